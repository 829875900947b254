//! A scene as a function of one parameter, in dual numbers: everything that moves or changes, by
//! the definitions of the changes and by nothing of the machinery under test.

use alloc::vec::Vec;

use drt_geom::Mesh;
use drt_math::{Real, Rgb, ValueChange, Vec3, vec3};
use drt_medium::{Grid, Phase, Volume, henyey_greenstein, rayleigh};
use drt_motion::{Change, GeometryChange, Parameter};

use crate::derivative::contraction::{Contraction, Motion};
use crate::derivative::sensitivity::AdjointSink;
use crate::derivative::tests::changes::{
    D, change, hat, moved, moved_vector, rgb, smooth, turned_normal, with_rate,
};
use crate::model::emitter::Emitter;
use crate::model::scene::{Scene, Target};
use crate::model::sensor::Pinhole;
use crate::model::surface::Property;
use crate::world::World;
use crate::world::vertex::SurfacePoint;

/// A point of a moving surface.
#[derive(Clone, Copy)]
pub(super) struct MovingPoint {
    pub(super) x: Vec3<D>,
    pub(super) ng: Vec3<D>,
    pub(super) ns: Vec3<D>,
    /// Area over area now.
    pub(super) jacobian: D,
}

/// A moving light.
#[derive(Clone, Copy)]
pub(super) struct Light {
    pub(super) strength: Rgb<D>,
    pub(super) position: Vec3<D>,
    pub(super) direction: Vec3<D>,
    pub(super) cutoff_angle: D,
    pub(super) beam_width: D,
}

/// What a medium does to light at a moving point.
#[derive(Clone, Copy)]
pub(super) struct Local {
    pub(super) sigma_t: Rgb<D>,
    pub(super) albedo: Rgb<D>,
    pub(super) emission: Rgb<D>,
}

impl Local {
    pub(super) fn sigma_s(&self) -> Rgb<D> {
        self.sigma_t * self.albedo
    }
    pub(super) fn source(&self) -> Rgb<D> {
        (self.sigma_t - self.sigma_s()) * self.emission
    }
}

/// The scene and its rate of change.
pub(super) struct Moving<'a> {
    pub(super) world: &'a World,
    motion: &'a Motion,
    original: &'a Scene,
    theta: D,
    positions: Vec<Vec<Vec3<D>>>,
    normals: Vec<Option<Vec<Vec3<D>>>>,
    pub(super) camera: Pinhole<D>,
    pub(super) lights: Vec<Light>,
    changes: Vec<(Target, Change<Target>)>,
}

impl<'a> Moving<'a> {
    /// The scene under one parameter; `world` and `motion` are at its value.
    pub(super) fn new(
        original: &'a Scene,
        parameter: &Parameter,
        world: &'a World,
        motion: &'a Motion,
    ) -> Self {
        let changes = parameter.effects.iter().map(|e| {
            let mut target = original.find(&e.target).expect("a known target");
            if let (Target::Shape(i), Change::Property(p)) = (target, &e.change) {
                // A shape's properties are those of what it carries.
                let shape = &original.shapes[i];
                let light = shape.emitter.filter(|_| p.property == "radiance");
                target = light.map_or(Target::Bsdf(shape.bsdf), Target::Emitter);
            }
            let change = match &e.change {
                Change::Geometry(g) => Change::Geometry(g.clone()),
                Change::Property(p) => Change::Property(p.clone()),
                Change::Follow(_) => unreachable!("not used here"),
            };
            (target, change)
        });
        let theta = D::variable(parameter.value, 0);
        let camera = &original.sensors[0].item.sensor;
        let mut moving = Self {
            world,
            motion,
            original,
            theta,
            positions: Vec::new(),
            normals: Vec::new(),
            camera: lifted(camera.pinhole()),
            lights: original.emitters.iter().map(|e| light(&e.item.emitter)).collect(),
            changes: changes.collect(),
        };
        for (i, shape) in original.shapes.iter().enumerate() {
            moving.shape(i, &shape.mesh);
        }
        for i in 0..original.emitters.len() {
            moving.light(i);
        }
        moving.sensor();
        moving.check();
        moving
    }

    fn on(&self, target: Target) -> impl Iterator<Item = &Change<Target>> {
        self.changes.iter().filter(move |(t, _)| *t == target).map(|(_, c)| c)
    }

    fn motions(&self, target: Target) -> impl Iterator<Item = &GeometryChange> {
        self.on(target).filter_map(|c| match c {
            Change::Geometry(g) => Some(g),
            _ => None,
        })
    }

