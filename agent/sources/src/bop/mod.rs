//! BOP scene folders: `rgb/`, `depth/`, `scene_camera.json`, `mask_visib/`, `scene_gt.json`.
//!
//! The layout of the BOP benchmark [Hodan 2018]: millimetres, world-to-camera poses. Masks become recorded labels;
//! an `objects.json` beside them names the classes. Defects, which the benchmark does not know, are read from
//! `defects/` (one value a pixel, 0 = none) if a `defects.json` names the values. A view that cannot be read is an
//! error of its own; the rest go on.

mod metadata;
mod pictures;
mod write;

pub(super) use write::write_json;
pub use write::{DEPTH_SCALE, SceneEntry, SceneWriter};

use crate::camera_mask::{self, PosedDepth};
use metadata::SceneMetadata;
use semascan_inspection::source::{Source, SourceError, SourceInfo};
use semascan_inspection::spec::CameraMask;
use semascan_model::Taxonomy;
use semascan_perception::view::{PoseEvidence, RecordedLabels, View, covariance_of_prior};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A BOP scene.
#[derive(Debug)]
pub struct BopSource {
    folder: PathBuf,
    info: SourceInfo,
    metadata: SceneMetadata,
    views: Vec<u32>,
    next: usize,
    ignore: Option<Vec<bool>>,
}

/// Standard deviations assumed of recorded poses: BOP records none. Radians and metres.
const POSE_SIGMA: (f64, f64) = (0.01, 0.003);

impl BopSource {
    /// Whether `folder` looks like a BOP scene.
    pub fn is_scene(folder: &Path) -> bool {
        folder.join("scene_camera.json").is_file()
    }

    /// Opens a scene folder.
    ///
    /// # Errors
    /// [`SourceError`] naming the file if the scene's own files (not single views) cannot be used.
    pub fn open(folder: &Path, mask: &CameraMask) -> Result<Self, SourceError> {
        let metadata = SceneMetadata::read(folder)?;
        let views = pictures::view_numbers(folder, &metadata)?;
        let [components, defects] = [&metadata.objects, &metadata.defects]
            .map(|classes| classes.iter().map(|c| c.name.as_str()).collect::<Vec<_>>());
        let part = folder.file_name().map_or("scene".into(), |n| n.to_string_lossy().into_owned());
        let info = SourceInfo {
            uri: folder.display().to_string(),
            part,
            taxonomy: Taxonomy::from_names(&components, &defects),
            view_count: Some(views.len() as u32),
            turntable: None,
            volume: None,
            settings: Vec::new(),
        };
        let mut source = Self { folder: folder.to_owned(), info, metadata, views, next: 0, ignore: None };
        source.ignore = match mask {
            CameraMask::None => None,
            CameraMask::File(path) => Some(pictures::read_mask(path)?),
            CameraMask::Auto => source.find_camera_mask(),
        };
        let ignored = source.ignore.as_ref().map_or(0, |m| m.iter().filter(|&&i| i).count());
        source.info.settings.push(("camera_mask".into(), format!("{ignored} pixels ignored ({})", describe(mask))));
        Ok(source)
    }

    /// The robot's own pixels, from every view that can be read; a scene with broken views still has a mask.
    fn find_camera_mask(&self) -> Option<Vec<bool>> {
        let posed = |&number: &u32| {
            let camera = self.metadata.camera(number).ok()?;
            let depth = pictures::read_depth(&self.folder, number, camera.depth_scale, None).ok()?;
            let intrinsics = camera.intrinsics(depth.width, depth.height);
            Some(PosedDepth { intrinsics, depth, table_from_camera: camera.table_from_camera? })
        };
        let views: Vec<PosedDepth> = self.views.iter().filter_map(posed).collect();
        camera_mask::find(&views)
    }

    fn read_view(&self, index: u32, number: u32) -> Result<View, SourceError> {
        let camera = self.metadata.camera(number)?;
        let rgb = pictures::read_rgb(&self.folder, number)?;
        let (width, height) = rgb.dimensions();
        let mut depth = pictures::read_depth(&self.folder, number, camera.depth_scale, Some((width, height)))?;
        if let Some(ignore) = &self.ignore {
            if ignore.len() != depth.metres.len() {
                return Err(SourceError::Format {
                    path: pictures::path_of(&self.folder, "depth", number),
                    reason: format!("{} pixels, but the camera mask has {}", depth.metres.len(), ignore.len()),
                });
            }
            for (z, _) in depth.metres.iter_mut().zip(ignore).filter(|(_, i)| **i) {
                *z = 0.0;
            }
        }
        let labels = self.read_labels(number, width, height)?;
        let (rotation, translation) = POSE_SIGMA;
        let pose = camera.table_from_camera.map_or(PoseEvidence::None, |table_from_camera| PoseEvidence::World {
            table_from_camera,
            covariance: covariance_of_prior(rotation, translation),
        });
        Ok(View {
            index,
            stamp: None,
            intrinsics: camera.intrinsics(width, height),
            rgb: Arc::new(rgb),
            depth: Arc::new(depth),
            pose,
            labels: labels.map(Arc::new),
            truth: None,
        })
    }

    /// Masks of a view as labels: where masks overlap the later object wins. `None` if the scene has no masks for it.
    fn read_labels(&self, number: u32, width: u32, height: u32) -> Result<Option<RecordedLabels>, SourceError> {
        let Some(objects) = self.metadata.visible_objects(number)? else { return Ok(None) };
        let pixels = (width * height) as usize;
        let mut components = vec![0; pixels];
        let mut instances = vec![0; pixels];
        for (k, class) in objects.iter().enumerate() {
            let Some(mask) = pictures::read_object_mask(&self.folder, number, k, width, height)? else { continue };
            for (i, _) in mask.iter().enumerate().filter(|(_, inside)| **inside) {
                components[i] = *class;
                instances[i] = k as u16 + 1;
            }
        }
        let defects = self.read_defects(number, width, height)?;
        Ok(Some(RecordedLabels { components, defects, instances }))
    }

    /// Defect classes of a view's pixels: none where the scene records none.
    fn read_defects(&self, number: u32, width: u32, height: u32) -> Result<Vec<u16>, SourceError> {
        let known = &self.metadata.defects;
        let values = if known.is_empty() { None } else { pictures::read_defects(&self.folder, number, width, height)? };
        let Some(values) = values else { return Ok(vec![0; (width * height) as usize]) };
        let class = |value: u8| {
            if value == 0 {
                return Ok(0);
            }
            let at = known.iter().position(|d| d.id == u64::from(value));
            at.map(|at| at as u16 + 1).ok_or_else(|| SourceError::Format {
                path: pictures::path_of(&self.folder, "defects", number),
                reason: format!("a pixel has the value {value}, which defects.json does not name"),
            })
        };
        values.into_iter().map(class).collect()
    }
}

impl Source for BopSource {
    fn info(&self) -> &SourceInfo {
        &self.info
    }

    fn next_view(&mut self) -> Option<Result<View, SourceError>> {
        let number = *self.views.get(self.next)?;
        let index = self.next as u32;
        self.next += 1;
        Some(self.read_view(index, number))
    }
}

/// The camera mask as it stands in the source's settings.
fn describe(mask: &CameraMask) -> &'static str {
    match mask {
        CameraMask::Auto => "found",
        CameraMask::File(_) => "from file",
        CameraMask::None => "off",
    }
}
