//! How a guide is learnt.
//!
//! - **What counts.** Of N observations with f², c and the weight w = 1/q' by the density q' that they were drawn from, the integral of
//!   f² over a cell is Σ f² w / N over those in it, and of c likewise.
//! - **Rare large samples** (a vertex next to the camera, a lobe hit by chance) often have most of Σ f² w and say nothing of
//!   their cell: they may happen to any sample that finds something. So f² w counts up to the T that a thousandth of
//!   them exceed, and what is above that is spread over all observations that are not zero, in proportion to w.
//! - **Growing.** Of halves along all axes, those are taken for which Σ V √(f² c) is least, V being volumes: the
//!   least work with density ∝ √(f² / c). Means of few observations are drawn towards that of the cell around, which
//!   counts as [`PRIOR`] observations.
//! - **Pruning.** Every other observation is left out in growing, and decides afterwards: where, judged by these, a node's halves take no
//!   less work than the node undivided, they go (reduced-error pruning, Quinlan 1987). So nothing is learnt from noise.
//! - **Off.** The same observations tell the gain, (∫ f²) (∫ c) over (∫ f² / q) (∫ c q); below [`LEAST_GAIN`], there is no guide.
//!   Then all observations make the densities.

use alloc::vec::Vec;

use drt_math::Real;

use super::{DEFENSIVE, DIMENSIONS, Guide, Node};

/// The most observations of one guide: 4 MB.
pub(crate) const MOST_OBSERVATIONS: usize = 1 << 17;

/// The gain below which there is no guide: more than observations left out have been seen to promise where there is
/// none.
pub(crate) const LEAST_GAIN: f64 = 1.4;

/// The part of observations whose size is not believed, and the fewest.
const LARGE: (f64, usize) = (1e-3, 8);

/// The fewest observations with a value from which anything is learnt.
const FEWEST: usize = 32;

/// The fewest observations of a half, not counting those left out.
const FEWEST_OF_HALF: usize = 8;

/// How many observations the mean of the cell around counts for.
const PRIOR: f64 = 2.0;

/// Halvings from the cube to the smallest cell.
const DEEPEST: u32 = 28;

/// What a sample has found.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Observation {
    pub(crate) point: [f32; DIMENSIONS],
    /// One over the density by which it was drawn.
    pub(crate) weight: f32,
    /// Its cost, in any unit.
    pub(crate) cost: f32,
    /// f².
    pub(crate) square: f64,
}

/// What has been learnt.
#[derive(Clone, Debug)]
pub(crate) struct Learnt {
    /// None where it would not help.
    pub(crate) guide: Option<Guide>,
    /// Work without the guide over that with it, by observations left out in growing it.
    pub(crate) gain: f64,
    /// Cost of a sample with the guide over that of one without, by these.
    pub(crate) cost: f64,
}

/// An observation with what counts of it.
struct Counted {
    point: [f32; DIMENSIONS],
    /// f² w, without rare large ones.
    square: f64,
    /// w.
    weight: f64,
    /// c w.
    cost: f64,
    /// Left out in growing.
    held: bool,
}

/// Sums over observations in a cell.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    square: f64,
    weight: f64,
    cost: f64,
    count: f64,
}

/// Means over a cell.
#[derive(Clone, Copy, Debug)]
struct Means {
    square: f64,
    cost: f64,
}

/// Work in a cell by observations left out, with the density within it that is told by the others.
#[derive(Clone, Copy, Debug)]
struct Judged {
    /// ∫ f² / q, q being one on average.
    squares: f64,
    /// ∫ c q over its volume.
    cost: f64,
    /// ∫ √(f² / c) by the others.
    mass: f64,
}

impl Sums {
    fn add(&mut self, o: &Counted) {
        self.square += o.square;
        self.weight += o.weight;
        self.cost += o.cost;
        self.count += 1.0;
    }

    /// Means over a cell of some volume, by these of `all` observations.
    fn means(&self, volume: f64, all: f64, around: Means) -> Means {
        let drawn =
            |own: f64, around: f64| (self.count * own + PRIOR * around) / (self.count + PRIOR);
        let cost = if self.weight > 0.0 { self.cost / self.weight } else { around.cost };
        Means {
            square: drawn(self.square / (all * volume), around.square),
            cost: drawn(cost, around.cost),
        }
    }
}

impl Means {
    fn density(self) -> f64 {
        Real::sqrt(self.square / self.cost)
    }
}

