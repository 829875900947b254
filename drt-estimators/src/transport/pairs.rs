//! Rays beside those of a path, to which a rougher surface moves light.
//!
//! Let a path leave a rough surface along w, of density p, and C be what comes from there. As the roughness α grows,
//! the value f changes mainly as the density of microfacet normals does, by a f, where a is of the size of 1/α and of
//! mean zero: a f C / p has the noise of C many times over. But each direction has a
//! [counterpart](crate::surface::Counterpart) w', which gains what it loses. With the symbols of that, a f C / p is
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
//! Pairs of paths with derivatives of opposite sign are from Zhang et al. 2021, "Antithetic Sampling for Monte Carlo
//! Differentiable Rendering". Those are mirrored, which serves what is odd, as derivatives by place are; by roughness they
//! are even. Zeltner et al. 2021, "Monte Carlo Estimators for Differential Light Transport", sample the two signs apart;
//! here they are paired.
//!
//! What else of f changes with α, masking, is differentiated as it stands, and so is all of it where w has no
//! counterpart: then it is not one itself. So are connections to lights. Where scattering finds a light it is weighted
//! against connections as ever, C by the density of w and C' by that of w'.
//!
//! Nothing moves by this, so that edges have no part in it.

use alloc::vec::Vec;

use drt_math::{Rgb, Rng, Vec3};

use super::record::{Node, Radiance};
use super::trace::{Leaving, Tracer};
use super::world::World;
use crate::surface::Given;

/// Pairs that a path has at most, so that its cost does not grow with the square of its length; those of little weight are
/// followed as seldom.
const MOST: f64 = 8.0;

/// A ray beside that which leaves a node.
#[derive(Clone, Debug)]
pub(crate) struct Pair {
    pub(crate) node: usize,
    /// The path's ray.
    leaving: Leaving,
    wo: Vec3,
    /// The other one's direction.
    w: Vec3,
    /// s a.
    pub(crate) slope: f64,
    /// r f'.
    value: Rgb,
    /// How many times f that is, at least 1.
    brighter: f64,
    /// Of the difference.
    weight: f64,
    /// What the path's ray had next.
    rng: Rng,
}

/// The pairs of a path.
#[derive(Clone, Debug, Default)]
pub(crate) struct Pairs {
    list: Vec<Pair>,
    /// For choosing among them; without it there are none.
    rng: Option<Rng>,
}

impl Pairs {
    /// Forgets those of the last path. There are none of the next without random numbers to choose by.
    pub(crate) fn begin(&mut self, rng: Option<Rng>) {
        self.list.clear();
        self.rng = rng;
    }

    /// Adds that of a ray that leaves a node, if it has one. Returns a, of which it is then for the pair to tell.
    pub(crate) fn offer(
        &mut self,
        world: &World,
        node: &Node,
        leaving: &Leaving,
        rng: &Rng,
    ) -> Option<f64> {
        if self.rng.is_none() || !world.roughens(&leaving.vertex) {
            return None;
        }
        let arrival = node.arrival.as_ref()?;
        let scattering = world.scattering(&leaving.vertex)?;
        let wo = -arrival.dir;
        let other = scattering.counterpart(wo, leaving.dir)?;
        let value = scattering.eval(wo, other.w) * other.ratio;
        let slope = other.share * other.slope;
        let (own, others) = (node.value.max_abs(), value.max_abs());
        let brighter = if others > own && own > 0.0 { others / own } else { 1.0 };
        // Also by f', as the one direction may be seen where the other hardly is.
        let larger = f64::max(own, others);
        let weight = arrival.throughput.max_abs() * node.inv_pdf * slope.abs() * larger;
        self.list.push(Pair {
            node: leaving.node as usize,
            leaving: *leaving,
            wo,
            w: other.w,
            slope,
            value,
            brighter,
            weight,
            rng: rng.clone(),
        });
        Some(other.slope)
    }

    /// Follows most of the other rays: tells `found` pairs, their probabilities, and r f' C'.
    pub(crate) fn follow(&self, tracer: &mut Tracer<'_>, mut found: impl FnMut(&Pair, f64, Rgb)) {
        let Some(mut rng) = self.rng.clone().filter(|_| !self.list.is_empty()) else { return };
        let own = tracer.rng.clone();
        let total: f64 = self.list.iter().map(|pair| pair.weight).sum();
        let mut choice = Choice { next: rng.next_f64(), total };
        for pair in &self.list {
            if let Some(chance) = choice.takes(pair.weight) {
                found(pair, chance, pair.follow(tracer));
            }
        }
        tracer.rng = own;
    }
}

impl Pair {
    /// r f' C'.
    fn follow(&self, tracer: &mut Tracer<'_>) -> Rgb {
        let Some(scattering) = tracer.world.scattering(&self.leaving.vertex) else {
            return Rgb::ZERO;
        };
        let pdf = scattering.pdf(self.wo, self.w, Given::Wo);
        if self.value.is_zero() || pdf.is_nan() || pdf <= 0.0 {
            return Rgb::ZERO;
        }
        tracer.rng = self.rng.clone();
        let mut light = Radiance::default();
        tracer.radiance_along(&self.leaving.turned(self.w, pdf, self.brighter), &mut light);
        self.value * light.0
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
