//! Material libraries (MTL): the diffuse colour and the picture of each material.
//!
//! Libraries are written carelessly, and a part is inspected by its shape: a line that cannot be read costs its colour only.

use crate::geometry::linear;
use crate::levels::{Range, largest};
use crate::text::{decoded, lines, number};
use std::collections::HashMap;

/// What is used of a material.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Material {
    /// Linear colour.
    pub(super) base_color: Option<[f32; 3]>,
    /// Name of the picture's file, with `/` between folders.
    pub(super) picture: Option<String>,
}

/// Adds the materials of a library by their names.
pub(super) fn read(bytes: &[u8], materials: &mut HashMap<String, Material>) {
    let mut current: Option<&mut Material> = None;
    for line in lines(bytes) {
        let line = decoded(line);
        let line = line.trim();
        let (word, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let rest = rest.trim();
        match (word.to_ascii_lowercase().as_str(), &mut current) {
            ("newmtl", _) => current = Some(materials.entry(rest.to_owned()).or_default()),
            ("kd", Some(material)) => material.base_color = color(rest).map(linear).or(material.base_color),
            ("map_kd", Some(material)) => material.picture = picture(rest).or(material.picture.take()),
            _ => {}
        }
    }
}

/// One number is grey; numbers past 1 are levels of 0..=255.
fn color(text: &str) -> Option<[f32; 3]> {
    let numbers: Vec<f64> = text.split_whitespace().take(3).map_while(number).collect();
    let range = Range::of(true, largest(&numbers));
    let numbers: Vec<f32> = numbers.into_iter().map(|channel| range.share(channel) as f32).collect();
    match numbers[..] {
        [r, g, b, ..] => Some([r, g, b]),
        [grey, ..] => Some([grey; 3]),
        [] => None,
    }
}

/// The file's name, after options if there are such.
fn picture(text: &str) -> Option<String> {
    let name = if text.starts_with('-') { text.split_whitespace().last()? } else { text };
    (!name.is_empty()).then(|| name.replace('\\', "/"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn careless_libraries_are_read_as_far_as_they_go() {
        let mut loud = HashMap::new();
        read(b"NEWMTL Geh\xe4use\r\tkd 255 0 0\rmap_kd -clamp on a.png", &mut loud);
        assert_eq!(loud["Gehäuse"], Material { base_color: Some([1.0, 0.0, 0.0]), picture: Some("a.png".into()) });
        let mut materials = HashMap::new();
        let text = b"Kd 1 1 1\nnewmtl a b\r\nKd 1\r\nKd spectral x.rfl\nmap_Kd -s 1 1 1 maps\\a.png\nnewmtl c\nKd 0 1 0\nmap_Kd\n";
        read(text, &mut materials);
        assert_eq!(materials.len(), 2);
        assert_eq!(materials["a b"], Material { base_color: Some([1.0; 3]), picture: Some("maps/a.png".into()) });
        assert_eq!(materials["c"], Material { base_color: Some([0.0, 1.0, 0.0]), picture: None });
    }
}
