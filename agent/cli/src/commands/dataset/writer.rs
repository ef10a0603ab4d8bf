//! A data set in one of the formats, view by view.

use super::{Failure, Format};
use nalgebra::Isometry3;
use semascan_labelling::{IGNORE, ViewMasks};
use semascan_model::{ClassDef, Taxonomy};
use semascan_perception::view::{PoseEvidence, RecordedLabels, View, covariance_of_prior};
use semascan_sources::bop::{SceneEntry, SceneWriter};
use semascan_sources::training_set::{CocoWriter, LabelledPicture, LabelmeWriter};
use semascan_store::write_file;
use serde_json::json;
use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A data set in one of the formats.
pub(in super::super) enum DatasetWriter {
    /// BOP scenes; `parts` has the part that each shows.
    Bop {
        folder: PathBuf,
        scene: Option<(SceneWriter, Vec<SceneEntry>)>,
        taxonomy: Taxonomy,
        parts: BTreeMap<String, String>,
    },
    Labelme {
        writer: LabelmeWriter,
        scene: String,
        part: String,
    },
    Coco {
        writer: CocoWriter,
        scene: String,
        part: String,
    },
}

impl DatasetWriter {
    /// Begins a data set in `folder`.
    ///
    /// # Errors
    /// [`Failure`] naming the folder that cannot be made.
    pub(in super::super) fn begin(folder: &Path, format: Format, taxonomy: &Taxonomy) -> Result<Self, Failure> {
        let (scene, part) = (String::new(), String::new());
        Ok(match format {
            Format::Bop => {
                Self::Bop { folder: folder.to_owned(), scene: None, taxonomy: taxonomy.clone(), parts: BTreeMap::new() }
            }
            Format::Labelme => Self::Labelme { writer: LabelmeWriter::create(folder)?, scene, part },
            Format::Coco => Self::Coco { writer: CocoWriter::create(folder, taxonomy)?, scene, part },
        })
    }

    /// Begins the views of one inspection of `part`. By the part, not by the inspection, views are kept on one side of a split:
    /// two inspections of one part show the same surface.
    ///
    /// # Errors
    /// [`Failure`] naming the folder that cannot be made.
    pub(in super::super) fn begin_scene(&mut self, name: &str, of: &str, taxonomy: &Taxonomy) -> Result<(), Failure> {
        match self {
            Self::Bop { folder, scene, parts, .. } => {
                let writer = SceneWriter::create(&folder.join(name), taxonomy, Isometry3::identity())?;
                *scene = Some((writer, Vec::new()));
                parts.insert(name.to_owned(), of.to_owned());
            }
            Self::Labelme { scene, part, .. } | Self::Coco { scene, part, .. } => {
                name.clone_into(scene);
                of.clone_into(part);
            }
        }
        Ok(())
    }

    /// Writes a view with its masks.
    ///
    /// # Errors
    /// [`Failure`] naming the file.
    pub(in super::super) fn write(
        &mut self,
        view: &View,
        table_from_camera: Isometry3<f64>,
        index: u32,
        masks: &ViewMasks,
        taxonomy: &Taxonomy,
    ) -> Result<(), Failure> {
        match self {
            Self::Bop { scene, .. } => {
                let Some((writer, entries)) = scene else { return Ok(()) };
                let known = |classes: &[u16]| -> Vec<u16> {
                    classes.iter().map(|c| if *c == IGNORE { RecordedLabels::UNKNOWN } else { *c }).collect()
                };
                let labels = RecordedLabels {
                    components: known(&masks.components),
                    defects: known(&masks.defects),
                    instances: masks.instances.clone(),
                };
                let pose = PoseEvidence::World { table_from_camera, covariance: covariance_of_prior(0.0, 0.0) };
                let labelled = View { index, pose, labels: Some(Arc::new(labels)), truth: None, ..view.clone() };
                entries.push(writer.write(&labelled)?);
            }
            Self::Labelme { writer, scene, part } => {
                let name = format!("{scene}_{index:06}");
                writer.write(&LabelledPicture { name: &name, part, rgb: &view.rgb, masks, taxonomy })?;
            }
            Self::Coco { writer, scene, part } => {
                let name = format!("{scene}_{index:06}");
                writer.write(&LabelledPicture { name: &name, part, rgb: &view.rgb, masks, taxonomy })?;
            }
        }
        Ok(())
    }

    /// Ends the views of an inspection.
    ///
    /// # Errors
    /// [`Failure`] naming the file.
    pub(in super::super) fn finish_scene(&mut self) -> Result<(), Failure> {
        if let Self::Bop { scene, .. } = self
            && let Some((writer, entries)) = scene.take()
        {
            writer.finish(&entries)?;
        }
        Ok(())
    }

    /// Writes what stands beside the scenes: for the training code what the values of the masks mean.
    ///
    /// # Errors
    /// [`Failure`] naming the file.
    pub(in super::super) fn finish(self) -> Result<(), Failure> {
        match self {
            Self::Bop { folder, taxonomy, parts, .. } => {
                let names = |classes: &[ClassDef]| classes.iter().map(|c| c.name.clone()).collect::<Vec<_>>();
                let index = json!({
                    "schema": 1,
                    "generator": concat!("semascan dataset ", env!("CARGO_PKG_VERSION")),
                    "classes": names(&taxonomy.components),
                    "defects": names(&taxonomy.defects),
                    "ignore": IGNORE,
                    "parts": parts,
                });
                let text = serde_json::to_string_pretty(&index)?;
                write_file(&folder.join("dataset.json"), |file| Ok(writeln!(file, "{text}")?))?;
            }
            Self::Labelme { .. } => {}
            Self::Coco { writer, .. } => writer.finish()?,
        }
        Ok(())
    }
}
