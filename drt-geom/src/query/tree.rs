//! The tree behind the queries, whichever is built in.

use alloc::vec::Vec;
use core::ops::ControlFlow;

use super::compact::CompactTree;
use super::frame::{Box32, BoxRay};

#[derive(Clone, Debug)]
pub(super) enum Tree {
    Compact(CompactTree),
}

impl Tree {
    /// The tree over some boxes (at least one) and their numbers in the tree's order.
    pub(super) fn build(boxes: &[Box32]) -> (Self, Vec<u32>) {
        let (tree, order) = CompactTree::build(boxes);
        (Self::Compact(tree), order)
    }

    /// New boxes for the same tree, by primitive in the tree's order.
    pub(super) fn refit(&mut self, primitive: impl Fn(usize) -> Box32) {
        match self {
            Self::Compact(tree) => tree.refit(primitive),
        }
    }

    /// See [`CompactTree::visit`].
    #[inline]
    pub(super) fn visit(&self, ray: &BoxRay, leaf: impl FnMut(usize) -> ControlFlow<(), f32>) {
        match self {
            Self::Compact(tree) => tree.visit(ray, leaf),
        }
    }

    /// See [`CompactTree::visit_near`].
    pub(super) fn visit_near(&self, p: [f64; 3], leaf: impl FnMut(usize) -> f64) {
        match self {
            Self::Compact(tree) => tree.visit_near(p, leaf),
        }
    }
}
