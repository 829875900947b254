//! The weights of edges beside a ray, or beside what lights a point.

use drt_geom::edges::Cone;
use drt_math::{Real, Vec3, fm};

use crate::derivative::velocity::{TangentPlane, TurningRay, Weight};
use crate::estimators::warped::angular_distance::Beside;
use crate::estimators::warped::edge::{Discontinuity, TurningEdge};

/// Within which angle edges turn a ray, in radians.
pub(super) const ANGLE: f64 = 0.1;

/// How far behind the plane of the surface where a ray ends edges turn it, over their distances.
pub(super) const BEHIND: f64 = 0.02;

/// How far creases between the faces of curved surfaces turn rays, over what other edges do.
pub(super) const NARROW: f64 = 0.1;

/// What the weight of an edge depends on besides the edge.
pub(super) struct Near {
    /// The viewer; where that is at infinity, a point on the ray.
    from: Vec3,
    /// Unit, of the ray.
    dir: Vec3,
    /// Scene units to each radian, of a viewer at infinity.
    at_infinity: Option<f64>,
    /// Squared sine of the cone's angle.
    square: Weight,
    /// How large an edge is seen, as a sine, whose weight is as large as that of any longer one.
    long: f64,
    pub(super) cone: Cone,
    /// For creases of curved surfaces.
    pub(super) narrow: Cone,
    /// The unit normal of the surface that the viewer is on, towards the ray's side.
    horizon: Option<Vec3>,
    /// Unit normal of the surface where the ray ends, away from the viewer; zero where it does not. And the distance of `from`
    /// from its plane.
    normal: Vec3,
    depth: f64,
    /// How far the ray goes, where it ends on facets whose planes do not count, and the shape of these.
    length: Option<(Weight, u32)>,
    /// The tangent plane there, in place of both.
    tangent_plane: Option<TangentPlane>,
    /// The shape where the ray ends, if creases of it count.
    creases_of: Option<u32>,
    /// No crease counts.
    silhouettes_only: bool,
    /// The viewer is the camera.
    of_camera: bool,
}

impl Near {
    /// Prepares the weights of edges beside a ray. `creases_of` is the shape where it ends, if radiance may jump at creases of that; `facets` tells that this is a
    /// curved one. With `by_length` it counts how far an edge is beyond the end of the ray, and not how far behind the plane there, and edges of the shape itself count
    /// wherever they are.
    pub(super) fn of_ray(
        ray: &TurningRay<'_>,
        angle: f64,
        creases_of: Option<u32>,
        by_length: bool,
        facets: bool,
    ) -> Self {
        let TurningRay { viewer, dir, distance, end, of_camera, .. } = *ray;
        let along = |n: Vec3| if n.dot(dir) < 0.0 { -n } else { n };
        let normal = end.map_or(Vec3::ZERO, |s| along(s.ng));
        let sine = fm::sin(angle);
        Self {
            from: viewer.x,
            dir,
            at_infinity: None,
            square: Weight::constant(sine * sine),
            long: sine,
            cone: Cone::new(viewer.x, dir, angle, f64::INFINITY),
            narrow: Cone::new(
                viewer.x,
                dir,
                if facets { NARROW * angle } else { 0.0 },
                f64::INFINITY,
            ),
            horizon: viewer.surface().map(|s| along(s.ng)),
            normal,
            // At creases that do not count, what is behind must not jump with the plane.
            tangent_plane: ray.tangent_plane,
            length: end.filter(|_| by_length).map(|s| {
                let gradient = normal.reject(dir) * (-distance / normal.dot(dir));
                (Weight { value: distance, gradient }, s.shape)
            }),
            // Nothing is behind the sky.
            depth: if end.is_some() { normal.dot(dir) * distance } else { 0.0 },
            creases_of,
            silhouettes_only: false,
            of_camera: of_camera.is_some(),
        }
    }

    /// Of what flows along the unit direction `dir` to a point x of a plane, with the unit `normal` along the flow. It comes
    /// from a point at the distance `range`, or from infinity, where a radian is taken as that distance. `square` is that of
    /// the cone's sine. Gradients are by x, times the range.
    pub(super) fn of_flow(
        x: Vec3,
        dir: Vec3,
        range: f64,
        at_infinity: bool,
        normal: Vec3,
        square: Weight,
    ) -> Self {
        let sine = Real::sqrt(square.value);
        let from = if at_infinity { x } else { x - dir * range };
        let cone = |sine: f64| match at_infinity {
            true => Cone::cylinder(x, dir, sine * range),
            false => Cone::new(from, dir, fm::asin(sine), f64::INFINITY),
        };
        Self {
            from,
            dir,
            at_infinity: at_infinity.then_some(range),
            square,
            long: fm::sin(ANGLE),
            cone: cone(sine),
            narrow: cone(0.0),
            horizon: None,
            normal,
            depth: normal.dot(x - from),
            length: None,
            tangent_plane: None,
            creases_of: None,
            silhouettes_only: true,
            of_camera: false,
        }
    }

