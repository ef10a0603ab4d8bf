//! What is seen of the photographs, over the 3D view: how many colour the mesh, or why none does.

#![allow(unreachable_pub)] // The component macro makes a public structure of the properties.

use super::controller::PhotoController;
use super::{Photo, Standing};
use crate::display::ColorMode;
use crate::features::view::{Controller, FeatureView, Host};
use crate::ui::Ui;
use leptos::prelude::*;
use std::rc::Rc;

impl FeatureView for Photo {
    fn overlay(ui: Ui) -> AnyView {
        view! { <PhotoKey ui/> }.into_any()
    }

    fn controller(host: &Host) -> Option<Rc<dyn Controller>> {
        Some(PhotoController::new(host))
    }
}

#[component]
fn PhotoKey(ui: Ui) -> impl IntoView {
    let shown = ui.part(|s| s.display.color_mode == ColorMode::Photo && s.has_model());
    let standing = ui.part(Standing::of);
    let views = ui.part(|s| {
        let views = s.features.photo.photographs.iter().map(|photograph| photograph.view.to_string());
        views.collect::<Vec<_>>().join(" ")
    });
    // Of the first photograph, for whoever compares the picture with it.
    let camera = ui.part(|s| {
        let first = s.features.photo.photographs.first()?.layer.camera;
        Some(format!("{} {} {} {}", first.focal.x, first.focal.y, first.center.x, first.center.y))
    });
    let is_there = move || matches!(standing.get(), Standing::Loading(_) | Standing::Ready(_));
    view! {
        <Show when=move || shown.get()>
            <figure
                class="scale is-raised" data-testid="photo-key" data-state=move || standing.get().key()
                data-views=move || views.get() data-camera=move || camera.get()
            >
                <figcaption>"Photographs"</figcaption>
                <p aria-live="polite">{move || sentence(standing.get())}</p>
                <Show when=is_there>
                    <p class="scale-unknown"><span class="scale-dot is-hatched"></span><span>{UNSEEN}</span></p>
                </Show>
            </figure>
        </Show>
    }
}

/// What the hatched surface is.
const UNSEEN: &str = "No photograph shows it";

/// What is so, or what to do.
fn sentence(standing: Standing) -> String {
    match standing {
        Standing::NoPhotographs => "No view has a picture and a known pose.".into(),
        Standing::Points => "They lie on the mesh: show it under Surface.".into(),
        Standing::NoMesh => "The mesh is being made.".into(),
        Standing::Loading(count) => format!("{count} on the mesh, more are loading."),
        Standing::Ready(1) => "1 on the mesh, chosen for this view.".into(),
        Standing::Ready(count) => format!("{count} on the mesh, chosen for this view."),
    }
}
