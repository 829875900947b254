//! What a sensor responds to, cameras or irradiance meter, under one set of calls.
//!
//! A pixel's value is ∫ P(q(w)) h(w) L(w) dw over directions, with the filter P over image points q
//! and the *importance* h: 1/(s² cos³) for a pinhole (2021 paper, Eq. 22), the cosine to its normal
//! for an irradiance meter, whose one pixel has P = 1. An [orthographic](super::orthographic) camera
//! sees one direction, and h stands for the delta in it.

use drt_math::{Affine, Frame, Ray, Real, Vec3, warp};

use crate::model::filter::{ALONG_BORDER, Filter, FilterKind};
use crate::model::sensor::{
    Lens, Projection, Response, Sensor, SensorError, SensorGradient, orthographic, unit,
};

/// The largest radius of a filter, in pixels, whose samples are shared: each touches (2 × 8)² pixels.
const MOST_SHARED: f64 = 8.0;

/// A direction drawn for a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewSample {
    /// Where the ray starts: the pinhole, the meter, or the point of an orthographic camera's film.
    pub origin: Vec3,
    /// Unit, into the scene.
    pub direction: Vec3,
    /// The image point, in pixels; the middle of an irradiance meter's one pixel.
    pub point: [f64; 2],
    /// P h over the density of the direction.
    pub weight: f64,
    /// Gradient of P by the image point, times h over the density.
    pub slope: [f64; 2],
    /// The point of the lens on the unit disk, of a camera that has one: this is a view of the pinhole
    /// [`at_lens`](Sensor::at_lens).
    pub lens: [f64; 2],
}

impl Sensor {
    /// A meter of irradiance: ∫ L cos dw over the hemisphere around `normal`. It has one pixel and
    /// moves as any sensor does.
    ///
    /// # Errors
    /// When the normal is zero or something is not finite.
    pub fn irradiance_meter(position: Vec3, normal: Vec3) -> Result<Self, SensorError> {
        let n = unit(normal).ok_or(SensorError::NoDirection)?;
        let frame = Frame::from_normal(n);
        let to_world = Affine {
            linear: drt_math::Mat3 { cols: [frame.s, frame.t, frame.n] },
            translation: position,
        };
        let filter = Filter::new(FilterKind::BOX)?;
        let camera = Self::from_to_world(&to_world, Lens::with_fov(90.0), [1, 1], filter)?;
        Ok(Self { response: Response::Irradiance, ..camera })
    }

    /// How the sensor weighs directions.
    #[must_use]
    pub fn response(&self) -> Response {
        self.response
    }

    /// Draws a direction for a pixel (row by row from the top left) from two uniform numbers;
    /// mirrored numbers, 1 - u, give image points mirrored at the pixel's centre.
    #[must_use]
    pub fn sample_view(&self, pixel: u32, u: [f64; 2], derivative: bool) -> ViewSample {
        match self.response {
            Response::Perspective | Response::Orthographic => {
                let s = self.filter.sample(u, derivative);
                let width = self.film[0];
                let [x, y] = [pixel % width, pixel / width].map(|p| f64::from(p) + 0.5);
                let point = [x + s.offset[0], y + s.offset[1]];
                let Ray { origin, dir: direction, .. } = self.ray(point);
                ViewSample {
                    origin,
                    direction,
                    point,
                    weight: s.weight,
                    slope: s.slope,
                    lens: [0.0; 2],
                }
            }
            Response::Irradiance => {
                let p = &self.pinhole;
                let w = warp::cosine_hemisphere(u);
                ViewSample {
                    origin: p.position,
                    direction: p.right * w.x + p.up * w.y + p.forward * w.z,
                    point: [0.5; 2],
                    weight: core::f64::consts::PI,
                    slope: [0.0; 2],
                    lens: [0.0; 2],
                }
            }
        }
    }

    /// True when an image point counts for several pixels, but not for so many that telling each would cost more
    /// than its path.
    pub(crate) fn shares_points(&self) -> bool {
        let radius = self.filter.radius();
        self.response != Response::Irradiance && 0.5 < radius && radius <= MOST_SHARED
    }

