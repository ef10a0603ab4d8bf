//! Cameras, findings and the mesh as entities of a 3D scene.

use crate::TABLE;
use crate::schema::{
    Color, FrameTransform, KeyValuePair, LinePrimitive, ModelPrimitive, Point3, Pose, Quaternion, SceneEntity,
    SceneEntityDeletion, SceneUpdate, TextPrimitive, Vector3, line_primitive, scene_entity_deletion,
};
use nalgebra::{Isometry3, Point3 as Point, Translation3, UnitQuaternion, Vector3 as Vector};
use prost_types::Timestamp;
use semascan_model::finding::{Finding, FindingKind};
use semascan_protocol::ViewReport;

/// How far from the camera its frustum is drawn, metres.
const FRUSTUM: f64 = 0.05;
/// Thickness of lines, pixels.
const THICKNESS: f64 = 2.0;
/// Height of letters, pixels, and how far from the surface a text stands, metres.
const LETTERS: f64 = 14.0;
const ABOVE: f64 = 0.008;

const ACCEPTED: [f64; 4] = [0.25, 0.6, 1.0, 1.0];
const REJECTED: [f64; 4] = [0.9, 0.25, 0.2, 1.0];
const FOUND: [f64; 4] = [1.0, 0.88, 0.29, 1.0];

fn color([r, g, b, a]: [f64; 4]) -> Option<Color> {
    Some(Color { r, g, b, a })
}

fn point(p: &Point<f64>) -> Point3 {
    Point3 { x: p.x, y: p.y, z: p.z }
}

fn quaternion(q: &UnitQuaternion<f64>) -> Quaternion {
    Quaternion { x: q.i, y: q.j, z: q.k, w: q.w }
}

pub(crate) fn identity() -> Pose {
    at(&Point::origin())
}

fn at(p: &Point<f64>) -> Pose {
    Pose {
        position: Some(Vector3 { x: p.x, y: p.y, z: p.z }),
        orientation: Some(quaternion(&UnitQuaternion::identity())),
    }
}

/// Where the camera of a view stood, if that is known.
pub(crate) fn table_from_camera(view: &ViewReport) -> Option<Isometry3<f64>> {
    let pose = view.table_from_camera.as_ref()?;
    let q = nalgebra::Quaternion::new(pose.qw, pose.qx, pose.qy, pose.qz);
    let translation = Translation3::new(pose.tx, pose.ty, pose.tz);
    let is_one = q.norm() > 0.5 && q.norm().is_finite() && translation.vector.iter().all(|c| c.is_finite());
    is_one.then(|| Isometry3::from_parts(translation, UnitQuaternion::new_normalize(q)))
}

/// The frame of a view's camera in that of the table: x to the right, y down, z ahead, as optical frames have it.
pub(crate) fn transform(timestamp: Timestamp, child: String, table_from_camera: &Isometry3<f64>) -> FrameTransform {
    let t = &table_from_camera.translation.vector;
    FrameTransform {
        timestamp: Some(timestamp),
        parent_frame_id: TABLE.to_owned(),
        child_frame_id: child,
        translation: Some(Vector3 { x: t.x, y: t.y, z: t.z }),
        rotation: Some(quaternion(&table_from_camera.rotation)),
    }
}

/// The frustum of a view's camera, with its number; nothing where its pose or its lens is not known.
pub(crate) fn frustum(timestamp: Timestamp, view: &ViewReport) -> Option<SceneEntity> {
    let (pose, k) = (table_from_camera(view)?, view.intrinsics.as_ref()?);
    if !(k.fx > 0.0 && k.fy > 0.0) {
        return None;
    }
    let (right, down) = (f64::from(k.width) - 0.5, f64::from(k.height) - 0.5);
    let corners = [[-0.5, -0.5], [right, -0.5], [right, down], [-0.5, down]]
        .map(|[u, v]| pose * Point::new((u - k.cx) / k.fx * FRUSTUM, (v - k.cy) / k.fy * FRUSTUM, FRUSTUM));
    let eye = pose * Point::origin();
    let edges = (0..4).flat_map(|k| [eye, corners[k], corners[k], corners[(k + 1) % 4]]);
    let shade = if view.accepted { ACCEPTED } else { REJECTED };
    Some(SceneEntity {
        lines: vec![lines(line_primitive::Type::LineList, edges.map(|p| point(&p)).collect(), shade)],
        texts: vec![text((view.index + 1).to_string(), &eye, shade)],
        metadata: (!view.reason.is_empty()).then(|| remark("rejected", &view.reason)).into_iter().collect(),
        ..entity(timestamp, format!("view {}", view.index + 1))
    })
}

