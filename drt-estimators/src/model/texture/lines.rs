//! Lines on a mesh along which a texture jumps: between squares or texels that are not interpolated, and between triangles with other texture
//! coordinates.

use alloc::collections::BTreeMap;
use alloc::vec::Vec;

use drt_geom::Mesh;
use drt_math::fm;

use crate::model::texture::{Bitmap, Texture, TextureFilter, TexturePoint, TextureWrap};

/// As many lines as a surface may have before they are too many to follow.
const MOST: usize = 1 << 18;

/// A straight line on a triangle along which values jump.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SurfaceLine {
    pub(crate) triangle: u32,
    /// Weights of the triangle's second and third vertex at both ends.
    pub(crate) ends: [[f64; 2]; 2],
}

/// The weights of the second and third vertex at each corner of a triangle.
const CORNERS: [[f64; 2]; 3] = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];

/// The edges that triangles share and on whose sides a function of triangle and weights `differs`.
pub(crate) fn seams<'a, T: Copy + 'a>(
    mesh: &'a Mesh,
    value: impl Fn(u32, [f64; 2]) -> T + 'a,
    differs: impl Fn(T, T) -> bool + 'a,
) -> impl Iterator<Item = SurfaceLine> + 'a {
    let mut sides = BTreeMap::new();
    let edges =
        (0..mesh.triangles.len() as u32).flat_map(|triangle| [0, 1, 2].map(|k| (triangle, k)));
    edges.filter_map(move |(triangle, k)| {
        let corners = mesh.triangles[triangle as usize];
        let (i, j) = (k, (k + 1) % 3);
        let (i, j) = if corners[i] < corners[j] { (i, j) } else { (j, i) };
        let ends = [CORNERS[i], CORNERS[j]];
        let along = [0.0, 0.381, 0.618, 1.0]
            .map(|w: f64| value(triangle, [0, 1].map(|c| ends[0][c] * (1.0 - w) + ends[1][c] * w)));
        let first = *sides.entry([corners[i], corners[j]]).or_insert(along);
        let apart = along.iter().zip(&first).any(|(a, b)| differs(*a, *b));
        apart.then_some(SurfaceLine { triangle, ends })
    })
}

/// Lines at which one of the coordinates of a plane is a whole number.
struct Grid<'a> {
    /// From texture coordinates.
    place: &'a dyn Fn([f64; 2]) -> [f64; 2],
    /// Whether the value changes where a coordinate passes a whole number.
    changes: &'a dyn Fn(usize, i64) -> bool,
}

impl Grid<'_> {
    /// Adds the lines on a mesh; false where there are too many.
    fn lines_on(&self, mesh: &Mesh, lines: &mut Vec<SurfaceLine>) -> bool {
        for triangle in 0..mesh.triangles.len() as u32 {
            let corners = CORNERS.map(|bary| (self.place)(mesh.texcoord(triangle, bary)));
            for axis in 0..2 {
                let at = corners.map(|c| c[axis]);
                let [low, high] = [f64::min, f64::max].map(|f| f(at[0], f(at[1], at[2])));
                let (first, last) = (fm::ceil(low), fm::floor(high));
                // More than would fit are not even counted; nor are those of coordinates that are no numbers.
                let beyond = last - first;
                if beyond.is_nan() || beyond > MOST as f64 {
                    return false;
                }
                for k in first as i64..=last as i64 {
                    if let Some(ends) = crossing(at, k as f64)
                        && (self.changes)(axis, k)
                    {
                        lines.push(SurfaceLine { triangle, ends });
                    }
                }
                if lines.len() > MOST {
                    return false;
                }
            }
        }
        true
    }
}

/// The ends of the line on a triangle where a linear function with these values at its corners has another value; `None` of a point.
fn crossing(at: [f64; 3], value: f64) -> Option<[[f64; 2]; 2]> {
    let mut ends = Vec::new();
    for i in 0..3 {
        let j = (i + 1) % 3;
        if at[i] == value {
            ends.push(CORNERS[i]);
        } else if (at[i] < value) != (at[j] < value) && at[j] != value {
            let w = (value - at[i]) / (at[j] - at[i]);
            ends.push([0, 1].map(|c| CORNERS[i][c] * (1.0 - w) + CORNERS[j][c] * w));
        }
    }
    // Three corners of one value are no line.
    <[_; 2]>::try_from(ends).ok()
}