    /// Draws a direction evenly from the square of a pixel, for a film on which it counts for every pixel that it
    /// reaches: its weight is one over the density of the image point per square pixel, without any pixel's filter. Squares
    /// at the film's border reach out as far as filters do.
    pub(crate) fn sample_square(&self, pixel: u32, u: [f64; 2]) -> ViewSample {
        if self.response == Response::Irradiance {
            return self.sample_view(pixel, u, false);
        }
        let [w, h] = self.film;
        let (x, of_x) = self.filter.sample_interval(pixel % w, w, u[0]);
        let (y, of_y) = self.filter.sample_interval(pixel / w, h, u[1]);
        let point = [x, y];
        let Ray { origin, dir: direction, .. } = self.ray(point);
        let weight = 1.0 / (of_x * of_y);
        ViewSample { origin, direction, point, weight, slope: [0.0; 2], lens: [0.0; 2] }
    }

    /// Where and how strongly the sensor sees a point, visibility and clip planes apart. Points of
    /// depth 0 or less are behind it.
    #[must_use]
    pub fn view(&self, x: Vec3) -> Projection {
        if self.is_orthographic() {
            return orthographic::project(&self.pinhole, x);
        }
        let mut projection = self.pinhole.project(x);
        if self.response == Response::Irradiance {
            projection.pixel = [0.5, 0.5];
            projection.importance = projection.depth / projection.offset.length();
        }
        projection
    }

    /// Gradient of `pixel_adjoint · pixel + importance_adjoint · ln importance`, first by the point
    /// seen, then by the sensor.
    #[must_use]
    pub fn view_gradient(
        &self,
        p: &Projection,
        pixel_adjoint: [f64; 2],
        importance_adjoint: f64,
    ) -> (Vec3, SensorGradient) {
        match self.response {
            Response::Perspective => {
                self.pinhole.projection_gradient(p, pixel_adjoint, importance_adjoint)
            }
            Response::Orthographic => orthographic::projection_gradient(
                &self.pinhole,
                p,
                pixel_adjoint,
                importance_adjoint,
            ),
            Response::Irradiance => {
                let along = p.offset / p.offset.length_squared();
                let point = (self.pinhole.forward / p.depth - along) * importance_adjoint;
                let gradient = SensorGradient {
                    position: -point,
                    forward: p.offset * (importance_adjoint / p.depth),
                    ..SensorGradient::default()
                };
                (point, gradient)
            }
        }
    }

    /// The gradient by the sensor of a number whose gradients by the origin, which is at `eye`, and by the unit direction
    /// of the ray of one and the same image point are given.
    pub(crate) fn ray_gradient(
        &self,
        eye: Vec3,
        direction: Vec3,
        origin: Vec3,
        turn: Vec3,
    ) -> SensorGradient {
        if self.is_orthographic() {
            return orthographic::ray_gradient(&self.pinhole, eye, origin, turn);
        }
        let mut gradient = self.direction_gradient(direction, turn);
        gradient.position += origin;
        gradient
    }

    /// The gradient by the sensor of a number whose gradient by the unit direction into the scene, of
    /// one and the same image point, is `adjoint`; its position has no part in it.
    #[must_use]
    pub fn direction_gradient(&self, direction: Vec3, adjoint: Vec3) -> SensorGradient {
        let p = &self.pinhole;
        match self.response {
            Response::Perspective => p.direction_gradient(direction, adjoint),
            // All image points have the same.
            Response::Orthographic => {
                SensorGradient { forward: adjoint, ..SensorGradient::default() }
            }
            Response::Irradiance => SensorGradient {
                right: adjoint * direction.dot(p.right),
                up: adjoint * direction.dot(p.up),
                forward: adjoint * direction.dot(p.forward),
                ..SensorGradient::default()
            },
        }
    }

    /// The window of a pixel's filter (see `Filter::window`) around an image point.
    pub(crate) fn window(&self, pixel: [u32; 2], point: [f64; 2]) -> (f64, [f64; 2]) {
        let center = pixel.map(|p| f64::from(p) + 0.5);
        self.filter.window([point[0] - center[0], point[1] - center[1]])
    }

    /// The factor of that by one coordinate, and its slope.
    pub(crate) fn window_along(&self, pixel: [u32; 2], point: [f64; 2], k: usize) -> (f64, f64) {
        self.filter.window_along(point[k] - (f64::from(pixel[k]) + 0.5))
    }

