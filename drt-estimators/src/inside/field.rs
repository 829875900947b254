//! The velocity fields inside media: for each medium one geometry that all parameters share, for each
//! parameter what it carries.

use alloc::sync::Arc;
use alloc::vec::Vec;

use drt_math::{Affine, Vec3};
use drt_motion::interior::{
    Blend, SiteWeight, TetVelocities, TetrahedralField, TetrahedralPlace, blend_jet,
};
use drt_motion::volume::{VolumeJet, VolumeMotion};

use super::mean_value::{self, MeanValue};

/// The motion of an inside under one parameter.
#[derive(Clone, Debug)]
pub(crate) enum Inside {
    /// One affine field.
    Affine(Affine),
    /// The fields of the medium's sites that move, blended.
    Blend(Vec<(usize, Affine)>),
    /// Velocities at the vertices of the medium's tetrahedra.
    Tetrahedra(TetVelocities),
    /// Velocities of all surfaces, interpolated.
    MeanValue(mean_value::Velocities),
}

/// What the motions of an inside share.
#[derive(Clone, Debug)]
pub(crate) enum Field {
    Blend(Blend),
    Tetrahedra(Arc<TetrahedralField>),
    MeanValue(MeanValue),
}

/// A field at a point.
#[derive(Clone, Debug, Default)]
pub(crate) struct Place {
    weights: Vec<SiteWeight>,
    corners: TetrahedralPlace,
    mean_value: mean_value::Place,
}

impl Field {
    pub(crate) fn place(&self, x: Vec3, place: &mut Place) {
        match self {
            Self::Blend(blend) => blend.weights(x, &mut place.weights),
            Self::Tetrahedra(tetrahedra) => place.corners = tetrahedra.place(x),
            Self::MeanValue(field) => field.place(x, &mut place.mean_value),
        }
    }
}

impl Inside {
    /// Velocity and divergence at a point, at which the medium's field is `place`.
    pub(crate) fn jet(&self, x: Vec3, place: &Place) -> VolumeJet {
        match self {
            Self::Affine(field) => VolumeMotion::Affine(*field).jet(x),
            Self::Blend(fields) => blend_jet(&place.weights, fields, x),
            Self::Tetrahedra(velocities) => place.corners.jet(velocities),
            Self::MeanValue(velocities) => velocities.jet(&place.mean_value),
        }
    }

    /// How it is called where the plan is printed.
    pub(crate) fn name(&self) -> &'static str {
        match self {
            Self::Affine(_) => "affine",
            Self::Blend(_) => "blend",
            Self::Tetrahedra(_) => "tetrahedral",
            Self::MeanValue(_) => "mean value",
        }
    }
}
