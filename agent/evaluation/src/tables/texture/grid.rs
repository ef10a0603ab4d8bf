//! A box with a printed grid, inspected: how much of the contrast of the print the photographs, the texture and the colours of
//! vertices have. It is measured as the amplitude at the grid's period in small windows, so that it does not depend on where
//! exactly the model lies.

use super::held_out::{in_atlas, vertex_color};
use super::{Baked, Config, TextureTableError, baked};
use image::{Rgb, RgbImage};
use nalgebra::Point3;
use semascan_inspection::record::isometry;
use semascan_perception::view::luma;
use semascan_rasterizer::SurfacePlace;
use serde::Serialize;
use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::fs;
use std::path::{Path, PathBuf};

/// Period of the grid, and width of its lines, metres.
const PERIOD: f64 = 2e-3;
const LINE: f64 = 0.7e-3;
/// Edges of the box, metres.
const BOX: [f64; 3] = [0.10, 0.08, 0.06];
/// Pixels of the print along a period.
const PIXELS: u32 = 20;
/// Edge of a window, metres: so many periods that the amplitude is that of the grid.
const WINDOW: f64 = 5.0 * PERIOD;
/// Places of the surface that are looked at, along the edge of a face.
const PLACES: u32 = 6;
/// Places that a window needs.
const LEAST_PLACES: u32 = 200;

/// Contrast of a printed grid: amplitudes at its period, levels of 255.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Legibility {
    /// Period of the grid, metres.
    pub period: f64,
    /// Length of a texel, metres.
    pub texel: f64,
    /// In the photographs, at the places of the surface.
    pub photographs: f64,
    /// In the texture.
    pub texture: f64,
    /// In the colours of the vertices.
    pub vertices: f64,
}

pub(super) fn printed(config: &Config) -> Result<Legibility, TextureTableError> {
    let part = "printed box";
    let failed = |path: PathBuf| {
        move |source: std::io::Error| TextureTableError::File { path: path.clone(), source: Box::new(source) }
    };
    let folder = tempfile::tempdir().map_err(failed(std::env::temp_dir()))?;
    write_box(folder.path())?;
    let path = folder.path().join("box.obj");
    let encoded: String = path.to_string_lossy().bytes().map(|byte| format!("%{byte:02x}")).collect();
    let (width, height) = config.size;
    let uri = format!("virtual:mesh?path={encoded}&unit=m&seed=5&views={}&size={width}x{height}", config.views);
    let Baked { inspected, views, textured } = baked(part, &uri)?;
    let poses = inspected.record.views.iter().filter(|view| view.accepted);
    let poses: Vec<_> = poses
        .filter_map(|view| Some((views.get(view.index as usize)?, isometry(view.pose.as_ref()?).inverse())))
        .collect();

    // The upper face, which all cameras that look down see.
    let mesh = &textured.mesh;
    let top = mesh.vertices.positions.iter().map(|p| p[2]).fold(f32::NEG_INFINITY, f32::max);
    let is_on_top = |v: u32| {
        let (position, normal) = (mesh.vertices.positions[v as usize], mesh.vertices.normals[v as usize]);
        position[2] > top - 2e-3 && normal[2] > 0.95
    };
    let mut windows: BTreeMap<(i64, i64), [Wave; 3]> = BTreeMap::new();
    for corners in mesh.triangles.iter().filter(|triangle| triangle.iter().all(|v| is_on_top(*v))) {
        for (i, j) in (0..PLACES).flat_map(|i| (0..PLACES - i).map(move |j| (i, j))) {
            let share = |k: u32| (k as f32 + 1.0 / 3.0) / PLACES as f32;
            let weights = [share(i), share(j), 1.0 - share(i) - share(j)];
            let place = SurfacePlace { depth: 0.0, corners: *corners, weights, is_outside: true };
            let in_atlas = in_atlas(&textured, &place);
            if !textured.is_seen_at(in_atlas) {
                continue;
            }
            let point = [0, 1, 2].map(|axis| {
                (0..3).map(|k| f64::from(weights[k] * mesh.vertices.positions[corners[k] as usize][axis])).sum::<f64>()
            });
            // The photograph that looks down most steeply.
            let steepest = poses.iter().filter_map(|(view, camera_from_table)| {
                let p = camera_from_table * Point3::from(point);
                let pixel = view.intrinsics.project(&p).and_then(|(u, v)| view.intrinsics.pixel(u, v))?;
                let width = view.rgb.width() as usize;
                let color = view.rgb.get_pixel((pixel % width) as u32, (pixel / width) as u32).0;
                let eye = camera_from_table.inverse() * Point3::origin();
                let toward = eye - Point3::from(point);
                Some((toward.z / toward.norm(), luma(color)))
            });
            let Some((_, photograph)) = steepest.max_by(|a, b| a.0.total_cmp(&b.0)) else { continue };
            let grey = |color: [f32; 3]| luma(color.map(|c| c.clamp(0.0, 255.0) as u8));
            let greys = [photograph, grey(textured.color_at(in_atlas)), grey(vertex_color(&textured, &place))];
            let window = [0, 1].map(|axis| (point[axis] / WINDOW).floor() as i64);
            let waves = windows.entry((window[0], window[1])).or_default();
            waves.iter_mut().zip(greys).for_each(|(wave, grey)| wave.add([point[0], point[1]], f64::from(grey)));
        }
    }
    let of = |which: usize| {
        let amplitudes: Vec<f64> = windows.values().filter_map(|waves| waves[which].amplitude()).collect();
        amplitudes.iter().sum::<f64>() / amplitudes.len().max(1) as f64
    };
    Ok(Legibility {
        period: PERIOD,
        texel: textured.figures.texel,
        photographs: of(0),
        texture: of(1),
        vertices: of(2),
    })
}

