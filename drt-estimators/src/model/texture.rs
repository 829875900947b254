//! Values that vary over surfaces, by texture coordinates or by attributes of their meshes.

mod lines;
mod texels;
mod volume;

use alloc::string::String;
use alloc::sync::Arc;
use alloc::vec::Vec;

use drt_geom::Mesh;
use drt_math::{Affine, Rgb, RgbVec, Vec3, fm};

pub(crate) use crate::model::texture::lines::{SurfaceLine, seams};
pub(crate) use crate::model::texture::texels::{
    Footprint, TexelChange, TexelTangent, replace_texels,
};
pub use crate::model::texture::texels::{TexelError, TexelGradient};
pub use crate::model::texture::volume::VolumeTexture;

/// A colour (or a number, in every channel alike) over texture coordinates.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Texture {
    /// Squares of two colours, half a unit wide.
    Checkerboard {
        /// The colour of the square at the origin, and the colour of its neighbours.
        colours: [Rgb; 2],
        /// What is done to coordinates first.
        to_uv: UvMap,
    },
    /// An image.
    Bitmap(Bitmap),
    /// Values of an attribute of the mesh, independent of texture coordinates.
    Attribute(AttributeTexture),
    /// Values of a volume at the position that the surface point had before it moved.
    Volume(VolumeTexture),
}

/// An attribute of the meshes that have this texture; see [`drt_geom::MeshAttribute`].
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct AttributeTexture {
    /// The attribute's name.
    pub name: String,
    /// Factor of the attribute's values.
    pub scale: f64,
    /// Whether the luminance of the values replaces every channel.
    pub grey: bool,
}

impl AttributeTexture {
    fn value(&self, channels: [f64; 3]) -> Rgb {
        let value = Rgb::from(channels) * self.scale;
        if self.grey { luminance(value) } else { value }
    }

    fn corners(&self, mesh: &Mesh, triangle: u32) -> Option<[Rgb; 3]> {
        let corners = mesh.attribute(&self.name)?.values[triangle as usize];
        Some(corners.map(|c| self.value(c.map(f64::from))))
    }
}

/// The luminance of a colour, in every channel.
fn luminance(value: Rgb) -> Rgb {
    Rgb::splat(Rgb::new(0.212_671, 0.715_160, 0.072_169).dot(value))
}

/// An affine map of texture coordinates, by rows.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct UvMap(pub [[f64; 3]; 2]);

/// An image over the unit square, its first row at v = 0.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "unchecked::Bitmap"))]
pub struct Bitmap {
    size: [u32; 2],
    /// Row by row; shared by the copies of a scene.
    texels: Arc<Vec<[f32; 3]>>,
    /// Values between the middles of texels.
    pub filter: TextureFilter,
    /// Values beyond the unit square.
    pub wrap: TextureWrap,
    /// What is done to coordinates first.
    pub to_uv: UvMap,
}

/// Interpolation between the middles of texels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum TextureFilter {
    /// The value of the nearest texel.
    Nearest,
    /// Linear interpolation along both axes.
    #[default]
    Bilinear,
}

/// Values outside the unit square.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum TextureWrap {
    /// The image is repeated.
    #[default]
    Repeat,
    /// The image is repeated, and every second copy is mirrored.
    Mirror,
    /// The values at the image's border.
    Clamp,
}

/// A point of a shape, where textures are looked up.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TexturePoint<'a> {
    pub(crate) mesh: &'a Mesh,
    pub(crate) triangle: u32,
    /// Weights of the triangle's second and third vertex.
    pub(crate) bary: [f64; 2],
    /// The direction that frames follow instead of that in which u grows.
    pub(crate) tangent: Option<&'a Vec3>,
    /// From the mesh's space to the world, where that is another: of an instance.
    pub(crate) to_world: Option<&'a Affine>,
}

impl<'a> TexturePoint<'a> {
    #[inline]
    pub(crate) fn new(mesh: &'a Mesh, triangle: u32, bary: [f64; 2]) -> Self {
        Self { mesh, triangle, bary, tangent: None, to_world: None }
    }

    /// A shading normal on the front of the surface, in the world, of any length.
    pub(crate) fn normal(&self) -> Vec3 {
        let Some(normals) = &self.mesh.normals else { return self.face_normal() };
        let [i, j, k] = self.mesh.triangles[self.triangle as usize].map(|v| normals[v as usize]);
        let [s, t] = self.bary;
        self.normal_to_world(i * (1.0 - s - t) + j * s + k * t)
    }

