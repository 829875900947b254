//! A viewpoint as groups of eight see it, in single precision.
//!
//! Each group has its own origin and unit of length, so that what is far from the scene's origin or
//! small loses nothing. A product of a place with a unit vector is then off by a few times 1e-7 of the
//! place's distance: less than [`TOLERANCE`], by which every bound is widened.

use core::f32::consts::FRAC_2_PI;

use drt_math::{Vec3, fm};

use crate::edges::tree::eight::{Eight, Vectors, along, dot, each, pairs, same, single};
use crate::edges::tree::view::{Cone, Viewpoint, Way};
use crate::edges::{Lobe, Lobes};

/// What has the sign of a bound may be beyond it by this part of distances.
const TOLERANCE: f32 = 2e-6;

/// What may count has left at least this part of its weight.
pub(super) const ALMOST_NOTHING: f32 = 1e-6;

/// ...and this weight.
const LEAST: f32 = 1e-36;

/// Nothing weighs more.
const MOST_WEIGHT: f32 = 1e30;

/// An origin and a unit of length.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub(super) center: Vec3,
    /// 1 over the unit.
    pub(super) scale: f64,
}

/// A viewpoint in single precision.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seen {
    x: Vec3,
    /// What rounding may move places by.
    slack: f64,
    /// Unit, and whether what is below counts too.
    pub(super) normal: Option<([f32; 3], bool)>,
    pub(super) even: f32,
    /// The axis, width and height of lobes, where there are any.
    lobes: Option<[([f32; 3], f32, f32); 2]>,
}

/// A [`Way`] in single precision.
#[derive(Clone, Copy, Debug)]
pub(super) struct Toward {
    /// The axis, and cosine and sine of half the angle.
    cone: Option<([f32; 3], f32, f32)>,
    reach: f64,
}

/// A viewpoint among the coordinates of a group.
#[derive(Clone, Copy, Debug)]
pub(super) struct Local {
    x: [f32; 3],
    pub(super) tolerance: f32,
}

/// Where a group lies, seen one way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Lies {
    /// Nothing of it counts.
    Outside,
    /// All of it is in the cone and near enough.
    Inside,
    Across,
}

impl Place {
    /// Around a box.
    pub(super) fn new(low: Vec3, high: Vec3) -> Self {
        let size = 0.5 * (high - low).length();
        Self { center: low.lerp(high, 0.5), scale: 1.0 / size.max(1e-100) }
    }

    /// Coordinates of a place.
    #[inline(always)]
    pub(super) fn of(&self, x: Vec3) -> Vec3 {
        (x - self.center) * self.scale
    }
}

impl Seen {
    /// `None` where nothing is scattered.
    #[inline(always)]
    pub(super) fn new(view: &Viewpoint, slack: f64) -> Option<Self> {
        let Viewpoint { x, normal, lobes: Lobes { even, lobes } } = view;
        let seen = lobes.map(|l| {
            // Of what is narrower the squares would be no numbers.
            (single(l.axis), (l.width2 as f32).max(1e-18), l.height as f32)
        });
        let glossy = seen.iter().any(|(_, _, height)| *height > 0.0);
        (x.is_finite() && (*even > 0.0 || glossy)).then(|| Self {
            x: *x,
            slack,
            normal: normal.map(|(n, through)| (single(n), through)),
            even: *even as f32,
            lobes: glossy.then_some(seen),
        })
    }

    #[inline(always)]
    pub(super) fn local(&self, place: &Place) -> Local {
        let x = single(place.of(self.x));
        let extent = x[0].abs() + x[1].abs() + x[2].abs() + 2.0;
        let tolerance = TOLERANCE * extent + 4.0 * (self.slack * place.scale) as f32;
        Local { x, tolerance }
    }

