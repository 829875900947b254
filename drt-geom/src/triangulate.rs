//! Polygons into triangles.

use alloc::vec::Vec;
use core::f64::consts::TAU;

use drt_math::{Vec3, fm};
use spade::{ConstrainedDelaunayTriangulation, HasPosition, Point2, Triangulation};

/// Why a polygon cannot be cut into triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum PolygonError {
    /// Fewer than three corners.
    #[error("a polygon needs at least 3 corners, this one has {0}")]
    TooFewCorners(usize),
    /// Edges cross when the polygon is projected along its normal.
    #[error("the polygon's edges cross each other")]
    Crossing,
    /// A corner is not finite.
    #[error("a corner of the polygon is not a finite number")]
    NotFinite,
}

/// A polygon's vector area: along its normal, as long as its area (Newell's method). Corners run
/// counter-clockwise seen from the normal's side.
pub fn newell_normal(corners: impl IntoIterator<Item = Vec3>) -> Vec3 {
    let mut corners = corners.into_iter();
    let Some(first) = corners.next() else { return Vec3::ZERO };
    let (mut sum, mut last) = (Vec3::ZERO, Vec3::ZERO);
    for c in corners {
        sum += last.cross(c - first);
        last = c - first;
    }
    sum * 0.5
}

/// Triangles that cover a polygon, as indices of its corners, oriented as the polygon is.
///
/// Where the fan from corner 0 covers it (any convex polygon), it is that fan, which is how
/// Mitsuba cuts polygons. Others get the constrained Delaunay triangulation of their projection along
/// the largest coordinate of [`newell_normal`]. Holes may be given by a pair of coincident edges
/// that connect them to the rim. The corners may be a little out of plane.
///
/// # Errors
/// When there are fewer than three corners, one is not finite, or edges cross in the projection.
pub fn triangulate(corners: &[Vec3]) -> Result<Vec<[u32; 3]>, PolygonError> {
    let n = corners.len();
    if n < 3 {
        return Err(PolygonError::TooFewCorners(n));
    }
    if corners.iter().any(|c| !c.is_finite()) {
        return Err(PolygonError::NotFinite);
    }
    if n == 3 {
        return Ok(alloc::vec![[0, 1, 2]]);
    }
    let flat = project(corners);
    if fan_covers(&flat) { Ok(fan(n as u32)) } else { delaunay(&flat) }
}

pub(crate) fn fan(n: u32) -> Vec<[u32; 3]> {
    (1..n - 1).map(|i| [0, i, i + 1]).collect()
}

/// The polygon in a plane, counter-clockwise, within [-1, 1]².
fn project(corners: &[Vec3]) -> Vec<[f64; 2]> {
    let size = corners.iter().map(|c| (*c - corners[0]).max_abs()).fold(0.0, f64::max);
    let scale = if size > 0.0 { 1.0 / size } else { 0.0 };
    let local = |c: &Vec3| (*c - corners[0]) * scale;
    let n = newell_normal(corners.iter().map(local));
    let z = (0..3).fold(0, |k, j| if n[j].abs() > n[k].abs() { j } else { k });
    let (x, y) = if n[z] < 0.0 { ((z + 2) % 3, (z + 1) % 3) } else { ((z + 1) % 3, (z + 2) % 3) };
    corners.iter().map(|c| [local(c)[x], local(c)[y]]).collect()
}

