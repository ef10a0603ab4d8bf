//! A fixed camera before a turntable, with poses: nothing that turns is the robot.

use semascan_inspection::source::Source;
use semascan_inspection::spec::CameraMask;
use semascan_perception::view::View;
use semascan_simulation::{TurntableDisc, TurntableOptions, TurntablePart, TurntableRecording};
use semascan_sources::bop::{BopSource, SceneWriter};

#[test]
fn the_camera_mask_takes_nothing_of_what_turns_before_a_fixed_camera() {
    for (seed, part, views) in [(1, TurntablePart::Bracket, 8), (2, TurntablePart::Can, 8), (3, TurntablePart::Mug, 12)]
    {
        let options = TurntableOptions {
            part,
            disc: TurntableDisc::Printed,
            views,
            step: None,
            size: (320, 240),
            posed: true,
            masks: true,
        };
        let recording = TurntableRecording::new(seed, options);
        let dir = tempfile::tempdir().expect("temporary folder");
        let taxonomy = &recording.info().taxonomy;
        let writer = SceneWriter::create(dir.path(), taxonomy, nalgebra::Isometry3::identity()).expect("made");
        let views: Vec<View> = (0..views).filter_map(|i| recording.view(i)).collect();
        let entries: Vec<_> = views.iter().map(|v| writer.write(v).expect("written")).collect();
        writer.finish(&entries).expect("finished");
        let mut source = BopSource::open(dir.path(), &CameraMask::Auto).expect("opens");
        let said = source.info().settings.iter().find(|(name, _)| name == "camera_mask").expect("said").1.clone();
        // What turns, part and disc, must be left; the room does move with the camera, in the frame that turns.
        let (mut part, mut kept, mut turning, mut left) = (0, 0, 0, 0);
        for truth in &views {
            let view = source.next_view().expect("a view").expect("reads");
            let labels = truth.labels.as_ref().expect("masks");
            let pose = truth.truth.as_ref().expect("truth").table_from_camera;
            for (i, z) in truth.depth.metres.iter().enumerate().filter(|(_, z)| **z > 0.0) {
                let read = usize::from((view.depth.metres[i] - z).abs() < 1e-3);
                let (u, v) = ((i % 320) as f64, (i / 320) as f64);
                let p = pose * truth.intrinsics.unproject(u, v, f64::from(*z));
                if p.z > -0.008 && p.x.hypot(p.y) < 0.1 {
                    (turning, left) = (turning + 1, left + read);
                }
                if labels.components[i] != 0 {
                    (part, kept) = (part + 1, kept + read);
                }
            }
        }
        assert!(part > 1000, "{part} pixels of the part");
        assert!(kept * 1000 >= part * 995, "{seed}: {kept} of {part} pixels of the part are left; {said}");
        assert!(left * 1000 >= turning * 995, "{seed}: {left} of {turning} pixels that turn are left; {said}");
    }
}
