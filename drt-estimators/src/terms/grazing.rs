//! Triangles that the camera sees edge on.
//!
//! Rays of the camera meet a surface in proportion to the cosine c of the angle of incidence. Where a value grows like 1/c, every
//! triangle adds to its mean alike, however thin it is in the image, but to its second moment like 1/c: one sample of a million may have
//! what thousands of others have. So points of such triangles are drawn by area, where the factor 1/c is no more, and the camera's
//! rays leave out what they find there.

use alloc::borrow::Cow;
use alloc::vec::Vec;

use drt_math::{CdfTable, Real, Rng, Vec3};

use crate::model::error::Error;
use crate::model::sensor::{Sensor, Viewpoint};
use crate::sampling::record::PathRecord;
use crate::sampling::trace::Endpoint;
use crate::world::World;
use crate::world::lights::triangle_bary;
use crate::world::vertex::SurfacePoint;

/// Cosine below which rounding decides what is seen of a face.
const IN_PLANE: f64 = 1e-9;

/// Triangles that the camera may see edge on. They are drawn in proportion to the angles that they would fill if they faced it.
#[derive(Debug)]
pub(crate) struct GrazingTriangles {
    triangles: Vec<Triangle>,
    table: CdfTable,
    /// By shape, the cosine of the angle of incidence below which it is seen edge on; 0 for shapes that do not count.
    below: Vec<f64>,
}

#[derive(Clone, Copy, Debug)]
struct Triangle {
    prim: u32,
    area: f64,
}

/// A point that is seen edge on.
pub(crate) struct GrazingPoint<'w> {
    pub(crate) point: SurfacePoint,
    pub(crate) x: Vec3,
    /// The point of the lens, and the camera there.
    pub(crate) lens: [f64; 2],
    pub(crate) camera: Cow<'w, Sensor>,
    /// Where the camera's ray starts.
    pub(crate) eye: Vec3,
    /// Of the angle between the geometric normal and the direction to the eye.
    pub(crate) cosine: f64,
    /// One over the density by area.
    pub(crate) inv_pdf: f64,
}

impl GrazingTriangles {
    /// Finds those of the shapes for which `below` is not 0: the cosine of the angle of incidence below which a shape is seen edge on.
    /// Returns `None` where there are none.
    pub(crate) fn new(world: &World, below: impl Fn(u32) -> f64) -> Result<Option<Self>, Error> {
        let viewpoint = world.camera.viewpoint();
        let below: Vec<f64> = (0..world.scene.shapes.len() as u32).map(below).collect();
        let (mut triangles, mut weights) = (Vec::new(), Vec::new());
        for (s, below) in below.iter().copied().enumerate().filter(|(_, below)| *below > 0.0) {
            let shape = &world.scene.shapes[s];
            for t in 0..shape.mesh.triangles.len() as u32 {
                let corners = shape.mesh.triangle(t);
                let across = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
                let area = 0.5 * across.length();
                let n = across.normalize();
                let (seen, r2) = match viewpoint {
                    Viewpoint::Infinity(forward) => (Real::abs(n.dot(forward)) < below, 1.0),
                    Viewpoint::Point(eye) => seen_from(corners, n, area, (eye, 0.0), below),
                    Viewpoint::Lens { centre, radius } => {
                        seen_from(corners, n, area, (centre, radius), below)
                    }
                };
                if area > 0.0 && seen {
                    triangles.push(Triangle { prim: world.prim_of(s, t), area });
                    weights.push(area / r2);
                }
            }
        }
        if triangles.is_empty() {
            return Ok(None);
        }
        let table = CdfTable::new(&weights).map_err(|e| Error::Element {
            element: "triangles seen edge on".into(),
            reason: e.into(),
        })?;
        Ok(Some(Self { triangles, table, below }))
    }

    /// The point of one of them at which a path begins, where the camera sees it edge on.
    pub(crate) fn first_of<'r>(&self, record: &'r PathRecord) -> Option<&'r SurfacePoint> {
        let arrivals = record.nodes.iter().skip(1).filter_map(|node| node.arrival.as_ref());
        let mut of_camera = arrivals.take_while(|arrival| arrival.parent == 0);
        let (point, dir) = of_camera.find_map(|arrival| match &arrival.end {
            Endpoint::Surface(vertex) => Some((vertex.surface()?, arrival.dir)),
            Endpoint::Volume(..) | Endpoint::Environment => None,
        })?;
        self.grazes(point, point.ng.dot(dir)).then_some(point)
    }

    /// True if a point of a surface is seen edge on, by the cosine of the angle of incidence.
    fn grazes(&self, point: &SurfacePoint, cosine: f64) -> bool {
        (IN_PLANE..self.below[point.shape as usize]).contains(&Real::abs(cosine))
    }

    /// Draws a point by area; `None` where it is not seen edge on.
    pub(crate) fn sample<'w>(&self, world: &'w World, rng: &mut Rng) -> Option<GrazingPoint<'w>> {
        let chosen = self.table.sample(rng.next_f64());
        let Triangle { prim, area } = self.triangles[chosen.index];
        let (point, x) = world.point(prim, triangle_bary(rng.next_2d()));
        let lens = world.camera.draw_lens(rng);
        let camera = world.camera.at_lens(lens);
        let eye = camera.eye_of(x);
        let to = eye - x;
        let cosine = point.ng.dot(to) / to.length();
        let inv_pdf = area / chosen.pmf;
        self.grazes(&point, cosine).then_some(GrazingPoint {
            point,
            x,
            lens,
            camera,
            eye,
            cosine,
            inv_pdf,
        })
    }
}

/// Whether a triangle with the unit normal `n` may be seen at cosines `below` from within a radius around the eye, and the square of its
/// distance, which is at least its area.
fn seen_from(
    corners: [Vec3; 3],
    n: Vec3,
    area: f64,
    (eye, radius): (Vec3, f64),
    below: f64,
) -> (bool, f64) {
    let height = Real::abs(n.dot(corners[0] - eye));
    let farthest = corners.iter().map(|c| (*c - eye).length()).fold(0.0, f64::max);
    let middle = (corners[0] + corners[1] + corners[2]) / 3.0 - eye;
    let r2 = f64::max(middle.length_squared(), area);
    (height - radius < below * (farthest + radius), r2)
}
