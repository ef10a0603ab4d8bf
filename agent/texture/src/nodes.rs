//! The vertices of charts, where charts meet, and the colours there that seams are levelled by.

use crate::charts::Chart;
use crate::level_seams::{Seam, Unlevelled};
use crate::photograph::{Colors, Photograph, project};
use crate::sights::Sights;
use crate::surface::{NO_FACE, Surface};
use nalgebra::Point3;
use rayon::prelude::*;

/// Edge in pixels of the square whose mean colour stands for a place.
const PATCH: f64 = 3.0;

/// The vertices of charts, and where charts meet.
pub(crate) struct Nodes {
    pub(crate) count: usize,
    pub(crate) seams: Vec<SeamSide>,
    edges: Vec<[usize; 2]>,
}

/// A side that faces of two charts share.
pub(crate) struct SeamSide {
    /// Its ends.
    vertices: [u32; 2],
    /// Both charts.
    charts: [usize; 2],
}

impl Nodes {
    pub(crate) fn of(surface: &Surface, charts: &[Chart]) -> Self {
        let mut chart_of = vec![usize::MAX; surface.faces.len()];
        for (number, chart) in charts.iter().enumerate() {
            chart.faces.iter().for_each(|face| chart_of[*face] = number);
        }
        let (mut seams, mut edges) = (Vec::new(), Vec::new());
        for (number, chart) in charts.iter().enumerate() {
            for face in &chart.faces {
                for side in 0..3 {
                    let [a, b] = [surface.faces[*face][side], surface.faces[*face][(side + 1) % 3]];
                    if let (Some(i), Some(j)) = (chart.local(a), chart.local(b)) {
                        edges.push([chart.first_node + i, chart.first_node + j]);
                    }
                    let other = surface.neighbours[*face][side];
                    let beyond = if other == NO_FACE { usize::MAX } else { chart_of[other as usize] };
                    if beyond != usize::MAX && number < beyond {
                        seams.push(SeamSide { vertices: [a, b], charts: [number, beyond] });
                    }
                }
            }
        }
        Self { count: charts.iter().map(|chart| chart.vertices.len()).sum(), seams, edges }
    }

    /// What seams are levelled by.
    pub(crate) fn unlevelled(&self, colors: &Samples, charts: &[Chart], sights: &Sights) -> Unlevelled {
        let mut seams = Vec::new();
        for (side, samples) in self.seams.iter().zip(&colors.of_seams) {
            for (end, vertex) in side.vertices.into_iter().enumerate() {
                let node = |k: usize| {
                    let chart = &charts[side.charts[k]];
                    chart.local(vertex).map(|local| chart.first_node + local)
                };
                let (Some(first), Some(second)) = (node(0), node(1)) else { continue };
                // At an end, and in the middle of the side: there the correction is the mean of those of both ends.
                let at = |chart: usize, channel: usize| {
                    let [begin, middle, last] = samples[chart].map(|color| color[channel]);
                    f64::from(if end == 0 { begin } else { last }) + f64::from(middle)
                };
                let difference = [0, 1, 2].map(|channel| (at(1, channel) - at(0, channel)) / 2.0);
                seams.push(Seam { nodes: [first, second], difference });
            }
        }
        let own = |node: usize| colors.of_nodes[node].map(f64::from);
        let off = |(node, vertex): (usize, &u32)| {
            let mean = sights.mean_color(*vertex as usize)?;
            let own = own(node);
            Some([0, 1, 2].map(|k| mean[k] - own[k]))
        };
        let off_mean = charts.iter().flat_map(|chart| (chart.first_node..).zip(&chart.vertices)).map(off).collect();
        Unlevelled { seams, edges: self.edges.clone(), off_mean }
    }
}

/// Colours of charts in their own photographs.
pub(crate) struct Samples {
    of_nodes: Vec<[f32; 3]>,
    /// Of both charts of a seam: at the first end, in the middle and at the other end.
    of_seams: Vec<[[[f32; 3]; 3]; 2]>,
}

impl Samples {
    pub(crate) fn new(nodes: &Nodes) -> Self {
        Self { of_nodes: vec![[0.0; 3]; nodes.count], of_seams: vec![[[[0.0; 3]; 3]; 2]; nodes.seams.len()] }
    }

    /// Those of the charts that have photograph `view`.
    pub(crate) fn take(
        &mut self,
        surface: &Surface,
        charts: &[Chart],
        nodes: &Nodes,
        view: u32,
        photograph: &Photograph<'_>,
    ) {
        let camera_from_table = photograph.table_from_camera.inverse();
        let colors = Colors::of(&photograph.rgb);
        let color = |point: &Point3<f64>| {
            let place = project(&photograph.intrinsics, &camera_from_table, point);
            place.map_or([0.0; 3], |(u, v, _)| colors.around(u, v, PATCH))
        };
        for chart in charts.iter().filter(|chart| chart.view == view) {
            let of_nodes = self.of_nodes[chart.first_node..].iter_mut().zip(&chart.vertices);
            of_nodes.for_each(|(node, vertex)| *node = color(&surface.positions[*vertex as usize]));
        }
        self.of_seams.par_iter_mut().zip(&nodes.seams).for_each(|(samples, side)| {
            let [first, last] = side.vertices.map(|v| surface.positions[v as usize]);
            let places = [first, nalgebra::center(&first, &last), last];
            for (samples, chart) in samples.iter_mut().zip(side.charts) {
                if charts[chart].view == view {
                    *samples = places.each_ref().map(&color);
                }
            }
        });
    }
}
