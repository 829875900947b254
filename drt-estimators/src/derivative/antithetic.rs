//! Rays beside those of a path, to which a rougher or turning surface moves light.
//!
//! # Roughness
//!
//! Let a path leave a rough surface along w, of density p, and C be what comes from there. As the roughness α grows,
//! the value f changes mainly as the density of microfacet normals does, by a f, where a is of the size of 1/α and of
//! mean zero: a f C / p has the noise of C many times over. But each direction has a
//! [counterpart](crate::model::surface::RoughnessPartner) w', which gains what it loses. With the symbols of that, a f C / p is
//! replaced by
//!
//! ```text
//! s a [f C - r f' C'] / p.
//! ```
//!
//! The mean is the same, as s shares the pair between its two directions, and what counts is what comes from the two
//! compared. C' is found by a path of its own, with the random numbers of the first: in narrow lobes both see much the same.
//! Where C is smooth the difference vanishes with α as 1/a does; where it has an edge, only how often it does not
//! vanish.
//!
//! # Lobes that turn
//!
//! With a surface, with the ray that meets it, or with the index of refraction the lobe turns, and f changes by b f, b again
//! of the size of 1/α. What one side of the lobe loses the other one gains, so the ray beside is the
//! [opposite](crate::model::surface::DirectionPartner) one, and b f C / p is replaced by
//!
//! ```text
//! s [b f C + r b' f' C'] / p.
//! ```
//!
//! b has parts by wo, wi, the normal and the index. The first two turn with the ends of their rays, as far as these stay
//! on their matter: what w' meets is not what w meets, so that C' is kept by where it comes from. Each of the two keeps
//! its own b, with which a path that turns as a whole does not change at all, and neither does its pair.
//!
//! # Both
//!
//! Pairs of paths with derivatives of opposite sign are from Zhang et al. 2021, "Antithetic Sampling for Monte Carlo
//! Differentiable Rendering", who mirror whole paths; derivatives by roughness are even and take other counterparts.
//! Zeltner et al. 2021, "Monte Carlo Estimators for Differential Light Transport", sample the two signs apart; here they
//! are paired.
//!
//! What else of f changes, masking and Fresnel's factor, is differentiated as it stands, and so is all of it where w has no
//! ray beside it: then it is not one itself. So are connections to lights. Where scattering finds a light it is weighted
//! against connections as ever, C by the density of w and C' by that of w'.
//!
//! The interior term alone is estimated so, and has the same mean: edges have no part in it.

use alloc::vec::Vec;

use drt_math::{Rgb, Rng, Vec3};

use crate::derivative::velocity::PathVelocities;
use crate::model::surface::{Given, Turn};
use crate::sampling::record::PathRecord;
use crate::sampling::trace::{Arrival, Observer, OutgoingRay, Pixel, Tracer};
use crate::world::{Crossing, World};

/// Pairs of each kind that a path has at most, so that its cost does not grow with the square of its length; those of
/// little weight are followed as seldom.
const MOST: f64 = 8.0;

/// A part of the logarithmic derivative of a scattering function that pairs tell.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct PairedPart {
    /// a, by the roughness.
    pub(crate) alpha: f64,
    /// Of which pair it is to tell b.
    turn: Option<u32>,
}

/// What a pair tells.
#[derive(Clone, Copy, Debug)]
pub(crate) enum PairKind {
    /// a, by the roughness.
    Roughness(f64),
    /// b and b', by what turns the lobe.
    Turns([Turn; 2]),
}

impl PairKind {
    fn index(&self) -> usize {
        match self {
            Self::Roughness(_) => 0,
            Self::Turns(_) => 1,
        }
    }
}

/// A ray beside that which leaves a node.
#[derive(Clone, Debug)]
pub(crate) struct AntitheticPair {
    pub(crate) node: usize,
    pub(crate) kind: PairKind,
    /// s.
    pub(crate) share: f64,
    /// The path's ray.
    leaving: OutgoingRay,
    /// The other one's direction, and its density.
    w: Vec3,
    pdf: f64,
    /// r f'.
    pub(crate) value: Rgb,
    /// How many times f that is, at least 1.
    brighter: f64,
    /// Of the difference.
    weight: f64,
    /// What the path's ray had next.
    rng: Rng,
}

/// What the other ray of a pair brings.
#[derive(Clone, Debug, Default)]
pub(crate) struct PairedRadiance {
    /// C'.
    pub(crate) light: Rgb,
    /// Where the ray ends, with the part of C' that comes from there: several where vertices are placed for lights as
    /// well.
    pub(crate) ends: Vec<(Arrival, Rgb)>,
    /// Emitted by the next end, of which the walk tells first.
    emitted: Rgb,
    /// Segments to the ends.
    first: u32,
    /// Nobody asks for the ends.
    unasked: bool,
}

