//! Cameras: from pixels to rays, from points to pixels, and how both change when the camera moves.
//!
//! Axes: `right` and `up` span the image plane, `forward` looks into the scene; the image point of
//! x is a = (d·right)/(d·forward), b = (d·up)/(d·forward) with d = x - position, on the plane at
//! distance one. Pixel coordinates have their origin at the film's top left corner, x to the right
//! and y down, and pixel (i, j) covers [i, i+1) × [j, j+1). Orthographic cameras have a = d·right, b = d·up.
//!
//! Placements mean what they mean in Mitsuba: the camera looks along the local +z axis with +y up
//! and +x to the *left* of the image, so that `right` is minus the first axis of `to_world`.

mod aperture;
mod footprint;
mod lens;
mod motion;
mod orthographic;
mod pinhole;
mod response;
#[cfg(test)]
mod tests;
mod view;
mod viewpoint;
mod window;

use drt_math::{Affine, Mat3, Ray, Vec3, fm};
use thiserror::Error;

use crate::model::filter::{Filter, FilterError};

pub use crate::model::sensor::aperture::Aperture;
pub use crate::model::sensor::footprint::{Footprint, PixelWeight};
pub use crate::model::sensor::lens::{FovAxis, Lens};
pub use crate::model::sensor::pinhole::{Pinhole, Projection, SensorGradient, SensorTangent};
pub use crate::model::sensor::response::Response;
pub use crate::model::sensor::view::ViewSample;
pub(crate) use crate::model::sensor::viewpoint::Viewpoint;
use crate::model::sensor::window::Window;

