use crate::{Vec3, fm};

/// Directions uniform in solid angle over a triangle seen from a point, after Arvo 1995,
/// "Stratified Sampling of Spherical Triangles".
///
/// Unlike there, no angles are added and compared with pi: the sub-triangle is found from half its
/// spherical excess directly, so that small and distant triangles keep their digits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SphericalTriangle {
    /// Unit vectors to the corners, counter-clockwise as seen from outside the sphere.
    corners: [Vec3; 3],
    /// Unit tangent at the first corner, towards the third.
    tangent: Vec3,
    /// Sine and cosine of the angle at the first corner.
    sin_a: f64,
    cos_a: f64,
    /// Tangent of half the side from the first corner to the second.
    tan_half_c: f64,
    solid_angle: f64,
}

impl SphericalTriangle {
    /// The triangle with the given corners as seen from `eye`; `None` when it has no solid angle
    /// (or one that is not a number): seen edge-on, degenerate, or with a corner at the eye.
    #[must_use]
    pub fn new(eye: Vec3, corners: [Vec3; 3]) -> Option<Self> {
        let [a, mut b, mut c] = corners.map(|p| (p - eye).normalize());
        if a.dot(b.cross(c)) < 0.0 {
            (b, c) = (c, b);
        }
        // Chords in place of cosines: 1 - a.b = |b - a|^2 / 2 without cancellation.
        let (ab, ac) = (b - a, c - a);
        let volume = a.dot(ab.cross(ac));
        let solid_angle = 2.0 * fm::atan2(volume, 1.0 + a.dot(b) + b.dot(c) + c.dot(a));
        let towards_b = (ab + a * (0.5 * ab.length_squared())).normalize();
        let tangent = (ac + a * (0.5 * ac.length_squared())).normalize();
        let sin_a = towards_b.cross(tangent).length();
        let cos_a = towards_b.dot(tangent);
        let tan_half_c = ab.length() / (a + b).length();
        let fit = solid_angle > 0.0 && sin_a > 0.0 && tan_half_c > 0.0 && tan_half_c.is_finite();
        fit.then_some(Self { corners: [a, b, c], tangent, sin_a, cos_a, tan_half_c, solid_angle })
    }

    /// The solid angle, in (0, 2 pi).
    #[inline]
    #[must_use]
    pub fn solid_angle(&self) -> f64 {
        self.solid_angle
    }

    /// The direction (a unit vector) for two uniform numbers.
    #[inline]
    #[must_use]
    pub fn sample(&self, [u, v]: [f64; 2]) -> Vec3 {
        let [a, b, _] = self.corners;
        // The corner c' on the side from a to c that leaves the share u of the area: with E the
        // excess of (a, b, c') and k = tan(side(a, b) / 2),
        //   tan(side(a, c') / 2) = sin(E/2) / (k sin(A - E/2)) = p / q.
        let (p, cos_half) = fm::sin_cos(0.5 * u * self.solid_angle);
        let q = self.tan_half_c * (self.sin_a * cos_half - self.cos_a * p);
        let c = (a * (q * q - p * p) + self.tangent * (2.0 * p * q)) / (q * q + p * p);
        // On the arc from b to c', areas are proportional to 1 - cos.
        let chord = c - b;
        let h = 0.5 * chord.length_squared();
        let away = (chord + b * h).normalize();
        let h = v * h;
        let w = b * (1.0 - h) + away * fm::sqrt((h * (2.0 - h)).max(0.0));
        // c' = b happens when the triangle is a needle and u is tiny.
        if w.is_finite() { w.normalize() } else { b }
    }

    /// Density in solid angle at the unit vector `w`: `1 / solid_angle` inside the triangle.
    ///
    /// For directions that came from elsewhere. Rounding may put a sample of this triangle just
    /// beyond an edge: its density is `1 / solid_angle` all the same.
    #[inline]
    #[must_use]
    pub fn pdf(&self, w: Vec3) -> f64 {
        let [a, b, c] = self.corners;
        let inside = [(a, b), (b, c), (c, a)].iter().all(|(p, q)| w.dot(p.cross(*q)) >= 0.0);
        if inside { 1.0 / self.solid_angle } else { 0.0 }
    }
}