    /// What is scattered from places `to` away, of the squared distance `r2`, over which something
    /// reaches `size2` in mean square, and which is seen at a given mean `cosine` to the normal.
    #[inline(always)]
    pub(super) fn scattering(&self, to: Vectors, r2: Eight, size2: Eight, cosine: Eight) -> Eight {
        let even = cosine * self.even;
        let Some(lobes) = &self.lobes else { return even };
        let r = r2.sqrt().max(Eight::splat(LEAST));
        let (dir, spread) = (each(to, |c| c / r), size2 / r2.max(Eight::splat(LEAST)));
        let mut sum = even;
        for (axis, width2, height) in lobes {
            let off = pairs(dir, same(*axis), |a, b| a - b);
            let width2 = Eight::splat(*width2) + spread;
            sum = sum + Lobe::value(Eight::splat(*height), width2, dot(off, off));
        }
        sum
    }

    #[inline(always)]
    pub(super) fn is_glossy(&self) -> bool {
        self.lobes.is_some()
    }

    /// What lobes scatter from arcs between two directions, in the mean: as much as from the place on the arc
    /// that is nearest to the axis, along the part that is about as far from it,
    ///
    /// ```text
    /// ∫ ds / (a² + s²)² = π / (2 a³),    a² = w² + off².
    /// ```
    #[inline(always)]
    pub(super) fn glossy(&self, from: Vectors, until: Vectors) -> Eight {
        let mut sum = Eight::ZERO;
        let Some(lobes) = &self.lobes else { return sum };
        let chord = pairs(until, from, |a, b| a - b);
        let length2 = dot(chord, chord).max(Eight::splat(LEAST));
        let length = length2.sqrt();
        for (axis, width2, height) in lobes {
            let to = pairs(same(*axis), from, |a, b| a - b);
            let t = (dot(to, chord) / length2).max(Eight::ZERO).min(Eight::ONE);
            let near = along(from, chord, t);
            let norm = dot(near, near).sqrt().max(Eight::splat(LEAST));
            let off = pairs(near, same(*axis), |a, b| a / norm - b);
            let [width2, off2] = [Eight::splat(*width2), dot(off, off)];
            let value = Lobe::value(Eight::splat(*height), width2, off2);
            sum = sum + value / (length / (width2 + off2).sqrt() * FRAC_2_PI + 1.0);
        }
        sum
    }
}

impl Local {
    /// The viewpoint, eight times.
    #[inline(always)]
    pub(super) fn x(&self) -> Vectors {
        same(self.x)
    }
}

impl From<&Way> for Toward {
    #[inline(always)]
    fn from(way: &Way) -> Self {
        let of = |c: Cone| (single(c.axis), c.cos as f32, c.sin as f32);
        Self { cone: way.cone.map(of), reach: way.reach }
    }
}

impl Toward {
    /// Where a group lies, going by the sphere of radius 1 around its box.
    #[inline(always)]
    pub(super) fn lies(&self, local: &Local, place: &Place) -> Lies {
        if self.cone.is_none() && self.reach == f64::INFINITY {
            return Lies::Inside;
        }
        let radius = 1.0 + local.tolerance;
        let [x, y, z] = [-local.x[0], -local.x[1], -local.x[2]];
        let length2 = x * x + y * y + z * z;
        let length = fm::sqrt(f64::from(length2)) as f32;
        let reach = (self.reach * place.scale) as f32;
        // How far the centre is from where things count, or less.
        let mut outside = length - reach;
        if let Some((axis, cos, sin)) = self.cone {
            let ahead = x * axis[0] + y * axis[1] + z * axis[2];
            let aside = [x - axis[0] * ahead, y - axis[1] * ahead, z - axis[2] * ahead];
            let off2 = aside[0] * aside[0] + aside[1] * aside[1] + aside[2] * aside[2];
            outside = outside.max(fm::sqrt(f64::from(off2)) as f32 * cos - ahead * sin);
        }
        if outside > radius {
            Lies::Outside
        } else if outside < -radius {
            Lies::Inside
        } else {
            Lies::Across
        }
    }

