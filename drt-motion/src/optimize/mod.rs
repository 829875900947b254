//! Gradient descent over parameter vectors, whatever their gradients come from.
//!
//! Nothing here knows of light, meshes or files: an [`Optimizer`] takes gradients and gives values.
//! All that it remembers is a [`State`] of plain numbers; from a stored one it goes on as if it had never
//! stopped, bit for bit.
//!
//! ```
//! use drt_motion::optimize::{Method, Optimizer, Variable};
//!
//! // The nearest point of the unit square to (0.3, 2).
//! let side = Variable { learning_rate: 0.1, lower: 0.0, upper: 1.0, ..Variable::default() };
//! let mut optimizer = Optimizer::new(Method::ADAM, vec![side; 2], &[0.5, 0.5])?;
//! for _ in 0..200 {
//!     let x = optimizer.values();
//!     let gradient = [2.0 * (x[0] - 0.3), 2.0 * (x[1] - 2.0)];
//!     optimizer.step(&gradient, 1.0)?;
//! }
//! let x = optimizer.values();
//! assert!((x[0] - 0.3).abs() < 1e-3 && x[1] == 1.0);
//! # Ok::<(), drt_motion::optimize::OptimizeError>(())
//! ```

mod error;
mod method;
mod optimizer;
mod schedule;
#[cfg(test)]
mod tests;
mod variable;

pub use error::OptimizeError;
pub use method::Method;
pub use optimizer::{Optimizer, State};
pub use schedule::{Decay, Stages};
pub use variable::Variable;
