//! One call to a session.

use crate::model::shard::Shard;
use crate::run::control::Control;
use crate::sampling::film::Blocks;
use crate::sampling::parallel::Pool;

/// What a call to [`Session::run`](super::Session::run) is given.
#[derive(Clone, Copy)]
pub(super) struct Pass<'a> {
    pub(super) pool: &'a Pool,
    pub(super) blocks: &'a Blocks,
    /// Samples per pixel.
    pub(super) spp: u32,
    /// Calls before this one.
    pub(super) before: u32,
    /// The part of the samples that is taken; all where it is not said.
    pub(super) shard: Option<Shard>,
    pub(super) control: &'a dyn Control,
}
