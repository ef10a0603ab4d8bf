//! What dragging, zooming and fitting do to the camera.

use super::*;

fn camera() -> OrbitCamera {
    let mut camera = OrbitCamera::default();
    camera.set_viewport(800.0, 600.0);
    camera
}

/// Where a point appears, CSS pixels from the top left corner.
fn pixel(camera: &OrbitCamera, p: Vec3) -> Vec2 {
    let clip = camera.clip_from_view(0.01, 10.0) * camera.view_from_table() * p.extend(1.0);
    let ndc = clip.truncate() / clip.w;
    Vec2::new(ndc.x + 1.0, 1.0 - ndc.y) / 2.0 * camera.viewport
}

#[test]
fn the_target_is_in_the_middle_from_every_side() {
    use StandardView::{Back, Bottom, Front, Isometric, Left, Right, Top};
    for view in [Isometric, Front, Back, Left, Right, Top, Bottom] {
        let mut camera = camera();
        camera.look_from(view);
        assert!(pixel(&camera, camera.target()).distance(Vec2::new(400.0, 300.0)) < 0.1, "{view:?}");
        assert!(camera.view_from_table().is_finite());
    }
}

#[test]
fn standard_views_show_the_axes_as_drawings_do() {
    let middle = Vec2::new(400.0, 300.0);
    let mut front = camera();
    front.look_from(StandardView::Front);
    let x = pixel(&front, front.target() + Vec3::X * 0.05) - middle;
    let z = pixel(&front, front.target() + Vec3::Z * 0.05) - middle;
    assert!(x.x > 10.0 && x.y.abs() < 0.5, "x to the right: {x}");
    assert!(z.y < -10.0 && z.x.abs() < 0.5, "z up: {z}");
    let mut top = camera();
    top.look_from(StandardView::Top);
    let y = pixel(&top, top.target() + Vec3::Y * 0.05) - middle;
    assert!(y.y < -10.0 && y.x.abs() < 0.5, "y up: {y}");
}

#[test]
fn a_drag_to_the_right_turns_the_front_of_the_part_to_the_right() {
    let mut camera = camera();
    let near_side = camera.target() - camera.forward() * 0.05;
    camera.orbit(Vec2::new(30.0, 0.0));
    assert!(pixel(&camera, near_side).x > 405.0);
    let mut camera = self::camera();
    camera.orbit(Vec2::new(0.0, 30.0));
    assert!(pixel(&camera, near_side).y > 305.0);
}

#[test]
fn pan_keeps_the_target_under_the_pointer() {
    let mut camera = camera();
    let grabbed = camera.target();
    camera.pan(Vec2::new(70.0, -40.0));
    assert!(pixel(&camera, grabbed).distance(Vec2::new(470.0, 260.0)) < 0.1);
}

#[test]
fn zoom_keeps_what_is_under_the_cursor() {
    let mut camera = camera();
    let (right, up) = camera.right_and_up();
    let p = camera.target() + right * 0.03 + up * 0.02;
    let at = pixel(&camera, p);
    for factor in [0.5, 0.8, 3.0] {
        camera.zoom(factor, Some(at));
        assert!(pixel(&camera, p).distance(at) < 0.1);
    }
}

#[test]
fn fit_shows_every_corner_in_any_viewport() {
    let bounds = Bounds::from_corners(Vec3::new(-0.1, -0.05, 0.0), Vec3::new(0.12, 0.04, 0.08));
    for (width, height) in [(800.0, 600.0), (300.0, 900.0), (2000.0, 300.0)] {
        let mut camera = camera();
        camera.set_viewport(width, height);
        camera.fit(bounds);
        let seen: Vec<Vec2> = bounds.corners().map(|corner| pixel(&camera, corner)).collect();
        for place in &seen {
            assert!(place.cmpge(Vec2::ZERO).all() && place.cmple(camera.viewport).all(), "{place}");
        }
        // One pair of edges is touched up to the margin.
        let low = seen.iter().copied().fold(Vec2::INFINITY, Vec2::min) / camera.viewport;
        let high = seen.iter().copied().fold(Vec2::NEG_INFINITY, Vec2::max) / camera.viewport;
        let filled = (high - low).max_element();
        assert!((0.9..0.95).contains(&filled), "{filled} of {width} x {height}");
    }
}

