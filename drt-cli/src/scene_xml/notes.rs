//! What is passed over in a scene, or mended: harmless, but perhaps not meant.

use std::cell::RefCell;
use std::collections::HashSet;

use crate::error::{Place, Warning};

/// The notes on one scene, in the order in which they were made.
#[derive(Debug, Default)]
pub(super) struct Notes {
    list: RefCell<Vec<Warning>>,
    /// What was noted of all things of a kind at once.
    said: RefCell<HashSet<String>>,
}

impl Notes {
    pub(super) fn add(&self, place: &Place, message: String) {
        self.list.borrow_mut().push(Warning { place: place.clone(), message });
    }

    /// Adds what holds for all things of a `kind`, where the first of them stands.
    pub(super) fn add_once(&self, kind: &str, place: &Place, message: String) {
        if self.said.borrow_mut().insert(kind.into()) {
            self.add(place, message);
        }
    }

    /// Everything noted so far.
    pub(super) fn take(&self) -> Vec<Warning> {
        self.list.take()
    }
}
