//! All tests of the crate from outside, in one program.

mod check_matrix;
mod clouds;
mod coincidence;
mod estimators;
mod insides;
mod invariances;
mod oracle_faults;
mod oracles;
mod random_scenes;
mod references;
mod refusals;
mod skipping;
mod smooth;
mod stability;
