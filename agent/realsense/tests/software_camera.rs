//! A camera of librealsense2's own that is software: from its frames to views. The library is the one within PyPI's `pyrealsense2`,
//! of the Python that `SEMASCAN_FOREIGN_PYTHON` names.

use semascan_inspection::source::Source;
use semascan_realsense::library::software::{SoftwareDevice, SoftwareDevices, SoftwareStream};
use semascan_realsense::library::{Context, Devices, Intrinsics, Library, StreamKind};
use semascan_realsense::{RealsenseOptions, open_in};
use semascan_sources::OpenOptions;
use std::path::PathBuf;
use std::process::Command;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

/// Where the library lies, and that of Python, which it needs: one a line.
const ASK: &str = "import sysconfig, os, pyrealsense2 as p\n\
    folder = os.path.dirname(p.__file__)\n\
    print([os.path.join(folder, n) for n in os.listdir(folder) if n.startswith('pyrealsense2.') and n.endswith('.so')][0])\n\
    print(os.path.join(sysconfig.get_config_var('LIBDIR'), sysconfig.get_config_var('INSTSONAME')))";

/// The library, or why it is not here.
fn library() -> Result<Library, String> {
    let python = std::env::var("SEMASCAN_FOREIGN_PYTHON").map_err(|_| "SEMASCAN_FOREIGN_PYTHON is not set")?;
    let output = Command::new(python).args(["-c", ASK]).output().map_err(|error| error.to_string())?;
    if !output.status.success() {
        return Err("the foreign Python has no pyrealsense2".to_owned());
    }
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    let paths: Vec<PathBuf> = said.lines().map(PathBuf::from).collect();
    let [wheel, python] = paths.as_slice() else { return Err(format!("no two paths: {said}")) };
    python_symbols(python)?;
    Library::load(wheel).map_err(|error| error.to_string())
}

/// Makes the symbols of Python known to what is loaded later: a wheel expects a Python around it.
#[cfg(unix)]
#[allow(unsafe_code)]
fn python_symbols(path: &std::path::Path) -> Result<(), String> {
    use libloading::os::unix::{Library, RTLD_GLOBAL, RTLD_NOW};
    // Nothing of it is called: it is loaded for its symbols, and never unloaded.
    let loaded = unsafe { Library::open(Some(path), RTLD_NOW | RTLD_GLOBAL) };
    loaded.map(std::mem::forget).map_err(|error| error.to_string())
}

#[cfg(not(unix))]
fn python_symbols(_: &std::path::Path) -> Result<(), String> {
    Err("wheels are loaded on Unix alone".to_owned())
}

const DEPTH: (u32, u32) = (32, 24);
const COLOR: (u32, u32) = (64, 48);
/// Metres of a depth of 1: not the usual one.
const UNIT: f32 = 0.0005;

fn stream(kind: StreamKind, size: (u32, u32)) -> SoftwareStream {
    let focal = f64::from(size.0);
    let pinhole = [focal, focal, f64::from(size.0 - 1) / 2.0, f64::from(size.1 - 1) / 2.0];
    SoftwareStream { kind, lens: Intrinsics { size, pinhole, model: 0, coefficients: [0.0; 5] }, rate: 30 }
}

fn camera(library: &Library, serial: &str) -> SoftwareDevice {
    let streams = [stream(StreamKind::Depth, DEPTH), stream(StreamKind::Color, COLOR)];
    SoftwareDevice::new(library, serial, streams, UNIT, 0.015).expect("a camera")
}

/// A camera whose pictures come until it is dropped: a wall at `0.5 m + 1 mm x` the number in red.
struct Running {
    device: Arc<Mutex<Option<SoftwareDevice>>>,
    plugged_in: Arc<SoftwareDevices>,
    is_over: Arc<AtomicBool>,
}

impl Running {
    fn start(device: SoftwareDevice, plugged_in: &Arc<SoftwareDevices>) -> Self {
        plugged_in.plug_in(&device);
        let device = Arc::new(Mutex::new(Some(device)));
        let is_over = Arc::new(AtomicBool::new(false));
        let (of_thread, end) = (Arc::clone(&device), Arc::clone(&is_over));
        thread::spawn(move || {
            for number in 0_u16.. {
                if end.load(Ordering::Relaxed) {
                    break;
                }
                let red = (number % 200) as u8;
                let depth = vec![1000 + 2 * u16::from(red); (DEPTH.0 * DEPTH.1) as usize];
                let color = [red, 20, 30].repeat((COLOR.0 * COLOR.1) as usize);
                let stamp = 1000.0 + 33.0 * f64::from(number);
                if let Some(device) = of_thread.lock().expect("no panic").as_mut() {
                    // A camera that nobody has started says so: it goes on.
                    let _ = device.send_depth(&depth, DEPTH.0, stamp);
                    let _ = device.send_color(&color, COLOR.0, stamp + 3.0);
                }
                thread::sleep(Duration::from_millis(15));
            }
        });
        Self { device, plugged_in: Arc::clone(plugged_in), is_over }
    }