    /// The value of a property after its changes.
    fn changed(&self, target: Target, property: &str, value: Rgb) -> Rgb<D> {
        self.on(target).fold(rgb(value), |v, c| match c {
            Change::Property(p) if p.property == property && p.voxels.is_none() => {
                change(&p.op, v, self.theta)
            }
            _ => v,
        })
    }

    fn shape(&mut self, i: usize, mesh: &Mesh) {
        let mut positions: Vec<Vec3<D>> = mesh.positions.iter().map(|x| x.lift()).collect();
        let mut normals: Option<Vec<Vec3<D>>> =
            mesh.normals.as_ref().map(|n| n.iter().map(|n| n.lift()).collect());
        let mut deformed = false;
        for g in self.motions(Target::Shape(i)) {
            if let GeometryChange::VertexVelocity(v) = g {
                deformed = true;
                for (x, v) in positions.iter_mut().zip(v.iter()) {
                    *x += v.lift() * self.theta;
                }
                continue;
            }
            positions.iter_mut().for_each(|x| *x = moved(g, *x, self.theta));
            for n in normals.iter_mut().flatten() {
                *n = turned_normal(g, *n, self.theta);
            }
        }
        if deformed && let Some(normals) = &mut normals {
            smooth(mesh, &positions, normals);
        }
        self.positions.push(positions);
        self.normals.push(normals);
    }

    fn light(&mut self, i: usize) {
        let target = Target::Emitter(i);
        let mut l = self.lights[i];
        for g in self.motions(target) {
            l.position = moved(g, l.position, self.theta);
            if l.direction.re() != Vec3::ZERO {
                l.direction = moved_vector(g, l.direction, self.theta).normalize();
            }
        }
        let name = match self.original.emitters[i].item.emitter {
            Emitter::Area { .. }
            | Emitter::TexturedArea { .. }
            | Emitter::Constant { .. }
            | Emitter::Envmap { .. } => "radiance",
            Emitter::Point { .. } | Emitter::Spot { .. } => "intensity",
            Emitter::Directional { .. } | Emitter::Projector { .. } => "irradiance",
        };
        l.strength = self.changed(target, name, l.strength.map(Real::re));
        let radians = |name: &str, angle: D| {
            let degrees = Rgb::splat(angle.re().to_degrees());
            self.changed(target, name, degrees).r * 1.0_f64.to_radians()
        };
        l.cutoff_angle = radians("cutoff_angle", l.cutoff_angle);
        l.beam_width = radians("beam_width", l.beam_width);
        self.lights[i] = l;
    }

    fn sensor(&mut self) {
        let target = Target::Sensor(0);
        let mut camera = self.camera;
        for g in self.motions(target) {
            camera.position = moved(g, camera.position, self.theta);
            for axis in [&mut camera.right, &mut camera.up, &mut camera.forward] {
                *axis = moved_vector(g, *axis, self.theta);
            }
        }
        let sensor = &self.original.sensors[0].item.sensor;
        let fov = self.changed(target, "fov", Rgb::splat(sensor.lens().fov)).r;
        // The lens is measured along x.
        let (sin, cos) = (fov * (0.5 * 1.0_f64.to_radians())).sin_cos();
        camera.pixel_size = sin / cos * (2.0 / f64::from(sensor.film()[0]));
        self.camera = camera;
    }

    /// The values must be those of the prepared world: what is compared is one and the same scene.
    fn check(&self) {
        let near = |a: Vec3, b: Vec3| assert!((a - b).max_abs() < 1e-12, "{a:?} {b:?}");
        for (i, shape) in self.world.scene.shapes.iter().enumerate() {
            for (a, b) in self.positions[i].iter().zip(&shape.mesh.positions) {
                near(a.re(), *b);
            }
            for (a, b) in self.normals[i].iter().flatten().zip(shape.mesh.normals.iter().flatten())
            {
                near(a.re(), *b);
            }
        }
        for (l, e) in self.lights.iter().zip(&self.world.scene.emitters) {
            let now = light(&e.item.emitter);
            near(l.position.re(), now.position.re());
            near(l.direction.re(), now.direction.re());
            assert!((l.strength - now.strength).map(Real::re).max_abs() < 1e-12);
        }
        let (a, b) = (&self.camera, self.world.camera.pinhole());
        near(a.position.re(), b.position);
        near(a.right.re(), b.right);
        near(a.up.re(), b.up);
        assert!((a.pixel_size.re() - b.pixel_size).abs() < 1e-14);
    }

