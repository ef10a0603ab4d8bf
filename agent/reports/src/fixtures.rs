//! Small surfaces and records for the tests of this crate.

use jiff::Timestamp;
use semascan_model::finding::{
    AreaBudget, ComponentFigures, Depth, Finding, FindingId, FindingKind, FindingView, FindingsRecord, Footprint,
    LabelUncertainty, LeftOut, NamedClass, PixelBox, Quantity, RegionFigures, Spread,
};
use semascan_model::measurement::{
    FeatureKind, FitRecord, KeptMeasurement, MeasuredFeature, MeasurementKind, MeasurementRecord,
};
use semascan_model::record::{
    ClassSummary, Convention, FilesRecord, InspectionRecord, LabelSource, Outcome, PoseRecord, QuaternionRecord,
    RegionRecord, RegistrationRecord, RunRecord, SCHEMA_VERSION, Setting, SoftwareRecord, Stage, StageTime, ViewRecord,
};
use semascan_model::review::ReviewId;
use semascan_model::verdict::{Conformity, CriteriaRecord, Decision, JudgedFigure, Verdict, VerdictLine};
use semascan_model::{InspectionId, SemanticMesh, SemanticPoint, Taxonomy};

/// Components 1 (blue) and 2 (orange), defects 1 (yellow) and 2.
pub(crate) fn taxonomy() -> Taxonomy {
    Taxonomy::from_names(&["housing", "gear"], &["wear", "crack"])
}

/// Adds a square of 20 x 20 cells at height `z`, facing upwards, between two corners.
pub(crate) fn quad(
    mesh: &mut SemanticMesh,
    low: [f32; 2],
    high: [f32; 2],
    z: f32,
    label: u16,
    defect: impl Fn([f32; 2]) -> u16,
) {
    const CELLS: u32 = 20;
    let first = mesh.len() as u32;
    for j in 0..=CELLS {
        for i in 0..=CELLS {
            let share = |axis: usize, n: u32| low[axis] + (high[axis] - low[axis]) * n as f32 / CELLS as f32;
            let (x, y) = (share(0, i), share(1, j));
            let vertex = SemanticPoint {
                position: [x, y, z],
                normal: [0.0, 0.0, 1.0],
                label,
                defect: defect([x, y]),
                confidence: 1.0,
                ..SemanticPoint::UNKNOWN
            };
            mesh.push(vertex, false);
        }
    }
    for j in 0..CELLS {
        for i in 0..CELLS {
            let a = first + j * (CELLS + 1) + i;
            let (b, c, d) = (a + 1, a + CELLS + 1, a + CELLS + 2);
            mesh.triangles.extend([[a, b, d], [a, d, c]]);
        }
    }
}

/// A plate of component 2 with a worn square in its middle, 20 mm wide.
pub(crate) fn worn_plate() -> SemanticMesh {
    let mut mesh = SemanticMesh::default();
    let worn = |p: [f32; 2]| u16::from(p[0].abs() <= 0.0101 && p[1].abs() <= 0.0101);
    quad(&mut mesh, [-0.05, -0.05], [0.05, 0.05], 0.0, 2, worn);
    mesh
}

pub(crate) fn class(class: u16, name: &str) -> NamedClass {
    NamedClass { class, name: name.into() }
}

/// The finding on [`worn_plate`].
pub(crate) fn worn_square() -> Finding {
    let spread = |mean| Spread { mean, least: mean / 2.0, greatest: 1.0 };
    Finding {
        id: FindingId::from_bytes([0x5a; 16]),
        kind: FindingKind::Defect { defect: class(1, "wear") },
        component: class(2, "gear"),
        instances: Vec::new(),
        region: Some(RegionFigures {
            area: Quantity::with_standard(4.0e-4, 1.0e-5),
            area_budget: AreaBudget {
                grid: 6e-6,
                other_components: 0.0,
                unseen: 0.0,
                convention: 0.0,
                labels: 8e-6,
                poses: Some(0.0),
            },
            length: Quantity::with_standard(0.028, 0.0005),
            width: Quantity::without_uncertainty(0.02),
            perimeter: 0.08,
            depth: Depth { fitted: None, unknown: Some("no sound surface around it".into()), reference: None },
            confidence: spread(0.9),
            sigma: LabelUncertainty { all: spread(0.05), data: None, model: None },
            position: [0.0, 0.0, 0.0],
            normal: [0.0, 0.0, 1.0],
            outlines: vec![vec![[-0.01, -0.01, 0.0], [0.01, -0.01, 0.0], [0.01, 0.01, 0.0], [-0.01, 0.01, 0.0]]],
            views: vec![FindingView {
                view: 0,
                pixels: PixelBox { left: 140, top: 100, width: 40, height: 40 },
                share: 1.0,
                cosine: 0.98,
            }],
            footprint: Footprint::default(),
        }),
    }
}

