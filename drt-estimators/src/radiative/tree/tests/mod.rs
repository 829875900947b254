//! Trees against brute force.

extern crate std;

mod cost;
mod density;
mod lost;
mod parts;
mod setup;
mod unbiased;
