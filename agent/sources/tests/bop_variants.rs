//! BOP scenes as other programs write them: every encoding of masks, depths, names and units holds the same views, and what
//! cannot be known is refused by name.

use image::{DynamicImage, GrayAlphaImage, GrayImage, Luma, LumaA, Rgb, RgbImage, Rgba, RgbaImage};
use semascan_inspection::source::{Source, SourceError};
use semascan_inspection::spec::{CameraMask, LengthUnit};
use semascan_perception::view::{PoseEvidence, View};
use semascan_sources::OpenOptions;
use semascan_sources::bop::BopSource;
use serde_json::{Map, Value, json};
use std::fs::{self, File};
use std::io::BufWriter;
use std::path::Path;
use tiff::encoder::{TiffEncoder, colortype};

const SIZE: (u32, u32) = (64, 48);
const VIEWS: u32 = 4;

/// How a mask is stored.
#[derive(Clone, Copy, Debug, PartialEq)]
enum MaskAs {
    Grey255,
    Grey1,
    Sixteen1,
    OneBit,
    TwoBit,
    Palette,
    PaletteOneBit,
    BlackPalette,
    Color,
    Alpha,
    GreyAlpha,
    OpaqueColor,
    Tiff,
    FloatTiff,
    Jpeg,
}

const MASKS: [MaskAs; 15] = [
    MaskAs::Grey255,
    MaskAs::Grey1,
    MaskAs::Sixteen1,
    MaskAs::OneBit,
    MaskAs::TwoBit,
    MaskAs::Palette,
    MaskAs::PaletteOneBit,
    MaskAs::BlackPalette,
    MaskAs::Color,
    MaskAs::Alpha,
    MaskAs::GreyAlpha,
    MaskAs::OpaqueColor,
    MaskAs::Tiff,
    MaskAs::FloatTiff,
    MaskAs::Jpeg,
];

/// How depth is stored; with the millimetres of a 1.
#[derive(Clone, Copy, Debug, PartialEq)]
enum DepthAs {
    Png(f64),
    Tiff16(f64),
    Tiff32(f64),
    TiffSigned(f64),
    Float(f64),
    Double(f64),
}

const DEPTHS: [DepthAs; 9] = [
    DepthAs::Png(0.1),
    DepthAs::Png(1.0),
    DepthAs::Tiff16(0.1),
    DepthAs::Tiff32(0.01),
    DepthAs::TiffSigned(0.1),
    DepthAs::Float(1.0),
    DepthAs::Float(1000.0),
    DepthAs::Float(0.1),
    DepthAs::Double(1000.0),
];

/// A scene and how it is written.
#[derive(Clone, Copy, Debug)]
struct Variant {
    mask: MaskAs,
    depth: DepthAs,
    digits: usize,
    color: &'static str,
    /// Millimetres of a translation of 1.
    translation: f64,
    /// Whether `depth_scale` says what a depth of 1 is.
    scale_written: bool,
    mark: bool,
}

const PLAIN: Variant = Variant {
    mask: MaskAs::Grey255,
    depth: DepthAs::Png(0.1),
    digits: 6,
    color: "rgb/png",
    translation: 1.0,
    scale_written: true,
    mark: false,
};

/// Depth in metres: a floor that rises to the right, with a step, so that views from elsewhere differ.
fn depth(view: u32, x: u32, y: u32) -> f64 {
    let (u, v) = ((f64::from(x) - 31.5) / 60.0, (f64::from(y) - 23.5) / 60.0);
    let shift = 0.03 * f64::from(view);
    // The plane z = 0.5 + 0.4 (x + shift) + 0.2 y in the first camera's frame, seen from `shift` along x.
    (0.5 + 0.4 * shift) / (1.0 - 0.4 * u - 0.2 * v)
}

/// Whether the pixel shows object 0 or 1 of the scene.
fn shows(object: u32, x: u32, y: u32) -> bool {
    (12..32).contains(&y) && if object == 0 { (8..24).contains(&x) } else { (32..56).contains(&x) }
}