    /// The triangle's normal, in the world, of any length.
    pub(crate) fn face_normal(&self) -> Vec3 {
        self.normal_to_world(self.mesh.normal(self.triangle))
    }

    fn normal_to_world(&self, n: Vec3) -> Vec3 {
        let Some(map) = self.to_world else { return n };
        let [a, b, c] = map.linear.cols;
        let side = if map.linear.determinant() < 0.0 { -1.0 } else { 1.0 };
        (b.cross(c) * n.x + c.cross(a) * n.y + a.cross(b) * n.z) * side
    }

    /// A displacement in the mesh's space, in the world.
    pub(crate) fn vector_to_world(&self, v: Vec3) -> Vec3 {
        self.to_world.map_or(v, |map| map.linear * v)
    }

    pub(crate) fn uv(&self) -> [f64; 2] {
        self.mesh.texcoord(self.triangle, self.bary)
    }

    /// The gradients of both coordinates by place, in the triangle's plane.
    pub(crate) fn uv_gradients(&self) -> [Vec3; 2] {
        let at = |bary| self.mesh.texcoord(self.triangle, bary);
        let [[u, v], by_s, by_t] = [at([0.0, 0.0]), at([1.0, 0.0]), at([0.0, 1.0])];
        let [s, t] = self.mesh.barycentric_gradients(self.triangle);
        [s * (by_s[0] - u) + t * (by_t[0] - u), s * (by_s[1] - v) + t * (by_t[1] - v)]
    }
}

impl UvMap {
    /// Coordinates as they are.
    pub const IDENTITY: Self = Self([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);

    #[inline]
    fn apply(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        self.0.map(|[a, b, c]| a * u + b * v + c)
    }
}

impl Bitmap {
    /// An image of `size` columns and rows, row by row, with the default filter and wrap mode.
    ///
    /// # Errors
    /// When there is not one texel per place, there is none, or one is not finite.
    pub fn new(size: [u32; 2], texels: Vec<[f32; 3]>) -> Result<Self, String> {
        let [width, height] = size.map(|n| n as usize);
        let expected = width.checked_mul(height).filter(|n| *n > 0);
        if expected != Some(texels.len()) {
            let found = texels.len();
            return Err(alloc::format!("{width}x{height} texels were expected, found {found}"));
        }
        if let Some(i) = texels.iter().position(|t| !t.iter().all(|c| c.is_finite())) {
            let (x, y) = (i % width, i / width);
            return Err(alloc::format!("the texel in column {x}, row {y} is not finite"));
        }
        let (filter, wrap) = (TextureFilter::default(), TextureWrap::default());
        Ok(Self { size, texels: Arc::new(texels), filter, wrap, to_uv: UvMap::IDENTITY })
    }

    /// This image with each texel replaced by the value of a function.
    ///
    /// # Errors
    /// When one is not finite.
    pub fn map(self, texel: impl Fn([f32; 3]) -> [f32; 3]) -> Result<Self, String> {
        let image = Self::new(self.size, self.texels.iter().map(|t| texel(*t)).collect())?;
        Ok(Self { texels: image.texels, ..self })
    }

    /// Columns and rows.
    #[must_use]
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// True when all texels at the border of the image are zero.
    pub(crate) fn is_black_around(&self) -> bool {
        let [width, height] = self.size.map(|n| n as usize);
        let at_border = |i: usize| {
            let (x, y) = (i % width, i / width);
            x == 0 || y == 0 || x + 1 == width || y + 1 == height
        };
        let black = |(i, t): (usize, &[f32; 3])| !at_border(i) || *t == [0.0; 3];
        self.to_uv == UvMap::IDENTITY && self.texels.iter().enumerate().all(black)
    }

    /// The texel in a column and row, which may be beyond the image.
    fn index(&self, at: [i64; 2]) -> u32 {
        let [x, y] = [0, 1].map(|axis| {
            let n = i64::from(self.size[axis]);
            let place = match self.wrap {
                TextureWrap::Repeat => at[axis].rem_euclid(n),
                TextureWrap::Clamp => at[axis].clamp(0, n - 1),
                TextureWrap::Mirror => {
                    let place = at[axis].rem_euclid(2 * n);
                    place.min(2 * n - 1 - place)
                }
            };
            place as usize
        });
        (y * self.size[0] as usize + x) as u32
    }

