//! Edges that coincide: of shapes put together from several, side by side or on top of each other.
//!
//! Several edges at one place are one edge with all their faces. It can be grazed in a plane that
//! has all faces on one side, so within the widest gap between neighbouring faces as one goes around
//! the edge, if that is wider than half a turn; the two faces beside that gap decide.

use alloc::vec::Vec;
use core::f64::consts::PI;

use drt_math::Vec3;

use crate::edges::edge::Edge;

/// Half a turn, and what rounding may add to it.
const HALF_TURN: f64 = PI * (1.0 + 1e-9);

/// Makes one of all edges at the same place: of one that `moves`, where there is one. Those at which
/// nothing can be hidden go.
pub(crate) fn weld(mut edges: Vec<Edge>, moves: impl Fn(&Edge) -> bool) -> Vec<Edge> {
    let mut places: Vec<_> = edges.iter().zip(0..).map(|(e, i)| (e.place(), i)).collect();
    places.sort_unstable();
    let mut kept: Vec<bool> = edges.iter().map(|_| true).collect();
    for same in places.chunk_by(|a, b| a.0 == b.0).filter(|same| same.len() > 1) {
        let all: Vec<usize> = same.iter().map(|(_, i)| *i).collect();
        let main = all.iter().copied().find(|i| moves(&edges[*i])).unwrap_or(all[0]);
        let one = together(&edges, &all, main);
        for i in all {
            kept[i] = i == main && one.is_some();
        }
        if let Some(one) = one {
            edges[main] = one;
        }
    }
    let mut kept = kept.into_iter();
    edges.retain(|_| kept.next() == Some(true));
    edges
}

/// The edge `main` with the faces of all edges at its place; `None` where they leave no gap through
/// which it is grazed.
fn together(edges: &[Edge], all: &[usize], main: usize) -> Option<Edge> {
    let reference = &edges[main];
    let mut faces: Vec<(f64, u32, Vec3)> =
        all.iter().flat_map(|i| edges[*i].faces_around(reference)).collect();
    faces.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let next = |i: usize| (i + 1) % faces.len();
    let gap = |i: usize| {
        let turn = faces[next(i)].0 - faces[i].0;
        if next(i) == 0 { turn + 2.0 * PI } else { turn }
    };
    let widest = (0..faces.len()).max_by(|a, b| gap(*a).total_cmp(&gap(*b)))?;
    let beside = [faces[next(widest)], faces[widest]].map(|(_, face, across)| (face, across));
    let between = (2.0 * PI - gap(widest)).max(0.0);
    (gap(widest) > HALF_TURN).then(|| reference.among(beside, between))
}

#[cfg(test)]
mod tests {
    use drt_math::{Affine, Frame, Mat3, vec3};

    use super::*;
    use crate::edges::edge::GrazedSide;

    /// An open edge along z with its face at an angle, in a random place.
    fn sheet(angle: f64, prim: u32, backwards: bool) -> Edge {
        let frame = Frame::from_normal(vec3(0.3, -0.5, 0.8).normalize());
        let axes = Mat3 { cols: [frame.s, frame.t, frame.n] };
        let place = Affine { linear: axes, translation: vec3(1.0, 2.0, -0.5) };
        let mut ends = [vec3(0.0, 0.0, -1.0), vec3(0.0, 0.0, 1.0)].map(|p| place.point(p));
        if backwards {
            ends.reverse();
        }
        let opposite = place.point(vec3(angle.cos(), angle.sin(), 0.2));
        let corners = if backwards { [1, 0] } else { [0, 1] };
        Edge::new(ends, [opposite; 2], [prim; 2], prim, corners, GrazedSide::Unknown).unwrap()
    }

    fn joined(angles: &[f64]) -> Vec<Edge> {
        let edges = angles.iter().zip(0..).map(|(a, i)| sheet(*a, i, i % 2 == 1)).collect();
        weld(edges, |e| e.faces[0] == 1)
    }

    #[test]
    fn grazed_where_all_faces_are_on_one_side() {
        // Faces, and the directions (in the plane across the edge) that graze all of them.
        let turn = |degrees: f64| degrees.to_radians();
        let cases: [&[f64]; 4] =
            [&[20.0, 110.0], &[-30.0, 15.0, 60.0], &[170.0, 200.0], &[5.0, 5.0]];
        for faces in cases {
            let angles: Vec<f64> = faces.iter().map(|f| turn(*f)).collect();
            let welded = joined(&angles);
            assert_eq!(welded.len(), 1, "{faces:?}");
            // The one that moves stays.
            assert_eq!(welded[0].faces[0], 1);
            let alone: Vec<Edge> = angles.iter().map(|a| sheet(*a, 0, false)).collect();
            for step in 0..360 {
                let w = sheet(turn(f64::from(step) + 0.5), 0, false).faces_around(&alone[0])[0].2;
                let sides: Vec<Option<Vec3>> = alone.iter().map(|e| e.occluded_side(w)).collect();
                let agree = sides.iter().all(|s| s.is_some_and(|n| n.dot(sides[0].unwrap()) > 0.5));
                let found = welded[0].occluded_side(w);
                assert_eq!(found.is_some(), agree, "{faces:?} {step}");
                if let (Some(found), Some(expected)) = (found, sides[0]) {
                    assert!((found - expected).max_abs() < 1e-12);
                }
            }
        }
    }

    #[test]
    fn nothing_hides_where_faces_are_all_around() {
        let turn = |degrees: &f64| degrees.to_radians();
        for faces in [&[0.0, 180.0][..], &[0.0, 120.0, 240.0], &[10.0, 190.0, 100.0]] {
            let angles: Vec<f64> = faces.iter().map(turn).collect();
            assert!(joined(&angles).is_empty(), "{faces:?}");
        }
        // At different places, all stay.
        let mut apart = joined(&[0.1]);
        apart.extend([vec3(0.0, 0.0, 0.1), vec3(0.1, 0.0, 0.0)].map(|d| {
            let ends = [vec3(0.0, 0.0, -1.0), vec3(0.0, 0.0, 1.0)].map(|p| p + d);
            Edge::new(ends, [vec3(1.0, 0.0, 0.0); 2], [7; 2], 7, [0, 1], GrazedSide::Unknown)
                .unwrap()
        }));
        assert_eq!(weld(apart, |_| false).len(), 3);
    }
}
