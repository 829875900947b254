//! NumPy's file format, version 1.0: a plain array with a line of text before it.

use std::io::Write;
use std::path::Path;

use crate::CliError;
use crate::atomic::write_atomically;

/// Header and magic number together are padded to a multiple of this.
const ALIGNMENT: usize = 64;

/// Writes numbers as an array of one dimension and 64-bit floats.
pub(crate) fn write_npy(path: &Path, values: &[f64]) -> Result<(), CliError> {
    write_atomically(path, |out| {
        out.write_all(&header(values.len()))?;
        for value in values {
            out.write_all(&value.to_le_bytes())?;
        }
        Ok(())
    })
}

fn header(length: usize) -> Vec<u8> {
    let mut text = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': ({length},), }}");
    // Before the text: six bytes of magic, two of version and two of length; after it a line's end.
    let total = (10 + text.len() + 1).next_multiple_of(ALIGNMENT);
    text.extend(std::iter::repeat_n(' ', total - 10 - text.len() - 1));
    text.push('\n');
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
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
            let bytes = header(length);
            assert_eq!(bytes.len() % ALIGNMENT, 0);
            assert_eq!(usize::from(bytes[8]) | usize::from(bytes[9]) << 8, bytes.len() - 10);
            assert!(bytes.ends_with(b"\n"));
        }
    }
}
