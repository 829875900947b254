//! The 2023 estimator: no edge is sampled; vertices move with the edges beside them instead.
//!
//! The boundary term of the derivative of an integral whose integrand f jumps becomes an interior term when points move
//! by a velocity field v that has the boundary's velocity where the integrand jumps (2023 paper, Eqs. 10 and 38; theory
//! sheet §9):
//!
//! ```text
//! d/dθ ∫ f dp = ∫ [∂f + div(f v)] dp.
//! ```
//!
//! Elsewhere v is free. The paper smooths a discontinuous velocity, which is known at auxiliary points, in the plane of
//! each vertex. That version is [here](auxiliary) for comparison; its ratio of estimates is biased, it traces more
//! rays, and it works for surfaces only.
//!
//! # By edges
//!
//! The default uses the edges themselves. In the spatial form (theory sheet §3, §10 route B) a path is a function
//! of directions, and radiance jumps at directions in which an edge is seen from the ray's origin x: silhouettes,
//! borders, and creases between faces of different radiance. A ray along the unit vector ω
//! [turns](crate::derivative::velocity::RayTurn) at a rate T(ω) that is near
//!
//! ```text
//! c_e = (1 - ω ω^T) (u_e - x_dot) / r_e
//! ```
//!
//! beside each edge within an angle Δ of ω (0.1 radians; less for camera rays and creases of curved surfaces).
//! Here e is the point of an edge that is nearest to the ray, u_e its velocity, r_e its distance from x, and x_dot the
//! velocity of x. T is a mean of the c_e, T = Σ λ_e c_e with λ_e = w_e / (1 + Σ w). For the camera's rays where a filter jumps, and the camera
//! is at rest, the weights are [matrices](held): across an edge T follows the edge, and along it T is free.
//! With q the squared sine of the angle between ω and e,
//!
//! ```text
//! w_e = c s (sin² Δ - q) / (q + (1 - s) sin² Δ).
//! ```
//!
//! s is 1 for edges in front of the plane of the surface where the ray ends, and falls to 0 behind it. c is the sine of
//! the angle that the edge subtends at x, over sin Δ, and at most 1: the many short edges of a fine mesh together have
//! the weight of the line that they approximate, however fine the mesh is. So a single long edge has λ = 1 - q / sin²
//! Δ. On an edge that is visible, the ray turns across it exactly as fast as the edge does, T is continuous wherever radiance is,
//! and its divergence is a closed form. There are no auxiliary rays and there is no bias.
//!
//! A crease between two faces of one shape is no discontinuity for a ray that ends on another shape. It counts only for
//! rays that end on its own shape, unless it rests on another surface.
//!
//! Radiance from the crease's own shape need not jump there either. An emitter whose radiance is constant emits equally
//! on both sides of its creases, though the light that it scatters jumps. Emission and scattering are summands of a
//! path's value, and each has a field of its own. For [emission](crate::derivative::adjoint), as next-event estimation
//! and rays that hit an emitter find it, creases of the emitter do not count, and s depends on how far beyond the end
//! of the ray the nearest point of an edge is, because the planes of facets jump at creases. So it is of shapes at whose creases nothing jumps.
//! For edges of the shape itself s is then 1: on facets that are seen nearly edge-on, beside a silhouette, it would rise from 0 to 1 within their narrow width.
//!
//! | requirement (theory sheet §9) | why it holds |
//! |---|---|
//! | T is the velocity of each visible edge across it | its w diverges there, and no other weight does, except at points where edges cross |
//! | T is continuous elsewhere | which edges count depends on x and the shape where the ray ends, which changes at edges that count; w is continuous in ω, and s on a face |
//! | s may differ on the two sides of a crease or silhouette | there T is that edge's velocity on both sides |
//! | no condition at horizons | scattered light vanishes there; edges below them are left out |
//! | x moves by its whole velocity | x_dot is that of the vertex before, its own turn included: each vertex is conditioned on the one before (theory sheet §9.3) |
//!
//! Where two edges cross in projection, or an edge and the border of a pixel, T has a limit that depends on direction: its divergence grows as one over the
//! distance, with a finite mean and a second moment that diverges like a logarithm. With matrices for weights one rate follows both, and T is near it on all
//! sides. On the other hand, T then changes along an edge from one of its ends to the next, which on fine meshes costs more than crossings do where
//! there are no borders.
//!
//! Vertices on surfaces that are curved, by their normals or their facets, have the velocity u of their matter as far
//! as edges leave weight for it and the vertex before is not near: v = λ_0 φ u + ..., with λ_0 = 1 - Σ λ. Creases
//! between their facets then turn only rays that nearly hit them, and are found in a [tree](drt_geom::edges::ConeTree)
//! that skips facets which are seen from one side.
//!
//! # Textures
//!
//! Vertices slide over surfaces, so that radiance jumps where a texture does: along straight lines between texels that are not
//! interpolated, and at edges at which triangles have other coordinates. Such a line is a crease between two faces of one plane, and counts as
//! one. Where light goes straight through, what rays see behind the surface jumps there as well, and the line counts as a silhouette.
//!
//! # In volumes
//!
//! A vertex in a medium is at a fixed distance along its ray, and turns with the ray; so do the points at which the
//! medium attenuates the ray. All points of a ray turn by the same angle, so the condition on edges in front of a
//! vertex also holds for those behind it. Surfaces beside media keep the [flux](crate::terms::flux) of the spatial
//! form, relative to rays that turn. Nothing else is needed: interfaces, grids, emission and several media are as in
//! the 2019 estimator, whose edge queries this field replaces.
//!
//! # The camera
//!
//! Camera rays keep their image points (2019 paper) except where they turn with an edge. Where a filter jumps, the
//! borders of its support are edges at rest in the image, across which no ray turns, and points seen there keep their image point: the material
//! velocity of curved surfaces falls to zero towards borders.
//!
//! An edge that lies along a border, as in symmetric scenes, would require two velocities of one ray. No camera ray
//! turns with such an edge; where it moves, it is [sampled](crate::terms::edge_queries) as an edge that the camera
//! sees.
//!
//! # Points and directions
//!
//! The light of point, spot and directional emitters jumps on surfaces along the shadows of edges, where no edge is
//! seen from the vertex before. A next-event connection to such an emitter gives the ray that found its vertex a rate
//! of its own, in which [shadows](crate::derivative::velocity::ShadowTurn) of edges near the connection have weights
//! beside those of edges near the ray. Their weights have the form above, with the squared distance of a shadow over
//! the squared radius of what the ray and the light see within Δ (the two squares are combined as parallel resistances
//! are). Only silhouettes as seen from the light count. Each such connection is differentiated separately, in one more
//! step of the backward sweep. Where the vertex is seen past smooth surfaces, its connection is the last ray of their
//! chain: shadows turn the chain's first ray, and all of the chain is swept once more.
//!
//! # What is left to boundary samples
//!
//! Boundary samples remain for edges along borders of pixels, as the camera sees them. The light of point, spot and
//! directional emitters in scenes with media or null interfaces, where lines of shadow become sheets in the volume, is
//! left to the path-space estimator where something moves; the plan of a [`Session`](crate::Session) says so.

