//! Sampling in plain numbers, without derivatives: the walk and its record, the samples of pixels, and the films that
//! add them up.

pub(crate) mod allocation;
pub(crate) mod bidirectional;
pub(crate) mod budget;
pub(crate) mod film;
pub(crate) mod flight;
pub(crate) mod guide;
pub(crate) mod importance;
pub(crate) mod parallel;
pub(crate) mod pixels;
mod radiance;
pub(crate) mod record;
pub(crate) mod streams;
pub(crate) mod trace;
mod transport_mode;
mod walk;
