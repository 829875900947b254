//! What may lie at a place: a tree over the boxes of anything that has corners.

use alloc::vec::Vec;
use core::ops::ControlFlow;

use drt_math::Vec3;

use super::Walk;
use super::collapse::collapse;
use super::frame::{Box32, BoxFrame};
use super::lanes::{Lanes, Machine, Vector};
use super::wide::{Query, Visitor, WIDTH, WideNode, WideTree};
use crate::{Aabb, NONE};

/// Boxes in a leaf of the tree.
const BLOCK: usize = 4;

/// The tree, over things that are named by their numbers.
#[derive(Clone, Debug)]
pub(crate) struct BoxTree {
    tree: Option<WideTree>,
    frame: BoxFrame,
    blocks: Vec<[u32; BLOCK]>,
    machine: Machine,
}

/// A box in the tree's coordinates. What touches it before rounding does after it: the boxes of the
/// tree are padded by more than it moves.
#[derive(Clone, Copy)]
struct Window {
    min: [f32; 3],
    max: [f32; 3],
}

impl BoxTree {
    /// The tree over as many things, each within the box of the corners it is given by, and all
    /// within finite bounds.
    pub(crate) fn build<const N: usize>(
        bounds: &Aabb,
        count: u32,
        corners: impl Fn(u32) -> [Vec3; N],
    ) -> Self {
        let frame = BoxFrame::new(bounds);
        let enclose = |i: u32| {
            let around = Aabb::around(corners(i));
            frame.enclose(&[around.min, around.max, around.max])
        };
        let boxes: Vec<Box32> = (0..count).map(enclose).collect();
        if boxes.is_empty() {
            return Self { tree: None, frame, blocks: Vec::new(), machine: Machine::detect() };
        }
        let collapsed = collapse(&boxes, BLOCK);
        let members = |b: usize| {
            let range = &collapsed.blocks[b];
            &collapsed.order[range.start as usize..range.end as usize]
        };
        let block = |b: usize| {
            let mut block = [NONE; BLOCK];
            block[..members(b).len()].copy_from_slice(members(b));
            block
        };
        let blocks = (0..collapsed.blocks.len()).map(block).collect();
        let tree = WideTree::new(&collapsed, |b| {
            Box32::around(members(b).iter().map(|&i| boxes[i as usize]))
        });
        Self { tree: Some(tree), frame, blocks, machine: Machine::detect() }
    }

    /// Calls `visit` with everything whose box meets the given one, and with some that lie near it,
    /// in no particular order, until it breaks off.
    #[inline]
    pub(crate) fn near(&self, window: &Aabb, visit: impl FnMut(u32) -> ControlFlow<()>) {
        let Some(tree) = &self.tree else { return };
        let local = |v| self.frame.local(v).map(|c| c as f32);
        let query = Window { min: local(window.min), max: local(window.max) };
        self.machine.run(Walk { tree, query, visitor: Members { blocks: &self.blocks, visit } });
    }
}

struct Members<'a, F> {
    blocks: &'a [[u32; BLOCK]],
    visit: F,
}

impl<F: FnMut(u32) -> ControlFlow<()>> Visitor for Members<'_, F> {
    #[inline(always)]
    fn announce<L: Lanes>(&self, lanes: L, index: usize) {
        lanes.prefetch(&self.blocks[index]);
    }
    #[inline(always)]
    fn block<L: Lanes>(&mut self, _: L, index: usize) -> ControlFlow<(), f32> {
        for &member in self.blocks[index].iter().take_while(|m| **m != NONE) {
            (self.visit)(member)?;
        }
        ControlFlow::Continue(0.0)
    }
}

impl Query for Window {
    #[inline(always)]
    fn enter<L: Lanes>(self, lanes: L, node: &WideNode, far: f32) -> (u32, [f32; WIDTH]) {
        let mut gap = lanes.single(f32::NEG_INFINITY);
        for k in 0..3 {
            let [low, high] = node.bounds(lanes, k);
            gap = gap.max(low - lanes.single(self.max[k])).max(lanes.single(self.min[k]) - high);
        }
        (gap.le(lanes.single(far)), [0.0; WIDTH])
    }
    fn far(self) -> f32 {
        0.0
    }
}
