//! The elements of `report.html` as typst reads them: JSON, and files of pictures.
//!
//! Only what `html/` writes is understood: elements that are closed, but for those that HTML never closes, and text that is
//! escaped. A drawing (`svg`) becomes a file of its own; so does a picture with the drawing that lies over it.

use crate::ReportError;
use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};
use serde_json::{Map, Value, json};
use std::collections::BTreeSet;
use std::fmt::Write;

/// How drawings look, on the page and here.
const DRAWINGS: &str = include_str!("../html/drawings.css");
/// Elements of HTML that have no end.
const VOID: [&str; 3] = ["br", "img", "meta"];
/// Elements whose text nobody reads.
const UNREAD: [&str; 3] = ["style", "title", "meta"];
/// Width that a picture has on the page, pixels of the screen: lines of one pixel are as wide in every picture.
const SHOWN: f64 = 330.0;

/// A page for typst.
pub(super) struct Page {
    /// The body: see `report.typ` for its form.
    pub(super) body: Value,
    /// Pictures (SVG), `0.svg` and so on by their place.
    pub(super) pictures: Vec<Vec<u8>>,
}

impl Page {
    /// Reads what [`crate::html`] wrote.
    ///
    /// # Errors
    /// [`ReportError::Pdf`] if it is not such a page.
    pub(super) fn read(html: &str) -> Result<Self, ReportError> {
        let mut reading = Reading { html, reader: Reader::from_str(html), pictures: Vec::new(), ids: BTreeSet::new() };
        reading.reader.config_mut().check_end_names = false;
        let mut body = reading.until_body()?;
        keep_known_links(&mut body, &reading.ids);
        Ok(Self { body, pictures: reading.pictures })
    }
}

fn wrong(reason: impl std::fmt::Display) -> ReportError {
    ReportError::Pdf(format!("the page cannot be read: {reason}"))
}

struct Reading<'a> {
    html: &'a str,
    reader: Reader<&'a [u8]>,
    pictures: Vec<Vec<u8>>,
    ids: BTreeSet<String>,
}

impl<'a> Reading<'a> {
    fn next(&mut self) -> Result<Event<'a>, ReportError> {
        self.reader.read_event().map_err(wrong)
    }

    fn until_body(&mut self) -> Result<Value, ReportError> {
        loop {
            match self.next()? {
                Event::Start(start) if start.name().as_ref() == "body" => return self.element(&start),
                Event::Eof => return Err(wrong("it has no body")),
                _ => {}
            }
        }
    }

    /// The element that `start` begins, to its end.
    fn element(&mut self, start: &BytesStart<'_>) -> Result<Value, ReportError> {
        let tag = start.name().as_ref().to_owned();
        let attributes = Attributes::of(start)?;
        if tag == "svg" {
            let contents = self.contents_of_drawing()?;
            let name = self.add_picture(drawing(&attributes, contents, "")?);
            return Ok(picture(name, &attributes, attributes.get("aria-label").unwrap_or("drawing")));
        }
        let mut element = Map::new();
        if let Some(id) = attributes.get("id") {
            self.ids.insert(id.to_owned());
            element.insert("id".into(), json!(id));
        }
        if let Some(target) = attributes.get("href").and_then(|href| href.strip_prefix('#')) {
            element.insert("to".into(), json!(target));
        }
        if let Some(span) = attributes.get("colspan") {
            element.insert("span".into(), json!(span.parse::<u32>().map_err(wrong)?));
        }
        if let Some(color) = attributes.get("style").and_then(|style| style.strip_prefix("background:")) {
            element.insert("color".into(), json!(color));
        }
        element.insert("class".into(), classes(&attributes));
        let children = if tag == "div" && attributes.has_class("frame") { self.frame()? } else { self.children()? };
        element.insert("children".into(), Value::Array(children));
        element.insert("tag".into(), json!(tag));
        Ok(Value::Object(element))
    }

    /// What an element holds, to its end.
    fn children(&mut self) -> Result<Vec<Value>, ReportError> {
        let mut children = Vec::new();
        let mut text = String::new();
        loop {
            match self.next()? {
                Event::Text(piece) => text.push_str(&piece.html_content()),
                Event::GeneralRef(reference) => text.push(character(&reference)?),
                Event::Start(start) => {
                    push_text(&mut children, &mut text);
                    let tag = start.name().as_ref().to_owned();
                    match tag.as_str() {
                        "br" => children.push(json!({ "tag": "br", "class": [], "children": [] })),
                        tag if VOID.contains(&tag) => return Err(wrong(format!("{tag} stands outside of a frame"))),
                        tag if UNREAD.contains(&tag) => {
                            self.reader.read_to_end(start.name()).map_err(wrong)?;
                        }
                        _ => children.push(self.element(&start)?),
                    }
                }
                Event::End(_) => {
                    push_text(&mut children, &mut text);
                    return Ok(children);
                }
                Event::Eof => return Err(wrong("it is cut")),
                _ => {}
            }
        }
    }

    /// A picture and the drawing over it, as one.
    fn frame(&mut self) -> Result<Vec<Value>, ReportError> {
        let (mut image, mut over) = (None, None);
        loop {
            match self.next()? {
                Event::Start(start) if start.name().as_ref() == "img" => image = Some(Attributes::of(&start)?),
                Event::Start(start) if start.name().as_ref() == "svg" => over = Some(self.contents_of_drawing()?),
                Event::End(_) => break,
                Event::Eof => return Err(wrong("it is cut")),
                _ => {}
            }
        }
        let image = image.ok_or_else(|| wrong("a frame has no picture"))?;
        let [width, height, source, alt] = ["width", "height", "src", "alt"].map(|name| image.get(name).unwrap_or(""));
        if !source.starts_with("data:image/jpeg;base64,") {
            return Err(wrong("a picture is not in it"));
        }
        let below = format!("<image href=\"{source}\" width=\"{width}\" height=\"{height}\"/>");
        let over_all = Attributes(vec![("viewBox".into(), format!("0 0 {width} {height}"))]);
        let name = self.add_picture(drawing(&over_all, over.unwrap_or(""), &below)?);
        Ok(vec![picture(name, &image, alt)])
    }

    /// The text between the start and the end of a drawing.
    fn contents_of_drawing(&mut self) -> Result<&'a str, ReportError> {
        let span = self.reader.read_to_end(quick_xml::name::QName("svg")).map_err(wrong)?;
        let range = usize::try_from(span.start).map_err(wrong)?..usize::try_from(span.end).map_err(wrong)?;
        self.html.get(range).ok_or_else(|| wrong("a drawing is cut"))
    }

    fn add_picture(&mut self, svg: String) -> String {
        self.pictures.push(svg.into_bytes());
        format!("{}.svg", self.pictures.len() - 1)
    }
}

