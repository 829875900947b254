use crate::model::sensor::{Response, Sensor, SensorError, finite};

/// The film that a lens is about, of which a sensor's own film may be a part. In pixels, which are fractions where
/// the number of pixels was changed.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Window {
    /// Where the sensor's film begins, from the whole one's top left corner.
    pub(super) offset: [f64; 2],
    /// Width and height of the whole film.
    pub(super) whole: [f64; 2],
}

impl Window {
    /// All of a film.
    pub(super) fn of(film: [u32; 2]) -> Self {
        Self { offset: [0.0; 2], whole: film.map(f64::from) }
    }

    /// The same part, with other pixels.
    pub(super) fn resized(&self, from: [u32; 2], to: [u32; 2]) -> Self {
        let scaled = |v: [f64; 2]| [0, 1].map(|k| v[k] * (f64::from(to[k]) / f64::from(from[k])));
        Self { offset: scaled(self.offset), whole: scaled(self.whole) }
    }
}

impl Sensor {
    /// The part of the film whose top left pixel has column and row `offset`, `size` pixels wide and high: as
    /// Mitsuba's `crop_offset_x`, `crop_width` and so on. Its pixels are those of the whole film.
    ///
    /// # Errors
    /// When it is empty or not inside the film, or the sensor is an irradiance meter, which has one pixel.
    pub fn cropped(&self, offset: [u32; 2], size: [u32; 2]) -> Result<Self, SensorError> {
        let fits = |k: usize| {
            size[k] > 0 && offset[k].checked_add(size[k]).is_some_and(|end| end <= self.film[k])
        };
        if !(fits(0) && fits(1)) || self.response == Response::Irradiance {
            return Err(SensorError::Crop { size, offset, film: self.film });
        }
        let Window { offset: before, whole } = self.window;
        let offset = [0, 1].map(|k| before[k] + f64::from(offset[k]));
        Self { film: size, ..self.clone() }.seen_in(Window { offset, whole })
    }

    /// The same sensor, its film being a part of a larger one.
    pub(super) fn seen_in(self, window: Window) -> Result<Self, SensorError> {
        let numbers = window.offset.iter().chain(&window.whole);
        finite(numbers.into_iter().all(|v| v.is_finite()), "crop window")?;
        let mut pinhole = self.pinhole;
        let parallel = self.response == Response::Orthographic;
        let size = self.lens.pixel_size(window.whole)?;
        let centre = window.whole.map(|n| 0.5 * n);
        let principal = if parallel { centre } else { self.lens.principal_point(window.whole) };
        pinhole.principal = [0, 1].map(|k| principal[k] - window.offset[k]);
        pinhole.pixel_size = match parallel {
            // Of an orthographic camera it is the width of the film that is given.
            true => pinhole.pixel_size * self.window.whole[0] / window.whole[0],
            false => size,
        };
        Ok(Self { pinhole, window, ..self })
    }
}
