//! The JSON Schema of `cell.toml`, read as JSON. It is made of the sample, which a test holds to every key there is: a key's type is
//! that of its value there, and its description the comment above it.

use super::config::{SAMPLE, is_sample_key};
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;

/// A section of the file.
#[derive(Default)]
struct Section {
    description: String,
    /// Schemas of its keys.
    keys: Map<String, Value>,
}

/// Sections by their names, the file itself under none.
type Sections = BTreeMap<Vec<String>, Section>;

/// The schema.
pub(crate) fn json_schema() -> Value {
    let mut sections = Sections::new();
    let mut name: Vec<String> = Vec::new();
    let mut comment: Vec<&str> = Vec::new();
    // A comment is of the keys below it, of which there may be several.
    let mut is_used = false;
    for line in SAMPLE.lines() {
        if let Some(header) = line.strip_prefix('[').and_then(|line| line.strip_suffix(']')) {
            name = header.split('.').map(str::to_owned).collect();
            sections.entry(name.clone()).or_default().description = comment.join(" ");
            comment.clear();
        } else if is_sample_key(line) {
            let key = toml::from_str::<toml::Table>(line.trim_start_matches('#')).unwrap_or_default();
            for (key, value) in key {
                let mut schema = of_value(&value);
                schema["description"] = comment.join(" ").into();
                sections.entry(name.clone()).or_default().keys.insert(key, schema);
            }
            is_used = true;
        } else if let Some(text) = line.strip_prefix("# ") {
            if std::mem::take(&mut is_used) {
                comment.clear();
            }
            comment.push(text);
        } else {
            comment.clear();
        }
    }
    let mut root = assembled(&sections, &[]);
    root["$schema"] = "https://json-schema.org/draft/2020-12/schema".into();
    root["title"] = "cell.toml".into();
    root
}

/// The schema of a section with those in it.
fn assembled(sections: &Sections, name: &[String]) -> Value {
    let own = sections.get(name);
    let mut properties = own.map(|section| section.keys.clone()).unwrap_or_default();
    for inner in sections.keys().filter(|inner| inner.len() == name.len() + 1 && inner.starts_with(name)) {
        if let Some(last) = inner.last() {
            properties.insert(last.clone(), assembled(sections, inner));
        }
    }
    let description = own.map_or("", |section| &section.description);
    json!({ "type": "object", "description": description, "additionalProperties": false, "properties": properties })
}

fn of_value(value: &toml::Value) -> Value {
    match value {
        toml::Value::String(_) | toml::Value::Datetime(_) => json!({ "type": "string" }),
        toml::Value::Integer(_) => json!({ "type": "integer", "minimum": 0 }),
        toml::Value::Float(_) => json!({ "type": "number" }),
        toml::Value::Boolean(_) => json!({ "type": "boolean" }),
        toml::Value::Array(items) => {
            let numbers = items.iter().any(toml::Value::is_float);
            let item = if numbers { json!({ "type": "number" }) } else { items.first().map_or(json!({}), of_value) };
            match numbers {
                // Numbers in a row have places: a box, a camera, a range.
                true => json!({ "type": "array", "items": item, "minItems": items.len(), "maxItems": items.len() }),
                false => json!({ "type": "array", "items": item }),
            }
        }
        toml::Value::Table(_) => json!({ "type": "object", "additionalProperties": { "type": "string" } }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_key_has_its_type_and_what_it_means() {
        let schema = json_schema();
        let of = |path: &str| schema.pointer(path).unwrap_or_else(|| panic!("{path}")).clone();
        assert_eq!(of("/properties/source/properties/voxel_mm/type"), "number");
        assert_eq!(of("/properties/serve/properties/limits/properties/connections/type"), "integer");
        assert_eq!(of("/properties/cell/properties/camera/properties/color/type"), "string");
        assert_eq!(of("/properties/region/properties/box/maxItems"), 6);
        let calibration = of("/properties/cell/properties/calibration/description");
        assert!(calibration.as_str().is_some_and(|text| text.contains("semascan calibrate")), "{calibration}");
        assert_eq!(of("/properties/cell/additionalProperties"), false);
        assert!(of("/properties/strict/description").as_str().is_some_and(|text| text.starts_with("Whether")));
        fn all_described(schema: &Value, path: &str) {
            for (key, value) in schema["properties"].as_object().into_iter().flatten() {
                let path = format!("{path}.{key}");
                if value["properties"].is_object() {
                    all_described(value, &path);
                } else {
                    assert!(value["description"].as_str().is_some_and(|text| text.len() > 10), "{path}: {value}");
                }
            }
        }
        all_described(&schema, "");
    }
}
