//! Participating media and phase functions.

use drt_estimators::{Named, Surrounding};
use drt_math::Rgb;
use drt_medium::{
    Flakes, Grid, GridMedium, Homogeneous, Medium, MediumKind, Phase, PhaseBlend, PhaseTable, Sggx,
    UniformMedium, Volume,
};

use super::Loader;
use super::element::Element;
use super::numbers::numbers;
use super::parts::Parts;
use super::properties::Properties;
use super::volumes::{self, Field, Values};
use crate::CliError;

/// Extinction (before the medium's scale), albedo and emitted radiance.
struct Quantities {
    sigma_t: Field,
    albedo: Field,
    emission: Field,
}

impl<'a> Loader<'a> {
    pub(super) fn medium(&self, e: &'a Element) -> Result<Named<Medium>, CliError> {
        let p = Properties::of(e)?;
        let scale = p.float("scale")?.unwrap_or(1.0);
        let phase = match self.index.single(&p, "phase", None)? {
            Some(phase) => self.phase(phase.target)?,
            None => Phase::Isotropic,
        };
        let quantities = self.quantities(&p)?;
        // How distances and lights are sampled does not change expected values.
        p.accept(&["sample_emitters", "has_spectral_extinction", "strategy", "method"]);
        p.accept(&["sampling_weight", "medium_sampling_mode", "sigma_n"]);
        let kind = match p.kind()? {
            "homogeneous" => homogeneous(e, quantities, scale)?,
            "heterogeneous" => heterogeneous(e, quantities, scale)?,
            other => {
                return Err(e.error(format!(
                    "the medium type `{other}` is not supported; expected homogeneous or \
                     heterogeneous"
                )));
            }
        };
        p.finish()?;
        Ok(Named { id: e.id().map(Into::into), item: Medium::new(kind, phase) })
    }

    /// `sigma_t` and `albedo`, or `sigma_a` and `sigma_s`, with `emission`.
    fn quantities(&self, p: &Properties<'a>) -> Result<Quantities, CliError> {
        let e = p.element;
        if e.is_legacy()
            && let Some(preset) = p.property("material")
        {
            return Err(preset.error(
                "the coefficients of named materials are not part of this program; give `sigma_t` and `albedo`, or `sigma_a` and `sigma_s`",
            ));
        }
        let density = if e.is_legacy() { self.field(p, "density")? } else { None };
        let sigma_t = match (self.field(p, "sigma_t")?, density) {
            (Some(_), Some(_)) => return Err(e.error("give `density` or `sigma_t`, not both")),
            (sigma_t, density) => sigma_t.or(density),
        };
        let albedo = self.field(p, "albedo")?;
        let (sigma_a, sigma_s) = (self.field(p, "sigma_a")?, self.field(p, "sigma_s")?);
        let (sigma_t, albedo) = match (sigma_t, albedo, sigma_a, sigma_s) {
            (Some(sigma_t), Some(albedo), None, None) => (sigma_t, albedo),
            (None, None, Some(sigma_a), Some(sigma_s)) => sum(e, sigma_a, sigma_s)?,
            // Mitsuba 3 has defaults; 0.6 would take those of human skin, in millimetres.
            (sigma_t, albedo, None, None) if !e.is_legacy() => (
                sigma_t.unwrap_or_else(|| Field::constant(Rgb::ONE)),
                albedo.unwrap_or_else(|| Field::constant(Rgb::splat(0.75))),
            ),
            _ => {
                return Err(e.error(
                    "give `sigma_t` and `albedo`, or `sigma_a` and `sigma_s`, and no more",
                ));
            }
        };
        let emission = self.field(p, "emission")?.unwrap_or_else(|| Field::constant(Rgb::ZERO));
        Ok(Quantities { sigma_t, albedo, emission })
    }

    pub(super) fn phase(&self, e: &'a Element) -> Result<Phase, CliError> {
        self.phase_part(e, &Parts::new("phase functions"))
    }

    /// A phase function that is inside of one.
    fn phase_part(&self, e: &'a Element, parts: &Parts) -> Result<Phase, CliError> {
        parts.count(e)?;
        let p = Properties::of(e)?;
        let phase = match p.kind()? {
            "isotropic" => Phase::Isotropic,
            "rayleigh" => Phase::Rayleigh,
            "hg" => self.henyey_greenstein(&p)?,
            "blendphase" => self.blended_phase(&p, parts)?,
            "sggx" => self.microflakes(&p)?,
            "tabphase" => {
                let values = p.string("values")?.ok_or_else(|| e.error("`values` is missing"))?;
                let table = PhaseTable::new(numbers(e, values)?).map_err(|err| e.error(err))?;
                Phase::Tabulated(Box::new(table))
            }
            other => {
                return Err(e.error(format!(
                    "the phase function type `{other}` is not supported; expected isotropic, hg, \
                     rayleigh, blendphase, tabphase or sggx"
                )));
            }
        };
        p.finish()?;
        Ok(phase)
    }

