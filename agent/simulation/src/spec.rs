//! What to simulate, as a URI: `virtual:starter-motor?seed=7&views=12&size=640x480` or `virtual:mesh?path=part.obj`.
//!
//! Keys (defaults in brackets): `seed` [7], `part-seed` [that seed] of the motor alone, `views` [12], `size` [640x480]
//! up to 4096x4096, `errors` [default], `rough` (each view off by up to 1 degree and 3 mm) or `none` (robot and table),
//! `noise` [the domain's], `default`, `zivid`, `stereo` or `none` (sensor), `sampling` [turn] or `random`, `domain`
//! [standard] or `shifted`: a wide lens, other lights and a stereo camera's noise, none of which training data ever
//! has; `cell` [1.2] the motor's mesh size in millimetres; for `mesh` also `path`, and `scale` to metres or `unit` (mm, cm, m,
//! inch) [assumed from the size]. `%xx` is a byte.

use std::path::PathBuf;

use super::domain::Domain;
use super::sampling::Sampling;
use super::sensor::SensorModel;
use super::station::ErrorModel;
use semascan_formats::percent;
use semascan_formats::unit::Unit;
use semascan_inspection::source::SourceError;

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
            "starter-motor" => false,
            "mesh" => true,
            _ => {
                return Err(fail(format!("unknown part {kind:?}: there are starter-motor and mesh")));
            }
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
                    let unit = Unit::parse(&value).ok_or_else(|| bad("mm, cm, m or inch"))?;
                    scale = Some(unit.in_metres() as f32);
                }
                _ => return Err(fail(format!("unknown key {key:?} for {kind}"))),
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