    /// The corners of a triangle.
    pub(super) fn triangle(&self, p: &SurfacePoint) -> [Vec3<D>; 3] {
        let corners = self.world.scene.shapes[p.shape as usize].mesh.triangles[p.triangle as usize];
        corners.map(|i| self.positions[p.shape as usize][i as usize])
    }

    pub(super) fn surface(&self, p: &SurfacePoint) -> MovingPoint {
        let [a, b, c] = self.triangle(p);
        let weights = [1.0 - p.bary[0] - p.bary[1], p.bary[0], p.bary[1]];
        let mix = |v: [Vec3<D>; 3]| {
            v[0] * D::from(weights[0]) + v[1] * D::from(weights[1]) + v[2] * D::from(weights[2])
        };
        let cross = (b - a).cross(c - a);
        let area = cross.length();
        let ng = cross.normalize();
        let corners = self.world.scene.shapes[p.shape as usize].mesh.triangles[p.triangle as usize];
        let ns = match &self.normals[p.shape as usize] {
            None => ng,
            Some(normals) => mix(corners.map(|i| normals[i as usize])).normalize(),
        };
        MovingPoint { x: mix([a, b, c]), ng, ns, jacobian: area / area.re() }
    }

    /// A material point inside a medium, and its volume Jacobian over the present one.
    pub(super) fn inside(&self, medium: usize, x: Vec3) -> (Vec3<D>, D) {
        // The field is whatever the estimator chose: any one is right.
        let mut probe = Contraction::new(self.world, self.motion);
        let mut rate = |u: Vec3, j: f64| {
            probe.clear();
            let one = Rgb::new(1.0, 0.0, 0.0);
            probe.volume(medium, x, &one.outer(u), one * j);
            probe.rates[0].r
        };
        let u = vec3(rate(Vec3::X, 0.0), rate(Vec3::Y, 0.0), rate(Vec3::Z, 0.0));
        let x = vec3(with_rate(x.x, u.x), with_rate(x.y, u.y), with_rate(x.z, u.z));
        (x, with_rate(1.0, rate(Vec3::ZERO, 1.0)))
    }

    pub(super) fn local(&self, medium: usize, x: Vec3<D>) -> Local {
        let (target, medium) = (Target::Medium(medium), &self.original.media[medium].item);
        let Some(grid) = medium.grid() else {
            let c = medium.coefficients(x.re());
            return Local {
                sigma_t: self.changed(target, "sigma_t", c.sigma_t),
                albedo: self.changed(target, "albedo", c.albedo),
                emission: self.changed(target, "emission", c.emission),
            };
        };
        let x = self.before_motion(target, x);
        let at = x.re();
        let follow = |value: Rgb, slope: drt_math::RgbVec| {
            let rate = slope.dot(vec3(x.x.eps[0], x.y.eps[0], x.z.eps[0]));
            Rgb::new(
                with_rate(value.r, rate.r),
                with_rate(value.g, rate.g),
                with_rate(value.b, rate.b),
            )
        };
        let (c, slopes) = (medium.coefficients(at), medium.gradients(at));
        let mut sigma_t = follow(c.sigma_t, slopes.sigma_t);
        for c in self.on(target) {
            let Change::Property(p) = c else { continue };
            if p.property != "sigma_t" {
                continue;
            }
            let after = change(&p.op, sigma_t, self.theta);
            sigma_t = match p.voxels {
                None => after,
                Some(v) => {
                    // A change of one voxel counts as much as that voxel does.
                    let ValueChange::Add(a) = p.op else { unreachable!("not used here") };
                    let share = hat(grid.density(), v).value(at).r;
                    sigma_t + rgb(a) * (self.theta * share)
                }
            };
        }
        let inside = |value: Rgb, name: &str| self.changed(target, name, value);
        Local {
            sigma_t,
            albedo: inside(c.albedo, "albedo"),
            emission: inside(c.emission, "emission"),
        }
    }

    /// Where the point at x was in the file: against the order of the changes.
    fn before_motion(&self, target: Target, x: Vec3<D>) -> Vec3<D> {
        let motions: Vec<_> = self.motions(target).collect();
        motions.iter().rev().fold(x, |x, g| moved(g, x, -self.theta))
    }

