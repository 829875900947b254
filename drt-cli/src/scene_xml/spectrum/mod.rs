//! Colours: `<rgb>`, `<spectrum>`, `<srgb>` and plain numbers.

use drt_math::Rgb;

use super::element::Element;
use super::numbers::{numbers, plain_value};
use crate::CliError;

/// Tags that can give a colour.
pub(super) const TAGS: &[&str] = &["rgb", "spectrum", "srgb", "float", "integer"];

/// The linear sRGB colour of light with the same power at every wavelength, which Mitsuba 3 gives
/// to emitters with a `<spectrum>` of one number: XYZ = (1, 1, 1) seen by a space whose white is D65.
const EQUAL_ENERGY: Rgb = Rgb::new(1.204_794, 0.948_291, 0.908_916);

/// The colour of something that reflects, refracts or absorbs.
pub(super) fn reflected(e: &Element) -> Result<Rgb, CliError> {
    color(e, Rgb::ONE)
}

/// The colour of light.
pub(super) fn emitted(e: &Element) -> Result<Rgb, CliError> {
    color(e, if e.is_legacy() { Rgb::ONE } else { EQUAL_ENERGY })
}

fn color(e: &Element, uniform: Rgb) -> Result<Rgb, CliError> {
    let text = plain_value(e)?;
    let triples = if e.is_legacy() { &["rgb", "spectrum", "srgb"][..] } else { &["rgb"] };
    if e.is_legacy() && text.trim_start().starts_with('#') && triples.contains(&e.tag.as_str()) {
        return Ok(gamma(e, hexadecimal(e, text.trim())?));
    }
    if text.contains(':') {
        return Err(e.error("sampled spectra are not supported; give an <rgb> or one number"));
    }
    if e.tag == "srgb" && !e.is_legacy() {
        return Err(e.error("a tag of Mitsuba 0.6; give an <rgb>, in linear values"));
    }
    match *numbers(e, text)? {
        [v] if e.tag == "spectrum" => Ok(uniform * v),
        [v] => Ok(gamma(e, Rgb::splat(v))),
        [r, g, b] if triples.contains(&e.tag.as_str()) => Ok(gamma(e, Rgb::new(r, g, b))),
        [_, _, _] => Err(e.error("three numbers need an <rgb>")),
        _ => Err(e.error("expected one number or three")),
    }
}

/// Linear values of a colour: only `<srgb>` holds others.
fn gamma(e: &Element, c: Rgb) -> Rgb {
    if e.tag == "srgb" { c.map(srgb_to_linear) } else { c }
}

/// The inverse of the sRGB transfer curve (IEC 61966-2-1).
fn srgb_to_linear(v: f64) -> f64 {
    if v <= 0.040_45 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
}

fn hexadecimal(e: &Element, text: &str) -> Result<Rgb, CliError> {
    let bad = || e.error(format!("`{text}` is not a colour; expected #rrggbb"));
    let digits = text.strip_prefix('#').filter(|d| d.len() == 6).ok_or_else(bad)?;
    let n = u32::from_str_radix(digits, 16).map_err(|_| bad())?;
    let channel = |shift: u32| f64::from((n >> shift) & 0xff) / 255.0;
    Ok(Rgb::new(channel(16), channel(8), channel(0)))
}
