use core::f64::consts::TAU;

use drt_math::{Frame, Rng, Vec3, fm};

use super::mesh;
use super::tube::{Tube, transport};
use crate::Mesh;

/// Rings along a branch, from base to tip.
const RINGS: u32 = 5;
/// Angles between a branch and its children, in radians.
const SPREAD: [f64; 2] = [0.4, 0.9];
/// Child's length over its parent's.
const SHRINK: [f64; 2] = [0.6, 0.8];
/// Radius at a branch's end over that at its base.
const TAPER: f64 = 0.65;
/// Largest sideways step of a branch between rings, over the step along it.
const WOBBLE: f64 = 0.15;

/// The shape of a [`branching_tree`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct BranchingTree {
    /// Chooses angles, lengths and wobble; the same seed gives the same tree.
    pub seed: u64,
    /// Generations after the trunk.
    pub levels: u32,
    /// Branches that leave each branch.
    pub children: u32,
    /// Length of the trunk.
    pub length: f64,
    /// Radius of the trunk at the ground.
    pub radius: f64,
    /// Vertices per ring.
    pub sides: u32,
}

impl Default for BranchingTree {
    fn default() -> Self {
        Self { seed: 0, levels: 3, children: 3, length: 1.0, radius: 0.08, sides: 8 }
    }
}

/// A tree growing from the origin along +z: one closed tapering tube per branch, each starting
/// inside its parent.
#[must_use]
pub fn branching_tree(shape: &BranchingTree) -> Mesh {
    let mut tube = Tube::default();
    let mut rng = Rng::new(shape.seed, 0, 0);
    let trunk = Branch {
        base: Vec3::ZERO,
        axis: Vec3::Z,
        length: shape.length,
        radius: shape.radius,
        level: 0,
    };
    let mut growing = alloc::vec![trunk];
    while let Some(branch) = growing.pop() {
        let (end, axis) = branch.grow(&mut tube, &mut rng, shape.sides.max(3));
        if branch.level == shape.levels {
            continue;
        }
        let around = Frame::from_normal(axis);
        let first = TAU * rng.next_f64();
        for child in 0..shape.children {
            let turn = first + TAU * f64::from(child) / f64::from(shape.children);
            let (s, c) = fm::sin_cos(turn);
            let (side, along) = fm::sin_cos(between(SPREAD, &mut rng));
            growing.push(Branch {
                base: end,
                axis: (axis * along + (around.s * c + around.t * s) * side).normalize(),
                length: branch.length * between(SHRINK, &mut rng),
                radius: branch.radius * TAPER,
                level: branch.level + 1,
            });
        }
    }
    mesh(tube.positions, tube.triangles)
}

struct Branch {
    base: Vec3,
    axis: Vec3,
    length: f64,
    radius: f64,
    level: u32,
}

impl Branch {
    /// Adds the branch's surface; returns where its children start, and its direction there.
    fn grow(&self, tube: &mut Tube, rng: &mut Rng, sides: u32) -> (Vec3, Vec3) {
        let step = self.length / f64::from(RINGS - 1);
        let mut frame = Frame::from_normal(self.axis);
        let mut at = self.base;
        let mut last = 0;
        for i in 0..RINGS {
            let radius = self.radius * (1.0 + (TAPER - 1.0) * f64::from(i) / f64::from(RINGS - 1));
            if i > 0 {
                let sideways = frame.s * between([-WOBBLE, WOBBLE], rng)
                    + frame.t * between([-WOBBLE, WOBBLE], rng);
                let axis = (frame.n + sideways).normalize();
                at += axis * step;
                frame = transport(&frame, axis);
            }
            let ring = tube.ring(at, &frame, radius, sides);
            if i == 0 {
                tube.cap(ring, sides, at - frame.n * radius, false);
            } else {
                tube.join(last, ring, sides, 0);
            }
            last = ring;
        }
        tube.cap(last, sides, at + frame.n * (self.radius * TAPER), true);
        (at, frame.n)
    }
}

fn between([low, high]: [f64; 2], rng: &mut Rng) -> f64 {
    low + (high - low) * rng.next_f64()
}
