//! Orthographic cameras: parallel rays that start on the film.
//!
//! The film is a rectangle of the plane through the position p, across the forward axis f. With d = x - p, a pixel sees x at
//!
//! ```text
//! q = principal + (a, -b)/s,   a = d·right,   b = d·up,   from the point of the film E(x) = x - (d·f) f.
//! ```
//!
//! # Importance
//!
//! A pixel's value is ∫ P(q) L(E, f) dq. An area dA at x with normal n covers dq = |n·f| dA / s² of the film, so in the area
//! measure the importance is the delta in direction of 2021 paper, §4.3: P/s² times the cosine at x, without the 1/r² of a
//! pinhole. Everything else in drt has a geometric term with 1/r², r = |x - E|; so the importance that is told here is
//! h = r²/s², which cancels it to rounding, and so do their derivatives.
//!
//! # Derivatives
//!
//! In material form x has a velocity of its own, and takes the film's point along:
//!
//! ```text
//! E_dot = x_dot - f (f·(x_dot - p_dot)) - (d·f) f_dot - f (d·f_dot),
//! ```
//!
//! which [`Sensor::film_gradient`] transposes. No motion of x turns the ray. In spatial form E stays at its image point,
//! E_dot = p_dot + a right_dot + b up_dot, and the ray turns by f_dot ([`ray_gradient`]).
//!
//! Where a ray grazes an edge at B and lands at S, a distance l beyond, the image point of B passes that of S with the velocity
//! (N·(u_B - u_S + l f_dot))/s, N being the unit normal of the edge in view. So the boundary segments of the camera (2021
//! paper, Eq. 41) have 1/s² for h/r², and these velocities for those of a pinhole; against a constant environment, which has
//! no place, image points stand still, and N·(u_B - E_dot - |B - E| f_dot) remains.

use drt_math::{Affine, Mat3, Ray, Real, Vec3};

use crate::model::filter::Filter;
use crate::model::sensor::{
    Lens, Pinhole, Projection, Response, Sensor, SensorError, SensorGradient, Window, finite,
    motion,
};

/// How much more one axis of a film may be stretched than the other, or sheared: what printed matrices are off by.
const OBLONG: f64 = 1e-3;

impl Sensor {
    /// An orthographic camera placed by a camera-to-world map, `film` pixels wide and high.
    ///
    /// As in Mitsuba the film covers [-1, 1] along the local x axis, and as much of y as square pixels make it; scales of
    /// `to_world` are the size of the film. Rays start on the near plane. Of the `lens` only clip distances count, in
    /// local units.
    ///
    /// # Errors
    /// Names what is not finite, empty, or sheared.
    pub fn orthographic(
        to_world: &Affine,
        lens: Lens,
        film: [u32; 2],
        filter: Filter,
    ) -> Result<Self, SensorError> {
        finite(to_world.is_finite(), "to_world")?;
        Self::check_film(film)?;
        let window = Window::of(film);
        // Checks the clip planes.
        lens.pixel_size(window.whole)?;
        let [left, up, forward] = to_world.linear.cols;
        let scale = square(-left, up, forward)?;
        let axes = motion::orthonormalize([-left, up, forward]);
        let [right, up, along] = axes.ok_or(SensorError::Oblong)?;
        let depth = forward.length();
        let lens = Lens { near: lens.near * depth, far: lens.far * depth, ..lens };
        let pinhole = Pinhole {
            position: to_world.translation + along * lens.near,
            right,
            up,
            forward: along,
            pixel_size: 2.0 * scale / f64::from(film[0]),
            principal: film.map(|n| 0.5 * f64::from(n)),
        };
        let response = Response::Orthographic;
        Ok(Self { pinhole, lens, film, window, filter, response, aperture: None })
    }

    /// True of a camera of parallel rays.
    #[inline]
    #[must_use]
    pub fn is_orthographic(&self) -> bool {
        self.response == Response::Orthographic
    }

    /// The point of the camera from which x is seen.
    #[inline]
    #[must_use]
    pub fn eye_of(&self, x: Vec3) -> Vec3 {
        let Pinhole { position, forward, .. } = self.pinhole;
        if self.is_orthographic() { x - forward * (x - position).dot(forward) } else { position }
    }

    /// Its corners, of all pixels and as far as filters reach beyond, in order around.
    pub(crate) fn film_corners(&self) -> [Vec3; 4] {
        let [w, h] = self.film.map(f64::from);
        let r = self.filter.radius();
        [[-r, -r], [w + r, -r], [w + r, h + r], [-r, h + r]].map(|q| self.ray(q).origin)
    }

    /// The gradient of a number by a point that the camera sees and by the camera, from that by the point of the film from which
    /// it is seen.
    pub(crate) fn film_gradient(&self, p: &Projection, adjoint: Vec3) -> (Vec3, SensorGradient) {
        let forward = self.pinhole.forward;
        let along = adjoint.dot(forward);
        let position = forward * along;
        let turn = -adjoint * p.depth - p.offset * along;
        let camera = SensorGradient { position, forward: turn, ..SensorGradient::default() };
        (adjoint - position, camera)
    }

