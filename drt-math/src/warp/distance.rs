use crate::{Vec3, fm};

/// A distance in [0, t_max] with density proportional to `exp(-sigma t)`: free flight in a medium
/// of extinction `sigma >= 0`, on the condition that it ends before `t_max`.
///
/// `t_max` may be infinite when `sigma` is positive. As `sigma` goes to zero the distance becomes
/// uniform, without loss of digits on the way.
#[inline]
#[must_use]
pub fn truncated_exponential(u: f64, sigma: f64, t_max: f64) -> f64 {
    let depth = sigma * t_max;
    if depth < f64::EPSILON {
        return u * t_max;
    }
    (-fm::ln_1p(u * fm::exp_m1(-depth)) / sigma).min(t_max)
}

/// Density of [`truncated_exponential`] in length:
/// `sigma exp(-sigma t) / (1 - exp(-sigma t_max))`.
#[inline]
#[must_use]
pub fn truncated_exponential_pdf(t: f64, sigma: f64, t_max: f64) -> f64 {
    if !(0.0..=t_max).contains(&t) {
        return 0.0;
    }
    let depth = sigma * t_max;
    if depth < f64::EPSILON {
        return 1.0 / t_max;
    }
    sigma * fm::exp(-sigma * t) / -fm::exp_m1(-depth)
}

/// Distances along a ray with density proportional to the inverse squared distance to a point off
/// the ray: equal angles seen from the point get equal probability (Kulla & Fajardo 2012,
/// "Importance Sampling Techniques for Path Tracing in Participating Media", section 4).
///
/// ```
/// use drt_math::{Vec3, vec3, warp::Equiangular};
/// let along = Equiangular::new(Vec3::ZERO, Vec3::X, vec3(2.0, 1.0, 0.0), 0.0, 4.0);
/// let t = along.sample(0.5);
/// assert!((t - 2.0).abs() < 1e-15 && along.pdf(t) > along.pdf(0.0));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Equiangular {
    t_min: f64,
    t_max: f64,
    /// Where on the ray the point is nearest.
    nearest: f64,
    /// How near it is there.
    distance: f64,
    /// The angle under which the point sees the segment, in (0, pi).
    angle: f64,
}

/// The square of this is still a normal number.
const SHORTEST: f64 = 1e-150;

impl Equiangular {
    /// The part `t_min < t < t_max` of the ray `origin + t direction` (a unit vector), seen from
    /// `point`. `t_max` may be infinite.
    ///
    /// A point nearer to the ray than a 1e-9th of its distance to the segment's farther end (the
    /// finite one) is taken to be that far away: sampling and density remain a matching pair and
    /// finite.
    #[must_use]
    pub fn new(origin: Vec3, direction: Vec3, point: Vec3, t_min: f64, t_max: f64) -> Self {
        let to_point = point - origin;
        let nearest = to_point.dot(direction);
        let (a, b) = (t_min - nearest, t_max - nearest);
        let reach = if b.is_finite() { f64::max(a.abs(), b.abs()) } else { a.abs() };
        let distance = to_point.reject(direction).length().max(1e-9 * reach).max(SHORTEST);
        let angle = if b.is_finite() {
            fm::atan2(distance * (b - a), distance * distance + a * b)
        } else {
            fm::atan2(distance, a)
        };
        Self { t_min, t_max, nearest, distance, angle }
    }

    /// The distance for a uniform number.
    #[inline]
    #[must_use]
    pub fn sample(&self, u: f64) -> f64 {
        // distance * tan(theta_min + u angle), with the tangent of the sum written out: theta_min
        // itself would lose the digits of a small angle.
        let a = self.t_min - self.nearest;
        let (s, c) = fm::sin_cos(u * self.angle);
        let from_nearest =
            self.distance * (a * c + self.distance * s) / (self.distance * c - a * s);
        (self.nearest + from_nearest).clamp(self.t_min, self.t_max)
    }

    /// Density in length: `D / (angle (D^2 + (t - nearest)^2))` on the segment.
    #[inline]
    #[must_use]
    pub fn pdf(&self, t: f64) -> f64 {
        if !(self.t_min..=self.t_max).contains(&t) {
            return 0.0;
        }
        let from_nearest = t - self.nearest;
        self.distance / (self.angle * (self.distance * self.distance + from_nearest * from_nearest))
    }
}
