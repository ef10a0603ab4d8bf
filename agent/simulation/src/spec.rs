//! What to simulate, as a URI: `virtual:starter-motor?seed=7&views=12&size=640x480` or `virtual:mesh?path=part.obj`.
//!
//! [`PARTS`] and [`KEYS`] list what there is, for help and for error messages. `%xx` is a byte.

use std::path::PathBuf;

use super::domain::Domain;
use super::sampling::Sampling;
use super::sensor::SensorModel;
use super::station::ErrorModel;
use semascan_formats::percent;
use semascan_inspection::source::SourceError;
use semascan_model::LengthUnit;
use semascan_model::choice::possible_instead;

/// The parts that there are.
pub const PARTS: [&str; 2] = [STARTER_MOTOR, MESH];
const STARTER_MOTOR: &str = "starter-motor";
const MESH: &str = "mesh";

/// A key of a `virtual:` URI.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Key {
    /// Its name.
    pub name: &'static str,
    /// The only part that has it; `None` for a key of every part.
    pub part: Option<&'static str>,
    /// What it is set to, with its default, in words.
    pub meaning: &'static str,
    /// A value that it takes.
    pub example: &'static str,
}

const fn key(name: &'static str, part: Option<&'static str>, meaning: &'static str, example: &'static str) -> Key {
    Key { name, part, meaning, example }
}

/// Every key.
pub const KEYS: [Key; 12] = [
    key("seed", None, "everything random depends on it [7]", "9"),
    key("views", None, "number of views, 1 to 100000 [12]", "5"),
    key("size", None, "columns and rows of the pictures, each 16 to 4096 [640x480]", "320x240"),
    key(
        "errors",
        None,
        "of robot and turntable: default, rough (each view off by up to 1 degree and 3 mm) or none [default]",
        "rough",
    ),
    key("noise", None, "of the sensor: default, zivid, stereo or none [that of the domain]", "zivid"),
    key("sampling", None, "where views are taken from: turn or random [turn]", "random"),
    key(
        "domain",
        None,
        "standard, or shifted: a wide lens, other lights, a stereo camera's noise, as no training data has [standard]",
        "shifted",
    ),
    key("part-seed", Some(STARTER_MOTOR), "seed of the motor alone [that of seed]", "3"),
    key("cell", Some(STARTER_MOTOR), "size of the motor's mesh cells, 0.5 to 5 millimetres [1.2]", "2.5"),
    key("path", Some(MESH), "the file: OBJ, PLY, STL, glTF or GLB", "part.glb"),
    key("unit", Some(MESH), "of the file: mm, cm, m or inch [assumed from the size, and said]", "mm"),
    key("scale", Some(MESH), "metres that one unit of the file is, in place of unit", "0.001"),
];

/// What stands on the table.
#[derive(Clone, Debug, PartialEq)]
pub enum PartSpec {
    /// A parametric starter motor, meshed with cells of this many millimetres.
    StarterMotor {
        /// 0.5 to 5.
        cell: f32,
    },
    /// A mesh from a file (OBJ, PLY, STL, glTF, GLB).
    Mesh {
        /// The file.
        path: PathBuf,
        /// File units to metres; assumed from the size if absent.
        scale: Option<f32>,
    },
}

/// A simulated inspection.
#[derive(Clone, Debug, PartialEq)]
pub struct VirtualCellSpec {
    /// The URI it was read from, or one that says the same.
    pub uri: String,
    /// The part.
    pub part: PartSpec,
    /// Everything random depends on it.
    pub seed: u64,
    /// The motor's own seed, where the same motor is to be seen by another cell.
    pub part_seed: Option<u64>,
    /// Number of views.
    pub views: u32,
    /// Columns and rows.
    pub size: (u32, u32),
    /// Robot and table errors.
    pub errors: ErrorModel,
    /// Sensor noise; `None` for an ideal sensor.
    pub noise: Option<SensorModel>,
    /// Where views are taken from.
    pub sampling: Sampling,
    /// Lens, light and development.
    pub domain: Domain,
}