/// A record with one view, one finding and a verdict.
pub(crate) fn record() -> InspectionRecord {
    let quantity = Quantity::with_standard(0.01, 1e-4);
    let summary = |class: u16, name: &str, area| ClassSummary {
        class,
        name: name.into(),
        points: 441,
        area,
        confidence: 0.95,
        sigma: Some(0.02),
    };
    let software = SoftwareRecord { name: "semascan".into(), version: "0.1.0".into() };
    let began = Timestamp::from_second(1_790_000_000).expect("in range");
    InspectionRecord {
        schema_version: SCHEMA_VERSION,
        id: InspectionId::new(1_790_000_000_000, &[7; 10]),
        began,
        ended: Timestamp::from_second(1_790_000_004).ok(),
        outcome: Outcome::Finished,
        files: Some(FilesRecord {
            generation: "0199aaaa-0000-7000-8000-000000000001".into(),
            names: vec!["cloud.ply".into(), "mesh.ply".into()],
        }),
        software: software.clone(),
        part: "starter motor 7".into(),
        source: "virtual:starter-motor?seed=7".into(),
        labels: LabelSource::Source,
        networks: None,
        settings: vec![Setting { name: "seed".into(), value: "7".into() }],
        voxel: Some(1e-3),
        points: 441,
        base_from_table: None,
        refinement: None,
        photometric: None,
        plan: None,
        run: Some(RunRecord::new(
            2,
            1,
            0.5,
            RegionRecord { measured: 1000, outside_box: 40, ..RegionRecord::default() },
        )),
        views: vec![
            ViewRecord {
                index: 0,
                stamp: Some(12.5),
                accepted: true,
                reason: None,
                pose: Some(PoseRecord {
                    rotation: QuaternionRecord { x: 1.0, y: 0.0, z: 0.0, w: 0.0 },
                    translation: [0.0, 0.0, 0.3],
                }),
                prior: None,
                covariance: None,
                registration: Some(RegistrationRecord::Kinematic),
                sharpness: None,
                networks: None,
                misidentified: Vec::new(),
                points_added: 441,
                timings: vec![StageTime { stage: Stage::Acquire, seconds: 0.02 }],
            },
            ViewRecord {
                index: 1,
                stamp: None,
                accepted: false,
                reason: Some("depth/1.png: is cut".into()),
                pose: None,
                prior: None,
                covariance: None,
                registration: None,
                sharpness: None,
                networks: None,
                misidentified: Vec::new(),
                points_added: 0,
                timings: Vec::new(),
            },
        ],
        components: vec![summary(0, "none", None), summary(1, "housing", None), summary(2, "gear", Some(0.01))],
        defects: vec![summary(0, "none", Some(9.6e-3)), summary(1, "wear", Some(4e-4)), summary(2, "crack", Some(0.0))],
        findings: Some(FindingsRecord {
            conventions: vec![Convention { name: "area".into(), text: "sum over the vertices".into() }],
            looked_for: vec![class(1, "wear"), class(2, "crack")],
            not_looked: None,
            least_area: 8e-6,
            left_out: vec![LeftOut { component: class(2, "gear"), defect: class(2, "crack"), regions: 3, area: 5e-6 }],
            components: vec![
                ComponentFigures {
                    component: class(1, "housing"),
                    instances: Vec::new(),
                    area: Quantity::without_uncertainty(0.0),
                    unjudged: 0.0,
                    confidence: None,
                    sigma: None,
                },
                ComponentFigures {
                    component: class(2, "gear"),
                    instances: vec![1, 2],
                    area: quantity,
                    unjudged: 1e-5,
                    confidence: Some(Spread { mean: 0.97, least: 0.5, greatest: 1.0 }),
                    sigma: Some(Spread { mean: 0.01, least: 0.0, greatest: 0.2 }),
                },
            ],
            list: vec![
                Finding {
                    id: FindingId::from_bytes([0x11; 16]),
                    kind: FindingKind::Completeness { share: None, least: 0.8, missing: true },
                    component: class(1, "housing"),
                    instances: Vec::new(),
                    region: None,
                },
                worn_square(),
            ],
        }),
        verdict: Some(Verdict {
            criteria: CriteriaRecord { name: "starter motor".into(), revision: "3".into(), sha256: "ab".repeat(32) },
            software,
            at: began,
            automatic: Decision::Reject,
            lines: vec![
                VerdictLine {
                    figure: JudgedFigure::Area,
                    component: Some(class(2, "gear")),
                    defect: Some(class(1, "wear")),
                    findings: vec![FindingId::from_bytes([0x5a; 16])],
                    value: Some(Quantity::with_standard(4.0e-4, 1.0e-5)),
                    limit: Some(3.0e-4),
                    conformity: Conformity::Broken,
                    decision: Decision::Reject,
                    reason: "wear on gear: area 400 +- 20 mm2 is more than 300 mm2".into(),
                },
                VerdictLine {
                    figure: JudgedFigure::Count,
                    component: Some(class(2, "gear")),
                    defect: Some(class(1, "wear")),
                    findings: Vec::new(),
                    value: Some(Quantity::with_standard(1.0, 0.0)),
                    limit: Some(5.0),
                    conformity: Conformity::Holds,
                    decision: Decision::Accept,
                    reason: "wear on gear: 1 finding of at most 5".into(),
                },
            ],
            overrides: Vec::new(),
        }),
        truth: None,
    }
}

