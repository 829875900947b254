//! Error against time as a picture: a panel for each job, both axes logarithmic.

use std::fmt::Write;

use super::series::Series;
use crate::commands::markup::{decade, escaped};

/// Pixels of a panel, and of what surrounds its axes.
const PANEL: [f64; 2] = [380.0, 280.0];
const MARGIN: [f64; 4] = [58.0, 30.0, 12.0, 40.0];
/// Panels side by side.
const COLUMNS: usize = 3;
/// Readable next to each other, on white.
const COLOURS: [&str; 8] =
    ["#1b6ca8", "#d1495b", "#3a7d44", "#8e5ea2", "#c77d0a", "#4a4e69", "#00798c", "#a44a3f"];

/// Draws all series as SVG.
pub(super) fn svg(all: &[Series]) -> String {
    let mut jobs: Vec<&str> = all.iter().map(|s| s.job.as_str()).collect();
    jobs.dedup();
    let columns = jobs.len().clamp(1, COLUMNS);
    let rows = jobs.len().div_ceil(columns).max(1);
    let (w, h) = (PANEL[0] * columns as f64, PANEL[1] * rows as f64 + LEGEND);
    let mut text = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{w}\" height=\"{h}\" \
         viewBox=\"0 0 {w} {h}\" font-family=\"sans-serif\" font-size=\"11\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
    );
    for (i, job) in jobs.iter().enumerate() {
        let series: Vec<&Series> = all.iter().filter(|s| s.job == *job).collect();
        let at = [PANEL[0] * (i % columns) as f64, PANEL[1] * (i / columns) as f64];
        panel(&mut text, at, job, &series);
    }
    legend(&mut text, h - LEGEND + 16.0);
    text + "</svg>\n"
}

/// Height of the line that explains the strokes.
const LEGEND: f64 = 26.0;

/// How an estimator's lines are drawn.
fn dashes(estimator: &str) -> &'static str {
    match estimator {
        "finite-difference" => "5 3",
        _ => "none",
    }
}

/// The decades that an axis shows.
struct Axis {
    low: i32,
    high: i32,
    pixels: [f64; 2],
}

impl Axis {
    fn new(values: impl Iterator<Item = f64>, pixels: [f64; 2]) -> Self {
        let (low, high) = values
            .filter(|v| *v > 0.0 && v.is_finite())
            .fold((f64::INFINITY, 0.0_f64), |(l, h), v| (l.min(v), h.max(v)));
        let (low, high) = if high > 0.0 { (low, high) } else { (0.1, 1.0) };
        let low = low.log10().floor() as i32;
        Self { low, high: (high.log10().ceil() as i32).max(low + 1), pixels }
    }

    fn place(&self, value: f64) -> f64 {
        let part = (value.log10() - f64::from(self.low)) / f64::from(self.high - self.low);
        self.pixels[0] + part * (self.pixels[1] - self.pixels[0])
    }

    fn decades(&self) -> impl Iterator<Item = (i32, f64)> + '_ {
        (self.low..=self.high).map(|d| (d, self.place(10.0_f64.powi(d))))
    }
}

