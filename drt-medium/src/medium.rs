use alloc::sync::Arc;
use alloc::vec::Vec;
use core::ops::ControlFlow;

use drt_math::{Affine, Rgb, Rng, Vec3};

use crate::homogeneous::check;
use crate::tracking::zip;
use crate::{
    CoefficientGradients, Coefficients, Crossing, DeformedGrid, DensityField, DistanceSample, Grid,
    GridMedium, Homogeneous, LocalPhase, MediumError, Phase, PhaseGradient, Piece, Property, Ray,
    SpaceMap, TrackingStats, UniformMedium, Volume, tracking,
};

/// Where a medium gets its coefficients from.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum MediumKind {
    /// One set of coefficients everywhere.
    Homogeneous(Homogeneous),
    /// One extinction everywhere, and volumes for the rest.
    Uniform(UniformMedium),
    /// Voxels in a box.
    Grid(GridMedium),
    /// Voxels in a box that is bent out of shape. It is made from the other for as long as it has
    /// that shape, takes part in everything but changes of parameters, and is not serialised.
    #[cfg_attr(feature = "serde", serde(skip))]
    Deformed(DeformedGrid),
    /// A field of the user's own. It takes part in everything but changes of parameters, and is
    /// not serialised.
    #[cfg_attr(feature = "serde", serde(skip))]
    Custom(Arc<dyn DensityField>),
}

/// A participating medium: coefficients in space and a phase function.
///
/// Rays are given as `origin + t dir` with unit `dir` and `0 < t < t_max`, lengths in scene
/// units; `t_max` may be infinite. All sampling is detached: weights are to be used as numbers,
/// derivatives come from [`Medium::gradients`] and tangents.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Medium {
    /// The coefficients.
    pub kind: MediumKind,
    /// The distribution of scattered directions.
    pub phase: Phase,
}

impl From<Homogeneous> for MediumKind {
    fn from(h: Homogeneous) -> Self {
        Self::Homogeneous(h)
    }
}

impl From<UniformMedium> for MediumKind {
    fn from(u: UniformMedium) -> Self {
        Self::Uniform(u)
    }
}

impl From<GridMedium> for MediumKind {
    fn from(g: GridMedium) -> Self {
        Self::Grid(g)
    }
}

impl From<DeformedGrid> for MediumKind {
    fn from(d: DeformedGrid) -> Self {
        Self::Deformed(d)
    }
}

impl MediumKind {
    /// The extinction as a field that [`tracking`] can walk through.
    pub(crate) fn field(&self) -> &dyn DensityField {
        match self {
            Self::Homogeneous(h) => h,
            Self::Uniform(u) => &u.extinction,
            Self::Grid(g) => g,
            Self::Deformed(d) => d,
            Self::Custom(f) => &**f,
        }
    }
}

impl Medium {
    /// A medium from its parts.
    #[must_use]
    pub fn new(kind: impl Into<MediumKind>, phase: Phase) -> Self {
        Self { kind: kind.into(), phase }
    }

    /// Everything at a point. The extinction of microflakes, which depends on the direction, is that for a
    /// [projected area](Medium::projected_area) of one.
    #[inline]
    #[must_use]
    pub fn coefficients(&self, x: Vec3) -> Coefficients {
        match &self.kind {
            MediumKind::Homogeneous(h) => h.coefficients(),
            MediumKind::Uniform(u) => u.coefficients(x),
            MediumKind::Grid(g) => g.coefficients(x),
            MediumKind::Deformed(d) => d.coefficients(x),
            MediumKind::Custom(f) => f.coefficients(x),
        }
    }

