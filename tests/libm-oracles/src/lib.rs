//! Four of the oracles in the configuration that bare targets get: elementary functions from libm,
//! the compact BVH, one thread. The crates here are compiled without their `std`, only this test
//! harness has it.
//!
//! The numbers are those of `tests/data/oracles.json`, where their derivation is described.

#![cfg(test)]

mod judge;
mod oracles;
mod scenes;
