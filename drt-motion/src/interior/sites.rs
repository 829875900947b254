//! What surrounds a medium, grouped by motion: surfaces that move alike, single triangles of those that
//! deform, and points.

use alloc::vec::Vec;

use drt_geom::TriangleBvh;
use drt_math::{Affine, Vec3};

use super::{InteriorError, Site, SurroundingSurface, Surroundings, triangle_field};
use crate::SurfaceMotion;

/// Triangles of a deforming surface that are blended one by one: each costs every volume vertex.
const MOST_TRIANGLES: usize = 1024;

/// Something around a medium that moves by one affine field for each parameter.
pub(super) struct MovingSite {
    pub(super) place: Place,
    /// Paths have vertices on it.
    pub(super) scatters: bool,
    /// Per parameter; zero where a surface deforms and does not count triangle by triangle.
    pub(super) velocities: Vec<Affine>,
}

/// Where a [`MovingSite`] is.
pub(super) enum Place {
    Surfaces(Vec<usize>),
    Triangle { surface: usize, triangle: u32 },
    Point(Vec3),
}

impl MovingSite {
    pub(super) fn point(&self) -> Option<Vec3> {
        match self.place {
            Place::Point(x) => Some(x),
            _ => None,
        }
    }

    /// As something to blend.
    pub(super) fn site(&self, around: &Surroundings<'_>) -> Result<Site, InteriorError> {
        Ok(match &self.place {
            Place::Point(x) => Site::Point(*x),
            Place::Triangle { surface, triangle } => {
                Site::Triangle(around.surfaces[*surface].mesh.triangle(*triangle))
            }
            Place::Surfaces(surfaces) => {
                let mut soup = Vec::new();
                for s in surfaces {
                    soup.extend(around.surfaces[*s].mesh.soup());
                }
                Site::Surface(TriangleBvh::build(&soup)?)
            }
        })
    }
}

impl SurroundingSurface<'_> {
    /// True when it counts triangle by triangle.
    fn is_split(&self) -> bool {
        self.deforms() && self.mesh.triangles.len() <= MOST_TRIANGLES
    }

    /// True when a parameter deforms it and it does not count triangle by triangle.
    pub(super) fn is_left_out(&self, parameter: usize) -> bool {
        self.deforms_by(parameter) && !self.is_split()
    }

    /// Its triangles, each with its own linear field.
    fn triangles(&self, surface: usize, parameters: usize) -> impl Iterator<Item = MovingSite> {
        (0..self.mesh.triangles.len() as u32).map(move |t| {
            let mut velocities = alloc::vec![Affine::ZERO; parameters];
            for (p, motion) in self.motions {
                velocities[*p] = match motion {
                    SurfaceMotion::Rest => Affine::ZERO,
                    SurfaceMotion::Affine(field) => *field,
                    SurfaceMotion::Vertices { positions, .. } => {
                        let corners =
                            self.mesh.triangles[t as usize].map(|v| positions[v as usize]);
                        triangle_field(self.mesh.triangle(t), corners)
                    }
                };
            }
            let place = Place::Triangle { surface, triangle: t };
            MovingSite { place, scatters: self.scatters, velocities }
        })
    }
}

impl Surroundings<'_> {
    /// Everything around the medium, grouped by motion; the surfaces come first.
    pub(super) fn sites(&self) -> Vec<MovingSite> {
        let mut sites: Vec<MovingSite> = Vec::new();
        for (s, surface) in self.surfaces.iter().enumerate() {
            let scatters = surface.scatters;
            if surface.is_split() {
                sites.extend(surface.triangles(s, self.parameters));
                continue;
            }
            let mut velocities = alloc::vec![Affine::ZERO; self.parameters];
            for (p, motion) in surface.motions {
                if let SurfaceMotion::Affine(field) = motion {
                    velocities[*p] = *field;
                }
            }
            let same = sites.iter_mut().find_map(|site| match &mut site.place {
                Place::Surfaces(list)
                    if site.scatters == scatters && site.velocities == velocities =>
                {
                    Some(list)
                }
                _ => None,
            });
            match same {
                Some(list) => list.push(s),
                None => {
                    let place = Place::Surfaces(alloc::vec![s]);
                    sites.push(MovingSite { place, scatters, velocities });
                }
            }
        }
        for point in &self.points {
            let mut velocities = alloc::vec![Affine::ZERO; self.parameters];
            for (p, v) in &point.velocities {
                velocities[*p] = Affine { translation: *v, ..Affine::ZERO };
            }
            sites.push(MovingSite {
                place: Place::Point(point.position),
                scatters: true,
                velocities,
            });
        }
        sites
    }
}