    fn unplug(&self) {
        self.plugged_in.unplug();
        *self.device.lock().expect("no panic") = None;
    }

    fn plug_in(&self, device: SoftwareDevice) {
        self.plugged_in.plug_in(&device);
        *self.device.lock().expect("no panic") = Some(device);
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.is_over.store(true, Ordering::Relaxed);
    }
}

/// One test: the library has threads and lists of its own, which tests side by side would share.
#[test]
fn frames_become_views_though_the_camera_is_unplugged_between() {
    let library = match library() {
        Ok(library) => library,
        Err(why) => {
            eprintln!("SKIPPED: {why}: no RealSense camera is tried");
            return;
        }
    };
    let context = Context::new(&library).expect("a context");
    assert!(context.devices().expect("a list").is_empty(), "this machine has a RealSense camera: unplug it");
    let plugged_in = Arc::new(SoftwareDevices::default());
    let devices: Arc<dyn Devices> = Arc::clone(&plugged_in) as _;
    let wanted = RealsenseOptions::read("17?exposure_us=5000&gain=20&silence_s=6").expect("options");
    let options = OpenOptions::default();
    let open = |wanted: &RealsenseOptions| open_in(Arc::clone(&devices), "realsense:17", wanted, &options);
    let missing = open(&wanted).err().expect("nothing is plugged in").to_string();
    assert!(missing.contains("no RealSense camera") && missing.contains("realsense:17"), "{missing}");

    let device = camera(&library, "17");
    let running = Running::start(device, &plugged_in);
    let size = RealsenseOptions::read("17?color_size=1920x1080").expect("options");
    let said = open(&size).err().expect("no such stream").to_string();
    assert!(said.contains("1920x1080") && said.contains("64x48"), "{said}");
    let bright = RealsenseOptions::read("17?gain=500").expect("options");
    let said = open(&bright).err().expect("too much").to_string();
    assert!(said.contains("gain=500") && said.contains("128"), "{said}");

    let mut source = open(&wanted).expect("a camera");
    let settings = source.info().settings.clone();
    let setting = |name: &str| settings.iter().find(|(key, _)| key == name).map_or("", |(_, value)| value.as_str());
    assert!(setting("camera").contains("serial 17") && setting("depth_unit").contains("0.5"), "{settings:?}");
    assert_eq!((setting("color_exposure_us"), setting("color_gain")), ("5000", "20"));
    let mut last = 0;
    let mut next = |source: &mut dyn Source| {
        let view = source.next_view().expect("a view").expect("is good");
        let red = view.rgb.get_pixel(10, 10).0;
        assert_eq!(red[1..], [20, 30]);
        assert_eq!((view.intrinsics.width, view.intrinsics.fx, view.intrinsics.cx), (64, 64.0, 31.5));
        let metres = 0.5 + 1e-3 * f32::from(red[0]);
        let measured: Vec<f32> = view.depth.metres.iter().copied().filter(|z| *z > 0.0).collect();
        // Beside what the depth camera 15 mm to the side did not see, every pixel of the finer colour picture has a depth.
        assert!(measured.len() > 48 * 55 && measured.len() < 48 * 64, "{} pixels", measured.len());
        assert!(measured.iter().all(|z| (z - metres).abs() < 1e-6), "{red:?}: {:?}", measured.first());
        assert!(red[0] != last, "a view is no older than the question");
        last = red[0];
    };
    for _ in 0..3 {
        next(&mut source);
    }

    running.unplug();
    let back = thread::spawn({
        let library = library.clone();
        move || {
            thread::sleep(Duration::from_millis(1500));
            running.plug_in(camera(&library, "17"));
            running
        }
    });
    for _ in 0..2 {
        next(&mut source);
    }
    let running = back.join().expect("no panic");
    running.unplug();
    let said = source.next_view().expect("an end").expect_err("it is gone").to_string();
    assert!(said.contains("lost") && said.contains("17"), "{said}");
    assert!(source.next_view().is_none());
    let captures = &source.info().settings.last().expect("said").1;
    assert!(captures.contains("lost 2 times"), "{captures}");
}

#[test]
fn a_library_that_is_none_is_named() {
    let said = Library::load(&PathBuf::from("/no/librealsense2.so")).expect_err("no file").to_string();
    assert!(said.contains("/no/librealsense2.so") && said.contains("SEMASCAN_REALSENSE"), "{said}");
    #[cfg(target_os = "linux")]
    {
        let other = Library::load(&PathBuf::from("libm.so.6")).expect_err("another library").to_string();
        assert!(other.contains("libm.so.6") && other.contains("rs2_"), "{other}");
    }
}
