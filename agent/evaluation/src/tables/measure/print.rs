//! The table for people.

use super::{Kind, Measurement, Report};
use std::io::{self, Write};

/// Prints every measurement and the summary.
///
/// # Errors
/// If `out` fails.
pub fn print(out: &mut impl Write, report: &Report) -> io::Result<()> {
    let Report { config, motors, summary } = report;
    writeln!(
        out,
        "measurements on models of {} motors, {} views of {}x{}; truth is what the motors were built with",
        motors.len(),
        config.views,
        config.size.0,
        config.size.1
    )?;
    for motor in motors {
        writeln!(out, "\nmotor {}, voxel {:.3} mm", motor.seed, motor.voxel * 1e3)?;
        writeln!(
            out,
            "  {:<22} {:<32} {:>9} {:>9} {:>9} {:>8}",
            "what", "of", "measured", "U (k=2)", "truth", "error"
        )?;
        for one in &motor.measurements {
            let (unit, digits) = unit(one.kind);
            let missed = if one.is_covered() { "" } else { "  missed" };
            writeln!(
                out,
                "  {:<22} {:<32} {:>9.digits$} {:>9.digits$} {:>9.digits$} {:>+8.digits$}{missed}",
                one.kind.label(),
                one.of,
                one.value / unit,
                one.expanded / unit,
                one.truth / unit,
                one.error() / unit
            )?;
        }
        let refused = if motor.refused.is_empty() { "none".to_owned() } else { motor.refused.join("; ") };
        writeln!(out, "  not seen: {} elements; refused: {refused}", motor.unseen)?;
    }
    writeln!(
        out,
        "\n{:<22} {:>5} {:>8} {:>12} {:>12} {:>14}",
        "what", "count", "covered", "median |e|", "median U", "rms of e / u"
    )?;
    for kind in Kind::ALL {
        let all: Vec<&Measurement> =
            motors.iter().flat_map(|m| &m.measurements).filter(|one| one.kind == kind).collect();
        if all.is_empty() {
            continue;
        }
        let (unit, digits) = unit(kind);
        let name = if kind == Kind::Angle { "deg" } else { "mm" };
        let median = |of: fn(&Measurement) -> f64| super::median(all.iter().map(|one| of(one))).unwrap_or(0.0) / unit;
        let ratio = all.iter().map(|one| (2.0 * one.error() / one.expanded.max(1e-12)).powi(2)).sum::<f64>();
        writeln!(
            out,
            "{:<22} {:>5} {:>8} {:>8.digits$} {name:<3} {:>8.digits$} {name:<3} {:>14.2}",
            kind.label(),
            all.len(),
            all.iter().filter(|one| one.is_covered()).count(),
            median(|one| one.error().abs()),
            median(|one| one.expanded),
            (ratio / all.len() as f64).sqrt()
        )?;
    }
    writeln!(
        out,
        "within U (k = 2): {} of {} ({:.1} %)",
        summary.covered,
        summary.measurements,
        100.0 * summary.covered as f64 / summary.measurements.max(1) as f64
    )?;
    if let (Some(metres), Some(voxels)) = (summary.distance_error, summary.distance_error_voxels) {
        writeln!(out, "median error of distances and steps: {:.3} mm, {voxels:.2} voxels", metres * 1e3)?;
    }
    Ok(())
}

/// Unit and digits of a kind.
fn unit(kind: Kind) -> (f64, usize) {
    if kind == Kind::Angle { (1_f64.to_radians(), 2) } else { (1e-3, 3) }
}
