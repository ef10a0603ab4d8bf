//! `semascan export DIR --format FORMAT`: the model of an inspection folder in other formats.

use super::export_texture::{TextureArgs, Textured};
use super::{Failure, numbers, serve};
use anyhow::{Context, anyhow};
use clap::{Args, ValueEnum};
use semascan_formats::gltf::{self, GlbOptions, SceneColors};
use semascan_formats::ply::{self, PlyModel};
use semascan_formats::{ExportFilter, FileFrame, UpAxis, components, file_part, obj, regular_file, stl};
use semascan_geometry::measure::model_figures;
use semascan_geometry::mesh::{MeshError, MeshOptions, decimate, fill_holes, mesh_cloud, simplify_points, smooth};
use semascan_model::LengthUnit;
use semascan_model::finding::Finding;
use semascan_model::record::InspectionRecord;
use semascan_model::{ModelFigures, PointFlags, SemanticCloud, SemanticMesh};
use semascan_store::{ExportFolder, check_beside_record, check_folder};
use std::io::Write;
use std::path::{Path, PathBuf};

/// What to write.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, ValueEnum)]
enum Format {
    /// The point cloud: cloud.ply
    Cloud,
    /// The mesh with all it knows: mesh.ply
    Ply,
    /// The mesh in objects and materials by component: mesh.obj, mesh.mtl
    Obj,
    /// The mesh as one binary solid by component: mesh-COMPONENT.stl
    Stl,
    /// The mesh as a scene with a node by component: mesh.glb
    Glb,
}

/// What the numbers of OBJ and STL files are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum ExportUnit {
    /// Millimetres
    Mm,
    /// Metres
    M,
    /// Inches of 25.4 mm
    Inch,
}

/// The axis of OBJ and STL files that points upwards.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Up {
    /// As CAD programs have it
    Z,
    /// As programs for pictures and games have it
    Y,
}

/// Which colours a GLB shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Colors {
    /// The surface's own
    Surface,
    /// Those of the component classes
    Classes,
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
    #[arg(long, value_name = "N", value_parser = numbers::count(), allow_negative_numbers = true)]
    simplify: Option<usize>,
    /// Rounds of smoothing that keep the mesh's size, outlines and rims
    #[arg(long, value_name = "ROUNDS", default_value_t = 0, value_parser = clap::value_parser!(u32).range(0..=1000))]
    smooth: u32,
    /// Close holes whose rim is at most MM millimetres around; nothing is closed unasked
    #[arg(
        long, value_name = "MM", default_value_t = 0.0,
        value_parser = numbers::length_or_zero::<f32>, allow_negative_numbers = true
    )]
    fill_holes: f32,
    /// Edge of the mesher's grid cells in voxels
    #[arg(
        long, value_name = "VOXELS", default_value_t = 1.0,
        value_parser = numbers::pitch, allow_negative_numbers = true
    )]
    pitch: f32,
    /// Voxel edge of the cloud in millimetres, where its file does not note it
    #[arg(long, value_name = "MM", value_parser = numbers::length::<f32>, allow_negative_numbers = true)]
    voxel: Option<f32>,
    /// Unit of OBJ and STL files [default: mm]. PLY and GLB are in metres, which they say
    #[arg(long, value_enum)]
    unit: Option<ExportUnit>,
    /// Upward axis of OBJ and STL files [default: z]
    #[arg(long, value_enum)]
    up: Option<Up>,
    /// Colours of a GLB; what each vertex belongs to is in the file in either case
    #[arg(long, value_enum, default_value = "surface")]
    colors: Colors,
    #[command(flatten)]
    texture: TextureArgs,
    /// Include the background, which lies outside of the measuring volume
    #[arg(long)]
    background: bool,
    /// Threads to compute with; the result does not depend on it
    #[arg(long, value_name = "N", value_parser = numbers::threads(), allow_negative_numbers = true)]
    threads: Option<usize>,
}

