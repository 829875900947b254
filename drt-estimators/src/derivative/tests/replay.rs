//! A recorded path's value as a function of one parameter, over the density that it was sampled
//! with: the measurement contribution written down straight away, factor by factor.

use alloc::vec::Vec;

use drt_geom::ray_plane;
use drt_math::{Real, Rgb, Vec3};

use crate::derivative::tests::changes::{D, rgb, with_rate};
use crate::derivative::tests::fade;
use crate::derivative::tests::moving::Moving;
use crate::model::emitter::Emitter;
use crate::model::surface::{Numbers, Property, PropertySet};
use crate::sampling::record::Node;
use crate::sampling::record::PathRecord;
use crate::sampling::trace::{Connection, Endpoint};
use crate::world::Crossing;
use crate::world::lights::{LightKind, LightSample};
use crate::world::vertex::{Kind, Vertex};

/// Gauss's rule of two points on [0, 1], exact for cubics: extinction is one along a line within
/// a voxel, as is its gradient times a velocity linear along the line.
const GAUSS: [f64; 2] = [0.211_324_865_405_187_1, 0.788_675_134_594_812_9];

/// The numbers of a material that change with the parameter.
#[derive(Clone, Copy)]
struct Rates<'a, 'b> {
    scene: &'a Moving<'b>,
    bsdf: usize,
    hidden: PropertySet,
}

impl Numbers<D> for Rates<'_, '_> {
    fn number(self, property: Property, value: f64) -> D {
        self.colour(property, Rgb::splat(value)).r
    }

    fn colour(self, property: Property, value: Rgb) -> Rgb<D> {
        if self.hidden.contains(property) {
            return value.map(D::from);
        }
        self.scene.material(self.bsdf, property, value)
    }

    fn without(self, hidden: PropertySet) -> Self {
        Self { hidden: self.hidden.union(hidden), ..self }
    }
}

/// A vertex as it moves.
#[derive(Clone, Copy)]
struct End {
    x: Vec3<D>,
    /// Unit geometric normal, on surfaces.
    ng: Option<Vec3<D>>,
    jacobian: D,
}

/// A stretch of the path and what it passes.
struct Stretch<'a> {
    start: Vec3<D>,
    dir: Vec3<D>,
    length: D,
    medium: Option<usize>,
    crossings: &'a [Crossing],
}

struct Replay<'a> {
    scene: &'a Moving<'a>,
    record: &'a PathRecord,
    children: Vec<Vec<usize>>,
}

/// The value of the record; `slope` is the filter's gradient over the density of the image point.
pub(super) fn replay(scene: &Moving<'_>, record: &PathRecord, slope: [f64; 2]) -> Rgb<D> {
    let mut children = alloc::vec![Vec::new(); record.nodes.len()];
    for (k, node) in record.nodes.iter().enumerate() {
        if let Some(a) = &node.arrival {
            children[a.parent as usize].push(k);
        }
    }
    let replay = Replay { scene, record, children };
    replay.value(slope)
}

fn black() -> Rgb<D> {
    Rgb::splat(D::zero())
}

/// The value over what it is now.
fn relative(v: D) -> D {
    v / v.re()
}