    fn texel(&self, index: u32) -> Rgb {
        Rgb::from(self.texels[index as usize].map(f64::from))
    }

    /// Columns and rows, in texels.
    fn place(&self, uv: [f64; 2]) -> [f64; 2] {
        let mapped = self.to_uv.apply(uv);
        [0, 1].map(|i| {
            let place = mapped[i] * f64::from(self.size[i]);
            // Coordinates that are no numbers, or whose texels cannot be told apart.
            if place.abs() < 1e15 { place } else { 0.0 }
        })
    }

    /// The four texels around a place, by rows, and how far it is from the first of them.
    fn around(&self, place: [f64; 2]) -> ([[u32; 2]; 2], [f64; 2]) {
        let corner = place.map(|s| fm::floor(s - 0.5));
        let [x, y] = corner.map(|c| c as i64);
        let row = |y| [self.index([x, y]), self.index([x + 1, y])];
        ([row(y), row(y + 1)], [0, 1].map(|i| place[i] - 0.5 - corner[i]))
    }

    fn nearest(&self, place: [f64; 2]) -> u32 {
        self.index(place.map(|s| fm::floor(s) as i64))
    }

    fn at(&self, uv: [f64; 2]) -> Rgb {
        let place = self.place(uv);
        match self.filter {
            TextureFilter::Nearest => self.texel(self.nearest(place)),
            TextureFilter::Bilinear => {
                let (rows, [s, t]) = self.around(place);
                let rows = rows.map(|row| row.map(|texel| self.texel(texel)));
                let [a, b] = rows.map(|[a, b]| a * (1.0 - s) + b * s);
                a * (1.0 - t) + b * t
            }
        }
    }

    fn footprint(&self, uv: [f64; 2]) -> Footprint {
        let place = self.place(uv);
        match self.filter {
            TextureFilter::Nearest => Footprint::of(self.nearest(place)),
            TextureFilter::Bilinear => {
                let (rows, by) = self.around(place);
                Footprint::between(rows, by)
            }
        }
    }

    /// The derivatives by both coordinates.
    fn slopes(&self, uv: [f64; 2]) -> [Rgb; 2] {
        if self.filter == TextureFilter::Nearest {
            return [Rgb::ZERO; 2];
        }
        let (rows, [s, t]) = self.around(self.place(uv));
        let [[a, b], [c, d]] = rows.map(|row| row.map(|texel| self.texel(texel)));
        let [width, height] = self.size.map(f64::from);
        let by_x = ((b - a) * (1.0 - t) + (d - c) * t) * width;
        let by_y = ((c - a) * (1.0 - s) + (d - b) * s) * height;
        let [x, y] = self.to_uv.0;
        [0, 1].map(|i| by_x * x[i] + by_y * y[i])
    }
}

/// Which of its colours a checkerboard has.
fn square(to_uv: &UvMap, uv: [f64; 2]) -> usize {
    let [u, v] = to_uv.apply(uv).map(|x| x - fm::floor(x) > 0.5);
    usize::from(u != v)
}

impl Texture {
    /// The value at a point; black on meshes without the attribute that is wanted.
    pub(crate) fn at_point(&self, point: &TexturePoint<'_>) -> Rgb {
        let Some(name) = self.attribute() else { return self.at(point.uv()) };
        let attribute = point.mesh.attribute(name);
        let channels = attribute.map(|v| v.at(point.triangle, point.bary));
        channels.map_or(Rgb::ZERO, |channels| match self {
            Self::Attribute(a) => a.value(channels),
            Self::Volume(v) => v.value(channels.into()),
            Self::Checkerboard { .. } | Self::Bitmap(_) => Rgb::ZERO,
        })
    }

    /// The gradient of the value by the place of a point in its triangle, but for jumps.
    pub(crate) fn gradient(&self, point: &TexturePoint<'_>) -> RgbVec {
        let ([by_s, by_t], [s, t]) = match self {
            Self::Attribute(a) => {
                let Some([p, q, r]) = a.corners(point.mesh, point.triangle) else {
                    return RgbVec::ZERO;
                };
                ([q - p, r - p], point.mesh.barycentric_gradients(point.triangle))
            }
            Self::Volume(v) => (
                v.slopes(point.mesh, point.triangle, point.bary),
                point.mesh.barycentric_gradients(point.triangle),
            ),
            _ => (self.slopes(point.uv()), point.uv_gradients()),
        };
        by_s.outer(s) + by_t.outer(t)
    }