impl Observer for PairedRadiance {
    const RECORDS: bool = false;

    fn contribution(&mut self, _: Pixel, segments: u32, value: Rgb) {
        self.light += value;
        match self.ends.last_mut() {
            Some((_, incoming)) if segments > self.first => *incoming += value,
            _ => self.emitted += value,
        }
    }

    fn arrive(&mut self, _world: &World, arrival: &Arrival, _crossings: &[Crossing]) -> u32 {
        if arrival.parent == 0 && !self.unasked {
            self.ends.push((*arrival, core::mem::take(&mut self.emitted)));
        }
        1
    }
}

/// The pairs of a path.
#[derive(Clone, Debug, Default)]
pub(crate) struct AntitheticPairs {
    list: Vec<AntitheticPair>,
    /// By node, as far as there are any.
    paired: Vec<PairedPart>,
    /// For choosing among them; without it there are none.
    rng: Option<Rng>,
    /// They tell how lobes turn, too.
    turning: bool,
}

impl AntitheticPairs {
    /// Of roughness, and if `turning` of how lobes turn.
    pub(crate) fn new(turning: bool) -> Self {
        Self { turning, ..Self::default() }
    }

    /// Forgets those of the last path. There are none of the next without random numbers to choose by.
    pub(crate) fn begin(&mut self, rng: Option<Rng>) {
        self.list.clear();
        self.paired.clear();
        self.rng = rng;
    }

    /// Adds those of a ray that leaves a node.
    pub(crate) fn offer(
        &mut self,
        world: &World,
        record: &PathRecord,
        velocities: &PathVelocities,
        leaving: &OutgoingRay,
        rng: &Rng,
    ) {
        let rougher = world.roughens(&leaving.vertex);
        let turns = self.turns(world, record, velocities, leaving);
        if self.rng.is_none() || !(rougher || turns) {
            return;
        }
        let node = &record.nodes[leaving.node as usize];
        let (Some(arrival), Some(scattering)) = (&node.arrival, world.scattering(&leaving.vertex))
        else {
            return;
        };
        let mut paired = PairedPart::default();
        let wo = -arrival.dir;
        // `often` is how often the other one is drawn for what it tells, by a given density.
        let mut add = |kind, size: f64, w, ratio: f64, often: f64| {
            let pdf = scattering.pdf(wo, w, Given::Wo);
            let drawn = leaving.pdf().unwrap_or(0.0);
            let share = drawn / (drawn + ratio * often * pdf);
            if !share.is_finite() {
                return false;
            }
            let value = scattering.eval(wo, w) * ratio;
            let (own, others) = (node.value.max_abs(), value.max_abs());
            let brighter = if others > own && own > 0.0 { others / own } else { 1.0 };
            // Also by f', as the one direction may be seen where the other hardly is.
            let larger = f64::max(own, others);
            let weight = arrival.throughput.max_abs() * node.inv_pdf * share * size * larger;
            let (node, leaving, rng) = (leaving.node as usize, *leaving, rng.clone());
            self.list.push(AntitheticPair {
                node,
                kind,
                share,
                leaving,
                w,
                pdf,
                value,
                brighter,
                weight,
                rng,
            });
            true
        };
        if rougher && let Some(c) = scattering.roughness_partner(wo, leaving.dir) {
            let [a, b] = c.slopes.map(f64::abs);
            if add(PairKind::Roughness(c.slopes[0]), a, c.w, c.ratio, a / b) {
                paired.alpha = c.slopes[0];
            }
        }
        if turns
            && let Some(o) = scattering.direction_partner(wo, leaving.dir)
            && add(PairKind::Turns(o.turns), o.turns[0].n.length(), o.w, o.ratio, 1.0)
        {
            paired.turn = Some(self.list.len() as u32 - 1);
        }
        let k = leaving.node as usize;
        if self.paired.len() <= k {
            self.paired.resize(k + 1, PairedPart::default());
        }
        self.paired[k] = paired;
    }

    /// What pairs tell of the ray that leaves a node.
    pub(crate) fn paired(&self, node: usize) -> PairedPart {
        self.paired.get(node).copied().unwrap_or_default()
    }

    /// b, where a pair tells it.
    pub(crate) fn turn(&self, paired: &PairedPart) -> Option<&Turn> {
        match &self.list.get(paired.turn? as usize)?.kind {
            PairKind::Turns([turn, _]) => Some(turn),
            PairKind::Roughness(_) => None,
        }
    }

