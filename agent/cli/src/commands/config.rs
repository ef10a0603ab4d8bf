//! `cell.toml`: what a cell's agent is started with: the sections `[cell]` and `[serve]`, and an [`InspectionSpec`]. Arguments on
//! the command line win over it. Relative paths in it are relative to its folder.

use super::cell_section::CellSection;
use super::oidc::OidcSection;
use anyhow::{Context, Result, anyhow, bail};
use semascan_inspection::explain_toml;
use semascan_inspection::spec::{CameraMask, InspectionSpec};
use semascan_model::choice::possible_instead;
use semascan_server::Limits;
use serde::Deserialize;
use serde_aux::serde_introspection::serde_introspect;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use toml::Spanned;
use toml::de::{DeTable, Deserializer, ValueDeserializer};

/// A `cell.toml` with every key, commented.
pub(crate) const SAMPLE: &str = include_str!("cell.sample.toml");

/// Contents of `cell.toml`; unknown keys are errors, so that a typing mistake is noticed.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct CellConfig {
    /// How the agent is reached.
    pub(crate) serve: ServeSection,
    /// What the cell is.
    pub(crate) cell: CellSection,
    /// What is inspected, and how: all other sections.
    pub(crate) inspection: InspectionSpec,
}

#[derive(Clone, Debug, Default, Deserialize, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct ServeSection {
    /// Address and port to listen on.
    pub(crate) listen: Option<SocketAddr>,
    /// Names under which the agent may be reached, beyond loopback and literal addresses.
    pub(crate) allow_hosts: Vec<String>,
    /// Origins of pages elsewhere that may follow this agent.
    pub(crate) allow_origins: Vec<String>,
    /// Other agents that this agent's pages may follow.
    pub(crate) allow_agents: Vec<String>,
    /// A second address at which metrics alone are answered.
    pub(crate) metrics: Option<SocketAddr>,
    /// Serve the viewer from this folder.
    pub(crate) web_dir: Option<PathBuf>,
    /// The certificate to show, and its key.
    pub(crate) tls_cert: Option<PathBuf>,
    /// The key of the certificate.
    pub(crate) tls_key: Option<PathBuf>,
    /// Whether HTTPS is spoken on loopback, too.
    pub(crate) tls: bool,
    /// Whether users log in on loopback, too.
    pub(crate) login: bool,
    /// The data folder that has the users.
    pub(crate) users: Option<PathBuf>,
    /// Whether everybody who reaches the agent may watch without a login.
    pub(crate) anyone_may_watch: bool,
    /// The criteria that inspections are judged by.
    pub(crate) criteria: Option<PathBuf>,
    /// The identity provider at which people may log in.
    pub(crate) oidc: OidcSection,
    /// How much of the agent its clients may take.
    pub(crate) limits: Limits,
}

/// Reads `cell.toml`; without a path, the defaults.
pub(crate) fn read(path: Option<&Path>) -> Result<CellConfig> {
    let Some(path) = path else { return Ok(CellConfig::default()) };
    let text = semascan_formats::regular_file::read_to_string(path).with_context(|| path.display().to_string())?;
    let config = parse(&text).with_context(|| path.display().to_string())?;
    Ok(config.anchored(path.parent().unwrap_or(Path::new(""))))
}

pub(crate) fn parse(text: &str) -> Result<CellConfig> {
    let mut table = DeTable::parse(text).map_err(|error| explained(&error))?;
    let top = serde_introspect::<InspectionSpec>().iter().copied().chain([CELL, SERVE]).collect::<Vec<_>>();
    if let Some(unknown) = table.get_ref().keys().find(|key| !top.contains(&key.get_ref().as_ref())) {
        let line = text.get(..unknown.span().start).map_or(1, |before| before.matches('\n').count() + 1);
        let name = unknown.get_ref();
        bail!("line {line}: unknown key {name:?}: {}", possible_instead(name, &top));
    }
    let serve = section(&mut table, SERVE, text)?;
    let cell: CellSection = section(&mut table, CELL, text)?;
    cell.check().map_err(|reason| anyhow!("[{CELL}] {reason}"))?;
    let inspection = InspectionSpec::deserialize(Deserializer::from(table)).map_err(|error| placed(error, text))?;
    Ok(CellConfig { serve, cell, inspection })
}