    /// Values, per channel, between which all others on a mesh are; `None` where it lacks the attribute that is wanted.
    pub(crate) fn bounds_on(&self, mesh: &Mesh) -> Option<[Rgb; 2]> {
        let a = match self {
            Self::Attribute(a) => a,
            Self::Volume(_) => {
                return mesh.attribute(VolumeTexture::POSITIONS).map(|_| self.bounds());
            }
            Self::Checkerboard { .. } | Self::Bitmap(_) => return Some(self.bounds()),
        };
        let values = mesh.attribute(&a.name)?.values.iter().flatten();
        let mut bounds = [f64::INFINITY, f64::NEG_INFINITY].map(Rgb::splat);
        for value in values.map(|c| a.value(c.map(f64::from))) {
            if !value.is_finite() {
                return Some([value; 2]);
            }
            bounds = widened(bounds, value);
        }
        Some(bounds)
    }

    /// The attribute of meshes that is wanted.
    pub(crate) fn attribute(&self) -> Option<&str> {
        match self {
            Self::Attribute(a) => Some(&a.name),
            Self::Volume(_) => Some(VolumeTexture::POSITIONS),
            Self::Checkerboard { .. } | Self::Bitmap(_) => None,
        }
    }

    /// The value at texture coordinates; of an attribute or a volume, which have none, [`Texture::mean`].
    #[must_use]
    pub fn at(&self, uv: [f64; 2]) -> Rgb {
        match self {
            Self::Checkerboard { colours, to_uv } => colours[square(to_uv, uv)],
            Self::Bitmap(image) => image.at(uv),
            Self::Attribute(_) | Self::Volume(_) => self.mean(),
        }
    }

    /// Columns and rows of texels: of a checkerboard, its two colours; of an attribute or a volume, none.
    #[must_use]
    pub fn size(&self) -> [u32; 2] {
        match self {
            Self::Checkerboard { .. } => [2, 1],
            Self::Bitmap(image) => image.size,
            Self::Attribute(_) | Self::Volume(_) => [0; 2],
        }
    }

    /// The texel in a column and row, as it is stored; none beyond the image.
    #[must_use]
    pub fn texel(&self, [x, y]: [usize; 2]) -> Option<Rgb> {
        let [width, height] = self.size().map(|n| n as usize);
        let index = (x < width && y < height).then_some(y * width + x)?;
        Some(match self {
            Self::Checkerboard { colours, .. } => colours[index],
            Self::Bitmap(image) => image.texel(index as u32),
            Self::Attribute(_) | Self::Volume(_) => return None,
        })
    }

    /// All texels, row by row and as they are stored; none of an attribute or a volume.
    #[must_use]
    pub fn texels(&self) -> Vec<Rgb> {
        match self {
            Self::Checkerboard { colours, .. } => colours.to_vec(),
            Self::Bitmap(image) => (0..image.texels.len() as u32).map(|t| image.texel(t)).collect(),
            Self::Attribute(_) | Self::Volume(_) => Vec::new(),
        }
    }

    /// Gives all texels other values.
    pub(crate) fn set_texels(&mut self, values: &[Rgb]) -> Result<(), TexelError> {
        match (&mut *self, values) {
            (Self::Checkerboard { colours, .. }, [a, b]) => *colours = [*a, *b],
            (Self::Bitmap(image), _) => return replace_texels(&mut image.texels, values),
            _ => {
                let (found, expected) = (values.len(), self.texels().len());
                return Err(TexelError::Count { found, expected });
            }
        }
        Ok(())
    }

    /// The texels that make up the value at texture coordinates; `None` of an attribute or a volume.
    pub(crate) fn footprint(&self, uv: [f64; 2]) -> Option<Footprint> {
        match self {
            Self::Checkerboard { to_uv, .. } => Some(Footprint::of(square(to_uv, uv) as u32)),
            Self::Bitmap(image) => Some(image.footprint(uv)),
            Self::Attribute(_) | Self::Volume(_) => None,
        }
    }

