//! Selects the chain of joints that is the robot.

use std::collections::{HashMap, HashSet};

use super::choice::ChainChoice;
use super::locks::{Locks, few};
use super::names::nearest_long;
use super::reader::Reader;
use super::tree::{Motion, Tree, TreeJoint};
use crate::robot::error::RobotError;

/// The chain within the tree.
pub(super) struct Selection<'a> {
    /// The root of the tree, in whose frame gravity points along −z.
    pub root: &'a str,
    /// Link that the chain begins at.
    pub base: &'a str,
    /// Link that the chain ends at.
    pub tip: &'a str,
    /// Axes of the chain, from the base outwards: joints, and those that follow one of them.
    pub active: Vec<usize>,
    /// How axes follow.
    pub followers: HashMap<usize, Gear>,
    /// Joints that the user holds.
    pub locks: Locks,
}

/// The axis moves as multiplier · q + offset of a joint of the chain that follows no other.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gear {
    pub master: usize,
    pub multiplier: f64,
    pub offset: f64,
}

/// What hangs on a link.
#[derive(Clone, Copy, Default)]
struct Branch {
    /// Largest number of movable joints on one path.
    deepest: usize,
    /// Movable joints that mimic no other.
    independent: usize,
    /// Joints that mimic another.
    mimics: usize,
}

/// A link at which no branch is clearly the arm.
struct Ambiguous<'a> {
    link: &'a str,
    /// Joints of the branches, the deepest first.
    joints: Vec<usize>,
    /// Movable joints before it.
    before: usize,
}

/// The tree with the joints that the user holds taken as fixed.
struct Search<'s, 'a> {
    tree: &'s Tree<'a>,
    /// Joints that the user holds, and those that mimic them.
    held: HashSet<usize>,
    branches: HashMap<&'a str, Branch>,
}

impl<'s, 'a> Search<'s, 'a> {
    fn new(tree: &'s Tree<'a>, locks: &'s Locks) -> Self {
        let mut search = Self {
            tree,
            held: held_with_followers(tree, locks),
            branches: HashMap::new(),
        };
        for link in tree.outwards().into_iter().rev() {
            let mut own = Branch::default();
            for joint in tree.below(link) {
                let branch = search.branch(joint);
                own.deepest = own.deepest.max(branch.deepest);
                own.independent += branch.independent;
                own.mimics += branch.mimics;
            }
            search.branches.insert(link, own);
        }
        search
    }

    fn is_movable(&self, joint: usize) -> bool {
        self.tree.joints[joint].motion.is_single() && !self.held.contains(&joint)
    }

