//! Names of findings that stay.
//!
//! A finding's first name is made of what it is and where: the hash of its kind, component and defect and of the cell of a
//! grid of 10 mm, in the table frame, that its centroid lies in. The same recording gives the same model and so the same
//! names. A model with other poses or another voxel has the same findings a little elsewhere: where an earlier result is at
//! hand, a finding that lies on one of that takes its name. Overlap is told by the cells of 2 mm that both touch.

use semascan_model::finding::{Finding, FindingId, FindingKind, Footprint};
use sha2::{Digest, Sha256};
use std::collections::BTreeSet;

/// Edge of the cells that names are made of, metres.
const NAME_CELL: f64 = 10e-3;
/// Edge of the cells that overlap is told by, metres.
const CELL: f64 = 2e-3;
/// Least share of the smaller footprint that lies on or beside the other.
const OVERLAP: f64 = 0.5;

/// The cells that points in the table frame (metres) lie in.
pub(crate) fn footprint(points: impl Iterator<Item = [f64; 3]>) -> Footprint {
    let cells: BTreeSet<[i32; 3]> = points.map(|p| cell_of(p, CELL)).collect();
    Footprint { cell: CELL, cells: cells.into_iter().collect() }
}

fn cell_of(p: [f64; 3], edge: f64) -> [i32; 3] {
    p.map(|c| (c / edge).floor() as i32)
}

/// Names the findings of a list, each of which comes with its centroid (metres, table frame); the same list gets the same
/// names. `earlier` are findings of an earlier result on the same part in the same frame.
pub(crate) fn name_all(findings: &mut [Finding], centroids: &[Option<[f64; 3]>], earlier: &[Finding]) {
    let kept = matched(findings, earlier);
    let mut taken: BTreeSet<FindingId> = kept.iter().flatten().copied().collect();
    for ((finding, centroid), kept) in findings.iter_mut().zip(centroids).zip(kept) {
        finding.id = kept.unwrap_or_else(|| {
            let mut ordinal = 0;
            loop {
                let id = name(finding, *centroid, ordinal);
                if taken.insert(id) {
                    return id;
                }
                ordinal += 1;
            }
        });
    }
}

fn name(finding: &Finding, centroid: Option<[f64; 3]>, ordinal: u32) -> FindingId {
    let mut hash = Sha256::new();
    let defect = finding.kind.defect().map_or("", |d| d.name.as_str());
    for text in [finding.kind.name(), &finding.component.name, defect] {
        hash.update((text.len() as u64).to_le_bytes());
        hash.update(text.as_bytes());
    }
    for c in centroid.map_or([0; 3], |p| cell_of(p, NAME_CELL)) {
        hash.update(c.to_le_bytes());
    }
    hash.update(ordinal.to_le_bytes());
    let digest = hash.finalize();
    FindingId::from_bytes(std::array::from_fn(|i| digest[i]))
}

