use super::super::Style;
use super::*;
use SectionEvent::{
    Aimed, Back, Clicked, Deepen, Extent, Flip, Follow, Limit, Offset, Read, Remove, Reset, Show, ShowLimits, Toward,
    Turn,
};
use semascan_model::{SemanticMesh, SemanticPoint};

const EXTENT: [[f64; 3]; 2] = [[-0.05, -0.05, 0.0], [0.05, 0.05, 0.1]];

#[derive(Default)]
struct Viewer {
    section: Section,
    display: Display,
}

impl Viewer {
    fn after(events: impl IntoIterator<Item = SectionEvent>) -> Self {
        let mut viewer = Self::default();
        events.into_iter().for_each(|event| viewer.reduce(event));
        viewer
    }

    fn reduce(&mut self, event: SectionEvent) {
        self.section.reduce(&event, &mut self.display);
    }

    /// Cuts `mesh` as the controller does.
    fn cut(&mut self, mesh: &SemanticMesh) {
        let plane = self.section.plane().expect("a plane");
        let shown = Shown::of(mesh, plane, self.section.limits, 1e-3, &Style::default(), |_| true);
        self.reduce(SectionEvent::Cut(Some(Arc::new(shown))));
    }
}

/// A square pipe along z: 80 mm outside, 60 mm inside.
fn pipe() -> SemanticMesh {
    let mut mesh = SemanticMesh::default();
    for (half, label) in [(0.04_f32, 1), (0.03, 2)] {
        let first = mesh.len() as u32;
        for [x, y] in [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]] {
            for z in [0.0, 0.1] {
                mesh.push(SemanticPoint { position: [x * half, y * half, z], label, ..SemanticPoint::UNKNOWN }, false);
            }
        }
        for k in 0..4 {
            let [a, b] = [first + 2 * k, first + 2 * ((k + 1) % 4)];
            for [i, j, k] in [[a, b, a + 1], [b, b + 1, a + 1]] {
                mesh.triangles.push(if label == 1 { [i, j, k] } else { [i, k, j] });
            }
        }
    }
    mesh
}

/// A look straight down at a place, from half a metre above the table; a pixel there is half a millimetre.
fn down(x: f32, y: f32) -> Ray {
    Ray { eye: Vec3::new(x, y, 0.5), toward: Vec3::NEG_Z, pixel: 1e-3 }
}

#[test]
fn the_plane_begins_in_the_middle_and_cuts_away_what_is_toward_the_camera() {
    let mut v = Viewer::after([Extent(Some(EXTENT)), Show(true), Toward([0.3, -0.3, 0.4])]);
    assert_eq!((v.section.offset, v.section.is_flipped), (0.05, false));
    assert!(v.display.cut.keeps([0.0, 0.0, 0.04]) && !v.display.cut.keeps([0.0, 0.0, 0.06]));
    v.reduce(Turn(Direction::Y));
    v.reduce(Toward([0.3, -0.3, 0.4]));
    assert!(v.section.offset.abs() < 1e-12 && v.section.is_flipped);
    assert!(v.display.cut.keeps([0.0, 0.04, 0.0]) && !v.display.cut.keeps([0.0, -0.04, 0.0]));
    v.reduce(Offset(-0.02));
    v.reduce(Deepen(1e-3));
    assert!((v.section.offset + 0.019).abs() < 1e-12, "deeper is away from the camera");
    v.reduce(Offset(f64::NAN));
    v.reduce(Flip);
    assert!((v.section.offset + 0.019).abs() < 1e-12 && v.display.cut.keeps([0.0, -0.04, 0.0]));
    v.reduce(Show(false));
    assert!(v.display.cut.keeps([0.0, 0.04, 0.0]));
    v.reduce(Show(true));
    assert!((v.section.offset + 0.019).abs() < 1e-12, "where it was");
}

#[test]
fn a_plane_through_a_point_counts_from_there() {
    let normal = [0.0, 0.6, 0.8];
    let v = Viewer::after([Turn(Direction::Surface { normal, through: [0.01, 0.02, 0.03] }), Offset(-0.005)]);
    let plane = v.section.plane().expect("a plane");
    assert!((plane.height([0.01, 0.02, 0.03]) - 0.005).abs() < 1e-12);
    assert!(!v.display.cut.keeps([0.01, 0.02, 0.03]));
}

#[test]
fn the_box_and_the_plane_cut_together_and_reset_takes_both_away() {
    let limit = |axis, end, at| Limit { axis, end, at };
    let mut v = Viewer::after([Extent(Some(EXTENT)), ShowLimits(true), limit(0, 1, 0.01), Show(true)]);
    assert!(v.display.cut.keeps([0.0, 0.0, 0.04]) && !v.display.cut.keeps([0.02, 0.0, 0.04]));
    v.reduce(limit(0, 0, 0.03));
    assert_eq!(v.section.limits.map(|[low, high]| (low[0], high[0])), Some((0.03, 0.03)), "the other end gives way");
    v.reduce(limit(0, 0, f64::INFINITY));
    v.reduce(limit(7, 0, 0.0));
    let mut content = FrameContent::default();
    v.section.draw(&v.display, &mut content);
    assert_eq!(content.marks.len(), 16, "the edges of plane and box");
    v.reduce(Reset);
    assert_eq!((v.section.extent, v.display.cut), (Some(EXTENT), Cut::default()));
    assert!(!v.section.is_active());
    v.reduce(Show(true));
    v.section.begin(&mut v.display);
    assert!(v.section == Section::default() && v.display.cut == Cut::default());
}