fn entity(timestamp: Timestamp, id: String) -> SceneEntity {
    SceneEntity { timestamp: Some(timestamp), frame_id: TABLE.to_owned(), id, ..SceneEntity::default() }
}

fn lines(kind: line_primitive::Type, points: Vec<Point3>, shade: [f64; 4]) -> LinePrimitive {
    LinePrimitive {
        r#type: kind.into(),
        pose: Some(identity()),
        thickness: THICKNESS,
        scale_invariant: true,
        points,
        color: color(shade),
        ..LinePrimitive::default()
    }
}

fn text(text: String, place: &Point<f64>, shade: [f64; 4]) -> TextPrimitive {
    TextPrimitive {
        pose: Some(at(place)),
        billboard: true,
        font_size: LETTERS,
        scale_invariant: true,
        color: color(shade),
        text,
    }
}

fn remark(key: &str, value: &str) -> KeyValuePair {
    KeyValuePair { key: key.to_owned(), value: value.to_owned() }
}

/// What takes everything of a topic away.
pub(crate) fn nothing(timestamp: Timestamp) -> SceneUpdate {
    let kind = scene_entity_deletion::Type::All.into();
    let all = SceneEntityDeletion { timestamp: Some(timestamp), r#type: kind, id: String::new() };
    SceneUpdate { deletions: vec![all], entities: Vec::new() }
}

/// The findings that have a place: their outlines, and what they are beside them. They take the place of those before.
pub fn findings(timestamp: Timestamp, findings: &[Finding]) -> SceneUpdate {
    SceneUpdate { entities: findings.iter().filter_map(|one| finding(timestamp, one)).collect(), ..nothing(timestamp) }
}

fn finding(timestamp: Timestamp, finding: &Finding) -> Option<SceneEntity> {
    let region = finding.region.as_ref()?;
    let kind = match &finding.kind {
        FindingKind::Deviation { greatest, .. } => format!("deviation of {:.2} mm", 1e3 * greatest.value),
        kind => kind.defect().map_or_else(|| kind.name().to_owned(), |defect| defect.name.clone()),
    };
    let area = match region.area.expanded {
        Some(expanded) => format!("{:.1} ± {:.1} mm²", 1e6 * region.area.value, 1e6 * expanded),
        None => format!("{:.1} mm²", 1e6 * region.area.value),
    };
    let place = Point::from(region.position) + Vector::from(region.normal) * ABOVE;
    let outline = |outline: &Vec<[f64; 3]>| {
        let points = outline.iter().map(|p| point(&Point::from(*p))).collect();
        lines(line_primitive::Type::LineLoop, points, FOUND)
    };
    Some(SceneEntity {
        metadata: vec![
            remark("finding", &finding.id.to_string()),
            remark("component", &finding.component.name),
            remark("kind", &kind),
            remark("area", &area),
        ],
        lines: region.outlines.iter().map(outline).collect(),
        texts: vec![text(format!("{kind}, {}, {area}", finding.component.name), &place, FOUND)],
        ..entity(timestamp, finding.id.to_string())
    })
}

/// The mesh of a model, of which `glb` is the scene: metres, y up as glTF has it. `None` takes it away.
pub fn mesh(timestamp: Timestamp, glb: Option<Vec<u8>>) -> SceneUpdate {
    let model = |data| SceneEntity {
        models: vec![ModelPrimitive {
            pose: Some(identity()),
            scale: Some(Vector3 { x: 1.0, y: 1.0, z: 1.0 }),
            media_type: "model/gltf-binary".to_owned(),
            data,
            ..ModelPrimitive::default()
        }],
        ..entity(timestamp, "mesh".to_owned())
    };
    SceneUpdate { entities: glb.map(model).into_iter().collect(), ..nothing(timestamp) }
}
