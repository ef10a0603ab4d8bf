//! GigE Vision over loopback with aravis' cameras that are software: one sends range over the network as a 3D camera does (its
//! description is `camera_3d.xml`), one colours in this process.
#![cfg(feature = "aravis")]

use aravis::GvFakeCamera;
use semascan_inspection::source::Source;
use semascan_sources::OpenOptions;
use std::path::Path;
use std::time::Duration;
use std::{fs, thread};

/// Lenses of both: the range camera beside the colour camera.
fn describe(folder: &Path) {
    let color = r#"{ "width": 160, "height": 120, "intrinsic_matrix": [500.0, 0, 0, 0, 500.0, 0, 79.5, 59.5, 1] }"#;
    let depth = r#"{ "width": 160, "height": 120, "intrinsic_matrix": [500.0, 0, 0, 0, 500.0, 0, 79.5, 59.5, 1],
        "color_from_depth": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1] }"#;
    fs::write(folder.join("camera_intrinsic.json"), color).expect("written");
    fs::write(folder.join("depth_intrinsic.json"), depth).expect("written");
}

/// A range camera on the loopback interface; `None` where the port of GigE Vision is taken.
fn plugged_in() -> Option<GvFakeCamera> {
    let description = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/camera_3d.xml");
    let camera = GvFakeCamera::new_full(Some("127.0.0.1"), Some("GV01"), description.to_str());
    camera.is_running().then_some(camera)
}

fn open(uri: &str) -> Result<Box<dyn Source>, String> {
    semascan_genicam::open(uri, OpenOptions::default()).map_err(|error| error.to_string())
}

/// One test: cameras of both have one name in the whole process.
#[test]
fn frames_of_two_cameras_become_views_though_the_one_on_the_network_is_unplugged() {
    let folder = tempfile::tempdir().expect("a folder");
    describe(folder.path());
    let Some(camera) = plugged_in() else {
        eprintln!("SKIPPED: aravis' fake camera does not get its port at 127.0.0.1: no GigE Vision is tried");
        return;
    };
    let uri = |query: &str| format!("genicam:Fake_1?depth=Aravis-Fake-GV01&cameras={}{query}", folder.path().display());
    let said = open("genicam:Nobody-7").err().expect("nobody answers");
    assert!(said.contains("Nobody-7") && said.contains("arv-tool"), "{said}");
    let said = open("genicam:Fake_1?depth=Aravis-Fake-GV01").err().expect("no lenses");
    assert!(said.contains("cameras=FOLDER"), "{said}");
    let said = open(&uri("&pixel_format=Rainbow")).err().expect("no such format");
    assert!(said.contains("Rainbow") && said.contains("Mono8"), "{said}");

    let mut source = open(&uri("&exposure_us=5000&silence_s=20&size=160x120&pixel_format=RGB8&depth_format=Mono16"))
        .expect("two cameras");
    let settings = source.info().settings.clone();
    let setting = |name: &str| settings.iter().find(|(key, _)| key == name).map_or("", |(_, value)| value.as_str());
    assert_eq!((setting("exposure_us"), setting("depth_unit")), ("5000", "0.5000 mm"), "{settings:?}");
    let next = |source: &mut dyn Source| {
        let view = loop {
            // A frame may be cut on a busy machine: it is named and the next one taken.
            match source.next_view().expect("a view") {
                Ok(view) => break view,
                Err(error) => assert!(error.to_string().contains("not whole"), "{error}"),
            }
        };
        assert_eq!((view.intrinsics.width, view.intrinsics.height, view.intrinsics.fx), (160, 120, 500.0));
        let measured: Vec<f32> = view.depth.metres.iter().copied().filter(|z| *z > 0.0).collect();
        // The pattern goes through the range of 16 bits: 0.1 m and half a millimetre a step.
        assert!(measured.len() > 160 * 120 / 2, "{} pixels", measured.len());
        assert!(measured.iter().all(|z| (0.1..=0.1 + 65.536 * 0.5).contains(z)));
        let colors: std::collections::BTreeSet<[u8; 3]> = view.rgb.pixels().map(|pixel| pixel.0).collect();
        assert!(colors.len() > 50, "{} colours", colors.len());
    };
    for _ in 0..3 {
        next(source.as_mut());
    }
    drop(camera);
    let back = thread::spawn(|| {
        thread::sleep(Duration::from_secs(2));
        (0..50).find_map(|_| {
            let camera = plugged_in();
            if camera.is_none() {
                thread::sleep(Duration::from_millis(100));
            }
            camera
        })
    });
    next(source.as_mut());
    assert!(back.join().expect("no panic").is_some(), "the camera got its port again");
}
