//! What surrounds each medium: its surfaces, and the cameras and point lights in it.

use alloc::vec::Vec;

use drt_math::Vec3;
use drt_motion::interior::{InteriorPoint, SurroundingSurface, Surroundings, enclosing_box};

use crate::derivative::medium_motion::adjacency::adjacency;
use crate::derivative::tangents::Tangents;
use crate::world::World;

/// What surrounds a medium, and where in the scene it comes from.
pub(super) struct MediumSurroundings<'a> {
    pub(super) inputs: Surroundings<'a>,
    /// The shape of each surface.
    pub(super) shapes: Vec<usize>,
    /// The item of each point.
    pub(super) anchors: Vec<Anchor>,
}

/// A point inside a medium whose velocity is its own.
#[derive(Clone, Copy, Debug)]
pub(super) enum Anchor {
    Camera,
    Emitter(usize),
}

/// The surroundings of all media, in their order; without tangents, at rest.
pub(super) fn surroundings<'a>(
    world: &'a World,
    tangents: Option<&'a Tangents>,
) -> impl Iterator<Item = MediumSurroundings<'a>> {
    let adjacent = adjacency(world);
    (0..world.scene.media.len()).map(move |medium| {
        let touches = |s: &usize| adjacent[*s].contains(&medium);
        let shapes: Vec<usize> = (0..adjacent.len()).filter(touches).collect();
        let surface = |s: &usize| SurroundingSurface {
            mesh: &world.scene.shapes[*s].mesh,
            motions: tangents.map_or(&[], |t| &t.shapes[*s]),
            scatters: world.scatters(*s),
        };
        let (anchors, points) = points(world, tangents, medium);
        let beyond = enclosing_box(shapes.iter().map(|s| &*world.scene.shapes[*s].mesh)).max;
        let inputs = Surroundings {
            parameters: tangents.map_or(0, |t| t.names.len()),
            surfaces: shapes.iter().map(surface).collect(),
            points,
            unbounded: !shapes.is_empty() && world.medium_at(beyond) == Some(medium),
            multiple_scattering: world.max_depth > 2,
        };
        MediumSurroundings { inputs, shapes, anchors }
    })
}

/// The cameras and point lights in a medium.
fn points(
    world: &World,
    tangents: Option<&Tangents>,
    medium: usize,
) -> (Vec<Anchor>, Vec<InteriorPoint>) {
    let point =
        |position: Vec3, velocities: Vec<(usize, Vec3)>| InteriorPoint { position, velocities };
    let mut found = Vec::new();
    // Only where rays meet in a point does what is around it have to move along.
    if world.camera_medium == Some(medium)
        && let Some(eye) = world.camera.viewpoint().centre()
    {
        let moves = tangents.iter().flat_map(|t| &t.sensor).map(|(p, t)| (*p, t.position));
        found.push((Anchor::Camera, point(eye, moves.collect())));
    }
    for (e, named) in world.scene.emitters.iter().enumerate() {
        if let Some(x) = named.item.emitter.position()
            && world.medium_of_emitter(e, x) == Some(medium)
        {
            let moves = tangents.iter().flat_map(|t| &t.emitters[e]).map(|(p, t)| (*p, t.position));
            found.push((Anchor::Emitter(e), point(x, moves.collect())));
        }
    }
    found.into_iter().unzip()
}