fn kept(number: u128, note: &str, measurement: MeasurementRecord) -> KeptMeasurement {
    KeptMeasurement {
        review: ReviewId(uuid::Uuid::from_u128(number)),
        person: "A. Reviewer".into(),
        at: Timestamp::UNIX_EPOCH,
        note: note.into(),
        is_of_earlier_model: number != 1,
        measurement,
    }
}

/// A distance of 50 mm between two points.
pub(crate) fn distance() -> KeptMeasurement {
    let point = |position: [f64; 3]| MeasuredFeature {
        kind: FeatureKind::Point,
        picked: position,
        position,
        direction: None,
        radius: None,
        fit: None,
    };
    let along = [0.03, -0.04, 0.0].map(|way| Quantity { value: way, expanded: Some(1.1e-3) });
    kept(
        1,
        "over the rim",
        MeasurementRecord {
            kind: MeasurementKind::Distance,
            figure: Some(Quantity { value: 0.05, expanded: Some(1.1e-3) }),
            along_axes: Some(along),
            features: vec![point([0.0; 3]), point([0.03, -0.04, 0.0])],
            voxel: 1.4e-3,
            place: [0.015, -0.02, 0.0],
            lines: vec![[[0.0; 3], [0.03, -0.04, 0.0]]],
        },
    )
}

/// A cylinder of radius 12 mm.
pub(crate) fn cylinder() -> KeptMeasurement {
    let feature = MeasuredFeature {
        kind: FeatureKind::Cylinder,
        picked: [0.012, 0.0, 0.0],
        position: [0.0; 3],
        direction: Some([0.0, 0.0, 1.0]),
        radius: Some(0.012),
        fit: Some(FitRecord { rms: 5e-5, largest: 3e-4, used: 812, left_out: 14 }),
    };
    kept(
        2,
        "=bore",
        MeasurementRecord {
            kind: MeasurementKind::Cylinder,
            figure: Some(Quantity { value: 0.012, expanded: Some(2e-5) }),
            along_axes: None,
            features: vec![feature],
            voxel: 1.4e-3,
            place: [0.012, 0.0, 0.0],
            lines: Vec::new(),
        },
    )
}

/// A plane, which has a form and no figure.
pub(crate) fn plane() -> KeptMeasurement {
    let KeptMeasurement { measurement, .. } = cylinder();
    let features = vec![MeasuredFeature { kind: FeatureKind::Plane, radius: None, ..measurement.features[0] }];
    kept(3, "", MeasurementRecord { kind: MeasurementKind::Plane, figure: None, features, ..measurement })
}

/// A right angle of which no uncertainty is known.
pub(crate) fn angle() -> KeptMeasurement {
    let KeptMeasurement { measurement, .. } = distance();
    let figure = Some(Quantity::without_uncertainty(std::f64::consts::FRAC_PI_2));
    kept(4, "", MeasurementRecord { kind: MeasurementKind::Angle, figure, along_axes: None, ..measurement })
}
