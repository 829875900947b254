//! What lies along a ray: interfaces that it crosses, and the media between them.

use alloc::vec::Vec;

use drt_geom::Hit;
use drt_math::Vec3;

use crate::world::vertex::SurfacePoint;

/// A null interface on a ray.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Crossing {
    pub(crate) point: SurfacePoint,
    pub(crate) x: Vec3,
    /// Distance from the ray's start.
    pub(crate) t: f64,
    pub(crate) after: Option<usize>,
}

/// What lies along a ray up to the first surface that scatters.
#[derive(Clone, Debug, Default)]
pub(crate) struct RayPath {
    /// The medium the ray starts in.
    pub(crate) medium: Option<usize>,
    pub(crate) crossings: Vec<Crossing>,
    /// The surface it ends on; `None` when it escapes.
    pub(crate) end: Option<(SurfacePoint, Vec3)>,
    /// Its length; infinite when it escapes.
    pub(crate) length: f64,
    pub(super) hits: Vec<Hit>,
}

impl RayPath {
    /// Ends the ray at `length`.
    pub(crate) fn cut(&mut self, length: f64) {
        self.crossings.retain(|c| c.t < length);
        self.end = None;
        self.length = length;
    }

    /// The medium at its end.
    pub(crate) fn last_medium(&self) -> Option<usize> {
        self.crossings.last().map_or(self.medium, |c| c.after)
    }

    /// Becomes the first `length` of another ray.
    pub(crate) fn truncate_from(&mut self, other: &Self, length: f64) {
        self.medium = other.medium;
        self.crossings.clear();
        self.crossings.extend(other.crossings.iter().take_while(|c| c.t < length));
        self.end = None;
        self.length = length;
    }
}

/// A piece of a ray inside one medium.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Interval {
    pub(crate) medium: Option<usize>,
    pub(crate) start: f64,
    pub(crate) end: f64,
}

/// The pieces a ray is cut into by its crossings.
pub(crate) fn intervals(
    medium: Option<usize>,
    crossings: &[Crossing],
    length: f64,
) -> impl Iterator<Item = Interval> + '_ {
    (0..=crossings.len()).map(move |i| Interval {
        medium: if i == 0 { medium } else { crossings[i - 1].after },
        start: if i == 0 { 0.0 } else { crossings[i - 1].t },
        end: crossings.get(i).map_or(length, |c| c.t),
    })
}
