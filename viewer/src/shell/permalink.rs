//! Links that lead others to what one sees: inspection, camera, colours, finding, what is cut away.
//!
//! The inspection stands in the query of the address, as the page has asked for past ones all along; the rest in its
//! fragment, which browsers keep to themselves: `#eye=x,y,z&target=x,y,z&color=defect&finding=ID&cut=x,y,z,d&box=x,y,z,x,y,z`,
//! places in millimetres of the table frame. A cut is the unit normal of its plane and its distance from the origin along that:
//! what lies beyond is cut away. A box is its lowest and highest corner.

use crate::display::ColorMode;
use crate::words::t;
use glam::{DVec3, Vec3};
use semascan_geometry::section::Plane;
use semascan_model::finding::FindingId;
use std::fmt::Write;
use uuid::Uuid;

/// What a link leads to, as far as it says so.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Permalink {
    /// Where the camera is and what it looks at, metres, table frame.
    pub camera: Option<(Vec3, Vec3)>,
    /// What the colours mean.
    pub color_mode: Option<ColorMode>,
    /// The chosen finding.
    pub finding: Option<FindingId>,
    /// What lies beyond it is cut away.
    pub plane: Option<Plane>,
    /// What lies outside of this box is: lowest and highest corner, metres, table frame.
    pub limits: Option<[[f64; 3]; 2]>,
}

impl Permalink {
    /// Reads the fragment of an address; what is not understood is left aside and said in `complaints`.
    ///
    /// * `parameter`: the decoded value of a parameter of the fragment.
    pub fn read(parameter: impl Fn(&str) -> Option<String>, complaints: &mut Vec<String>) -> Self {
        let mut understood = |name: &str, expected: &str, is_right: bool| {
            if !is_right {
                complaints.push(t!("permalink.complaint", name, expected));
            }
        };
        let mut place = |name: &str| {
            let text = parameter(name)?;
            let place = read_place(&text);
            understood(name, t!("permalink.place"), place.is_some());
            place
        };
        let camera = place("eye").zip(place("target"));
        let color_mode = parameter("color").and_then(|key| {
            let mode = ColorMode::from_key(&key);
            understood("color", t!("permalink.color"), mode.is_some());
            mode
        });
        let finding = parameter("finding").and_then(|text| {
            let finding = Uuid::parse_str(&text).ok().map(|uuid| FindingId::from_bytes(uuid.into_bytes()));
            understood("finding", t!("permalink.finding"), finding.is_some());
            finding
        });
        let plane = parameter("cut").and_then(|text| {
            let plane = read_plane(&text);
            understood("cut", t!("permalink.plane"), plane.is_some());
            plane
        });
        let limits = parameter("box").and_then(|text| {
            let limits = read_box(&text);
            understood("box", t!("permalink.box"), limits.is_some());
            limits
        });
        Self { camera, color_mode, finding, plane, limits }
    }

    /// The address that leads there.
    ///
    /// * `page`: the page's address without query and fragment.
    /// * `inspection`: the inspection, if the agent keeps it.
    pub fn address(&self, page: &str, inspection: Option<&str>) -> String {
        let mut address = page.to_owned();
        if let Some(inspection) = inspection {
            address.push_str("?inspection=");
            address.push_str(inspection);
        }
        let mut parameters = Vec::new();
        if let Some((eye, target)) = self.camera {
            parameters.push(format!("eye={}&target={}", place(eye), place(target)));
        }
        parameters.extend(self.color_mode.map(|mode| format!("color={}", mode.key())));
        parameters.extend(self.finding.map(|finding| format!("finding={finding}")));
        parameters.extend(self.plane.map(|plane| {
            let [x, y, z] = plane.normal();
            format!("cut={x:.5},{y:.5},{z:.5},{:.2}", plane.offset() * 1e3)
        }));
        parameters.extend(self.limits.map(|limits| {
            let [low, high] = limits.map(|corner| corner.map(|c| format!("{:.2}", c * 1e3)).join(","));
            format!("box={low},{high}")
        }));
        if !parameters.is_empty() {
            // A string takes whatever is written to it.
            let _ = write!(address, "#{}", parameters.join("&"));
        }
        address
    }
}

fn place(metres: Vec3) -> String {
    let [x, y, z] = (metres * 1e3).to_array();
    format!("{x:.1},{y:.1},{z:.1}")
}

fn read_place(text: &str) -> Option<Vec3> {
    let numbers: Vec<f32> = text.split(',').map(str::parse).collect::<Result<_, _>>().ok()?;
    let place = Vec3::from_array(numbers.try_into().ok()?) * 1e-3;
    place.is_finite().then_some(place)
}

