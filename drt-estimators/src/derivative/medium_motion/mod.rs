//! How the inside of each medium moves with each parameter (theory sheet §4.1, §14.1).
//!
//! This module collects the surfaces, cameras and lights around each medium from the scene; drt-motion
//! [chooses](drt_motion::interior) the velocity field that follows them.

use alloc::string::String;
use alloc::vec::Vec;

use drt_motion::interior::{InteriorBasis, InteriorError, InteriorMotion, InteriorVelocity};

use crate::derivative::tangents::Tangents;
use crate::model::error::{ElementError, Error};
use crate::world::World;
use crate::world::cache::PreparedCache;

mod adjacency;
mod reverse;
mod surroundings;

pub(crate) use crate::derivative::medium_motion::reverse::{
    InteriorGradients, ReverseMediumMotions,
};
use crate::derivative::medium_motion::surroundings::surroundings;

/// How an estimator lets the insides of media move.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Insides {
    /// They follow what is around them.
    Follow,
    /// They follow what moves all that is around them by one affine field.
    Affine,
    /// They stay where they are.
    AtRest,
}

/// The motions of the insides of all media, and the shapes whose flux must be added.
#[derive(Clone, Debug, Default)]
pub(crate) struct MediumMotions {
    /// Per medium: the parameters that move its inside, and how.
    pub(crate) velocities: Vec<Vec<(usize, InteriorVelocity)>>,
    /// Per medium: what these motions share.
    pub(crate) bases: Vec<Option<InteriorBasis>>,
    /// Shapes through which some medium has a flux for some parameter.
    pub(crate) flux_shapes: Vec<usize>,
    /// Per medium: parameters that need a flux.
    pub(crate) flux: Vec<Vec<usize>>,
    /// Per medium: why it could not be filled with tetrahedra, where these would have been chosen.
    pub(crate) unfilled: Vec<Option<String>>,
}

impl MediumMotions {
    /// As an estimator lets them move.
    pub(crate) fn new(
        insides: Insides,
        world: &World,
        tangents: &Tangents,
        asked: &[(usize, InteriorMotion)],
        kept: &mut PreparedCache,
    ) -> Result<Self, Error> {
        match insides {
            Insides::Follow => Self::plan(world, tangents, asked, kept),
            Insides::Affine => Ok(Self::affine(world, tangents, asked)),
            Insides::AtRest => Ok(Self::at_rest(world.scene.media.len())),
        }
    }

    /// Nothing moves, and nothing else makes up for it.
    pub(crate) fn at_rest(media: usize) -> Self {
        Self {
            velocities: alloc::vec![Vec::new(); media],
            bases: alloc::vec![None; media],
            flux: alloc::vec![Vec::new(); media],
            flux_shapes: Vec::new(),
            unfilled: alloc::vec![None; media],
        }
    }

    /// The media that move by one affine field: whichever parameter moves anything around one, everything there
    /// moves by one affine field. The others are at rest, as all are in reverse mode, where vertices move one by
    /// one.
    pub(crate) fn affine(
        world: &World,
        tangents: &Tangents,
        asked: &[(usize, InteriorMotion)],
    ) -> Self {
        let mut motions = Self::at_rest(world.scene.media.len());
        for (m, around) in surroundings(world, Some(tangents)).enumerate() {
            // Other kinds have a transpose, which reverse mode takes to be what forward mode does.
            let wanted = matches!(asked_for(asked, m), None | Some(InteriorMotion::Affine));
            if wanted && world.medium(m).homogeneous().is_some() {
                let fields = around.inputs.affine_fields().unwrap_or_default().into_iter();
                motions.velocities[m] =
                    fields.map(|(p, field)| (p, InteriorVelocity::Affine(field))).collect();
            }
        }
        motions
    }

    /// As chosen for every medium and parameter, or asked for.
    pub(crate) fn plan(
        world: &World,
        tangents: &Tangents,
        asked: &[(usize, InteriorMotion)],
        kept: &mut PreparedCache,
    ) -> Result<Self, Error> {
        let mut motions = Self::at_rest(world.scene.media.len());
        for (m, around) in surroundings(world, Some(tangents)).enumerate() {
            let named = |e: &InteriorError| {
                let parameter = |p: usize| tangents.names[p].clone();
                e.with_names(|s| world.shape_name(around.shapes[s]), parameter)
            };
            let plan = around
                .inputs
                .plan(asked_for(asked, m), kept.tetrahedra(m))
                .map_err(|e| unusable(world, m, &e, named(&e)))?;
            motions.velocities[m] = plan.velocities;
            motions.bases[m] = plan.basis;
            motions.flux[m] = plan.flux;
            motions.unfilled[m] = plan.instead_of.as_ref().map(named);
            motions.flux_shapes.extend(plan.flux_surfaces.iter().map(|s| around.shapes[*s]));
        }
        motions.flux_shapes.sort_unstable();
        motions.flux_shapes.dedup();
        Ok(motions)
    }
}

/// How a medium's inside is to move, if that was said.
fn asked_for(asked: &[(usize, InteriorMotion)], medium: usize) -> Option<&InteriorMotion> {
    asked.iter().rev().find(|(m, _)| *m == medium).map(|(_, kind)| kind)
}

fn unusable(world: &World, medium: usize, error: &InteriorError, message: String) -> Error {
    let name = world.scene.media[medium].id.clone();
    let element = name.unwrap_or_else(|| alloc::format!("medium[{medium}]"));
    Error::Element { element, reason: ElementError::Interior { error: error.clone(), message } }
}
