//! A distribution of the first random numbers of a sample, learnt from what earlier samples have found.
//!
//! A sampler maps uniform numbers u to a value f(u) at the cost c(u). With u of the density q instead, and f / q for
//! the value, the expectation is the same for every q that is nowhere zero. Variance times cost is then, but
//! for the square of the mean, (∫ f² / q) (∫ c q), and by Cauchy and Schwarz's inequality
//!
//! ```text
//! (∫ f² / q) (∫ c q) ≥ (∫ |f| √c)²,      with equality for q ∝ |f| / √c.
//! ```
//!
//! Only the first [`DIMENSIONS`] numbers are guided, and q is the same all over each cell of a kd-tree, which halves
//! cells. So f² and c stand for their means over a cell and over what is drawn later, and q ∝ √(f² / c). Samples in *primary sample space*
//! need no knowledge of what numbers mean. For boundary segments they are a light, a point among all edges, and a point of the
//! light or a direction; the tree over these is that of Yan et al. (2022, "Efficient estimation of boundary integrals for
//! path-space differentiable rendering"), who take f for √f².
//!
//! - **Defensive.** A part [`DEFENSIVE`] of q is uniform, so that f / q is never more than 1 / [`DEFENSIVE`] times f (Hesterberg
//!   1995), whatever has been missed in learning.
//! - **Stratified.** A point falls through the tree with one number per dimension, stretched at each node (McCool and Harwood
//!   1997): points that are even stay so.
//! - **Bounded.** A tree is learnt from [`MOST_OBSERVATIONS`](learning::MOST_OBSERVATIONS) at most, of which each leaf has several.

pub(crate) mod learning;
#[cfg(all(test, feature = "std"))]
mod tests;

use alloc::vec::Vec;

/// The numbers of a sample that are guided.
pub(crate) const DIMENSIONS: usize = 4;

/// The part of a guide that is uniform.
pub(crate) const DEFENSIVE: f64 = 0.2;

/// The largest number below one.
const BELOW_ONE: f64 = 1.0 - f64::EPSILON / 2.0;

/// A density over the cube of the first numbers, the same all over each leaf of a kd-tree.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Guide {
    nodes: Vec<Node>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Node {
    Leaf,
    /// Halved along an axis: the lower half's probability, and where the upper one is. The lower one comes next.
    Split {
        axis: u8,
        lower: f64,
        upper: u32,
    },
}

/// A point drawn from a guide.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Drawn {
    pub(crate) point: [f64; DIMENSIONS],
    /// One over its density.
    pub(crate) inverse_density: f64,
}

impl Guide {
    /// The uniform one.
    pub(crate) fn even() -> Self {
        Self { nodes: alloc::vec![Node::Leaf] }
    }

    /// The number of its cells.
    pub(crate) fn cells(&self) -> usize {
        self.nodes.len().div_ceil(2)
    }

    /// The point that belongs to a uniform one, both inside the open cube.
    pub(crate) fn draw(&self, uniform: [f64; DIMENSIONS]) -> Drawn {
        let (mut u, mut low, mut size) = (uniform, [0.0; DIMENSIONS], [1.0; DIMENSIONS]);
        let (mut at, mut inverse_density) = (0, 1.0);
        while let Node::Split { axis, lower, upper } = self.nodes[at] {
            let k = usize::from(axis);
            size[k] *= 0.5;
            let part = if u[k] < lower {
                u[k] = f64::min(u[k] / lower, BELOW_ONE);
                at += 1;
                lower
            } else {
                u[k] = f64::min((u[k] - lower) / (1.0 - lower), BELOW_ONE);
                low[k] += size[k];
                at = upper as usize;
                1.0 - lower
            };
            inverse_density *= 0.5 / part;
        }
        let inside = |k: usize| f64::max(low[k] + size[k] * u[k], f64::MIN_POSITIVE).min(BELOW_ONE);
        Drawn { point: core::array::from_fn(inside), inverse_density }
    }

    /// Its density at a point.
    pub(crate) fn density(&self, point: [f64; DIMENSIONS]) -> f64 {
        let (mut u, mut at, mut density) = (point, 0, 1.0);
        while let Node::Split { axis, lower, upper } = self.nodes[at] {
            let x = &mut u[usize::from(axis)];
            *x *= 2.0;
            let part = if *x < 1.0 {
                at += 1;
                lower
            } else {
                *x -= 1.0;
                at = upper as usize;
                1.0 - lower
            };
            density *= 2.0 * part;
        }
        density
    }
}
