//! `semascan plan DIR`: poses from which the findings and components of an inspection are seen closely: the second stage of an
//! adaptive inspection, for a robot that is driven by other programs.

use super::{Failure, config, numbers, source};
use crate::stderr::Stderr;
use crate::stdout::print_json;
use anyhow::{Context, anyhow};
use clap::Args;
use nalgebra::Point3;
use semascan_formats::ply::{self, PlyModel};
use semascan_formats::regular_file;
use semascan_inspection::planning::Viewpoint;
use semascan_inspection::record::pose_record;
use semascan_inspection::spec::InspectionSpec;
use semascan_model::SemanticMesh;
use semascan_model::record::{InspectionRecord, PoseRecord};
use semascan_perception::view::Intrinsics;
use semascan_planning::{Camera, Reach, RegionOutcome, TargetedPlan, defect_regions, look_closely, named_components};
use serde::Serialize;
use std::io::Write;
use std::path::PathBuf;

/// Arguments of `semascan plan`.
#[derive(Debug, Args)]
pub(crate) struct PlanCommandArgs {
    /// The inspection's folder
    folder: PathBuf,
    /// Also look at these components as a whole, separated by commas
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    component: Vec<String>,
    /// Millimetres of the surface that a pixel covers at most [default: 0.1]
    #[arg(long, value_name = "MM", value_parser = numbers::length::<f64>, allow_negative_numbers = true)]
    pixel: Option<f64>,
    /// Largest angle of incidence in degrees [default: 45]
    #[arg(long, value_name = "DEG", value_parser = numbers::length::<f64>, allow_negative_numbers = true)]
    incidence: Option<f64>,
    /// Pass over defects that are shorter, in millimetres [default: 5]
    #[arg(long, value_name = "MM", value_parser = numbers::length_or_zero::<f64>, allow_negative_numbers = true)]
    least: Option<f64>,
    /// Most views [default: 12]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1000))]
    views: Option<u32>,
    /// Columns and rows of the camera's pictures and its focal length in pixels [default: the camera of the inspection's source,
    /// where that can be steered]
    #[arg(long, value_name = "WxHxF", value_parser = pinhole)]
    camera: Option<Intrinsics>,
    /// Configuration of the cell, with its limits
    #[arg(long, value_name = "TOML")]
    config: Option<PathBuf>,
    /// Print the poses as one JSON object on stdout
    #[arg(long)]
    json: bool,
}

/// Two corners of a box in metres, table frame.
type Corners = (Point3<f64>, Point3<f64>);

/// The poses, for other programs. Metres, radians.
#[derive(Serialize)]
struct Printed {
    /// In the order in which they add most.
    views: Vec<PrintedView>,
    /// What is seen of each region; shares are of its area.
    regions: Vec<RegionOutcome>,
}

#[derive(Serialize)]
struct PrintedView {
    /// The camera in the frame that turns with the part.
    table_from_camera: PoseRecord,
    /// The camera in the static frame of the turntable.
    tablebase_from_camera: PoseRecord,
    /// How far the table is turned.
    table_angle: f64,
    /// What it shows.
    regions: Vec<String>,
    /// Surface that it shows and none before it did, square metres.
    area: f64,
}

/// Reads `WIDTHxHEIGHTxFOCAL`.
fn pinhole(text: &str) -> Result<Intrinsics, String> {
    let wrong = || format!("{text:?} is no camera such as 2448x2048x3100");
    let numbers: Vec<f64> = text.split('x').map(|n| n.parse().map_err(|_| wrong())).collect::<Result<_, _>>()?;
    let [width, height, focal] = numbers[..] else { return Err(wrong()) };
    let is_edge = |n: f64| (16.0..=65_536.0).contains(&n) && n.fract() == 0.0;
    if !is_edge(width) || !is_edge(height) || !(1.0..=1e6).contains(&focal) {
        return Err(wrong());
    }
    let (cx, cy) = (0.5 * (width - 1.0), 0.5 * (height - 1.0));
    Ok(Intrinsics { width: width as u32, height: height as u32, fx: focal, fy: focal, cx, cy })
}

