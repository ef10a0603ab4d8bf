//! A fitted element as a wireframe, as large as the piece of surface that it was fitted to.

use super::taken::Line;
use glam::Vec3;
use semascan_geometry::fit::{Circle, Cylinder, Element, Plane, Sphere};
use std::f32::consts::TAU;

/// Lines each way across a plane.
const MESHES: usize = 4;
/// Pieces of a circle.
const PIECES: usize = 48;
/// Lines along a cylinder.
const STAVES: usize = 8;

/// The wireframe of `element` over `points` of the surface; metres.
pub(super) fn lines(element: &Element, points: &[[f32; 3]]) -> Vec<Line> {
    match element {
        Element::Plane(Plane { point, normal }) => plane(vector(point), vector(normal), points),
        Element::Cylinder(Cylinder { point, axis, radius }) => {
            cylinder(vector(point), vector(axis), *radius as f32, points)
        }
        Element::Sphere(Sphere { centre, radius }) => {
            let axes = [Vec3::X, Vec3::Y, Vec3::Z];
            axes.into_iter().flat_map(|axis| circle(vector(centre), axis, *radius as f32)).collect()
        }
        Element::Circle(Circle { centre, normal, radius }) => {
            let (centre, normal, radius) = (vector(centre), vector(normal), *radius as f32);
            let (u, v) = normal.any_orthonormal_pair();
            let cross = [u, v].map(|way| line(centre - way * radius * 0.25, centre + way * radius * 0.25));
            circle(centre, normal, radius).chain(cross).collect()
        }
    }
}

fn vector(v: &impl std::ops::Index<usize, Output = f64>) -> Vec3 {
    Vec3::new(v[0] as f32, v[1] as f32, v[2] as f32)
}

fn line(from: Vec3, to: Vec3) -> Line {
    [from.to_array(), to.to_array()]
}

fn plane(middle: Vec3, normal: Vec3, points: &[[f32; 3]]) -> Vec<Line> {
    let (u, v) = normal.any_orthonormal_pair();
    let ([left, right], [low, high]) = (span(points, middle, u), span(points, middle, v));
    let at = |x: f32, y: f32| middle + u * x + v * y;
    (0..=MESHES)
        .flat_map(|k| {
            let share = k as f32 / MESHES as f32;
            let (x, y) = (left + (right - left) * share, low + (high - low) * share);
            [line(at(x, low), at(x, high)), line(at(left, y), at(right, y))]
        })
        .collect()
}

fn cylinder(middle: Vec3, axis: Vec3, radius: f32, points: &[[f32; 3]]) -> Vec<Line> {
    let (u, v) = axis.any_orthonormal_pair();
    let [low, high] = span(points, middle, axis).map(|along| middle + axis * along);
    let staves = (0..STAVES).map(|k| {
        let (sine, cosine) = (k as f32 / STAVES as f32 * TAU).sin_cos();
        let out = (u * cosine + v * sine) * radius;
        line(low + out, high + out)
    });
    let ends = [low, high].into_iter().flat_map(|end| circle(end, axis, radius));
    // The axis stands out at both ends.
    let beyond = (high - low) * 0.08;
    staves.chain(ends).chain([line(low - beyond, high + beyond)]).collect()
}

fn circle(centre: Vec3, normal: Vec3, radius: f32) -> impl Iterator<Item = Line> {
    let (u, v) = normal.any_orthonormal_pair();
    let at = move |k: usize| {
        let (sine, cosine) = (k as f32 / PIECES as f32 * TAU).sin_cos();
        centre + (u * cosine + v * sine) * radius
    };
    (0..PIECES).map(move |k| line(at(k), at(k + 1)))
}

/// How far points reach along a direction, from a place.
fn span(points: &[[f32; 3]], from: Vec3, along: Vec3) -> [f32; 2] {
    let ways = points.iter().map(|p| (Vec3::from(*p) - from).dot(along));
    ways.fold([0.0, 0.0], |[low, high], way| [f32::min(low, way), f32::max(high, way)])
}