/// Sums for the amplitude at the grid's period, along both axes.
#[derive(Clone, Copy, Debug, Default)]
struct Wave {
    count: u32,
    mean: f64,
    /// Of cosine and sine by axis: with the value, and alone.
    with_value: [[f64; 2]; 2],
    alone: [[f64; 2]; 2],
}

impl Wave {
    fn add(&mut self, place: [f64; 2], value: f64) {
        self.count += 1;
        self.mean += value;
        for (axis, along) in place.into_iter().enumerate() {
            let (sine, cosine) = (TAU * along / PERIOD).sin_cos();
            for (k, factor) in [cosine, sine].into_iter().enumerate() {
                self.with_value[axis][k] += value * factor;
                self.alone[axis][k] += factor;
            }
        }
    }

    /// Mean amplitude of both axes; `None` in windows with too few places.
    fn amplitude(&self) -> Option<f64> {
        let count = f64::from(self.count);
        let of = |axis: usize| {
            // A window that is not whole has a mean of its own, which is no part of the wave.
            let part = |k: usize| (self.with_value[axis][k] - self.mean / count * self.alone[axis][k]) / count;
            2.0 * part(0).hypot(part(1))
        };
        (self.count >= LEAST_PLACES).then(|| (of(0) + of(1)) / 2.0)
    }
}

/// Writes the box with the print on all of its sides.
fn write_box(folder: &Path) -> Result<(), TextureTableError> {
    let failed = |path: PathBuf| {
        move |source: std::io::Error| TextureTableError::File { path: path.clone(), source: Box::new(source) }
    };
    let share = |pixel: u32| f64::from(pixel % PIXELS) / f64::from(PIXELS) * PERIOD < LINE;
    let print =
        RgbImage::from_fn(10 * PIXELS, 10 * PIXELS, |x, y| Rgb([if share(x) || share(y) { 50 } else { 205 }; 3]));
    let path = folder.join("grid.png");
    let wrong = |source: image::ImageError| TextureTableError::File { path: path.clone(), source: Box::new(source) };
    print.save(&path).map_err(wrong)?;
    let path = folder.join("box.mtl");
    fs::write(&path, "newmtl print\nKd 1 1 1\nmap_Kd grid.png\n").map_err(failed(path.clone()))?;
    let mut text = String::from("mtllib box.mtl\nusemtl print\n");
    let (mut vertices, mut faces) = (String::new(), String::new());
    let mut count = 0;
    for (axis, edge) in BOX.into_iter().enumerate() {
        let (a, b) = ((axis + 1) % 3, (axis + 2) % 3);
        for side in [0.0, 1.0] {
            let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
            for [s, t] in corners {
                let mut p = [0.0; 3];
                (p[axis], p[a], p[b]) = (side * edge, s * BOX[a], t * BOX[b]);
                vertices += &format!("v {} {} {}\n", p[0] - BOX[0] / 2.0, p[1] - BOX[1] / 2.0, p[2]);
                // The picture holds ten periods and repeats.
                vertices += &format!("vt {} {}\n", s * BOX[a] / (10.0 * PERIOD), t * BOX[b] / (10.0 * PERIOD));
            }
            let order: [u32; 4] = if side > 0.5 { [1, 2, 3, 4] } else { [4, 3, 2, 1] };
            let corner = order.map(|k| format!("{0}/{0}", count + k)).join(" ");
            faces += &format!("f {corner}\n");
            count += 4;
        }
    }
    text += &vertices;
    text += &faces;
    let path = folder.join("box.obj");
    fs::write(&path, text).map_err(failed(path.clone()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_amplitude_of_a_wave_is_found_wherever_it_lies() {
        for phase in [0.0, 0.7, 2.0] {
            let mut wave = Wave::default();
            for i in 0..4000_u32 {
                let place = [f64::from(i % 50) * 2e-4, f64::from(i / 50) * 1.25e-4];
                let of = |x: f64| 20.0 * (TAU * x / PERIOD + phase).cos();
                wave.add(place, 100.0 + of(place[0]) + of(place[1]));
            }
            let amplitude = wave.amplitude().expect("many places");
            assert!((amplitude - 20.0).abs() < 0.5, "{amplitude}");
        }
        assert_eq!(Wave::default().amplitude(), None);
    }
}