/// A guide from observations.
pub(crate) fn learn(observations: &[Observation]) -> Learnt {
    let none = Learnt { guide: None, gain: 1.0, cost: 1.0 };
    let mut counted = tempered(observations);
    if counted.iter().filter(|o| o.square > 0.0).count() < FEWEST {
        return none;
    }
    let [mut kept, mut held] = [Sums::default(); 2];
    for o in &counted {
        if o.held { held.add(o) } else { kept.add(o) }
    }
    let of_all =
        |sums: &Sums| Means { square: sums.square / sums.count, cost: sums.cost / sums.weight };
    let mut growth = Growth { counts: [kept.count, held.count], nodes: Vec::new() };
    let cube = Cell { low: [0.0; DIMENSIONS], size: [1.0; DIMENSIONS], volume: 1.0, depth: 0 };
    growth.grow(&mut counted, &cube, of_all(&kept));
    let fit = |which: &dyn Fn(&Counted) -> bool| fitted(&growth.nodes, &counted, which);
    let [gain, cost] = match fit(&|o| !o.held) {
        Some(guide) if guide.cells() > 1 => judged(&guide, &counted),
        _ => return none,
    };
    let guide = if gain >= LEAST_GAIN { fit(&|_| true) } else { None };
    Learnt { guide, gain, cost }
}

/// What counts of observations.
fn tempered(observations: &[Observation]) -> Vec<Counted> {
    let influence = |o: &Observation| o.square * f64::from(o.weight);
    let (part, fewest) = LARGE;
    let large = usize::max((part * observations.len() as f64) as usize, fewest);
    let mut sizes: Vec<f64> = observations.iter().map(influence).collect();
    let mut most = 0.0;
    if large < sizes.len() {
        let (_, size, _) = sizes.select_nth_unstable_by(large, |a, b| b.total_cmp(a));
        most = *size;
    }
    let (mut excess, mut spread) = (0.0, 0.0);
    for o in observations.iter().filter(|o| o.square > 0.0) {
        excess += f64::max(influence(o) - most, 0.0);
        spread += f64::from(o.weight);
    }
    let each = if spread > 0.0 { excess / spread } else { 0.0 };
    let counted = |(i, o): (usize, &Observation)| {
        let weight = f64::from(o.weight);
        let found = o.square > 0.0;
        Counted {
            point: o.point,
            square: if found { f64::min(influence(o), most) + each * weight } else { 0.0 },
            weight,
            cost: f64::from(o.cost) * weight,
            held: i % 2 == 1,
        }
    };
    observations.iter().enumerate().map(counted).collect()
}

/// Work without a guide over that with it, and the cost of a sample with it over that of one without, by observations that were
/// left out.
fn judged(guide: &Guide, counted: &[Counted]) -> [f64; 2] {
    let (mut squares, mut costs, mut weights) = ([0.0; 2], [0.0; 2], [0.0; 2]);
    for o in counted.iter().filter(|o| o.held) {
        let q = guide.density(o.point.map(f64::from));
        for (k, q) in [1.0, q].into_iter().enumerate() {
            squares[k] += o.square / q;
            costs[k] += o.cost * q;
            weights[k] += o.weight * q;
        }
    }
    let [even, guided] = [0, 1].map(|k| costs[k] / weights[k]);
    [squares[0] * even / (squares[1] * guided), guided / even]
}

/// A box that is a node's.
#[derive(Clone, Copy)]
struct Cell {
    low: [f32; DIMENSIONS],
    size: [f32; DIMENSIONS],
    volume: f64,
    depth: u32,
}

impl Cell {
    fn middle(&self, axis: usize) -> f32 {
        self.low[axis] + 0.5 * self.size[axis]
    }

    fn halves(&self, axis: usize) -> [Self; 2] {
        let mut lower = Self { volume: 0.5 * self.volume, depth: self.depth + 1, ..*self };
        lower.size[axis] *= 0.5;
        let mut upper = lower;
        upper.low[axis] = self.middle(axis);
        [lower, upper]
    }
}

/// A tree that grows.
struct Growth {
    /// Observations in all: kept, and left out.
    counts: [f64; 2],
    nodes: Vec<Node>,
}

/// How a cell is halved.
struct Halving {
    axis: usize,
    work: f64,
    means: [Means; 2],
}

