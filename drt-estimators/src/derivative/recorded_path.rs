//! A path as it is handed to what differentiates it.

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
}
