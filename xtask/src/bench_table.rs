//! One table of everything that was measured: the numbers of JSON reports and criterion's estimates.

use anyhow::{Context, Result};
use serde_json::Value;
use std::fmt::Write;
use std::fs;
use std::path::Path;

/// One figure of one benchmark.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Row {
    pub(crate) bench: String,
    pub(crate) figure: String,
    pub(crate) value: String,
}

impl Row {
    fn new(bench: &str, figure: &str, value: String) -> Self {
        Self { bench: bench.to_owned(), figure: figure.to_owned(), value }
    }
}

/// The figures of a report, nested names joined by dots.
pub(crate) fn flatten(bench: &str, report: &Value) -> Vec<Row> {
    let mut rows = Vec::new();
    visit(bench, "", report, &mut rows);
    rows
}

fn visit(bench: &str, name: &str, value: &Value, rows: &mut Vec<Row>) {
    let join = |part: &str| {
        if name.is_empty() { part.to_owned() } else { format!("{name}.{part}") }
    };
    match value {
        Value::Object(fields) => fields.iter().for_each(|(key, value)| visit(bench, &join(key), value, rows)),
        Value::Array(items) => {
            items.iter().enumerate().for_each(|(i, value)| visit(bench, &join(&i.to_string()), value, rows));
        }
        Value::Number(number) => rows.push(Row::new(bench, name, readable(number.as_f64().unwrap_or(f64::NAN)))),
        Value::String(text) => rows.push(Row::new(bench, name, text.clone())),
        Value::Bool(yes) => rows.push(Row::new(bench, name, yes.to_string())),
        Value::Null => {}
    }
}

fn readable(number: f64) -> String {
    if number.fract() == 0.0 && number.abs() < 1e15 {
        format!("{number:.0}")
    } else if number.abs() >= 100.0 {
        format!("{number:.1}")
    } else if number.abs() >= 0.01 {
        format!("{number:.3}")
    } else {
        format!("{number:.3e}")
    }
}

/// The median of every benchmark that criterion has measured, with its throughput where it has one.
pub(crate) fn criterion(folder: &Path) -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    if folder.is_dir() {
        search(folder, &mut rows)?;
    }
    rows.sort_by(|a, b| (&a.bench, &a.figure).cmp(&(&b.bench, &b.figure)));
    Ok(rows)
}

fn search(folder: &Path, rows: &mut Vec<Row>) -> Result<()> {
    let (estimates, about) = (folder.join("new/estimates.json"), folder.join("new/benchmark.json"));
    if estimates.exists() && about.exists() {
        rows.extend(estimate(&read(&about)?, &read(&estimates)?));
        return Ok(());
    }
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            search(&path, rows)?;
        }
    }
    Ok(())
}

/// Criterion writes nanoseconds, and what one iteration processes.
fn estimate(about: &Value, estimates: &Value) -> Vec<Row> {
    let name = about["full_id"].as_str().unwrap_or("criterion");
    let Some(nanoseconds) = estimates["median"]["point_estimate"].as_f64() else {
        return Vec::new();
    };
    let mut rows = vec![Row::new(name, "median ms", readable(nanoseconds / 1e6))];
    for (key, unit) in [("Elements", "M elements/s"), ("Bytes", "MB/s")] {
        if let Some(amount) = about["throughput"][key].as_f64() {
            rows.push(Row::new(name, unit, readable(amount * 1e3 / nanoseconds)));
        }
    }
    rows
}

fn read(path: &Path) -> Result<Value> {
    let text = fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
    serde_json::from_str(&text).with_context(|| format!("{} is not JSON", path.display()))
}

/// Columns wide enough for their content; the name of a benchmark stands at its first figure only.
pub(crate) fn render(rows: &[Row]) -> String {
    let width = |column: fn(&Row) -> &str| rows.iter().map(|row| column(row).chars().count()).max().unwrap_or(0);
    let (first, second) = (width(|row| &row.bench), width(|row| &row.figure));
    let mut text = String::new();
    let mut previous = "";
    for row in rows {
        let bench = if row.bench == previous { "" } else { row.bench.as_str() };
        previous = &row.bench;
        // Writing to a string cannot fail.
        let _ = writeln!(text, "   {bench:<first$}  {:<second$}  {:>12}", row.figure, row.value);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn nested_figures_get_joined_names() {
        let rows = flatten("stream", &json!({ "points": 3, "encode": { "mpoints_s": 4.25 }, "lost": null }));
        let figures: Vec<_> = rows.iter().map(|row| (row.figure.as_str(), row.value.as_str())).collect();
        assert_eq!(figures, [("encode.mpoints_s", "4.250"), ("points", "3")]);
    }

    #[test]
    fn criterion_gives_median_and_throughput() {
        let about = json!({ "full_id": "fuse/view", "throughput": { "Elements": 300_000 } });
        let rows = estimate(&about, &json!({ "median": { "point_estimate": 50e6 } }));
        assert_eq!(rows[0], Row::new("fuse/view", "median ms", "50".into()));
        assert_eq!(rows[1], Row::new("fuse/view", "M elements/s", "6".into()));
    }

    #[test]
    fn a_benchmark_is_named_once() {
        let text = render(&flatten("stream", &json!({ "a": 1, "b": 2 })));
        assert_eq!(text.matches("stream").count(), 1);
        assert_eq!(text.lines().count(), 2);
    }
}
