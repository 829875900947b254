//! Small scenes put together at random, to find what nobody thought of: a few bodies in contact, through each other or apart, on a
//! floor, in a room or in the open, by every kind of light and filter, with and without media, some exactly aligned with each other and
//! with the pixels.
//!
//! A scene is a function of its number, so that one which fails is found again.

use std::f64::consts::{FRAC_PI_2, PI};

use drt_estimators::emitter::Emitter;
use drt_estimators::surface::{Bsdf, Distribution, Phong, RoughConductor};
use drt_geom::Mesh;
use drt_geom::procedural::{cube, disk, icosphere, rectangle, uv_sphere};
use drt_math::{Rgb, Rng, Vec3, vec3};
use drt_medium::{Homogeneous, Phase};
use drt_motion::Effect;

use super::effects::{add, grow, translate, turn};
use super::filters::FILTERS;
use super::set::{diffuse, placed};
use super::textures::{by_place, coloured};
use super::{Cell, Set, Stage};
use crate::Result;

/// A scene in the making.
struct Draft {
    rng: Rng,
    set: Set,
    cells: Vec<Cell>,
}

/// The scene with a number, and two or three derivatives of it.
///
/// # Errors
/// When the library rejects the scene.
pub fn scene(number: u32) -> Result<Stage> {
    let mut rng = Rng::new(45, u64::from(number), 0);
    let aligned = chance(&mut rng, 0.3);
    let depth = 2 + below(&mut rng, 3) as u32;
    let height = if aligned { 0.5 } else { between(&mut rng, 0.5, 1.6) };
    let side = if aligned { 0.0 } else { between(&mut rng, -1.5, 1.5) };
    let (eye, target) = (vec3(side, height, 2.6), vec3(0.0, 0.5, 0.0));
    let fov = between(&mut rng, 30.0, 55.0);
    let set = if aligned {
        Set::facing(eye, target, fov, depth)?
    } else {
        Set::new(eye, target, fov, depth)?
    };
    let set = set.filter(FILTERS[below(&mut rng, FILTERS.len())])?;
    let mut draft = Draft { rng, set, cells: Vec::new() };
    draft.surroundings();
    draft.bodies(aligned)?;
    draft.medium()?;
    draft.lights();
    draft.camera();
    let Draft { mut rng, set, mut cells } = draft;
    // Three at most, any of them.
    while cells.len() > 3 {
        let _ = cells.swap_remove(below(&mut rng, cells.len()));
    }
    Ok(Stage { samples: 256, boundary_samples: 256, ..Stage::new("random", set.scene, cells) })
}

impl Draft {
    /// A floor, and sometimes a wall behind.
    fn surroundings(&mut self) {
        let floor = placed(&rectangle(), vec3(2.0, 2.0, 1.0), Vec3::X, -FRAC_PI_2, Vec3::ZERO);
        self.shape("floor", floor, diffuse([0.6, 0.5, 0.4]));
        self.cell("reflectance", add("floor", "reflectance", [0.3, -0.2, 0.1]));
        if chance(&mut self.rng, 0.4) {
            let wall =
                placed(&rectangle(), vec3(2.0, 1.5, 1.0), Vec3::X, 0.0, vec3(0.0, 1.0, -1.2));
            let bsdf = self.material();
            self.shape("wall", wall, bsdf);
            self.cell("wall moves", translate("wall", vec3(0.3, 0.2, 0.7)));
        }
    }

