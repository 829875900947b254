//! The insides of media in reverse mode: what tetrahedra collect goes to the surfaces, cameras and lights
//! that move them.

use alloc::vec::Vec;

use drt_math::Vec3;
use drt_motion::interior::{self, InteriorMotion, TetrahedralField};
use drt_motion::volume::VolumeAdjoint;

use crate::derivative::medium_motion::surroundings::{Anchor, surroundings};
use crate::derivative::medium_motion::{asked_for, unusable};
use crate::derivative::scene_gradient::SceneGradient;
use crate::derivative::sensitivity::ActiveInputs;
use crate::model::error::Error;
use crate::world::World;

/// The tetrahedra of all media whose insides move, and the shapes whose flux must be added.
#[derive(Clone, Debug, Default)]
pub(crate) struct ReverseMediumMotions {
    media: Vec<Option<Filled>>,
    pub(crate) flux_shapes: Vec<usize>,
}

/// The tetrahedra of a medium, and what they were made from.
#[derive(Clone, Debug)]
struct Filled {
    field: TetrahedralField,
    shapes: Vec<usize>,
    anchors: Vec<Anchor>,
}

/// By medium, the gradient with respect to the velocities of the tetrahedra's vertices; empty for an
/// inside that does not move.
#[derive(Clone, Debug)]
pub(crate) struct InteriorGradients(Vec<Vec<Vec3>>);

impl ReverseMediumMotions {
    /// Nothing moves, and nothing else makes up for it.
    pub(crate) fn at_rest(world: &World) -> Self {
        let media = world.scene.media.iter().map(|_| None).collect();
        Self { media, flux_shapes: Vec::new() }
    }

    /// Chooses for every medium. Affine, blended and mean value insides count as not asked for.
    pub(crate) fn new(
        world: &World,
        active: &ActiveInputs,
        asked: &[(usize, InteriorMotion)],
    ) -> Result<Self, Error> {
        let mut motions = Self::default();
        for (m, around) in surroundings(world, None).enumerate() {
            let active = interior::ActiveInputs {
                surfaces: around.shapes.iter().map(|s| active.shapes[*s]).collect(),
                points: around.anchors.iter().map(|a| a.is_active(active)).collect(),
            };
            let plan = around.inputs.plan_reverse(&active, asked_for(asked, m)).map_err(|e| {
                let surface = |s: usize| world.shape_name(around.shapes[s]);
                let message = e.with_names(surface, |p| alloc::format!("{p}"));
                unusable(world, m, &e, message)
            })?;
            motions.flux_shapes.extend(plan.flux_surfaces.iter().map(|s| around.shapes[*s]));
            motions.media.push(plan.field.map(|field| Filled {
                field,
                shapes: around.shapes,
                anchors: around.anchors,
            }));
        }
        motions.flux_shapes.sort_unstable();
        motions.flux_shapes.dedup();
        Ok(motions)
    }

    /// The media whose insides move.
    pub(crate) fn volumes(&self) -> Vec<bool> {
        self.media.iter().map(Option::is_some).collect()
    }

    /// No gradient yet.
    pub(crate) fn zeros(&self) -> InteriorGradients {
        let vertices = |inside: &Option<Filled>| {
            inside.as_ref().map_or(0, |inside| inside.field.mesh().positions.len())
        };
        InteriorGradients(self.media.iter().map(|m| alloc::vec![Vec3::ZERO; vertices(m)]).collect())
    }

    /// Adds the transpose of the jet of a medium's inside at a point.
    pub(crate) fn scatter(
        &self,
        medium: usize,
        x: Vec3,
        adjoint: &VolumeAdjoint,
        gradients: &mut InteriorGradients,
    ) {
        if let Some(inside) = &self.media[medium] {
            inside.field.place(x).scatter(adjoint, &mut gradients.0[medium]);
        }
    }

    /// Hands everything on to what moves the insides.
    pub(crate) fn gather(
        &self,
        world: &World,
        gradients: InteriorGradients,
        scene: &mut SceneGradient,
    ) {
        for (inside, gradient) in self.media.iter().zip(gradients.0) {
            let Some(Filled { field, shapes, anchors }) = inside else { continue };
            let mut points: Vec<Option<Vec3>> =
                anchors.iter().map(|a| position(*a, scene).map(|_| Vec3::ZERO)).collect();
            let mut surfaces: Vec<_> = scene
                .shapes
                .iter_mut()
                .enumerate()
                .filter(|(s, _)| shapes.contains(s))
                .map(|(s, to)| (&*world.scene.shapes[s].mesh, to.as_mut()))
                .collect();
            field.gather(gradient, &mut surfaces, &mut points);
            for (anchor, sum) in anchors.iter().zip(points) {
                if let (Some(to), Some(sum)) = (position(*anchor, scene), sum) {
                    *to += sum;
                }
            }
        }
    }
}

impl Anchor {
    /// Whether its position is asked for.
    fn is_active(self, active: &ActiveInputs) -> bool {
        match self {
            Self::Camera => active.sensor,
            Self::Emitter(e) => active.emitters[e],
        }
    }
}

/// The gradient with respect to where a camera or light is, if it is asked for.
fn position(anchor: Anchor, scene: &mut SceneGradient) -> Option<&mut Vec3> {
    match anchor {
        Anchor::Camera => scene.sensor.as_mut().map(|g| &mut g.position),
        Anchor::Emitter(e) => scene.emitters[e].as_mut().map(|g| &mut g.position),
    }
}

impl InteriorGradients {
    pub(crate) fn add(&mut self, other: &Self) {
        for (a, b) in self.0.iter_mut().flatten().zip(other.0.iter().flatten()) {
            *a += *b;
        }
    }
}
