//! The tables for people.

use super::{Aggregate, Method, ReconstructionTables};
use std::io::{self, Write};

/// Writes the tables, published figures beside ours.
///
/// # Errors
/// If `out` fails.
pub fn print(report: &ReconstructionTables, out: &mut dyn Write) -> io::Result<()> {
    writeln!(out, "P1, {} runs of {} views each", report.seeds, report.views)?;
    writeln!(out, "setting: {}", report.setting)?;
    for convention in &report.conventions {
        writeln!(out, "{convention}")?;
    }
    writeln!(out)?;
    table(report, out, "C2C, mm (P1: Tables 3 and 4)", |m| m.c2c_mm, |p| p)?;
    table(report, out, "3D IoU, % within 1 mm", |m| m.precision_1mm * 100.0, |_| None)?;
    masks(report, out)?;
    writeln!(
        out,
        "\nCPU ms a view (P1: Table 5, with the network)\n{:<16}{:>26}{:>22}",
        "", "segmentation", "mapping"
    )?;
    for (m, p) in report.overall.iter().zip(&report.published_cpu_ms) {
        writeln!(
            out,
            "{:<16}{:>12.1} (P1 {:>5.0}){:>16.1} (P1 {:>4.0})",
            m.method.name(),
            m.segmentation_ms,
            p[0],
            m.mapping_ms,
            p[1]
        )?;
    }
    writeln!(out, "\npaired differences, mean and 95 % interval over {} runs", report.runs.len())?;
    for s in &report.steps {
        let (c, p) = (s.c2c_mm, s.precision_1mm);
        writeln!(
            out,
            "{:<13}-> {:<13} C2C {:+.3} mm [{:+.3}, {:+.3}]   3D IoU {:+.2} points [{:+.2}, {:+.2}]",
            s.from.name(),
            s.to.name(),
            c.mean,
            c.low,
            c.high,
            p.mean * 100.0,
            p.low * 100.0,
            p.high * 100.0
        )?;
    }
    writeln!(
        out,
        "\nC2C of {} below {} on {} of {} objects; fusion raises the mean mask IoU by {:.2} points",
        Method::LcccpSicp.name(),
        Method::MaskOnly.name(),
        report.better_than_mask_only,
        report.objects.len(),
        report.mask_iou_gain_points
    )
}

fn table(
    report: &ReconstructionTables,
    out: &mut dyn Write,
    title: &str,
    figure: fn(&Aggregate) -> f64,
    published: fn(Option<[f64; 4]>) -> Option<[f64; 4]>,
) -> io::Result<()> {
    write!(out, "\n{title:<30}")?;
    for method in Method::ALL {
        write!(out, "{:>22}", method.name())?;
    }
    writeln!(out)?;
    for row in &report.objects {
        write!(out, "{:<30}", row.object)?;
        for (k, m) in row.methods.iter().enumerate() {
            match published(row.published_c2c_mm) {
                Some(p) => write!(out, "{:>10.3} (P1 {:>5.3})", figure(m), p[k])?,
                None => write!(out, "{:>10.3}            ", figure(m))?,
            }
        }
        writeln!(out)?;
    }
    write!(out, "{:<30}", "mean")?;
    for m in &report.overall {
        write!(out, "{:>10.3}            ", figure(m))?;
    }
    writeln!(out)
}

fn masks(report: &ReconstructionTables, out: &mut dyn Write) -> io::Result<()> {
    let columns = ["network", "SLIC fusion", "LCCCP fusion", "P1: network", "P1: fusion", "misidentified views"];
    write!(out, "\n{:<30}", "mask IoU, % (P1: Tables 1, 2)")?;
    for column in columns {
        write!(out, "{column:>14}")?;
    }
    writeln!(out)?;
    for row in &report.objects {
        write!(out, "{:<30}", row.object)?;
        for k in [0, 2, 3] {
            write!(out, "{:>14.2}", row.methods[k].mask_iou * 100.0)?;
        }
        for k in 0..2 {
            match row.published_mask_iou {
                Some(p) => write!(out, "{:>14.2}", p[k])?,
                None => write!(out, "{:>14}", "-")?,
            }
        }
        let shares = row.methods.iter().map(|m| format!("{:.0}", m.misidentified * 100.0)).collect::<Vec<_>>();
        writeln!(out, "{:>17} %", shares.join("/"))?;
    }
    write!(out, "{:<30}", "mean")?;
    for k in [0, 2, 3] {
        write!(out, "{:>14.2}", report.overall[k].mask_iou * 100.0)?;
    }
    writeln!(out)
}
