use core::ops::ControlFlow;

use drt_math::Vec3;

use super::block::{BLOCK, chain};
use super::lanes::{Array, Lanes, Vector};
use super::nearest::{cross, dot, sub};
use super::wide::Visitor;
use super::{TriangleBvh, Walk};
use crate::NONE;

/// The most blocks of triangles that are looked at. A long segment in a fine mesh meets more, and looking at all of them would take
/// longer than it saves.
const MOST_BLOCKS: u32 = 64;

/// A segment beside which triangles are looked for that are almost parallel to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AlongSegment {
    /// Where it starts and ends.
    pub ends: [Vec3; 2],
    /// How far the plane of a triangle may be from the middle of the segment, in scene units.
    pub reach: f64,
    /// The largest sine of the angle between the segment and the plane of a triangle.
    pub sine: f64,
    /// Triangles that do not count.
    pub except: [u32; 2],
}

impl TriangleBvh {
    /// False where no triangle but those excepted lies along a segment: has a point near it, and a plane that is near to it and
    /// almost parallel. True where one does, and rarely also where none does.
    #[must_use]
    pub fn may_lie_along(&self, segment: &AlongSegment) -> bool {
        let Some(tree) = self.tree.as_ref() else { return false };
        let AlongSegment { ends: [a, b], reach, sine, except } = *segment;
        let (middle, along) = ((a + b) * 0.5, b - a);
        let radius = 0.5 * along.length() + reach;
        let squared = radius * radius;
        if !(middle.is_finite() && squared.is_finite()) {
            return true;
        }
        let plane = Plane {
            middle: middle.to_array(),
            along: along.to_array(),
            reach: reach * reach,
            tilt: sine * sine * along.length_squared(),
        };
        let (limit, mut found) = (self.frame.squared(squared), false);
        let visitor = Along { bvh: self, plane, except, limit, blocks: 0, found: &mut found };
        self.machine.run(Walk { tree, query: self.frame.point(middle, squared), visitor });
        found
    }
}

/// The middle and the direction of a segment, which planes of triangles are compared with.
#[derive(Clone, Copy)]
struct Plane {
    middle: [f64; 3],
    along: [f64; 3],
    /// The squared distance from the middle.
    reach: f64,
    /// The square of the sine, times that of the segment's length.
    tilt: f64,
}

impl Plane {
    /// Those of some triangles whose planes are near and almost parallel, as bits. Triangles too small to have a normal are
    /// among them.
    #[inline(always)]
    fn lies_in<V: Vector<f64, N>, const N: usize>(
        &self,
        number: impl Fn(f64) -> V,
        [a, b, c]: &[[V; 3]; 3],
    ) -> u32 {
        let n = cross(sub(*b, *a), sub(*c, *a));
        let nn = dot(n, n);
        let tilt = dot(n, self.along.map(&number));
        let off = dot(n, sub(self.middle.map(&number), *a));
        (tilt * tilt).le(nn * number(self.tilt)) & (off * off).le(nn * number(self.reach))
    }
}

/// Looks for a triangle that lies along a segment.
struct Along<'a> {
    bvh: &'a TriangleBvh,
    plane: Plane,
    except: [u32; 2],
    /// The squared distance up to which blocks are met, in the tree's coordinates.
    limit: f32,
    blocks: u32,
    found: &'a mut bool,
}

impl Visitor for Along<'_> {
    #[inline(always)]
    fn announce<L: Lanes>(&self, lanes: L, index: usize) {
        lanes.prefetch(&self.bvh.blocks[index]);
    }
    #[inline(always)]
    fn block<L: Lanes>(&mut self, lanes: L, index: usize) -> ControlFlow<(), f32> {
        let block = &self.bvh.blocks[index];
        let counts = |prim: u32| prim != NONE && !self.except.contains(&prim);
        let mut mask = self.plane.lies_in(|x| lanes.double(x), &block.corners(lanes));
        while mask != 0 {
            let lane = mask.trailing_zeros() as usize % BLOCK;
            mask &= mask - 1;
            *self.found |= counts(block.prims[lane]);
        }
        if !self.bvh.twins.is_empty() {
            for twin in block.twins.iter().flat_map(|first| chain(&self.bvh.twins, *first)) {
                let one = |x| Array([x]);
                let lies = self.plane.lies_in(one, &twin.corners.map(|v| v.map(one))) != 0;
                *self.found |= lies && counts(twin.prim);
            }
        }
        self.blocks += 1;
        *self.found |= self.blocks > MOST_BLOCKS;
        if *self.found { ControlFlow::Break(()) } else { ControlFlow::Continue(self.limit) }
    }
}

