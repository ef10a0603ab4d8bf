//! A camera as a source of views.

use super::{Camera, CameraError, Capture, DepthCamera, Timing};
use crate::OpenOptions;
use crate::bop::mask;
use crate::camera_model::Aligner;
use crate::recorded_pose::{OF_ROBOTS, evidence};
use nalgebra::Isometry3;
use semascan_inspection::source::{Source, SourceError, SourceInfo};
use semascan_inspection::spec::CameraMask;
use semascan_model::Taxonomy;
use semascan_perception::view::View;
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

/// How long a camera is waited for at once: an inspection that is stopped waits no longer than this.
const PATIENCE: Duration = Duration::from_millis(200);
/// Pause before a camera that is lost is looked for again.
const PAUSE: Duration = Duration::from_millis(500);

/// Connects to a camera; the error says why it cannot be reached.
type Connect = Box<dyn FnMut() -> Result<Box<dyn Camera>, String> + Send>;

/// Views of a camera.
pub struct CameraSource {
    info: SourceInfo,
    timing: Timing,
    connect: Connect,
    /// `None` while it is lost.
    camera: Option<Box<dyn Camera>>,
    aligner: Aligner,
    /// Pixels that show the robot, row-major.
    ignore: Option<Vec<bool>>,
    counts: Counts,
    /// When the last capture came, or the camera was opened.
    heard: Instant,
    /// When the last view was taken.
    taken: Option<Instant>,
    is_over: bool,
}

/// What became of what came.
#[derive(Clone, Copy, Debug, Default)]
struct Counts {
    views: u32,
    unusable: u32,
    lost: u32,
}

impl CameraSource {
    /// Connects to a camera by `connect`, which is called again when it is lost.
    ///
    /// # Errors
    /// [`SourceError::Uri`] if it cannot be reached, or an option cannot be used with a camera; [`SourceError`] naming a camera
    /// mask that cannot be read.
    pub fn open(
        uri: &str,
        timing: Timing,
        options: &OpenOptions,
        connect: impl FnMut() -> Result<Box<dyn Camera>, String> + Send + 'static,
    ) -> Result<Self, SourceError> {
        let refuse = |reason: String| SourceError::Uri { uri: uri.to_owned(), reason };
        if options.unit.is_some() || options.depth_scale.is_some() {
            return Err(refuse("a camera says itself what a length is: no other unit can be given".to_owned()));
        }
        let ignore = match &options.camera_mask {
            CameraMask::File(file) => Some(mask::read(file)?.inside),
            CameraMask::None | CameraMask::Auto => None,
        };
        let mut connect: Connect = Box::new(connect);
        let camera = connect().map_err(refuse)?;
        let info = SourceInfo {
            uri: uri.to_owned(),
            part: "part before a camera".into(),
            taxonomy: Taxonomy::from_names::<&str>(&[], &[]),
            view_count: timing.views,
            turntable: None,
            volume: None,
            no_labels: Some("cameras have no labels".into()),
            settings: camera.description(),
        };
        Ok(Self {
            info,
            timing,
            connect,
            camera: Some(camera),
            aligner: Aligner::default(),
            ignore,
            counts: Counts::default(),
            heard: Instant::now(),
            taken: None,
            is_over: false,
        })
    }

    fn fault(&self, reason: String) -> SourceError {
        SourceError::Uri { uri: self.info.uri.clone(), reason }
    }

    /// The end: says what became of what came.
    fn end(&mut self) {
        self.is_over = true;
        let Counts { views, unusable, lost } = self.counts;
        let said =
            format!("{views} captures became views, {unusable} could not be used; the camera was lost {lost} times");
        tracing::info!("{}: {said}", self.info.uri);
        self.info.settings.push(("captures".to_owned(), said));
    }

