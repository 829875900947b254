//! Trees against brute force.

extern crate std;

mod cost;
mod setup;
