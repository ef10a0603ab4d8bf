//! Which views saw a finding, and where in their pictures.
//!
//! A vertex was seen by a view where it faces the camera and the depth measured at its pixel agrees with its own: nothing
//! stood before it. A pixel without depth saw nothing.

use super::regions::Region;
use super::surface::Surface;
use nalgebra::{Point3, Vector3};
use semascan_model::finding::{FindingView, PixelBox};
use semascan_perception::fuse::KeptDepth;

/// Difference of depths in voxels up to which a pixel shows the vertex, at least this many metres.
const AGREEMENT: (f64, f64) = (2.0, 1e-3);
/// Least cosine of incidence.
const GRAZING: f64 = 0.1;

/// What `view` saw of `region`; `None` if nothing.
pub(crate) fn seen_by(surface: &Surface<'_>, region: &Region, view: &KeptDepth<'_>) -> Option<FindingView> {
    let k = &view.intrinsics;
    let tolerance = (AGREEMENT.0 * surface.voxel).max(AGREEMENT.1);
    let camera = view.table_from_camera.translation.vector;
    let (mut low, mut high) = ([u32::MAX; 2], [0_u32; 2]);
    let (mut seen, mut all, mut cosines) = (0.0, 0.0, 0.0);
    for &v in &region.vertices {
        let area = surface.areas[v as usize];
        all += area;
        let Some(normal) = surface.normal(v).map(Vector3::from) else { continue };
        let position = Vector3::from(surface.position(v));
        let cosine = (camera - position).normalize().dot(&normal);
        let p = view.table_from_camera.inverse_transform_point(&Point3::from(position));
        let Some(pixel) = k.project(&p).and_then(|(x, y)| k.pixel(x, y)).filter(|_| cosine > GRAZING) else { continue };
        let measured = view.metres.get(pixel).copied().map_or(0.0, f64::from);
        // On a slanted surface neighbouring pixels lie at other depths.
        if measured <= 0.0 || (measured - p.z).abs() > tolerance + k.footprint(p.z) / cosine {
            continue;
        }
        seen += area;
        cosines += area * cosine;
        let at = [pixel as u32 % k.width, pixel as u32 / k.width];
        for axis in 0..2 {
            (low[axis], high[axis]) = (low[axis].min(at[axis]), high[axis].max(at[axis]));
        }
    }
    (seen > 0.0).then(|| FindingView {
        view: view.index,
        pixels: PixelBox { left: low[0], top: low[1], width: high[0] - low[0] + 1, height: high[1] - low[1] + 1 },
        share: seen / all,
        cosine: cosines / seen,
    })
}

/// The best view first: that which saw most of the region, most directly; of equals the earlier one.
pub(crate) fn sort(views: &mut [FindingView]) {
    views.sort_by(|a, b| (b.share * b.cosine).total_cmp(&(a.share * a.cosine)).then(a.view.cmp(&b.view)));
}

#[cfg(test)]
mod tests {
    use super::super::fixtures::{grid, with_defect};
    use super::super::regions::defect_regions;
    use super::*;
    use nalgebra::Isometry3;
    use semascan_perception::view::Intrinsics;

    #[test]
    fn a_view_saw_what_nothing_hides() {
        // A plane 0.3 m before a camera that looks straight at it; its pixels are 0.5 mm wide there.
        let mesh = with_defect(grid(41, 41, |_, _| 0.0), |x, y| (10.0..30.0).contains(&x) && (15.0..25.0).contains(&y));
        let surface = Surface::new(&mesh, 1e-3);
        let region = &defect_regions(&surface)[0];
        let k = Intrinsics { width: 160, height: 120, fx: 600.0, fy: 600.0, cx: 80.0, cy: 60.0 };
        let target = Point3::new(0.02, 0.02, 0.0);
        let table_from_camera =
            Isometry3::face_towards(&Point3::new(0.02, 0.02, 0.3), &target, &Vector3::new(0.0, -1.0, 0.0));
        let mut metres = vec![0.3_f32; 160 * 120];
        let of = |metres: &[f32]| {
            let view = KeptDepth { index: 4, intrinsics: k, metres: metres.into(), table_from_camera };
            seen_by(&surface, region, &view)
        };
        let seen = of(&metres).expect("in sight");
        assert!((seen.share - 1.0).abs() < 1e-9 && seen.cosine > 0.99, "{seen:?}");
        let PixelBox { width, height, .. } = seen.pixels;
        assert!((37..=41).contains(&width) && (17..=21).contains(&height), "{seen:?}");
        // Something stands before the right half, and a row was not measured.
        for (i, z) in metres.iter_mut().enumerate() {
            match (i % 160 >= 80, i / 160 == 60) {
                (true, _) => *z = 0.2,
                (_, true) => *z = 0.0,
                _ => {}
            }
        }
        let half = of(&metres).expect("half of it");
        assert!((0.35..0.55).contains(&half.share), "{half:?}");
        metres.fill(0.0);
        assert_eq!(of(&metres), None, "where nothing was measured nothing was seen");
    }
}
