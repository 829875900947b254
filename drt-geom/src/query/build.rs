use alloc::vec::Vec;

use drt_math::Vec3;

use super::TriangleBvh;
use super::binary::BvhBuilder;
use super::block::{BLOCK, Block, Twin};
use super::collapse::collapse;
use super::frame::{Box32, BoxFrame};
use super::lanes::Machine;
use super::watertight::corners;
use super::wide::WideTree;
use crate::weld::lexicographic;
use crate::{Aabb, Mesh, NONE, is_usable};

/// Most triangles: blocks of them have 31 bits in the tree.
const MOST: usize = (1 << 31) - 1;

/// The most boxes that a ray may meet in a tree that followed its triangles, over those in the tree as it was built.
const WORN: f64 = 1.25;

/// Why a tree cannot be built.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BvhError {
    /// A coordinate is NaN, infinite or beyond 1e100.
    #[error("triangle {prim} (from 0) has a coordinate that is not a number below 1e100")]
    BadCoordinate {
        /// Which triangle.
        prim: u32,
    },
    /// More triangles than the tree can name.
    #[error("{count} triangles are too many: at most 2147483647 can be indexed")]
    TooMany {
        /// How many there are.
        count: usize,
    },
    /// An instance's map, or what it does to its tree, cannot be used.
    #[error(
        "instance {instance} (from 0) is placed by a map that flattens it, is not finite, or takes it beyond 1e100"
    )]
    BadInstance {
        /// Which instance.
        instance: u32,
    },
    /// A refit with another number of triangles than the tree was built over.
    #[error("the tree was built over {expected} triangles and cannot be refitted to {found}")]
    CountChanged {
        /// How many the tree has.
        expected: usize,
        /// How many were given.
        found: usize,
    },
}

impl TriangleBvh {
    /// Builds the tree over triangles, which queries name by their place in the slice.
    ///
    /// # Errors
    /// When a coordinate is not finite or beyond 1e100, or there are too many triangles.
    pub fn build(triangles: &[[Vec3; 3]]) -> Result<Self, BvhError> {
        Self::build_by(BvhBuilder::default(), triangles)
    }

    /// Builds the tree with a given builder.
    ///
    /// # Errors
    /// As [`TriangleBvh::build`].
    pub fn build_by(builder: BvhBuilder, triangles: &[[Vec3; 3]]) -> Result<Self, BvhError> {
        if triangles.len() > MOST {
            return Err(BvhError::TooMany { count: triangles.len() });
        }
        let bounds = usable_bounds(triangles)?;
        let (leaves, repeats) = group_twins(triangles);
        let mut bvh = Self {
            tree: None,
            frame: BoxFrame::new(&bounds, triangles.iter().map(|t| t[0])),
            bounds,
            blocks: Vec::new(),
            twins: Vec::with_capacity(repeats.len()),
            triangle_count: triangles.len(),
            boxes_met: 0.0,
            builder,
            machine: Machine::detect(),
        };
        if leaves.is_empty() {
            return Ok(bvh);
        }
        let boxes: Vec<_> =
            leaves.iter().map(|&i| bvh.frame.enclose(&triangles[i as usize])).collect();
        let collapsed = collapse(&boxes, BLOCK, builder);
        // Where each triangle that has repetitions is.
        let mut places = alloc::vec![NONE; if repeats.is_empty() { 0 } else { triangles.len() }];
        for members in &collapsed.blocks {
            let mut block = Block::EMPTY;
            let members = &collapsed.order[members.start as usize..members.end as usize];
            for (lane, &leaf) in members.iter().enumerate() {
                let prim = leaves[leaf as usize];
                block.set(lane, prim, &corners(&triangles[prim as usize]));
                if let Some(place) = places.get_mut(prim as usize) {
                    *place = (bvh.blocks.len() * BLOCK + lane) as u32;
                }
            }
            bvh.blocks.push(block);
        }
        for (first, prim) in repeats {
            let place = places[first as usize] as usize;
            let index = bvh.twins.len() as u32;
            let head = &mut bvh.blocks[place / BLOCK].twins[place % BLOCK];
            let next = core::mem::replace(head, index);
            bvh.twins.push(Twin { corners: corners(&triangles[prim as usize]), prim, next });
        }
        let tree = WideTree::new(&collapsed, |block| {
            let members =
                collapsed.blocks[block].start as usize..collapsed.blocks[block].end as usize;
            Box32::around(collapsed.order[members].iter().map(|&leaf| boxes[leaf as usize]))
        });
        bvh.boxes_met = tree.boxes_met();
        bvh.tree = Some(tree);
        Ok(bvh)
    }

    /// Builds the tree over the triangles of a mesh.
    ///
    /// # Errors
    /// As [`TriangleBvh::build`].
    pub fn of(mesh: &Mesh) -> Result<Self, BvhError> {
        Self::build(&mesh.soup())
    }

