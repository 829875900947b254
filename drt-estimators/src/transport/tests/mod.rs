//! The derivative of a recorded path and of each of its factors, against dual numbers.

mod factors;
mod moving;
mod records;
mod replay;
#[path = "../../../tests/common/mod.rs"]
mod scenes;
