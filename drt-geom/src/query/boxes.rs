//! What may lie at a place: a tree over the boxes of anything that has corners.

use alloc::vec::Vec;
use core::ops::{ControlFlow, Range};

use drt_math::Vec3;

use super::Walk;
use super::binary::BvhBuilder;
use super::children::WIDTH;
use super::collapse::collapse;
use super::frame::{Box32, BoxFrame};
use super::lanes::{Lanes, Machine, Vector};
use super::wide::{Query, Visitor, WideNode, WideTree};
use crate::Aabb;

/// Boxes in a leaf of the tree.
const BLOCK: usize = 4;

/// The tree, over things in an order of its own in which neighbours are near each other.
#[derive(Clone, Debug)]
pub(crate) struct BoxTree {
    tree: Option<WideTree>,
    frame: BoxFrame,
    blocks: Vec<Range<u32>>,
    machine: Machine,
}

/// A box in the tree's coordinates, rounded outward as those of the tree are, so that what touches it before rounding does
/// after it.
#[derive(Clone, Copy)]
struct Window {
    min: [f32; 3],
    max: [f32; 3],
}

impl BoxTree {
    /// The tree over as many things, each within the box of the corners it is given by and all
    /// within finite bounds; and their numbers in the tree's order.
    pub(crate) fn build<const N: usize>(
        bounds: &Aabb,
        count: u32,
        corners: impl Fn(u32) -> [Vec3; N],
    ) -> (Self, Vec<u32>) {
        let places = (0..count).map(|i| corners(i).first().copied().unwrap_or(Vec3::ZERO));
        let frame = BoxFrame::new(bounds, places);
        let enclose = |i: u32| {
            let around = Aabb::around(corners(i));
            frame.enclose(&[around.min, around.max, around.max])
        };
        let boxes: Vec<Box32> = (0..count).map(enclose).collect();
        let mut built = Self { tree: None, frame, blocks: Vec::new(), machine: Machine::detect() };
        if boxes.is_empty() {
            return (built, Vec::new());
        }
        let collapsed = collapse(&boxes, BLOCK, BvhBuilder::Binned);
        built.tree = Some(WideTree::new(&collapsed, |b| {
            let Range { start, end } = collapsed.blocks[b];
            let members = &collapsed.order[start as usize..end as usize];
            Box32::around(members.iter().map(|&i| boxes[i as usize]))
        }));
        built.blocks = collapsed.blocks;
        (built, collapsed.order)
    }

    /// Calls `visit` with places in the tree's order that have among them everything whose box meets
    /// the given one, and some that lie near it, until it breaks off.
    #[inline]
    pub(crate) fn near(&self, window: &Aabb, visit: impl FnMut(Range<usize>) -> ControlFlow<()>) {
        let Some(tree) = &self.tree else { return };
        let Box32 { min, max } = self.frame.enclose(&[window.min, window.max, window.max]);
        let query = Window { min, max };
        self.machine.run(Walk { tree, query, visitor: Members { blocks: &self.blocks, visit } });
    }
}

struct Members<'a, F> {
    blocks: &'a [Range<u32>],
    visit: F,
}

impl<F: FnMut(Range<usize>) -> ControlFlow<()>> Visitor for Members<'_, F> {
    #[inline(always)]
    fn announce<L: Lanes>(&self, lanes: L, index: usize) {
        lanes.prefetch(&self.blocks[index]);
    }
    #[inline(always)]
    fn block<L: Lanes>(&mut self, _: L, index: usize) -> ControlFlow<(), f32> {
        let Range { start, end } = self.blocks[index];
        (self.visit)(start as usize..end as usize)?;
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
