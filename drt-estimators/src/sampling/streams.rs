//! Names of random numbers: what tells the streams and sequences of all uses apart.

use drt_math::Rng;
use drt_math::sobol::SET_DIMENSIONS;

/// Random-number streams are pixels; the top bits tell other uses apart.
pub(crate) const LINE_STREAM: u64 = 1 << 62;
pub(crate) const FLUX_STREAM: u64 = 1 << 61;
pub(crate) const SEQUENCE_STREAM: u64 = 1 << 60;
pub(crate) const PAIR_STREAM: u64 = 1 << 59;
pub(crate) const VELOCITY_STREAM: u64 = 1 << 58;
pub(crate) const GUIDE_STREAM: u64 = 1 << 57;
pub(crate) const PROBE_STREAM: u64 = 1 << 56;
pub(crate) const LEVEL_STREAM: u64 = 1 << 55;
/// Numbers of a sample that are spread evenly: image point, and the first vertices.
pub(crate) const DIMENSIONS: u32 = SET_DIMENSIONS;

/// The name of a Sobol' sequence of a pixel.
pub(crate) fn sequence_name(seed: u64, pixel: u32, number: u32) -> u32 {
    Rng::new(seed, SEQUENCE_STREAM | u64::from(pixel), number).next_u32()
}

/// The names of the two Sobol' sequences of the probes of a pixel.
pub(crate) fn names_of_probes(seed: u64, pixel: u32) -> [u32; 2] {
    let mut names = Rng::new(seed, SEQUENCE_STREAM | PROBE_STREAM | u64::from(pixel), 0);
    [names.next_u32(), names.next_u32()]
}
