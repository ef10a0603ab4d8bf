//! The area of defects that an inspection states where its labels are true: neither the rim of a defect nor the grid of the
//! map may make it larger or smaller.

use super::posed_shape::{Pictures, pose};
use super::{ABOVE, EXACT, NOISY, VOXEL, camera, inspect, plane};
use semascan_geometry::measure::seen_vertex_areas;
use semascan_inspection::Inspected;
use semascan_simulation::{VirtualCell, VirtualCellSpec};
use std::collections::BTreeMap;

/// Poses of the plane.
const POSES: u64 = 12;
/// Least area of a defect whose area is asked for, square metres.
const LEAST: f64 = 25e-6;
/// Difference of a vertex's depth and that of a pixel, metres, up to which the pixel shows the vertex.
const AGREEMENT: f64 = 5e-4;

/// Discs (centre, radius) and stripes with round ends (two ends, half the width) in the plane z = 0, millimetres.
const DISCS: [([f32; 2], f32); 3] = [([-17.3, -14.6], 3.0), ([14.2, -15.4], 5.0), ([-12.1, 12.7], 9.0)];
const STRIPES: [([f32; 2], [f32; 2], f32); 2] = [([8.0, 2.0], [24.0, 18.0], 0.6), ([2.0, 25.0], [24.0, 23.0], 1.0)];

/// The defect at a place of the plane: one class for each disc and stripe.
fn defect_at([x, y, _]: [f32; 3]) -> u16 {
    let at = [x, y].map(|c| c * 1e3);
    let from = |p: [f32; 2]| [at[0] - p[0], at[1] - p[1]];
    let in_disc = DISCS.iter().map(|&(centre, radius)| from(centre)[0].hypot(from(centre)[1]) < radius);
    let in_stripe = STRIPES.iter().map(|&(start, end, half_width)| {
        let ([px, py], [dx, dy]) = (from(start), [end[0] - start[0], end[1] - start[1]]);
        let along = ((px * dx + py * dy) / (dx * dx + dy * dy)).clamp(0.0, 1.0);
        (px - along * dx).hypot(py - along * dy) < half_width
    });
    in_disc.chain(in_stripe).position(|inside| inside).map_or(0, |class| class as u16 + 1)
}

/// Square metres of each class of [`defect_at`].
fn true_areas() -> Vec<f64> {
    let pi = std::f64::consts::PI;
    let disc = |&(_, radius): &([f32; 2], f32)| pi * f64::from(radius).powi(2);
    let stripe = |&([ax, ay], [bx, by], half): &([f32; 2], [f32; 2], f32)| {
        2.0 * f64::from(half) * f64::from((bx - ax).hypot(by - ay)) + pi * f64::from(half).powi(2)
    };
    DISCS.iter().map(disc).chain(STRIPES.iter().map(stripe)).map(|area| area * 1e-6).collect()
}

#[test]
fn discs_and_stripes_have_their_area() {
    let truth = true_areas();
    for (sensor, voxel) in [(EXACT, 0.5), (NOISY, 0.5), (NOISY, 0.7), (NOISY, 1.0)] {
        let pictures = Pictures::take_with_defects(&plane(0.06), &defect_at, &ABOVE, 0.3, camera(320, 0.3), sensor);
        // Relative errors by defect, one a pose.
        let mut errors = vec![Vec::new(); truth.len()];
        for seed in 0..POSES {
            let inspected = inspect(pictures.posed(&pose(seed)), voxel);
            for (class, area) in truth.iter().enumerate() {
                let stated = inspected.figures.defect(class as u16 + 1).and_then(|d| d.area).unwrap_or(0.0);
                errors[class].push(stated / area - 1.0);
            }
        }
        for (errors, area) in errors.iter().zip(&truth) {
            let mean = errors.iter().sum::<f64>() / errors.len() as f64;
            assert!(mean.abs() < 0.04, "voxels of {voxel} mm, defect of {:.1} mm2: {:+.2} %", area * 1e6, 100.0 * mean);
        }
        let median = median_size(errors.concat());
        assert!(median < 0.025, "voxels of {voxel} mm: median error {:.2} %", 100.0 * median);
    }
}

/// Median of the absolute values.
fn median_size(mut errors: Vec<f64>) -> f64 {
    errors.iter_mut().for_each(|e| *e = e.abs());
    errors.sort_by(f64::total_cmp);
    errors[errors.len() / 2]
}

/// Square metres of the model's surface by defect: as stated, and as the pixels say that see it most squarely.
fn stated_and_seen(inspected: &Inspected) -> BTreeMap<u16, [f64; 2]> {
    let vertices = &inspected.mesh.vertices;
    let mut best = vec![(0.0, 0); vertices.len()];
    let map = inspected.model.read();
    for i in 0..map.kept_views().len() {
        let view = map.kept_views().restore(i).expect("it was kept");
        let camera_from_table = view.table_from_camera.inverse();
        let k = view.cloud.intrinsics;
        for (v, best) in best.iter_mut().enumerate() {
            let point = camera_from_table * nalgebra::Point3::from(vertices.positions[v].map(f64::from));
            let normal = camera_from_table * nalgebra::Vector3::from(vertices.normals[v].map(f64::from));
            let Some(pixel) = k.project(&point).and_then(|(u, v)| k.pixel(u, v)) else { continue };
            let cosine = -normal.dot(&point.coords) / point.coords.norm();
            if (f64::from(view.cloud.depth[pixel]) - point.z).abs() < AGREEMENT && cosine > best.0 {
                *best = (cosine, view.segmentation.defects.best(pixel));
            }
        }
    }
    let mut areas: BTreeMap<u16, [f64; 2]> = BTreeMap::new();
    for (v, area) in seen_vertex_areas(&inspected.mesh, VOXEL as f32 * 1e-3).into_iter().enumerate() {
        let (cosine, seen) = best[v];
        if cosine > 0.0 {
            areas.entry(vertices.defects[v]).or_default()[0] += area;
            areas.entry(seen).or_default()[1] += area;
        }
    }
    areas
}

#[test]
fn motors_have_the_defects_that_their_pixels_show() {
    let mut errors = Vec::new();
    for seed in 7..=10 {
        let uri = format!("virtual:starter-motor?seed={seed}&views=12&errors=none");
        let cell = VirtualCell::open(&VirtualCellSpec::parse(&uri).expect("a URI")).expect("a motor");
        let inspected = inspect(cell, VOXEL);
        let areas = stated_and_seen(&inspected);
        let known = areas.into_iter().filter(|(defect, [_, seen])| *defect != 0 && *seen > LEAST);
        errors.extend(known.map(|(_, [stated, seen])| stated / seen - 1.0));
    }
    let (count, median) = (errors.len(), median_size(errors));
    assert!(count >= 8 && median < 0.03, "median error of {count} defects: {:.2} %", 100.0 * median);
}
