//! What is measured, and how.
#![allow(dead_code, reason = "each benchmark uses its own part")]

pub(crate) mod scenes;
pub(crate) mod turns;
