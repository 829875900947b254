//! `drt view`: a picture in the terminal.
//!
//! Terminals that show pictures (by the protocols of Kitty and iTerm) get one, all others half blocks, two pixels to a character. So does
//! what is not a terminal: half blocks are text, which can be piped.

use std::io::{ErrorKind, IsTerminal};
use std::path::Path;

use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader};
use viuer::{Config, ViuError};

use super::Outcome;
use super::options::{Layers, ViewOptions};
use super::preview::chosen;
use crate::error::Place;
use crate::files::image::{Canvas, show_layers};
use crate::files::{input_file, memory};
use crate::{CliError, read_exr};

/// Characters in a line of what is not a terminal.
const COLUMNS: u32 = 80;

pub(super) fn run(options: &ViewOptions) -> Result<Outcome, CliError> {
    input_file::checked(&options.input)?;
    let picture = picture(&options.input, &options.layers)?;
    let terminal = std::io::stdout().is_terminal();
    let room = if terminal { u32::from(viuer::terminal_size().0) } else { COLUMNS };
    let (columns, rows) = (picture.width(), picture.height());
    let width = options.width.map_or(columns.min(room), u32::from).max(1);
    // A character is about twice as high as it is wide.
    let height = (f64::from(width) * f64::from(rows) / (2.0 * f64::from(columns))).ceil() as u32;
    let config = Config {
        width: Some(width),
        height: Some(height.max(1)),
        absolute_offset: false,
        truecolor: true,
        use_kitty: terminal,
        use_iterm: terminal,
        ..Config::default()
    };
    match viuer::print(&picture, &config) {
        // Where its reader has gone there is nothing left to do.
        Err(ViuError::Io(e)) if e.kind() == ErrorKind::BrokenPipe => Ok(Outcome::Done),
        Err(e) => Err(CliError::write(Path::new("to the standard output"), e)),
        Ok(_) => Ok(Outcome::Done),
    }
}

/// The picture to show: layers of an OpenEXR file as `drt preview` shows them, and of other files their pixels.
fn picture(path: &Path, layers: &Layers) -> Result<DynamicImage, CliError> {
    let fail = |e: &dyn std::fmt::Display| CliError::input(&Place::file(path), e);
    let reader = ImageReader::open(path).and_then(ImageReader::with_guessed_format);
    let reader = reader.map_err(|e| fail(&e))?;
    let Some(format) = reader.format().filter(|format| *format != ImageFormat::OpenExr) else {
        let file = read_exr(path)?;
        let layers = (chosen(path, &file, &layers.names)?, layers.look.tone(None));
        return shown(show_layers(file.size, &layers.0, layers.1))
            .ok_or_else(|| fail(&"it is empty"));
    };
    if let Some(name) = layers.names.first() {
        return Err(fail(&format!("it has no layer `{name}`; only OpenEXR files have layers")));
    }
    let decoder = reader.into_decoder().map_err(|e| fail(&e))?;
    memory::check(u128::from(decoder.total_bytes()))
        .map_err(|e| fail(&format!("its pixels {e}")))?;
    let image = DynamicImage::from_decoder(decoder).map_err(|e| fail(&e))?;
    if format != ImageFormat::Hdr {
        let option = layers.look.given();
        let exposed =
            |option| fail(&format!("{option}: it holds no light, but colours of a screen"));
        return option.map_or(Ok(image), |option| Err(exposed(option)));
    }
    let light = image.into_rgb32f();
    let pixels: Vec<[f32; 3]> = light.pixels().map(|p| p.0).collect();
    let size = [light.width(), light.height()];
    shown(show_layers(size, &[("", &pixels)], layers.look.tone(None)))
        .ok_or_else(|| fail(&"it is empty"))
}

fn shown(canvas: Canvas) -> Option<DynamicImage> {
    let Canvas { width, height, pixels } = canvas;
    let image = image::RgbImage::from_raw(width as u32, height as u32, pixels.into_flattened())?;
    (width * height > 0).then_some(DynamicImage::ImageRgb8(image))
}
