//! Where going down a tree starts: at nodes that are far enough to be judged as one.
//!
//! What is near counts most, and there an estimate for many segments at once is off by most: from
//! beside a surface its own node seems to hold a tenth of what it does, as the mean over the node
//! misses the few segments that are nearest. So nodes are opened as long as they are near, down to
//! their segments (as Conty Estevez & Kulla 2018 split nodes, section 5.4), of which each
//! is judged by itself.
//!
//! Not so from points of surfaces: what is nearest to them are mostly edges of the same mesh, which
//! move along and jump by little. To judge those well was found to cost twice the variance.

use super::node::Node;
use super::view::Viewpoint;
use super::{ARITY, EVEN, EdgeTree, LEAF};

/// Nodes nearer than this, in half diagonals of their boxes, are opened.
const NEAR: f64 = 0.5;

/// Most entries of a cut: beyond this nothing more is opened.
const MOST: usize = 384;

/// Parts of the pieces in their order, with estimates of what they amount to.
pub(super) struct Cut {
    weights: [f64; MOST],
    /// The place after the last piece of each.
    ends: [u32; MOST],
    /// The node of each, 0 for a single piece.
    nodes: [u32; MOST],
    count: usize,
}

impl Cut {
    pub(super) fn weights(&self) -> &[f64] {
        &self.weights[..self.count]
    }

    pub(super) fn ends(&self) -> &[u32] {
        &self.ends[..self.count]
    }

    pub(super) fn node(&self, k: usize) -> u32 {
        self.nodes[k]
    }

    fn add(&mut self, weight: f64, end: u32, node: u32) {
        let k = self.count;
        (self.weights[k], self.ends[k], self.nodes[k]) = (weight, end, node);
        self.count += 1;
    }

    /// Gives nodes an equal share in a part of all choices. Pieces are known too well to need it.
    pub(super) fn even_out(&mut self) {
        let total: f64 = self.weights().iter().sum();
        let judged = |k: &usize| self.nodes[*k] != 0 && self.weights[*k] > 0.0;
        let share = EVEN * total / (0..self.count).filter(judged).count().max(1) as f64;
        for (weight, node) in self.weights.iter_mut().zip(self.nodes).take(self.count) {
            *weight += if node != 0 && *weight > 0.0 { share } else { 0.0 };
        }
    }
}

impl EdgeTree {
    /// All that may count.
    pub(super) fn cut(&self, view: &Viewpoint, slack: f64) -> Cut {
        let mut cut = Cut { weights: [0.0; MOST], ends: [0; MOST], nodes: [0; MOST], count: 0 };
        self.open((0, 0), 0, view, slack, &mut cut);
        cut
    }

    /// An estimate of the integral over all segments of kernel, scattering and weight.
    pub(crate) fn amount(&self, view: &Viewpoint) -> f64 {
        let (slack, root) = (self.slack(view), &self.nodes[0]);
        let sum = match (view.normal, root.children) {
            (None, _) => self.cut(view, slack).weights().iter().sum(),
            (_, 0) => root.importance(view, slack),
            _ => self.children(root, 0).map(|(child, _)| child.importance(view, slack)).sum(),
        };
        self.unit * sum
    }

    fn open(
        &self,
        (node, begin): (u32, u32),
        after: usize,
        view: &Viewpoint,
        slack: f64,
        cut: &mut Cut,
    ) {
        let Node { children, end, .. } = self.nodes[node as usize];
        if children == 0 {
            let pieces = &self.pieces[begin as usize..end as usize];
            for (place, piece) in (begin..).zip(pieces) {
                cut.add(piece.weigh(view, slack) / self.unit, place + 1, 0);
            }
            return;
        }
        for (k, (child, from)) in (children..).zip(self.children(&self.nodes[node as usize], begin))
        {
            let weight = child.importance(view, slack);
            let near = weight > 0.0 && view.normal.is_none() && child.is_near(view, NEAR);
            // Those that come after it on its own level and above need their room.
            let after = after + ARITY;
            if near && cut.count + LEAF + after <= MOST {
                self.open((k, from), after, view, slack, cut);
            } else {
                cut.add(weight, child.end, k);
            }
        }
    }
}
