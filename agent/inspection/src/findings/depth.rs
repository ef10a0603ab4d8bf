//! Depth of a region against its surroundings: a quadric is fitted to the sound surface of the same component in a ring around
//! it, robustly (iteratively reweighted least squares with Tukey's biweight [Beaton 1974]), and the region's points are measured along the
//! mean normal. Positive where material is missing.
//!
//! The depth is not known where the ring is too small, does not surround the region, or the surface turns so far that it is
//! no function over a plane. It is the 95 % quantile over the region, of depths averaged over neighbours: the deepest single
//! point would be noise. Of a hump, whose 5 % quantile lies farther from the fitted surface, it is that one, and negative.

use super::regions::Region;
use super::surface::Surface;
use nalgebra::{SMatrix, SVector};
use semascan_geometry::vector::{cross, dot, length, sub, unit};
use semascan_model::finding::Quantity;
use std::collections::BTreeSet;

/// Coefficients of a quadric height field.
const TERMS: usize = 6;
/// The first rings of vertices around the region are not used: labels there are mixed.
const SKIPPED: u32 = 2;
/// Width of the ring in vertices: at least this, at most the second, and in between a quarter of the region's size.
const WIDTH: (u32, u32) = (6, 20);
/// Fewest vertices of the ring.
const FEWEST: usize = 30;
/// Length of the mean of the normals of region and ring from which on the surface is a function over a plane.
const FLAT: f64 = 0.9;
/// Sectors around the region, and how many of them the ring must have vertices in.
const SECTORS: (usize, usize) = (12, 10);
/// Iterations of the fit, and Tukey's constant.
const ITERATIONS: u32 = 12;
const TUKEY: f64 = 4.685;
/// Residuals of neighbours are alike: so many vertices are one independent witness.
const ALIKE: f64 = 9.0;
/// The quantile that is stated.
pub(crate) const QUANTILE: f64 = 0.95;

/// Depth of `region` against a surface fitted to its surroundings, metres.
///
/// # Errors
/// Why it is not known, in words.
pub(crate) fn fitted_depth(surface: &Surface<'_>, region: &Region) -> Result<Quantity, String> {
    let ring = ring(surface, region);
    if ring.len() < FEWEST {
        return Err(format!("only {} vertices of sound surface around it", ring.len()));
    }
    let normals = region.vertices.iter().chain(&ring).filter_map(|v| surface.normal(*v));
    let (sum, count) = normals.fold(([0.0; 3], 0.0), |(s, n), m| ([0, 1, 2].map(|k| s[k] + m[k]), n + 1.0));
    let axis = unit(sum, f64::MIN_POSITIVE).filter(|_| length(sum) > FLAT * count);
    let Some(axis) = axis else { return Err("the surface around it is bent too far".into()) };
    let frame = Frame::new(axis, [0, 1, 2].map(|k| region.mean(surface, |v| surface.position(v)[k])), surface, &ring);
    let mut sectors = [false; SECTORS.0];
    for v in &ring {
        let [x, y, _] = frame.local(surface.position(*v));
        let turn = y.atan2(x) / std::f64::consts::TAU + 0.5;
        sectors[((turn * SECTORS.0 as f64) as usize).min(SECTORS.0 - 1)] = true;
    }
    if sectors.iter().filter(|s| **s).count() < SECTORS.1 {
        return Err("its surroundings were not seen on all sides".into());
    }
    let points: Vec<[f64; 3]> = ring.iter().map(|v| frame.local(surface.position(*v))).collect();
    let Some(fit) = Fit::of(&points) else { return Err("no surface can be fitted to its surroundings".into()) };
    let depths: Vec<f64> = region
        .vertices
        .iter()
        .map(|v| {
            let [x, y, z] = frame.local(surface.position(*v));
            fit.height(x, y) - z
        })
        .collect();
    let smooth = averaged(surface, region, &depths);
    let (deepest, highest) =
        (quantile(surface, region, &smooth, QUANTILE), quantile(surface, region, &smooth, 1.0 - QUANTILE));
    let farthest = if highest.abs() > deepest.abs() { highest } else { deepest };
    // The fit is least certain where the region is farthest from the ring, and the surroundings are no quadric themselves.
    let leverage = region
        .vertices
        .iter()
        .map(|v| frame.local(surface.position(*v)))
        .map(|[x, y, _]| fit.leverage(x, y))
        .fold(0.0, f64::max);
    Ok(Quantity::with_standard(farthest, fit.sigma * (1.0 + ALIKE * leverage).sqrt()))
}

