//! Mitsuba's binary grid volumes (`.vol`, version 3; the same in Mitsuba 0.5 and 3).
//!
//! Little-endian throughout: the bytes `VOL` and 3; i32 encoding (1: float32, 2: float16,
//! 3: u8 with 255 for one); i32 size along x, y, z; i32 channels; six float32 of bounding box (least
//! corner, then largest); then the values, x fastest, then y, then z, channels side by side.

use std::format;
use std::fs::File;
use std::io::{ErrorKind, Read};
use std::path::Path;
use std::string::{String, ToString};
use std::vec;
use std::vec::Vec;

use drt_math::{Affine, Mat3, Vec3, vec3};

use crate::Grid;
use crate::pages::Pages;
pub use crate::vol_error::VolError;

const MAGIC: [u8; 4] = *b"VOL\x03";
const HEADER: usize = 48;
/// Bytes that are read at a time: whole values of every encoding.
const BUFFER: usize = 1 << 16;

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

/// Reads a file. Its bytes are not kept beside the values.
///
/// # Errors
/// When it cannot be opened, is not a `.vol` file of version 3, is cut off, has other than 1 or 3
/// channels, or holds a value that is not finite. Nothing is allocated for sizes that the file
/// does not have the bytes for.
pub fn read(path: impl AsRef<Path>) -> Result<VolFile, VolError> {
    let (file, length, open) = open(path)?;
    decode_from(open, length, &file)
}

/// Reads the content of a file; `file` names it in errors.
///
/// # Errors
/// As [`read`].
pub fn decode(bytes: &[u8], file: &str) -> Result<VolFile, VolError> {
    decode_from(bytes, bytes.len() as u64, file)
}

/// Reads a file of symmetric matrices, whose six channels are the entries xx, yy, zz, xy, xz and yz, as one of those on the
/// diagonal and one of the others.
///
/// # Errors
/// As [`read`], but for the number of channels, which is six.
pub fn read_matrices(path: impl AsRef<Path>) -> Result<[VolFile; 2], VolError> {
    let (file, length, open) = open(path)?;
    matrices_from(open, length, &file)
}

/// Reads the content of a file of symmetric matrices as [`read_matrices`] does; `file` names it in errors.
///
/// # Errors
/// As [`read_matrices`].
pub fn decode_matrices(bytes: &[u8], file: &str) -> Result<[VolFile; 2], VolError> {
    matrices_from(bytes, bytes.len() as u64, file)
}

/// Reads a file of matrices of a length.
fn matrices_from(from: impl Read, length: u64, file: &str) -> Result<[VolFile; 2], VolError> {
    let (header, values) = values_from(from, length, file, &[6])?;
    let part = |first: usize| -> Result<VolFile, VolError> {
        let own = values.chunks_exact(6).flat_map(|six| six[first..first + 3].iter().copied());
        header.grid(3, own.collect(), file)
    };
    Ok([part(0)?, part(3)?])
}

/// The name of a file, its length and what is in it.
fn open(path: impl AsRef<Path>) -> Result<(String, u64, File), VolError> {
    let file = path.as_ref().display().to_string();
    match File::open(path).and_then(|open| Ok((open.metadata()?.len(), open))) {
        Ok((length, open)) => Ok((file, length, open)),
        Err(source) => Err(VolError::Io { file, source }),
    }
}

/// What the header of a file tells.
#[derive(Clone, Copy)]
struct Header {
    encoding: Encoding,
    size: [usize; 3],
    channels: usize,
    bounds: [Vec3; 2],
}

impl Header {
    /// The file with these values.
    fn grid(&self, channels: usize, values: Vec<f64>, file: &str) -> Result<VolFile, VolError> {
        let grid = Grid::new(self.size, channels, values)
            .map_err(|source| VolError::Grid { file: file.to_string(), source })?;
        Ok(VolFile { grid, bounds: self.bounds })
    }
}

/// Reads a file of a length.
fn decode_from(from: impl Read, length: u64, file: &str) -> Result<VolFile, VolError> {
    let (header, values) = values_from(from, length, file, &[1, 3])?;
    header.grid(header.channels, values, file)
}

