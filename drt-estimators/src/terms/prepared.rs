//! Everything sampling needs that does not depend on how many parameters there are.

use alloc::sync::Arc;
use alloc::vec::Vec;

use crate::derivative::contraction::Motion;
use crate::derivative::sensitivity::ActiveInputs;
use crate::derivative::velocity::Spatial;
use crate::discontinuities::speeds::speeds;
use crate::model::error::Error;
use crate::model::settings::{EstimatorKind, PathSampling, Settings};
use crate::sampling::bidirectional::EmissionSampler;
use crate::sampling::film::BATCHES;
use crate::terms::boundary_segments::{Boundary, Strategy};
use crate::terms::film_plane;
use crate::terms::flux::{Flux, GrazingFlux};
use crate::terms::interior::{AlongRays, Component, EdgeQueries};
use crate::terms::radiative::Radiative;
use crate::terms::splatting::{BoundarySource, Splatter};
use crate::terms::warped::Warped;
use crate::world::World;

/// A scene ready to be sampled for what is of interest.
pub(crate) struct Prepared {
    pub(crate) world: World,
    pub(crate) boundary: Boundary,
    pub(crate) flux: Option<Flux>,
    grazing: Option<GrazingFlux>,
    /// Set in the spatial form.
    pub(crate) radiative: Option<Radiative>,
    /// Set where rays turn with edges.
    pub(crate) warped: Option<Warped>,
    /// Where paths of light start, if there are any.
    pub(crate) emission: Option<EmissionSampler>,
    /// Splatted terms that can contribute.
    pub(crate) sources: Vec<BoundarySource>,
    /// Image points come in mirrored pairs.
    pub(crate) antithetic: bool,
    /// Rays in narrow lobes come in pairs, by the settings.
    lobe_pairs: bool,
    /// Boundary samples of each kind to each sample of a pixel, by the settings alone.
    pub(crate) boundary_ratio: f64,
    /// The part of that which edges seen from the camera take.
    pub(crate) primary_share: f64,
    /// Of the spatial form.
    queries: EdgeQueries,
}

impl Prepared {
    /// `motion` tells which edges move how fast, where that is known.
    pub(crate) fn new(
        world: World,
        active: &ActiveInputs,
        flux_shapes: &[usize],
        settings: &Settings,
        motion: Option<&Motion>,
    ) -> Result<Self, Error> {
        film_plane::check(&world, active, settings)?;
        match settings.estimator {
            EstimatorKind::Radiative if active.any() => {
                Self::spatial(world, active, settings, motion)
            }
            EstimatorKind::Warped if active.any() => Self::warped(world, active, settings),
            _ => Self::material(world, active, flux_shapes, settings),
        }
    }

    /// For the path-space estimator.
    fn material(
        world: World,
        active: &ActiveInputs,
        flux_shapes: &[usize],
        settings: &Settings,
    ) -> Result<Self, Error> {
        let moving = active.moves_geometry();
        let boundary = if moving { Boundary::new(&world, active)? } else { Boundary::default() };
        let flux = Flux::new(&world, flux_shapes, active);
        let mut sources = Vec::new();
        if moving {
            for strategy in [Strategy::Primary, Strategy::Direct, Strategy::Indirect] {
                if boundary.offers(&world, strategy) {
                    sources.push(BoundarySource::Edges(strategy));
                }
            }
            if world.camera.has_borders() {
                sources.push(BoundarySource::Borders);
            }
        }
        let kinds = sources.len();
        let grazing = grazing_flux(&world, flux.as_ref(), active, &mut sources)?;
        let antithetic = mirrors(&world, active, settings);
        let emission = emission(&world, active, settings, &mut sources);
        Ok(Self {
            lobe_pairs: settings.antithetic && emission.is_none(),
            emission,
            boundary_ratio: boundary_ratio(settings, kinds),
            primary_share: 1.0,
            queries: EdgeQueries::default(),
            radiative: None,
            warped: None,
            world,
            boundary,
            flux,
            grazing,
            sources,
            antithetic,
        })
    }

    /// For the 2019 estimator.
    fn spatial(
        world: World,
        active: &ActiveInputs,
        settings: &Settings,
        motion: Option<&Motion>,
    ) -> Result<Self, Error> {
        let spatial = Arc::new(Spatial::new(&world, active));
        // Grids that move sweep over what stands still.
        let flux = (active.moves_geometry() || active.grids.contains(&true))
            .then(|| Flux::spatial(&world, active, &spatial))
            .flatten();
        let radiative = match motion {
            Some(motion) => Radiative::new(&world, active, spatial, speeds(motion, &world))?,
            None => Radiative::new(&world, active, spatial, |_| 1.0)?,
        };
        let mut sources = if radiative.has_primary_edges() {
            alloc::vec![BoundarySource::PrimaryEdges]
        } else {
            Vec::new()
        };
        let has_edges = radiative.has_edges(&world);
        let queries = has_edges && !settings.every_vertex;
        let boundary_ratio = boundary_ratio(settings, sources.len() + usize::from(queries));
        let grazing = grazing_flux(&world, flux.as_ref(), active, &mut sources)?;
        let queries = match settings.every_vertex {
            _ if !has_edges => EdgeQueries::default(),
            true => EdgeQueries::EveryVertex,
            false => EdgeQueries::Average(boundary_ratio),
        };
        Ok(Self {
            emission: None,
            boundary: Boundary::default(),
            radiative: Some(radiative),
            warped: None,
            antithetic: false,
            lobe_pairs: settings.antithetic,
            primary_share: 1.0,
            world,
            flux,
            grazing,
            sources,
            boundary_ratio,
            queries,
        })
    }

