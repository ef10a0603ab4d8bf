//! From the link and the model to events of the state.

use crate::app::Event;
use crate::app::legend::ClassFigures;
use crate::link::LinkEvent;
use crate::model::LiveModel;
use crate::render::HiddenFlags;

/// What an event of the link means to the state; `None` for the bulk lane, which only the model follows.
pub fn app_event(event: LinkEvent) -> Option<Event> {
    Some(match event {
        LinkEvent::Connecting { attempt } => Event::Connecting { attempt },
        LinkEvent::Connected { inspection, resumed, agent } => Event::Connected { inspection, resumed, agent },
        LinkEvent::Disconnected { reason, retry_ms } => Event::Disconnected { reason, retry_ms },
        LinkEvent::Refused { reason } => Event::Refused { reason },
        LinkEvent::Cleared(inspection) => Event::Cleared(inspection),
        LinkEvent::Progress(progress) => Event::Progress(progress),
        LinkEvent::Stage(stage) => Event::Stage(stage),
        LinkEvent::View(report) => Event::View(report),
        LinkEvent::Malformed { reason } => Event::Malformed { reason },
        LinkEvent::Chunk(_) | LinkEvent::ChunkGone { .. } => return None,
    })
}

/// The figures of the model by component class, over the points that `hidden` leaves in the picture; the place in the
/// list is the class.
pub fn class_figures(model: &LiveModel, hidden: HiddenFlags) -> Vec<ClassFigures> {
    let mut list = Vec::new();
    for (class, stats) in model.class_stats(hidden) {
        let place = usize::from(class);
        if list.len() <= place {
            list.resize(place + 1, ClassFigures::default());
        }
        list[place] =
            ClassFigures { points: stats.points as u64, area: stats.area, confidence: stats.mean_confidence() };
    }
    list
}
