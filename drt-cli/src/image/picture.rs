//! Plain pictures: linear colours from EXR, NPY or PNG, and PNG to look at.

use std::fs::File;
use std::io::{BufReader, Write};
use std::path::Path;

use drt_math::Rgb;

use super::read_exr;
use super::tone::Pixel;
use crate::CliError;
use crate::error::Place;
use crate::npy::{MAGIC, read_npy_image};

/// A picture, row by row from the top left.
pub(crate) struct Picture {
    /// Columns and rows.
    pub(crate) size: [u32; 2],
    /// What is stored: linear colours in EXR, in PNG values from 0 to 1.
    values: Vec<Rgb>,
    /// Values are encoded for screens.
    encoded: bool,
}

impl Picture {
    /// Linear colours; those of PNG are taken as sRGB.
    pub(crate) fn linear(self) -> Vec<Rgb> {
        match self.encoded {
            true => self.values.into_iter().map(|v| v.map(decode)).collect(),
            false => self.values,
        }
    }

    /// Refuses a picture of another size than the film's.
    pub(crate) fn check_size(&self, path: &Path, film: [u32; 2]) -> Result<(), CliError> {
        let ([w, h], [fw, fh]) = (self.size, film);
        if self.size == film {
            return Ok(());
        }
        let message = format!(
            "it has {w}x{h} pixels, but the film of its sensor has {fw}x{fh}; expected the same \
             size (`--size` changes the film's)"
        );
        Err(CliError::input(&Place::file(path), message))
    }

    /// One number per pixel, as stored, whatever the encoding.
    pub(crate) fn gray(&self) -> Vec<f64> {
        self.values.iter().map(|v| v.mean()).collect()
    }
}

/// Reads EXR (its plain `R`, `G`, `B`), NPY or PNG; its first bytes tell which of them it is.
pub(crate) fn read_picture(path: &Path) -> Result<Picture, CliError> {
    let place = Place::file(path);
    let fail = |reason: &dyn std::fmt::Display| CliError::input(&place, reason);
    let bytes = std::fs::read(path).map_err(|e| fail(&format!("cannot read this file: {e}")))?;
    if bytes.starts_with(b"\x89PNG") {
        return read_png(path).map_err(|e| fail(&e));
    }
    if bytes.starts_with(MAGIC) {
        let (size, values) = read_npy_image(path)?;
        let values = values.into_iter().map(Rgb::from).collect();
        return Ok(Picture { size, values, encoded: false });
    }
    let mut file = read_exr(path)?;
    let pixels = file.layers.remove("").ok_or_else(|| fail(&"it has no channels R, G and B"))?;
    let values = pixels.into_iter().map(|p| p.map(f64::from).into()).collect();
    Ok(Picture { size: file.size, values, encoded: false })
}

fn read_png(path: &Path) -> Result<Picture, Box<dyn std::error::Error>> {
    let mut decoder = png::Decoder::new(BufReader::new(File::open(path)?));
    decoder.set_transformations(png::Transformations::EXPAND);
    let mut reader = decoder.read_info()?;
    let mut bytes = vec![0; reader.output_buffer_size().ok_or("it is too large")?];
    let info = reader.next_frame(&mut bytes)?;
    let bytes = &bytes[..info.buffer_size()];
    let samples: Vec<f64> = match info.bit_depth {
        png::BitDepth::Sixteen => bytes
            .chunks_exact(2)
            .map(|b| f64::from(u16::from_be_bytes([b[0], b[1]])) / 65535.0)
            .collect(),
        _ => bytes.iter().map(|b| f64::from(*b) / 255.0).collect(),
    };
    let channels = info.color_type.samples();
    let color = |p: &[f64]| match p {
        [r, g, b, ..] => Rgb::new(*r, *g, *b),
        [gray, ..] => Rgb::splat(*gray),
        [] => Rgb::ZERO,
    };
    Ok(Picture {
        size: [info.width, info.height],
        values: samples.chunks_exact(channels).map(color).collect(),
        encoded: true,
    })
}

/// The inverse of the sRGB transfer curve (IEC 61966-2-1).
fn decode(s: f64) -> f64 {
    if s <= 0.040_45 { s / 12.92 } else { ((s + 0.055) / 1.055).powf(2.4) }
}

/// Writes a picture as PNG.
pub(crate) fn encode_png(
    out: impl Write,
    [w, h]: [u32; 2],
    pixels: &[Pixel],
) -> Result<(), png::EncodingError> {
    let mut encoder = png::Encoder::new(out, w, h);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::RelativeColorimetric);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(pixels.as_flattened())?;
    writer.finish()
}
