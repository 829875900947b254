//! Rays through a prepared scene: followed to the first surface that scatters, or up to a point.

use alloc::vec::Vec;

use drt_geom::{Hit, Skip, coincide};
use drt_math::{Ray, Rgb, Rng, Vec3};
use drt_medium::TrackingStats;

use crate::model::rendering::Counters;
use crate::model::surface::agree;
use crate::world::geometry::Prim;
use crate::world::vertex::{Kind, SurfacePoint, Vertex};
use crate::world::{Crossing, RayPath, World, intervals};

/// What a ray goes through besides null interfaces.
#[derive(Clone, Copy, PartialEq)]
enum Past {
    Nothing,
    /// All area emitters.
    Emitters,
    /// One triangle.
    Facet(u32),
}

impl World {
    fn skip_of(v: &Vertex) -> Skip {
        match &v.kind {
            Kind::Surface(s) => Skip::one(s.prim),
            Kind::Volume(Some(c)) => Skip::one(c.point.prim),
            _ => Skip::NOTHING,
        }
    }

    /// Follows a ray from `v` along the unit direction `dir` to the first surface that scatters.
    pub(crate) fn cast(&self, v: &Vertex, dir: Vec3, path: &mut RayPath, counters: &mut Counters) {
        path.medium = self.medium_toward(v, dir);
        self.cast_from(v.x, Self::skip_of(v), dir, path, counters, v, Past::Nothing);
    }

    /// As [`World::cast`], past area emitters as if they were null interfaces.
    pub(crate) fn cast_past_emitters(
        &self,
        v: &Vertex,
        dir: Vec3,
        path: &mut RayPath,
        counters: &mut Counters,
    ) {
        path.medium = self.medium_toward(v, dir);
        self.cast_from(v.x, Self::skip_of(v), dir, path, counters, v, Past::Emitters);
    }

    /// As [`World::cast`] from a point on an edge, past the edge's own faces.
    pub(crate) fn cast_past(
        &self,
        x: Vec3,
        faces: [u32; 2],
        medium: Option<usize>,
        dir: Vec3,
        path: &mut RayPath,
        counters: &mut Counters,
    ) {
        path.medium = medium;
        let v = Vertex { x, medium, kind: Kind::Point };
        self.cast_from(x, Skip::two(faces[0], faces[1]), dir, path, counters, &v, Past::Nothing);
    }

    /// As [`World::cast`], along a single direction that a smooth surface reflects or refracts into. If it leads to the other side of the facet than of
    /// the shading normal, the ray goes through the facet by which it comes back to the latter side.
    pub(crate) fn cast_bent(
        &self,
        v: &Vertex,
        dir: Vec3,
        path: &mut RayPath,
        counters: &mut Counters,
    ) {
        self.cast(v, dir, path, counters);
        let (Kind::Surface(s), Some((end, _))) = (&v.kind, path.end) else { return };
        let outwards = |s: &SurfacePoint| s.ng.dot(dir) > 0.0;
        let returns = end.shape == s.shape && outwards(&end) != outwards(s);
        if returns && self.is_smooth(s) && !agree(s.ng, s.ns, dir) {
            let past = Past::Facet(end.prim);
            self.cast_from(v.x, Self::skip_of(v), dir, path, counters, v, past);
        }
    }