    /// True when the straight line between two points is seen along a border between pixels, by a filter that jumps there.
    pub(crate) fn sees_on_border(&self, ends: [Vec3; 2]) -> bool {
        if !(self.has_borders() && self.filter.tiles() && self.aperture.is_none()) {
            return false;
        }
        let [a, b] = ends.map(|x| self.view(x));
        let along = |k: usize| {
            let [a, b] = [a.pixel[k], b.pixel[k]];
            Filter::is_border(a) && Real::abs(a - b) < ALONG_BORDER
        };
        a.depth > 0.0 && b.depth > 0.0 && (along(0) || along(1))
    }

    /// True when the filter jumps at the borders of pixels.
    #[must_use]
    pub fn has_borders(&self) -> bool {
        self.response != Response::Irradiance && !self.filter.is_continuous()
    }
}

#[cfg(test)]
mod tests {
    use drt_math::{Rng, vec3};

    use super::*;

    #[test]
    fn irradiance_gradient_matches_differences() {
        let meter = Sensor::irradiance_meter(vec3(0.3, -0.2, 0.5), vec3(0.2, -0.4, 1.0)).unwrap();
        let x = vec3(0.1, 0.7, 2.0);
        let ln = |m: &Sensor, x: Vec3| m.view(x).importance.ln();
        let (point, gradient) = meter.view_gradient(&meter.view(x), [0.0; 2], 1.0);
        let h = 1e-6;
        for (d, axis) in [(point.x, Vec3::X), (point.y, Vec3::Y), (point.z, Vec3::Z)] {
            let fd = (ln(&meter, x + axis * h) - ln(&meter, x - axis * h)) / (2.0 * h);
            assert!((fd - d).abs() < 1e-8);
            let field = Affine { linear: drt_math::Mat3::skew(axis), translation: axis };
            let at = |s: f64| {
                let map =
                    Affine { linear: drt_math::Mat3::rotation(axis, s), translation: axis * s };
                ln(&meter.moved(&map).unwrap(), x)
            };
            let fd = (at(h) - at(-h)) / (2.0 * h);
            assert!((fd - gradient.dot(&meter.velocity(&field))).abs() < 1e-8);
        }
    }

    /// Against the rates of directions themselves, for cameras that move, turn and zoom.
    #[test]
    fn direction_gradients_are_transposed_rates() {
        let lens = Lens::with_fov(50.0);
        let place = Affine {
            linear: drt_math::Mat3::rotation(vec3(0.3, 0.8, -0.4).normalize(), 0.7),
            translation: vec3(1.0, -2.0, 0.5),
        };
        let camera =
            Sensor::from_to_world(&place, lens, [40, 30], Filter::new(FilterKind::BOX).unwrap())
                .unwrap();
        let pixel = [7.3, 21.9];
        let direction = camera.ray(pixel).dir;
        let adjoint = vec3(0.4, -1.3, 0.7);
        let gradient = camera.direction_gradient(direction, adjoint);
        let field = Affine {
            linear: drt_math::Mat3::skew(vec3(0.2, -0.6, 0.3)),
            translation: vec3(3.0, 1.0, 2.0),
        };
        let zoom = camera.property_tangent("fov", drt_math::Rgb::splat(2.0)).unwrap();
        let shift =
            camera.property_tangent("principal_point_offset_y", drt_math::Rgb::ONE).unwrap();
        for tangent in [camera.velocity(&field), zoom, shift] {
            let rate = camera.pinhole.direction_rate(pixel, &tangent);
            assert!((gradient.dot(&tangent) - adjoint.dot(rate)).abs() < 1e-12);
            assert!(rate.length() > 1e-3);
        }
        let meter = Sensor::irradiance_meter(vec3(0.3, -0.2, 0.5), vec3(0.2, -0.4, 1.0)).unwrap();
        let tangent = meter.velocity(&field);
        let turned = field.vector(direction);
        let found = meter.direction_gradient(direction, adjoint).dot(&tangent);
        assert!((found - adjoint.dot(turned)).abs() < 1e-12);
    }

    #[test]
    fn sampled_directions_integrate_the_cosine() {
        let meter = Sensor::irradiance_meter(Vec3::ZERO, vec3(0.0, 0.3, -1.0)).unwrap();
        let mut rng = Rng::new(1, 0, 0);
        let mut sum = 0.0;
        for _ in 0..1000 {
            let s = meter.sample_view(0, rng.next_2d(), true);
            assert!(meter.view(s.direction).importance > 0.0);
            sum += s.weight;
        }
        assert!((sum / 1000.0 - core::f64::consts::PI).abs() < 1e-12);
    }
}
