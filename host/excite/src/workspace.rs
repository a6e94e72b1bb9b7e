//! Planes that bound the positions of points of the links.

use rig_shared::multibody::JointKind;

use super::interval::Interval;
use rig_model::robot::{self, Robot};

/// A half-space in which a point of a link must stay.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Plane {
    /// The link that carries the point, from 0.
    pub link: usize,
    /// The point in its frame, m.
    pub point: [f64; 3],
    /// Unit normal towards the allowed side, in the base frame.
    pub normal: [f64; 3],
    /// Smallest allowed distance along the normal, m.
    pub least: f64,
    /// Upper bound of the distance between the point and the base frame's origin, m: the unit of violations.
    pub reach: f64,
    /// One for each axis up to the link.
    segments: Vec<Segment>,
}

/// An axis with the lengths of its link.
#[derive(Clone, Debug, PartialEq)]
struct Segment {
    kind: JointKind,
    /// Absolute values of a and d, m.
    across: f64,
    along: f64,
    /// The joint that it is or follows.
    joint: usize,
    /// Absolute values of its position per position of the joint, and at the joint's zero.
    ratio: f64,
    offset: f64,
}

impl Segment {
    /// Returns the axis of link `link`; `None` if it follows an unknown joint, which the loader refuses.
    fn of(robot: &Robot, link: usize) -> Option<Self> {
        let own = robot.link_as_joint(link)?;
        let follower = (link.checked_sub(robot.joints.len())).map(|k| &robot.followers[k]);
        Some(Self {
            kind: match own.kind {
                robot::JointKind::Revolute => JointKind::Revolute,
                robot::JointKind::Prismatic => JointKind::Prismatic,
            },
            across: own.a.abs(),
            along: own.d.abs(),
            joint: robot.joint_of_link(link)?,
            ratio: follower.map_or(1.0, |own| own.ratio.abs()),
            offset: follower.map_or(0.0, |own| own.offset.abs()),
        })
    }

    /// Returns the largest length for positions of the joint up to `position` from zero, m.
    fn length(&self, position: f64) -> f64 {
        match self.kind {
            JointKind::Revolute => self.across.hypot(self.along),
            JointKind::Prismatic => {
                (self.across).hypot(self.along + self.ratio * position + self.offset)
            }
        }
    }
}

impl Plane {
    /// Returns the distance along the normal.
    pub(super) fn height(&self, at: [f64; 3]) -> f64 {
        self.normal.iter().zip(at).map(|(n, x)| n * x).sum()
    }

    /// Returns an upper bound of the point's acceleration, m/s², for velocities and accelerations (`state[j][1]`,
    /// `state[j][2]`) and positions of prismatic joints (`state[j][0]`) within intervals.
    ///
    /// The point is the sum of the segments, each turning with its link: |r̈| ≤ |r|·(|ω̇| + |ω|²) + 2·|ω|·|ḋ| + |d̈|.
    /// |ω| is at most the sum of the preceding joints' speeds, |ω̇| at most the sum of their accelerations plus ½|ω|².
    pub(super) fn acceleration_bound(&self, state: &[[Interval; 3]]) -> f64 {
        let (mut turning, mut swinging, mut sum) = (0.0_f64, 0.0_f64, 0.0_f64);
        let around = |length: f64, w: f64, a: f64| length * (a + 1.5 * w * w);
        for segment in &self.segments {
            let [q, qd, qdd] = &state[segment.joint];
            let speed = segment.ratio * qd.magnitude();
            let change = segment.ratio * qdd.magnitude();
            sum += around(segment.length(q.magnitude()), turning, swinging);
            match segment.kind {
                JointKind::Revolute => {
                    turning += speed;
                    swinging += change;
                }
                JointKind::Prismatic => sum += 2.0 * turning * speed + change,
            }
        }
        let [x, y, z] = self.point;
        sum + around(x.hypot(y).hypot(z), turning, swinging)
    }
}

/// Returns the planes of all regions of a robot.
pub(super) fn planes_of(robot: &Robot) -> Vec<Plane> {
    let mut planes = Vec::new();
    for region in &robot.workspace {
        // The loader has rejected unknown names.
        let Some(link) = robot.joint_index(&region.joint) else {
            continue;
        };
        let order = robot.links_outwards();
        let before = order.iter().take_while(|own| **own != link).copied();
        let segments: Vec<Segment> = (before.chain([link]))
            .filter_map(|link| Segment::of(robot, link))
            .collect();
        let [x, y, z] = region.point;
        let travel = |j: usize| {
            let limits = robot.joints[j].limits.as_ref();
            limits.map_or(0.0, |l| l.position[0].abs().max(l.position[1].abs()))
        };
        let reach = x.hypot(y).hypot(z)
            + segments
                .iter()
                .map(|own| own.length(travel(own.joint)))
                .sum::<f64>();
        let mut add = |normal: [f64; 3], least: f64| {
            if least.is_finite() {
                planes.push(Plane {
                    link,
                    point: region.point,
                    normal,
                    least,
                    reach: reach.max(1e-3),
                    segments: segments.clone(),
                });
            }
        };
        for axis in 0..3 {
            let mut unit = [0.0; 3];
            unit[axis] = 1.0;
            if let Some(min) = region.min {
                add(unit, min[axis]);
            }
            if let Some(max) = region.max {
                add(unit.map(|v| -v), -max[axis]);
            }
        }
        if let (Some(normal), Some(beyond)) = (region.normal, region.beyond) {
            let length = normal.iter().map(|v| v * v).sum::<f64>().sqrt();
            add(normal.map(|v| v / length), beyond);
        }
    }
    planes
}
