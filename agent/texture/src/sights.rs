//! For each face the photographs that show it, how well, and in which colour; and for each vertex the mean colour over all
//! photographs that show it.

use crate::photograph::{Colors, Photograph};
use crate::surface::Surface;
use crate::visibility::{Seen, Visibility};
use rayon::prelude::*;
use semascan_perception::view::sharpness;
use semascan_rasterizer::Scene;

/// Most photographs that are kept for a face: the best.
const MOST: usize = 16;
/// What is left of the resolution where something farther may shine through.
const RIM_SHARE: f64 = 0.2;
/// Edge in pixels of the square whose mean colour a place is judged by.
const PATCH: f64 = 3.0;

/// How a photograph shows a face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sight {
    /// Place of the photograph in the list of all.
    pub(crate) view: u32,
    /// Pixels on a square metre, less what blur and rims take; only compared with others of the face.
    pub(crate) quality: f32,
    /// Mean colour at its middle, sRGB levels.
    pub(crate) color: [f32; 3],
}

/// What was seen in all photographs so far.
#[derive(Debug)]
pub(crate) struct Sights {
    /// Of each face, the best first.
    pub(crate) of_faces: Vec<Vec<Sight>>,
    /// Sum of weighted colours and weight of each vertex.
    sums: Vec<([f64; 3], f64)>,
}

impl Sights {
    pub(crate) fn new(surface: &Surface) -> Self {
        let sums = vec![([0.0; 3], 0.0); surface.positions.len()];
        Self { of_faces: vec![Vec::new(); surface.faces.len()], sums }
    }

    /// Looks at photograph `view`.
    pub(crate) fn add(&mut self, surface: &Surface, scene: &Scene<'_>, view: u32, photograph: &Photograph<'_>) {
        let visibility = Visibility::of(scene, photograph);
        let depths = visibility.depths();
        // A picture without contrast is worth what its pixels are.
        let sharpness = sharpness(&photograph.rgb, |at| depths[at].is_finite()).unwrap_or(1.0);
        let colors = Colors::of(&photograph.rgb);
        let look = |face: usize| visibility.face(surface.corners(face), &surface.normals[face]);
        let seen: Vec<Option<Seen>> = (0..surface.faces.len()).into_par_iter().map(look).collect();
        let weight = |seen: &Seen| {
            let shown = if seen.is_at_rim { RIM_SHARE } else { 1.0 };
            seen.resolution * sharpness * sharpness * shown
        };
        self.of_faces.par_iter_mut().zip(&seen).for_each(|(sights, seen)| {
            let Some(seen) = seen else { return };
            let [u, v] = seen.pixel;
            let sight = Sight { view, quality: weight(seen) as f32, color: colors.around(u, v, PATCH) };
            let place = sights.partition_point(|other| other.quality >= sight.quality);
            sights.insert(place, sight);
            sights.truncate(MOST);
        });
        // A vertex is seen where a face around it is.
        let mut of_vertices = vec![0.0_f64; surface.positions.len()];
        for (face, seen) in surface.faces.iter().zip(&seen) {
            let Some(seen) = seen else { continue };
            face.iter().for_each(|v| of_vertices[*v as usize] = of_vertices[*v as usize].max(weight(seen)));
        }
        self.sums.par_iter_mut().zip(&of_vertices).zip(&surface.positions).for_each(|((sum, weight), position)| {
            let Some((u, v, _)) = visibility.project(position).filter(|_| *weight > 0.0) else { return };
            let color = colors.around(u, v, PATCH);
            sum.0 = [0, 1, 2].map(|k| sum.0[k] + weight * f64::from(color[k]));
            sum.1 += weight;
        });
    }

    /// Mean colour of a vertex over the photographs that show it, each with its pixels there as weight; `None` if there are none.
    pub(crate) fn mean_color(&self, vertex: usize) -> Option<[f64; 3]> {
        let (sum, weight) = self.sums[vertex];
        (weight > 0.0).then(|| sum.map(|c| c / weight))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::{camera_above, quad};
    use semascan_model::SemanticMesh;

    fn stripes(x: f64, _: f64) -> [u8; 3] {
        [if (x * 200.0).rem_euclid(1.0) < 0.5 { 200 } else { 40 }; 3]
    }

    #[test]
    fn the_best_photograph_is_near_and_sharp() {
        let mut mesh = SemanticMesh::default();
        quad(&mut mesh, [-0.02, -0.02], [0.02, 0.02], 0.0);
        let (surface, scene) = (Surface::of(&mesh), Scene::of_shape(&mesh));
        let mut sights = Sights::new(&surface);
        let near = camera_above([0.0, 0.0], 0.3, stripes);
        let mut blurred = camera_above([0.0, 0.0], 0.29, stripes);
        blurred.rgb = std::sync::Arc::new(image::imageops::blur(blurred.rgb.as_ref(), 2.0));
        let photographs =
            [camera_above([0.0, 0.0], 0.5, stripes), near, blurred, camera_above([0.9, 0.0], 0.3, stripes)];
        for (view, photograph) in photographs.iter().enumerate() {
            sights.add(&surface, &scene, view as u32, photograph);
        }
        let inner =
            surface.faces.iter().position(|f| f.iter().all(|v| surface.positions[*v as usize].coords.norm() < 0.01));
        let order: Vec<u32> = sights.of_faces[inner.expect("a face")].iter().map(|sight| sight.view).collect();
        assert_eq!(order, [1, 0, 2], "the last does not show it");
        let mean = sights.mean_color(surface.faces[0][0] as usize).expect("seen");
        assert!((40.0..200.0).contains(&mean[0]) && mean[0] == mean[2], "{mean:?}");
    }
}
