//! What changes do, by their definitions, in dual numbers.

use drt_geom::Mesh;
use drt_math::{Dual, Real, Rgb, ValueChange, Vec3, vec3};
use drt_medium::Grid;
use drt_motion::GeometryChange;

pub(super) type D = Dual<f64, 1>;

pub(super) fn rgb(v: Rgb) -> Rgb<D> {
    v.map(D::from)
}

pub(super) fn rates(v: Rgb<D>) -> Rgb {
    v.map(|c| c.eps[0])
}

/// A number whose derivative is given.
pub(super) fn with_rate(value: f64, rate: f64) -> D {
    D::new(value, [rate])
}

/// One voxel of a grid set to one, the others to zero.
pub(super) fn hat(grid: &Grid, voxel: [usize; 3]) -> Grid {
    let size = grid.size();
    let mut values = alloc::vec![0.0; size.iter().product()];
    values[(voxel[2] * size[1] + voxel[1]) * size[0] + voxel[0]] = 1.0;
    let basis = Grid::new(size, 1, values).expect("the same shape");
    let basis = basis.with_layout(grid.layout()).with_filter(grid.filter()).with_wrap(grid.wrap());
    basis.with_placement(*grid.to_world()).expect("the same box")
}

pub(super) fn change(op: &ValueChange, v: Rgb<D>, theta: D) -> Rgb<D> {
    match *op {
        ValueChange::Add(a) => v + rgb(a) * theta,
        ValueChange::Multiply(m) => v * (theta * m + 1.0),
        ValueChange::MultiplyLog(m) => v * (theta * m).exp(),
    }
}

/// The image of a point under a change of space.
pub(super) fn moved(g: &GeometryChange, x: Vec3<D>, theta: D) -> Vec3<D> {
    match *g {
        GeometryChange::Translate(t) => x + t.lift() * theta,
        GeometryChange::Rotate { axis, pivot } => {
            // Rodrigues' formula.
            let (k, d) = (axis.normalize().lift(), x - pivot.lift());
            let (sin, cos) = theta.sin_cos();
            x + k.cross(d) * sin + k.cross(k.cross(d)) * (D::one() - cos)
        }
        GeometryChange::Scale { factor, pivot } => {
            let d = x - pivot.lift();
            let grow = |f: f64, d: D| d * (theta * f).exp();
            pivot.lift() + vec3(grow(factor.x, d.x), grow(factor.y, d.y), grow(factor.z, d.z))
        }
        _ => unreachable!("not used here"),
    }
}

pub(super) fn moved_vector(g: &GeometryChange, v: Vec3<D>, theta: D) -> Vec3<D> {
    moved(g, v, theta) - moved(g, Vec3::zero(), theta)
}

/// Normals go with the inverse transpose.
pub(super) fn turned_normal(g: &GeometryChange, n: Vec3<D>, theta: D) -> Vec3<D> {
    match g {
        GeometryChange::Scale { .. } => moved_vector(g, n, -theta).normalize(),
        _ => moved_vector(g, n, theta),
    }
}

/// Normals at the corners of a mesh without seams: the faces' normals weighted by their angles.
pub(super) fn smooth(mesh: &Mesh, x: &[Vec3<D>], normals: &mut [Vec3<D>]) {
    normals.fill(Vec3::zero());
    for corners in &mesh.triangles {
        for k in 0..3 {
            let [v, next, last] = [0, 1, 2].map(|j| corners[(k + j) % 3] as usize);
            let (a, b) = (x[next] - x[v], x[last] - x[v]);
            let angle = a.normalize().dot(b.normalize()).acos();
            normals[v] += a.cross(b).normalize() * angle;
        }
    }
    normals.iter_mut().for_each(|n| *n = n.normalize());
}
