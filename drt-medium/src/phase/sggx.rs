use alloc::boxed::Box;

use drt_math::{Affine, Mat3, Rgb, Vec3, fm};

use super::flakes::{Flakes, FlakesGradient};
use crate::tracking::zip;
use crate::volume::Volume;
use crate::{Grid, MediumError};

/// A field of microflakes: the symmetric matrix S of the SGGX distribution at every point; see [`Flakes`].
///
/// S is given in the axes of the world, whatever the placement of its grids, as in Mitsuba. [Moving](Self::place) the field
/// turns the flakes with it, but changes neither their number nor their shapes; its values stay those before any motion.
/// A deformation of space takes the field along and does not turn flakes.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(into = "stored::Sggx", try_from = "stored::Sggx"))]
pub struct Sggx {
    /// Diagonal and off-diagonal entries.
    pub(crate) entries: [Volume; 2],
    /// How far motions have turned the flakes.
    turn: Option<Mat3>,
    range: Range,
}

/// What the entries of S are in all voxels together.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Range {
    least: [Rgb; 2],
    largest: [Rgb; 2],
    /// The largest eigenvalue is at most this.
    norm: f64,
}

impl Sggx {
    /// A field with one S everywhere.
    ///
    /// # Errors
    /// When it is neither positive definite nor zero.
    pub fn new(s: Flakes) -> Result<Self, MediumError> {
        let constant = |v: Vec3| Volume::Constant(Rgb::from(v.to_array()));
        Self::with([constant(s.diagonal), constant(s.off_diagonal)])
    }

    /// An S that varies, by a grid of `[Sxx, Syy, Szz]` and one of `[Sxy, Sxz, Syz]`.
    ///
    /// # Errors
    /// When the grids have other than three channels, or differ in anything but values, or the S of a voxel is neither
    /// positive definite nor zero.
    pub fn varying(diagonal: Grid, off_diagonal: Grid) -> Result<Self, MediumError> {
        Self::with([Volume::Grid(diagonal), Volume::Grid(off_diagonal)])
    }

    fn with(entries: [Volume; 2]) -> Result<Self, MediumError> {
        let range = Range::of(&entries);
        let field = Self { entries, turn: None, range };
        field.validate().map(|()| field)
    }

    /// Refuses what makes no distribution of flakes.
    pub(crate) fn validate(&self) -> Result<(), MediumError> {
        let grids = match self.entries.each_ref().map(Volume::grid) {
            [Some(diagonal), Some(off_diagonal)] => [diagonal, off_diagonal],
            [None, None] => return valid(self.flakes(Vec3::ZERO), None),
            _ => return Err(MediumError::SggxGrids),
        };
        if grids.iter().any(|g| g.channels() != 3) || !grids[0].is_like(grids[1]) {
            return Err(MediumError::SggxGrids);
        }
        let [nx, ny, nz] = grids[0].size();
        let places = (0..nx * ny * nz).map(|n| crate::grid::unflatten([nx, ny, nz], n));
        for voxel in places {
            let [d, o] = grids.map(|g| Vec3::from(g.voxel(voxel).to_array()));
            valid(Flakes { diagonal: d, off_diagonal: o }, Some(voxel))?;
        }
        Ok(())
    }

    /// The diagonal entries, and those off the diagonal, as they were before any motion.
    #[must_use]
    pub fn entries(&self) -> &[Volume; 2] {
        &self.entries
    }

    /// True where S is not the same everywhere.
    #[must_use]
    pub fn varies(&self) -> bool {
        self.entries[0].grid().is_some()
    }

    /// S at a point of the space in which its grids are placed.
    #[inline]
    #[must_use]
    pub fn at(&self, x: Vec3) -> Flakes {
        match &self.turn {
            None => self.flakes(x),
            Some(turn) => self.flakes(x).turned(turn),
        }
    }

    /// The [projected area](Flakes::projected_area) at such a point for a unit direction.
    #[inline]
    pub(crate) fn area(&self, x: Vec3, w: Vec3) -> f64 {
        let w = self.turn.map_or(w, |turn| turn.transpose_mul(w));
        self.flakes(x).projected_area(w)
    }

    /// S as it was before any motion.
    #[inline]
    fn flakes(&self, x: Vec3) -> Flakes {
        let [d, o] = self.entries.each_ref().map(|v| Vec3::from(v.value(x).to_array()));
        Flakes { diagonal: d, off_diagonal: o }
    }

    /// A gradient by S at a point, as one by the values before any motion.
    pub(crate) fn by_values(&self, gradient: &FlakesGradient) -> [Rgb; 2] {
        let own = self.turn.map_or(*gradient, |turn| gradient.before(&turn));
        [own.diagonal, own.off_diagonal].map(|v| Rgb::from(v.to_array()))
    }

    /// The gradient by the place, in the space of the grids, of a number whose gradient by S is given.
    pub(crate) fn by_place(&self, x: Vec3, gradient: &FlakesGradient) -> Vec3 {
        if !self.varies() {
            return Vec3::ZERO;
        }
        let [by_d, by_o] = self.by_values(gradient);
        let [d, o] = self.entries.each_ref().map(|v| v.gradient(x));
        d.weighted(by_d) + o.weighted(by_o)
    }

