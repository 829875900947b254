use drt_math::{Real, Vec3};

/// Distance and barycentric coordinates of the point where a line meets the plane of a triangle,
/// generic over the scalar: with [`Dual`](drt_math::Dual) numbers in, the rates of change of the hit
/// come out, whatever moves (origin, direction or vertices).
///
/// Returns `(t, [b1, b2])`: the point is `origin + t dir`, in units of `dir`, and also
/// `(1 - b1 - b2) v0 + b1 v1 + b2 v2`. Which triangle is hit must be known already (from
/// [`TriangleBvh`](crate::TriangleBvh)); the coordinates are those of the plane, also outside the
/// triangle. Not finite for a line parallel to the plane or a triangle without area.
#[inline]
pub fn ray_plane<T: Real>(origin: Vec3<T>, dir: Vec3<T>, triangle: [Vec3<T>; 3]) -> (T, [T; 2]) {
    let [v0, v1, v2] = triangle;
    let (e1, e2) = (v1 - v0, v2 - v0);
    let n = e1.cross(e2);
    let t = n.dot(v0 - origin) / n.dot(dir);
    let p = origin + dir * t - v0;
    let per_area = n.length_squared().recip();
    (t, [p.cross(e2).dot(n) * per_area, e1.cross(p).dot(n) * per_area])
}
