//! `semascan tables P0|P1|P2|findings|labels|measure|planning|teach|texture`: reruns a paper's tables on the virtual cell, judges findings,
//! measurements, labels that were corrected on the model, networks before and after they were trained on such labels, or textures. P0 is [Remanufacturing paper], P1
//! [Eye-in-hand 2020], P2 [Wang 2023].

use super::dataset::{DatasetWriter, Format};
use super::{Failure, numbers};
use crate::stderr::Stderr;
use crate::stdout::print_pretty_json;
use anyhow::{Context, anyhow};
use clap::{Args, ValueEnum};
use indicatif::{ProgressBar, ProgressStyle};
use nalgebra::Isometry3;
use semascan_evaluation::tables::{NetworkSetting, findings, labels, measure, p0, p1, p2, planning, teach, texture};
use semascan_evaluation::{TestDomain, TestViews};
use semascan_formats::regular_file;
use semascan_labelling::ViewMasks;
use semascan_model::Taxonomy;
use semascan_model::record::LabelSource;
use semascan_perception::view::View;
use semascan_simulation::VirtualCellSpec;
use semascan_store::{DATASET_KIND, DatasetFolder, MANIFEST, check_place, write_file};
use serde::Serialize;
use std::io::Write;
use std::path::{Path, PathBuf};

/// The papers whose tables can be rerun.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Paper {
    /// Semantic 3D product modelling for automated inspection in remanufacturing processes: Tables 1, 3, 5 and 6
    #[value(name = "P0", alias = "p0")]
    P0,
    /// Semantic 3D reconstruction for robotic manipulators with an eye-in-hand vision system: Tables 1 to 5
    #[value(name = "P1", alias = "p1")]
    P1,
    /// Keyframe image processing of semantic 3D point clouds based on deep learning: Tables 2 to 4
    #[value(name = "P2", alias = "p2")]
    P2,
    /// No paper's: findings of unseen motors against truth, and how many of the stated intervals hold it
    Findings,
    /// No paper's: labels corrected once on the model and projected into every view, against true masks
    Labels,
    /// No paper's: distances, radii and angles on models of unseen motors against truth, and how many of the stated intervals hold it
    Measure,
    /// No paper's: planned views against truth: how much of the reachable surface so many views see, and the close looks of the second
    /// stage
    Planning,
    /// No paper's: a network before and after it was trained on such labels, in the shifted world and in its own
    Teach,
    /// No paper's: textures of the photographs and colours of vertices, against pictures from elsewhere
    Texture,
}

/// Arguments of `semascan tables`.
#[derive(Debug, Args)]
pub(crate) struct TablesArgs {
    /// The paper: P0 is on modelling used parts, P1 on a camera in the robot's hand, P2 on keyframes (`--help` has the titles)
    #[arg(value_enum)]
    paper: Paper,
    /// Only these tables, separated by commas: P0 has 1, 3, 5, 6; P1 has 1 to 5; P2 has 2, 3, 4
    #[arg(long = "table", value_name = "N", value_delimiter = ',')]
    tables: Vec<u32>,
    /// Simulated motors [default: 4 in P0's Table 1, else 10]; in P1's Tables 3 to 5: runs of each object [default: 10]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=1000))]
    seeds: Option<u64>,
    /// Views of each [default: 5, in P1's Tables 3 to 5: 12; P1 itself took 16]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=360))]
    views: Option<u32>,
    /// For findings, labels, measure, planning, teach and texture: seed of the first motor [default: 1001, for teach 3001]
    #[arg(long, value_name = "SEED")]
    first_seed: Option<u64>,
    /// For findings, labels, measure, planning, teach and texture: columns and rows of the pictures [default: 960x720 for findings,
    /// measure and texture, 320x240 for planning, else 640x480]
    #[arg(long, value_name = "WxH", value_parser = size)]
    size: Option<(u32, u32)>,
    /// For findings, labels and planning: where labels come from, source or network [default: source, for labels network]
    #[arg(long, value_name = "FROM", value_parser = label_source)]
    labels: Option<LabelSource>,
    /// For labels: the world that motors are seen in
    #[arg(long, value_enum, value_name = "WORLD")]
    domain: Option<World>,
    /// For labels: voxel edge in millimetres [default: that of an inspection, twice the median pixel footprint]
    #[arg(long, value_name = "MM", value_parser = numbers::length::<f64>, allow_negative_numbers = true)]
    voxel: Option<f64>,
    /// For labels: write the masks as a data set into this folder, which agent/training reads
    #[arg(long, value_name = "DIR")]
    masks: Option<PathBuf>,
    /// For texture: write pictures of what is compared into this folder
    #[arg(long, value_name = "DIR")]
    pictures: Option<PathBuf>,
    /// For teach: the network before [default: ud-net-edge]
    #[arg(long, value_name = "MODEL")]
    before: Option<PathBuf>,
    /// For teach: the network after
    #[arg(long, value_name = "MODEL")]
    after: Option<PathBuf>,
    /// In P1's Tables 3 to 5: only objects whose name contains this
    #[arg(long, value_name = "NAME")]
    only: Option<String>,
    /// For P1: folder with the YCB meshes (lemon/textured.obj ...) [default: objects/ycb in SEMASCAN_DATA]
    #[arg(long, value_name = "DIR")]
    ycb: Option<PathBuf>,
    /// Folder of models [default: where an inspection looks for them]
    #[arg(long, value_name = "DIR")]
    models: Option<PathBuf>,
    /// For P0: largest standard uncertainty of a label, 0 to 1 [default: chosen on validation motors]
    #[arg(long, value_name = "T", value_parser = numbers::threshold, allow_negative_numbers = true)]
    sigma: Option<f32>,
    /// Few and small pictures, to see that all works; the figures say nothing
    #[arg(long)]
    quick: bool,
    /// Also write the JSON report into this file
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Print the report as one JSON object on stdout
    #[arg(long)]
    json: bool,
}