impl Growth {
    /// Grows the subtree of a cell from the observations in it, which it puts in another order.
    fn grow(&mut self, inside: &mut [Counted], cell: &Cell, means: Means) -> Judged {
        let at = self.nodes.len();
        self.nodes.push(Node::Leaf);
        let mut held = Sums::default();
        inside.iter().filter(|o| o.held).for_each(|o| held.add(o));
        let cost = if held.weight > 0.0 { held.cost / held.weight } else { means.cost };
        let squares = cell.volume * held.square / self.counts[1];
        let undivided = Judged { squares, cost, mass: cell.volume * means.density() };
        let Some(halving) = self.halve(inside, cell, means) else { return undivided };
        let (axis, middle) = (halving.axis, cell.middle(halving.axis));
        let split = partition(inside, |o| o.point[axis] < middle);
        let (lower, upper) = inside.split_at_mut(split);
        let [low, high] = cell.halves(axis);
        let a = self.grow(lower, &low, halving.means[0]);
        let next = self.nodes.len() as u32;
        let b = self.grow(upper, &high, halving.means[1]);
        let mass = a.mass + b.mass;
        let part = a.mass / mass;
        let divided = Judged {
            squares: a.squares / part + b.squares / (1.0 - part),
            cost: a.cost * part + b.cost * (1.0 - part),
            mass,
        };
        // Not finite where a half has nothing.
        if divided.squares * divided.cost < undivided.squares * undivided.cost {
            self.nodes[at] = Node::Split { axis: axis as u8, lower: 0.5, upper: next };
            return divided;
        }
        self.nodes.truncate(at + 1);
        undivided
    }

    /// The halves that promise the least work.
    fn halve(&self, inside: &[Counted], cell: &Cell, around: Means) -> Option<Halving> {
        if cell.depth >= DEEPEST || around.square <= 0.0 || inside.len() < 4 * FEWEST_OF_HALF {
            return None;
        }
        let middles: [f32; DIMENSIONS] = core::array::from_fn(|k| cell.middle(k));
        let mut sums = [[Sums::default(); 2]; DIMENSIONS];
        for o in inside.iter().filter(|o| !o.held) {
            for (k, halves) in sums.iter_mut().enumerate() {
                halves[usize::from(o.point[k] >= middles[k])].add(o);
            }
        }
        let mut best: Option<Halving> = None;
        for (axis, halves) in sums.iter().enumerate() {
            if halves.iter().any(|h| h.count < FEWEST_OF_HALF as f64) {
                continue;
            }
            let means = halves.map(|h| h.means(0.5 * cell.volume, self.counts[0], around));
            let work = means.iter().map(|m| Real::sqrt(m.square * m.cost)).sum();
            if best.as_ref().is_none_or(|b| work < b.work) {
                best = Some(Halving { axis, work, means });
            }
        }
        best
    }
}

/// Puts those for which `first` holds first; their number.
fn partition<T>(items: &mut [T], first: impl Fn(&T) -> bool) -> usize {
    let mut n = 0;
    for i in 0..items.len() {
        if first(&items[i]) {
            items.swap(n, i);
            n += 1;
        }
    }
    n
}

/// The tree with the densities of some observations; `None` where they are no numbers.
fn fitted(nodes: &[Node], counted: &[Counted], which: &dyn Fn(&Counted) -> bool) -> Option<Guide> {
    let mut sums = alloc::vec![Sums::default(); nodes.len()];
    for o in counted.iter().filter(|o| which(o)) {
        let (mut u, mut at) = (o.point, 0);
        sums[at].add(o);
        while let Node::Split { axis, upper, .. } = nodes[at] {
            let x = &mut u[usize::from(axis)];
            *x *= 2.0;
            if *x < 1.0 {
                at += 1;
            } else {
                *x -= 1.0;
                at = upper as usize;
            }
            sums[at].add(o);
        }
    }
    let root =
        Means { square: sums[0].square / sums[0].count, cost: sums[0].cost / sums[0].weight };
    let mut masses = alloc::vec![0.0; nodes.len()];
    let mut volumes = alloc::vec![1.0; nodes.len()];
    let mut means = alloc::vec![root; nodes.len()];
    let mut total = 0.0;
    for (at, node) in nodes.iter().enumerate() {
        match *node {
            Node::Leaf => {
                masses[at] = volumes[at] * means[at].density();
                total += masses[at];
            }
            Node::Split { upper, .. } => {
                for half in [at + 1, upper as usize] {
                    volumes[half] = 0.5 * volumes[at];
                    means[half] = sums[half].means(volumes[half], sums[0].count, means[at]);
                }
            }
        }
    }
    if !(total > 0.0 && total.is_finite()) {
        return None;
    }
    let mut guide = Guide { nodes: nodes.to_vec() };
    for at in (0..nodes.len()).rev() {
        match &mut guide.nodes[at] {
            Node::Leaf => {
                masses[at] = DEFENSIVE * volumes[at] + (1.0 - DEFENSIVE) * masses[at] / total;
            }
            Node::Split { lower, upper, .. } => {
                masses[at] = masses[at + 1] + masses[*upper as usize];
                *lower = masses[at + 1] / masses[at];
            }
        }
    }
    Some(guide)
}
