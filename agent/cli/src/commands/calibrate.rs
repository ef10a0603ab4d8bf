//! `semascan models calibrate MODEL --views SOURCE ...`: which views a model's labels can be believed for, measured on views
//! of the world that it was trained for and checked on pictures from elsewhere, into its manifest.

use super::Failure;
use super::source::open;
use crate::stderr::Stderr;
use crate::stdout::print_json;
use anyhow::{Context, anyhow};
use clap::Args;
use image::RgbImage;
use semascan_formats::regular_file;
use semascan_inspection::spec::InspectionSpec;
use semascan_model::Taxonomy;
use semascan_model::choice::possible_instead;
use semascan_perception::segment::Segmenter;
use semascan_perception::segment::network::{
    Domain, EngineChoice, FALSE_ALARMS, FILE_NAME, Manifest, NetworkConfig, NetworkModel, NetworkSegmenter, Provider,
    STATISTICS, Task, disagreement, engine, extended, installed, numbers_of, search_path,
};
use semascan_perception::view::{DepthImage, Intrinsics, PoseEvidence, View};
use semascan_store::write_file;
use serde_json::json;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Extensions of pictures.
const PICTURES: [&str; 6] = ["png", "jpg", "jpeg", "webp", "tif", "tiff"];

/// Arguments of `semascan models calibrate`.
#[derive(Debug, Args)]
pub(crate) struct CalibrateArgs {
    /// Names of models, or folders of models, whose manifests get the calibration
    #[arg(required = true)]
    models: Vec<String>,
    /// Sources whose views the labels can be believed for: at least two, and 99 views together. An ensemble is asked about
    /// each, which takes seconds a view
    #[arg(long, value_name = "SOURCE", required = true, num_args = 1..)]
    views: Vec<String>,
    /// Sources of further such views, which are kept back: how many of them are marked falsely
    #[arg(long, value_name = "SOURCE", num_args = 1..)]
    check: Vec<String>,
    /// Pictures from elsewhere, which are to be told apart: folders of pictures, or sources. They do not set the threshold
    #[arg(long, value_name = "FOLDER", num_args = 1..)]
    outside: Vec<PathBuf>,
    /// Print one JSON object on stdout: the calibration and the score of every view
    #[arg(long)]
    json: bool,
}

/// The numbers of the views of one source.
type Numbers = (String, Vec<[f64; STATISTICS]>);

impl CalibrateArgs {
    pub(crate) fn run(self) -> Result<(), Failure> {
        let folders = self.models.iter().map(|name| folder(name)).collect::<Result<Vec<_>, _>>()?;
        let mut out = Stderr::default();
        let views = self.views.iter().map(|uri| of_source(uri, &mut out)).collect::<Result<Vec<_>, _>>()?;
        let kept_back = self.check.iter().map(|uri| of_source(uri, &mut out)).collect::<Result<Vec<_>, _>>()?;
        let outside = self.outside.iter().map(|path| of_pictures(path, &mut out)).collect::<Result<Vec<_>, _>>()?;
        let photographs: Vec<_> = outside.iter().flat_map(|(_, numbers)| numbers.iter().copied()).collect();
        let domain = Domain::calibrated(&views, &photographs).map_err(|e| Failure::Work(e.into()))?;

        writeln!(out, "{:>8} {:>8} {:>8}  views: smallest, median and largest score", "min", "median", "max")?;
        let sets = [("inside", &views), ("kept back", &kept_back), ("outside", &outside)];
        let sets = sets.into_iter().flat_map(|(kind, sets)| sets.iter().map(move |set| (kind, set)));
        let mut scores = Vec::new();
        for (kind, (source, numbers)) in sets {
            let mut of_set: Vec<f64> = numbers.iter().map(|n| domain.score(n)).collect();
            of_set.sort_by(f64::total_cmp);
            let [low, middle, high] = [0, of_set.len() / 2, of_set.len().saturating_sub(1)]
                .map(|i| of_set.get(i).map_or_else(|| "-".to_owned(), |score| format!("{score:.2}")));
            writeln!(out, "{low:>8} {middle:>8} {high:>8}  {kind} {source} ({})", of_set.len())?;
            scores.push(json!({ "source": source, "kind": kind, "scores": of_set, "statistics": numbers }));
        }
        let marked = |sets: &[Numbers]| {
            let numbers = || sets.iter().flat_map(|(_, numbers)| numbers);
            (numbers().filter(|n| domain.score(n) > domain.threshold).count(), numbers().count())
        };
        let ((of_kept, kept), (of_outside, elsewhere)) = (marked(&kept_back), marked(&outside));
        writeln!(
            out,
            "threshold {:.3}, which {} % of the views inside may exceed; largest score inside {:.3} (each source judged by the \
             others); kept back {of_kept} of {kept} marked, outside {of_outside} of {elsewhere}",
            domain.threshold,
            100.0 * FALSE_ALARMS,
            domain.largest,
        )?;
        for folder in &folders {
            let mut domain = domain.clone();
            if let Some(inside) = self.disagreements(folder)? {
                domain = domain.with_disagreement(inside).map_err(|e| Failure::Work(e.into()))?;
            }
            if let (Some(largest), Some(most)) = (domain.largest_disagreement, domain.disagreement_threshold) {
                let asked = domain.asked.unwrap_or_default();
                writeln!(out, "disagreement up to {largest:.4} on {asked} views inside, threshold {most:.4}")?;
            }
            let path = folder.join(FILE_NAME);
            let text = regular_file::read_to_string(&path).with_context(|| path.display().to_string())?;
            let text = with_domain(&text, &domain)?;
            // What is written can be read.
            Manifest::parse(&text).map_err(|(field, reason)| anyhow!("{}: {field}: {reason}", path.display()))?;
            write_file(&path, |out| Ok(out.write_all(text.as_bytes())?))?;
            writeln!(out, "written to {}", path.display())?;
        }
        if self.json {
            print_json(&json!({ "domain": domain, "sets": scores }))?;
        }
        Ok(())
    }
}

