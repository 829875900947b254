//! Where things stand in a NanoVDB file and in a grid of it, in bytes.

/// First bytes of a file, of either kind that there is.
pub(super) const FILE_SIGNATURES: [[u8; 8]; 2] = [*b"NanoVDB0", *b"NanoVDB2"];
/// First bytes of a grid.
pub(super) const GRID_SIGNATURES: [[u8; 8]; 2] = [*b"NanoVDB0", *b"NanoVDB1"];
/// The major version that is read and written.
pub(super) const MAJOR: u32 = 32;
/// Bits of the version below the major one.
pub(super) const MAJOR_SHIFT: u32 = 21;

/// The header of a segment, and what is told of each grid, before its name.
pub(super) const SEGMENT: usize = 16;
pub(super) const ABOUT_GRID: usize = 176;

/// Parts of a grid: its own numbers, and its tree's.
pub(super) const GRID: usize = 672;
pub(super) const TREE: usize = 64;
/// Parts of a grid's own numbers.
pub(super) const VERSION: usize = 16;
pub(super) const GRID_NAME: usize = 40;
pub(super) const LONGEST_NAME: usize = 255;
pub(super) const MAP: usize = 296;
/// The map in double precision, after that in single precision: a matrix by rows, its inverse, and a translation.
pub(super) const LINEAR: usize = MAP + 88;
pub(super) const INVERSE: usize = LINEAR + 72;
pub(super) const TRANSLATION: usize = INVERSE + 72;
pub(super) const CLASS: usize = 632;
pub(super) const KIND: usize = 636;

/// Sides of nodes in voxels, and the binary logarithms of their sides in what they consist of.
pub(super) const LEAF_SIDE: i64 = 8;
pub(super) const LOWER_SIDE: i64 = 128;
pub(super) const UPPER_SIDE: i64 = 4096;
pub(super) const LOWER_LOG: usize = 4;
pub(super) const UPPER_LOG: usize = 5;

/// Where the numbers of a root, the mask of values of an inner node and that of a leaf begin.
pub(super) const TABLE_SIZE: usize = 24;
pub(super) const BACKGROUND: usize = 28;
pub(super) const VALUE_MASK: usize = 32;
pub(super) const LEAF_MASK: usize = 16;

/// A tile of a root: its key, the place of its child, whether it is active, and its value.
pub(super) const TILE: usize = 32;
pub(super) const TILE_VALUE: usize = 20;

/// The kind of values of a grid, and what depends on their size.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Layout {
    pub(super) channels: usize,
    /// The number that stands for the kind.
    pub(super) kind: u32,
    pub(super) root: usize,
    /// An entry of an inner node's table.
    pub(super) entry: usize,
    /// Where the values of a leaf begin.
    pub(super) leaf_values: usize,
}

impl Layout {
    pub(super) const FLOAT: Self =
        Self { channels: 1, kind: 1, root: 64, entry: 8, leaf_values: 96 };
    pub(super) const VECTOR: Self =
        Self { channels: 3, kind: 6, root: 96, entry: 16, leaf_values: 128 };

    /// The bytes of a leaf.
    pub(super) fn leaf(self) -> usize {
        self.leaf_values + 512 * 4 * self.channels
    }

    /// Where the mask of children of an inner node with sides of so many bits begins.
    pub(super) fn child_mask(log: usize) -> usize {
        VALUE_MASK + (1 << (3 * log)) / 8
    }

    /// Where its table begins: after both masks and the room for its least value, largest value, mean and deviation.
    pub(super) fn table(log: usize) -> usize {
        VALUE_MASK + 2 * (1 << (3 * log)) / 8 + 32
    }

    /// The bytes of an inner node.
    pub(super) fn inner(self, log: usize) -> usize {
        Self::table(log) + (self.entry << (3 * log))
    }
}
