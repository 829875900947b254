//! How a caller observes and cancels a run.

use crate::model::rendering::Estimate;
use crate::sampling::film::PixelFilm;

/// Observes and cancels a run. Every method has a default that does nothing.
pub trait Control: Sync {
    /// Returns true to stop soon; finished samples are kept. Once true, it must stay true, because unfinished work is
    /// then discarded.
    fn cancelled(&self) -> bool {
        false
    }
    /// Called with the part of the current call to [`Session::run`](crate::Session::run) that is done, from 0 to 1.
    fn progress(&self, _done: f64) {}
    /// Called with each finished piece of the image, in order.
    fn tile(&self, _tile: &FinishedTile<'_>) {}
}

/// No control: the run goes on to its end and reports nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct Unattended;
impl Control for Unattended {}

/// The control of a part of a longer run.
#[derive(Clone, Copy)]
pub struct Part<'a> {
    whole: &'a dyn Control,
    from: f64,
    to: f64,
}

impl<'a> Part<'a> {
    /// The part from `from` to `to` of what `whole` controls, where 0 is its start and 1 its end.
    #[must_use]
    pub fn new(whole: &'a dyn Control, from: f64, to: f64) -> Self {
        Self { whole, from, to }
    }
}

impl Control for Part<'_> {
    fn cancelled(&self) -> bool {
        self.whole.cancelled()
    }

    fn progress(&self, done: f64) {
        self.whole.progress(self.from + (self.to - self.from) * done);
    }
}

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
