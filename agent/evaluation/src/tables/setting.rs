//! What tables of networks have in common: the views they are judged on, and how a row is scored.

use crate::network_scores::{Shelf, score_networks, test_source};
use crate::{NetworkError, PixelScores, TestDomain, TestViews};
use semascan_perception::segment::network::{Manifest, ModelError};
use serde::Serialize;
use std::path::PathBuf;

/// What tables of networks are made with.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NetworkSetting {
    /// Views of motors that were neither trained nor chosen anything on.
    pub test: TestViews,
    /// Seeds of the motors that the threshold of sigma is chosen on.
    pub validation: Vec<u64>,
    /// Folder of models; where an inspection looks, if absent.
    pub models: Option<PathBuf>,
    /// Threshold of sigma; chosen on the validation motors if absent.
    pub sigma: Option<f32>,
}

impl Default for NetworkSetting {
    fn default() -> Self {
        Self {
            test: TestViews { motors: (1001..=1010).collect(), views: 5, size: (640, 480), cell: 1.2 },
            validation: (901..=905).collect(),
            models: None,
            sigma: None,
        }
    }
}

impl NetworkSetting {
    /// A small run that shows whether everything works; its figures say nothing.
    pub fn quick() -> Self {
        Self {
            test: TestViews { motors: vec![1001], views: 2, size: (240, 180), cell: 3.0 },
            validation: vec![901],
            ..Self::default()
        }
    }

    /// The models.
    ///
    /// # Errors
    /// If nothing runs networks.
    pub fn shelf(&self) -> Result<Shelf, NetworkError> {
        Ok(Shelf::open(self.models.as_deref())?)
    }
}

/// Figures in one domain.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DomainScores {
    /// The domain.
    pub domain: TestDomain,
    /// Over all its views together.
    pub scores: PixelScores,
}

/// A model that was judged: its manifest, and its figures by domain.
pub(super) type Judged = (Manifest, Vec<DomainScores>);

/// Pictures that a model was trained on, repeats counted, where its manifest says so.
pub(super) fn images_seen(manifest: &Manifest) -> Option<i64> {
    manifest.training.get("images_seen")?.as_integer()
}

/// That number for people.
pub(super) fn pictures(seen: Option<i64>) -> String {
    seen.map_or_else(|| "-".to_owned(), |n| n.to_string())
}

/// Scores of each of `names` in each domain, and its manifest; `None` for models that are not there. Every model is asked
/// once about the picture as it is; of an ensemble the first member is.
pub(super) fn score_singles(
    names: &[&str],
    setting: &NetworkSetting,
    progress: &mut Progress<'_>,
) -> Result<Vec<Option<Judged>>, NetworkError> {
    let shelf = setting.shelf()?;
    let source = test_source();
    let (mut places, mut networks) = (Vec::new(), Vec::new());
    let mut rows: Vec<Option<Judged>> = vec![None; names.len()];
    for (place, name) in names.iter().enumerate() {
        let Some(folder) = shelf.find(name) else { continue };
        networks.push(shelf.single(&folder, 0, &source)?);
        places.push(place);
        let manifest = Manifest::read(&folder).map_err(ModelError::from)?;
        rows[place] = Some((manifest, Vec::new()));
    }
    if networks.is_empty() {
        return Ok(rows);
    }
    for domain in TestDomain::ALL {
        let scores = score_networks(&mut networks, &setting.test, domain, || progress.step())?;
        for (place, scores) in places.iter().zip(scores) {
            if let Some((_, domains)) = &mut rows[*place] {
                domains.push(DomainScores { domain, scores: scores.components.unfiltered() });
            }
        }
    }
    Ok(rows)
}

/// What a row without weights says.
pub(super) const NOT_TRAINED: &str = "not trained here";

/// How far a run is.
pub struct Progress<'a> {
    done: usize,
    all: usize,
    on_step: &'a mut dyn FnMut(usize, usize),
}

impl<'a> Progress<'a> {
    /// `on_step` gets how many steps are done, and of how many.
    pub fn new(on_step: &'a mut dyn FnMut(usize, usize)) -> Self {
        Self { done: 0, all: 0, on_step }
    }

    /// There are `steps` more to do.
    pub(super) fn expect(&mut self, steps: usize) {
        self.all += steps;
        (self.on_step)(self.done, self.all);
    }

    /// One is done.
    pub(super) fn step(&mut self) {
        self.done += 1;
        (self.on_step)(self.done, self.all);
    }
}
