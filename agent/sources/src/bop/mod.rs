//! BOP scene folders: `rgb/` (or `gray/`), `depth/`, `scene_camera.json`, `mask_visib/`, `scene_gt.json`.
//!
//! The layout of the BOP benchmark [Hodan 2018]: millimetres, world-to-camera poses. Masks become recorded labels;
//! an `objects.json` beside them names the classes. Defects, which the benchmark does not know, are read from
//! `defects/` (one value a pixel, 0 = none, 255 = unknown) if a `defects.json` names the values. A view that cannot be read is an
//! error of its own; the rest go on.
//!
//! In a scene that names its classes (`objects.json`) a pixel of `labels/` that is 255 and in no mask is one of which nothing is
//! known, as data sets of corrected models have them: no label, and not none.
//!
//! A scene of several cameras has files with their names (`sensor`).
//!
//! A mask that is not there says nothing: its view is an error, unless `scene_gt_info.json` says that the object is hidden.
//! Units are checked (`units`), and what is assumed is said.

mod instances;
mod listing;
pub(crate) mod mask;
pub(crate) mod metadata;
pub(crate) mod pictures;
mod probe;
pub(crate) mod raster;
mod sensor;
pub(crate) mod units;
mod write;

pub use write::{DEPTH_SCALE, SceneEntry, SceneWriter};
pub(super) use write::{write_json, write_png};

use crate::OpenOptions;
use crate::camera_mask::{self, CameraPixels};
use crate::camera_model::DepthEncoding;
use crate::recorded_pose::{OF_ROBOTS, evidence};
use instances::{Instances, ViewObjects};
use metadata::SceneMetadata;
use pictures::{Pictures, StoredDepth};
use probe::{Probe, SceneUnits};
use semascan_inspection::source::{Source, SourceError, SourceInfo};
use semascan_inspection::spec::CameraMask;
use semascan_model::Taxonomy;
use semascan_perception::view::{RecordedLabels, View};
use sensor::Sensor;
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;

/// A BOP scene.
#[derive(Debug)]
pub struct BopSource {
    info: SourceInfo,
    metadata: SceneMetadata,
    pictures: Pictures,
    units: SceneUnits,
    /// The depth camera, where it was named.
    device: Option<&'static DepthEncoding>,
    instances: Instances,
    views: Vec<u32>,
    next: usize,
    /// Pixels that show the robot, row-major.
    ignore: Option<Vec<bool>>,
    labels: bool,
    /// Pixels of the views so far that are in more than one mask.
    shared_pixels: u64,
}

/// The setting that says how far masks overlap.
const OVERLAP: &str = "mask_overlap";

/// Value of a pixel of which nothing is known, in `labels/` and, unless `defects.json` names it, in `defects/`.
const UNKNOWN: u8 = u8::MAX;

impl BopSource {
    /// Whether `path` looks like a BOP scene folder, or is the file of one of its cameras.
    pub fn is_scene(path: &Path) -> bool {
        Sensor::is_scene(path)
    }

    /// Opens a scene folder, or the scene of one of its cameras by that camera's file.
    ///
    /// # Errors
    /// [`SourceError`] naming the file if the scene's own files (not single views) cannot be used, or naming the field if
    /// poses and depth differ by a unit and it cannot be known which of them is wrong.
    pub fn open(path: &Path, options: impl Into<OpenOptions>) -> Result<Self, SourceError> {
        let options = options.into();
        let sensor = Sensor::of(path)?;
        let folder = sensor.folder();
        let metadata = SceneMetadata::read(&sensor, options.labels)?;
        let pictures = Pictures::list(&sensor)?;
        // Every picture and every camera entry, so that a missing half is noticed.
        let views: BTreeSet<u32> = pictures.color.keys().chain(metadata.camera_numbers()).collect();
        let views: Vec<u32> = views.into_iter().step_by(options.every.max(1) as usize).collect();
        let [components, defects] = [&metadata.objects, &metadata.defects]
            .map(|classes| classes.iter().map(|c| c.name.as_str()).collect::<Vec<_>>());
        let mut info = SourceInfo {
            uri: options.uri_of(path),
            part: sensor.part(),
            taxonomy: Taxonomy::from_names(&components, &defects),
            view_count: Some(views.len() as u32),
            turntable: None,
            volume: None,
            no_labels: no_labels(&sensor, &metadata, &pictures, &views, options.labels)?,
            settings: Vec::new(),
        };
        let wanted = match options.camera_mask {
            CameraMask::Auto => probe::FOR_A_MASK,
            CameraMask::None | CameraMask::File(_) => probe::FOR_UNITS,
        };
        let Probe { units, posed, said } = Probe::take(&metadata, &pictures, &views, &options, wanted)?;
        let mut say = |name: &str, text: String| info.settings.push((name.to_owned(), text));
        for (name, text) in said {
            tracing::warn!("{}: {name}: {text}", folder.display());
            say(name, text);
        }
        let (ignore, taken) = match &options.camera_mask {
            CameraMask::None => (None, "off".to_owned()),
            CameraMask::File(path) => {
                let ignore = mask::read(path)?.inside;
                let count = ignore.iter().filter(|i| **i).count();
                let share = count as f64 / ignore.len().max(1) as f64;
                (Some(ignore), format!("{count} pixels ignored ({:.1} % of the picture, from file)", 100.0 * share))
            }
            CameraMask::Auto => match camera_mask::find(&posed) {
                CameraPixels::Nothing => (None, "0 pixels ignored (nothing found)".to_owned()),
                CameraPixels::Found { ignore, share } => {
                    let count = ignore.iter().filter(|i| **i).count();
                    let text = format!("{count} pixels ignored ({:.1} % of those with depth, found)", 100.0 * share);
                    (Some(ignore), text)
                }
                CameraPixels::TooMany { share } => {
                    let text = format!(
                        "0 pixels ignored: what seems to move with the camera is {:.0} % of the pixels with depth, which \
                         is no robot; name it with --camera-mask PNG, or what matters with --depth, --box or --roi",
                        100.0 * share
                    );
                    tracing::warn!("{}: camera mask: {text}", folder.display());
                    (None, text)
                }
            },
        };
        say("camera_mask", taken);
        let instances = Instances::track(&objects_by_view(&metadata, &views, units.pose));
        if instances.by_order {
            say("instances", "objects of one kind are told apart by their order: no poses are recorded".into());
        }
        let device = options.recording.device;
        if let Some(device) = device {
            say("depth_camera", format!("{device}, as said"));
        }
        let labels = options.labels;
        Ok(Self {
            info,
            metadata,
            pictures,
            units,
            device,
            instances,
            views,
            next: 0,
            ignore,
            labels,
            shared_pixels: 0,
        })
    }

