use alloc::string::String;
use alloc::sync::Arc;
use alloc::vec::Vec;
use core::f64::consts::{PI, TAU};

use drt_math::{AliasTable, Mat3, Rgb, RgbVec, Vec3, fm, vec3};

use crate::model::texture::{Footprint, TexelChange, TexelError, TexelTangent, replace_texels};

/// Light from all around, as an image says: Mitsuba's `envmap`. Columns go around the axis y of its frame and rows from +y to
/// -y, the first and the last of them at the poles; values between the middles of texels are interpolated linearly.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "unchecked::EnvironmentMap"))]
pub struct EnvironmentMap {
    size: [u32; 2],
    /// Row by row; shared by maps that differ in their frames.
    texels: Arc<Vec<[f32; 3]>>,
    to_world: Mat3,
    /// Of the cells between texels, row by row: by their mean light. `None` where all are black.
    #[cfg_attr(feature = "serde", serde(skip_serializing))]
    cells: Option<AliasTable>,
    /// Integral of the mean of the channels over all directions.
    #[cfg_attr(feature = "serde", serde(skip_serializing))]
    power: f64,
}

fn is_orthonormal(frame: &Mat3) -> bool {
    let off = [Vec3::X, Vec3::Y, Vec3::Z].map(|e| frame.transpose_mul(*frame * e) - e);
    // What is no number is not small.
    off.into_iter().all(|d| d.is_finite() && d.max_abs() < TOLERANCE)
}

/// Of the products of a frame's axes.
const TOLERANCE: f64 = 1e-6;

impl EnvironmentMap {
    /// An image of `size` columns and rows, row by row from the top, and the frame it is in: a rotation, or one with a reflection.
    ///
    /// # Errors
    /// When there is not one texel per place, there are fewer than two rows, a texel is negative or not finite, or the
    /// frame is not orthonormal.
    pub fn new(size: [u32; 2], texels: Vec<[f32; 3]>, to_world: Mat3) -> Result<Self, String> {
        let [width, height] = size.map(|n| n as usize);
        let expected = width.checked_mul(height).filter(|n| *n > 0);
        if expected != Some(texels.len()) {
            let found = texels.len();
            return Err(alloc::format!("{width}x{height} texels were expected, found {found}"));
        }
        if height < 2 {
            return Err("it has one row; an environment needs two at least".into());
        }
        if let Some(i) = texels.iter().position(|t| !t.iter().all(|c| c.is_finite() && *c >= 0.0)) {
            let (x, y) = (i % width, i / width);
            return Err(alloc::format!(
                "the texel in column {x}, row {y} is negative or not finite"
            ));
        }
        if !is_orthonormal(&to_world) {
            return Err("its frame may be turned and mirrored, not scaled or sheared".into());
        }
        let texels = Arc::new(texels);
        let mut map = Self { size, texels, to_world, cells: None, power: 0.0 };
        map.prepare()?;
        Ok(map)
    }

    /// Finds where light comes from.
    fn prepare(&mut self) -> Result<(), String> {
        let map = &*self;
        let [width, height] = self.size.map(|n| n as usize);
        let mut weights = Vec::with_capacity(width * (height - 1));
        for y in 0..height - 1 {
            let solid_angle = map.solid_angle(y);
            weights.extend((0..width).map(|x| {
                let corners = [(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)];
                // A change of texels may push some below zero.
                let light = corners.map(|(x, y)| map.wrapped(x, y).mean().max(0.0));
                solid_angle * 0.25 * light.iter().sum::<f64>()
            }));
        }
        self.power = weights.iter().sum();
        self.cells = None;
        if self.power > 0.0 {
            let table = AliasTable::new(&weights);
            self.cells = Some(table.map_err(|e| alloc::format!("{e}"))?);
        }
        Ok(())
    }

