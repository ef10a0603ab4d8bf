//! All steps in their order: a mesh and its photographs become a textured mesh.

use crate::assign_views::assign_views;
use crate::atlas::{UNSEEN_EDGE, compose};
use crate::bake::{Tile, bake, correct, pad};
use crate::charts::{Chart, ChartCamera, charts};
use crate::cut::cut;
use crate::level_seams::level_seams;
use crate::nodes::{Nodes, Samples};
use crate::pack::{Packing, pack};
use crate::photograph::Photograph;
use crate::sights::Sights;
use crate::surface::Surface;
use crate::textured_mesh::{Lengths, TexturedMesh, figures};
use rayon::prelude::*;
use semascan_model::SemanticMesh;
use semascan_rasterizer::Scene;

/// The longest edge of an atlas in texels: what every graphics card takes.
pub const LARGEST_ATLAS: u32 = 8192;
/// How much longer texels are made at a time until they fit.
const LONGER: f64 = 1.04;

/// How a texture is made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureOptions {
    /// Length of a texel on the surface, metres; `None`: that of the photographs' pixels, the median over the surface.
    pub texel: Option<f64>,
    /// The longest edge of the atlas, texels. Texels become longer until they fit.
    pub largest: u32,
}

impl Default for TextureOptions {
    fn default() -> Self {
        Self { texel: None, largest: LARGEST_ATLAS }
    }
}

/// Why there is no texture.
#[derive(Debug, thiserror::Error, PartialEq, Eq)]
pub enum TextureError {
    /// There is no face.
    #[error("the mesh has no faces")]
    NoFaces,
    /// There is no photograph.
    #[error("no photograph can be used{}", first_of(.left_out))]
    NoPhotograph {
        /// Why each could not be.
        left_out: Vec<String>,
    },
    /// No photograph shows the mesh.
    #[error("none of the {photographs} photographs shows any of the mesh")]
    NothingSeen {
        /// How many there are.
        photographs: usize,
    },
    /// The charts do not fit.
    #[error("an atlas of {largest} texels is too small")]
    TooSmall {
        /// Its longest edge.
        largest: u32,
    },
}

fn first_of(left_out: &[String]) -> String {
    left_out.first().map_or_else(String::new, |reason| format!(": {reason}"))
}

/// Makes the texture of `mesh` (table frame, metres) of `count` photographs. `photograph` gives them by their number, or says why it
/// does not; it is asked for all in order, and then again for some.
///
/// # Errors
/// [`TextureError`] if there is nothing to be seen.
pub fn texture<'a>(
    mesh: &SemanticMesh,
    count: u32,
    mut photograph: impl FnMut(u32) -> Result<Photograph<'a>, String>,
    options: &TextureOptions,
) -> Result<TexturedMesh, TextureError> {
    let surface = Surface::of(mesh);
    if surface.faces.is_empty() {
        return Err(TextureError::NoFaces);
    }
    // Every photograph is looked at once.
    let scene = Scene::of_shape(mesh);
    let mut sights = Sights::new(&surface);
    let mut cameras: Vec<Option<ChartCamera>> = Vec::new();
    let mut left_out = Vec::new();
    for view in 0..count {
        let looked_at = photograph(view).and_then(|photograph| match photograph.is_whole() {
            true => Ok(photograph),
            false => Err("has other pixels than its camera".to_owned()),
        });
        cameras.push(looked_at.as_ref().ok().map(|photograph| {
            sights.add(&surface, &scene, view, photograph);
            ChartCamera { intrinsics: photograph.intrinsics, table_from_camera: photograph.table_from_camera }
        }));
        left_out.extend(looked_at.err().map(|reason| format!("view {view}: {reason}")));
    }
    if cameras.iter().flatten().next().is_none() {
        return Err(TextureError::NoPhotograph { left_out });
    }

    // Each face gets one, faces that hang together become charts, and these their places.
    let views = assign_views(&surface, &sights);
    let charts = charts(&surface, &views, |view| cameras.get(view as usize).copied().flatten());
    if charts.is_empty() {
        return Err(TextureError::NothingSeen { photographs: cameras.iter().flatten().count() });
    }
    let pixel = median_footprint(&surface, &charts);
    let wanted = options.texel.unwrap_or(pixel);
    let (texel, packing) = packed(&charts, wanted, options.largest)?;

    // The photographs are asked again, for texels and for the colours that seams are levelled by.
    let nodes = Nodes::of(&surface, &charts);
    let mut tiles: Vec<Tile> = vec![Tile::default(); charts.len()];
    let mut colors = Samples::new(&nodes);
    let mut of_view: Vec<u32> = charts.iter().map(|chart| chart.view).collect();
    of_view.sort_unstable();
    of_view.dedup();
    for view in &of_view {
        match photograph(*view) {
            Ok(photograph) => {
                tiles.par_iter_mut().zip(&charts).filter(|(_, chart)| chart.view == *view).for_each(|(tile, chart)| {
                    *tile = bake(&surface, chart, &photograph, texel);
                });
                colors.take(&surface, &charts, &nodes, *view, &photograph);
            }
            Err(reason) => left_out.push(format!("view {view}: {reason}")),
        }
    }

    let corrections = level_seams(&nodes.unlevelled(&colors, &charts, &sights));
    tiles.par_iter_mut().zip(&charts).for_each(|(tile, chart)| {
        correct(tile, &surface, chart, &corrections, texel);
        pad(tile);
    });
    let atlas = compose(&packing, &tiles);
    let figures = figures(&surface, &charts, of_view.len(), left_out, Lengths { texel, wanted, pixel });
    let (mesh, places) = cut(mesh, &surface, &charts, &packing, texel);
    Ok(TexturedMesh { mesh, places, atlas, figures })
}

