//! `semascan export DIR --format FORMAT`: the model of an inspection folder in other formats.

use super::{Failure, serve};
use anyhow::{Context, anyhow};
use clap::{Args, ValueEnum};
use semascan_formats::gltf::{self, GlbOptions};
use semascan_formats::ply::{self, PlyModel};
use semascan_formats::{ExportFilter, components, file_part, obj, stl};
use semascan_geometry::mesh::{MeshError, MeshOptions, decimate, fill_holes, mesh_cloud, simplify_points, smooth};
use semascan_model::{SemanticCloud, SemanticMesh};
use semascan_store::write_file;
use std::path::{Path, PathBuf};

/// What to write.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, ValueEnum)]
enum Format {
    /// The point cloud: cloud.ply
    Cloud,
    /// The mesh with all it knows: mesh.ply
    Ply,
    /// The mesh in groups and materials by component: mesh.obj, mesh.mtl
    Obj,
    /// The mesh as one binary solid by component: mesh-COMPONENT.stl
    Stl,
    /// The mesh as a scene with a node by component: mesh.glb
    Glb,
}

/// Arguments of `semascan export`.
#[derive(Debug, Args)]
pub(crate) struct ExportArgs {
    /// An inspection's folder, or a PLY file with points or a mesh
    source: PathBuf,
    /// What to write (several with commas)
    #[arg(long, value_enum, value_delimiter = ',', required = true)]
    format: Vec<Format>,
    /// Folder to write into [default: that of the source]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Contract points (for `cloud`) or edges, least quadric error first, until at most N points or triangles are left
    #[arg(long, value_name = "N")]
    simplify: Option<usize>,
    /// Rounds of smoothing that keep the mesh's size, outlines and rims
    #[arg(long, value_name = "ROUNDS", default_value_t = 0)]
    smooth: u32,
    /// Close holes whose rim is at most MM millimetres around; nothing is closed unasked
    #[arg(long, value_name = "MM", default_value_t = 0.0)]
    fill_holes: f32,
    /// Edge of the mesher's grid cells in voxels
    #[arg(long, value_name = "VOXELS", default_value_t = 1.0)]
    pitch: f32,
    /// Voxel edge of the cloud in millimetres, where its file does not note it
    #[arg(long, value_name = "MM")]
    voxel: Option<f32>,
    /// Threads to compute with; the result does not depend on it
    #[arg(long, value_name = "N")]
    threads: Option<usize>,
}

impl ExportArgs {
    pub(crate) fn run(self) -> Result<(), Failure> {
        serve::use_threads(self.threads)?;
        let (model, folder) = self.read()?;
        let out = self.out.clone().unwrap_or(folder);
        std::fs::create_dir_all(&out).with_context(|| format!("{}", out.display()))?;
        let mut formats = self.format.clone();
        formats.sort_unstable();
        formats.dedup();
        if formats.contains(&Format::Cloud) {
            self.write_cloud(&out, &model)?;
        }
        if formats.iter().any(|f| *f != Format::Cloud) {
            let mesh = self.mesh(&model)?;
            for format in formats {
                write_mesh(&out, format, &mesh, &model)?;
            }
        }
        Ok(())
    }

    /// The model and the folder it lies in.
    fn read(&self) -> Result<(PlyModel, PathBuf), Failure> {
        let is_folder = self.source.is_dir();
        let file = if is_folder { self.source.join("cloud.ply") } else { self.source.clone() };
        let folder = file.parent().unwrap_or(Path::new(".")).to_owned();
        let bytes = std::fs::read(&file).with_context(|| format!("{}", file.display()))?;
        let model = ply::read(&file.display().to_string(), &bytes)?;
        for warning in &model.warnings {
            tracing::warn!("{}: {warning}", file.display());
        }
        Ok((model, folder))
    }

    fn voxel(&self, model: &PlyModel) -> Result<f32, Failure> {
        let noted = self.voxel.map(|mm| mm * 1e-3).or_else(|| model.voxel());
        noted.ok_or_else(|| Failure::Call(anyhow!("the cloud does not note its voxel edge: name it with --voxel MM")))
    }

