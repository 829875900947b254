//! Reading.

use std::borrow::Cow;
use std::format;
use std::io::Read;
use std::string::{String, ToString};
use std::vec;
use std::vec::Vec;

use drt_math::{Affine, Mat3, Vec3, vec3};
use flate2::read::ZlibDecoder;

use crate::Grid;
use crate::nanovdb::NanoVdb;
use crate::nanovdb::layout::{
    ABOUT_GRID, BACKGROUND, CLASS, FILE_SIGNATURES, GRID, GRID_SIGNATURES, KIND, LEAF_SIDE, LINEAR,
    LOWER_LOG, LOWER_SIDE, Layout, MAJOR, MAJOR_SHIFT, SEGMENT, TABLE_SIZE, TILE, TILE_VALUE,
    TRANSLATION, UPPER_LOG, UPPER_SIDE, VERSION,
};
use crate::pages::Pages;
use crate::vol_error::VolError;

/// Voxels of a box that are always accepted, and how many there may be for each one that is stored.
const SMALL: u64 = 1 << 24;
const SPARSE: u64 = 64;

/// The most that zlib packs into a byte.
const DENSEST: usize = 1032;

/// Reads a grid of the content of a file, as [`read`](super::read) chooses it; `file` names the file in errors.
///
/// # Errors
/// As [`read`](super::read).
pub fn decode(bytes: &[u8], file: &str, name: Option<&str>) -> Result<NanoVdb, VolError> {
    let pages = Pages { bytes, file };
    let stored = chosen(&pages, stored_grids(&pages)?, name)?;
    let data = unpacked(&pages, &stored)?;
    let label = format!("{file}, grid `{}`", stored.name);
    let tree = Tree::new(Pages { bytes: &data, file: &label })?;
    let placement = tree.placement()?;
    let grid = tree.grid()?;
    Ok(NanoVdb { name: stored.name, grid, placement })
}

/// A grid as a file has it.
struct Stored {
    name: String,
    packing: u16,
    /// Where it begins, its bytes in the file, and its bytes in memory.
    start: usize,
    length: usize,
    unpacked: usize,
}

/// What a file has. Each of its segments tells of all its grids first.
fn stored_grids(pages: &Pages<'_>) -> Result<Vec<Stored>, VolError> {
    let (mut found, mut at) = (Vec::new(), 0);
    while at < pages.bytes.len() || at == 0 {
        pages.signature(at, FILE_SIGNATURES, "the bytes \"NanoVDB0\" or \"NanoVDB2\"")?;
        check_version(pages, at + 8)?;
        let count = pages.u16(at + 12)?;
        at += SEGMENT;
        let first = found.len();
        for _ in 0..count {
            let unpacked = pages.length(at, "the size of a grid")?;
            let length = pages.length(at + 8, "the size of a grid in the file")?;
            let letters = pages.u32(at + 136)? as usize;
            let packing = pages.u16(at + 168)?;
            let text = pages.slice(at + ABOUT_GRID, letters)?;
            let text = text.split(|c| *c == 0).next().unwrap_or_default();
            let name = String::from_utf8_lossy(text).to_string();
            found.push(Stored { name, packing, start: 0, length, unpacked });
            at += ABOUT_GRID + letters;
        }
        for grid in &mut found[first..] {
            grid.start = at;
            pages.slice(at, grid.length)?;
            at += grid.length;
        }
    }
    Ok(found)
}

fn check_version(pages: &Pages<'_>, offset: usize) -> Result<(), VolError> {
    let major = pages.u32(offset)? >> MAJOR_SHIFT;
    match major {
        MAJOR => Ok(()),
        _ => Err(pages.field(offset, "the major version", major.to_string(), "32")),
    }
}

fn chosen(
    pages: &Pages<'_>,
    mut stored: Vec<Stored>,
    name: Option<&str>,
) -> Result<Stored, VolError> {
    let place = match name {
        Some(name) => stored.iter().position(|grid| grid.name == name),
        None if stored.len() == 1 => Some(0),
        None => stored.iter().position(|grid| grid.name == "density"),
    };
    match place {
        Some(place) => Ok(stored.swap_remove(place)),
        None => {
            let names: Vec<String> = stored.iter().map(|g| format!("`{}`", g.name)).collect();
            let found = if names.is_empty() { "none".into() } else { names.join(", ") };
            Err(pages.field(0, "the list of grids", found, "one with the name that is asked for"))
        }
    }
}