impl Bitmap {
    /// Whether the texels on both sides of the beginning of a column (axis 0) or row differ anywhere.
    fn changes_at(&self, axis: usize, k: i64) -> bool {
        (0..i64::from(self.size[1 - axis])).any(|other| {
            let at = |along: i64| if axis == 0 { [along, other] } else { [other, along] };
            self.texel(self.index(at(k - 1))) != self.texel(self.index(at(k)))
        })
    }
}

impl Texture {
    /// The lines on a mesh along which it jumps; `None` where there are too many of them, or it jumps elsewhere.
    pub(crate) fn lines_on(&self, mesh: &Mesh) -> Option<Vec<SurfaceLine>> {
        let mut lines = Vec::new();
        let counted = match self {
            Self::Checkerboard { colours: [a, b], to_uv } if a != b => {
                let place = |uv| to_uv.apply(uv).map(|x| 2.0 * x);
                Grid { place: &place, changes: &|_, _| true }.lines_on(mesh, &mut lines)
            }
            Self::Bitmap(image) if image.filter == TextureFilter::Nearest => {
                let within: [Vec<bool>; 2] = [0, 1].map(|axis| {
                    // Where the image comes again, mirrored or not, so do its columns and rows after two of them.
                    let period = 2 * i64::from(image.size[axis]);
                    (0..period).map(|k| image.changes_at(axis, k)).collect()
                });
                let changes = |axis: usize, k: i64| {
                    let period = 2 * i64::from(image.size[axis]);
                    let repeats = image.wrap != TextureWrap::Clamp;
                    let k = if repeats { k.rem_euclid(period) } else { k };
                    (0..period).contains(&k) && within[axis][k as usize]
                };
                Grid { place: &|uv| image.place(uv), changes: &changes }.lines_on(mesh, &mut lines)
            }
            Self::Volume(v) => v.is_continuous(),
            _ => true,
        };
        let value = |triangle, bary| self.at_point(&TexturePoint::new(mesh, triangle, bary));
        lines.extend(seams(mesh, value, |a, b| (a - b).max_abs() > 1e-9).take(MOST + 1));
        (counted && lines.len() <= MOST).then_some(lines)
    }
}

#[cfg(test)]
mod tests {
    use drt_geom::procedural;
    use drt_math::{Rgb, Rng};

    use super::*;
    use crate::model::texture::UvMap;

    /// Two triangles that share their coordinates, or not.
    fn sheet(seam: bool) -> Mesh {
        let mesh = procedural::rectangle();
        let corners = (0..2).map(|i| {
            let shift = if seam { 0.3 * f64::from(i) } else { 0.0 };
            mesh.triangle(i).map(|p| [0.5 + 0.5 * p.x + shift, 0.5 + 0.5 * p.y])
        });
        let corners = corners.collect();
        mesh.with_texcoords(corners).expect("coordinates")
    }

    fn textures() -> Vec<Texture> {
        let to_uv = UvMap([[2.3, 0.4, 0.1], [-0.3, 1.7, 0.2]]);
        let texels = (0..12_u8).map(|i| [f32::from(i % 5), 0.3, 0.1 * f32::from(i)]).collect();
        let nearest = Bitmap::new([4, 3], texels).expect("an image");
        let wraps = [TextureWrap::Repeat, TextureWrap::Mirror, TextureWrap::Clamp];
        let filter = TextureFilter::Nearest;
        let images = wraps.map(|wrap| Bitmap { wrap, filter, to_uv, ..nearest.clone() });
        let mut all: Vec<Texture> = images.into_iter().map(Texture::Bitmap).collect();
        all.push(Texture::Checkerboard { colours: [Rgb::splat(0.2), Rgb::ONE], to_uv });
        all
    }

