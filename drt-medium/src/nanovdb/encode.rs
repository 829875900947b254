//! Writing.

use std::collections::BTreeMap;
use std::vec;
use std::vec::Vec;

use drt_math::{Affine, Mat3, Vec3, vec3};

use crate::nanovdb::NanoVdb;
use crate::nanovdb::layout::{
    ABOUT_GRID, CLASS, FILE_SIGNATURES, GRID, GRID_NAME, GRID_SIGNATURES, INVERSE, KIND, LEAF_MASK,
    LEAF_SIDE, LINEAR, LONGEST_NAME, LOWER_LOG, LOWER_SIDE, Layout, MAJOR, MAJOR_SHIFT, MAP,
    SEGMENT, TABLE_SIZE, TILE, TRANSLATION, TREE, UPPER_LOG, UPPER_SIDE, VERSION,
};
use crate::vol_error::VolError;

/// Flags of a grid: that boxes are stored, and that nodes come in the order of their level.
const FLAGS: u32 = 1 << 1 | 1 << 5;
const FOG_VOLUME: u32 = 2;
/// What stands for no checksum.
const NO_CHECKSUM: u64 = u64::MAX;

/// The content of a file with one grid, not packed, of the class *fog volume*.
///
/// # Errors
/// When a size exceeds 2³⁰, a value or the map the range of its number, the map has no inverse, or the name is longer than 255 bytes or holds a
/// zero byte.
pub fn encode(volume: &NanoVdb) -> Result<Vec<u8>, VolError> {
    let tree = Tree::new(volume)?;
    let grid = tree.bytes(volume)?;
    let mut file = Bytes(vec![0; SEGMENT + ABOUT_GRID]);
    let name = volume.name.as_bytes();
    let (size, letters) = (grid.0.len() as u64, name.len() as u32 + 1);
    file.set(0, &FILE_SIGNATURES[0]);
    file.set(8, &(MAJOR << MAJOR_SHIFT).to_le_bytes());
    file.set(12, &1_u16.to_le_bytes());
    let about = SEGMENT;
    file.set(about, &size.to_le_bytes());
    file.set(about + 8, &size.to_le_bytes());
    file.set(about + 24, &tree.voxels.to_le_bytes());
    file.set(about + 32, &tree.layout.kind.to_le_bytes());
    file.set(about + 36, &FOG_VOLUME.to_le_bytes());
    file.copy(about + 40, &grid, GRID - 112..GRID - 64);
    file.set(about + 88, &tree.corners());
    file.copy(about + 112, &grid, GRID - 64..GRID - 40);
    file.set(about + 136, &letters.to_le_bytes());
    for (k, count) in tree.counts().into_iter().chain([1]).enumerate() {
        file.set(about + 140 + 4 * k, &(count as u32).to_le_bytes());
    }
    file.set(about + 172, &(MAJOR << MAJOR_SHIFT).to_le_bytes());
    file.0.extend(name);
    file.0.push(0);
    file.0.extend(grid.0);
    Ok(file.0)
}

/// The bytes of a file or grid.
struct Bytes(Vec<u8>);

impl Bytes {
    fn set(&mut self, at: usize, bytes: &[u8]) {
        self.0[at..at + bytes.len()].copy_from_slice(bytes);
    }

    fn copy(&mut self, at: usize, from: &Self, range: core::ops::Range<usize>) {
        self.set(at, &from.0[range]);
    }

    fn mark(&mut self, mask: usize, bit: usize) {
        self.0[mask + bit / 8] |= 1 << (bit % 8);
    }
}

/// The origin of a block.
type Origin = [i64; 3];

/// The nodes that a grid needs, each with its place among those of its kind.
struct Tree<'a> {
    volume: &'a NanoVdb,
    layout: Layout,
    size: [i64; 3],
    leaves: BTreeMap<Origin, usize>,
    lower: BTreeMap<Origin, usize>,
    upper: BTreeMap<Origin, usize>,
    /// Those that are not zero.
    voxels: u64,
}

