use core::f64::consts::PI;

use drt_math::{Real, Vec3, fm, warp};

use crate::Aabb;

/// An edge with the half-planes of the two faces that decide what is grazed there: the only one of an
/// open edge, twice; those beside the [widest gap](crate::edges::Fan::widest_gap) of more than two.
///
/// A direction *grazes* the edge where all faces lie on one side of the plane through both.
#[derive(Clone, Copy, Debug)]
pub struct Wedge {
    /// Where it starts and ends.
    pub ends: [Vec3; 2],
    /// Unit, from the first end to the second.
    pub tangent: Vec3,
    /// Distance of the ends.
    pub length: f64,
    /// The faces, by numbers of the caller's.
    pub faces: [u32; 2],
    /// Unit, across the edge into each face.
    pub across: [Vec3; 2],
    /// Angle between the faces in radians; 0 for an open edge.
    pub between: f64,
}

impl Wedge {
    /// An edge between two `ends` of faces with the given corners `opposite` to it; `None` where it
    /// has no length or a face no area.
    #[must_use]
    pub fn new(ends: [Vec3; 2], opposite: [Vec3; 2], faces: [u32; 2]) -> Option<Self> {
        let [a, b] = ends;
        let length = (b - a).length();
        let tangent = (b - a) / length;
        let across = opposite.map(|c| (c - a).reject(tangent).normalize());
        let [h0, h1] = across;
        let usable = tangent.is_finite() && h0.is_finite() && h1.is_finite() && length > 0.0;
        let between = fm::atan2(h0.cross(h1).length(), h0.dot(h1));
        usable.then_some(Self { ends, tangent, length, faces, across, between })
    }

    /// The point at `u` of the way from the first end to the second.
    #[must_use]
    pub fn at(&self, u: f64) -> Vec3 {
        let [a, b] = self.ends;
        a * (1.0 - u) + b * u
    }

    /// Angle in radians through which planes that graze the edge turn: half a turn without what is
    /// [between](Self::between) the faces.
    #[must_use]
    pub fn silhouette_angle(&self) -> f64 {
        PI - self.between
    }

    /// Unit, from the edge in between its faces; `None` where they lie in one plane.
    #[must_use]
    pub fn inward(&self) -> Option<Vec3> {
        let sum = self.across[0] + self.across[1];
        (sum.length_squared() > 1e-8).then(|| sum.normalize())
    }

    /// Normals of the faces' planes. Directions that graze the edge with both faces on one side have
    /// products of the same sign with both.
    #[must_use]
    pub fn plane_normals(&self) -> [Vec3; 2] {
        self.across.map(|h| h.cross(self.tangent))
    }

    /// The unit normal of the plane of the edge and the unit direction `w`, towards the side where
    /// the faces lie; `None` unless all of them lie strictly on one side.
    #[must_use]
    pub fn occluded_side(&self, w: Vec3) -> Option<Vec3> {
        let n = self.tangent.cross(w);
        let length = n.length();
        let [s0, s1] = self.across.map(|h| h.dot(n));
        if s0 * s1 <= 0.0 || length < 1e-12 {
            return None;
        }
        Some(n * (s0.signum() / length))
    }

    /// True when the edge is a silhouette seen along the unit direction `w`, from either side.
    #[must_use]
    pub fn is_silhouette(&self, w: Vec3) -> bool {
        self.occluded_side(w).is_some()
    }

    /// A direction that grazes the edge, from two uniform numbers, with its inverse density in
    /// steradians. The polar angle θ around the edge has density ∝ sin² θ, the azimuth is uniform over
    /// the valid wedges (theory sheet §4.3).
    #[must_use]
    pub fn sample_direction(&self, u: [f64; 2]) -> (Vec3, f64) {
        let theta = warp::sin_squared_polar(u[0]);
        let free = self.silhouette_angle();
        let u = 2.0 * u[1];
        let azimuth =
            if u < 1.0 { self.between + u * free } else { PI + self.between + (u - 1.0) * free };
        let (x, y) = self.frame();
        let ((sin, cos), (sin_phi, cos_phi)) = (fm::sin_cos(theta), fm::sin_cos(azimuth));
        let w = self.tangent * cos + (x * cos_phi + y * sin_phi) * sin;
        (w, self.inverse_density(theta, sin))
    }

    fn inverse_density(&self, theta: f64, sin: f64) -> f64 {
        2.0 * self.silhouette_angle() * sin / warp::sin_squared_polar_pdf(theta)
    }

    /// Density per steradian of [`Self::sample_direction`] at a direction that grazes the edge.
    #[must_use]
    pub fn direction_pdf(&self, w: Vec3) -> f64 {
        let sin = self.tangent.cross(w).length();
        let theta = fm::atan2(sin, self.tangent.dot(w));
        1.0 / self.inverse_density(theta, sin)
    }

    /// The first face's direction, and the one a quarter turn towards the second.
    fn frame(&self) -> (Vec3, Vec3) {
        let [h0, h1] = self.across;
        let y = self.tangent.cross(h0);
        (h0, if y.dot(h1) < 0.0 { -y } else { y })
    }

    /// The angle in radians that the edge subtends from `eye`; 0 where it is no silhouette.
    #[must_use]
    pub fn subtended_angle(&self, eye: Vec3) -> f64 {
        let [da, db] = self.ends.map(|p| p - eye);
        if ![da, db, (da + db) * 0.5].into_iter().any(|d| self.is_silhouette(d.normalize())) {
            return 0.0;
        }
        self.largest_size(eye, 0.0)
    }

