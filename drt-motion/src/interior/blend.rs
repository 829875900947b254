//! Several motions blended over the space between them: the inside of a medium whose surroundings
//! move differently.
//!
//! At a point x with distances d_i to the sites, the weights are Shepard's (1968),
//!
//! ```text
//! λ_i = d_i⁻² / Σ_j d_j⁻²,   u(x) = Σ λ_i u_i(x),
//! ```
//!
//! so u equals u_i on site i, with its first derivatives, and is continuous everywhere: what a field
//! inside a medium must be (theory sheet §4.1, §14.1). The divergence jumps where the nearest point
//! of a site does, which is harmless.
//!
//! Away from a surface its distance may be any that goes over into the true one near it: with s the
//! distance interpolated on a lattice, d the true one, and w rising smoothly from 0 to 1 with s,
//!
//! ```text
//! d_i = d + w (s - d),
//! ```
//!
//! so that the nearest point of a mesh is looked for near it only.

use alloc::vec::Vec;

use drt_geom::{TriangleBvh, nearest_point};
use drt_math::{Affine, Mat3, Vec3};

use super::distances::Distances;
use crate::volume::VolumeJet;

/// Something that moves on its own.
#[derive(Clone, Debug)]
pub enum Site {
    /// A surface that moves by one field.
    Surface(TriangleBvh),
    /// A triangle of a surface that deforms.
    Triangle([Vec3; 3]),
    /// A camera or point light.
    Point(Vec3),
}

/// A site and what is prepared for it.
#[derive(Clone, Debug)]
struct Prepared {
    site: Site,
    /// Of a surface.
    distances: Option<Distances>,
}

/// The weight of a site at a point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SiteWeight {
    /// λ, from 0 to 1; all sum to 1.
    pub lambda: f64,
    /// Gradient of λ.
    pub gradient: Vec3,
}

impl Prepared {
    fn new(site: Site) -> Self {
        let distances = match &site {
            Site::Surface(bvh) => Distances::new(bvh),
            _ => None,
        };
        Self { site, distances }
    }

    /// Its squared distance as λ, with half the gradient; infinitely far where there is nothing.
    fn squared_distance(&self, x: Vec3) -> SiteWeight {
        let to = |p: Vec3| SiteWeight { lambda: (x - p).length_squared(), gradient: x - p };
        match &self.site {
            Site::Surface(bvh) => match &self.distances {
                Some(distances) => surface_distance(bvh, distances, x),
                None => bvh.closest_point(x).map(|c| to(c.point)),
            }
            .unwrap_or(NOWHERE),
            Site::Triangle(t) => to(nearest_point(*t, x)),
            Site::Point(p) => to(*p),
        }
    }
}

const NOWHERE: SiteWeight = SiteWeight { lambda: f64::INFINITY, gradient: Vec3::ZERO };

/// Where interpolated distances begin to count, and where they alone do, in cubes of their lattice:
/// the first is more than they can be off by.
const FADE: [f64; 2] = [1.0, 2.0];

fn surface_distance(bvh: &TriangleBvh, distances: &Distances, x: Vec3) -> Option<SiteWeight> {
    let far = distances.at(x);
    let (s, [begin, end]) = (far.distance, FADE.map(|f| f * distances.width()));
    if s >= end {
        return Some(SiteWeight { lambda: s * s, gradient: far.gradient * s });
    }
    let away = x - bvh.closest_point_within(x, 1.001 * (s + distances.error()))?.point;
    let d = away.length();
    if s <= begin || d == 0.0 {
        return Some(SiteWeight { lambda: d * d, gradient: away });
    }
    let z = (s - begin) / (end - begin);
    let (w, slope) = (z * z * (3.0 - 2.0 * z), 6.0 * z * (1.0 - z) / (end - begin));
    let distance = d + w * (s - d);
    let gradient = away * ((1.0 - w) / d) + far.gradient * (w + slope * (s - d));
    Some(SiteWeight { lambda: distance * distance, gradient: gradient * distance })
}

/// The sites around a medium.
#[derive(Clone, Debug, Default)]
pub struct Blend {
    sites: Vec<Prepared>,
}

impl Blend {
    /// A blend of these sites; empty surfaces count for nothing.
    #[must_use]
    pub fn new(sites: Vec<Site>) -> Self {
        Self { sites: sites.into_iter().map(Prepared::new).collect() }
    }

    /// Replaces `out` by the weights of all sites at `x`.
    pub fn weights(&self, x: Vec3, out: &mut Vec<SiteWeight>) {
        out.clear();
        // First, λ holds d² and the gradient half that of d².
        out.extend(self.sites.iter().map(|site| site.squared_distance(x)));
        let Some(least) = out.iter().map(|w| w.lambda).min_by(f64::total_cmp) else { return };
        if least < f64::MIN_POSITIVE {
            // On a site: it alone counts, and derivatives of the weights vanish.
            let mut first = true;
            for w in out {
                let on = w.lambda == least && first;
                first &= !on;
                *w = SiteWeight { lambda: f64::from(u8::from(on)), gradient: Vec3::ZERO };
            }
            return;
        }
        let (mut sum, mut mean) = (0.0, Vec3::ZERO);
        for w in out.iter_mut() {
            let inverse = 1.0 / w.lambda;
            // ∇ ln d⁻² = -2 (x - nearest) / d².
            w.gradient *= -2.0 * inverse;
            w.lambda = least * inverse;
            sum += w.lambda;
            mean += w.gradient * w.lambda;
        }
        let normalized = 1.0 / sum;
        mean *= normalized;
        for w in out {
            w.lambda *= normalized;
            w.gradient = (w.gradient - mean) * w.lambda;
        }
    }
}

