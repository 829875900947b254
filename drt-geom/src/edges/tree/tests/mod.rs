//! Trees against brute force.

mod cost;
mod density;
mod lost;
mod parts;
mod registers;
mod setup;
mod unbiased;
