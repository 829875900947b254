//! The kinds of samples that land anywhere on the film.

use crate::model::rendering::Term;
use crate::terms::boundary_segments::Strategy;

/// A kind of samples each of which may count for any pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum BoundarySource {
    /// Boundary segments found by a strategy.
    Edges(Strategy),
    /// Jumps of a box filter.
    Borders,
    /// Edges seen from the camera, in the spatial form.
    PrimaryEdges,
    /// The flux through what the camera sees edge on.
    GrazingFlux,
    /// Paths that begin on what the camera sees edge on.
    GrazingPaths,
    /// Light paths that are connected to the camera.
    LightPaths,
}

impl BoundarySource {
    pub(crate) fn term(self) -> Term {
        match self {
            Self::Edges(Strategy::Primary) | Self::Borders | Self::PrimaryEdges => Term::Primary,
            Self::Edges(Strategy::Direct) => Term::Direct,
            Self::Edges(Strategy::Indirect) => Term::Indirect,
            Self::GrazingFlux => Term::Flux,
            Self::GrazingPaths | Self::LightPaths => Term::Interior,
        }
    }

    /// Tells the source's random numbers apart from all others.
    pub(crate) fn stream(self) -> u64 {
        let id = match self {
            Self::Edges(Strategy::Primary) => 1,
            Self::Edges(Strategy::Direct) => 2,
            Self::Edges(Strategy::Indirect) => 3,
            Self::Borders => 4,
            Self::PrimaryEdges => 5,
            Self::GrazingFlux => 6,
            Self::LightPaths => 7,
            Self::GrazingPaths => 8,
        };
        id << 40
    }

    /// Samples of it to one of other sources.
    pub(crate) fn part(self) -> f64 {
        match self {
            Self::GrazingFlux => 0.0625,
            Self::GrazingPaths => 0.25,
            _ => 1.0,
        }
    }

    /// True for the edges that the camera sees.
    pub(crate) fn is_of_camera(self) -> bool {
        matches!(self, Self::PrimaryEdges | Self::Edges(Strategy::Primary))
    }

    /// True for those whose first numbers may have a distribution that is learnt.
    pub(crate) fn is_guided(self) -> bool {
        !matches!(self, Self::GrazingFlux | Self::GrazingPaths | Self::LightPaths)
    }

    /// True when no sample counts much more than others.
    pub(crate) fn is_even(self) -> bool {
        matches!(self, Self::PrimaryEdges | Self::GrazingFlux | Self::GrazingPaths)
    }
}
