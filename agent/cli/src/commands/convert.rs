//! `semascan convert SOURCE OUT`: the views of any source as a capture that Foxglove opens too, or as a BOP scene.

use super::spec_args::UnitArg;
use super::{Failure, numbers, source};
use anyhow::{Context, anyhow};
use clap::Args;
use nalgebra::Isometry3;
use semascan_captures::{CaptureInfo, CaptureWriter};
use semascan_inspection::source::Source;
use semascan_inspection::spec::{CameraMask, InspectionSpec};
use semascan_sources::bop::SceneWriter;
use std::fs;
use std::path::{Path, PathBuf};

/// Arguments of `semascan convert`.
#[derive(Debug, Args)]
#[command(after_long_help = source::help())]
pub(crate) struct ConvertArgs {
    /// What to read: all that can be inspected (`--help` lists it)
    source: String,
    /// What to write. `x.mcap`: a capture, from which every view comes back bit for bit; Foxglove opens it. Anything else is the
    /// folder of a BOP scene: depth to 6.5 m in tenths of a millimetre, poses as they are known best
    out: PathBuf,
    /// Write the first N views only
    #[arg(long, value_name = "N", value_parser = numbers::count(), allow_negative_numbers = true)]
    first: Option<usize>,
    /// Unit of the source's lengths, as `semascan inspect` takes it
    #[arg(long, value_enum)]
    unit: Option<UnitArg>,
    /// Millimetres of a depth of 1 in a recording [default: what the recording says]
    #[arg(long, value_name = "MM", value_parser = numbers::length::<f64>, allow_negative_numbers = true)]
    depth_scale: Option<f64>,
    /// Replace the file that is there
    #[arg(long)]
    overwrite: bool,
}

/// What became of the views.
#[derive(Clone, Copy, Debug, Default)]
struct Counts {
    written: u32,
    left_out: u32,
}

impl ConvertArgs {
    pub(crate) fn run(self) -> Result<(), Failure> {
        let is_capture = self.out.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("mcap"));
        let is_there = self.out.try_exists().with_context(|| self.out.display().to_string())?;
        if is_there && !(is_capture && self.overwrite && self.out.is_file()) {
            let hint = if is_capture { ": --overwrite replaces a file" } else { "" };
            return Err(Failure::Call(anyhow!("{} is there already{hint}", self.out.display())));
        }
        if is_there && is_same(Path::new(&self.source), &self.out) {
            return Err(Failure::Call(anyhow!("{} is the source itself", self.out.display())));
        }
        let mut spec = InspectionSpec::default();
        // The robot is left in the pictures: whoever inspects the copy finds it as in the original.
        spec.source.camera_mask = CameraMask::None;
        spec.source.unit = self.unit.map(Into::into);
        spec.source.depth_scale_mm = self.depth_scale;
        let mut source = source::open(&self.source, &spec)?;
        let most = self.first.unwrap_or(usize::MAX);
        let counts = if is_capture {
            write_capture(source.as_mut(), &self.out, most)?
        } else {
            write_scene(source.as_mut(), &self.out, most)?
        };
        eprintln!("{}: {} views", self.out.display(), counts.written);
        if counts.written == 0 {
            return Err(Failure::Work(anyhow!("{} has no view that could be read", self.source)));
        }
        if counts.left_out > 0 {
            return Err(Failure::Work(anyhow!("{} views could not be read (named above)", counts.left_out)));
        }
        Ok(())
    }
}

/// Whether two paths lead to one file.
fn is_same(a: &Path, b: &Path) -> bool {
    matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}

/// Writes a capture beside its place, and puts it there when it is whole.
fn write_capture(source: &mut dyn Source, out: &Path, most: usize) -> Result<Counts, Failure> {
    let part = out.with_extension("mcap.part");
    if part.try_exists().with_context(|| part.display().to_string())? {
        fs::remove_file(&part).with_context(|| part.display().to_string())?;
    }
    let info = CaptureInfo::new(source.info(), source.truth());
    let mut capture = CaptureWriter::create(&part, &info, source.truth())?;
    let mut counts = Counts::default();
    while counts.written as usize + (counts.left_out as usize) < most
        && let Some(view) = source.next_view()
    {
        // Why a view could not be read is kept in its place.
        capture.append(&view, &source.info().settings)?;
        capture.sync()?;
        counts.note(view.as_ref().err());
    }
    capture.finish()?;
    drop(capture);
    fs::rename(&part, out).with_context(|| out.display().to_string())?;
    Ok(counts)
}

/// Writes the scene view by view; its JSON files, which make it one, come last.
fn write_scene(source: &mut dyn Source, out: &Path, most: usize) -> Result<Counts, Failure> {
    let scene = SceneWriter::create(out, &source.info().taxonomy, Isometry3::identity())?;
    let (mut entries, mut counts) = (Vec::new(), Counts::default());
    while counts.written as usize + (counts.left_out as usize) < most
        && let Some(view) = source.next_view()
    {
        if let Ok(view) = &view {
            entries.push(scene.write(view)?);
        }
        counts.note(view.as_ref().err());
    }
    scene.finish(&entries)?;
    Ok(counts)
}

impl Counts {
    fn note(&mut self, error: Option<&impl std::fmt::Display>) {
        match error {
            None => self.written += 1,
            Some(error) => {
                self.left_out += 1;
                tracing::warn!("{error}");
            }
        }
    }
}
