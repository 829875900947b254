//! Rays beside those of a path, to which a rougher surface moves light.
//!
//! Let a path leave a rough surface along w, of density p, and C be what comes from there. As the roughness α grows,
//! the value f changes mostly as the density of microfacet normals does, by a f, where a is of the size of 1/α and
//! as often negative as positive: a f C / p has the noise of C many times over. But each direction has a
//! [counterpart](crate::surface::Counterpart) w', which gains what it loses, and with the symbols of that
//!
//! ```text
//! s a [f C - r f' C'] / p,
//! ```
//!
//! of the same mean, compares what comes from the two. C' is found by a path of its own, with the random numbers of the
//! first: in narrow lobes both see much the same, and their difference vanishes with α as 1/a does. (Pairs of paths with
//! derivatives of opposite sign: Zhang et al. 2021, "Antithetic Sampling for Monte Carlo Differentiable
//! Rendering". There the pair is mirrored, which serves what is odd, as derivatives by place are; by roughness they are
//! even. That the two signs be sampled apart is from Zeltner et al. 2021, "Monte Carlo Estimators for Differential Light
//! Transport".)
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

/// Pairs that a path has at most on average, so that its cost does not grow with the square of its length.
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
    ratio: f64,
    /// s a.
    pub(crate) slope: f64,
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

    pub(crate) fn is_empty(&self) -> bool {
        self.list.is_empty()
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
        let wo = -node.arrival.as_ref()?.dir;
        let other = world.scattering(&leaving.vertex)?.counterpart(wo, leaving.dir)?;
        self.list.push(Pair {
            node: leaving.node as usize,
            leaving: *leaving,
            wo,
            w: other.w,
            ratio: other.ratio,
            slope: other.share * other.slope,
            rng: rng.clone(),
        });
        Some(other.slope)
    }

    /// Follows most of the other rays: tells `found` pairs, their probabilities, and r f' C'.
    pub(crate) fn follow(
        &mut self,
        tracer: &mut Tracer<'_>,
        mut found: impl FnMut(&Pair, f64, Rgb),
    ) {
        let Some(rng) = &mut self.rng else { return };
        let own = tracer.rng.clone();
        let total: f64 = self.list.iter().map(Pair::weight).sum();
        // Evenly spaced by weight.
        let mut next = rng.next_f64();
        for pair in &self.list {
            let chance = f64::min(MOST * pair.weight() / total, 1.0);
            next -= chance;
            if next < 0.0 {
                next += 1.0;
                found(pair, chance, pair.follow(tracer));
            }
        }
        tracer.rng = own;
    }
}

impl Pair {
    /// What the difference is multiplied by.
    fn weight(&self) -> f64 {
        self.leaving.throughput.max_abs() * self.slope.abs()
    }

    /// r f' C'.
    fn follow(&self, tracer: &mut Tracer<'_>) -> Rgb {
        let Some(scattering) = tracer.world.scattering(&self.leaving.vertex) else {
            return Rgb::ZERO;
        };
        let value = scattering.eval(self.wo, self.w) * self.ratio;
        let pdf = scattering.pdf(self.wo, self.w, Given::Wo);
        if value.is_zero() || pdf.is_nan() || pdf <= 0.0 {
            return Rgb::ZERO;
        }
        tracer.rng = self.rng.clone();
        let mut light = Radiance::default();
        tracer.radiance_along(&self.leaving.turned(self.w, pdf), &mut light);
        value * light.0
    }
}
