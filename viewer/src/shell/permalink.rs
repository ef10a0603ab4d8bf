//! Links that lead others to what one sees: inspection, camera, colours, finding.
//!
//! The inspection stands in the query of the address, as the page has asked for past ones all along; the rest in its
//! fragment, which browsers keep to themselves: `#eye=x,y,z&target=x,y,z&color=defect&finding=ID`, places in
//! millimetres of the table frame.

use crate::display::ColorMode;
use glam::Vec3;
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
}

impl Permalink {
    /// Reads the fragment of an address; what is not understood is left aside and said in `complaints`.
    ///
    /// * `parameter`: the decoded value of a parameter of the fragment.
    pub fn read(parameter: impl Fn(&str) -> Option<String>, complaints: &mut Vec<String>) -> Self {
        let mut understood = |name: &str, expected: &str, is_right: bool| {
            if !is_right {
                complaints.push(format!("The link's {name} is not understood; it is {expected}."));
            }
        };
        let mut place = |name: &str| {
            let text = parameter(name)?;
            let place = read_place(&text);
            understood(name, "three numbers in millimetres", place.is_some());
            place
        };
        let camera = place("eye").zip(place("target"));
        let color_mode = parameter("color").and_then(|key| {
            let mode = ColorMode::from_key(&key);
            understood("color", "one of the colour modes", mode.is_some());
            mode
        });
        let finding = parameter("finding").and_then(|text| {
            let finding = Uuid::parse_str(&text).ok().map(|uuid| FindingId::from_bytes(uuid.into_bytes()));
            understood("finding", "the identifier of a finding", finding.is_some());
            finding
        });
        Self { camera, color_mode, finding }
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
    }

    proptest! {
        #[test]
        fn whoever_follows_a_link_sees_the_same(
            eye in prop::array::uniform3(-5.0_f32..5.0),
            target in prop::array::uniform3(-5.0_f32..5.0),
            mode in prop::sample::select(ColorMode::ALL.to_vec()),
            finding in prop::option::of(any::<[u8; 16]>()),
        ) {
            let link = Permalink {
                camera: Some((Vec3::from(eye), Vec3::from(target))),
                color_mode: Some(mode),
                finding: finding.map(FindingId::from_bytes),
            };
            let address = link.address("https://cell/", None);
            let (back, complaints) = read(address.split_once('#').map_or("", |(_, fragment)| fragment));
            prop_assert!(complaints.is_empty());
            let ((a, b), (c, d)) = (link.camera.unwrap_or_default(), back.camera.unwrap_or_default());
            prop_assert!((a - c).length() < 1e-4 && (b - d).length() < 1e-4);
            prop_assert_eq!(Permalink { camera: link.camera, ..back }, link);
        }

        #[test]
        fn no_fragment_is_too_strange(fragment in "\\PC*") {
            read(&fragment);
        }
    }
}
