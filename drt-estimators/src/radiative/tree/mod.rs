//! Points on edges for the boundary term of the 2019 form (theory sheet §3), drawn as they matter to
//! one scattering vertex.
//!
//! At a vertex x that term is an integral over all edges at which the radiance arriving at x jumps,
//!
//! ```text
//! ∫ f(x, w) ΔL(x, w) N.(y_dot - x_dot) sin(t, w) / r^2 dl(y),    r = |y - x|, w r = y - x,
//! ```
//!
//! t the edge's tangent. Of a fine mesh few edges have a jump: silhouettes, one of whose faces turns
//! its front to x and the other its back, and creases between faces with different radiance. Which an
//! edge is depends on x alone and is the same all along it, since the planes of its faces hold it.
//!
//! [`EdgeTree`] is a hierarchy over edges with bounds of their positions and normals (Li et al. 2018,
//! "Differentiable Monte Carlo Ray Tracing through Edge Sampling", section 4), gone through as
//! hierarchies of lights are (Conty Estevez & Kulla 2018, "Importance Sampling of Many Lights with
//! Adaptive Tree Splitting"): from the root down, one of a node's children is chosen in proportion
//! to an estimate of
//!
//! ```text
//! sum over its edges: weight × length × P(counts as silhouette or crease) × f / r^2,
//! ```
//!
//! f being a [sketch](crate::surface::Lobes) of how x scatters: a cosine with the normal of a surface,
//! and lobes, as wide as the node is seen besides their own width. The estimate ([`node`]) is positive
//! wherever an edge below may count, so nothing is lost, and 0 where it is proved that none does.
//! Near x nodes are opened first, down to their edges ([`cut`]), and the first choice is among all that
//! this leaves.
//! Nodes have eight children, as each choice adds its error and a wide tree has few of them; leaves
//! weigh each of their edges by what it really amounts to ([`piece`]), and so does a node with many
//! segments for children with few. On the edge the density is sin / r^2, exactly ([`kernel`]). A
//! sample costs time logarithmic in the number of edges.
//!
//! A node may turn out to hold nothing that counts after all. Then there is no sample, and the
//! density is what it is, with an integral below one: an estimate that takes such a sample for zero
//! is unbiased.
//!
//! The same tree also draws points towards a light: those in the cone of directions to a sphere
//! around it ([`Viewpoint::toward`]), with segments cut to their part in the cone. Both densities are
//! known at any point, so that the two can share samples (Veach & Guibas 1995).

mod build;
mod cut;
mod kernel;
mod node;
mod piece;
#[cfg(all(test, feature = "std"))]
mod tests;
mod view;

use alloc::vec::Vec;

use drt_math::Vec3;

use node::Node;
use piece::{Piece, Stretch};
pub(crate) use view::Viewpoint;

/// An edge of a surface at which the radiance may jump that arrives at a point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Segment {
    pub(crate) a: Vec3,
    pub(crate) b: Vec3,
    /// Unit normals of the two faces, on the sides that are one side of the surface; only the first
    /// is looked at of an open edge.
    pub(crate) faces: [Vec3; 2],
    /// One face only: always a silhouette.
    pub(crate) open: bool,
    /// What to expect of the jump where the edge is a silhouette.
    pub(crate) jump: f64,
    /// The same where both faces are seen from the front, and where both are from the back.
    pub(crate) crease: [f64; 2],
}

/// A point on an edge.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Chosen {
    pub(crate) edge: usize,
    /// How far it is from the edge's first end, as a part of its length.
    pub(crate) u: f64,
    /// 1 over the density per length.
    pub(crate) inv_pdf: f64,
}

/// Edges to choose from: a node's children are consecutive, and so are the pieces below it. Where
/// they are follows from where each ends; a node takes up 96 bytes.
#[derive(Debug)]
pub(crate) struct EdgeTree {
    /// The root first.
    nodes: Vec<Node>,
    /// In the order of the leaves.
    pieces: Vec<Piece>,
    /// Where each of the caller's segments is among the pieces.
    places: Vec<u32>,
    /// The weight in which the nodes count.
    unit: f64,
    /// Of all coordinates.
    largest: f64,
}

/// Most children of a node.
const ARITY: usize = 8;

/// Evenly made choices in comparison with others.
const EVEN: f64 = 0.1;

/// Most segments of a leaf: among fewer than this, the number of silhouettes is hard to guess.
const LEAF: usize = 32;