impl ExportArgs {
    pub(crate) fn run(self) -> Result<(), Failure> {
        serve::use_threads(self.threads)?;
        let nameless = self.format.iter().any(|format| matches!(format, Format::Obj | Format::Stl));
        if !nameless && (self.unit.is_some() || self.up.is_some()) {
            let reason = "--unit and --up are for obj and stl: PLY is in metres with z up, GLB in metres with y up";
            return Err(Failure::Call(anyhow!(reason)));
        }
        self.check_texture()?;
        let file = if self.source.is_dir() { self.source.join("cloud.ply") } else { self.source.clone() };
        let folder = file.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let out = ExportFolder::begin(self.out.as_deref().unwrap_or(folder), &file)?;
        self.check_places(&out)?;
        if self.source.is_dir() {
            check_folder(&self.source)?;
        }
        let photographs = self.texture.photographs(&self.source)?;
        let model = read(&file)?;
        let mut formats = self.format.clone();
        formats.sort_unstable();
        formats.dedup();
        if formats.contains(&Format::Cloud) {
            self.write_cloud(&out, &model)?;
        }
        if formats.iter().any(|f| *f != Format::Cloud) {
            let Surface { mesh, figures } = self.surface(&model)?;
            let textured = photographs.map(|photographs| self.texture.of(&mesh, &model, photographs)).transpose()?;
            for format in formats {
                match &textured {
                    None => self.write_mesh(&out, format, &mesh, &figures, &model)?,
                    Some(textured) => self.write_textured(&out, format, textured, &figures, &model)?,
                }
            }
        }
        Ok(())
    }

    /// Refuses a texture in formats that cannot have one, and under other colours.
    fn check_texture(&self) -> Result<(), Failure> {
        if self.texture.texture && !self.format.iter().all(|format| matches!(format, Format::Obj | Format::Glb)) {
            return Err(Failure::Call(anyhow!("--texture is for glb and obj: no other format can have a picture")));
        }
        if self.texture.texture && self.colors == Colors::Classes {
            return Err(Failure::Call(anyhow!("--texture shows the surface: it does not go with --colors classes")));
        }
        Ok(())
    }

    /// What cannot be written is said before anything is computed.
    fn check_places(&self, out: &ExportFolder) -> Result<(), Failure> {
        for format in &self.format {
            match format {
                Format::Cloud => drop(out.place("cloud.ply")?),
                Format::Ply => drop(out.place("mesh.ply")?),
                Format::Obj | Format::Stl | Format::Glb => {}
            }
        }
        Ok(())
    }

    fn voxel(&self, model: &PlyModel) -> Result<f32, Failure> {
        let noted = self.voxel.map(|mm| mm * 1e-3).or_else(|| model.voxel());
        noted.ok_or_else(|| Failure::Call(anyhow!("the cloud does not note its voxel edge: name it with --voxel MM")))
    }

    fn write_cloud(&self, out: &ExportFolder, model: &PlyModel) -> Result<(), Failure> {
        let (points, filter) = (&model.mesh.vertices, self.filter());
        let kept = filter.apply(points);
        let cloud = match self.simplify {
            Some(n) => simplify_points(&kept, self.voxel(model)?, n, &()).map_err(call)?,
            None => kept.clone(),
        };
        let path = out.write("cloud.ply", |file| {
            ply::write_cloud_at(file, &cloud, model.shift, &model.taxonomy, &model.comments)
        })?;
        log_written(&path, cloud.len(), "points");
        let simplified = match self.simplify {
            Some(_) => format!("; the other {} simplified to {}", kept.len(), cloud.len()),
            None => String::new(),
        };
        self.log_left_out(&format!("  of {} points", points.len()), points, &simplified);
        Ok(())
    }

    /// What an export holds of a model's points.
    fn filter(&self) -> ExportFilter {
        let mut filter = ExportFilter::of_the_part();
        if self.background {
            filter.skip_flags &= !PointFlags::BACKGROUND;
        }
        filter
    }

    /// Says what of `points` is left out, and how to have it.
    fn log_left_out(&self, of: &str, points: &SemanticCloud, more: &str) {
        let left_out = self.filter().left_out(points);
        let way = if left_out.background > 0 { " (--background includes the background)" } else { "" };
        tracing::info!("{of}: left out {left_out}{way}{more}");
    }