    /// One to three bodies that float, stand on the floor, or go into it.
    fn bodies(&mut self, aligned: bool) -> Result<()> {
        for (i, name) in (0..=below(&mut self.rng, 3)).zip(["first", "second", "third"]) {
            let rng = &mut self.rng;
            let size =
                vec3(between(rng, 0.15, 0.4), between(rng, 0.15, 0.4), between(rng, 0.15, 0.4));
            let (mesh, round) = match below(rng, 6) {
                0 => (uv_sphere(6), true),
                1 => (uv_sphere(6).with_smooth_normals(), true),
                2 => (icosphere(1), true),
                3 => (disk(12), false),
                4 => (rectangle(), false),
                _ => (cube(), false),
            };
            let x = i as f64 * 0.7 - 0.5;
            let (angle, x) = if aligned {
                (0.0, if i == 0 { 0.0 } else { x })
            } else {
                (between(rng, 0.0, PI), x)
            };
            let rest = below(rng, 3);
            let lift = match rest {
                0 => between(rng, 0.2, 0.6),
                1 => 0.0,
                _ => -0.5 * size.y,
            };
            let axis = if rest == 0 && !aligned { vec3(0.3, 1.0, 0.2) } else { Vec3::Y };
            let place = vec3(x, size.y + lift, between(rng, -0.4, 0.4));
            let mut mesh = placed(&mesh, size, axis, angle, place);
            let bsdf = if chance(&mut self.rng, 0.15) && round {
                mesh = by_place(mesh)?;
                coloured()?
            } else {
                self.material()
            };
            if round && chance(&mut self.rng, 0.1) {
                self.set = self.set.clone().lamp(name, mesh, Rgb::new(2.0, 1.5, 1.0));
            } else {
                self.shape(name, mesh, bsdf);
            }
            // What stands on the floor slides on it: as it parts from the floor its image has a kink.
            let free = if rest == 1 { vec3(1.0, 0.0, 1.0) } else { Vec3::splat(1.0) };
            let within = |v: Vec3| vec3(v.x * free.x, v.y * free.y, v.z * free.z);
            let along = within(self.direction());
            self.cell("moves", translate(name, along * 0.7));
            let about = if rest == 1 { Vec3::Y } else { self.direction() };
            self.cell("turns", turn(name, about, place));
            self.cell("grows", grow(name, within(vec3(0.5, 0.8, 0.3)), place));
        }
        Ok(())
    }

    /// Nothing, a box of fog that stands on the floor or above it, or a translucent ball.
    fn medium(&mut self) -> Result<()> {
        let rng = &mut self.rng;
        if !chance(rng, 0.5) {
            return Ok(());
        }
        let sigma_t =
            Rgb::new(between(rng, 0.3, 1.5), between(rng, 0.3, 1.5), between(rng, 0.3, 1.5));
        let fog = Homogeneous::new(sigma_t, Rgb::new(0.9, 0.8, 0.6), Rgb::ZERO)?;
        let phase = Phase::henyey_greenstein(between(rng, -0.3, 0.6))?;
        let lift = [0.0, 0.05, -0.1][below(rng, 3)];
        let border = if chance(rng, 0.7) {
            placed(&cube(), vec3(1.1, 0.6, 1.1), Vec3::Y, 0.0, vec3(0.0, 0.6 + lift, 0.0))
        } else {
            placed(&icosphere(2), Vec3::splat(0.5), Vec3::Y, 0.3, vec3(0.1, 0.9, 0.3))
        };
        self.set =
            self.set.clone().medium("fog", fog, phase).interface("border", border, "fog", None);
        self.cell("extinction", add("fog", "sigma_t", [0.5, 0.2, 0.4]));
        let rise = if lift == 0.0 { 0.0 } else { 0.1 };
        self.cell("border moves", translate("border", vec3(0.4, rise, -0.3)));
        Ok(())
    }