    #[allow(clippy::too_many_arguments)]
    #[inline]
    fn cast_from(
        &self,
        origin: Vec3,
        skip: Skip,
        dir: Vec3,
        path: &mut RayPath,
        counters: &mut Counters,
        v: &Vertex,
        past: Past,
    ) {
        path.crossings.clear();
        path.end = None;
        path.length = f64::INFINITY;
        let mut medium = path.medium;
        // A volume vertex that touches a surface meets it at once when it looks into it.
        if let Kind::Volume(Some(c)) = &v.kind
            && (c.point.ng.dot(dir) > 0.0) != c.front
        {
            if !self.is_null(c.point.shape) {
                path.end = Some((c.point, v.x));
                path.length = 0.0;
                return;
            }
            medium = self.medium_on_side(&c.point, !c.front, medium);
            path.crossings.push(Crossing { point: c.point, x: v.x, t: 0.0, after: medium });
        }
        counters.rays += 1;
        let ray = Ray { origin, dir, t_max: f64::INFINITY };
        let end = if self.any_null || past != Past::Nothing {
            let blocks = |prim: u32| {
                let shape = self.geometry.prim(prim).shape;
                let passed = match past {
                    Past::Nothing => false,
                    Past::Emitters => self.scene.shapes[shape as usize].emitter.is_some(),
                    Past::Facet(facet) => prim == facet,
                };
                !(self.is_null(shape) || passed)
            };
            let end = self.geometry.bvh.closest_through(&ray, skip, blocks, &mut path.hits);
            if let Some(end) = &end {
                self.leave_beyond(&ray, end, &mut path.hits);
            }
            self.cross(path, &ray, medium);
            end
        } else {
            self.geometry.bvh.foremost(&ray, skip)
        };
        if let Some(hit) = end {
            path.end = Some(self.point(hit.prim, hit.bary));
            path.length = hit.t;
        }
    }

    /// Takes away the hits on interfaces that coincide with the surface on which a ray ends: they lie beyond it, from whichever
    /// side the ray comes, as they do for rays that start on that surface. So fog that stands on a floor begins at the floor.
    fn leave_beyond(&self, ray: &Ray, end: &Hit, hits: &mut Vec<Hit>) {
        hits.retain(|hit| !(hit.is_near(end) && self.coincide(ray, end, hit)));
    }

    /// Whether two triangles coincide where a ray meets them.
    #[cold]
    pub(super) fn coincide(&self, ray: &Ray, a: &Hit, b: &Hit) -> bool {
        coincide(ray, (a, self.corners(a.prim)), (b, self.corners(b.prim)))
    }

    /// The corners of a triangle in the world.
    fn corners(&self, prim: u32) -> [Vec3; 3] {
        let Prim { shape, triangle } = self.geometry.prim(prim);
        let corners = self.scene.shapes[shape as usize].mesh.triangle(triangle);
        match self.scene.placement(shape as usize) {
            Some(to_world) => corners.map(|x| to_world.point(x)),
            None => corners,
        }
    }

    /// Brings hits on interfaces that coincide into the order in which media follow each other: one that ends the medium
    /// a ray is in comes before one that begins another.
    #[cold]
    fn order_coincident(&self, hits: &mut [Hit], ray: &Ray, mut medium: Option<usize>) {
        for i in 0..hits.len() {
            let coincides = |hit: &&Hit| self.coincide(ray, &hits[i], hit);
            let same = hits[i + 1..].iter().take_while(coincides).count();
            let sides = |hit: &Hit| {
                let (point, _) = self.point(hit.prim, hit.bary);
                let out = point.ng.dot(ray.dir) > 0.0;
                let on = |front: bool| self.medium_on_side(&point, front, medium);
                (out, on(!out), on(out))
            };
            // The nearest that begins in the medium, else one that is left.
            let next = (i..=i + same).find(|k| sides(&hits[*k]).1 == medium);
            let next = next.or_else(|| (i..=i + same).find(|k| sides(&hits[*k]).0)).unwrap_or(i);
            medium = sides(&hits[next]).2;
            hits[i..=next].rotate_right(1);
        }
    }

    /// Crosses the interfaces that a path's hits are on.
    fn cross(&self, path: &mut RayPath, ray: &Ray, mut medium: Option<usize>) {
        if path.hits.windows(2).any(|h| h[0].is_near(&h[1])) {
            self.order_coincident(&mut path.hits, ray, medium);
        }
        for hit in &path.hits {
            let (point, x) = self.point(hit.prim, hit.bary);
            medium = self.medium_on_side(&point, point.ng.dot(ray.dir) > 0.0, medium);
            path.crossings.push(Crossing { point, x, t: hit.t, after: medium });
        }
    }

