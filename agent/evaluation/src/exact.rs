//! Distances in double precision.

use nalgebra::{Point3, Vector3};

/// Distance of two points.
pub(super) fn distance(p: [f64; 3], q: [f64; 3]) -> f64 {
    (Point3::from(p) - Point3::from(q)).norm()
}

/// Distance of a point from a triangle, also one without area (C. Ericson, "Real-Time Collision Detection", 2005, section
/// 5.1.5: which corner, edge or the face the point's foot lies on).
pub(super) fn distance_to_triangle(p: [f64; 3], triangle: [[f64; 3]; 3]) -> f64 {
    let p = Point3::from(p);
    let [a, b, c] = triangle.map(Point3::from);
    let edges = [(a, b), (b, c), (c, a)];
    let to_edges = edges.map(|(from, to)| distance_to_segment(p, from, to)).into_iter().fold(f64::INFINITY, f64::min);
    let normal = (b - a).cross(&(c - a));
    let squared = normal.norm_squared();
    // The foot lies within where it is on the inner side of every edge.
    let within = edges.iter().all(|(from, to)| (to - from).cross(&(p - from)).dot(&normal) >= 0.0);
    if within && squared > 0.0 { ((p - a).dot(&normal) / squared.sqrt()).abs() } else { to_edges }
}

fn distance_to_segment(p: Point3<f64>, from: Point3<f64>, to: Point3<f64>) -> f64 {
    let along: Vector3<f64> = to - from;
    let squared = along.norm_squared();
    let share = if squared > 0.0 { ((p - from).dot(&along) / squared).clamp(0.0, 1.0) } else { 0.0 };
    (p - (from + along * share)).norm()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_foot_is_on_the_face_an_edge_or_a_corner() {
        let triangle = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 3.0, 0.0]];
        for (p, expected) in [
            ([1.0, 1.0, -2.0], 2.0),
            ([1.0, -3.0, 4.0], 5.0),
            ([7.0, 0.0, 4.0], 5.0),
            ([4.0, 3.0, 0.0], 2.4),
            ([0.0, 6.0, 4.0], 5.0),
        ] {
            let turned = [triangle[1], triangle[2], triangle[0]];
            for triangle in [triangle, turned, [triangle[1], triangle[0], triangle[2]]] {
                assert!((distance_to_triangle(p, triangle) - expected).abs() < 1e-12, "{p:?}");
            }
        }
        assert_eq!(distance_to_triangle([1.0, 2.0, 0.0], [[0.0; 3], [0.0; 3], [4.0, 0.0, 0.0]]), 2.0);
    }
}
