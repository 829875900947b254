//! Optical depths of rays through a medium that varies in space, and all that their derivatives
//! depend on, in one estimate that any number of parameters share.
//!
//! With a ray o + t w and a grid that moves by an affine field u(x) = A x + b, the rate of its optical
//! depth needs the field only at the origin and along the direction,
//!
//! ```text
//! ∫ u·∇σ dt = u(o)·G + (A w)·M,   G = ∫ ∇σ dt,   M = ∫ t ∇σ dt,
//! ```
//!
//! and so do the rates by the motion of the ray's own ends. At the faces of a grid's box, where σ
//! jumps by -σ along the outward normal N, ∇σ dt stands for -σ N / |N·w|.
//!
//! In a medium of microflakes the extinction depends on the direction as well ([`directed`](crate::directed)), and all of this holds for
//! σ(x) A(x, w). With P = ∫ ∂(σA)/∂w dt across w, the direction's own rate w' adds w'·P. Flakes that turn with the rate ω
//! look as if w turned with -ω, so that a grid with the spin ω = curl u / 2 adds -(ω × w)·P = -ω·(w × P).

use core::cell::OnceCell;

use drt_math::{Rgb, RgbVec, Vec3};

use crate::bounds::in_unit_cube;
use crate::tangent::spin;
use crate::{
    Crossing, DeformedGrid, DensityField, FlakesGradient, FlowPlace, GridMedium, Medium,
    MediumKind, MediumTangent, Ray,
};

/// An estimate of a ray's optical depth and of what its derivatives depend on; unbiased where
/// [`Medium::line_points`] gave the points.
#[derive(Clone, Debug)]
pub struct DepthEstimate<'a> {
    medium: &'a Medium,
    /// The ray.
    pub ray: Ray,
    /// The points `(t, w)` and weights of the estimate.
    pub points: &'a [(f64, f64)],
    /// Length of the ray inside the medium, of which microflakes make as much more as their projected area.
    pub length: f64,
    /// The optical depth: a gradient by voxels does without, so that it is looked up where somebody asks.
    depth: OnceCell<Rgb>,
    /// `∫ grad sigma_t dt`; zero unless asked for.
    pub gradient: RgbVec,
    /// `∫ t grad sigma_t dt`; zero unless asked for.
    pub moment: RgbVec,
    /// The derivative by the ray's direction across it; zero but for microflakes.
    pub turn: RgbVec,
    /// The faces of a grid's box are in it.
    pub faces: bool,
    /// Motions of the grids are left out of its rate.
    pub at_rest: bool,
}

/// What the points of a ray tell of a grid.
struct GridSums {
    length: f64,
    depth: Rgb,
    gradient: RgbVec,
    moment: RgbVec,
}

impl<'a> DepthEstimate<'a> {
    /// The estimate from points of the ray, without the faces of a grid's box. Gradients are looked
    /// up only for what is `moving`. A medium of one extinction, which has closed forms, gives nothing.
    #[must_use]
    pub fn inside(medium: &'a Medium, ray: Ray, points: &'a [(f64, f64)], moving: bool) -> Self {
        let mut estimate = Self {
            medium,
            ray,
            points,
            length: 0.0,
            depth: OnceCell::new(),
            gradient: RgbVec::ZERO,
            moment: RgbVec::ZERO,
            turn: RgbVec::ZERO,
            faces: false,
            at_rest: false,
        };
        match &medium.kind {
            _ if medium.phase.sggx().is_some() => estimate.add_directed(medium, moving),
            MediumKind::Homogeneous(_) | MediumKind::Uniform(_) => {}
            MediumKind::Grid(g) if moving => {
                let GridSums { length, depth, gradient, moment } = estimate.in_grid::<true>(g);
                estimate = Self { length, depth: depth.into(), gradient, moment, ..estimate };
            }
            MediumKind::Grid(g) => {
                estimate.length = estimate.length_in(g);
                return estimate;
            }
            MediumKind::Deformed(d) => estimate.add_deformed(d, moving),
            MediumKind::Custom(f) => estimate.add_field(&**f, moving),
        }
        estimate.depth.get_or_init(|| Rgb::ZERO);
        estimate
    }

    /// The optical depth, `∫ sigma_t dt`.
    #[must_use]
    pub fn depth(&self) -> Rgb {
        *self.depth.get_or_init(|| match &self.medium.kind {
            MediumKind::Grid(g) => self.in_grid::<false>(g).depth,
            _ => Rgb::ZERO,
        })
    }

    /// The same with the faces of a grid's box that the ray passes through.
    #[must_use]
    pub fn with_faces(mut self, medium: &Medium) -> Self {
        let ray = self.ray;
        medium.crossings(&ray, |c| self.add_face(c));
        self.faces = true;
        self
    }

