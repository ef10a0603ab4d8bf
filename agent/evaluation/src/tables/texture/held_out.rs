//! A motor's texture and the colours of its vertices, drawn from places where no photograph was taken, against what the
//! simulation shows there.

use super::{Baked, Config, Motor, TextureTableError, baked};
use image::{Rgb, RgbImage};
use nalgebra::{Isometry3, Quaternion, UnitQuaternion, Vector3};
use rayon::prelude::*;
use semascan_inspection::record::isometry;
use semascan_perception::view::View;
use semascan_rasterizer::{Camera, Scene, SeenSurface, SurfacePlace};
use semascan_simulation::{VirtualCell, VirtualCellSpec};
use semascan_texture::TexturedMesh;
use serde::Serialize;
use std::path::Path;

/// Half the edge in pixels of the square whose mean a pixel is compared with, for details.
const DETAIL_REACH: usize = 6;
/// What the model is compared with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Against {
    /// The photographs that the texture is made of.
    Own,
    /// Photographs from elsewhere: lamps stand in the room, so the part has other light in them, too.
    HeldOut,
}

impl Against {
    /// In the order of the table.
    pub const ALL: [Self; 2] = [Self::Own, Self::HeldOut];

    /// For people.
    pub fn name(self) -> &'static str {
        match self {
            Self::Own => "the photographs themselves",
            Self::HeldOut => "held-out photographs",
        }
    }
}

/// Mean absolute errors in levels (0 to 255, mean over the channels) over the pixels that show the part.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ColorErrors {
    /// What with.
    pub against: Against,
    /// Of the texture.
    pub texture: f64,
    /// Of the colours of vertices.
    pub vertices: f64,
    /// Of details: what differs from the mean of the surroundings.
    pub texture_details: f64,
    /// The same of the colours of vertices.
    pub vertex_details: f64,
    /// Mean size of the details themselves.
    pub details: f64,
    /// Pixels.
    pub pixels: u64,
}

pub(super) fn motor(config: &Config, seed: u64) -> Result<Motor, TextureTableError> {
    let (width, height) = config.size;
    let uri = |views: u32| format!("virtual:starter-motor?seed={seed}&views={views}&size={width}x{height}");
    let part = format!("motor {seed}");
    let Baked { inspected, views, textured } = baked(&part, &uri(config.views))?;
    let record = &inspected.record;
    let poses = record.views.iter().filter(|view| view.accepted);
    let poses = poses.filter_map(|view| Some((views.get(view.index as usize)?, isometry(view.pose.as_ref()?))));
    let poses: Vec<(&View, Isometry3<f64>)> = poses.collect();
    let model_from_truth = model_from_truth(&poses).ok_or(TextureTableError::NoTruth { part })?;

    let scene = Scene::of_shape(&textured.mesh);
    let mut sums = Against::ALL.map(Sums::new);
    for (view, pose) in &poses {
        let drawn = Drawn::of(&textured, &scene, view, pose);
        sums[0].add(&drawn, &view.rgb);
    }
    let twice = VirtualCell::open(&VirtualCellSpec::parse(&uri(2 * config.views))?)?;
    for index in (1..2 * config.views).step_by(2) {
        let Some(view) = twice.view(index) else { continue };
        let Some(truth) = &view.truth else { continue };
        let drawn = Drawn::of(&textured, &scene, &view, &(model_from_truth * truth.table_from_camera));
        sums[1].add(&drawn, &view.rgb);
        if let Some(folder) = &config.pictures {
            let path = folder.join(format!("{seed}-{index:02}.png"));
            save(&path, &[&view.rgb, &drawn.texture, &drawn.vertices])?;
        }
    }
    let bytes = textured.png().map_or(0, |png| png.len());
    Ok(Motor {
        seed,
        voxel: record.voxel.unwrap_or(0.0),
        texel: textured.figures.texel,
        atlas: textured.atlas.dimensions(),
        bytes,
        charts: textured.figures.charts,
        unseen: textured.figures.unseen,
        errors: sums.map(|sums| sums.errors()).to_vec(),
    })
}

