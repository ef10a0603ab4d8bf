//! Charts: faces side by side with one photograph, and their places in it.
//!
//! A chart lies in the atlas as it lies in its photograph, as in [Waechter 2014]: faces that it shows do not overlap there, and
//! where the surface is seen obliquely there are no more texels than pixels. What differs is the scale, so that a texel is as
//! long on the surface in all charts.

use crate::assign_views::regions;
use crate::photograph::project;
use crate::surface::Surface;
use nalgebra::{Isometry3, Point3};
use semascan_perception::view::Intrinsics;

/// Texels around a chart that repeat its rim: as many as two levels of a mip map and bilinear filtering look beyond it.
pub(crate) const PADDING: u32 = 4;

/// A camera that a chart lies in the picture of.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ChartCamera {
    pub(crate) intrinsics: Intrinsics,
    pub(crate) table_from_camera: Isometry3<f64>,
}

/// A chart.
#[derive(Clone, Debug)]
pub(crate) struct Chart {
    /// Place of its photograph in the list of all.
    pub(crate) view: u32,
    /// Its faces.
    pub(crate) faces: Vec<usize>,
    /// The vertices of these, in order.
    pub(crate) vertices: Vec<u32>,
    /// Number of its first node: a node is a vertex of a chart.
    pub(crate) first_node: usize,
    /// Column and row in the photograph of each vertex.
    pixels: Vec<[f64; 2]>,
    /// The least of these.
    corner: [f64; 2],
    /// The greatest, less the least.
    extent: [f64; 2],
    /// Metres on the surface that a pixel is long where it faces the camera, at the middle depth of the chart.
    pub(crate) footprint: f64,
}

/// The charts of faces with these photographs. `camera` gives that of a photograph.
pub(crate) fn charts(
    surface: &Surface,
    views: &[Option<u32>],
    camera: impl Fn(u32) -> Option<ChartCamera>,
) -> Vec<Chart> {
    let mut charts = Vec::new();
    let mut first_node = 0;
    for region in regions(surface, views) {
        let Some(camera) = camera(region.view) else { continue };
        let mut vertices: Vec<u32> = region.faces.iter().flat_map(|face| surface.faces[*face]).collect();
        vertices.sort_unstable();
        vertices.dedup();
        let camera_from_table = camera.table_from_camera.inverse();
        let places =
            vertices.iter().map(|v| project(&camera.intrinsics, &camera_from_table, &surface.positions[*v as usize]));
        // The photograph shows all corners of its faces: none lies behind the camera.
        let Some(places) = places.collect::<Option<Vec<(f64, f64, f64)>>>() else { continue };
        let bound = |axis: fn(&(f64, f64, f64)) -> f64, better: fn(f64, f64) -> f64| {
            places.iter().map(axis).reduce(better).unwrap_or(0.0)
        };
        let corner = [bound(|p| p.0, f64::min), bound(|p| p.1, f64::min)];
        let extent = [bound(|p| p.0, f64::max) - corner[0], bound(|p| p.1, f64::max) - corner[1]];
        let depth = places.iter().map(|p| p.2).sum::<f64>() / places.len() as f64;
        charts.push(Chart {
            view: region.view,
            faces: region.faces,
            first_node,
            pixels: places.iter().map(|(u, v, _)| [*u, *v]).collect(),
            corner,
            extent,
            footprint: camera.intrinsics.footprint(depth),
            vertices,
        });
        first_node += charts.last().map_or(0, |chart| chart.vertices.len());
    }
    charts
}

impl Chart {
    /// Texels that a pixel is long.
    pub(crate) fn scale(&self, texel: f64) -> f64 {
        self.footprint / texel
    }

    /// Columns and rows of the rectangle that it takes in the atlas, padding included.
    pub(crate) fn size(&self, texel: f64) -> (u32, u32) {
        // A whole number of texels stays one, whatever rounding adds to it.
        let texels = |pixels: f64| (pixels * self.scale(texel) - 1e-3).ceil() as u32;
        let [width, height] = self.extent.map(|extent| texels(extent) + 1 + 2 * PADDING);
        (width, height)
    }

    /// Where vertex number `local` of the chart lies in its rectangle, in texels: `[0.5, 0.5]` is the middle of the first one.
    pub(crate) fn texel(&self, local: usize, texel: f64) -> [f64; 2] {
        let place = self.pixels[local];
        [0, 1].map(|k| (place[k] - self.corner[k]) * self.scale(texel) + f64::from(PADDING) + 0.5)
    }

    /// Number within the chart of a vertex.
    pub(crate) fn local(&self, vertex: u32) -> Option<usize> {
        self.vertices.binary_search(&vertex).ok()
    }

    /// The corners of a face: their numbers within the chart and their places.
    pub(crate) fn corners(&self, surface: &Surface, face: usize) -> Option<([usize; 3], [Point3<f64>; 3])> {
        let [a, b, c] = surface.faces[face].map(|v| self.local(v));
        Some(([a?, b?, c?], surface.corners(face)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::{camera_above, quad};
    use semascan_model::SemanticMesh;

    #[test]
    fn a_chart_lies_in_the_atlas_as_in_its_photograph() {
        let mut mesh = SemanticMesh::default();
        quad(&mut mesh, [-0.05, -0.02], [0.05, 0.02], 0.0);
        let surface = Surface::of(&mesh);
        let photograph = camera_above([0.0, 0.0], 0.4, |_, _| [90; 3]);
        let camera = ChartCamera { intrinsics: photograph.intrinsics, table_from_camera: photograph.table_from_camera };
        let views: Vec<Option<u32>> = (0..surface.faces.len())
            .map(|f| (surface.middle(f).x < 0.03).then_some(u32::from(surface.middle(f).x < 0.0)))
            .collect();
        let charts = charts(&surface, &views, |_| Some(camera));
        assert_eq!(charts.len(), 2);
        // 1 mm a pixel at this height: 50 by 40 mm, and 30 by 40 mm.
        let left = charts.iter().find(|chart| chart.view == 1).expect("a chart");
        let right = charts.iter().find(|chart| chart.view == 0).expect("a chart");
        assert!((left.footprint - 1e-3).abs() < 1e-9);
        assert_eq!(left.size(1e-3), (51 + 2 * PADDING, 41 + 2 * PADDING));
        assert_eq!(right.size(0.5e-3), (61 + 2 * PADDING, 81 + 2 * PADDING));
        assert_eq!((left.first_node, right.first_node), (0, left.vertices.len()));
        let ([a, b, _], places) = right.corners(&surface, right.faces[0]).expect("its face");
        let (p, q) = (right.texel(a, 0.5e-3), right.texel(b, 0.5e-3));
        let apart = ((p[0] - q[0]).powi(2) + (p[1] - q[1]).powi(2)).sqrt();
        assert!((apart * 0.5e-3 - (places[0] - places[1]).norm()).abs() < 1e-9, "texels are lengths");
    }
}