/// A world of the virtual cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum World {
    /// As it is
    Standard,
    /// A camera, lights and noise that no training data have
    Shifted,
}

fn size(value: &str) -> Result<(u32, u32), String> {
    VirtualCellSpec::parse_size(value).ok_or_else(|| format!("{value:?} is no size such as 640x480"))
}

fn label_source(value: &str) -> Result<LabelSource, String> {
    match value {
        "source" => Ok(LabelSource::Source),
        "network" => Ok(LabelSource::Network),
        _ => Err(format!("{value:?}: there are source, network")),
    }
}

/// The tables of [Eye-in-hand 2020] together.
#[derive(Serialize)]
struct P1Report {
    /// Tables 3 to 5.
    #[serde(flatten)]
    reconstruction: Option<p1::ReconstructionTables>,
    /// Tables 1 and 2.
    #[serde(skip_serializing_if = "Option::is_none")]
    masks: Option<p1::masks::MaskTables>,
}

impl TablesArgs {
    pub(crate) fn run(self, quiet: bool) -> Result<(), Failure> {
        // What cannot be written is said before anything is computed.
        self.out.as_deref().map(check_place).transpose()?;
        if self.paper != Paper::Labels && (self.domain.is_some() || self.masks.is_some()) {
            return Err(Failure::Call(anyhow!("--domain and --masks belong to labels")));
        }
        if self.paper != Paper::Teach && (self.before.is_some() || self.after.is_some()) {
            return Err(Failure::Call(anyhow!("--before and --after belong to teach")));
        }
        if self.paper != Paper::Texture && self.pictures.is_some() {
            return Err(Failure::Call(anyhow!("--pictures belongs to texture")));
        }
        match self.paper {
            Paper::P0 => self.p0(quiet),
            Paper::P1 => self.p1(quiet),
            Paper::P2 => self.p2(quiet),
            Paper::Findings => self.findings(quiet),
            Paper::Labels => self.labels(quiet),
            Paper::Measure => self.measure(quiet),
            Paper::Planning => self.planning(quiet),
            Paper::Teach => self.teach(quiet),
            Paper::Texture => self.texture(quiet),
        }
    }

    /// The tables that were asked for, of those there are.
    fn tables(&self, all: &[u32]) -> Result<Vec<u32>, Failure> {
        if let Some(none) = self.tables.iter().find(|t| !all.contains(t)) {
            let names: Vec<String> = all.iter().map(u32::to_string).collect();
            return Err(Failure::Call(anyhow!("--table {none}: there are {}", names.join(", "))));
        }
        Ok(if self.tables.is_empty() { all.to_vec() } else { self.tables.clone() })
    }

    /// Refuses what belongs to the tables of [Eye-in-hand 2020].
    fn not_p1(&self) -> Result<(), Failure> {
        if self.only.is_some() || self.ycb.is_some() {
            return Err(Failure::Call(anyhow!("--only and --ycb belong to P1")));
        }
        Ok(())
    }

