//! A folder in, a model out: `cargo run -p semascan-inspection --example inspect -- path/to/bop/scene`.

use semascan_inspection::Inspection;
use semascan_inspection::event::EventKind;
use semascan_inspection::spec::{CameraMask, InspectionSpec};

fn main() -> anyhow::Result<()> {
    let Some(folder) = std::env::args().nth(1) else { anyhow::bail!("name a BOP scene folder") };
    let source = semascan_sources::open(&folder, &CameraMask::Auto)?;

    // Labels come with the scene and poses from ICP: the defaults. A subscriber watches the views pass.
    let inspection = Inspection::new(InspectionSpec::default(), source)?;
    let events = inspection.subscribe();
    let handle = inspection.start();
    for event in events {
        if let EventKind::ViewFinished { record, .. } = &event.kind {
            eprintln!("view {}: {}", record.index, record.reason.as_deref().unwrap_or("accepted"));
        }
    }

    // The model: points in metres in the table frame, and what was found of each class.
    let inspected = handle.wait()?;
    eprintln!("{}: {} points", inspected.record.part, inspected.cloud.len());
    for class in &inspected.record.components {
        let area = class.area.map_or_else(|| "unknown".into(), |area| format!("{:.1} mm2", area * 1e6));
        eprintln!("{:<24} {area:>12}", class.name);
    }
    Ok(())
}
