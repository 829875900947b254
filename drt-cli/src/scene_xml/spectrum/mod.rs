//! Colours: `<rgb>`, `<srgb>`, `<spectrum>` and plain numbers.

pub(super) mod conductors;
pub(super) mod observer;

use drt_math::Rgb;

use super::element::Element;
use super::numbers::{number, numbers, plain_value};
use super::properties::{Properties, no_texture};
use crate::CliError;
use crate::files::input_file::read_text;
use observer::Spectrum;

/// Tags that can give a colour; textures only where they are the same everywhere.
const TAGS: &[&str] = &["rgb", "spectrum", "srgb", "float", "integer", "texture", "blackbody"];

/// The linear sRGB colour of light with the same power at every wavelength, which Mitsuba 3 gives
/// to emitters with a `<spectrum>` of one number: XYZ = (1, 1, 1) seen by a space whose white is D65.
const EQUAL_ENERGY: Rgb = Rgb::new(1.204_794, 0.948_291, 0.908_916);

/// What a colour is of.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Of {
    /// Something that reflects, refracts or absorbs.
    Matter,
    Light,
}

impl Properties<'_> {
    /// A colour of something that reflects, refracts or absorbs, for which no texture stands.
    pub(super) fn uniform_color(&self, name: &'static str) -> Result<Option<Rgb>, CliError> {
        if self.varying(name).is_some() {
            return Err(no_texture(self.element, name));
        }
        self.value(name, TAGS, reflected)
    }

    /// A colour of light.
    pub(super) fn light(&self, name: &'static str) -> Result<Option<Rgb>, CliError> {
        if let Some(e) = self.varying(name) {
            return Err(no_texture(e, name));
        }
        self.value(name, TAGS, emitted)
    }
}

/// The colour of something that reflects, refracts or absorbs.
pub(super) fn reflected(e: &Element) -> Result<Rgb, CliError> {
    color(e, Of::Matter)
}

/// The colour of light.
fn emitted(e: &Element) -> Result<Rgb, CliError> {
    color(e, Of::Light)
}

fn color(e: &Element, of: Of) -> Result<Rgb, CliError> {
    if e.tag == "blackbody" {
        return black_body(e, of);
    }
    let spectral = e.tag == "spectrum";
    if e.tag == "texture" || (spectral && e.attribute("type").is_some()) {
        return plugin(e, of);
    }
    if spectral && e.attribute("filename").is_some() {
        e.only_attributes(&["name", "filename"])?;
        return Ok(seen(&file(e)?, of));
    }
    let text = plain_value(e)?;
    let triples = if e.is_legacy() { &["rgb", "spectrum", "srgb"][..] } else { &["rgb", "srgb"] };
    let three = triples.contains(&e.tag.as_str());
    if three && text.trim_start().starts_with('#') {
        return Ok(linear(e, hexadecimal(e, text.trim())?));
    }
    if spectral && text.contains(':') {
        return Ok(seen(&pairs(e, text)?, of));
    }
    match *numbers(e, text)? {
        [v] if spectral && of == Of::Light && !e.is_legacy() => Ok(EQUAL_ENERGY * v),
        [v] => Ok(linear(e, Rgb::splat(v))),
        [r, g, b] if three => Ok(linear(e, Rgb::new(r, g, b))),
        [_, _, _] => Err(e.error("three numbers need an <rgb>")),
        _ => Err(e.error("expected one number or three")),
    }
}

/// The element of version 0.5 and 0.6 for the light of a black body: `temperature`, which may end in K, times `scale`.
fn black_body(e: &Element, of: Of) -> Result<Rgb, CliError> {
    if !e.is_legacy() {
        let message = "is of versions 0.5 and 0.6; here it is a <spectrum type=\"blackbody\">";
        return Err(e.error(message));
    }
    e.only_attributes(&["name", "id", "temperature", "scale"])?;
    let text = e.required("temperature")?.trim().trim_end_matches(['K', 'k']);
    let kelvin = number(e, "temperature", text)?;
    let scale = e.attribute("scale").map_or(Ok(1.0), |text| number(e, "scale", text))?;
    glowing(e, kelvin, of).map(|color| color * scale)
}

fn glowing(e: &Element, kelvin: f64, of: Of) -> Result<Rgb, CliError> {
    if kelvin <= 0.0 {
        return Err(e.error(format!("`temperature` is {kelvin}; it must be positive")));
    }
    Ok(seen(&Spectrum::black_body(kelvin), of))
}

fn seen(spectrum: &Spectrum, of: Of) -> Rgb {
    match of {
        Of::Matter => spectrum.reflected(),
        Of::Light => spectrum.emitted(),
    }
}

