//! The table for people.

use super::{COMPLETE, CloseLooks, Part, Report};
use std::io::{self, Write};

const STRATEGIES: [&str; 5] = ["best", "next-best", "greedy", "uniform", "random"];

/// Prints the table.
///
/// # Errors
/// If `out` fails.
pub fn print(out: &mut impl Write, report: &Report) -> io::Result<()> {
    let config = &report.config;
    let (width, height) = config.size;
    writeln!(
        out,
        "planned views of {width}x{height}; reachable: points of the true surface that some pose of a fine grid within azimuth 45-90 \
         (any table angle), polar 45-90 deg, 400-600 mm sees under 75 deg of incidence; best knows the part"
    )?;
    for is_motor in [true, false] {
        let parts: Vec<&Part> = report.parts.iter().filter(|part| part.is_motor == is_motor).collect();
        if !parts.is_empty() {
            writeln!(out, "\n{}", if is_motor { "motors" } else { "meshes of others" })?;
            table(out, &parts, config.views)?;
        }
    }
    models(out, report)?;
    close(out, report)
}

fn table(out: &mut impl Write, parts: &[&Part], views: u32) -> io::Result<()> {
    writeln!(
        out,
        "{:<34} {:>9}  views for {:.0} %: {}  {:>8} {:>8}",
        "part",
        "reachable",
        100.0 * COMPLETE,
        STRATEGIES.map(|s| format!("{s:>9}")).join(" "),
        "stops at",
        "s a view"
    )?;
    let number = |n: Option<usize>| n.map_or_else(|| format!(">{views}"), |n| n.to_string());
    for part in parts {
        let needed = STRATEGIES.map(|s| format!("{:>9}", number(part.needed(s))));
        let stops = part.stopped_after.map_or_else(|| "-".to_owned(), |n| n.to_string());
        let name: String = part.name.chars().take(34).collect();
        writeln!(
            out,
            "{name:<34} {:>7.1} %                   {}  {stops:>8} {:>8.3}",
            100.0 * part.reachable,
            needed.join(" "),
            part.planning_seconds
        )?;
    }
    writeln!(out, "mean share of the reachable surface after so many views (after a stop as before it):")?;
    write!(out, "{:<10}", "")?;
    (1..=views).try_for_each(|n| write!(out, " {n:>5}"))?;
    writeln!(out)?;
    for strategy in STRATEGIES {
        write!(out, "{strategy:<10}")?;
        for n in 0..views as usize {
            let curves = parts.iter().filter_map(|part| part.coverage.get(strategy));
            let shares: Vec<f64> = curves.filter_map(|c| c.get(n).or(c.last()).copied()).collect();
            write!(out, " {:>5.1}", 100.0 * shares.iter().sum::<f64>() / shares.len().max(1) as f64)?;
        }
        writeln!(out)?;
    }
    Ok(())
}

fn models(out: &mut impl Write, report: &Report) -> io::Result<()> {
    let scores: Vec<_> = report.parts.iter().filter_map(|part| part.models.as_ref()).collect();
    if scores.is_empty() {
        return Ok(());
    }
    let mean = |of: &dyn Fn(&(super::ModelScores, super::ModelScores)) -> f64| {
        100.0 * scores.iter().map(|s| of(s)).sum::<f64>() / scores.len() as f64
    };
    writeln!(
        out,
        "\nmodels of motors after {} views, labels: {}: on the reachable true surface of the components",
        report.config.compared,
        report.config.labels.name()
    )?;
    writeln!(
        out,
        "next-best    mean IoU {:.2} %  completeness {:.2} %",
        mean(&|s| s.0.mean_iou),
        mean(&|s| s.0.completeness)
    )?;
    writeln!(
        out,
        "random (P0)  mean IoU {:.2} %  completeness {:.2} %",
        mean(&|s| s.1.mean_iou),
        mean(&|s| s.1.completeness)
    )
}

fn close(out: &mut impl Write, report: &Report) -> io::Result<()> {
    let cameras = report.parts.iter().map(|part| part.close.len()).max().unwrap_or(0);
    for camera in 0..cameras {
        let looks: Vec<&CloseLooks> = report.parts.iter().filter_map(|part| part.close.get(camera)).collect();
        let findings = || looks.iter().flat_map(|looks| &looks.findings);
        let Some(first) = looks.first() else { continue };
        let possible = findings().filter(|f| f.is_possible()).count();
        let reached = findings().filter(|f| f.is_reached()).count();
        let within = findings().filter(|f| f.within_incidence > 0.0).count();
        let mut finest: Vec<f64> = findings().filter_map(|f| f.finest_mm).collect();
        finest.sort_by(f64::total_cmp);
        let range = |at: usize| finest.get(at).map_or_else(|| "-".to_owned(), |mm| format!("{mm:.3}"));
        writeln!(
            out,
            "\nclose looks with {}x{} (focal length about {:.0} pixels): findings of 5 mm and more: {}; some pose sees them under 45 deg: \
             {within}, and at 0.1 mm a pixel: {possible}; of these reached by the planned views: {reached}; {:.1} views a part; finest mm a \
             pixel: median {}, worst {}",
            first.size.0,
            first.size.1,
            first.focal,
            findings().count(),
            looks.iter().map(|looks| looks.views).sum::<usize>() as f64 / looks.len() as f64,
            range(finest.len() / 2),
            range(finest.len().saturating_sub(1)),
        )?;
    }
    Ok(())
}
