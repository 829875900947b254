//! Mitsuba's binary grid volumes (`.vol`, version 3; the same in Mitsuba 0.5 and 3).
//!
//! Little-endian throughout: the bytes `VOL` and 3; i32 encoding (1: float32, 2: float16,
//! 3: u8 with 255 for one); i32 size along x, y, z; i32 channels; six float32 of bounding box (least
//! corner, then largest); then the values, x fastest, then y, then z, channels side by side.

use std::path::Path;
use std::string::{String, ToString};
use std::vec::Vec;

use drt_math::{Affine, Mat3, Vec3};

use crate::{Grid, MediumError};

const MAGIC: [u8; 4] = *b"VOL\x03";
const HEADER: usize = 48;

/// A grid and the bounding box stored with it.
#[derive(Clone, Debug, PartialEq)]
pub struct VolFile {
    /// The values, in the unit cube.
    pub grid: Grid,
    /// Least and largest corner of the stored box. Mitsuba 0.5 places the grid there; Mitsuba 3
    /// only with `use_grid_bbox`.
    pub bounds: [Vec3; 2],
}

impl VolFile {
    /// The map of the unit cube to the stored box.
    #[must_use]
    pub fn placement(&self) -> Affine {
        let [lo, hi] = self.bounds;
        Affine { linear: Mat3::diagonal(hi - lo), translation: lo }
    }
}

/// Why a file of a volume cannot be read or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum VolError {
    /// The system refused.
    #[error("{file}: {source}")]
    Io {
        /// The file.
        file: String,
        /// What the system says.
        source: std::io::Error,
    },
    /// A header field or value is not what the format allows.
    #[error("{file}, byte {offset}: {field} is {found}, expected {expected}")]
    Field {
        /// The file.
        file: String,
        /// Where in the file.
        offset: usize,
        /// What stands there.
        field: &'static str,
        /// What was found.
        found: String,
        /// What the format allows.
        expected: &'static str,
    },
    /// The file ends too early.
    #[error("{file} is cut off at byte {found}: its header announces {expected} bytes")]
    Cut {
        /// The file.
        file: String,
        /// Bytes there.
        found: usize,
        /// Bytes needed; `usize::MAX` when no file could be that large.
        expected: usize,
    },
    /// The values do not form a grid.
    #[error("{file}: {source}")]
    Grid {
        /// The file.
        file: String,
        /// What is wrong with it.
        source: MediumError,
    },
    /// A grid cannot be stored in this format.
    #[error("the grid cannot be written: {0}")]
    NotStorable(&'static str),
}

/// Reads a file.
///
/// # Errors
/// When it cannot be opened, is not a `.vol` file of version 3, is cut off, has other than 1 or 3
/// channels, or holds a value that is not finite. Nothing is allocated for sizes that the file
/// does not have the bytes for.
pub fn read(path: impl AsRef<Path>) -> Result<VolFile, VolError> {
    let file = path.as_ref().display().to_string();
    match std::fs::read(path) {
        Ok(bytes) => decode(&bytes, &file),
        Err(source) => Err(VolError::Io { file, source }),
    }
}

/// Reads the content of a file; `file` names it in errors.
///
/// # Errors
/// As [`read`].
pub fn decode(bytes: &[u8], file: &str) -> Result<VolFile, VolError> {
    let input = Input { bytes, file };
    if bytes.len() < HEADER {
        return Err(input.cut(HEADER));
    }
    if bytes[..4] != MAGIC {
        let found = format!("{:?}", &bytes[..4]);
        return Err(input.field(0, "the signature", found, "the bytes \"VOL\" and version 3"));
    }
    let encoding = match input.i32(4) {
        1 => Encoding::Float32,
        2 => Encoding::Float16,
        3 => Encoding::Byte,
        e => {
            let expected = "1 (float32), 2 (float16) or 3 (bytes)";
            return Err(input.field(4, "the encoding", e.to_string(), expected));
        }
    };
    let size = [
        input.size(8, "the size along x")?,
        input.size(12, "the size along y")?,
        input.size(16, "the size along z")?,
    ];
    let channels = match input.i32(20) {
        n @ (1 | 3) => n as usize,
        n => return Err(input.field(20, "the number of channels", n.to_string(), "1 or 3")),
    };
    let mut corners = [0.0; 6];
    for (k, c) in corners.iter_mut().enumerate() {
        *c = input.finite(24 + 4 * k, "the bounding box", f64::from(input.f32(24 + 4 * k)))?;
    }
    let [x0, y0, z0, x1, y1, z1] = corners;

    let width = encoding.width();
    let length = size.iter().try_fold(channels * width, |n, &s| n.checked_mul(s));
    let end = length.and_then(|n| n.checked_add(HEADER)).unwrap_or(usize::MAX);
    let data = bytes.get(HEADER..end).ok_or_else(|| input.cut(end))?;
    let values = data
        .chunks_exact(width)
        .enumerate()
        .map(|(n, raw)| input.finite(HEADER + n * width, "a grid value", encoding.value(raw)))
        .collect::<Result<Vec<_>, _>>()?;
    let grid = Grid::new(size, channels, values)
        .map_err(|source| VolError::Grid { file: file.to_string(), source })?;
    Ok(VolFile { grid, bounds: [[x0, y0, z0].into(), [x1, y1, z1].into()] })
}

