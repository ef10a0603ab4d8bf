//! A loaded model: its manifest, and its networks, checked against it. What does not fit is an error here, before the
//! first view, that names file and field.

use super::engine::{Element, Engine, EngineError, Network, Port, Tensor};
use super::manifest::{Activation, Manifest, ManifestError, Task};
use super::objects::{Objects, from_detections};
use super::upsample::{enlarged, factor};
use rayon::prelude::*;
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// Why a model cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ModelError {
    /// The manifest, or a network that is not what it says.
    #[error(transparent)]
    Manifest(#[from] ManifestError),
    /// The engine, or a network that it cannot run.
    #[error(transparent)]
    Engine(#[from] EngineError),
}

/// Edge of the picture that a network is tried with, pixels, before padding.
const TRIAL: u32 = 64;
/// How far beyond 0..1 a probability may be for rounding.
const ROUNDING: f32 = 1e-2;

/// A model that is ready to run.
pub struct NetworkModel {
    folder: PathBuf,
    manifest: Manifest,
    networks: Vec<Box<dyn Network>>,
}

impl fmt::Debug for NetworkModel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("NetworkModel").field("folder", &self.folder).field("networks", &self.networks.len()).finish()
    }
}

/// What one network says of a batch of pictures.
#[derive(Clone, Debug, PartialEq)]
pub struct Answer {
    /// Class probabilities, `[N, K, H, W]`.
    pub probabilities: Tensor,
    /// Two-stream: the share of the colour stream, `[N, 1, H, W]`.
    pub contribution: Option<Tensor>,
    /// Detectors: the objects of the first picture.
    pub objects: Option<Objects>,
}

impl NetworkModel {
    /// Loads the model in `folder` with `threads` threads for all its networks together.
    ///
    /// # Errors
    /// [`ModelError`] if the manifest is wrong, a file is missing or not the one it names, or a network does not fit it.
    pub fn load(folder: &Path, engine: &dyn Engine, threads: usize) -> Result<Self, ModelError> {
        let manifest = Manifest::read(folder)?;
        manifest.verify(folder)?;
        // Members run beside each other on the pipeline's own threads; what is left over works within a network.
        let within = (threads / manifest.networks.len()).max(1);
        let networks: Vec<_> = manifest
            .networks
            .par_iter()
            .map(|network| engine.load(&folder.join(&network.file), within))
            .collect::<Result<_, _>>()?;
        let mut model = Self { folder: folder.into(), manifest, networks };
        for index in 0..model.networks.len() {
            model.check(index)?;
        }
        Ok(model)
    }

    /// The description.
    pub fn manifest(&self) -> &Manifest {
        &self.manifest
    }

    /// Where it lies.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The model with member `index` of its ensemble alone; unchanged if there is no such member.
    pub fn alone(mut self, index: usize) -> Self {
        if index < self.networks.len() {
            self.networks = vec![self.networks.swap_remove(index)];
            self.manifest.networks = vec![self.manifest.networks.swap_remove(index)];
        }
        self
    }

    fn fault(&self, field: &str, index: usize, reason: &str) -> ModelError {
        let file = self.manifest.networks.get(index).map_or("", |n| &n.file);
        ManifestError::new(&self.folder, field, format!("{file} {reason}")).into()
    }

