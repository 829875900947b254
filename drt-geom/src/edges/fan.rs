//! All faces around an edge.

use alloc::vec::Vec;
use core::f64::consts::PI;

use drt_math::{Vec3, fm};

use crate::edges::Wedge;

/// Half a turn, and what rounding may add to it.
const HALF_TURN: f64 = PI * (1.0 + 1e-9);

/// A face at an edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FanFace {
    /// Around the edge in radians, from the direction of the edge's first face.
    pub angle: f64,
    /// Its number.
    pub face: u32,
    /// Unit, across the edge into the face.
    pub across: Vec3,
}

/// An edge and all faces around it, in the order of their angles.
#[derive(Clone, Copy, Debug)]
pub struct Fan<'a> {
    /// The edge that angles are measured from.
    pub edge: &'a Wedge,
    /// By their angles.
    pub faces: &'a [FanFace],
}

/// The widest angle between neighbouring faces around an edge, if it is more than half a turn: what grazes the
/// edge has all faces on one side, so that the two faces beside it decide.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gap {
    /// The face after the gap, and the one before it.
    pub beside: [FanFace; 2],
    /// Angle in radians that holds all faces.
    pub between: f64,
}

/// What is seen on the two sides of an edge.
#[derive(Clone, Copy, Debug)]
pub struct EdgeSides {
    /// Unit normal of the plane of the edge and the viewer.
    pub n: Vec3,
    /// Sine of the angle between edge and view.
    pub sine: f64,
    /// The face on the side of `n`, and the one on the other side, with the unit vectors across the edge into
    /// them; `None` where one sees past the edge.
    pub faces: [Option<(u32, Vec3)>; 2],
}

impl EdgeSides {
    /// The faces that rays from the edge ignore.
    #[must_use]
    pub fn own_faces(&self) -> Option<[u32; 2]> {
        let [a, b] = self.faces.map(|f| f.map(|(face, _)| face));
        Some([a.or(b)?, b.or(a)?])
    }

    /// To the side on which one sees past the edge.
    #[must_use]
    pub fn outward(&self) -> Vec3 {
        if self.faces[0].is_none() { self.n } else { -self.n }
    }
}

/// The faces of edges that coincide with `edge`, each once, in the order in which one goes around it.
pub fn faces_around<'a>(
    edge: &Wedge,
    coincident: impl IntoIterator<Item = &'a Wedge>,
) -> Vec<FanFace> {
    let mut fan: Vec<FanFace> = Vec::new();
    for other in coincident {
        for (face, across) in other.faces.into_iter().zip(other.across) {
            if fan.iter().all(|f| f.face != face) {
                fan.push(FanFace::new(edge, face, across));
            }
        }
    }
    fan.sort_unstable_by(|a, b| a.angle.total_cmp(&b.angle));
    fan
}

impl FanFace {
    /// A face into which the unit vector `across` an edge points.
    #[must_use]
    pub fn new(edge: &Wedge, face: u32, across: Vec3) -> Self {
        let (x, y) = axes(edge);
        Self { angle: fm::atan2(across.dot(y), across.dot(x)), face, across }
    }
}

/// The directions across an edge from which angles are measured, and a quarter turn on.
fn axes(edge: &Wedge) -> (Vec3, Vec3) {
    let x = edge.across[0];
    (x, edge.tangent.cross(x))
}

