//! Two levels of trees: triangles in world space, and instances, which are affine images of trees that they share.
//!
//! A ray goes through an instance as its image in the space of the instance's tree, with the same parameter t. So what it meets
//! there has the t and the barycentric weights of the hit in the world, whatever the map is, and no triangle is copied: an
//! instance costs its map, its inverse and its share of a tree over boxes.

use alloc::sync::Arc;
use alloc::vec::Vec;
use core::ops::{ControlFlow, Range};

use drt_math::{Affine, Ray, Real, Vec3, vec3};

use super::binary::BvhBuilder;
use super::collapse::collapse;
use super::ends::{End, gamma};
use super::frame::{Box32, BoxFrame};
use super::lanes::{Lanes, Machine};
use super::wide::{Visitor, WideTree};
use super::{BvhError, Hit, Skip, TriangleBvh, Walk, sort};
use crate::{Aabb, NONE, is_usable};

/// Instances in a leaf of the tree.
const BLOCK: usize = 2;

/// Roundings of a coordinate mapped from one space to another, and of what it was made from.
const MAPPED: f64 = gamma(16.0);

/// Triangles under one tree, and instances of other trees under another.
///
/// Queries are those of [`TriangleBvh`]. Triangles of the first tree have the numbers that they have there; those of instances
/// come after them, in the order of the instances.
#[derive(Clone, Debug)]
pub struct InstancedBvh {
    triangles: TriangleBvh,
    instances: Option<Instances>,
}

/// Where an instance of a tree is.
#[derive(Clone, Debug)]
pub struct InstancePlacement {
    /// The tree, shared by all its instances.
    pub tree: Arc<TriangleBvh>,
    /// From its space to the world.
    pub to_world: Affine,
}

#[derive(Clone, Debug)]
struct Instances {
    /// `None` where no instance has a triangle.
    tree: Option<WideTree>,
    frame: BoxFrame,
    bounds: Aabb,
    machine: Machine,
    /// Places in `order`, by block.
    blocks: Vec<Range<u32>>,
    order: Vec<u32>,
    placed: Vec<Placed>,
}

#[derive(Clone, Debug)]
struct Placed {
    tree: Arc<TriangleBvh>,
    to_world: Affine,
    to_local: Affine,
    /// The number of its first triangle.
    first: u32,
}

impl InstancedBvh {
    /// The tree over instances, beside one over triangles.
    ///
    /// # Errors
    /// When a map cannot be inverted or takes a box beyond 1e100, or there are too many triangles.
    pub fn new(
        triangles: TriangleBvh,
        instances: impl IntoIterator<Item = InstancePlacement>,
    ) -> Result<Self, BvhError> {
        let mut next = triangles.triangle_count;
        let mut placed = Vec::new();
        for (i, InstancePlacement { tree, to_world }) in (0..).zip(instances) {
            let to_local = to_world.inverse();
            if !(to_local.is_finite() && to_world.is_finite()) {
                return Err(BvhError::BadInstance { instance: i });
            }
            let first = next as u32;
            next = next.saturating_add(tree.triangle_count);
            if next >= NONE as usize {
                return Err(BvhError::TooMany { count: next });
            }
            placed.push(Placed { tree, to_world, to_local, first });
        }
        let instances = if placed.is_empty() { None } else { Some(Instances::new(placed)?) };
        Ok(Self { triangles, instances })
    }