impl<'a> Tree<'a> {
    fn new(volume: &'a NanoVdb) -> Result<Self, VolError> {
        let refuse = |why| Err(VolError::NotStorable(why));
        if volume.name.len() > LONGEST_NAME || volume.name.contains('\0') {
            return refuse("its name is longer than 255 bytes, or holds a zero byte");
        }
        let grid = &volume.grid;
        if grid.size().iter().any(|n| *n > 1 << 30) {
            return refuse("a size exceeds 2³⁰");
        }
        if grid.values().iter().any(|v| !(*v as f32).is_finite()) {
            return refuse("a value exceeds the range of float32");
        }
        let layout = if grid.channels() == 3 { Layout::VECTOR } else { Layout::FLOAT };
        let size = grid.size().map(|n| n as i64);
        let (mut leaves, mut voxels) = (BTreeMap::new(), 0);
        for (i, voxel) in (0_i64..).zip(grid.values().chunks_exact(layout.channels)) {
            if voxel.iter().any(|v| *v != 0.0) {
                let place = [i % size[0], i / size[0] % size[1], i / size[0] / size[1]];
                leaves.insert(origin_of(place, LEAF_SIDE), 0);
                voxels += 1;
            }
        }
        let parents = |of: &BTreeMap<Origin, usize>, side| {
            of.keys().map(|place| (origin_of(*place, side), 0)).collect()
        };
        let mut lower: BTreeMap<Origin, usize> = parents(&leaves, LOWER_SIDE);
        let mut upper: BTreeMap<Origin, usize> = parents(&lower, UPPER_SIDE);
        for nodes in [&mut leaves, &mut lower, &mut upper] {
            nodes.values_mut().enumerate().for_each(|(k, n)| *n = k);
        }
        Ok(Self { volume, layout, size, leaves, lower, upper, voxels })
    }

    fn counts(&self) -> [usize; 3] {
        [self.leaves.len(), self.lower.len(), self.upper.len()]
    }

    /// The box of all values.
    fn corners(&self) -> Vec<u8> {
        let most = self.size.map(|n| n - 1);
        [0; 3].into_iter().chain(most).flat_map(|c| (c as i32).to_le_bytes()).collect()
    }

    fn bytes(&self, volume: &NanoVdb) -> Result<Bytes, VolError> {
        let layout = self.layout;
        let [leaves, lower, upper] = self.counts();
        let root = GRID + TREE;
        let first_upper = root + layout.root + TILE * upper;
        let first_lower = first_upper + layout.inner(UPPER_LOG) * upper;
        let first_leaf = first_lower + layout.inner(LOWER_LOG) * lower;
        let mut to = Bytes(vec![0; first_leaf + layout.leaf() * leaves]);
        let size = to.0.len() as u64;
        to.set(0, &GRID_SIGNATURES[0]);
        to.set(8, &NO_CHECKSUM.to_le_bytes());
        to.set(VERSION, &(MAJOR << MAJOR_SHIFT).to_le_bytes());
        to.set(VERSION + 4, &FLAGS.to_le_bytes());
        to.set(28, &1_u32.to_le_bytes());
        to.set(32, &size.to_le_bytes());
        to.set(GRID_NAME, volume.name.as_bytes());
        to.set(CLASS, &FOG_VOLUME.to_le_bytes());
        to.set(KIND, &layout.kind.to_le_bytes());
        self.set_map(&mut to, &volume.placement)?;
        let firsts = [first_leaf, first_lower, first_upper, root];
        for (k, first) in firsts.into_iter().enumerate() {
            to.set(GRID + 8 * k, &((first - GRID) as u64).to_le_bytes());
        }
        for (k, count) in self.counts().into_iter().enumerate() {
            to.set(GRID + 32 + 4 * k, &(count as u32).to_le_bytes());
        }
        to.set(GRID + 56, &self.voxels.to_le_bytes());
        to.set(root, &self.corners());
        to.set(root + TABLE_SIZE, &(upper as u32).to_le_bytes());
        for (place, k) in &self.upper {
            let (node, tile) =
                (first_upper + layout.inner(UPPER_LOG) * k, root + layout.root + TILE * k);
            let [x, y, z] = place.map(|c| (c as u64 & 0xffff_ffff) >> 12);
            to.set(tile, &(x << 42 | y << 21 | z).to_le_bytes());
            to.set(tile + 8, &((node - root) as u64).to_le_bytes());
        }
        let kinds = [
            (&self.lower, &self.upper, UPPER_LOG, [first_lower, first_upper]),
            (&self.leaves, &self.lower, LOWER_LOG, [first_leaf, first_lower]),
        ];
        for (children, parents, log, [first_child, first_parent]) in kinds {
            let (side, own) = match log {
                UPPER_LOG => (LOWER_SIDE, layout.inner(LOWER_LOG)),
                _ => (LEAF_SIDE, layout.leaf()),
            };
            for (place, parent) in parents {
                let node = first_parent + layout.inner(log) * parent;
                to.set(node, &corners_of(*place, side << log));
            }
            for (place, k) in children {
                let parent = origin_of(*place, side << log);
                let node = first_parent + layout.inner(log) * parents[&parent];
                let [x, y, z] = [0, 1, 2].map(|c| ((place[c] - parent[c]) / side) as usize);
                let n = (x << log | y) << log | z;
                to.mark(node + Layout::child_mask(log), n);
                let child = first_child + own * k;
                let entry = node + Layout::table(log) + layout.entry * n;
                to.set(entry, &((child - node) as u64).to_le_bytes());
            }
        }
        for (place, k) in &self.leaves {
            self.set_leaf(&mut to, first_leaf + layout.leaf() * k, *place);
        }
        Ok(to)
    }

