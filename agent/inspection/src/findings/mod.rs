//! What is found on a finished model: connected defect regions with their place, their size and how sure that is; and what
//! follows from an expectation: a component that was not seen, a surface that is not where it should be.
//!
//! | file | what |
//! |---|---|
//! | `surface.rs` | the mesh, the area of each vertex, what lies beside it |
//! | `regions.rs` | connected regions of one component and defect |
//! | `outline.rs` | closed curves around a region |
//! | `extent.rs` | length and width along the surface |
//! | `depth.rs` | depth against a surface fitted to the surroundings |
//! | `evidence.rs` | which views saw a region, and where in their pictures |
//! | `uncertainty.rs` | uncertainty of area and extent, after the GUM |
//! | `identity.rs` | names that stay |
//! | `completeness.rs` | components that are expected and were not seen, or too little |
//! | `drawn.rs` | figures of what a person drew |
//! | `deviation.rs` | surface that is too far from a reference; depth against it |
//!
//! Everything is measured on the mesh as it was made of the model's points, and with the areas that the figures of the model
//! use: the areas of the findings of a component and defect, with those of the regions that are too small to be one, sum up to
//! the area that the figures state.

mod completeness;
mod depth;
mod deviation;
mod drawn;
mod evidence;
mod extent;
#[cfg(test)]
pub(crate) mod fixtures;
mod identity;
mod outline;
mod regions;
mod surface;
mod uncertainty;

pub(crate) use completeness::completeness;
pub use deviation::Reference;
pub(crate) use drawn::{DrawnOn, measure_drawn};
use uncertainty::KnownPose;

use completeness::incomplete_components;
use deviation::{DeviationRule, compare_with_reference};
use evidence::Evidence;
use extent::Extent;
use nalgebra::Matrix6;
use outline::Outline;
use rayon::prelude::*;
use regions::Region;
use semascan_model::criteria::Criteria;
use semascan_model::finding::{
    ComponentFigures, Depth, Finding, FindingId, FindingKind, FindingsRecord, LabelUncertainty, LeftOut, NamedClass,
    RegionFigures, Spread,
};
use semascan_model::record::Convention;
use semascan_model::{ClassDef, SemanticMesh, Taxonomy};
use semascan_perception::fuse::{FuseError, KeptViews};
use std::collections::BTreeMap;
use surface::Surface;

/// Regions of fewer voxels than this are no findings.
pub(crate) const LEAST_VOXELS: f64 = 8.0;

/// What findings are looked for in.
pub(crate) struct Model<'a> {
    /// The mesh, as it was made.
    pub(crate) mesh: &'a SemanticMesh,
    /// Edge of the voxels that it was made of, metres.
    pub(crate) voxel: f64,
    /// The classes of its labels.
    pub(crate) taxonomy: &'a Taxonomy,
    /// Defect classes that were looked for, or why nobody looked.
    pub(crate) looked_for: &'a Result<Vec<NamedClass>, String>,
    /// The views that it was made of.
    pub(crate) views: &'a KeptViews,
    /// Covariance of each one's pose over (rotation, translation), camera frame, by its place in the capture order.
    pub(crate) covariances: BTreeMap<u32, Matrix6<f64>>,
}