    /// Whether the segment between two points of a triangle meets a line.
    fn meets(line: &SurfaceLine, [a, b]: [[f64; 2]; 2]) -> bool {
        let side = |[p, q]: [[f64; 2]; 2], x: [f64; 2]| {
            (q[0] - p[0]) * (x[1] - p[1]) - (q[1] - p[1]) * (x[0] - p[0])
        };
        let apart = |of: [[f64; 2]; 2], [x, y]: [[f64; 2]; 2]| side(of, x) * side(of, y) <= 1e-12;
        apart(line.ends, [a, b]) && apart([a, b], line.ends)
    }

    #[test]
    fn values_that_differ_have_a_line_between_them() {
        let mut rng = Rng::new(71, 0, 0);
        for texture in textures() {
            for mesh in [sheet(false), sheet(true)] {
                let lines = texture.lines_on(&mesh).expect("lines");
                let (mut differ, mut missed) = (0, 0);
                for i in 0..12_000 {
                    let (triangle, [s, t]) = (i % 2, rng.next_2d());
                    let a = if s + t > 1.0 { [1.0 - s, 1.0 - t] } else { [s, t] };
                    let b = a.map(|x| x + 0.02 * (rng.next_f64() - 0.5));
                    let value = |bary| texture.at_point(&TexturePoint::new(&mesh, triangle, bary));
                    if b[0] < 0.0 || b[1] < 0.0 || b[0] + b[1] > 1.0 || value(a) == value(b) {
                        continue;
                    }
                    differ += 1;
                    let own = || lines.iter().filter(|line| line.triangle == triangle);
                    assert!(own().any(|line| meets(line, [a, b])), "{texture:?}: {a:?} {b:?}");
                    // Planted: without one of the lines.
                    missed += u32::from(own().skip(1).all(|line| !meets(line, [a, b])));
                }
                assert!(differ > 50 && missed > 0, "{texture:?}: {differ}, {missed}");
            }
        }
    }

    #[test]
    fn lines_lie_where_values_differ() {
        for texture in textures() {
            let mesh = sheet(false);
            let lines = texture.lines_on(&mesh).expect("lines");
            let value = |line: &SurfaceLine, along: f64, across: f64| {
                let [p, q] = line.ends;
                let at = |k: usize| p[k] + (q[k] - p[k]) * along;
                let [x, y] = [at(0) - across * (q[1] - p[1]), at(1) + across * (q[0] - p[0])];
                texture.at_point(&TexturePoint::new(&mesh, line.triangle, [x, y]))
            };
            let of_texels = lines.iter().filter(|line| {
                (1..10).any(|k| {
                    let along = 0.1 * f64::from(k);
                    value(line, along, 1e-6) != value(line, along, -1e-6)
                })
            });
            assert_eq!(of_texels.count(), lines.len(), "{texture:?}");
        }
    }

    #[test]
    fn seams_are_lines_and_what_is_continuous_has_none() {
        let smooth = Bitmap::new([2, 1], alloc::vec![[0.0; 3], [1.0; 3]]).expect("an image");
        let smooth = Texture::Bitmap(Bitmap { wrap: TextureWrap::Clamp, ..smooth });
        assert_eq!(smooth.lines_on(&sheet(false)), Some(Vec::new()));
        let seams = smooth.lines_on(&sheet(true)).expect("lines");
        assert_eq!(seams.len(), 1);
        let even = Texture::Checkerboard { colours: [Rgb::ONE; 2], to_uv: UvMap::IDENTITY };
        assert_eq!(even.lines_on(&sheet(true)), Some(Vec::new()));
        let fine = UvMap([[1e7, 0.0, 0.0], [0.0, 1.0, 0.0]]);
        let many = Texture::Checkerboard { colours: [Rgb::ZERO, Rgb::ONE], to_uv: fine };
        assert_eq!(many.lines_on(&sheet(false)), None);
        let endless = UvMap([[f64::MAX, 0.0, f64::MAX], [0.0, 1.0, 0.0]]);
        let endless = Texture::Checkerboard { colours: [Rgb::ZERO, Rgb::ONE], to_uv: endless };
        assert_eq!(endless.lines_on(&sheet(false)), None);
    }
}
