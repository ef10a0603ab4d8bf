//! Whatever has depth comes back bit by bit.

use super::*;
use proptest::prelude::*;

const K: Intrinsics = Intrinsics { width: 23, height: 11, fx: 30.0, fy: 30.0, cx: 11.0, cy: 5.0 };
const PIXELS: usize = 23 * 11;

fn view(metres: Vec<f32>, draw: &[u8]) -> LabelledView {
    let byte = |i: usize| draw[i % draw.len()];
    LabelledView {
        index: 3,
        cloud: OrganizedCloud::new(K, &DepthImage { width: 23, height: 11, metres }, None),
        rgb: std::sync::Arc::new(RgbImage::from_fn(23, 11, |x, y| {
            image::Rgb([byte(x as usize), byte(y as usize), byte(7)])
        })),
        segmentation: Segmentation {
            components: ClassField::Soft {
                classes: 3,
                probabilities: (0..PIXELS * 3).map(byte).collect(),
                sigma: (0..PIXELS).map(|i| byte(i + 5)).collect(),
                model_sigma: (0..PIXELS).map(|i| byte(i + 7)).collect(),
            },
            defects: ClassField::Hard((0..PIXELS).map(|i| u16::from(byte(i)) * 257).collect()),
            instances: (0..PIXELS).map(|i| u16::from(byte(i * 3)) << 4).collect(),
            network: None,
        },
        table_from_camera: Isometry3::identity(),
    }
}

proptest! {
    #[test]
    fn what_has_depth_comes_back_bit_by_bit(
        // Drawn as whole numbers: proptest's sampler of f32 ranges now and then fails an assertion of its own.
        depth in prop::collection::vec(
            prop_oneof![Just(0.0_f32), (0_u32..1 << 24).prop_map(|k| 0.1 + 1.9 * k as f32 / 16_777_216.0)],
            PIXELS,
        ),
        step in prop_oneof![Just(None), prop::sample::select(STEPS.to_vec()).prop_map(Some)],
        draw in prop::collection::vec(any::<u8>(), 40..90),
    ) {
        let metres = depth.iter().map(|&z| step.map_or(z, |q| steps(z, q) as f32 * q)).collect();
        let before = view(metres, &draw);
        let packed = pack(&before).expect("packs");
        let after = packed.unpack(&packed.bytes, before.index, before.table_from_camera).expect("unpacks");
        prop_assert_eq!(&after.cloud.depth, &before.cloud.depth);
        prop_assert_eq!(&after.cloud.normals, &before.cloud.normals);
        for i in (0..PIXELS).filter(|&i| before.cloud.depth[i] > 0.0) {
            prop_assert_eq!(&after.rgb.as_raw()[i * 3..i * 3 + 3], &before.rgb.as_raw()[i * 3..i * 3 + 3]);
            prop_assert_eq!(after.segmentation.instances[i], before.segmentation.instances[i]);
            prop_assert_eq!(after.segmentation.defects.best(i), before.segmentation.defects.best(i));
            let sigmas = |v: &LabelledView| (v.segmentation.components.sigma(i), v.segmentation.components.model_sigma(i));
            prop_assert_eq!(sigmas(&after), sigmas(&before));
            let said = |v: &LabelledView| {
                let mut evidence = [0.0; 3];
                v.segmentation.components.add_evidence(i, 1.0, &mut evidence);
                evidence
            };
            prop_assert_eq!(said(&after), said(&before));
        }
        prop_assert!(packed.unpack(&packed.bytes[..packed.bytes.len() - 1], 0, Isometry3::identity()).is_err());
    }
}
