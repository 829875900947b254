//! A lamp behind a slab of glass: all derivatives in closed form.

use drt_motion::Effect;

use super::*;
use crate::model::surface::Dielectric;

const ALL: [Fault; 4] = [Fault::Divergence, Fault::Sign, Fault::Weight, Fault::Direction];

/// How a lamp is seen through a slab of glass, in closed form.
#[derive(Clone, Copy)]
struct SeenThroughSlab {
    index: f64,
    /// How far the lamp has moved.
    lamp: Vec3,
    /// By what the slab has turned about the y axis, in radians.
    turned: f64,
    camera: Vec3,
}

impl SeenThroughSlab {
    const HALF_THICKNESS: f64 = 0.2;
    const ANGLE: f64 = 0.5;
    const CAMERA: Vec3 = vec3(0.0, 0.0, 3.0);
    const LAMP: Vec3 = vec3(0.2, -0.1, -1.2);
    const HALF_LAMP: f64 = 0.4;

    const AT_REST: Self = Self { index: 1.5, lamp: Vec3::ZERO, turned: 0.0, camera: Vec3::ZERO };

    fn scene() -> Scene {
        let size = vec3(20.0, 20.0, Self::HALF_THICKNESS);
        let slab = placed(procedural::cube(), size, Self::ANGLE, Vec3::ZERO);
        let lamp = placed(procedural::rectangle(), Vec3::splat(Self::HALF_LAMP), 0.0, Self::LAMP);
        let glass =
            Bsdf::Dielectric(Dielectric { eta: Self::AT_REST.index, ..Dielectric::default() });
        let scene = SceneBuilder::new()
            .shape("lamp", glowing(lamp, Rgb::ONE))
            .shape("slab", ShapeBuilder::new(slab, glass));
        seen(scene, [Self::CAMERA, Vec3::ZERO], 3)
    }

    /// The point in the lamp's plane that is seen at an image point at distance 1, and which part of the light arrives.
    fn seen_at(&self, [x, y]: [f64; 2]) -> (Vec3, f64) {
        let d = vec3(x, y, -1.0).normalize();
        let placed = Mat3::rotation(vec3(0.48, 0.64, 0.6), Self::ANGLE) * Vec3::Z;
        let n = Mat3::rotation(Vec3::Y, self.turned) * placed;
        let cos = -n.dot(d);
        let inside = f64::sqrt(1.0 - (1.0 - cos * cos) / (self.index * self.index));
        let along = d / self.index + n * (cos / self.index - inside);
        let eye = Self::CAMERA + self.camera;
        let enters = eye + d * ((n.dot(eye) - Self::HALF_THICKNESS) / cos);
        let leaves = enters + along * (2.0 * Self::HALF_THICKNESS / inside);
        let plane = Self::LAMP.z + self.lamp.z;
        let s = (cos - self.index * inside) / (cos + self.index * inside);
        let p = (self.index * cos - inside) / (self.index * cos + inside);
        let through = 1.0 - 0.5 * (s * s + p * p);
        (leaves + d * ((plane - leaves.z) / d.z), through * through)
    }

    /// The light's moment across the image, by an integral over the lamp.
    fn moment(&self) -> f64 {
        // Six pixels are 40° wide.
        let pixel = 2.0 * f64::tan(20.0_f64.to_radians()) / 6.0;
        // The rule of Gauss and Legendre, in each of eight parts of a side.
        let rule: Vec<(f64, f64)> = (0..24)
            .map(|i| {
                let (part, node) = (f64::from(i / 3), f64::from(i % 3 - 1));
                let weight = if node == 0.0 { 8.0 } else { 5.0 } / 9.0;
                ((2.0 * part + 1.0 + node * f64::sqrt(0.6)) / 8.0 - 1.0, weight / 8.0)
            })
            .collect();
        let mut sum = 0.0;
        for (u, of_u) in &rule {
            for (v, of_v) in &rule {
                let place = Self::LAMP + self.lamp + vec3(*u, *v, 0.0) * Self::HALF_LAMP;
                let (at, enlarged) = self.image_of(place);
                let area = Self::HALF_LAMP * Self::HALF_LAMP * of_u * of_v * enlarged;
                sum += self.seen_at(at).1 * area * at[0] / (pixel * pixel * pixel);
            }
        }
        sum
    }

    /// Where a point of the lamp's plane is in the image, and how much larger that is, by Newton's method.
    fn image_of(&self, place: Vec3) -> ([f64; 2], f64) {
        let [mut x, mut y] = [0.0; 2];
        let mut inverse = 0.0;
        for _ in 0..8 {
            let h = 1e-5;
            let by = |a: [f64; 2], b: [f64; 2]| (self.seen_at(a).0 - self.seen_at(b).0) / (2.0 * h);
            let (by_x, by_y) = (by([x + h, y], [x - h, y]), by([x, y + h], [x, y - h]));
            let off = place - self.seen_at([x, y]).0;
            inverse = 1.0 / (by_x.x * by_y.y - by_x.y * by_y.x);
            x += (off.x * by_y.y - off.y * by_y.x) * inverse;
            y += (by_x.x * off.y - by_x.y * off.x) * inverse;
        }
        ([x, y], inverse.abs())
    }
}

const SHIFT: Vec3 = vec3(0.4, 0.2, 0.3);

#[test]
fn a_lamp_behind_a_slab() {
    const REST: SeenThroughSlab = SeenThroughSlab::AT_REST;
    type Later = fn(f64) -> SeenThroughSlab;
    let scene = SeenThroughSlab::scene();
    let sum = Sum { samples: 16, ..MOMENT };
    let turn = GeometryChange::Rotate { axis: Vec3::Y, pivot: Vec3::ZERO };
    let shift = |name| moves(name, GeometryChange::Translate(SHIFT));
    let cases: [(Effect, Later, &[Fault]); 4] = [
        (shift("lamp"), |t| SeenThroughSlab { lamp: SHIFT * t, ..REST }, &ALL),
        (shift("camera"), |t| SeenThroughSlab { camera: SHIFT * t, ..REST }, &[Fault::Direction]),
        (moves("slab", turn), |t| SeenThroughSlab { turned: t, ..REST }, &[Fault::Direction]),
        (
            changes("slab", "eta", grey(1.0)),
            |t| SeenThroughSlab { index: REST.index + t, ..REST },
            &[Fault::Direction],
        ),
    ];
    for (effect, later, faults) in cases {
        let step = 1e-3;
        let difference = later(step).moment() - later(-step).moment();
        let reference = Batches::exact(difference / (2.0 * step));
        let motion = parameter(&effect.target.clone(), 0.0, alloc::vec![effect]);
        let by = |kind| prepare_lit(kind, EmitterMask::Extended, &scene, &motion, 3);
        assert_found(&reference, sum, || by(EstimatorKind::Warped), faults);
    }
}
