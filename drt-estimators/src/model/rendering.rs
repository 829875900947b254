//! What an estimator returns: images with standard errors, and an account of the work done.

use alloc::string::String;
use alloc::vec::Vec;

use drt_math::{Real, Rgb};

use crate::model::plan::Plan;

/// Cells of the grid of block means along each image side.
pub const BLOCKS: usize = 8;

/// A number per channel with its standard error.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Estimate {
    /// The mean.
    pub mean: Rgb,
    /// The standard error of that mean.
    pub stderr: Rgb,
}

impl Estimate {
    /// The sum with an independent estimate.
    #[must_use]
    pub fn plus(&self, o: &Self) -> Self {
        let variance = self.stderr * self.stderr + o.stderr * o.stderr;
        Self { mean: self.mean + o.mean, stderr: variance.map(Real::sqrt) }
    }
}

/// An image with the standard error of each pixel, and of its 8×8 block means and total mean
/// (correlations between pixels are in them).
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Layer {
    /// Columns and rows.
    pub size: [u32; 2],
    /// Row by row from the top left.
    pub pixels: Vec<Estimate>,
    /// Means over cells of the image, row by row; cell k of n pixels runs from floor(k·n/8) to
    /// floor((k+1)·n/8).
    pub blocks: Vec<Estimate>,
    /// Mean over all pixels.
    pub total: Estimate,
    /// How much of the second moment of that mean single samples are.
    pub tail: Tail,
}

/// The second moment of a mean, and the share that its largest sample has in it.
///
/// Standard errors are estimated from the samples themselves, and are valid only where the second moment is finite and
/// has converged. Where the distribution of samples has a power-law tail, as 1 / distance has where surfaces slide
/// along each other, the largest sample keeps a sizeable share however many samples there are, and the true error may
/// be larger than the estimated one.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Tail {
    /// The sum over samples of the square of what each adds to the mean over all pixels.
    pub second_moment: Rgb,
    /// The largest of these squares.
    pub largest: Rgb,
}

impl Tail {
    /// The share of the largest sample from which on an estimated standard error is not to be trusted.
    pub const HEAVY: f64 = 0.1;

    /// The largest sample's share of the second moment, from 0 to 1, in the channel where it is largest.
    #[must_use]
    pub fn share(&self) -> f64 {
        let pairs = self.largest.to_array().into_iter().zip(self.second_moment.to_array());
        pairs.fold(
            0.0,
            |share, (largest, all)| {
                if all > 0.0 { f64::max(share, largest / all) } else { share }
            },
        )
    }

    /// The tail of the sum of two independent estimates.
    #[must_use]
    pub fn plus(&self, o: &Self) -> Self {
        Self {
            second_moment: self.second_moment + o.second_moment,
            largest: self.largest.max(o.largest),
        }
    }
}

/// The summands of a derivative image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Term {
    /// The interior term: differentiated contributions along paths.
    Interior,
    /// Visibility from the camera, and jumps of the pixel filter.
    Primary,
    /// Visibility between an emitter and the first vertex it lights; in
    /// [`EstimatorKind::Radiative`](crate::EstimatorKind::Radiative), edges that the first scattering vertex sees.
    Direct,
    /// Visibility between scattering vertices; in [`EstimatorKind::Radiative`](crate::EstimatorKind::Radiative), edges
    /// that later vertices see.
    Indirect,
    /// Flux of scattering through moving surfaces that the inside of a medium does not follow.
    Flux,
    /// What the motion of edges adds along paths, in [`EstimatorKind::Warped`](crate::EstimatorKind::Warped).
    Warp,
}

impl Term {
    /// Every term, in the order they are stored.
    pub const ALL: [Self; 6] =
        [Self::Interior, Self::Primary, Self::Direct, Self::Indirect, Self::Flux, Self::Warp];

    /// The name used in layer names.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Interior => "interior",
            Self::Primary => "primary",
            Self::Direct => "direct",
            Self::Indirect => "indirect",
            Self::Flux => "flux",
            Self::Warp => "warp",
        }
    }
}

/// The derivative image of one parameter.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Derivative {
    /// The parameter's name.
    pub name: String,
    /// The derivative.
    pub total: Layer,
    /// Its terms, where they were asked for.
    pub terms: Vec<(Term, Layer)>,
}

/// Work done, for tests that assert what was skipped.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Counters {
    /// Camera paths traced.
    pub paths: u64,
    /// Rays cast.
    pub rays: u64,
    /// Path vertices of which a record was kept.
    pub recorded_vertices: u64,
    /// Path records differentiated.
    pub differentiated_paths: u64,
    /// Boundary segments sampled.
    pub boundary_samples: u64,
    /// Pixel borders sampled.
    pub border_samples: u64,
    /// Samples of pixel borders and boundary segments that pilots took to learn guides.
    pub guide_samples: u64,
    /// Points on moving surfaces sampled for the flux term.
    pub flux_samples: u64,
    /// Tentative collisions in heterogeneous media.
    pub tracking_steps: u64,
    /// Points on rays at which the extinctions of media were probed.
    pub probes: u64,
    /// Edges and shadows that turned rays, counted once for each ray that they turned.
    pub turning_edges: u64,
}

impl Counters {
    /// Adds another account.
    pub fn add(&mut self, o: &Self) {
        self.paths += o.paths;
        self.rays += o.rays;
        self.recorded_vertices += o.recorded_vertices;
        self.differentiated_paths += o.differentiated_paths;
        self.boundary_samples += o.boundary_samples;
        self.border_samples += o.border_samples;
        self.guide_samples += o.guide_samples;
        self.flux_samples += o.flux_samples;
        self.tracking_steps += o.tracking_steps;
        self.probes += o.probes;
        self.turning_edges += o.turning_edges;
    }
}

/// A contribution that was not a finite number, with the random numbers that reproduce it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct NonFinite {
    /// The term that it belongs to; `None` is the image itself.
    pub term: Option<Term>,
    /// Seed, stream and index of the random numbers.
    pub seed: u64,
    /// Stream of the random numbers.
    pub stream: u64,
    /// Index in the stream.
    pub index: u32,
    /// Vertices of the path.
    pub bounces: u32,
    /// Primitive of the last vertex, where it lay on one.
    pub primitive: Option<u32>,
}

/// What work leaves besides its images.
#[derive(Clone, Debug, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Account {
    pub(crate) counters: Counters,
    /// The first contributions that were not finite.
    pub(crate) non_finite: Vec<NonFinite>,
    pub(crate) non_finite_count: u64,
    /// Rays of edge queries.
    pub(crate) query_rays: u64,
}

impl Account {
    /// Non-finite contributions that are described one by one.
    const DESCRIBED: usize = 16;

    pub(crate) fn add(&mut self, o: Self) {
        self.counters.add(&o.counters);
        self.non_finite_count += o.non_finite_count;
        self.query_rays += o.query_rays;
        let room = Self::DESCRIBED.saturating_sub(self.non_finite.len());
        self.non_finite.extend(o.non_finite.into_iter().take(room));
    }
}

/// The results of a finished (or cancelled) session.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Rendering {
    /// The image.
    pub image: Layer,
    /// One derivative image per parameter.
    pub derivatives: Vec<Derivative>,
    /// What was run and what was skipped.
    pub plan: Plan,
    /// Work done.
    pub counters: Counters,
    /// Number of contributions that were not finite; they count as zero in the images.
    pub non_finite: u64,
    /// The first of them.
    pub non_finite_examples: Vec<NonFinite>,
    /// Samples per pixel finished.
    pub spp: u32,
    /// False when the session was cancelled; the images then have the samples that were finished.
    pub complete: bool,
}