#[test]
fn a_pipe_is_measured_and_its_walls_are_read() {
    let mut v = Viewer::after([Extent(Some(EXTENT)), Show(true), Toward([0.0, 0.0, 1.0])]);
    v.cut(&pipe());
    let shown = v.section.shown.clone().expect("a section");
    assert!((shown.length - 0.56).abs() < 1e-6 && (shown.area - (0.08 * 0.08 - 0.06 * 0.06)).abs() < 1e-9);
    assert_eq!((shown.closed, shown.open), (2, 0));
    v.reduce(Clicked(down(0.035, 0.0)));
    assert!(v.section.readings.is_empty(), "clicks are not for reading yet");
    v.reduce(Read(true));
    v.reduce(Clicked(down(0.036, 0.001)));
    let wall = v.section.readings[0];
    assert!((wall.estimate().value - 0.01).abs() < 1e-7 && wall.kind == ReadingKind::Thickness, "{wall:?}");
    assert_eq!(wall.ends.map(|end| end.label), [1, 2]);
    // Within a few pixels of an outline it is the outline that is meant.
    v.reduce(Clicked(down(0.039, 0.0)));
    assert!(v.section.first.is_some() && v.section.readings.len() == 1);
    v.reduce(Clicked(down(0.039, 0.0)));
    assert_eq!(v.section.readings.len(), 1, "the same place again");
    v.reduce(Aimed(Some(down(-0.041, 0.0))));
    assert!(v.section.aimed().is_some_and(|r| (r.estimate().value - 0.08).abs() < 1e-7));
    v.reduce(Clicked(down(-0.041, 0.0)));
    assert_eq!(
        v.section.readings.iter().map(|r| (r.number, r.kind)).collect::<Vec<_>>(),
        [(1, ReadingKind::Thickness), (2, ReadingKind::Distance)]
    );
    let mut content = FrameContent::default();
    v.section.draw(&v.display, &mut content);
    assert!(content.section.is_some_and(|s| s.cap.len() >= 4 && s.lines.len() == 32));
    assert_eq!(content.marks.len(), 4 + 2 * 2, "the plane's edge and two readings");
    v.reduce(Remove(1));
    assert_eq!(v.section.readings.len(), 1);
}

#[test]
fn from_behind_and_beside_nothing_is_read_and_another_section_has_other_readings() {
    let mut v = Viewer::after([Extent(Some(EXTENT)), Show(true), Toward([0.0, 0.0, 1.0]), Read(true)]);
    v.cut(&pipe());
    v.reduce(Clicked(Ray { eye: Vec3::new(0.035, 0.0, -0.5), toward: Vec3::Z, pixel: 1e-3 }));
    assert!(v.section.missed && v.section.readings.is_empty());
    v.reduce(Clicked(down(0.2, 0.0)));
    let gap = v.section.readings.len();
    assert!(v.section.missed && gap == 0, "no line lies across from out there");
    v.reduce(Clicked(down(0.035, 0.0)));
    assert_eq!(v.section.readings.len(), 1);
    v.cut(&pipe());
    assert_eq!(v.section.readings.len(), 1, "the same section");
    v.reduce(Offset(0.02));
    v.cut(&pipe());
    assert!(v.section.readings.is_empty());
    v.reduce(Clicked(down(0.039, 0.0)));
    v.reduce(Back);
    assert!(v.section.first.is_none() && v.section.is_reading);
    v.reduce(Back);
    assert!(!v.section.reads());
    v.reduce(Read(true));
    v.reduce(Show(false));
    assert!(!v.section.is_reading);
}

#[test]
fn the_box_ends_outlines_and_areas() {
    let mut v = Viewer::after([Extent(Some(EXTENT)), ShowLimits(true), Limit { axis: 0, end: 0, at: 0.0 }, Show(true)]);
    v.cut(&pipe());
    let shown = v.section.shown.clone().expect("a section");
    assert!((shown.length - 0.28).abs() < 1e-6 && (shown.area - 0.5 * (0.08 * 0.08 - 0.06 * 0.06)).abs() < 1e-9);
    assert_eq!((shown.closed, shown.open), (0, 0));
}

#[test]
fn a_link_leads_to_the_same_plane_and_box() {
    for events in [
        vec![Extent(Some(EXTENT)), Show(true), Deepen(0.01)],
        vec![Extent(Some(EXTENT)), Turn(Direction::X), Offset(0.012), Flip, ShowLimits(true)],
        vec![Turn(Direction::Camera { normal: [0.6, 0.0, 0.8], through: [0.01, 0.02, 0.03] }), Deepen(0.004)],
        vec![ShowLimits(true)],
    ] {
        let sent = Viewer::after(events).section;
        let followed = Viewer::after([Follow { plane: sent.plane(), limits: sent.limits }]);
        assert_eq!((followed.section.is_on, followed.section.limits), (sent.is_on, sent.limits));
        for (there, here) in sent.plane().iter().zip(&followed.section.plane()) {
            let same =
                [[0.0; 3], [0.1, 0.2, 0.3]].iter().all(|at| (there.height(*at) - here.height(*at)).abs() < 1e-12);
            assert!(same, "{there:?} and {here:?}");
        }
        assert_eq!(followed.display.cut.is_on(), sent.is_active());
    }
    let along = Viewer::after([Turn(Direction::Y), Flip]).section;
    let followed = Viewer::after([Follow { plane: along.plane(), limits: None }]).section;
    assert_eq!((followed.direction, followed.is_flipped), (Direction::Y, true), "it can be moved along its axis");
}