/// The sections that are no part of an inspection.
const CELL: &str = "cell";
const SERVE: &str = "serve";

/// Takes a section out of the document.
fn section<'a, T: Default + Deserialize<'a>>(table: &mut Spanned<DeTable<'a>>, name: &str, text: &str) -> Result<T> {
    let Some(section) = table.get_mut().remove(name) else { return Ok(T::default()) };
    T::deserialize(ValueDeserializer::from(section)).map_err(|error| placed(error, text).context(format!("[{name}]")))
}

/// The error of a reader, with its line and section. The line itself is not shown: it may hold a secret.
fn placed(error: toml::de::Error, text: &str) -> anyhow::Error {
    let before = error.span().and_then(|span| text.get(..span.start)).unwrap_or_default();
    let header = before.lines().rev().map(str::trim).find(|line| line.starts_with('['));
    let line = before.matches('\n').count() + 1;
    let place = header.map_or_else(|| format!("line {line}"), |header| format!("line {line}, {header}"));
    explained(&error).context(place)
}

/// The error of a reader.
fn explained(error: &toml::de::Error) -> anyhow::Error {
    anyhow!("{}", explain_toml(error))
}

/// Whether a line of the sample is a key, which is commented out.
pub(crate) fn is_sample_key(line: &str) -> bool {
    line.strip_prefix('#').is_some_and(|rest| rest.starts_with(|c: char| c.is_lowercase()))
}

impl CellConfig {
    /// Its relative paths taken from `folder`, where the file lies.
    fn anchored(mut self, folder: &Path) -> Self {
        let anchor = |path: &mut Option<PathBuf>| {
            if let Some(path) = path {
                *path = folder.join(&*path);
            }
        };
        let Self { serve, cell, inspection } = &mut self;
        for path in [&mut cell.calibration, &mut cell.data, &mut cell.camera.record] {
            anchor(path);
        }
        let ServeSection { web_dir, tls_cert, tls_key, users, criteria, oidc, .. } = serve;
        for path in [web_dir, tls_cert, tls_key, users, criteria] {
            anchor(path);
        }
        anchor(&mut oidc.client_secret_file);
        anchor(&mut oidc.authorities);
        anchor(&mut inspection.network.onnxruntime);
        if let CameraMask::File(mask) = &mut inspection.source.camera_mask {
            *mask = folder.join(&*mask);
        }
        // Names of models and addresses of sources may be paths: they are where something lies there.
        let names = inspection.network.models.iter_mut().chain(&mut inspection.source.uri);
        for name in names {
            let path = folder.join(name.split_once('?').map_or(name.as_str(), |(path, _)| path));
            let at = folder.join(&*name);
            if path.exists()
                && let Some(at) = at.to_str()
            {
                at.clone_into(name);
            }
        }
        self
    }

    /// What is inspected, and how: the source that the file names, or `source`, completed by what the cell is.
    pub(crate) fn complete(&self, mut spec: InspectionSpec, source: Option<String>) -> InspectionSpec {
        spec.source.uri = source.or(spec.source.uri);
        self.cell.complete(&mut spec);
        spec
    }
}

#[cfg(test)]
mod tests {
    use super::super::cell_section::{CameraSection, FramesSection};
    use super::*;
    use proptest::prelude::*;
    use semascan_inspection::spec::{
        NetworkSpec, PlanSpec, PreparationSpec, ReachSpec, RegionSpec, SourceSpec, TargetSpec,
    };
    use semascan_perception::fuse::OutlierFilter;