    /// How far the nearest point of an edge is behind the plane of the surface where the ray ends, or farther away than that; zero of edges that count
    /// wherever they are.
    fn behind(&self, edge: &TurningEdge, beside: &Beside) -> Weight {
        let side = edge.ends[1] - edge.ends[0];
        if let Some(TangentPlane { normal, place, by_direction }) = self.tangent_plane {
            let beyond = beside.place + self.from - place;
            let mut gradient = beside.along.gradient * normal.dot(side);
            for (across, [by_normal, by_place]) in by_direction {
                gradient += across * (by_normal.dot(beyond) - normal.dot(by_place));
            }
            return Weight { value: normal.dot(beyond), gradient };
        }
        match self.length {
            // Where a facet is seen edge-on, the distance to its silhouette would change over a short way.
            Some((_, shape)) if edge.shape == shape => Weight::default(),
            Some((length, _)) => beside.distance - length,
            None => {
                let value = self.normal.dot(beside.place) - self.depth;
                Weight { value, gradient: beside.along.gradient * self.normal.dot(side) }
            }
        }
    }

    /// An edge beside the ray and its weight; `None` where it has none.
    pub(super) fn weight(&self, edge: &TurningEdge) -> Option<(Beside, Weight)> {
        if self.of_camera && edge.on_border {
            return None;
        }
        let (from, w) = (self.from, self.dir);
        let [a, b] = edge.ends;
        let ends = [a - from, b - from];
        let below = |n: Vec3| ends.iter().all(|p| n.dot(*p) <= 1e-9 * p.length());
        let view = if self.at_infinity.is_some() { w } else { ends[0] };
        let full = (self.square, self.long);
        let (widest, long) = match edge.discontinuity(view) {
            Discontinuity::Silhouette => full,
            _ if self.silhouettes_only => return None,
            Discontinuity::None => return None,
            _ if edge.within.is_some_and(|shape| self.creases_of != Some(shape)) => return None,
            Discontinuity::Facets => {
                (self.square * Weight::constant(NARROW * NARROW), self.long * NARROW)
            }
            Discontinuity::Crease => full,
        };
        // Most edges are farther away, by a sphere around them.
        let middle = (ends[0] + ends[1]) * 0.5;
        let along = middle.dot(w);
        let across = middle.length_squared() - along * along;
        let least = Real::sqrt(f64::max(across, 0.0)) - edge.half;
        let beside = if let Some(scale) = self.at_infinity {
            if least > 0.0 && least * least > widest.value * (scale * scale) {
                return None;
            }
            Beside::from_infinity(ends, w, scale)
        } else {
            // Of what is nearer than a right angle the tangent is at most that of the sine.
            let reach = along + edge.half;
            let square = widest.value;
            let outside = least > 0.0 && least * least * (1.0 - square) > square * reach * reach;
            if reach <= 0.0 || outside || self.horizon.is_some_and(below) {
                return None;
            }
            Beside::new(ends, w)?
        };
        let square = beside.square;
        if square.value >= widest.value {
            return None;
        }
        let least = f64::MIN_POSITIVE.sqrt();
        // The weights of many short edges add up to what that of one line has where they are.
        let part = Weight::constant(f64::min(self.seen_length(ends) / long, 1.0));
        let behind = self.behind(edge, &beside);
        // Of an edge that is not hidden the weight diverges where the ray meets it.
        if behind.value <= 0.0 {
            let square = Weight { value: f64::max(square.value, least), ..square };
            return Some((beside, part * (widest / square - Weight::constant(1.0))));
        }
        let q = behind / (beside.distance * Weight::constant(BEHIND));
        if q.value >= 1.0 {
            return None;
        }
        let rest = Weight::constant(1.0) - q * q;
        let shown = rest * rest;
        let rise = shown * (widest - square);
        let mut fall = square + (Weight::constant(1.0) - shown) * widest;
        fall.value = f64::max(fall.value, least);
        Some((beside, part * (rise / fall)))
    }

    /// How long an edge between two points, less the viewer's place, is as it is seen: the sine of its angle.
    fn seen_length(&self, [a, b]: [Vec3; 2]) -> f64 {
        match self.at_infinity {
            Some(scale) => (b - a).cross(self.dir).length() / scale,
            None if a.dot(b) <= 0.0 => 1.0,
            None => {
                let square = a.length_squared() * b.length_squared();
                Real::sqrt(a.cross(b).length_squared() / square)
            }
        }
    }
}