impl CalibrateArgs {
    /// How far the ensemble in `folder` disagrees about each view; `None` where it does not label components or is no ensemble.
    fn disagreements(&self, folder: &Path) -> Result<Option<Vec<f64>>, Failure> {
        let manifest = Manifest::read(folder)?;
        if !matches!(manifest.task, Task::Semantic | Task::TwoStream) || manifest.networks.len() < 2 {
            return Ok(None);
        }
        let engine = engine::open(EngineChoice::default(), None, Provider::Cpu)?;
        let taxonomy = extended(&Taxonomy::from_names::<&str>(&[], &[]), &[&manifest]);
        let config = NetworkConfig { judge_domain: false, ..NetworkConfig::default() };
        let model = NetworkModel::load(folder, engine.as_ref(), rayon::current_num_threads())?;
        let mut segmenter = NetworkSegmenter::new(vec![model], engine.description(), &taxonomy, None, config)?;
        let mut found = Vec::new();
        for uri in &self.views {
            let mut source = open(uri, &InspectionSpec::default())?;
            segmenter.look_at(source.info().volume);
            while let Some(view) = source.next_view() {
                // Those that cannot be read were said already.
                let Ok(view) = view else { continue };
                let said = segmenter.segment(&view)?;
                found.extend(said.network.and_then(|detail| disagreement(&detail.components)));
            }
        }
        Ok(Some(found))
    }
}

/// The folder of the model `name`.
fn folder(name: &str) -> Result<PathBuf, Failure> {
    let places = std::iter::once(PathBuf::from(name)).chain(search_path().into_iter().map(|folder| folder.join(name)));
    let found = places.into_iter().find(|folder| folder.join(FILE_NAME).is_file());
    found.ok_or_else(|| {
        let there = installed(&search_path());
        let names: Vec<_> = there.iter().filter_map(|model| model.folder.file_name()?.to_str()).collect();
        let instead = possible_instead(name, &names);
        Failure::Call(anyhow!("{name}: neither an installed model nor a folder with {FILE_NAME}: {instead}"))
    })
}