    /// Least and largest projected area for a unit direction, and what it is roughly.
    pub(crate) fn area_range(&self, w: Vec3) -> AreaRange {
        let Range { least, largest, norm } = &self.range;
        let w = self.turn.map_or(w, |turn| turn.transpose_mul(w));
        let by = FlakesGradient::of_square(w, 1.0);
        let (mut low, mut high) = (0.0, 0.0);
        for (k, by) in [by.diagonal, by.off_diagonal].into_iter().enumerate() {
            let by = Rgb::from(by.to_array());
            let ends = [by * least[k], by * largest[k]];
            low += zip(ends[0], ends[1], f64::min).sum();
            high += zip(ends[0], ends[1], f64::max).sum();
        }
        /// What rounding may add.
        const ROUNDING: f64 = 1e-12;
        let (low, high) = (f64::max(low, 0.0), f64::min(high, *norm));
        AreaRange {
            least: fm::sqrt(low) * (1.0 - ROUNDING),
            largest: fm::sqrt(high) * (1.0 + ROUNDING),
            mean: fm::sqrt(0.5 * (low + high)),
        }
    }

    /// The edges of the box of its grids together, in scene units.
    pub(crate) fn extent(&self) -> Option<f64> {
        self.entries[0].grid().map(|g| g.world_extent().length())
    }

    /// A length over which it varies.
    pub(crate) fn feature_size(&self) -> f64 {
        self.entries[0].grid().map_or(f64::INFINITY, Grid::voxel_size)
    }

    /// Brings up to date what follows from the values.
    pub(crate) fn update(&mut self) {
        self.range = Range::of(&self.entries);
    }

    /// Moves the field by a map of the world, and turns the flakes with it.
    ///
    /// # Errors
    /// When the map is singular, or does more than move, turn, and scale alike along all axes.
    pub fn place(&mut self, map: &Affine) -> Result<(), MediumError> {
        let turn = rotation(&map.linear).ok_or(MediumError::SggxMotion)?;
        self.entries.iter_mut().try_for_each(|v| v.place(map))?;
        if turn != Mat3::IDENTITY {
            self.turn = Some(self.turn.map_or(turn, |before| turn * before));
        }
        Ok(())
    }

    /// Refuses velocities of the field that would do more than move, turn, and scale it alike along all axes.
    pub(crate) fn admits(&self, velocity: &Affine) -> Result<(), MediumError> {
        let [x, y, z] = velocity.linear.cols;
        let size = [x, y, z].iter().fold(0.0, |m, c| f64::max(m, c.max_abs()));
        let stretches = [x.x - y.y, x.x - z.z, x.y + y.x, x.z + z.x, y.z + z.y];
        let even = stretches.iter().all(|s| s.abs() <= ROUNDING * size);
        if even { Ok(()) } else { Err(MediumError::SggxMotion) }
    }
}

/// Bounds of the projected area along a direction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AreaRange {
    pub(crate) least: f64,
    pub(crate) largest: f64,
    pub(crate) mean: f64,
}

/// How far a map may be from a similarity, or a velocity from that of one, beside its size.
const ROUNDING: f64 = 1e-9;

/// The rotation in a similarity; `None` of other maps.
fn rotation(linear: &Mat3) -> Option<Mat3> {
    let det = linear.determinant();
    if *linear == Mat3::IDENTITY {
        return Some(Mat3::IDENTITY);
    }
    if !(det.is_finite() && det > 0.0) {
        return None;
    }
    let turn = *linear * (1.0 / fm::cbrt(det));
    let square = turn.transpose() * turn;
    let off = |k: usize| (square.cols[k] - Mat3::IDENTITY.cols[k]).max_abs() <= ROUNDING;
    (0..3).all(off).then_some(turn)
}

fn valid(flakes: Flakes, voxel: Option<[usize; 3]>) -> Result<(), MediumError> {
    if flakes.is_valid() {
        return Ok(());
    }
    let Flakes { diagonal, off_diagonal } = flakes;
    Err(MediumError::SggxMatrix {
        voxel,
        entries: Box::new([diagonal.to_array(), off_diagonal.to_array()]),
    })
}

impl Range {
    fn of(entries: &[Volume; 2]) -> Self {
        let mut range = Self {
            least: [Rgb::splat(f64::INFINITY); 2],
            largest: [Rgb::splat(f64::NEG_INFINITY); 2],
            norm: 0.0,
        };
        let mut add = |s: [Rgb; 2]| {
            for (k, v) in s.into_iter().enumerate() {
                range.least[k] = zip(range.least[k], v, f64::min);
                range.largest[k] = zip(range.largest[k], v, f64::max);
            }
            let squares = s[0].dot(s[0]) + 2.0 * s[1].dot(s[1]);
            range.norm = f64::max(range.norm, fm::sqrt(squares));
        };
        match entries {
            [Volume::Grid(d), Volume::Grid(o)] => {
                let colours = |g: &Grid| g.channels() == 3;
                if colours(d) && colours(o) {
                    let rgb = |v: &[f64]| Rgb::new(v[0], v[1], v[2]);
                    let pairs = d.values().chunks_exact(3).zip(o.values().chunks_exact(3));
                    pairs.for_each(|(d, o)| add([rgb(d), rgb(o)]));
                }
            }
            [d, o] => add([d.value(Vec3::ZERO), o.value(Vec3::ZERO)]),
        }
        range
    }
}

#[cfg(feature = "serde")]
mod stored {
    use drt_math::Mat3;

    use super::{MediumError, Volume};

    /// What a file holds of a field of microflakes; its range follows.
    #[derive(serde::Serialize, serde::Deserialize)]
    pub(super) struct Sggx {
        entries: [Volume; 2],
        turn: Option<Mat3>,
    }

    impl From<super::Sggx> for Sggx {
        fn from(field: super::Sggx) -> Self {
            Self { entries: field.entries, turn: field.turn }
        }
    }

    impl TryFrom<Sggx> for super::Sggx {
        type Error = MediumError;
        fn try_from(stored: Sggx) -> Result<Self, MediumError> {
            Ok(Self { turn: stored.turn, ..Self::with(stored.entries)? })
        }
    }
}