    fn write_cloud(&self, out: &Path, model: &PlyModel) -> Result<(), Failure> {
        let keep = |c: &SemanticCloud| ExportFilter::of_the_part().apply(c);
        let cloud = match self.simplify {
            // What is no part of the model would only cost others their points.
            Some(n) => simplify_points(&keep(&model.mesh.vertices), self.voxel(model)?, n, &()).map_err(call)?,
            None => model.mesh.vertices.clone(),
        };
        let path = out.join("cloud.ply");
        if path.exists() && path.canonicalize().ok() == self.source.join("cloud.ply").canonicalize().ok() {
            return Err(Failure::Call(anyhow!(
                "{}: would overwrite its source; name a folder with --out",
                path.display()
            )));
        }
        write_file(&path, |file| ply::write_cloud_at(file, &cloud, model.shift, &model.taxonomy, &model.comments))?;
        log_written(&path, cloud.len(), "points");
        Ok(())
    }

    fn mesh(&self, model: &PlyModel) -> Result<SemanticMesh, Failure> {
        let mut mesh = if model.mesh.triangles.is_empty() {
            let options = MeshOptions { pitch: self.pitch, radius: 2.0 * self.pitch, ..MeshOptions::default() };
            mesh_cloud(&model.mesh.vertices, self.voxel(model)?, &options, &()).map_err(call)?
        } else {
            model.mesh.clone()
        };
        if self.fill_holes > 0.0 {
            let filled = fill_holes(&mut mesh, self.fill_holes * 1e-3);
            tracing::info!("closed {filled} holes; their middles have no confidence");
        }
        smooth(&mut mesh, self.smooth);
        if let Some(triangles) = self.simplify {
            mesh = decimate(&mesh, triangles, &()).map_err(call)?;
        }
        Ok(mesh)
    }
}

fn write_mesh(out: &Path, format: Format, mesh: &SemanticMesh, model: &PlyModel) -> Result<(), Failure> {
    let taxonomy = &model.taxonomy;
    let file = |name: &str| out.join(name);
    if matches!(format, Format::Stl | Format::Glb) && model.shift != [0.0; 3] {
        let [x, y, z] = model.shift;
        tracing::warn!("{format:?} holds single precision only: its origin lies at {x} {y} {z} of the source");
    }
    match format {
        Format::Cloud => {}
        Format::Ply => {
            let path = file("mesh.ply");
            write_file(&path, |file| ply::write_semantic_mesh_at(file, mesh, model.shift, taxonomy, &model.comments))?;
            log_written(&path, mesh.triangles.len(), "triangles");
        }
        Format::Obj => {
            let path = file("mesh.obj");
            write_file(&path, |file| obj::write_mesh_at(file, mesh, model.shift, taxonomy, "mesh.mtl"))?;
            write_file(&file("mesh.mtl"), |file| obj::write_materials(file, mesh, taxonomy))?;
            log_written(&path, mesh.triangles.len(), "triangles");
        }
        Format::Stl => {
            for component in components(mesh, taxonomy)? {
                let path = file(&format!("mesh-{}.stl", file_part(&component.name)));
                write_file(&path, |file| stl::write_mesh(file, mesh, Some(component.label), &component.name))?;
                log_written(&path, component.triangles.len(), "triangles");
            }
        }
        Format::Glb => {
            let path = file("mesh.glb");
            let part = model.comment("part").unwrap_or("part").to_owned();
            let options = GlbOptions { part, voxel: model.voxel().unwrap_or(0.0) };
            write_file(&path, |file| gltf::write_mesh(file, mesh, taxonomy, &options))?;
            log_written(&path, mesh.triangles.len(), "triangles");
        }
    }
    Ok(())
}

fn log_written(path: &Path, count: usize, what: &str) {
    tracing::info!("{}: {count} {what}", path.display());
}

/// A setting out of range is the caller's fault.
fn call(error: MeshError) -> Failure {
    Failure::Call(error.into())
}