impl Fan<'_> {
    /// The gap through which the edge is grazed; `None` where faces are all around.
    #[must_use]
    pub fn widest_gap(&self) -> Option<Gap> {
        let faces = self.faces;
        let next = |i: usize| (i + 1) % faces.len();
        let gap = |i: usize| {
            let turn = faces[next(i)].angle - faces[i].angle;
            if next(i) == 0 { turn + 2.0 * PI } else { turn }
        };
        let widest = (0..faces.len()).max_by(|a, b| gap(*a).total_cmp(&gap(*b)))?;
        let beside = [faces[next(widest)], faces[widest]];
        let between = (2.0 * PI - gap(widest)).max(0.0);
        (gap(widest) > HALF_TURN).then_some(Gap { beside, between })
    }

    /// What a viewer sees of the edge, who is along the unit `w` from it; `None` along the edge.
    #[must_use]
    pub fn sides(&self, w: Vec3) -> Option<EdgeSides> {
        let n = self.edge.tangent.cross(w);
        let sine = n.length();
        if sine < 1e-12 {
            return None;
        }
        let (x, y) = axes(self.edge);
        let view = fm::atan2(w.dot(y), w.dot(x));
        let turn = |angle: f64| if angle < 0.0 { angle + 2.0 * PI } else { angle };
        // The first face met on each way around.
        let first = |turned: fn(f64, f64) -> f64| {
            let nearest = |b: &FanFace| turn(turned(b.angle, view));
            self.faces
                .iter()
                .min_by(|a, b| nearest(a).total_cmp(&nearest(b)))
                .filter(|b| nearest(b) < PI)
                .map(|b| (b.face, b.across))
        };
        let faces = [first(|angle, view| angle - view), first(|angle, view| view - angle)];
        Some(EdgeSides { n: n / sine, sine, faces })
    }
}

#[cfg(test)]
mod tests {
    use drt_math::{Affine, Frame, Mat3, vec3};

    use super::*;

    /// An open edge along z with its face at an angle in degrees, in a random place.
    fn sheet(degrees: f64, face: u32) -> Wedge {
        let angle = degrees.to_radians();
        let frame = Frame::from_normal(vec3(0.3, -0.5, 0.8).normalize());
        let axes = Mat3 { cols: [frame.s, frame.t, frame.n] };
        let place = Affine { linear: axes, translation: vec3(1.0, 2.0, -0.5) };
        let mut ends = [vec3(0.0, 0.0, -1.0), vec3(0.0, 0.0, 1.0)].map(|p| place.point(p));
        if face % 2 == 1 {
            ends.reverse();
        }
        let opposite = place.point(vec3(angle.cos(), angle.sin(), 0.2));
        Wedge::new(ends, [opposite; 2], [face; 2]).unwrap()
    }

    fn sheets(degrees: &[f64]) -> Vec<Wedge> {
        degrees.iter().zip(0..).map(|(a, i)| sheet(*a, i)).collect()
    }

    #[test]
    fn grazed_where_all_faces_are_on_one_side() {
        let cases: [&[f64]; 4] =
            [&[20.0, 110.0], &[-30.0, 15.0, 60.0], &[170.0, 200.0], &[5.0, 5.0]];
        for degrees in cases {
            let sheets = sheets(degrees);
            let faces = faces_around(&sheets[0], &sheets);
            assert_eq!(faces.len(), sheets.len());
            let fan = Fan { edge: &sheets[0], faces: &faces };
            let gap = fan.widest_gap().unwrap();
            let joined =
                Wedge { across: gap.beside.map(|f| f.across), between: gap.between, ..sheets[0] };
            for step in 0..360 {
                let w = sheet(f64::from(step) + 0.5, 0).across[0];
                let sides: Vec<Option<Vec3>> = sheets.iter().map(|e| e.occluded_side(w)).collect();
                let agree = sides.iter().all(|s| s.is_some_and(|n| n.dot(sides[0].unwrap()) > 0.5));
                let found = joined.occluded_side(w);
                assert_eq!(found.is_some(), agree, "{degrees:?} {step}");
                if let (Some(found), Some(expected)) = (found, sides[0]) {
                    assert!((found - expected).max_abs() < 1e-12);
                }
                // One sees past it on just one side.
                let seen = fan.sides(w).unwrap();
                let past = seen.faces.iter().filter(|f| f.is_none()).count();
                assert_eq!(past == 1, agree, "{degrees:?} {step}");
                if agree {
                    assert!((seen.outward() + found.unwrap()).max_abs() < 1e-12);
                }
            }
        }
    }

    #[test]
    fn nothing_hides_where_faces_are_all_around() {
        for degrees in [&[0.0, 180.0][..], &[0.0, 120.0, 240.0], &[10.0, 190.0, 100.0]] {
            let sheets = sheets(degrees);
            let faces = faces_around(&sheets[0], &sheets);
            assert_eq!(Fan { edge: &sheets[0], faces: &faces }.widest_gap(), None, "{degrees:?}");
        }
    }
}
