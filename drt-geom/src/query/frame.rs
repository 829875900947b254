//! Single-precision boxes that lose no double-precision hit, in scenes of things of any sizes and distances.
//!
//! The tree holds its boxes in `f32`, in coordinates that have most things near zero, where such numbers are
//! finest, and everything within [-1, 1]. A ray is first clipped to the scene's box in `f64`, so that its origin has
//! such coordinates too, however far away it started. Each rounding of a slab test then shifts a plane by
//! 2^-24 of its coordinate and of that of the origin: six of them (conversion of the origin, difference, inverse
//! direction, product, conversion of where hits end the ray, and one to spare). So a plane is moved outward by
//! 2^-21 of its own coordinate when the tree is built, and by as much of the origin's coordinate by every ray, which
//! has two origins: one for the planes that it enters by and one for those that it leaves by. What a box
//! is enlarged by depends on where it and the ray are, and not on how large the scene is.
//!
//! The rounding of the hits themselves moves a triangle by a few 2^-53 of its distance from where the ray
//! started. Rays add 2^-46 of the largest coordinate of that point, or of the scene, for it.

use alloc::vec::Vec;

use drt_math::{Ray, Real, Vec3};

use crate::Aabb;

/// What planes are moved by, relative to the coordinates of a plane or of a ray's origin.
const RELATIVE: f64 = 1.0 / (1 << 21) as f64;

/// What planes are moved by for hits in double precision, relative to the largest coordinate.
const HITS: f64 = 1.0 / (1_u64 << 46) as f64;

/// What the scene's box is enlarged by on all sides for the clipping of rays.
const REACH: f64 = 1.0 / (1 << 20) as f64;

/// Direction coordinates nearer to zero than this are zero, and their inverse is that of this: over the
/// whole scene either moves the ray by less than 1e-20.
const STILL: f32 = 1e-30;

/// Coordinates whose squares might be too large. To a point as far as this all boxes are equally near.
const REMOTE: f64 = (1_u64 << 60) as f64;

/// The map from the scene's coordinates to those of the boxes.
#[derive(Clone, Copy, Debug)]
pub(super) struct BoxFrame {
    center: Vec3,
    scale: f64,
    /// The scene's box, enlarged.
    low: [f64; 3],
    high: [f64; 3],
}

/// A box in the tree's coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Box32 {
    pub(super) min: [f32; 3],
    pub(super) max: [f32; 3],
}

/// A ray in the tree's coordinates, for box tests only.
#[derive(Clone, Copy, Debug)]
pub(super) struct BoxRay {
    /// Where it starts for the planes that it enters boxes by.
    pub(super) enter: [f32; 3],
    /// Where it starts for those that it leaves them by.
    pub(super) leave: [f32; 3],
    pub(super) inverse: [f32; 3],
    /// Where the ray ends, in its own parameter.
    pub(super) far: f32,
    start: f64,
    rate: f64,
}

/// A point in the tree's coordinates, for distances to boxes only.
///
/// No computed distance is more than the true one to anything in the box: the point is two, each moved towards the
/// planes it is compared with by what roundings may add, as the planes are; and the factor makes up for the
/// roundings of squares and sums.
#[derive(Clone, Copy, Debug)]
pub(super) struct BoxPoint {
    /// The point for the boxes' lower bounds.
    pub(super) below: [f32; 3],
    /// The point for their upper bounds.
    pub(super) above: [f32; 3],
    /// Factor of the squared distances.
    pub(super) trust: f32,
    /// The squared distance up to which boxes count.
    pub(super) far: f32,
}

impl BoxFrame {
    /// The frame of a scene with the given bounds. `places` are those of the things in it: most of them are near zero in the tree's
    /// coordinates.
    pub(super) fn new(bounds: &Aabb, places: impl Iterator<Item = Vec3> + Clone) -> Self {
        let center = Vec3::from([0, 1, 2].map(|k| median(places.clone().map(|p| p[k]))));
        let half = (bounds.max - center).max_abs().max((bounds.min - center).max_abs());
        let scale = if half > 0.0 { 1.0 / half } else { 1.0 };
        let mut frame = Self { center, scale, low: [0.0; 3], high: [0.0; 3] };
        frame.low = frame.local(bounds.min).map(|c| c - REACH);
        frame.high = frame.local(bounds.max).map(|c| c + REACH);
        frame
    }

    /// A point in the tree's coordinates.
    pub(super) fn local(&self, p: Vec3) -> [f64; 3] {
        ((p - self.center) * self.scale).to_array()
    }

    /// A squared distance in the tree's coordinates. Never as far as boxes that are not there.
    pub(super) fn squared(&self, squared: f64) -> f32 {
        (squared * (self.scale * self.scale)).min(f32::MAX.into()) as f32
    }

    /// The padded box of some points, rounded outward.
    pub(super) fn enclose(&self, points: &[Vec3; 3]) -> Box32 {
        points.iter().fold(Box32::EMPTY, |b, p| {
            let l = self.local(*p);
            b.union(&Box32 {
                min: l.map(|c| round_down(c - margin(c))),
                max: l.map(|c| round_up(c + margin(c))),
            })
        })
    }

