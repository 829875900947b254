use drt_math::{Real, Vec3};

use crate::model::gradient::dual_vectors;

/// Where a camera is and how it maps directions to pixels; generic, so that it can carry duals.
///
/// The axes are orthonormal. Seen in a right-handed world they are left-handed
/// (right × up = -forward is backward) unless the placement mirrors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pinhole<T = f64> {
    /// The centre of projection.
    pub position: Vec3<T>,
    /// Towards larger pixel x.
    pub right: Vec3<T>,
    /// Towards smaller pixel y.
    pub up: Vec3<T>,
    /// Into the scene.
    pub forward: Vec3<T>,
    /// Side s of a pixel on the plane at distance one, or on an orthographic camera's film.
    pub pixel_size: T,
    /// Pixel coordinates of the forward axis.
    pub principal: [T; 2],
}

/// A point of space as a pinhole sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Projection<T = f64> {
    /// Pixel coordinates.
    pub pixel: [T; 2],
    /// 1/(s² cos³), cos = depth over distance: with the filter P, the importance We = P/(s² cos³)
    /// that goes with a geometric term without cosine at the pinhole (2021 paper, Eq. 22). Of an orthographic
    /// camera r²/s², which takes the distance r out of the geometric term.
    pub importance: T,
    /// Distance along the forward axis.
    pub depth: T,
    /// The point less the pinhole.
    pub(super) offset: Vec3<T>,
    /// Coordinates (a, b) on the plane at distance one, or on an orthographic camera's film.
    pub(super) plane: [T; 2],
}

/// Rates of change of a camera with a parameter.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SensorTangent {
    /// Velocity of the pinhole.
    pub position: Vec3,
    /// Rate of the right axis.
    pub right: Vec3,
    /// Rate of the up axis.
    pub up: Vec3,
    /// Rate of the forward axis.
    pub forward: Vec3,
    /// Rate of the pixel size.
    pub pixel_size: f64,
    /// Rate of the principal point, in pixels.
    pub principal: [f64; 2],
    /// Rate of the lens's radius.
    pub aperture_radius: f64,
    /// Rate of the depth that is sharp.
    pub focus_distance: f64,
}

/// Derivatives of a number with respect to what a [`SensorTangent`] holds the rates of.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SensorGradient {
    /// With respect to the pinhole's position.
    pub position: Vec3,
    /// With respect to the right axis.
    pub right: Vec3,
    /// With respect to the up axis.
    pub up: Vec3,
    /// With respect to the forward axis.
    pub forward: Vec3,
    /// With respect to the pixel size.
    pub pixel_size: f64,
    /// With respect to the principal point.
    pub principal: [f64; 2],
    /// With respect to the lens's radius.
    pub aperture_radius: f64,
    /// With respect to the depth that is sharp.
    pub focus_distance: f64,
}

impl<T: Real> Pinhole<T> {
    /// The vector through an image point, of depth one.
    #[inline]
    pub fn view(&self, pixel: [T; 2]) -> Vec3<T> {
        let [a, b] = self.plane(pixel);
        self.forward + self.right * a + self.up * b
    }

    /// Projects a point that is not in the plane through the pinhole parallel to the image.
    #[inline]
    pub fn project(&self, x: Vec3<T>) -> Projection<T> {
        let offset = x - self.position;
        let depth = offset.dot(self.forward);
        let plane = [offset.dot(self.right) / depth, offset.dot(self.up) / depth];
        let s = self.pixel_size;
        let per_cos = offset.length() / depth;
        Projection {
            pixel: [self.principal[0] + plane[0] / s, self.principal[1] - plane[1] / s],
            importance: per_cos * (per_cos / s).squared(),
            depth,
            offset,
            plane,
        }
    }

    /// Coordinates (a, b) on the plane at distance one.
    pub(super) fn plane(&self, [x, y]: [T; 2]) -> [T; 2] {
        let s = self.pixel_size;
        [(x - self.principal[0]) * s, (self.principal[1] - y) * s]
    }
}

impl Pinhole {
    /// Gradient of `pixel_adjoint · pixel + importance_adjoint · ln importance`, first with
    /// respect to the projected point, then to the camera.
    ///
    /// For a contribution c = P(pixel) · importance · rest, the adjoints that give the gradient of
    /// c are grad P · importance · rest and c.
    #[must_use]
    pub fn projection_gradient(
        &self,
        p: &Projection,
        pixel_adjoint: [f64; 2],
        importance_adjoint: f64,
    ) -> (Vec3, SensorGradient) {
        let per_depth = 1.0 / p.depth;
        let per_size = 1.0 / self.pixel_size;
        let [along_a, along_b] =
            [pixel_adjoint[0] * per_size * per_depth, -pixel_adjoint[1] * per_size * per_depth];
        let along_depth =
            -(along_a * p.plane[0] + along_b * p.plane[1]) - 3.0 * importance_adjoint * per_depth;
        let along_offset = 3.0 * importance_adjoint / p.offset.length_squared();
        let point = self.right * along_a
            + self.up * along_b
            + self.forward * along_depth
            + p.offset * along_offset;
        let camera = SensorGradient {
            position: -point,
            right: p.offset * along_a,
            up: p.offset * along_b,
            forward: p.offset * along_depth,
            pixel_size: -per_size
                * (pixel_adjoint[0] * (p.pixel[0] - self.principal[0])
                    + pixel_adjoint[1] * (p.pixel[1] - self.principal[1])
                    + 2.0 * importance_adjoint),
            principal: pixel_adjoint,
            ..SensorGradient::default()
        };
        (point, camera)
    }

    /// Rate of the unit direction into the scene through a fixed image point; the ray's origin
    /// moves with [`SensorTangent::position`].
    #[must_use]
    pub fn direction_rate(&self, pixel: [f64; 2], tangent: &SensorTangent) -> Vec3 {
        let v = self.view(pixel);
        let [a, b] = self.plane(pixel);
        let growth = tangent.pixel_size / self.pixel_size;
        let a_rate = a * growth - self.pixel_size * tangent.principal[0];
        let b_rate = b * growth + self.pixel_size * tangent.principal[1];
        let rate = tangent.forward
            + tangent.right * a
            + tangent.up * b
            + self.right * a_rate
            + self.up * b_rate;
        let length = v.length();
        rate.reject(v / length) / length
    }

    /// The transpose of [`Pinhole::direction_rate`]: the gradient by the camera of a number whose
    /// gradient by the unit direction is `adjoint`; `direction` needs not be unit.
    pub(super) fn direction_gradient(&self, direction: Vec3, adjoint: Vec3) -> SensorGradient {
        let depth = direction.dot(self.forward);
        let [a, b] = [self.right, self.up].map(|axis| direction.dot(axis) / depth);
        let length = direction.length();
        let forward = adjoint.reject(direction / length) * (depth / length);
        let [to_a, to_b] = [forward.dot(self.right), forward.dot(self.up)];
        SensorGradient {
            position: Vec3::ZERO,
            right: forward * a,
            up: forward * b,
            forward,
            pixel_size: (to_a * a + to_b * b) / self.pixel_size,
            principal: [-self.pixel_size * to_a, self.pixel_size * to_b],
            ..SensorGradient::default()
        }
    }
}

dual_vectors!(
    SensorGradient,
    SensorTangent {
        position,
        right,
        up,
        forward,
        pixel_size,
        principal,
        aperture_radius,
        focus_distance,
    }
);