/// The affine field with given velocities at a triangle's corners, the same along its normal.
#[must_use]
pub fn triangle_field([a, b, c]: [Vec3; 3], [u, v, w]: [Vec3; 3]) -> Affine {
    let (e1, e2) = (b - a, c - a);
    let edges = Mat3 { cols: [e1, e2, e1.cross(e2)] };
    let rates = Mat3 { cols: [v - u, w - u, Vec3::ZERO] };
    let linear = rates * edges.inverse();
    let field = Affine { linear, translation: u - linear * a };
    if field.is_finite() { field } else { Affine { translation: u, ..Affine::ZERO } }
}

/// The blended velocity at `x` and its divergence: `velocities` gives the field of each site that
/// moves, by its place in the blend; the others are at rest.
#[must_use]
pub fn blend_jet(weights: &[SiteWeight], velocities: &[(usize, Affine)], x: Vec3) -> VolumeJet {
    let mut jet = VolumeJet::default();
    for (site, field) in velocities {
        let w = &weights[*site];
        let u = field.point(x);
        jet.u += u * w.lambda;
        jet.j_dot += field.linear.trace() * w.lambda + u.dot(w.gradient);
    }
    jet
}

#[cfg(test)]
mod tests {
    use drt_geom::procedural;
    use drt_math::vec3;

    use super::*;

    fn example() -> (Blend, Vec<(usize, Affine)>) {
        let sphere = procedural::icosphere(2);
        let plate = procedural::rectangle().transform(&Affine::translation(vec3(0.0, 0.0, -3.0)));
        let blend = Blend::new(alloc::vec![
            Site::Surface(TriangleBvh::of(&sphere).unwrap()),
            Site::Surface(TriangleBvh::of(&plate).unwrap()),
            Site::Point(vec3(4.0, 0.0, 1.0)),
        ]);
        let spin =
            Affine { linear: Mat3::skew(vec3(0.2, -0.5, 0.3)), translation: vec3(1.0, 0.2, 0.0) };
        let slide = Affine { translation: vec3(0.0, -0.7, 0.1), ..Affine::ZERO };
        (blend, alloc::vec![(0, spin), (2, slide)])
    }

    #[test]
    fn meets_every_site_with_its_velocity() {
        let (blend, v) = example();
        let mut w = Vec::new();
        for (x, expected) in [
            (vec3(0.0, 0.0, 1.0), v[0].1.point(vec3(0.0, 0.0, 1.0))),
            (vec3(0.3, 0.1, -3.0), Vec3::ZERO),
            (vec3(4.0, 0.0, 1.0), v[1].1.translation),
        ] {
            for off in [0.0, 1e-7] {
                let p = x + vec3(0.0, 0.0, off);
                blend.weights(p, &mut w);
                let sum: f64 = w.iter().map(|w| w.lambda).sum();
                assert!((sum - 1.0).abs() < 1e-14);
                assert!((blend_jet(&w, &v, p).u - expected).max_abs() < 1e-6);
            }
        }
    }

    #[test]
    fn triangle_fields_meet_their_corners() {
        let t = [vec3(0.1, 0.2, 0.3), vec3(1.0, -0.4, 0.2), vec3(0.3, 0.9, -0.5)];
        let v = [vec3(0.4, 0.0, -1.0), vec3(0.2, 0.3, 0.1), vec3(-0.6, 0.5, 0.0)];
        let field = triangle_field(t, v);
        let n = (t[1] - t[0]).cross(t[2] - t[0]);
        for (x, u) in t.into_iter().zip(v) {
            assert!((field.point(x) - u).max_abs() < 1e-14);
            assert!((field.point(x + n) - u).max_abs() < 1e-14);
        }
    }

    #[test]
    fn divergence_matches_differences() {
        let (blend, v) = example();
        let mut w = Vec::new();
        let mut u = |x: Vec3| {
            blend.weights(x, &mut w);
            blend_jet(&w, &v, x)
        };
        let h = 1e-6;
        // Near the ball, where its distance fades over into the interpolated one, and beyond.
        for x in [
            vec3(0.9, 0.4, 0.6),
            vec3(1.01, 0.4, 0.2),
            vec3(1.05, 0.4, 0.2),
            vec3(1.3, 0.4, 0.2),
            vec3(-0.2, 1.6, -1.1),
            vec3(1.2, 1.3, 1.1),
            vec3(3.5, 0.4, 0.7),
        ] {
            let along = |axis: Vec3| axis * h;
            let fd = ((u(x + along(Vec3::X)).u - u(x - along(Vec3::X)).u).x
                + (u(x + along(Vec3::Y)).u - u(x - along(Vec3::Y)).u).y
                + (u(x + along(Vec3::Z)).u - u(x - along(Vec3::Z)).u).z)
                / (2.0 * h);
            assert!(
                (u(x).j_dot - fd).abs() < 1e-7 * fd.abs().max(1.0),
                "{x:?} {} {fd}",
                u(x).j_dot
            );
        }
    }
}
