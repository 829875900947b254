//! Insides in reverse mode: what tetrahedra collect goes to the surfaces, cameras and lights that move
//! them.
//!
//! There every vertex of every shape that is asked for moves by itself, so of all fields the
//! tetrahedral one applies. Per medium:
//!
//! * nothing around it is asked for: static;
//! * only surfaces without path vertices (null or black) are asked for: static, with the flux added.
//!   Its variance is finite there, and less by single vertices than that of tetrahedra: these are as
//!   thin as triangles are small, and reach far;
//! * else: tetrahedra. Where surfaces touch, no field follows them both, and their flux is added: it
//!   comes to nothing wherever the field does follow;
//! * there are no tetrahedra, because surfaces pass through each other: static, with the flux.

use alloc::vec::Vec;

use drt_math::Vec3;
use drt_motion::interior::TetrahedralField;
use drt_motion::volume::VolumeAdjoint;

use super::parts::{self, Anchor};
use super::{adjacency, asked_for, tetrahedra};
use crate::Error;
use crate::scene_gradient::SceneGradient;
use crate::sensitivity::Interest;
use crate::settings::InsideKind;
use crate::transport::World;

/// The tetrahedra of all media whose insides move, and the shapes whose flux must be added.
#[derive(Clone, Debug, Default)]
pub(crate) struct TransposedInsides {
    media: Vec<Option<Transposed>>,
    pub(crate) flux_shapes: Vec<usize>,
}

/// The tetrahedra of a medium, and what they were made from.
#[derive(Clone, Debug)]
struct Transposed {
    field: TetrahedralField,
    shapes: Vec<usize>,
    anchors: Vec<Anchor>,
}

/// By medium, the gradient with respect to the velocities of the tetrahedra's vertices; empty for an
/// inside that does not move.
#[derive(Clone, Debug)]
pub(crate) struct InsideGradients(Vec<Vec<Vec3>>);

impl TransposedInsides {
    /// Nothing moves, and nothing else makes up for it.
    pub(crate) fn at_rest(world: &World) -> Self {
        let media = world.scene.media.iter().map(|_| None).collect();
        Self { media, flux_shapes: Vec::new() }
    }

    /// Chooses for every medium. Affine, blended and mean value insides count as not asked for.
    pub(crate) fn new(
        world: &World,
        interest: &Interest,
        asked: &[(usize, InsideKind)],
    ) -> Result<Self, Error> {
        let adjacent = adjacency(world);
        let mut insides = Self::default();
        for m in 0..world.scene.media.len() {
            let shapes: Vec<usize> =
                (0..adjacent.len()).filter(|s| adjacent[*s].contains(&m)).collect();
            let inside = insides.inside(world, interest, m, shapes, asked_for(asked, m))?;
            insides.media.push(inside);
        }
        insides.flux_shapes.sort_unstable();
        insides.flux_shapes.dedup();
        Ok(insides)
    }

    fn inside(
        &mut self,
        world: &World,
        interest: &Interest,
        medium: usize,
        shapes: Vec<usize>,
        asked: Option<&InsideKind>,
    ) -> Result<Option<Transposed>, Error> {
        let (anchors, points): (Vec<Anchor>, Vec<Vec3>) =
            parts::anchors(world, medium).into_iter().unzip();
        let moving: Vec<usize> = shapes.iter().copied().filter(|s| interest.shapes[*s]).collect();
        let anchored = anchors.iter().any(|anchor| match anchor {
            Anchor::Camera => interest.sensor,
            Anchor::Emitter(e) => interest.emitters[*e],
        });
        if moving.is_empty() && !anchored {
            return Ok(None);
        }
        let scatters = || anchored || moving.iter().any(|s| world.scatters(*s));
        let field = match asked {
            Some(InsideKind::Tetrahedral(Some(given))) => {
                Some(tetrahedra::given(world, medium, &shapes, &given.mesh)?)
            }
            Some(InsideKind::Tetrahedral(None)) => {
                Some(tetrahedra::around(world, medium, &shapes, &points)?)
            }
            Some(InsideKind::Static) => None,
            _ if !scatters() => None,
            _ => tetrahedra::around(world, medium, &shapes, &points).ok(),
        };
        let Some(field) = field else {
            self.flux_shapes.extend(moving);
            return Ok(None);
        };
        let touching = field.contacts().into_iter().map(|pair| pair.map(|s| shapes[s as usize]));
        let left_behind = touching.filter(|pair| pair.iter().any(|s| interest.shapes[*s]));
        self.flux_shapes.extend(left_behind.flatten());
        Ok(Some(Transposed { field, shapes, anchors }))
    }

    /// The media whose insides move.
    pub(crate) fn volumes(&self) -> Vec<bool> {
        self.media.iter().map(Option::is_some).collect()
    }

    /// No gradient yet.
    pub(crate) fn zeros(&self) -> InsideGradients {
        let vertices = |inside: &Option<Transposed>| {
            inside.as_ref().map_or(0, |inside| inside.field.mesh().positions.len())
        };
        InsideGradients(self.media.iter().map(|m| alloc::vec![Vec3::ZERO; vertices(m)]).collect())
    }

    /// Adds the transpose of the jet of a medium's inside at a point.
    pub(crate) fn scatter(
        &self,
        medium: usize,
        x: Vec3,
        adjoint: &VolumeAdjoint,
        gradients: &mut InsideGradients,
    ) {
        if let Some(inside) = &self.media[medium] {
            inside.field.place(x).scatter(adjoint, &mut gradients.0[medium]);
        }
    }

    /// Hands everything on to what moves the insides.
    pub(crate) fn gather(
        &self,
        world: &World,
        gradients: InsideGradients,
        scene: &mut SceneGradient,
    ) {
        for (inside, gradient) in self.media.iter().zip(gradients.0) {
            let Some(Transposed { field, shapes, anchors }) = inside else { continue };
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

/// The gradient with respect to where a camera or light is, if it is asked for.
fn position(anchor: Anchor, scene: &mut SceneGradient) -> Option<&mut Vec3> {
    match anchor {
        Anchor::Camera => scene.sensor.as_mut().map(|g| &mut g.position),
        Anchor::Emitter(e) => scene.emitters[e].as_mut().map(|g| &mut g.position),
    }
}

impl InsideGradients {
    pub(crate) fn add(&mut self, other: &Self) {
        for (a, b) in self.0.iter_mut().flatten().zip(other.0.iter().flatten()) {
            *a += *b;
        }
    }
}
