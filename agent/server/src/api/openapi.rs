//! The OpenAPI 3.1 document: paths from the handlers, schemas of the data model from the same types that are written.

use super::problem::Problem;
use super::{account_log, captures, findings, inspections, measurements, pointers, reviews, teaching, trends, views};
use schemars::generate::SchemaSettings;
use semascan_model::record::InspectionRecord;
use semascan_model::review::Review;
use serde_json::{Value, json};
use utoipa::openapi::schema::{Object, SchemaFormat, SchemaType, Type};
use utoipa::openapi::{KnownFormat, ObjectBuilder, OpenApi};

/// Files that can be exported, and their media types.
pub(super) const FILES: [(&str, &str); 6] = [
    ("inspection.json", "application/json"),
    ("cloud.ply", "application/octet-stream"),
    ("mesh.ply", "application/octet-stream"),
    ("scene.glb", "model/gltf-binary"),
    ("truth.ply", "application/octet-stream"),
    ("report.html", "text/html"),
];

/// Statuses that every route may answer with, as a problem.
const PROBLEMS: [(&str, &str); 5] = [
    ("400", "A parameter cannot be used"),
    ("403", "The request comes from elsewhere, or is not allowed"),
    ("404", "There is no such thing"),
    ("500", "A fault of the program"),
    ("503", "What is kept cannot be read now, or too many ask at once"),
];
/// And the route that takes content.
const PROBLEMS_OF_CONTENT: [(&str, &str); 6] = [
    ("408", "The content did not come in time"),
    ("409", "There is another review with this identifier, the model is another one by now, or the inspection runs"),
    ("413", "The content is too large"),
    ("415", "The content is no JSON"),
    ("422", "A field cannot be used"),
    ("507", "The disk is full: nothing was taken in, and the same can be sent again later"),
];

/// The document, with `paths` from the handlers.
pub(super) fn document(mut paths: OpenApi) -> Value {
    paths.info.title = "Semascan agent".into();
    paths.info.version = env!("CARGO_PKG_VERSION").into();
    paths.info.description = Some(
        "Inspections that an agent keeps: their views, findings, verdicts and reviews. Lengths in metres, areas in square \
         metres, positions in the table frame. Errors are `application/problem+json` and name the field at fault. Every answer \
         to GET has an ETag."
            .into(),
    );
    // What is plain data always serialises.
    let mut document = serde_json::to_value(&paths).unwrap_or_default();
    if let Some(info) = document.get_mut("info").and_then(Value::as_object_mut) {
        info.remove("contact");
        info.insert("license".into(), json!({"name": "MIT OR Apache-2.0", "identifier": "MIT OR Apache-2.0"}));
    }
    document["components"]["schemas"] = schemas();
    let operations = document["paths"].as_object_mut().into_iter().flatten();
    for (_, path) in operations {
        for (method, operation) in path.as_object_mut().into_iter().flatten() {
            describe(operation, method == "post");
        }
    }
    document
}

/// Puts in what all operations have alike, and what the handlers cannot say.
fn describe(operation: &mut Value, takes_content: bool) {
    let mut is_export = false;
    let with_content = PROBLEMS_OF_CONTENT.iter().filter(|_| takes_content);
    for (status, description) in PROBLEMS.iter().chain(with_content) {
        operation["responses"][*status] = json!({
            "description": description,
            "content": {"application/problem+json": {"schema": {"$ref": "#/components/schemas/Problem"}}}
        });
    }
    if !takes_content {
        operation["responses"]["304"] = json!({"description": "The client has this already (If-None-Match)"});
    }
    if takes_content {
        operation["requestBody"]["required"] = true.into();
    }
    for parameter in operation["parameters"].as_array_mut().into_iter().flatten() {
        match parameter["name"].as_str() {
            Some("inspection") => parameter["schema"] = json!({"type": "string", "format": "uuid"}),
            Some("view") => parameter["schema"] = json!({"type": "integer", "minimum": 0, "maximum": u32::MAX}),
            Some("file") => {
                let names: Vec<&str> = FILES.iter().map(|(name, _)| *name).collect();
                parameter["schema"] = json!({"type": "string", "enum": names});
                is_export = true;
            }
            _ => {}
        }
    }
    if is_export {
        let bytes = || json!({"schema": {"type": "string", "format": "binary"}});
        let contents = FILES.iter().map(|(_, media_type)| {
            let record = json!({"schema": {"$ref": "#/components/schemas/InspectionRecord"}});
            ((*media_type).to_owned(), if *media_type == "application/json" { record } else { bytes() })
        });
        operation["responses"]["200"]["content"] = Value::Object(contents.collect());
    }
}