impl Variant {
    fn write(&self, folder: &Path) {
        let (kind, ending) = self.color.split_once('/').expect("folder and ending");
        for name in [kind, "depth", "mask_visib"] {
            fs::create_dir_all(folder.join(name)).expect("made");
        }
        let (mut cameras, mut truth) = (Map::new(), Map::new());
        for view in 0..VIEWS {
            let name = format!("{view:0width$}", width = self.digits);
            let color = RgbImage::from_fn(SIZE.0, SIZE.1, |x, y| Rgb([x as u8, y as u8, 90]));
            let path = folder.join(kind).join(format!("{name}.{ending}"));
            match kind {
                "gray" => DynamicImage::from(color).to_luma8().save(path).expect("saved"),
                _ => color.save(path).expect("saved"),
            }
            self.write_depth(view, &folder.join("depth").join(&name));
            // The lists are in another order in every other view.
            let order: [u32; 2] = if view % 2 == 0 { [0, 1] } else { [1, 0] };
            for (place, object) in order.iter().enumerate() {
                let name = format!("{name}_{place:0width$}", width = self.digits);
                self.write_mask(&folder.join("mask_visib").join(name), |x, y| shows(*object, x, y));
            }
            let per_one = match self.depth {
                DepthAs::Png(mm) | DepthAs::Tiff16(mm) | DepthAs::Tiff32(mm) => mm,
                DepthAs::TiffSigned(mm) | DepthAs::Float(mm) | DepthAs::Double(mm) => mm,
            };
            cameras.insert(
                view.to_string(),
                json!({
                    "cam_K": [60.0, 0.0, 31.5, 0.0, 60.0, 23.5, 0.0, 0.0, 1.0],
                    "depth_scale": if self.scale_written { per_one } else { 0.1 },
                    "cam_R_w2c": [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
                    "cam_t_w2c": [-30.0 * f64::from(view) / self.translation, 0.0, 0.0],
                }),
            );
            truth.insert(view.to_string(), order.map(|object| json!({ "obj_id": 7 + object })).to_vec().into());
        }
        let mark = if self.mark { "\u{feff}" } else { "" };
        for (name, value) in [("scene_camera.json", cameras), ("scene_gt.json", truth)] {
            fs::write(folder.join(name), format!("{mark}{}", Value::Object(value))).expect("written");
        }
    }

    fn write_depth(&self, view: u32, path: &Path) {
        let value = |mm: f64| {
            (0..SIZE.0 * SIZE.1).map(move |i| match i {
                // Not measured.
                0 => 0.0,
                _ => depth(view, i % SIZE.0, i / SIZE.0) * 1e3 / mm,
            })
        };
        let tiff = || BufWriter::new(File::create(path.with_extension("tif")).expect("made"));
        macro_rules! tiff {
            ($color:ty, $number:ty, $mm:expr) => {{
                let values: Vec<$number> = value($mm).map(|v| v as $number).collect();
                let mut encoder = TiffEncoder::new(tiff()).expect("begun");
                encoder.write_image::<$color>(SIZE.0, SIZE.1, &values).expect("written");
            }};
        }
        match self.depth {
            DepthAs::Png(mm) => {
                let values: Vec<u16> = value(mm).map(|v| v.round() as u16).collect();
                let picture = image::ImageBuffer::<Luma<u16>, _>::from_raw(SIZE.0, SIZE.1, values).expect("fits");
                picture.save(path.with_extension("png")).expect("saved");
            }
            DepthAs::Tiff16(mm) => tiff!(colortype::Gray16, u16, mm),
            DepthAs::Tiff32(mm) => tiff!(colortype::Gray32, u32, mm),
            DepthAs::TiffSigned(mm) => tiff!(colortype::GrayI32, i32, mm),
            DepthAs::Float(mm) => tiff!(colortype::Gray32Float, f32, mm),
            DepthAs::Double(mm) => tiff!(colortype::Gray64Float, f64, mm),
        }
    }

    fn write_mask(&self, path: &Path, inside: impl Fn(u32, u32) -> bool) {
        let (w, h) = SIZE;
        let at = |x: u32, y: u32| u8::from(inside(x, y));
        let png = path.with_extension("png");
        let packed = |bits: u32| -> Vec<u8> {
            let mut bytes = vec![0_u8; (w * bits / 8 * h) as usize];
            for (x, y) in (0..h).flat_map(|y| (0..w).map(move |x| (x, y))) {
                let bit = x * bits;
                bytes[(y * (w * bits / 8) + bit / 8) as usize] |= at(x, y) << (8 - bits - bit % 8);
            }
            bytes
        };
        let save = |picture: DynamicImage| picture.save(&png).expect("saved");
        let raw = |color, depth, palette: Option<&[u8]>, data: &[u8]| {
            let mut encoder = png::Encoder::new(BufWriter::new(File::create(&png).expect("made")), w, h);
            encoder.set_color(color);
            encoder.set_depth(depth);
            if let Some(palette) = palette {
                encoder.set_palette(palette.to_vec());
            }
            let mut writer = encoder.write_header().expect("header");
            writer.write_image_data(data).expect("data");
        };
        let plain: Vec<u8> = (0..h).flat_map(|y| (0..w).map(move |x| (x, y))).map(|(x, y)| at(x, y)).collect();
        match self.mask {
            MaskAs::Grey255 => save(GrayImage::from_fn(w, h, |x, y| Luma([255 * at(x, y)])).into()),
            MaskAs::Grey1 => save(GrayImage::from_fn(w, h, |x, y| Luma([at(x, y)])).into()),
            MaskAs::Sixteen1 => {
                let picture = image::ImageBuffer::<Luma<u16>, Vec<u16>>::from_fn(w, h, |x, y| Luma([at(x, y).into()]));
                save(picture.into());
            }
            MaskAs::OneBit => raw(png::ColorType::Grayscale, png::BitDepth::One, None, &packed(1)),
            MaskAs::TwoBit => raw(png::ColorType::Grayscale, png::BitDepth::Two, None, &packed(2)),
            MaskAs::Palette => {
                raw(png::ColorType::Indexed, png::BitDepth::Eight, Some(&[0, 0, 0, 128, 0, 0]), &plain);
            }
            MaskAs::PaletteOneBit => {
                // White is index 0: what counts is what a program shows.
                let inverse: Vec<u8> = packed(1).iter().map(|b| !b).collect();
                raw(png::ColorType::Indexed, png::BitDepth::One, Some(&[255, 255, 255, 0, 0, 0]), &inverse);
            }
            MaskAs::BlackPalette => raw(png::ColorType::Indexed, png::BitDepth::Eight, Some(&[0; 6]), &plain),
            MaskAs::Color => save(RgbImage::from_fn(w, h, |x, y| Rgb([0, 200 * at(x, y), 0])).into()),
            MaskAs::Alpha => save(RgbaImage::from_fn(w, h, |x, y| Rgba([255, 255, 255, 255 * at(x, y)])).into()),
            MaskAs::GreyAlpha => save(GrayAlphaImage::from_fn(w, h, |x, y| LumaA([0, 255 * at(x, y)])).into()),
            MaskAs::OpaqueColor => save(RgbaImage::from_fn(w, h, |x, y| Rgba([at(x, y), 0, 0, 255])).into()),
            MaskAs::Tiff => {
                let picture = GrayImage::from_fn(w, h, |x, y| Luma([at(x, y)]));
                picture.save(path.with_extension("tif")).expect("saved");
            }
            MaskAs::FloatTiff => {
                let values: Vec<f32> = plain.iter().map(|v| f32::from(*v)).collect();
                let file = BufWriter::new(File::create(path.with_extension("tiff")).expect("made"));
                let mut encoder = TiffEncoder::new(file).expect("begun");
                encoder.write_image::<colortype::Gray32Float>(w, h, &values).expect("written");
            }
            MaskAs::Jpeg => {
                let picture = GrayImage::from_fn(w, h, |x, y| Luma([255 * at(x, y)]));
                picture.save(path.with_extension("jpg")).expect("saved");
            }
        }
    }
}

fn views(folder: &Path, options: OpenOptions) -> Result<(BopSource, Vec<View>), SourceError> {
    let mut source = BopSource::open(folder, options)?;
    let views: Result<Vec<View>, SourceError> = std::iter::from_fn(|| source.next_view()).collect();
    views.map(|views| (source, views))
}

fn unmasked() -> OpenOptions {
    OpenOptions { camera_mask: CameraMask::None, ..OpenOptions::default() }
}

fn setting(source: &BopSource, name: &str) -> String {
    let found = source.info().settings.iter().find(|(key, _)| key == name);
    found.map(|(_, value)| value.clone()).unwrap_or_default()
}

/// Writes the scene, reads it, and compares every pixel with what was written.
fn check(variant: Variant) {
    let dir = tempfile::tempdir().expect("folder");
    variant.write(dir.path());
    let (source, views) = views(dir.path(), unmasked()).unwrap_or_else(|e| panic!("{variant:?}: {e}"));
    assert_eq!(views.len() as u32, VIEWS, "{variant:?}");
    assert_eq!(source.info().no_labels, None, "{variant:?}");
    let mut number = [0_u16; 2];
    for view in &views {
        let labels = view.labels.as_ref().unwrap_or_else(|| panic!("{variant:?}: labels"));
        for (x, y) in (0..SIZE.1).flat_map(|y| (0..SIZE.0).map(move |x| (x, y))) {
            let i = (y * SIZE.0 + x) as usize;
            let expected = if i == 0 { 0.0 } else { depth(view.index, x, y) };
            let off = (f64::from(view.depth.metres[i]) - expected).abs();
            assert!(off < 1.1e-3, "{variant:?}: depth of {x}, {y} is {} m, not {expected}", view.depth.metres[i]);
            // JPEG blurs the border.
            let border = |object| (0..9).any(|k| shows(object, x + k % 3, y + k / 3) != shows(object, x + 1, y + 1));
            if variant.mask == MaskAs::Jpeg && x > 0 && y > 0 && (border(0) || border(1)) {
                continue;
            }
            let object = (0..2).find(|object| shows(*object, x, y));
            assert_eq!(labels.components[i], object.map_or(0, |o| o as u16 + 1), "{variant:?}: {x}, {y}");
            if let Some(object) = object {
                let known = &mut number[object as usize];
                assert!(labels.instances[i] > 0, "{variant:?}");
                assert!(
                    *known == 0 || *known == labels.instances[i],
                    "{variant:?}: instances change from view to view"
                );
                *known = labels.instances[i];
            }
        }
        let PoseEvidence::World { table_from_camera, .. } = &view.pose else { panic!("{variant:?}: a pose") };
        let x = table_from_camera.translation.vector.x;
        assert!((x - 0.03 * f64::from(view.index)).abs() < 1e-9, "{variant:?}: camera {} at {x} m", view.index);
    }
    assert_ne!(number[0], number[1], "{variant:?}");
}

#[test]
fn every_mask_and_every_depth_is_read_to_the_same_values() {
    for mask in MASKS {
        for depth in DEPTHS {
            check(Variant { mask, depth, ..PLAIN });
        }
    }
}

#[test]
fn names_formats_and_byte_order_marks_do_not_matter() {
    for color in ["rgb/png", "rgb/jpg", "rgb/jpeg", "rgb/tif", "rgb/tiff", "gray/tif", "gray/png", "rgb/webp"] {
        for digits in [4, 5, 6] {
            check(Variant { color, digits, mark: digits == 5, ..PLAIN });
        }
    }
}

/// The layout of scenes that several cameras saw: every name ends with the camera's.
#[test]
fn the_files_of_one_camera_of_several_make_the_scene_and_every_other_view_is_taken() {
    let dir = tempfile::tempdir().expect("folder");
    PLAIN.write(dir.path());
    let (_, whole) = views(dir.path(), unmasked()).expect("reads");
    for entry in ["rgb", "depth", "mask_visib"] {
        fs::rename(dir.path().join(entry), dir.path().join(format!("{entry}_cam1"))).expect("renamed");
    }
    for file in ["scene_camera", "scene_gt"] {
        let named = dir.path().join(format!("{file}_cam1.json"));
        fs::rename(dir.path().join(format!("{file}.json")), named).expect("renamed");
    }
    fs::write(dir.path().join("scene_camera_photo.json"), "{}").expect("written");
    for path in [dir.path().to_owned(), dir.path().join("scene_camera_cam1.json")] {
        let (source, found) = views(&path, unmasked()).expect("reads");
        assert_eq!((found.len(), source.info().no_labels.as_deref()), (whole.len(), None));
        assert!(source.info().part.ends_with(" cam1"), "{}", source.info().part);
        for (a, b) in found.iter().zip(&whole) {
            assert_eq!((&a.depth, &a.labels, &a.pose), (&b.depth, &b.labels, &b.pose));
        }
    }
    let (_, found) = views(dir.path(), OpenOptions { every: 2, ..unmasked() }).expect("reads");
    assert_eq!(found.iter().map(|view| view.index).collect::<Vec<_>>(), [0, 1]);
    assert_eq!(found[1].pose, whole[2].pose);
}

#[test]
fn translations_in_other_units_are_found_by_the_depth_and_said() {
    for (translation, name) in [(1000.0, "metres"), (1e-3, "thousandths")] {
        for depth in [DepthAs::Png(0.1), DepthAs::Float(1.0)] {
            let variant = Variant { translation, depth, ..PLAIN };
            check(variant);
            let dir = tempfile::tempdir().expect("folder");
            variant.write(dir.path());
            let source = BopSource::open(dir.path(), unmasked()).expect("opens");
            assert!(setting(&source, "pose_unit").contains(name), "{:?}", source.info().settings);
        }
    }
    let dir = tempfile::tempdir().expect("folder");
    PLAIN.write(dir.path());
    assert_eq!(setting(&BopSource::open(dir.path(), unmasked()).expect("opens"), "pose_unit"), "");
}

#[test]
fn a_factor_of_ten_is_refused_until_it_is_said_which_is_right() {
    let dir = tempfile::tempdir().expect("folder");
    Variant { translation: 10.0, ..PLAIN }.write(dir.path());
    let error = BopSource::open(dir.path(), unmasked()).expect_err("ambiguous").to_string();
    for word in ["scene_camera.json", "cam_t_w2c", "depth_scale", "10", "--unit", "--depth-scale"] {
        assert!(error.contains(word), "{error}");
    }
    let first_depth = |options| {
        let (_, views) = views(dir.path(), options).expect("said");
        let PoseEvidence::World { table_from_camera, .. } = &views[1].pose else { panic!("a pose") };
        (views[1].depth.at(32, 24).expect("depth"), table_from_camera.translation.vector.x)
    };
    let (z, x) = first_depth(OpenOptions { unit: Some(LengthUnit::Centimetres), ..unmasked() });
    assert!((z - depth(1, 32, 24) as f32).abs() < 1e-3 && (x - 0.03).abs() < 1e-9, "{z} {x}");
    let (z, x) = first_depth(OpenOptions { depth_scale: Some(0.01), ..unmasked() });
    assert!((z - 0.1 * depth(1, 32, 24) as f32).abs() < 1e-3 && (x - 0.003).abs() < 1e-9, "{z} {x}");
}

#[test]
fn a_missing_depth_scale_is_said_and_the_poses_correct_it() {
    let dir = tempfile::tempdir().expect("folder");
    for (depth, factor) in [(DepthAs::Png(1.0), None), (DepthAs::Png(0.1), Some("0.1"))] {
        Variant { depth, ..PLAIN }.write(dir.path());
        let path = dir.path().join("scene_camera.json");
        let text = fs::read_to_string(&path).expect("reads").replace("depth_scale", "no_scale");
        fs::write(&path, text).expect("written");
        let (source, views) = views(dir.path(), unmasked()).expect("reads");
        assert!(setting(&source, "depth_scale").contains("missing"), "{:?}", source.info().settings);
        assert_eq!(factor.is_some(), setting(&source, "depth_unit").contains(factor.unwrap_or("times")));
        let off = f64::from(views[1].depth.at(32, 24).expect("depth")) - self::depth(1, 32, 24);
        assert!(off.abs() < 1.1e-3, "{depth:?}: off by {off} m");
    }
}

#[test]
fn a_missing_depth_scale_is_that_of_the_depth_camera_that_is_named() {
    let dir = tempfile::tempdir().expect("folder");
    Variant { depth: DepthAs::Png(0.1), ..PLAIN }.write(dir.path());
    let path = dir.path().join("scene_camera.json");
    let text = fs::read_to_string(&path).expect("reads").replace("depth_scale", "no_scale");
    fs::write(&path, text).expect("written");
    let mut source =
        semascan_sources::open(&format!("{}?device=d405", dir.path().display()), unmasked()).expect("opens");
    let view = source.next_view().expect("a view").expect("is good");
    let off = f64::from(view.depth.at(32, 24).expect("depth")) - depth(0, 32, 24);
    assert!(off.abs() < 1.1e-4, "off by {off} m");
    let said = &source.info().settings;
    assert!(said.iter().any(|(name, text)| name == "depth_camera" && text.contains("D405")), "{said:?}");
    assert!(said.iter().all(|(name, _)| name != "depth_scale"), "nothing was assumed: {said:?}");
}

#[test]
fn floating_point_depth_says_what_it_was_taken_for() {
    for (depth, name) in [(DepthAs::Float(1000.0), "metres"), (DepthAs::Float(1.0), "millimetres")] {
        // `depth_scale` is that of the pictures it was made from.
        let variant = Variant { depth, scale_written: false, ..PLAIN };
        check(variant);
        let dir = tempfile::tempdir().expect("folder");
        variant.write(dir.path());
        let source = BopSource::open(dir.path(), unmasked()).expect("opens");
        assert!(setting(&source, "depth_unit").contains(name), "{:?}", source.info().settings);
    }
}

#[test]
fn a_missing_mask_is_an_error_unless_the_object_is_hidden() {
    let dir = tempfile::tempdir().expect("folder");
    PLAIN.write(dir.path());
    fs::remove_file(dir.path().join("mask_visib/000001_000000.png")).expect("removed");
    let error = views(dir.path(), unmasked()).expect_err("a mask is missing").to_string();
    assert!(error.contains("mask_visib/000001_000000.png") && error.contains("visib_fract"), "{error}");
    let hidden = |field: &str, value: f64| {
        let shown = json!({ "visib_fract": 0.5, "px_count_visib": 10 });
        let mut first = shown.clone();
        first[field] = json!(value);
        fs::write(dir.path().join("scene_gt_info.json"), json!({ "1": [first, shown] }).to_string()).expect("written");
        views(dir.path(), unmasked())
    };
    for field in ["visib_fract", "px_count_visib"] {
        let (_, views) = hidden(field, 0.0).expect("hidden");
        let labels = views[1].labels.as_ref().expect("labels");
        assert!(labels.components.contains(&1) && !labels.components.contains(&2));
    }
    assert!(hidden("visib_fract", 0.25).is_err());
}

#[test]
fn overlapping_masks_give_the_same_labels_in_any_order_and_are_counted() {
    let dir = tempfile::tempdir().expect("folder");
    PLAIN.write(dir.path());
    // The first object in every list covers all.
    for view in 0..VIEWS {
        let all = GrayImage::from_pixel(SIZE.0, SIZE.1, Luma([255]));
        all.save(dir.path().join(format!("mask_visib/{view:06}_{:06}.png", view % 2))).expect("saved");
    }
    let (source, views) = views(dir.path(), unmasked()).expect("reads");
    let first = views[0].labels.as_ref().expect("labels");
    assert!(views.iter().all(|v| v.labels.as_ref().is_some_and(|l| l.components == first.components)));
    let second = (0..SIZE.1).flat_map(|y| (0..SIZE.0).map(move |x| (x, y))).filter(|(x, y)| shows(1, *x, *y)).count();
    assert!(setting(&source, "mask_overlap").contains(&format!("{} pixels", VIEWS as usize * second)));
}

#[test]
fn a_scene_without_masks_or_objects_has_no_labels_and_says_why() {
    let dir = tempfile::tempdir().expect("folder");
    PLAIN.write(dir.path());
    let reason = || {
        let (source, views) = views(dir.path(), unmasked()).expect("opens");
        assert!(views.iter().all(|v| v.labels.is_none()));
        source.info().no_labels.clone().expect("a reason")
    };
    for file in fs::read_dir(dir.path().join("mask_visib")).expect("reads") {
        fs::remove_file(file.expect("a file").path()).expect("removed");
    }
    assert!(reason().contains("mask_visib") && reason().contains('8'), "{}", reason());
    fs::remove_dir(dir.path().join("mask_visib")).expect("removed");
    fs::create_dir(dir.path().join("mask")).expect("made");
    assert!(reason().contains("mask_visib") && reason().contains("mask/"), "{}", reason());
    let empty: Map<String, Value> = (0..VIEWS).map(|v| (v.to_string(), json!([]))).collect();
    fs::write(dir.path().join("scene_gt.json"), Value::Object(empty).to_string()).expect("written");
    assert!(reason().contains("lists no object"), "{}", reason());
    fs::remove_file(dir.path().join("scene_gt.json")).expect("removed");
    assert!(reason().contains("scene_gt.json is missing"), "{}", reason());
}

#[test]
fn labels_that_are_not_asked_for_are_not_looked_at() {
    let dir = tempfile::tempdir().expect("folder");
    PLAIN.write(dir.path());
    fs::write(dir.path().join("scene_gt.json"), "no JSON").expect("written");
    let (source, views) = views(dir.path(), OpenOptions { labels: false, ..unmasked() }).expect("opens");
    assert!(views.iter().all(|v| v.labels.is_none()));
    assert_eq!(source.info().taxonomy.component_count(), 1, "none");
    assert!(BopSource::open(dir.path(), unmasked()).is_err());
}

#[test]
fn a_view_without_depth_says_what_its_pixels_are() {
    let dir = tempfile::tempdir().expect("folder");
    PLAIN.write(dir.path());
    let saturated = image::ImageBuffer::<Luma<u16>, Vec<u16>>::from_pixel(SIZE.0, SIZE.1, Luma([65535]));
    saturated.save(dir.path().join("depth/000002.png")).expect("saved");
    let error = views(dir.path(), unmasked()).expect_err("no depth").to_string();
    assert!(error.contains("000002.png") && error.contains("no depth") && error.contains("3072 saturated"), "{error}");
    let mask = dir.path().join("all.png");
    GrayImage::from_pixel(SIZE.0, SIZE.1, Luma([1])).save(&mask).expect("saved");
    let options = OpenOptions { camera_mask: CameraMask::File(mask), ..OpenOptions::default() };
    let error = views(dir.path(), options).expect_err("all masked").to_string();
    assert!(error.contains("camera mask takes all"), "{error}");
}

#[test]
fn a_saturated_background_is_missing_depth_and_no_robot() {
    let dir = tempfile::tempdir().expect("folder");
    PLAIN.write(dir.path());
    for view in 0..VIEWS {
        let path = dir.path().join(format!("depth/{view:06}.png"));
        let mut picture = image::open(&path).expect("opens").into_luma16();
        picture.enumerate_pixels_mut().filter(|(_, y, _)| *y < 10).for_each(|(_, _, p)| p.0 = [65535]);
        picture.save(&path).expect("saved");
    }
    let (_, views) = views(dir.path(), OpenOptions::default()).expect("reads");
    for view in views {
        for (i, z) in view.depth.metres.iter().enumerate() {
            assert_eq!(*z > 0.0, i as u32 / SIZE.0 >= 10, "view {}: pixel {i} has {z} m", view.index);
        }
    }
}
