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
use super::{EdgeTree, LEAF};

/// Nodes nearer than this, in half diagonals of their boxes, are opened.
const NEAR: f64 = 1.0;

/// What can be chosen first.
#[derive(Clone, Copy)]
pub(super) enum Entry<'a> {
    /// A node, and the place of its first piece.
    Node(&'a Node, u32),
    /// A piece by its place.
    Piece(u32),
}

impl Entry<'_> {
    /// Its weight where nothing is known of any: a leaf's pieces have that of a node together.
    pub(super) fn evenly(&self) -> f64 {
        match self {
            Self::Node(..) => 1.0,
            Self::Piece(_) => 1.0 / LEAF as f64,
        }
    }

    pub(super) fn contains(&self, place: u32) -> bool {
        match self {
            Self::Node(node, begin) => (*begin..node.end).contains(&place),
            Self::Piece(own) => *own == place,
        }
    }
}

impl EdgeTree {
    /// Goes through everything that may count, each with an estimate of what it amounts to.
    pub(super) fn cut<'a>(
        &'a self,
        view: &Viewpoint,
        slack: f64,
        visit: &mut impl FnMut(Entry<'a>, f64),
    ) {
        if view.x.is_finite() {
            self.open(&self.nodes[0], 0, view, slack, visit);
        }
    }

    fn open<'a>(
        &'a self,
        node: &'a Node,
        begin: u32,
        view: &Viewpoint,
        slack: f64,
        visit: &mut impl FnMut(Entry<'a>, f64),
    ) {
        if node.children == 0 {
            let pieces = &self.pieces[begin as usize..node.end as usize];
            for (place, piece) in (begin..).zip(pieces) {
                let weight = piece.weigh(view, slack) / self.unit;
                if weight > 0.0 {
                    visit(Entry::Piece(place), weight);
                }
            }
            return;
        }
        for (child, from) in self.children(node, begin) {
            let weight = child.importance(view, slack);
            if weight > 0.0 && view.normal.is_none() && child.is_near(view, NEAR) {
                self.open(child, from, view, slack, visit);
            } else if weight > 0.0 {
                visit(Entry::Node(child, from), weight);
            }
        }
    }
}