    fn networks(&self) -> Result<NetworkSetting, Failure> {
        if let Some(folder) = &self.models {
            regular_file::check_folder(folder).with_context(|| format!("--models {}", folder.display()))?;
        }
        let mut setting = if self.quick { NetworkSetting::quick() } else { NetworkSetting::default() };
        setting.test.views = self.views.unwrap_or(setting.test.views);
        if let Some(motors) = self.seeds {
            setting.test.motors = (1..=motors).map(|k| 1000 + k).collect();
        }
        Ok(NetworkSetting { models: self.models.clone(), sigma: self.sigma, ..setting })
    }

    fn p0(self, quiet: bool) -> Result<(), Failure> {
        self.not_p1()?;
        let mut reference_models = p0::reference_models::Config::default();
        if self.quick {
            reference_models.motors.truncate(1);
            (reference_models.size, reference_models.reference_points) = ((240, 180), 40_000);
        }
        reference_models.views = self.views.unwrap_or(reference_models.views);
        if let Some(motors) = self.seeds {
            reference_models.motors = (1..=motors).map(|k| 100 + k).collect();
        }
        let config = p0::Config { tables: self.tables(&p0::TABLES)?, reference_models, networks: self.networks()? };
        let report = watched(quiet, |on_step| p0::run(&config, on_step))?;
        p0::print(&mut Stderr::default(), &report)?;
        self.write(&report)
    }

    fn p1(self, quiet: bool) -> Result<(), Failure> {
        let tables = self.tables(&[1, 2, 3, 4, 5])?;
        let wants = |these: &[u32]| tables.iter().any(|t| these.contains(t));
        // Networks know components of motors alone; one object of the others needs none of them.
        let masks = if wants(&[1, 2]) && self.only.is_none() {
            let networks = self.networks()?;
            let masks = watched(quiet, |on_step| p1::masks::run(&networks, on_step))?;
            p1::masks::print(&mut Stderr::default(), &masks)?;
            Some(masks)
        } else {
            None
        };
        let reconstruction = if wants(&[3, 4, 5]) { Some(self.reconstruction(quiet)?) } else { None };
        self.write(&P1Report { reconstruction, masks })
    }

    /// [Eye-in-hand 2020], Tables 3 to 5.
    fn reconstruction(&self, quiet: bool) -> Result<p1::ReconstructionTables, Failure> {
        let in_data = || Some(PathBuf::from(std::env::var_os("SEMASCAN_DATA")?).join("objects/ycb"));
        let ycb = self.ycb.clone().or_else(|| in_data().filter(|folder| folder.is_dir()));
        match &ycb {
            None => tracing::warn!("no YCB meshes: name their folder with --ycb; those objects are left out"),
            Some(folder) => {
                regular_file::check_folder(folder).with_context(|| format!("--ycb {}", folder.display()))?
            }
        }
        let config = p1::Config {
            seeds: self.seeds.unwrap_or(if self.quick { 1 } else { 10 }),
            views: self.views.unwrap_or(if self.quick { 3 } else { 12 }),
            setting: p1::Setting::P1,
            ycb,
            only: self.only.clone(),
            workers: std::thread::available_parallelism().map_or(1, usize::from),
        };
        let result = watched(quiet, |on_step| p1::run(&config, on_step));
        let report = result.map_err(|error| match error {
            p1::TableError::NoObject { .. } => Failure::Call(error.into()),
            error => Failure::Work(error.into()),
        })?;
        p1::print(&report, &mut Stderr::default())?;
        Ok(report)
    }

    fn p2(self, quiet: bool) -> Result<(), Failure> {
        self.not_p1()?;
        let config = p2::Config { tables: self.tables(&p2::TABLES)?, networks: self.networks()? };
        let report = watched(quiet, |on_step| p2::run(&config, on_step))?;
        p2::print(&mut Stderr::default(), &report)?;
        self.write(&report)
    }

    /// Findings against truth.
    fn findings(self, quiet: bool) -> Result<(), Failure> {
        self.not_p1()?;
        if !self.tables.is_empty() || self.models.is_some() || self.sigma.is_some() {
            return Err(Failure::Call(anyhow!("--table, --models and --sigma belong to the papers")));
        }
        let mut config = findings::Config { labels: self.labels.unwrap_or_default(), ..Default::default() };
        self.choose(4, &mut config.motors, &mut config.views, &mut config.size);
        let report = watched(quiet, |on_step| findings::run(&config, on_step))?;
        findings::print(&mut Stderr::default(), &report)?;
        self.write(&report)
    }

