//! A camera of the test's own, which can be unplugged.

use super::*;
use crate::OpenOptions;
use crate::camera_model::Distortion;
use semascan_inspection::source::{Source, SourceError};
use semascan_perception::view::{Intrinsics, PoseEvidence, View};
use std::collections::VecDeque;
use std::sync::{Arc, Mutex};

const K: Intrinsics = Intrinsics { width: 16, height: 12, fx: 20.0, fy: 20.0, cx: 7.5, cy: 5.5 };

/// What the camera does when it is asked.
#[derive(Clone, Debug)]
enum Step {
    Take(u8),
    Spoil,
    Wait,
    Unplug,
    /// Not found when it is looked for.
    Missing,
}

struct Scripted(Arc<Mutex<VecDeque<Step>>>);

impl Camera for Scripted {
    fn description(&self) -> Vec<(String, String)> {
        vec![("camera".to_owned(), "of the test".to_owned())]
    }

    fn capture(&mut self, patience: Duration) -> Result<Option<Capture>, CameraError> {
        match self.0.lock().expect("no panic").pop_front() {
            Some(Step::Take(number)) => Ok(Some(capture(number))),
            Some(Step::Spoil) => Err(CameraError::Unusable("half a picture".to_owned())),
            Some(Step::Unplug) => Err(CameraError::Lost("no such device".to_owned())),
            Some(Step::Wait | Step::Missing) => Ok(None),
            None => {
                std::thread::sleep(patience);
                Ok(None)
            }
        }
    }
}

/// A wall before a depth camera that stands 20 mm beside the colour camera, which has twice its pixels.
fn capture(number: u8) -> Capture {
    let color = Intrinsics { width: 32, height: 24, fx: 40.0, fy: 40.0, cx: 15.5, cy: 11.5 };
    let model = |k| CameraModel::new(k, Distortion::None).expect("a camera");
    Capture {
        stamp: Some(f64::from(number)),
        color: RgbImage::from_pixel(32, 24, image::Rgb([number, 0, 0])),
        color_camera: model(color),
        depth: DepthImage { width: 16, height: 12, metres: vec![0.5; 16 * 12] },
        depth_camera: Some(DepthCamera { model: model(K), color_from_depth: Isometry3::translation(0.02, 0.0, 0.1) }),
    }
}

/// What a source says of itself.
type Settings = Vec<(String, String)>;

fn views(timing: &Timing, steps: &[Step]) -> (Vec<Result<View, SourceError>>, Settings) {
    let steps = Arc::new(Mutex::new(VecDeque::from(steps.to_vec())));
    let connect = move || -> Result<Box<dyn Camera>, String> {
        let is_missing = matches!(steps.lock().expect("no panic").front(), Some(Step::Missing));
        if is_missing {
            steps.lock().expect("no panic").pop_front();
            return Err("nothing is plugged in".to_owned());
        }
        Ok(Box::new(Scripted(Arc::clone(&steps))))
    };
    let options = OpenOptions::default();
    let mut source = CameraSource::open("test:1", timing.clone(), &options, connect).expect("a camera");
    let found = std::iter::from_fn(|| source.next_view()).take(20).collect();
    (found, source.info().settings.clone())
}

fn timing() -> Timing {
    Timing { silence: Duration::from_millis(900), ..Timing::default() }
}

#[test]
fn captures_become_views_with_depth_in_the_colour_camera_though_it_is_unplugged_between() {
    let steps = [Step::Take(1), Step::Wait, Step::Unplug, Step::Missing, Step::Take(2), Step::Spoil, Step::Take(3)];
    let (found, settings) = views(&timing(), &steps);
    let reds: Vec<_> = found.iter().map(|view| view.as_ref().map(|view| view.rgb.get_pixel(3, 3).0[0]).ok()).collect();
    assert_eq!(reds, [Some(1), Some(2), None, Some(3)]);
    let said = found[2].as_ref().expect_err("spoilt").to_string();
    assert!(said.contains("view 2: half a picture") && said.contains("test:1"), "{said}");
    let view = found[3].as_ref().expect("a view");
    assert_eq!((view.index, view.stamp, view.intrinsics.width), (3, Some(3.0), 32));
    assert_eq!(view.pose, PoseEvidence::None);
    let measured: Vec<f32> = view.depth.metres.iter().copied().filter(|z| *z > 0.0).collect();
    assert!(measured.len() > 400 && measured.iter().all(|z| (z - 0.6).abs() < 1e-5), "{} pixels", measured.len());
    let captures = &settings.iter().find(|(name, _)| name == "captures").expect("said").1;
    assert!(captures.starts_with("3 captures became views, 1 could not") && captures.ends_with("lost 1 times"));
    assert_eq!(settings[0].1, "of the test");
}

#[test]
fn it_ends_with_the_number_of_views_and_who_gives_nothing_is_named() {
    let limited = Timing { views: Some(2), ..timing() };
    assert_eq!(views(&limited, &[Step::Take(1), Step::Take(2), Step::Take(3)]).0.len(), 2);
    let (found, _) = views(&Timing { silence: Duration::from_millis(300), ..timing() }, &[]);
    assert!(found.len() == 1 && found[0].as_ref().expect_err("silent").to_string().contains("no capture"), "{found:?}");
    let gone: Vec<Step> = [Step::Take(1), Step::Unplug].into_iter().chain(vec![Step::Missing; 9]).collect();
    let (found, _) = views(&timing(), &gone);
    let said = found.last().expect("an end").as_ref().expect_err("it is gone").to_string();
    assert!(found.len() == 2 && said.contains("nothing is plugged in"), "{said}");
}

#[test]
fn pictures_that_are_not_of_their_camera_are_an_error_and_units_are_refused() {
    let timing = Timing { views: Some(1), ..timing() };
    let connect = || -> Result<Box<dyn Camera>, String> {
        struct Wrong;
        impl Camera for Wrong {
            fn description(&self) -> Vec<(String, String)> {
                Vec::new()
            }
            fn capture(&mut self, _: Duration) -> Result<Option<Capture>, CameraError> {
                let mut wrong = capture(0);
                wrong.depth = DepthImage { width: 16, height: 11, metres: vec![0.5; 16 * 11] };
                Ok(Some(wrong))
            }
        }
        Ok(Box::new(Wrong))
    };
    let mut source = CameraSource::open("test:2", timing.clone(), &OpenOptions::default(), connect).expect("a camera");
    let said = source.next_view().expect("an error").expect_err("another size").to_string();
    assert!(said.contains("depth picture"), "{said}");
    let scaled = OpenOptions { depth_scale: Some(1.0), ..OpenOptions::default() };
    assert!(CameraSource::open("test:2", timing, &scaled, connect).is_err());
}