#[test]
fn fit_stays_out_of_what_is_covered() {
    let bounds = Bounds::from_corners(Vec3::new(-0.05, -0.05, 0.0), Vec3::new(0.05, 0.05, 0.3));
    for (width, height) in [(800.0, 600.0), (300.0, 900.0), (320.0, 240.0)] {
        let mut camera = camera();
        camera.set_viewport(width, height);
        camera.set_covered(60.0);
        camera.fit(bounds);
        let seen: Vec<f32> = bounds.corners().map(|corner| pixel(&camera, corner).y).collect();
        let low = seen.iter().copied().fold(f32::INFINITY, f32::min);
        let high = seen.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        assert!(low >= 60.0 && high <= height, "{low} to {high} of {height}");
        assert!(((low - 60.0) - (height - high)).abs() < 0.2 * height, "in the middle of the rest: {low} to {high}");
    }
}

#[test]
fn near_and_far_enclose_the_scene_from_outside_and_inside() {
    let scene = Bounds::from_corners(Vec3::splat(-0.2), Vec3::splat(0.2));
    let mut camera = camera();
    for distance in [5.0, 0.6, 0.05, 0.005] {
        camera.distance = distance;
        let (near, far) = camera.near_far(scene);
        assert!(near > 0.0 && far > near, "{distance}: {near} {far}");
        let farthest = (scene.center() - camera.eye()).dot(camera.forward()) + scene.radius();
        assert!(far >= farthest);
    }
}

#[test]
fn nonsense_input_leaves_the_camera_sound() {
    let mut camera = camera();
    camera.orbit(Vec2::NAN);
    camera.pan(Vec2::splat(f32::INFINITY));
    for factor in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        camera.zoom(factor, Some(Vec2::ZERO));
    }
    camera.fit(Bounds::EMPTY);
    camera.frame(Vec3::NAN, 1.0);
    assert_eq!(camera, self::camera());
    camera.zoom(1e-30, None);
    camera.orbit(Vec2::new(0.0, 1e6));
    assert!(camera.eye().is_finite() && camera.view_from_table().is_finite());
}

#[test]
fn a_point_is_found_again_where_it_appears() {
    let mut camera = OrbitCamera::default();
    camera.set_viewport(800.0, 500.0);
    camera.look_from(StandardView::Front);
    camera.frame(Vec3::new(0.1, 0.2, 0.3), 0.1);
    let (middle, distance) = camera.project(camera.target()).expect("it is in front");
    assert!(middle.distance(Vec2::new(400.0, 250.0)) < 1e-2 && (distance - camera.distance()).abs() < 1e-5);
    // From the front x points right and z up.
    let (right_and_up, _) = camera.project(camera.target() + Vec3::new(0.01, 0.0, 0.02)).expect("it is in front");
    assert!(right_and_up.x > 401.0 && right_and_up.y < 249.0);
    for point in [Vec3::new(0.12, 0.15, 0.33), Vec3::new(-0.3, 0.4, 0.1)] {
        let (at, distance) = camera.project(point).expect("it is in front");
        assert!(camera.unproject(at, distance).distance(point) < 1e-5);
    }
    assert_eq!(camera.project(camera.eye() - camera.forward()), None, "behind the eye");
    assert_eq!(camera.project(Vec3::NAN), None);
}

#[test]
fn it_looks_from_one_place_at_another() {
    let mut camera = OrbitCamera::default();
    let (eye, target) = (Vec3::new(0.3, -0.4, 0.5), Vec3::new(0.01, 0.02, 0.03));
    camera.apply(CameraInput::From { eye, target }, None);
    assert!((camera.eye() - eye).length() < 1e-5 && (camera.target() - target).length() < 1e-6);
    let before = camera;
    camera.look_at(target, target);
    camera.look_at(Vec3::splat(f32::NAN), target);
    camera.look_at(eye, Vec3::splat(f32::INFINITY));
    assert_eq!(camera, before);
    camera.look_at(target + Vec3::Z, target);
    assert!((camera.eye() - target - Vec3::Z).length() < 2e-3, "as good as straight from above");
}
