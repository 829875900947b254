//! The faces around a line along which two surfaces intersect.

use drt_geom::edges::Wedge;
use drt_math::Vec3;

use crate::derivative::velocity::EdgeMatter;
use crate::world::World;

/// The middle of a triangle.
const CENTER: [f64; 2] = [1.0 / 3.0; 2];

/// Four faces around a line, and the unit vectors across it into them.
pub(crate) type Sheets = [(u32, Vec3); 4];

/// The faces of a shape on the two sides of another's; one twice, unless an edge between two lies in the other.
#[derive(Clone, Copy, Debug)]
pub(super) struct IntersectingFaces {
    pub(super) shape: u32,
    pub(super) faces: [u32; 2],
}

impl IntersectingFaces {
    /// The faces around the line, first those of its wedge. Few samples are of such lines: what all edges would have to keep for them
    /// is computed.
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
        let [a, b, c, d] = self.sheets(world, wedge);
        // At an edge between two faces, as if it were rounded off.
        let normals = [[a, b], [c, d]]
            .map(|[(_, first), (_, second)]| wedge.tangent.cross(first - second).normalize());
        let points = [a, c].map(|(face, _)| world.point_near(face, x).0.material());
        EdgeMatter::of_intersection(points, normals)
    }
}