impl PlanCommandArgs {
    pub(crate) fn run(self) -> Result<(), Failure> {
        let spec = config::read(self.config.as_deref()).map_err(Failure::Call)?.inspection;
        spec.plan.check().map_err(|error| Failure::Call(error.into()))?;
        let path = self.folder.join("inspection.json");
        let text = regular_file::read_to_string(&path).with_context(|| path.display().to_string())?;
        let record = InspectionRecord::from_json(&text).with_context(|| path.display().to_string())?;
        let path = self.folder.join("mesh.ply");
        let name = path.display().to_string();
        let bytes = regular_file::read(&path).with_context(|| name.clone())?;
        let PlyModel { mesh, taxonomy, .. } = ply::read(&name, &bytes)?;

        let (camera, volume) = self.camera_and_volume(&record, &spec, &mesh)?;
        let mut target = spec.plan.target.clone();
        target.pixel_mm = self.pixel.unwrap_or(target.pixel_mm);
        target.incidence_deg = self.incidence.unwrap_or(target.incidence_deg);
        target.least_mm = self.least.unwrap_or(target.least_mm);
        let mut regions = defect_regions(&mesh, &taxonomy, 1e-3 * target.least_mm);
        regions.extend(named_components(&mesh, &taxonomy, &self.component).map_err(|unknown| {
            let names: Vec<&str> = taxonomy.components.iter().skip(1).map(|class| class.name.as_str()).collect();
            Failure::Call(anyhow!("--component {unknown}: there are {}", names.join(", ")))
        })?);
        let reach = Reach::new(&spec.plan.reach, volume);
        let views = self.views.unwrap_or(spec.plan.refine_views);
        let surface = (mesh.vertices.positions.as_slice(), record.voxel.unwrap_or(1e-3));
        let plan = look_closely(&regions, surface, &Camera::new(camera, &target), &reach, views);
        print(&plan)?;
        if self.json {
            let view = |view: &semascan_planning::TargetedView| PrintedView {
                table_from_camera: pose_record(&Viewpoint::table_from_camera(&view.viewpoint)),
                tablebase_from_camera: pose_record(&view.viewpoint.tablebase_from_camera),
                table_angle: view.viewpoint.table_angle,
                regions: view.regions.iter().map(|i| regions[*i].name.clone()).collect(),
                area: view.area,
            };
            print_json(&Printed { views: plan.views.iter().map(view).collect(), regions: plan.regions.clone() })?;
        }
        Ok(())
    }

    /// The camera, and the measuring volume: those of the source where it can be opened and steered, else those of the
    /// argument and of the model.
    fn camera_and_volume(
        &self,
        record: &InspectionRecord,
        spec: &InspectionSpec,
        mesh: &SemanticMesh,
    ) -> Result<(Intrinsics, Corners), Failure> {
        let known = source::open(&record.source, spec).ok().and_then(|mut source| {
            let camera = source.steered()?.intrinsics();
            Some((camera, source.info().volume?))
        });
        let of_model = || {
            let labelled = |v: &usize| mesh.vertices.labels[*v] != 0;
            let points = (0..mesh.len()).filter(labelled).map(|v| mesh.vertices.positions[v].map(f64::from));
            points.fold(None, |corners: Option<([f64; 3], [f64; 3])>, p| {
                let (low, high) = corners.unwrap_or((p, p));
                Some(([0, 1, 2].map(|k| low[k].min(p[k])), [0, 1, 2].map(|k| high[k].max(p[k]))))
            })
        };
        match (self.camera, known) {
            (camera, Some((own, volume))) => Ok((camera.unwrap_or(own), volume)),
            (Some(camera), None) => {
                let (low, high) =
                    of_model().ok_or_else(|| anyhow!("{}: nothing is labelled", self.folder.display()))?;
                Ok((camera, (Point3::from(low), Point3::from(high))))
            }
            (None, None) => Err(Failure::Call(anyhow!(
                "{}: its camera is not known here: say it with --camera WIDTHxHEIGHTxFOCAL",
                record.source
            ))),
        }
    }
}

/// The poses and what they show, for people.
fn print(plan: &TargetedPlan) -> std::io::Result<()> {
    let mut out = Stderr::default();
    for (i, view) in plan.views.iter().enumerate() {
        let p = view.viewpoint.tablebase_from_camera.translation.vector * 1e3;
        writeln!(
            out,
            "view {:>2}: table at {:>5.1} deg, camera at {:>6.1} {:>6.1} {:>6.1} mm, {} regions, {:.0} mm2 new",
            i + 1,
            view.viewpoint.table_angle.to_degrees(),
            p.x,
            p.y,
            p.z,
            view.regions.len(),
            1e6 * view.area
        )?;
    }
    writeln!(
        out,
        "{:<28} {:>9} {:>7} {:>9} {:>10} {:>9} {:>10}",
        "region", "area mm2", "seen", "possible", "incidence", "finest mm", "needs f px"
    )?;
    for region in &plan.regions {
        let percent = |share: f64| format!("{:.0} %", 100.0 * share);
        let known = |value: Option<f64>, digits: usize| value.map_or_else(|| "-".into(), |v| format!("{v:.digits$}"));
        writeln!(
            out,
            "{:<28} {:>9.1} {:>7} {:>9} {:>10} {:>9} {:>10}",
            region.name,
            1e6 * region.area,
            percent(region.seen),
            percent(region.reachable),
            percent(region.within_incidence),
            known(region.finest_pixel.map(|pixel| 1e3 * pixel), 3),
            known(region.needed_focal, 0)
        )?;
    }
    Ok(())
}
