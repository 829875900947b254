use drt_math::{Vec3, fm};

/// Squared sine of an angle below which its functions come from their series.
const SMALL: f64 = 1e-3;

/// What a point sees of an edge: the angle θ between the directions to its ends, as
/// g = θ / |d_i × d_j|, with the gradient of that.
#[derive(Clone, Copy, Debug)]
pub(super) struct EdgeView {
    /// d_i × d_j.
    pub(super) cross: Vec3,
    /// θ / |d_i × d_j|.
    pub(super) g: f64,
    /// Gradient of g with respect to the point.
    pub(super) gradient: Vec3,
}

impl EdgeView {
    /// The view from the origin of the edge from `di` to `dj`, which must not pass through it.
    #[inline]
    pub(super) fn new(di: Vec3, dj: Vec3) -> Self {
        let cross = di.cross(dj);
        let (squared, cosine) = (cross.length_squared(), di.dot(dj));
        let lengths_squared = di.length_squared() * dj.length_squared();
        let inverse = 1.0 / lengths_squared;
        let z = squared * inverse;
        // slope = (cos θ / (|d_i| |d_j|) - g) / |d_i × d_j|².
        let (g, slope) = if cosine > 0.0 && z < SMALL {
            let per_length = fm::sqrt(inverse);
            (arc(z) * per_length, -arc_slope(z) * per_length * inverse)
        } else {
            let sine = fm::sqrt(squared);
            let g = fm::atan2(sine, cosine) / sine;
            (g, (cosine * inverse - g) / squared)
        };
        let gradient = (di + dj) * inverse + cross.cross(dj - di) * slope;
        Self { cross, g, gradient }
    }
}

/// asin(s) / s as a series in z = s².
fn arc(z: f64) -> f64 {
    1.0 + z * (1.0 / 6.0 + z * (3.0 / 40.0 + z * (5.0 / 112.0 + z * (35.0 / 1152.0))))
}

/// (asin(s) / s - sqrt(1 - s²)) / s² as a series in z = s².
fn arc_slope(z: f64) -> f64 {
    2.0 / 3.0 + z * (1.0 / 5.0 + z * (3.0 / 28.0 + z * (5.0 / 72.0 + z * (35.0 / 704.0))))
}