/// The model lies a little off the true table frame, as calibrations do: the mean motion between recorded and true poses.
fn model_from_truth(poses: &[(&View, Isometry3<f64>)]) -> Option<Isometry3<f64>> {
    let moved = poses.iter().filter_map(|(view, pose)| Some(pose * view.truth.as_ref()?.table_from_camera.inverse()));
    let moved: Vec<Isometry3<f64>> = moved.collect();
    let first = moved.first()?.rotation;
    let (mut turn, mut shift) = (Quaternion::new(0.0, 0.0, 0.0, 0.0), Vector3::zeros());
    for one in &moved {
        let sign = if one.rotation.coords.dot(&first.coords) < 0.0 { -1.0 } else { 1.0 };
        turn += one.rotation.into_inner() * sign;
        shift += one.translation.vector;
    }
    let shift = shift / moved.len() as f64;
    Some(Isometry3::from_parts(shift.into(), UnitQuaternion::from_quaternion(turn)))
}

/// The model as a camera sees it.
struct Drawn {
    texture: RgbImage,
    vertices: RgbImage,
    /// Pixels that show the part, in truth and in the model, where some photograph shows it.
    is_part: Vec<bool>,
}

impl Drawn {
    fn of(textured: &TexturedMesh, scene: &Scene<'_>, view: &View, table_from_camera: &Isometry3<f64>) -> Self {
        let camera = Camera { intrinsics: view.intrinsics, table_from_camera: *table_from_camera };
        let seen = SeenSurface::of(scene, &camera);
        let (width, height) = (view.intrinsics.width, view.intrinsics.height);
        let (mut texture, mut vertices) = (RgbImage::new(width, height), RgbImage::new(width, height));
        let mut is_part = vec![false; seen.places.len()];
        for (at, place) in seen.places.iter().enumerate() {
            let Some(place) = place else { continue };
            let (x, y) = ((at % seen.width) as u32, (at / seen.width) as u32);
            let in_atlas = in_atlas(textured, place);
            texture.put_pixel(x, y, pixel(textured.color_at(in_atlas)));
            vertices.put_pixel(x, y, pixel(vertex_color(textured, place)));
            let truly = view.labels.as_ref().is_none_or(|labels| labels.shows_component(at));
            is_part[at] = truly && place.is_outside && textured.is_seen_at(in_atlas);
        }
        Self { texture, vertices, is_part }
    }
}

/// Where a place of the surface lies in the atlas.
pub(super) fn in_atlas(textured: &TexturedMesh, place: &SurfacePlace) -> [f32; 2] {
    let corners = place.corners.map(|v| textured.places[v as usize]);
    [0, 1].map(|axis| (0..3).map(|k| place.weights[k] * corners[k][axis]).sum())
}

/// The colour that graphics cards give a place between its vertices.
pub(super) fn vertex_color(textured: &TexturedMesh, place: &SurfacePlace) -> [f32; 3] {
    let corners = place.corners.map(|v| textured.mesh.vertices.colors[v as usize]);
    [0, 1, 2].map(|channel| (0..3).map(|k| place.weights[k] * f32::from(corners[k][channel])).sum())
}

fn pixel(color: [f32; 3]) -> Rgb<u8> {
    Rgb(color.map(|c| (c.clamp(0.0, 255.0) + 0.5) as u8))
}

/// Errors while they sum up.
struct Sums {
    against: Against,
    /// Texture, vertices, details of both, and details themselves.
    of: [f64; 5],
    pixels: u64,
}

impl Sums {
    fn new(against: Against) -> Self {
        Self { against, of: [0.0; 5], pixels: 0 }
    }

    fn add(&mut self, drawn: &Drawn, truth: &RgbImage) {
        if truth.dimensions() != drawn.texture.dimensions() {
            return;
        }
        let details = [truth, &drawn.texture, &drawn.vertices].map(|picture| details(picture, &drawn.is_part));
        let width = truth.width() as usize;
        for (at, _) in drawn.is_part.iter().enumerate().filter(|(_, is_part)| **is_part) {
            let (x, y) = ((at % width) as u32, (at / width) as u32);
            let [true_color, texture, vertices] =
                [truth, &drawn.texture, &drawn.vertices].map(|picture| picture.get_pixel(x, y).0.map(f32::from));
            let [true_detail, texture_detail, vertex_detail] = details.each_ref().map(|details| details[at]);
            let errors = [
                apart(texture, true_color),
                apart(vertices, true_color),
                apart(texture_detail, true_detail),
                apart(vertex_detail, true_detail),
                apart(true_detail, [0.0; 3]),
            ];
            self.of.iter_mut().zip(errors).for_each(|(sum, error)| *sum += f64::from(error));
            self.pixels += 1;
        }
    }