/// The defects of a model. `earlier` are findings of an earlier result on the same part in the same frame, whose names stay.
///
/// # Errors
/// [`FuseError`] if a view that is kept on disk cannot be read back.
pub(crate) fn find(model: &Model<'_>, earlier: &[Finding]) -> Result<FindingsRecord, FuseError> {
    let Model { mesh, voxel, taxonomy, looked_for, views, covariances } = model;
    let poses = known_poses(views, covariances);
    let surface = Surface::new(mesh, *voxel);
    let least_area = LEAST_VOXELS * voxel * voxel;
    let mut regions = Vec::new();
    // Number and area by component and defect.
    let mut small: BTreeMap<(u16, u16), (u64, f64)> = BTreeMap::new();
    for region in if looked_for.is_ok() { regions::defect_regions(&surface) } else { Vec::new() } {
        let area = region.area(&surface);
        if area >= least_area {
            regions.push(region);
        } else {
            let (number, sum) = small.entry((region.component, region.defect)).or_default();
            (*number, *sum) = (*number + 1, *sum + area);
        }
    }
    let left_out = small.into_iter().map(|((component, defect), (regions, area))| LeftOut {
        component: named(&taxonomy.components, component),
        defect: named(&taxonomy.defects, defect),
        regions,
        area,
    });
    let seen = seen_in(&surface, &regions, views)?;
    let mut list: Vec<Finding> = regions
        .par_iter()
        .zip(seen)
        .map(|(region, seen)| Finding {
            id: FindingId::from_bytes([0; 16]),
            kind: FindingKind::Defect { defect: named(&taxonomy.defects, region.defect) },
            component: named(&taxonomy.components, region.component),
            instances: instances(&surface, region.vertices.iter().copied()),
            region: Some(region_figures(&surface, region, seen, &poses)),
        })
        .collect();
    identity::name_all(&mut list, &centroids(&surface, &regions), earlier);
    let (looked_for, not_looked) = match looked_for {
        Ok(classes) => (classes.clone(), None),
        Err(why) => (Vec::new(), Some(why.clone())),
    };
    Ok(FindingsRecord {
        conventions: conventions(),
        looked_for,
        not_looked,
        least_area,
        left_out: left_out.collect(),
        components: component_figures(&surface, &taxonomy.components),
        list,
    })
}

/// Adds to `record` what `criteria` expect and was not found (components, surface off the reference), in place of what earlier
/// criteria made of it, and states depths against the reference. Returns whether the surface was compared with it. `mesh` is that
/// of the record's model, with its classes, made of voxels of edge `voxel` (metres).
pub(crate) fn expected_findings(
    record: &mut FindingsRecord,
    criteria: &Criteria,
    reference: Option<&Reference>,
    mesh: Option<(&SemanticMesh, &Taxonomy)>,
    voxel: Option<f64>,
) -> bool {
    let is_expected = |f: &Finding| matches!(f.kind, FindingKind::Completeness { .. } | FindingKind::Deviation { .. });
    let (earlier, kept): (Vec<Finding>, Vec<Finding>) =
        std::mem::take(&mut record.list).into_iter().partition(is_expected);
    record.list = kept;
    for region in record.list.iter_mut().filter_map(|f| f.region.as_mut()) {
        region.depth.reference = None;
    }
    let mut found: Vec<(Finding, Option<[f64; 3]>)> =
        incomplete_components(&criteria.components, &record.components).into_iter().map(|f| (f, None)).collect();
    let mut compared = false;
    if let (Some(rule), Some(reference), Some((mesh, taxonomy)), Some(voxel)) =
        (&criteria.reference, reference, mesh, voxel)
        && !mesh.triangles.is_empty()
    {
        let rule = DeviationRule { tolerance: rule.tolerance_mm * 1e-3, voxel };
        let beyond = compare_with_reference(record, mesh, taxonomy, reference, rule);
        found.extend(beyond.into_iter().map(|(finding, centroid)| (finding, Some(centroid))));
        compared = true;
    }
    let (mut found, centroids): (Vec<Finding>, Vec<_>) = found.into_iter().unzip();
    identity::name_all(&mut found, &centroids, &earlier);
    record.list.extend(found);
    compared
}

/// A region of a mesh, measured.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasuredRegion {
    /// Component class.
    pub component: u16,
    /// Defect class.
    pub defect: u16,
    /// Its vertices, in order.
    pub vertices: Vec<u32>,
    /// Area as the figures of a model state it, square metres.
    pub area: f64,
    /// Length along the surface, metres.
    pub length: f64,
    /// Width along the surface, metres.
    pub width: f64,
}