    pub(super) fn parallel_ray(&self, pixel: [f64; 2]) -> Ray {
        let p = &self.pinhole;
        let [a, b] = p.plane(pixel);
        let Lens { near, far, .. } = self.lens;
        Ray::new(p.position + p.right * a + p.up * b, p.forward).until(far - near)
    }

    pub(super) fn orthographic_to_world(&self) -> Affine {
        let Pinhole { position, right, up, forward, pixel_size, .. } = self.pinhole;
        let scale = 0.5 * pixel_size * self.window.whole[0];
        Affine {
            linear: Mat3 { cols: [right * -scale, up * scale, forward] },
            translation: position - forward * self.lens.near,
        }
    }

    /// Moved by a map that takes the camera's axes to `axes`.
    pub(super) fn moved_film(&self, map: &Affine, axes: [Vec3; 3]) -> Result<Self, SensorError> {
        let [right, up, forward] = axes;
        let grown = square(right, up, forward)?;
        let [right, up, forward] = motion::orthonormalize(axes).ok_or(SensorError::Flattened)?;
        let position = map.point(self.pinhole.position);
        finite(position.is_finite(), "position after the motion")?;
        let pixel_size = self.pinhole.pixel_size * grown;
        let pinhole = Pinhole { position, right, up, forward, pixel_size, ..self.pinhole };
        let Lens { near, far, .. } = self.lens;
        let lens = Lens { near: near * grown, far: far * grown, ..self.lens };
        Ok(Self { pinhole, lens, ..self.clone() })
    }

    /// Checks that the pixels of an orthographic camera stay square under a velocity field.
    ///
    /// # Errors
    /// When they do not.
    pub fn check_velocity(&self, field: &Affine) -> Result<(), SensorError> {
        let Pinhole { right, up, .. } = self.pinhole;
        let [r, u] = [right, up].map(|v| field.vector(v));
        let stretch = r.dot(right) - u.dot(up);
        let shear = r.dot(up) + u.dot(right);
        let most = OBLONG * f64::max(r.length(), u.length());
        if self.is_orthographic() && f64::max(stretch.abs(), shear.abs()) > most {
            return Err(SensorError::Oblong);
        }
        Ok(())
    }
}

/// The size of a film's half width, with axes that are equally long and at right angles.
fn square(right: Vec3, up: Vec3, forward: Vec3) -> Result<f64, SensorError> {
    let (a, b, c) = (right.length(), up.length(), forward.length());
    let sheared = |v: Vec3, w: Vec3, size: f64| v.dot(w).abs() > OBLONG * size;
    let off = (a - b).abs() > OBLONG * b
        || sheared(right, up, a * b)
        || sheared(right, forward, a * c)
        || sheared(up, forward, b * c);
    let volume = a * b * c;
    let usable = !off && volume.is_finite() && volume > 0.0;
    if usable { Ok(b) } else { Err(SensorError::Oblong) }
}

/// Projects a point along the forward axis.
pub(super) fn project<T: Real>(camera: &Pinhole<T>, x: Vec3<T>) -> Projection<T> {
    let offset = x - camera.position;
    let depth = offset.dot(camera.forward);
    let plane = [offset.dot(camera.right), offset.dot(camera.up)];
    let s = camera.pixel_size;
    Projection {
        pixel: [camera.principal[0] + plane[0] / s, camera.principal[1] - plane[1] / s],
        importance: (depth / s).squared(),
        depth,
        offset,
        plane,
    }
}

/// As [`Pinhole::projection_gradient`].
pub(super) fn projection_gradient(
    camera: &Pinhole,
    p: &Projection,
    pixel_adjoint: [f64; 2],
    importance_adjoint: f64,
) -> (Vec3, SensorGradient) {
    let per_size = 1.0 / camera.pixel_size;
    let [along_a, along_b] = [pixel_adjoint[0] * per_size, -pixel_adjoint[1] * per_size];
    let along_depth = 2.0 * importance_adjoint / p.depth;
    let point = camera.right * along_a + camera.up * along_b + camera.forward * along_depth;
    let gradient = SensorGradient {
        position: -point,
        right: p.offset * along_a,
        up: p.offset * along_b,
        forward: p.offset * along_depth,
        pixel_size: -per_size
            * (along_a * p.plane[0] + along_b * p.plane[1] + 2.0 * importance_adjoint),
        principal: pixel_adjoint,
        ..SensorGradient::default()
    };
    (point, gradient)
}

/// The gradient by the camera of a number whose gradients by the origin, which is at `eye`, and by the direction of the
/// ray of one and the same image point are given.
pub(super) fn ray_gradient(
    camera: &Pinhole,
    eye: Vec3,
    origin: Vec3,
    turn: Vec3,
) -> SensorGradient {
    let offset = eye - camera.position;
    let [a, b] = [camera.right, camera.up].map(|axis| offset.dot(axis));
    let [to_a, to_b] = [camera.right, camera.up].map(|axis| origin.dot(axis));
    let s = camera.pixel_size;
    SensorGradient {
        position: origin,
        right: origin * a,
        up: origin * b,
        forward: turn,
        pixel_size: (to_a * a + to_b * b) / s,
        principal: [-s * to_a, s * to_b],
        ..SensorGradient::default()
    }
}
