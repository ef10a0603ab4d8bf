//! A task as the bytes of files. The writers are those of `semascan inspect` and `semascan export`.

use super::estimate::{Amounts, bytes_of};
use super::format::{Format, MeshFormat, PointFormat};
use super::task::{About, Task};
use crate::state::export_choice::{Solids, Step};
use crate::state::units;
use semascan_formats::gltf::{self, GlbOptions};
use semascan_formats::{WriteError, components, file_part, obj, ply, stl};
use semascan_geometry::measure::model_figures;
use semascan_geometry::mesh::decimate;
use semascan_model::SemanticMesh;
use std::cell::Cell;
use std::io::Write;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicUsize, Ordering};

/// A file that is ready to be saved.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ExportFile {
    /// Name of the file, from the part's name.
    pub name: String,
    /// Its content.
    pub bytes: Vec<u8>,
    /// Number of points or triangles in it.
    pub count: usize,
    /// Number of points or triangles of the model that it does not hold, because they are hidden.
    pub left_out: usize,
}

/// Hears how much of a step is done, 0..=1.
pub(super) type Report = fn(Step, f32);

impl Task {
    /// Writes the files.
    ///
    /// # Errors
    /// [`WriteError`] if the model is too large for the format.
    pub fn run(&self, report: Report) -> Result<Vec<ExportFile>, WriteError> {
        match self.format {
            Format::Points(format) => self.points(format, report).map(|file| vec![file]),
            Format::Mesh(format) => self.surface(format, report),
        }
    }

    fn points(&self, format: PointFormat, report: Report) -> Result<ExportFile, WriteError> {
        let whole = &self.mesh.vertices;
        let is_kept = |position| !self.cut.is_on() || self.cut.keeps(position);
        let cloud = whole.iter().filter(|p| self.filter.keep(p) && is_kept(p.position)).collect();
        let mesh = SemanticMesh { vertices: cloud, ..SemanticMesh::default() };
        let (cloud, taxonomy) = (&mesh.vertices, &self.about.taxonomy);
        let meter = self.meter(&mesh, report);
        let mut out = meter.file();
        let extension = match format {
            PointFormat::Ply => {
                ply::write_cloud(&mut out, cloud, taxonomy, &comments(&self.about))?;
                "ply"
            }
            PointFormat::Glb => {
                let counted = || model_figures(whole, &SemanticMesh::default(), self.about.voxel as f32);
                let figures = self.figures.clone().unwrap_or_else(counted);
                let options = GlbOptions { part: self.about.part.clone(), figures, ..GlbOptions::default() };
                gltf::write_points(&mut out, cloud, taxonomy, &options)?;
                "glb"
            }
        };
        let name = format!("{}.{extension}", units::file_stem(&self.about.part));
        Ok(ExportFile { name, bytes: out.bytes, count: cloud.len(), left_out: whole.len() - cloud.len() })
    }

    /// The mesh as fine as was chosen, without what is left out; and how many triangles are.
    fn chosen_mesh(&self, report: Report) -> (SemanticMesh, usize) {
        let (whole, filter) = (&self.mesh, &self.filter);
        let is_kept = |t| !self.cut.is_on() || whole.corners(t).is_some_and(|c| c.iter().all(|p| self.cut.keeps(*p)));
        let mesh = whole.select(|t| !filter.hidden_labels.contains(&whole.triangle_label(t)) && is_kept(t));
        let left_out = whole.triangles.len() - mesh.triangles.len();
        let Some(most) = self.choice.detail.most(mesh.triangles.len()) else { return (mesh, left_out) };
        report(Step::Simplify, 0.0);
        let told = AtomicUsize::new(0);
        let progress = |done: usize, total: usize| {
            let percent = done * 100 / total.max(1);
            if told.swap(percent, Ordering::Relaxed) < percent {
                report(Step::Simplify, percent as f32 / 100.0);
            }
            ControlFlow::Continue(())
        };
        // It fails only where somebody ends it.
        let simpler = decimate(&mesh, most, &progress).unwrap_or(mesh);
        (simpler, left_out)
    }