    #[test]
    fn a_mistyped_key_is_named() {
        for (wrong, word) in [
            ("[serve]\nlisten_on = \"127.0.0.1:1\"", "listen_on"),
            ("[serve.limits]\nconnection = 1", "connection"),
            ("[serve.oidc]\nclient_secret = \"hunter2\"", "client_secret"),
            ("[serve.oidc]\nroles = { quality = \"inspector\" }", "inspector"),
            ("[sorce]\nuri = \"x\"", "sorce"),
            ("[network]\nprovider = \"gpu\"", "gpu"),
            ("[network]\nregions = 1", "regions"),
            ("[network]\nuncertain = \"keep\"", "keep"),
            ("[cell]\ncalibraton = \"c.json\"", "calibraton"),
            ("[cell.camera]\nrate_hz = \"30\"", "rate_hz"),
            ("\n\n[cell]\nworking_distance = 3", "line 4"),
            ("[source]\nvoxel_mm = \"1 mm\"", "line 2"),
            ("\n[sorce]", "line 2"),
            ("[serve]\n\nlisten_on = 1", "line 3"),
        ] {
            let error = format!("{:#}", parse(wrong).expect_err(word));
            assert!(error.contains(word), "{error}");
        }
    }

    #[test]
    fn a_slip_is_answered_with_what_was_meant() {
        for (wrong, meant) in [
            ("[sorce]\nuri = \"x\"", "\"source\""),
            ("[srve]\nlisten = \"x\"", "\"serve\""),
            ("[source]\nvoxel = 1", "\"voxel_mm\""),
            ("[serve]\nlistn = \"127.0.0.1:1\"", "\"listen\""),
            ("[serve.limits]\nconnection = 1", "\"connections\""),
            ("[network]\nprovider = \"cudaa\"", "\"cuda\""),
        ] {
            let error = format!("{:#}", parse(wrong).expect_err(meant));
            assert!(error.contains(&format!("did you mean {meant}?")), "{error}");
        }
        let error = format!("{:#}", parse("[colour]").expect_err("unknown"));
        assert!(error.contains("there are source, ") && error.contains(", serve"), "{error}");
    }

    /// The sample with every key set.
    fn sample_with_every_key() -> String {
        SAMPLE.lines().map(|line| if is_sample_key(line) { &line[1..] } else { line }).collect::<Vec<_>>().join("\n")
    }

    #[test]
    fn the_sample_changes_nothing_and_its_values_are_the_defaults() {
        assert_eq!(parse(SAMPLE).expect("can be read"), CellConfig::default());
        let set = parse(&sample_with_every_key()).expect("can be read with every key set");
        assert_eq!(set.serve.limits, Limits::default());
        let (oidc, default) = (set.serve.oidc, OidcSection::default());
        assert_eq!(
            (oidc.scopes, oidc.groups_claim, oidc.answer_s),
            (default.scopes, default.groups_claim, default.answer_s)
        );
        let (set, default) = (set.inspection, InspectionSpec::default());
        assert_eq!((&set.outliers, &set.preparation), (&default.outliers, &default.preparation));
        assert_eq!((set.labels, set.masks, set.association), (default.labels, default.masks, default.association));
        assert_eq!((set.registration, set.turntable), (default.registration, default.turntable));
        assert_eq!((set.strict, set.least_share()), (default.strict, default.least_share()));
        assert_eq!(set.network.network_config(), default.network.network_config());
        assert_eq!(set.network.uncertainty_rule(), default.network.uncertainty_rule());
        assert_eq!(set.region.footprint(), default.region.footprint());
    }