    /// The smallest box around the triangles, and boxes around those of instances.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        let of_instances = self.instances.as_ref().map_or(Aabb::EMPTY, |i| i.bounds);
        self.triangles.bounds().union(&of_instances)
    }

    /// The tree over the triangles that are no instances.
    #[must_use]
    pub fn triangles(&self) -> &TriangleBvh {
        &self.triangles
    }

    /// The first hit along a ray.
    #[must_use]
    #[inline]
    pub fn closest(&self, ray: &Ray, skip: Skip) -> Option<Hit> {
        let hit = self.triangles.closest(ray, skip);
        match &self.instances {
            None => hit,
            Some(instances) => instances.closest(ray, skip, hit),
        }
    }

    /// As [`TriangleBvh::foremost`]; instances coincide with nothing.
    #[must_use]
    #[inline]
    pub fn foremost(&self, ray: &Ray, skip: Skip) -> Option<Hit> {
        let hit = self.triangles.foremost(ray, skip);
        match &self.instances {
            None => hit,
            Some(instances) => instances.closest(ray, skip, hit),
        }
    }

    /// As [`TriangleBvh::any`].
    #[inline]
    pub fn any(&self, ray: &Ray, skip: Skip, mut blocks: impl FnMut(u32) -> bool) -> bool {
        self.triangles.any(ray, skip, &mut blocks)
            || self.instances.as_ref().is_some_and(|i| i.any(ray, skip, blocks))
    }

    /// As [`TriangleBvh::crossings`].
    pub fn crossings(
        &self,
        ray: &Ray,
        skip: Skip,
        blocks: impl Fn(u32) -> bool,
        out: &mut Vec<Hit>,
    ) -> bool {
        if self.triangles.crossings(ray, skip, &blocks, out) {
            return true;
        }
        let Some(instances) = &self.instances else { return false };
        let blocked = instances.any(ray, skip, &blocks);
        if blocked {
            out.clear();
        } else {
            instances.all(ray, ray.t_max, skip, |hit| {
                out.push(hit);
                ray.t_max
            });
            sort(out);
        }
        blocked
    }

    /// As [`TriangleBvh::closest_through`].
    pub fn closest_through(
        &self,
        ray: &Ray,
        skip: Skip,
        blocks: impl Fn(u32) -> bool,
        out: &mut Vec<Hit>,
    ) -> Option<Hit> {
        let mut best = self.triangles.closest_through(ray, skip, &blocks, out);
        let Some(instances) = &self.instances else { return best };
        let far = best.map_or(ray.t_max, |b| b.t.next_up());
        instances.all(ray, far, skip, |hit| {
            if !blocks(hit.prim) {
                out.push(hit);
            } else if best.is_none_or(|b| hit.is_before(&b)) {
                best = Some(hit);
            }
            best.map_or(ray.t_max, |b| b.t.next_up())
        });
        if let Some(best) = &best {
            out.retain(|h| h.is_before(best));
        }
        sort(out);
        best
    }
}

impl Instances {
    fn new(placed: Vec<Placed>) -> Result<Self, BvhError> {
        let mut boxes = Vec::new();
        let mut bounds = Aabb::EMPTY;
        for (i, p) in (0..).zip(&placed) {
            let around = p.world_bounds();
            if !around.is_empty() {
                if !(is_usable(around.min) && is_usable(around.max)) {
                    return Err(BvhError::BadInstance { instance: i });
                }
                bounds = bounds.union(&around);
                boxes.push((i, around));
            }
        }
        let frame = BoxFrame::new(&bounds, boxes.iter().map(|(_, b)| b.center()));
        let (mut order, mut blocks, mut tree) = (Vec::new(), Vec::new(), None);
        if !boxes.is_empty() {
            let enclosed: Vec<Box32> =
                boxes.iter().map(|(_, b)| frame.enclose(&[b.min, b.max, b.max])).collect();
            let collapsed = collapse(&enclosed, BLOCK, BvhBuilder::Binned);
            tree = Some(WideTree::new(&collapsed, |block| {
                let Range { start, end } = collapsed.blocks[block];
                let members = &collapsed.order[start as usize..end as usize];
                Box32::around(members.iter().map(|&i| enclosed[i as usize]))
            }));
            order = collapsed.order.iter().map(|&i| boxes[i as usize].0).collect();
            blocks = collapsed.blocks;
        }
        let machine = Machine::detect();
        Ok(Self { tree, frame, bounds, machine, blocks, order, placed })
    }

    /// Calls `meet` with instances whose boxes the ray meets, by and large the nearer first. Its answer is where the ray ends from
    /// then on.
    fn visit(&self, ray: &Ray, meet: impl FnMut(&Placed) -> ControlFlow<(), f64>) {
        let (Some(tree), Some(query)) = (&self.tree, self.frame.clip(ray)) else { return };
        let limit = |t: f64| if t < f64::INFINITY { query.limit(t) } else { f32::INFINITY };
        let visitor = Met { instances: self, far: query.far, limit, meet };
        self.machine.run(Walk { tree, query: &query, visitor });
    }

    /// The first hit, if it is before the one given.
    fn closest(&self, ray: &Ray, skip: Skip, known: Option<Hit>) -> Option<Hit> {
        let mut best = known;
        // Up to the hit itself: another at the same t may have a lower number.
        let end = |best: &Option<Hit>| best.map_or(ray.t_max, |hit| hit.t.next_up());
        let mut far = end(&best);
        self.visit(&Ray { t_max: far, ..*ray }, |p| {
            let (local, skip, ends) = p.probe(ray, far, skip);
            if let Some(hit) = p.tree.closest_from(&local, skip, Some(ends)).map(|hit| p.named(hit))
                && best.is_none_or(|b| hit.is_before(&b))
            {
                best = Some(hit);
                far = end(&best);
            }
            ControlFlow::Continue(far)
        });
        best
    }