    /// Returns true if a joint mimics another, or another mimics it.
    fn is_geared(&self, joint: usize) -> bool {
        let own = &self.tree.joints[joint];
        let follows = |other: &TreeJoint<'_>| {
            (other.mimic.as_ref()).is_some_and(|mimic| mimic.master == own.name)
        };
        own.mimic.is_some() || self.tree.joints.iter().any(follows)
    }

    /// Returns what a joint moves, itself included.
    fn branch(&self, joint: usize) -> Branch {
        let own = &self.tree.joints[joint];
        let beyond = self.branches.get(own.child).copied().unwrap_or_default();
        if !self.is_movable(joint) {
            return beyond;
        }
        let mimics = usize::from(own.mimic.is_some());
        Branch {
            deepest: beyond.deepest + 1,
            independent: beyond.independent + 1 - mimics,
            mimics: beyond.mimics + mimics,
        }
    }

    /// Returns the joints with one coordinate or more that leave `link` or what is fixed to it, and that move something.
    fn outgoing(&self, link: &'a str) -> Vec<usize> {
        let mut found = Vec::new();
        let mut pending = vec![link];
        while let Some(link) = pending.pop() {
            for joint in self.tree.below(link) {
                let own = &self.tree.joints[joint];
                let several = matches!(own.motion, Motion::Floating | Motion::Planar);
                if self.is_movable(joint) || several && self.branch(joint).deepest > 0 {
                    found.push(joint);
                } else {
                    pending.push(own.child);
                }
            }
        }
        found.sort_by_key(|joint| (usize::MAX - self.branch(*joint).deepest, *joint));
        found
    }

    /// Follows the only joint, or the one that clearly belongs to the arm, from `link` on. `before`: movable joints
    /// before that link. Returns the last link.
    fn follow(&self, link: &'a str, before: usize) -> Result<&'a str, Ambiguous<'a>> {
        let (mut link, mut before) = (link, before);
        loop {
            let outgoing = self.outgoing(link);
            let branches: Vec<Branch> = outgoing.iter().map(|j| self.branch(*j)).collect();
            let Some((first, others)) = branches.split_first() else {
                return Ok(link);
            };
            // A joint alone that is in no gear is one of the arm, whatever follows it.
            let is_of_arm = matches!(outgoing[..], [only] if !self.is_geared(only));
            if !is_of_arm && is_gripper(&branches, before) {
                return Ok(link);
            }
            let second = others.first().map_or(0, |branch| branch.deepest);
            // The arm is more than twice as long as what branches off.
            if !others.is_empty() && first.deepest <= 2 * second {
                return Err(Ambiguous {
                    link,
                    joints: outgoing,
                    before,
                });
            }
            let joint = outgoing[0];
            before += usize::from(self.is_movable(joint));
            link = self.tree.joints[joint].child;
        }
    }

    /// Returns the option that ends the chain at `tip`, with the number of its joints.
    fn option(&self, tip: &str) -> String {
        let path = self.tree.path_to(tip);
        match path.iter().filter(|joint| self.is_movable(**joint)).count() {
            1 => format!("--tip {tip} (1 joint)"),
            n => format!("--tip {tip} ({n} joints)"),
        }
    }
}

/// Returns the joints that the user holds and all that follow them.
fn held_with_followers(tree: &Tree<'_>, locks: &Locks) -> HashSet<usize> {
    let mut held: HashSet<usize> = locks.keys().copied().collect();
    loop {
        let names: HashSet<&str> = held.iter().map(|joint| tree.joints[*joint].name).collect();
        let follows = |(index, joint): &(usize, &TreeJoint<'_>)| {
            let master = joint.mimic.as_ref().map(|mimic| mimic.master);
            !held.contains(index) && master.is_some_and(|master| names.contains(master))
        };
        let found: Vec<usize> = (tree.joints.iter().enumerate().filter(follows))
            .map(|(index, _)| index)
            .collect();
        if found.is_empty() {
            return held;
        }
        held.extend(found);
    }
}

/// Returns true if `branches` (the deepest first) are the fingers of a gripper behind `before` movable joints: one drive
/// moves several joints; half of the joints or more follow others, whose number is at most half that of the arm; or
/// several equally long branches have at most half as many joints as the arm before them.
fn is_gripper(branches: &[Branch], before: usize) -> bool {
    let independent: usize = branches.iter().map(|branch| branch.independent).sum();
    let mimics: usize = branches.iter().map(|branch| branch.mimics).sum();
    // One path without branches: what follows there is a gear of the arm.
    let is_path = |branch: &Branch| branch.deepest == branch.independent + branch.mimics;
    if let [only] = branches
        && is_path(only)
    {
        return false;
    }
    let few = independent <= 1 || mimics >= independent && 2 * independent <= before + 1;
    if before > 0 && mimics > 0 && few {
        return true;
    }
    let [first, second, others @ ..] = branches else {
        return false;
    };
    let alike = first.deepest == second.deepest
        || !others.is_empty() && 2 * second.deepest >= first.deepest;
    alike && 2 * first.deepest <= before + 1
}