    fn set_leaf(&self, to: &mut Bytes, node: usize, origin: Origin) {
        let channels = self.layout.channels;
        for (k, c) in origin.into_iter().enumerate() {
            to.set(node + 4 * k, &(c as i32).to_le_bytes());
        }
        // The extent of its box less one, and a flag that there is one.
        to.set(node + 12, &[7, 7, 7, 1 << 1]);
        for n in 0..512_usize {
            let place = [(n >> 6) as i64, (n >> 3 & 7) as i64, (n & 7) as i64];
            let [x, y, z] = [0, 1, 2].map(|k| origin[k] + place[k]);
            let [w, h, d] = self.size;
            if x >= w || y >= h || z >= d {
                continue;
            }
            let i = ((z * h + y) * w + x) as usize * channels;
            let voxel = &self.volume.grid.values()[i..i + channels];
            if voxel.iter().any(|v| *v != 0.0) {
                to.mark(node + LEAF_MASK, n);
            }
            for (k, v) in voxel.iter().enumerate() {
                let at = node + self.layout.leaf_values + 4 * (channels * n + k);
                to.set(at, &(*v as f32).to_le_bytes());
            }
        }
    }

    /// The map of integer coordinates to where the grid is, what undoes it, and the box and the size of voxels there.
    fn set_map(&self, to: &mut Bytes, placement: &Affine) -> Result<(), VolError> {
        let voxel = Mat3::diagonal(Vec3::from(self.size.map(|n| 1.0 / n as f64)));
        let half = voxel * vec3(0.5, 0.5, 0.5);
        let map = placement.after(&Affine { linear: voxel, translation: half });
        let inverse = map.inverse();
        let all = [map.linear, inverse.linear].map(|m| {
            let [a, b, c] = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| (m * axis).to_array());
            [[a[0], b[0], c[0]], [a[1], b[1], c[1]], [a[2], b[2], c[2]]].concat()
        });
        let numbers = all.concat().into_iter().chain(map.translation.to_array());
        let numbers: Vec<f64> = numbers.collect();
        if numbers.iter().any(|v| !(*v as f32).is_finite()) {
            return Err(VolError::NotStorable("its placement has no inverse, or is out of range"));
        }
        for (k, v) in numbers.iter().enumerate() {
            to.set(MAP + 4 * k, &(*v as f32).to_le_bytes());
        }
        for (k, v) in numbers.iter().enumerate() {
            let (from, k) = match k {
                0..9 => (LINEAR, k),
                9..18 => (INVERSE, k - 9),
                _ => (TRANSLATION, k - 18),
            };
            to.set(from + 8 * k, &v.to_le_bytes());
        }
        let corner = |k: usize| {
            let unit = vec3((k & 1) as f64, (k >> 1 & 1) as f64, (k >> 2) as f64);
            placement.linear * unit + placement.translation
        };
        let corners: Vec<Vec3> = (0..8).map(corner).collect();
        let least = corners.iter().copied().reduce(Vec3::min).unwrap_or_default();
        let most = corners.iter().copied().reduce(Vec3::max).unwrap_or_default();
        let sides = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| (map.linear * axis).length());
        let rest = least.to_array().into_iter().chain(most.to_array()).chain(sides);
        for (k, v) in rest.enumerate() {
            to.set(GRID - 112 + 8 * k, &v.to_le_bytes());
        }
        Ok(())
    }
}

/// The origin of the block with sides of a given length that a place is in.
fn origin_of(place: Origin, side: i64) -> Origin {
    place.map(|c| c.div_euclid(side) * side)
}

/// The box of a node.
fn corners_of(origin: Origin, side: i64) -> Vec<u8> {
    let most = origin.map(|c| c + side - 1);
    origin.into_iter().chain(most).flat_map(|c| (c as i32).to_le_bytes()).collect()
}