    fn errors(&self) -> ColorErrors {
        let [texture, vertices, texture_details, vertex_details, details] =
            self.of.map(|sum| sum / self.pixels.max(1) as f64);
        let (against, pixels) = (self.against, self.pixels);
        ColorErrors { against, texture, vertices, texture_details, vertex_details, details, pixels }
    }
}

fn apart(a: [f32; 3], b: [f32; 3]) -> f32 {
    (0..3).map(|k| (a[k] - b[k]).abs()).sum::<f32>() / 3.0
}

/// Each pixel of the part less the mean of those of the part around it.
fn details(picture: &RgbImage, is_part: &[bool]) -> Vec<[f32; 3]> {
    let (width, height) = (picture.width() as usize, picture.height() as usize);
    let color = |at: usize| picture.get_pixel((at % width) as u32, (at / width) as u32).0.map(f32::from);
    (0..width * height)
        .into_par_iter()
        .map(|at| {
            if !is_part[at] {
                return [0.0; 3];
            }
            let (x, y) = (at % width, at / width);
            let (mut sum, mut count) = ([0.0_f32; 3], 0.0_f32);
            for row in y.saturating_sub(DETAIL_REACH)..(y + DETAIL_REACH + 1).min(height) {
                for column in x.saturating_sub(DETAIL_REACH)..(x + DETAIL_REACH + 1).min(width) {
                    let beside = row * width + column;
                    if is_part[beside] {
                        let color = color(beside);
                        sum = [0, 1, 2].map(|k| sum[k] + color[k]);
                        count += 1.0;
                    }
                }
            }
            let own = color(at);
            [0, 1, 2].map(|k| own[k] - sum[k] / count)
        })
        .collect()
}

/// The mean of several lists of errors, each counting alike.
pub(super) fn mean_errors<'a>(lists: impl Iterator<Item = &'a [ColorErrors]>) -> Vec<ColorErrors> {
    let lists: Vec<&[ColorErrors]> = lists.collect();
    let mean = |against: Against| {
        let all: Vec<&ColorErrors> =
            lists.iter().flat_map(|list| list.iter()).filter(|e| e.against == against).collect();
        let of = |value: fn(&ColorErrors) -> f64| all.iter().map(|e| value(e)).sum::<f64>() / all.len().max(1) as f64;
        ColorErrors {
            against,
            texture: of(|e| e.texture),
            vertices: of(|e| e.vertices),
            texture_details: of(|e| e.texture_details),
            vertex_details: of(|e| e.vertex_details),
            details: of(|e| e.details),
            pixels: all.iter().map(|e| e.pixels).sum(),
        }
    };
    Against::ALL.into_iter().map(mean).collect()
}

/// Writes pictures side by side.
fn save(path: &Path, pictures: &[&RgbImage]) -> Result<(), TextureTableError> {
    let width = pictures.iter().map(|picture| picture.width()).sum();
    let height = pictures.iter().map(|picture| picture.height()).max().unwrap_or(0);
    let mut sheet = RgbImage::new(width, height);
    let mut left = 0;
    for picture in pictures {
        image::imageops::replace(&mut sheet, *picture, left, 0);
        left += i64::from(picture.width());
    }
    sheet.save(path).map_err(|source| TextureTableError::File { path: path.to_owned(), source: Box::new(source) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn details_are_what_differs_from_the_surroundings() {
        let flat = RgbImage::from_pixel(40, 40, Rgb([70; 3]));
        let is_part = vec![true; 1600];
        assert!(details(&flat, &is_part).iter().all(|d| d[0].abs() < 1e-3));
        let striped = RgbImage::from_fn(40, 40, |x, _| Rgb([if x % 2 == 0 { 60 } else { 80 }; 3]));
        let middle = details(&striped, &is_part)[20 * 40 + 20];
        assert!((-11.0..-9.0).contains(&middle[0]), "{middle:?}");
    }
}