    /// Whether the lobe of a node may turn as parameters change, or one of its rays. Does not depend on the ray that
    /// leaves it, which would be another one for the other side.
    fn turns(
        &self,
        world: &World,
        record: &PathRecord,
        velocities: &PathVelocities,
        leaving: &OutgoingRay,
    ) -> bool {
        let (v, k) = (&leaving.vertex, leaving.node as usize);
        let (true, Some(s)) = (self.turning, v.surface()) else { return false };
        let field = velocities.field();
        let seen = || {
            record.nodes[k].arrival.as_ref().is_some_and(|a| a.parent == 0) && velocities.moves(0)
        };
        let transmissive = world.bsdf_of(s.shape).is_transmissive();
        // Most lobes are wide.
        world.lobe_width(v) < field.widest_paired(transmissive)
            && (world.bends_light(v) || seen() || field.turns_rays(world, s, velocities.of(k)))
    }

    /// Follows most of the other rays: tells `found` pairs, their probabilities, and what they bring; `incoming` is a
    /// buffer.
    pub(crate) fn follow(
        &self,
        tracer: &mut Tracer<'_>,
        incoming: &mut PairedRadiance,
        mut found: impl FnMut(&AntitheticPair, f64, &PairedRadiance),
    ) {
        let Some(mut rng) = self.rng.clone().filter(|_| !self.list.is_empty()) else { return };
        let own = tracer.rng.clone();
        let mut totals = [0.0; 2];
        for pair in &self.list {
            totals[pair.kind.index()] += pair.weight;
        }
        let mut choices = totals.map(|total| Choice { next: rng.next_f64(), total });
        for pair in &self.list {
            if let Some(chance) = choices[pair.kind.index()].takes(pair.weight) {
                pair.follow(tracer, incoming);
                found(pair, chance, incoming);
            }
        }
        tracer.rng = own;
    }
}

impl AntitheticPair {
    /// Traces the other ray.
    fn follow(&self, tracer: &mut Tracer<'_>, incoming: &mut PairedRadiance) {
        incoming.ends.clear();
        (incoming.light, incoming.emitted) = (Rgb::ZERO, Rgb::ZERO);
        incoming.first = self.leaving.segments + 1;
        incoming.unasked = matches!(self.kind, PairKind::Roughness(_));
        if self.value.is_zero() || self.pdf <= 0.0 {
            return;
        }
        tracer.rng = self.rng.clone();
        tracer.radiance_along(&self.leaving.turned(self.w, self.pdf, self.brighter), incoming);
    }
}

/// A choice of at most [`MOST`], evenly spaced by weight.
struct Choice {
    /// Uniform, at first.
    next: f64,
    /// Of all weights.
    total: f64,
}

impl Choice {
    /// Whether the next one is taken, and how likely that was.
    fn takes(&mut self, weight: f64) -> Option<f64> {
        let chance = f64::min(MOST * weight / self.total, 1.0);
        self.next -= chance;
        if self.next >= 0.0 {
            return None;
        }
        self.next += 1.0;
        Some(chance)
    }
}

#[cfg(all(test, feature = "std"))]
mod tests {
    use super::*;

    #[test]
    fn choices_are_as_likely_as_they_say() {
        let mut rng = Rng::new(4, 0, 0);
        let many: Vec<f64> = (0..30).map(|i| 0.1 + f64::from(i % 7)).collect();
        for weights in [&[1.0][..], &[1.0, 100.0], &many] {
            let total = weights.iter().sum();
            // Sums of 1 / probability, and of 1 as if all were certain.
            let (mut fair, mut faulty) = (alloc::vec![0.0; weights.len()], 0.0);
            for _ in 0..20_000 {
                let mut choice = Choice { next: rng.next_f64(), total };
                let taken: Vec<_> = weights.iter().map(|w| choice.takes(*w)).collect();
                assert!(taken.iter().flatten().count() as f64 <= MOST);
                for (sum, chance) in fair.iter_mut().zip(&taken) {
                    *sum += chance.map_or(0.0, |c| 1.0 / c) / 20_000.0;
                }
                faulty += taken.iter().flatten().count() as f64 / 20_000.0;
            }
            assert!(fair.iter().all(|mean| (mean - 1.0).abs() < 0.2), "{fair:?}");
            let mean = fair.iter().sum::<f64>() / weights.len() as f64;
            assert!((mean - 1.0).abs() < 0.02, "{fair:?}");
            // Planted: the probabilities are forgotten.
            assert!(weights.len() == 1 || faulty < 0.6 * weights.len() as f64, "{faulty}");
        }
    }
}
