//! `drt view`: a picture in the terminal, in half blocks: two pixels to a character, in colours of 24 bits. That is text, which any terminal
//! shows, a remote one too, and which can be piped.

use std::fmt::Write as _;
use std::path::Path;

use ::console::Term;
use image::imageops::{FilterType, resize};
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, RgbImage};

use super::options::{Layers, ViewOptions};
use super::preview::chosen;
use super::{Outcome, console};
use crate::error::Place;
use crate::files::image::{Canvas, NamedLayer, show_layers};
use crate::files::{input_file, memory, pfm};
use crate::{CliError, read_exr};

/// Characters in a line of what is not a terminal.
const COLUMNS: u16 = 80;

pub(super) fn run(options: &ViewOptions) -> Result<Outcome, CliError> {
    input_file::checked(&options.input)?;
    let picture = picture(&options.input, &options.layers)?;
    let room = || Term::stdout().size_checked().map_or(COLUMNS, |(_, columns)| columns);
    let width = options.width.map_or_else(|| picture.width().min(room().into()), u32::from);
    console::print(half_blocks(&picture, width.max(1)))?;
    Ok(Outcome::Done)
}

/// Lines of so many characters, each of which has a pixel above and one below.
fn half_blocks(picture: &RgbImage, width: u32) -> String {
    let (columns, rows) = picture.dimensions();
    let height = (f64::from(width) * f64::from(rows) / f64::from(columns)).round() as u32;
    let shown = resize(picture, width, height.max(1), FilterType::Triangle);
    let mut text = String::new();
    for y in (0..shown.height()).step_by(2) {
        for x in 0..width {
            // Writing to a string cannot fail.
            let [r, g, b] = shown.get_pixel(x, y).0;
            let _ = write!(text, "\x1b[38;2;{r};{g};{b}m");
            if let Some(below) = shown.get_pixel_checked(x, y + 1) {
                let [r, g, b] = below.0;
                let _ = write!(text, "\x1b[48;2;{r};{g};{b}m");
            }
            text.push('\u{2580}');
        }
        text += "\x1b[0m\n";
    }
    text
}

/// The picture to show: layers of an OpenEXR file as `drt preview` shows them, and of other files their pixels.
fn picture(path: &Path, layers: &Layers) -> Result<RgbImage, CliError> {
    let fail = |e: &dyn std::fmt::Display| CliError::input(&Place::file(path), e);
    let light = |size, named: &[NamedLayer<'_>]| {
        shown(show_layers(size, named, layers.look.tone(None))).ok_or_else(|| fail(&"it is empty"))
    };
    let plain = || match layers.names.first() {
        Some(name) => {
            Err(fail(&format!("it has no layer `{name}`; only OpenEXR files have layers")))
        }
        None => Ok(()),
    };
    if let Some((size, pixels)) = pfm::read(path).map_err(|e| fail(&e))? {
        return plain().and_then(|()| light(size, &[("", &pixels)]));
    }
    let reader = ImageReader::open(path).and_then(ImageReader::with_guessed_format);
    let reader = reader.map_err(|e| fail(&e))?;
    let Some(format) = reader.format().filter(|format| *format != ImageFormat::OpenExr) else {
        let file = read_exr(path)?;
        return light(file.size, &chosen(path, &file, &layers.names)?);
    };
    plain()?;
    let decoder = reader.into_decoder().map_err(|e| fail(&e))?;
    memory::check(u128::from(decoder.total_bytes()))
        .map_err(|e| fail(&format!("its pixels {e}")))?;
    let image = DynamicImage::from_decoder(decoder).map_err(|e| fail(&e))?;
    if format != ImageFormat::Hdr {
        let option = layers.look.given();
        let exposed =
            |option| fail(&format!("{option}: it holds no light, but colours of a screen"));
        return option.map_or(Ok(image.into_rgb8()), |option| Err(exposed(option)));
    }
    let image = image.into_rgb32f();
    let pixels: Vec<[f32; 3]> = image.pixels().map(|p| p.0).collect();
    light([image.width(), image.height()], &[("", &pixels)])
}

/// A picture that has pixels.
fn shown(canvas: Canvas) -> Option<RgbImage> {
    let Canvas { width, height, pixels } = canvas;
    let pixels = pixels.into_flattened();
    RgbImage::from_raw(width as u32, height as u32, pixels).filter(|image| !image.is_empty())
}