    /// Columns and rows.
    #[must_use]
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// The same turned further; `None` where the map of space is no rotation or reflection.
    pub(super) fn turned(&self, by: &Mat3) -> Option<Self> {
        let to_world = *by * self.to_world;
        is_orthonormal(&to_world).then(|| Self { to_world, ..self.clone() })
    }

    /// Makes a change of texels, whose rates it returns.
    pub(super) fn change(&mut self, change: &TexelChange) -> Result<TexelTangent, TexelError> {
        let value = |t: u32| Rgb::from(self.texels[t as usize].map(f64::from));
        let rates = change.tangent(self.texels.len() as u32, value);
        if change.apply(&mut self.texels)? {
            self.prepare().map_err(|_| TexelError::NotFinite)?;
        }
        Ok(rates)
    }

    /// All texels, row by row.
    pub(super) fn texels(&self) -> Vec<Rgb> {
        self.texels.iter().map(|t| Rgb::from(t.map(f64::from))).collect()
    }

    /// Gives all texels other values.
    pub(super) fn set_texels(&mut self, values: &[Rgb]) -> Result<(), TexelError> {
        replace_texels(&mut self.texels, values)?;
        self.prepare().map_err(|_| TexelError::NotFinite)
    }

    /// Integral of the mean of the channels over all directions.
    pub(super) fn power(&self) -> f64 {
        self.power
    }

    /// The texel in a column and row; none beyond the image.
    #[must_use]
    pub fn texel(&self, [x, y]: [usize; 2]) -> Option<Rgb> {
        let [width, height] = self.size.map(|n| n as usize);
        (x < width && y < height).then(|| self.wrapped(x, y))
    }

    fn wrapped(&self, x: usize, y: usize) -> Rgb {
        let width = self.size[0] as usize;
        Rgb::from(self.texels[y * width + x % width].map(f64::from))
    }

    /// Of a cell of a row.
    fn solid_angle(&self, row: usize) -> f64 {
        let [top, bottom] = self.heights(row);
        (top - bottom) * TAU / f64::from(self.size[0])
    }

    /// Cosines to the axis at the borders of a row of cells.
    fn heights(&self, row: usize) -> [f64; 2] {
        [row, row + 1].map(|y| fm::sin_cos(y as f64 * PI / f64::from(self.size[1] - 1)).1)
    }

    /// Column and row of a cell, and where in it a unit direction is.
    fn cell(&self, w: Vec3) -> ([usize; 2], [f64; 2]) {
        let [width, height] = self.size;
        let v = self.to_world.transpose_mul(w);
        let around = fm::atan2(v.x, -v.z) / TAU * f64::from(width) - 0.5;
        let down = fm::acos(v.y.clamp(-1.0, 1.0)) / PI * f64::from(height - 1);
        let column = fm::floor(around);
        let row = fm::floor(down).min(f64::from(height - 2));
        let x = (column as i64).rem_euclid(i64::from(width)) as usize;
        ([x, row as usize], [around - column, down - row])
    }

    /// The light from a unit direction.
    #[must_use]
    pub fn at(&self, w: Vec3) -> Rgb {
        let ([x, y], [s, t]) = self.cell(w);
        let row = |y| self.wrapped(x, y) * (1.0 - s) + self.wrapped(x + 1, y) * s;
        row(y) * (1.0 - t) + row(y + 1) * t
    }

    /// The texels that make up the light from a unit direction.
    pub(crate) fn footprint(&self, w: Vec3) -> Footprint {
        let ([x, y], by) = self.cell(w);
        let width = self.size[0] as usize;
        let row = |y: usize| [x, x + 1].map(|x| (y * width + x % width) as u32);
        Footprint::between([row(y), row(y + 1)], by)
    }

    /// The derivative of the light from a unit direction w as the map turns, by the vector of its rotation ω: directions in the
    /// map's frame turn by -ω × w, so that it is ∇L × w.
    pub(crate) fn by_rotation(&self, w: Vec3) -> RgbVec {
        self.gradient(w).map(|g| g.cross(w))
    }