/// For each finding the name of the earlier one that it is, if it is one: pairs are made from the best overlap down.
fn matched(findings: &[Finding], earlier: &[Finding]) -> Vec<Option<FindingId>> {
    let mut pairs: Vec<(f64, usize, usize)> = Vec::new();
    for (i, now) in findings.iter().enumerate() {
        for (j, before) in earlier.iter().enumerate().filter(|(_, before)| is_alike(now, before)) {
            match (&now.region, &before.region) {
                (Some(a), Some(b)) => pairs.extend(overlap(&a.footprint, &b.footprint).map(|share| (share, i, j))),
                // What was not seen has no place but its component.
                (None, None) => pairs.push((1.0, i, j)),
                _ => {}
            }
        }
    }
    pairs.sort_by(|a, b| b.0.total_cmp(&a.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    let (mut names, mut used) = (vec![None; findings.len()], vec![false; earlier.len()]);
    for (_, i, j) in pairs {
        if names[i].is_none() && !used[j] {
            (names[i], used[j]) = (Some(earlier[j].id), true);
        }
    }
    names
}

/// Whether two findings can be the same one. Classes are compared by name: another taxonomy has other numbers.
fn is_alike(a: &Finding, b: &Finding) -> bool {
    let defect = |f: &Finding| f.kind.defect().map(|d| d.name.clone());
    let by_person = |f: &Finding| matches!(f.kind, FindingKind::Drawn { .. });
    a.kind.name() == b.kind.name()
        && a.component.name == b.component.name
        && defect(a) == defect(b)
        && !by_person(a)
        && !by_person(b)
}

/// How far two footprints overlap: the share of the smaller one that lies in cells of the other, where cells beside those
/// count half. `None` where they are not the same place.
fn overlap(a: &Footprint, b: &Footprint) -> Option<f64> {
    if a.cell != b.cell || a.cells.is_empty() || b.cells.is_empty() {
        return None;
    }
    let (small, large) = if a.cells.len() <= b.cells.len() { (a, b) } else { (b, a) };
    let large: BTreeSet<[i32; 3]> = large.cells.iter().copied().collect();
    let beside =
        |c: &[i32; 3]| (0..27).any(|k| large.contains(&[c[0] + k % 3 - 1, c[1] + k / 3 % 3 - 1, c[2] + k / 9 - 1]));
    let on = small.cells.iter().filter(|c| large.contains(*c)).count() as f64;
    let near = small.cells.iter().filter(|c| beside(c)).count() as f64;
    let all = small.cells.len() as f64;
    // Of two that a small one lies on, the one of its own size is meant.
    let alike = all / large.len() as f64;
    (near / all >= OVERLAP).then(|| 0.5 * (on + near) / all + 0.1 * alike)
}

#[cfg(test)]
mod tests {
    use super::*;
    use semascan_model::finding::{Depth, LabelUncertainty, NamedClass, Quantity, RegionFigures, Spread};

    fn finding(defect: &str, middle: [f64; 3], radius: f64) -> Finding {
        let named = |name: &str| NamedClass { class: 1, name: name.into() };
        let quantity = Quantity::without_uncertainty(1.0);
        let spread = Spread { mean: 1.0, least: 1.0, greatest: 1.0 };
        let steps = || (-20..=20).map(|k| f64::from(k) * 0.05 * radius);
        let points = steps().flat_map(|x| steps().map(move |y| [middle[0] + x, middle[1] + y, middle[2]]));
        Finding {
            id: FindingId::from_bytes([0; 16]),
            kind: FindingKind::Defect { defect: named(defect) },
            component: named("gear"),
            instances: Vec::new(),
            region: Some(RegionFigures {
                area: quantity,
                area_budget: Default::default(),
                length: quantity,
                width: quantity,
                perimeter: 1.0,
                depth: Depth::default(),
                confidence: spread,
                sigma: LabelUncertainty { all: spread, data: None, model: None },
                position: middle,
                normal: [0.0; 3],
                outlines: Vec::new(),
                views: Vec::new(),
                footprint: footprint(points),
            }),
        }
    }

    fn named(list: &[(&str, [f64; 3], f64)], earlier: &[Finding]) -> Vec<Finding> {
        let mut findings: Vec<Finding> = list.iter().map(|(d, p, r)| finding(d, *p, *r)).collect();
        name_all(&mut findings, &list.iter().map(|(_, p, _)| Some(*p)).collect::<Vec<_>>(), earlier);
        findings
    }

    fn ids(findings: &[Finding]) -> Vec<FindingId> {
        findings.iter().map(|f| f.id).collect()
    }

    #[test]
    fn the_same_findings_have_the_same_names_and_different_ones_different_names() {
        let list = [
            ("wear", [0.0099, 0.0, 0.0], 4e-3),
            ("crack", [0.0099, 0.0, 0.0], 4e-3),
            ("wear", [0.05, 0.02, 0.0], 9e-3),
            // In the same cell as the first.
            ("wear", [0.002, 0.001, 0.001], 1e-3),
        ];
        let first = ids(&named(&list, &[]));
        assert_eq!(ids(&named(&list, &[])), first);
        assert_eq!(first.iter().collect::<BTreeSet<_>>().len(), 4);
    }

    #[test]
    fn a_finding_that_moved_a_little_keeps_its_name() {
        let list = [
            ("wear", [0.0099, 0.0, 0.0], 4e-3),
            ("crack", [0.0099, 0.0, 0.0], 4e-3),
            ("wear", [0.0231, 0.0, 0.0], 2e-3),
        ];
        let earlier = named(&list, &[]);
        // Past borders of cells, in another order, larger, and with a new one between them.
        let moved = [
            ("wear", [0.0238, 0.0004, -0.0003], 2e-3),
            ("wear", [0.0165, 0.0, 0.0], 1e-3),
            ("wear", [0.0103, 0.0003, -0.0004], 5e-3),
            ("crack", [0.0103, 0.0003, -0.0004], 3e-3),
        ];
        let without = ids(&named(&moved, &[]));
        assert_ne!(without[2], earlier[0].id, "it lies in another cell");
        let now = ids(&named(&moved, &earlier));
        assert_eq!([now[0], now[2], now[3]], [earlier[2].id, earlier[0].id, earlier[1].id]);
        assert!(!ids(&earlier).contains(&now[1]));
    }

    #[test]
    fn another_defect_or_place_is_another_finding() {
        let earlier = named(&[("wear", [0.0, 0.0, 0.0], 4e-3)], &[]);
        for other in [("crack", [0.0, 0.0, 0.0], 4e-3), ("wear", [0.03, 0.0, 0.0], 4e-3)] {
            assert_ne!(named(&[other], &earlier)[0].id, earlier[0].id);
        }
        // A new one in the cell of an earlier one that is found again elsewhere does not take its name.
        let again = [("wear", [0.004, 0.0, 0.0], 4e-3), ("wear", [0.0, 0.0, 0.0085], 1e-4)];
        let now = named(&again, &earlier);
        assert_eq!(now[0].id, earlier[0].id);
        assert_ne!(now[1].id, earlier[0].id);
    }
}
