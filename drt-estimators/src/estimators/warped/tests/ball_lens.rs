//! A lamp behind a ball of glass on the camera's axis: derivatives by the rays of a perfect sphere.
//!
//! Nothing jumps where the lamp ends, so that rays may turn with it or not, as long as their rates are continuous and have the divergence that they say.

use drt_motion::Effect;

use super::*;
use crate::model::surface::Dielectric;
use crate::model::texture::{Bitmap, Texture, TextureWrap};

/// How a lamp is seen through a ball.
#[derive(Clone, Copy)]
struct SeenThroughBall {
    /// How far the ball has moved.
    ball: Vec3,
    /// By what the camera has turned about the y axis, in radians.
    turned: f64,
}

impl SeenThroughBall {
    const RADIUS: f64 = 0.8;
    const CAMERA: Vec3 = vec3(0.0, 0.0, 3.0);
    const LAMP: Vec3 = vec3(0.1, 0.05, -1.3);
    const HALF_LAMP: f64 = 0.5;
    const INDEX: f64 = 1.3;
    const AT_REST: Self = Self { ball: Vec3::ZERO, turned: 0.0 };
    /// Points along each side of the image.
    const POINTS: u32 = 700;

    /// The lamp fades to black at its border, so that nothing jumps in the integral below.
    fn scene() -> Scene {
        let sphere = procedural::icosphere(3).with_smooth_normals();
        let ball = placed(sphere, Vec3::splat(Self::RADIUS), 0.0, Vec3::ZERO);
        let flat = procedural::rectangle();
        let coordinates = |i| flat.triangle(i).map(|p| [0.5 + 0.5 * p.x, 0.5 + 0.5 * p.y]);
        let coordinates = (0..2).map(coordinates).collect();
        let lamp = flat.clone().with_texcoords(coordinates).expect("coordinates");
        let lamp = placed(lamp, Vec3::splat(Self::HALF_LAMP), 0.0, Self::LAMP);
        let texels = (0..9).map(|i| if i == 4 { [1.0; 3] } else { [0.0; 3] }).collect();
        let mut image = Bitmap::new([3, 3], texels).expect("an image");
        image.wrap = TextureWrap::Clamp;
        let texture = Texture::Bitmap(image);
        let glow = Emitter::TexturedArea { radiance: Rgb::ONE, texture };
        let glass = Bsdf::Dielectric(Dielectric { eta: Self::INDEX, ..Dielectric::default() });
        let black = diffuse(0.0, 0.0, 0.0);
        let scene = SceneBuilder::new()
            .shape("lamp", ShapeBuilder::new(lamp, black).emitter(glow))
            .shape("ball", ShapeBuilder::new(ball, glass));
        seen(scene, [Self::CAMERA, Vec3::ZERO], 3)
    }

    /// The radiance of the lamp at a point of its plane, from its middle: of three texels, the middle one shines.
    fn radiance(place: Vec3) -> f64 {
        let tent = |x: f64| f64::max(1.0 - 1.5 * (x / Self::HALF_LAMP).abs(), 0.0);
        tent(place.x) * tent(place.y)
    }

    /// The direction of a ray along d after it is refracted at a surface with the normal n against it, and the part that goes through.
    fn refracted(d: Vec3, n: Vec3, index: f64) -> (Vec3, f64) {
        let cos = -n.dot(d);
        let inside = f64::sqrt(1.0 - (1.0 - cos * cos) / (index * index));
        let s = (cos - index * inside) / (cos + index * inside);
        let p = (index * cos - inside) / (index * cos + inside);
        (d * (1.0 / index) + n * (cos / index - inside), 1.0 - 0.5 * (s * s + p * p))
    }

    /// The radiance at an image point at distance 1.
    fn seen_at(&self, [x, y]: [f64; 2]) -> f64 {
        let d = Mat3::rotation(Vec3::Y, self.turned) * vec3(x, y, -1.0).normalize();
        let eye = Self::CAMERA - self.ball;
        let middle = eye - d * eye.dot(d);
        let half2 = Self::RADIUS * Self::RADIUS - middle.length_squared();
        if half2 <= 0.0 {
            return 0.0;
        }
        let enters = middle - d * half2.sqrt();
        let (along, a) = Self::refracted(d, enters * (1.0 / Self::RADIUS), Self::INDEX);
        let leaves = enters - along * (2.0 * enters.dot(along));
        let n = leaves * (-1.0 / Self::RADIUS);
        let (out, b) = Self::refracted(along, n, 1.0 / Self::INDEX);
        let plane = Self::LAMP - self.ball;
        let seen = leaves + out * ((plane.z - leaves.z) / out.z);
        if out.z < 0.0 { a * b * Self::radiance(seen - plane) } else { 0.0 }
    }

    /// The light's moment across the image.
    fn moment(&self) -> f64 {
        // Six pixels are 40° wide.
        let half = f64::tan(20.0_f64.to_radians());
        let (pixel, step) = (half / 3.0, 2.0 * half / f64::from(Self::POINTS));
        let at = |i: u32| (f64::from(i) + 0.5) * step - half;
        let points = (0..Self::POINTS).flat_map(|i| (0..Self::POINTS).map(move |j| [at(i), at(j)]));
        let sum: f64 = points.map(|at| self.seen_at(at) * at[0]).sum();
        sum * step * step / (pixel * pixel * pixel)
    }
}

const SHIFT: Vec3 = vec3(0.4, 0.2, 0.3);

#[test]
fn a_lamp_behind_a_ball() {
    const REST: SeenThroughBall = SeenThroughBall::AT_REST;
    type Later = fn(f64) -> SeenThroughBall;
    let scene = SeenThroughBall::scene();
    let shift = |name| moves(name, GeometryChange::Translate(SHIFT));
    let turn = GeometryChange::Rotate { axis: Vec3::Y, pivot: SeenThroughBall::CAMERA };
    let cases: [(Effect, Later, u32, &[Fault]); 2] = [
        (
            moves("camera", turn),
            |t| SeenThroughBall { turned: t, ..REST },
            48,
            &[Fault::Divergence],
        ),
        (shift("ball"), |t| SeenThroughBall { ball: SHIFT * t, ..REST }, 48, &[]),
    ];
    for (effect, later, samples, faults) in cases {
        let sum = Sum { samples, ..MOMENT };
        let step = 1e-2;
        let difference = later(step).moment() - later(-step).moment();
        let reference = Batches::exact(difference / (2.0 * step));
        let motion = parameter(&effect.target.clone(), 0.0, alloc::vec![effect]);
        let by = |kind| prepare_lit(kind, EmitterMask::Extended, &scene, &motion, 3);
        assert_found(&reference, sum, || by(EstimatorKind::Warped), faults);
    }
}