/// A spectrum, or a texture that is the same everywhere, as a plugin.
fn plugin(e: &Element, of: Of) -> Result<Rgb, CliError> {
    let p = Properties::of(e)?;
    let one = |name| Ok::<f64, CliError>(p.number(name)?.unwrap_or(1.0));
    let needed = |name: &str| e.error(format!("`{name}` is missing"));
    let color = match p.kind()? {
        "uniform" => Rgb::splat(one("value")?),
        // The white of linear sRGB.
        "d65" => p.uniform_color("color")?.unwrap_or(Rgb::ONE) * one("scale")?,
        "srgb" => p.uniform_color("color")?.ok_or_else(|| needed("color"))?,
        "rawconstant" => match p.vector("value") {
            Ok(Some(v)) => Rgb::new(v.x, v.y, v.z),
            _ => Rgb::splat(p.number("value")?.ok_or_else(|| needed("value"))?),
        },
        "scale" if e.is_legacy() => {
            let inner = scaled(&p)?;
            color(inner, of)? * factor(&p)?
        }
        "blackbody" => {
            let kelvin = p.number("temperature")?.ok_or_else(|| needed("temperature"))?;
            glowing(e, kelvin, of)?
        }
        "regular" => {
            let (from, to) = (p.number("wavelength_min")?, p.number("wavelength_max")?);
            let values = list(&p, "values")?.ok_or_else(|| needed("values"))?;
            let (Some(from), Some(to)) = (from, to) else {
                return Err(needed("wavelength_min` or `wavelength_max"));
            };
            let step = (to - from) / (values.len().max(2) - 1) as f64;
            let at = |i: usize| from + step * i as f64;
            let samples = values.iter().enumerate().map(|(i, v)| [at(i), *v]).collect();
            seen(&checked(e, samples)?, of)
        }
        "irregular" => {
            let wavelengths = list(&p, "wavelengths")?.ok_or_else(|| needed("wavelengths"))?;
            let values = list(&p, "values")?.ok_or_else(|| needed("values"))?;
            if wavelengths.len() != values.len() {
                return Err(e.error("there must be as many `wavelengths` as `values`"));
            }
            let samples = wavelengths.into_iter().zip(values).map(|(w, v)| [w, v]).collect();
            seen(&checked(e, samples)?, of)
        }
        other => {
            let message = format!(
                "the {} type `{other}` is not supported; expected uniform, d65, srgb, rawconstant, \
                 blackbody, regular, irregular, bitmap, checkerboard, mesh_attribute or volume",
                e.tag
            );
            return Err(e.error(message));
        }
    };
    p.finish()?;
    Ok(color)
}

/// The texture that a `scale` of version 0.5 and 0.6 is of.
pub(super) fn scaled<'a>(p: &Properties<'a>) -> Result<&'a Element, CliError> {
    let scale = |e: &Element| p.is_property(e, "scale");
    match p.children(|e| matches!(e.tag.as_str(), "texture" | "spectrum") && !scale(e))[..] {
        [inner] => Ok(inner),
        ref other => {
            let message = format!("expected one texture inside, found {}", other.len());
            Err(p.element.error(message))
        }
    }
}

/// What such a `scale` multiplies by.
pub(super) fn factor(p: &Properties<'_>) -> Result<Rgb, CliError> {
    Ok(p.uniform_color("scale")?.unwrap_or(Rgb::ONE))
}

/// The numbers of a `<string>`.
fn list(p: &Properties<'_>, name: &'static str) -> Result<Option<Vec<f64>>, CliError> {
    p.string(name)?.map(|text| numbers(p.element, text)).transpose()
}

/// Pairs such as `400:0.1, 500:0.3`.
fn pairs(e: &Element, text: &str) -> Result<Spectrum, CliError> {
    let words = text.split(|c: char| c.is_whitespace() || c == ',').filter(|w| !w.is_empty());
    let pair = |word: &str| match word.split_once(':') {
        Some((w, v)) => Ok([number(e, "value", w)?, number(e, "value", v)?]),
        None => Err(e.error(format!("`{word}` is no pair of wavelength and value, as in 500:0.3"))),
    };
    checked(e, words.map(pair).collect::<Result<_, _>>()?)
}

/// A text file with a wavelength and a value per line; `#` starts a comment.
fn file(e: &Element) -> Result<Spectrum, CliError> {
    let missing = || e.error("the attribute `filename` is missing");
    let path = e.resolve(e.file_name().ok_or_else(missing)?)?;
    let text = read_text(&path, Some(&e.place))?;
    let mut samples = Vec::new();
    for (i, line) in text.lines().enumerate() {
        let line = line.split('#').next().unwrap_or("").trim();
        if line.is_empty() {
            continue;
        }
        let mut words = line.split_whitespace().map(str::parse::<f64>);
        match (words.next(), words.next(), words.next()) {
            (Some(Ok(w)), Some(Ok(v)), None) => samples.push([w, v]),
            _ => {
                let message =
                    format!("{}:{}: expected a wavelength and a value", path.display(), i + 1);
                return Err(e.error(message));
            }
        }
    }
    checked(e, samples)
}

fn checked(e: &Element, samples: Vec<[f64; 2]>) -> Result<Spectrum, CliError> {
    Spectrum::new(samples)
        .ok_or_else(|| e.error("a spectrum needs finite values at increasing wavelengths"))
}

/// Linear values of a colour: only `<srgb>` holds others.
fn linear(e: &Element, c: Rgb) -> Rgb {
    if e.tag == "srgb" { c.map(srgb_to_linear) } else { c }
}

/// The inverse of the sRGB transfer curve (IEC 61966-2-1).
pub(super) fn srgb_to_linear(v: f64) -> f64 {
    if v <= 0.040_45 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
}

fn hexadecimal(e: &Element, text: &str) -> Result<Rgb, CliError> {
    let bad = || e.error(format!("`{text}` is not a colour; expected #rrggbb"));
    let digits = text.strip_prefix('#').filter(|d| d.len() == 6).ok_or_else(bad)?;
    let n = u32::from_str_radix(digits, 16).map_err(|_| bad())?;
    let channel = |shift: u32| f64::from((n >> shift) & 0xff) / 255.0;
    Ok(Rgb::new(channel(16), channel(8), channel(0)))
}
