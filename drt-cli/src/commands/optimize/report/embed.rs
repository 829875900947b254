//! Pictures inside of a page.

use std::path::Path;

use crate::commands::markup::escaped;

/// A PNG file as an element of a page, under its caption; nothing where it cannot be read.
pub(super) fn figure(path: &Path, caption: &str) -> String {
    let Ok(bytes) = std::fs::read(path) else { return String::new() };
    format!(
        "<figure><img alt=\"{caption}\" src=\"data:image/png;base64,{}\"/>\
         <figcaption>{caption}</figcaption></figure>\n",
        base64(&bytes),
        caption = escaped(caption)
    )
}

/// RFC 4648.
fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for group in bytes.chunks(3) {
        let bits = [0, 1, 2]
            .map(|i| u32::from(group.get(i).copied().unwrap_or(0)))
            .into_iter()
            .fold(0, |bits, byte| bits << 8 | byte);
        for (i, shift) in [18, 12, 6, 0].into_iter().enumerate() {
            let digit = char::from(DIGITS[(bits >> shift & 63) as usize]);
            text.push(if i <= group.len() { digit } else { '=' });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_is_that_of_the_rfc() {
        for (plain, coded) in
            [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foobar", "Zm9vYmFy")]
        {
            assert_eq!(base64(plain.as_bytes()), coded);
        }
    }
}
