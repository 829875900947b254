//! Descent over fields: very many unknowns of one kind, such as the coordinates of a mesh's vertices, the values of
//! a grid's voxels or the texels of a texture.
//!
//! A [`FieldOptimizer`] steps all values of a field by one [`FieldRule`], where an
//! [`Optimizer`](super::Optimizer) has a rule for each of its few variables. What it remembers is a [`FieldState`];
//! from a stored one it goes on to the same bits.
//!
//! Gradients of so many unknowns are noisy, and most of their directions are of no use. Three remedies are here:
//! `LaplacianSmoothing` (with the feature `sparse`) makes the steps of a mesh smooth, [`laplacian_energy`] makes
//! rough meshes cost something, and [`total_variation`] does so for grids and textures.
//!
//! ```
//! use drt_motion::optimize::Stages;
//! use drt_motion::optimize::field::{FieldOptimizer, FieldRule, total_variation};
//!
//! // Four texels in a row that were observed as 0, 0.1, 1 and 0.9, with a price on their differences.
//! let observed = [0.0, 0.1, 1.0, 0.9];
//! let rule = FieldRule {
//!     learning_rate: Stages::new(0.05, vec![(100, 0.005), (200, 0.0005)]),
//!     lower: 0.0,
//!     upper: 1.0,
//!     ..FieldRule::default()
//! };
//! let mut texels = FieldOptimizer::new(rule, &[0.5; 4])?;
//! for iteration in 0..300 {
//!     let x = texels.values();
//!     let mut gradient: Vec<f64> = x.iter().zip(observed).map(|(x, o)| x - o).collect();
//!     total_variation([4, 1, 1], 1, x, &mut gradient, 0.1)?;
//!     texels.step(&gradient, iteration, 1.0)?;
//! }
//! // Small differences are gone; the large one is still there.
//! let x = texels.values();
//! assert!((x[0] - x[1]).abs() < 1e-2 && (x[2] - x[3]).abs() < 1e-2);
//! assert!((x[1] - 0.1).abs() < 1e-2 && (x[2] - 0.9).abs() < 1e-2);
//! # Ok::<(), drt_motion::optimize::OptimizeError>(())
//! ```

mod laplacian;
mod optimizer;
mod rule;
#[cfg(feature = "sparse")]
mod smoothing;
mod variation;

pub use laplacian::{MeshLaplacian, laplacian_energy};
pub use optimizer::{FieldOptimizer, FieldState};
pub use rule::FieldRule;
#[cfg(feature = "sparse")]
pub use smoothing::LaplacianSmoothing;
pub use variation::{TOTAL_VARIATION_EPSILON, total_variation};