    /// Coordinates in the unit cube of a medium's grid.
    pub(super) fn in_grid(&self, medium: usize, x: Vec3<D>) -> Vec3<D> {
        let x = self.before_motion(Target::Medium(medium), x);
        let grid = self.original.media[medium].item.grid().expect("voxels").density();
        let m = grid.from_world();
        let [a, b, c] = m.linear.cols.map(|c| c.lift());
        a * x.x + b * x.y + c * x.z + m.translation.lift()
    }

    /// The value of a phase function at a point and a flow cosine.
    pub(super) fn phase(&self, medium: usize, x: Vec3<D>, cosine: D) -> D {
        let target = Target::Medium(medium);
        let at = self.before_motion(target, x);
        self.phase_of(&self.original.media[medium].item.phase, target, at, cosine)
    }

    fn phase_of(&self, phase: &Phase, target: Target, at: Vec3<D>, cosine: D) -> D {
        let constant = |name: &str, value: f64| self.changed(target, name, Rgb::splat(value)).r;
        match phase {
            Phase::Isotropic => henyey_greenstein(constant("g", 0.0), cosine),
            Phase::HenyeyGreenstein { g } => henyey_greenstein(constant("g", *g), cosine),
            Phase::HenyeyGreensteinGrid(grid) => {
                henyey_greenstein(self.in_voxels(target, "g", grid, at), cosine)
            }
            Phase::Rayleigh => rayleigh(cosine),
            Phase::Blend(blend) => {
                let weight = match blend.weight() {
                    Volume::Constant(w) => constant("weight", w.r),
                    Volume::Grid(grid) => self.in_voxels(target, "weight", grid, at),
                };
                let [a, b] = blend.parts().each_ref().map(|p| self.phase_of(p, target, at, cosine));
                a * (D::one() - weight) + b * weight
            }
            Phase::Tabulated(_) | Phase::Sggx(_) => unreachable!("not used here"),
        }
    }

    /// A number that a grid has at a point of it.
    fn in_voxels(&self, target: Target, name: &str, grid: &Grid, x: Vec3<D>) -> D {
        let at = x.re();
        let rate = grid.gradient(at).r.dot(vec3(x.x.eps[0], x.y.eps[0], x.z.eps[0]));
        let mut value = with_rate(grid.value(at).r, rate);
        for c in self.on(target) {
            let Change::Property(p) = c else { continue };
            if p.property == name {
                let after = change(&p.op, Rgb::splat(value), self.theta).r;
                let share = p.voxels.map_or(1.0, |v| hat(grid, v).value(at).r);
                value += (after - value) * share;
            }
        }
        value
    }

    /// A property of a material.
    pub(super) fn material(&self, bsdf: usize, property: Property, value: Rgb) -> Rgb<D> {
        // The world's values are at theta already, so only the rate is new.
        let named = |name: &str| Property::from_name(name) == Ok(property);
        self.on(Target::Bsdf(bsdf)).fold(rgb(value), |v, c| match c {
            Change::Property(p) if named(&p.property) => {
                assert_eq!(self.theta.re, 0.0, "changes of materials start from the file's value");
                change(&p.op, v, self.theta)
            }
            _ => v,
        })
    }
}

fn light(emitter: &Emitter) -> Light {
    let still = Light {
        strength: Rgb::splat(D::zero()),
        position: Vec3::zero(),
        direction: Vec3::zero(),
        cutoff_angle: D::zero(),
        beam_width: D::zero(),
    };
    match *emitter {
        Emitter::Area { radiance }
        | Emitter::TexturedArea { radiance, .. }
        | Emitter::Constant { radiance }
        | Emitter::Envmap { radiance, .. } => Light { strength: rgb(radiance), ..still },
        Emitter::Point { position, intensity } => {
            Light { strength: rgb(intensity), position: position.lift(), ..still }
        }
        Emitter::Spot { position, direction, intensity, cutoff_angle, beam_width } => Light {
            strength: rgb(intensity),
            position: position.lift(),
            direction: direction.lift(),
            cutoff_angle: D::from(cutoff_angle),
            beam_width: D::from(beam_width),
        },
        Emitter::Directional { direction, irradiance } => {
            Light { strength: rgb(irradiance), direction: direction.lift(), ..still }
        }
        Emitter::Projector { .. } => unreachable!("these scenes have none"),
    }
}

fn lifted(p: &Pinhole) -> Pinhole<D> {
    Pinhole {
        position: p.position.lift(),
        right: p.right.lift(),
        up: p.up.lift(),
        forward: p.forward.lift(),
        pixel_size: D::from(p.pixel_size),
        principal: p.principal.map(D::from),
    }
}
