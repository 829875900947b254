//! Frames whose first axis follows the texture coordinates, as Mitsuba's do.

use drt_geom::Mesh;
use drt_math::{Frame, Real, Vec3};

use crate::model::surface::At;
use crate::model::texture::{SurfaceLine, TexturePoint, seams};

/// The frame about a normal: `s` is the direction in which u grows, made orthogonal to the normal; `t` completes a
/// right-handed frame on the front of the surface, and is the same on its back, where the normal is turned over.
pub(super) fn shading_frame<T: Real>(at: At<'_>, n: Vec3<T>) -> Frame<T> {
    let Some(at) = at else { return Frame::from_normal(n) };
    let along = at.tangent.copied().unwrap_or_else(|| by_coordinates(at)[0]);
    let across = along.reject(n.re());
    // Where u does not grow along the surface any frame will do.
    if across.length_squared() <= 1e-24 * along.length_squared() || !across.is_finite() {
        return Frame::from_normal(n);
    }
    let s = along.lift::<T>().reject(n).normalize();
    let side = if is_front(at, n.re()) { 1.0 } else { -1.0 };
    Frame { s, t: n.cross(s) * T::from(side), n }
}

/// True where a normal is on the front of the surface.
pub(super) fn is_front(at: &TexturePoint<'_>, n: Vec3) -> bool {
    n.dot(at.normal()) >= 0.0
}

/// How the point moves in the world as u and v grow, in its triangle; along any frame's axes where the mesh has no coordinates.
pub(super) fn by_coordinates(at: &TexturePoint<'_>) -> [Vec3; 2] {
    let any = || {
        let frame = Frame::from_normal(at.face_normal().normalize());
        [frame.s, frame.t]
    };
    let Some(texcoords) = &at.mesh.texcoords else { return any() };
    let [p, q, r] = at.mesh.triangle(at.triangle);
    let [[u, v], [u1, v1], [u2, v2]] = texcoords[at.triangle as usize];
    let (e1, e2) = (q - p, r - p);
    let ([u1, v1], [u2, v2]) = ([u1 - u, v1 - v], [u2 - u, v2 - v]);
    let determinant = u1 * v2 - v1 * u2;
    let [by_u, by_v] = [e1 * v2 - e2 * v1, e2 * u1 - e1 * u2].map(|d| d / determinant);
    if by_u.is_finite() && by_v.is_finite() {
        [by_u, by_v].map(|by| at.vector_to_world(by))
    } else {
        any()
    }
}

/// The edges at which two triangles meet with the same normals, and on which u grows in different directions.
pub(super) fn frame_seams(mesh: &Mesh) -> impl Iterator<Item = SurfaceLine> + '_ {
    let sides = |triangle: u32, _| {
        let at = TexturePoint::new(mesh, triangle, [1.0 / 3.0; 2]);
        (by_coordinates(&at)[0].normalize(), mesh.normal(triangle).normalize())
    };
    seams(mesh, sides, |(along, normal), (other, before)| {
        let smooth = mesh.normals.is_some() || normal.dot(before) > 1.0 - 1e-12;
        smooth && (along - other).max_abs() > 1e-9
    })
}