impl Replay<'_> {
    fn value(&self, slope: [f64; 2]) -> Rgb<D> {
        let camera = &self.scene.camera;
        let mut sum = black();
        for &k in &self.children[0] {
            let seen = match self.end(k) {
                Some(end) => end.x,
                // A direction has no parallax.
                None => camera.position + self.direction(k).lift(),
            };
            let p = camera.project(seen);
            let off = [0, 1].map(|i| (p.pixel[i] - p.pixel[i].re()) * slope[i]);
            let filter = off[0] + off[1] + self.record.nodes[0].value.r;
            sum += self.arriving(0, k) * (filter * relative(p.importance));
        }
        sum
    }

    fn direction(&self, k: usize) -> Vec3 {
        self.record.nodes[k].arrival.as_ref().expect("not the camera").dir
    }

    fn vertex(&self, v: &Vertex) -> End {
        match &v.kind {
            Kind::Surface(s) => {
                let p = self.scene.surface(s);
                End { x: p.x, ng: Some(p.ng), jacobian: p.jacobian }
            }
            Kind::Volume(_) => {
                let (x, jacobian) = self.scene.inside(v.medium.expect("a medium"), v.x);
                End { x, ng: None, jacobian }
            }
            Kind::Point => End { x: self.scene.camera.position, ng: None, jacobian: D::one() },
        }
    }

    /// Where a node is; `None` for the environment.
    fn end(&self, k: usize) -> Option<End> {
        match &self.record.nodes[k].arrival {
            None => Some(End { x: self.scene.camera.position, ng: None, jacobian: D::one() }),
            Some(_) => self.record.nodes[k].vertex().map(|v| self.vertex(v)),
        }
    }

    /// What child k brings to its parent, over the density of its distance.
    fn arriving(&self, parent: usize, k: usize) -> Rgb<D> {
        let node = &self.record.nodes[k];
        let arrival = node.arrival.as_ref().expect("not the camera");
        let start = self.end(parent).expect("paths leave vertices").x;
        let mut path = Stretch {
            start,
            dir: arrival.dir.lift(),
            length: D::from(arrival.distance),
            medium: arrival.start_medium,
            crossings: &self.record.crossings[node.crossings.clone()],
        };
        let mut geometry = D::one();
        if let Some(end) = self.end(k) {
            let d = end.x - start;
            path.length = d.length();
            path.dir = d / path.length;
            geometry = geometric_term(&end, path.dir, path.length);
        }
        rgb(arrival.arrival) * self.transmittance(&path) * geometry * self.received(k)
    }

    /// What leaves a node towards its parent.
    fn received(&self, k: usize) -> Rgb<D> {
        let node = &self.record.nodes[k];
        let arrival = node.arrival.as_ref().expect("not the camera");
        let seen = D::from(arrival.emission_weight);
        let scene = self.scene;
        match &arrival.end {
            Endpoint::Environment => {
                let sky = scene.world.lights.environment().expect("it was met");
                scene.lights[sky.emitter].strength * seen
            }
            Endpoint::Surface(v) => {
                let s = v.surface().expect("a surface");
                let emitter = scene.world.scene.shapes[s.shape as usize].emitter;
                let emitter = emitter.filter(|_| s.ng.dot(arrival.dir) < 0.0);
                let emitted = emitter.map_or(black(), |e| scene.lights[e].strength * seen);
                emitted + self.collected(k, v)
            }
            Endpoint::Volume(v, _) => {
                let c = scene.local(v.medium.expect("a medium"), self.vertex(v).x);
                c.source() * seen + c.sigma_s() * self.collected(k, v)
            }
        }
    }

    fn collected(&self, k: usize, v: &Vertex) -> Rgb<D> {
        let node = &self.record.nodes[k];
        let here = self.vertex(v);
        let parent = node.arrival.as_ref().expect("not the camera").parent as usize;
        let behind = self.end(parent).expect("a vertex");
        let wo = (behind.x - here.x).normalize();
        let mut sum = black();
        for (c, crossings) in &self.record.connections[node.connections.clone()] {
            sum += self.connection(v, &here, wo, c, &self.record.crossings[crossings.clone()]);
        }
        sum + self.continued(k, node, v, &here, wo)
    }

    fn continued(&self, k: usize, node: &Node, v: &Vertex, here: &End, wo: Vec3<D>) -> Rgb<D> {
        let mut sum = black();
        for &c in &self.children[k] {
            let wi = match self.end(c) {
                Some(end) => (end.x - here.x).normalize(),
                None => node.wi.lift(),
            };
            let f = self.scattering(v, wo, wi);
            sum += f * self.arriving(k, c) * D::from(node.inv_pdf);
        }
        sum
    }

    fn connection(
        &self,
        v: &Vertex,
        here: &End,
        wo: Vec3<D>,
        c: &Connection,
        crossings: &[Crossing],
    ) -> Rgb<D> {
        let (light, moving) = (&c.light, &self.scene.lights[c.light.emitter]);
        let mut path = Stretch {
            start: here.x,
            dir: light.w.lift(),
            length: D::from(light.distance),
            medium: c.start_medium,
            crossings,
        };
        let mut towards = |x: Vec3<D>| {
            let d = x - here.x;
            path.length = d.length();
            path.dir = d / path.length;
        };
        let incident = match &light.kind {
            LightKind::Area(s) => {
                let p = self.scene.surface(s);
                towards(p.x);
                let end = End { x: p.x, ng: Some(p.ng), jacobian: p.jacobian };
                moving.strength * geometric_term(&end, path.dir, path.length)
            }
            LightKind::Position => {
                towards(moving.position);
                moving.strength * (self.falloff(light, path.dir) / path.length.squared())
            }
            LightKind::Direction => {
                path.dir = -moving.direction;
                moving.strength
            }
            LightKind::Environment => moving.strength,
        };
        let transport = rgb(c.transport) * self.transmittance(&path);
        self.scattering(v, wo, path.dir) * transport * incident
    }

    /// The fall of a spot's intensity off its axis, in the direction it is seen from by `w`.
    fn falloff(&self, light: &LightSample, w: Vec3<D>) -> D {
        let l = &self.scene.lights[light.emitter];
        let emitter = &self.scene.world.scene.emitters[light.emitter].item.emitter;
        if !matches!(emitter, Emitter::Spot { .. }) {
            return D::one();
        }
        let angle = (-w.dot(l.direction)).acos();
        if angle.re <= l.beam_width.re {
            D::one()
        } else if angle.re >= l.cutoff_angle.re {
            D::zero()
        } else {
            (l.cutoff_angle - angle) / (l.cutoff_angle - l.beam_width)
        }
    }

    fn scattering(&self, v: &Vertex, wo: Vec3<D>, wi: Vec3<D>) -> Rgb<D> {
        match &v.kind {
            Kind::Surface(s) => {
                let p = self.scene.surface(s);
                let shape = &self.scene.world.scene.shapes[s.shape as usize];
                let bsdf = &self.scene.world.scene.bsdfs[shape.bsdf].item;
                let numbers =
                    Rates { scene: self.scene, bsdf: shape.bsdf, hidden: PropertySet::NONE };
                let value = bsdf.value(numbers, None, [wo, wi, p.ns]);
                if shape.mesh.normals.is_none() {
                    return value;
                }
                value * (fade(p.ns.dot(wo)) * fade(p.ng.dot(wi)))
            }
            _ => {
                let m = v.medium.expect("a medium");
                Rgb::splat(self.scene.phase(m, self.vertex(v).x, -wo.dot(wi)))
            }
        }
    }

    /// Transmittance over what it is now.
    fn transmittance(&self, path: &Stretch<'_>) -> Rgb<D> {
        let mut depth = black();
        let (mut medium, mut begin) = (path.medium, D::zero());
        for c in path.crossings {
            let (t, _) = ray_plane(path.start, path.dir, self.scene.triangle(&c.point));
            depth += self.depth(path, medium, begin, t);
            (medium, begin) = (c.after, t);
        }
        depth += self.depth(path, medium, begin, path.length);
        depth.map(|d| relative((-d).exp()))
    }

    fn depth(&self, path: &Stretch<'_>, medium: Option<usize>, begin: D, end: D) -> Rgb<D> {
        let Some(m) = medium else { return black() };
        let length = end - begin;
        if !length.re().is_finite() {
            return black();
        }
        if self.scene.world.medium(m).homogeneous().is_some() {
            return self.scene.local(m, path.start).sigma_t * length;
        }
        self.depth_of_voxels(path, m, begin, end)
    }

    /// The optical depth between two distances, voxel by voxel.
    fn depth_of_voxels(&self, path: &Stretch<'_>, m: usize, begin: D, end: D) -> Rgb<D> {
        let mut sum = black();
        for part in self.voxel_faces(path, m, begin, end).windows(2) {
            let length = part[1] - part[0];
            for node in GAUSS {
                let x = path.start + path.dir * (part[0] + length * node);
                sum += self.scene.local(m, x).sigma_t * (length * 0.5);
            }
        }
        sum
    }

    /// Where a stretch passes from voxel to voxel between two distances, those included.
    fn voxel_faces(&self, path: &Stretch<'_>, m: usize, begin: D, end: D) -> Vec<D> {
        let size = self.scene.world.medium(m).grid().expect("voxels").density().size();
        let origin = self.scene.in_grid(m, path.start);
        let dir = (self.scene.in_grid(m, path.start + path.dir) - origin).to_array();
        let origin = origin.to_array();
        let mut faces = alloc::vec![begin, end];
        for axis in 0..3 {
            let n = size[axis] as u32 - 1;
            let at = |k| (D::from(f64::from(k) / f64::from(n)) - origin[axis]) / dir[axis];
            faces.extend((0..=n).map(at).filter(|t| begin.re < t.re && t.re < end.re));
        }
        faces.sort_by(|a, b| a.re.total_cmp(&b.re));
        faces
    }
}

/// The geometric term of arriving at an end, times the end's Jacobian, over what it is now.
fn geometric_term(end: &End, dir: Vec3<D>, length: D) -> D {
    let cosine = end.ng.map_or(with_rate(1.0, 0.0), |n| n.dot(dir));
    relative(cosine / length.squared()) * end.jacobian
}