/// The numbers of the views of the source `uri`. Bad views are said and left out.
fn of_source(uri: &str, out: &mut impl Write) -> Result<Numbers, Failure> {
    let mut source = open(uri, &InspectionSpec::default())?;
    let volume = source.info().volume;
    let margin = NetworkConfig::default().margin;
    let mut numbers = Vec::new();
    while let Some(view) = source.next_view() {
        match view.map(|view| numbers_of(&view, volume.as_ref(), margin)) {
            Ok(Some(of_view)) => numbers.push(of_view),
            Ok(None) => writeln!(out, "left out: a view of {uri} shows too little of the part")?,
            Err(error) => writeln!(out, "left out: {error}")?,
        }
    }
    Ok((uri.to_owned(), numbers))
}

/// The numbers of pictures from elsewhere: of all in a folder, or of the views of a source.
fn of_pictures(path: &Path, out: &mut impl Write) -> Result<Numbers, Failure> {
    let name = path.display().to_string();
    regular_file::check_folder(path).with_context(|| name.clone())?;
    let mut files: Vec<PathBuf> = std::fs::read_dir(path)
        .with_context(|| name.clone())?
        .map(|entry| entry.map(|e| e.path()))
        .collect::<Result<_, _>>()
        .with_context(|| name.clone())?;
    files.retain(|file| {
        let extension = file.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
        PICTURES.contains(&extension.as_str())
    });
    if files.is_empty() {
        return of_source(&name, out);
    }
    files.sort();
    let mut numbers = Vec::new();
    for file in files {
        let bytes = regular_file::read(&file).with_context(|| file.display().to_string())?;
        let picture = image::load_from_memory(&bytes).with_context(|| file.display().to_string())?.to_rgb8();
        match numbers_of(&view_of(picture), None, 0) {
            Some(of_picture) => numbers.push(of_picture),
            None => writeln!(out, "left out: {} is too small", file.display())?,
        }
    }
    Ok((name, numbers))
}

/// A picture as a view of which nothing else is known.
fn view_of(rgb: RgbImage) -> View {
    let (width, height) = rgb.dimensions();
    let (w, h) = (f64::from(width), f64::from(height));
    View {
        index: 0,
        stamp: None,
        intrinsics: Intrinsics { width, height, fx: w, fy: w, cx: w / 2.0, cy: h / 2.0 },
        rgb: Arc::new(rgb),
        depth: Arc::new(DepthImage { width, height, metres: vec![0.0; width as usize * height as usize] }),
        pose: PoseEvidence::None,
        labels: None,
        truth: None,
    }
}

/// The manifest `text` with the table `[domain]` in place of one that it may have; all else stays as it is.
fn with_domain(text: &str, domain: &Domain) -> Result<String, Failure> {
    #[derive(serde::Serialize)]
    struct Table<'a> {
        domain: &'a Domain,
    }
    let mut kept = Vec::new();
    let mut within = false;
    for line in text.lines() {
        if line.starts_with('[') && !line.starts_with("[[") || line.starts_with("[[") && line.contains("]]") {
            within = line.trim() == "[domain]";
        }
        if !within {
            kept.push(line);
        }
    }
    let table = toml::to_string(&Table { domain }).context("the calibration cannot be written")?;
    Ok(format!("{}\n\n{table}", kept.join("\n").trim_end()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_calibration_replaces_the_one_before_and_nothing_else() {
        let numbers = |seed: usize| -> Vec<[f64; STATISTICS]> {
            let value = |v: usize, k: usize| (((v * 31 + k * 17 + seed * 7) * 2_654_435_761) % 1000) as f64;
            (0..60).map(|v| std::array::from_fn(|k| value(v * (k + 1), k + v))).collect()
        };
        let sets = [("a".to_owned(), numbers(1)), ("b".to_owned(), numbers(2))];
        let domain = Domain::calibrated(&sets, &[]).expect("enough views");
        let before =
            "schema = 1\n\n[input]\ntensor = \"image\"\n\n[[classes]]\nname = \"none\"\n\n[metrics]\niou = 0.5\n";
        let once = with_domain(before, &domain).expect("writes");
        assert!(once.starts_with(before.trim_end()) && once.contains("\n[domain]\n"));
        assert_eq!(with_domain(&once, &domain).expect("writes"), once, "twice is as once");
        let between = once.replace("[metrics]\niou = 0.5\n\n", "") + "\n[metrics]\niou = 0.5\n";
        let again = with_domain(&between, &domain).expect("writes");
        assert!(again.contains("[metrics]\niou = 0.5") && again.matches("[domain]").count() == 1);
    }
}
