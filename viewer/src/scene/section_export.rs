//! The section as a drawing. The writers are those of `semascan_formats::drawing`.

use crate::export::ExportFile;
use crate::features::section::plane_name;
use crate::state::{AppState, units};
use semascan_formats::drawing::{Drawing, dxf, svg};

/// A file to save the section to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SectionFormat {
    /// A drawing for people, in millimetres.
    Svg,
    /// Outlines for CAD, in millimetres.
    Dxf,
}

impl SectionFormat {
    /// Media type of the file.
    pub fn mime(self) -> &'static str {
        match self {
            Self::Svg => "image/svg+xml",
            Self::Dxf => "image/vnd.dxf",
        }
    }
}

/// Writes the section that `state` shows; `None` without one.
pub fn export_section(state: &AppState, format: SectionFormat) -> Option<ExportFile> {
    let section = &state.features.section;
    let shown = section.shown.as_ref()?;
    // Files are in millimetres, whatever the page shows.
    let mut notes = vec![plane_name(section)];
    if let Some([low, high]) = section.limits {
        let mm = |corner: [f64; 3]| corner.map(|c| format!("{:.2}", c * 1e3)).join(", ");
        notes.push(format!("Box from {} to {} mm", mm(low), mm(high)));
    }
    let (length, area) = (shown.length * 1e3, shown.area * 1e6);
    notes.push(format!("Outlines {length:.1} mm, enclosed {area:.1} mm²"));
    if shown.open > 0 {
        notes.push(format!("{} of {} outlines open: not seen beyond", shown.open, shown.section.outlines.len()));
    }
    if !state.legend.all_visible() {
        notes.push("Without hidden components".to_owned());
    }
    if state.features.mesh.outdated {
        notes.push("Of an earlier model than the last".to_owned());
    }
    let (part, taxonomy) = (&state.inspection.part, state.inspection.taxonomy());
    let drawing = Drawing { section: &shown.section, taxonomy: &taxonomy, part, notes: &notes };
    let (text, ending) = match format {
        SectionFormat::Svg => (svg::write(&drawing), "svg"),
        SectionFormat::Dxf => (dxf::write(&drawing), "dxf"),
    };
    let name = format!("{}-section-{}.{ending}", units::file_stem(part), section.direction.key());
    Some(ExportFile { name, bytes: text.into_bytes(), count: shown.section.outlines.len(), left_out: 0 })
}
