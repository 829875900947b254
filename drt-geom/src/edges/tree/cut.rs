//! Where going down a tree starts: at nodes that are far enough to be judged as one.
//!
//! What is near counts most, and there an estimate for many segments at once is off by most: from
//! beside a surface its own node seems to hold a tenth of what it does, as the mean over the node
//! misses the few segments that are nearest. So nodes are opened as long as they are near, down to
//! their segments (as Conty Estevez & Kulla 2018 split nodes, section 5.4), of which each
//! is judged by itself.
//!
//! Not so from points of surfaces: what is nearest to them are mostly edges of the same mesh, which
//! move along and jump by little. To judge those well was found to cost twice the variance. Only
//! the few long edges of a room around a fine mesh are looked at one by one from there, too: of a node
//! with many segments, children with few.

use crate::edges::tree::eight::Eight;
use crate::edges::tree::node::Child;
use crate::edges::tree::options::{NodeGroup, TreeScratch};
use crate::edges::tree::seen::{Seen, Toward};
use crate::edges::tree::view::{MOST_WAYS, Viewpoint, Way};
use crate::edges::tree::{ARITY, EdgeTree, LEAF};

/// Most groups of a cut: beyond this nothing more is opened.
const MOST: usize = 64;

/// Of a node with more segments than this, children without nodes of their own are opened, too.
const MANY: usize = ARITY * LEAF;

/// A query, ready for groups of eight.
pub(super) struct Looking {
    pub(super) seen: Seen,
    ways: [Toward; MOST_WAYS],
    count: usize,
    /// To choose, and not only to see how much there is.
    finely: bool,
}

impl Looking {
    /// `None` where nothing counts.
    #[inline(always)]
    pub(super) fn new(view: &Viewpoint, ways: &[Way], slack: f64, finely: bool) -> Option<Self> {
        let mut all = [Toward::from(&Way::anywhere(0.0)); MOST_WAYS];
        all.iter_mut().zip(ways).for_each(|(a, w)| *a = w.into());
        let count = ways.len().min(MOST_WAYS);
        Some(Self { seen: Seen::new(view, slack)?, ways: all, count, finely })
    }

    fn ways(&self) -> &[Toward] {
        &self.ways[..self.count]
    }
}

impl EdgeTree {
    /// Judges what is below a child; where it may be `open`ed, far enough down.
    #[inline(always)]
    pub(super) fn cut(
        &self,
        child: Child,
        query_rays: &Looking,
        mut open: bool,
        options: &mut TreeScratch,
    ) {
        options.clear(query_rays.count);
        let mut next = Some(child);
        while let Some(child) = next {
            if child.bundles > 0 {
                self.add_bundles(child, query_rays, options);
            } else {
                self.add_family(child.first, query_rays, open, options);
            }
            next = options.opened.pop();
            open = true;
        }
    }

    #[inline(always)]
    fn add_bundles(&self, child: Child, query_rays: &Looking, options: &mut TreeScratch) {
        for index in child.first..child.first + child.bundles {
            let (bundle, mut all) = (&self.bundles[index as usize], [Eight::ZERO; MOST_WAYS]);
            let (weight, lines) = bundle.weigh(&query_rays.seen);
            for (w, way) in all.iter_mut().zip(query_rays.ways()) {
                *w = bundle.toward(way, &query_rays.seen, weight, &lines);
            }
            options.add(NodeGroup::Bundle(index), bundle.unit, &all[..query_rays.count]);
        }
    }

    #[inline(always)]
    fn add_family(&self, index: u32, query_rays: &Looking, open: bool, options: &mut TreeScratch) {
        let (family, mut all) = (&self.families[index as usize], [Eight::ZERO; MOST_WAYS]);
        let (weight, boxes) = family.weigh(&query_rays.seen);
        for (w, way) in all.iter_mut().zip(query_rays.ways()) {
            *w = family.toward(way, weight, &boxes);
        }
        let all = &mut all[..query_rays.count];
        let few = query_rays.finely && family.count as usize > MANY;
        if open || few {
            let near = if open { family.near(&boxes) } else { Eight::ZERO };
            let mut room = MOST.saturating_sub(options.groups().len() + 1);
            for (lane, child) in family.children.iter().enumerate().rev() {
                let badly_judged = near.0[lane] > 0.0 || (few && child.bundles > 0);
                let groups = child.bundles.max(1) as usize;
                if badly_judged && groups <= room && all.iter().any(|w| w.0[lane] > 0.0) {
                    all.iter_mut().for_each(|w| w.0[lane] = 0.0);
                    room -= groups;
                    options.opened.push(*child);
                }
            }
        }
        options.add(NodeGroup::Family(index), family.unit, all);
    }
}
