//! `criteria.toml` read and checked: a wrong key, class or limit is refused by its name, before anything is judged.

use crate::findings::Reference;
use crate::toml_error::explain_toml;
use semascan_model::choice::possible_instead;
use semascan_model::criteria::{CRITERIA_VERSION, ComponentRule, Criteria, DefectRule};
use semascan_model::verdict::{CriteriaRecord, Decision};
use sha2::{Digest, Sha256};
use std::collections::BTreeSet;

/// Why criteria cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum CriteriaError {
    /// They are no TOML, or a key is not what it should be.
    #[error("{0}")]
    Toml(String),
    /// They come from another version of the software.
    #[error("version = {0}: this program reads criteria of version {CRITERIA_VERSION}")]
    Version(u32),
    /// A value cannot be used.
    #[error("{field}: {reason}")]
    Field {
        /// The key, with its rule: `defect 2: largest_share`.
        field: String,
        /// Why.
        reason: String,
    },
}

/// Criteria, ready to judge by.
pub struct CheckedCriteria {
    /// The criteria.
    pub criteria: Criteria,
    /// What the record says of them.
    pub record: CriteriaRecord,
    /// Their text, byte for byte.
    pub text: String,
    /// The mesh that they compare with, where they name one; whoever reads files sets it.
    pub reference: Option<Reference>,
}

impl CheckedCriteria {
    /// Reads the text of `criteria.toml` and checks everything but the names of classes and the reference.
    ///
    /// # Errors
    /// [`CriteriaError`] naming the key.
    pub fn parse(text: &str) -> Result<Self, CriteriaError> {
        // The version comes first: of another layout nothing else can be said.
        let table: toml::Table = toml::from_str(text).map_err(|e| CriteriaError::Toml(explain_toml(&e)))?;
        if let Some(version) = table.get("version").and_then(toml::Value::as_integer)
            && version != i64::from(CRITERIA_VERSION)
        {
            return Err(CriteriaError::Version(u32::try_from(version).unwrap_or(u32::MAX)));
        }
        let criteria: Criteria = toml::from_str(text).map_err(|e| CriteriaError::Toml(explain_toml(&e)))?;
        check(&criteria)?;
        let sha256 = Sha256::digest(text.as_bytes()).iter().map(|b| format!("{b:02x}")).collect();
        let record = CriteriaRecord { name: criteria.name.clone(), revision: criteria.revision.clone(), sha256 };
        Ok(Self { criteria, record, text: text.to_owned(), reference: None })
    }

    /// Refuses classes that an inspection with these `components` and `defects` does not know.
    ///
    /// # Errors
    /// [`CriteriaError::Field`] naming rule and class, and the classes that there are.
    pub fn check_classes(&self, components: &[&str], defects: &[&str]) -> Result<(), CriteriaError> {
        let known = |rule: String, key: &str, name: &str, possible: &[&str]| {
            if possible.contains(&name) {
                return Ok(());
            }
            let reason = format!("the inspection knows no {key} {name:?}; {}", possible_instead(name, possible));
            Err(CriteriaError::Field { field: format!("{rule}: {key}"), reason })
        };
        for (number, rule) in (1..).zip(&self.criteria.components) {
            known(format!("component {number}"), "component", &rule.component, components)?;
        }
        for (number, rule) in (1..).zip(&self.criteria.defects) {
            let place = format!("defect {number}");
            known(place.clone(), "defect", &rule.defect, defects)?;
            if let Some(component) = &rule.component {
                known(place, "component", component, components)?;
            }
        }
        Ok(())
    }
}

