//! What two triangles have in common, by exact predicates (Shewchuk 1997, "Adaptive Precision
//! Floating-Point Arithmetic and Fast Robust Geometric Predicates").

use drt_math::Vec3;
use robust::{Coord, Coord3D, orient2d, orient3d};

type Triangle = [Vec3; 3];
type Plane = [Coord<f64>; 3];

/// Whether the corners are not all on one line.
pub(crate) fn has_area(t: &Triangle) -> bool {
    flat_axis(t).is_some()
}

/// Whether two triangles with areas have a point in common other than their common corners and
/// edge. Corners are common where their indices are equal.
pub(super) fn cross(positions: &[Vec3], t: [u32; 3], u: [u32; 3]) -> bool {
    // Both rotated so that a single common corner, or a single one that is not, comes first.
    let shared = |i: u32, other: [u32; 3]| other.contains(&i);
    let count = t.iter().filter(|&&i| shared(i, u)).count();
    let first_where = |t: [u32; 3], other: [u32; 3], is: bool| {
        let k = t.iter().position(|&i| shared(i, other) == is).unwrap_or(0);
        [0, 1, 2].map(|j| positions[t[(k + j) % 3] as usize])
    };
    match count {
        0 => {
            let [t, u] = [t, u].map(|t| t.map(|i| positions[i as usize]));
            let edges = |[a, b, c]: Triangle| [[a, b], [b, c], [c, a]];
            !apart(&t, &u)
                && !apart(&u, &t)
                && (edges(t).iter().any(|e| hits(*e, &u)) || edges(u).iter().any(|e| hits(*e, &t)))
        }
        // What they have in common is convex and holds the corner: if there is more, it reaches the
        // opposite edge of one of them.
        1 => {
            let (t, u) = (first_where(t, u, true), first_where(u, t, true));
            !apart(&t, &u) && !apart(&u, &t) && (hits([t[1], t[2]], &u) || hits([u[1], u[2]], &t))
        }
        // Folded flat onto each other about the edge.
        2 => {
            let (t, u) = (first_where(t, u, false), first_where(u, t, false));
            side(&t, u[0]) == 0.0
                && flat_axis(&t).is_some_and(|axis| {
                    let [p, a, b] = t.map(|v| project(v, axis));
                    orient2d(a, b, p) * sign(orient2d(a, b, project(u[0], axis))) > 0.0
                })
        }
        _ => true,
    }
}

/// Whether the other triangle is on one side of this one's plane, but for corners common to both.
fn apart(t: &Triangle, other: &Triangle) -> bool {
    let sides = other.map(|p| if t.contains(&p) { None } else { Some(side(t, p)) });
    let all = |on: fn(f64) -> bool| sides.iter().flatten().all(|s| on(*s));
    all(|s| s > 0.0) || all(|s| s < 0.0)
}

/// Whether a segment and a triangle, both closed, have a point in common.
fn hits([p, q]: [Vec3; 2], t: &Triangle) -> bool {
    let (above, below) = (side(t, p), side(t, q));
    if above == 0.0 && below == 0.0 {
        return flat_axis(t).is_some_and(|axis| {
            hits_flat([p, q].map(|v| project(v, axis)), t.map(|v| project(v, axis)))
        });
    }
    let [a, b, c] = *t;
    sign(above) * below <= 0.0
        && one_side([[a, b], [b, c], [c, a]].map(|[a, b]| side(&[p, q, a], b)))
}

/// The same in a plane.
fn hits_flat([p, q]: [Coord<f64>; 2], t: Plane) -> bool {
    let [a, b, c] = t;
    let edges = [[a, b], [b, c], [c, a]];
    let holds = |p| one_side(edges.map(|[a, b]| orient2d(a, b, p)));
    holds(p)
        || holds(q)
        || edges.iter().any(|[a, b]| {
            let splits =
                |[a, b]: [Coord<f64>; 2], p, q| sign(orient2d(a, b, p)) * orient2d(a, b, q) <= 0.0;
            // Segments on one line are met by their ends, and those end in the triangle or not at all.
            orient2d(p, q, *a) != 0.0 && splits([p, q], *a, *b) && splits([*a, *b], p, q)
        })
}

fn one_side(sides: [f64; 3]) -> bool {
    sides.iter().all(|s| *s >= 0.0) || sides.iter().all(|s| *s <= 0.0)
}

/// The sign of the tetrahedron's volume, as of [`TetMesh`](crate::TetMesh), on some number.
#[cfg(feature = "tetgen")]
pub(crate) fn volume_sign([a, b, c, d]: [Vec3; 4]) -> f64 {
    -side(&[a, b, c], d)
}

/// On which side of the triangle's plane a point lies.
fn side(t: &Triangle, p: Vec3) -> f64 {
    let [a, b, c, d] = [t[0], t[1], t[2], p].map(|v| Coord3D { x: v.x, y: v.y, z: v.z });
    orient3d(a, b, c, d)
}

/// The sign as a factor, so that a product can neither overflow nor vanish.
fn sign(x: f64) -> f64 {
    if x > 0.0 {
        1.0
    } else if x < 0.0 {
        -1.0
    } else {
        0.0
    }
}

/// An axis along which the triangle can be projected and keep an area.
fn flat_axis(t: &Triangle) -> Option<usize> {
    (0..3).find(|&axis| {
        let [a, b, c] = t.map(|v| project(v, axis));
        orient2d(a, b, c) != 0.0
    })
}

fn project(v: Vec3, axis: usize) -> Coord<f64> {
    Coord { x: v[(axis + 1) % 3], y: v[(axis + 2) % 3] }
}