mod angular_distance;
mod auxiliary;
mod behind_chains;
mod critical_angle;
mod edge;
mod edge_weights;
mod edges;
mod rates_across;
mod shadows;
#[cfg(all(test, feature = "std"))]
mod tests;
mod turning;

use alloc::sync::Arc;
use alloc::vec::Vec;

use crate::derivative::medium_motion::Insides;
use crate::derivative::sensitivity::ActiveInputs;
use crate::derivative::velocity::Spatial;
use crate::derivative::velocity::blend::curvature;
use crate::discontinuities::discontinuity_edge::{DiscontinuityEdge, DiscontinuityEdges};
use crate::estimators::orthographic_refusals::{self, Film};
use crate::estimators::warped::auxiliary::directions::AuxiliaryDirections;
use crate::estimators::warped::auxiliary::points::AuxiliaryPoints;
use crate::estimators::warped::edge::TurningEdge;
use crate::estimators::warped::edges::TurningEdges;
use crate::estimators::warped::turning::EdgeTurns;
use crate::estimators::{Changes, Estimator, mirrors};
use crate::model::error::{ElementError, Error, SettingError};
use crate::model::refusals::Sliding;
use crate::model::scene::{Scene, unusable};
use crate::model::settings::{PathSampling, Settings, Warp};
use crate::terms::boundary_source::BoundarySource;
use crate::terms::edge_queries::SeenEdges;
use crate::terms::flux::Flux;
use crate::terms::selected::Terms;
use crate::world::World;

/// Vertices move with the edges beside them, so that hardly any edge is sampled.
pub(crate) struct Warped;