fn check(criteria: &Criteria) -> Result<(), CriteriaError> {
    let Criteria { name, revision, largest_unjudged_share, reference, components, defects, .. } = criteria;
    let fail = |field: String, reason: &str| Err(CriteriaError::Field { field, reason: reason.into() });
    for (field, text) in [("name", name), ("revision", revision)] {
        if text.trim().is_empty() {
            return fail(field.into(), "is empty");
        }
    }
    share("largest_unjudged_share", Some(*largest_unjudged_share))?;
    if let Some(rule) = reference {
        length("reference: tolerance_mm", Some(rule.tolerance_mm))?;
        if rule.then == Decision::Accept {
            return fail("reference: then".into(), "a tolerance that nothing follows from is none");
        }
    }
    if components.is_empty() && defects.is_empty() && reference.is_none() {
        return fail("defect".into(), "no rule is stated: whatever was found would be judged by nothing");
    }
    let mut named = BTreeSet::new();
    for (number, rule) in (1..).zip(components) {
        check_component(&format!("component {number}"), rule)?;
        if !named.insert(&rule.component) {
            return fail(format!("component {number}: component"), "has a rule already");
        }
    }
    for (number, rule) in (1..).zip(defects) {
        check_defect(&format!("defect {number}"), rule)?;
    }
    Ok(())
}

fn check_component(place: &str, rule: &ComponentRule) -> Result<(), CriteriaError> {
    length(&format!("{place}: expected_area_mm2"), rule.expected_area_mm2)?;
    share(&format!("{place}: least_completeness"), rule.least_completeness)?;
    share(&format!("{place}: least_confidence"), rule.least_confidence)?;
    if rule.least_completeness.is_some() && rule.expected_area_mm2.is_none() {
        let reason = "is a share of the area that is expected: state expected_area_mm2".to_owned();
        return Err(CriteriaError::Field { field: format!("{place}: least_completeness"), reason });
    }
    Ok(())
}

fn check_defect(place: &str, rule: &DefectRule) -> Result<(), CriteriaError> {
    for (key, value) in [
        ("largest_area_mm2", rule.largest_area_mm2),
        ("largest_length_mm", rule.largest_length_mm),
        ("largest_depth_mm", rule.largest_depth_mm),
        ("counted_from_mm2", rule.counted_from_mm2),
    ] {
        length(&format!("{place}: {key}"), value)?;
    }
    share(&format!("{place}: largest_share"), rule.largest_share)?;
    share(&format!("{place}: least_confidence"), rule.least_confidence)?;
    let reason = match (rule.then, rule.has_limit()) {
        (Decision::Accept, true) => "accept takes the defect whatever its size: leave its limits out",
        (Decision::Accept, false) | (_, true) => return Ok(()),
        (_, false) => "no limit is stated; largest_count = 0 allows none at all",
    };
    Err(CriteriaError::Field { field: format!("{place}: then"), reason: reason.into() })
}

fn length(field: &str, value: Option<f64>) -> Result<(), CriteriaError> {
    match value {
        Some(v) if !(v.is_finite() && v > 0.0) => {
            Err(CriteriaError::Field { field: field.into(), reason: format!("{v} is not above 0") })
        }
        _ => Ok(()),
    }
}

