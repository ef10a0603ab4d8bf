//! What a key or a command of the palette asks for.

use crate::camera::CameraInput;
use crate::display::Representation;
use crate::export::{MeshFormat, PointFormat};
use crate::state::Event;

/// One thing that a person asks for.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    /// A change of the state.
    State(Box<Event>),
    /// A move of the camera.
    Camera(CameraInput),
    /// The model as points or as a mesh, which is made where there is none.
    Show(Representation),
    /// A pick in the middle of the view.
    PickMiddle,
    /// A link to what is seen.
    CopyLink,
    /// The picture as a file.
    SavePicture,
    /// The points as a file.
    SavePoints(PointFormat),
    /// The mesh as a file.
    SaveMesh(MeshFormat),
    /// A file to look at.
    OpenFile,
    /// A puck that moves the camera.
    SpaceMouse,
    /// The page in the language of this code.
    Language(&'static str),
    /// Another page of the agent.
    Page(&'static str),
}

impl From<Event> for Action {
    fn from(event: Event) -> Self {
        Self::State(Box::new(event))
    }
}

#[cfg(target_arch = "wasm32")]
mod performing {
    use super::Action;
    use crate::export::Format;
    use crate::features::mesh::show_as;
    use crate::ui::{Command, Ui};
    use wasm_bindgen::JsCast;
    use web_sys::HtmlElement;

    /// The field in the header that files are chosen with.
    pub(in crate::shell) const FILE_FIELD: &str = "open-file";

    impl Action {
        /// Has it done.
        pub(in crate::shell) fn perform(self, ui: Ui) {
            match self {
                Self::State(event) => ui.send(*event),
                Self::Camera(input) => ui.ask(Command::Camera(input)),
                Self::Show(representation) => show_as(ui, representation),
                Self::PickMiddle => ui.ask(Command::PickMiddle),
                Self::CopyLink => ui.ask(Command::CopyLink),
                Self::SavePicture => ui.ask(Command::SavePicture),
                Self::SavePoints(format) => ui.ask(Command::Export(Format::Points(format))),
                Self::SaveMesh(format) => ui.ask(Command::Export(Format::Mesh(format))),
                Self::OpenFile => {
                    let document = web_sys::window().and_then(|window| window.document());
                    let field = document.and_then(|document| document.get_element_by_id(FILE_FIELD));
                    if let Some(field) = field.and_then(|field| field.dyn_into::<HtmlElement>().ok()) {
                        field.click();
                    }
                }
                // Chosen at once, while the browser still knows that a person asked for it.
                Self::SpaceMouse => {
                    let asked = web_sys::Event::new("space-mouse");
                    if let (Some(window), Ok(asked)) = (web_sys::window(), asked) {
                        // Nobody cancels it.
                        let _ = window.dispatch_event(&asked);
                    }
                }
                Self::Language(code) => ui.ask(Command::Language(code)),
                Self::Page(path) => {
                    if let Some(window) = web_sys::window() {
                        // Fails only in a page that is being left anyway.
                        let _ = window.location().set_href(path);
                    }
                }
            }
        }
    }
}

#[cfg(target_arch = "wasm32")]
pub(super) use performing::FILE_FIELD;
