//! One call to a session.

use crate::run::session::Control;
use crate::sampling::film::Blocks;
use crate::sampling::parallel::Pool;

/// What a call to [`Session::run`](super::Session::run) is given.
pub(super) struct Pass<'a> {
    pub(super) pool: &'a Pool,
    pub(super) blocks: &'a Blocks,
    /// Samples per pixel.
    pub(super) spp: u32,
    /// Calls before this one.
    pub(super) before: u32,
    pub(super) control: &'a dyn Control,
}
