//! STL: text with every end of line, in capitals and in several solids; binary, whose head may say `solid`.

use super::{POSITIONS, Variant, triangles};

fn facets(triangles: &[[u32; 3]]) -> String {
    let facet = |t: &[u32; 3]| {
        let vertices = t.map(|v| {
            let [x, y, z] = POSITIONS[v as usize];
            format!("      vertex {x}.0 {y}e0 {z}\n")
        });
        format!("  facet normal 0 0 0\n    outer loop\n{}    endloop\n  endfacet\n", vertices.concat())
    };
    triangles.iter().map(facet).collect()
}

fn binary(head: &str) -> Vec<u8> {
    let mut out = vec![b' '; 80];
    out[..head.len()].copy_from_slice(head.as_bytes());
    out.extend((triangles().len() as u32).to_le_bytes());
    for t in triangles() {
        out.extend([0; 12]);
        for v in t {
            POSITIONS[v as usize].iter().for_each(|c| out.extend(f32::from(*c).to_le_bytes()));
        }
        out.extend([0; 2]);
    }
    out
}

pub(crate) fn variants() -> Vec<Variant> {
    let all = triangles();
    let one = format!("solid box\n{}endsolid box\n", facets(&all));
    let two = format!("solid a\n{}endsolid a\nsolid b\n{}endsolid b\n", facets(&all[..5]), facets(&all[5..]));
    let mut variants = Vec::new();
    for (solids, text) in [("one", &one), ("two", &two)] {
        for (end, bytes) in [("lf", "\n"), ("crlf", "\r\n"), ("cr", "\r")] {
            for capitals in [false, true] {
                let text = text.replace('\n', bytes);
                let (text, case) = if capitals { (text.to_uppercase(), "upper") } else { (text, "lower") };
                let mut variant = Variant::of_box(format!("{solids}-{end}-{case}.stl"), text.into_bytes(), true);
                variant.foreign = end != "cr" && !capitals;
                variants.push(variant);
            }
        }
    }
    for (what, head) in [("plain", "made by a test"), ("solid", "solid made by a test"), ("empty", "")] {
        variants.push(Variant::of_box(format!("binary-{what}.stl"), binary(head), true));
    }
    variants
}