    /// Checks the ports of a network, then runs it on a grey picture.
    fn check(&mut self, index: usize) -> Result<(), ModelError> {
        let (inputs, outputs) = (self.networks[index].inputs(), self.networks[index].outputs());
        let names = |ports: &[Port]| ports.iter().map(|p| p.name.as_str()).collect::<Vec<_>>().join(", ");
        let input = &self.manifest.input;
        let [port] = inputs else {
            let reason = format!("has {} inputs ({}), one is needed", inputs.len(), names(inputs));
            return Err(self.fault("input.tensor", index, &reason));
        };
        if port.name != input.tensor {
            return Err(self.fault("input.tensor", index, &format!("has no input {}: {}", input.tensor, port.name)));
        }
        for (field, name) in self.manifest.output.names() {
            if !outputs.iter().any(|port| port.name == name) {
                return Err(self.fault(field, index, &format!("has no output {name}: {}", names(outputs))));
            }
        }
        if let Element::Other(found) = &port.element {
            return Err(self.fault("input.tensor", index, &format!("takes {found}, not f32 or f16")));
        }
        let detects = self.manifest.output.boxes.is_some();
        if let Some(shape) = &port.shape {
            let wanted = input.channels.len();
            if let [_, second, _, last] = shape.as_slice()
                && *last == Some(wanted)
                && *second != *last
            {
                let reason =
                    format!("takes [N, H, W, {wanted}]: export it with channels first, as [N, {wanted}, H, W]");
                return Err(self.fault("input.tensor", index, &reason));
            }
            let (channels, height, width) = match shape.as_slice() {
                [_, c, h, w] => (*c, *h, *w),
                [c, h, w] if detects => (*c, *h, *w),
                _ => {
                    let reason = format!("takes {} dimensions, not [N, C, H, W]", shape.len());
                    return Err(self.fault("input.tensor", index, &reason));
                }
            };
            if let Some(found) = channels.filter(|&c| c != input.channels.len()) {
                let reason = format!("takes {found} channels, {} are named", input.channels.len());
                return Err(self.fault("input.channels", index, &reason));
            }
            for (field, fixed, said) in [("input.height", height, input.height), ("input.width", width, input.width)] {
                match (fixed, said) {
                    (Some(fixed), Some(said)) if fixed != said as usize => {
                        return Err(self.fault(field, index, &format!("takes {fixed}, not {said}")));
                    }
                    (Some(fixed), None) => {
                        return Err(self.fault(field, index, &format!("takes {fixed} only, which must be said")));
                    }
                    _ => {}
                }
            }
        }
        // Detectors resize what they get: a trial would take seconds and say little.
        if detects { Ok(()) } else { self.try_out(index) }
    }

    /// Runs a network on a grey picture: shapes and ranges that the graph does not state show then.
    fn try_out(&mut self, index: usize) -> Result<(), ModelError> {
        let input = &self.manifest.input;
        let padded = TRIAL.div_ceil(input.multiple) * input.multiple;
        let (width, height) = (input.width.unwrap_or(padded) as usize, input.height.unwrap_or(padded) as usize);
        let channels = input.channels.len();
        let picture = Tensor { shape: vec![1, channels, height, width], data: vec![0.0; channels * height * width] };
        let named = self.manifest.output.names();
        let wanted: Vec<&str> = named.iter().map(|(_, name)| *name).collect();
        let outputs = self.networks[index].run(&picture, &wanted)?;
        let classes = self.manifest.classes.len();
        for ((field, _), output) in named.iter().zip(&outputs) {
            let quarter = |n: usize| n / 4;
            let (field, wanted) = match *field {
                "output.tensor" => ("classes", [1, classes, height, width]),
                "output.centres" => ("classes", [1, classes, quarter(height), quarter(width)]),
                "output.offsets" => (*field, [1, 2, quarter(height), quarter(width)]),
                _ => (*field, [1, 1, height, width]),
            };
            if output.shape.len() != 4 || output.data.len() != output.shape.iter().product::<usize>() {
                return Err(self.fault(field, index, &format!("gives {:?}, not {wanted:?}", output.shape)));
            }
            // Many networks label cells of 2 to 16 pixels: what they say is spread over these.
            let coarse = matches!(field, "classes" | "output.contribution") && factor(&output.shape, &wanted).is_some();
            if output.shape != wanted && !coarse {
                if output.shape == [1, height, width, wanted[1]] {
                    let reason = format!("gives [N, H, W, {0}]: export it as [N, {0}, H, W]", wanted[1]);
                    return Err(self.fault("output.tensor", index, &reason));
                }
                // The number of classes is the usual mistake and has a field of its own.
                let field = if output.shape[1] == wanted[1] { "output.tensor" } else { field };
                return Err(self.fault(field, index, &format!("gives {:?}, not {wanted:?}", output.shape)));
            }
        }
        let said = outputs.first().map_or(&[][..], |o| &o.data);
        let raw = self.manifest.output.activation == Activation::None;
        if let Some(value) = said.iter().find(|p| !p.is_finite() || raw && !(-ROUNDING..=1.0 + ROUNDING).contains(*p)) {
            let reason = format!("gives {value}, which is no probability");
            return Err(self.fault("output.activation", index, &reason));
        }
        Ok(())
    }

