//! What passes through the faces at an edge, and how the line where they meet moves.

use drt_geom::edges::Wedge;
use drt_math::Vec3;

use crate::derivative::velocity::EdgeMatter;
use crate::world::World;

/// The middle of a triangle.
const CENTER: [f64; 2] = [1.0 / 3.0; 2];

/// Four faces around a line, and the unit vectors across it into them.
pub(crate) type Sheets = [(u32, Vec3); 4];

/// The faces of a shape, on the two sides of those they pass through; one twice, unless the line where they meet is an edge of theirs.
#[derive(Clone, Copy, Debug)]
pub(super) struct Crossed {
    pub(super) shape: u32,
    pub(super) faces: [u32; 2],
}

impl Crossed {
    /// The faces around the line, first those of its wedge.
    pub(super) fn sheets(&self, world: &World, wedge: &Wedge) -> Sheets {
        let middle = wedge.at(0.5);
        let [[a, b], [c, d]] = [wedge.faces, self.faces].map(|faces| {
            let [first, second] = faces.map(|face| {
                let (point, x) = world.point(face, CENTER);
                let across = point.ng.cross(wedge.tangent).normalize();
                (face, if across.dot(x - middle) < 0.0 { -across } else { across })
            });
            if first.0 == second.0 { [first, (first.0, -first.1)] } else { [first, second] }
        });
        [a, b, c, d]
    }

    /// How a point x of the line moves.
    pub(super) fn matter(&self, world: &World, wedge: &Wedge, x: Vec3) -> [EdgeMatter; 2] {
        let faces = [wedge.faces, self.faces];
        // At an edge between two faces, as if it were rounded off.
        let normals = faces.map(|faces| {
            let [n, m] = faces.map(|face| world.point(face, CENTER).0.ng);
            (n + if n.dot(m) < 0.0 { -m } else { m }).normalize()
        });
        let points = faces.map(|[face, _]| world.point_near(face, x).0.material());
        EdgeMatter::of_crossing(points, normals)
    }
}
