//! Reads `inspection.json`. Version 1 had free strings and bare tuples: it is brought to version 2 as JSON, then read.

use super::{InspectionRecord, SCHEMA_VERSION};
use crate::InspectionId;
use jiff::Timestamp;
use serde_json::{Map, Value, json};

/// Why a record cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// It is no JSON, or a field is not what it should be.
    #[error("no record of an inspection: {0}")]
    Json(#[from] serde_json::Error),
    /// It comes from another version of the software.
    #[error("a record of schema version {0}: this program reads 1 to {SCHEMA_VERSION}")]
    Version(u64),
    /// A field of a version 1 record is not what it should be.
    #[error("field {0} of a version 1 record cannot be understood")]
    Field(&'static str),
}

impl InspectionRecord {
    /// Reads a record of version 1 or 2.
    ///
    /// # Errors
    /// [`RecordError`] naming what is wrong.
    pub fn from_json(text: &str) -> Result<Self, RecordError> {
        let mut record: Value = serde_json::from_str(text)?;
        match record.get("schema_version").and_then(Value::as_u64) {
            Some(1) => upgrade(&mut record)?,
            Some(version) if version != u64::from(SCHEMA_VERSION) => return Err(RecordError::Version(version)),
            _ => {}
        }
        Ok(serde_json::from_value(record)?)
    }
}

/// Brings a record of version 1 to version 2.
fn upgrade(record: &mut Value) -> Result<(), RecordError> {
    quaternions(record);
    let fields = record.as_object_mut().ok_or(RecordError::Field("schema_version"))?;
    fields.insert("schema_version".into(), json!(SCHEMA_VERSION));
    let id = fields.get("id").and_then(Value::as_str).unwrap_or_default();
    let (began, id) = identity(id).ok_or(RecordError::Field("id"))?;
    fields.insert("began".into(), json!(began));
    fields.insert("id".into(), json!(id));
    // Version 1 was written for finished inspections alone.
    fields.insert("outcome".into(), json!({ "state": "finished" }));
    rename(fields, "segmentation", "networks");
    tuples(fields, "settings", &["name", "value"]);
    for view in fields.get_mut("views").and_then(Value::as_array_mut).into_iter().flatten() {
        let view = view.as_object_mut().ok_or(RecordError::Field("views"))?;
        upgrade_view(view)?;
    }
    if let Some(truth) = fields.get_mut("truth").and_then(Value::as_object_mut) {
        tuples(truth, "conventions", &["name", "text"]);
        tuples(truth, "poses", &["view", "rotation", "translation"]);
        if let Some(aligned) = truth.get_mut("aligned").and_then(Value::as_object_mut) {
            tuples(aligned, "poses", &["view", "rotation", "translation"]);
            tuples(aligned, "prior_poses", &["view", "rotation", "translation"]);
        }
    }
    Ok(())
}

fn upgrade_view(view: &mut Map<String, Value>) -> Result<(), RecordError> {
    rename(view, "segmentation", "networks");
    if let Some(networks) = view.get_mut("networks").and_then(Value::as_object_mut)
        && let Some(window) = networks.get_mut("window")
    {
        *window = named(window, &["left", "top", "width", "height"]);
    }
    if let Some(registration) = view.get_mut("registration").and_then(Value::as_object_mut) {
        let method = match registration.get("method").and_then(Value::as_str) {
            Some("kinematic") => "kinematic",
            Some("icp") => "icp",
            Some("kept prior") => "kept_prior",
            Some("camera is frame") => "camera_is_frame",
            Some("relocalised") => "relocalized",
            _ => return Err(RecordError::Field("registration.method")),
        };
        registration.insert("method".into(), json!(method));
    }
    // What was handed over in no time: it is no stage any more.
    if let Some(timings) = view.get_mut("timings").and_then(Value::as_array_mut) {
        timings.retain(|timing| timing.get("stage").and_then(Value::as_str) != Some("publish"));
    }
    Ok(())
}

/// When an inspection of version 1 began, and its UUID: `<nanoseconds since 1970, hexadecimal>-<process>`.
fn identity(id: &str) -> Option<(Timestamp, InspectionId)> {
    let (nanos, process) = id.split_once('-')?;
    let nanos = i128::from_str_radix(nanos, 16).ok()?;
    let process = u32::from_str_radix(process, 16).ok()?;
    let began = Timestamp::from_nanosecond(nanos).ok()?;
    let millis = u64::try_from(nanos / 1_000_000).ok()?;
    let mut unique = [0; 10];
    unique[..6].copy_from_slice(&(nanos % 1_000_000).to_be_bytes()[10..]);
    unique[6..].copy_from_slice(&process.to_be_bytes());
    Some((began, InspectionId::new(millis, &unique)))
}

/// Gives the components of every `rotation` beside a `translation` their names.
fn quaternions(value: &mut Value) {
    match value {
        Value::Array(items) => items.iter_mut().for_each(quaternions),
        Value::Object(fields) => {
            if fields.contains_key("translation")
                && let Some(rotation) = fields.get_mut("rotation").filter(|r| r.is_array())
            {
                *rotation = named(rotation, &["x", "y", "z", "w"]);
            }
            fields.values_mut().for_each(quaternions);
        }
        _ => {}
    }
}

fn rename(fields: &mut Map<String, Value>, from: &str, to: &str) {
    if let Some(value) = fields.remove(from) {
        fields.insert(to.into(), value);
    }
}

/// Makes every tuple of the list `field` an object with these names.
fn tuples(fields: &mut Map<String, Value>, field: &str, names: &[&str]) {
    for item in fields.get_mut(field).and_then(Value::as_array_mut).into_iter().flatten() {
        *item = named(item, names);
    }
}

/// An array as an object; what is no array stays.
fn named(value: &Value, names: &[&str]) -> Value {
    match value.as_array() {
        Some(items) => names.iter().zip(items).map(|(name, item)| ((*name).to_owned(), item.clone())).collect(),
        None => value.clone(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::{LabelSource, Outcome, RegistrationRecord, Stage};
    use proptest::prelude::*;

    const VERSION_1: &str = include_str!("fixtures/version1.json");
    const WITH_NETWORKS: &str = include_str!("fixtures/version1_networks.json");

    #[test]
    fn the_mean_confidence_is_that_of_labelled_points() {
        let record = InspectionRecord::from_json(WITH_NETWORKS).expect("version 1");
        let seen: Vec<f64> =
            record.components.iter().filter(|c| c.class != 0 && c.points > 0).map(|c| c.confidence).collect();
        let (least, most) = (seen.iter().copied().fold(1.0, f64::min), seen.iter().copied().fold(0.0, f64::max));
        let mean = record.component_confidence().expect("labelled");
        assert!(least < mean && mean < most, "{least} < {mean} < {most}");
        let unlabelled = InspectionRecord { labels: LabelSource::None, ..record.clone() };
        let empty = InspectionRecord { components: Vec::new(), ..record };
        assert_eq!((unlabelled.component_confidence(), empty.component_confidence()), (None, None));
    }

    #[test]
    fn version_1_is_read_whole() {
        let record = InspectionRecord::from_json(VERSION_1).expect("version 1");
        assert_eq!((record.schema_version, record.labels, record.outcome), (2, LabelSource::Source, Outcome::Finished));
        assert_eq!(record.id.uuid().get_version_num(), 7);
        assert_eq!(record.settings[0].name, "seed");
        assert_eq!(record.views.len(), 3);
        let aligned = record.views.iter().filter_map(|v| v.registration.as_ref());
        assert!(aligned.clone().count() == 3 && aligned.clone().any(|r| matches!(r, RegistrationRecord::Icp { .. })));
        assert!(record.views[0].timings.iter().any(|t| t.stage == Stage::Fuse));
        let truth = record.truth.expect("the virtual cell knows the truth");
        assert_eq!((truth.poses.len(), truth.poses[2].view), (3, 2));
        assert!(truth.aligned.is_some_and(|a| a.prior_poses.len() == 3) && truth.at_true_poses.is_some());
        // The same run has the same identifier, another run another.
        assert_eq!(InspectionRecord::from_json(VERSION_1).expect("again").id, record.id);
        let networks = InspectionRecord::from_json(WITH_NETWORKS).expect("version 1");
        assert_ne!(networks.id, record.id);
        assert!(networks.networks.is_some_and(|n| n.network.models.len() == 3));
        let window = networks.views[0].networks.as_ref().and_then(|n| n.window).expect("the part is in sight");
        assert!(window.width > 0 && window.left + window.width <= 240);
    }

    #[test]
    fn a_record_comes_back_as_it_was() {
        for text in [VERSION_1, WITH_NETWORKS] {
            let record = InspectionRecord::from_json(text).expect("version 1");
            let written = serde_json::to_string(&record).expect("plain data");
            assert_eq!(InspectionRecord::from_json(&written).expect("version 2"), record);
        }
    }

    #[test]
    fn what_is_no_record_is_refused_by_name() {
        let error = |text: &str| InspectionRecord::from_json(text).expect_err("refused").to_string();
        assert!(error("{ \"schema_version\": 3 }").contains('3'));
        assert!(error("{ \"schema_version\": 2 }").contains("id"));
        assert!(error("{ \"schema_version\": 1, \"id\": \"x\" }").contains("id"));
        assert!(error(&VERSION_1.replace("\"icp\",", "\"guess\",")).contains("registration.method"));
        assert!(error("[").contains("no record"));
    }

    #[cfg(feature = "schema")]
    #[test]
    fn the_schema_names_every_field_of_the_record() {
        let schema = InspectionRecord::json_schema();
        let record = InspectionRecord::from_json(WITH_NETWORKS).expect("version 1");
        let record = serde_json::to_value(record).expect("plain data");
        for field in record.as_object().expect("an object").keys() {
            assert!(schema["properties"].get(field).is_some(), "{field}");
        }
    }

    proptest! {
        #[test]
        fn damaged_records_are_read_or_refused(
            damage in prop::collection::vec(
                (any::<prop::sample::Index>(), prop::sample::select(vec!["0", "-1", "1e308", "nan", "99999999999999999999", "null", "[[[[[[[[", "\"", "\u{0}ä", ""])),
                1..6,
            ),
            cut in any::<prop::sample::Index>(),
            is_cut in any::<bool>(),
        ) {
            let mut text: Vec<char> = VERSION_1.chars().collect();
            for (at, word) in damage {
                let at = at.index(text.len());
                drop(text.splice(at..=at, word.chars()));
            }
            if is_cut {
                text.truncate(cut.index(text.len() + 1));
            }
            let text: String = text.into_iter().collect();
            let _ = InspectionRecord::from_json(&text);
        }
    }
}
