//! The class that a mark gives to the surface.

use semascan_model::ClassDef;

/// A class.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Naming {
    /// Of components; 0 = none.
    Component(u16),
    /// Of defects; 0 = none.
    Defect(u16),
}

impl Naming {
    /// Stable text for forms and tests: `component-2`.
    pub fn key(self) -> String {
        match self {
            Self::Component(class) => format!("component-{class}"),
            Self::Defect(class) => format!("defect-{class}"),
        }
    }

    /// The class of that text.
    pub fn from_key(key: &str) -> Option<Self> {
        let (kind, class) = key.split_once('-')?;
        let class = class.parse().ok()?;
        match kind {
            "component" => Some(Self::Component(class)),
            "defect" => Some(Self::Defect(class)),
            _ => None,
        }
    }

    /// Its name among `components` and `defects`, `none` for class 0 of either; `None` where they have no such class.
    pub fn name(self, components: &[ClassDef], defects: &[ClassDef]) -> Option<String> {
        let (classes, class) = match self {
            Self::Component(class) => (components, class),
            Self::Defect(class) => (defects, class),
        };
        if class == 0 {
            return Some("none".into());
        }
        classes.iter().find(|known| known.id == class).map(|known| known.name.clone())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use semascan_model::Taxonomy;

    #[test]
    fn keys_lead_back_and_names_are_those_of_the_taxonomy() {
        for naming in [Naming::Component(0), Naming::Component(3), Naming::Defect(65535)] {
            assert_eq!(Naming::from_key(&naming.key()), Some(naming));
        }
        for wrong in ["", "component", "component-", "component--1", "defect-70000", "view-1"] {
            assert_eq!(Naming::from_key(wrong), None, "{wrong}");
        }
        let Taxonomy { components, defects } = Taxonomy::from_names(&["gear"], &["crack"]);
        let name = |naming: Naming| naming.name(&components, &defects);
        assert_eq!(name(Naming::Component(1)).as_deref(), Some("gear"));
        assert_eq!(name(Naming::Defect(1)).as_deref(), Some("crack"));
        assert_eq!((name(Naming::Defect(0)).as_deref(), name(Naming::Component(9))), (Some("none"), None));
    }
}
