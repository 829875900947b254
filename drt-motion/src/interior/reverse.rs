//! The inside of a medium in reverse mode: what tetrahedra collect goes to the surfaces, cameras and lights
//! that move them.
//!
//! There every vertex of every active surface moves by itself, so of all fields the tetrahedral one
//! applies:
//!
//! * nothing around the medium is active: rest;
//! * only surfaces without path vertices (null or black) are active: rest, with the flux added. Its
//!   variance is finite there, and less by single vertices than that of tetrahedra: these are as thin as
//!   triangles are small, and reach far;
//! * else: tetrahedra. Where surfaces touch, no field follows them both, and their flux is added: it
//!   comes to nothing wherever the field does follow;
//! * there are no tetrahedra, because surfaces pass through each other: rest, with the flux.

use alloc::vec::Vec;

use super::tetrahedra::Tetrahedralizer;
use super::{InteriorError, InteriorMotion, Surroundings, TetrahedralField};

/// Which of the [`Surroundings`] a gradient is asked for with respect to, by their indices.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ActiveInputs {
    /// Vertices of surfaces.
    pub surfaces: Vec<bool>,
    /// Points.
    pub points: Vec<bool>,
}

/// How the inside of a medium moves in reverse mode.
#[derive(Clone, Debug, Default)]
pub struct ReverseInteriorPlan {
    /// The tetrahedra that carry velocities; `None` for an inside at rest.
    pub field: Option<TetrahedralField>,
    /// The surfaces whose flux must be added, in no order.
    pub flux_surfaces: Vec<usize>,
}

impl Surroundings<'_> {
    /// Chooses the field of reverse mode. Affine, blended and mean value insides count as not asked for, and
    /// motions as not given.
    ///
    /// # Errors
    /// When tetrahedra are asked for, and cannot be made or used.
    ///
    /// # Panics
    /// When there are fewer flags than surfaces or points.
    pub fn plan_reverse(
        &self,
        active: &ActiveInputs,
        asked: Option<&InteriorMotion>,
    ) -> Result<ReverseInteriorPlan, InteriorError> {
        let moving: Vec<usize> = (0..self.surfaces.len()).filter(|s| active.surfaces[*s]).collect();
        let moves_points = active.points.contains(&true);
        if moving.is_empty() && !moves_points {
            return Ok(ReverseInteriorPlan::default());
        }
        let scatters = || moves_points || moving.iter().any(|s| self.surfaces[*s].scatters);
        let field = match asked {
            Some(InteriorMotion::Tetrahedral(Some(given))) => Some(self.given(&given.mesh)?),
            Some(InteriorMotion::Tetrahedral(None)) => Some(self.tetrahedra(Tetrahedralizer::Own)?),
            Some(InteriorMotion::Tetgen) => Some(self.tetrahedra(Tetrahedralizer::Tetgen)?),
            Some(InteriorMotion::Static) => None,
            _ if !scatters() => None,
            _ => self.tetrahedra(Tetrahedralizer::Own).ok(),
        };
        let flux_surfaces = match &field {
            None => moving,
            Some(field) => {
                let touching = field.contacts().into_iter().map(|pair| pair.map(|s| s as usize));
                let left_behind = touching.filter(|pair| pair.iter().any(|s| active.surfaces[*s]));
                left_behind.flatten().collect()
            }
        };
        Ok(ReverseInteriorPlan { field, flux_surfaces })
    }
}
