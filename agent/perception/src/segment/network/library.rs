//! Which models are installed, and which of them an inspection uses.
//!
//! Looked for in the folder that the environment variable `SEMASCAN_MODELS` names and nowhere else, or in this order:
//! `models` beside the executable, `../share/semascan/models` from there, the user's data folder (`semascan/models` in it),
//! `semascan/models` in Python's site-packages, `agent/models` in the working directory, `agent/models` of the source tree
//! that cargo's target folder lies in.

use super::manifest::{FILE_NAME, Manifest, ManifestError, Task};
use super::places::Places;
use super::taxonomy::shared;
use semascan_model::Taxonomy;
use semascan_model::choice::possible_instead;
use std::path::{Path, PathBuf};

/// Names the folder of models.
const VARIABLE: &str = "SEMASCAN_MODELS";

/// Folder, within a folder of models, of those that no inspection uses: variants for the papers' tables.
const COMPARISON: &str = "comparison";

/// A folder with a manifest.
#[derive(Clone, Debug, PartialEq)]
pub struct Installed {
    /// The folder.
    pub folder: PathBuf,
    /// Its manifest, or what is wrong with it.
    pub manifest: Result<Manifest, ManifestError>,
}

/// Why the models that were asked for are not there.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SelectError {
    /// There are none at all.
    #[error("no models are installed; looked in {}", list(looked_in))]
    None {
        /// Where.
        looked_in: Vec<PathBuf>,
    },
    /// No model or folder has this name.
    #[error("there is no model {name:?}: {}", instead(name, installed))]
    Unknown {
        /// What was asked for.
        name: String,
        /// What there is.
        installed: Vec<String>,
    },
    /// A manifest is wrong.
    #[error(transparent)]
    Manifest(#[from] ManifestError),
    /// The models do not make up a segmenter.
    #[error("{0}")]
    Tasks(String),
}

fn list(paths: &[PathBuf]) -> String {
    paths.iter().map(|p| p.display().to_string()).collect::<Vec<_>>().join(", ")
}

fn instead(name: &str, installed: &[String]) -> String {
    possible_instead(name, &installed.iter().map(String::as_str).collect::<Vec<_>>())
}

/// Folders that models may lie in, whether they exist or not.
pub fn search_path() -> Vec<PathBuf> {
    let named = std::env::var_os(VARIABLE).filter(|v| !v.is_empty()).map(PathBuf::from);
    search(named, std::env::current_exe().ok().as_deref(), &Places::of_environment())
}

fn search(named: Option<PathBuf>, executable: Option<&Path>, places: &Places) -> Vec<PathBuf> {
    if let Some(folder) = named {
        return vec![folder];
    }
    let mut folders = Vec::new();
    if let Some(beside) = executable.and_then(Path::parent) {
        folders.push(beside.join("models"));
        folders.extend(beside.parent().map(|prefix| prefix.join("share/semascan/models")));
    }
    folders.extend(places.data.iter().map(|data| data.join("models")));
    folders.extend(places.site_packages(executable).into_iter().map(|site| site.join("semascan/models")));
    folders.push(PathBuf::from("agent/models"));
    let target = executable.iter().flat_map(|e| e.ancestors()).find(|a| a.file_name().is_some_and(|n| n == "target"));
    folders.extend(target.and_then(Path::parent).map(|root| root.join("agent/models")));
    folders
}

/// The models in `folders`, by name of their folders; of two with one name the first.
pub fn installed(folders: &[PathBuf]) -> Vec<Installed> {
    let mut found: Vec<Installed> = Vec::new();
    for folder in folders {
        let entries = std::fs::read_dir(folder).into_iter().flatten().filter_map(|entry| Some(entry.ok()?.path()));
        let mut models: Vec<PathBuf> = entries.filter(|path| path.join(FILE_NAME).is_file()).collect();
        models.sort();
        for model in models {
            if !found.iter().any(|other| other.folder.file_name() == model.file_name()) {
                found.push(Installed { manifest: Manifest::read(&model), folder: model });
            }
        }
    }
    found
}

/// The folder of the model called `name` in `folders`, or of the variant of that name that is kept for comparison.
pub fn find(folders: &[PathBuf], name: &str) -> Option<PathBuf> {
    folders
        .iter()
        .flat_map(|folder| [folder.join(name), folder.join(COMPARISON).join(name)])
        .find(|path| path.join(FILE_NAME).is_file())
}

