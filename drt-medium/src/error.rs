use alloc::boxed::Box;
use alloc::format;
use alloc::string::String;
use core::fmt;

/// The property of a medium that an error or a change is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Property {
    /// Extinction after the medium's scale.
    SigmaT,
    /// Single-scattering albedo.
    Albedo,
    /// Emitted radiance.
    Emission,
    /// Mean cosine of the phase function.
    G,
    /// Part of a blend of phase functions that the second one has.
    Weight,
    /// Entries Sxx, Syy and Szz of the matrix of the SGGX phase function.
    SggxDiagonal,
    /// Its entries Sxy, Sxz and Syz.
    SggxOffDiagonal,
}

impl Property {
    /// All of them.
    pub const ALL: [Self; 7] = [
        Self::SigmaT,
        Self::Albedo,
        Self::Emission,
        Self::G,
        Self::Weight,
        Self::SggxDiagonal,
        Self::SggxOffDiagonal,
    ];

    /// True of a property of the phase function.
    #[must_use]
    pub fn is_of_phase(self) -> bool {
        !matches!(self, Self::SigmaT | Self::Albedo | Self::Emission)
    }

    /// The property of a name, as jobs and messages call it.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|p| p.name() == name)
    }

    /// What it is called.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::SigmaT => "sigma_t",
            Self::Albedo => "albedo",
            Self::Emission => "emission",
            Self::G => "g",
            Self::Weight => "weight",
            Self::SggxDiagonal => "sggx_diagonal",
            Self::SggxOffDiagonal => "sggx_off_diagonal",
        }
    }
}

impl fmt::Display for Property {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Why a medium cannot be built or changed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MediumError {
    /// A grid's value count does not fit its size.
    #[error(
        "a grid of {}x{}x{} voxels with {channels} channels needs {expected} values, found {found}",
        size[0], size[1], size[2]
    )]
    ValueCount {
        /// Voxels along x, y, z.
        size: [usize; 3],
        /// Values per voxel.
        channels: usize,
        /// Values needed; `usize::MAX` when the product overflows.
        expected: usize,
        /// Values given.
        found: usize,
    },
    /// A grid has no voxels along an axis, or neither one nor three channels.
    #[error(
        "a grid needs at least one voxel per axis and 1 or 3 channels, found {}x{}x{} with {channels}",
        size[0], size[1], size[2]
    )]
    GridShape {
        /// Voxels along x, y, z.
        size: [usize; 3],
        /// Values per voxel.
        channels: usize,
    },
    /// A grid value is NaN or infinite.
    #[error("the grid value at voxel [{}, {}, {}], channel {channel}, is {value}; it must be finite",
        voxel[0], voxel[1], voxel[2])]
    NotFinite {
        /// Position in the grid.
        voxel: [usize; 3],
        /// Channel.
        channel: usize,
        /// The value found.
        value: f64,
    },
    /// A placement cannot be inverted.
    #[error(
        "the placement of a grid is singular or not finite; it must map the unit cube to a box of positive volume"
    )]
    SingularPlacement,
    /// A coefficient lies outside its physical range.
    #[error("{property} is {value}; it must be {expected}")]
    OutOfRange {
        /// The property.
        property: Property,
        /// The value found.
        value: f64,
        /// The range in words.
        expected: &'static str,
    },
    /// A number that makes no phase function.
    #[error("the phase function's {what} is {value}; it must be {expected}")]
    PhaseFunction {
        /// Which number.
        what: &'static str,
        /// The value found.
        value: f64,
        /// The range in words.
        expected: &'static str,
    },
    /// A voxel was addressed that the property does not have.
    #[error("voxel [{}, {}, {}] of {property} does not exist; the grid has {}x{}x{} voxels",
        voxel[0], voxel[1], voxel[2], size[0], size[1], size[2])]
    NoSuchVoxel {
        /// The property.
        property: Property,
        /// The voxel asked for.
        voxel: [usize; 3],
        /// Voxels along x, y, z.
        size: [usize; 3],
    },
    /// A voxel of a constant property was addressed.
    #[error("{property} of this medium is one constant; only a grid has voxels to change")]
    NotAGrid {
        /// The property.
        property: Property,
    },
    /// Three numbers were given for a scalar.
    #[error("{property} is one number, not a colour")]
    NotScalar {
        /// The property.
        property: Property,
    },
    /// The phase function has no such parameter.
    #[error("this phase function has no g; use Henyey-Greenstein")]
    NoMeanCosine,
    /// The phase function is no blend.
    #[error("this phase function has no weight; use a blend")]
    NoWeight,
    /// The phase function has no such parameter.
    #[error("this phase function has no matrix S; use SGGX")]
    NoSggx,
    /// A matrix makes no distribution of microflakes.
    #[error("the matrix S of SGGX{} with [Sxx, Syy, Szz] = {:?} and [Sxy, Sxz, Syz] = {:?} is not positive definite; it must be that, or zero",
        at_voxel(voxel), entries[0], entries[1])]
    SggxMatrix {
        /// Where it is; `None` where it is the same everywhere.
        voxel: Option<[usize; 3]>,
        /// Its entries on the diagonal, and off it.
        entries: Box<[[f64; 3]; 2]>,
    },
    /// The grids of the entries of S do not belong together.
    #[error(
        "the diagonal and the off-diagonal entries of SGGX must be grids of three channels that differ in values alone"
    )]
    SggxGrids,
    /// A blend of phase functions has SGGX in it.
    #[error(
        "SGGX cannot be a part of a blend: the extinction depends on the direction for it, and not for the other part"
    )]
    SggxInBlend,
    /// A motion that would change more of microflakes than their directions.
    #[error(
        "a medium with the phase function SGGX can be moved, turned, and scaled alike along all axes; a stretch or a deformation would change its flakes in a way that SGGX does not tell"
    )]
    SggxMotion,
    /// A deformed grid cannot be changed.
    #[error("the grid is deformed; place it, and change its values, before that")]
    Deformed,
    /// A field defined by its user has no parameters known here.
    #[error("a custom field cannot be changed or moved from outside; change it where it is made")]
    CustomField,
    /// The factor of a `multiply` change has reached zero, so the value it multiplied is lost.
    #[error(
        "{property} is multiplied by zero at this parameter value, where the derivative cannot be told from the product; use a logarithmic factor"
    )]
    VanishingFactor {
        /// The property.
        property: Property,
    },
}

fn at_voxel(voxel: &Option<[usize; 3]>) -> String {
    voxel.map_or_else(String::new, |[i, j, k]| format!(" at voxel [{i}, {j}, {k}]"))
}
