//! Material libraries (MTL): the diffuse colour and the picture of each material.
//!
//! Libraries are written carelessly, and a part is inspected by its shape: a line that cannot be read costs its colour only.

use crate::geometry::linear;
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
    for line in bytes.split(|b| *b == b'\n') {
        let line = String::from_utf8_lossy(line);
        let line = line.trim();
        let (word, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let rest = rest.trim();
        match (word, &mut current) {
            ("newmtl", _) => current = Some(materials.entry(rest.to_owned()).or_default()),
            ("Kd", Some(material)) => material.base_color = color(rest).map(linear).or(material.base_color),
            ("map_Kd", Some(material)) => material.picture = picture(rest).or(material.picture.take()),
            _ => {}
        }
    }
}

/// One number is grey.
fn color(text: &str) -> Option<[f32; 3]> {
    let numbers: Vec<f32> = text.split_whitespace().map_while(|w| w.parse().ok()).collect();
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
        let mut materials = HashMap::new();
        let text = b"Kd 1 1 1\nnewmtl a b\r\nKd 1\r\nKd spectral x.rfl\nmap_Kd -s 1 1 1 maps\\a.png\nnewmtl c\nKd 0 1 0\nmap_Kd\n";
        read(text, &mut materials);
        assert_eq!(materials.len(), 2);
        assert_eq!(materials["a b"], Material { base_color: Some([1.0; 3]), picture: Some("maps/a.png".into()) });
        assert_eq!(materials["c"], Material { base_color: Some([0.0, 1.0, 0.0]), picture: None });
    }
}
