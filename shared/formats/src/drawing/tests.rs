//! Drawings read back: the SVG as XML, the DXF as the pairs of codes and values that it is.

use super::*;
use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};
use semascan_geometry::section::{End, Plane};
use std::collections::BTreeMap;

/// A square of two classes with a square hole, and an open line.
fn section() -> PlaneSection {
    let square = |half: f64| vec![[-half, -half], [half, -half], [half, half], [-half, half]];
    let closed = |half, labels| Outline { places: square(half), labels, ends: None };
    let open = Outline {
        places: vec![[0.05, 0.0], [0.06, 0.01], [0.07, 0.01]],
        labels: vec![2, 2],
        ends: Some([End::Rim, End::Window]),
    };
    PlaneSection {
        plane: Plane::through([0.0; 3], [0.0, 0.0, 1.0]).expect("a plane"),
        outlines: vec![closed(0.04, vec![1, 1, 2, 1]), closed(0.01, vec![1; 4]), open],
        rings: vec![square(0.04), square(0.01)],
    }
}

fn taxonomy() -> Taxonomy {
    Taxonomy::from_names(&["gear & shaft <main>", "gear & shaft #main>", "unused"], &[])
}

fn notes() -> Vec<String> {
    vec!["z = \u{2212}12.00 mm".to_owned(), "two \"quotes\" and a \u{0} and Ä".to_owned()]
}

/// Elements of an XML text: name, attributes, text in it.
fn elements(xml: &str) -> Vec<(String, BTreeMap<String, String>, String)> {
    let mut reader = Reader::from_str(xml);
    let mut found: Vec<(String, BTreeMap<String, String>, String)> = Vec::new();
    let mut open: Vec<usize> = Vec::new();
    let of = |start: &BytesStart<'_>| {
        let attributes = start.attributes().map(|attribute| {
            let attribute = attribute.expect("an attribute");
            (attribute.key.as_ref().to_owned(), attribute.value.into_owned())
        });
        (start.name().as_ref().to_owned(), attributes.collect(), String::new())
    };
    loop {
        match reader.read_event().expect("well-formed") {
            Event::Start(start) => {
                found.push(of(&start));
                open.push(found.len() - 1);
            }
            Event::Empty(start) => found.push(of(&start)),
            Event::End(_) => drop(open.pop()),
            Event::Text(text) => {
                if let Some(element) = open.last() {
                    found[*element].2.push_str(&text);
                }
            }
            Event::GeneralRef(name) => {
                if let Some(element) = open.last() {
                    found[*element].2.push_str(&format!("&{};", &*name));
                }
            }
            Event::Eof => break,
            _ => {}
        }
    }
    assert!(open.is_empty());
    found
}

#[test]
fn an_svg_is_true_to_scale_and_says_what_it_shows() {
    let (section, taxonomy, notes) = (section(), taxonomy(), notes());
    let svg = svg::write(&Drawing { section: &section, taxonomy: &taxonomy, part: "A & B", notes: &notes });
    let elements = elements(&svg);
    let first = |name: &str| elements.iter().find(|(n, ..)| n == name).expect("an element");
    assert_eq!(first("title").2, "Section of A &amp; B");
    assert!(first("desc").2.contains("z = \u{2212}12.00 mm") && !svg.contains('\u{0}'));
    let page = &first("svg").1;
    let number = |text: &str| text.trim_end_matches("mm").parse::<f64>().expect("a number");
    assert_eq!(
        page["viewBox"],
        format!("0 0 {} {}", page["width"].trim_end_matches("mm"), page["height"].trim_end_matches("mm"))
    );
    assert!(number(&page["width"]) > 110.0, "80 mm and the open line beside it");

    let groups: Vec<_> = elements.iter().filter(|(_, a, _)| a.get("class").is_some_and(|c| c == "component")).collect();
    assert_eq!(groups.iter().map(|(_, a, _)| a["data-class"].as_str()).collect::<Vec<_>>(), ["1", "2"]);
    assert_eq!(groups[0].1["data-name"], "gear &amp; shaft &lt;main&gt;");
    let [r, g, b] = taxonomy.components[2].color;
    assert_eq!(groups[1].1["stroke"], format!("#{r:02x}{g:02x}{b:02x}"));

    let filled = elements.iter().find(|(_, a, _)| a.get("id").is_some_and(|id| id == "enclosed")).expect("a fill");
    assert_eq!(filled.1["fill-rule"], "evenodd");
    let rings: Vec<Vec<[f64; 2]>> = filled.1["d"].split_terminator('Z').map(places).collect();
    assert_eq!(rings.iter().map(Vec::len).collect::<Vec<_>>(), [4, 4]);
    let side = (rings[0][1][0] - rings[0][0][0]).hypot(rings[0][1][1] - rings[0][0][1]);
    assert!((side - 80.0).abs() < 2e-3, "{side} mm");
    assert!(rings[0][0][1] > rings[0][2][1], "up is up");

    let bar = elements.iter().find(|(_, a, _)| a.get("id").is_some_and(|id| id == "scale-bar")).expect("a bar");
    assert!(bar.1["d"].contains("h20v") && elements.iter().any(|(_, _, text)| text == "20 mm"), "{}", bar.1["d"]);
    let rims = elements.iter().filter(|(n, a, _)| n == "rect" && a["width"] == "0.8").count();
    assert_eq!(rims, 1, "the window's end is no open end");
}

