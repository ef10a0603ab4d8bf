//! Views of starter motors that no network was trained on, with exact labels, from the generator that `semascan synth`
//! writes training data with and from the virtual cell.

use semascan_inspection::source::{Source, SourceError};
use semascan_model::Taxonomy;
use semascan_perception::segment::network::Volume;
use semascan_perception::view::View;
use semascan_simulation::{Randomisation, TrainingCell, TrainingOptions, VirtualCell, VirtualCellSpec};
use serde::Serialize;

/// The world that views come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum TestDomain {
    /// As training data: lights, camera and surfaces drawn anew for every view, a window around the part.
    Randomised,
    /// A camera, a light rig and a noise model that no training view has.
    Shifted,
    /// The virtual cell as it is.
    VirtualCell,
}

impl TestDomain {
    /// In the order of the tables.
    pub const ALL: [Self; 3] = [Self::Randomised, Self::Shifted, Self::VirtualCell];

    /// For people.
    pub fn name(self) -> &'static str {
        match self {
            Self::Randomised => "randomised",
            Self::Shifted => "shifted",
            Self::VirtualCell => "virtual cell",
        }
    }
}

/// Which views.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TestViews {
    /// Seed of each motor; each domain makes motors of its own from them.
    pub motors: Vec<u64>,
    /// Views of each.
    pub views: u32,
    /// Columns and rows of the camera.
    pub size: (u32, u32),
    /// Cells of the motors' meshes, millimetres.
    pub cell: f32,
}

/// One motor in one domain.
#[derive(Debug)]
pub struct TestMotor {
    from: From,
    views: u32,
}

#[derive(Debug)]
enum From {
    Training(Box<TrainingCell>),
    Cell(Box<VirtualCell>),
}

impl TestViews {
    /// Number of views in a domain.
    pub fn count(&self) -> usize {
        self.motors.len() * self.views as usize
    }

    /// Classes of the labels.
    pub fn taxonomy() -> Taxonomy {
        TrainingCell::taxonomy()
    }

    /// The motor `seed` in `domain`.
    ///
    /// # Errors
    /// [`SourceError`] if there cannot be such views.
    pub fn motor(&self, domain: TestDomain, seed: u64) -> Result<TestMotor, SourceError> {
        let from = match domain {
            TestDomain::Randomised => {
                // A window as large, beside the picture, as networks are trained on.
                let window = (self.size.0 / 2, self.size.1 * 8 / 15);
                let options = TrainingOptions { size: self.size, window, cell: self.cell };
                From::Training(Box::new(TrainingCell::new(seed, 0, options, Randomisation::TRAINING)))
            }
            TestDomain::Shifted => From::Cell(Box::new(self.virtual_cell(seed, "shifted")?)),
            TestDomain::VirtualCell => From::Cell(Box::new(self.virtual_cell(seed, "standard")?)),
        };
        Ok(TestMotor { from, views: self.views })
    }

    fn virtual_cell(&self, seed: u64, domain: &str) -> Result<VirtualCell, SourceError> {
        let Self { views, size: (w, h), cell, .. } = self;
        let uri = format!("virtual:starter-motor?seed={seed}&views={views}&size={w}x{h}&cell={cell}&domain={domain}");
        VirtualCell::open(&VirtualCellSpec::parse(&uri)?)
    }
}

impl TestMotor {
    /// The measuring volume; unknown where the picture is a window around the part already.
    pub fn volume(&self) -> Option<Volume> {
        match &self.from {
            From::Training(_) => None,
            From::Cell(cell) => cell.info().volume,
        }
    }

    /// Its views, rendered one by one.
    pub fn views(&self) -> impl Iterator<Item = View> {
        (0..self.views).filter_map(|index| match &self.from {
            From::Training(cell) => Some(cell.view(index)),
            From::Cell(cell) => cell.view(index),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_domain_shows_labelled_motors_of_its_own() {
        let views = TestViews { motors: vec![1001, 1002], views: 2, size: (160, 120), cell: 3.0 };
        let mut pictures = Vec::new();
        for domain in TestDomain::ALL {
            for seed in &views.motors {
                let motor = views.motor(domain, *seed).expect("a motor");
                assert_eq!(motor.volume().is_none(), domain == TestDomain::Randomised);
                for view in motor.views() {
                    let labels = view.labels.as_ref().expect("labels").components.clone();
                    assert!(labels.iter().any(|l| *l != 0), "{domain:?}");
                    pictures.push(view.rgb);
                }
            }
        }
        assert_eq!(pictures.len(), 3 * views.count());
        assert!((1..pictures.len()).all(|i| pictures[i] != pictures[i - 1]));
        assert_eq!(pictures[0].dimensions(), (80, 64));
    }
}