    /// Follows triangles that moved, keeping their numbers and the shape of the tree, in a fifth of the time of
    /// [`build`](Self::build). It is built anew where triangles have no area or coincide, and where they moved so far against each
    /// other that a ray would meet a quarter more boxes than when it was built.
    ///
    /// # Errors
    /// As [`TriangleBvh::build`], or when the number of triangles changed. The tree is then as
    /// before.
    pub fn refit(&mut self, triangles: &[[Vec3; 3]]) -> Result<(), BvhError> {
        if triangles.len() != self.triangle_count {
            let (expected, found) = (self.triangle_count, triangles.len());
            return Err(BvhError::CountChanged { expected, found });
        }
        let bounds = usable_bounds(triangles)?;
        // Triangles that had no area are not in the tree, and twins may part.
        let held: usize = self.blocks.iter().map(Block::len).sum();
        let same_set = held == triangles.len() && triangles.iter().all(has_area);
        if same_set {
            self.follow(bounds, triangles);
        }
        let met = self.tree.as_ref().map_or(0.0, WideTree::boxes_met);
        if !same_set || met > WORN * self.boxes_met {
            let fresh = Self::build_by(self.builder, triangles)?;
            *self = Self { machine: self.machine, ..fresh };
        }
        Ok(())
    }

    /// Takes the new places of the triangles that it holds.
    fn follow(&mut self, bounds: Aabb, triangles: &[[Vec3; 3]]) {
        self.bounds = bounds;
        self.frame = BoxFrame::new(&bounds, triangles.iter().map(|t| t[0]));
        for block in &mut self.blocks {
            for lane in 0..block.len() {
                let prim = block.prims[lane];
                block.set(lane, prim, &corners(&triangles[prim as usize]));
            }
        }
        let (frame, blocks) = (&self.frame, &self.blocks);
        let Some(tree) = &mut self.tree else { return };
        tree.fit(|block| {
            let prims = blocks[block].prims.iter().take_while(|p| **p != NONE);
            Box32::around(prims.map(|&p| frame.enclose(&triangles[p as usize])))
        });
    }
}

fn usable_bounds(triangles: &[[Vec3; 3]]) -> Result<Aabb, BvhError> {
    let usable = |t: &[Vec3; 3]| t.iter().copied().all(is_usable);
    match triangles.iter().position(|t| !usable(t)) {
        Some(prim) => Err(BvhError::BadCoordinate { prim: prim as u32 }),
        None => Ok(Aabb::around(triangles.iter().flatten().copied())),
    }
}

fn has_area(t: &[Vec3; 3]) -> bool {
    (t[1] - t[0]).cross(t[2] - t[0]) != Vec3::ZERO
}

/// The triangles with an area, without repetitions; and the repetitions, each with the triangle it
/// repeats (the same three positions in whatever order).
fn group_twins(triangles: &[[Vec3; 3]]) -> (Vec<u32>, Vec<(u32, u32)>) {
    let mut keyed: Vec<([Vec3; 3], u32)> = Vec::with_capacity(triangles.len());
    for (t, prim) in triangles.iter().zip(0..).filter(|(t, _)| has_area(t)) {
        let mut key = *t;
        key.sort_unstable_by(|a, b| lexicographic(*a, *b));
        keyed.push((key, prim));
    }
    keyed.sort_unstable_by(|(a, i), (b, j)| {
        let corner = |k: usize| lexicographic(a[k], b[k]);
        corner(0).then_with(|| corner(1)).then_with(|| corner(2)).then(i.cmp(j))
    });
    let (mut leaves, mut twins) = (Vec::with_capacity(keyed.len()), Vec::new());
    for run in keyed.chunk_by(|(a, _), (b, _)| a == b) {
        let first = run[0].1;
        leaves.push(first);
        twins.extend(run[1..].iter().map(|(_, prim)| (first, *prim)));
    }
    leaves.sort_unstable();
    (leaves, twins)
}

#[cfg(test)]
mod tests {
    use alloc::vec::Vec;

    use drt_math::{Ray, Rng, Vec3, vec3};

    use super::WORN;
    use crate::query::{Skip, TriangleBvh};

    fn cloud(seed: u64) -> Vec<[Vec3; 3]> {
        let mut rng = Rng::new(seed, 0, 0);
        let mut point = |size: f64| Vec3::from([0, 1, 2].map(|_| size * rng.next_f64()));
        let mut triangle = |_| {
            let at = point(10.0);
            [at, at + point(0.3), at + point(0.3)]
        };
        (0..500).map(&mut triangle).collect()
    }

    fn met(bvh: &TriangleBvh) -> f64 {
        bvh.tree.as_ref().unwrap().boxes_met()
    }

    /// A tree follows triangles that turn together; where they change places it is built anew.
    #[test]
    fn a_tree_that_serves_badly_is_built_anew() {
        let (first, second) = (cloud(1), cloud(2));
        let turned: Vec<_> = first.iter().map(|t| t.map(|p| vec3(p.y, -p.x, p.z + 3.0))).collect();
        let built = TriangleBvh::build(&first).unwrap();
        let mut bvh = built.clone();
        bvh.refit(&turned).unwrap();
        assert!((met(&bvh) / met(&built) - 1.0).abs() < 0.05, "{} {}", met(&bvh), met(&built));
        let mut follows = built.clone();
        follows.follow(bvh.bounds, &second);
        assert!(met(&follows) > 2.0 * WORN * met(&built), "{} {}", met(&follows), met(&built));
        bvh.refit(&second).unwrap();
        let fresh = TriangleBvh::build(&second).unwrap();
        assert_eq!(met(&bvh), met(&fresh));
        for i in 0..200 {
            let mut rng = Rng::new(3, 0, i);
            let mut point = || Vec3::from([0, 1, 2].map(|_| 10.0 * rng.next_f64()));
            let (origin, dir) = (point(), (point() - point()).normalize());
            let ray = Ray { origin, dir, t_max: f64::INFINITY };
            assert_eq!(bvh.closest(&ray, Skip::NOTHING), fresh.closest(&ray, Skip::NOTHING));
        }
    }
}
