//! The table for people.

use super::{Legibility, Report};
use std::io::{self, Write};

/// Prints every motor and the means.
///
/// # Errors
/// If `out` fails.
pub fn print(out: &mut impl Write, report: &Report) -> io::Result<()> {
    let Report { config, motors, errors, grid } = report;
    writeln!(
        out,
        "textures of {} motors, {} photographs of {}x{}; errors are mean absolute differences in levels of 255 over the pixels that \
         show the part",
        motors.len(),
        config.views,
        config.size.0,
        config.size.1
    )?;
    writeln!(
        out,
        "\n{:>6} {:>9} {:>9} {:>13} {:>8} {:>7} {:>8}",
        "motor", "voxel", "texel", "atlas", "MB", "charts", "unseen"
    )?;
    for motor in motors {
        writeln!(
            out,
            "{:>6} {:>6.2} mm {:>6.3} mm {:>13} {:>8.1} {:>7} {:>6.1} %",
            motor.seed,
            motor.voxel * 1e3,
            motor.texel * 1e3,
            format!("{} x {}", motor.atlas.0, motor.atlas.1),
            motor.bytes as f64 * 1e-6,
            motor.charts,
            motor.unseen * 1e2
        )?;
    }
    writeln!(
        out,
        "\n{:<28} {:>8} {:>9} {:>6}   {:>8} {:>9} {:>6} {:>8}",
        "against", "texture", "vertices", "ratio", "details:", "vertices", "ratio", "size"
    )?;
    for error in errors {
        let ratio = |a: f64, b: f64| b / a.max(1e-9);
        writeln!(
            out,
            "{:<28} {:>8.2} {:>9.2} {:>6.2}   {:>8.2} {:>9.2} {:>6.2} {:>8.2}",
            error.against.name(),
            error.texture,
            error.vertices,
            ratio(error.texture, error.vertices),
            error.texture_details,
            error.vertex_details,
            ratio(error.texture_details, error.vertex_details),
            error.details
        )?;
    }
    if let Some(Legibility { texel, period, photographs, texture, vertices }) = grid {
        writeln!(
            out,
            "\nprinted grid of {:.0} mm, texel {:.3} mm; contrast of its lines in levels: {photographs:.1} in the photographs, \
             {texture:.1} in the texture, {vertices:.1} in the colours of vertices",
            period * 1e3,
            texel * 1e3
        )?;
    }
    Ok(())
}
