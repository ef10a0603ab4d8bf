//! The files of an inspection: inspection.json, cloud.ply, mesh.ply, scene.glb, truth.ply where it is known, the views' own
//! clouds where they are asked for, and report.html, which somebody else writes.

use crate::StoreError;
use crate::contents::{CLOUD, MESH, REPORT, SCENE, TRUTH, VIEWS};
use crate::write::{sync_folder, write_file, write_new};
use semascan_formats::gltf::{self, GlbOptions};
use semascan_formats::ply::{self, LabelledMesh};
use semascan_formats::{ExportFilter, WriteError};
use semascan_inspection::Inspected;
use semascan_model::Taxonomy;
use semascan_model::record::{FilesRecord, InspectionRecord};
use semascan_perception::fuse::KeptViews;
use std::fs;
use std::io::Write;
use std::path::Path;

/// Writes a report of the record that it is given, which names the files of the set and their generation: HTML, with the
/// generation in its first kilobytes as `<meta name="generation" content="...">`.
pub type ReportWriter<'a> = dyn Fn(&InspectionRecord) -> String + Sync + 'a;

/// What stands beside the model.
#[derive(Clone, Copy, Default)]
pub struct Additions<'a> {
    /// Whether each view is written as a cloud of its own.
    pub view_clouds: bool,
    /// What writes `report.html`; there is none without it.
    pub report: Option<&'a ReportWriter<'a>>,
}

/// Writes everything but the record into `folder`, each file with its `generation`. Returns the names of the files. Errors
/// speak of `target`, where the files will stand.
pub(crate) fn write(
    folder: &Path,
    target: &Path,
    generation: &str,
    inspected: &Inspected,
    additions: Additions<'_>,
) -> Result<Vec<String>, StoreError> {
    let Inspected { record, cloud, mesh, figures, source, model, .. } = inspected;
    let (taxonomy, truth) = (&source.info().taxonomy, source.truth());
    let comments = comments(record, generation);
    let names = names(inspected, additions);
    let place = |name: &str| (folder.join(name), target.join(name));
    let write_cloud = || {
        let (path, shown) = place(CLOUD);
        write_new(&path, &shown, |out| ply::write_cloud(out, cloud, taxonomy, &comments))
    };
    let write_mesh = || {
        let (path, shown) = place(MESH);
        write_new(&path, &shown, |out| ply::write_semantic_mesh(out, mesh, taxonomy, &comments))
    };
    let options = GlbOptions {
        part: record.part.clone(),
        figures: figures.clone(),
        findings: record.findings.as_ref().map_or_else(Vec::new, |f| f.list.clone()),
        generation: Some(generation.to_owned()),
        ..GlbOptions::default()
    };
    let write_scene = || {
        let (path, shown) = place(SCENE);
        write_new(&path, &shown, |out| {
            if mesh.triangles.is_empty() {
                // Without oriented points there is no mesh; what was marked as stray or as background stays in cloud.ply.
                gltf::write_points(out, &ExportFilter::of_the_part().apply(cloud), taxonomy, &options)
            } else {
                gltf::write_mesh(out, mesh, taxonomy, &options)
            }
        })
    };
    let write_truth = || {
        let Some(mesh) = truth else { return Ok(()) };
        let (path, shown) = place(TRUTH);
        write_new(&path, &shown, |out| {
            let labelled = LabelledMesh {
                vertices: &mesh.vertices,
                triangles: &mesh.triangles,
                labels: &mesh.labels,
                defects: &mesh.defects,
            };
            ply::write_mesh(out, &labelled, taxonomy, &comments)
        })
    };
    let files = FilesRecord { generation: generation.to_owned(), names: names.clone() };
    let named = InspectionRecord { files: Some(files), ..record.clone() };
    let write_report = || {
        let Some(report) = additions.report else { return Ok(()) };
        let html = report(&named);
        let (path, shown) = place(REPORT);
        write_new(&path, &shown, |out| Ok(out.write_all(html.as_bytes())?))
    };
    // The files wait for the disk while the report's pictures are drawn.
    let (of_report, (of_truth, (of_cloud, (of_mesh, of_scene)))) = rayon::join(write_report, || {
        rayon::join(write_truth, || rayon::join(write_cloud, || rayon::join(write_mesh, write_scene)))
    });
    of_cloud.and(of_mesh).and(of_scene).and(of_truth).and(of_report)?;
    if additions.view_clouds {
        write_view_clouds(folder, target, &comments, model.read().kept_views(), taxonomy)?;
    }
    Ok(names)
}

/// The names of the files of a set but for the record.
fn names(inspected: &Inspected, additions: Additions<'_>) -> Vec<String> {
    let mut names: Vec<String> = [CLOUD, MESH, SCENE].map(str::to_owned).into();
    names.extend(inspected.source.truth().map(|_| TRUTH.to_owned()));
    if additions.view_clouds {
        names.extend(inspected.model.read().kept_views().indices().into_iter().map(view_cloud));
    }
    names.extend(additions.report.map(|_| REPORT.to_owned()));
    names
}

/// The name of the cloud of the view with the place `index` in the capture order.
fn view_cloud(index: u32) -> String {
    format!("{VIEWS}/{index:06}.ply")
}

/// Writes a record to `path`; errors speak of `shown`, where it will stand.
pub(crate) fn write_record(path: &Path, shown: &Path, record: &InspectionRecord) -> Result<(), StoreError> {
    write_new(path, shown, |out| put_record(out, record))
}

/// Replaces the record at `path` in one step.
pub(crate) fn write_record_whole(path: &Path, record: &InspectionRecord) -> Result<(), StoreError> {
    write_file(path, |out| put_record(out, record))
}

fn put_record(out: &mut impl Write, record: &InspectionRecord) -> Result<(), WriteError> {
    serde_json::to_writer_pretty(&mut *out, record)?;
    Ok(writeln!(out)?)
}

/// Writes every kept view as a semantic cloud of its own (as [Wang 2023] makes of keyframes), `views/000000.ply` and so on
/// by its place in the capture order.
fn write_view_clouds(
    folder: &Path,
    target: &Path,
    comments: &[(String, String)],
    views: &KeptViews,
    taxonomy: &Taxonomy,
) -> Result<(), StoreError> {
    let parent = folder.join(VIEWS);
    fs::create_dir_all(&parent).map_err(StoreError::io(&target.join(VIEWS)))?;
    for i in 0..views.len() {
        let view = views.restore(i)?;
        let name = view_cloud(view.index);
        let comments = [comments, &[("view".to_owned(), view.index.to_string())]].concat();
        write_new(&folder.join(&name), &target.join(&name), |out| {
            ply::write_cloud(out, &view.semantic_cloud(), taxonomy, &comments)
        })?;
    }
    sync_folder(&parent)
}

/// Comments of every PLY: but for the generation they do not depend on when or how fast it was made.
fn comments(record: &InspectionRecord, generation: &str) -> Vec<(String, String)> {
    let mut list = vec![
        ("generator".to_owned(), format!("semascan {}", record.software.version)),
        ("generation".to_owned(), generation.to_owned()),
        ("part".to_owned(), record.part.clone()),
        ("frame".to_owned(), "table, metres".to_owned()),
    ];
    list.extend(record.voxel.map(|v| ("voxel".to_owned(), v.to_string())));
    list
}
