//! Descent over parameter vectors, whatever their gradients come from.
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
//!
//! Very many unknowns of one kind, such as the vertices of a mesh, step by [`field`].
//!
//! Where the function is a sum of squares whose parts have known derivatives, [`Method::GaussNewton`] goes
//! straight there, through valleys and noise:
//!
//! ```
//! use drt_motion::optimize::{Method, Observation, Optimizer, Variable};
//!
//! // The least squares of x + y = 3 and 100 (x - y) = 100.
//! let variable = Variable { learning_rate: 10.0, ..Variable::default() };
//! let mut optimizer = Optimizer::new(Method::GAUSS_NEWTON, vec![variable; 2], &[0.0, 0.0])?;
//! let rows = [[1.0, 1.0], [100.0, -100.0]];
//! let residuals = [-3.0, -100.0];
//! let product = |i: usize, v: &dyn Fn(usize) -> f64| -> f64 {
//!     (0..2).map(|k| rows[k][i] * v(k)).sum()
//! };
//! let gradient: Vec<f64> = (0..2).map(|i| product(i, &|k| residuals[k])).collect();
//! let row = |i| (0..2).map(|j| product(i, &|k| rows[k][j])).collect();
//! let curvature: Vec<Vec<f64>> = (0..2).map(row).collect();
//! let (gradient, curvature) = (&gradient, &curvature);
//! let seen = Observation { gradient, curvature, noise: &[], covariance: &[], weight: 1.0 };
//! optimizer.step_by(&seen, 1.0)?;
//! let x = optimizer.values();
//! assert!((x[0] - 2.0).abs() < 1e-5 && (x[1] - 1.0).abs() < 1e-5);
//! # Ok::<(), drt_motion::optimize::OptimizeError>(())
//! ```

mod checks;
mod error;
pub mod field;
mod gauss_newton;
mod method;
mod optimizer;
mod schedule;
#[cfg(test)]
mod tests;
mod variable;

pub use error::OptimizeError;
pub use gauss_newton::{Averages, Observation};
pub use method::Method;
pub use optimizer::{Optimizer, Outlook, State};
pub use schedule::{Decay, Stages};
pub use variable::Variable;
