//! What made the result: versions, networks with their checksums, seeds and settings, criteria, files.

use maud::{Markup, html};
use semascan_model::record::{InspectionRecord, NetworksRecord};

pub(super) fn provenance(record: &InspectionRecord) -> Markup {
    let row = |name: &str, value: Markup| html! { tr { th { (name) } td { (value) } } };
    html! {
        section #provenance {
            h2 { "Provenance" }
            table.figures.wide {
                tbody {
                    (row("Inspection", html! { code { (record.id) } }))
                    @if let Some(files) = &record.files {
                        (row("Generation", html! { code { (files.generation) } ", which every file of the set carries" }))
                        (row("Files", html! { (files.names.join(", ")) }))
                    }
                    (row("Record", html! { "inspection.json, schema version " (record.schema_version) ": it is the whole, and what counts" }))
                    (row("Software", html! { (record.software.name) " " (record.software.version) }))
                    (row("Source", html! { code { (record.source) } }))
                    @if let Some(verdict) = &record.verdict {
                        (row("Criteria", html! {
                            (verdict.criteria.name) ", revision " (verdict.criteria.revision) ", SHA-256 "
                            code { (verdict.criteria.sha256) }
                        }))
                    }
                    @for setting in &record.settings { (row(&setting.name, html! { (setting.value) })) }
                }
            }
            @if let Some(networks) = &record.networks { (of_networks(networks)) }
        }
    }
}

fn of_networks(record: &NetworksRecord) -> Markup {
    let NetworksRecord { network, uncertain } = record;
    html! {
        h3 { "Networks" }
        table {
            thead { tr { th { "Network" } th { "Says" } th { "Kind" } th { "Calibrated" } th { "Files, SHA-256" } } }
            tbody {
                @for model in &network.models {
                    tr {
                        td { (model.name) " " (model.version) }
                        td { (model.task.name()) }
                        td { (model.architecture) ", " (model.backbone) }
                        td { @if model.calibrated { "yes" } @else { "no" } }
                        td.files {
                            @for file in &model.networks {
                                (file.file) " " code { (file.sha256) } br;
                                @for weights in &file.weights { (weights.file) " " code { (weights.sha256) } br; }
                            }
                        }
                    }
                }
            }
        }
        p.note {
            "Run by " (network.engine.name) " " (network.engine.version) " on " (network.engine.provider.name()) ". "
            (network.augmentations.len()) " augmentations, seed " (network.seed) "; sigma above " (network.threshold)
            " (defects: " (network.defect_threshold) ") is uncertain, and such pixels "
            @match uncertain {
                semascan_model::record::Uncertain::Geometry => "count for the shape and for no class.",
                semascan_model::record::Uncertain::Drop => "are dropped.",
            }
        }
    }
}
