//! A cube and a plane behind it, drawn.

use super::*;
use crate::fixtures::{quad, taxonomy};
use semascan_model::SemanticMesh;

/// A wall at z = 0, 0.2 m wide, and a plate 0.1 m wide that floats 0.05 m over its middle; a defect covers the plate's right half.
fn scene_mesh() -> SemanticMesh {
    let mut mesh = SemanticMesh::default();
    quad(&mut mesh, [-0.1, -0.1], [0.1, 0.1], 0.0, 1, |_| 0);
    quad(&mut mesh, [-0.05, -0.05], [0.05, 0.05], 0.05, 2, |p| u16::from(p[0] > 0.0));
    mesh
}

fn from_above(size: (u32, u32)) -> Camera {
    Camera::of_all(&[[-0.1, -0.1, 0.0], [0.1, 0.1, 0.0]], Direction::Top.axes(), size).expect("points")
}

#[test]
fn what_lies_nearer_hides_and_has_its_colour() {
    let (mesh, taxonomy) = (scene_mesh(), taxonomy());
    let scene = Scene::in_class_colors(&mesh, &taxonomy);
    let camera = from_above((120, 120));
    let Rendering { image, depth } = render(&scene, &camera, &[]);
    let at = |p: [f64; 3]| {
        let (u, v, _) = camera.project(&p).expect("ahead");
        image.get_pixel(u.round() as u32, v.round() as u32).0
    };
    assert_eq!(image.get_pixel(0, 0).0, [255; 3], "nothing is white");
    let (wall, plate, defect) = (at([-0.08, 0.0, 0.0]), at([-0.03, 0.0, 0.05]), at([0.03, 0.0, 0.05]));
    // Component 1 is blue, 2 orange, the defect a full yellow.
    assert!(wall[2] > wall[0] && plate[0] > plate[2] && defect[2] + 40 < plate[2], "{wall:?} {plate:?} {defect:?}");
    let height = f64::from(depth.depths[depth.sample(&[0.0; 3]).expect("inside").0]);
    let expected = camera.project(&[0.0, 0.0, 0.05]).expect("ahead").2;
    assert!((height - expected).abs() < 1e-6, "{height} for {expected}");
    assert!(depth.shows(&[-0.08, 0.0, 0.0], 1e-4) && !depth.shows(&[0.0; 3], 1e-3), "the plate hides the wall");
    // No sample between two triangles is left open.
    let corner = |p: [f64; 3]| depth.camera.project(&p).map(|(u, v, _)| [u, v]).expect("ahead");
    let (low, high) = (corner([-0.1, 0.1, 0.0]), corner([0.1, -0.1, 0.0]));
    for y in low[1].ceil() as usize + 1..high[1] as usize {
        for x in low[0].ceil() as usize + 1..high[0] as usize {
            assert!(depth.depths[y * depth.width + x].is_finite(), "{x} {y}");
        }
    }
    let contour = at([-0.05, 0.02, 0.05]);
    assert!(contour.iter().map(|c| u32::from(*c)).sum::<u32>() < plate.iter().map(|c| u32::from(*c)).sum::<u32>());
}

#[test]
fn an_outline_is_drawn_where_nothing_hides_it() {
    let (mesh, taxonomy) = (scene_mesh(), taxonomy());
    let scene = Scene::in_class_colors(&mesh, &taxonomy);
    let camera = from_above((120, 120));
    // A bar on the wall that runs below the plate.
    let curve = [[-0.09, -0.01, 0.0], [0.09, -0.01, 0.0], [0.09, 0.01, 0.0], [-0.09, 0.01, 0.0]];
    let outline = Outline { curve: &curve, color: [255, 0, 0], width: 2.0, tolerance: 1e-3 };
    let image = render(&scene, &camera, &[outline]).image;
    let is_red = |p: [f64; 3]| {
        let (u, v, _) = camera.project(&p).expect("ahead");
        let [r, g, b] = image.get_pixel(u.round() as u32, v.round() as u32).0;
        r > 200 && g < 120 && b < 120
    };
    assert!(is_red([-0.07, 0.01, 0.0]) && is_red([0.09, 0.0, 0.0]) && !is_red([0.0, 0.01, 0.0]));
}

#[test]
fn the_picture_does_not_depend_on_the_number_of_threads() {
    let (mesh, taxonomy) = (scene_mesh(), taxonomy());
    let scene = Scene::in_class_colors(&mesh, &taxonomy);
    let camera = Camera::of_all(scene.positions(), Direction::Isometric.axes(), (150, 101)).expect("points");
    let of = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| render(&scene, &camera, &[]).image)
    };
    let one = of(1);
    assert_eq!(one, of(4));
    assert_eq!(one.dimensions(), (150, 101));
    assert!(one.pixels().any(|p| p.0 != [255; 3]));
}

#[test]
fn broken_triangles_are_left_out() {
    let taxonomy = taxonomy();
    let mut mesh = scene_mesh();
    mesh.triangles.push([0, 1, 999]);
    mesh.vertices.positions[0] = [f32::NAN, 0.0, 0.0];
    let scene = Scene::in_class_colors(&mesh, &taxonomy);
    assert!(!scene.is_empty() && scene.triangles.len() < mesh.triangles.len());
    let camera = Camera::of_all(scene.positions(), Direction::Top.axes(), (20, 20)).expect("points");
    assert_eq!(render(&scene, &camera, &[]).image.dimensions(), (20, 20));
    let nothing = SemanticMesh::default();
    assert!(Scene::in_class_colors(&nothing, &taxonomy).is_empty());
}
