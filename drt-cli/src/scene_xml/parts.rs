//! How many things one thing may be made of.

use std::cell::Cell;

use super::element::Element;
use crate::CliError;

/// The most parts of one thing: references could make trees of any size and depth.
const MOST: u32 = 64;

/// What may still be inside of a BSDF or a phase function.
pub(super) struct Parts {
    left: Cell<u32>,
    /// What they are, for the message.
    called: &'static str,
}

impl Parts {
    pub(super) fn new(called: &'static str) -> Self {
        Self { left: Cell::new(MOST), called }
    }

    /// Counts one more.
    pub(super) fn count(&self, e: &Element) -> Result<(), CliError> {
        match self.left.get().checked_sub(1) {
            Some(left) => self.left.set(left),
            None => return Err(e.error(format!("more than {MOST} {} in one", self.called))),
        }
        Ok(())
    }
}