/// The models to use: those named in `asked` (a model's folder, a folder of models, or a name), or the best of each task
/// for a source with the classes `known` where only folders of models are named or nothing is.
///
/// # Errors
/// [`SelectError`] naming what is missing or wrong.
pub fn select(asked: &[String], known: &Taxonomy) -> Result<Vec<(PathBuf, Manifest)>, SelectError> {
    select_from(asked, known, search_path())
}

fn select_from(
    asked: &[String],
    known: &Taxonomy,
    mut folders: Vec<PathBuf>,
) -> Result<Vec<(PathBuf, Manifest)>, SelectError> {
    let mut named = Vec::new();
    let mut shelves = Vec::new();
    for name in asked {
        let path = Path::new(name);
        if path.join(FILE_NAME).is_file() {
            named.push((path.to_owned(), Manifest::read(path)?));
        } else if path.is_dir() {
            shelves.push(path.to_owned());
        }
    }
    let is_path = |name: &String| Path::new(name).is_dir();
    // Folders that are named replace those that are searched.
    if !shelves.is_empty() {
        folders = shelves;
    }
    tracing::debug!("models are looked for in {}", list(&folders));
    let there = installed(&folders);
    for name in asked.iter().filter(|name| !is_path(name)) {
        let model = there.iter().find(|m| m.folder.file_name().is_some_and(|f| f == name.as_str()));
        match model {
            Some(model) => named.push((model.folder.clone(), model.manifest.clone()?)),
            None => {
                let installed =
                    there.iter().filter_map(|m| Some(m.folder.file_name()?.to_string_lossy().into_owned())).collect();
                return Err(SelectError::Unknown { name: name.clone(), installed });
            }
        }
    }
    if !named.is_empty() {
        return Ok(named);
    }
    if there.is_empty() {
        return Err(SelectError::None { looked_in: folders });
    }
    best(there, known)
}

/// One model for components, one for defects and one for instances, where there are such. What a model is for shows in
/// its classes: one that shares most with the source comes first, and one for defects that shares none, though the source
/// names some, is for other parts.
fn best(there: Vec<Installed>, known: &Taxonomy) -> Result<Vec<(PathBuf, Manifest)>, SelectError> {
    let mut models = Vec::new();
    for model in there {
        let manifest = model.manifest?;
        let shared = shared(&manifest, known);
        if manifest.task != Task::Defect || shared > 0 || known.defects.len() < 2 {
            models.push((shared, model.folder, manifest));
        }
    }
    // Uncertainty needs an ensemble; after that the better measured one.
    let rank = |shared: usize, m: &Manifest| (shared, m.task == Task::Semantic, m.networks.len());
    models.sort_by(|(s, _, a), (t, _, b)| rank(*t, b).cmp(&rank(*s, a)).then(mean_iou(b).total_cmp(&mean_iou(a))));
    let mut chosen: Vec<(PathBuf, Manifest)> = Vec::new();
    for (_, folder, manifest) in models {
        if !chosen.iter().any(|(_, other)| kind(other) == kind(&manifest)) {
            chosen.push((folder, manifest));
        }
    }
    Ok(chosen)
}

/// Two-stream networks label components as semantic ones do.
fn kind(manifest: &Manifest) -> Task {
    if manifest.task == Task::TwoStream { Task::Semantic } else { manifest.task }
}