    /// A point for distances to boxes, of which those farther than the given squared distance do not
    /// count.
    pub(super) fn point(&self, p: Vec3, squared: f64) -> BoxPoint {
        let far = self.squared(squared);
        let local = self.local(p);
        if local.iter().all(|c| c.abs() < REMOTE) {
            let below = local.map(|c| (c + margin(c)) as f32);
            let above = local.map(|c| (c - margin(c)) as f32);
            BoxPoint { below, above, trust: 1.0 - 4.0 * RELATIVE as f32, far }
        } else {
            BoxPoint { below: [0.0; 3], above: [0.0; 3], trust: 0.0, far }
        }
    }

    /// The part of the ray near the scene; `None` when it passes the scene by.
    #[inline(always)]
    pub(super) fn clip(&self, ray: &Ray) -> Option<BoxRay> {
        let rate = ray.dir.max_abs() * self.scale;
        let origin = self.local(ray.origin);
        // Zero times what is not finite is no number.
        let nothing = (ray.origin + ray.dir) * 0.0;
        if !(rate > 0.0 && rate < f64::INFINITY && nothing.x + nothing.y + nothing.z == 0.0) {
            return None;
        }
        let dir = (ray.dir * self.scale).to_array();
        // Margins are far more than a rounding of these.
        let per = dir.map(|d| 1.0 / d);
        let (mut near, mut far) = (0.0, ray.t_max);
        for k in 0..3 {
            let (low, high) = (self.low[k] - origin[k], self.high[k] - origin[k]);
            if dir[k] != 0.0 {
                let (a, b) = (low * per[k], high * per[k]);
                near = greater(near, lesser(a, b));
                far = lesser(far, greater(a, b));
            } else if low > 0.0 || high < 0.0 {
                return None;
            }
        }
        // Also turns away a NaN end.
        if !(near <= far && ray.t_max > 0.0) {
            return None;
        }
        let hits = HITS
            * greater(1.0, greater(origin[0].abs(), greater(origin[1].abs(), origin[2].abs())));
        let (mut enter, mut leave, mut inverse) = ([0.0; 3], [0.0; 3], [0.0; 3]);
        for k in 0..3 {
            let per = (per[k] * rate) as f32;
            inverse[k] = if per.abs() > 1.0 / STILL { 1.0 / STILL } else { per };
            let start = origin[k] + near * dir[k];
            let margin = (RELATIVE * start.abs() + hits).copysign(inverse[k].into());
            enter[k] = (start + margin) as f32;
            leave[k] = (start - margin) as f32;
        }
        let far = ((far - near) * rate) as f32;
        Some(BoxRay { enter, leave, inverse, far, start: near, rate })
    }
}

impl BoxRay {
    /// The box parameter behind which nothing nearer than the scene's `t` can be.
    ///
    /// Margins less roundings put a box's entry before any hit in it by more than this is rounded by.
    #[inline]
    pub(super) fn limit(&self, t: f64) -> f32 {
        ((t - self.start) * self.rate) as f32
    }
}

impl Box32 {
    pub(super) const EMPTY: Self = Self { min: [f32::INFINITY; 3], max: [f32::NEG_INFINITY; 3] };

    /// The box around some boxes.
    pub(super) fn around(boxes: impl IntoIterator<Item = Self>) -> Self {
        boxes.into_iter().fold(Self::EMPTY, |b, o| b.union(&o))
    }

    #[must_use]
    pub(super) fn union(&self, o: &Self) -> Self {
        let pick = |f: fn(f32, f32) -> f32, a: &[f32; 3], b: &[f32; 3]| {
            [f(a[0], b[0]), f(a[1], b[1]), f(a[2], b[2])]
        };
        Self { min: pick(f32::min, &self.min, &o.min), max: pick(f32::max, &self.max, &o.max) }
    }

    /// Half the surface area; zero for the empty box.
    pub(super) fn half_area(&self) -> f32 {
        let [x, y, z] = [0, 1, 2].map(|k| (self.max[k] - self.min[k]).max(0.0));
        x * y + y * z + z * x
    }

    /// Twice the middle.
    pub(super) fn doubled_center(&self) -> [f32; 3] {
        [0, 1, 2].map(|k| self.min[k] + self.max[k])
    }
}

/// What a plane or point is moved by at a coordinate. At zero that is little, but no box is flat.
#[inline(always)]
fn margin(c: f64) -> f64 {
    RELATIVE * Real::abs(c) + HITS
}

/// The middle one of some numbers; zero of none.
fn median(numbers: impl Iterator<Item = f64>) -> f64 {
    let mut numbers: Vec<f64> = numbers.collect();
    if numbers.is_empty() {
        return 0.0;
    }
    let middle = numbers.len() / 2;
    *numbers.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// The lesser, in one instruction; the first where one is no number.
#[inline(always)]
fn lesser(a: f64, b: f64) -> f64 {
    if b < a { b } else { a }
}

/// The greater, in one instruction; the first where one is no number.
#[inline(always)]
fn greater(a: f64, b: f64) -> f64 {
    if b > a { b } else { a }
}

fn round_down(x: f64) -> f32 {
    let r = x as f32;
    if f64::from(r) > x { r.next_down() } else { r }
}

fn round_up(x: f64) -> f32 {
    let r = x as f32;
    if f64::from(r) < x { r.next_up() } else { r }
}
