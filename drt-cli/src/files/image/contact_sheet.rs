//! A PNG to look at: the image, and beside it each derivative under its name.

use std::path::Path;

use drt_estimators::{Layer, Rendering};
use drt_math::Rgb;

use super::font;
use super::picture::encode_png;
use super::tone::{self, Pixel};
use crate::CliError;
use crate::files::atomic::write_atomically;

const BACKGROUND: Pixel = [38, 38, 40];
const INK: Pixel = [225, 225, 225];
/// Blank pixels around panels.
const MARGIN: usize = 6;
/// Panels narrower than this are enlarged by a whole factor.
const LEAST_PANEL: usize = 160;

struct Canvas {
    width: usize,
    height: usize,
    pixels: Vec<Pixel>,
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
}

/// Writes a preview. Without derivatives it is the image alone, pixel for pixel.
///
/// # Errors
/// When the file cannot be written.
pub fn write_preview(
    path: &Path,
    rendering: &Rendering,
    further: &[(String, &Layer)],
) -> Result<(), CliError> {
    let image = exposed(&means(&rendering.image));
    let derivatives = rendering.derivatives.iter();
    let mut panels: Vec<(String, Vec<Pixel>)> =
        derivatives.map(|d| (format!("d_{}", d.name), tone::diverging(&means(&d.total)))).collect();
    panels
        .extend(further.iter().map(|(name, layer)| (name.clone(), tone::diverging(&means(layer)))));
    panels.insert(0, ("image".into(), image));
    write_panels(path, rendering.image.size, &mut panels)
}

fn exposed(image: &[Rgb]) -> Vec<Pixel> {
    tone::exposed(image, tone::white_of(image))
}

/// Writes a preview of layers of a file, by their names: what may be negative from blue through white (zero) to red, each in its own
/// range, all else as light. One layer is written pixel for pixel.
///
/// # Errors
/// When the file cannot be written.
pub fn write_layers(
    path: &Path,
    size: [u32; 2],
    layers: &[(&str, &[[f32; 3]])],
) -> Result<(), CliError> {
    let panel = |(name, pixels): &(&str, &[[f32; 3]])| {
        let image: Vec<Rgb> = pixels.iter().map(|p| p.map(f64::from).into()).collect();
        let derivative = name.starts_with("d_") || name.starts_with("fd_");
        let signed = derivative && !is_error(name) || image.iter().any(|p| p.mean() < 0.0);
        let shown = if name.is_empty() { "image" } else { name };
        (shown.into(), if signed { tone::diverging(&image) } else { exposed(&image) })
    };
    write_panels(path, size, &mut layers.iter().map(panel).collect::<Vec<_>>())
}

/// True for the name of a layer of standard errors.
pub fn is_error(name: &str) -> bool {
    name == "stderr" || name.ends_with("_stderr")
}

fn write_panels(
    path: &Path,
    size: [u32; 2],
    panels: &mut [(String, Vec<Pixel>)],
) -> Result<(), CliError> {
    let [w, h] = size.map(|n| n as usize);
    let canvas = match panels {
        [(_, pixels)] => Canvas { width: w, height: h, pixels: core::mem::take(pixels) },
        _ => sheet(panels, [w, h]),
    };
    write_atomically(path, |out| {
        Ok(encode_png(out, [canvas.width as u32, canvas.height as u32], &canvas.pixels)?)
    })
}

fn means(layer: &Layer) -> Vec<Rgb> {
    layer.pixels.iter().map(|p| p.mean).collect()
}

/// Panels of one size in a grid, each above its name.
fn sheet(panels: &[(String, Vec<Pixel>)], [w, h]: [usize; 2]) -> Canvas {
    let zoom = LEAST_PANEL.div_ceil(w).clamp(1, 16);
    let columns = (panels.len() as f64).sqrt().ceil() as usize;
    let cell = [w * zoom + MARGIN, h * zoom + font::HEIGHT + 2 * MARGIN];
    let rows = panels.len().div_ceil(columns);
    let mut canvas = Canvas::new(columns * cell[0] + MARGIN, rows * cell[1] + MARGIN);
    for (i, (name, pixels)) in panels.iter().enumerate() {
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
    }
    canvas
}