/// The places of a path of straight lines.
fn places(path: &str) -> Vec<[f64; 2]> {
    let pair = |text: &str| -> Vec<f64> { text.split(' ').map(|c| c.parse().expect("a number")).collect() };
    path.split(['M', 'L']).filter(|t| !t.is_empty()).map(|t| <[f64; 2]>::try_from(pair(t)).expect("a pair")).collect()
}

/// The pairs of a DXF.
fn pairs(dxf: &str) -> Vec<(u16, String)> {
    let lines: Vec<&str> = dxf.split_terminator("\r\n").collect();
    assert_eq!(lines.len() % 2, 0);
    lines.chunks(2).map(|pair| (pair[0].trim().parse().expect("a code"), pair[1].to_owned())).collect()
}

#[test]
fn a_dxf_has_a_layer_for_each_component_and_polylines_in_millimetres() {
    let (section, taxonomy, notes) = (section(), taxonomy(), notes());
    let dxf = dxf::write(&Drawing { section: &section, taxonomy: &taxonomy, part: "Motor Ä", notes: &notes });
    assert!(dxf.is_ascii() && dxf.contains("AC1009"));
    let pairs = pairs(&dxf);
    assert_eq!(pairs.last(), Some(&(0, "EOF".to_owned())));
    let count = |code: u16, value: &str| pairs.iter().filter(|(c, v)| *c == code && v == value).count();
    assert_eq!((count(0, "SECTION"), count(0, "ENDSEC"), count(0, "TABLE"), count(0, "ENDTAB")), (3, 3, 2, 2));
    // Names that differ in letters that layers cannot have.
    let named: Vec<&str> =
        pairs.windows(2).filter(|w| w[0] == (0, "LAYER".into()) && w[1].0 == 2).map(|w| w[1].1.as_str()).collect();
    assert_eq!(named, ["GEAR___SHAFT__MAIN_", "GEAR___SHAFT__MAIN__2", "0", "NOTES", "OPEN_ENDS"]);
    assert_eq!(count(70, "5"), 1, "as many layers as the table says");
    // The outer square is cut where its class changes; the inner one is closed.
    assert_eq!((count(0, "POLYLINE"), count(0, "SEQEND"), count(0, "POINT")), (4, 4, 1));
    let entities = pairs.split(|(code, _)| *code == 0).collect::<Vec<_>>();
    let closed = entities.iter().filter(|e| e.contains(&(66, "1".into())) && e.contains(&(70, "1".into()))).count();
    assert_eq!(closed, 1);
    assert_eq!(count(0, "VERTEX"), 4 + 2 + 4 + 3);
    let reach = pairs
        .iter()
        .filter(|(code, _)| *code == 10)
        .map(|(_, x)| x.parse::<f64>().expect("a number"))
        .fold(0.0, f64::max);
    assert_eq!(reach, 70.0);
}

#[test]
fn nothing_makes_an_empty_drawing() {
    let section = PlaneSection { outlines: Vec::new(), rings: Vec::new(), ..section() };
    let (taxonomy, notes) = (taxonomy(), Vec::new());
    let drawing = Drawing { section: &section, taxonomy: &taxonomy, part: "", notes: &notes };
    assert!(
        elements(&svg::write(&drawing))
            .iter()
            .all(|(name, ..)| name != "g" || !svg::write(&drawing).contains("component"))
    );
    assert!(pairs(&dxf::write(&drawing)).iter().all(|(_, value)| value != "POLYLINE"));
}
