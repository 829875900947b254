//! The few samples by which a session decides where the others go, and which are then forgotten.

use alloc::vec::Vec;

use crate::run::component::seed_of_component;
use crate::run::session::Session;
use crate::run::session::images::Images;
use crate::run::session::pass::Pass;
use crate::sampling::allocation::Allocation;
use crate::sampling::budget::{SampleBudget, TermStatistics};
use crate::sampling::film::{PixelFilm, SplatFilm};

/// What a pilot found out.
pub(super) struct Pilot {
    /// Which pixels take more samples than others.
    pub(super) pixels: Allocation,
    /// How many boundary samples there are, where that was not said.
    pub(super) budget: Option<SampleBudget>,
}

impl Session {
    /// Takes `units` samples of every pixel and finds out where noise is. False when it was cancelled.
    pub(super) fn fly_pilot(
        &mut self,
        pass: &Pass<'_>,
        units: u32,
        progress: impl Fn(f64),
    ) -> bool {
        let n = self.parameters();
        let mut film = self.new_film(true);
        let (first_query, queries) = self.queries(film.layers());
        let seed = !self.settings.seed;
        let (account, done) = self.fill(&mut film, seed, true, pass, units, |_, _| {}, progress);
        let along = self.settings.boundary_ratio.is_none().then(|| {
            let samples = f64::from(units * self.per_unit());
            let of_queries = if first_query < film.layers() { account.query_rays } else { 0 };
            let rays = [account.counters.rays - of_queries, of_queries];
            let pixels = Pixels { film: &film, samples, parameters: n };
            [(1..first_query, rays[0], 1.0), (first_query..film.layers(), rays[1], queries)]
                .map(|(layers, rays, each)| pixels.statistics(layers, rays, each))
        });
        self.account.add(account);
        let mut budget = None;
        if let Some([paths, of_queries]) = along.filter(|_| n > 0 && done == units) {
            let mut sources = Vec::new();
            for (c, i) in self.sources() {
                let Some(measured) = self.measure(c, i, pass, units) else { return false };
                sources.push(measured);
            }
            budget = Some(SampleBudget::new(&paths, &of_queries, &sources));
        }
        // Of one derivative, the noise of edge queries counts by how many there will be.
        let per_query = budget.as_ref().map_or(1.0, |budget| queries / budget.queries);
        let layers = film.layers();
        let counted = (1..=n).map(|p| {
            let weight = |l: usize| if l >= first_query { per_query } else { 1.0 };
            (p..layers).step_by(n).map(|l| (l, weight(l))).collect()
        });
        let image = (n == 0).then(|| alloc::vec![(0, 1.0)]);
        let pixels = Allocation::new(&film, image.into_iter().chain(counted));
        self.pilot = Some(Pilot { pixels, budget });
        done == units
    }

    /// Of so many `layers`, with terms apart, the first one of edge queries; and how many each path takes. Queries
    /// from every vertex belong to their path, and have none.
    fn queries(&self, layers: usize) -> (usize, f64) {
        let average = |images: &Images| images.component.prepared.terms.queries.average();
        match self.images.iter().find_map(average) {
            // They are the last ones: those of two terms.
            Some(queries) => (layers - 2 * self.parameters(), queries),
            None => (layers, 1.0),
        }
    }

    /// Variance and cost of a source of boundary samples; `None` when it was cancelled.
    fn measure(
        &mut self,
        c: usize,
        i: usize,
        pass: &Pass<'_>,
        units: u32,
    ) -> Option<TermStatistics> {
        let (size, n) = (self.film.size(), self.parameters());
        let mut film = SplatFilm::new(size, n);
        // Where no sample counts much more than others, few tell enough.
        let even = self.images[c].component.sources()[i].is_even();
        let part = if even { 0.25 } else { 1.0 };
        let per_pixel = part * f64::from(units * self.per_unit()) * self.source_ratio(c, i);
        let seed = !seed_of_component(self.settings.seed, c);
        let (account, going) =
            self.images[c].sample_source(&mut film, i, seed, per_pixel, &self.world, pass, |_| {});
        let samples = film.samples();
        let per_pixel = samples / (f64::from(size[0]) * f64::from(size[1]));
        let variance = (0..n).map(|p| per_pixel * film.variance(p)).collect();
        let rays = account.counters.rays as f64 / samples;
        self.account.add(account);
        going.then_some(TermStatistics { variance, rays, even })
    }
}

/// The pixels of a pilot.
struct Pixels<'a> {
    film: &'a PixelFilm,
    /// Of each pixel.
    samples: f64,
    parameters: usize,
}

impl Pixels<'_> {
    /// Of the terms in some of the layers, which took so many rays, and so many samples of `each` path.
    fn statistics(&self, layers: core::ops::Range<usize>, rays: u64, each: f64) -> TermStatistics {
        let [w, h] = self.film.size();
        let mut variance = alloc::vec![0.0; self.parameters];
        for l in layers {
            let sum: f64 = (0..w * h).map(|i| self.film.variance(i, l)).sum();
            variance[(l - 1) % self.parameters] += each * self.samples * sum / f64::from(w * h);
        }
        let rays = rays as f64 / (each * self.samples * f64::from(w * h));
        TermStatistics { variance, rays, even: false }
    }
}
