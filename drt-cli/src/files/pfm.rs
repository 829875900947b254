//! PFM, portable float maps: linear colours in numbers of 32 bits.

use std::io::{self, Read};
use std::path::Path;

use super::input_file;

/// The columns and rows of an image, and its pixels, row by row from the top left.
pub(crate) type Pixels = ([u32; 2], Vec<[f32; 3]>);

/// Reads a file that begins as PFM does; others are `None`, whatever their names end in. Where it is grey, that is all three colours.
/// Values are multiplied by the scale that the header states.
///
/// # Errors
/// Says why the file cannot be read, or how its header differs from what is in it.
pub(crate) fn read(path: &Path) -> Result<Option<Pixels>, String> {
    if !begins(path).map_err(|e| e.to_string())? {
        return Ok(None);
    }
    let bytes = input_file::read(path).map_err(|e| e.to_string())?;
    decode(&bytes).map(Some)
}

fn begins(path: &Path) -> io::Result<bool> {
    let mut start = Vec::new();
    input_file::open(path)?.take(3).read_to_end(&mut start)?;
    Ok(matches!(&start[..], [b'P', b'F' | b'f', space] if space.is_ascii_whitespace()))
}

fn decode(bytes: &[u8]) -> Result<Pixels, String> {
    let mut rest = bytes;
    let mut word = || {
        let start = rest.iter().position(|b| !b.is_ascii_whitespace())?;
        let length = rest[start..].iter().position(u8::is_ascii_whitespace)?;
        let (word, after) = rest[start..].split_at(length);
        // A single blank ends a word: the byte after the last one is a number's.
        rest = &after[1..];
        str::from_utf8(word).ok()
    };
    let channels = if word() == Some("PF") { 3 } else { 1 };
    let mut side = || word()?.parse::<u32>().ok().filter(|n| *n > 0);
    let sides = side().zip(side());
    let scale = word().and_then(|w| w.parse::<f32>().ok()).filter(|s| s.is_normal());
    let header = sides.zip(scale);
    let Some(((width, height), scale)) = header else {
        return Err("expected PF or Pf, columns, rows, and a scale that is not 0".into());
    };
    let claimed = 4 * u128::from(width) * u128::from(height) * channels as u128;
    if rest.len() as u128 != claimed {
        let length = rest.len();
        return Err(format!(
            "after its header there are {length} bytes; {width}x{height} pixels of {channels} numbers take {claimed}"
        ));
    }
    // The sign of the scale is the order of bytes.
    let number = if scale < 0.0 { f32::from_le_bytes } else { f32::from_be_bytes };
    let value = |b: &[u8; 4]| number(*b) * scale.abs();
    let pixel = |p: &[[u8; 4]]| match p {
        [r, g, b] => [r, g, b].map(value),
        grey => [value(&grey[0]); 3],
    };
    let numbers = rest.as_chunks().0;
    let rows = numbers.chunks_exact(width as usize * channels).rev();
    Ok(([width, height], rows.flat_map(|row| row.chunks_exact(channels).map(pixel)).collect()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Folder;

    fn file(header: &str, numbers: impl IntoIterator<Item = [u8; 4]>) -> Vec<u8> {
        header.bytes().chain(numbers.into_iter().flatten()).collect()
    }

    #[test]
    fn rows_come_from_the_top_in_either_order_of_bytes() {
        let folder = Folder::new();
        let colours = [0.5, 1.0, 2.0, -3.0, 0.0, 1e9_f32];
        let little = file("PF\n1 2\n-1.0\n", colours.map(f32::to_le_bytes));
        let big = file("PF 1 2 1\n", colours.map(f32::to_be_bytes));
        for bytes in [little, big] {
            let read = read(&folder.file("colour.pfm", bytes)).unwrap();
            assert_eq!(read, Some(([1, 2], vec![[-3.0, 0.0, 1e9], [0.5, 1.0, 2.0]])));
        }
        let grey = file("Pf\n2 1\n-0.5\n", [2.0, 4.0_f32].map(f32::to_le_bytes));
        let read_grey = read(&folder.file("grey.any", grey)).unwrap();
        assert_eq!(read_grey, Some(([2, 1], vec![[1.0; 3], [2.0; 3]])));
    }

    #[test]
    fn what_is_not_as_its_header_says_is_refused() {
        let folder = Folder::new();
        let numbers = [[0; 4]; 6];
        for (header, part) in [
            ("PF\n1 2\n", "expected PF or Pf"),
            ("PF\n1 2\n0\n", "expected PF or Pf"),
            ("PF\n1 -2\n-1\n", "expected PF or Pf"),
            ("PF\n0 2\n-1\n", "expected PF or Pf"),
            ("PF\n1 2\nnan\n", "expected PF or Pf"),
            ("PF\n2 2\n-1\n", "there are 24 bytes"),
            ("PF\n4294967295 4294967295\n-1\n", "there are 24 bytes"),
        ] {
            let error = read(&folder.file("bad.pfm", file(header, numbers))).unwrap_err();
            assert!(error.contains(part), "{header}: {error}");
        }
        for other in ["P6\n1 1\n255\n", "PF", "", "PFx"] {
            assert_eq!(read(&folder.file("other", file(other, []))), Ok(None));
        }
    }
}
