//! A PNG to look at: the image, and beside it each derivative under its name.

use std::path::Path;

use drt_estimators::{Layer, Rendering};
use drt_math::Rgb;

use super::exr_file::NamedLayer;
use super::font;
use super::picture::{SCREEN, encode_png};
use super::tone::{self, Pixel, Tone};
use crate::CliError;
use crate::files::atomic::write_atomically;

const BACKGROUND: Pixel = [38, 38, 40];
const INK: Pixel = [225, 225, 225];
/// Blank pixels around panels.
const MARGIN: usize = 6;
/// Panels narrower than this are enlarged by a whole factor.
const LEAST_PANEL: usize = 160;

/// A picture as a screen shows it.
pub(crate) struct Canvas {
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// Row by row from the top left.
    pub(crate) pixels: Vec<Pixel>,
}

impl Canvas {
    fn new(width: usize, height: usize) -> Self {
        Self { width, height, pixels: vec![BACKGROUND; width * height] }
    }

    fn set(&mut self, x: usize, y: usize, color: Pixel) {
        if x < self.width && y < self.height {
            self.pixels[y * self.width + x] = color;
        }
    }

    /// The colours of values from minus to plus a range, between these numbers.
    fn bar(&mut self, range: f64, [left, top]: [usize; 2], width: usize) {
        let number = match range {
            0.01..1000.0 => format!("{range:.2}"),
            _ => format!("{range:.1e}"),
        };
        let text = |sign: &str| format!("{sign}{number}");
        let wide = text("-").len() * font::ADVANCE;
        let [start, end] = [wide, width.saturating_sub(wide)];
        for x in start..end {
            let part = (x - start) as f64 / (end - start).max(2).wrapping_sub(1) as f64;
            for y in 0..font::HEIGHT {
                self.set(left + x, top + y, tone::signed(2.0 * part - 1.0));
            }
        }
        for (sign, at) in [("-", 0), ("+", end)] {
            font::draw(&text(sign), |x, y| self.set(left + at + x, top + y, INK));
        }
    }
}

/// What is seen of one layer.
struct Panel {
    name: String,
    pixels: Vec<Pixel>,
    /// What full colour stands for, where colours have signs.
    range: Option<f64>,
}

impl Panel {
    fn light(name: impl Into<String>, image: &[Rgb], tone: Tone) -> Self {
        Self { name: name.into(), pixels: tone.shown(image), range: None }
    }

    fn signed(name: impl Into<String>, image: &[Rgb]) -> Self {
        let range = Some(tone::range_of(image));
        Self { name: name.into(), pixels: tone::diverging(image), range }
    }

    /// A layer of a file, by its name.
    fn of((name, pixels): &NamedLayer<'_>, tone: Tone) -> Self {
        let image: Vec<Rgb> = pixels.iter().map(|p| p.map(f64::from).into()).collect();
        let derivative = name.starts_with("d_") || name.starts_with("fd_");
        let signed = derivative && !is_error(name) || image.iter().any(|p| p.mean() < 0.0);
        let shown = if name.is_empty() { "image" } else { name };
        if signed { Self::signed(shown, &image) } else { Self::light(shown, &image, tone) }
    }
}

/// Writes a picture to look at. Without derivatives it is the image alone, pixel for pixel; with some, each is beside it, with the values
/// that its colours stand for, and whatever else is in `further`.
///
/// # Errors
/// When the file cannot be written.
pub fn write_preview(
    path: &Path,
    rendering: &Rendering,
    further: &[(String, &Layer)],
    tone: Tone,
) -> Result<(), CliError> {
    let mut panels = vec![Panel::light("image", &means(&rendering.image), tone)];
    let derivatives = rendering.derivatives.iter();
    panels.extend(derivatives.map(|d| Panel::signed(format!("d_{}", d.name), &means(&d.total))));
    panels.extend(further.iter().map(|(name, layer)| Panel::signed(name.clone(), &means(layer))));
    write_panels(path, rendering.image.size, panels, tone)
}

/// Writes a preview of layers of a file, by their names: what may be negative from blue through white (zero) to red, each in its own
/// range, all else as light. One layer is written pixel for pixel.
///
/// # Errors
/// When the file cannot be written.
pub fn write_layers(
    path: &Path,
    size: [u32; 2],
    layers: &[NamedLayer<'_>],
    tone: Tone,
) -> Result<(), CliError> {
    write_panels(path, size, layers.iter().map(|layer| Panel::of(layer, tone)).collect(), tone)
}

/// The picture that [`write_layers`] writes.
#[cfg(feature = "command")]
pub(crate) fn show_layers(size: [u32; 2], layers: &[NamedLayer<'_>], tone: Tone) -> Canvas {
    arranged(size, layers.iter().map(|layer| Panel::of(layer, tone)).collect())
}

/// True for the name of a layer of standard errors.
pub fn is_error(name: &str) -> bool {
    name == "stderr" || name.ends_with("_stderr")
}

fn write_panels(
    path: &Path,
    size: [u32; 2],
    panels: Vec<Panel>,
    tone: Tone,
) -> Result<(), CliError> {
    let plain = matches!(&panels[..], [Panel { range: None, .. }]) && tone == Tone::PLAIN;
    let note = (!plain).then_some(SCREEN);
    let canvas = arranged(size, panels);
    write_atomically(path, |out| {
        Ok(encode_png(out, [canvas.width as u32, canvas.height as u32], &canvas.pixels, note)?)
    })
}

/// One panel pixel for pixel, or a sheet of several.
fn arranged(size: [u32; 2], mut panels: Vec<Panel>) -> Canvas {
    let [width, height] = size.map(|n| n as usize);
    match &mut panels[..] {
        [Panel { pixels, .. }] => Canvas { width, height, pixels: core::mem::take(pixels) },
        panels => sheet(panels, [width, height]),
    }
}

fn means(layer: &Layer) -> Vec<Rgb> {
    layer.pixels.iter().map(|p| p.mean).collect()
}

/// Panels of one size in a grid, each above its name, and above a bar of its colours between the values that they stand for.
fn sheet(panels: &[Panel], [w, h]: [usize; 2]) -> Canvas {
    let zoom = LEAST_PANEL.div_ceil(w).clamp(1, 16);
    let columns = (panels.len() as f64).sqrt().ceil() as usize;
    let bars = panels.iter().any(|panel| panel.range.is_some());
    let line = font::HEIGHT + MARGIN;
    let cell = [w * zoom + MARGIN, h * zoom + line * if bars { 2 } else { 1 } + MARGIN];
    let rows = panels.len().div_ceil(columns);
    let mut canvas = Canvas::new(columns * cell[0] + MARGIN, rows * cell[1] + MARGIN);
    for (i, Panel { name, pixels, range }) in panels.iter().enumerate() {
        let [left, top] = [i % columns * cell[0] + MARGIN, i / columns * cell[1] + MARGIN];
        for y in 0..h * zoom {
            for x in 0..w * zoom {
                canvas.set(left + x, top + y, pixels[y / zoom * w + x / zoom]);
            }
        }
        let fitting = w * zoom / font::ADVANCE;
        font::draw(&name.chars().take(fitting).collect::<String>(), |x, y| {
            canvas.set(left + x, top + h * zoom + MARGIN / 2 + y, INK);
        });
        if let Some(range) = range {
            canvas.bar(*range, [left, top + h * zoom + MARGIN / 2 + line], w * zoom);
        }
    }
    canvas
}