/// The defect regions of any mesh whose vertices lie about `voxel` metres apart, however small, in the order of the findings
/// of a model: by component, defect and area, the largest first.
pub fn measure_regions(mesh: &SemanticMesh, voxel: f64) -> Vec<MeasuredRegion> {
    let surface = Surface::new(mesh, voxel);
    let measured = |region: Region| {
        let Extent { length, width } = Extent::of(&surface, &region);
        let area = region.area(&surface);
        MeasuredRegion {
            component: region.component,
            defect: region.defect,
            vertices: region.vertices,
            area,
            length,
            width,
        }
    };
    regions::defect_regions(&surface).into_par_iter().map(measured).collect()
}

/// What the views saw of each region, the best view first.
fn seen_in(surface: &Surface<'_>, regions: &[Region], views: &KeptViews) -> Result<Vec<Evidence>, FuseError> {
    let mut seen: Vec<Evidence> = regions.iter().map(Evidence::none).collect();
    // One view at a time is in memory.
    for i in 0..views.len() {
        let (view, defects) = (views.depth(i)?, views.defects(i)?);
        seen.par_iter_mut().zip(regions).for_each(|(seen, region)| seen.add(surface, region, &view, &defects));
    }
    seen.iter_mut().for_each(Evidence::sort);
    Ok(seen)
}

/// Everything that is measured of a region, without a reference.
fn region_figures(
    surface: &Surface<'_>,
    region: &Region,
    evidence: Evidence,
    poses: &BTreeMap<u32, KnownPose>,
) -> RegionFigures {
    let labels = uncertainty::label_part(surface, region);
    figures_of(surface, region, labels, evidence, poses)
}

/// As [`region_figures`], with the part of the area's standard uncertainty that is the labels' (square metres).
fn figures_of(
    surface: &Surface<'_>,
    region: &Region,
    labels: f64,
    evidence: Evidence,
    poses: &BTreeMap<u32, KnownPose>,
) -> RegionFigures {
    let parts = evidence.uncertainty_parts(surface, region);
    let views = evidence.views;
    let outline = Outline::of(surface, region);
    let extent = Extent::of(surface, region);
    let ([area, length, width], area_budget) =
        uncertainty::figures(surface, region, (&outline, extent), labels, &views, poses);
    let (fitted, unknown) = match depth::fitted_depth(surface, region) {
        Ok(depth) => (Some(depth), None),
        Err(why) => (None, Some(why)),
    };
    let centroid = centroid(surface, region);
    let nearest = region.vertices.iter().map(|v| surface.position(*v)).min_by(|a, b| {
        let to = |p: &[f64; 3]| semascan_geometry::vector::squared_distance(*p, centroid);
        to(a).total_cmp(&to(b))
    });
    let normal = [0, 1, 2].map(|k| region.mean(surface, |v| surface.normal(v).map_or(0.0, |n| n[k])));
    let vertices = &surface.mesh.vertices;
    // A region has vertices.
    let nothing = Spread { mean: f64::NAN, least: f64::NAN, greatest: f64::NAN };
    let spread = |value: &[f32]| spread(surface, &region.vertices, value).unwrap_or(nothing);
    RegionFigures {
        area,
        area_budget,
        length,
        width,
        perimeter: outline.length(),
        depth: Depth { fitted, unknown, reference: None },
        confidence: spread(&vertices.defect_confidence),
        sigma: LabelUncertainty {
            all: spread(&vertices.defect_sigma),
            data: parts.map(|[data, _]| data),
            model: parts.map(|[_, model]| model),
        },
        position: nearest.unwrap_or(centroid),
        normal: semascan_geometry::vector::unit(normal, 1e-9).unwrap_or_default(),
        outlines: outline.curves,
        views,
        footprint: identity::footprint(region.vertices.iter().map(|v| surface.position(*v))),
    }
}