    /// Measurements against truth.
    fn measure(self, quiet: bool) -> Result<(), Failure> {
        self.not_p1()?;
        if !self.tables.is_empty() || self.models.is_some() || self.sigma.is_some() || self.labels.is_some() {
            return Err(Failure::Call(anyhow!("--table, --models, --sigma and --labels do not belong to measure")));
        }
        let mut config = measure::Config::default();
        self.choose(4, &mut config.motors, &mut config.views, &mut config.size);
        let report = watched(quiet, |on_step| measure::run(&config, on_step))?;
        measure::print(&mut Stderr::default(), &report)?;
        self.write(&report)
    }

    /// Corrected labels against true masks.
    fn labels(self, quiet: bool) -> Result<(), Failure> {
        self.not_p1()?;
        if !self.tables.is_empty() || self.models.is_some() || self.sigma.is_some() {
            return Err(Failure::Call(anyhow!("--table, --models and --sigma belong to the papers")));
        }
        let mut config = labels::Config::default();
        config.labels = self.labels.unwrap_or(config.labels);
        config.voxel_mm = self.voxel;
        self.choose(4, &mut config.motors, &mut config.views, &mut config.size);
        if self.domain == Some(World::Shifted) {
            config.domain = TestDomain::Shifted;
        }
        let mut set = self.masks.as_deref().map(MaskSet::begin).transpose()?;
        let mut keep = |view: &labels::MaskedView<'_>| match &mut set {
            Some(set) => set.add(view),
            None => Ok(()),
        };
        let report = watched(quiet, |on_step| labels::run(&config, on_step, &mut keep))?;
        set.map(|set| set.publish(&config)).transpose()?;
        labels::print(&mut Stderr::default(), &report)?;
        self.write(&report)
    }

    /// Planned views against truth.
    fn planning(self, quiet: bool) -> Result<(), Failure> {
        self.not_p1()?;
        if !self.tables.is_empty() || self.models.is_some() || self.sigma.is_some() {
            return Err(Failure::Call(anyhow!("--table, --models and --sigma belong to the papers")));
        }
        let mut config = planning::Config { labels: self.labels.unwrap_or_default(), ..Default::default() };
        self.choose(4, &mut config.motors, &mut config.views, &mut config.size);
        config.compared = config.compared.min(config.views);
        if !self.quick {
            config.data = std::env::var_os("SEMASCAN_DATA").map(PathBuf::from).filter(|folder| folder.is_dir());
            if config.data.is_none() {
                tracing::warn!("SEMASCAN_DATA names no folder: the meshes of others are left out");
            }
        }
        let report = watched(quiet, |on_step| planning::run(&config, on_step))?;
        planning::print(&mut Stderr::default(), &report)?;
        self.write(&report)
    }

    /// A network before and after it was trained on corrected labels.
    fn teach(self, quiet: bool) -> Result<(), Failure> {
        self.not_p1()?;
        if !self.tables.is_empty() || self.sigma.is_some() || self.labels.is_some() {
            return Err(Failure::Call(anyhow!("--table, --sigma and --labels do not belong to teach")));
        }
        let Some(after) = self.after.clone() else {
            return Err(Failure::Call(anyhow!("--after: name the folder of the network that was trained")));
        };
        let mut config = teach::Config::new(self.before.clone().unwrap_or_else(|| "ud-net-edge".into()), after);
        let TestViews { motors, views, size, cell } = &mut config.views;
        self.choose(2, motors, views, size);
        if self.quick {
            *cell = 2.0;
        }
        config.models.clone_from(&self.models);
        let report = watched(quiet, |on_step| teach::run(&config, on_step))?;
        teach::print(&mut Stderr::default(), &report)?;
        self.write(&report)
    }

    /// Textures against pictures from elsewhere.
    fn texture(self, quiet: bool) -> Result<(), Failure> {
        self.not_p1()?;
        if !self.tables.is_empty() || self.models.is_some() || self.sigma.is_some() || self.labels.is_some() {
            return Err(Failure::Call(anyhow!("--table, --models, --sigma and --labels do not belong to texture")));
        }
        if let Some(folder) = &self.pictures {
            regular_file::check_folder(folder).with_context(|| format!("--pictures {}", folder.display()))?;
        }
        let mut config = texture::Config { pictures: self.pictures.clone(), ..Default::default() };
        self.choose(6, &mut config.motors, &mut config.views, &mut config.size);
        let report = watched(quiet, |on_step| texture::run(&config, on_step))?;
        texture::print(&mut Stderr::default(), &report)?;
        self.write(&report)
    }

    /// Puts `--quick`, `--views`, `--size`, `--seeds` and `--first-seed` into what a table is made of; the seeds of its motors
    /// follow one another.
    fn choose(&self, quick_views: u32, motors: &mut Vec<u64>, views: &mut u32, size: &mut (u32, u32)) {
        if self.quick {
            (*size, *views) = ((320, 240), quick_views);
            motors.truncate(1);
        }
        *views = self.views.unwrap_or(*views);
        *size = self.size.unwrap_or(*size);
        let first = self.first_seed.or_else(|| motors.first().copied()).unwrap_or_default();
        let count = self.seeds.unwrap_or(motors.len() as u64);
        *motors = (first..first + count).collect();
    }

    /// The report as JSON, where it was asked for.
    fn write(&self, report: &impl Serialize) -> Result<(), Failure> {
        let text = serde_json::to_string_pretty(report)?;
        if let Some(file) = &self.out {
            write_file(file, |out| Ok(out.write_all(text.as_bytes())?)).context("the report could not be written")?;
        }
        if self.json {
            print_pretty_json(report)?;
        }
        Ok(())
    }
}