impl Estimator for Warped {
    fn name(&self) -> &'static str {
        "warped"
    }

    fn insides(&self) -> Insides {
        Insides::AtRest
    }

    fn slides(&self, settings: &Settings) -> Sliding {
        match settings.warp {
            Warp::Edges => Sliding::AcrossLines,
            Warp::Points(_) | Warp::Directions(_) => Sliding::Continuously,
        }
    }

    // What lies behind a connection turns alike for all light that it brings.
    fn takes_delta_lights(&self, scene: &Scene, settings: &Settings) -> bool {
        let volumes = !scene.media.is_empty() || scene.bsdfs.iter().any(|b| b.item.is_null());
        // What is chosen for images, derivatives do not have.
        let from_camera = settings.sampling != PathSampling::Bidirectional;
        !volumes && matches!(settings.warp, Warp::Edges) && from_camera
    }

    fn terms(&self, world: &World, changes: &Changes<'_>) -> Result<Terms, Error> {
        orthographic_refusals::refuse(world, changes, Film::Turning)?;
        let Changes { active, settings, .. } = *changes;
        let lights = &active.moving_emitters;
        let lists = [&active.shapes, lights, &active.bending];
        let any = active.sensor || lists.into_iter().any(|list| list.contains(&true));
        refuse(world, settings.warp, any)?;
        let found = if any {
            DiscontinuityEdges::collect(world, &active.shapes)
        } else {
            DiscontinuityEdges::default()
        };
        let count = [found.list.len() as u64, found.all];
        let mut spatial = Spatial::new(world, active);
        spatial.blends.leave_media();
        let spatial = Arc::new(spatial);
        let moves = |edge: &DiscontinuityEdge| edge.moves(&active.shapes);
        let lamp = |shape: u32| world.scene.shapes[shape as usize].emitter.is_some();
        let curvatures: Vec<f64> = (0..world.scene.shapes.len() as u32)
            .map(|s| if lamp(s) { curvature(world, s) } else { spatial.blends.curvature(s) })
            .collect();
        let curved = |shape: u32| curvatures[shape as usize] > 0.0;
        let lines = if any { texture_lines(world, active)? } else { Vec::new() };
        let edges = TurningEdges::new(world, &found, moves, curved, lines);
        let mut terms = match settings.warp {
            Warp::Edges => {
                let field = EdgeTurns::new(world, active, Arc::clone(&spatial), edges);
                let mut terms = Terms::interior(Arc::new(field));
                let on_border = |edge: &DiscontinuityEdge| {
                    (active.sensor || moves(edge))
                        && world.camera.sees_on_border(edge.edge.wedge.ends)
                };
                terms.edges = SeenEdges::in_view(world, found, Arc::clone(&spatial), on_border)?;
                if world.hides_emitters && terms.edges.is_some() {
                    let reason = ElementError::HiddenAtBorder;
                    return Err(Error::Element { element: "integrator".into(), reason });
                }
                terms.sources.extend(terms.edges.as_ref().map(|_| BoundarySource::PrimaryEdges));
                terms.flux = flux(world, active, &spatial);
                terms
            }
            Warp::Points(samples) => {
                let field = AuxiliaryPoints::new(world, active, edges, samples);
                let mut terms = Terms::interior(Arc::new(field));
                if active.moves_geometry() && world.camera.has_borders() {
                    terms.sources.push(BoundarySource::Borders);
                }
                terms
            }
            Warp::Directions(samples) => {
                let field = AuxiliaryDirections::new(world, Arc::clone(&spatial), edges, samples);
                let mut terms = Terms::interior(Arc::new(field));
                terms.flux = flux(world, active, &spatial);
                terms
            }
        };
        terms.edge_count = count;
        terms.share_samples(settings, terms.sources.len());
        terms.antithetic = mirrors(world, changes);
        terms.add_light_paths(world, changes);
        Ok(terms)
    }
}

/// The lines on surfaces along which textures jump. What jumps elsewhere has been refused.
fn texture_lines(world: &World, active: &ActiveInputs) -> Result<Vec<TurningEdge>, Error> {
    let mut lines = Vec::new();
    for (shape, moves) in active.shapes.iter().enumerate() {
        for line in world.scene.lines_on(shape).unwrap_or_default() {
            let edge = TurningEdge::of_texture(world, shape as u32, line, *moves);
            if edge.on_border && (*moves || active.sensor) {
                let reason = ElementError::TextureAtBorder;
                return Err(unusable(&world.scene.shapes[shape].id, "shape", shape, reason));
            }
            lines.push(edge);
        }
    }
    Ok(lines)
}

/// Refuses what the kinds of warp cannot do that do not know edges, where `any` edge may move.
fn refuse(world: &World, warp: Warp, any: bool) -> Result<(), Error> {
    let surfaces_only = !(world.has_media() || world.any_null);
    let reason = match warp {
        Warp::Edges => return Ok(()),
        _ if !surfaces_only => SettingError::SurfacesOnly,
        _ if any && world.scene.first_smooth().is_some() => SettingError::SmoothSurfaces,
        _ if any && world.hides_emitters => SettingError::HiddenFromWarp,
        _ if any && world.camera.aperture().is_some() => SettingError::Aperture,
        _ if any && world.lights.has_image() => SettingError::VaryingSky,
        Warp::Directions(_) if world.camera.has_borders() => SettingError::JumpingFilter,
        _ => return Ok(()),
    };
    Err(Error::Setting { setting: "warp", reason })
}

/// What sweeps over rays that turn.
fn flux(world: &World, active: &ActiveInputs, spatial: &Arc<Spatial>) -> Option<Flux> {
    let sweeps = active.moves_geometry() || active.grids.contains(&true);
    let flux = sweeps.then(|| Flux::spatial(world, active, spatial)).flatten();
    flux.map(Flux::along_rays)
}