    fn any(&self, ray: &Ray, skip: Skip, mut blocks: impl FnMut(u32) -> bool) -> bool {
        let mut blocked = false;
        self.visit(ray, |p| {
            let (local, skip, ends) = p.probe(ray, ray.t_max, skip);
            blocked = p.tree.any_from(&local, skip, Some(ends), |prim| blocks(p.first + prim));
            if blocked { ControlFlow::Break(()) } else { ControlFlow::Continue(f64::INFINITY) }
        });
        blocked
    }

    /// Calls `found` with all hits before `far`, which is where it says from then on; some that are behind may be among them.
    fn all(&self, ray: &Ray, mut far: f64, skip: Skip, mut found: impl FnMut(Hit) -> f64) {
        self.visit(&Ray { t_max: far, ..*ray }, |p| {
            let (local, skip, ends) = p.probe(ray, far, skip);
            p.tree.all_from(&local, skip, Some(ends), |hit| far = found(p.named(hit)));
            ControlFlow::Continue(far)
        });
    }
}

impl Placed {
    /// Around the image of the tree's box, and what rounding adds to it.
    fn world_bounds(&self) -> Aabb {
        let b = self.tree.bounds();
        if b.is_empty() {
            return b;
        }
        let corner = |i: u32| {
            let pick = |k: usize| if i >> k & 1 == 0 { b.min[k] } else { b.max[k] };
            self.to_world.point(vec3(pick(0), pick(1), pick(2)))
        };
        Aabb::around((0..8).map(corner))
    }

    /// The ray cut off at `far`, the triangles that it skips and its ends, in the space of the tree.
    fn probe(&self, ray: &Ray, far: f64, skip: Skip) -> (Ray, Skip, (End, Option<End>)) {
        let origin = self.to_local.point(ray.origin);
        let dir = self.to_local.vector(ray.dir);
        let own = |prim: u32| {
            let place = prim.wrapping_sub(self.first);
            if prim != NONE && (place as usize) < self.tree.triangle_count { place } else { NONE }
        };
        let Skip([a, b]) = skip;
        let end = |x: Vec3, world: Vec3| {
            End::with_error(x.to_array(), (self.rounding(x, world) * MAPPED).to_array())
        };
        let last = (ray.t_max < f64::INFINITY).then(|| {
            let reach = absolute(ray.origin) + absolute(ray.dir) * ray.t_max;
            end(origin + dir * ray.t_max, reach)
        });
        let ends = (end(origin, absolute(ray.origin)), last);
        (Ray { origin, dir, t_max: far }, Skip::two(own(a), own(b)), ends)
    }

    /// The size of what is added up in mapping a point of the tree's space to the world and back.
    fn rounding(&self, local: Vec3, world: Vec3) -> Vec3 {
        let there = sizes(&self.to_world, absolute(local)) + world;
        sizes(&self.to_local, there)
    }

    fn named(&self, hit: Hit) -> Hit {
        Hit { prim: self.first + hit.prim, ..hit }
    }
}

fn absolute(v: Vec3) -> Vec3 {
    vec3(Real::abs(v.x), Real::abs(v.y), Real::abs(v.z))
}

/// The sums of the sizes of the terms of a mapped point's coordinates.
fn sizes(map: &Affine, v: Vec3) -> Vec3 {
    let [x, y, z] = map.linear.cols.map(absolute);
    x * v.x + y * v.y + z * v.z + absolute(map.translation)
}

struct Met<'a, L, F> {
    instances: &'a Instances,
    far: f32,
    limit: L,
    meet: F,
}

impl<T: Fn(f64) -> f32, F: FnMut(&Placed) -> ControlFlow<(), f64>> Visitor for Met<'_, T, F> {
    #[inline(always)]
    fn announce<L: Lanes>(&self, lanes: L, index: usize) {
        lanes.prefetch(&self.instances.blocks[index]);
    }
    #[inline(always)]
    fn block<L: Lanes>(&mut self, _: L, index: usize) -> ControlFlow<(), f32> {
        let Range { start, end } = self.instances.blocks[index];
        for &i in &self.instances.order[start as usize..end as usize] {
            let t = (self.meet)(&self.instances.placed[i as usize])?;
            self.far = self.far.min((self.limit)(t));
        }
        ControlFlow::Continue(self.far)
    }
}
