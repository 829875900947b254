//! Which field moves the inside of a medium, parameter by parameter.

use alloc::vec::Vec;

use drt_math::Affine;

use super::sites::MovingSite;
use super::tetrahedra::Tetrahedralizer;
use super::{
    Blend, GivenTetrahedra, InteriorBasis, InteriorError, InteriorMotion, InteriorVelocity,
    Interpolation, Surroundings, TetrahedraCache,
};

/// How the inside of a medium moves with each parameter.
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
pub struct InteriorPlan {
    /// The parameters that move it, and how.
    pub velocities: Vec<(usize, InteriorVelocity)>,
    /// What these fields share; `None` where each is affine.
    pub basis: Option<InteriorBasis>,
    /// Parameters for which a flux through surfaces must be added, ascending.
    pub flux: Vec<usize>,
    /// The surfaces with a flux for some parameter, ascending.
    pub flux_surfaces: Vec<usize>,
    /// Why there are no tetrahedra, where they would have been chosen.
    pub instead_of: Option<InteriorError>,
}

impl Surroundings<'_> {
    /// Chooses the field of every parameter, or takes the kind that is asked for.
    ///
    /// # Errors
    /// When the kind that is asked for cannot be made.
    ///
    /// # Panics
    /// When a surface or point names a parameter that there is not, or a motion does not fit its mesh.
    pub fn plan(
        &self,
        asked: Option<&InteriorMotion>,
        cache: &mut TetrahedraCache,
    ) -> Result<InteriorPlan, InteriorError> {
        let planner = Planner { around: self, sites: self.sites(), asked };
        let mut plan = planner.plan(cache)?;
        plan.flux.sort_unstable();
        plan.flux.dedup();
        plan.flux_surfaces.sort_unstable();
        plan.flux_surfaces.dedup();
        Ok(plan)
    }

    /// The affine field of each parameter that moves anything around the medium; `None` when for one of
    /// them not everything moves by one.
    #[must_use]
    pub fn affine_fields(&self) -> Option<Vec<(usize, Affine)>> {
        let planner = Planner { around: self, sites: self.sites(), asked: None };
        let moving = (0..self.parameters).filter(|p| planner.moves(*p));
        moving.map(|p| Some((p, planner.one_affine_field(p)?))).collect()
    }
}

struct Planner<'a> {
    around: &'a Surroundings<'a>,
    sites: Vec<MovingSite>,
    asked: Option<&'a InteriorMotion>,
}

