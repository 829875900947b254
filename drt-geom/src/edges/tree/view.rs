//! Where edges are looked at from, and which way.

use drt_math::{Real, Vec3};

use crate::edges::Lobes;

/// A point at which light scatters, as edges matter to it.
#[derive(Clone, Copy, Debug)]
pub struct Viewpoint {
    pub(super) x: Vec3,
    pub(super) normal: Option<(Vec3, bool)>,
    /// What is scattered from where.
    pub(super) lobes: Lobes,
}

/// One of several cones of directions to sample edges in.
#[derive(Clone, Copy, Debug)]
pub struct Way {
    /// The part of queries that go this way.
    pub(super) chance: f64,
    pub(super) cone: Option<Cone>,
    /// Edges farther away do not matter.
    pub(super) reach: f64,
}

/// Most ways of a query.
pub const MOST_WAYS: usize = 5;

/// A cone of directions less than a right angle wide on either side.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cone {
    /// Unit.
    pub(super) axis: Vec3,
    /// Of half its angle.
    pub(super) cos: f64,
    pub(super) sin: f64,
}

impl Viewpoint {
    /// A point `x` on a surface with the unit `normal`, or in a volume where there is none. With the
    /// normal goes whether light from below counts too; where it does not, what lies below the
    /// plane through `x` does not matter.
    #[must_use]
    pub fn new(x: Vec3, normal: Option<(Vec3, bool)>) -> Self {
        Self { x, normal, lobes: Lobes::even(1.0) }
    }

    /// The same, where directions count by their `lobes`.
    #[must_use]
    pub fn scattering(self, lobes: Lobes) -> Self {
        Self { lobes, ..self }
    }

    /// That of a direction and the normal; 1 in volumes.
    pub(super) fn cosine(&self, w: Vec3) -> f64 {
        self.normal.map_or(1.0, |(n, _)| Real::abs(n.dot(w)))
    }

    /// Looking only at what may be before a sphere, in the part `chance` of queries: in the cone of directions that meet it, up to its
    /// far side. From inside the sphere these are all directions.
    #[must_use]
    pub fn toward(&self, chance: f64, center: Vec3, radius: f64) -> Way {
        let to = center - self.x;
        let distance = to.length();
        let sin = radius / distance;
        let cone = (sin < 1.0).then(|| {
            let cos = Real::sqrt((1.0 - sin) * (1.0 + sin));
            Cone { axis: to / distance, cos, sin }
        });
        Way { chance, cone, reach: (distance + radius) * (1.0 + 1e-9) }
    }
}

impl Way {
    /// Looking at all edges there are, in the part `chance` of queries.
    #[must_use]
    pub const fn anywhere(chance: f64) -> Self {
        Self { chance, cone: None, reach: f64::INFINITY }
    }
}

impl Cone {
    /// The part of a line inside the cone whose apex is the origin, from `near` to `far` along it:
    /// an interval, as a cone is convex.
    pub(super) fn clip(
        &self,
        from: Vec3,
        tangent: Vec3,
        [near, far]: [f64; 2],
    ) -> Option<[f64; 2]> {
        let at = |s: f64| self.outside(from + tangent * s);
        if at(near) <= 0.0 && at(far) <= 0.0 {
            return Some([near, far]);
        }
        if at(0.5 * (near + far)) > 0.5 * (far - near) {
            return None;
        }
        // Where the distance from the axis, times the cosine, is that along it, times the sine: on
        // this nappe or the opposite one. And where the line leaves the half space before x.
        let [(p, p_aside), (t, t_aside)] = [from, tangent].map(|v| self.split(v));
        let (c2, s2) = (self.cos * self.cos, self.sin * self.sin);
        let a = c2 * t_aside.length_squared() - s2 * t * t;
        let half_b = c2 * p_aside.dot(t_aside) - s2 * p * t;
        let c = c2 * p_aside.length_squared() - s2 * p * p;
        let root = Real::sqrt(f64::max(0.0, half_b * half_b - a * c));
        let q = -(half_b + if half_b < 0.0 { -root } else { root });
        let mut cuts = [near, q / a, c / q, -p / t, far]
            .map(|s| if s.is_nan() { near } else { s.clamp(near, far) });
        cuts.sort_unstable_by(f64::total_cmp);
        let mut inside = None;
        for ends in cuts.windows(2).filter(|ends| ends[0] < ends[1]) {
            if at(0.5 * (ends[0] + ends[1])) <= 0.0 {
                let start = inside.map_or(ends[0], |[start, _]: [f64; 2]| start);
                inside = Some([start, ends[1]]);
            }
        }
        inside
    }

    /// Positive outside the cone whose apex is the origin, and there at most the distance from it.
    fn outside(&self, p: Vec3) -> f64 {
        let (along, aside) = self.split(p);
        aside.length() * self.cos - along * self.sin
    }

    /// A vector's component along the axis, and the rest of it.
    fn split(&self, v: Vec3) -> (f64, Vec3) {
        let along = v.dot(self.axis);
        (along, v - self.axis * along)
    }
}