    /// The mesh of a file without the triangles at points that are left out.
    fn selected(&self, mesh: &SemanticMesh) -> SemanticMesh {
        let filter = self.filter();
        let keep = |v: u32| mesh.vertices.flags.get(v as usize).is_none_or(|flags| !flags.has(filter.skip_flags));
        mesh.select(|triangle| triangle.into_iter().all(keep))
    }

    /// The mesh as it is to be written, and the figures of the model. These are measured on the mesh that an inspection
    /// makes, whatever is done to the one that is written: so they are those of the inspection's record.
    fn surface(&self, model: &PlyModel) -> Result<Surface, Failure> {
        let points = &model.mesh.vertices;
        let (mut mesh, figures) = if model.mesh.triangles.is_empty() {
            let voxel = self.voxel(model)?;
            let made = |options: &MeshOptions| mesh_cloud(points, voxel, options, &()).map_err(call);
            let measured = made(&MeshOptions::default())?;
            let figures = model_figures(points, &measured, voxel);
            let (all, kept) = (points.len(), points.len() - self.filter().left_out(points).total());
            self.log_left_out(&format!("a mesh of {kept} of the model's {all} points"), points, "");
            let options = MeshOptions { pitch: self.pitch, radius: 2.0 * self.pitch, ..MeshOptions::default() };
            if self.background {
                // The mesher passes over what is marked.
                let mut unmarked = points.clone();
                unmarked.flags.iter_mut().for_each(|flags| flags.0 &= !PointFlags::BACKGROUND);
                (mesh_cloud(&unmarked, voxel, &options, &()).map_err(call)?, figures)
            } else {
                (if options == MeshOptions::default() { measured } else { made(&options)? }, figures)
            }
        } else {
            // A file with a mesh alone: its vertices are all the points there are.
            let voxel = self.voxel.map(|mm| mm * 1e-3).or_else(|| model.voxel());
            self.log_left_out(&format!("of the {} vertices", points.len()), points, "");
            (self.selected(&model.mesh), model_figures(points, &model.mesh, voxel.unwrap_or(0.0)))
        };
        if self.fill_holes > 0.0 {
            let filled = fill_holes(&mut mesh, self.fill_holes * 1e-3);
            tracing::info!("closed {filled} holes; their middles have no confidence");
        }
        smooth(&mut mesh, self.smooth);
        if let Some(triangles) = self.simplify {
            let before = mesh.triangles.len();
            mesh = decimate(&mesh, triangles, &()).map_err(call)?;
            if mesh.triangles.len() > triangles {
                tracing::warn!(
                    "of {before} triangles {} are left and not {triangles}: to contract more edges would close openings, \
                     fold the surface or join parts",
                    mesh.triangles.len()
                );
            }
        }
        Ok(Surface { mesh, figures })
    }

    /// Unit and upward axis of formats that name neither.
    fn frame(&self) -> FileFrame {
        let default = FileFrame::default();
        FileFrame {
            unit: self.unit.map_or(default.unit, |unit| match unit {
                ExportUnit::Mm => LengthUnit::Millimetres,
                ExportUnit::M => LengthUnit::Metres,
                ExportUnit::Inch => LengthUnit::Inches,
            }),
            up: self.up.map_or(default.up, |up| match up {
                Up::Z => UpAxis::Z,
                Up::Y => UpAxis::Y,
            }),
        }
    }

