//! `semascan export --texture`.

use crate::{MOTOR, semascan, stderr};
use std::fs;
use std::path::Path;

/// Larger pictures than other tests need, so that they show something.
const SEEN: &str = "virtual:starter-motor?seed=3&views=5&size=240x180&cell=2.5";

#[test]
fn the_photographs_of_an_inspection_become_a_texture() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let path = |name: &str| dir.path().join(name).to_str().expect("UTF-8").to_owned();
    let (motor, out) = (path("motor"), path("out"));
    assert_eq!(semascan(&["inspect", SEEN, "--out", &motor]).status.code(), Some(0));
    let output = semascan(&["export", &motor, "--format", "glb,obj", "--texture", "--out", &out]);
    let said = stderr(&output);
    assert_eq!(output.status.code(), Some(0), "{said}");
    for expected in ["MB, texel ", " charts of 5 photographs", " % of the surface (", "in no photograph: grey, alpha 0"]
    {
        assert!(said.contains(expected), "{expected} in {said}");
    }
    let mut names: Vec<_> = fs::read_dir(&out).expect("reads").filter_map(Result::ok).map(|e| e.file_name()).collect();
    names.sort();
    assert_eq!(names, ["mesh.glb", "mesh.mtl", "mesh.obj", "mesh.png"]);
    let bytes = |name: &str| fs::read(Path::new(&out).join(name)).expect("written");
    let atlas = image::load_from_memory(&bytes("mesh.png")).expect("a picture").into_rgba8();
    assert!(atlas.width().is_multiple_of(4) && atlas.height().is_multiple_of(4) && atlas.width() <= 8192);
    let seen = atlas.pixels().filter(|texel| texel.0[3] == 255).count();
    let grey = atlas.pixels().filter(|texel| texel.0 == [128, 128, 128, 0]).count();
    assert_eq!(seen + grey, (atlas.width() * atlas.height()) as usize);
    assert!(seen > grey, "charts lie close: {seen} texels of them, {grey} others");
    assert!(String::from_utf8_lossy(&bytes("mesh.mtl")).contains("\nmap_Kd mesh.png\n"));

    let scene = gltf::Gltf::from_slice(&bytes("mesh.glb")).expect("valid");
    let blob = scene.blob.as_deref().expect("a buffer");
    let Some(gltf::image::Source::View { view, .. }) = scene.images().next().map(|image| image.source()) else {
        panic!("the picture is in the file");
    };
    assert!(&blob[view.offset()..][..view.length()] == bytes("mesh.png").as_slice(), "both files have one picture");
    // What the texture shows is near to what the vertices have, which the same photographs gave.
    let (mut count, mut apart, mut unseen) = (0_u32, 0.0, 0_u32);
    for primitive in scene.meshes().flat_map(|mesh| mesh.primitives()) {
        let reader = primitive.reader(|_| Some(blob));
        let places: Vec<[f32; 2]> = reader.read_tex_coords(0).expect("places").into_f32().collect();
        let colors = primitive.get(&gltf::Semantic::Extras("VERTEX_COLOR".into())).expect("colours");
        let colors = gltf::accessor::Iter::<[u16; 4]>::new(colors, |_| Some(blob)).expect("numbers");
        for (place, color) in places.iter().zip(colors) {
            assert!(place.iter().all(|c| (0.0..=1.0).contains(c)), "{place:?}");
            let at = |share: f32, size: u32| ((share * size as f32) as u32).min(size - 1);
            let texel = atlas.get_pixel(at(place[0], atlas.width()), at(place[1], atlas.height())).0;
            if texel[3] == 0 {
                unseen += 1;
                continue;
            }
            count += 1;
            let level = |light: u16| {
                let light = f32::from(light) / 65535.0;
                let value = if light <= 0.003_130_8 { 12.92 * light } else { 1.055 * light.powf(1.0 / 2.4) - 0.055 };
                255.0 * value
            };
            apart += (0..3).map(|k| (level(color[k]) - f32::from(texel[k])).abs()).sum::<f32>() / 3.0;
        }
    }
    let mean = apart / count as f32;
    assert!(count > 1000 && mean < 25.0 && unseen < count, "{count} vertices, {mean} levels apart, {unseen} unseen");

    // Texels as long as asked for.
    let coarse = path("coarse");
    let output = semascan(&["export", &motor, "--format", "glb", "--texture", "--texel", "4", "--out", &coarse]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(stderr(&output).contains("texel 4.000 mm"), "{}", stderr(&output));
    assert!(fs::metadata(Path::new(&coarse).join("mesh.glb")).expect("written").len() < bytes("mesh.glb").len() as u64);
}

#[test]
fn photographs_are_taken_from_the_capture_and_missed_where_there_are_none() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let path = |name: &str| dir.path().join(name).to_str().expect("UTF-8").to_owned();
    let (data, out) = (path("data"), path("out"));
    let output = semascan(&["inspect", MOTOR, "--data", &data]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let kept = fs::read_dir(Path::new(&data).join("inspections")).expect("reads").next().expect("one").expect("reads");
    let kept = kept.path().to_str().expect("UTF-8").to_owned();
    let output = semascan(&["export", &kept, "--format", "glb", "--texture", "--out", &out]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(stderr(&output).contains("of 3 photographs"), "{}", stderr(&output));

    let wrong = |args: &[&str], expected: &str| {
        let output = semascan(&[&["export"], args, &["--texture", "--out", &path("wrong")]].concat());
        assert_eq!((output.status.code(), stderr(&output).contains(expected)), (Some(2), true), "{}", stderr(&output));
        assert!(!Path::new(&path("wrong")).join("mesh.glb").exists());
    };
    wrong(&[&kept, "--format", "ply"], "--texture is for glb and obj");
    wrong(&[&kept, "--format", "glb,stl"], "--texture is for glb and obj");
    wrong(&[&kept, "--format", "glb", "--colors", "classes"], "does not go with --colors classes");
    wrong(&[&kept, "--format", "glb", "--photographs", &path("nowhere")], "its photographs are not there");
    wrong(&[&kept, "--format", "glb", "--texel", "0"], "--texel");
    let file = format!("{kept}/mesh.ply");
    wrong(&[&file, "--format", "glb"], "a file alone has no photographs");
    let output = semascan(&["export", &kept, "--format", "glb", "--texel", "1", "--out", &path("wrong")]);
    assert_eq!(output.status.code(), Some(2), "--texel alone: {}", stderr(&output));
}