    /// Refuses a property that [changes](Self::apply) have taken out of the range in which it has a meaning.
    ///
    /// # Errors
    /// Names the property, a value and the range.
    pub fn check(&self, property: Property) -> Result<(), MediumError> {
        if property.is_of_phase() {
            return self.phase.validate();
        }
        let coefficients = match &self.kind {
            MediumKind::Homogeneous(h) => h.coefficients(),
            MediumKind::Uniform(u) => return u.check_property(property),
            MediumKind::Grid(g) => return g.check_property(property),
            MediumKind::Deformed(d) => return d.grids().check_property(property),
            MediumKind::Custom(_) => return Ok(()),
        };
        match property {
            Property::SigmaT => check(property, coefficients.sigma_t),
            Property::Albedo => check(property, coefficients.albedo),
            Property::Emission => check(property, coefficients.emission),
            // Checked above.
            _ => Ok(()),
        }
    }

    /// The extinction at a point, in 1 / scene unit; that of the [coefficients](Medium::coefficients). See
    /// [`Medium::sigma_t_along`].
    #[inline]
    #[must_use]
    pub fn sigma_t(&self, x: Vec3) -> Rgb {
        match &self.kind {
            MediumKind::Homogeneous(h) => h.coefficients().sigma_t,
            MediumKind::Uniform(u) => u.sigma_t(),
            MediumKind::Grid(g) => g.sigma_t(x),
            MediumKind::Deformed(d) => d.sigma_t(x),
            MediumKind::Custom(f) => f.sigma_t(x),
        }
    }

    /// Spatial gradients at a point of the medium at rest. Jumps at the box of a grid are not in
    /// them.
    #[inline]
    #[must_use]
    pub fn gradients(&self, x: Vec3) -> CoefficientGradients {
        match &self.kind {
            MediumKind::Homogeneous(_) => CoefficientGradients::ZERO,
            MediumKind::Uniform(u) => u.gradients(x),
            MediumKind::Grid(g) => g.gradients(x),
            MediumKind::Deformed(d) => d.gradients(x),
            MediumKind::Custom(f) => f.gradients(x),
        }
    }

    /// The coefficients of a medium that is the same everywhere, with its phase function.
    #[inline]
    #[must_use]
    pub fn homogeneous(&self) -> Option<&Homogeneous> {
        match &self.kind {
            MediumKind::Homogeneous(h) => Some(h).filter(|_| !self.phase.varies()),
            _ => None,
        }
    }