    /// The first hit of a ray on what is no null interface, even where one coincides with it.
    pub(crate) fn nearest_scattering(&self, ray: &Ray, skip: Skip) -> Option<Hit> {
        if !self.any_null {
            return self.geometry.bvh.closest(ray, skip);
        }
        let blocks = |prim: u32| !self.is_null(self.geometry.prim(prim).shape);
        self.geometry.bvh.closest_through(ray, skip, blocks, &mut Vec::new())
    }

    /// The null interfaces between `v` and a point at `distance` along the unit direction `dir`;
    /// false when a surface blocks. `target` is excluded from blocking.
    pub(crate) fn connect(
        &self,
        v: &Vertex,
        dir: Vec3,
        distance: f64,
        target: Option<u32>,
        path: &mut RayPath,
        counters: &mut Counters,
    ) -> bool {
        path.medium = self.medium_toward(v, dir);
        let Skip([start, _]) = Self::skip_of(v);
        let skip = target.map_or(Skip::one(start), |end| Skip::two(start, end));
        self.connect_from(v, skip, dir, distance, path, counters)
    }

    /// Begins a path of a given length, with the surface that its start touches. The medium it goes on in; `None` where that
    /// surface blocks.
    #[inline(always)]
    fn begin(
        &self,
        v: &Vertex,
        dir: Vec3,
        distance: f64,
        path: &mut RayPath,
    ) -> Option<Option<usize>> {
        path.crossings.clear();
        path.end = None;
        path.length = distance;
        let mut medium = path.medium;
        if let Kind::Volume(Some(c)) = &v.kind
            && (c.point.ng.dot(dir) > 0.0) != c.front
        {
            if !self.is_null(c.point.shape) {
                return None;
            }
            medium = self.medium_on_side(&c.point, !c.front, medium);
            path.crossings.push(Crossing { point: c.point, x: v.x, t: 0.0, after: medium });
        }
        Some(medium)
    }

    /// As [`World::connect`], through all that lets light go straight on, and how much of it that does; zero where something
    /// blocks.
    #[cold]
    pub(crate) fn connect_straight(
        &self,
        v: &Vertex,
        dir: Vec3,
        distance: f64,
        path: &mut RayPath,
        counters: &mut Counters,
    ) -> Rgb {
        path.medium = self.medium_toward(v, dir);
        let Some(medium) = self.begin(v, dir, distance, path) else { return Rgb::ZERO };
        counters.rays += 1;
        let ray = Ray { origin: v.x, dir, t_max: short_of(v.x, distance) };
        path.hits.clear();
        let blocks = |prim: u32| {
            let shape = self.geometry.prim(prim).shape;
            !self.is_null(shape) && !self.bsdf_of(shape).passes_straight()
        };
        if self.geometry.bvh.crossings(&ray, Self::skip_of(v), blocks, &mut path.hits) {
            return Rgb::ZERO;
        }
        let met = path.crossings.len();
        self.cross(path, &ray, medium);
        let through = |s: &SurfacePoint| {
            let at = self.texture_point(s);
            self.bsdf_of(s.shape).straight(Some(&at), s.ns.dot(dir).abs())
        };
        let crossed = path.crossings[met..].iter().filter(|c| !self.is_null(c.point.shape));
        crossed.fold(Rgb::ONE, |part, c| part * through(&c.point))
    }

    /// As [`World::connect`] from a point on an edge, past the edge's own faces.
    #[allow(clippy::too_many_arguments)]
    pub(crate) fn connect_past(
        &self,
        x: Vec3,
        faces: [u32; 2],
        medium: Option<usize>,
        dir: Vec3,
        distance: f64,
        path: &mut RayPath,
        counters: &mut Counters,
    ) -> bool {
        path.medium = medium;
        let v = Vertex { x, medium, kind: Kind::Point };
        self.connect_from(&v, Skip::two(faces[0], faces[1]), dir, distance, path, counters)
    }

