//! Plain pictures: linear colours from EXR, PFM, NPY or PNG, and PNG to look at.

use std::fs::File;
use std::io::{BufReader, Read, Write};
use std::path::Path;

use drt_math::Rgb;

use super::exr_file::{CHANNELS, read_plain};
use super::tone::Pixel;
use crate::CliError;
use crate::error::Place;
use crate::files::input_file;
use crate::files::npy::{MAGIC, read_npy_image};
use crate::files::pfm;

/// A picture, row by row from the top left.
pub struct Picture {
    /// Columns and rows.
    pub size: [u32; 2],
    /// What is stored: values from 0 to 1 in PNG, and linear colours in the other formats.
    values: Vec<Rgb>,
    /// Values are encoded for screens.
    encoded: bool,
}

impl Picture {
    /// Linear colours; those of PNG are taken as sRGB.
    pub fn linear(self) -> Vec<Rgb> {
        match self.encoded {
            true => self.values.into_iter().map(|v| v.map(decode)).collect(),
            false => self.values,
        }
    }

    /// One number per pixel, as stored, whatever the encoding.
    pub fn gray(&self) -> Vec<f64> {
        self.values.iter().map(|v| v.mean()).collect()
    }
}

/// What a PNG carries that is no longer the image it was made of: light has been exposed, or derivatives have become colours.
pub(crate) const SCREEN: &str = "for the eye alone: exposed for a screen";
/// The keyword of that note.
const NOTE: &str = "Comment";

/// Reads a picture that must be of a film's size: EXR (its plain `R`, `G`, `B`, or `Y` in place of all three), PFM,
/// NPY or PNG; its first bytes tell which of them it is. What says in its header that it is of another size is not decoded.
///
/// # Errors
/// Names the file and what is wrong with it or its size.
pub fn read_picture(path: &Path, film: [u32; 2]) -> Result<Picture, CliError> {
    let mut start = Vec::new();
    let first = input_file::open(path).and_then(|f| f.take(8).read_to_end(&mut start));
    first.map_err(|e| input_file::unreadable(path, None, &e))?;
    let expected = |size| check_size(path, size, film);
    let picture = if start.starts_with(b"\x89PNG") {
        read_png(path, expected)?
    } else if start.starts_with(MAGIC) {
        let (size, values) = read_npy_image(path, film)?;
        expected(size)?;
        let values = values.into_iter().map(Rgb::from).collect();
        Picture { size, values, encoded: false }
    } else {
        let pixels = match pfm::read(path).map_err(|e| CliError::input(&Place::file(path), e))? {
            Some((size, pixels)) => expected(size).map(|()| pixels)?,
            None => read_plain(path, expected)?,
        };
        let values = pixels.into_iter().map(|p| p.map(f64::from).into()).collect();
        Picture { size: film, values, encoded: false }
    };
    check_finite(path, &picture)?;
    Ok(picture)
}

/// Refuses a picture of another size than the film's.
fn check_size(path: &Path, [w, h]: [u32; 2], film: [u32; 2]) -> Result<(), CliError> {
    if [w, h] == film {
        return Ok(());
    }
    let [fw, fh] = film;
    let message = format!(
        "it has {w}x{h} pixels, but the film of its sensor has {fw}x{fh}; expected the same \
         size (`--size` changes the film's)"
    );
    Err(CliError::input(&Place::file(path), message))
}

/// Refuses a picture with a value that is no number.
fn check_finite(path: &Path, picture: &Picture) -> Result<(), CliError> {
    let Some(i) = picture.values.iter().position(|v| !v.is_finite()) else { return Ok(()) };
    let values = picture.values[i].to_array();
    let channel = values.iter().position(|v| !v.is_finite()).unwrap_or(0);
    let (column, row) = (i % picture.size[0] as usize, i / picture.size[0] as usize);
    let message = format!(
        "channel {} of the pixel in column {column}, row {row} is {}; expected a finite number",
        CHANNELS[channel], values[channel]
    );
    Err(CliError::input(&Place::file(path), message))
}

fn read_png(
    path: &Path,
    expected: impl Fn([u32; 2]) -> Result<(), CliError>,
) -> Result<Picture, CliError> {
    let fail = |e: &dyn std::fmt::Display| CliError::input(&Place::file(path), e);
    let file = input_file::open(path).map_err(|e| input_file::unreadable(path, None, &e))?;
    let mut decoder = png::Decoder::new(BufReader::new(file));
    decoder.set_transformations(png::Transformations::EXPAND);
    let reader = decoder.read_info().map_err(|e| fail(&e))?;
    expected([reader.info().width, reader.info().height])?;
    let notes = &reader.info().uncompressed_latin1_text;
    if notes.iter().any(|note| note.keyword == NOTE && note.text == SCREEN) {
        let message = "it was made to be looked at, its light is exposed for a screen; expected the OpenEXR file of the same image";
        return Err(fail(&message));
    }
    decode_png(reader).map_err(|e| fail(&e))
}

fn decode_png(
    mut reader: png::Reader<BufReader<File>>,
) -> Result<Picture, Box<dyn std::error::Error>> {
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

/// Writes a picture as PNG, with a note where it is for the eye [alone](SCREEN).
pub(crate) fn encode_png(
    out: impl Write,
    [w, h]: [u32; 2],
    pixels: &[Pixel],
    note: Option<&str>,
) -> Result<(), png::EncodingError> {
    let mut encoder = png::Encoder::new(out, w, h);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::RelativeColorimetric);
    if let Some(note) = note {
        encoder.add_text_chunk(NOTE.into(), note.into())?;
    }
    let mut writer = encoder.write_header()?;
    writer.write_image_data(pixels.as_flattened())?;
    writer.finish()
}
