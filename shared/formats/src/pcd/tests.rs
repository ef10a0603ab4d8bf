//! PCD files of every storage, and broken ones.

use super::PcdCloud;
use super::read::parse;
use proptest::prelude::*;

const FIELDS: &str = "FIELDS label x y z rgba\nSIZE 4 4 4 4 4\nTYPE U F F F U\nCOUNT 1 1 1 1 1\n";

fn head(data: &str) -> String {
    format!("# .PCD v0.7\nVERSION 0.7\n{FIELDS}WIDTH 2\nHEIGHT 1\nVIEWPOINT 1 2 3 0 1 0 0\nPOINTS 2\nDATA {data}\n")
}

/// Two points, the second without depth, field by field.
fn columns() -> Vec<u8> {
    let mut out = Vec::new();
    [21_u32, 0].iter().for_each(|v| out.extend(v.to_le_bytes()));
    for axis in [[1.0, f32::NAN], [-2.0, f32::NAN], [0.5, f32::NAN]] {
        axis.iter().for_each(|v| out.extend(v.to_le_bytes()));
    }
    [0xff10_2030_u32, 0].iter().for_each(|v| out.extend(v.to_le_bytes()));
    out
}

fn rows() -> Vec<u8> {
    let columns = columns();
    (0..2)
        .flat_map(|i| (0..5).flat_map(move |f| [f * 8 + i * 4; 1]))
        .flat_map(|at| columns[at..at + 4].to_vec())
        .collect()
}

/// LZF of literals alone.
fn packed(content: &[u8]) -> Vec<u8> {
    let body: Vec<u8> = content.chunks(32).flat_map(|c| std::iter::once(c.len() as u8 - 1).chain(c.to_vec())).collect();
    [&(body.len() as u32).to_le_bytes()[..], &(content.len() as u32).to_le_bytes(), &body].concat()
}

fn check(cloud: &PcdCloud) {
    assert_eq!((cloud.width, cloud.height), (2, 1));
    assert_eq!(cloud.positions[0], [1.0, -2.0, 0.5]);
    assert!(cloud.positions[1].iter().all(|v| v.is_nan()));
    assert_eq!(cloud.labels.as_deref(), Some(&[21, 0][..]));
    assert_eq!(cloud.colors.as_deref(), Some(&[[0x10, 0x20, 0x30], [0; 3]][..]));
    assert!(cloud.normals.is_none());
    let viewpoint = cloud.viewpoint.expect("stated");
    assert_eq!((viewpoint.translation, viewpoint.rotation), ([1.0, 2.0, 3.0], [0.0, 1.0, 0.0, 0.0]));
}

#[test]
fn all_storages_say_the_same() {
    let binary = [head("binary").as_bytes(), &rows()].concat();
    check(&parse(&binary).expect("binary"));
    let compressed = [head("binary_compressed").as_bytes(), &packed(&columns())].concat();
    check(&parse(&compressed).expect("compressed"));
    let ascii = head("ascii") + "21 1 -2 0.5 4279246896\n0 nan nan nan 0\n";
    check(&parse(ascii.as_bytes()).expect("ascii"));
}

#[test]
fn what_is_wrong_is_named() {
    let whole = [head("binary_compressed").as_bytes(), &packed(&columns())].concat();
    let with = |from: &str, to: &str| head("binary").replacen(from, to, 1).into_bytes();
    for (data, word) in [
        (Vec::new(), "DATA"),
        (head("zip").into_bytes(), "zip"),
        (head("binary").into_bytes(), "do not fit"),
        (whole[..whole.len() - 1].to_vec(), "leave the file"),
        (with("POINTS 2", "POINTS 3"), "POINTS 3"),
        (with("WIDTH 2", "WIDTH 4000000000"), "POINTS 2"),
        (with("HEIGHT 1", "HEIGHT -1"), "HEIGHT -1"),
        (with("SIZE 4", "SIZE 3"), "SIZE 3"),
        (with("COUNT 1", "COUNT 0"), "COUNT 0"),
        (with("COUNT 1 1 1 1 1", "COUNT 1 1"), "COUNT has 2"),
        (with("label x", "label w"), "x, y and z"),
        ((head("ascii") + "1 2 3 4 5\n1 2 3 4    \n").into_bytes(), "rgba is missing"),
        ((head("ascii") + "1 2 x 4 5\n1 2 3 4 5\n").into_bytes(), "\"x\""),
        ((head("ascii") + "1 2 3 4 5\n            ").into_bytes(), "1 points of 2"),
    ] {
        let data = if word == "x, y and z" { [data, vec![0; 40]].concat() } else { data };
        let message = parse(&data).expect_err(word);
        assert!(message.contains(word), "{word}: {message}");
    }
    let huge = "FIELDS x y z\nSIZE 8 8 8\nTYPE F F F\nCOUNT 4096 4096 4096\nWIDTH 4294967295\nHEIGHT 4294967295\n";
    for data in ["ascii", "binary", "binary_compressed"] {
        assert!(parse(format!("{huge}DATA {data}\n12345678").as_bytes()).is_err());
    }
}

proptest! {
    #[test]
    fn damaged_files_never_panic(
        kind in 0..3_usize,
        cut in (0..1_200_000_i32).prop_map(|k| f64::from(k) / 1e6),
        damage in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..6),
    ) {
        let mut data = match kind {
            0 => [head("binary").as_bytes(), &rows()].concat(),
            1 => [head("binary_compressed").as_bytes(), &packed(&columns())].concat(),
            _ => (head("ascii") + "21 1 -2 0.5 4279246896\n0 nan nan nan 0\n").into_bytes(),
        };
        for (at, value) in damage {
            let at = at.index(data.len());
            data[at] = value;
        }
        let keep = ((data.len() as f64 * cut) as usize).min(data.len());
        if let Ok(cloud) = parse(&data[..keep]) {
            prop_assert_eq!(cloud.positions.len(), cloud.width as usize * cloud.height as usize);
        }
    }
}
