use drt_math::{Frame, Vec3};

use super::mesh;
use super::tube::Tube;
use crate::Mesh;

/// The side of the cylinder of radius one about the z axis from z = 0 to z = 1, without its ends, as a
/// prism of `n` sides with the cylinder's own normals as shading normals. Stands for Mitsuba's
/// `cylinder`.
#[must_use]
pub fn cylinder(n: u32) -> Mesh {
    let n = n.max(3);
    let frame = Frame { s: Vec3::X, t: Vec3::Y, n: Vec3::Z };
    let mut tube = Tube::default();
    let ends = [Vec3::ZERO, Vec3::Z].map(|center| tube.ring(center, &frame, 1.0, n));
    tube.join(ends[0], ends[1], n, 0);
    let normals = Some(tube.positions.iter().map(|p| p.reject(Vec3::Z)).collect());
    Mesh { normals, ..mesh(tube.positions, tube.triangles) }
}
