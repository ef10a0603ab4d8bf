//! OBJ: indices of every style, from both ends, of polygons and triangles, with every end of line.

use super::{POSITIONS, QUADS, Variant, levels, triangles};

pub(crate) fn variants() -> Vec<Variant> {
    let mut variants = Vec::new();
    let faces = [
        ("triangles", triangles().iter().map(|t| t.to_vec()).collect::<Vec<_>>()),
        ("quads", QUADS.iter().map(|q| q.to_vec()).collect()),
    ];
    for (polygon, faces) in &faces {
        for style in ["v", "v-vt", "v--vn", "v-vt-vn"] {
            for negative in [false, true] {
                for (end, bytes) in [("lf", "\n"), ("crlf", "\r\n"), ("cr", "\r")] {
                    let text = text(faces, style, negative, false).replace('\n', bytes);
                    let sign = if negative { "negative" } else { "positive" };
                    let name = format!("{polygon}-{style}-{sign}-{end}.obj");
                    let mut variant = Variant::of_box(name, text.into_bytes(), true);
                    // trimesh counts vt and vn of negative indices from the wrong end.
                    variant.foreign = end != "cr" && !(negative && style != "v");
                    variants.push(variant);
                }
            }
        }
        let mut colored =
            Variant::of_box(format!("{polygon}-colors.obj"), text(faces, "v", false, true).into_bytes(), true);
        colored.colors = levels();
        variants.push(colored);
    }
    variants
}

fn text(faces: &[Vec<u32>], style: &str, negative: bool, colored: bool) -> String {
    let mut out = "# a box\no box\n".to_owned();
    for ([x, y, z], color) in POSITIONS.iter().zip(levels()) {
        let color = color.map(|level| (f64::from(level) / 255.0).to_string()).join(" ");
        out += &if colored { format!("v {x} {y} {z} {color}\n") } else { format!("v {x} {y} {z}\n") };
    }
    if style.contains("vt") {
        POSITIONS
            .iter()
            .for_each(|[x, y, _]| out += &format!("vt {} {}\n", f32::from(*x) / 64.0, f32::from(*y) / 64.0));
    }
    if style.contains("vn") {
        POSITIONS.iter().for_each(|_| out += "vn 0 0 1\n");
    }
    for face in faces {
        let corner = |v: &u32| {
            let index = if negative { i64::from(*v) - POSITIONS.len() as i64 } else { i64::from(*v) + 1 };
            style
                .split('-')
                .map(|part| if part.is_empty() { String::new() } else { index.to_string() })
                .collect::<Vec<_>>()
                .join("/")
        };
        out += &format!("f {}\n", face.iter().map(corner).collect::<Vec<_>>().join(" "));
    }
    out
}
