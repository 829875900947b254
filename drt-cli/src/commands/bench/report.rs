//! Measurements as a table and as comma-separated values.

use super::series::Series;
use crate::commands::table::Table;

/// The last measurement of each series, and what all of them show.
pub(super) fn table(all: &[Series]) -> Table<10> {
    let percent = |x: f64| format!("{:.3} %", 100.0 * x);
    let rows = all.iter().filter_map(|s| {
        let last = s.points.last()?;
        Some([
            s.job.clone(),
            s.estimator.into(),
            s.image.clone(),
            last.spp.to_string(),
            format!("{:.3}", s.set_up),
            format!("{:.2}", last.seconds),
            percent(s.relative(last.noise)),
            last.error.map_or_else(String::new, |e| percent(s.relative(e))),
            s.slope().map_or_else(String::new, |x| format!("{x:.2}")),
            s.cost().map_or_else(String::new, |x| format!("{x:.3e}")),
        ])
    });
    Table::new(
        [
            "job",
            "estimator",
            "image",
            "spp",
            "set-up s",
            "seconds",
            "noise",
            "error",
            "slope",
            "variance x CPU s",
        ],
        rows,
    )
}

/// Every measurement; noise and error relative to the series' scale.
pub(super) fn csv(all: &[Series]) -> String {
    let mut text = String::from("job,estimator,image,spp,seconds,cpu_seconds,noise,error\n");
    for s in all {
        for p in &s.points {
            let error = p.error.map_or_else(String::new, |e| s.relative(e).to_string());
            let noise = s.relative(p.noise);
            let (job, image) = (quoted(&s.job), quoted(&s.image));
            text += &format!(
                "{job},{},{image},{},{},{},{noise},{error}\n",
                s.estimator, p.spp, p.seconds, p.cpu_seconds
            );
        }
    }
    text
}

fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.into()
    }
}

#[cfg(test)]
mod tests {
    use super::super::series::tests::falling;
    use super::*;

    #[test]
    fn a_table_has_a_row_and_a_file_all_points() {
        let mut series = falling(-0.5);
        series.job = "a, \"b\"".into();
        let text = table(&[series.clone()]).to_string();
        assert_eq!(text.trim_end().lines().count(), 2);
        assert!(text.contains("-0.50"), "{text}");
        let file = csv(&[series.clone()]);
        assert_eq!(file.lines().count(), 1 + series.points.len());
        assert!(file.lines().nth(1).unwrap().starts_with("\"a, \"\"b\"\"\",path-space,d_x,1,"));
    }
}