    /// With one mean cosine, or with a volume of them.
    fn henyey_greenstein(&self, p: &Properties<'a>) -> Result<Phase, CliError> {
        let grid = match self.index.single(p, "volume", Some("g"))? {
            Some(volume) => match volumes::read(volume.target, Values::Any)?.volume {
                Volume::Grid(grid) => Some(grid),
                Volume::Constant(g) => {
                    return Phase::henyey_greenstein(g.r).map_err(|err| p.element.error(err));
                }
            },
            None => None,
        };
        let phase = match grid {
            Some(grid) => Phase::henyey_greenstein_grid(grid),
            None => Phase::henyey_greenstein(p.float("g")?.unwrap_or(0.8)),
        };
        phase.map_err(|err| p.element.error(err))
    }

    /// With a volume of matrices, which are the same everywhere where that has one voxel.
    fn microflakes(&self, p: &Properties<'a>) -> Result<Phase, CliError> {
        let e = p.element;
        let volume = self.index.single(p, "volume", Some("S"))?;
        let volume = volume.ok_or_else(|| e.error("the volume `S` is missing"))?.target;
        let [diagonal, off_diagonal] = volumes::read_matrices(volume)?;
        let field = if diagonal.size() == [1; 3] {
            let of = |grid: &Grid| grid.voxel([0; 3]).to_array().into();
            Sggx::new(Flakes { diagonal: of(&diagonal), off_diagonal: of(&off_diagonal) })
        } else {
            Sggx::varying(diagonal, off_diagonal)
        };
        Ok(Phase::Sggx(Box::new(field.map_err(|err| volume.error(err))?)))
    }

    /// Of the two inside, in the order of the file.
    fn blended_phase(&self, p: &Properties<'a>, parts: &Parts) -> Result<Phase, CliError> {
        let e = p.element;
        let weight = self.field(p, "weight")?.ok_or_else(|| e.error("`weight` is missing"))?;
        let inner = self.index.inner(p, "phase", None);
        let [a, b] = inner.as_slice() else {
            return Err(
                e.error(format!("expected two phase functions inside, found {}", inner.len()))
            );
        };
        let parts = [self.phase_part(a.target, parts)?, self.phase_part(b.target, parts)?];
        let blend = match weight.volume {
            Volume::Constant(weight) => PhaseBlend::new(weight.r, parts),
            Volume::Grid(weights) => PhaseBlend::varying(weights, parts),
        };
        Ok(Phase::Blend(Box::new(blend.map_err(|err| e.error(err))?)))
    }

    /// The medium stated for a camera or light: a reference, or one nested there.
    pub(super) fn surrounding(&self, p: &Properties<'a>) -> Result<Surrounding, CliError> {
        Ok(match self.index.single(p, "medium", None)? {
            Some(medium) => Surrounding::Stated(self.index.position(medium.target)),
            None => Surrounding::Counted,
        })
    }
}

/// Stands for a medium that is not used and cannot be read.
pub(super) fn vacuum(e: &Element) -> Result<Medium, CliError> {
    let nothing = Homogeneous::new(Rgb::ZERO, Rgb::ZERO, Rgb::ZERO).map_err(|err| e.error(err))?;
    Ok(Medium::new(nothing, Phase::Isotropic))
}

/// Extinction and albedo from absorption and scattering. The albedo of two grids would not be one
/// of trilinear values, so only constants can be added, and grids where the other is zero.
fn sum(e: &Element, sigma_a: Field, sigma_s: Field) -> Result<(Field, Field), CliError> {
    match (sigma_a.as_constant(), sigma_s.as_constant()) {
        (Some(a), Some(s)) => {
            let albedo = Field::constant(s.div_or_zero(a + s));
            Ok((Field { volume: Volume::Constant(a + s), ..sigma_s }, albedo))
        }
        (Some(a), None) if a.is_zero() => Ok((sigma_s, Field::constant(Rgb::ONE))),
        (None, Some(s)) if s.is_zero() => Ok((sigma_a, Field::constant(Rgb::ZERO))),
        _ => Err(e.error(
            "`sigma_a` and `sigma_s` as grids are not supported; give `sigma_t` and `albedo`",
        )),
    }
}

fn homogeneous(e: &Element, q: Quantities, scale: f64) -> Result<MediumKind, CliError> {
    let sigma_t = q.sigma_t.as_constant().ok_or_else(|| {
        e.error("`sigma_t` of a homogeneous medium must be one number or colour; `albedo` may vary")
    })?;
    let kind = match (q.albedo.as_constant(), q.emission.as_constant()) {
        (Some(albedo), Some(emission)) => {
            Homogeneous::new(sigma_t * scale, albedo, emission).map(MediumKind::from)
        }
        _ => UniformMedium::new(sigma_t * scale, q.albedo.volume, q.emission.volume)
            .map(MediumKind::from),
    };
    kind.map_err(|err| e.error(err))
}

/// A constant density fills the unit cube of its volume, as in Mitsuba.
fn heterogeneous(e: &Element, q: Quantities, scale: f64) -> Result<MediumKind, CliError> {
    let density = match q.sigma_t.volume {
        Volume::Grid(grid) => Ok(grid),
        Volume::Constant(c) => {
            Grid::constant(c).and_then(|g| g.with_placement(q.sigma_t.placement))
        }
    };
    let medium = density
        .and_then(|density| GridMedium::new(density, scale, q.albedo.volume, q.emission.volume))
        .map_err(|err| e.error(err))?;
    Ok(medium.into())
}