    #[test]
    fn the_sample_names_every_key() {
        let table: toml::Table = toml::from_str(&sample_with_every_key()).expect("can be read");
        let keys_of = |path: &str| -> Vec<String> {
            let section = path
                .split('.')
                .filter(|name| !name.is_empty())
                .fold(&table, |table, name| table[name].as_table().expect("a section"));
            section.keys().cloned().collect()
        };
        let every: [(&str, &[&str]); 15] = [
            ("cell", serde_introspect::<CellSection>()),
            ("cell.camera", serde_introspect::<CameraSection>()),
            ("cell.frames", serde_introspect::<FramesSection>()),
            ("", serde_introspect::<InspectionSpec>()),
            ("source", serde_introspect::<SourceSpec>()),
            ("region", serde_introspect::<RegionSpec>()),
            ("preparation", serde_introspect::<PreparationSpec>()),
            ("network", serde_introspect::<NetworkSpec>()),
            ("outliers", serde_introspect::<OutlierFilter>()),
            ("plan", serde_introspect::<PlanSpec>()),
            ("plan.reach", serde_introspect::<ReachSpec>()),
            ("plan.target", serde_introspect::<TargetSpec>()),
            (SERVE, serde_introspect::<ServeSection>()),
            ("serve.oidc", serde_introspect::<OidcSection>()),
            ("serve.limits", serde_introspect::<Limits>()),
        ];
        for (section, keys) in every {
            assert!(!keys.is_empty(), "{section}");
            let named = keys_of(section);
            for key in keys {
                assert!(named.iter().any(|name| name == key), "[{section}] {key} is not in the sample");
            }
        }
    }

    #[test]
    fn a_whole_file_is_read() {
        let text = "labels = \"network\"\n[serve]\nlisten = \"0.0.0.0:80\"\nallow_hosts = [\"cell\"]\n\
                    [serve.limits]\nconnections = 9\nslow_s = 2.5\n[source]\n\
                    uri = \"virtual:starter-motor\"\nvoxel_mm = 1.5\n[network]\nmodels = [\"ud-net-edge\"]\n\
                    provider = \"tensorrt\"\nengine = \"onnxruntime\"\nthreads = 2\n\
                    augmentations = [\"identity\", \"flip\", \"warp\"]\nstatistic = \"predicted\"\nuncertain = \"drop\"\n\
                    region = \"whole\"\nthreshold = 0.3";
        let config = parse(text).expect("valid");
        assert_eq!(config.inspection.source.voxel_mm, Some(1.5));
        assert_eq!(config.serve.allow_hosts, ["cell"]);
        assert_eq!(config.serve.limits, Limits { connections: 9, slow_s: 2.5, ..Limits::default() });
        assert_eq!(config.inspection.network.threads, Some(2));
    }

    #[test]
    fn relative_paths_are_from_the_folder_of_the_file() {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::create_dir(folder.path().join("scene")).expect("a folder");
        let path = folder.path().join("cell.toml");
        let text = "[cell]\ncalibration = \"calibration.json\"\n[source]\nuri = \"scene\"\ncamera_mask = \"mask.png\"\n\
                    [serve]\ncriteria = \"/etc/criteria.toml\"\n[network]\nmodels = [\"ud-net-edge\"]";
        std::fs::write(&path, text).expect("written");
        let config = read(Some(&path)).expect("can be read");
        assert_eq!(config.cell.calibration, Some(folder.path().join("calibration.json")));
        assert_eq!(config.inspection.source.uri.as_deref(), folder.path().join("scene").to_str());
        assert_eq!(config.inspection.source.camera_mask, CameraMask::File(folder.path().join("mask.png")));
        assert_eq!(config.serve.criteria, Some("/etc/criteria.toml".into()));
        assert_eq!(config.inspection.network.models, ["ud-net-edge"]);
    }

    proptest! {
        #[test]
        fn damaged_configurations_are_read_or_refused(
            damage in prop::collection::vec(
                (any::<prop::sample::Index>(), prop::sample::select(vec!["0", "-1", "1e308", "nan", "99999999999999999999", "null", "[[[[[[[[", "\"", "\u{0}ä", ""])),
                1..6,
            ),
            cut in any::<prop::sample::Index>(),
            is_cut in any::<bool>(),
        ) {
            let mut text: Vec<char> = SAMPLE.chars().collect();
            for (at, word) in damage {
                let at = at.index(text.len());
                drop(text.splice(at..=at, word.chars()));
            }
            if is_cut {
                text.truncate(cut.index(text.len() + 1));
            }
            let text: String = text.into_iter().collect();
            let _ = parse(&text);
        }
    }
}
