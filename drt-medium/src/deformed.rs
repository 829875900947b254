//! Grids seen through a deformation of space: the medium at x is what the grids hold at the material
//! point that has come to x.

use alloc::sync::Arc;
use alloc::vec::Vec;
use core::fmt::Debug;
use core::ops::ControlFlow;

use drt_math::{Affine, Mat3, Rgb, RgbVec, Vec3};

use crate::bounds::clip_to_box;
use crate::{CoefficientGradients, Coefficients, Crossing, DensityField, GridMedium, Piece, Ray};

/// A continuous map between the world and the space in which grids were placed, affine in pieces.
///
/// Space is never turned inside out: the map is one to one.
pub trait SpaceMap: Debug + Send + Sync {
    /// The material point X that is at a point x of the world, and dX/dx; `None` where there is none.
    fn material(&self, x: Vec3) -> Option<(Vec3, Mat3)>;

    /// Shows the stretches of a ray on which the map is affine, `(start, end, map from the world)`, in
    /// increasing order of distance until `visit` breaks. What is left out is empty.
    fn stretches(&self, ray: &Ray, visit: &mut dyn FnMut(f64, f64, &Affine) -> ControlFlow<()>);
}

/// A [`GridMedium`] that a map of space deforms.
#[derive(Clone, Debug)]
pub struct DeformedGrid {
    pub(crate) grids: GridMedium,
    map: Arc<dyn SpaceMap>,
}

/// A part of a ray that is inside the box of the density grid.
struct Passage {
    ends: [f64; 2],
    /// The maps at both ends.
    maps: [Affine; 2],
}

impl DeformedGrid {
    /// Grids as they are placed before the deformation, and the deformation.
    #[must_use]
    pub fn new(grids: GridMedium, map: Arc<dyn SpaceMap>) -> Self {
        Self { grids, map }
    }

    /// The grids, placed as before the deformation.
    #[must_use]
    pub fn grids(&self) -> &GridMedium {
        &self.grids
    }

    /// The material point at a point of the world, and dX/dx; `None` outside of the density grid's box.
    #[inline]
    pub(crate) fn material(&self, x: Vec3) -> Option<(Vec3, Mat3)> {
        self.map.material(x).filter(|(material, _)| self.grids.contains(*material))
    }

    /// Where a ray passes through the faces of the density grid's box, which may be often; see
    /// [`GridMedium::crossings`].
    pub(crate) fn crossings(&self, ray: &Ray) -> Vec<Crossing> {
        let margin = self.grids.crossing_margin();
        let mut crossings = Vec::new();
        for passage in self.passages(ray) {
            for (t, map) in passage.ends.into_iter().zip(&passage.maps) {
                if t > margin && t < ray.t_max - margin {
                    let unit = self.grids.density().from_world().after(map);
                    crossings.push(self.grids.crossing(&unit, ray, t));
                }
            }
        }
        crossings
    }

    /// The parts of a ray inside the box. Those nearer than crossings are told apart from a ray's ends
    /// are one: a face of the box may be where the map's pieces meet.
    fn passages(&self, ray: &Ray) -> Vec<Passage> {
        let margin = self.grids.crossing_margin();
        let mut passages: Vec<Passage> = Vec::new();
        self.map.stretches(ray, &mut |start, end, map| {
            if let Some((a, b)) =
                clip_to_box(self.grids.density(), &seen_from(ray, start, end, map))
            {
                let [a, b] = [start + a, start + b];
                match passages.last_mut().filter(|p| p.ends[1] > a - margin) {
                    Some(p) => (p.ends[1], p.maps[1]) = (b, *map),
                    None => passages.push(Passage { ends: [a, b], maps: [*map; 2] }),
                }
            }
            ControlFlow::Continue(())
        });
        passages.retain(|p| p.ends[1] - p.ends[0] > margin);
        passages
    }
}

/// A stretch of a ray in the space of the grids, with distances from its start.
fn seen_from(ray: &Ray, start: f64, end: f64, map: &Affine) -> Ray {
    Ray::new(map.point(ray.at(start)), map.vector(ray.dir)).until(end - start)
}

impl DensityField for DeformedGrid {
    fn coefficients(&self, x: Vec3) -> Coefficients {
        self.map.material(x).map_or(Coefficients::VACUUM, |(m, _)| self.grids.coefficients(m))
    }

    fn sigma_t(&self, x: Vec3) -> Rgb {
        self.map.material(x).map_or(Rgb::ZERO, |(m, _)| self.grids.sigma_t(m))
    }

    fn gradients(&self, x: Vec3) -> CoefficientGradients {
        let Some((material, slope)) = self.map.material(x) else {
            return CoefficientGradients::ZERO;
        };
        let g = self.grids.gradients(material);
        let world = |g: RgbVec| g.map(|g| slope.transpose_mul(g));
        CoefficientGradients {
            sigma_t: world(g.sigma_t),
            albedo: world(g.albedo),
            emission: world(g.emission),
        }
    }

    fn pieces(&self, ray: &Ray, visit: &mut dyn FnMut(&Piece) -> ControlFlow<()>) {
        self.map.stretches(ray, &mut |start, end, map| {
            let mut flow = ControlFlow::Continue(());
            self.grids.pieces(&seen_from(ray, start, end, map), &mut |piece| {
                let (start, end) = (start + piece.start, start + piece.end);
                flow = visit(&Piece { start, end, ..*piece });
                flow
            });
            flow
        });
    }

    fn means(&self, ray: &Ray, visit: &mut dyn FnMut(&Piece) -> ControlFlow<()>) {
        self.map.stretches(ray, &mut |start, end, map| {
            let mut flow = ControlFlow::Continue(());
            self.grids.means(&seen_from(ray, start, end, map), &mut |piece| {
                let (start, end) = (start + piece.start, start + piece.end);
                flow = visit(&Piece { start, end, ..*piece });
                flow
            });
            flow
        });
    }

    fn covered(&self, ray: &Ray) -> Option<(f64, f64)> {
        let mut covered: Option<(f64, f64)> = None;
        self.map.stretches(ray, &mut |start, end, map| {
            if let Some((a, b)) =
                clip_to_box(self.grids.density(), &seen_from(ray, start, end, map))
            {
                covered = Some((covered.map_or(start + a, |c| c.0), start + b));
            }
            ControlFlow::Continue(())
        });
        covered
    }

    fn majorant_floor(&self) -> f64 {
        self.grids.majorant_floor()
    }

    fn feature_size(&self) -> f64 {
        self.grids.feature_size()
    }
}