impl VirtualCellSpec {
    /// Largest picture edge.
    pub const MAX_EDGE: u32 = 4096;
    /// Largest number of views.
    pub const MAX_VIEWS: u32 = 100_000;

    /// Reads `WIDTHxHEIGHT`; `None` where it is not that, or an edge is not 16 to [`Self::MAX_EDGE`].
    pub fn parse_size(value: &str) -> Option<(u32, u32)> {
        let (w, h) = value.split_once('x')?;
        let edge = |v: &str| number(v, 16, Self::MAX_EDGE);
        Some((edge(w)?, edge(h)?))
    }

    /// Reads a `virtual:` URI.
    ///
    /// # Errors
    /// [`SourceError::Uri`] that names the key at fault, or the keys there are.
    pub fn parse(uri: &str) -> Result<Self, SourceError> {
        let fail = |reason: String| SourceError::Uri { uri: uri.to_owned(), reason };
        let rest = uri.strip_prefix("virtual:").ok_or_else(|| fail("must begin with virtual:".into()))?;
        let (kind, query) = rest.split_once('?').unwrap_or((rest, ""));
        let mesh = match kind {
            STARTER_MOTOR => false,
            MESH => true,
            _ => return Err(fail(format!("unknown part {kind:?}: {}", possible_instead(kind, &PARTS)))),
        };
        let mut spec = Self {
            uri: uri.to_owned(),
            part: PartSpec::StarterMotor { cell: 1.2 },
            seed: 7,
            part_seed: None,
            views: 12,
            size: (640, 480),
            errors: ErrorModel::DEFAULT,
            noise: Some(SensorModel::DEFAULT),
            sampling: Sampling::Turn,
            domain: Domain::Standard,
        };
        let (mut path, mut scale, mut cell) = (None, None, 1.2_f32);
        let mut seen: Vec<&str> = Vec::new();
        for pair in query.split('&').filter(|p| !p.is_empty()) {
            let (key, raw) = pair.split_once('=').ok_or_else(|| fail(format!("{pair:?} is not key=value")))?;
            if seen.contains(&key) {
                return Err(fail(format!("key {key} is given twice")));
            }
            seen.push(key);
            let value = percent::decode(raw).ok_or_else(|| fail(format!("key {key}: {raw:?} has a bad % sequence")))?;
            let bad = |want: &str| fail(format!("key {key}: {value:?} is not {want}"));
            match key {
                "seed" => spec.seed = value.parse().map_err(|_| bad("a number from 0 to 2^64-1"))?,
                "part-seed" if !mesh => {
                    spec.part_seed = Some(value.parse().map_err(|_| bad("a number from 0 to 2^64-1"))?);
                }
                "views" => spec.views = number(&value, 1, Self::MAX_VIEWS).ok_or_else(|| bad("1 to 100000"))?,
                "size" => spec.size = Self::parse_size(&value).ok_or_else(|| bad("WIDTHxHEIGHT, each 16 to 4096"))?,
                "errors" => spec.errors = choice(&value, &ERRORS).ok_or_else(|| bad("default, rough or none"))?,
                "noise" => spec.noise = choice(&value, &NOISES).ok_or_else(|| bad("default, zivid, stereo or none"))?,
                "sampling" => spec.sampling = choice(&value, &SAMPLINGS).ok_or_else(|| bad("turn or random"))?,
                "domain" => spec.domain = choice(&value, &DOMAINS).ok_or_else(|| bad("standard or shifted"))?,
                "cell" if !mesh => cell = length(&value, 0.5, 5.0).ok_or_else(|| bad("0.5 to 5 millimetres"))?,
                "path" if mesh && !value.is_empty() => path = Some(PathBuf::from(&value)),
                "path" if mesh => return Err(bad("a file")),
                "scale" | "unit" if mesh && scale.is_some() => {
                    return Err(fail("keys scale and unit: give one".into()));
                }
                "scale" if mesh => {
                    scale = Some(length(&value, 1e-6, 1e6).ok_or_else(|| bad("a positive number"))?);
                }
                "unit" if mesh => {
                    let unit = LengthUnit::parse(&value).ok_or_else(|| bad("mm, cm, m or inch"))?;
                    scale = Some(unit.in_metres() as f32);
                }
                _ => {
                    let of_part = KEYS.iter().filter(|k| k.part.is_none_or(|part| part == kind));
                    let names: Vec<&str> = of_part.map(|k| k.name).collect();
                    return Err(fail(format!("unknown key {key:?} for {kind}: {}", possible_instead(key, &names))));
                }
            }
        }
        if !seen.contains(&"noise") {
            spec.noise = Some(spec.domain.sensor());
        }
        spec.part = if mesh {
            PartSpec::Mesh { path: path.ok_or_else(|| fail("key path is missing".into()))?, scale }
        } else {
            PartSpec::StarterMotor { cell }
        };
        Ok(spec)
    }
}

