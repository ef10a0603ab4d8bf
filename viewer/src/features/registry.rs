//! The tools' states and events, one of each a tool, made of the table in [`super`].

use super::feature::Feature;
use crate::display::Display;
use crate::render::FrameContent;

macro_rules! define_registry {
    ($($module:ident: $State:ident),+ $(,)?) => {
        /// The states of the tools.
        #[derive(Clone, Debug, Default, PartialEq)]
        pub struct Features {
            $(
                #[doc = concat!("See [`", stringify!($module), "`](super::", stringify!($module), ").")]
                pub $module: super::$module::$State,
            )+
        }

        /// What happens to one of the tools.
        #[derive(Clone, Debug, PartialEq)]
        pub enum FeatureEvent {
            $(
                #[doc = concat!("See [`", stringify!($module), "`](super::", stringify!($module), ").")]
                $State(<super::$module::$State as Feature>::Event),
            )+
        }

        $(
            impl From<<super::$module::$State as Feature>::Event> for FeatureEvent {
                fn from(event: <super::$module::$State as Feature>::Event) -> Self {
                    Self::$State(event)
                }
            }
        )+

        impl Features {
            /// Hands an event to the tool that it is for.
            pub fn reduce(&mut self, event: &FeatureEvent, display: &mut Display) {
                match event {
                    $(FeatureEvent::$State(event) => self.$module.reduce(event, display),)+
                }
            }

            /// Another model begins, for every tool.
            pub fn begin(&mut self, display: &mut Display) {
                $(self.$module.begin(display);)+
            }

            /// Another inspection is shown, for every tool.
            pub fn leave(&mut self) {
                $(self.$module.leave();)+
            }

            /// Puts what every tool shows into the picture.
            pub fn draw(&self, display: &Display, content: &mut FrameContent) {
                $(self.$module.draw(display, content);)+
            }
        }
    };
}

for_each_feature!(define_registry);
