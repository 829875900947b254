//! Steps of a fit that are too large: no sequence of small, physically possible steps leads from one scene to the
//! other.

use alloc::string::String;
use alloc::sync::Arc;
use alloc::vec::Vec;

use drt_geom::Mesh;
use drt_math::Vec3;
use thiserror::Error;

use crate::model::scene::{Scene, Shape};
use crate::model::surface::Bsdf;

/// The reason why a step of a fit from one scene to another is refused.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum Misstep {
    /// A closed shape's volume has changed its sign.
    #[error("`{shape}` turned inside out")]
    InsideOut {
        /// The shape.
        shape: String,
    },
    /// Much of a shape that deforms has turned over.
    #[error("`{shape}` folded over: {percent:.0} % of its surface turned round in one step")]
    Folded {
        /// The shape.
        shape: String,
        /// The part of its area that has turned over, in percent.
        percent: f64,
    },
    /// A light or camera has passed through an opaque surface.
    #[error("`{item}` passed through `{wall}`")]
    Through {
        /// The light or camera.
        item: String,
        /// The surface.
        wall: String,
    },
}

/// Part of a deforming surface that may turn over in one step.
const MOST_FOLDED: f64 = 0.1;
/// Most vertices of a glowing shape that are looked at.
const MOST_VERTICES: usize = 64;
/// Relative change of a length below which a triangle is rigid.
const RIGID: f64 = 1e-9;
/// Distance from a plane, relative to the triangle's size, that counts as on it.
const ON: f64 = 1e-9;

/// Checks a step between two scenes that differ by their parameters' values only: a shape that has
/// turned inside out or folded over, or a light or one of these sensors that has passed through a wall, is an error.
/// Everything that moves is assumed to move along straight lines.
///
/// # Errors
/// The first of these faults that is found.
pub fn check_step(before: &Scene, after: &Scene, sensors: &[usize]) -> Result<(), Misstep> {
    let shapes = || before.shapes.iter().zip(&after.shapes).enumerate();
    for (i, (a, b)) in shapes().filter(|(_, (a, b))| !Arc::ptr_eq(&a.mesh, &b.mesh)) {
        check_shape(&name(&a.id, "shape", i), &a.mesh, &b.mesh)?;
    }
    let tracks = tracks(before, after, sensors);
    for (i, (a, b)) in shapes().filter(|(_, (a, _))| is_opaque(&before.bsdfs[a.bsdf].item)) {
        let others = || tracks.iter().filter(|t| t.shape != Some(i));
        if Arc::ptr_eq(&a.mesh, &b.mesh) && others().all(|t| t.from == t.to) {
            continue;
        }
        for t in 0..a.mesh.triangles.len() as u32 {
            let (from, to) = (a.mesh.triangle(t), b.mesh.triangle(t));
            if let Some(track) = others().find(|track| passes(track, from, to)) {
                let wall = name(&a.id, "shape", i);
                return Err(Misstep::Through { item: track.name.clone(), wall });
            }
        }
    }
    Ok(())
}

fn name(id: &Option<String>, kind: &str, i: usize) -> String {
    id.clone().unwrap_or_else(|| alloc::format!("{kind}[{i}]"))
}

fn is_opaque(bsdf: &Bsdf) -> bool {
    !matches!(bsdf, Bsdf::Null | Bsdf::RoughDielectric(_))
}

fn check_shape(name: &str, before: &Mesh, after: &Mesh) -> Result<(), Misstep> {
    let (mut area, mut turned, mut rigid) = (0.0, 0.0, true);
    let mut rims = [Vec3::ZERO; 2];
    for t in 0..before.triangles.len() as u32 {
        let [from, to] = [before, after].map(|mesh| {
            let [a, b, c] = mesh.triangle(t);
            [b - a, c - a]
        });
        let [n, m] = [from, to].map(|[u, v]| u.cross(v));
        let lengths = [0, 1].map(|k| (from[k].length_squared(), to[k].length_squared()));
        rigid &= lengths.iter().all(|(a, b)| (a - b).abs() <= RIGID * a);
        area += n.length();
        turned += if n.dot(m) < 0.0 { n.length() } else { 0.0 };
        rims[0] += n;
        rims[1] += m;
    }
    // The normals of a closed surface add up to nothing.
    let closed = rims[0].length() <= RIGID * area;
    if closed && before.volume() * after.volume() < 0.0 {
        return Err(Misstep::InsideOut { shape: name.into() });
    }
    if !rigid && turned > MOST_FOLDED * area {
        return Err(Misstep::Folded { shape: name.into(), percent: 100.0 * turned / area });
    }
    Ok(())
}

/// A point of a light or camera, from one place to another.
struct Track {
    name: String,
    /// The shape that it is on.
    shape: Option<usize>,
    from: Vec3,
    to: Vec3,
}

