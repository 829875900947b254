//! Single-precision boxes that lose no double-precision hit.
//!
//! The tree holds its boxes in `f32`, in coordinates centred on the scene and scaled to [-1, 1].
//! A ray is first clipped to the scene's box in `f64`, so that its origin has such coordinates too,
//! however far away it started. All roundings of a slab test then shift box planes by at most
//! about 21 · 2^-24 (conversion of the origin 1, difference 2, inverse direction and products 6,
//! quantization of compressed boxes 6, their decompression 6), and every box is padded by
//! 64 · 2^-24. The rounding of the hits themselves moves a triangle by a few 2^-53 of its distance
//! from the ray's origin, which is less than the padding left as long as the origin is within 2^28
//! scene sizes.

use drt_math::Vec3;

use super::ray::Ray;
use crate::Aabb;

/// Padding of every box, in units of the scene's half extent.
const PADDING: f64 = 1.0 / (1 << 18) as f64;

/// Length (largest coordinate) of a box ray's direction. So short that the padding alone keeps a ray
/// in the box it starts in for a t of one or more: traversals that ignore everything below some
/// small t (some do below 1e-4) then still see every box.
const SPEED: f64 = 1.0 / (1 << 20) as f64;

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
    pub(super) origin: [f32; 3],
    pub(super) inverse: [f32; 3],
    /// Where the ray ends, in its own parameter.
    pub(super) far: f32,
    start: f64,
    rate: f64,
}

/// A point in the tree's coordinates, for distances to boxes only.
///
/// No computed distance is more than the true one to anything in the box. For a point within 4 of
/// the centre, rounding it and the differences (by less than 2^-20) is less than the padding;
/// farther out it is less than 2^-21 of the distance, and the factor makes up for it and for the
/// roundings of squares and sums.
#[derive(Clone, Copy, Debug)]
pub(super) struct BoxPoint {
    pub(super) point: [f32; 3],
    /// Factor of the squared distances.
    pub(super) trust: f32,
    /// The squared distance up to which boxes count.
    pub(super) far: f32,
}

impl BoxFrame {
    /// The frame of a scene with the given bounds.
    pub(super) fn new(bounds: &Aabb) -> Self {
        let half = bounds.extent().max_abs() * 0.5;
        Self { center: bounds.center(), scale: if half > 0.0 { 1.0 / half } else { 1.0 } }
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
                min: l.map(|c| round_down(c - PADDING)),
                max: l.map(|c| round_up(c + PADDING)),
            })
        })
    }

    /// A point for distances to boxes, of which those farther than the given squared distance do not
    /// count.
    pub(super) fn point(&self, p: Vec3, squared: f64) -> BoxPoint {
        let far = self.squared(squared);
        let local = self.local(p);
        if local.iter().all(|c| c.abs() < REMOTE) {
            BoxPoint { point: local.map(|c| c as f32), trust: 1.0 - 2.0 * PADDING as f32, far }
        } else {
            BoxPoint { point: [0.0; 3], trust: 0.0, far }
        }
    }

    /// The part of the ray near the scene; `None` when it passes the scene by.
    #[inline(always)]
    pub(super) fn clip(&self, ray: &Ray) -> Option<BoxRay> {
        let speed = ray.dir.max_abs() * self.scale;
        let origin = self.local(ray.origin);
        // Zero times what is not finite is no number.
        let nothing = (ray.origin + ray.dir) * 0.0;
        if !(speed > 0.0 && speed < f64::INFINITY && nothing.x + nothing.y + nothing.z == 0.0) {
            return None;
        }
        let dir = (ray.dir * self.scale).to_array();
        // Padding is far more than a rounding of these.
        let per = dir.map(|d| 1.0 / d);
        let (mut near, mut far) = (0.0, ray.t_max);
        for k in 0..3 {
            let reach = 1.0 + 2.0 * PADDING;
            if dir[k] != 0.0 {
                let (a, b) = ((-reach - origin[k]) * per[k], (reach - origin[k]) * per[k]);
                near = greater(near, lesser(a, b));
                far = lesser(far, greater(a, b));
            } else if origin[k].abs() > reach {
                return None;
            }
        }
        // Also turns away a NaN end.
        if !(near <= far && ray.t_max > 0.0) {
            return None;
        }
        let rate = speed / SPEED;
        let inverse = per.map(|p| {
            let inverse = (p * rate) as f32;
            if inverse.abs() > 1.0 / STILL { 1.0 / STILL } else { inverse }
        });
        Some(BoxRay {
            origin: [0, 1, 2].map(|k| (origin[k] + near * dir[k]) as f32),
            inverse,
            far: ((far - near) * rate) as f32 + 1.0,
            start: near,
            rate,
        })
    }
}

impl BoxRay {
    /// The box parameter behind which nothing nearer than the scene's `t` can be.
    ///
    /// Padding less roundings puts a box's entry two or more before any hit in it, and parameters
    /// stay below 2^22, so rounding to nearest (by at most 1/4) is enough.
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
