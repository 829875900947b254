//! What a run will do and what it skips, decided once and printable.

use alloc::string::String;
use alloc::vec::Vec;
use core::fmt;

/// How a medium is tracked, and which velocity field its inside has.
#[derive(Clone, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct MediumPlan {
    /// The medium's name.
    pub medium: String,
    /// `closed form` or `delta tracking`; and the extinction below which derivatives by it are estimated by probes, points on
    /// rays of paths at which no path stops, where that is so.
    pub tracking: String,
    /// For each parameter that moves it, the parameter's name and the field: `affine`, `blend`, `tetrahedral`,
    /// `mean value` or `static`, followed by `with flux` where flux through surfaces is added.
    pub motion: Vec<(String, String)>,
}

/// What a session will run and what it skips.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Plan {
    /// The estimators of derivatives, and the light that each differentiates.
    pub estimators: Vec<String>,
    /// The estimator that was chosen and the reason, where the settings leave the choice open.
    pub estimator: Option<String>,
    /// Media that a path can enter.
    pub media: Vec<MediumPlan>,
    /// True when paths are recorded, to be differentiated.
    pub record: bool,
    /// Shapes that move with some parameter.
    pub moving_shapes: Vec<String>,
    /// Edges at which visibility can change, out of all edges.
    pub edges: [u64; 2],
    /// Boundary segments to the camera are sampled.
    pub primary: bool,
    /// Jumps of a box filter at pixel borders are sampled.
    pub borders: bool,
    /// Boundary segments to emitters are sampled.
    pub direct: bool,
    /// Boundary segments between scattering vertices are sampled.
    pub indirect: bool,
    /// Surfaces beside media whose inside does not follow them: the flux through these surfaces is sampled.
    pub flux_shapes: Vec<String>,
    /// Image points come in antithetic pairs, mirrored at the pixel's centre.
    pub antithetic: bool,
    /// Paths of the image count for every pixel whose filter they reach.
    pub splatting: bool,
    /// Paths of the image, and of the interior term, come from emitters, too.
    pub bidirectional: bool,
    /// The kind of paths that was chosen and the reason, where the settings leave the choice open.
    pub sampling: Option<String>,
    /// What guides of boundary samples have learnt, in words, one entry for each kind of boundary samples.
    pub guiding: Vec<String>,
    /// What is skipped, and why.
    pub skipped: Vec<String>,
}

impl Plan {
    /// Several estimators at once, each for some of the light.
    pub(crate) fn together<'a>(plans: impl Iterator<Item = &'a Self>) -> Self {
        plans.fold(Self::default(), |mut all, one| {
            for (own, other) in [
                (&mut all.record, one.record),
                (&mut all.primary, one.primary),
                (&mut all.borders, one.borders),
                (&mut all.direct, one.direct),
                (&mut all.indirect, one.indirect),
                (&mut all.antithetic, one.antithetic),
                (&mut all.splatting, one.splatting),
                (&mut all.bidirectional, one.bidirectional),
            ] {
                *own |= other;
            }
            fn unite<T: Clone + PartialEq>(all: &mut Vec<T>, one: &[T]) {
                for item in one {
                    if !all.contains(item) {
                        all.push(item.clone());
                    }
                }
            }
            unite(&mut all.media, &one.media);
            unite(&mut all.estimators, &one.estimators);
            unite(&mut all.moving_shapes, &one.moving_shapes);
            unite(&mut all.flux_shapes, &one.flux_shapes);
            unite(&mut all.skipped, &one.skipped);
            for (own, other) in all.edges.iter_mut().zip(one.edges) {
                *own = u64::max(*own, other);
            }
            all
        })
    }
}

impl fmt::Display for Plan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for e in &self.estimators {
            writeln!(f, "estimator: {e}")?;
        }
        for m in &self.media {
            writeln!(f, "medium {}: {}", m.medium, m.tracking)?;
            for (parameter, motion) in &m.motion {
                writeln!(f, "  inside moves with {parameter}: {motion}")?;
            }
        }
        let yes = |on: bool| if on { "yes" } else { "no" };
        let image = match self.splatting {
            true => "every path counts for all pixels that it reaches",
            false => "each pixel has paths of its own",
        };
        let ends = if self.bidirectional { ", from the camera and from emitters" } else { "" };
        writeln!(f, "image: {image}{ends}")?;
        for (what, choice) in [("sampling", &self.sampling), ("estimator", &self.estimator)] {
            if let Some(choice) = choice {
                writeln!(f, "choice of {what}: {choice}")?;
            }
        }
        writeln!(f, "path record: {}", yes(self.record))?;
        if self.record {
            let pairs = if self.antithetic { ", mirrored pairs" } else { "" };
            let paths = match self.bidirectional {
                true => "each pixel by paths of its own from both ends, and all by light paths",
                false => "each pixel by paths of its own",
            };
            writeln!(f, "interior term: yes, {paths}{pairs}")?;
        }
        if !self.moving_shapes.is_empty() {
            writeln!(f, "moving shapes: {}", self.moving_shapes.join(", "))?;
        }
        writeln!(f, "edges kept: {} of {}", self.edges[0], self.edges[1])?;
        for (name, on) in [
            ("camera boundary", self.primary),
            ("pixel borders", self.borders),
            ("emitter boundary", self.direct),
            ("indirect boundary", self.indirect),
        ] {
            writeln!(f, "{name}: {}", yes(on))?;
        }
        if !self.flux_shapes.is_empty() {
            writeln!(f, "flux through: {}", self.flux_shapes.join(", "))?;
        }
        for g in &self.guiding {
            writeln!(f, "guiding: {g}")?;
        }
        for s in &self.skipped {
            writeln!(f, "skipped: {s}")?;
        }
        Ok(())
    }
}