    /// Makes a change of texels, whose rates it returns.
    pub(crate) fn change(&mut self, change: &TexelChange) -> Result<TexelTangent, TexelError> {
        let [width, height] = self.size();
        match self {
            Self::Checkerboard { colours, .. } => {
                let rates = change.tangent(width * height, |t| colours[t as usize]);
                *colours = [0, 1].map(|t| change.value(t, colours[t as usize]));
                Ok(rates)
            }
            Self::Bitmap(image) => {
                let rates = change.tangent(width * height, |t| image.texel(t));
                change.apply(&mut image.texels)?;
                Ok(rates)
            }
            Self::Attribute(a) => Err(TexelError::NoTexture(a.name.clone())),
            Self::Volume(_) => Err(TexelError::NoTexture(VolumeTexture::POSITIONS.into())),
        }
    }

    /// The derivatives of the value by both coordinates, but for jumps.
    #[must_use]
    pub fn slopes(&self, uv: [f64; 2]) -> [Rgb; 2] {
        match self {
            Self::Checkerboard { .. } | Self::Attribute(_) | Self::Volume(_) => [Rgb::ZERO; 2],
            Self::Bitmap(image) => image.slopes(uv),
        }
    }

    /// False of a value that changes in jumps alone.
    pub(crate) fn has_slopes(&self) -> bool {
        match self {
            Self::Checkerboard { .. } => false,
            Self::Bitmap(image) => image.filter == TextureFilter::Bilinear,
            Self::Attribute(_) | Self::Volume(_) => true,
        }
    }

    /// False where the value jumps, though coordinates do not.
    #[must_use]
    pub fn is_continuous(&self) -> bool {
        match self {
            Self::Checkerboard { .. } => false,
            Self::Bitmap(image) => image.filter == TextureFilter::Bilinear,
            Self::Attribute(a) => a.name.starts_with("vertex_"),
            Self::Volume(v) => v.is_continuous(),
        }
    }

    /// Values, per channel, between which all others are; of a checkerboard its two colours, of an attribute its mean,
    /// of a volume those of its voxels.
    #[must_use]
    pub fn bounds(&self) -> [Rgb; 2] {
        let none = [f64::INFINITY, f64::NEG_INFINITY].map(Rgb::splat);
        match self {
            Self::Checkerboard { colours, .. } => *colours,
            Self::Bitmap(image) => image.texels.iter().fold(none, |b, t| {
                let [r, g, b2] = t.map(f64::from);
                widened(b, Rgb::new(r, g, b2))
            }),
            Self::Attribute(_) => [self.mean(); 2],
            Self::Volume(v) => v.bounds(),
        }
    }

    /// About the mean of the values on a triangle of a mesh.
    pub(crate) fn mean_on(&self, mesh: &Mesh, triangle: u32) -> Rgb {
        const ROWS: u32 = 8;
        let mut sum = Rgb::ZERO;
        // The middles of that many equal triangles squared, which come in pairs but in the last row.
        for (i, j) in (0..ROWS).flat_map(|i| (0..ROWS - i).map(move |j| (i, j))) {
            let middle = |by: f64| [i, j].map(|k| (f64::from(k) + by) / f64::from(ROWS));
            sum += self.at_point(&TexturePoint::new(mesh, triangle, middle(1.0 / 3.0)));
            if i + j + 1 < ROWS {
                sum += self.at_point(&TexturePoint::new(mesh, triangle, middle(2.0 / 3.0)));
            }
        }
        sum * (1.0 / f64::from(ROWS * ROWS))
    }

    /// The mean of all values over the texture's own period; for an attribute, which depends on the mesh, that of 0 and
    /// 1; of a volume that of its voxels.
    #[must_use]
    pub fn mean(&self) -> Rgb {
        match self {
            Self::Checkerboard { colours: [a, b], .. } => (*a + *b) * 0.5,
            Self::Attribute(a) => Rgb::splat(0.5 * a.scale),
            Self::Volume(v) => v.mean(),
            Self::Bitmap(image) => {
                let sum = image
                    .texels
                    .iter()
                    .fold([0.0; 3], |s, t| core::array::from_fn(|c| s[c] + f64::from(t[c])));
                Rgb::from(sum) * (image.texels.len() as f64).recip()
            }
        }
    }
}

/// Bounds that hold another colour, too.
fn widened([low, high]: [Rgb; 2], c: Rgb) -> [Rgb; 2] {
    let by = |f: fn(f64, f64) -> f64, a: Rgb| Rgb::new(f(a.r, c.r), f(a.g, c.g), f(a.b, c.b));
    [by(f64::min, low), by(f64::max, high)]
}

#[cfg(feature = "serde")]
mod unchecked {
    use super::{String, TextureFilter, TextureWrap, UvMap, Vec};