    /// Shows `pictures` pictures (`[1, C, H, W]`) to each network, and gives what is taken from the answers, all of the first
    /// network first. Networks work beside each other, each on one picture at a time: what a picture needs is small enough
    /// for the caches, and is made and given back where it is used.
    ///
    /// # Errors
    /// [`EngineError`] if one does not run or gives another shape than it did when it was tried.
    pub fn ask_each<T: Send>(
        &mut self,
        pictures: usize,
        picture: impl Fn(usize) -> Tensor + Sync,
        take: impl Fn(usize, Answer) -> T + Sync,
    ) -> Result<Vec<T>, EngineError> {
        if self.manifest.output.boxes.is_some() {
            return (0..pictures).map(|place| Ok(take(place, self.detect(&picture(place))?))).collect();
        }
        let Self { folder, manifest, networks } = self;
        let count = networks.len();
        let networks: Vec<Mutex<&mut Box<dyn Network>>> = networks.iter_mut().map(Mutex::new).collect();
        // Threads begin at different networks, so that they seldom wait for each other.
        let ask = |job: usize| {
            let (place, step) = (job / count, job % count);
            let member = (step + place * count / pictures) % count;
            let input = picture(place);
            let file = folder.join(&manifest.networks[member].file);
            let mut network = networks[member].lock().unwrap_or_else(PoisonError::into_inner);
            let answer = answer(network.as_mut(), &file, manifest, &input)?;
            drop(network);
            Ok((member * pictures + place, take(place, answer)))
        };
        let mut taken: Vec<(usize, T)> =
            (0..count * pictures).into_par_iter().with_max_len(1).map(ask).collect::<Result<_, EngineError>>()?;
        taken.sort_unstable_by_key(|(order, _)| *order);
        Ok(taken.into_iter().map(|(_, taken)| taken).collect())
    }

    /// What the first network alone says of a batch of pictures.
    ///
    /// # Errors
    /// As [`Self::ask_each`].
    pub fn ask_first(&mut self, pictures: &Tensor) -> Result<Answer, EngineError> {
        if self.manifest.output.boxes.is_some() {
            return self.detect(pictures);
        }
        let Self { folder, manifest, networks } = self;
        let (Some(network), Some(file)) = (networks.first_mut(), manifest.networks.first()) else {
            return Err(EngineError::Run { file: folder.clone(), reason: "holds no network".into() });
        };
        answer(network.as_mut(), &folder.join(&file.file), manifest, pictures)
    }

    /// What a detector says, picture by picture.
    fn detect(&mut self, pictures: &Tensor) -> Result<Answer, EngineError> {
        let classes = self.manifest.classes.len();
        let (height, width) = (pictures.shape[2], pictures.shape[3]);
        let mut answer = Answer {
            probabilities: Tensor { shape: vec![pictures.shape[0], classes, height, width], data: Vec::new() },
            contribution: None,
            objects: None,
        };
        let one = [&[1], &pictures.shape[1..]].concat();
        for picture in pictures.data.chunks_exact(one.iter().product::<usize>().max(1)) {
            let outputs = self.outputs(&Tensor { shape: one.clone(), data: picture.to_vec() })?;
            let (probabilities, objects) = from_detections(&outputs, classes, (width, height)).map_err(|e| {
                let file = self.manifest.networks.first().map_or("", |n| &n.file);
                EngineError::Run { file: self.folder.join(file), reason: e.to_string() }
            })?;
            answer.probabilities.data.extend(probabilities);
            answer.objects.get_or_insert(objects);
        }
        Ok(answer)
    }