/// A grid as it is in memory.
fn unpacked<'a>(pages: &Pages<'a>, stored: &Stored) -> Result<Cow<'a, [u8]>, VolError> {
    let data = pages.slice(stored.start, stored.length)?;
    match stored.packing {
        0 => Ok(Cow::Borrowed(data)),
        1 => {
            let length = pages.length(stored.start, "the size of a packed grid")?;
            let packed = pages.slice(stored.start + 8, length)?;
            let refuse = |found| {
                pages.field(stored.start, "a packed grid", found, "as many bytes as are announced")
            };
            if stored.unpacked / DENSEST > packed.len() {
                return Err(refuse(format!("{} bytes for {}", packed.len(), stored.unpacked)));
            }
            let mut all = Vec::new();
            let mut from = ZlibDecoder::new(packed).take(stored.unpacked as u64 + 1);
            from.read_to_end(&mut all).map_err(|e| refuse(e.to_string()))?;
            match all.len() == stored.unpacked {
                true => Ok(Cow::Owned(all)),
                false => Err(refuse(format!("{} bytes", all.len()))),
            }
        }
        other => {
            let expected = "0 (none) or 1 (zlib)";
            Err(pages.field(stored.start, "the packing of a grid", other.to_string(), expected))
        }
    }
}

/// The tree of a grid.
struct Tree<'a> {
    pages: Pages<'a>,
    layout: Layout,
    root: usize,
    /// The least and the largest coordinates of active values.
    least: [i64; 3],
    size: [usize; 3],
}

impl<'a> Tree<'a> {
    fn new(pages: Pages<'a>) -> Result<Self, VolError> {
        pages.signature(0, GRID_SIGNATURES, "the bytes \"NanoVDB0\" or \"NanoVDB1\"")?;
        check_version(&pages, VERSION)?;
        let kind = pages.u32(KIND)?;
        let known = [Layout::FLOAT, Layout::VECTOR].into_iter().find(|l| l.kind == kind);
        let layout = known.ok_or_else(|| {
            let expected = "1 (float) or 6 (three floats)";
            pages.field(KIND, "the kind of values", kind.to_string(), expected)
        })?;
        let class = pages.u32(CLASS)?;
        if ![0, 2].contains(&class) {
            let expected = "0 (not known) or 2 (fog volume)";
            return Err(pages.field(CLASS, "the class of the grid", class.to_string(), expected));
        }
        let root = GRID + pages.length(GRID + 24, "the place of the root")?;
        let corner = |at: usize| -> Result<[i64; 3], VolError> {
            let c = |k: usize| pages.i32(root + at + 4 * k).map(i64::from);
            Ok([c(0)?, c(1)?, c(2)?])
        };
        let (least, most) = (corner(0)?, corner(12)?);
        let size = [0, 1, 2].map(|k| usize::try_from(most[k] - least[k] + 1).unwrap_or(0));
        if size.contains(&0) {
            let found = format!("{least:?} to {most:?}");
            return Err(pages.field(root, "the box of active values", found, "some extent"));
        }
        Ok(Self { pages, layout, root, least, size })
    }

    /// The map of the unit cube to where the grid is.
    fn placement(&self) -> Result<Affine, VolError> {
        let number = |at: usize| self.pages.f64(at, "the map of the grid");
        let row = |r: usize| -> Result<Vec3, VolError> {
            let c = |k: usize| number(LINEAR + 8 * (3 * r + k));
            Ok(vec3(c(0)?, c(1)?, c(2)?))
        };
        let linear = Mat3::from_rows(row(0)?, row(1)?, row(2)?);
        let t = |k: usize| number(TRANSLATION + 8 * k);
        let map = Affine { linear, translation: vec3(t(0)?, t(1)?, t(2)?) };
        let [x, y, z] = self.size.map(|n| n as f64);
        let [a, b, c] = self.least.map(|c| c as f64 - 0.5);
        Ok(map.after(&Affine { linear: Mat3::diagonal(vec3(x, y, z)), translation: vec3(a, b, c) }))
    }

    fn value(&self, offset: usize) -> Result<[f64; 3], VolError> {
        let mut value = [0.0; 3];
        for (k, v) in value.iter_mut().take(self.layout.channels).enumerate() {
            *v = self.pages.f32(offset + 4 * k, "a value")?;
        }
        Ok(value)
    }

    /// All values of the box.
    fn grid(&self) -> Result<Grid, VolError> {
        let voxels = self.size.iter().try_fold(1_u64, |n, s| n.checked_mul(*s as u64));
        let leaves = (self.pages.bytes.len() / self.layout.leaf()) as u64;
        let most = u64::max(SMALL, leaves.saturating_mul(512 * SPARSE));
        let voxels = voxels.filter(|n| *n <= most).ok_or_else(|| {
            let found = format!("{:?} voxels with {leaves} blocks of 8x8x8", self.size);
            let expected = "at most 2^24 voxels, or 64 for each one in a block";
            self.pages.field(self.root, "the box of active values", found, expected)
        })?;
        let background = self.value(self.root + BACKGROUND)?;
        let channels = self.layout.channels;
        let mut values = vec![0.0; voxels as usize * channels];
        for voxel in values.chunks_exact_mut(channels) {
            voxel.copy_from_slice(&background[..channels]);
        }
        let mut to = Filled { tree: self, values, background, voxels: 0, nodes: 0 };
        to.root()?;
        Grid::new(self.size, channels, to.values)
            .map_err(|source| VolError::Grid { file: self.pages.file.to_string(), source })
    }
}

