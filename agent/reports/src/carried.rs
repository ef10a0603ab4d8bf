//! Photographs that an earlier report of the same model holds: a report that is written anew, as after a judgement, needs
//! neither the source nor a capture for them.
//!
//! Nothing of the earlier file is copied as it stands. Numbers are read as numbers, pictures must be JPEG of the size that is
//! said, paths may hold moves, lines and numbers alone.

use crate::photograph::{Photograph, ProjectedOutline};
use crate::{Photographs, findings};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use semascan_model::finding::{FindingId, PixelBox};
use semascan_model::record::InspectionRecord;
use std::collections::BTreeMap;

/// How a photograph begins in a report; `html/findings.rs` writes it so.
const FIGURE: &str = "<figure class=\"picture photograph\" ";

/// The photographs in `html`, an earlier report of `record`; `None` if it is of another generation.
pub fn carried_photographs(html: &str, record: &InspectionRecord) -> Option<Photographs> {
    let generation = &record.files.as_ref()?.generation;
    let head = html.split_once("</head>")?.0;
    let meta = head.split_once("<meta name=\"generation\" content=\"")?.1;
    if meta.split_once('"')?.0 != generation {
        return None;
    }
    let mut of: BTreeMap<FindingId, Vec<Photograph>> = BTreeMap::new();
    for figure in html.split(FIGURE).skip(1) {
        let Some((figure, _)) = figure.split_once("</figure>") else { continue };
        let Some((id, photograph)) = read(figure, record) else { continue };
        of.entry(id).or_default().push(photograph);
    }
    Some(Photographs { of, missing: None })
}

fn read(figure: &str, record: &InspectionRecord) -> Option<(FindingId, Photograph)> {
    let named = attribute(figure, "data-finding")?;
    let id = findings(record).iter().map(|finding| finding.id).find(|id| id.to_string() == named)?;
    let view = attribute(figure, "data-view")?.parse().ok()?;
    let numbers: Vec<u32> = attribute(figure, "data-crop")?.split(' ').map_while(|n| n.parse().ok()).collect();
    let &[left, top, width, height] = numbers.as_slice() else { return None };
    let jpeg = STANDARD.decode(attribute(figure, "src")?.strip_prefix("data:image/jpeg;base64,")?).ok()?;
    let decoded = image::load_from_memory_with_format(&jpeg, image::ImageFormat::Jpeg).ok()?;
    if (decoded.width(), decoded.height()) != (width, height) {
        return None;
    }
    let path = |class: &str| -> Option<String> {
        let Some((_, rest)) = figure.split_once(class) else { return Some(String::new()) };
        let path = attribute(rest.split_once('>')?.0, "d")?;
        path.bytes().all(|b| matches!(b, b'M' | b'L' | b'0'..=b'9' | b'.' | b'-' | b' ')).then(|| path.to_owned())
    };
    let outline = ProjectedOutline {
        seen: path("<path class=\"outline\"")?,
        unmeasured: path("<path class=\"outline dashed\"")?,
        contradicted: figure.split_once('>')?.0.contains(" data-contradicted"),
    };
    Some((id, Photograph { view, crop: PixelBox { left, top, width, height }, jpeg, outline }))
}

/// The value of an attribute.
fn attribute<'a>(element: &'a str, name: &str) -> Option<&'a str> {
    let start = element.find(&format!("{name}=\""))?;
    // ` d="` must not be found in the end of another name.
    let before = element[..start].bytes().last();
    if before.is_some_and(|b| b != b' ') {
        return attribute(&element[start + name.len()..], name);
    }
    element[start + name.len() + 2..].split_once('"').map(|(value, _)| value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::{record, taxonomy, worn_square};
    use crate::{Pictures, Report, html};

    fn photographs() -> Photographs {
        let image = image::RgbImage::from_pixel(12, 9, image::Rgb([200, 10, 10]));
        let photograph = |view: u32, contradicted: bool| Photograph {
            view,
            crop: PixelBox { left: 3, top: 4, width: 12, height: 9 },
            jpeg: crate::pictures::jpeg(&image, 80).expect("encoded"),
            outline: ProjectedOutline {
                seen: if contradicted { String::new() } else { "M1.0 2.0L3.0 -4.5".into() },
                unmeasured: if contradicted { String::new() } else { "M5.0 6.0L7.0 8.0".into() },
                contradicted,
            },
        };
        let list = vec![photograph(0, false), photograph(4, true)];
        Photographs { of: BTreeMap::from([(worn_square().id, list)]), missing: None }
    }

    #[test]
    fn photographs_of_the_same_model_come_back_and_of_another_do_not() {
        let (record, taxonomy, taken) = (record(), taxonomy(), photographs());
        let pictures = Pictures::default();
        let report =
            Report { record: &record, taxonomy: &taxonomy, pictures: &pictures, photographs: &taken, reviewed: None };
        let text = html(&report);
        let carried = carried_photographs(&text, &record).expect("the same generation");
        assert_eq!(carried.of, taken.of);
        let mut other = record.clone();
        other.files.as_mut().expect("kept").generation = "another".into();
        assert!(carried_photographs(&text, &other).is_none());
        // What somebody put into the file is not taken over.
        let tampered = text.replace("M1.0 2.0L3.0 -4.5", "M1.0&quot;/><script>");
        assert_eq!(carried_photographs(&tampered, &record).expect("read").of[&worn_square().id].len(), 1);
        let tampered = text.replace("data-crop=\"3 4 12 9\"", "data-crop=\"3 4 13 9\"");
        assert!(carried_photographs(&tampered, &record).expect("read").of.is_empty());
    }
}