impl EdgeTree {
    /// Draws a point with two uniform numbers: the first chooses the edge, what each choice leaves of
    /// it serving for the next, the second the place on it. `None` where nothing counts, or nothing
    /// is found (see [above](self)).
    pub(crate) fn sample(&self, view: &Viewpoint, [mut u, along]: [f64; 2]) -> Option<Chosen> {
        let (place, pmf, stretch) = self.descend(view, |_, weights, total| {
            let mut target = u * total;
            let mut chosen = None;
            for (k, w) in weights.iter().enumerate().filter(|(_, w)| **w > 0.0) {
                chosen = Some(k);
                if target < *w {
                    u = target / w;
                    break;
                }
                target -= w;
            }
            chosen
        })?;
        let t = stretch.sample(along);
        let pdf = pmf * stretch.pdf(t);
        Some(Chosen { edge: self.pieces[place].edge as usize, u: t, inv_pdf: 1.0 / pdf })
    }

    /// The density per length of [`EdgeTree::sample`].
    pub(crate) fn pdf(&self, view: &Viewpoint, edge: usize, u: f64) -> f64 {
        let Some(place) = self.places.get(edge).filter(|p| **p != u32::MAX) else { return 0.0 };
        let found = self.descend(view, |ends, _, _| ends.iter().position(|end| place < end));
        found.map_or(0.0, |(_, pmf, stretch)| pmf * stretch.pdf(u))
    }

    /// What rounding may move places by.
    fn slack(&self, view: &Viewpoint) -> f64 {
        1e-15 * (self.largest + view.x.max_abs())
    }

    /// A node's children, each with the place of its first piece.
    fn children<'a>(
        &'a self,
        node: &'a Node,
        mut begin: u32,
    ) -> impl Iterator<Item = (&'a Node, u32)> {
        let mut children = self.nodes[node.children as usize..].iter();
        core::iter::from_fn(move || {
            let child = (begin < node.end).then(|| children.next())??;
            let from = core::mem::replace(&mut begin, child.end);
            Some((child, from))
        })
    }

    /// Goes down by choices among weights, of parts of the pieces that have the given ends. Returns
    /// the piece, the probability, and what of the piece counts.
    fn descend(
        &self,
        view: &Viewpoint,
        mut choose: impl FnMut(&[u32], &[f64], f64) -> Option<usize>,
    ) -> Option<(usize, f64, Stretch)> {
        if !view.x.is_finite() {
            return None;
        }
        let slack = self.slack(view);
        let mut pick = |ends: &[u32], weights: &[f64]| {
            let total: f64 = weights.iter().sum();
            if !(total > 0.0 && total.is_finite()) {
                return None;
            }
            let k = choose(ends, weights, total)?;
            (weights[k] > 0.0).then(|| (k, weights[k] / total))
        };
        let mut cut = self.cut(view, slack);
        cut.even_out();
        let (k, mut pmf) = pick(cut.ends(), cut.weights())?;
        let mut begin = if k > 0 { cut.ends()[k - 1] } else { 0 };
        let stretch = |place: u32| self.pieces[place as usize].stretch(view, slack);
        let mut node = match cut.node(k) {
            0 => return Some((begin as usize, pmf, stretch(begin)?)),
            node => &self.nodes[node as usize],
        };
        let (mut weights, mut ends) = ([0.0; LEAF], [0; LEAF]);
        while node.children != 0 {
            let many = (node.end - begin) as usize > ARITY * LEAF;
            let mut count = 0;
            for (child, from) in self.children(node, begin) {
                weights[count] = if many && child.children == 0 {
                    let few = &self.pieces[from as usize..child.end as usize];
                    few.iter().map(|piece| piece.weigh(view, slack)).sum::<f64>() / self.unit
                } else {
                    child.importance(view, slack)
                };
                ends[count] = child.end;
                count += 1;
            }
            even_out(&mut weights[..count]);
            let (k, p) = pick(&ends[..count], &weights[..count])?;
            begin = if k > 0 { ends[k - 1] } else { begin };
            (node, pmf) = (&self.nodes[node.children as usize + k], pmf * p);
        }
        let pieces = &self.pieces[begin as usize..node.end as usize];
        for (k, piece) in pieces.iter().enumerate() {
            (weights[k], ends[k]) = (piece.weigh(view, slack), begin + k as u32 + 1);
        }
        let (k, p) = pick(&ends[..pieces.len()], &weights[..pieces.len()])?;
        let place = begin + k as u32;
        Some((place as usize, pmf * p, stretch(place)?))
    }
}

/// Gives children that may count an equal share in a part of all choices: an estimate may be too low
/// by any factor, and variance grows with the greatest.
fn even_out(weights: &mut [f64]) {
    let total: f64 = weights.iter().sum();
    let positive = weights.iter().filter(|w| **w > 0.0).count();
    let share = EVEN * total / positive.max(1) as f64;
    for w in weights.iter_mut().filter(|w| **w > 0.0) {
        *w += share;
    }
}