const ERRORS: [(&str, ErrorModel); 3] =
    [("default", ErrorModel::DEFAULT), ("rough", ErrorModel::ROUGH), ("none", ErrorModel::NONE)];
const NOISES: [(&str, Option<SensorModel>); 4] = [
    ("default", Some(SensorModel::DEFAULT)),
    ("zivid", Some(SensorModel::ZIVID)),
    ("stereo", Some(SensorModel::STEREO)),
    ("none", None),
];
const DOMAINS: [(&str, Domain); 2] = [("standard", Domain::Standard), ("shifted", Domain::Shifted)];
const SAMPLINGS: [(&str, Sampling); 2] = [("turn", Sampling::Turn), ("random", Sampling::Random)];

fn choice<T: Copy>(value: &str, of: &[(&str, T)]) -> Option<T> {
    of.iter().find(|(name, _)| *name == value).map(|(_, v)| *v)
}

fn number(value: &str, low: u32, high: u32) -> Option<u32> {
    value.parse().ok().filter(|n| (low..=high).contains(n))
}

fn length(value: &str, low: f32, high: f32) -> Option<f32> {
    value.parse().ok().filter(|n| (low..=high).contains(n))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn defaults_and_all_keys() {
        let plain = VirtualCellSpec::parse("virtual:starter-motor").expect("defaults");
        assert_eq!((plain.seed, plain.views, plain.size), (7, 12, (640, 480)));
        assert_eq!((plain.errors, plain.noise), (ErrorModel::DEFAULT, Some(SensorModel::DEFAULT)));
        let uri = "virtual:starter-motor?seed=9&views=5&size=1920x1200&errors=none&noise=zivid&sampling=random&cell=2";
        let full = VirtualCellSpec::parse(uri).expect("all keys");
        assert_eq!((full.seed, full.views, full.size, full.errors), (9, 5, (1920, 1200), ErrorModel::NONE));
        assert_eq!((full.noise, full.sampling), (Some(SensorModel::ZIVID), Sampling::Random));
        assert_eq!(full.part, PartSpec::StarterMotor { cell: 2.0 });
        let shifted = VirtualCellSpec::parse("virtual:starter-motor?domain=shifted").expect("another world");
        assert_eq!((shifted.domain, shifted.noise), (Domain::Shifted, Some(SensorModel::STEREO)));
        let quiet = VirtualCellSpec::parse("virtual:starter-motor?noise=zivid&domain=shifted").expect("its own noise");
        assert_eq!(quiet.noise, Some(SensorModel::ZIVID));
        let mesh = VirtualCellSpec::parse("virtual:mesh?path=a%20b%26c.obj&scale=0.001").expect("a mesh");
        assert_eq!(mesh.part, PartSpec::Mesh { path: "a b&c.obj".into(), scale: Some(0.001) });
        let inches = VirtualCellSpec::parse("virtual:mesh?path=a.obj&unit=inch").expect("a mesh");
        assert_eq!(inches.part, PartSpec::Mesh { path: "a.obj".into(), scale: Some(0.0254) });
        let plain = VirtualCellSpec::parse("virtual:mesh?path=a.obj").expect("a mesh");
        assert_eq!(plain.part, PartSpec::Mesh { path: "a.obj".into(), scale: None });
    }

    #[test]
    fn the_list_has_every_key_and_an_unknown_one_is_answered_with_it() {
        for part in PARTS {
            let own: Vec<_> = KEYS.iter().filter(|k| k.part.is_none_or(|of| of == part)).collect();
            for key in &own {
                let file = if part == MESH && key.name != "path" { "path=a.obj&" } else { "" };
                let uri = format!("virtual:{part}?{file}{}={}", key.name, key.example);
                VirtualCellSpec::parse(&uri).expect("a key of the list");
                let elsewhere = PARTS.into_iter().find(|other| key.part.is_some() && *other != part);
                if let Some(other) = elsewhere {
                    VirtualCellSpec::parse(&format!("virtual:{other}?{}={}", key.name, key.example)).expect_err(other);
                }
            }
            let said = VirtualCellSpec::parse(&format!("virtual:{part}?viws=3")).expect_err("a slip").to_string();
            assert!(said.contains("did you mean \"views\"?"), "{said}");
            assert!(own.iter().all(|key| said.contains(key.name)), "{said}");
        }
        let said = VirtualCellSpec::parse("virtual:startermotor").expect_err("a slip").to_string();
        assert!(said.contains("did you mean \"starter-motor\"? There are starter-motor, mesh"), "{said}");
    }

    #[test]
    fn errors_name_the_key() {
        for (uri, word) in [
            ("virtual:starter-motor?sede=7", "sede"),
            ("virtual:starter-motor?seed=-1", "seed"),
            ("virtual:starter-motor?views=0", "views"),
            ("virtual:starter-motor?size=640", "size"),
            ("virtual:starter-motor?size=9999x480", "size"),
            ("virtual:starter-motor?errors=some", "errors"),
            ("virtual:starter-motor?noise=loud", "noise"),
            ("virtual:starter-motor?sampling=all", "sampling"),
            ("virtual:starter-motor?domain=moon", "domain"),
            ("virtual:starter-motor?path=x", "path"),
            ("virtual:mesh?path=x&unit=foot", "unit"),
            ("virtual:mesh?path=x&unit=mm&scale=1", "unit"),
            ("virtual:starter-motor?seed=1&seed=2", "twice"),
            ("virtual:starter-motor?seed", "key=value"),
            ("virtual:mesh", "path"),
            ("virtual:mesh?path=x&scale=nan", "scale"),
            ("virtual:mesh?path=%zz", "path"),
            ("virtual:gearbox", "gearbox"),
            ("bop:x", "virtual:"),
        ] {
            let message = VirtualCellSpec::parse(uri).expect_err(uri).to_string();
            assert!(message.contains(word) && message.contains(uri), "{message}");
        }
    }

    proptest! {
        #[test]
        fn any_text_is_read_or_refused(text in "\\PC*") {
            let _ = VirtualCellSpec::parse(&text);
            let _ = VirtualCellSpec::parse(&format!("virtual:starter-motor?{text}"));
            let _ = VirtualCellSpec::parse(&format!("virtual:mesh?path={text}"));
        }

        #[test]
        fn values_in_range_are_kept(seed in any::<u64>(), views in 1_u32..=100_000, w in 16_u32..=4096, h in 16_u32..=4096) {
            let uri = format!("virtual:starter-motor?size={w}x{h}&seed={seed}&views={views}");
            let spec = VirtualCellSpec::parse(&uri).expect("valid");
            prop_assert_eq!((spec.seed, spec.views, spec.size), (seed, views, (w, h)));
        }
    }
}
