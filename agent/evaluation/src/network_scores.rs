//! Networks judged on labelled views: each view is rendered once and every network asked about it, by the same way as in
//! an inspection.

use super::risk_coverage::RiskCoverage;
use super::test_views::{TestDomain, TestViews};
use semascan_inspection::source::{SourceError, SourceInfo};
use semascan_model::Taxonomy;
use semascan_perception::segment::network::engine::{self, Engine};
use semascan_perception::segment::network::{
    Augmentation, EngineChoice, EngineDescription, EngineError, Manifest, ModelError, NetworkConfig, NetworkModel,
    NetworkSegmenter, Provider, SelectError, SetupError, Task, extended, find, search_path, select,
};
use semascan_perception::segment::{SegmentError, Segmenter};
use std::path::{Path, PathBuf};

/// Why networks could not be judged.
#[derive(Debug, thiserror::Error)]
pub enum NetworkError {
    /// There are no views.
    #[error(transparent)]
    Acquire(#[from] SourceError),
    /// Nothing runs networks.
    #[error(transparent)]
    Engine(#[from] EngineError),
    /// No models are installed, or one is broken.
    #[error(transparent)]
    Select(#[from] SelectError),
    /// A model cannot be used.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// Models do not go together.
    #[error(transparent)]
    Setup(#[from] SetupError),
    /// A network failed on a view.
    #[error(transparent)]
    Segment(#[from] SegmentError),
}

/// Installed models and what runs them.
#[derive(Debug)]
pub struct Shelf {
    folders: Vec<PathBuf>,
    asked: Vec<String>,
    engine: Box<dyn Engine>,
}

/// What is known of a network after its views.
#[derive(Clone, Debug)]
pub struct NetworkScores {
    /// Component labels.
    pub components: RiskCoverage,
    /// Defect labels; all are misses where no network looks for them.
    pub defects: RiskCoverage,
}

impl Shelf {
    /// The models in `folder`, or in the folders that an inspection looks in.
    ///
    /// # Errors
    /// [`EngineError`] if nothing runs networks.
    pub fn open(folder: Option<&Path>) -> Result<Self, EngineError> {
        Ok(Self {
            folders: folder.map_or_else(search_path, |f| vec![f.to_owned()]),
            asked: folder.iter().map(|f| f.display().to_string()).collect(),
            engine: engine::open(EngineChoice::Auto, None, Provider::Cpu)?,
        })
    }

    /// What runs the networks.
    pub fn engine(&self) -> EngineDescription {
        self.engine.description()
    }

    /// The folder of the model called `name`, shipped or for comparison.
    pub fn find(&self, name: &str) -> Option<PathBuf> {
        find(&self.folders, name)
    }

    /// The models that an inspection of `known` classes takes where none are named.
    ///
    /// # Errors
    /// [`NetworkError::Select`]
    pub fn chosen(&self, known: &Taxonomy) -> Result<Vec<(PathBuf, Manifest)>, NetworkError> {
        Ok(select(&self.asked, known)?)
    }

    /// A segmenter of the models in `folders`, and the classes that it speaks of.
    ///
    /// # Errors
    /// [`NetworkError`] naming what is wrong with them.
    pub fn segmenter(
        &self,
        folders: &[PathBuf],
        info: &SourceInfo,
        config: &NetworkConfig,
    ) -> Result<NetworkSegmenter, NetworkError> {
        self.assemble(self.load(folders)?, info, config)
    }

    /// A segmenter of member `member` alone of the ensemble in `folder`, asked about the picture as it is.
    ///
    /// # Errors
    /// [`NetworkError`] naming what is wrong with it.
    pub fn single(&self, folder: &Path, member: usize, info: &SourceInfo) -> Result<NetworkSegmenter, NetworkError> {
        let config = NetworkConfig { augmentations: vec![Augmentation::Identity], ..NetworkConfig::default() };
        let models = self.load(&[folder.to_owned()])?.into_iter().map(|model| model.alone(member)).collect();
        self.assemble(models, info, &config)
    }

    fn load(&self, folders: &[PathBuf]) -> Result<Vec<NetworkModel>, ModelError> {
        let threads = rayon::current_num_threads();
        folders.iter().map(|folder| NetworkModel::load(folder, self.engine.as_ref(), threads)).collect()
    }

    fn assemble(
        &self,
        models: Vec<NetworkModel>,
        info: &SourceInfo,
        config: &NetworkConfig,
    ) -> Result<NetworkSegmenter, NetworkError> {
        let manifests: Vec<&Manifest> = models.iter().map(NetworkModel::manifest).collect();
        let taxonomy = extended(&info.taxonomy, &manifests);
        Ok(NetworkSegmenter::new(models, self.engine.description(), &taxonomy, info.volume, config.clone())?)
    }
}

/// The models of `chosen` that label pixels: objects are not told apart in the tables.
pub fn labelling(chosen: &[(PathBuf, Manifest)]) -> Vec<PathBuf> {
    let instances_only = |m: &Manifest| {
        m.task == Task::Instance && chosen.iter().any(|(_, o)| matches!(o.task, Task::Semantic | Task::TwoStream))
    };
    chosen.iter().filter(|(_, m)| !instances_only(m)).map(|(folder, _)| folder.clone()).collect()
}

/// A source of nothing but the classes of the test views, to make segmenters for.
pub fn test_source() -> SourceInfo {
    SourceInfo {
        uri: String::new(),
        part: String::new(),
        taxonomy: TestViews::taxonomy(),
        view_count: None,
        turntable: None,
        volume: None,
        no_labels: None,
        settings: Vec::new(),
    }
}

/// Asks every one of `networks` about all `views` of `domain`; `seen` is called after every view. One result a network.
///
/// # Errors
/// [`NetworkError`] naming the view or the motor.
pub fn score_networks(
    networks: &mut [NetworkSegmenter],
    views: &TestViews,
    domain: TestDomain,
    mut seen: impl FnMut(),
) -> Result<Vec<NetworkScores>, NetworkError> {
    let known = TestViews::taxonomy();
    let nothing = NetworkScores {
        components: RiskCoverage::new(known.component_count()),
        defects: RiskCoverage::new(known.defect_count()),
    };
    let mut scores = vec![nothing; networks.len()];
    for seed in &views.motors {
        let motor = views.motor(domain, *seed)?;
        networks.iter_mut().for_each(|network| network.look_at(motor.volume()));
        for view in motor.views() {
            let Some(labels) = &view.labels else { continue };
            for (network, scores) in networks.iter_mut().zip(&mut scores) {
                let said = network.segment(&view)?;
                scores.components.add(&said.components, &labels.components);
                scores.defects.add(&said.defects, &labels.defects);
            }
            seen();
        }
    }
    Ok(scores)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::network_fixtures::{manifest, onnx, write};

    /// A folder with an ensemble of two that says `none` to what is bright, more or less.
    fn shelf() -> (tempfile::TempDir, Shelf) {
        let root = tempfile::tempdir().expect("a folder");
        let member = |bias: f32| onnx::classifier(&[&[0.0; 3], &[-9.0; 3]], &[0.0, bias]);
        let manifest = manifest("semantic", &["none", "housing"]);
        write(&root.path().join("dark"), manifest, &[member(5.0), member(9.0)]);
        let shelf = Shelf::open(Some(root.path())).expect("an engine");
        (root, shelf)
    }

    #[test]
    fn networks_are_judged_on_views_of_every_domain() {
        let (_root, shelf) = shelf();
        let views = TestViews { motors: vec![1001], views: 2, size: (160, 120), cell: 3.0 };
        let info = test_source();
        let folder = shelf.find("dark").expect("is there");
        let chosen = labelling(&shelf.chosen(&info.taxonomy).expect("one model"));
        assert_eq!(chosen, std::slice::from_ref(&folder));
        let mut networks = vec![
            shelf.segmenter(&chosen, &info, &NetworkConfig::default()).expect("fits"),
            shelf.single(&folder, 0, &info).expect("fits"),
            shelf.single(&folder, 1, &info).expect("fits"),
        ];
        assert_eq!(networks.iter().map(NetworkSegmenter::predictions).collect::<Vec<_>>(), [4, 1, 1]);
        for domain in TestDomain::ALL {
            let mut seen = 0;
            let scores = score_networks(&mut networks, &views, domain, || seen += 1).expect("runs");
            assert_eq!((seen, scores.len()), (2, 3));
            let pixels = if domain == TestDomain::Randomised { 80 * 64 } else { 160 * 120 };
            assert!(scores.iter().all(|s| s.components.unfiltered().pixels == 2 * pixels));
            assert_ne!(scores[1].components, scores[2].components, "the members differ");
            // Where they differ the ensemble is unsure, and fewer labels remain below a threshold.
            let point = scores[0].components.point(0.05);
            assert!(point.completeness < 1.0, "{point:?}");
            assert_eq!(scores[1].components.point(0.05).completeness, 1.0);
            let defects = scores[0].defects.unfiltered();
            assert_eq!(defects.mean_iou, 0.0, "nobody looks for defects");
        }
    }
}
