//! The choice that `EstimatorKind::Auto` leaves open: which estimator differentiates images or losses. Costs are counted, not timed,
//! because counts are the same on any machine, with any number of threads and in every run, and so is the choice.

mod comparison;
mod estimator;
pub(crate) mod gradients;

pub(crate) use crate::run::session::choice::estimator::{Chosen, estimator};
