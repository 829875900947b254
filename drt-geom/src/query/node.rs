//! A node of the binary tree from which the wide one is made.

use super::frame::Box32;

/// A node, or the set of primitives that is to become one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Node {
    pub(super) bounds: Box32,
    /// Inner node: index of the first of its two children. Leaf: its primitive.
    pub(super) first: u32,
    /// Number of primitives, one; zero marks an inner node.
    pub(super) count: u32,
}
