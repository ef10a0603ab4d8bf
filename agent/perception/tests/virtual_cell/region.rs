//! Where networks look: the window of the picture that shows the measuring volume.

use nalgebra::{Isometry3, Point3};
use semascan_inspection::source::Source;
use semascan_perception::segment::network::{Sight, Window};
use semascan_perception::view::{PoseEvidence, covariance_of_prior};
use semascan_simulation::{VirtualCell, VirtualCellSpec};
use std::sync::Arc;

fn cell() -> VirtualCell {
    let spec = VirtualCellSpec::parse("virtual:starter-motor?seed=3&views=4&cell=3").expect("a valid URI");
    VirtualCell::open(&spec).expect("needs no file")
}

fn in_sight(sight: Sight) -> Window {
    let Sight::In(window) = sight else { panic!("{sight:?}") };
    window
}

#[test]
fn every_pixel_of_the_part_is_in_it_and_much_else_is_not() {
    let mut cell = cell();
    let volume = cell.info().volume;
    while let Some(view) = cell.next_view() {
        let view = view.expect("renders");
        let window = in_sight(Window::of_volume(&view, volume.as_ref(), 8));
        assert!(window.pixels() < 640 * 480 / 2, "{window:?}");
        // Without depth the volume's corners have to do.
        let mut blind = view.clone();
        Arc::make_mut(&mut blind.depth).metres.fill(0.0);
        let wider = in_sight(Window::of_volume(&blind, volume.as_ref(), 8));
        assert!(wider.pixels() > window.pixels(), "{wider:?}, {window:?}");
        let labels = &view.labels.as_ref().expect("truth").components;
        for (i, _) in labels.iter().enumerate().filter(|(_, label)| **label != 0) {
            let (u, v) = (i as u32 % 640, i as u32 / 640);
            assert!(window.contains(u, v), "pixel {u} {v}, {window:?}");
        }
    }
}

#[test]
fn what_is_not_known_is_not_guessed() {
    let mut cell = cell();
    let volume = cell.info().volume;
    let mut view = cell.next_view().expect("a view").expect("renders");
    assert_eq!(Window::of_volume(&view, None, 8), Sight::Unknown);
    view.pose = PoseEvidence::None;
    assert_eq!(Window::of_volume(&view, volume.as_ref(), 8), Sight::Unknown);
    // The camera in the volume.
    let covariance = covariance_of_prior(1.0, 1.0);
    view.pose = PoseEvidence::World { table_from_camera: Isometry3::identity(), covariance };
    let around = (Point3::new(-1.0, -1.0, -1.0), Point3::new(1.0, 1.0, 1.0));
    assert_eq!(Window::of_volume(&view, Some(&around), 8), Sight::Unknown);
    // Before it, but beside the picture.
    let beside = (Point3::new(5.0, 0.0, 1.0), Point3::new(6.0, 0.1, 1.1));
    assert_eq!(Window::of_volume(&view, Some(&beside), 8), Sight::None);
}
