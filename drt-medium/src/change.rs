use drt_math::{Affine, Rgb, ValueChange, ValueMap};

use crate::homogeneous::Homogeneous;
use crate::{
    Grid, GridMedium, Medium, MediumError, MediumKind, Phase, Property, UniformMedium, Volume,
};

/// One way in which a medium depends on a parameter theta.
///
/// `sigma_t` is the extinction after the medium's scale and changes with the albedo held; the
/// albedo changes with `sigma_t` held. A change of a grid acts on all voxels alike, or on the one
/// voxel `[i, j, k]` (x fastest).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum MediumChange {
    /// Changes a property, in its units; entries of the matrix of SGGX are three channels in the order of their names.
    Value {
        /// The property that changes.
        property: Property,
        /// How.
        op: ValueChange,
        /// One voxel only.
        voxels: Option<[usize; 3]>,
    },
    /// Moves the grids of the medium, and turns its microflakes with them.
    Place {
        /// The map of the world at the parameter's value.
        map: Affine,
        /// Velocity of the moved grid per unit of theta at each point of the world.
        velocity: Affine,
    },
}

/// A change of one property of a medium.
#[derive(Clone, Copy)]
pub(crate) struct FieldChange {
    pub(crate) property: Property,
    pub(crate) op: ValueChange,
    pub(crate) voxel: Option<[usize; 3]>,
}

impl MediumChange {
    /// The property that this may take out of the range in which it has a meaning, where it is in it before: one that it
    /// adds to, or multiplies where the range has an upper end. See [`Medium::check`].
    #[must_use]
    pub fn pushes(&self, theta: f64) -> Option<Property> {
        let change = self.field()?;
        let ValueMap { factor, offset } = change.op.map(theta);
        let bounded = !matches!(change.property, Property::SigmaT | Property::Emission);
        let keeps = offset.is_zero() && (factor == 1.0 || factor >= 0.0 && !bounded);
        (!keeps).then_some(change.property)
    }

    pub(crate) fn field(&self) -> Option<FieldChange> {
        match *self {
            Self::Value { property, op, voxels } => {
                Some(FieldChange { property, op, voxel: voxels })
            }
            Self::Place { .. } => None,
        }
    }
}

impl Medium {
    /// Carries a change out at the parameter value theta.
    ///
    /// # Errors
    /// When the medium has no such property or voxel, or the result would not be finite.
    pub fn apply(&mut self, change: &MediumChange, theta: f64) -> Result<(), MediumError> {
        match change {
            MediumChange::Place { map, .. } => self.place(map),
            _ => match (change.field(), &mut self.kind) {
                (Some(c), _) if c.property.is_of_phase() => self.phase.change(&c, theta),
                (Some(c), MediumKind::Homogeneous(h)) => h.change(c, theta),
                (Some(_), MediumKind::Uniform(u)) if u.is_deformed() => Err(MediumError::Deformed),
                (Some(c), MediumKind::Uniform(u)) => u.change(c, theta),
                (Some(c), MediumKind::Grid(g)) => g.change(c, theta),
                (_, MediumKind::Deformed(_)) => Err(MediumError::Deformed),
                (_, MediumKind::Custom(_)) => Err(MediumError::CustomField),
                (None, _) => Ok(()),
            },
        }
    }
}

