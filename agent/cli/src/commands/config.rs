//! `cell.toml`: what a cell's agent is started with: the section `[serve]`, and an [`InspectionSpec`]. Arguments on the
//! command line win over it.

use anyhow::{Context, Result};
use semascan_inspection::spec::InspectionSpec;
use semascan_server::Limits;
use serde::Deserialize;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};

/// Contents of `cell.toml`; unknown keys are errors, so that a typing mistake is noticed.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct CellConfig {
    /// How the agent is reached.
    pub(crate) serve: ServeSection,
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
    /// Serve the viewer from this folder.
    pub(crate) web_dir: Option<PathBuf>,
    /// How much of the agent its clients may take.
    pub(crate) limits: Limits,
}

/// Reads `cell.toml`; without a path, the defaults.
pub(crate) fn read(path: Option<&Path>) -> Result<CellConfig> {
    let Some(path) = path else { return Ok(CellConfig::default()) };
    let text = semascan_formats::regular_file::read_to_string(path).with_context(|| path.display().to_string())?;
    parse(&text).with_context(|| path.display().to_string())
}

fn parse(text: &str) -> Result<CellConfig, toml::de::Error> {
    let mut table: toml::Table = toml::from_str(text)?;
    let serve = match table.remove("serve") {
        Some(section) => section.try_into()?,
        None => ServeSection::default(),
    };
    Ok(CellConfig { serve, inspection: table.try_into()? })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mistyped_key_is_named() {
        for (wrong, word) in [
            ("[serve]\nlisten_on = \"127.0.0.1:1\"", "listen_on"),
            ("[serve.limits]\nconnection = 1", "connection"),
            ("[sorce]\nuri = \"x\"", "sorce"),
            ("[network]\nprovider = \"gpu\"", "gpu"),
            ("[network]\nregions = 1", "regions"),
            ("[network]\nuncertain = \"keep\"", "keep"),
        ] {
            let error = parse(wrong).expect_err(word).to_string();
            assert!(error.contains(word), "{error}");
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
}