/// The values of a box, as far as they are known.
struct Filled<'a> {
    tree: &'a Tree<'a>,
    values: Vec<f64>,
    background: [f64; 3],
    /// What was set, and nodes that were read: no more than there can be.
    voxels: usize,
    nodes: usize,
}

impl Filled<'_> {
    fn root(&mut self) -> Result<(), VolError> {
        let Tree { pages, layout, root, .. } = *self.tree;
        for i in 0..pages.u32(root + TABLE_SIZE)? as usize {
            let tile = root + layout.root + TILE * i;
            let key = pages.u64(tile)?;
            let origin = [42, 21, 0].map(|shift| {
                let steps = (key >> shift & 0x1f_ffff) as i64;
                // Coordinates are 32 bits with a sign.
                i64::from((steps << 12) as i32)
            });
            match pages.length(tile + 8, "the place of a node")? {
                0 => {
                    let value = self.tree.value(tile + TILE_VALUE)?;
                    self.fill(origin, UPPER_SIDE, value)?;
                }
                child => self.inner(root + child, origin, UPPER_LOG)?,
            }
        }
        Ok(())
    }

    /// An inner node with sides of so many bits.
    fn inner(&mut self, node: usize, origin: [i64; 3], log: usize) -> Result<(), VolError> {
        let Tree { pages, layout, .. } = *self.tree;
        self.count(node, layout.inner(log))?;
        let side = if log == UPPER_LOG { LOWER_SIDE } else { LEAF_SIDE };
        let children = pages.slice(node + Layout::child_mask(log), (1 << (3 * log)) / 8)?;
        for n in 0..1_usize << (3 * log) {
            let entry = node + Layout::table(log) + layout.entry * n;
            let of = |shift: usize| (n >> shift & ((1 << log) - 1)) as i64 * side;
            let [x, y, z] = origin;
            let place = [x + of(2 * log), y + of(log), z + of(0)];
            if children[n / 8] >> (n % 8) & 1 == 0 {
                let value = self.tree.value(entry)?;
                self.fill(place, side, value)?;
                continue;
            }
            let child = node + pages.length(entry, "the place of a node")?;
            if log == UPPER_LOG {
                self.inner(child, place, LOWER_LOG)?;
            } else {
                self.leaf(child, place)?;
            }
        }
        Ok(())
    }

    fn leaf(&mut self, node: usize, origin: [i64; 3]) -> Result<(), VolError> {
        let layout = self.tree.layout;
        self.count(node, layout.leaf())?;
        for n in 0..512_usize {
            let [x, y, z] = origin;
            let place = [x + (n >> 6) as i64, y + (n >> 3 & 7) as i64, z + (n & 7) as i64];
            let value = self.tree.value(node + layout.leaf_values + 4 * layout.channels * n)?;
            self.fill(place, 1, value)?;
        }
        Ok(())
    }

    /// Refuses more nodes than there is room for, which would be read for ever.
    fn count(&mut self, node: usize, size: usize) -> Result<(), VolError> {
        let pages = &self.tree.pages;
        pages.slice(node, size)?;
        self.nodes += size;
        match self.nodes <= pages.bytes.len() {
            true => Ok(()),
            false => {
                let expected = "each node once";
                Err(pages.field(node, "a node", "one of too many".into(), expected))
            }
        }
    }

    /// Gives the part of a cube that is in the box a value.
    fn fill(&mut self, origin: [i64; 3], side: i64, value: [f64; 3]) -> Result<(), VolError> {
        if value == self.background {
            return Ok(());
        }
        let Tree { pages, least, size, layout, root, .. } = *self.tree;
        let part = [0, 1, 2].map(|k| {
            let start = (origin[k] - least[k]).clamp(0, size[k] as i64) as usize;
            let end = (origin[k] + side - least[k]).clamp(0, size[k] as i64) as usize;
            start..end
        });
        let [xs, ys, zs] = part;
        self.voxels += xs.len() * ys.len() * zs.len();
        if self.voxels * layout.channels > self.values.len() {
            let expected = "cubes that do not overlap";
            return Err(pages.field(root, "the tree", "two values for a voxel".into(), expected));
        }
        for z in zs {
            for y in ys.clone() {
                let line = (z * size[1] + y) * size[0];
                let line = (line + xs.start) * layout.channels..(line + xs.end) * layout.channels;
                for voxel in self.values[line].chunks_exact_mut(layout.channels) {
                    voxel.copy_from_slice(&value[..layout.channels]);
                }
            }
        }
        Ok(())
    }
}