/// Pixels on the surface, metres: the median over its area.
fn median_footprint(surface: &Surface, charts: &[Chart]) -> f64 {
    let area = |chart: &Chart| chart.faces.iter().map(|face| surface.areas[*face]).sum::<f64>();
    let mut footprints: Vec<(f64, f64)> = charts.iter().map(|chart| (chart.footprint, area(chart))).collect();
    footprints.sort_by(|a, b| a.0.total_cmp(&b.0));
    let half = footprints.iter().map(|(_, area)| area).sum::<f64>() / 2.0;
    let mut sum = 0.0;
    let reached = footprints.iter().find(|(_, area)| {
        sum += area;
        sum >= half
    });
    reached.map_or(0.0, |(footprint, _)| *footprint)
}

/// The places of charts, and of the square for unseen faces behind them, with texels as long as wanted or as has to be.
fn packed(charts: &[Chart], wanted: f64, largest: u32) -> Result<(f64, Packing), TextureError> {
    let mut texel = wanted;
    // Charts shrink to their padding: when longer texels help no more, nothing does.
    while texel < 1e3 * wanted {
        let sizes = charts.iter().map(|chart| chart.size(texel)).chain([(UNSEEN_EDGE, UNSEEN_EDGE)]);
        if let Some(packing) = pack(&sizes.collect::<Vec<_>>(), largest) {
            return Ok((texel, packing));
        }
        texel *= LONGER;
    }
    Err(TextureError::TooSmall { largest })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::UNSEEN_COLOR;
    use crate::fixtures::{camera_above, quad};

    /// Stripes of 8 mm that grow brighter with x.
    fn print(x: f64, y: f64) -> [u8; 3] {
        let stripe = if (y * 125.0).rem_euclid(1.0) < 0.5 { 60.0 } else { 0.0 };
        [(90.0 + 300.0 * x + stripe) as u8, 100, (90.0 + stripe) as u8]
    }

    /// A plate, and a shelf whose lower side nobody sees, in photographs from left and right; the second has more light.
    fn scene() -> (SemanticMesh, Vec<Photograph<'static>>) {
        let mut mesh = SemanticMesh::default();
        quad(&mut mesh, [-0.15, -0.05], [0.15, 0.05], 0.0);
        let first = mesh.triangles.len();
        quad(&mut mesh, [-0.03, -0.03], [0.03, 0.03], -0.05);
        mesh.triangles[first..].iter_mut().for_each(|triangle| triangle.reverse());
        let brighter = |x: f64, y: f64| print(x, y).map(|c| c + 30);
        (mesh, vec![camera_above([-0.08, 0.0], 0.4, print), camera_above([0.08, 0.0], 0.4, brighter)])
    }

    fn textured(photographs: &[Photograph<'static>], mesh: &SemanticMesh, options: &TextureOptions) -> TexturedMesh {
        let photograph = |number: u32| Ok(photographs[number as usize].clone());
        texture(mesh, photographs.len() as u32, photograph, options).expect("a texture")
    }

    #[test]
    fn the_texture_shows_what_the_photographs_do_in_one_light() {
        let (mesh, photographs) = scene();
        let made = textured(&photographs, &mesh, &TextureOptions::default());
        assert_eq!((made.figures.charts, made.figures.photographs), (2, 2));
        assert!((made.figures.texel - 1e-3).abs() < 1e-6 && !made.figures.is_coarser, "{:?}", made.figures);
        // 800 of 1600 faces lie on the lower side, 36 of 336 square centimetres.
        assert_eq!((made.figures.unseen_faces, made.figures.faces), (800, 1600));
        assert!((made.figures.unseen - 36.0 / 336.0).abs() < 1e-3, "{}", made.figures.unseen);
        assert_eq!(made.mesh.triangles.len(), mesh.triangles.len());
        let (mut steps, mut worst) = (Vec::new(), 0.0_f32);
        for (number, triangle) in made.mesh.triangles.iter().enumerate() {
            assert_eq!(made.mesh.corners(*triangle), mesh.corners(mesh.triangles[number]), "faces keep their order");
            let middle = |of: &dyn Fn(usize) -> f32| triangle.iter().map(|v| of(*v as usize)).sum::<f32>() / 3.0;
            let place = [0, 1].map(|axis| middle(&|v| made.places[v][axis]));
            let [x, y] = [0, 1].map(|axis| middle(&|v| made.mesh.vertices.positions[v][axis]));
            assert!(place.iter().all(|c| (0.0..=1.0).contains(c)));
            let color = made.color_at(place);
            if number >= 800 {
                assert_eq!(color, UNSEEN_COLOR.map(f32::from));
                assert!(!made.is_seen_at(place));
                continue;
            }
            assert!(made.is_seen_at(place));
            let expected = print(f64::from(x), f64::from(y)).map(f32::from);
            // Not at the edges of stripes, where a texel has both.
            if [0.0, 0.0012]
                .iter()
                .all(|off| print(f64::from(x), f64::from(y) + off) == print(f64::from(x), f64::from(y) - off))
            {
                steps.push((x, color[0] - expected[0]));
                worst = worst.max((color[2] - expected[2] - (color[0] - expected[0])).abs());
            }
        }
        // Between the two lights, without a step of 30 levels where the charts meet.
        assert!(steps.iter().all(|(_, off)| (-3.0..33.0).contains(off)), "{steps:?}");
        let near = |low: f32, high: f32| {
            let of: Vec<f32> = steps.iter().filter(|(x, _)| (low..high).contains(x)).map(|(_, off)| *off).collect();
            of.iter().sum::<f32>() / of.len() as f32
        };
        assert!((near(-0.02, 0.0) - near(0.0, 0.02)).abs() < 6.0, "{} and {}", near(-0.02, 0.0), near(0.0, 0.02));
        assert!(worst < 4.0, "all channels are corrected alike: {worst}");
        let png = image::load_from_memory(&made.png().expect("encodes")).expect("a picture").into_rgba8();
        assert_eq!(png, made.atlas);
    }

    #[test]
    fn threads_do_not_matter_and_texels_fit() {
        let (mesh, photographs) = scene();
        let options = TextureOptions { texel: Some(0.25e-3), ..TextureOptions::default() };
        let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool");
        let three = rayon::ThreadPoolBuilder::new().num_threads(3).build().expect("a pool");
        let made = one.install(|| textured(&photographs, &mesh, &options));
        let again = three.install(|| textured(&photographs, &mesh, &options));
        assert!(made.atlas == again.atlas && made.places == again.places && made.mesh == again.mesh);
        assert!((made.figures.texel - 0.25e-3).abs() < 1e-9 && made.atlas.width() > 400);
        let small = textured(&photographs, &mesh, &TextureOptions { largest: 128, ..options });
        assert!(small.figures.is_coarser && small.figures.texel > 1e-3, "{:?}", small.figures);
        assert!(small.atlas.width() <= 128 && small.atlas.height() <= 128);
    }

    #[test]
    fn what_cannot_be_textured_says_why() {
        let (mesh, photographs) = scene();
        let options = TextureOptions::default();
        let none = texture(&mesh, 2, |_| Err("is gone".into()), &options);
        let expected =
            TextureError::NoPhotograph { left_out: vec!["view 0: is gone".into(), "view 1: is gone".into()] };
        assert_eq!(none.err(), Some(expected));
        let far = camera_above([5.0, 0.0], 0.4, print);
        let nothing = texture(&mesh, 1, |_| Ok(far.clone()), &options).err();
        assert_eq!(nothing, Some(TextureError::NothingSeen { photographs: 1 }));
        assert_eq!(
            texture(&SemanticMesh::default(), 0, |_| Err(String::new()), &options).err(),
            Some(TextureError::NoFaces)
        );
        let tiny = TextureOptions { largest: 16, ..options };
        let photograph = |number: u32| Ok(photographs[number as usize].clone());
        assert_eq!(texture(&mesh, 2, photograph, &tiny).err(), Some(TextureError::TooSmall { largest: 16 }));
        // One that cannot be used leaves the others.
        let half = |number: u32| match number {
            0 => Err("is damaged".into()),
            number => Ok(photographs[number as usize].clone()),
        };
        let made = texture(&mesh, 2, half, &options).expect("a texture");
        assert_eq!(made.figures.left_out, ["view 0: is damaged"]);
        assert!(made.figures.unseen > 36.0 / 336.0 + 0.1);
    }
}