/// A camera that cannot be used.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum SensorError {
    /// A field of view that is not that of a plane image.
    #[error("the field of view is {0} degrees; it must lie strictly between 0 and 180")]
    FieldOfView(f64),
    /// A film without pixels.
    #[error("the film is {}x{} pixels; both sides need at least one", .0[0], .0[1])]
    FilmSize([u32; 2]),
    /// A film of too many pixels.
    #[error("the film is {}x{} pixels; at most 268435456 in all", .0[0], .0[1])]
    TooManyPixels([u32; 2]),
    /// A part of a film that is not in it.
    #[error(
        "the crop window is {}x{} pixels at ({}, {}), which is not inside the film of {}x{} pixels",
        .size[0], .size[1], .offset[0], .offset[1], .film[0], .film[1]
    )]
    Crop {
        /// Its width and height.
        size: [u32; 2],
        /// Column and row of its top left pixel.
        offset: [u32; 2],
        /// Width and height of the film.
        film: [u32; 2],
    },
    /// A number of a lens that is not valid.
    #[error("`{what}` is {value}; expected a positive number")]
    Aperture {
        /// Which number.
        what: &'static str,
        /// Its value.
        value: f64,
    },
    /// A lens on a sensor that is not a perspective camera.
    #[error("only a perspective camera has a lens")]
    NoLens,
    /// Clip planes that leave nothing to see.
    #[error("the clip planes are at {near} and {far}; expected 0 < near < far")]
    Clip {
        /// Distance of the near plane along the forward axis.
        near: f64,
        /// Distance of the far plane.
        far: f64,
    },
    /// A placement that changes lengths or angles.
    #[error(
        "the camera's to_world scales or shears; only rotations, reflections and translations \
         keep a camera a camera"
    )]
    NotRigid,
    /// A film of an orthographic camera whose pixels are not square.
    #[error(
        "the orthographic camera's film is stretched along one axis or sheared; its pixels stay square \
         under rotations, reflections, translations and scales that are the same along all axes"
    )]
    Oblong,
    /// A property of a camera that has no properties.
    #[error(
        "an orthographic camera has no property to differentiate, and none named `{0}`; move or scale it"
    )]
    NoProperties(alloc::string::String),
    /// A motion that flattens the camera.
    #[error("the motion flattens the camera's axes; choose a value nearer to zero")]
    Flattened,
    /// A viewing direction that is zero.
    #[error("look_at: origin and target are the same point")]
    NoDirection,
    /// An upward direction that is zero or parallel to the viewing direction.
    #[error("look_at: `up` is zero or parallel to the viewing direction")]
    NoUp,
    /// A NaN or infinity.
    #[error("the camera's {0} is not finite")]
    NotFinite(&'static str),
    /// A property that cameras do not have.
    #[error(
        "a camera has no property `{0}` to differentiate; it has fov, principal_point_offset_x and \
         principal_point_offset_y, and where it has a lens aperture_radius and focus_distance"
    )]
    UnknownProperty(alloc::string::String),
    /// Different numbers for the channels of a property that is a single number.
    #[error("`{0}` is a single number; give three equal ones")]
    NotScalar(&'static str),
    /// The reconstruction filter is unusable.
    #[error(transparent)]
    Filter(#[from] FilterError),
}

/// A perspective or orthographic camera with its film, or an irradiance meter.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "Parts", into = "Parts"))]
pub struct Sensor {
    pinhole: Pinhole,
    lens: Lens,
    film: [u32; 2],
    window: Window,
    filter: Filter,
    response: Response,
    /// `None` for a pinhole.
    aperture: Option<Aperture>,
}

/// The camera-to-world map of a camera at `origin` that looks at `target`; its columns are left, up, forward, as in
/// Mitsuba's `lookat`.
///
/// # Errors
/// When the three vectors do not determine a viewing direction and an upward direction.
pub fn look_at(origin: Vec3, target: Vec3, up: Vec3) -> Result<Affine, SensorError> {
    for (v, what) in [(origin, "origin"), (target, "target"), (up, "up direction")] {
        finite(v.is_finite(), what)?;
    }
    let forward = unit(target - origin).ok_or(SensorError::NoDirection)?;
    // Parallel up to rounding leaves a cross product of rounding errors: no direction either.
    let left = unit(up)
        .map(|up| up.cross(forward))
        .filter(|l| l.length_squared() > 1e-24)
        .and_then(unit)
        .ok_or(SensorError::NoUp)?;
    let linear = Mat3 { cols: [left, forward.cross(left), forward] };
    Ok(Affine { linear, translation: origin })
}

impl Sensor {
    /// Most pixels of a film.
    pub const MAX_PIXELS: u64 = 1 << 28;

    /// Checks the width and height of a film.
    ///
    /// # Errors
    /// When a side is zero, or there are more than [`MAX_PIXELS`](Self::MAX_PIXELS).
    pub fn check_film(film: [u32; 2]) -> Result<(), SensorError> {
        if film.contains(&0) {
            return Err(SensorError::FilmSize(film));
        }
        if u64::from(film[0]) * u64::from(film[1]) > Self::MAX_PIXELS {
            return Err(SensorError::TooManyPixels(film));
        }
        Ok(())
    }

    /// A camera placed by a camera-to-world map, `film` pixels wide and high.
    ///
    /// Reflections are kept (they mirror the image). Deviations from orthonormal axes up to 10⁻³,
    /// as printed matrices have, are removed.
    ///
    /// # Errors
    /// Names what is not finite, empty, or not a camera.
    pub fn from_to_world(
        to_world: &Affine,
        lens: Lens,
        film: [u32; 2],
        filter: Filter,
    ) -> Result<Self, SensorError> {
        finite(to_world.is_finite(), "to_world")?;
        let m = to_world.linear;
        let gram = m.transpose() * m + Mat3::IDENTITY * -1.0;
        if gram.cols.iter().any(|c| c.max_abs() > 1e-3) {
            return Err(SensorError::NotRigid);
        }
        let [left, up, forward] = m.cols;
        let [right, up, forward] =
            motion::orthonormalize([-left, up, forward]).ok_or(SensorError::NotRigid)?;
        Self::check_film(film)?;
        let window = Window::of(film);
        let pixel_size = lens.pixel_size(window.whole)?;
        let principal = lens.principal_point(window.whole);
        let position = to_world.translation;
        let pinhole = Pinhole { position, right, up, forward, pixel_size, principal };
        let response = Response::Perspective;
        Ok(Self { pinhole, lens, film, window, filter, response, aperture: None })
    }

    /// A camera at `origin` that looks at `target`; see [`look_at`].
    ///
    /// # Errors
    /// As [`look_at`] and [`Sensor::from_to_world`].
    pub fn look_at(
        [origin, target, up]: [Vec3; 3],
        lens: Lens,
        film: [u32; 2],
        filter: Filter,
    ) -> Result<Self, SensorError> {
        Self::from_to_world(&look_at(origin, target, up)?, lens, film, filter)
    }

    /// This sensor with another number of pixels.
    ///
    /// # Errors
    /// When a side is zero, or there are more than [`MAX_PIXELS`](Self::MAX_PIXELS).
    pub fn with_film(&self, film: [u32; 2]) -> Result<Self, SensorError> {
        Self::check_film(film)?;
        self.with(self.lens, film, self.window.resized(self.film, film))
    }

    /// This sensor with another lens and film.
    fn with(&self, lens: Lens, film: [u32; 2], window: Window) -> Result<Self, SensorError> {
        let (to_world, filter, response) = (self.to_world(), self.filter.clone(), self.response);
        let (window, aperture) = (Some(window), self.aperture);
        Parts { to_world, lens, film, window, filter, response, aperture }.sensor()
    }

    /// This sensor with another filter.
    #[must_use]
    pub fn with_filter(self, filter: Filter) -> Self {
        Self { filter, ..self }
    }

    /// The camera-to-world map.
    #[must_use]
    pub fn to_world(&self) -> Affine {
        if self.is_orthographic() {
            return self.orthographic_to_world();
        }
        let Pinhole { position, right, up, forward, .. } = self.pinhole;
        Affine { linear: Mat3 { cols: [-right, up, forward] }, translation: position }
    }

    /// The centre of projection; for an orthographic camera, a point on its film.
    #[inline]
    #[must_use]
    pub fn position(&self) -> Vec3 {
        self.pinhole.position
    }

    /// Position, axes and image coordinates.
    #[must_use]
    pub fn pinhole(&self) -> &Pinhole {
        &self.pinhole
    }

    /// Field of view, principal point and clip planes.
    #[must_use]
    pub fn lens(&self) -> &Lens {
        &self.lens
    }

    /// Pixels per row, and rows.
    #[must_use]
    pub fn film(&self) -> [u32; 2] {
        self.film
    }

    /// The reconstruction filter.
    #[must_use]
    pub fn filter(&self) -> &Filter {
        &self.filter
    }

    /// The ray into the scene through an image point, in pixel coordinates, with unit direction; light flows against it. It ends at
    /// the far clip plane. It starts at the pinhole, and crosses the near plane after near / far of its length; that of an
    /// orthographic camera starts on the near plane.
    #[inline]
    #[must_use]
    pub fn ray(&self, pixel: [f64; 2]) -> Ray {
        if self.is_orthographic() {
            return self.parallel_ray(pixel);
        }
        let v = self.pinhole.view(pixel);
        let length = v.length();
        Ray::new(self.pinhole.position, v / length).until(self.lens.far * length)
    }

    /// Where the camera sees the point x, visibility apart; `None` beyond a clip plane.
    #[inline]
    #[must_use]
    pub fn project(&self, x: Vec3) -> Option<Projection> {
        let seen = self.view(x);
        let [near, far] = [self.lens.near, self.lens.far];
        // The film of an orthographic camera is in its near plane.
        let from = if self.is_orthographic() { near } else { 0.0 };
        let depth = seen.depth + from;
        (near <= depth && depth <= far).then_some(seen)
    }

    /// The pixels whose filters reach an image point.
    #[must_use]
    pub fn footprint(&self, pixel: [f64; 2]) -> Footprint<'_> {
        Footprint::new(&self.filter, self.film, pixel)
    }
}

