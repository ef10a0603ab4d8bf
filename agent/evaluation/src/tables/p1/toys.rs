//! The five toys of [Eye-in-hand 2020] (its Fig. 2a) as meshes: cylinder, half-cylinder, L-block, cuboid, box. The
//! paper gives no sizes; these are those of building blocks, in millimetres.

use std::fmt::Write;

/// A prism standing on the table.
pub(super) struct Toy {
    /// The paper's name for it.
    pub(super) name: &'static str,
    /// Outline in (x, y), counter-clockwise; every corner is seen from the first one.
    outline: Vec<[f64; 2]>,
    height: f64,
    /// sRGB paint, 0..=1.
    paint: [f64; 3],
}

/// Corners of a full circle.
const CIRCLE: usize = 96;

/// The toys in the order of the paper's Table 3.
pub(super) fn toys() -> [Toy; 5] {
    let arc = |radius: f64, from: f64, to: f64, n: usize| -> Vec<[f64; 2]> {
        let at = |i: usize| from + (to - from) * i as f64 / n as f64;
        (0..=n).map(|i| [radius * at(i).cos(), radius * at(i).sin()]).collect()
    };
    let block = |x: f64, y: f64| vec![[0.0, 0.0], [x, 0.0], [x, y], [0.0, y]];
    let mut circle = arc(22.0, 0.0, std::f64::consts::TAU, CIRCLE);
    circle.pop();
    let toy = |name, outline, height, paint| Toy { name, outline, height, paint };
    [
        toy("cylinder", circle, 55.0, [0.75, 0.20, 0.16]),
        toy("half-cylinder", arc(32.0, 0.0, std::f64::consts::PI, CIRCLE / 2), 50.0, [0.18, 0.42, 0.75]),
        // From the inner corner all others are seen.
        toy(
            "L-block",
            vec![[28.0, 28.0], [28.0, 70.0], [0.0, 70.0], [0.0, 0.0], [70.0, 0.0], [70.0, 28.0]],
            30.0,
            [0.85, 0.66, 0.15],
        ),
        toy("cuboid", block(38.0, 38.0), 75.0, [0.20, 0.60, 0.28]),
        toy("box", block(80.0, 60.0), 45.0, [0.72, 0.55, 0.38]),
    ]
}

impl Toy {
    /// A Wavefront OBJ in millimetres with the paint on its vertices.
    pub(super) fn obj(&self) -> String {
        let (n, [r, g, b]) = (self.outline.len(), self.paint);
        let mut text = String::new();
        for z in [0.0, self.height] {
            for [x, y] in &self.outline {
                // Writing to a string cannot fail.
                let _ = writeln!(text, "v {x} {y} {z} {r} {g} {b}");
            }
        }
        for i in 0..n {
            let (a, b) = (i + 1, (i + 1) % n + 1);
            let _ = writeln!(text, "f {a} {b} {}\nf {a} {} {}", b + n, b + n, a + n);
        }
        for i in 1..n - 1 {
            let _ = writeln!(text, "f 1 {} {}\nf {} {} {}", i + 2, i + 1, n + 1, n + i + 1, n + i + 2);
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Signed volume of an OBJ's triangles and how often each edge is used each way.
    fn volume(text: &str) -> (f64, bool) {
        let numbers =
            |line: &str| -> Vec<f64> { line.split(' ').skip(1).map(|w| w.parse().expect("a number")).collect() };
        let v: Vec<Vec<f64>> = text.lines().filter(|l| l.starts_with('v')).map(numbers).collect();
        let mut edges = std::collections::BTreeMap::new();
        let mut six = 0.0;
        for f in text.lines().filter(|l| l.starts_with('f')).map(numbers) {
            let f: Vec<usize> = f.iter().map(|i| *i as usize - 1).collect();
            let [a, b, c] = [0, 1, 2].map(|k| nalgebra::Vector3::new(v[f[k]][0], v[f[k]][1], v[f[k]][2]));
            six += a.dot(&b.cross(&c));
            for k in 0..3 {
                let (i, j) = (f[k], f[(k + 1) % 3]);
                *edges.entry((i.min(j), i.max(j))).or_insert(0) += if i < j { 1 } else { -1 };
            }
        }
        (six / 6.0, edges.values().all(|&n| n == 0))
    }

    #[test]
    fn toys_are_closed_and_face_outwards() {
        let expected = [
            std::f64::consts::PI * 22.0 * 22.0 * 55.0,
            0.5 * std::f64::consts::PI * 32.0 * 32.0 * 50.0,
            (70.0 * 28.0 + 42.0 * 28.0) * 30.0,
            38.0 * 38.0 * 75.0,
            80.0 * 60.0 * 45.0,
        ];
        for (toy, expected) in toys().iter().zip(expected) {
            let (volume, closed) = volume(&toy.obj());
            assert!(closed, "{}", toy.name);
            assert!((volume / expected - 1.0).abs() < 3e-3, "{}: {volume} against {expected}", toy.name);
        }
    }
}