/// The header and the values of a file of a length and one of the given numbers of channels.
fn values_from(
    mut from: impl Read,
    length: u64,
    file: &str,
    allowed: &[usize],
) -> Result<(Header, Vec<f64>), VolError> {
    let length = usize::try_from(length).unwrap_or(usize::MAX);
    let failed = |source| VolError::Io { file: file.to_string(), source };
    let mut start = Vec::new();
    from.by_ref().take(HEADER as u64).read_to_end(&mut start).map_err(failed)?;
    let header = header(&Pages { bytes: &start, file }, allowed)?;
    let Header { encoding, size, channels, .. } = header;
    let width = encoding.width();
    let count = size.iter().try_fold(channels, |n, &s| n.checked_mul(s));
    let bytes = count.and_then(|n| n.checked_mul(width));
    let end = bytes.and_then(|n| n.checked_add(HEADER)).unwrap_or(usize::MAX);
    let cut = |found| VolError::Cut { file: file.to_string(), found, expected: end };
    let count = count.filter(|_| end <= length).ok_or_else(|| cut(length))?;
    let mut values = Vec::with_capacity(count);
    let mut buffer = vec![0; usize::min(BUFFER, count * width)];
    while values.len() < count {
        let at = HEADER + values.len() * width;
        let part = &mut buffer[..usize::min(BUFFER, end - at)];
        from.read_exact(part).map_err(|source| match source.kind() {
            ErrorKind::UnexpectedEof => cut(at),
            _ => failed(source),
        })?;
        let part = Pages { bytes: part, file };
        for (n, raw) in part.bytes.chunks_exact(width).enumerate() {
            values.push(part.finite(at + n * width, "a grid value", encoding.value(raw))?);
        }
    }
    Ok((header, values))
}

fn header(pages: &Pages<'_>, allowed: &[usize]) -> Result<Header, VolError> {
    pages.slice(0, HEADER)?;
    let signature = pages.slice(0, MAGIC.len())?;
    if *signature != MAGIC {
        let (found, expected) = (format!("{signature:?}"), "the bytes \"VOL\" and version 3");
        return Err(pages.field(0, "the signature", found, expected));
    }
    let encoding = match pages.i32(4)? {
        1 => Encoding::Float32,
        2 => Encoding::Float16,
        3 => Encoding::Byte,
        e => {
            let expected = "1 (float32), 2 (float16) or 3 (bytes)";
            return Err(pages.field(4, "the encoding", e.to_string(), expected));
        }
    };
    let extent = |offset, field| {
        let n = pages.i32(offset)?;
        let size = usize::try_from(n).ok().filter(|n| *n > 0);
        size.ok_or_else(|| pages.field(offset, field, n.to_string(), "at least 1"))
    };
    let size = [
        extent(8, "the size along x")?,
        extent(12, "the size along y")?,
        extent(16, "the size along z")?,
    ];
    let found = pages.i32(20)?;
    let channels = allowed.iter().copied().find(|n| usize::try_from(found) == Ok(*n));
    let expected = if allowed.contains(&6) { "6" } else { "1 or 3" };
    let channels = channels
        .ok_or_else(|| pages.field(20, "the number of channels", found.to_string(), expected))?;
    let corner = |offset: usize| -> Result<Vec3, VolError> {
        let c = |k: usize| pages.f32(offset + 4 * k, "the bounding box");
        Ok(vec3(c(0)?, c(1)?, c(2)?))
    };
    Ok(Header { encoding, size, channels, bounds: [corner(24)?, corner(36)?] })
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
    encode_parts(&[volume])
}

/// The content of a file of symmetric matrices in float32, from a grid of the entries on the diagonal and one of the others, as
/// [`read_matrices`] reads it.
///
/// # Errors
/// As [`encode`], and when the grids differ in size or do not have three channels.
pub fn encode_matrices([diagonal, others]: &[VolFile; 2]) -> Result<Vec<u8>, VolError> {
    if diagonal.grid.size() != others.grid.size()
        || [diagonal, others].iter().any(|part| part.grid.channels() != 3)
    {
        return Err(VolError::NotStorable(
            "matrices need two grids of one size and three channels",
        ));
    }
    encode_parts(&[diagonal, others])
}

/// The channels of grids of one size side by side, in the box of the first.
fn encode_parts(parts: &[&VolFile]) -> Result<Vec<u8>, VolError> {
    let (size, [lo, hi]) = (parts[0].grid.size(), parts[0].bounds);
    let channels = parts.iter().map(|part| part.grid.channels()).sum();
    let voxels: usize = size.iter().product();
    let mut out = Vec::with_capacity(HEADER + 4 * voxels * channels);
    out.extend(MAGIC);
    out.extend(1_i32.to_le_bytes());
    for n in size.into_iter().chain([channels]) {
        let n = i32::try_from(n).map_err(|_| VolError::NotStorable("a size exceeds 2³¹ - 1"))?;
        out.extend(n.to_le_bytes());
    }
    let corners = lo.to_array().into_iter().chain(hi.to_array());
    let voxel = |n: usize| {
        parts.iter().flat_map(move |part| {
            let channels = part.grid.channels();
            part.grid.values()[n * channels..][..channels].iter().copied()
        })
    };
    for v in corners.chain((0..voxels).flat_map(voxel)) {
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
