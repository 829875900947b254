//! The children of a node of the wide tree, and how they are told apart.

/// Most children of a node.
pub(super) const WIDTH: usize = 8;

/// Marks a child that is a block of primitives.
pub(super) const LEAF: u32 = 1 << 31;

/// Stands where a node has no child.
pub(super) const NO_CHILD: u32 = u32::MAX;