    /// An image as stored, before its texels are counted.
    #[derive(serde::Deserialize)]
    pub(super) struct Bitmap {
        size: [u32; 2],
        texels: Vec<[f32; 3]>,
        filter: TextureFilter,
        wrap: TextureWrap,
        to_uv: UvMap,
    }

    impl TryFrom<Bitmap> for super::Bitmap {
        type Error = String;
        fn try_from(b: Bitmap) -> Result<Self, String> {
            let image = Self::new(b.size, b.texels)?;
            Ok(Self { filter: b.filter, wrap: b.wrap, to_uv: b.to_uv, ..image })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two columns and two rows: 1 2 over 3 4.
    fn image(filter: TextureFilter, wrap: TextureWrap) -> Texture {
        let texels = [1.0, 2.0, 3.0, 4.0].map(|v| [v, 10.0 * v, 0.0]).to_vec();
        Texture::Bitmap(Bitmap { filter, wrap, ..Bitmap::new([2, 2], texels).expect("an image") })
    }

    fn red(t: &Texture, u: f64, v: f64) -> f64 {
        t.at([u, v]).r
    }

    #[test]
    fn texels_are_where_their_middles_are() {
        for filter in [TextureFilter::Nearest, TextureFilter::Bilinear] {
            let t = image(filter, TextureWrap::Repeat);
            for (u, v, value) in [(0.25, 0.25, 1.0), (0.75, 0.25, 2.0), (0.25, 0.75, 3.0)] {
                assert_eq!(t.at([u, v]), Rgb::new(value, 10.0 * value, 0.0));
            }
        }
        let t = image(TextureFilter::Bilinear, TextureWrap::Repeat);
        assert_eq!(red(&t, 0.5, 0.25), 1.5);
        assert_eq!(red(&t, 0.5, 0.5), 2.5);
        assert!((red(&t, 0.35, 0.4) - (1.0 + 0.2 + 0.6)).abs() < 1e-12);
    }

    #[test]
    fn images_go_on_beyond_the_unit_square() {
        let at = |wrap, u| red(&image(TextureFilter::Nearest, wrap), u, 0.25);
        for (u, repeat, mirror, clamp) in
            [(1.25, 1.0, 2.0, 2.0), (1.75, 2.0, 1.0, 2.0), (-0.25, 2.0, 1.0, 1.0)]
        {
            assert_eq!(at(TextureWrap::Repeat, u), repeat, "{u}");
            assert_eq!(at(TextureWrap::Mirror, u), mirror, "{u}");
            assert_eq!(at(TextureWrap::Clamp, u), clamp, "{u}");
        }
        // Between the last and the first column.
        assert_eq!(red(&image(TextureFilter::Bilinear, TextureWrap::Repeat), 1.0, 0.25), 1.5);
        assert_eq!(red(&image(TextureFilter::Bilinear, TextureWrap::Clamp), 1.0, 0.25), 2.0);
        for u in [f64::NAN, f64::INFINITY, -1e300] {
            assert!(red(&image(TextureFilter::Bilinear, TextureWrap::Mirror), u, u).is_finite());
        }
    }

    #[test]
    fn squares_alternate() {
        let colours = [Rgb::splat(0.2), Rgb::splat(0.4)];
        let to_uv = UvMap([[2.0, 0.0, 0.0], [0.0, 2.0, 0.0]]);
        let t = Texture::Checkerboard { colours, to_uv };
        for (u, v, first) in
            [(0.1, 0.1, true), (0.3, 0.1, false), (0.3, 0.3, true), (-0.1, 0.1, false)]
        {
            assert_eq!(t.at([u, v]) == colours[0], first, "{u} {v}");
        }
        assert!((t.mean().r - 0.3).abs() < 1e-15);
        assert_eq!(t.bounds(), colours);
    }

    #[test]
    fn broken_images_are_refused() {
        assert!(Bitmap::new([2, 2], alloc::vec![[0.0; 3]; 3]).is_err());
        assert!(Bitmap::new([0, 2], Vec::new()).is_err());
        let nan = Bitmap::new([2, 1], alloc::vec![[0.0; 3], [0.0, f32::NAN, 0.0]]);
        assert!(nan.unwrap_err().contains("column 1, row 0"));
    }
}