impl<'a> Reader<'a> {
    /// Selects the chain that `choice` asks for, or the one that is clearly the arm.
    ///
    /// # Errors
    /// A name is wrong, the links do not lie on one path, several chains may be the robot, or it cannot be read.
    pub(super) fn selection(
        &self,
        tree: &Tree<'a>,
        choice: &ChainChoice,
    ) -> Result<Selection<'a>, RobotError> {
        let locks = self.locks(tree, choice)?;
        let named = |option: &str, name: &Option<String>| match name {
            None => Ok(None),
            Some(name) => self.chosen(tree, option, name).map(Some),
        };
        let (base, tip) = (named("base", &choice.base)?, named("tip", &choice.tip)?);
        let start = match (base, tip) {
            (Some(base), _) => base,
            (None, Some(tip)) => match tree.path_to(tip).first() {
                Some(joint) => tree.joints[*joint].parent,
                None => tip,
            },
            (None, None) => self.only_root(tree)?,
        };
        let tip = match tip {
            Some(tip) => tip,
            None => {
                let search = Search::new(tree, &locks);
                (search.follow(start, 0)).map_err(|found| self.ambiguous(&search, &found))?
            }
        };
        self.between(tree, locks, base, [start, tip])
    }

    /// Returns the link that option `--option` names.
    fn chosen(&self, tree: &Tree<'a>, option: &str, name: &str) -> Result<&'a str, RobotError> {
        if let Some((own, _)) = tree.links.iter().find(|(own, _)| *own == name) {
            return Ok(own);
        }
        let names: Vec<&str> = tree.links.iter().map(|(name, _)| *name).collect();
        let meant = match nearest_long(name, names.iter().copied()) {
            _ if tree.joint(name).is_some() => {
                let joint = tree
                    .joint(name)
                    .map_or("", |index| tree.joints[index].child);
                format!("this is a joint, and the link that it moves is `{joint}`")
            }
            Some(near) => format!("is `{near}` meant?"),
            None => format!("its links are {}", few(&names)),
        };
        Err(self.choice_error(format!(
            "the file has no link `{name}`, which --{option} names; {meant}"
        )))
    }

    fn only_root(&self, tree: &Tree<'a>) -> Result<&'a str, RobotError> {
        match tree.roots().as_slice() {
            [] => Err(self.error(self.document.root_element(), "the robot has no link; it needs a base link and one for each joint to move".into())),
            [(name, _)] => Ok(name),
            [(first, _), (second, node), ..] => Err(self.error(*node, format!("links `{first}` and `{second}` are both no joint's child; connect them by a fixed joint so that there is one base, or choose one with --base"))),
        }
    }

    /// Selects the movable joints between two links. `base`: the link that the user chose.
    fn between(
        &self,
        tree: &Tree<'a>,
        locks: Locks,
        base: Option<&'a str>,
        [start, tip]: [&'a str; 2],
    ) -> Result<Selection<'a>, RobotError> {
        let path = tree.path_to(tip);
        let root = path.first().map_or(tip, |joint| tree.joints[*joint].parent);
        let above = tree.path_to(start);
        if !path.starts_with(&above)
            || root != above.first().map_or(start, |j| tree.joints[*j].parent)
        {
            let links = path.iter().map(|joint| tree.joints[*joint].parent);
            let links: Vec<&str> = links.collect();
            return Err(self.choice_error(format!(
                "link `{start}`, which --base names, does not carry link `{tip}`, which --tip names; give a base that does: {}",
                few(&links)
            )));
        }
        let mut rest = &path[above.len()..];
        let mut start = start;
        let is_movable =
            |joint: &usize| tree.joints[*joint].motion.is_single() && !locks.contains_key(joint);
        // A robot that floats in the world has its base behind this joint.
        let several = |joint: &usize| {
            matches!(
                tree.joints[*joint].motion,
                Motion::Floating | Motion::Planar
            )
        };
        if let (None, Some(last)) = (base, rest.iter().rposition(several))
            && !rest[..last].iter().any(is_movable)
        {
            start = tree.joints[rest[last]].child;
            rest = &rest[last + 1..];
        }
        if let Some(joint) = rest.iter().find(|joint| several(joint)) {
            let joint = &tree.joints[*joint];
            let kind = joint.node.attribute("type").unwrap_or_default();
            return Err(self.error(joint.node, format!("joint `{}` is of type \"{kind}\", but only revolute, continuous, prismatic and fixed joints can be read; begin the chain behind it with --base {}, or end it before it with --tip {}", joint.name, joint.child, joint.parent)));
        }
        let moving: Vec<usize> = rest
            .iter()
            .copied()
            .filter(|joint| is_movable(joint))
            .collect();
        let (active, followers) = self.moved(tree, &locks, &moving)?;
        if active.is_empty() {
            let between = format!("between link `{start}` and link `{tip}`");
            return Err(self.error(self.document.root_element(), format!("the robot has no movable joint {between}; it needs at least one revolute, continuous or prismatic joint")));
        }
        Ok(Selection {
            root,
            base: start,
            tip,
            active,
            followers,
            locks,
        })
    }

    /// Returns the axes of a path without those that follow a joint beside it, which is held, and how the others follow.
    ///
    /// # Errors
    /// A joint mimics one that does not exist, itself, or with a multiplier of 0.
    fn moved(
        &self,
        tree: &Tree<'a>,
        locks: &Locks,
        moving: &[usize],
    ) -> Result<(Vec<usize>, HashMap<usize, Gear>), RobotError> {
        let (mut active, mut followers) = (Vec::new(), HashMap::new());
        for &index in moving {
            if tree.joints[index].mimic.is_none() {
                active.push(index);
                continue;
            }
            let gear = self.gear(tree, locks, index)?;
            // Its master is held, so it is too.
            if !moving.contains(&gear.master) {
                continue;
            }
            if gear.multiplier == 0.0 {
                let joint = &tree.joints[index];
                return Err(self.error(joint.node, format!("joint `{}` mimics joint `{}` with a multiplier of 0, so it never moves; make it a fixed joint", joint.name, tree.joints[gear.master].name)));
            }
            active.push(index);
            followers.insert(index, gear);
        }
        Ok((active, followers))
    }

    /// Returns how a joint moves with the joint that it mimics in the end. A joint that the user holds is one.
    fn gear(&self, tree: &Tree<'a>, locks: &Locks, index: usize) -> Result<Gear, RobotError> {
        let mut gear = Gear {
            master: index,
            multiplier: 1.0,
            offset: 0.0,
        };
        for _ in 0..=tree.joints.len() {
            let joint = &tree.joints[gear.master];
            let Some(mimic) = joint
                .mimic
                .as_ref()
                .filter(|_| !locks.contains_key(&gear.master))
            else {
                return Ok(gear);
            };
            gear.offset += gear.multiplier * mimic.offset;
            gear.multiplier *= mimic.multiplier;
            gear.master = self.master(tree, mimic.node, joint.name, mimic.master)?;
        }
        Err(self.mimics_itself(&tree.joints[index]))
    }

    /// Returns the refusal of a tree with several arms, with the tips that can be chosen.
    fn ambiguous(&self, search: &Search<'_, 'a>, found: &Ambiguous<'a>) -> RobotError {
        const MOST: usize = 8;
        let joints = &search.tree.joints;
        let names: Vec<&str> = found.joints.iter().map(|j| joints[*j].name).collect();
        let long = |found: &Ambiguous<'a>| {
            let deepest = found
                .joints
                .first()
                .map_or(0, |j| search.branch(*j).deepest);
            let mut long = found.joints.clone();
            long.retain(|joint| 2 * search.branch(*joint).deepest >= deepest);
            long.reverse();
            let before = found.before;
            long.into_iter().map(move |joint| (joint, before))
        };
        let mut tips: Vec<String> = Vec::new();
        let mut pending: Vec<(usize, usize)> = long(found).collect();
        while let Some((joint, before)) = pending.pop() {
            let before = before + usize::from(search.is_movable(joint));
            match search.follow(joints[joint].child, before) {
                Ok(tip) => tips.push(search.option(tip)),
                Err(further) => pending.extend(long(&further)),
            }
        }
        let more = match tips.len().saturating_sub(MOST) {
            0 => String::new(),
            n => format!(", or {n} more"),
        };
        tips.truncate(MOST);
        let node = search.tree.by_name.get(found.link);
        let node = node
            .copied()
            .unwrap_or_else(|| self.document.root_element());
        let end = match found.before {
            0 => String::new(),
            _ => format!("; or {} to hold the branches", search.option(found.link)),
        };
        self.error(node, format!(
            "the robot branches at link `{}`, where joints {} leave, and no branch is clearly the arm; choose the last link of the chain: {}{more}{end}",
            found.link,
            few(&names),
            tips.join(", or "),
        ))
    }
}