    fn surface(&self, format: MeshFormat, report: Report) -> Result<Vec<ExportFile>, WriteError> {
        let (mesh, left_out) = self.chosen_mesh(report);
        let (about, frame) = (&self.about, self.choice.frame);
        let taxonomy = &about.taxonomy;
        let stem = format!("{}-mesh", units::file_stem(&about.part));
        let count = mesh.triangles.len();
        let meter = self.meter(&mesh, report);
        let mut out = meter.file();
        let file = |name: String, out: Output<'_>, count| ExportFile { name, bytes: out.bytes, count, left_out };
        Ok(match format {
            MeshFormat::Ply => {
                ply::write_semantic_mesh(&mut out, &mesh, taxonomy, &comments(about))?;
                vec![file(format!("{stem}.ply"), out, count)]
            }
            MeshFormat::Obj => {
                let (library, mut materials) = (format!("{stem}.mtl"), meter.file());
                obj::write_mesh(&mut out, &mesh, taxonomy, &library, frame)?;
                obj::write_materials(&mut materials, &mesh, taxonomy)?;
                vec![file(format!("{stem}.obj"), out, count), file(library, materials, count)]
            }
            MeshFormat::Stl if self.choice.solids == Solids::One => {
                stl::write_mesh(&mut out, &mesh, None, &about.part, frame)?;
                vec![file(format!("{stem}.stl"), out, count)]
            }
            MeshFormat::Stl => {
                let mut files = Vec::new();
                for component in components(&mesh, taxonomy)? {
                    let mut out = meter.file();
                    stl::write_mesh(&mut out, &mesh, Some(component.label), &component.name, frame)?;
                    let name = format!("{stem}-{}.stl", file_part(&component.name));
                    files.push(file(name, out, component.triangles.len()));
                }
                files
            }
            MeshFormat::Glb => {
                let figures = self.figures.clone().unwrap_or_default();
                let options = GlbOptions { part: about.part.clone(), figures, ..GlbOptions::default() };
                gltf::write_mesh(&mut out, &mesh, taxonomy, &options)?;
                vec![file(format!("{stem}.glb"), out, count)]
            }
        })
    }

    /// Tells how much of the files is written.
    fn meter(&self, mesh: &SemanticMesh, report: Report) -> Meter {
        report(Step::Write, 0.0);
        let (points, triangles) = (mesh.vertices.len() as u64, mesh.triangles.len() as u64);
        let amounts = Amounts { points, triangles, components: 1, ids: 1 };
        let expected = bytes_of(self.format, amounts, self.choice).max(1);
        Meter { report, expected, written: Cell::default(), told: Cell::default() }
    }
}

/// What a PLY says beside the classes.
fn comments(about: &About) -> [(String, String); 4] {
    [
        ("part".to_owned(), about.part.clone()),
        ("source".to_owned(), about.source.clone()),
        ("inspection".to_owned(), about.id.clone()),
        ("voxel".to_owned(), about.voxel.to_string()),
    ]
}

/// Counts what is written to all files of an export.
struct Meter {
    report: Report,
    expected: u64,
    written: Cell<u64>,
    /// The last percentage that was reported.
    told: Cell<u64>,
}

impl Meter {
    /// An empty file.
    fn file(&self) -> Output<'_> {
        Output { bytes: Vec::new(), meter: self }
    }

    fn count(&self, bytes: usize) {
        self.written.set(self.written.get() + bytes as u64);
        let percent = (self.written.get() * 100 / self.expected).min(100);
        if self.told.replace(percent) < percent {
            (self.report)(Step::Write, percent as f32 / 100.0);
        }
    }
}

/// A file in memory.
struct Output<'a> {
    bytes: Vec<u8>,
    meter: &'a Meter,
}

impl Write for Output<'_> {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.bytes.extend_from_slice(bytes);
        self.meter.count(bytes.len());
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

#[cfg(test)]
mod tests;