/// Writes a file in float32. Layout, filter, wrap mode and placement are not part of the format.
///
/// # Errors
/// As [`encode`], and when the file cannot be written.
pub fn write(path: impl AsRef<Path>, volume: &VolFile) -> Result<(), VolError> {
    let file = path.as_ref().display().to_string();
    std::fs::write(path, encode(volume)?).map_err(|source| VolError::Io { file, source })
}

/// The content of a file in float32.
///
/// # Errors
/// When a size exceeds an i32, or a value or corner the range of float32.
pub fn encode(volume: &VolFile) -> Result<Vec<u8>, VolError> {
    let (grid, [lo, hi]) = (&volume.grid, volume.bounds);
    let mut out = Vec::with_capacity(HEADER + 4 * grid.values().len());
    out.extend(MAGIC);
    out.extend(1_i32.to_le_bytes());
    for n in grid.size().into_iter().chain([grid.channels()]) {
        let n = i32::try_from(n).map_err(|_| VolError::NotStorable("a size exceeds 2³¹ - 1"))?;
        out.extend(n.to_le_bytes());
    }
    let corners = lo.to_array().into_iter().chain(hi.to_array());
    for v in corners.chain(grid.values().iter().copied()) {
        let v = v as f32;
        if !v.is_finite() {
            return Err(VolError::NotStorable("a value exceeds the range of float32"));
        }
        out.extend(v.to_le_bytes());
    }
    Ok(out)
}

#[derive(Clone, Copy)]
enum Encoding {
    Float32,
    Float16,
    Byte,
}

impl Encoding {
    fn width(self) -> usize {
        match self {
            Self::Float32 => 4,
            Self::Float16 => 2,
            Self::Byte => 1,
        }
    }

    /// The number stored in `width` bytes.
    fn value(self, raw: &[u8]) -> f64 {
        match (self, raw) {
            (Self::Float32, &[a, b, c, d]) => f64::from(f32::from_le_bytes([a, b, c, d])),
            (Self::Float16, &[a, b]) => half(u16::from_le_bytes([a, b])),
            (Self::Byte, &[a]) => f64::from(a) / 255.0,
            _ => f64::NAN,
        }
    }
}

/// The value of an IEEE 754 binary16 number.
fn half(bits: u16) -> f64 {
    let fraction = f64::from(bits & 0x3ff);
    let magnitude = match bits >> 10 & 0x1f {
        0 => fraction * (-24_f64).exp2(),
        31 if fraction == 0.0 => f64::INFINITY,
        31 => f64::NAN,
        e => (1024.0 + fraction) * (f64::from(e) - 25.0).exp2(),
    };
    if bits >> 15 == 1 { -magnitude } else { magnitude }
}

/// The bytes of a file at least as long as the header, and its name for errors.
struct Input<'a> {
    bytes: &'a [u8],
    file: &'a str,
}

impl Input<'_> {
    fn word(&self, offset: usize) -> [u8; 4] {
        core::array::from_fn(|i| self.bytes[offset + i])
    }
    fn i32(&self, offset: usize) -> i32 {
        i32::from_le_bytes(self.word(offset))
    }
    fn f32(&self, offset: usize) -> f32 {
        f32::from_le_bytes(self.word(offset))
    }
    fn size(&self, offset: usize, field: &'static str) -> Result<usize, VolError> {
        let n = self.i32(offset);
        match usize::try_from(n) {
            Ok(n) if n > 0 => Ok(n),
            _ => Err(self.field(offset, field, n.to_string(), "at least 1")),
        }
    }
    fn finite(&self, offset: usize, field: &'static str, value: f64) -> Result<f64, VolError> {
        if value.is_finite() {
            return Ok(value);
        }
        Err(self.field(offset, field, value.to_string(), "a finite number"))
    }
    fn field(
        &self,
        offset: usize,
        field: &'static str,
        found: String,
        expected: &'static str,
    ) -> VolError {
        VolError::Field { file: self.file.to_string(), offset, field, found, expected }
    }
    fn cut(&self, expected: usize) -> VolError {
        VolError::Cut { file: self.file.to_string(), found: self.bytes.len(), expected }
    }
}
