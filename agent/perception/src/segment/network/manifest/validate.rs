//! Whether a manifest makes sense in itself: what types alone cannot say.

use super::{Channel, Fusion, Input, Manifest, Output, Task};
use std::path::{Component, Path};

/// (field, reason).
type Fault = (String, String);

/// Widest and tallest fixed input, and largest padding.
const LARGEST_EDGE: u32 = 8192;
/// Most classes: eight-bit probabilities of more would be noise.
const MOST_CLASSES: usize = 200;

fn fault<T>(field: impl Into<String>, reason: impl Into<String>) -> Result<T, Fault> {
    Err((field.into(), reason.into()))
}

impl Manifest {
    /// Checks everything but the networks.
    pub(super) fn validate(&self) -> Result<(), Fault> {
        if self.schema != 1 {
            return fault("schema", format!("{} is not known, only 1 is", self.schema));
        }
        if self.name.is_empty() || !self.name.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-')
        {
            return fault("name", format!("{:?} is not made of lower-case letters, digits and -", self.name));
        }
        if self.version.is_empty() {
            return fault("version", "is empty");
        }
        self.validate_networks()?;
        self.input.validate()?;
        self.validate_fusion()?;
        self.output.validate(self.task)?;
        self.domain.as_ref().map_or(Ok(()), super::Domain::validate)?;
        self.validate_classes()
    }

    fn validate_networks(&self) -> Result<(), Fault> {
        if self.networks.is_empty() {
            return fault("network", "there is none");
        }
        if self.networks.len() > 1 && self.task == Task::Instance {
            return fault("network", "objects of several networks cannot be averaged: name one");
        }
        for (i, network) in self.networks.iter().enumerate() {
            validate_file(&format!("network[{i}]"), &network.file, &network.sha256)?;
            for (k, weights) in network.weights.iter().enumerate() {
                validate_file(&format!("network[{i}].weights[{k}]"), &weights.file, &weights.sha256)?;
            }
        }
        Ok(())
    }

    fn validate_fusion(&self) -> Result<(), Fault> {
        let depth = self.uses_depth();
        let both = depth && self.input.channels.len() > 1;
        match (self.fusion, both) {
            (Fusion::None, true) => fault("fusion", "is none, but input.channels has colour and depth"),
            (Fusion::None, false) | (_, true) => Ok(()),
            (_, false) => fault("fusion", "is not none, but input.channels has not both colour and depth"),
        }
    }

    fn validate_classes(&self) -> Result<(), Fault> {
        if !(2..=MOST_CLASSES).contains(&self.classes.len()) {
            return fault("classes", format!("{} are not 2 to {MOST_CLASSES}", self.classes.len()));
        }
        for (i, class) in self.classes.iter().enumerate() {
            if (i == 0) != (class.name == "none") {
                return fault(format!("classes[{i}].name"), "the first class is none, and no other");
            }
            if class.name.trim().is_empty() || class.name.chars().any(char::is_control) {
                return fault(format!("classes[{i}].name"), format!("{:?} is no name", class.name));
            }
            if self.classes[..i].iter().any(|other| other.name == class.name) {
                return fault(format!("classes[{i}].name"), format!("{:?} is there twice", class.name));
            }
            if class.rgb().is_none() {
                return fault(format!("classes[{i}].colour"), format!("{:?} is not #rrggbb", class.color));
            }
        }
        Ok(())
    }
}

/// A file in the model's folder, and a checksum that can be one.
fn validate_file(field: &str, file: &str, sha256: &str) -> Result<(), Fault> {
    let mut parts = Path::new(file).components();
    if !matches!((parts.next(), parts.next()), (Some(Component::Normal(_)), None)) {
        return fault(format!("{field}.file"), format!("{file:?} is not a file in the model's folder"));
    }
    if sha256.len() != 64 || !sha256.chars().all(|c| c.is_ascii_hexdigit()) {
        return fault(format!("{field}.sha256"), format!("{sha256:?} is not 64 hexadecimal digits"));
    }
    Ok(())
}