impl Medium {
    /// Adds to every value of a grid at once, as a step along a gradient does: one number per voxel
    /// and channel in the grid's order, in the units of the property (a density's scale is
    /// divided out).
    ///
    /// # Errors
    /// When the property has no grid, or the numbers do not fit it or are not finite.
    pub fn add_to_voxels(&mut self, property: Property, step: &[f64]) -> Result<(), MediumError> {
        let mut scale = 1.0;
        let grid = match (&mut self.kind, property) {
            (_, property) if property.is_of_phase() => self.phase.voxels_mut(property),
            (MediumKind::Deformed(_), _) => return Err(MediumError::Deformed),
            (MediumKind::Uniform(u), _) if u.is_deformed() => return Err(MediumError::Deformed),
            (MediumKind::Grid(g), Property::SigmaT) => {
                scale = g.editable_scale();
                Some(&mut g.density)
            }
            (MediumKind::Grid(GridMedium { albedo: volume, .. }), Property::Albedo)
            | (MediumKind::Grid(GridMedium { emission: volume, .. }), Property::Emission)
            | (MediumKind::Uniform(UniformMedium { albedo: volume, .. }), Property::Albedo)
            | (MediumKind::Uniform(UniformMedium { emission: volume, .. }), Property::Emission) => {
                volume.grid_mut()
            }
            _ => None,
        };
        let grid = grid.ok_or(MediumError::NotAGrid { property })?;
        let values = grid.values();
        if step.len() != values.len() {
            return Err(MediumError::ValueCount {
                size: grid.size(),
                channels: grid.channels(),
                expected: values.len(),
                found: step.len(),
            });
        }
        let mut sums = values.iter().zip(step).map(|(v, s)| v + s / scale);
        if let Some(value) = sums.find(|v| !v.is_finite()) {
            return Err(MediumError::OutOfRange { property, value, expected: "finite" });
        }
        for (v, s) in grid.values_mut().iter_mut().zip(step) {
            *v += s / scale;
        }
        if let (MediumKind::Grid(medium), Property::SigmaT) = (&mut self.kind, property) {
            medium.update_bounds(None);
        }
        if let Phase::Sggx(flakes) = &mut self.phase {
            flakes.update();
        }
        Ok(())
    }
}

impl Phase {
    /// Refuses a change of what it does not have.
    pub(crate) fn check_change(&self, c: &FieldChange) -> Result<(), MediumError> {
        let scalar = match (self, c.property) {
            (
                Self::Isotropic | Self::HenyeyGreenstein { .. } | Self::HenyeyGreensteinGrid(_),
                Property::G,
            )
            | (Self::Blend(_), Property::Weight) => true,
            (Self::Sggx(_), Property::SggxDiagonal | Property::SggxOffDiagonal) => false,
            (_, Property::Weight) => return Err(MediumError::NoWeight),
            (_, Property::SggxDiagonal | Property::SggxOffDiagonal) => {
                return Err(MediumError::NoSggx);
            }
            _ => return Err(MediumError::NoMeanCosine),
        };
        if c.op.is_scalar() || !scalar {
            Ok(())
        } else {
            Err(MediumError::NotScalar { property: c.property })
        }
    }

    fn change(&mut self, c: &FieldChange, theta: f64) -> Result<(), MediumError> {
        self.check_change(c)?;
        let g = match self {
            Self::Blend(blend) => return c.of_volume(&mut blend.weight, theta),
            Self::Sggx(flakes) => {
                let [diagonal, off_diagonal] = &mut flakes.entries;
                let entries =
                    if c.property == Property::SggxDiagonal { diagonal } else { off_diagonal };
                c.of_volume(entries, theta)?;
                flakes.update();
                return Ok(());
            }
            Self::HenyeyGreensteinGrid(g) => return c.of_grid(g, theta, 1.0),
            Self::HenyeyGreenstein { g } => *g,
            _ => 0.0,
        };
        *self = Self::HenyeyGreenstein { g: c.of_constant(Rgb::splat(g), theta)?.r };
        Ok(())
    }
}

impl Homogeneous {
    fn change(&mut self, c: FieldChange, theta: f64) -> Result<(), MediumError> {
        let c0 = &mut self.coefficients;
        let value = match c.property {
            Property::SigmaT => &mut c0.sigma_t,
            Property::Albedo => &mut c0.albedo,
            Property::Emission => &mut c0.emission,
            // Those of the phase function.
            _ => return Ok(()),
        };
        *value = c.of_constant(*value, theta)?;
        Ok(())
    }
}