fn tracks(before: &Scene, after: &Scene, sensors: &[usize]) -> Vec<Track> {
    let mut tracks = Vec::new();
    for (i, (a, b)) in before.emitters.iter().zip(&after.emitters).enumerate() {
        if let (Some(from), Some(to)) = (a.item.emitter.position(), b.item.emitter.position()) {
            tracks.push(Track { name: name(&a.id, "emitter", i), shape: None, from, to });
        }
    }
    for &i in sensors {
        let (a, b) = (&before.sensors[i], &after.sensors[i]);
        let [from, to] = [a, b].map(|s| s.item.sensor.position());
        tracks.push(Track { name: name(&a.id, "sensor", i), shape: None, from, to });
    }
    let glowing = |(_, (a, _)): &(usize, (&Shape, &Shape))| a.emitter.is_some();
    for (i, (a, b)) in before.shapes.iter().zip(&after.shapes).enumerate().filter(glowing) {
        let stride = a.mesh.positions.len().div_ceil(MOST_VERTICES).max(1);
        let pairs = a.mesh.positions.iter().zip(&b.mesh.positions);
        tracks.extend(pairs.step_by(stride).map(|(from, to)| Track {
            name: name(&a.id, "shape", i),
            shape: Some(i),
            from: *from,
            to: *to,
        }));
    }
    tracks
}

/// Whether a point passes through a triangle, both moving straight.
fn passes(track: &Track, from: [Vec3; 3], to: [Vec3; 3]) -> bool {
    let side = |[a, b, c]: [Vec3; 3], x: Vec3| {
        let n = (b - a).cross(c - a);
        let (height, size) = (n.dot(x - a), n.length());
        if height.abs() <= ON * size * (x - a).length() { 0.0 } else { height / size }
    };
    let (s, t) = (side(from, track.from), side(to, track.to));
    if s * t >= 0.0 {
        return false;
    }
    let when = s / (s - t);
    let mix = |a: Vec3, b: Vec3| a + (b - a) * when;
    let [a, b, c] = [0, 1, 2].map(|k| mix(from[k], to[k]));
    let x = mix(track.from, track.to);
    let n = (b - a).cross(c - a);
    [(a, b), (b, c), (c, a)].iter().all(|(p, q)| (*q - *p).cross(x - *p).dot(n) >= 0.0)
}

#[cfg(test)]
mod tests {
    use drt_math::vec3;

    use super::*;

    const TRIANGLE: [Vec3; 3] = [Vec3::ZERO, Vec3::X, Vec3::Y];

    fn track(from: Vec3, to: Vec3) -> Track {
        Track { name: String::new(), shape: None, from, to }
    }

    #[test]
    fn points_pass_through_triangles_or_beside_them() {
        let up = vec3(0.0, 0.0, 1.0);
        let (inside, outside) = (vec3(0.2, 0.2, -0.5), vec3(0.7, 0.7, -0.5));
        assert!(passes(&track(inside, inside + up), TRIANGLE, TRIANGLE));
        assert!(!passes(&track(outside, outside + up), TRIANGLE, TRIANGLE));
        assert!(!passes(&track(inside, inside + up * 0.4), TRIANGLE, TRIANGLE));
        // What rests in the plane does not pass through it.
        let on = vec3(0.2, 0.2, 0.0);
        assert!(!passes(&track(on, on + up), TRIANGLE, TRIANGLE));
        // The wall may be what moves; together nothing happens.
        let lowered = TRIANGLE.map(|p| p - up);
        assert!(passes(&track(inside, inside), TRIANGLE, lowered));
        assert!(!passes(&track(inside, inside - up), TRIANGLE, lowered));
    }

    #[test]
    fn shapes_turn_but_do_not_fold() {
        let tetrahedron = |tip: Vec3| {
            let faces = alloc::vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
            Mesh::new(alloc::vec![Vec3::ZERO, Vec3::X, Vec3::Y, tip], faces).unwrap()
        };
        let upright = tetrahedron(Vec3::Z);
        assert_eq!(check_shape("a", &upright, &tetrahedron(vec3(0.3, 0.0, 0.5))), Ok(()));
        let upside_down = Misstep::InsideOut { shape: "a".into() };
        assert_eq!(check_shape("a", &upright, &tetrahedron(-Vec3::Z)), Err(upside_down));
        let turn = drt_math::Affine::about(drt_math::Mat3::rotation(Vec3::X, 3.0), Vec3::ZERO);
        assert_eq!(check_shape("a", &upright, &upright.transform(&turn)), Ok(()));
        let open = |corner: Vec3| {
            let faces = alloc::vec![[0, 1, 2], [0, 2, 3]];
            Mesh::new(alloc::vec![Vec3::ZERO, Vec3::X, vec3(1.0, 1.0, 0.0), corner], faces).unwrap()
        };
        let folded = check_shape("a", &open(Vec3::Y), &open(vec3(0.9, 0.1, 0.0)));
        assert!(
            matches!(folded, Err(Misstep::Folded { percent, .. }) if percent == 50.0),
            "{folded:?}"
        );
    }
}