/// The attributes of an element, without their escapes.
struct Attributes(Vec<(String, String)>);

impl Attributes {
    fn of(start: &BytesStart<'_>) -> Result<Self, ReportError> {
        let mut list = Vec::new();
        for attribute in start.html_attributes() {
            let attribute = attribute.map_err(wrong)?;
            let value = attribute.normalized_value(quick_xml::XmlVersion::Implicit1_0).map_err(wrong)?;
            list.push((attribute.key.as_ref().to_owned(), value.into_owned()));
        }
        Ok(Self(list))
    }

    fn get(&self, name: &str) -> Option<&str> {
        self.0.iter().find(|(key, _)| key == name).map(|(_, value)| value.as_str())
    }

    fn has_class(&self, class: &str) -> bool {
        self.get("class").is_some_and(|classes| classes.split(' ').any(|one| one == class))
    }
}

fn classes(attributes: &Attributes) -> Value {
    attributes.get("class").unwrap_or("").split_whitespace().collect()
}

fn picture(name: String, attributes: &Attributes, alt: &str) -> Value {
    json!({ "tag": "picture", "class": classes(attributes), "children": [], "name": name, "alt": alt })
}

/// A drawing that stands alone: `contents` over `below`, with its style.
fn drawing(attributes: &Attributes, contents: &str, below: &str) -> Result<String, ReportError> {
    let view_box = attributes.get("viewBox").ok_or_else(|| wrong("a drawing has no size"))?;
    let size: Vec<f64> = view_box.split(' ').filter_map(|number| number.parse().ok()).collect();
    let &[_, _, width, height] = size.as_slice() else { return Err(wrong("a drawing has no size")) };
    let class = attributes.get("class").unwrap_or("");
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"{class}\" viewBox=\"{view_box}\" width=\"{width}\" \
         height=\"{height}\" preserveAspectRatio=\"none\" font-family=\"Libertinus Serif\"><style>{DRAWINGS}"
    );
    // Typst's reader of SVG does not know `vector-effect`, by which the browser keeps these lines as wide as they are.
    let pixel = width / SHOWN;
    let widths = format!(
        "path.halo{{stroke-width:{:.3}}}path.outline{{stroke-width:{:.3}}}path.dashed{{stroke-dasharray:{:.3} {:.3}}}",
        3.4 * pixel,
        1.5 * pixel,
        5.0 * pixel,
        4.0 * pixel
    );
    // Writing to a string cannot fail.
    let _ = write!(svg, "{widths}</style>{below}{contents}</svg>");
    Ok(svg)
}

/// The character that a reference such as `&lt;` stands for.
fn character(reference: &quick_xml::events::BytesRef<'_>) -> Result<char, ReportError> {
    if let Some(character) = reference.resolve_char_ref().map_err(wrong)? {
        return Ok(character);
    }
    let name = reference.html_content();
    let resolved = quick_xml::escape::resolve_predefined_entity(&name).and_then(|text| text.chars().next());
    resolved.ok_or_else(|| wrong(format!("&{name}; is not known")))
}

fn push_text(children: &mut Vec<Value>, text: &mut String) {
    if !text.is_empty() {
        children.push(Value::String(std::mem::take(text)));
    }
}

/// Takes links away that lead nowhere: of very many findings the last have no section.
fn keep_known_links(element: &mut Value, ids: &BTreeSet<String>) {
    let Value::Object(map) = element else { return };
    if map.get("to").and_then(Value::as_str).is_some_and(|target| !ids.contains(target)) {
        map.remove("to");
    }
    if let Some(Value::Array(children)) = map.get_mut("children") {
        children.iter_mut().for_each(|child| keep_known_links(child, ids));
    }
}