impl UniformMedium {
    fn change(&mut self, c: FieldChange, theta: f64) -> Result<(), MediumError> {
        match c.property {
            Property::SigmaT => self.extinction.change(c, theta),
            Property::Albedo => c.of_volume(&mut self.albedo, theta),
            Property::Emission => c.of_volume(&mut self.emission, theta),
            _ => Ok(()),
        }
    }
}

impl GridMedium {
    fn change(&mut self, c: FieldChange, theta: f64) -> Result<(), MediumError> {
        let volume = match c.property {
            Property::SigmaT => return self.change_density(c, theta),
            Property::Albedo => &mut self.albedo,
            Property::Emission => &mut self.emission,
            _ => return Ok(()),
        };
        c.of_volume(volume, theta)
    }

    fn change_density(&mut self, c: FieldChange, theta: f64) -> Result<(), MediumError> {
        let ValueMap { factor, offset } = c.op.map(theta);
        if c.voxel.is_none() && offset.is_zero() && factor > 0.0 && c.op.is_scalar() {
            // The bounds are those of the unscaled grid, so they stay.
            self.scale = c.finite(self.scale * factor)?;
            return Ok(());
        }
        let scale = self.editable_scale();
        c.of_grid(&mut self.density, theta, scale)?;
        self.update_bounds(c.voxel);
        Ok(())
    }

    /// A scale that terms of the extinction can be divided by.
    fn editable_scale(&mut self) -> f64 {
        if self.scale == 0.0 {
            // Nothing is left of the values.
            self.density.values_mut().fill(0.0);
            self.scale = 1.0;
            self.update_bounds(None);
        }
        self.scale
    }
}

impl FieldChange {
    fn finite(&self, value: f64) -> Result<f64, MediumError> {
        if value.is_finite() {
            return Ok(value);
        }
        Err(MediumError::OutOfRange { property: self.property, value, expected: "finite" })
    }

    fn of_constant(&self, value: Rgb, theta: f64) -> Result<Rgb, MediumError> {
        if self.voxel.is_some() {
            return Err(MediumError::NotAGrid { property: self.property });
        }
        let changed = self.op.at(value, theta);
        changed.to_array().into_iter().try_for_each(|v| self.finite(v).map(drop))?;
        Ok(changed)
    }

    fn of_volume(&self, volume: &mut Volume, theta: f64) -> Result<(), MediumError> {
        match volume {
            Volume::Constant(v) => *v = self.of_constant(*v, theta)?,
            Volume::Grid(g) => self.of_grid(g, theta, 1.0)?,
        }
        Ok(())
    }

    /// Changes a grid whose values times `scale` are the property.
    fn of_grid(&self, grid: &mut Grid, theta: f64, scale: f64) -> Result<(), MediumError> {
        let size = grid.size();
        if let Some(voxel) = self.voxel.filter(|v| (0..3).any(|k| v[k] >= size[k])) {
            return Err(MediumError::NoSuchVoxel { property: self.property, voxel, size });
        }
        let ValueMap { factor, offset } = self.op.map(theta);
        let term = offset / scale;
        let voxels = match self.voxel.map(|v| grid.flatten(v)) {
            Some(n) => n..n + 1,
            None => 0..grid.values().len() / grid.channels(),
        };
        let values = |grid: &Grid| voxels.start * grid.channels()..voxels.end * grid.channels();
        let largest = grid.values()[values(grid)].iter().fold(0.0, |m, v| f64::max(m, v.abs()));
        self.finite(largest * factor.abs() + term.abs().sum())?;
        // Also at theta = 0: the derivative needs the channels that the value does not use yet.
        if !self.op.is_scalar() {
            grid.spread_channels();
        }
        let (range, channels) = (values(grid), grid.channels());
        let term = term.to_array();
        for voxel in grid.values_mut()[range].chunks_exact_mut(channels) {
            for (value, term) in voxel.iter_mut().zip(term) {
                *value = *value * factor + term;
            }
        }
        Ok(())
    }
}