    fn connect_from(
        &self,
        v: &Vertex,
        skip: Skip,
        dir: Vec3,
        distance: f64,
        path: &mut RayPath,
        counters: &mut Counters,
    ) -> bool {
        let Some(medium) = self.begin(v, dir, distance, path) else { return false };
        counters.rays += 1;
        let ray = Ray { origin: v.x, dir, t_max: short_of(v.x, distance) };
        if !self.any_null {
            return !self.geometry.bvh.any(&ray, skip, |_| true);
        }
        path.hits.clear();
        let blocks = |prim: u32| !self.is_null(self.geometry.prim(prim).shape);
        if self.geometry.bvh.crossings(&ray, skip, blocks, &mut path.hits) {
            return false;
        }
        self.cross(path, &ray, medium);
        true
    }

    /// Transmittance along a ray that [`World::connect`] or [`World::cast`] has followed, to where `path` ends.
    pub(crate) fn transmittance(
        &self,
        ray: &Ray,
        path: &RayPath,
        rng: &mut Rng,
        counters: &mut Counters,
    ) -> Rgb {
        let mut tau = Rgb::ONE;
        if !self.has_media() {
            return tau;
        }
        for i in intervals(path.medium, &path.crossings, path.length) {
            if let Some(m) = i.medium {
                let mut stats = TrackingStats::default();
                let part = Ray::new(ray.at(i.start), ray.dir).until(i.end - i.start);
                tau *= self.medium(m).transmittance(&part, rng, &mut stats);
                counters.tracking_steps += stats.lookups;
                if tau.is_zero() {
                    break;
                }
            }
        }
        tau
    }
}

/// A distance from `x`, less what rounding may add to it: a surface in which a camera or light sits
/// does not hide it.
pub(crate) fn short_of(x: Vec3, distance: f64) -> f64 {
    // The sky stays infinitely far.
    distance * (1.0 - 8.0 * f64::EPSILON) - 8.0 * f64::EPSILON * x.length()
}

#[cfg(test)]
mod tests {
    use drt_geom::procedural::icosphere;
    use drt_math::vec3;

    use super::*;
    use crate::derivative::tests::scenes::*;
    use crate::model::surface::{Bsdf, Dielectric};
    use crate::world::cache::PreparedCache;
    use crate::world::lights::EmitterMask;

    /// A ray that leaves a coarse ball by the shading normal does not meet it again, even where it passes under the facets.
    #[test]
    fn bent_rays_leave_by_shading_normals() {
        let ball = icosphere(1).with_smooth_normals();
        let ball = ShapeBuilder::new(ball, Bsdf::Dielectric(Dielectric::default()));
        let scene = SceneBuilder::new().shape("ball", ball);
        let scene = seen(scene, [vec3(0.0, 0.0, 4.0), Vec3::ZERO], 3);
        let mut kept = PreparedCache::default();
        let world = World::new(scene, 0, Some(3), None, EmitterMask::All, &mut kept).unwrap();
        let (mut path, mut counters) = (RayPath::default(), Counters::default());
        let mut rng = Rng::new(3, 0, 0);
        let (mut under, mut trapped) = (0, 0);
        for _ in 0..2000 {
            let [a, b] = rng.next_2d();
            let prim = (rng.next_f64() * 80.0) as u32;
            let (point, x) = world.point(prim, [a * (1.0 - b), b]);
            let across = point.ns.cross(vec3(rng.next_f64(), rng.next_f64(), 0.5)).normalize();
            let dir = (across + point.ns * 0.02).normalize();
            if agree(point.ng, point.ns, dir) {
                continue;
            }
            let v = Vertex { x, medium: None, kind: Kind::Surface(point) };
            world.cast_bent(&v, dir, &mut path, &mut counters);
            assert!(path.end.is_none(), "{point:?} {dir:?}");
            world.cast(&v, dir, &mut path, &mut counters);
            under += 1;
            trapped += u32::from(path.end.is_some());
        }
        assert!(under > 200 && trapped == under, "{trapped} of {under}");
    }

    #[test]
    fn distances_give_way_by_rounding_alone() {
        let x = vec3(1e6, -2.0, 3.0);
        assert_eq!(short_of(x, f64::INFINITY), f64::INFINITY);
        let given = 1.5 - short_of(x, 1.5);
        assert!(given > 1e-10 && given < 1e-8, "{given}");
    }
}
