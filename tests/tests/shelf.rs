//! The first real input: a robot-mounted camera in front of a shelf, four objects with recorded masks.
//!
//! The fused labels are projected back into each view: a pixel with depth takes the label of the nearest model point
//! within 4 mm, and is compared with the recorded mask.

use semascan_inspection::record::isometry;
use semascan_inspection::source::Source;
use semascan_inspection::spec::CameraMask;
use semascan_model::SemanticCloud;
use semascan_sources::bop::BopSource;
use semascan_tests::data;
use semascan_tests::inspect::inspect;
use std::collections::HashMap;

/// Farthest model point that a pixel may take its label from, metres.
const REACH: f32 = 0.004;
const OBJECTS: usize = 4;

/// Model points by cell of edge [`REACH`].
struct Nearest<'a> {
    cloud: &'a SemanticCloud,
    cells: HashMap<[i32; 3], Vec<usize>>,
}

impl<'a> Nearest<'a> {
    fn new(cloud: &'a SemanticCloud) -> Self {
        let mut cells: HashMap<[i32; 3], Vec<usize>> = HashMap::new();
        for (i, p) in cloud.positions.iter().enumerate() {
            cells.entry(p.map(|c| (c / REACH).floor() as i32)).or_default().push(i);
        }
        Self { cloud, cells }
    }

    fn label(&self, p: [f32; 3]) -> Option<u16> {
        let cell = p.map(|c| (c / REACH).floor() as i32);
        let mut best = (REACH * REACH, None);
        for offset in 0..27 {
            let near = [cell[0] + offset / 9 - 1, cell[1] + offset / 3 % 3 - 1, cell[2] + offset % 3 - 1];
            for &i in self.cells.get(&near).into_iter().flatten() {
                let q = self.cloud.positions[i];
                let d: f32 = (0..3).map(|a| (p[a] - q[a]).powi(2)).sum();
                if d <= best.0 {
                    best = (d, Some(self.cloud.labels[i]));
                }
            }
        }
        best.1
    }
}

#[test]
#[cfg_attr(not(semascan_data), ignore = "SEMASCAN_DATA is not set")]
fn fused_labels_agree_with_the_recorded_masks() {
    let folder = data::folder("shelf-eye-in-hand").expect("real captures");
    let source = BopSource::open(&folder, &CameraMask::Auto).expect("opens");
    let inspected = inspect(Box::new(source)).expect("inspects");
    assert_eq!(inspected.recorded.rejections(), Vec::<String>::new());
    assert_eq!(inspected.record.views.len(), 15);
    let nearest = Nearest::new(&inspected.cloud);

    // Without the camera mask: every mask and label pixel that has depth counts.
    let mut views = BopSource::open(&folder, &CameraMask::None).expect("opens");
    let (mut both, mut either) = ([0_u64; OBJECTS + 1], [0_u64; OBJECTS + 1]);
    let (mut covered, mut masked) = (0_u64, 0_u64);
    while let Some(view) = views.next_view() {
        let view = view.expect("reads");
        let estimate = inspected.record.views[view.index as usize].pose.as_ref().expect("every view has a pose");
        let table_from_camera = isometry(estimate);
        let labels = view.labels.as_ref().expect("the scene has masks");
        for (i, &z) in view.depth.metres.iter().enumerate().filter(|(_, z)| **z > 0.0) {
            let (u, v) = (i as u32 % view.depth.width, i as u32 / view.depth.width);
            let p = table_from_camera * view.intrinsics.unproject(u.into(), v.into(), z.into());
            let found = nearest.label([p.x as f32, p.y as f32, p.z as f32]);
            let (truth, given) = (usize::from(labels.components[i]), usize::from(found.unwrap_or(0)));
            masked += u64::from(truth > 0);
            covered += u64::from(truth > 0 && found.is_some());
            if truth == given {
                both[truth] += 1;
                either[truth] += 1;
            } else {
                either[truth] += 1;
                either[given] += 1;
            }
        }
    }
    for object in 1..=OBJECTS {
        let iou = both[object] as f64 / either[object] as f64;
        assert!(iou >= 0.90, "object {object}: IoU {iou:.3}");
    }
    let coverage = covered as f64 / masked as f64;
    assert!(coverage >= 0.95, "coverage {coverage:.3}");
}

#[test]
#[cfg_attr(not(semascan_data), ignore = "SEMASCAN_DATA is not set")]
fn the_gripper_is_found_and_the_objects_are_left_alone() {
    let folder = data::folder("shelf-eye-in-hand").expect("real captures");
    let mut with = BopSource::open(&folder, &CameraMask::Auto).expect("opens");
    let mut without = BopSource::open(&folder, &CameraMask::None).expect("opens");
    let (masked, whole) =
        (with.next_view().expect("view").expect("reads"), without.next_view().expect("view").expect("reads"));
    let labels = whole.labels.expect("masks");
    let (mut near, mut near_left, mut object, mut object_left) = (0, 0, 0, 0);
    for (i, (&before, &after)) in whole.depth.metres.iter().zip(&masked.depth.metres).enumerate() {
        // The gripper is nearer than 0.2 m in this scene, everything else farther.
        near += u32::from(before > 0.0 && before < 0.2);
        near_left += u32::from(after > 0.0 && after < 0.2);
        object += u32::from(before > 0.0 && labels.components[i] > 0);
        object_left += u32::from(after > 0.0 && labels.components[i] > 0);
    }
    // What is left are speckles on its rim, where some views see past it.
    assert!(near > 500 && near_left * 100 < near * 7, "{near_left} of {near} gripper pixels are left");
    assert!(object_left * 100 >= object * 99, "{object_left} of {object} object pixels are left");
}
