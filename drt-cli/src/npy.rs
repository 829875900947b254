//! NumPy's file format, version 1.0: a plain array with a line of text before it.

use std::fs::File;
use std::io::{Read, Write};
use std::path::Path;

use crate::CliError;
use crate::atomic::write_atomically;
use crate::error::Place;

/// Header and magic number together are padded to a multiple of this.
const ALIGNMENT: usize = 64;
const MAGIC: &[u8] = b"\x93NUMPY";
/// 64-bit floats and bytes, as headers call them.
const FLOATS: &str = "<f8";
const BYTES: &str = "|u1";

/// Writes numbers as an array of one dimension and 64-bit floats.
pub(crate) fn write_npy(path: &Path, values: &[f64]) -> Result<(), CliError> {
    write_atomically(path, |out| {
        out.write_all(&header(FLOATS, values.len()))?;
        for value in values {
            out.write_all(&value.to_le_bytes())?;
        }
        Ok(())
    })
}

/// Writes bytes as an array of one dimension.
pub(crate) fn write_npy_bytes(path: &Path, bytes: &[u8]) -> Result<(), CliError> {
    write_atomically(path, |out| {
        out.write_all(&header(BYTES, bytes.len()))?;
        Ok(out.write_all(bytes)?)
    })
}

/// True for a file that begins as NPY does.
pub(crate) fn is_npy(path: &Path) -> Result<bool, CliError> {
    let fail = |e| CliError::input(&Place::file(path), format!("cannot read this file: {e}"));
    let mut start = Vec::new();
    File::open(path).and_then(|f| f.take(6).read_to_end(&mut start)).map_err(fail)?;
    Ok(start == MAGIC)
}

/// Reads what [`write_npy_bytes`] wrote; `None` for other arrays.
pub(crate) fn read_npy_bytes(path: &Path) -> Result<Option<Vec<u8>>, CliError> {
    let mut bytes = std::fs::read(path).map_err(|e| CliError::input(&Place::file(path), e))?;
    // The header says how many there are; what it is must be the same to the byte.
    let of = |b: &[u8]| Some(10 + usize::from(*b.get(8)?) + (usize::from(*b.get(9)?) << 8));
    let Some(start) = of(&bytes).filter(|start| *start <= bytes.len()) else { return Ok(None) };
    let content = bytes.split_off(start);
    Ok((bytes == header(BYTES, content.len())).then_some(content))
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
    fn headers_are_aligned() {
        for length in [0, 3, 1_000_000] {
            let bytes = header(FLOATS, length);
            assert_eq!(bytes.len() % ALIGNMENT, 0);
            assert_eq!(usize::from(bytes[8]) | usize::from(bytes[9]) << 8, bytes.len() - 10);
            assert!(bytes.ends_with(b"\n"));
        }
    }
}
