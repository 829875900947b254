//! NumPy's file format, version 1.0: a plain array with a line of text before it.

use std::io::Write;
use std::path::Path;

use crate::CliError;
use crate::error::Place;
use crate::files::atomic::write_atomically;
use crate::files::{checksum, input_file};

/// Header and magic number together are padded to a multiple of this.
const ALIGNMENT: usize = 64;
pub(crate) const MAGIC: &[u8] = b"\x93NUMPY";
/// 64-bit floats and bytes, as headers call them.
const FLOATS: &str = "<f8";
const BYTES: &str = "|u1";
/// Bytes that the header of an image may have.
const MOST_HEADER: u64 = 1 << 16;

/// Writes numbers as an array of one dimension and 64-bit floats.
///
/// ```
/// # let folder = tempfile::tempdir()?;
/// let path = folder.path().join("gradient.npy");
/// drt_cli::write_npy(&path, &[0.5, -1.0])?;
/// let file = std::fs::read(&path)?;
/// assert!(file.starts_with(b"\x93NUMPY") && file.ends_with(&(-1.0_f64).to_le_bytes()));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// When the file cannot be written.
pub fn write_npy(path: &Path, values: &[f64]) -> Result<(), CliError> {
    write_atomically(path, |out| {
        out.write_all(&header(FLOATS, values.len()))?;
        for value in values {
            out.write_all(&value.to_le_bytes())?;
        }
        Ok(())
    })
}

/// Writes bytes as an array of one dimension, with the [`checksum`] that they may have a place for.
///
/// # Errors
/// When the file cannot be written.
pub fn write_npy_bytes(path: &Path, bytes: &[u8]) -> Result<(), CliError> {
    let mut file = header(BYTES, bytes.len());
    file.extend(bytes);
    checksum::seal(&mut file);
    write_atomically(path, |out| Ok(out.write_all(&file)?))
}

/// True for the bytes of a file that begins as NPY does.
pub fn is_npy(file: &[u8]) -> bool {
    file.starts_with(MAGIC)
}

/// Takes the array out of the bytes of a file that [`write_npy_bytes`] wrote; `None` for others.
pub fn npy_bytes(mut bytes: Vec<u8>) -> Option<Vec<u8>> {
    // The header says how many there are; what it is must be the same to the byte.
    let of = |b: &[u8]| Some(10 + usize::from(*b.get(8)?) + (usize::from(*b.get(9)?) << 8));
    let start = of(&bytes).filter(|start| *start <= bytes.len())?;
    let content = bytes.split_off(start);
    (bytes == header(BYTES, content.len())).then_some(content)
}

/// Reads an image, an array of rows × columns × 3 floats of 32 or 64 bits: its columns and rows, and its pixels row by row. A
/// file that is too large for one of the size that is expected is not read.
///
/// # Errors
/// When the file cannot be read, is cut off or holds something else.
pub fn read_npy_image(
    path: &Path,
    expected: [u32; 2],
) -> Result<([u32; 2], Vec<[f64; 3]>), CliError> {
    let [w, h] = expected.map(u64::from);
    let most = MOST_HEADER + 24 * w * h;
    if path.metadata().is_ok_and(|m| m.len() > most) {
        let message = format!("it is too large for an image of {w}x{h} pixels");
        return Err(CliError::input(&Place::file(path), message));
    }
    let fail = |message: &str| CliError::input(&Place::file(path), message);
    let expected = || fail("expected an array of rows x columns x 3 floats, in C order");
    let bytes = input_file::read_at(path, None)?;
    let number = |at: usize| bytes.get(at).map(|b| usize::from(*b)).ok_or_else(expected);
    let (length, start) = match number(6)? {
        1 => (number(8)? + (number(9)? << 8), 10_usize),
        _ => (number(8)? + (number(9)? << 8) + (number(10)? << 16) + (number(11)? << 24), 12),
    };
    let text = start.checked_add(length).and_then(|end| bytes.get(start..end));
    let text = text.ok_or_else(expected)?;
    let text = String::from_utf8_lossy(text).replace([' ', '\n'], "");
    let value = |key: &str| text.split_once(&format!("'{key}':")).map(|(_, rest)| rest);
    if value("fortran_order").is_none_or(|v| !v.starts_with("False")) {
        return Err(expected());
    }
    let shape = value("shape").and_then(|v| v.strip_prefix('(')?.split_once(')'));
    let sides: Option<Vec<u32>> =
        shape.and_then(|(s, _)| s.split_terminator(',').map(|n| n.parse().ok()).collect());
    let Some([height, width, 3]) = sides.as_deref() else { return Err(expected()) };
    let data = &bytes[start + length..];
    let values: Vec<f64> = match value("descr").ok_or_else(expected)? {
        v if v.starts_with("'<f8'") => {
            data.as_chunks().0.iter().map(|b| f64::from_le_bytes(*b)).collect()
        }
        v if v.starts_with("'<f4'") => {
            data.as_chunks().0.iter().map(|b| f64::from(f32::from_le_bytes(*b))).collect()
        }
        _ => return Err(expected()),
    };
    if values.len() as u64 != 3 * u64::from(*width) * u64::from(*height) || values.is_empty() {
        return Err(fail("it is cut off"));
    }
    Ok(([*width, *height], values.as_chunks().0.to_vec()))
}

