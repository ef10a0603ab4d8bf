//! `criteria.toml` and the reference that it names, read from files.

use super::Failure;
use anyhow::{Context, anyhow};
use semascan_formats::{read_file, regular_file};
use semascan_inspection::criteria::CheckedCriteria;
use semascan_inspection::findings::Reference;
use semascan_inspection::spec::InspectionSpec;
use semascan_model::Taxonomy;
use semascan_model::record::{InspectionRecord, LabelSource};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The criteria that a command judges its inspections by, and the file that they come from.
#[derive(Clone)]
pub(crate) struct CriteriaFile {
    path: PathBuf,
    checked: Arc<CheckedCriteria>,
}

impl CriteriaFile {
    /// Reads them; what is wrong with them is a wrong call.
    pub(super) fn open(path: &Path) -> Result<Self, Failure> {
        Ok(Self { path: path.to_owned(), checked: Arc::new(read(path)?) })
    }

    /// The criteria, if they know no other classes than an inspection as `spec` says that names those of `taxonomy`. Without
    /// labels there are no classes; the verdict then says that nobody looked.
    pub(super) fn for_classes(
        &self,
        spec: &InspectionSpec,
        taxonomy: &Taxonomy,
    ) -> Result<Arc<CheckedCriteria>, Failure> {
        if spec.labels != LabelSource::None {
            check_taxonomy(&self.path, &self.checked, taxonomy)?;
        }
        Ok(Arc::clone(&self.checked))
    }
}

/// Reads criteria and their reference; what is wrong with them is a wrong call.
pub(super) fn read(path: &Path) -> Result<CheckedCriteria, Failure> {
    let name = || path.display().to_string();
    let text = regular_file::read_to_string(path).with_context(name).map_err(Failure::Call)?;
    let mut checked = CheckedCriteria::parse(&text).with_context(name).map_err(Failure::Call)?;
    if let Some(rule) = &checked.criteria.reference {
        let file = path.parent().unwrap_or(Path::new("")).join(&rule.file);
        let reference = reference(&file, rule.unit.in_metres());
        checked.reference =
            Some(reference.with_context(|| format!("{}: reference", path.display())).map_err(Failure::Call)?);
    }
    Ok(checked)
}

fn reference(file: &Path, scale: f64) -> anyhow::Result<Reference> {
    let geometry = read_file(file)?;
    for warning in &geometry.warnings {
        tracing::warn!("{}: {warning}", file.display());
    }
    let positions: Vec<[f32; 3]> = geometry.positions.iter().map(|p| p.map(|c| (c * scale) as f32)).collect();
    Reference::new(&positions, &geometry.triangles)
        .ok_or_else(|| anyhow!("{}: has no triangles: a reference is a mesh", file.display()))
}

/// Refuses classes that an inspection with the classes of `taxonomy` does not know.
fn check_taxonomy(path: &Path, checked: &CheckedCriteria, taxonomy: &Taxonomy) -> Result<(), Failure> {
    let names = |classes: &[semascan_model::ClassDef]| -> Vec<String> {
        classes.iter().skip(1).map(|class| class.name.clone()).collect()
    };
    check_names(path, checked, &names(&taxonomy.components), &names(&taxonomy.defects))
}

/// The same for an inspection that was written. One that used no labels has no classes, and nothing to judge: that is said by
/// the verdict.
pub(super) fn check_record(path: &Path, checked: &CheckedCriteria, record: &InspectionRecord) -> Result<(), Failure> {
    if record.labels == LabelSource::None {
        return Ok(());
    }
    let names = |classes: &[semascan_model::record::ClassSummary]| -> Vec<String> {
        classes.iter().filter(|class| class.class != 0).map(|class| class.name.clone()).collect()
    };
    check_names(path, checked, &names(&record.components), &names(&record.defects))
}

fn check_names(
    path: &Path,
    checked: &CheckedCriteria,
    components: &[String],
    defects: &[String],
) -> Result<(), Failure> {
    let components: Vec<&str> = components.iter().map(String::as_str).collect();
    let defects: Vec<&str> = defects.iter().map(String::as_str).collect();
    checked.check_classes(&components, &defects).with_context(|| path.display().to_string()).map_err(Failure::Call)
}