fn read_plane(text: &str) -> Option<Plane> {
    let [x, y, z, offset] = read_numbers(text)?;
    let normal = DVec3::new(x, y, z).try_normalize()?;
    Plane::through((normal * offset * 1e-3).to_array(), normal.to_array())
}

fn read_box(text: &str) -> Option<[[f64; 3]; 2]> {
    let [a, b, c, d, e, f] = read_numbers(text)?.map(|mm: f64| mm * 1e-3);
    let limits = [[a, b, c], [d, e, f]];
    (0..3).all(|k| limits[0][k] <= limits[1][k]).then_some(limits)
}

/// So many finite numbers.
fn read_numbers<const N: usize>(text: &str) -> Option<[f64; N]> {
    let numbers: Vec<f64> = text.split(',').map(str::parse).collect::<Result<_, _>>().ok()?;
    numbers.try_into().ok().filter(|numbers: &[f64; N]| numbers.iter().all(|n| n.is_finite()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn read(fragment: &str) -> (Permalink, Vec<String>) {
        let mut complaints = Vec::new();
        let parameter = |name: &str| {
            let pair = fragment.split('&').filter_map(|pair| pair.split_once('='));
            pair.filter(|(key, _)| *key == name).map(|(_, value)| value.to_owned()).next()
        };
        (Permalink::read(parameter, &mut complaints), complaints)
    }

    #[test]
    fn a_link_names_the_inspection_and_nothing_that_is_not_known() {
        let page = "https://cell.example:8787/";
        assert_eq!(Permalink::default().address(page, None), page);
        let link = Permalink { color_mode: Some(ColorMode::Defect), ..Permalink::default() };
        assert_eq!(link.address(page, Some("018f")), "https://cell.example:8787/?inspection=018f#color=defect");
        assert_eq!(read(""), (Permalink::default(), Vec::new()));
    }

    #[test]
    fn what_is_not_understood_is_said_and_left_aside() {
        let (link, complaints) = read("eye=1,2&target=0,0,0&color=pink&finding=7");
        assert_eq!((link, complaints.len()), (Permalink::default(), 3));
        let (link, complaints) = read("eye=1,2,NaN&target=inf,0,0");
        assert_eq!((link.camera, complaints.len()), (None, 2));
        for wrong in ["cut=0,0,0,5", "cut=0,0,1", "cut=0,0,1,inf", "box=0,0,0,1,1", "box=0,0,2,1,1,1"] {
            let (link, complaints) = read(wrong);
            assert_eq!((link, complaints.len()), (Permalink::default(), 1), "{wrong}");
        }
    }

    proptest! {
        #[test]
        fn whoever_follows_a_link_sees_the_same(
            eye in prop::array::uniform3(-5.0_f32..5.0),
            target in prop::array::uniform3(-5.0_f32..5.0),
            mode in prop::sample::select([ColorMode::ALL.as_slice(), &[ColorMode::Photo]].concat()),
            finding in prop::option::of(any::<[u8; 16]>()),
            normal in prop::array::uniform3(-1.0_f64..1.0),
            low in prop::array::uniform3(-0.3_f64..0.0),
        ) {
            let link = Permalink {
                camera: Some((Vec3::from(eye), Vec3::from(target))),
                color_mode: Some(mode),
                finding: finding.map(FindingId::from_bytes),
                plane: Plane::through(low, normal),
                limits: Some([low, low.map(|c| -c)]),
            };
            let address = link.address("https://cell/", None);
            let (back, complaints) = read(address.split_once('#').map_or("", |(_, fragment)| fragment));
            prop_assert!(complaints.is_empty());
            let ((a, b), (c, d)) = (link.camera.unwrap_or_default(), back.camera.unwrap_or_default());
            prop_assert!((a - c).length() < 1e-4 && (b - d).length() < 1e-4);
            prop_assert_eq!(back.plane.is_some(), link.plane.is_some());
            for (plane, other) in link.plane.iter().zip(&back.plane) {
                prop_assert!([low, [0.1; 3]].iter().all(|at| (plane.height(*at) - other.height(*at)).abs() < 5e-5));
            }
            let corners = back.limits.unwrap_or_default().into_iter().zip(link.limits.unwrap_or_default());
            prop_assert!(corners.flat_map(|(a, b)| a.into_iter().zip(b)).all(|(a, b)| (a - b).abs() < 1e-5));
            prop_assert_eq!((back.color_mode, back.finding), (link.color_mode, link.finding));
        }

        #[test]
        fn no_fragment_is_too_strange(fragment in "\\PC*") {
            read(&fragment);
        }
    }
}