/// Figures of every component class but none.
fn component_figures(surface: &Surface<'_>, classes: &[ClassDef]) -> Vec<ComponentFigures> {
    let vertices = &surface.mesh.vertices;
    let of = |class: &ClassDef| {
        let own: Vec<u32> = (0..surface.mesh.len() as u32).filter(|v| surface.component(*v) == class.id).collect();
        let area = own.iter().map(|v| surface.areas[*v as usize]).sum();
        let unjudged = own.iter().filter(|v| vertices.defect_confidence[**v as usize] <= 0.0);
        ComponentFigures {
            component: NamedClass { class: class.id, name: class.name.clone() },
            instances: instances(surface, own.iter().copied()),
            area: uncertainty::of_component(area),
            unjudged: unjudged.map(|v| surface.areas[*v as usize]).sum(),
            confidence: spread(surface, &own, &vertices.confidence),
            sigma: spread(surface, &own, &vertices.sigma),
        }
    };
    classes.par_iter().filter(|class| class.id != 0).map(of).collect()
}

/// Mean by area, least and greatest of a value over vertices; `None` without any.
fn spread(surface: &Surface<'_>, vertices: &[u32], values: &[f32]) -> Option<Spread> {
    Spread::of(vertices.iter().map(|v| (f64::from(values[*v as usize]), surface.areas[*v as usize])))
}

/// Instances of vertices but 0, in order.
fn instances(surface: &Surface<'_>, vertices: impl Iterator<Item = u32>) -> Vec<u16> {
    let mut list: Vec<u16> =
        vertices.map(|v| surface.mesh.vertices.instances[v as usize]).filter(|i| *i != 0).collect();
    list.sort_unstable();
    list.dedup();
    list
}

fn centroid(surface: &Surface<'_>, region: &Region) -> [f64; 3] {
    [0, 1, 2].map(|k| region.mean(surface, |v| surface.position(v)[k]))
}

fn centroids(surface: &Surface<'_>, regions: &[Region]) -> Vec<Option<[f64; 3]>> {
    regions.iter().map(|region| Some(centroid(surface, region))).collect()
}

fn named(classes: &[ClassDef], class: u16) -> NamedClass {
    let name = classes.get(usize::from(class)).map_or_else(|| format!("class {class}"), |c| c.name.clone());
    NamedClass { class, name }
}

/// The poses of views whose covariance is known.
fn known_poses(views: &KeptViews, covariances: &BTreeMap<u32, Matrix6<f64>>) -> BTreeMap<u32, KnownPose> {
    let known = |(view, table_from_camera)| {
        let covariance = *covariances.get(&view).filter(|c| c.iter().all(|value| value.is_finite()))?;
        Some((view, KnownPose { table_from_camera, covariance }))
    };
    views.indices().into_iter().zip(views.poses()).filter_map(known).collect()
}

fn conventions() -> Vec<Convention> {
    let convention = |name: &str, text: &str| Convention { name: name.into(), text: text.into() };
    vec![
        convention("region", "connected vertices of the mesh with one component and one defect, instances together"),
        convention(
            "area",
            "sum over the vertices of a third of their faces, each counted along the mean normal around it, and of the strip \
             to the rim: as the areas of components and defects",
        ),
        convention("length", "longest of the shortest ways between two points of the region on its own surface"),
        convention("width", "largest area of a slice across that way divided by its thickness"),
        convention(
            "depth",
            "95 % quantile over the region of the distance below a quadric fitted to the sound surface around it, or below the \
             reference; positive where material is missing",
        ),
        convention(
            "expanded",
            "expanded uncertainty, k = 2 (GUM): grid, rims, convention of areas, standard uncertainty of labels taken as \
             alike along a rim, poses",
        ),
        convention("confidence, sigma", "mean by area, least and greatest over the vertices of the region"),
        convention("views", "share: of the region's area, seen where the depth at its pixel agrees with the model"),
    ]
}