    /// A view, and how many of its pixels are in more than one mask.
    fn read_view(&self, index: u32, number: u32) -> Result<(View, u64), SourceError> {
        let camera = self.metadata.camera(number, self.units.pose)?;
        let rgb = pictures::read_color(self.pictures.color.get(number)?)?;
        let size = rgb.dimensions();
        let depth_path = self.pictures.depth.get(number)?;
        let stored = StoredDepth::read(depth_path)?;
        let (mut depth, unmeasured) = stored.in_metres(self.units.depth(&camera), self.device);
        pictures::check_size(depth_path, (depth.width, depth.height), size)?;
        let refuse = |reason: String| SourceError::Format { path: depth_path.to_owned(), reason };
        let measured = depth.metres.iter().filter(|z| **z > 0.0).count();
        if measured == 0 {
            return Err(refuse(format!("no depth in the whole picture: {unmeasured}")));
        }
        if let Some(ignore) = &self.ignore {
            if ignore.len() != depth.metres.len() {
                return Err(refuse(format!("{} pixels, but the camera mask has {}", depth.metres.len(), ignore.len())));
            }
            for (z, _) in depth.metres.iter_mut().zip(ignore).filter(|(_, i)| **i) {
                *z = 0.0;
            }
            if depth.metres.iter().all(|z| *z <= 0.0) {
                return Err(refuse(format!(
                    "the camera mask takes all {measured} pixels that have depth (--camera-mask none switches it off)"
                )));
            }
        }
        let labels = if self.labels { self.read_labels(number, size)? } else { None };
        let (labels, shared) = labels.map_or((None, 0), |(labels, shared)| (Some(Arc::new(labels)), shared));
        let pose = evidence(camera.table_from_camera, OF_ROBOTS);
        let view = View {
            index,
            stamp: None,
            intrinsics: camera.intrinsics(size.0, size.1),
            rgb: Arc::new(rgb),
            depth: Arc::new(depth),
            pose,
            labels,
            truth: None,
        };
        Ok((view, shared))
    }

    /// Masks of a view as labels, and how many pixels are in more than one of them: there the object with the larger
    /// instance wins, in every view alike. `None` if the scene has no ground truth for the view.
    fn read_labels(&self, number: u32, size: (u32, u32)) -> Result<Option<(RecordedLabels, u64)>, SourceError> {
        if self.info.no_labels.is_some() {
            return Ok(None);
        }
        let Some(mut objects) = self.metadata.objects_of(number)? else { return Ok(None) };
        objects.sort_by_key(|o| self.instances.of(number, o.place));
        let pixels = (size.0 * size.1) as usize;
        let mut components = vec![0; pixels];
        let mut instances = vec![0; pixels];
        let mut shared = 0;
        for object in objects {
            let key = (number, object.place);
            let Some(path) = self.pictures.masks.find(key)? else {
                if self.metadata.is_hidden(number, object.place) {
                    continue;
                }
                let reason = format!(
                    "no such mask, though {} lists the object; a hidden one has visib_fract 0 in scene_gt_info.json",
                    self.metadata.ground_truth_path().display()
                );
                return Err(SourceError::Format { path: self.pictures.masks.expected(key), reason });
            };
            let instance = self.instances.of(number, object.place);
            for (i, _) in pictures::read_mask(path, size)?.iter().enumerate().filter(|(_, inside)| **inside) {
                shared += u64::from(components[i] != 0);
                components[i] = object.class;
                instances[i] = instance;
            }
        }
        for i in self.unknown(number, size)? {
            if components[i] == 0 {
                components[i] = RecordedLabels::UNKNOWN;
            }
        }
        let defects = self.read_defects(number, size)?;
        Ok(Some((RecordedLabels { components, defects, instances }, shared)))
    }

