//! Curves over iterations, as SVG.

use std::fmt::Write as _;

use crate::commands::markup::{decade, escaped};

/// Pixels of a chart, and of what surrounds its axes: left, top, right, bottom.
const SIZE: [f64; 2] = [350.0, 210.0];
const MARGIN: [f64; 4] = [64.0, 26.0, 12.0, 24.0];
/// About as many marks as fit along the vertical axis.
const MARKS: f64 = 5.0;

/// A number per iteration.
pub(super) struct Chart<'a> {
    pub(super) title: &'a str,
    pub(super) values: &'a [f64],
    /// The vertical axis shows decades.
    pub(super) logarithmic: bool,
    /// Beyond the last value, what it may be off by.
    pub(super) error: Option<f64>,
}

impl Chart<'_> {
    pub(super) fn svg(&self) -> String {
        let [left, top, right, bottom] = MARGIN;
        let [w, h] = SIZE;
        let mut text = format!(
            "<svg viewBox=\"0 0 {w} {h}\" width=\"{w}\" height=\"{h}\" role=\"img\">\
             <text x=\"{left}\" y=\"16\" class=\"title\">{}</text>\n",
            escaped(self.title)
        );
        let last = self.values.len().saturating_sub(1).max(1) as f64;
        let across = |i: f64| left + (w - left - right) * i / last;
        let axis = Axis::new(self.shown(), self.logarithmic);
        let down = |v: f64| top + (h - top - bottom) * (1.0 - axis.part(v));
        // Writing to a string cannot fail.
        for (v, label) in axis.marks() {
            let y = down(v);
            let _ = writeln!(
                text,
                "<line x1=\"{left}\" y1=\"{y:.1}\" x2=\"{:.1}\" y2=\"{y:.1}\" class=\"grid\"/>\
                 <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{label}</text>",
                w - right,
                left - 5.0,
                y + 4.0
            );
        }
        for (i, anchor) in [(0.0, "start"), (last, "end")] {
            let _ = writeln!(
                text,
                "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"{anchor}\">{i}</text>",
                across(i),
                h - 8.0
            );
        }
        let finite = self.values.iter().enumerate().filter(|(_, v)| axis.holds(**v));
        let points: Vec<String> =
            finite.map(|(i, v)| format!("{:.1},{:.1}", across(i as f64), down(*v))).collect();
        let _ = writeln!(text, "<polyline points=\"{}\" class=\"curve\"/>", points.join(" "));
        if let (Some(error), Some(value)) = (self.error, self.values.last()) {
            let _ = writeln!(
                text,
                "<line x1=\"{x:.1}\" x2=\"{x:.1}\" y1=\"{:.1}\" y2=\"{:.1}\" class=\"error\"/>",
                down(value - error),
                down(value + error),
                x = across(last) - 1.5
            );
        }
        text + "</svg>\n"
    }

    /// All that must lie on the axis.
    fn shown(&self) -> impl Iterator<Item = f64> + '_ {
        let bar = self.error.zip(self.values.last()).map(|(e, v)| [v - e, v + e]);
        self.values.iter().copied().chain(bar.into_iter().flatten())
    }
}

/// The vertical axis.
struct Axis {
    low: f64,
    high: f64,
    logarithmic: bool,
}

impl Axis {
    fn new(values: impl Iterator<Item = f64>, logarithmic: bool) -> Self {
        let fits = |v: &f64| v.is_finite() && (!logarithmic || *v > 0.0);
        let (low, high) = values
            .filter(fits)
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        let (low, high) = match (low <= high, logarithmic) {
            (false, _) => (if logarithmic { 0.1 } else { 0.0 }, 1.0),
            (true, false) if low == high => (low - 0.5, high + 0.5),
            (true, false) => (low, high),
            (true, true) => (low / 1.2, high * 1.2),
        };
        Self { low, high, logarithmic }
    }

    fn holds(&self, v: f64) -> bool {
        (self.low..=self.high).contains(&v)
    }

    fn part(&self, v: f64) -> f64 {
        let along = |v: f64| if self.logarithmic { v.max(self.low).ln() } else { v };
        (along(v) - along(self.low)) / (along(self.high) - along(self.low))
    }

    fn marks(&self) -> Vec<(f64, String)> {
        if self.logarithmic {
            let [low, high] = [self.low, self.high].map(f64::log10);
            let decades: Vec<i32> = (low.ceil() as i32..=high.floor() as i32).collect();
            if decades.len() >= 2 {
                let stride = decades.len().div_ceil(MARKS as usize);
                let mark = |d: &i32| (10.0_f64.powi(*d), decade(*d));
                return decades.iter().step_by(stride).map(mark).collect();
            }
        }
        let step = round_step((self.high - self.low) / MARKS);
        let first = (self.low / step).ceil() as i64;
        let last = (self.high / step).floor() as i64;
        let digits = usize::try_from((-step.log10().floor()).max(0.0) as i64).unwrap_or(0);
        let label = |v: f64| match digits {
            0..=5 => format!("{v:.digits$}"),
            _ => format!("{v:.1e}"),
        };
        (first..=last).map(|k| (k as f64 * step, label(k as f64 * step))).collect()
    }
}

/// 1, 2 or 5 times a power of ten, at least `step`.
fn round_step(step: f64) -> f64 {
    let decade = 10.0_f64.powf(step.log10().floor());
    [1.0, 2.0, 5.0].into_iter().map(|f| f * decade).find(|s| *s >= step).unwrap_or(10.0 * decade)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_stay_on_their_chart() {
        for (values, logarithmic) in [
            (vec![3.0, 0.5, 1e-4, 2e-3], true),
            (vec![-1.0, 0.2, 0.4], false),
            (vec![7.0], false),
            (vec![0.0, 0.0], true),
            (vec![], false),
        ] {
            let chart = Chart { title: "a < b", values: &values, logarithmic, error: Some(0.1) };
            let text = chart.svg();
            let document = roxmltree::Document::parse(&text).unwrap();
            let line = document.descendants().find(|n| n.has_tag_name("polyline")).unwrap();
            let points = line.attribute("points").unwrap();
            for point in points.split_whitespace() {
                let (x, y) = point.split_once(',').unwrap();
                let [x, y] = [x, y].map(|v| v.parse::<f64>().unwrap());
                assert!((0.0..=SIZE[0]).contains(&x) && (0.0..=SIZE[1]).contains(&y), "{point}");
            }
        }
    }

    #[test]
    fn marks_are_round() {
        let axis = Axis::new([0.13, 0.88].into_iter(), false);
        let labels: Vec<String> = axis.marks().into_iter().map(|(_, l)| l).collect();
        assert_eq!(labels, ["0.2", "0.4", "0.6", "0.8"]);
        let axis = Axis::new([1e-3, 50.0].into_iter(), true);
        assert_eq!(axis.marks().len(), 5);
    }
}
