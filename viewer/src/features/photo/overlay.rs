//! What is seen of the photographs, over the 3D view: how many colour the mesh, or why none does.

#![allow(unreachable_pub)] // The component macro makes a public structure of the properties.

use super::controller::PhotoController;
use super::{Photo, Standing};
use crate::display::ColorMode;
use crate::features::view::{Controller, FeatureView, Host};
use crate::ui::Ui;
use crate::words::t;
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
                <figcaption>{t!("color_mode.photo")}</figcaption>
                <p aria-live="polite">{move || sentence(standing.get())}</p>
                <Show when=is_there>
                    <p class="scale-unknown"><span class="scale-dot is-hatched"></span><span>{t!("photo.unseen")}</span></p>
                </Show>
            </figure>
        </Show>
    }
}

/// What is so, or what to do.
fn sentence(standing: Standing) -> String {
    match standing {
        Standing::NoPhotographs => t!("photo.none").into(),
        Standing::Points => t!("photo.points").into(),
        Standing::NoMesh => t!("photo.no_mesh").into(),
        Standing::Loading(count) => t!("photo.loading", count),
        Standing::Ready(0) => t!("photo.nothing").into(),
        Standing::Ready(count) => t!("photo.ready", count),
    }
}