/// The quantile `share` over a region, by area, of a value for each of its vertices.
pub(crate) fn quantile(surface: &Surface<'_>, region: &Region, values: &[f64], share: f64) -> f64 {
    let mut order: Vec<(f64, f64)> =
        values.iter().zip(&region.vertices).map(|(d, v)| (*d, surface.areas[*v as usize])).collect();
    order.sort_by(|a, b| a.0.total_cmp(&b.0));
    let wanted = share * order.iter().map(|(_, area)| area).sum::<f64>();
    let mut below = 0.0;
    let found = order.iter().find(|(_, area)| {
        below += area;
        below >= wanted
    });
    found.or(order.last()).map_or(0.0, |(value, _)| *value)
}

/// Values averaged over neighbours in the region, twice.
pub(crate) fn averaged(surface: &Surface<'_>, region: &Region, values: &[f64]) -> Vec<f64> {
    let once = |values: &[f64]| -> Vec<f64> {
        region
            .vertices
            .iter()
            .enumerate()
            .map(|(i, v)| {
                let near = surface.neighbours(*v).iter().filter_map(|w| region.vertices.binary_search(w).ok());
                let (sum, n) = near.fold((values[i], 1.0), |(sum, n), j| (sum + values[j], n + 1.0));
                sum / n
            })
            .collect()
    };
    once(&once(values))
}

/// Vertices of the same component without a defect around a region.
fn ring(surface: &Surface<'_>, region: &Region) -> Vec<u32> {
    let across = (region.area(surface).sqrt() / surface.voxel / 4.0) as u32;
    let last = SKIPPED + across.clamp(WIDTH.0, WIDTH.1);
    let sound = |v: u32| surface.component(v) == region.component && surface.defect(v) == 0;
    let mut seen: BTreeSet<u32> = region.vertices.iter().copied().collect();
    let (mut edge, mut ring) = (region.vertices.clone(), Vec::new());
    for step in 1..=last {
        let mut next = Vec::new();
        for &w in edge.iter().flat_map(|v| surface.neighbours(*v)) {
            if sound(w) && seen.insert(w) {
                next.push(w);
            }
        }
        if step > SKIPPED {
            ring.extend(&next);
        }
        edge = next;
    }
    ring
}

/// A plane above which heights are measured: an axis and two directions across it, in units of the ring's size.
struct Frame {
    origin: [f64; 3],
    axes: [[f64; 3]; 3],
    size: f64,
}

impl Frame {
    fn new(axis: [f64; 3], origin: [f64; 3], surface: &Surface<'_>, ring: &[u32]) -> Self {
        let helper = if axis[0].abs() < 0.7 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
        let across = unit(cross(axis, helper), f64::MIN_POSITIVE).unwrap_or(helper);
        let size = ring.iter().map(|v| length(sub(surface.position(*v), origin))).fold(f64::MIN_POSITIVE, f64::max);
        Self { origin, axes: [across, cross(axis, across), axis], size }
    }

    /// Place across the axis in units of the size, height in metres.
    fn local(&self, p: [f64; 3]) -> [f64; 3] {
        let to = sub(p, self.origin);
        [dot(to, self.axes[0]) / self.size, dot(to, self.axes[1]) / self.size, dot(to, self.axes[2])]
    }
}

/// A fitted quadric.
struct Fit {
    coefficients: SVector<f64, TERMS>,
    /// Inverse of the normal matrix.
    inverse: SMatrix<f64, TERMS, TERMS>,
    /// Robust standard deviation of the residuals, metres.
    sigma: f64,
}

fn terms(x: f64, y: f64) -> SVector<f64, TERMS> {
    SVector::from([1.0, x, y, x * x, x * y, y * y])
}