impl Input {
    fn validate(&self) -> Result<(), Fault> {
        if self.tensor.is_empty() {
            return fault("input.tensor", "is empty");
        }
        if self.channels.is_empty() {
            return fault("input.channels", "is empty");
        }
        for (i, channel) in self.channels.iter().enumerate() {
            if self.channels[..i].contains(channel) {
                return fault("input.channels", "names a channel twice");
            }
        }
        if !(1..=LARGEST_EDGE).contains(&self.multiple) {
            return fault("input.multiple", format!("{} is not 1 to {LARGEST_EDGE}", self.multiple));
        }
        for (name, edge) in [("input.width", self.width), ("input.height", self.height)] {
            match edge {
                Some(n) if !(1..=LARGEST_EDGE).contains(&n) => {
                    return fault(name, format!("{n} is not 1 to {LARGEST_EDGE}"));
                }
                Some(n) if n % self.multiple != 0 => {
                    return fault(name, format!("{n} is not a multiple of {}", self.multiple));
                }
                None if self.width.is_some() || self.height.is_some() => {
                    return fault(name, "is missing beside the other");
                }
                _ => {}
            }
        }
        if let Some([finest, coarsest]) = self.footprint
            && !(finest > 0.0 && finest <= coarsest && coarsest.is_finite())
        {
            return fault("input.footprint", "is not two lengths in metres, the finest first");
        }
        let has_color = self.channels.iter().any(|c| *c != Channel::Depth);
        match &self.color {
            None if has_color => return fault("input.colour", "is missing, and there are colour channels"),
            Some(scale) => {
                if !scale.mean.iter().all(|m| m.is_finite()) {
                    return fault("input.colour.mean", "is not finite");
                }
                if !scale.std.iter().all(|s| s.is_finite() && *s > 0.0) {
                    return fault("input.colour.std", "is not positive");
                }
            }
            None => {}
        }
        match &self.depth {
            None if self.channels.contains(&Channel::Depth) => {
                fault("input.depth", "is missing, and there is a depth channel")
            }
            Some(scale) if !(scale.near.is_finite() && scale.near >= 0.0) => {
                fault("input.depth.near", "is not a distance")
            }
            Some(scale) if !(scale.far.is_finite() && scale.far > scale.near) => {
                fault("input.depth.far", "is not beyond near")
            }
            Some(scale) if !scale.missing.is_finite() => fault("input.depth.missing", "is not finite"),
            _ => Ok(()),
        }
    }
}

impl Output {
    fn validate(&self, task: Task) -> Result<(), Fault> {
        let by_centres = [("output.centres", &self.centres), ("output.offsets", &self.offsets)];
        let by_detection = [
            ("output.boxes", &self.boxes),
            ("output.labels", &self.labels),
            ("output.scores", &self.scores),
            ("output.masks", &self.masks),
        ];
        if let Some((field, _)) = self.names().into_iter().find(|(_, name)| name.is_empty()) {
            return fault(field, "is empty");
        }
        if self.contribution.is_some() && task != Task::TwoStream {
            return fault("output.contribution", format!("belongs to two-stream networks, not to {}", task.name()));
        }
        if task != Task::Instance {
            if self.tensor.is_none() {
                return fault("output.tensor", "is missing");
            }
            return match by_centres.iter().chain(&by_detection).find(|(_, name)| name.is_some()) {
                Some((field, _)) => fault(*field, format!("belongs to instance networks, not to {}", task.name())),
                None => Ok(()),
            };
        }
        let used = |set: &[(&str, &Option<String>)]| set.iter().any(|(_, name)| name.is_some());
        let set: &[_] = match (used(&by_centres), used(&by_detection)) {
            (true, false) => &by_centres,
            (false, true) => &by_detection,
            (true, true) => {
                return fault("output.boxes", "stands beside centres: objects are found by one or the other");
            }
            (false, false) => {
                return fault("output.centres", "is missing, and so is boxes: where do objects come from");
            }
        };
        match set.iter().find(|(_, name)| name.is_none()) {
            Some((field, _)) => fault(*field, "is missing beside the others"),
            None => Ok(()),
        }
    }
}
