use drt_math::{Real, Vec3, vec3};

/// Relative rounding errors of a point's distance from a plane.
const ROUNDING: f64 = 1e-9;

/// An axis-aligned box; empty when `min > max`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Aabb {
    /// Smallest coordinates.
    pub min: Vec3,
    /// Largest coordinates.
    pub max: Vec3,
}

impl Aabb {
    /// The box of no points.
    pub const EMPTY: Self = Self {
        min: vec3(f64::INFINITY, f64::INFINITY, f64::INFINITY),
        max: vec3(f64::NEG_INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY),
    };

    /// The smallest box around some points.
    #[must_use]
    pub fn around(points: impl IntoIterator<Item = impl Into<Vec3>>) -> Self {
        points
            .into_iter()
            .map(Into::into)
            .fold(Self::EMPTY, |b, p| Self { min: b.min.min(p), max: b.max.max(p) })
    }
    /// The smallest box around two boxes.
    #[must_use]
    pub fn union(&self, o: &Self) -> Self {
        Self { min: self.min.min(o.min), max: self.max.max(o.max) }
    }
    /// True when it holds no point.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        !(self.min.x <= self.max.x && self.min.y <= self.max.y && self.min.z <= self.max.z)
    }
    /// The middle; not finite for the empty box.
    #[must_use]
    pub fn center(&self) -> Vec3 {
        self.min * 0.5 + self.max * 0.5
    }
    /// Edge lengths; negative for the empty box.
    #[must_use]
    pub fn extent(&self) -> Vec3 {
        self.max - self.min
    }
    /// True when the boxes have a point in common, on their boundaries at least.
    #[must_use]
    pub fn meets(&self, o: &Self) -> bool {
        (0..3).all(|k| self.min[k] <= o.max[k] && o.min[k] <= self.max[k])
    }
    /// The least and greatest signed distance n·(x - `at`) of its points, times the length of `n`; moved
    /// apart by rounding errors.
    #[must_use]
    pub fn signed_distances(&self, at: Vec3, n: Vec3) -> (f64, f64) {
        let (centre, half) = (self.center() - at, self.extent() * 0.5);
        let sum = |v: Vec3| {
            Real::abs(n.x) * Real::abs(v.x)
                + Real::abs(n.y) * Real::abs(v.y)
                + Real::abs(n.z) * Real::abs(v.z)
        };
        let (middle, reach) = (n.dot(centre), sum(half));
        // Of the coordinates themselves, which may be much larger than their differences.
        let rounding = ROUNDING * (sum(at) + sum(self.center()) + reach);
        (middle - reach - rounding, middle + reach + rounding)
    }
    /// True when the point lies inside or on the boundary.
    #[must_use]
    pub fn contains(&self, p: Vec3) -> bool {
        (0..3).all(|k| self.min[k] <= p[k] && p[k] <= self.max[k])
    }
}