    fn write_mesh(
        &self,
        out: &ExportFolder,
        format: Format,
        mesh: &SemanticMesh,
        figures: &ModelFigures,
        model: &PlyModel,
    ) -> Result<(), Failure> {
        let (taxonomy, frame) = (&model.taxonomy, self.frame());
        if matches!(format, Format::Stl | Format::Glb) && model.shift != [0.0; 3] {
            let [x, y, z] = model.shift;
            let name = if format == Format::Stl { "STL" } else { "GLB" };
            tracing::warn!(
                "{name} holds single precision only: its origin lies at {x} {y} {z} m of the source, as the file notes"
            );
        }
        match format {
            Format::Cloud => {}
            Format::Ply => {
                let path = out.write("mesh.ply", |file| {
                    ply::write_semantic_mesh_at(file, mesh, model.shift, taxonomy, &model.comments)
                })?;
                log_written(&path, mesh.triangles.len(), "triangles");
            }
            Format::Obj => {
                // What the geometry names is there before it is.
                out.write("mesh.mtl", |file| obj::write_materials(file, mesh, taxonomy))?;
                let path = out.write("mesh.obj", |file| {
                    obj::write_mesh_at(file, mesh, model.shift, taxonomy, "mesh.mtl", frame)
                })?;
                log_written(&path, mesh.triangles.len(), &format!("triangles, {}", frame.name()));
            }
            Format::Stl => {
                for component in components(mesh, taxonomy)? {
                    let name = format!("mesh-{}.stl", file_part(&component.name));
                    let path = out.write(&name, |file| {
                        stl::write_mesh_at(file, mesh, model.shift, Some(component.label), &component.name, frame)
                    })?;
                    log_written(&path, component.triangles.len(), &format!("triangles, {}", frame.name()));
                }
            }
            Format::Glb => {
                let options = self.scene(figures, model);
                let path = out.write("mesh.glb", |file| gltf::write_mesh(file, mesh, taxonomy, &options))?;
                log_written(&path, mesh.triangles.len(), "triangles");
            }
        }
        Ok(())
    }

    fn write_textured(
        &self,
        out: &ExportFolder,
        format: Format,
        textured: &Textured,
        figures: &ModelFigures,
        model: &PlyModel,
    ) -> Result<(), Failure> {
        let (mesh, picture, taxonomy) = (&textured.made.mesh, textured.picture(), &model.taxonomy);
        let path = match format {
            Format::Obj => {
                // What the geometry names is there before it is.
                out.write("mesh.png", |file| Ok(file.write_all(&textured.png)?))?;
                out.write("mesh.mtl", |file| {
                    obj::write_textured_materials(file, mesh, &picture, taxonomy, "mesh.png")
                })?;
                out.write("mesh.obj", |file| {
                    obj::write_textured_mesh_at(file, mesh, &picture, model.shift, taxonomy, "mesh.mtl", self.frame())
                })?
            }
            Format::Glb => {
                let options = self.scene(figures, model);
                out.write("mesh.glb", |file| gltf::write_textured_mesh(file, mesh, &picture, taxonomy, &options))?
            }
            // These cannot have a picture, which was refused.
            Format::Cloud | Format::Ply | Format::Stl => return Ok(()),
        };
        log_written(&path, mesh.triangles.len(), "triangles with a texture");
        Ok(())
    }

    /// What a scene says beside its geometry.
    fn scene(&self, figures: &ModelFigures, model: &PlyModel) -> GlbOptions {
        GlbOptions {
            part: model.comment("part").unwrap_or("part").to_owned(),
            figures: figures.clone(),
            findings: self.findings(),
            generation: model.comment("generation").map(str::to_owned),
            colors: match self.colors {
                Colors::Surface => SceneColors::Surface,
                Colors::Classes => SceneColors::Classes,
            },
            shift: model.shift,
        }
    }

    /// The findings of the inspection that is exported; none where a file alone is.
    fn findings(&self) -> Vec<Finding> {
        let text = regular_file::read_to_string(&self.source.join("inspection.json")).unwrap_or_default();
        let record = InspectionRecord::from_json(&text).ok();
        record.and_then(|record| record.findings).map_or_else(Vec::new, |findings| findings.list)
    }
}

/// Reads the model in `file`.
fn read(file: &Path) -> Result<PlyModel, Failure> {
    check_beside_record(file)?;
    let bytes = regular_file::read(file).with_context(|| format!("{}", file.display()))?;
    let model = ply::read(&file.display().to_string(), &bytes)?;
    for warning in &model.warnings {
        tracing::warn!("{}: {warning}", file.display());
    }
    Ok(model)
}

/// A mesh to write, and the figures of the model that it shows.
struct Surface {
    mesh: SemanticMesh,
    figures: ModelFigures,
}

fn log_written(path: &Path, count: usize, what: &str) {
    tracing::info!("{}: {count} {what}", path.display());
}

/// A setting out of range is the caller's fault.
fn call(error: MeshError) -> Failure {
    Failure::Call(error.into())
}
