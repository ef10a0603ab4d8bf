//! Small surfaces that tests label, and records and entries about them.

use jiff::Timestamp;
use semascan_model::finding::{
    AreaBudget, Depth, Finding, FindingId, FindingKind, FindingsRecord, Footprint, LabelUncertainty, NamedClass,
    Quantity, RegionFigures, Spread,
};
use semascan_model::record::{
    ClassSummary, FilesRecord, InspectionRecord, LabelSource, Outcome, SCHEMA_VERSION, SoftwareRecord,
};
use semascan_model::review::{Review, ReviewAction, ReviewEntry, ReviewId, ReviewedVersions, Subject};
use semascan_model::{InspectionId, SemanticMesh, SemanticPoint, Taxonomy};
use uuid::Uuid;

/// Components 1 and 2, defects 1 and 2.
pub(crate) fn taxonomy() -> Taxonomy {
    Taxonomy::from_names(&["housing", "gear"], &["wear", "crack"])
}

/// Generation of the models of these records.
const GENERATION: &str = "0199aaaa-0000-7000-8000-000000000001";

fn software() -> SoftwareRecord {
    SoftwareRecord { name: "semascan".into(), version: "1".into() }
}

/// An entry of the log.
pub(crate) fn entry(sequence: u64, subject: Subject, action: ReviewAction) -> ReviewEntry {
    ReviewEntry {
        sequence,
        inspection: InspectionId::new(1, &[7; 10]),
        at: Timestamp::UNIX_EPOCH,
        versions: ReviewedVersions {
            software: software(),
            inspected_with: software(),
            model: Some(GENERATION.into()),
            networks: Vec::new(),
            criteria: None,
        },
        conflicts_with: Vec::new(),
        drawn: None,
        review: Review {
            id: ReviewId(Uuid::from_u128(u128::from(sequence))),
            subject,
            seen: 0,
            model: None,
            action,
            person: "A. Reviewer".into(),
            reason: "as the photograph shows".into(),
            resolves: Vec::new(),
        },
    }
}

/// A record of an inspection that looked for defects and found these, voxels of 1 mm.
pub(crate) fn record(list: Vec<Finding>) -> InspectionRecord {
    let summaries = |names: [&str; 3]| {
        let of = |(class, name): (u16, &str)| ClassSummary {
            class,
            name: name.into(),
            points: 1,
            area: None,
            confidence: 1.0,
            sigma: None,
        };
        (0..).zip(names).map(of).collect::<Vec<_>>()
    };
    InspectionRecord {
        schema_version: SCHEMA_VERSION,
        id: InspectionId::new(1, &[7; 10]),
        began: Timestamp::UNIX_EPOCH,
        ended: None,
        outcome: Outcome::Finished,
        files: Some(FilesRecord { generation: GENERATION.into(), names: Vec::new() }),
        software: software(),
        part: "plate".into(),
        source: "scene".into(),
        labels: LabelSource::Network,
        networks: None,
        settings: Vec::new(),
        voxel: Some(1e-3),
        points: 1,
        base_from_table: None,
        refinement: None,
        photometric: None,
        plan: None,
        run: None,
        views: Vec::new(),
        components: summaries(["none", "housing", "gear"]),
        defects: summaries(["none", "wear", "crack"]),
        findings: Some(FindingsRecord {
            conventions: Vec::new(),
            looked_for: Vec::new(),
            not_looked: None,
            least_area: 0.0,
            left_out: Vec::new(),
            components: Vec::new(),
            list,
        }),
        verdict: None,
        truth: None,
    }
}

/// The finding of wear on housing about the origin.
pub(crate) fn worn_finding() -> Finding {
    let named = |class, name: &str| NamedClass { class, name: name.into() };
    let spread = Spread { mean: 0.1, least: 0.0, greatest: 0.2 };
    let quantity = Quantity::without_uncertainty;
    Finding {
        id: FindingId::from_bytes([0x5a; 16]),
        kind: FindingKind::Defect { defect: named(1, "wear") },
        component: named(1, "housing"),
        instances: Vec::new(),
        region: Some(RegionFigures {
            area: quantity(1.2e-4),
            area_budget: AreaBudget::default(),
            length: quantity(0.015),
            width: quantity(0.011),
            perimeter: 0.044,
            depth: Depth::default(),
            confidence: spread,
            sigma: LabelUncertainty { all: spread, data: None, model: None },
            position: [0.0; 3],
            normal: [0.0, 0.0, 1.0],
            outlines: Vec::new(),
            views: Vec::new(),
            footprint: Footprint::default(),
        }),
    }
}

/// A plate of component 1 in the plane z = 0 that faces upwards, 40 mm wide, its vertices 1 mm apart.
pub(crate) fn plate() -> SemanticMesh {
    const CELLS: u32 = 40;
    let mut mesh = SemanticMesh::default();
    for (j, i) in (0..=CELLS).flat_map(|j| (0..=CELLS).map(move |i| (j, i))) {
        let position = [i as f32 * 1e-3 - 0.02, j as f32 * 1e-3 - 0.02, 0.0];
        let normal = [0.0, 0.0, 1.0];
        mesh.push(SemanticPoint { position, normal, label: 1, confidence: 1.0, ..SemanticPoint::UNKNOWN }, false);
    }
    for (j, i) in (0..CELLS).flat_map(|j| (0..CELLS).map(move |i| (j, i))) {
        let a = j * (CELLS + 1) + i;
        let (b, c, d) = (a + 1, a + CELLS + 1, a + CELLS + 2);
        mesh.triangles.extend([[a, b, d], [a, d, c]]);
    }
    mesh
}
