//! What there is to choose among at once: groups of eight, with a weight of each for every way of
//! looking.

use alloc::vec::Vec;

use crate::edges::tree::EVEN;
use crate::edges::tree::eight::{Eight, LANES};
use crate::edges::tree::node::Child;
use crate::edges::tree::view::MOST_WAYS;

/// A group of eight parts of a tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum NodeGroup {
    /// The children of a node.
    Family(u32),
    /// Segments.
    Bundle(u32),
}

/// Memory for choices, to be used again and again.
#[derive(Debug, Default)]
pub struct TreeScratch {
    groups: Vec<NodeGroup>,
    /// Children that are to be judged by what is below them.
    pub(super) opened: Vec<Child>,
    /// What each group has to offer, for one way after the other.
    offers: Vec<GroupWeights>,
    totals: [Total; MOST_WAYS],
    ways: usize,
}

/// A group's weights for one way.
#[derive(Clone, Copy, Debug)]
struct GroupWeights {
    weights: Eight,
    unit: f64,
    sum: f64,
    /// How many are judged as a whole, and may count.
    judged: u32,
}

#[derive(Clone, Copy, Debug, Default)]
struct Total {
    sum: f64,
    judged: u32,
}

impl TreeScratch {
    #[inline(always)]
    pub(super) fn clear(&mut self, ways: usize) {
        self.groups.clear();
        self.opened.clear();
        self.offers.clear();
        self.totals = [Total::default(); MOST_WAYS];
        self.ways = ways;
    }

    #[inline(always)]
    pub(super) fn groups(&self) -> &[NodeGroup] {
        &self.groups
    }

    /// Adds a group with its weights for all ways, in a unit.
    #[inline(always)]
    pub(super) fn add(&mut self, group: NodeGroup, unit: f64, weights: &[Eight]) {
        self.groups.push(group);
        for (total, weights) in self.totals.iter_mut().zip(weights) {
            let judged = match group {
                NodeGroup::Family(_) => weights.positive(),
                // Segments are known too well to need it.
                NodeGroup::Bundle(_) => 0,
            };
            let sum = f64::from(weights.sum()) * unit;
            total.sum += sum;
            total.judged += judged;
            self.offers.push(GroupWeights { weights: *weights, unit, sum, judged });
        }
    }

    /// All of the weights for one way.
    #[inline(always)]
    pub(super) fn sum(&self, way: usize) -> f64 {
        self.totals[way].sum
    }

    /// Chooses one by its weight for one way with a uniform number, of which it leaves another.
    #[inline(always)]
    pub(super) fn choose(&self, way: usize, u: &mut f64) -> Option<(usize, usize)> {
        let total = self.totals[way];
        let all = total.all();
        if !(all > 0.0 && all.is_finite()) {
            return None;
        }
        let share = total.share();
        let mut target = *u * all;
        let mut chosen = None;
        let offers = self.offers.iter().skip(way).step_by(self.ways);
        for (group, offer) in offers.enumerate().filter(|(_, o)| o.sum > 0.0) {
            let part = offer.sum + share * f64::from(offer.judged);
            chosen = Some((group, offer));
            if target < part {
                break;
            }
            target -= part;
        }
        let (group, offer) = chosen?;
        let mut chosen = None;
        for lane in 0..LANES {
            let weight = offer.weight(lane, share);
            if weight > 0.0 {
                chosen = Some((group, lane));
                if target < weight {
                    *u = (target / weight).max(0.0);
                    break;
                }
                target -= weight;
            }
        }
        chosen
    }

    /// The probability of one for some way.
    #[inline(always)]
    pub(super) fn chance(&self, way: usize, (group, lane): (usize, usize)) -> f64 {
        let total = self.totals[way];
        let weight = self.offers[group * self.ways + way].weight(lane, total.share());
        if weight > 0.0 { weight / total.all() } else { 0.0 }
    }
}

impl GroupWeights {
    /// One's weight, and an equal `share` of what is judged as a whole.
    #[inline(always)]
    fn weight(&self, lane: usize, share: f64) -> f64 {
        let weight = f64::from(self.weights.0[lane]);
        if weight > 0.0 && self.judged > 0 {
            weight * self.unit + share
        } else {
            weight * self.unit
        }
    }
}

impl Total {
    /// What is given to each that is judged as a whole and may count: an estimate may be too low by any
    /// factor, and variance grows with the greatest.
    #[inline(always)]
    fn share(&self) -> f64 {
        EVEN * self.sum / f64::from(self.judged.max(1))
    }

    #[inline(always)]
    fn all(&self) -> f64 {
        if self.judged > 0 { self.sum * (1.0 + EVEN) } else { self.sum }
    }
}