fn share(field: &str, value: Option<f64>) -> Result<(), CriteriaError> {
    match value {
        Some(v) if !(0.0..=1.0).contains(&v) => {
            Err(CriteriaError::Field { field: field.into(), reason: format!("{v} is not from 0 to 1") })
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const HEAD: &str = "version = 1\nname = \"motor\"\nrevision = \"3\"\n";

    fn refusal(rest: &str) -> String {
        CheckedCriteria::parse(&format!("{HEAD}{rest}")).err().expect("refused").to_string()
    }

    #[test]
    fn criteria_are_read_whole() {
        let text = format!(
            "{HEAD}unlisted = \"reject\"\n\
             [reference]\nfile = \"cad/motor.stl\"\nunit = \"mm\"\ntolerance_mm = 0.5\nthen = \"person\"\n\
             [[component]]\ncomponent = \"gear\"\nexpected_area_mm2 = 5000\nleast_completeness = 0.8\nthen = \"rework\"\n\
             [[defect]]\ndefect = \"corrosion\"\nlargest_area_mm2 = 50.5\nlargest_count = 2\nthen = \"reject\"\n\
             [[defect]]\ncomponent = \"gear\"\ndefect = \"wear\"\nthen = \"accept\"\n"
        );
        let checked = CheckedCriteria::parse(&text).expect("right");
        let criteria = &checked.criteria;
        assert_eq!((criteria.unlisted, criteria.components.len(), criteria.defects.len()), (Decision::Reject, 1, 2));
        assert_eq!(criteria.defects[0].largest_area_mm2, Some(50.5));
        assert_eq!(checked.record.sha256.len(), 64);
        checked.check_classes(&["none", "gear"], &["corrosion", "wear"]).expect("known");
        let unknown = checked.check_classes(&["none", "gears"], &["corrosion", "wear"]).expect_err("unknown");
        assert!(unknown.to_string().contains("component 1: component") && unknown.to_string().contains("\"gears\""));
        let unknown = checked.check_classes(&["gear"], &["corrosion", "crack"]).expect_err("unknown");
        assert!(unknown.to_string().contains("defect 2: defect") && unknown.to_string().contains("wear"), "{unknown}");
    }

    #[test]
    fn what_cannot_be_judged_by_is_refused_by_name() {
        for (rest, words) in [
            ("[[defects]]\n", ["defects", "did you mean \"defect\""]),
            (
                "[[defect]]\ndefect = \"wear\"\nlargest_aera_mm2 = 3\nthen = \"reject\"\n",
                ["largest_aera_mm2", "largest_area_mm2"],
            ),
            ("[[defect]]\ndefect = \"wear\"\nlargest_count = 3\nthen = \"refuse\"\n", ["refuse", "reject"]),
            ("[[defect]]\ndefect = \"wear\"\nthen = \"reject\"\n", ["defect 1: then", "no limit"]),
            ("[[defect]]\ndefect = \"wear\"\nlargest_count = 1\nthen = \"accept\"\n", ["defect 1: then", "limits out"]),
            ("[[defect]]\ndefect = \"wear\"\nlargest_share = 5\nthen = \"reject\"\n", ["defect 1: largest_share", "5"]),
            ("[[defect]]\ndefect = \"wear\"\nlargest_depth_mm = nan\nthen = \"reject\"\n", ["largest_depth_mm", "NaN"]),
            ("[[defect]]\ndefect = \"wear\"\nlargest_count = -1\nthen = \"reject\"\n", ["largest_count", "-1"]),
            (
                "[[component]]\ncomponent = \"a\"\nleast_completeness = 0.5\nthen = \"reject\"\n",
                ["component 1: least_completeness", "expected_area_mm2"],
            ),
            (
                "[[component]]\ncomponent = \"a\"\nthen = \"reject\"\n[[component]]\ncomponent = \"a\"\nthen = \"reject\"\n",
                ["component 2", "already"],
            ),
            ("largest_unjudged_share = 2.0\n", ["largest_unjudged_share", "2"]),
            ("", ["defect", "no rule"]),
        ] {
            let said = refusal(rest);
            assert!(words.iter().all(|word| said.contains(word)), "{rest}: {said}");
        }
        let other = CheckedCriteria::parse("version = 2\nfurther = 1").err().expect("refused").to_string();
        assert!(other.contains("version = 2"), "{other}");
        let empty = CheckedCriteria::parse(&HEAD.replace("motor", " ")).err().expect("refused").to_string();
        assert!(empty.contains("name"), "{empty}");
    }

    proptest! {
        #[test]
        fn damaged_criteria_are_read_or_refused(
            damage in prop::collection::vec(
                (any::<prop::sample::Index>(), prop::sample::select(vec!["0", "-1", "1e308", "nan", "99999999999999999999", "null", "[[[[[[[[", "\"", "\u{0}ä", ""])),
                1..6,
            ),
            cut in any::<prop::sample::Index>(),
            is_cut in any::<bool>(),
        ) {
            let mut text: Vec<char> = format!("{HEAD}[[defect]]\ndefect = \"wear\"\nlargest_area_mm2 = 50.5\nlargest_count = 2\nthen = \"reject\"\n").chars().collect();
            for (at, word) in damage {
                let at = at.index(text.len());
                drop(text.splice(at..=at, word.chars()));
            }
            if is_cut {
                text.truncate(cut.index(text.len() + 1));
            }
            let text: String = text.into_iter().collect();
            let _ = CheckedCriteria::parse(&text);
        }
    }
}
