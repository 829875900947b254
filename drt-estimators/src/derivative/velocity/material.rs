//! The material form: vertices move with the matter that they are on (2021 paper, Eqs. 23–30; theory
//! sheet §4). Paths do not depend on the parameters in coordinates of matter.

use alloc::vec::Vec;

use drt_math::Vec3;

use crate::derivative::velocity::{
    Auxiliary, Blend, Found, Movers, Probe, VelocityField, VertexVelocity,
};
use crate::sampling::trace::Endpoint;
use crate::world::World;
use crate::world::vertex::{SurfacePoint, Vertex};

/// Lobes of mirrors beyond which pairs cost more than they gain, in radians: 1.08 to 1.17 times the work
/// of single rays from 0.1 on.
const WIDEST_PAIRED_MIRROR: f64 = 0.07;

/// φ = 1 everywhere.
#[derive(Clone, Debug)]
pub(crate) struct Material {
    movers: Movers,
}

impl Material {
    pub(crate) fn new(movers: Movers) -> Self {
        Self { movers }
    }
}

impl VelocityField for Material {
    fn camera(&self) -> VertexVelocity {
        VertexVelocity { moves: self.movers.camera, blend: Blend::MATERIAL, ..Default::default() }
    }

    fn vertex(
        &self,
        _: &World,
        found: &Found<'_>,
        _: &mut Probe,
        _: &mut Vec<Auxiliary>,
    ) -> VertexVelocity {
        let moves = match &found.arrival.end {
            Endpoint::Surface(v) | Endpoint::Volume(v, _) => {
                v.matter().is_some_and(|matter| self.movers.moves(&matter))
            }
            Endpoint::Environment => false,
        };
        VertexVelocity { moves, blend: Blend::MATERIAL, ..Default::default() }
    }

    fn follows_rays(&self) -> bool {
        false
    }

    fn blend(&self, _: &World, _: &Vertex, _: &Vertex, _: Vec3, _: f64) -> Blend {
        Blend::MATERIAL
    }

    fn turns_rays(&self, _: &World, _: &SurfacePoint, _: &VertexVelocity) -> bool {
        // With either of their ends.
        self.movers.shapes.contains(&true)
    }

    fn widest_paired(&self, transmissive: bool) -> f64 {
        if transmissive { super::spatial::WIDEST_PAIRED } else { WIDEST_PAIRED_MIRROR }
    }
}