fn panel(text: &mut String, [x, y]: [f64; 2], job: &str, series: &[&Series]) {
    let [left, top, right, bottom] = MARGIN;
    let across = [x + left, x + PANEL[0] - right];
    let down = [y + PANEL[1] - bottom, y + top];
    let points = || series.iter().flat_map(|s| s.points.iter().map(|p| (*s, *p)));
    let time = Axis::new(points().map(|(_, p)| p.seconds), across);
    let noise = Axis::new(points().map(|(s, p)| 100.0 * s.relative(p.noise)), down);
    // Writing to a string cannot fail.
    for (d, px) in time.decades() {
        let _ = writeln!(
            text,
            "<line x1=\"{px:.1}\" y1=\"{:.1}\" x2=\"{px:.1}\" y2=\"{:.1}\" stroke=\"#ddd\"/>\
             <text x=\"{px:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>",
            down[0],
            down[1],
            down[0] + 14.0,
            decade(d)
        );
    }
    for (d, py) in noise.decades() {
        let _ = writeln!(
            text,
            "<line x1=\"{:.1}\" y1=\"{py:.1}\" x2=\"{:.1}\" y2=\"{py:.1}\" stroke=\"#ddd\"/>\
             <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{} %</text>",
            across[0],
            across[1],
            across[0] - 4.0,
            py + 4.0,
            decade(d)
        );
    }
    let _ = writeln!(
        text,
        "<text x=\"{:.1}\" y=\"{:.1}\" font-weight=\"bold\">{}</text>\
         <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">seconds</text>",
        across[0],
        y + top - 10.0,
        escaped(job),
        across[1],
        down[0] + 28.0
    );
    let mut images: Vec<&str> = Vec::new();
    for s in series {
        if !images.contains(&s.image.as_str()) {
            images.push(&s.image);
        }
        let index = images.iter().position(|i| *i == s.image).unwrap_or(0);
        let colour = COLOURS[index % COLOURS.len()];
        let line: String = s
            .points
            .iter()
            .filter(|p| p.has_logarithms())
            .map(|p| {
                let percent = 100.0 * s.relative(p.noise);
                format!("{:.1},{:.1} ", time.place(p.seconds), noise.place(percent))
            })
            .collect();
        let _ = writeln!(
            text,
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"1.5\" \
             stroke-dasharray=\"{}\"/>",
            line.trim_end(),
            dashes(s.estimator)
        );
    }
    for (i, image) in images.iter().enumerate() {
        let _ = writeln!(
            text,
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\" fill=\"{}\">{}</text>",
            across[1] - 4.0,
            down[1] + 12.0 + 13.0 * i as f64,
            COLOURS[i % COLOURS.len()],
            escaped(image)
        );
    }
}

fn legend(text: &mut String, y: f64) {
    for (i, (estimator, name)) in [
        ("path-space", "image, and derivatives by paths"),
        ("finite-difference", "finite differences"),
    ]
    .into_iter()
    .enumerate()
    {
        let x = MARGIN[0] + 240.0 * i as f64;
        let _ = writeln!(
            text,
            "<line x1=\"{x}\" y1=\"{:.1}\" x2=\"{}\" y2=\"{:.1}\" stroke=\"black\" \
             stroke-width=\"1.5\" stroke-dasharray=\"{}\"/><text x=\"{}\" y=\"{y:.1}\">{name}</text>",
            y - 4.0,
            x + 30.0,
            y - 4.0,
            dashes(estimator),
            x + 36.0
        );
    }
}

#[cfg(test)]
mod tests {
    use super::super::series::tests::falling;
    use super::*;

    #[test]
    fn plots_are_well_formed_and_lines_fall_inside_their_panel() {
        let mut other = falling(-0.8);
        // Of a single sample.
        other.points[0].noise = f64::INFINITY;
        other.job = "a < b & c".into();
        let text = svg(&[falling(-0.5), other]);
        let document = roxmltree::Document::parse(&text).unwrap();
        let lines: Vec<_> = document.descendants().filter(|n| n.has_tag_name("polyline")).collect();
        assert_eq!(lines.len(), 2);
        for (i, line) in lines.iter().enumerate() {
            let points: Vec<[f64; 2]> = line
                .attribute("points")
                .unwrap()
                .split(' ')
                .map(|p| {
                    let (x, y) = p.split_once(',').unwrap();
                    [x.parse().unwrap(), y.parse().unwrap()]
                })
                .collect();
            let from = PANEL[0] * i as f64;
            assert!(points.iter().all(|p| p[0] >= from && p[0] <= from + PANEL[0]));
            assert!(points.windows(2).all(|p| p[1][0] > p[0][0] && p[1][1] > p[0][1]));
        }
        assert!(roxmltree::Document::parse(&svg(&[])).is_ok());
    }
}
