//! What the writers write, read back by this crate's readers and by those of others: the crates `gltf`, `tobj` and `stl_io`.

mod glb;
mod mesh;
mod open3d;
mod ply;
mod semantics;
mod texture;

use proptest::prelude::*;
use semascan_formats::ExportFilter;
use semascan_model::{PointFlags, SemanticCloud, SemanticPoint, Taxonomy};

fn taxonomy() -> Taxonomy {
    Taxonomy::from_names(&["housing", "electrical connection"], &["corrosion"])
}

fn any_point() -> impl Strategy<Value = SemanticPoint> {
    let normal = (
        (-1_000_000..1_000_000_i32).prop_map(|k| k as f32 / 1e6),
        (0..6_300_000_i32).prop_map(|k| k as f32 / 1e6),
        any::<bool>(),
    );
    let shares = prop::array::uniform4((0..1_000_000_i32).prop_map(|k| k as f32 / 1e6));
    let numbers = (0_u16..4, any::<u16>(), any::<u16>(), any::<u16>(), any::<u16>());
    let position = prop::array::uniform3((-9_000_000..9_000_000_i32).prop_map(|k| k as f32 / 1e6));
    (position, normal, any::<[u8; 3]>(), shares, numbers).prop_map(
        |(position, (z, angle, known), color, shares, (label, defect, instance, views, flags))| {
            let r = (1.0 - z * z).sqrt();
            SemanticPoint {
                position,
                normal: if known { [r * angle.cos(), r * angle.sin(), z] } else { [0.0; 3] },
                color,
                label,
                confidence: shares[0],
                defect,
                defect_confidence: shares[1],
                sigma: shares[2],
                defect_sigma: shares[3],
                instance,
                views,
                flags: PointFlags(flags),
            }
        },
    )
}

fn any_cloud() -> impl Strategy<Value = SemanticCloud> {
    prop::collection::vec(any_point(), 0..60).prop_map(|points| points.into_iter().collect())
}

#[test]
fn the_filter_leaves_out_what_it_says() {
    let flags = [0, PointFlags::RADIUS_OUTLIER, PointFlags::BACKGROUND];
    let labels = [1_u16, 1, 2];
    let mut cloud = SemanticCloud::default();
    for (flags, label) in flags.into_iter().zip(labels) {
        cloud.push(SemanticPoint {
            position: [0.0; 3],
            normal: [0.0; 3],
            color: [0; 3],
            label,
            confidence: 1.0,
            defect: 0,
            defect_confidence: 1.0,
            sigma: 0.0,
            defect_sigma: 0.0,
            instance: 0,
            views: 1,
            flags: PointFlags(flags),
        });
    }
    assert_eq!(ExportFilter::default().apply(&cloud), cloud);
    let no_outliers = ExportFilter { skip_flags: PointFlags::OUTLIER, ..Default::default() };
    assert_eq!(no_outliers.apply(&cloud).labels, [1, 2]);
    let no_first = ExportFilter { hidden_labels: [1].into(), ..Default::default() };
    assert_eq!(no_first.apply(&cloud).labels, [2]);
}