    /// One or two lights: a lamp, which may lie in a ceiling's plane, a sky, a point, a sun or a spot.
    fn lights(&mut self) {
        for i in 0..=below(&mut self.rng, 2) {
            let kind = below(&mut self.rng, 6);
            let (name, set) = (["light", "other"][i], self.set.clone());
            let rng = &mut self.rng;
            let x = between(rng, -0.8, 0.8);
            // Two lamps in one plane may be in one place, where it is not known which shines.
            let height = 2.2 - 0.3 * i as f64;
            let up = vec3(x, height, between(rng, -0.5, 0.8));
            self.set = match kind {
                0 => set.light(name, Emitter::Constant { radiance: Rgb::new(0.8, 0.9, 1.0) }),
                1 => set.light(
                    name,
                    Emitter::Point { position: up, intensity: Rgb::new(4.0, 3.0, 5.0) },
                ),
                2 => {
                    let (direction, irradiance) = (vec3(-x, -1.0, -0.4), Rgb::new(1.0, 1.5, 2.0));
                    set.light(name, Emitter::Directional { direction, irradiance })
                }
                3 => set.light(
                    name,
                    Emitter::Spot {
                        position: up,
                        direction: vec3(-x, -2.0, -0.3),
                        intensity: Rgb::new(8.0, 7.0, 6.0),
                        cutoff_angle: 0.6,
                        beam_width: 0.3,
                    },
                ),
                _ => {
                    let half = between(rng, 0.2, 0.6);
                    let lamp = placed(&rectangle(), vec3(half, half, 1.0), Vec3::X, FRAC_PI_2, up);
                    let ceiling = placed(
                        &rectangle(),
                        vec3(2.0, 2.0, 1.0),
                        Vec3::X,
                        FRAC_PI_2,
                        vec3(0.0, 2.2, 0.0),
                    );
                    let set = set.lamp(name, lamp, Rgb::new(5.0, 6.0, 4.0));
                    let has_ceiling =
                        set.scene.shapes.iter().any(|s| s.id.as_deref() == Some("ceiling"));
                    match chance(rng, 0.3) && !has_ceiling {
                        true => set.shape("ceiling", ceiling, diffuse([0.5; 3])),
                        false => set,
                    }
                }
            };
            let in_plane = self.set.scene.shapes.iter().any(|s| s.id.as_deref() == Some("ceiling"));
            // In the ceiling's plane it stays there.
            let along =
                if in_plane && kind > 3 { vec3(0.6, 0.0, 0.4) } else { vec3(0.6, -0.3, 0.4) };
            match kind {
                0 => {}
                2 => self.cell("light turns", turn(name, vec3(0.5, 0.1, 1.0), Vec3::ZERO)),
                _ => self.cell("light moves", translate(name, along)),
            }
        }
    }

    fn camera(&mut self) {
        self.cell("camera moves", translate("camera", vec3(0.4, 0.2, -0.3)));
        self.cell("camera turns", turn("camera", vec3(0.2, 1.0, 0.3), vec3(0.0, 0.6, 2.0)));
    }

    fn cell(&mut self, name: &str, effect: Effect) {
        let target = effect.target.clone();
        self.cells.push(Cell::new(&format!("{target}: {name}"), [effect]).samples(1024));
    }

    fn shape(&mut self, id: &str, mesh: Mesh, bsdf: Bsdf) {
        self.set = self.set.clone().shape(id, mesh, bsdf);
    }

    fn direction(&mut self) -> Vec3 {
        let rng = &mut self.rng;
        vec3(between(rng, -1.0, 1.0), between(rng, -1.0, 1.0), between(rng, -1.0, 1.0))
    }

    fn material(&mut self) -> Bsdf {
        let rng = &mut self.rng;
        let colour = [between(rng, 0.2, 0.8), between(rng, 0.2, 0.8), between(rng, 0.2, 0.8)];
        if chance(rng, 0.8) {
            return diffuse(colour);
        }
        if chance(rng, 0.5) {
            let (reflectance, exponent) = (Rgb::splat(0.4), between(rng, 5.0, 40.0));
            return Bsdf::Phong(Phong { reflectance, exponent, ..Phong::default() });
        }
        let (distribution, alpha) = (Distribution::Ggx, between(rng, 0.2, 0.5));
        Bsdf::RoughConductor(RoughConductor { distribution, alpha, ..RoughConductor::default() })
    }
}

fn between(rng: &mut Rng, low: f64, high: f64) -> f64 {
    low + (high - low) * rng.next_f64()
}

fn below(rng: &mut Rng, n: usize) -> usize {
    ((rng.next_f64() * n as f64) as usize).min(n - 1)
}

fn chance(rng: &mut Rng, part: f64) -> bool {
    rng.next_f64() < part
}
