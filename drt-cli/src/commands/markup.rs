//! Text inside of SVG and HTML.

/// Text that stands for itself.
pub(super) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// A power of ten as people write it.
pub(super) fn decade(d: i32) -> String {
    match d {
        -3..=4 => format!("{}", 10.0_f64.powi(d)),
        _ => format!("1e{d}"),
    }
}