    /// For the 2023 estimator.
    fn warped(world: World, active: &ActiveInputs, settings: &Settings) -> Result<Self, Error> {
        let warped = Warped::new(&world, active, settings)?;
        let flux = warped
            .spatial
            .as_ref()
            .filter(|_| active.moves_geometry() || active.grids.contains(&true));
        let flux = flux.and_then(|spatial| Flux::spatial(&world, active, spatial));
        let mut sources = Vec::new();
        if warped.spatial.is_none() && active.moves_geometry() && world.camera.has_borders() {
            sources.push(BoundarySource::Borders);
        }
        if warped.on_borders.is_some() {
            sources.push(BoundarySource::PrimaryEdges);
        }
        let boundary_ratio = boundary_ratio(settings, sources.len());
        let emission = emission(&world, active, settings, &mut sources);
        Ok(Self {
            lobe_pairs: settings.antithetic && emission.is_none(),
            emission,
            boundary: Boundary::default(),
            radiative: None,
            warped: Some(warped),
            antithetic: mirrors(&world, active, settings),
            primary_share: 1.0,
            boundary_ratio,
            world,
            flux: flux.map(Flux::along_rays),
            grazing: None,
            sources,
            queries: EdgeQueries::default(),
        })
    }

    pub(crate) fn along_rays(&self) -> AlongRays<'_> {
        AlongRays {
            flux: self.flux.as_ref(),
            shadows: self.boundary.shadows.as_ref(),
            radiative: self.radiative.as_ref(),
            warped: self.warped.as_ref(),
            queries: self.queries,
            lobe_pairs: self.lobe_pairs,
        }
    }

    /// Changes how vertices move in the spatial form.
    #[cfg(all(test, feature = "std"))]
    pub(crate) fn change_spatial(&mut self, change: impl FnOnce(&mut Spatial)) {
        let radiative = self.radiative.as_mut().expect("the spatial form");
        change(Arc::make_mut(&mut radiative.spatial));
        if let Some(flux) = &mut self.flux {
            flux.spatial = Some(Arc::clone(&radiative.spatial));
        }
    }

    /// Its part in the derivatives of paths.
    pub(crate) fn component<S>(&self, sink: S) -> Component<'_, S> {
        Component { world: &self.world, along: self.along_rays(), sink }
    }

    /// `all` is the world lit by all emitters.
    pub(crate) fn splatter<'a>(&'a self, all: &'a World, seed: u64) -> Splatter<'a> {
        let on_borders = self.warped.as_ref().and_then(|warped| warped.on_borders.as_ref());
        let radiative = self.radiative.as_ref().or(on_borders);
        let (grazing, emission) = (self.grazing.as_ref(), self.emission.as_ref());
        let (world, boundary) = (&self.world, &self.boundary);
        let along = self.along_rays();
        let cancelled = &|| false;
        Splatter { world, all, along, boundary, radiative, grazing, emission, seed, cancelled }
    }

    /// Samples of a splatted source to each of a pixel, by the settings alone.
    pub(crate) fn source_ratio(&self, i: usize) -> f64 {
        let source = self.sources[i];
        if source == BoundarySource::LightPaths {
            return 1.0;
        }
        let part = if source.is_of_camera() { self.primary_share } else { 1.0 };
        self.boundary_ratio * part * source.part()
    }

    /// Samples of each batch of a splatted source that takes so many per pixel.
    pub(crate) fn samples_per_batch(&self, per_pixel: f64) -> u32 {
        let [w, h] = self.world.camera.film();
        let samples = per_pixel * f64::from(w) * f64::from(h);
        f64::max(samples / BATCHES as f64, 1.0) as u32
    }
}

/// Whether image points come in mirrored pairs. The filter's rate is what they cancel; without it they only cost.
fn mirrors(world: &World, active: &ActiveInputs, settings: &Settings) -> bool {
    settings.antithetic && active.moves_geometry() && world.camera.filter().is_continuous()
}

/// Where paths of light start, if there are any; those that the camera sees are one more source.
fn emission(
    world: &World,
    active: &ActiveInputs,
    settings: &Settings,
    sources: &mut Vec<BoundarySource>,
) -> Option<EmissionSampler> {
    let bidirectional = settings.sampling == PathSampling::Bidirectional && active.any();
    sources.extend(bidirectional.then_some(BoundarySource::LightPaths));
    bidirectional.then(|| EmissionSampler::new(world))
}

/// What the camera sees edge on of surfaces with a flux, as one more source.
fn grazing_flux(
    world: &World,
    flux: Option<&Flux>,
    active: &ActiveInputs,
    sources: &mut Vec<BoundarySource>,
) -> Result<Option<GrazingFlux>, Error> {
    let Some(flux) = flux else { return Ok(None) };
    let seen = GrazingFlux::new(world, flux, active)?;
    sources.extend(seen.is_some().then_some(BoundarySource::GrazingFlux));
    Ok(seen)
}

/// Samples of each of some kinds of boundary samples to each sample of a pixel.
fn boundary_ratio(settings: &Settings, kinds: usize) -> f64 {
    settings.boundary_ratio.unwrap_or(1.0) / kinds.max(1) as f64
}