/// The model's own figure.
fn mean_iou(manifest: &Manifest) -> f64 {
    manifest.metrics.get("mean_iou").and_then(toml::Value::as_float).unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::segment::network::fixtures;

    fn write(shelf: &Path, name: &str, task: &str, members: usize, iou: f64) {
        let mut manifest = fixtures::manifest(task, &["none", "housing"]);
        manifest.name = name.into();
        manifest.networks = vec![manifest.networks[0].clone(); members];
        manifest.metrics.insert("mean_iou".into(), toml::Value::Float(iou));
        let folder = shelf.join(name);
        std::fs::create_dir_all(&folder).expect("a folder");
        std::fs::write(folder.join(FILE_NAME), toml::to_string(&manifest).expect("writes")).expect("writes");
    }

    #[test]
    fn the_best_of_each_task_is_taken_unless_models_are_named() {
        let root = tempfile::tempdir().expect("a folder");
        let shelf = root.path();
        write(shelf, "single", "semantic", 1, 0.99);
        write(shelf, "ensemble", "semantic", 5, 0.9);
        write(shelf, "streams", "two-stream", 9, 0.99);
        write(shelf, "rust", "defect", 1, 0.8);
        let nothing = Taxonomy::from_names::<&str>(&[], &[]);
        let mut known = nothing.clone();
        let chosen = |asked: &[&str], known: &Taxonomy| {
            let asked: Vec<String> = asked.iter().map(|s| (*s).to_owned()).collect();
            let models = select_from(&asked, known, vec![shelf.to_owned()])?;
            Ok::<_, SelectError>(models.into_iter().map(|(_, m)| m.name).collect::<Vec<_>>())
        };
        assert_eq!(chosen(&[], &nothing).expect("there are some"), ["ensemble", "rust"]);
        assert_eq!(chosen(&["streams", "rust"], &nothing).expect("both"), ["streams", "rust"]);
        let path = shelf.join("single").display().to_string();
        assert_eq!(chosen(&[&path], &nothing).expect("a path"), ["single"]);
        assert_eq!(chosen(&[&shelf.display().to_string()], &nothing).expect("a shelf"), ["ensemble", "rust"]);
        let error = chosen(&["missing"], &nothing).expect_err("not there").to_string();
        assert!(error.contains("missing") && error.contains("ensemble"), "{error}");
        // A source whose defects the model does not know has no use for it; one that knows its components comes first.
        known.defects = Taxonomy::from_names::<&str>(&[], &["pitting"]).defects;
        assert_eq!(chosen(&[], &known).expect("there are some"), ["ensemble"]);
        write(shelf, "fans", "semantic", 1, 0.5);
        let text = std::fs::read_to_string(shelf.join("fans").join(FILE_NAME)).expect("reads");
        std::fs::write(shelf.join("fans").join(FILE_NAME), text.replace("housing", "fan")).expect("writes");
        known.components = Taxonomy::from_names::<&str>(&["fan", "shaft"], &[]).components;
        assert_eq!(chosen(&[], &known).expect("there are some"), ["fans"]);
    }

    #[test]
    fn installed_models_are_found_outside_of_the_source_tree() {
        let places = Places { data: Some("/home/a/.local/share/semascan".into()), python: vec!["/venv".into()] };
        let folders = search(None, Some(Path::new("/opt/semascan/bin/semascan")), &places);
        let expected = [
            "/opt/semascan/bin/models",
            "/opt/semascan/share/semascan/models",
            "/home/a/.local/share/semascan/models",
            "agent/models",
        ];
        assert_eq!(folders, expected.map(PathBuf::from));
        let built = search(None, Some(Path::new("/src/target/release/semascan")), &Places::default());
        assert_eq!(built.last(), Some(&PathBuf::from("/src/agent/models")));
        let named = search(Some("/models".into()), Some(Path::new("/opt/semascan/bin/semascan")), &places);
        assert_eq!(named, [PathBuf::from("/models")], "what a person names is the only one");
    }

    #[test]
    fn variants_for_comparison_are_found_but_never_chosen() {
        let root = tempfile::tempdir().expect("a folder");
        write(root.path(), "shipped", "semantic", 1, 0.5);
        write(&root.path().join("comparison"), "variant", "semantic", 5, 0.9);
        let folders = [root.path().join("nowhere"), root.path().to_owned()];
        assert_eq!(find(&folders, "shipped"), Some(root.path().join("shipped")));
        assert_eq!(find(&folders, "variant"), Some(root.path().join("comparison/variant")));
        assert_eq!(find(&folders, "other"), None);
        let known = Taxonomy::from_names::<&str>(&[], &[]);
        let chosen = select_from(&[], &known, folders.to_vec()).expect("there is one");
        assert_eq!(chosen.len(), 1);
        assert_eq!(chosen[0].1.name, "shipped");
    }

    #[test]
    fn an_empty_shelf_says_where_it_looked_and_a_broken_manifest_is_named() {
        let known = Taxonomy::from_names::<&str>(&[], &[]);
        let root = tempfile::tempdir().expect("a folder");
        let error = select_from(&[], &known, vec![root.path().to_owned()]).expect_err("nothing there").to_string();
        assert!(error.contains(&root.path().display().to_string()), "{error}");
        std::fs::create_dir_all(root.path().join("broken")).expect("a folder");
        std::fs::write(root.path().join("broken").join(FILE_NAME), "schema = 1").expect("writes");
        let error = select_from(&[], &known, vec![root.path().to_owned()]).expect_err("broken").to_string();
        assert!(error.contains("broken/model.toml"), "{error}");
    }
}
