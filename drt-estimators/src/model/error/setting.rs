use thiserror::Error;

/// What is wrong with a setting.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum SettingError {
    /// A number that must be positive and finite.
    #[error("is {0}; expected a positive number")]
    NotPositive(f64),
    /// A sensor that does not exist.
    #[error("there is no sensor {index}; the scene has {count}")]
    NoSensor {
        /// The one asked for.
        index: usize,
        /// How many there are.
        count: usize,
    },
    /// A group of unknowns that does not exist.
    #[error("there is no group {index}; the fit has {count}")]
    NoGroup {
        /// The one asked for.
        index: usize,
        /// How many there are.
        count: usize,
    },
    /// A medium that does not exist.
    #[error("there is no medium {index}; the scene has {count}")]
    NoMedium {
        /// The one asked for.
        index: usize,
        /// How many there are.
        count: usize,
    },
    /// Finite differences where a session is asked for.
    #[error("finite differences have no session; call `finite_differences`")]
    NoSession,
    /// A list of pixels of the wrong length.
    #[error("has {found} pixels; expected {}x{}", .expected[0], .expected[1])]
    PixelCount {
        /// Its length.
        found: usize,
        /// Width and height.
        expected: [u32; 2],
    },
    /// An image of another size than the film.
    #[error(
        "has {}x{} pixels; the film of its sensor has {}x{}",
        .found[0], .found[1], .film[0], .film[1]
    )]
    FilmSize {
        /// Width and height of the image.
        found: [u32; 2],
        /// Width and height of the film.
        film: [u32; 2],
    },
    /// A [`Warp`](crate::Warp) by auxiliary samples where there are media.
    #[error(
        "auxiliary points and directions are for surfaces alone; here are media or index-matched interfaces"
    )]
    SurfacesOnly,
    /// A [`PathSampling`](crate::PathSampling) that the estimator of derivatives does not have.
    #[error(
        "bidirectional sampling is for images, and for derivatives by path-space, warped (with edges) and finite differences \
         alone"
    )]
    OtherKinds,
    /// Paths from both ends, where emitters are hidden from the camera.
    #[error(
        "bidirectional sampling has no hidden emitters: the integrator hides some; use unidirectional"
    )]
    HiddenEmitters,
    /// Paths from both ends, past a surface that light of points and directions goes straight through.
    #[error(
        "bidirectional sampling has no masks and thin panes: light goes straight through `{0}`; use unidirectional"
    )]
    Straight(alloc::string::String),
    /// Derivatives by paths from both ends, past a smooth surface.
    #[error(
        "bidirectional sampling has no derivatives past smooth surfaces, as `{0}` is; use unidirectional"
    )]
    Smooth(alloc::string::String),
    /// A [`Warp`](crate::Warp) by auxiliary samples, past a smooth surface.
    #[error("auxiliary points and directions are not for scenes with smooth surfaces")]
    SmoothSurfaces,
    /// A [`Warp`](crate::Warp) by auxiliary samples, where emitters are hidden from the camera.
    #[error("auxiliary points and directions do not know what `hide_emitters` hides")]
    HiddenFromWarp,
    /// A [`Warp`](crate::Warp) that the pixel filter does not allow.
    #[error("auxiliary directions need a pixel filter that does not jump: tent or gaussian")]
    JumpingFilter,
    /// A [`Warp`](crate::Warp) by auxiliary samples in the view of a lens.
    #[error("auxiliary points and directions are not for cameras with an aperture")]
    Aperture,
    /// A [`Warp`](crate::Warp) by auxiliary samples under an environment that differs by direction.
    #[error("auxiliary points and directions are not for environments of an image")]
    VaryingSky,
    /// No target to fit to.
    #[error("is missing: there is nothing to fit to")]
    NoTarget,
    /// Values that are not one per parameter.
    #[error("has {found} numbers; there are {parameters} parameters")]
    ValueCount {
        /// Numbers given.
        found: usize,
        /// Parameters.
        parameters: usize,
    },
    /// A pixel that is NaN or infinite.
    #[error("the pixel in column {column}, row {row} is not finite")]
    PixelNotFinite {
        /// From the left.
        column: u32,
        /// From the top.
        row: u32,
    },
    /// A mask's pixel that is negative or not finite.
    #[error("the pixel in column {column}, row {row} is {value}; expected 0 or more")]
    MaskPixel {
        /// From the left.
        column: u32,
        /// From the top.
        row: u32,
        /// What it holds.
        value: f64,
    },
    /// A negative pixel of a target where differences are relative.
    #[error("the pixel in column {column}, row {row} of the target is negative")]
    NegativePixel {
        /// From the left.
        column: u32,
        /// From the top.
        row: u32,
    },
    /// A mask of zeros.
    #[error("is zero everywhere, which leaves nothing to fit")]
    EmptyMask,
    /// A black target where differences are relative.
    #[error("has no meaning for a black target")]
    BlackTarget,
    /// An image that cannot be reduced by a factor.
    #[error("{}x{} pixels cannot be divided by {factor}", .size[0], .size[1])]
    Indivisible {
        /// Width and height.
        size: [u32; 2],
        /// The factor.
        factor: u32,
    },
    /// Images that are not of the views of a fit.
    #[error("are not of the views and parameters of this fit")]
    ForeignHalves,
    /// Finite differences in shards.
    #[error("cannot be finite differences, which are not made in shards")]
    NoShards,
    /// More shards than strata of samples.
    #[error(
        "is one of {count}; so few samples have at most {most} strata, and a shard takes whole ones"
    )]
    TooManyShards {
        /// Shards asked for.
        count: u32,
        /// Strata.
        most: u32,
    },
    /// A pyramid without levels.
    #[error("has 0 levels; expected at least 1")]
    NoLevels,
    /// A weight that is not positive and finite.
    #[error("has weight {0}; expected a positive number")]
    Weight(f64),
}
