//! Checksums over whole files that other runs go on from. Any bit that has flipped is found.
//!
//! A binary file has a place for its checksum somewhere in it: [`space`] makes the place, [`seal`] fills it in, and
//! [`is_whole`] looks at it. JSON has its checksum at the end: [`seal_json`] and [`is_whole_json`].

use crc32fast::Hasher;

/// What begins the place of a checksum: bytes that no text and hardly anything else has.
const SEAL: [u8; 16] = *b"\xd7drt\xffcrc32\x80hole\xa9";
/// The length of what [`space`] gives.
const LENGTH: usize = SEAL.len() + 4;

/// Gives the bytes that a binary file has where its checksum shall be.
pub fn space() -> [u8; LENGTH] {
    let mut space = [0; LENGTH];
    space[..SEAL.len()].copy_from_slice(&SEAL);
    space
}

/// Where a binary file has the place of its checksum; `None` where it has none.
fn find(file: &[u8]) -> Option<usize> {
    file.windows(SEAL.len()).position(|w| w == SEAL).filter(|at| at + LENGTH <= file.len())
}

fn sum(file: &[u8], at: usize) -> [u8; 4] {
    let mut hasher = Hasher::new();
    hasher.update(&file[..at]);
    hasher.update(&space());
    hasher.update(&file[at + LENGTH..]);
    hasher.finalize().to_le_bytes()
}

/// Fills in the checksum of a file that has a place for it.
pub fn seal(file: &mut [u8]) {
    if let Some(at) = find(file) {
        let sum = sum(file, at);
        file[at + SEAL.len()..at + LENGTH].copy_from_slice(&sum);
    }
}

/// Tells whether a file is what was sealed; `None` where it has no place for a checksum.
pub fn is_whole(file: &[u8]) -> Option<bool> {
    let at = find(file)?;
    Some(file[at + SEAL.len()..at + LENGTH] == sum(file, at))
}

/// Gives what follows the checksum's place in a part of a file that begins with it; `None` for other parts.
pub fn content(part: &[u8]) -> Option<&[u8]> {
    part.starts_with(&SEAL).then(|| part.get(LENGTH..)).flatten()
}

/// Computes the checksum of a text.
pub fn of_text(text: &str) -> u32 {
    crc32fast::hash(text.as_bytes())
}

/// Adds to a JSON object, which must not be empty, the checksum of all before as its last entry, and gives the text of a file.
pub fn seal_json(object: &str) -> String {
    let body = object.trim_end().strip_suffix('}').unwrap_or(object);
    format!("{body},\"crc32\":\"{:08x}\"}}\n", of_text(body))
}

/// Tells whether the text of a file is what [`seal_json`] gave.
pub fn is_whole_json(text: &str) -> bool {
    let body = text.rsplit_once(",\"crc32\":");
    body.is_some_and(|(body, _)| seal_json(&format!("{body}}}")) == text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_flipped_bit_is_found() {
        let mut file = [&b"before"[..], &space(), b"after it"].concat();
        seal(&mut file);
        assert_eq!(is_whole(&file), Some(true));
        assert_eq!(content(&file[6..]), Some(&b"after it"[..]));
        let text = seal_json("{\"a\":1,\"b\":[0.5]}");
        assert!(is_whole_json(&text), "{text}");
        for bit in 0..8 * file.len() {
            let mut copy = file.clone();
            copy[bit / 8] ^= 1 << (bit % 8);
            assert_ne!(is_whole(&copy), Some(true), "{bit}");
        }
        for bit in 0..8 * text.len() {
            let mut copy = text.clone().into_bytes();
            copy[bit / 8] ^= 1 << (bit % 8);
            assert!(!String::from_utf8(copy).is_ok_and(|t| is_whole_json(&t)), "{bit}");
        }
        assert_eq!(is_whole(b"nothing"), None);
    }
}
