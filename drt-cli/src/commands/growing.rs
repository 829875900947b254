//! A picture that grows while it is rendered.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use drt_estimators::{Control, FinishedTile};
use drt_math::Rgb;

use super::monitor::Monitor;
use super::stop;
use crate::files::atomic::write_atomically;
use crate::files::image::picture::{SCREEN, encode_png};
use crate::{CliError, Tone};

/// How often the file is replaced.
const EVERY: Duration = Duration::from_secs(1);

/// Watches a run, as a [`Monitor`] does, and shows what is finished in a PNG file. The run itself is not changed by that.
pub(super) struct Growing<'a> {
    monitor: &'a Monitor,
    path: PathBuf,
    size: [u32; 2],
    tone: Tone,
    image: Mutex<Image>,
}

struct Image {
    pixels: Vec<Rgb>,
    shown: Instant,
}

impl<'a> Growing<'a> {
    /// Begins a picture of this size in place of the file.
    ///
    /// # Errors
    /// When it cannot be written.
    pub(super) fn begin(
        monitor: &'a Monitor,
        path: &Path,
        size: [u32; 2],
        tone: Tone,
    ) -> Result<Self, CliError> {
        // What is not finished has no light that exposure could be judged by; it is shown black.
        let pixels = vec![Rgb::splat(f64::NAN); size[0] as usize * size[1] as usize];
        let image = Mutex::new(Image { pixels, shown: Instant::now() });
        let growing = Self { monitor, path: path.into(), size, tone, image };
        growing.write(&growing.image.lock().unwrap_or_else(PoisonError::into_inner).pixels)?;
        Ok(growing)
    }

    fn write(&self, pixels: &[Rgb]) -> Result<(), CliError> {
        let _writing = stop::writing();
        let pixels = self.tone.shown(pixels);
        write_atomically(&self.path, |out| Ok(encode_png(out, self.size, &pixels, Some(SCREEN))?))
    }
}

impl Control for Growing<'_> {
    fn cancelled(&self) -> bool {
        self.monitor.cancelled()
    }

    fn progress(&self, done: f64) {
        self.monitor.progress(done);
    }

    fn tile(&self, tile: &FinishedTile<'_>) {
        let mut image = self.image.lock().unwrap_or_else(PoisonError::into_inner);
        let (first, end) = tile.pixels;
        let pixels = &mut image.pixels[first as usize..end as usize];
        pixels.iter_mut().zip(tile.image()).for_each(|(pixel, estimate)| *pixel = estimate.mean);
        if image.shown.elapsed() >= EVERY {
            // Where it fails, the picture at the end, which goes to the same place, is told to have failed.
            let _ = self.write(&image.pixels);
            image.shown = Instant::now();
        }
    }
}
