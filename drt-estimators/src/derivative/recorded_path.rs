//! A path as it is handed to what differentiates it.

use drt_math::Rgb;

use crate::derivative::antithetic::AntitheticPairs;
use crate::derivative::velocity::PathVelocities;
use crate::sampling::record::PathRecord;
use crate::world::lights::EmitterMask;

/// What is to be differentiated of a path: the light of some emitters, by a velocity field.
#[derive(Clone, Copy)]
pub(crate) struct RecordedPath<'p> {
    pub(crate) record: &'p PathRecord,
    pub(crate) velocities: &'p PathVelocities,
    /// Rays beside it, where they are asked for.
    pub(crate) pairs: &'p AntitheticPairs,
    pub(crate) lit: EmitterMask,
    /// The light that scattering collects at the record's probe, where extinctions are differentiated by probes as well as at
    /// vertices.
    pub(crate) probed: Option<Rgb>,
}

impl RecordedPath<'_> {
    /// The control radiance of the ray that found a node, as far as it counts.
    pub(crate) fn control(&self, node: usize) -> Rgb {
        let counts = self.probed.is_some() && self.lit.by_surroundings();
        if counts { self.record.nodes[node].control } else { Rgb::ZERO }
    }
}
