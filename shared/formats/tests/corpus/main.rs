//! A corpus of generated files: every type of number, byte order, container, index style and colour that the formats allow,
//! each read to the values that it was made of; and read to the same values by the readers of others (plyfile, trimesh,
//! pypcd4), so that file and expectation are not wrong together.

mod foreign;
mod gltf;
mod numbers;
mod obj;
mod pcd;
mod ply;
mod stl;

use semascan_formats::{Geometry, no_files};
use semascan_model::LengthUnit;
use std::collections::{BTreeMap, HashSet};

/// Corners of a box of 40 x 20 x 10 with one corner drawn out, so that no two numbers can be exchanged unnoticed. Whole
/// numbers that every type holds.
const POSITIONS: [[u8; 3]; 8] =
    [[0, 0, 0], [40, 0, 0], [40, 20, 0], [0, 20, 0], [0, 0, 10], [40, 0, 10], [41, 22, 13], [0, 20, 10]];
/// Its sides, counter-clockwise from outside.
const QUADS: [[u32; 4]; 6] = [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]];
/// A class for each corner.
const LABELS: [u8; 8] = [0, 1, 2, 3, 4, 5, 6, 100];

/// A level of 0..=255 for each channel of each corner; the largest are full light.
fn levels() -> Vec<[u8; 3]> {
    (0..8_u8).map(|i| [i * 10, 255 - i * 20, 51 + i]).collect()
}

/// The sides as triangles, as fans of their first corner.
fn triangles() -> Vec<[u32; 3]> {
    QUADS.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect()
}

/// A generated file and what it was made of.
struct Variant {
    /// Name of the file; tells all that is special of it.
    name: String,
    bytes: Vec<u8>,
    positions: Vec<[f64; 3]>,
    triangles: Vec<[u32; 3]>,
    /// Levels of 0..=255, or none.
    colors: Vec<[u8; 3]>,
    labels: Vec<u16>,
    /// Numbers of the file by the name of their column, as readers of others give them.
    columns: BTreeMap<&'static str, Vec<f64>>,
    /// Whether the readers of others are known to read it.
    foreign: bool,
}

impl Variant {
    /// The box, with or without its sides.
    fn of_box(name: String, bytes: Vec<u8>, has_sides: bool) -> Self {
        Self {
            name,
            bytes,
            positions: POSITIONS.iter().map(|p| p.map(f64::from)).collect(),
            triangles: if has_sides { triangles() } else { Vec::new() },
            colors: Vec::new(),
            labels: Vec::new(),
            columns: BTreeMap::new(),
            foreign: true,
        }
    }
}

fn corpus() -> Vec<Variant> {
    [ply::variants(), pcd::variants(), stl::variants(), obj::variants(), gltf::variants()]
        .into_iter()
        .flatten()
        .collect()
}

/// The triangles by the places of their corners, each beginning with its least: readers may number vertices anew.
fn surface(positions: &[[f64; 3]], triangles: &[[u32; 3]]) -> Vec<[[i64; 3]; 3]> {
    let place = |v: u32| positions[v as usize].map(|c| (c * 1000.0).round() as i64);
    let mut surface: Vec<_> = triangles
        .iter()
        .map(|t| {
            let mut corners = t.map(place);
            let least = (0..3).min_by_key(|k| corners[*k]).unwrap_or(0);
            corners.rotate_left(least);
            corners
        })
        .collect();
    surface.sort_unstable();
    surface
}

#[test]
fn every_variant_is_read_to_the_values_that_it_was_made_of() {
    let corpus = corpus();
    let names: HashSet<&str> = corpus.iter().map(|v| v.name.as_str()).collect();
    assert_eq!(names.len(), corpus.len(), "names are unique");
    assert!(corpus.len() >= 300, "{} variants", corpus.len());
    let mut faults = Vec::new();
    for variant in &corpus {
        if let Err(fault) = check(variant) {
            faults.push(format!("{}: {fault}", variant.name));
        }
    }
    assert!(faults.is_empty(), "{} of {} variants:\n{}", faults.len(), corpus.len(), faults.join("\n"));
    eprintln!("{} variants", corpus.len());
}

fn check(variant: &Variant) -> Result<(), String> {
    let geometry = Geometry::read(&variant.name, &variant.bytes, &no_files).map_err(|e| e.to_string())?;
    let (found, wanted) = (&geometry.positions, &variant.positions);
    if variant.triangles.is_empty() {
        if !geometry.triangles.is_empty() || found.len() != wanted.len() {
            return Err(format!("{} points, {} triangles", found.len(), geometry.triangles.len()));
        }
        let off = found.iter().flatten().zip(wanted.iter().flatten()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        if off > 1e-5 {
            return Err(format!("points are {off} off: {found:?}"));
        }
    } else if surface(found, &geometry.triangles) != surface(wanted, &variant.triangles) {
        return Err(format!("another surface: {found:?} {:?}", geometry.triangles));
    }
    // Where vertices keep their order, so do their columns.
    let levels: Vec<[u8; 3]> =
        geometry.colors.iter().map(|c| c.map(|l| (l.powf(1.0 / 2.2) * 255.0).round() as u8)).collect();
    if levels != variant.colors {
        return Err(format!("colours {levels:?}"));
    }
    if geometry.labels != variant.labels {
        return Err(format!("labels {:?}", geometry.labels));
    }
    Ok(())
}

#[test]
fn every_unit_comes_to_the_same_metres() {
    for unit in LengthUnit::ALL {
        for edge in [0.04, 0.2, 0.9] {
            let scale = edge / unit.in_metres();
            let text = format!("v 0 0 0\nv {scale} 0 0\nv 0 {scale} 0\nf 1 2 3\n");
            let geometry = Geometry::read("a.obj", text.as_bytes(), &no_files).expect("valid");
            let metres = geometry.extent() * unit.in_metres();
            assert!((metres - edge).abs() < 1e-12, "{unit:?} {edge}: {metres}");
            // The two units that parts are drawn in are told by the size.
            let is_told = unit == LengthUnit::Metres || unit == LengthUnit::Millimetres;
            assert!(!is_told || geometry.assumed_unit() == unit, "{unit:?} {edge}");
        }
    }
}
