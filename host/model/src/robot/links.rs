//! The links of a robot: those of its joints, and those of axes that follow a joint.
//!
//! A link has a number: joints come first, in their order, then followers in theirs. Rows of standard parameters and
//! regressor columns have this order. In the chain followers stand between the joints.

use nalgebra::Isometry3;
use rig_shared::multibody::{self, Chain, ChainError};
use rig_shared::scalar::Real;

use super::error::RobotError;
use super::fault::Step;
use super::follower::Follower;
use super::joint::{Inertial, Joint, JointKind};
use super::numbers::geometry_of;
use super::serial_robot::Robot;

impl Robot {
    /// Returns true if the drive of some joint turns further axes.
    pub fn has_followers(&self) -> bool {
        !self.followers.is_empty()
    }

    /// Returns the number of links, which is that of the joints and the followers.
    pub fn link_count(&self) -> usize {
        self.joints.len() + self.followers.len()
    }

    /// Returns the number of the joint that follower `follower` stands before; that of joints if it is beyond all.
    fn place(&self, follower: &Follower) -> usize {
        let before = |name: &String| self.joint_index(name).map(|joint| joint + 1);
        follower
            .after
            .as_ref()
            .map_or(0, |name| before(name).unwrap_or(self.joints.len()))
    }

    /// Returns the links from the base outwards.
    pub fn links_outwards(&self) -> Vec<usize> {
        let n = self.joints.len();
        let mut order = Vec::with_capacity(self.link_count());
        for joint in 0..=n {
            let here = |own: &(usize, &Follower)| self.place(own.1) == joint;
            let followers = self.followers.iter().enumerate().filter(here);
            order.extend(followers.map(|(k, _)| n + k));
            order.extend((joint < n).then_some(joint));
        }
        order
    }

    /// Returns the link beyond all axes, in whose frame the flange is described.
    pub fn last_link(&self) -> usize {
        self.links_outwards().last().copied().unwrap_or(0)
    }

    /// Returns the name of the joint or follower that moves link `link`; empty past the end.
    pub fn link_name(&self, link: usize) -> &str {
        let n = self.joints.len();
        let joint = self.joints.get(link).map(|own| own.name.as_str());
        let follower = || {
            self.followers
                .get(link.checked_sub(n)?)
                .map(|own| own.name.as_str())
        };
        joint.or_else(follower).unwrap_or_default()
    }

    /// Returns how each link moves.
    pub fn link_kinds(&self) -> Vec<JointKind> {
        let joints = self.joints.iter().map(|own| own.kind);
        joints
            .chain(self.followers.iter().map(|own| own.kind))
            .collect()
    }

    /// Returns the inertial parameters of link `link`, if they are stated.
    pub fn link_inertial(&self, link: usize) -> Option<&Inertial> {
        match link.checked_sub(self.joints.len()) {
            None => self.joints[link].inertial.as_ref(),
            Some(k) => self.followers.get(k)?.inertial.as_ref(),
        }
    }

    /// Returns the place of the inertial parameters of link `link`; `None` past the end.
    pub fn link_inertial_mut(&mut self, link: usize) -> Option<&mut Option<Inertial>> {
        match link.checked_sub(self.joints.len()) {
            None => Some(&mut self.joints[link].inertial),
            Some(k) => Some(&mut self.followers.get_mut(k)?.inertial),
        }
    }

    /// Returns the joint that moves link `link`: its own, or the one that is followed.
    pub fn joint_of_link(&self, link: usize) -> Option<usize> {
        match link.checked_sub(self.joints.len()) {
            None => Some(link),
            Some(k) => self.joint_index(&self.followers.get(k)?.follows),
        }
    }

    /// Returns the joint that moves link `link`, and the ratio and offset of its axis; 1 and 0 for a joint's own.
    pub fn link_motion(&self, link: usize) -> Option<(usize, f64, f64)> {
        let joint = self.joint_of_link(link)?;
        Some(match link.checked_sub(self.joints.len()) {
            None => (joint, 1.0, 0.0),
            Some(k) => (joint, self.followers[k].ratio, self.followers[k].offset),
        })
    }

    /// Returns link `link` as the link of a joint of its own; `None` past the end.
    pub fn link_as_joint(&self, link: usize) -> Option<Joint> {
        match link.checked_sub(self.joints.len()) {
            None => self.joints.get(link).cloned(),
            Some(k) => self.followers.get(k).map(Follower::as_joint),
        }
    }

    /// Returns the axes from the base outwards, each as a joint of its own.
    pub fn axes(&self) -> Vec<Joint> {
        let links = self.links_outwards();
        (links.into_iter())
            .filter_map(|link| self.link_as_joint(link))
            .collect()
    }

    /// Returns the pose of the last axis' frame in the base frame at joint positions `q`, rad or m.
    pub fn last_pose(&self, q: &[f64]) -> Isometry3<f64> {
        let links = self.links_outwards();
        links.into_iter().fold(Isometry3::identity(), |at, link| {
            let motion = self.link_motion(link).zip(self.link_as_joint(link));
            motion.map_or(at, |((joint, ratio, offset), own)| {
                at * own.pose(ratio * q[joint] + offset)
            })
        })
    }

    /// Returns the path to the table of a link in a description.
    pub(super) fn link_key(&self, link: usize) -> [Step; 2] {
        match link.checked_sub(self.joints.len()) {
            None => [Step::Key("joint"), Step::At(link)],
            Some(k) => [Step::Key("follower"), Step::At(k)],
        }
    }

    /// Builds the chain: geometry of joints and followers, and gravity.
    ///
    /// # Errors
    /// [`ChainError`] for numbers that are not finite, too many axes, or a follower of an unknown joint; a description that
    /// was read has none.
    pub fn chain<T: Real>(&self) -> Result<Chain<T>, ChainError> {
        Chain::with_followers(&self.geometry(), &self.follower_axes(), self.gravity)
    }

    /// Returns the axes that follow, for [`Chain::with_followers`].
    pub fn follower_axes(&self) -> Vec<multibody::Follower> {
        (self.followers.iter())
            .map(|own| multibody::Follower {
                geometry: geometry_of(&own.as_joint()),
                before: self.place(own),
                master: self.joint_index(&own.follows).unwrap_or(usize::MAX),
                ratio: own.ratio,
                offset: own.offset,
            })
            .collect()
    }

    /// Refuses a robot with followers. `what`: the work that does not cover them, as the subject of a sentence.
    ///
    /// # Errors
    /// [`RobotError::Followers`] with the first follower, its joint and the work.
    pub fn without_followers(&self, what: &str) -> Result<(), RobotError> {
        match self.followers.first() {
            None => Ok(()),
            Some(own) => Err(RobotError::Followers {
                what: what.to_owned(),
                follower: own.name.clone(),
                joint: own.follows.clone(),
            }),
        }
    }
}