    /// How far away things may be, squared.
    #[inline(always)]
    pub(super) fn reach2(&self, local: &Local, place: &Place) -> Eight {
        let reach = (self.reach * place.scale) as f32 * (1.0 + TOLERANCE) + local.tolerance;
        Eight::splat(reach * reach)
    }

    /// An estimate of how much of boxes lies in the cone: 0 only if nothing does, 1 where all does.
    /// `center` are the boxes' middles from the viewpoint, `half` half their edges.
    ///
    /// The plane that touches the cone in its line nearest to a box's centre has the cone on one
    /// side. Where the box lies on the other they are apart.
    #[inline(always)]
    pub(super) fn overlap(&self, local: &Local, center: Vectors, half: Vectors) -> Eight {
        let Some((_, _, sin)) = self.cone else { return Eight::ONE };
        let (normal, outside) = self.plane(center);
        let reach = dot(each(normal, Eight::abs), half) + Eight::splat(local.tolerance);
        let least = Eight::splat(ALMOST_NOTHING);
        let across = ((reach - outside) / (reach * 2.0)).max(least).min(Eight::ONE);
        let wide = dot(center, center).sqrt() * sin / reach;
        let part = across * wide.max(least).min(Eight::ONE);
        reach.less(outside, Eight::ZERO, part)
    }

    /// The parts from `near` to `far` along lines as far as the planes leave them that touch the
    /// cone nearest to their ends; and true where that is less than all. `from` is where the lines
    /// start from the viewpoint.
    #[inline(always)]
    pub(super) fn clip(
        &self,
        local: &Local,
        from: Vectors,
        tangent: Vectors,
        [near, far]: [Eight; 2],
    ) -> ([Eight; 2], bool) {
        if self.cone.is_none() {
            return ([near, far], false);
        }
        let tolerance = Eight::splat(local.tolerance);
        let (mut low, mut high) = (near, far);
        let mut cut = false;
        for end in [near, far] {
            let (normal, _) = self.plane(along(from, tangent, end));
            let a = dot(normal, along(from, tangent, near)) - tolerance;
            let b = dot(normal, along(from, tangent, far)) - tolerance;
            let zero = near + (far - near) * (a / (a - b));
            // Where both ends are outside, nothing is left.
            low = Eight::ZERO.less(a, Eight::ZERO.less(b, far, zero.max(low)), low);
            high = Eight::ZERO.less(b, zero.min(high), high);
            cut |= Eight::ZERO.any_less(a) | Eight::ZERO.any_less(b);
        }
        ([low, high], cut)
    }

    /// The normals of planes that touch the cone in its lines nearest to given places, away from the
    /// cone, and the places' distances from them. On the axis there is none, and both are 0.
    #[inline(always)]
    fn plane(&self, place: Vectors) -> (Vectors, Eight) {
        let (axis, cos, sin) = self.cone.unwrap_or_default();
        let axis = same(axis);
        let ahead = dot(place, axis);
        let aside = along(place, axis, Eight::ZERO - ahead);
        // Close to the axis most of the first difference is rounding.
        let aside = along(aside, axis, Eight::ZERO - dot(aside, axis));
        let off = dot(aside, aside).sqrt();
        let unit = Eight::splat(cos) / off.max(Eight::splat(LEAST));
        let normal = pairs(aside, axis, |a, n| a * unit - n * sin);
        let outside = off * cos - ahead * sin;
        let least = ahead.abs() * 1e-5;
        let normal = each(normal, |v| least.less(off, v, Eight::ZERO));
        (normal, least.less(off, outside, Eight::ZERO))
    }
}

/// Weights of what may count, 0 of the rest: never too small to be more than that, nor no number.
#[inline(always)]
pub(super) fn weights(counts: Eight, weight: Eight) -> Eight {
    let some = weight.max(Eight::splat(LEAST)).min(Eight::splat(MOST_WEIGHT));
    Eight::ZERO.less(counts, some, Eight::ZERO)
}