    /// The gradient ∇L of the light by its unit direction, across it. At the poles, where it grows without bounds, it is zero.
    pub(crate) fn gradient(&self, w: Vec3) -> RgbVec {
        let ([x, y], [s, t]) = self.cell(w);
        let [[a, b], [c, d]] = [y, y + 1].map(|y| [x, x + 1].map(|x| self.wrapped(x, y)));
        let [width, height] = self.size.map(f64::from);
        let around = ((b - a) * (1.0 - t) + (d - c) * t) * (width / TAU);
        let down = ((c - a) * (1.0 - s) + (d - b) * s) * ((height - 1.0) / PI);
        let v = self.to_world.transpose_mul(w);
        let square = v.x * v.x + v.z * v.z;
        if square <= 0.0 {
            return RgbVec::ZERO;
        }
        // Of the angles atan2(x, -z) and acos y.
        let by_around = vec3(-v.z, 0.0, v.x) / square;
        let by_down = (v * v.y - Vec3::Y) / fm::sqrt(square);
        around.outer(self.to_world * by_around) + down.outer(self.to_world * by_down)
    }

    /// Draws a direction that light comes from, by two uniform numbers and one that chooses, with its density per steradian.
    /// `None` where no light comes from anywhere.
    #[must_use]
    pub fn sample(&self, choice: f64, [u, v]: [f64; 2]) -> Option<(Vec3, f64)> {
        let table = self.cells.as_ref()?;
        let cell = table.sample(choice).index;
        let width = self.size[0] as usize;
        let (x, y) = (cell % width, cell / width);
        let [top, bottom] = self.heights(y);
        let height = top + (bottom - top) * v;
        let radius = fm::sqrt((1.0 - height * height).max(0.0));
        let (sin, cos) = fm::sin_cos((x as f64 + 0.5 + u) * TAU / width as f64);
        let w = self.to_world * vec3(radius * sin, height, -radius * cos);
        Some((w, table.pmf(cell) / self.solid_angle(y)))
    }

    /// Density per steradian with which [`Self::sample`] draws a direction.
    #[must_use]
    pub fn pdf(&self, w: Vec3) -> f64 {
        let Some(table) = &self.cells else { return 0.0 };
        let ([x, y], _) = self.cell(w);
        table.pmf(y * self.size[0] as usize + x) / self.solid_angle(y)
    }
}

#[cfg(feature = "serde")]
mod unchecked {
    use super::{Mat3, String, Vec};

    /// A map as stored, before its texels are looked at.
    #[derive(serde::Deserialize)]
    pub(super) struct EnvironmentMap {
        size: [u32; 2],
        texels: Vec<[f32; 3]>,
        to_world: Mat3,
    }

    impl TryFrom<EnvironmentMap> for super::EnvironmentMap {
        type Error = String;
        fn try_from(m: EnvironmentMap) -> Result<Self, String> {
            Self::new(m.size, m.texels, m.to_world)
        }
    }
}

#[cfg(test)]
mod tests {
    use drt_math::{Rng, warp};

    use super::*;

    fn map(seed: u64) -> EnvironmentMap {
        let mut rng = Rng::new(seed, 0, 0);
        let texels = (0..15).map(|_| [0; 3].map(|_| rng.next_f64() as f32)).collect();
        let mirror = Mat3::diagonal(vec3(-1.0, 1.0, 1.0));
        let frame = Mat3::rotation(vec3(0.3, 1.0, -0.2).normalize(), 0.7) * mirror;
        EnvironmentMap::new([5, 3], texels, frame).expect("a map")
    }

