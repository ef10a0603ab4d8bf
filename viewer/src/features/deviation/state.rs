//! The reference, how far the mesh deviates from it, and the tolerance.

use super::DeviationEvent;
use crate::display::{ColorMode, Display};
use crate::features::Feature;
use crate::mesh_worker::{DeviationFigures, ReferenceInfo};
use crate::render::FrameContent;
use semascan_model::LengthUnit;

/// Tolerance until the person sets another, metres.
const TOLERANCE: f64 = 0.5e-3;
/// Tolerances that make sense, metres.
const TOLERANCES: std::ops::RangeInclusive<f64> = 1e-6..=0.1;

/// The comparison as the panels show it.
#[derive(Clone, Debug, PartialEq)]
pub struct Deviation {
    /// Name of a reference that is being read.
    pub reading: Option<String>,
    /// The reference.
    pub reference: Option<ReferenceInfo>,
    /// Unit of its numbers, if the person has said it.
    pub unit: Option<LengthUnit>,
    /// Colours were taken away from deviations that mean nothing. That is done once: a person may want to see them.
    is_warned: bool,
    /// How far the mesh deviates from it.
    pub figures: Option<DeviationFigures>,
    /// Largest deviation within tolerance, metres.
    pub tolerance: f64,
}

impl Default for Deviation {
    fn default() -> Self {
        Self { reading: None, reference: None, unit: None, is_warned: false, figures: None, tolerance: TOLERANCE }
    }
}

impl Feature for Deviation {
    type Event = DeviationEvent;

    fn reduce(&mut self, event: &DeviationEvent, display: &mut Display) {
        match event {
            DeviationEvent::Reading(name) => {
                self.reading = Some(name.clone());
                self.unit = None;
            }
            DeviationEvent::Unit(unit) => self.unit = *unit,
            // The controller's business.
            DeviationEvent::FileRead { .. } => {}
            DeviationEvent::Reference(reference) => {
                self.reading = None;
                self.reference = Some(reference.clone());
                self.figures = None;
                self.is_warned = false;
                display.has_reference = true;
                display.set_color_mode(ColorMode::Deviation);
            }
            DeviationEvent::NoReference => self.reading = None,
            DeviationEvent::Removed => {
                self.reference = None;
                self.unit = None;
                self.figures = None;
                display.has_reference = false;
                display.leave_deviations();
            }
            DeviationEvent::MeshReplaced => self.figures = None,
            DeviationEvent::Compared(figures) => {
                if self.reference.is_some() {
                    self.figures = Some(*figures);
                    if figures.mismatch.is_some() && !std::mem::replace(&mut self.is_warned, true) {
                        display.leave_deviations();
                    }
                }
            }
            DeviationEvent::Tolerance(metres) => {
                if TOLERANCES.contains(metres) {
                    self.tolerance = *metres;
                }
            }
        }
    }

    /// The reference and the tolerance stay.
    fn begin(&mut self, display: &mut Display) {
        self.figures = None;
        display.leave_deviations();
    }

    fn draw(&self, _: &Display, content: &mut FrameContent) {
        content.tolerance = self.tolerance as f32;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::display::Representation;
    use crate::mesh_worker::placement::Mismatch;
    use DeviationEvent::{Compared, MeshReplaced, NoReference, Reading, Reference, Removed, Tolerance};

    fn reference() -> DeviationEvent {
        Reference(ReferenceInfo {
            name: "motor.stl".into(),
            triangles: 9,
            points: 5,
            unit: LengthUnit::Millimetres,
            is_guess: true,
            warnings: Vec::new(),
        })
    }

    fn after(events: impl IntoIterator<Item = DeviationEvent>) -> (Deviation, Display) {
        let (mut deviation, mut display) = <(Deviation, Display)>::default();
        events.into_iter().for_each(|event| deviation.reduce(&event, &mut display));
        (deviation, display)
    }

    #[test]
    fn deviations_belong_to_a_reference_and_a_mesh() {
        let figures = DeviationFigures { mean: 1e-4, ..DeviationFigures::default() };
        assert_eq!(after([Compared(figures)]).0.figures, None);
        let (mut d, mut display) = after([Reading("motor.stl".into()), reference(), Compared(figures)]);
        assert_eq!((d.reading.clone(), d.figures), (None, Some(figures)));
        d.reduce(&MeshReplaced, &mut display);
        assert_eq!(d.figures, None, "of the mesh before");
        d.reduce(&Reading("letter.stl".into()), &mut display);
        d.reduce(&NoReference, &mut display);
        assert!(d.reading.is_none() && d.reference.is_some());
        d.begin(&mut display);
        assert!(d.reference.is_some());
        d.reduce(&Removed, &mut display);
        assert_eq!(d.reference, None);
    }

    #[test]
    fn a_reference_colors_the_mesh_until_it_is_taken_away() {
        let (mut d, mut display) = after([]);
        display.set_color_mode(ColorMode::Deviation);
        assert_eq!(display.color_mode, ColorMode::Component, "there is nothing to deviate from");
        d.reduce(&reference(), &mut display);
        assert_eq!((display.color_mode, display.representation), (ColorMode::Deviation, Representation::Mesh));
        display.set_representation(Representation::Points);
        assert_eq!(display.color_mode, ColorMode::Component, "deviations are those of the mesh");
        display.set_color_mode(ColorMode::Deviation);
        assert_eq!(display.representation, Representation::Mesh);
        d.reduce(&Removed, &mut display);
        assert_eq!((display.color_mode, display.has_reference), (ColorMode::Component, false));
    }

    #[test]
    fn deviations_that_mean_nothing_are_not_painted_unless_a_person_wants_it() {
        let (mut d, mut display) = after([reference()]);
        let mismatch = Some(Mismatch::Unit { ratio: 1000.0, fits: LengthUnit::Millimetres });
        let off = Compared(DeviationFigures { mismatch, ..DeviationFigures::default() });
        d.reduce(&off, &mut display);
        assert_eq!(display.color_mode, ColorMode::Component);
        assert_eq!(d.figures.and_then(|f| f.mismatch), mismatch, "the panel says why");
        display.set_color_mode(ColorMode::Deviation);
        d.reduce(&off, &mut display);
        assert_eq!(display.color_mode, ColorMode::Deviation, "the person has been warned");
        d.reduce(&reference(), &mut display);
        d.reduce(&Compared(DeviationFigures::default()), &mut display);
        assert_eq!(display.color_mode, ColorMode::Deviation, "in its right unit");
    }

    #[test]
    fn a_unit_is_said_of_one_file() {
        let (mut d, mut display) =
            after([Reading("a.stl".into()), DeviationEvent::Unit(Some(LengthUnit::Inches)), reference()]);
        assert_eq!(d.unit, Some(LengthUnit::Inches));
        d.reduce(&Reading("b.stl".into()), &mut display);
        assert_eq!(d.unit, None);
    }

    #[test]
    fn tolerances_that_make_no_sense_are_passed_over() {
        let (mut d, mut display) = after([]);
        for (metres, kept) in [(1e-3, 1e-3), (0.0, 1e-3), (f64::NAN, 1e-3), (-1.0, 1e-3), (9.0, 1e-3)] {
            d.reduce(&Tolerance(metres), &mut display);
            assert_eq!(d.tolerance, kept);
        }
    }
}
