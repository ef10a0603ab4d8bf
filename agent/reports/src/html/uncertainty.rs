//! Where uncertainties come from, after the GUM, and how figures are to be read.

use maud::{Markup, html};
use semascan_model::record::{Convention, InspectionRecord};

pub(super) fn uncertainty(record: &InspectionRecord) -> Markup {
    let conventions = record.findings.as_ref().map_or(&[][..], |found| &found.conventions);
    html! {
        section #uncertainty {
            h2 { "Uncertainty" }
            p {
                "A figure is given as its value and its expanded uncertainty, coverage factor k = 2: the interval holds the true "
                "value with about 95 % (GUM: JCGM 100:2008). The standard uncertainty of an area combines, as the root of the sum of "
                "squares, where the rim lies between two voxels, rims to other components and to what was not seen, the convention "
                "by which areas are measured on a mesh, the uncertainty of the labels along the rim, and the covariance of the poses "
                "of the views that saw it. Errors that are alike along a rim count by its length, those of the grid by the root of "
                "it. Lengths and widths are uncertain by the same rims at their two ends."
            }
            p {
                "Where one part is not known, as without a covariance of the poses, the whole is not known, and the figure stands "
                "alone: that is no statement of accuracy. Confidence is the share of the evidence that the named class has, sigma "
                "the standard uncertainty of the label from 0 to 1. A criterion is decided by the whole interval of its figure "
                "(ISO 14253-1)."
            }
            (definitions(conventions))
        }
    }
}

/// Definitions of figures, as the record has them.
pub(super) fn definitions(conventions: &[Convention]) -> Markup {
    html! {
        @if !conventions.is_empty() {
            dl.definitions {
                @for convention in conventions { dt { (convention.name) } dd { (convention.text) } }
            }
        }
    }
}