/// Twice the signed area of a triangle.
fn area([ax, ay]: [f64; 2], [bx, by]: [f64; 2], [cx, cy]: [f64; 2]) -> f64 {
    (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
}

/// Whether the fan from corner 0 has no triangle turned over and goes around less than once.
fn fan_covers(p: &[[f64; 2]]) -> bool {
    let mut angle = 0.0;
    for w in p[1..].windows(2) {
        let twice_area = area(p[0], w[0], w[1]);
        if twice_area < 0.0 {
            return false;
        }
        let [a, b] = [w[0], w[1]].map(|q| [q[0] - p[0][0], q[1] - p[0][1]]);
        angle += fm::atan2(twice_area, a[0] * b[0] + a[1] * b[1]);
    }
    angle < TAU
}

struct Corner {
    position: Point2<f64>,
    index: u32,
}

impl HasPosition for Corner {
    type Scalar = f64;
    fn position(&self) -> Point2<f64> {
        self.position
    }
}

/// A corner for spade: coordinates too small for its predicates are zero at the polygon's scale of one.
fn place(q: [f64; 2]) -> Point2<f64> {
    let [x, y] = q.map(|c| if c.abs() < 1e-100 { 0.0 } else { c });
    Point2::new(x, y)
}

fn delaunay(p: &[[f64; 2]]) -> Result<Vec<[u32; 3]>, PolygonError> {
    let n = p.len();
    let corners: Vec<_> =
        p.iter().zip(0..).map(|(q, index)| Corner { position: place(*q), index }).collect();
    // Zero-length constraints make spade panic.
    let edges = (0..n)
        .map(|i| [i, (i + 1) % n])
        .filter(|&[a, b]| corners[a].position != corners[b].position)
        .collect();
    let mut crossing = false;
    let cdt = ConstrainedDelaunayTriangulation::<Corner>::try_bulk_load_cdt(corners, edges, |_| {
        crossing = true;
    })
    .map_err(|_| PolygonError::NotFinite)?;
    if crossing {
        return Err(PolygonError::Crossing);
    }
    let winds = windings(&cdt, p);
    let inside = cdt.inner_faces().filter(|f| winds[f.index()] != 0);
    Ok(inside.map(|f| f.vertices().map(|v| v.data().index)).collect())
}

type Faces = ConstrainedDelaunayTriangulation<Corner>;

/// How often the polygon winds around each face, by the face's number.
///
/// Two faces that share an edge have the same number unless the polygon runs along that edge, so numbers are carried from
/// the outer face inward. Where a piece of the polygon passes through another of its corners, it is not known how much
/// the number changes there, and one face beyond is computed from its centre.
fn windings(faces: &Faces, p: &[[f64; 2]]) -> Vec<i32> {
    let changes = changes(faces, p);
    let mut winds = alloc::vec![None; faces.num_all_faces()];
    winds[faces.outer_face().index()] = Some(0);
    let mut open: Vec<_> = faces.convex_hull().map(|e| (e.fix(), 0)).collect();
    let mut seeds = faces.inner_faces();
    loop {
        while let Some((edge, winding)) = open.pop() {
            let edge = faces.directed_edge(edge);
            let change = match &changes {
                Some(changes) => changes[edge.fix().index()],
                None if edge.is_constraint_edge() => continue,
                None => 0,
            };
            let winding = winding - change;
            if let Some(face) = edge.rev().face().as_inner()
                && winds[face.index()].replace(winding).is_none()
            {
                open.extend(face.adjacent_edges().map(|e| (e.fix(), winding)));
            }
        }
        let Some(seed) = seeds.find(|f| winds[f.index()].is_none()) else { break };
        let c = seed.center();
        let winding = winding_around(p, [c.x, c.y]);
        winds[seed.index()] = Some(winding);
        open.extend(seed.adjacent_edges().map(|e| (e.fix(), winding)));
    }
    winds.into_iter().map(Option::unwrap_or_default).collect()
}

/// For each directed edge, how much more the polygon winds around what lies to its left than around what lies to its right.
/// `None` where an edge of the polygon runs through another corner.
fn changes(faces: &Faces, p: &[[f64; 2]]) -> Option<Vec<i32>> {
    // Corners in the same place are one vertex.
    let key = |q: Point2<f64>| [q.x, q.y];
    let by_place = |a: &[f64; 2], b: &[f64; 2]| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1]));
    let mut vertices: Vec<_> = faces.vertices().map(|v| (key(v.position()), v.fix())).collect();
    vertices.sort_unstable_by(|a, b| by_place(&a.0, &b.0));
    let vertex = |q: Point2<f64>| {
        let place = vertices.binary_search_by(|v| by_place(&v.0, &key(q))).ok()?;
        Some(vertices[place].1)
    };
    let mut changes = alloc::vec![0; faces.num_directed_edges()];
    for i in 0..p.len() {
        let [from, to] = [vertex(place(p[i]))?, vertex(place(p[(i + 1) % p.len()]))?];
        if from != to {
            let edge = faces.get_edge_from_neighbors(from, to)?;
            changes[edge.fix().index()] += 1;
            changes[edge.rev().fix().index()] -= 1;
        }
    }
    Some(changes)
}

/// How often the polygon winds around a point that is on none of its edges.
fn winding_around(p: &[[f64; 2]], q: [f64; 2]) -> i32 {
    let mut winding = 0;
    for i in 0..p.len() {
        let (a, b) = (p[i], p[(i + 1) % p.len()]);
        if (a[1] <= q[1]) != (b[1] <= q[1]) {
            let side = area(a, b, q);
            winding += if b[1] > a[1] { i32::from(side > 0.0) } else { -i32::from(side < 0.0) };
        }
    }
    winding
}
