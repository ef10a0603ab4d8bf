//! The folder that an inspection leaves behind: inspection.json, cloud.ply, mesh.ply, scene.glb, and truth.ply where it is
//! known.
//!
//! Each file is written under a temporary name and renamed when it is whole, so that a killed process or a full disk
//! leaves no half file under a good name.

use semascan_formats::gltf::{self, GlbOptions};
use semascan_formats::ply::{self, LabelledMesh};
use semascan_formats::{ExportFilter, WriteError};
use semascan_inspection::Inspected;
use semascan_model::Taxonomy;
use semascan_model::record::InspectionRecord;
use semascan_perception::fuse::{FuseError, KeptViews};
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// Why an inspection could not be written.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// The folder or one of its files could not be written.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The underlying I/O error.
        source: io::Error,
    },
    /// The folder holds something already.
    #[error("{}: holds {found} already; name another folder, or replace it with --overwrite", path.display())]
    NotEmpty {
        /// The folder.
        path: PathBuf,
        /// One of the things in it.
        found: String,
    },
    /// An export failed.
    #[error("{}: {source}", path.display())]
    Export {
        /// The file.
        path: PathBuf,
        /// Why.
        source: WriteError,
    },
    /// A kept view cannot be read back.
    #[error(transparent)]
    View(#[from] FuseError),
}

/// The files of an inspection. The record is the first that goes: without it the others are of no inspection.
const FILES: [&str; 5] = ["inspection.json", "cloud.ply", "mesh.ply", "scene.glb", "truth.ply"];

/// Begins the folder of an inspection: afterwards it holds `record` and nothing of an earlier one. It is made if need be;
/// one that holds something is refused, unless `overwrite` allows that the files of an earlier inspection are removed.
///
/// # Errors
/// [`StoreError`] naming the folder or file.
pub fn begin_folder(folder: &Path, record: &InspectionRecord, overwrite: bool) -> Result<(), StoreError> {
    let io = |path: &Path| {
        let path = path.to_owned();
        move |source| StoreError::Io { path, source }
    };
    fs::create_dir_all(folder).map_err(io(folder))?;
    if !overwrite {
        let mut names = fs::read_dir(folder).map_err(io(folder))?.filter_map(Result::ok).map(|e| e.file_name());
        if let Some(name) = names.find(|name| !name.to_string_lossy().starts_with('.')) {
            return Err(StoreError::NotEmpty { path: folder.to_owned(), found: name.to_string_lossy().into_owned() });
        }
    }
    let views = fs::read_dir(folder.join("views")).into_iter().flatten().filter_map(Result::ok).map(|e| e.path());
    let clouds = views.filter(|path| path.extension().is_some_and(|e| e == "ply"));
    for path in FILES.iter().map(|file| folder.join(file)).chain(clouds) {
        match fs::remove_file(&path) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(io(&path)(error)),
            _ => {}
        }
    }
    write_record(folder, record)
}

/// Writes the record of an inspection into its folder.
///
/// # Errors
/// [`StoreError`] naming the file.
pub fn write_record(folder: &Path, record: &InspectionRecord) -> Result<(), StoreError> {
    write(&folder.join("inspection.json"), |out| {
        serde_json::to_writer_pretty(&mut *out, record)?;
        Ok(writeln!(out)?)
    })
}

/// Writes an inspection into `folder`, which is made if need be.
///
/// # Errors
/// [`StoreError`] naming the file; files that were complete before stay as they were.
pub fn write_inspection(folder: &Path, inspected: &Inspected) -> Result<(), StoreError> {
    let Inspected { record, cloud, mesh, figures, source, .. } = inspected;
    let (taxonomy, truth) = (&source.info().taxonomy, source.truth());
    fs::create_dir_all(folder).map_err(|source| StoreError::Io { path: folder.to_owned(), source })?;
    let comments = comments(record);
    write(&folder.join("cloud.ply"), |out| ply::write_cloud(out, cloud, taxonomy, &comments))?;
    write(&folder.join("mesh.ply"), |out| ply::write_semantic_mesh(out, mesh, taxonomy, &comments))?;
    write(&folder.join("scene.glb"), |out| {
        let options = GlbOptions { part: record.part.clone(), figures: figures.clone() };
        if mesh.triangles.is_empty() {
            // Without oriented points there is no mesh; what was marked as stray or as background stays in cloud.ply.
            gltf::write_points(out, &ExportFilter::of_the_part().apply(cloud), taxonomy, &options)
        } else {
            gltf::write_mesh(out, mesh, taxonomy, &options)
        }
    })?;
    if let Some(mesh) = truth {
        write(&folder.join("truth.ply"), |out| {
            let labelled = LabelledMesh {
                vertices: &mesh.vertices,
                triangles: &mesh.triangles,
                labels: &mesh.labels,
                defects: &mesh.defects,
            };
            ply::write_mesh(out, &labelled, taxonomy, &comments)
        })?;
    }
    write_record(folder, record)
}

/// Writes every kept view as a semantic cloud of its own (as [Wang 2023] makes of keyframes), `folder/000000.ply` and
/// so on by its place in the capture order.
///
/// # Errors
/// [`StoreError`] naming the file or the view.
pub fn write_view_clouds(folder: &Path, views: &KeptViews, taxonomy: &Taxonomy) -> Result<(), StoreError> {
    fs::create_dir_all(folder).map_err(|source| StoreError::Io { path: folder.to_owned(), source })?;
    for i in 0..views.len() {
        let view = views.restore(i)?;
        let comments = [("frame".to_owned(), "table, metres".to_owned()), ("view".to_owned(), view.index.to_string())];
        write(&folder.join(format!("{:06}.ply", view.index)), |out| {
            ply::write_cloud(out, &view.semantic_cloud(), taxonomy, &comments)
        })?;
    }
    Ok(())
}

/// Comments of every PLY: they do not depend on when or how fast it was made.
fn comments(record: &InspectionRecord) -> Vec<(String, String)> {
    let mut list = vec![
        ("generator".to_owned(), format!("semascan {}", record.software.version)),
        ("part".to_owned(), record.part.clone()),
        ("frame".to_owned(), "table, metres".to_owned()),
    ];
    list.extend(record.voxel.map(|v| ("voxel".to_owned(), v.to_string())));
    list
}

/// Writes a file under a temporary name and renames it when it is whole.
///
/// # Errors
/// [`StoreError`] naming the file; what stood there before then stays.
pub fn write(
    path: &Path,
    content: impl FnOnce(&mut BufWriter<File>) -> Result<(), WriteError>,
) -> Result<(), StoreError> {
    let io_error = |source| StoreError::Io { path: path.to_owned(), source };
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(".part");
    let temporary = path.with_file_name(name);
    let mut out = BufWriter::new(File::create(&temporary).map_err(io_error)?);
    let written = content(&mut out).map_err(|source| StoreError::Export { path: path.to_owned(), source });
    let flushed = written.and_then(|()| out.flush().map_err(io_error)).and_then(|()| {
        out.get_ref().sync_all().map_err(io_error)?;
        fs::rename(&temporary, path).map_err(io_error)
    });
    if flushed.is_err() {
        let _ = fs::remove_file(&temporary);
    }
    flushed
}