fn header(kind: &str, length: usize) -> Vec<u8> {
    let mut text = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({length},), }}");
    // Before the text: six bytes of magic, two of version and two of length; after it a line's end.
    let total = (10 + text.len() + 1).next_multiple_of(ALIGNMENT);
    text.extend(std::iter::repeat_n(' ', total - 10 - text.len() - 1));
    text.push('\n');
    let mut bytes = MAGIC.to_vec();
    bytes.extend([1, 0]);
    bytes.extend((text.len() as u16).to_le_bytes());
    bytes.extend(text.into_bytes());
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn images_are_read() {
        let folder = crate::testing::Folder::new();
        let file = |kind: &str, shape: &str, data: &[u8]| {
            let mut bytes = header(kind, 0);
            let (text, with) = ("'shape': (0,)", format!("'shape': {shape}"));
            let mut line = String::from_utf8_lossy(&bytes.split_off(10)).replace(text, &with);
            line = format!("{}\n", line.trim_end());
            bytes[8..10].copy_from_slice(&(line.len() as u16).to_le_bytes());
            bytes.extend(line.into_bytes());
            bytes.extend(data);
            folder.file("image.npy", bytes)
        };
        let numbers: Vec<f64> = (0..6).map(f64::from).collect();
        let wide: Vec<u8> = numbers.iter().flat_map(|v| v.to_le_bytes()).collect();
        let narrow: Vec<u8> = numbers.iter().flat_map(|v| (*v as f32).to_le_bytes()).collect();
        for (kind, data) in [("<f8", &wide), ("<f4", &narrow)] {
            let read = read_npy_image(&file(kind, "(1, 2, 3)", data), [2, 1]).unwrap();
            assert_eq!(read, ([2, 1], vec![[0.0, 1.0, 2.0], [3.0, 4.0, 5.0]]));
        }
        for (kind, shape, data, part) in [
            ("<f8", "(1, 2, 3)", &wide[1..], "cut off"),
            ("<f8", "(2, 3)", &wide[..], "rows x columns x 3"),
            ("<i8", "(1, 2, 3)", &wide[..], "rows x columns x 3"),
        ] {
            let error = read_npy_image(&file(kind, shape, data), [2, 1]).unwrap_err().to_string();
            assert!(error.contains(part) && error.contains("image.npy"), "{error}");
        }
        for cut in [0, 7, 11, 40] {
            let bytes = std::fs::read(file("<f8", "(1, 2, 3)", &wide)).unwrap();
            assert!(read_npy_image(&folder.file("cut.npy", &bytes[..cut]), [2, 1]).is_err());
        }
    }

    #[test]
    fn headers_are_aligned() {
        for length in [0, 3, 1_000_000] {
            let bytes = header(FLOATS, length);
            assert_eq!(bytes.len() % ALIGNMENT, 0);
            assert_eq!(usize::from(bytes[8]) | usize::from(bytes[9]) << 8, bytes.len() - 10);
            assert!(bytes.ends_with(b"\n"));
        }
    }
}