    /// About the largest angle in radians that the edge subtends from points within a `radius` of `eye`, if it is a
    /// silhouette from any; never 0 then, whichever it is.
    #[must_use]
    pub fn most_subtended(&self, eye: Vec3, radius: f64) -> f64 {
        // From all such points both faces' planes, and so the faces, are on the same or on different sides.
        let apart = |n: Vec3| (eye - self.ends[0]).dot(n);
        let [s0, s1] = self.plane_normals().map(apart);
        if s0 * s1 < 0.0 && f64::min(Real::abs(s0), Real::abs(s1)) > radius {
            return 0.0;
        }
        self.largest_size(eye, radius)
    }

    /// About the largest angle in radians between the directions to its ends from points within a `radius` of `eye`, silhouette or not.
    #[must_use]
    pub fn largest_size(&self, eye: Vec3, radius: f64) -> f64 {
        let [da, db] = self.ends.map(|p| p - eye);
        let angle = fm::atan2(da.cross(db).length(), da.dot(db));
        if radius == 0.0 {
            return angle;
        }
        let near = f64::max(da.length(), db.length()) * 1e-3;
        let apart = da.length_squared() + radius * radius + near * near;
        f64::max(angle, self.length * radius / apart)
    }

    /// The edge's length seen along the unit direction `w`; 0 where it is no silhouette.
    #[must_use]
    pub fn projected_length(&self, w: Vec3) -> f64 {
        if self.is_silhouette(w) { self.length * self.tangent.cross(w).length() } else { 0.0 }
    }

    /// Sine of the angle between the edge and a unit direction.
    #[must_use]
    pub fn sine(&self, w: Vec3) -> f64 {
        let c = self.tangent.dot(w);
        Real::sqrt(f64::max(0.0, 1.0 - c * c))
    }

    /// False when no segment that grazes the edge can end in a box: when all of it lies on opposite
    /// sides of the two faces' planes.
    #[must_use]
    pub fn can_be_grazed_towards(&self, b: &Aabb) -> bool {
        let [(low0, high0), (low1, high1)] =
            self.plane_normals().map(|n| b.signed_distances(self.ends[0], n));
        let apart = |low: f64, high: f64| low > 0.0 && high < 0.0;
        !apart(low0, high1) && !apart(low1, high0)
    }
}

#[cfg(test)]
mod tests {
    use drt_math::{Rng, vec3};

    use super::*;

    fn point(rng: &mut Rng, size: f64) -> Vec3 {
        vec3(rng.next_f64() - 0.5, rng.next_f64() - 0.5, rng.next_f64() - 0.5) * (2.0 * size)
    }

    fn random(rng: &mut Rng) -> Wedge {
        let [a, b, c, d] = [0; 4].map(|_| point(rng, 1.0));
        Wedge::new([a, b], [c, d], [0, 1]).unwrap()
    }

    /// No edge is dropped past which a segment ends in the box; boxes elsewhere are kept apart.
    #[test]
    fn edges_that_are_grazed_stay() {
        let mut rng = Rng::new(5, 0, 0);
        let (mut seen, mut dropped) = (0, 0);
        for _ in 0..20_000 {
            let e = random(&mut rng);
            let x = e.at(rng.next_f64());
            let end = point(&mut rng, 3.0);
            let (a, b) = (point(&mut rng, 0.2), point(&mut rng, 0.2));
            let b = Aabb { min: end - a.max(-a), max: end + b.max(-b) };
            if e.is_silhouette((end - x).normalize()) {
                assert!(e.can_be_grazed_towards(&b));
                seen += 1;
            } else if !e.can_be_grazed_towards(&b) {
                dropped += 1;
            }
        }
        assert!(seen > 5_000 && dropped > 3_000, "{seen} {dropped}");
    }

    /// Sampled directions graze the edge and have the density they claim: ∫ sin θ cos² θ dω over those that graze
    /// it is π/4 times the silhouette angle.
    #[test]
    fn directions_are_those_that_graze() {
        let mut rng = Rng::new(7, 0, 0);
        for _ in 0..20 {
            let e = random(&mut rng);
            let (mut sum, mut squares, n) = (0.0, 0.0, 20_000);
            for _ in 0..n {
                let (w, inverse) = e.sample_direction([rng.next_f64(), rng.next_f64()]);
                assert!(e.is_silhouette(w));
                assert!((e.direction_pdf(w) * inverse - 1.0).abs() < 1e-9);
                let cosine = e.tangent.dot(w);
                let term = inverse * e.sine(w) * cosine * cosine;
                sum += term;
                squares += term * term;
            }
            let n = f64::from(n);
            let (mean, expected) = (sum / n, 0.25 * PI * e.silhouette_angle());
            let error = Real::sqrt((squares / n - mean * mean) / n);
            assert!((mean - expected).abs() < 4.0 * error, "{mean} ± {error}, not {expected}");
            assert!(error < 0.01 * expected);
        }
    }

    #[test]
    fn edges_without_length_or_area_are_none() {
        let (a, b) = (vec3(0.0, 0.0, 0.0), vec3(1.0, 0.0, 0.0));
        assert!(Wedge::new([a, a], [b, b], [0, 1]).is_none());
        assert!(Wedge::new([a, b], [b, vec3(0.0, 1.0, 0.0)], [0, 1]).is_none());
        assert!(Wedge::new([a, vec3(f64::NAN, 0.0, 0.0)], [b, b], [0, 1]).is_none());
    }
}