/// What determines a sensor.
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Parts {
    to_world: Affine,
    lens: Lens,
    film: [u32; 2],
    /// `None` where the film is whole.
    #[cfg_attr(feature = "serde", serde(default))]
    window: Option<Window>,
    filter: Filter,
    response: Response,
    /// `None` for a pinhole.
    #[cfg_attr(feature = "serde", serde(default))]
    aperture: Option<Aperture>,
}

impl Parts {
    fn sensor(self) -> Result<Sensor, SensorError> {
        let Self { to_world, lens, film, window, filter, response, aperture } = self;
        let mut sensor = match response {
            Response::Orthographic => Sensor::orthographic(&to_world, lens, film, filter)?,
            _ => {
                let camera = Sensor::from_to_world(&to_world, lens, film, filter)?;
                Sensor { response, ..camera }
            }
        };
        if let Some(window) = window {
            sensor = sensor.seen_in(window)?;
        }
        match aperture {
            Some(aperture) => sensor.with_aperture(aperture),
            None => Ok(sensor),
        }
    }
}

#[cfg(feature = "serde")]
impl TryFrom<Parts> for Sensor {
    type Error = SensorError;
    fn try_from(p: Parts) -> Result<Self, SensorError> {
        p.sensor()
    }
}

#[cfg(feature = "serde")]
impl From<Sensor> for Parts {
    fn from(s: Sensor) -> Self {
        let (to_world, response) = (s.to_world(), s.response);
        let window = (s.window != Window::of(s.film)).then_some(s.window);
        Self {
            to_world,
            lens: s.lens,
            film: s.film,
            window,
            filter: s.filter,
            response,
            aperture: s.aperture,
        }
    }
}

fn finite(ok: bool, what: &'static str) -> Result<(), SensorError> {
    if ok { Ok(()) } else { Err(SensorError::NotFinite(what)) }
}

/// `None` for the zero vector. Scaled by the largest coordinate first, so that no length under- or
/// overflows.
fn unit(v: Vec3) -> Option<Vec3> {
    let size = v.max_abs();
    let v = v * (1.0 / size);
    (size > 0.0 && v.is_finite()).then(|| v * (1.0 / fm::sqrt(v.length_squared())))
}