impl Fit {
    fn of(points: &[[f64; 3]]) -> Option<Self> {
        let mut weights = vec![1.0; points.len()];
        let mut fit = None;
        for _ in 0..ITERATIONS {
            let mut normal = SMatrix::<f64, TERMS, TERMS>::zeros();
            let mut right = SVector::<f64, TERMS>::zeros();
            for (&[x, y, z], &w) in points.iter().zip(&weights) {
                let t = terms(x, y);
                normal += w * t * t.transpose();
                right += w * z * t;
            }
            let inverse = normal.cholesky()?.inverse();
            let coefficients = inverse * right;
            let residuals: Vec<f64> = points.iter().map(|&[x, y, z]| z - terms(x, y).dot(&coefficients)).collect();
            let mut sizes: Vec<f64> = residuals.iter().map(|r| r.abs()).collect();
            let middle = sizes.len() / 2;
            let sigma = 1.4826 * *sizes.select_nth_unstable_by(middle, f64::total_cmp).1;
            for (w, r) in weights.iter_mut().zip(&residuals) {
                let share = r / (TUKEY * sigma.max(f64::MIN_POSITIVE));
                *w = if share.abs() < 1.0 { (1.0 - share * share).powi(2) } else { 0.0 };
            }
            fit = Some(Self { coefficients, inverse, sigma });
            // An exact fit has no residuals to weigh by.
            if sigma < 1e-12 {
                break;
            }
        }
        fit
    }

    fn height(&self, x: f64, y: f64) -> f64 {
        terms(x, y).dot(&self.coefficients)
    }

    /// Variance of the height in units of that of a residual.
    fn leverage(&self, x: f64, y: f64) -> f64 {
        let t = terms(x, y);
        t.dot(&(self.inverse * t))
    }
}

#[cfg(test)]
mod tests {
    use super::super::fixtures::{grid, with_defect};
    use super::super::regions::defect_regions;
    use super::*;
    use semascan_model::SemanticMesh;

    fn depth(mesh: &SemanticMesh) -> Result<Quantity, String> {
        let surface = Surface::new(mesh, 1e-3);
        fitted_depth(&surface, &defect_regions(&surface)[0])
    }

    /// A disc of 8 mm around the middle of a bent surface, `deep` millimetres deep in its middle.
    fn pit(deep: f32, noise: f32) -> SemanticMesh {
        let mesh = grid(61, 61, |x, y| {
            let (u, v) = (x as f32 - 30.0, y as f32 - 30.0);
            let bend = 1e-3 * (0.004 * u * u - 0.002 * u * v);
            let hole = (1.0 - (u.hypot(v) / 8.0).powi(4)).max(0.0) * deep * 1e-3;
            let rough = if (x * 7 + y * 13) % 3 == 0 { noise } else { -0.5 * noise };
            bend - hole + rough
        });
        with_defect(mesh, |x, y| (x - 30.0).hypot(y - 30.0) < 8.0)
    }

    #[test]
    fn a_pit_in_a_bent_surface_is_as_deep_as_it_is() {
        for (deep, noise) in [(0.0, 0.0), (1.5, 0.0), (1.5, 4e-5), (-0.7, 4e-5), (0.0, 4e-5)] {
            let found = depth(&pit(deep, noise)).expect("surrounded");
            let expected = f64::from(deep) * 1e-3;
            let uncertainty = found.expanded.expect("known");
            assert!((found.value - expected).abs() < 0.06e-3 + uncertainty, "{found:?} for {deep} mm");
            assert!(uncertainty < 3e-4, "{found:?}");
        }
    }

    #[test]
    fn outliers_in_the_surroundings_do_not_matter() {
        let mut mesh = pit(1.0, 2e-5);
        for v in 0..mesh.len() {
            let [x, y, _] = mesh.vertices.positions[v];
            // A rib beside it.
            if (0.040..0.0425).contains(&x) && y > 0.02 {
                mesh.vertices.positions[v][2] += 4e-3;
            }
        }
        let found = depth(&mesh).expect("surrounded");
        assert!((found.value - 1e-3).abs() < 0.1e-3, "{found:?}");
    }

    #[test]
    fn what_is_not_surrounded_or_bent_has_no_depth() {
        let at_rim = with_defect(grid(61, 61, |_, _| 0.0), |x, y| x < 9.0 && (20.0..40.0).contains(&y));
        assert!(depth(&at_rim).expect_err("one side").contains("all sides"));
        let everywhere = with_defect(grid(21, 21, |_, _| 0.0), |_, _| true);
        assert!(depth(&everywhere).expect_err("nothing around").contains("0 vertices"));
        let mut bent = pit(1.0, 0.0);
        for v in 0..bent.len() {
            let turn = bent.vertices.positions[v][0] * 60.0;
            bent.vertices.normals[v] = [turn.sin(), 0.0, turn.cos()];
        }
        assert!(depth(&bent).expect_err("wound").contains("bent"));
    }
}
