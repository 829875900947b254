//! The tree behind the queries: obvhs's where that is built in and fit, else our own.

use alloc::vec::Vec;
use core::ops::ControlFlow;

use super::compact::CompactTree;
use super::frame::{Box32, BoxRay};
#[cfg(feature = "obvhs")]
use super::wide::WideTree;

/// Most primitives in a leaf of the compact tree.
const COMPACT_LEAF: usize = 4;

#[derive(Clone, Debug)]
pub(super) enum Tree {
    Compact(CompactTree),
    #[cfg(feature = "obvhs")]
    Wide(WideTree),
}

impl Tree {
    /// The tree over some boxes (at least one) and their numbers in the tree's order.
    pub(super) fn build(boxes: &[Box32]) -> (Self, Vec<u32>) {
        #[cfg(feature = "obvhs")]
        if let Some((tree, order)) = WideTree::build(boxes) {
            return (Self::Wide(tree), order);
        }
        Self::build_compact(boxes)
    }

    /// The compact tree, whatever is built in.
    pub(super) fn build_compact(boxes: &[Box32]) -> (Self, Vec<u32>) {
        let (tree, order) = CompactTree::build(boxes, COMPACT_LEAF);
        (Self::Compact(tree), order)
    }

    /// See [`CompactTree::visit`].
    #[inline]
    pub(super) fn visit(&self, ray: &BoxRay, leaf: impl FnMut(usize) -> ControlFlow<(), f32>) {
        match self {
            Self::Compact(tree) => tree.visit(ray, leaf),
            #[cfg(feature = "obvhs")]
            Self::Wide(tree) => tree.visit(ray, leaf),
        }
    }

    /// See [`CompactTree::visit_near`].
    pub(super) fn visit_near(&self, p: [f64; 3], leaf: impl FnMut(usize) -> f64) {
        match self {
            Self::Compact(tree) => tree.visit_near(p, leaf),
            #[cfg(feature = "obvhs")]
            Self::Wide(tree) => tree.visit_near(p, leaf),
        }
    }
}