    /// The phase function at a point of the world.
    #[inline]
    #[must_use]
    pub fn phase_at(&self, x: Vec3) -> LocalPhase<'_> {
        LocalPhase::new(&self.phase, self.phase_place(x))
    }

    /// The place where the phase function's grids are looked up for a point of the world.
    #[inline]
    pub(crate) fn phase_place(&self, x: Vec3) -> Vec3 {
        if !self.phase.varies() {
            return x;
        }
        match &self.kind {
            MediumKind::Uniform(u) => u.material(x).0,
            MediumKind::Deformed(d) => d.material(x).map_or(x, |(material, _)| material),
            MediumKind::Homogeneous(_) | MediumKind::Grid(_) | MediumKind::Custom(_) => x,
        }
    }

    /// Derivatives of the phase function's value at a point of the world, all with respect to the world; see
    /// [`LocalPhase::gradient`]. `here` is what [`Medium::phase_at`] gives there.
    #[must_use]
    pub fn phase_gradient(
        &self,
        x: Vec3,
        here: &LocalPhase<'_>,
        wo: Vec3,
        wi: Vec3,
    ) -> PhaseGradient {
        self.in_world(x, here.gradient(wo, wi))
    }

    /// Derivatives of the [projected area](LocalPhase::projected_area) of microflakes at a point of the world, all with
    /// respect to the world.
    #[must_use]
    pub fn area_gradient(&self, x: Vec3, w: Vec3) -> PhaseGradient {
        self.in_world(x, self.phase_at(x).area_gradient(w))
    }

    /// A gradient whose place is where grids are looked up, by the place in the world.
    pub(crate) fn in_world(&self, x: Vec3, mut gradient: PhaseGradient) -> PhaseGradient {
        if gradient.place != Vec3::ZERO {
            let slope = match &self.kind {
                MediumKind::Uniform(u) => Some(u.material(x).1),
                MediumKind::Deformed(d) => d.material(x).map(|(_, slope)| slope),
                MediumKind::Homogeneous(_) | MediumKind::Grid(_) | MediumKind::Custom(_) => None,
            };
            if let Some(slope) = slope {
                gradient.place = slope.transpose_mul(gradient.place);
            }
        }
        gradient
    }

    /// A homogeneous medium with this one's extinction, where that is the same everywhere and in all directions. Distances and
    /// transmittances of both are alike; its albedo and emission mean nothing.
    #[inline]
    #[must_use]
    pub fn extinction(&self) -> Option<&Homogeneous> {
        if self.phase.sggx().is_some() { None } else { self.even_extinction() }
    }

    /// A homogeneous medium with the extinction of this one's [coefficients](Self::coefficients), where that is the same
    /// everywhere: [`Medium::extinction`] but for microflakes.
    #[inline]
    #[must_use]
    pub fn even_extinction(&self) -> Option<&Homogeneous> {
        match &self.kind {
            MediumKind::Homogeneous(h) => Some(h),
            MediumKind::Uniform(u) => Some(&u.extinction),
            _ => None,
        }
    }

    /// The density grid of a medium that has one, with its other volumes; of a deformed one as they were placed
    /// before.
    #[inline]
    #[must_use]
    pub fn grid(&self) -> Option<&GridMedium> {
        match &self.kind {
            MediumKind::Grid(g) => Some(g),
            MediumKind::Deformed(d) => Some(d.grids()),
            MediumKind::Homogeneous(_) | MediumKind::Uniform(_) | MediumKind::Custom(_) => None,
        }
    }

    /// The grids and the place in them that a point of the world sees, inside of the density's box.
    #[inline]
    pub(crate) fn grid_at(&self, x: Vec3) -> Option<(&GridMedium, Vec3)> {
        match &self.kind {
            MediumKind::Grid(g) => g.contains(x).then_some((g, x)),
            MediumKind::Deformed(d) => d.material(x).map(|(material, _)| (d.grids(), material)),
            MediumKind::Homogeneous(_) | MediumKind::Uniform(_) | MediumKind::Custom(_) => None,
        }
    }

    /// True of a point of the world in the box of the medium's density grid.
    #[must_use]
    pub fn contains(&self, x: Vec3) -> bool {
        self.grid_at(x).is_some()
    }

    /// The voxels that give a property; `None` where it is the same everywhere, or the user's own.
    #[must_use]
    pub fn voxels(&self, property: Property) -> Option<&Grid> {
        let [sigma_t, albedo, emission] = self.volumes();
        match property {
            Property::SigmaT => sigma_t,
            Property::Albedo => albedo,
            Property::Emission => emission,
            _ => self.phase.voxels(property),
        }
    }

    /// What the values of these voxels are multiplied with to make the property: the scale of a density, or 1.
    #[must_use]
    pub fn voxel_scale(&self, property: Property) -> f64 {
        match (self.grid(), property) {
            (Some(grid), Property::SigmaT) => grid.scale(),
            _ => 1.0,
        }
    }

    /// True when a motion of the medium can change its coefficients or its phase function: when they vary in space or depend on
    /// more than angles.
    #[must_use]
    pub fn is_carried(&self) -> bool {
        let flakes = self.phase.sggx().is_some();
        self.volumes().iter().any(Option::is_some) || self.phase.varies() || flakes
    }

    /// Refuses velocities with which the medium cannot be carried, per unit of a parameter at each point of the world.
    ///
    /// # Errors
    /// When microflakes would not only turn.
    pub fn admits(&self, velocity: &Affine) -> Result<(), MediumError> {
        self.phase.sggx().map_or(Ok(()), |flakes| flakes.admits(velocity))
    }

    /// The part of the world that must move with a medium which is carried along: smallest and largest corner of
    /// the boxes of its grids, or of the density's alone where that has one.
    #[must_use]
    pub fn carried_bounds(&self) -> Option<[Vec3; 2]> {
        let [sigma_t, albedo, emission] = self.volumes();
        if let Some(density) = sigma_t {
            return Some(density.world_bounds());
        }
        let mut grids: Vec<&Grid> = [albedo, emission].into_iter().flatten().collect();
        self.phase.grids(&mut |grid| grids.push(grid));
        let bounds = grids.into_iter().map(Grid::world_bounds);
        bounds.reduce(|[a, b], [c, d]| [a.min(c), b.max(d)])
    }

    /// The grids of the extinction, the albedo and the emission, as far as they are grids; of what is deformed as
    /// they were placed before.
    pub(crate) fn volumes(&self) -> [Option<&Grid>; 3] {
        match &self.kind {
            MediumKind::Uniform(u) => u.volumes(),
            MediumKind::Grid(g) => g.volumes(),
            MediumKind::Deformed(d) => d.grids().volumes(),
            MediumKind::Homogeneous(_) | MediumKind::Custom(_) => [None; 3],
        }
    }

    /// These grids, and the place in them that a point of the world sees; `None` where there is nothing, and in
    /// custom fields.
    #[inline]
    pub(crate) fn volumes_at(&self, x: Vec3) -> Option<([Option<&Grid>; 3], Vec3)> {
        match &self.kind {
            MediumKind::Homogeneous(_) => Some(([None; 3], x)),
            MediumKind::Uniform(u) => Some((u.volumes(), u.material(x).0)),
            _ => self.grid_at(x).map(|(grids, material)| (grids.volumes(), material)),
        }
    }

    /// Calls `visit` with the places where a ray passes through the faces of a grid's box; see
    /// [`GridMedium::crossings`].
    #[inline]
    pub fn crossings(&self, ray: &Ray, mut visit: impl FnMut(&Crossing)) {
        let seen =
            |c: Crossing| Crossing { sigma_t: self.along(c.sigma_t, ray.at(c.t), ray.dir), ..c };
        match &self.kind {
            MediumKind::Grid(g) => g.crossings(ray).for_each(|c| visit(&seen(c))),
            MediumKind::Deformed(d) => d.crossings(ray).into_iter().for_each(|c| visit(&seen(c))),
            MediumKind::Homogeneous(_) | MediumKind::Uniform(_) | MediumKind::Custom(_) => {}
        }
    }

    /// False when no point of the medium emits. Custom fields are taken to emit. Looks at every
    /// voxel: a question for the preparation of a scene.
    #[must_use]
    pub fn is_emissive(&self) -> bool {
        match &self.kind {
            MediumKind::Homogeneous(h) => !h.coefficients().source().is_zero(),
            MediumKind::Uniform(u) => u.is_emissive(),
            MediumKind::Grid(g) => g.is_emissive(),
            MediumKind::Deformed(d) => d.grids().is_emissive(),
            MediumKind::Custom(_) => true,
        }
    }

    /// False when no point of the medium would scatter or emit light, whatever its extinction. Custom fields are taken to. Looks
    /// at every voxel: a question for the preparation of a scene.
    #[must_use]
    pub fn would_send_light(&self) -> bool {
        let [albedo, emission] = match &self.kind {
            MediumKind::Homogeneous(h) => {
                let c = h.coefficients();
                return !(c.albedo.is_zero() && c.emission.is_zero());
            }
            MediumKind::Uniform(u) => return u.is_scattering() || u.is_emissive(),
            MediumKind::Grid(g) => [g.albedo(), g.emission()],
            MediumKind::Deformed(d) => [d.grids().albedo(), d.grids().emission()],
            MediumKind::Custom(_) => return true,
        };
        !(albedo.is_zero() && emission.is_zero())
    }

    /// False when no point of the medium scatters. Custom fields are taken to scatter. Looks at
    /// every voxel: a question for the preparation of a scene.
    #[must_use]
    pub fn is_scattering(&self) -> bool {
        match &self.kind {
            MediumKind::Homogeneous(h) => !h.coefficients().sigma_s().is_zero(),
            MediumKind::Uniform(u) => u.is_scattering(),
            MediumKind::Grid(g) => g.is_scattering(),
            MediumKind::Deformed(d) => d.grids().is_scattering(),
            MediumKind::Custom(_) => true,
        }
    }

    /// Samples a distance along a ray of unit direction; see [`tracking::sample_distance`] and [`Homogeneous::free_flight_pdf`]
    /// for the densities. `channels` are the nonnegative weights of the colour channels
    /// (throughput). `defensive` in [0, 1) is the share of events placed without regard to the
    /// present extinction, as derivatives with respect to it need; 0 is plain free flight.
    #[inline]
    pub fn sample_distance(
        &self,
        ray: &Ray,
        channels: Rgb,
        defensive: f64,
        rng: &mut Rng,
        stats: &mut TrackingStats,
    ) -> DistanceSample {
        if let Some(directed) = self.directed(ray.dir) {
            return match directed.even() {
                Some(h) => h.sample_distance(ray.t_max, channels, defensive, rng),
                None => tracking::sample_distance(&directed, ray, channels, defensive, rng, stats),
            };
        }
        match &self.kind {
            MediumKind::Homogeneous(h)
            | MediumKind::Uniform(UniformMedium { extinction: h, .. }) => {
                h.sample_distance(ray.t_max, channels, defensive, rng)
            }
            MediumKind::Grid(g) => {
                tracking::sample_distance(g, ray, channels, defensive, rng, stats)
            }
            MediumKind::Deformed(d) => {
                tracking::sample_distance(d, ray, channels, defensive, rng, stats)
            }
            MediumKind::Custom(f) => {
                tracking::sample_distance(&**f, ray, channels, defensive, rng, stats)
            }
        }
    }

    /// The density of [`Medium::sample_distance`] at the distance t: exact where the extinction is the
    /// same everywhere, otherwise the positive stand-in of [`tracking::approximate_pdf`] for weights of
    /// multiple importance sampling.
    #[must_use]
    pub fn free_flight_pdf(&self, ray: &Ray, t: f64, channels: Rgb, defensive: f64) -> f64 {
        if let Some(directed) = self.directed(ray.dir) {
            return match directed.even() {
                Some(h) => h.free_flight_pdf(t, ray.t_max, channels, defensive),
                None => tracking::approximate_pdf(&directed, ray, t, channels, defensive),
            };
        }
        match &self.kind {
            MediumKind::Homogeneous(h)
            | MediumKind::Uniform(UniformMedium { extinction: h, .. }) => {
                h.free_flight_pdf(t, ray.t_max, channels, defensive)
            }
            MediumKind::Grid(g) => tracking::approximate_pdf(g, ray, t, channels, defensive),
            MediumKind::Deformed(d) => tracking::approximate_pdf(d, ray, t, channels, defensive),
            MediumKind::Custom(f) => tracking::approximate_pdf(&**f, ray, t, channels, defensive),
        }
    }

    /// Transmittance of a ray of unit direction: exact where the extinction is the same everywhere, otherwise an
    /// unbiased estimate.
    #[inline]
    pub fn transmittance(&self, ray: &Ray, rng: &mut Rng, stats: &mut TrackingStats) -> Rgb {
        if let Some(directed) = self.directed(ray.dir) {
            return match directed.even() {
                Some(h) => h.transmittance(ray.t_max),
                None => tracking::transmittance(&directed, ray, rng, stats),
            };
        }
        match &self.kind {
            MediumKind::Homogeneous(h)
            | MediumKind::Uniform(UniformMedium { extinction: h, .. }) => {
                h.transmittance(ray.t_max)
            }
            MediumKind::Grid(g) => tracking::transmittance(g, ray, rng, stats),
            MediumKind::Deformed(d) => tracking::transmittance(d, ray, rng, stats),
            MediumKind::Custom(f) => tracking::transmittance(&**f, ray, rng, stats),
        }
    }

    /// Points and weights `(t, w)` on a ray of unit direction such that `sum w h(t)` estimates `∫_0^t_max h(t) dt` without
    /// bias for an h that vanishes where the medium's box is not; appended to `out`. A medium of one
    /// extinction, whose integrals have closed forms, adds none, and one without a box none to an infinite ray.
    pub fn line_points(&self, ray: &Ray, rng: &mut Rng, out: &mut Vec<(f64, f64)>) {
        match &self.kind {
            MediumKind::Homogeneous(_) | MediumKind::Uniform(_) => {
                if let Some(directed) = self.directed(ray.dir).filter(|_| ray.t_max.is_finite()) {
                    tracking::line_points(&directed, ray, rng, out);
                }
            }
            MediumKind::Grid(g) => tracking::line_points(g, ray, rng, out),
            MediumKind::Deformed(d) => tracking::line_points(d, ray, rng, out),
            MediumKind::Custom(f) => tracking::line_points(&**f, ray, rng, out),
        }
    }

    /// Shows stretches of a ray with the mean extinction on each, by which densities of sampling are steered, until
    /// `visit` breaks; see [`DensityField::means`].
    pub fn means(&self, ray: &Ray, visit: &mut dyn FnMut(&Piece) -> ControlFlow<()>) {
        match self.directed(ray.dir) {
            Some(directed) => directed.means(ray, visit),
            None => self.kind.field().means(ray, visit),
        }
    }

    /// An upper bound of the extinction along a ray.
    #[must_use]
    pub fn majorant(&self, ray: &Ray) -> Rgb {
        if let Some(h) = self.extinction() {
            return h.coefficients().sigma_t;
        }
        let mut bound = Rgb::ZERO;
        let visit = &mut |p: &Piece| {
            bound = zip(bound, p.majorant, f64::max);
            ControlFlow::Continue(())
        };
        match self.directed(ray.dir) {
            Some(directed) => directed.pieces(ray, visit),
            None => self.kind.field().pieces(ray, visit),
        }
        bound
    }

    /// Lets a map of space carry the grids from where they are placed. The rest has nothing that could
    /// be carried.
    ///
    /// # Errors
    /// For grids that are deformed already, for custom fields, and for microflakes.
    pub fn deform(&mut self, map: Arc<dyn SpaceMap>) -> Result<(), MediumError> {
        if self.phase.sggx().is_some() {
            return Err(MediumError::SggxMotion);
        }
        self.kind = match &mut self.kind {
            MediumKind::Uniform(u) => return u.deform(map),
            MediumKind::Grid(g) => MediumKind::Deformed(DeformedGrid::new(g.clone(), map)),
            MediumKind::Homogeneous(_) if !self.phase.varies() => return Ok(()),
            MediumKind::Homogeneous(h) => {
                let Coefficients { sigma_t, albedo, emission } = h.coefficients();
                let [albedo, emission] = [albedo, emission].map(Volume::Constant);
                let mut uniform = UniformMedium::new(sigma_t, albedo, emission)?;
                uniform.deform(map)?;
                uniform.into()
            }
            MediumKind::Deformed(_) => return Err(MediumError::Deformed),
            MediumKind::Custom(_) => return Err(MediumError::CustomField),
        };
        Ok(())
    }

    /// Moves the grids by a map of the world, with those of the phase function. A homogeneous medium has no others; surfaces
    /// bound it.
    ///
    /// # Errors
    /// When the map is singular, or [unfit](crate::Sggx::place) for microflakes, for deformed grids, and for custom fields, which
    /// nobody outside can move.
    pub fn place(&mut self, map: &Affine) -> Result<(), MediumError> {
        match &mut self.kind {
            MediumKind::Uniform(u) => u.place(map)?,
            MediumKind::Grid(g) => g.place(map)?,
            MediumKind::Homogeneous(_) => {}
            MediumKind::Deformed(_) => return Err(MediumError::Deformed),
            MediumKind::Custom(_) => return Err(MediumError::CustomField),
        }
        self.phase.place(map)
    }
}
