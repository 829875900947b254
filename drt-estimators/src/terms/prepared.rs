//! Everything sampling needs that does not depend on how many parameters there are.

#[cfg(all(test, feature = "std"))]
use alloc::sync::Arc;

#[cfg(all(test, feature = "std"))]
use crate::derivative::velocity::Spatial;
use crate::sampling::film::BATCHES;
use crate::terms::boundary_source::BoundarySource;
use crate::terms::interior::Component;
use crate::terms::level::Levels;
use crate::terms::selected::Terms;
use crate::terms::splatting::Splatter;
use crate::world::World;

/// A scene ready to be sampled for the terms of its derivatives.
pub(crate) struct Prepared {
    /// The name of the estimator.
    pub(crate) estimator: &'static str,
    /// Lit by what is differentiated.
    pub(crate) world: World,
    pub(crate) terms: Terms,
    /// The part of boundary samples that edges seen from the camera take of an equal one.
    pub(crate) primary_share: f64,
    /// What the motion of the camera's rays is taken relative to.
    pub(crate) levels: Levels,
}

impl Prepared {
    pub(crate) fn new(estimator: &'static str, world: World, terms: Terms) -> Self {
        Self { estimator, world, terms, primary_share: 1.0, levels: Levels::default() }
    }

    /// Changes how vertices move in the spatial form.
    #[cfg(all(test, feature = "std"))]
    pub(crate) fn change_spatial(&mut self, change: impl FnOnce(&mut Spatial)) {
        let Terms { velocity, edges, flux, .. } = &mut self.terms;
        let spatial = &mut edges.as_mut().expect("edges that vertices see").spatial;
        change(Arc::make_mut(spatial));
        *velocity = Arc::clone(spatial) as _;
        if let Some(flux) = flux {
            flux.spatial = Some(Arc::clone(spatial));
        }
    }

    /// Its part in the derivatives of paths.
    pub(crate) fn component<S>(&self, sink: S) -> Component<'_, S> {
        let Self { world, terms, levels, .. } = self;
        Component { world, terms, levels, queries: terms.queries, sink }
    }

    /// `all` is the world lit by all emitters.
    pub(crate) fn splatter<'a>(&'a self, all: &'a World, seed: u64) -> Splatter<'a> {
        let Self { world, terms, .. } = self;
        Splatter { world, all, terms, seed, cancelled: &|| false }
    }

    /// Samples of a splatted source to each of a pixel, by the settings alone.
    pub(crate) fn source_ratio(&self, i: usize) -> f64 {
        let source = self.terms.sources[i];
        if source == BoundarySource::LightPaths {
            return 1.0;
        }
        let part = if source.is_of_camera() { self.primary_share } else { 1.0 };
        self.terms.boundary_ratio * part * source.part()
    }

    /// Samples of each batch of a splatted source that takes so many per pixel.
    pub(crate) fn samples_per_batch(&self, per_pixel: f64) -> u32 {
        let [w, h] = self.world.camera.film();
        let samples = per_pixel * f64::from(w) * f64::from(h);
        f64::max(samples / BATCHES as f64, 1.0) as u32
    }
}
