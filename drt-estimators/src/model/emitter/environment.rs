use alloc::string::String;
use alloc::vec::Vec;
use core::f64::consts::{PI, TAU};

use drt_math::{AliasTable, Mat3, Rgb, Vec3, fm, vec3};

/// Light from all around, as an image says: Mitsuba's `envmap`. Columns go around the axis y of its frame and rows from +y to
/// -y, the first and the last of them at the poles; values between the middles of texels are interpolated linearly.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "unchecked::EnvironmentMap"))]
pub struct EnvironmentMap {
    size: [u32; 2],
    texels: Vec<[f32; 3]>,
    to_world: Mat3,
    /// Of the cells between texels, row by row: by their mean light. `None` where all are black.
    #[cfg_attr(feature = "serde", serde(skip_serializing))]
    cells: Option<AliasTable>,
    /// Integral of the mean of the channels over all directions.
    #[cfg_attr(feature = "serde", serde(skip_serializing))]
    power: f64,
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
        let off = [Vec3::X, Vec3::Y, Vec3::Z].map(|e| to_world.transpose_mul(to_world * e) - e);
        // What is no number is not small.
        if !off.into_iter().all(|d| d.is_finite() && d.max_abs() < TOLERANCE) {
            return Err("its frame may be turned and mirrored, not scaled or sheared".into());
        }
        let mut map = Self { size, texels, to_world, cells: None, power: 0.0 };
        let cells = width * (height - 1);
        let mut weights = Vec::with_capacity(cells);
        for y in 0..height - 1 {
            let solid_angle = map.solid_angle(y);
            weights.extend((0..width).map(|x| {
                let corners = [(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)];
                solid_angle
                    * 0.25
                    * corners.map(|(x, y)| map.texel(x, y).mean()).iter().sum::<f64>()
            }));
        }
        map.power = weights.iter().sum();
        if map.power > 0.0 {
            let table = AliasTable::new(&weights);
            map.cells = Some(table.map_err(|e| alloc::format!("{e}"))?);
        }
        Ok(map)
    }

    /// Integral of the mean of the channels over all directions.
    pub(super) fn power(&self) -> f64 {
        self.power
    }

    fn texel(&self, x: usize, y: usize) -> Rgb {
        let width = self.size[0] as usize;
        let [r, g, b] = self.texels[y * width + x % width].map(f64::from);
        Rgb::new(r, g, b)
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
        let row = |y| self.texel(x, y) * (1.0 - s) + self.texel(x + 1, y) * s;
        row(y) * (1.0 - t) + row(y + 1) * t
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
