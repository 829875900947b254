//! How a caller watches and steers a run.

use crate::model::rendering::Estimate;
use crate::sampling::film::PixelFilm;

/// Watches and steers a run. Every method has a default that does nothing.
pub trait Control: Sync {
    /// True to stop soon; what is finished is kept. Once true, it must stay true: work that ended early is thrown away on its word.
    fn cancelled(&self) -> bool {
        false
    }
    /// Called with the part of the current call to [`Session::run`](crate::Session::run) that is done, from 0 to 1.
    fn progress(&self, _done: f64) {}
    /// Called with each finished piece of the image, in order.
    fn tile(&self, _tile: &FinishedTile<'_>) {}
}

/// No control: run to the end in silence.
#[derive(Clone, Copy, Debug, Default)]
pub struct Unattended;
impl Control for Unattended {}

/// Some neighbouring pixels after another round of samples.
#[derive(Clone, Copy, Debug)]
pub struct FinishedTile<'a> {
    /// First pixel and one past the last, row by row from the top left.
    pub pixels: (u32, u32),
    pub(super) film: &'a PixelFilm,
}

impl FinishedTile<'_> {
    /// The forward image there so far, pixel by pixel.
    #[must_use]
    pub fn image(&self) -> impl ExactSizeIterator<Item = Estimate> {
        let (first, end) = self.pixels;
        (first..end).map(|pixel| self.film.estimate(pixel as usize, 0))
    }
}
