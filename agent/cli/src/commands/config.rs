//! `cell.toml`: what a cell's agent is started with. Arguments on the command line win over it.

use super::network::NetworkSection;
use anyhow::{Context, Result};
use serde::Deserialize;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};

/// Contents of `cell.toml`; unknown keys are errors, so that a typing mistake is noticed.
#[derive(Clone, Debug, Default, Deserialize, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct CellConfig {
    /// How the agent is reached.
    pub(crate) serve: ServeSection,
    /// What is inspected.
    pub(crate) source: SourceSection,
    /// What labels it, with `--labels network`.
    pub(crate) network: NetworkSection,
}

#[derive(Clone, Debug, Default, Deserialize, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct ServeSection {
    /// Address and port to listen on.
    pub(crate) listen: Option<SocketAddr>,
    /// Names under which the agent may be reached, beyond loopback and literal addresses.
    pub(crate) allow_hosts: Vec<String>,
    /// Serve the viewer from this folder.
    pub(crate) web_dir: Option<PathBuf>,
}

#[derive(Clone, Debug, Default, Deserialize, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct SourceSection {
    /// URI or path of the source.
    pub(crate) uri: Option<String>,
    /// Camera mask: a PNG, `auto` or `none`.
    pub(crate) camera_mask: Option<String>,
    /// Voxel edge in millimetres.
    pub(crate) voxel_mm: Option<f64>,
}

/// Reads `cell.toml`; without a path, the defaults.
pub(crate) fn read(path: Option<&Path>) -> Result<CellConfig> {
    let Some(path) = path else { return Ok(CellConfig::default()) };
    let text = std::fs::read_to_string(path).with_context(|| path.display().to_string())?;
    toml::from_str(&text).with_context(|| path.display().to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mistyped_key_is_named() {
        let error = toml::from_str::<CellConfig>("[serve]\nlisten_on = \"127.0.0.1:1\"").expect_err("unknown key");
        assert!(error.to_string().contains("listen_on"), "{error}");
    }

    #[test]
    fn a_whole_file_is_read() {
        let text = "[serve]\nlisten = \"0.0.0.0:80\"\nallow_hosts = [\"cell\"]\n[source]\nuri = \"virtual:starter-motor\"\nvoxel_mm = 1.5";
        let config: CellConfig = toml::from_str(text).expect("valid");
        assert_eq!(config.source.voxel_mm, Some(1.5));
        assert_eq!(config.serve.allow_hosts, ["cell"]);
    }

    #[test]
    fn the_networks_section_is_read_and_checked() {
        let text = "[network]\nmodels = [\"ud-net-edge\"]\nprovider = \"tensorrt\"\nengine = \"onnxruntime\"\nthreads = 2\n\
                    augmentations = [\"identity\", \"flip\", \"warp\"]\nstatistic = \"predicted\"\nuncertain = \"drop\"\n\
                    region = \"whole\"\nthreshold = 0.3";
        toml::from_str::<CellConfig>(text).expect("valid");
        for (wrong, word) in
            [("provider = \"gpu\"", "gpu"), ("regions = 1", "regions"), ("uncertain = \"keep\"", "keep")]
        {
            let error = toml::from_str::<CellConfig>(&format!("[network]\n{wrong}")).expect_err(word).to_string();
            assert!(error.contains(word), "{error}");
        }
    }
}
