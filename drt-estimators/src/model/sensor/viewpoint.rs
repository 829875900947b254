//! Where the rays of a camera come from, for those who ask how an edge or a face lies to them.

use drt_math::Vec3;

use crate::model::sensor::Sensor;

/// Where the rays of a camera come from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Viewpoint {
    /// All rays start at the centre of projection.
    Point(Vec3),
    /// Rays start anywhere on a lens.
    Lens {
        /// The middle of the lens.
        centre: Vec3,
        /// The radius of the lens.
        radius: f64,
    },
    /// All rays are parallel to this unit vector into the scene: those of a viewer infinitely far away.
    Infinity(Vec3),
}

impl Viewpoint {
    /// The centre of projection, or the middle of the lens; `None` at infinity.
    pub(crate) fn centre(self) -> Option<Vec3> {
        match self {
            Self::Point(centre) | Self::Lens { centre, .. } => Some(centre),
            Self::Infinity(_) => None,
        }
    }

    /// True where the ray that sees a point moves along with the point, and does not turn.
    #[inline]
    pub(crate) fn is_at_infinity(self) -> bool {
        matches!(self, Self::Infinity(_))
    }

    /// The direction, of any length, in which the point x is seen; from the middle of a lens.
    pub(crate) fn onward(self, x: Vec3) -> Vec3 {
        match self {
            Self::Point(centre) | Self::Lens { centre, .. } => x - centre,
            Self::Infinity(forward) => forward,
        }
    }
}

impl Sensor {
    /// Where rays come from.
    #[inline]
    pub(crate) fn viewpoint(&self) -> Viewpoint {
        match self.aperture() {
            _ if self.is_orthographic() => Viewpoint::Infinity(self.pinhole().forward),
            None => Viewpoint::Point(self.position()),
            Some(lens) => Viewpoint::Lens { centre: self.position(), radius: lens.radius },
        }
    }

    /// Four points around all those where rays start; `None` where that is a single point.
    pub(crate) fn around_origins(&self) -> Option<[Vec3; 4]> {
        let square = [[-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0]];
        match self.viewpoint() {
            Viewpoint::Point(_) => None,
            Viewpoint::Lens { .. } => Some(square.map(|at| self.at_lens(at).position())),
            Viewpoint::Infinity(_) => Some(self.film_corners()),
        }
    }

    /// The width of a pixel at the distance of the point x.
    pub(crate) fn pixel_width_at(&self, x: Vec3) -> f64 {
        let size = self.pinhole().pixel_size;
        self.viewpoint().centre().map_or(size, |centre| size * (x - centre).length())
    }
}
