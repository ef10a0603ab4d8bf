//! The section as it is drawn and measured: outlines in the colours of their components, within the box, with their figures.

use crate::display::{ColorScheme, Palette};
use crate::render::SectionPicture;
use crate::render::segment::Segment;
use glam::{DVec3, Vec3};
use semascan_geometry::section::{Plane, PlaneSection, Window, area, fill};
use semascan_model::SemanticMesh;
use std::sync::Arc;

/// Widths of an outline and of what sets it off, CSS pixels.
const LINE: f32 = 2.5;
const HALO: f32 = 5.0;
/// Side of the square at an open end, CSS pixels.
const RIM: f32 = 8.0;
/// Length of the line that makes such a square, metres: none that shows.
const DOT: f64 = 1e-6;
/// What has no component.
const UNKNOWN: [u8; 3] = [140, 147, 156];

/// What a section is drawn with.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Style {
    /// Colours of the components.
    pub palette: Palette,
    /// Whether the page is light or dark.
    pub color_scheme: ColorScheme,
}

/// A section, its figures, and its picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Shown {
    /// The section, within the box if there is one.
    pub section: PlaneSection,
    /// Length of all outlines, metres.
    pub length: f64,
    /// What the closed outlines enclose, square metres.
    pub area: f64,
    /// How many outlines are closed; those that the box ends are not.
    pub closed: usize,
    /// How many run into a rim of the surface.
    pub open: usize,
    /// Voxel edge of the model, metres.
    pub voxel: f64,
    /// The picture.
    pub picture: Arc<SectionPicture>,
}

impl Shown {
    /// The section of those components of `mesh` that `shows` accepts.
    ///
    /// * `limits`: corners of the box that it is shown in, metres, table frame.
    /// * `voxel`: voxel edge of the model, metres.
    pub fn of(
        mesh: &SemanticMesh,
        plane: Plane,
        limits: Option<[[f64; 3]; 2]>,
        voxel: f64,
        style: &Style,
        shows: impl Fn(u16) -> bool,
    ) -> Self {
        let whole = PlaneSection::of(mesh, plane, shows);
        let section = limits.map_or_else(|| whole.clone(), |limits| whole.within(&Window::of_box(&plane, limits)));
        let quads = fill(&section.rings);
        let lift = |place| DVec3::from(plane.lift(place)).as_vec3();
        // The hatching runs from the upper left to the lower right.
        let across = |place: [f64; 2]| ((place[0] + place[1]) * std::f64::consts::FRAC_1_SQRT_2) as f32;
        let cap = quads.iter().map(|quad| quad.map(|place| (lift(place), across(place)))).collect();
        Self {
            length: section.length(),
            area: area(&quads),
            closed: section.outlines.iter().filter(|outline| outline.is_closed()).count(),
            open: section.open(),
            voxel,
            picture: Arc::new(SectionPicture { lines: lines(&section, style, lift), cap }),
            section,
        }
    }
}

/// The outlines, and a square at each open end.
fn lines(section: &PlaneSection, style: &Style, lift: impl Fn([f64; 2]) -> Vec3) -> Vec<Segment> {
    let (halo, rim) = match style.color_scheme {
        ColorScheme::Dark => ([0x10, 0x14, 0x18, 0xd0], [0xff, 0xc0, 0x45, 0xff]),
        ColorScheme::Light => ([0xff, 0xff, 0xff, 0xe0], [0xb0, 0x4a, 0x00, 0xff]),
    };
    let color = |label: u16| {
        let [r, g, b] =
            style.palette.components.get(usize::from(label)).copied().filter(|_| label > 0).unwrap_or(UNKNOWN);
        [r, g, b, 0xff]
    };
    let segments = || section.outlines.iter().flat_map(|outline| outline.segments());
    let segment = |[from, to]: [[f64; 2]; 2], color, width| Segment { from: lift(from), to: lift(to), color, width };
    let halos = segments().map(|(ends, _)| segment(ends, halo, HALO));
    let colored = segments().map(|(ends, label)| segment(ends, color(label), LINE));
    let rims = section.outlines.iter().flat_map(|outline| outline.rims()).flat_map(|[x, y]| {
        let dot = [[x - DOT, y], [x + DOT, y]];
        [segment(dot, halo, RIM + 3.0), segment(dot, rim, RIM)]
    });
    halos.chain(colored).chain(rims).collect()
}
