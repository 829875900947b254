//! Points on edges for the boundary term of the 2019 form.

mod build;
mod kernel;
mod node;
mod piece;
#[cfg(test)]
mod tests;
mod view;

use alloc::vec::Vec;
use core::ops::Range;

use drt_math::{Rng, Vec3};

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

/// Edges to choose from.
#[derive(Debug)]
pub(crate) struct EdgeTree {
    /// The root first.
    nodes: Vec<Node>,
    /// In the order of the leaves.
    pieces: Vec<Piece>,
    /// Where each of the caller's segments is among the pieces.
    places: Vec<u32>,
    /// Of all coordinates.
    largest: f64,
}

/// Children of a node, and segments of a leaf.
const ARITY: usize = 8;

/// Consecutive pieces.
#[derive(Clone, Copy, Debug)]
struct Span {
    begin: usize,
    len: usize,
}

impl Span {
    /// One of [`ARITY`] parts; of fewer pieces than that some parts are empty, none has two.
    fn part(&self, k: usize) -> Self {
        let [begin, end] = [k, k + 1].map(|k| self.begin + self.len * k / ARITY);
        Self { begin, len: end - begin }
    }

    fn range(&self) -> Range<usize> {
        self.begin..self.begin + self.len
    }
}

impl EdgeTree {
    /// Draws a point.
    pub(crate) fn sample(&self, view: &Viewpoint, rng: &mut Rng) -> Option<Chosen> {
        let [mut u, along] = rng.next_2d();
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
        let found = self.descend(view, |span, _, _| {
            (0..ARITY).find(|k| span.part(*k).range().contains(&(*place as usize)))
        });
        found.map_or(0.0, |(_, pmf, stretch)| pmf * stretch.pdf(u))
    }

    /// Goes down by choices among weights, and returns the piece, the probability, and what of the
    /// piece counts.
    fn descend(
        &self,
        view: &Viewpoint,
        mut choose: impl FnMut(&Span, &[f64; ARITY], f64) -> Option<usize>,
    ) -> Option<(usize, f64, Stretch)> {
        let slack = 1e-15 * (self.largest + view.x.max_abs());
        let mut pick = |span: &Span, weights: &[f64; ARITY]| {
            let total: f64 = weights.iter().sum();
            if !(total > 0.0 && total.is_finite()) {
                return None;
            }
            let k = choose(span, weights, total)?;
            (weights[k] > 0.0).then(|| (k, weights[k] / total))
        };
        let mut span = Span { begin: 0, len: self.pieces.len() };
        let mut node = &self.nodes[0];
        let mut pmf = 1.0;
        while node.children != 0 {
            let children = &self.nodes[node.children as usize..][..ARITY];
            let weights = core::array::from_fn(|k| children[k].importance(view, slack));
            let (k, p) = pick(&span, &weights)?;
            (node, span, pmf) = (&children[k], span.part(k), pmf * p);
        }
        let stretches: [Option<Stretch>; ARITY] = core::array::from_fn(|k| {
            self.pieces[span.part(k).range()].first()?.stretch(view, slack)
        });
        let weights = core::array::from_fn(|k| stretches[k].as_ref().map_or(0.0, |s| s.weight));
        let (k, p) = pick(&span, &weights)?;
        Some((span.part(k).begin, pmf * p, stretches[k]?))
    }
}
