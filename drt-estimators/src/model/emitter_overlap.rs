//! Two emitters in one place: surfaces of lamps that overlap in a common plane.
//!
//! Where surfaces coincide, a ray hits the one with the lower number. Where both emit, next-event estimation samples
//! each of them, and the radiance of the second would depend on how it was found. Which of the two should be seen is
//! for the scene to say.

use alloc::vec::Vec;

use drt_geom::Aabb;
use drt_math::Vec3;

/// What counts as one plane, and as no overlap, relative to coordinates: some rounding errors of these.
const ROUNDING: f64 = 64.0 * f64::EPSILON;

type Corners = [Vec3; 3];

/// A triangle that emits.
struct Emitting {
    shape: usize,
    corners: Corners,
    bounds: Aabb,
}

/// Two shapes that emit and overlap in one plane, where there are such, the lower number first. `shapes` are those that
/// emit, by their numbers, and their triangles.
pub(super) fn overlapping_lamps<T: Iterator<Item = Corners>>(
    shapes: impl Iterator<Item = (usize, T)>,
) -> Option<[usize; 2]> {
    let of_shape = |(shape, triangles): (usize, T)| {
        triangles.map(move |corners| Emitting { shape, corners, bounds: Aabb::around(corners) })
    };
    let mut triangles: Vec<Emitting> = shapes.flat_map(of_shape).collect();
    // From left to right, so that each is compared only with those that begin before it ends.
    triangles.sort_by(|a, b| a.bounds.min.x.total_cmp(&b.bounds.min.x));
    let of_pair = |(i, a): (usize, &Emitting)| {
        let beside = triangles[i + 1..].iter().take_while(|b| b.bounds.min.x <= a.bounds.max.x);
        let mut others = beside.filter(|b| b.shape != a.shape && b.bounds.meets(&a.bounds));
        let met = others.find(|b| overlap_in_plane(&a.corners, &b.corners))?;
        Some([a.shape.min(met.shape), a.shape.max(met.shape)])
    };
    triangles.iter().enumerate().find_map(of_pair)
}

/// True when both triangles lie in one plane and have an area in common.
fn overlap_in_plane(a: &Corners, b: &Corners) -> bool {
    let largest =
        a.iter().chain(b).flat_map(|v| v.to_array()).fold(0.0, |m, x| f64::max(m, x.abs()));
    let slack = ROUNDING * largest;
    let normal = |t: &Corners| (t[1] - t[0]).cross(t[2] - t[0]).normalize();
    let [of_a, of_b] = [normal(a), normal(b)];
    let within = |n: Vec3, at: Vec3, t: &Corners| t.iter().all(|v| n.dot(*v - at).abs() <= slack);
    within(of_a, a[0], b) && within(of_b, b[0], a) && {
        // Convex figures in a plane are disjoint where a side of one of them separates them.
        let sides = |t: &Corners| [0, 1, 2].map(|k| of_a.cross(t[(k + 1) % 3] - t[k]).normalize());
        let shared = |axis: &Vec3| {
            let range = |t: &Corners| {
                let [p, q, r] = t.map(|v| axis.dot(v));
                [p.min(q).min(r), p.max(q).max(r)]
            };
            let [[low_a, high_a], [low_b, high_b]] = [range(a), range(b)];
            high_a.min(high_b) - low_a.max(low_b) > slack
        };
        sides(a).iter().chain(&sides(b)).all(shared)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use drt_math::vec3;

    const A: Corners = [Vec3::ZERO, vec3(1.0, 0.0, 0.0), vec3(0.0, 1.0, 0.0)];

    fn moved(t: &Corners, by: Vec3) -> Corners {
        t.map(|v| v + by)
    }

    fn tilted(t: &Corners) -> Corners {
        let (sin, cos) = (0.6_f64, 0.8_f64);
        t.map(|v| vec3(v.x * cos - v.z * sin + 3.0, v.y - 7.0, v.x * sin + v.z * cos + 0.1))
    }

    #[test]
    fn areas_in_one_plane_count_and_nothing_else() {
        for place in [Clone::clone, tilted] {
            let overlaps = |b: &Corners| {
                let [a, b] = [&A, b].map(place);
                let turned = [b[2], b[1], b[0]];
                let found = overlap_in_plane(&a, &b);
                assert_eq!(found, overlap_in_plane(&b, &a));
                assert_eq!(found, overlap_in_plane(&a, &turned));
                found
            };
            assert!(overlaps(&A));
            assert!(overlaps(&moved(&A, vec3(0.2, 0.1, 0.0))));
            assert!(overlaps(&A.map(|v| v * 0.1 + vec3(0.3, 0.3, 0.0))));
            assert!(!overlaps(&moved(&A, vec3(0.0, 0.0, 1e-9))));
            assert!(!overlaps(&moved(&A, vec3(1.0, 0.0, 0.0))));
            assert!(!overlaps(&moved(&A, vec3(0.6, 0.6, 0.0))));
            let across = [A[0], A[1], vec3(0.0, 0.0, 1.0)];
            assert!(!overlaps(&across));
            // What shares a side, as two halves of a rectangle do, shares no area.
            assert!(!overlaps(&[A[1], vec3(1.0, 1.0, 0.0), A[2]]));
        }
    }
}