impl Planner<'_> {
    fn plan(&self, cache: &mut TetrahedraCache) -> Result<InteriorPlan, InteriorError> {
        let mut plan = InteriorPlan::default();
        let mut fielded = Vec::new();
        for p in (0..self.around.parameters).filter(|p| self.moves(*p)) {
            match (self.asked, self.one_affine_field(p)) {
                (Some(InteriorMotion::Affine), None) => {
                    return Err(InteriorError::NotAffine { parameter: p });
                }
                (None | Some(InteriorMotion::Affine), Some(field)) => {
                    plan.velocities.push((p, InteriorVelocity::Affine(field)));
                }
                (Some(InteriorMotion::Static), _) => self.add_flux(p, |_| true, &mut plan),
                (None, None) if !self.is_worth_a_field(p) => {
                    self.add_flux(p, |_| true, &mut plan);
                }
                _ => fielded.push(p),
            }
        }
        if fielded.is_empty() {
            return Ok(plan);
        }
        let basis = self.basis(&fielded, cache, &mut plan)?;
        for p in fielded {
            if let Some(velocity) = self.velocity(&basis, p, &mut plan)? {
                plan.velocities.push((p, velocity));
            }
        }
        plan.basis = Some(basis);
        Ok(plan)
    }

    /// The field of a parameter in a basis; `None` for one that rests.
    fn velocity(
        &self,
        basis: &InteriorBasis,
        p: usize,
        plan: &mut InteriorPlan,
    ) -> Result<Option<InteriorVelocity>, InteriorError> {
        Ok(Some(match basis {
            InteriorBasis::Blend(_) => {
                let surfaces = &self.around.surfaces;
                let is_left_out = |s: usize| surfaces[s].is_left_out(p);
                if (0..surfaces.len()).any(is_left_out) {
                    self.add_flux(p, is_left_out, plan);
                }
                let fields = self.sites.iter().map(|site| site.velocities[p]).enumerate();
                let fields: Vec<_> = fields.filter(|(_, v)| !v.is_zero()).collect();
                if fields.is_empty() {
                    return Ok(None);
                }
                InteriorVelocity::Blend(fields)
            }
            InteriorBasis::MeanValue(field) => {
                InteriorVelocity::MeanValue(field.velocities(self.around, p)?)
            }
            InteriorBasis::Tetrahedral(field) => {
                let given = self.given().map_or(Ok(None), |given| given.velocities(p))?;
                InteriorVelocity::Tetrahedral(given.unwrap_or_else(|| {
                    let (velocities, left) = self.around.vertex_velocities(field, p);
                    if !left.is_empty() {
                        plan.flux.push(p);
                        plan.flux_surfaces.extend(left);
                    }
                    velocities
                }))
            }
        }))
    }

    /// What the motions by some parameters share.
    fn basis(
        &self,
        parameters: &[usize],
        cache: &mut TetrahedraCache,
        plan: &mut InteriorPlan,
    ) -> Result<InteriorBasis, InteriorError> {
        let around = self.around;
        let mut tetrahedra = || match self.given() {
            Some(given) => around.given(&given.mesh).map(alloc::sync::Arc::new),
            None if self.asked == Some(&InteriorMotion::Tetgen) => {
                cache.get(around, Tetrahedralizer::Tetgen)
            }
            None => cache.get(around, Tetrahedralizer::Own),
        };
        let deforms = || {
            let by = |p: &usize| around.surfaces.iter().any(|s| s.deforms_by(*p));
            parameters.iter().any(by)
        };
        match self.asked {
            Some(InteriorMotion::Tetrahedral(_) | InteriorMotion::Tetgen) => {
                Ok(InteriorBasis::Tetrahedral(tetrahedra()?))
            }
            Some(InteriorMotion::MeanValue) => {
                Ok(InteriorBasis::MeanValue(Interpolation::new(around)?))
            }
            None if deforms() => match tetrahedra() {
                Ok(field) => Ok(InteriorBasis::Tetrahedral(field)),
                Err(e) => {
                    plan.instead_of = Some(e);
                    self.blend()
                }
            },
            _ => self.blend(),
        }
    }

    fn blend(&self) -> Result<InteriorBasis, InteriorError> {
        let sites = self.sites.iter().map(|site| site.site(self.around));
        Ok(InteriorBasis::Blend(Blend::new(sites.collect::<Result<_, _>>()?)))
    }

    /// Whether anything around the medium moves with a parameter.
    fn moves(&self, p: usize) -> bool {
        self.around.surfaces.iter().any(|s| s.motion(p).is_some())
            || self.sites.iter().any(|site| !site.velocities[p].is_zero())
    }

    /// The field that everything around moves by, if it is one.
    fn one_affine_field(&self, p: usize) -> Option<Affine> {
        let first = self.sites.iter().find(|site| site.point().is_none())?.velocities[p];
        // A point has one velocity, whatever the field is elsewhere.
        let agrees = |site: &MovingSite| match site.point() {
            Some(x) => site.velocities[p].point(x) == first.point(x),
            None => site.velocities[p] == first,
        };
        let whole = self.around.surfaces.iter().all(|s| !s.is_left_out(p));
        (whole && self.sites.iter().all(agrees)).then_some(first)
    }

    /// Whether the flux alone would be too noisy.
    fn is_worth_a_field(&self, p: usize) -> bool {
        let moves = |site: &MovingSite| !site.velocities[p].is_zero();
        self.around.multiple_scattering
            || self.sites.iter().any(|site| site.scatters && moves(site))
            || self.around.surfaces.iter().any(|s| s.scatters && s.is_left_out(p))
    }

    /// Leaves the inside at rest next to the surfaces that move and are chosen.
    fn add_flux(&self, p: usize, chosen: impl Fn(usize) -> bool, plan: &mut InteriorPlan) {
        plan.flux.push(p);
        let moving = |s: &usize| self.around.surfaces[*s].motion(p).is_some() && chosen(*s);
        plan.flux_surfaces.extend((0..self.around.surfaces.len()).filter(moving));
    }

    fn given(&self) -> Option<&GivenTetrahedra> {
        match self.asked {
            Some(InteriorMotion::Tetrahedral(given)) => given.as_deref(),
            _ => None,
        }
    }
}