    /// This estimate without what motions of the grids change, for derivatives by coefficients alone.
    #[must_use]
    pub fn at_rest(&self) -> Self {
        let [gradient, moment] = [RgbVec::ZERO; 2];
        Self { gradient, moment, faces: false, at_rest: true, ..self.clone() }
    }

    fn add_face(&mut self, c: &Crossing) {
        let g = -c.depth_per_velocity();
        self.gradient += g;
        self.moment += g * c.t;
    }

    #[cold]
    fn add_directed(&mut self, medium: &Medium, moving: bool) {
        let w = self.ray.dir;
        let mut depth = Rgb::ZERO;
        for (x, t, weight) in self.points_in(medium) {
            let (sigma_t, here) = (medium.sigma_t(x), medium.phase_at(x));
            let (area, by) = (here.projected_area(w), medium.area_gradient(x, w));
            self.length += weight * area;
            depth += sigma_t * (weight * area);
            self.turn += sigma_t.outer(by.wo.reject(w)) * weight;
            if moving {
                let g = medium.gradients(x).sigma_t * area + sigma_t.outer(by.place);
                self.gradient += g * weight;
                self.moment += g * (weight * t);
            }
        }
        self.depth = depth.into();
    }

    /// The points of the estimate that lie in the medium, with their distances and weights.
    fn points_in<'m>(
        &self,
        medium: &'m Medium,
    ) -> impl Iterator<Item = (Vec3, f64, f64)> + use<'a, 'm> {
        let (ray, points) = (self.ray, self.points);
        let places = points.iter().map(move |(t, w)| (ray.at(*t), *t, *w));
        places.filter(|(x, ..)| medium.volumes_at(*x).is_some())
    }

    /// How the depth depends on the matrix of microflakes: calls `visit` with points of the ray, and the derivative there,
    /// which a colour multiplies. Other media have none.
    pub(crate) fn by_flakes(
        &self,
        medium: &Medium,
        mut visit: impl FnMut(Vec3, &FlakesGradient, Rgb),
    ) {
        if medium.phase.sggx().is_some() {
            for (x, _, weight) in self.points_in(medium) {
                let by = medium.phase_at(x).area_gradient(self.ray.dir).flakes;
                visit(x, &by, medium.sigma_t(x) * weight);
            }
        }
    }

    /// How the depth depends on the spin of the grids, which turns microflakes: -(w × P).
    pub(crate) fn by_spin(&self) -> RgbVec {
        if self.at_rest { RgbVec::ZERO } else { self.turn.map(|turn| turn.cross(self.ray.dir)) }
    }

    fn add_deformed(&mut self, medium: &DeformedGrid, moving: bool) {
        let mut depth = Rgb::ZERO;
        for &(t, w) in self.points {
            let Some((material, slope)) = medium.material(self.ray.at(t)) else { continue };
            self.length += w;
            depth += medium.grids.sigma_t(material) * w;
            if moving {
                let g = medium.grids.density().gradient(material) * (medium.grids.scale() * w);
                let g = g.map(|g| slope.transpose_mul(g));
                self.gradient += g;
                self.moment += g * t;
            }
        }
        self.depth = depth.into();
    }

    fn add_field(&mut self, field: &dyn DensityField, moving: bool) {
        let mut depth = Rgb::ZERO;
        for &(t, w) in self.points {
            let x = self.ray.at(t);
            self.length += w;
            depth += field.sigma_t(x) * w;
            if moving {
                let g = field.gradients(x).sigma_t * w;
                self.gradient += g;
                self.moment += g * t;
            }
        }
        self.depth = depth.into();
    }

    /// The length of the ray inside the box of a grid.
    fn length_in(&self, medium: &GridMedium) -> f64 {
        let [origin, dir] = self.in_unit_cube_of(medium);
        let inside = self.points.iter().filter(|(t, _)| in_unit_cube(origin + dir * *t));
        inside.map(|(_, w)| w).sum()
    }

    /// Origin and direction as a grid sees them.
    fn in_unit_cube_of(&self, medium: &GridMedium) -> [Vec3; 2] {
        let unit = medium.density().from_world();
        [unit.point(self.ray.origin), unit.vector(self.ray.dir)]
    }

    fn in_grid<const MOVING: bool>(&self, medium: &GridMedium) -> GridSums {
        let grid = medium.density();
        let [origin, dir] = self.in_unit_cube_of(medium);
        // Sums per channel: of the values, and of the slopes along the lattice with their moments.
        let (mut depth, mut slopes, mut moments) = ([0.0; 3], [Vec3::ZERO; 3], [Vec3::ZERO; 3]);
        let mut length = 0.0;
        for &(t, w) in self.points {
            let u = origin + dir * t;
            if !in_unit_cube(u) {
                continue;
            }
            length += w;
            let cell = grid.cell(u);
            let at = grid.corners(&cell);
            for c in 0..grid.channels() {
                let v = grid.corner_values(&at, c);
                depth[c] += cell.interpolate(&v) * w;
                if MOVING {
                    let slope = cell.slopes(&v) * w;
                    slopes[c] += slope;
                    moments[c] += slope * t;
                }
            }
        }
        let scale = medium.scale();
        // One channel stands for all three.
        let of = |c: usize| if grid.channels() == 1 { 0 } else { c };
        let world = |slopes: &[Vec3; 3]| {
            let world = |c: usize| grid.slope_in_world(slopes[of(c)]) * scale;
            RgbVec { r: world(0), g: world(1), b: world(2) }
        };
        let depth = Rgb::new(depth[of(0)], depth[of(1)], depth[of(2)]) * scale;
        GridSums { length, depth, gradient: world(&slopes), moment: world(&moments) }
    }

    /// The rate of the fixed ray's optical depth along a tangent of the medium, the motion of its
    /// grids included.
    #[must_use]
    pub fn rate(&self, medium: &Medium, tangent: &MediumTangent) -> Rgb {
        let mut rate = self.rate_without_flows(medium, tangent);
        if !tangent.flows.is_empty() {
            let place = &mut FlowPlace::default();
            self.pulls(medium, |x, pull| rate += pull.dot(tangent.flow(x, place)));
        }
        rate
    }

    /// How the optical depth depends on the velocity of the grids: calls `visit` with points of the ray,
    /// and the derivative by the velocity there. Of many parameters whose tangents flow, each adds the
    /// products with its own velocities to [`rate_without_flows`](Self::rate_without_flows).
    pub fn pulls(&self, medium: &Medium, mut visit: impl FnMut(Vec3, RgbVec)) {
        if self.at_rest {
            return;
        }
        for &(t, w) in self.points {
            let x = self.ray.at(t);
            let mut g = medium.gradients(x).sigma_t;
            if let Some(directed) = medium.directed(self.ray.dir) {
                g = directed.gradients(x).sigma_t;
            }
            if g != RgbVec::ZERO {
                visit(x, g * -w);
            }
        }
        if self.faces {
            medium.crossings(&self.ray, |c| visit(self.ray.at(c.t), c.depth_per_velocity()));
        }
    }

    /// [`rate`](Self::rate) but for what the tangent's flows add to it.
    #[must_use]
    pub fn rate_without_flows(&self, medium: &Medium, tangent: &MediumTangent) -> Rgb {
        let MediumTangent { sigma_t, velocity, .. } = tangent;
        let by_factor = match sigma_t.relative {
            0.0 => Rgb::ZERO,
            relative => self.depth() * relative,
        };
        let mut rate = sigma_t.uniform * self.length + by_factor
            - self.gradient.dot(velocity.point(self.ray.origin))
            - self.moment.dot(velocity.vector(self.ray.dir));
        if !sigma_t.voxels.is_empty() {
            for (grid, material, w) in self.points_inside(medium) {
                rate += sigma_t.voxel_rate(grid.density(), material) * w;
            }
        }
        if medium.phase.sggx().is_some() {
            rate + self.rate_of_flakes(medium, tangent)
        } else {
            rate
        }
    }

    /// What microflakes add to the rate as they change and turn.
    #[cold]
    fn rate_of_flakes(&self, medium: &Medium, tangent: &MediumTangent) -> Rgb {
        let mut rate = self.by_spin().dot(spin(&tangent.velocity));
        if tangent.flakes.iter().any(|t| !t.is_zero()) {
            self.by_flakes(medium, |x, by, sigma_t| {
                rate += sigma_t * tangent.flakes_rate(medium, x, by);
            });
        }
        rate
    }

    /// The points of the estimate that lie inside the medium's grids, as the grids see them, with their
    /// weights, which microflakes multiply with their projected areas.
    pub(crate) fn points_inside<'m>(
        &self,
        medium: &'m Medium,
    ) -> impl Iterator<Item = (&'m GridMedium, Vec3, f64)> + use<'a, 'm> {
        let (ray, points, directed) = (self.ray, self.points, medium.phase.sggx().is_some());
        points.iter().filter_map(move |(t, w)| {
            let x = ray.at(*t);
            let (grid, material) = medium.grid_at(x)?;
            let w = if directed { *w * medium.projected_area(x, ray.dir) } else { *w };
            Some((grid, material, w))
        })
    }
}
