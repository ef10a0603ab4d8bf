//! What a tool is to the viewer's state: plain data that follows events, free of the browser and testable anywhere.

use crate::display::Display;
use crate::render::FrameContent;
use std::fmt::Debug;

/// The state of a tool.
pub trait Feature: Clone + Debug + Default + PartialEq {
    /// What happens to the tool.
    type Event: Clone + Debug + PartialEq;

    /// Follows an event of the tool. Total: no event, whatever it carries, is refused or panics.
    ///
    /// * `display`: how the model is shown, which a tool may change.
    fn reduce(&mut self, event: &Self::Event, display: &mut Display);

    /// Another model begins: what was of the one before is void. It may be that of the same inspection, as after a cut link.
    fn begin(&mut self, display: &mut Display) {
        let _ = display;
    }

    /// Another inspection is shown: what the person has begun to say of the one before is void, too.
    fn leave(&mut self) {}

    /// Puts what the tool shows into the picture.
    fn draw(&self, display: &Display, content: &mut FrameContent) {
        let _ = (display, content);
    }
}