fn schemas() -> Value {
    let settings = SchemaSettings::draft2020_12().with(|settings| {
        settings.definitions_path = "/components/schemas".into();
        settings.meta_schema = None;
    });
    let mut generator = settings.into_generator();
    generator.subschema_for::<Problem>();
    generator.subschema_for::<inspections::InspectionList>();
    generator.subschema_for::<inspections::InspectionDetail>();
    generator.subschema_for::<trends::TrendsAnswer>();
    generator.subschema_for::<views::ViewList>();
    generator.subschema_for::<findings::FindingsAnswer>();
    generator.subschema_for::<findings::CriteriaAnswer>();
    generator.subschema_for::<findings::VerdictAnswer>();
    generator.subschema_for::<measurements::MeasurementsAnswer>();
    generator.subschema_for::<reviews::ReviewList>();
    generator.subschema_for::<reviews::ReviewTaken>();
    generator.subschema_for::<teaching::TeachingAnswer>();
    generator.subschema_for::<captures::Capture>();
    generator.subschema_for::<captures::CaptureTaken>();
    generator.subschema_for::<pointers::Pointing>();
    generator.subschema_for::<pointers::PointingTold>();
    generator.subschema_for::<account_log::AccountLog>();
    generator.subschema_for::<Review>();
    generator.subschema_for::<InspectionRecord>();
    Value::Object(generator.take_definitions(true))
}

/// One of some words.
fn one_of(words: &[&str]) -> Object {
    ObjectBuilder::new().schema_type(SchemaType::Type(Type::String)).enum_values(Some(words.iter().copied())).build()
}

/// How inspections stand.
pub(super) fn states() -> Object {
    one_of(&["running", "finished", "stopped", "failed", "interrupted"])
}

/// What is decided.
pub(super) fn decisions() -> Object {
    one_of(&["accept", "rework", "person", "reject"])
}

/// What has classes.
pub(super) fn classes() -> Object {
    one_of(&["components", "defects"])
}

/// What pixels are labelled with.
pub(super) fn instances_too() -> Object {
    one_of(&["components", "defects", "instances"])
}

/// A time.
pub(super) fn times() -> Object {
    let format = SchemaFormat::KnownFormat(KnownFormat::DateTime);
    ObjectBuilder::new().schema_type(SchemaType::Type(Type::String)).format(Some(format)).build()
}

/// A number from 0 on.
pub(super) fn numbers() -> Object {
    ObjectBuilder::new().schema_type(SchemaType::Type(Type::Integer)).minimum(Some(0)).maximum(Some(u32::MAX)).build()
}

/// Most inspections of a page.
pub(super) fn limits() -> Object {
    up_to(200)
}

/// Most views or reviews of a page.
pub(super) fn long_limits() -> Object {
    up_to(500)
}

fn up_to(most: u32) -> Object {
    ObjectBuilder::new().schema_type(SchemaType::Type(Type::Integer)).minimum(Some(1)).maximum(Some(most)).build()
}

/// An identifier.
pub(super) fn identifiers() -> Object {
    let format = SchemaFormat::Custom("uuid".into());
    ObjectBuilder::new().schema_type(SchemaType::Type(Type::String)).format(Some(format)).build()
}
