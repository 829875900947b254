//! The few samples by which a part decides where the others go, and which are then forgotten.

use alloc::vec::Vec;

use super::{Part, Pixels, Round};
use crate::allocation::Allocation;
use crate::contraction::Motion;
use crate::film::{PixelFilm, SplatFilm};
use crate::split::{Observed, Split};

/// What a pilot found out.
pub(super) struct Guidance {
    /// Which pixels take more samples than others.
    pub(super) pixels: Allocation,
    /// How many boundary samples there are, where that was not said.
    pub(super) split: Option<Split>,
}

impl Part {
    /// Takes `units` samples of every pixel and finds out where noise is. False when it was cancelled.
    pub(super) fn fly_pilot(
        &mut self,
        round: &Round<'_>,
        units: u32,
        progress: impl Fn(f64),
    ) -> bool {
        let n = self.motion.as_ref().map_or(0, Motion::parameters);
        let along = self.prepared.along_rays();
        let mut film = PixelFilm::new(self.pixels.size(), along.layers(n, true));
        let (first_look, looks) = along.first_of_looks(n, film.layers());
        let pass = Pixels { seed: !self.settings.seed, separate: true };
        let (account, done) = self.fill(&mut film, pass, round, units, |_, _| {}, progress);
        let observed = self.settings.boundary_spp.is_none().then(|| {
            let samples = f64::from(units * self.per_unit());
            let looking = if first_look < film.layers() { account.looking } else { 0 };
            let rays = [account.counters.rays - looking, looking];
            let seen = Seen { film: &film, samples, parameters: n };
            [(1..first_look, rays[0], 1.0), (first_look..film.layers(), rays[1], looks)]
                .map(|(layers, rays, each)| seen.term(layers, rays, each))
        });
        self.account.add(account);
        let mut split = None;
        if let Some([paths, looks]) = observed.filter(|_| n > 0 && done == units) {
            let mut sources = Vec::new();
            for i in 0..self.prepared.sources.len() {
                let Some(seen) = self.see_source(i, round, units) else { return false };
                sources.push(seen);
            }
            split = Some(Split::new(&paths, &looks, &sources));
        }
        // Of one derivative, what is seen at edges counts by how many looks there will be.
        let per_look = split.as_ref().map_or(1.0, |split| looks / split.looks);
        let layers = film.layers();
        let counted = (1..=n).map(|p| {
            let weight = |l: usize| if l >= first_look { per_look } else { 1.0 };
            (p..layers).step_by(n).map(|l| (l, weight(l))).collect()
        });
        let image = (n == 0).then(|| alloc::vec![(0, 1.0)]);
        let pixels = Allocation::new(&film, image.into_iter().chain(counted));
        self.guidance = Some(Guidance { pixels, split });
        done == units
    }

    /// What a splatted source is worth; `None` when it was cancelled.
    fn see_source(&mut self, i: usize, round: &Round<'_>, units: u32) -> Option<Observed> {
        let size = self.pixels.size();
        let n = self.motion.as_ref().map_or(0, Motion::parameters);
        let mut film = SplatFilm::new(size, n);
        // Where no sample counts much more than others, few tell enough.
        let even = self.prepared.sources[i].is_even();
        let part = if even { 0.25 } else { 1.0 };
        let per_pixel = part * f64::from(units * self.per_unit()) * self.source_ratio(i);
        let seed = !self.settings.seed;
        let (account, going) = self.splat(&mut film, i, seed, per_pixel, round, |_| {});
        let samples = film.samples();
        let per_pixel = samples / (f64::from(size[0]) * f64::from(size[1]));
        let variance = (0..n).map(|p| per_pixel * film.variance(p)).collect();
        let rays = account.counters.rays as f64 / samples;
        self.account.add(account);
        going.then_some(Observed { variance, rays, even })
    }
}

/// What a pilot's pixels have seen.
struct Seen<'a> {
    film: &'a PixelFilm,
    /// Of each pixel.
    samples: f64,
    parameters: usize,
}

impl Seen<'_> {
    /// Of what is in some of the layers, took so many rays, and so many samples of `each` path.
    fn term(&self, layers: core::ops::Range<usize>, rays: u64, each: f64) -> Observed {
        let [w, h] = self.film.size();
        let mut variance = alloc::vec![0.0; self.parameters];
        for l in layers {
            let sum: f64 = (0..w * h).map(|i| self.film.variance(i, l)).sum();
            variance[(l - 1) % self.parameters] += each * self.samples * sum / f64::from(w * h);
        }
        let rays = rays as f64 / (each * self.samples * f64::from(w * h));
        Observed { variance, rays, even: false }
    }
}
