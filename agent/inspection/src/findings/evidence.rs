//! Which views saw a finding, where in their pictures, and what of the uncertainty of its labels was theirs.
//!
//! A vertex was seen by a view where it faces the camera and the depth measured at its pixel agrees with its own: nothing
//! stood before it. A pixel without depth saw nothing.
//!
//! The uncertainty of a pixel's label has a part that is in the data (the scatter over what was done to the picture) and one
//! that is in the networks (how far members of the ensemble disagree). The map keeps the whole; the parts of a vertex are the
//! means over the views that saw it.

use super::regions::Region;
use super::surface::Surface;
use nalgebra::{Point3, Vector3};
use semascan_model::finding::{FindingView, PixelBox, Spread};
use semascan_perception::fuse::KeptDepth;
use semascan_perception::segment::ClassField;

/// Difference of depths in voxels up to which a pixel shows the vertex, at least this many metres.
const AGREEMENT: (f64, f64) = (2.0, 1e-3);
/// Least cosine of incidence.
const GRAZING: f64 = 0.1;

/// What the views have seen of a region.
#[derive(Clone, Debug)]
pub(crate) struct Evidence {
    /// The views that saw it.
    pub(crate) views: Vec<FindingView>,
    /// Uncertainty of the labels of each of its vertices.
    parts: Vec<Parts>,
}

/// Sums over the views that saw a vertex and know the parts of their label's standard uncertainty.
#[derive(Clone, Copy, Debug, Default)]
struct Parts {
    data: f64,
    model: f64,
    views: u32,
}

impl Evidence {
    /// Nothing has been seen of `region` yet.
    pub(crate) fn none(region: &Region) -> Self {
        Self { views: Vec::new(), parts: vec![Parts::default(); region.vertices.len()] }
    }

    /// Adds what `view`, whose pixels have the `defects`, saw of `region`.
    pub(crate) fn add(&mut self, surface: &Surface<'_>, region: &Region, view: &KeptDepth<'_>, defects: &ClassField) {
        let parts = &mut self.parts;
        let seen = seen_by(surface, region, view, |i, pixel| {
            if let (Some(of_vertex), Some(model)) = (parts.get_mut(i), defects.model_sigma(pixel)) {
                let (all, model) = (f64::from(defects.sigma(pixel)), f64::from(model));
                of_vertex.data += (all * all - model * model).max(0.0).sqrt();
                of_vertex.model += model;
                of_vertex.views += 1;
            }
        });
        self.views.extend(seen);
    }

    /// Adds what `view` saw of `region`, of whose labels nothing is known.
    pub(crate) fn add_depth(&mut self, surface: &Surface<'_>, region: &Region, view: &KeptDepth<'_>) {
        self.views.extend(seen_by(surface, region, view, |_, _| {}));
    }

    /// The best view first: that which saw most of the region, most directly; of equals the earlier one.
    pub(crate) fn sort(&mut self) {
        let quality = |view: &FindingView| view.share * view.cosine;
        self.views.sort_by(|a, b| quality(b).total_cmp(&quality(a)).then(a.view.cmp(&b.view)));
    }

    /// The parts of the labels' standard uncertainty that are in the data and in the networks; `None` if no view knows them.
    pub(crate) fn uncertainty_parts(&self, surface: &Surface<'_>, region: &Region) -> Option<[Spread; 2]> {
        let known = || region.vertices.iter().zip(&self.parts).filter(|(_, parts)| parts.views > 0);
        let of = |part: fn(&Parts) -> f64| {
            Spread::of(known().map(|(v, parts)| (part(parts) / f64::from(parts.views), surface.areas[*v as usize])))
        };
        Some([of(|parts| parts.data)?, of(|parts| parts.model)?])
    }
}

/// What `view` saw of `region`; `None` if nothing. `at` is told the place in the region and the pixel of each vertex that it saw.
fn seen_by(
    surface: &Surface<'_>,
    region: &Region,
    view: &KeptDepth<'_>,
    mut at: impl FnMut(usize, usize),
) -> Option<FindingView> {
    let k = &view.intrinsics;
    let tolerance = (AGREEMENT.0 * surface.voxel).max(AGREEMENT.1);
    let camera = view.table_from_camera.translation.vector;
    let (mut low, mut high) = ([u32::MAX; 2], [0_u32; 2]);
    let (mut seen, mut all, mut cosines) = (0.0, 0.0, 0.0);
    for (i, &v) in region.vertices.iter().enumerate() {
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
        at(i, pixel);
        let place = [pixel as u32 % k.width, pixel as u32 / k.width];
        for axis in 0..2 {
            (low[axis], high[axis]) = (low[axis].min(place[axis]), high[axis].max(place[axis]));
        }
    }
    (seen > 0.0).then(|| FindingView {
        view: view.index,
        pixels: PixelBox { left: low[0], top: low[1], width: high[0] - low[0] + 1, height: high[1] - low[1] + 1 },
        share: seen / all,
        cosine: cosines / seen,
    })
}

#[cfg(test)]
mod tests {
    use super::super::fixtures::{grid, with_defect};
    use super::super::regions::defect_regions;
    use super::*;
    use nalgebra::Isometry3;
    use semascan_perception::segment::UNKNOWN_PART;
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
            // Labels of sigma 0.5, of which the networks make 0.3, but for a column of pixels where nobody knows.
            let mut model_sigma = vec![77; 160 * 120];
            (0..120).for_each(|row| model_sigma[row * 160 + 80] = UNKNOWN_PART);
            let (probabilities, sigma) = (vec![128; 2 * 160 * 120], vec![128; 160 * 120]);
            let mut evidence = Evidence::none(region);
            evidence.add(&surface, region, &view, &ClassField::Soft { classes: 2, probabilities, sigma, model_sigma });
            evidence
        };
        let evidence = of(&metres);
        let seen = evidence.views[0];
        let [data, model] = evidence.uncertainty_parts(&surface, region).expect("known");
        assert!((model.mean - 0.302).abs() < 1e-3 && (data.mean - 0.401).abs() < 1e-3, "{data:?} {model:?}");
        assert!(evidence.parts.iter().any(|parts| parts.views == 0), "where it is not known it is left out");
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
        let half = of(&metres).views[0];
        assert!((0.35..0.55).contains(&half.share), "{half:?}");
        metres.fill(0.0);
        let nothing = of(&metres);
        assert!(nothing.views.is_empty(), "where nothing was measured nothing was seen");
        assert_eq!(nothing.uncertainty_parts(&surface, region), None);
    }
}