    #[test]
    fn samples_have_their_density_and_integrate() {
        let map = map(1);
        let mut rng = Rng::new(2, 0, 0);
        let n = 200_000;
        let [mut drawn, mut even, mut density] = [0.0; 3];
        for _ in 0..n {
            let (w, pdf) = map.sample(rng.next_f64(), rng.next_2d()).expect("light");
            assert!((map.pdf(w) / pdf - 1.0).abs() < 1e-9 && (w.length() - 1.0).abs() < 1e-9);
            // An odd function of the direction, so that a turned map would show.
            let weight = |w: Vec3| 1.0 + 0.8 * w.x + 0.3 * w.y * w.z;
            drawn += map.at(w).g * weight(w) / pdf / f64::from(n);
            let w = warp::uniform_sphere(rng.next_2d());
            even += map.at(w).g * weight(w) * 4.0 * PI / f64::from(n);
            density += map.pdf(w) * 4.0 * PI / f64::from(n);
        }
        assert!((drawn / even - 1.0).abs() < 0.01, "{drawn} {even}");
        assert!((density - 1.0).abs() < 0.01, "{density}");
    }

    /// What Mitsuba 3.9.1 says of an image of 4 by 3 texels that count from 0 to 1.1 in red.
    #[test]
    fn directions_are_where_mitsuba_has_them() {
        let texels = (0..12_u8).map(|i| [f32::from(i) * 0.1, 0.0, 0.0]).collect();
        let map = EnvironmentMap::new([4, 3], texels, Mat3::IDENTITY).expect("a map");
        for (w, red) in MITSUBA {
            let found = map.at(Vec3::from(w).normalize()).r;
            assert!((found - red).abs() < 1e-5, "{w:?}: {found}, not {red}");
        }
    }

    const MITSUBA: [([f64; 3], f64); 4] = [
        ([1.0, 0.2, 0.3], 0.420357),
        ([-0.5, 0.7, 0.1], 0.397748),
        ([0.1, -0.9, -0.4], 0.793819),
        ([-0.3, 0.1, -0.9], 0.584706),
    ];

    #[test]
    fn light_turns_with_the_map() {
        let (map, mut rng) = (map(3), Rng::new(4, 0, 0));
        let step = 1e-6;
        for _ in 0..200 {
            let w = warp::uniform_sphere(rng.next_2d());
            let axis = warp::uniform_sphere(rng.next_2d());
            let turned = |by: f64| map.turned(&Mat3::rotation(axis, by)).expect("a rotation").at(w);
            let difference = (turned(step) - turned(-step)) * (0.5 / step);
            let rate = map.by_rotation(w).dot(axis);
            // Not where a border between cells passes by.
            let error = (rate - difference).max_abs();
            assert!(error < 1e-6 * (1.0 + rate.max_abs()), "{w:?}: {rate:?} {difference:?}");
        }
        assert!(map.turned(&(Mat3::IDENTITY * 1.1)).is_none());
    }

    #[test]
    fn broken_maps_are_refused() {
        let fails = |size, texels: Vec<[f32; 3]>, frame, part: &str| {
            let message = EnvironmentMap::new(size, texels, frame).unwrap_err();
            assert!(message.contains(part), "{message}");
        };
        let grey = |n| alloc::vec![[0.5; 3]; n];
        fails([2, 2], grey(3), Mat3::IDENTITY, "2x2 texels");
        fails([1, 1], grey(1), Mat3::IDENTITY, "one row");
        for wrong in [f32::NAN, f32::INFINITY, -0.1] {
            let mut texels = grey(4);
            texels[3][1] = wrong;
            fails([2, 2], texels, Mat3::IDENTITY, "column 1, row 1");
        }
        for frame in [Mat3::IDENTITY * 2.0, Mat3::IDENTITY * f64::NAN] {
            fails([2, 2], grey(4), frame, "not scaled");
        }
        let black = EnvironmentMap::new([2, 2], alloc::vec![[0.0; 3]; 4], Mat3::IDENTITY);
        assert!(black.expect("a map").sample(0.5, [0.5; 2]).is_none());
    }
}