/// The masks of all motors as a data set, in the layout and by the code of `semascan dataset`.
struct MaskSet {
    folder: DatasetFolder,
    /// The writer and the scene that it is in, once there is a view.
    begun: Option<(DatasetWriter, u64)>,
    scenes: u32,
    views: u64,
}

impl MaskSet {
    fn begin(folder: &Path) -> Result<Self, Failure> {
        Ok(Self { folder: DatasetFolder::begin(folder, false)?, begun: None, scenes: 0, views: 0 })
    }

    fn add(&mut self, masked: &labels::MaskedView<'_>) -> Result<(), Box<dyn std::error::Error + Send + Sync>> {
        let labels::MaskedView { seed, part, view, table_from_camera, masks, taxonomy } = *masked;
        self.write(seed, part, view, table_from_camera, masks, taxonomy).map_err(|failure| failure.reason().into())
    }

    fn write(
        &mut self,
        seed: u64,
        part: &str,
        view: &View,
        table_from_camera: Isometry3<f64>,
        masks: &ViewMasks,
        taxonomy: &Taxonomy,
    ) -> Result<(), Failure> {
        let (mut writer, scene_of) = match self.begun.take() {
            Some((writer, seed)) => (writer, Some(seed)),
            None => (DatasetWriter::begin(self.folder.draft(), Format::Bop, taxonomy)?, None),
        };
        if scene_of != Some(seed) {
            writer.finish_scene()?;
            writer.begin_scene(&format!("{:06}", self.scenes), part, taxonomy)?;
            self.scenes += 1;
        }
        writer.write(view, table_from_camera, view.index, masks, taxonomy)?;
        self.views += 1;
        self.begun = Some((writer, seed));
        Ok(())
    }

    fn publish(self, config: &labels::Config) -> Result<(), Failure> {
        let Some((mut writer, _)) = self.begun else {
            return Err(anyhow!("--masks: no view was inspected, there is nothing to write").into());
        };
        writer.finish_scene()?;
        writer.finish()?;
        let manifest = serde_json::json!({
            "kind": DATASET_KIND,
            "software": { "name": "semascan", "version": env!("CARGO_PKG_VERSION") },
            "tables": config,
            "views": self.views,
        });
        let text = serde_json::to_string_pretty(&manifest)?;
        write_file(&self.folder.draft().join(MANIFEST), |file| Ok(writeln!(file, "{text}")?))?;
        Ok(self.folder.publish()?)
    }
}

/// Runs `work` with a progress bar, unless `quiet`, that gets how many steps are done, and of how many.
fn watched<T>(quiet: bool, work: impl FnOnce(&dyn Fn(usize, usize)) -> T) -> T {
    let bar = if quiet { ProgressBar::hidden() } else { ProgressBar::new(0) };
    if let Ok(style) = ProgressStyle::with_template("{bar:40} {pos}/{len}, {elapsed} of {duration}") {
        bar.set_style(style);
    }
    let result = work(&|done, all| {
        bar.set_length(all as u64);
        bar.set_position(done as u64);
    });
    bar.finish_and_clear();
    result
}