    /// Asks the camera, or looks for it; why it is not there, where it cannot be found.
    fn ask(&mut self) -> Result<Option<Capture>, CameraError> {
        if let Some(camera) = &mut self.camera {
            let asked = camera.capture(PATIENCE);
            if let Err(CameraError::Lost(reason)) = &asked {
                tracing::warn!("{}: the camera is lost ({reason}); it is looked for", self.info.uri);
                self.counts.lost += 1;
                self.camera = None;
                return Ok(None);
            }
            return asked;
        }
        match (self.connect)() {
            Ok(camera) => {
                tracing::info!("{}: the camera is there again", self.info.uri);
                self.camera = Some(camera);
                Ok(None)
            }
            Err(reason) => {
                thread::sleep(PAUSE);
                Err(CameraError::Lost(reason))
            }
        }
    }

    /// The view of a capture; the error says what is wrong with it.
    fn view(&mut self, capture: Capture) -> Result<View, String> {
        let Capture { stamp, color, color_camera, depth, depth_camera } = capture;
        let DepthCamera { model, color_from_depth } = match depth_camera {
            Some(camera) => camera,
            // The pixels of the colour picture, behind the same lens.
            None => DepthCamera { model: color_camera.clone(), color_from_depth: Isometry3::identity() },
        };
        let names = ("the colour picture", "the depth picture");
        let (intrinsics, rgb, mut depth) =
            self.aligner.align(names, (color_camera, color), (model, depth), &color_from_depth)?;
        if let Some(ignore) = &self.ignore {
            if ignore.len() != depth.metres.len() {
                return Err(format!("{} pixels, but the camera mask has {}", depth.metres.len(), ignore.len()));
            }
            depth.metres.iter_mut().zip(ignore).filter(|(_, ignored)| **ignored).for_each(|(z, _)| *z = 0.0);
        }
        if depth.metres.iter().all(|z| *z <= 0.0) {
            return Err("no depth in the whole picture".to_owned());
        }
        let view = View {
            index: self.counts.views + self.counts.unusable,
            stamp,
            intrinsics,
            rgb: Arc::new(rgb),
            depth: Arc::new(depth),
            pose: evidence(None, OF_ROBOTS),
            labels: None,
            truth: None,
        };
        view.check_sizes().map_err(|error| error.to_string())?;
        Ok(view)
    }
}

impl Source for CameraSource {
    fn info(&self) -> &SourceInfo {
        &self.info
    }

    fn next_view(&mut self) -> Option<Result<View, SourceError>> {
        if self.timing.views.is_some_and(|views| self.counts.views >= views) && !self.is_over {
            self.end();
        }
        if let Some(taken) = self.taken {
            thread::sleep(self.timing.interval.saturating_sub(taken.elapsed()));
        }
        // The time in which the last view was waited for by nobody is no silence.
        self.heard = Instant::now();
        while !self.is_over {
            let asked = self.ask();
            let is_silent = self.heard.elapsed() > self.timing.silence;
            let unusable = match asked {
                Ok(Some(capture)) => {
                    self.taken = Some(Instant::now());
                    match self.view(capture) {
                        Ok(view) => {
                            self.counts.views += 1;
                            return Some(Ok(view));
                        }
                        Err(reason) => reason,
                    }
                }
                Err(CameraError::Unusable(reason)) => reason,
                Ok(None) if is_silent && self.camera.is_some() => {
                    self.end();
                    let seconds = self.timing.silence.as_secs_f64();
                    let reason = format!("the camera is there, but no capture came for {seconds} s");
                    return (self.counts.views == 0).then(|| Err(self.fault(reason)));
                }
                Err(CameraError::Lost(reason)) if is_silent => {
                    self.end();
                    let seconds = self.timing.silence.as_secs_f64();
                    return Some(Err(self.fault(format!("the camera has been lost for {seconds} s: {reason}"))));
                }
                Ok(None) | Err(CameraError::Lost(_)) => continue,
            };
            self.counts.unusable += 1;
            let number = self.counts.views + self.counts.unusable - 1;
            return Some(Err(self.fault(format!("view {number}: {unusable}"))));
        }
        None
    }
}
