//! Findings against the true regions: which were found, which findings are false, and how far area and length are off.
//!
//! A finding and a true region of the same component and defect are compared where a third of one of them lies on the other. One that is found in two pieces, or two that are found as one, are compared as a group, area against area; lengths
//! only where one finding is one region. A finding most of whose surface has the defect in truth, but on surface that counts
//! as unseen (it is seen at too flat an angle), is neither right nor false.

use super::true_regions::{TrueRegion, TrueRegions};
use semascan_geometry::measure::NearestPoints;
use semascan_inspection::Inspected;
use semascan_inspection::findings::measure_regions;
use semascan_model::finding::{AreaBudget, Finding, Quantity};
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};

/// Farthest that a vertex of the model may lie from a true region that it is on, metres.
const REACH: f64 = 1.5e-3;
/// Share of a finding or region that lies on the other from which on they are compared.
const OVERLAP: f64 = 1.0 / 3.0;
/// Seen area from which on a region must be found, square metres.
pub const COUNTED: f64 = 25e-6;

/// A stated figure beside the true one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Compared {
    /// As stated.
    pub stated: Quantity,
    /// The truth.
    pub truth: f64,
}

impl Compared {
    /// Relative error of the stated value.
    pub fn error(&self) -> f64 {
        self.stated.value / self.truth - 1.0
    }

    /// Whether the interval holds the truth; `None` where it is not known.
    pub fn is_covered(&self) -> Option<bool> {
        self.stated.interval().map(|(low, high)| (low..=high).contains(&self.truth))
    }
}

/// Findings and true regions that lie on each other.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Match {
    /// Component class.
    pub component: u16,
    /// Defect class.
    pub defect: u16,
    /// Number of findings and of regions.
    pub members: (usize, usize),
    /// Areas, square metres.
    pub area: Compared,
    /// What the uncertainty of the area is made of; those of several findings are summed.
    pub budget: AreaBudget,
    /// Lengths, metres; only where one finding is one region.
    pub length: Option<Compared>,
}

/// The findings of one part against truth.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct FindingScores {
    /// Findings.
    pub findings: usize,
    /// Findings that are on no true region.
    pub false_findings: usize,
    /// Findings on true regions that count as unseen.
    pub unseen: usize,
    /// True regions with at least [`COUNTED`] of seen area.
    pub regions: usize,
    /// Those of them that were found.
    pub found: usize,
    /// What is compared.
    pub matches: Vec<Match>,
}

/// Judges the defects that `inspected` found. `None` if it has no findings: nobody looked.
pub fn score_findings(inspected: &Inspected, truth: &TrueRegions) -> Option<FindingScores> {
    let findings = inspected.record.findings.as_ref()?;
    let voxel = inspected.record.voxel?;
    // The same regions, in the same order, and their vertices.
    let measured: Vec<_> =
        measure_regions(&inspected.mesh, voxel).into_iter().filter(|r| r.area >= findings.least_area).collect();
    let list: Vec<&Finding> = findings.list.iter().filter(|f| f.kind.defect().is_some()).collect();
    let of_truth =
        |regions: &[TrueRegion]| ByClass::new(regions.iter().map(|r| ((r.component, r.defect), r.points.clone())));
    let (seen, all) = (of_truth(&truth.seen), of_truth(&truth.all));
    let mut overlaps: BTreeMap<(usize, usize), f64> = BTreeMap::new();
    let mut on_truth = vec![0.0; list.len()];
    for (i, region) in measured.iter().enumerate() {
        let class = (region.component, region.defect);
        let each = region.area / region.vertices.len() as f64;
        for v in &region.vertices {
            let place = inspected.mesh.vertices.positions[*v as usize];
            if let Some(j) = seen.region_at(class, place) {
                *overlaps.entry((i, j)).or_default() += each;
            }
            if all.region_at(class, place).is_some() {
                on_truth[i] += each;
            }
        }
    }
    let area = |i: usize| list[i].area().map_or(0.0, |a| a.value);
    let mut pairs: BTreeSet<(usize, usize)> = BTreeSet::new();
    pairs.extend(overlaps.iter().filter(|((i, _), overlap)| **overlap >= OVERLAP * area(*i)).map(|(pair, _)| *pair));
    // Small pieces of truth lie on a finding between vertices of it: they are looked up the other way round.
    let stated = ByClass::new(measured.iter().map(|region| {
        let points = region.vertices.iter().map(|v| inspected.mesh.vertices.positions[*v as usize]).collect();
        ((region.component, region.defect), points)
    }));
    for (j, region) in truth.seen.iter().enumerate() {
        let mut on: BTreeMap<usize, usize> = BTreeMap::new();
        for place in &region.points {
            if let Some(i) = stated.region_at((region.component, region.defect), *place) {
                *on.entry(i).or_default() += 1;
            }
        }
        let enough = |count: &usize| *count as f64 >= OVERLAP * region.points.len() as f64;
        pairs.extend(on.iter().filter(|(_, count)| enough(count)).map(|(i, _)| (*i, j)));
    }
    let pairs: Vec<(usize, usize)> = pairs.into_iter().collect();
    let matches = groups(list.len(), truth.seen.len(), &pairs)
        .into_iter()
        .map(|(stated, true_ones)| compare(&list, &truth.seen, &stated, &true_ones))
        .collect();
    let is_matched = |i: usize| pairs.iter().any(|(k, _)| *k == i);
    let alone = (0..list.len()).filter(|i| !is_matched(*i));
    let (unseen, wrong): (Vec<usize>, Vec<usize>) = alone.partition(|i| on_truth[*i] >= 0.5 * area(*i));
    let counted: Vec<usize> = (0..truth.seen.len()).filter(|j| truth.seen[*j].area >= COUNTED).collect();
    Some(FindingScores {
        findings: list.len(),
        false_findings: wrong.len(),
        unseen: unseen.len(),
        found: counted.iter().filter(|j| pairs.iter().any(|(_, k)| k == *j)).count(),
        regions: counted.len(),
        matches,
    })
}