#[cfg(test)]
mod tests {
    use alloc::vec::Vec;

    use drt_math::{Rng, Vec3, vec3};

    use super::AlongSegment;
    use crate::query::{TriangleBvh, nearest_point};

    fn point(rng: &mut Rng) -> Vec3 {
        Vec3::from([0, 1, 2].map(|_| rng.next_f64()))
    }

    /// By all triangles, of which each counts that is so near and so flat.
    fn by_each(triangles: &[[Vec3; 3]], s: &AlongSegment, factor: f64) -> bool {
        let [a, b] = s.ends;
        let (middle, along) = ((a + b) * 0.5, b - a);
        let lies_along = |(i, t): (u32, &[Vec3; 3])| {
            let n = (t[1] - t[0]).cross(t[2] - t[0]).normalize();
            let near = (nearest_point(*t, middle) - middle).length();
            !s.except.contains(&i)
                && near <= factor * (0.5 * along.length() + s.reach)
                && n.dot(middle - t[0]).abs() <= factor * s.reach
                && n.dot(along).abs() <= factor * s.sine * along.length()
        };
        (0..).zip(triangles).any(lies_along)
    }

    /// Small triangles, and segments of which some lie in the plane of one, or nearly so. None that lies along is missed, and
    /// few are told of that are far. Planted fault: a reach and a sine of a tenth miss some.
    #[test]
    fn what_lies_along_is_found() {
        let mut rng = Rng::new(46, 1, 0);
        let (mut found, mut too_many, mut missed) = (0, 0, 0);
        for _ in 0..40 {
            let triangles: Vec<[Vec3; 3]> = (0..200)
                .map(|_| {
                    let at = point(&mut rng);
                    [0, 1, 2].map(|_| at + (point(&mut rng) - Vec3::splat(0.5)) * 0.1)
                })
                .collect();
            let bvh = TriangleBvh::build(&triangles).unwrap();
            for (k, t) in triangles.iter().enumerate() {
                let n = (t[1] - t[0]).cross(t[2] - t[0]).normalize();
                let (lift, turn) = (0.002 * rng.next_f64(), 0.02 * rng.next_f64());
                let from = t[0].lerp(t[1], rng.next_f64()) + n * lift;
                let along = (t[2] - t[0]).normalize() + n * turn;
                let ends = [from, from + along * 0.05];
                let except = [(k as u32 + 1) % 200, 7];
                let segment = AlongSegment { ends, reach: 0.001, sine: 0.01, except };
                let (is, may) = (by_each(&triangles, &segment, 1.0), bvh.may_lie_along(&segment));
                assert!(may || !is, "{segment:?}");
                found += u32::from(is);
                too_many += u32::from(may && !is);
                let less = AlongSegment { reach: 1e-4, sine: 1e-3, ..segment };
                missed += u32::from(is && !bvh.may_lie_along(&less));
            }
        }
        assert!(
            found > 1000 && too_many < found / 4 && missed > found / 2,
            "{found} {too_many} {missed}"
        );
    }

    #[test]
    fn nothing_lies_along_in_an_empty_tree_and_anything_may_without_an_end() {
        let segment = |x| AlongSegment {
            ends: [vec3(x, 0.0, 0.0), vec3(1.0, 0.0, 0.0)],
            reach: 1e-3,
            sine: 1e-3,
            except: [0; 2],
        };
        let triangle = [vec3(0.0, 0.0, 5.0), vec3(1.0, 0.0, 5.0), vec3(0.0, 1.0, 5.0)];
        let (empty, one) = [&[][..], &[triangle]].map(|t| TriangleBvh::build(t).unwrap()).into();
        assert!(!empty.may_lie_along(&segment(0.0)) && !one.may_lie_along(&segment(0.0)));
        assert!(one.may_lie_along(&segment(f64::NAN)));
    }
}