    /// The raw outputs of an instance network for one picture, in the order of
    /// [`super::manifest::Output::object_names`].
    ///
    /// # Errors
    /// [`EngineError`] if it does not run.
    pub fn outputs(&mut self, picture: &Tensor) -> Result<Vec<Tensor>, EngineError> {
        let wanted = self.manifest.output.object_names();
        let wanted: Vec<&str> = wanted.iter().map(|(_, name)| *name).collect();
        let Some(network) = self.networks.first_mut() else { return Ok(Vec::new()) };
        // Torchvision's detectors take one picture without a batch.
        let bare = network.inputs().first().and_then(|p| p.shape.as_ref()).is_some_and(|s| s.len() == 3);
        if bare {
            let picture = Tensor { shape: picture.shape[1..].to_vec(), data: picture.data.clone() };
            return network.run(&picture, &wanted);
        }
        network.run(picture, &wanted)
    }

    /// Whether it gives classes to pixels of its own account.
    pub fn labels_pixels(&self) -> bool {
        self.manifest.output.tensor.is_some() || self.manifest.output.boxes.is_some()
    }

    /// Whether it separates objects.
    pub fn separates_objects(&self) -> bool {
        self.manifest.task == Task::Instance
    }
}

/// What the network in `file` says of a batch of pictures.
fn answer(
    network: &mut dyn Network,
    file: &Path,
    manifest: &Manifest,
    pictures: &Tensor,
) -> Result<Answer, EngineError> {
    let output = &manifest.output;
    let wanted: Vec<&str> = output.tensor.iter().chain(&output.contribution).map(String::as_str).collect();
    let classes = manifest.classes.len();
    let mut outputs = network.run(pictures, &wanted)?.into_iter();
    let mut next = |channels: usize| {
        let wanted = [&pictures.shape[..1], &[channels], &pictures.shape[2..]].concat();
        let output = outputs.next().unwrap_or_default();
        let is_whole = output.data.len() == output.shape.iter().product::<usize>();
        if let Some(factor) = factor(&output.shape, &wanted).filter(|_| is_whole) {
            return Ok(if factor == 1 { output } else { enlarged(&output, factor) });
        }
        let reason = format!("gives {:?}, not {wanted:?}", output.shape);
        Err(EngineError::Run { file: file.to_owned(), reason })
    };
    let mut probabilities = next(classes)?;
    activate(&mut probabilities, classes, output.activation);
    let contribution = if output.contribution.is_some() { Some(next(1)?) } else { None };
    Ok(Answer { probabilities, contribution, objects: None })
}

/// Makes probabilities of what the network gives, `[N, K, H, W]`.
pub(super) fn activate(tensor: &mut Tensor, classes: usize, activation: Activation) {
    let pixels = tensor.shape.iter().skip(2).product::<usize>().max(1);
    for picture in tensor.data.chunks_exact_mut((classes * pixels).max(1)) {
        match activation {
            Activation::None => picture.iter_mut().for_each(|p| *p = p.clamp(0.0, 1.0)),
            Activation::Sigmoid => picture.iter_mut().for_each(|x| *x = 1.0 / (1.0 + (-*x).exp())),
            Activation::Softmax => {
                for i in 0..pixels {
                    let largest = (0..classes).map(|c| picture[c * pixels + i]).fold(f32::NEG_INFINITY, f32::max);
                    (0..classes).for_each(|c| picture[c * pixels + i] = (picture[c * pixels + i] - largest).exp());
                }
            }
        }
        if activation == Activation::None {
            continue;
        }
        for i in 0..pixels {
            let sum: f32 = (0..classes).map(|c| picture[c * pixels + i]).sum();
            (0..classes).for_each(|c| picture[c * pixels + i] /= sum.max(f32::MIN_POSITIVE));
        }
    }
}