fn compare(list: &[&Finding], truth: &[TrueRegion], stated: &[usize], true_ones: &[usize]) -> Match {
    let sum = |values: Vec<Quantity>| Quantity {
        value: values.iter().map(|q| q.value).sum(),
        // What is common to all does not average out.
        expanded: values.iter().map(|q| q.expanded).sum(),
    };
    let areas = sum(stated.iter().filter_map(|i| list[*i].area()).collect());
    let first = &truth[true_ones[0]];
    let length = match (stated, true_ones) {
        ([i], [_]) => list[*i].region.as_ref().map(|r| Compared { stated: r.length, truth: first.length }),
        _ => None,
    };
    Match {
        component: first.component,
        defect: first.defect,
        members: (stated.len(), true_ones.len()),
        budget: budget(stated.iter().filter_map(|i| list[*i].region.as_ref()).map(|r| r.area_budget)),
        area: Compared { stated: areas, truth: true_ones.iter().map(|j| truth[*j].area).sum() },
        length,
    }
}

/// The budgets of several findings, summed: what is common to all does not average out.
fn budget(each: impl Iterator<Item = AreaBudget>) -> AreaBudget {
    each.reduce(|a, b| AreaBudget {
        grid: a.grid + b.grid,
        other_components: a.other_components + b.other_components,
        unseen: a.unseen + b.unseen,
        convention: a.convention + b.convention,
        labels: a.labels + b.labels,
        poses: a.poses.zip(b.poses).map(|(a, b)| a + b),
    })
    .unwrap_or_default()
}

/// Connected groups of findings and regions.
fn groups(findings: usize, regions: usize, pairs: &[(usize, usize)]) -> Vec<(Vec<usize>, Vec<usize>)> {
    // The group of each: the smallest number of a finding in it, made smaller until nothing changes.
    let mut of_finding: Vec<usize> = (0..findings).collect();
    let mut of_region = vec![usize::MAX; regions];
    loop {
        let before = (of_finding.clone(), of_region.clone());
        for &(i, j) in pairs {
            let group = of_finding[i].min(of_region[j]);
            (of_finding[i], of_region[j]) = (group, group);
        }
        if before == (of_finding.clone(), of_region.clone()) {
            break;
        }
    }
    let members = |of: &[usize], group: usize| (0..of.len()).filter(|i| of[*i] == group).collect::<Vec<_>>();
    (0..findings)
        .map(|group| (members(&of_finding, group), members(&of_region, group)))
        .filter(|(_, regions)| !regions.is_empty())
        .collect()
}

/// Regions by class, to be found by a place.
struct ByClass(BTreeMap<Class, (NearestPoints, Vec<usize>)>);

/// Component and defect class.
type Class = (u16, u16);

/// Points, and the region of each.
type Numbered = (Vec<[f32; 3]>, Vec<usize>);

impl ByClass {
    /// Regions by their class and points, numbered through.
    fn new(regions: impl Iterator<Item = (Class, Vec<[f32; 3]>)>) -> Self {
        let mut points: BTreeMap<Class, Numbered> = BTreeMap::new();
        for (number, (class, of_region)) in regions.enumerate() {
            let (places, numbers) = points.entry(class).or_default();
            numbers.extend(std::iter::repeat_n(number, of_region.len()));
            places.extend(of_region);
        }
        Self(
            points
                .into_iter()
                .map(|(class, (places, numbers))| (class, (NearestPoints::new(&places), numbers)))
                .collect(),
        )
    }

    fn region_at(&self, class: Class, place: [f32; 3]) -> Option<usize> {
        let (index, numbers) = self.0.get(&class)?;
        let nearest = index.nearest(place).filter(|n| n.distance() <= REACH)?;
        numbers.get(nearest.index as usize).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_lies_on_each_other_is_one_group() {
        let found = groups(4, 3, &[(0, 1), (2, 1), (3, 0)]);
        assert_eq!(found, [(vec![0, 2], vec![1]), (vec![3], vec![0])]);
        assert!(groups(2, 2, &[]).is_empty());
    }

    #[test]
    fn an_interval_holds_the_truth_or_not() {
        let compared = |value, expanded, truth| Compared { stated: Quantity { value, expanded }, truth };
        assert_eq!(compared(10.0, Some(1.0), 10.9).is_covered(), Some(true));
        assert_eq!(compared(10.0, Some(1.0), 11.1).is_covered(), Some(false));
        assert_eq!(compared(10.0, None, 10.0).is_covered(), None);
        assert!((compared(11.0, None, 10.0).error() - 0.1).abs() < 1e-12);
    }
}