    /// The pixels of a view of whose component nothing is known.
    fn unknown(&self, number: u32, size: (u32, u32)) -> Result<Vec<usize>, SourceError> {
        if !self.metadata.names_objects {
            return Ok(Vec::new());
        }
        let Some(path) = self.pictures.labels.find(number)? else { return Ok(Vec::new()) };
        let labels = pictures::read_classes(path, size)?;
        Ok((0..labels.len()).filter(|i| labels[*i] == UNKNOWN).collect())
    }

    /// Defect classes of a view's pixels: none where the scene records none.
    fn read_defects(&self, number: u32, size: (u32, u32)) -> Result<Vec<u16>, SourceError> {
        let known = &self.metadata.defects;
        if known.is_empty() {
            return Ok(vec![0; (size.0 * size.1) as usize]);
        }
        let path = self.pictures.defects.get(number)?;
        let class = |value: u8| {
            if value == 0 {
                return Ok(0);
            }
            let at = known.iter().position(|d| d.id == u64::from(value)).map(|at| at as u16 + 1);
            at.or((value == UNKNOWN).then_some(RecordedLabels::UNKNOWN)).ok_or_else(|| SourceError::Format {
                path: path.to_owned(),
                reason: format!("a pixel has the value {value}, which defects.json does not name"),
            })
        };
        pictures::read_classes(path, size)?.into_iter().map(class).collect()
    }
}

/// Why the scene has no labels at all; `None` if it has some.
fn no_labels(
    sensor: &Sensor,
    metadata: &SceneMetadata,
    pictures: &Pictures,
    views: &[u32],
    wanted: bool,
) -> Result<Option<String>, SourceError> {
    if !wanted {
        return Ok(Some("its recorded labels were not asked for".into()));
    }
    let file = metadata.ground_truth_path().display();
    if !metadata.has_ground_truth() {
        return Ok(Some(format!("{file} is missing, which lists the objects")));
    }
    // An entry that cannot be read is its view's error.
    let listed: Vec<(u32, u32)> = views
        .iter()
        .filter_map(|&view| Some((view, metadata.objects_of(view).ok()??)))
        .flat_map(|(view, objects)| objects.into_iter().map(move |o| (view, o.place)))
        .collect();
    if listed.is_empty() && !views.iter().any(|view| metadata.objects_of(*view).is_err()) {
        return Ok(Some(format!("{file} lists no object")));
    }
    let unread = listed.iter().filter(|(view, place)| !metadata.is_hidden(*view, *place)).count();
    if pictures.masks.is_empty() && unread > 0 {
        let masks = pictures.masks.folder().display();
        let mut reason = format!("{masks} holds no mask of the {unread} objects that scene_gt.json lists");
        if sensor.pictures("mask").is_dir() {
            reason += "; those in mask/ show what is hidden as well";
        }
        return Ok(Some(reason));
    }
    Ok(None)
}

/// The objects of every view whose entry can be read.
fn objects_by_view(metadata: &SceneMetadata, views: &[u32], pose_unit: f64) -> Vec<ViewObjects> {
    let objects = |&view: &u32| {
        let objects = metadata.objects_of(view).ok()??;
        let table_from_camera = metadata.camera(view, pose_unit).ok().and_then(|c| c.table_from_camera);
        Some(ViewObjects { view, table_from_camera, objects })
    };
    views.iter().filter_map(objects).collect()
}

impl Source for BopSource {
    fn info(&self) -> &SourceInfo {
        &self.info
    }

    fn next_view(&mut self) -> Option<Result<View, SourceError>> {
        let number = *self.views.get(self.next)?;
        let index = self.next as u32;
        self.next += 1;
        let read = self.read_view(index, number);
        if let Ok((_, shared)) = &read
            && *shared > 0
        {
            self.shared_pixels += shared;
            let text = format!("{} pixels are in more than one mask: the later object has them", self.shared_pixels);
            let settings = &mut self.info.settings;
            match settings.iter_mut().find(|(name, _)| name == OVERLAP) {
                Some((_, value)) => *value = text,
                None => settings.push((OVERLAP.into(), text)),
            }
        }
        Some(read.map(|(view, _)| view))
    }

    fn rewind(&mut self) -> bool {
        (self.next, self.shared_pixels) = (0, 0);
        true
    }
}
