//! Four of the oracles in the configuration that bare targets get: elementary functions from libm,
//! the compact BVH, one thread. Meant for `--no-default-features --features libm`, when only this test harness has std.
//!
//! The numbers are those of `tests/data/oracles.json`, where their derivation is described.

mod judge;
mod oracles;
mod scenes;
