//! The scene on the turntable, ready to be seen: part, chuck and table as one labelled triangle soup with appearance.
//!
//! Geometry is in the table frame in metres; appearance is evaluated in the part's own frame in millimetres.

use std::sync::Arc;

use glam::{Affine3A, Mat3A, Vec2, Vec3};
use image::RgbImage;
use rayon::prelude::*;

use super::appearance::{Appearance, Finish, Grime};
use super::defects::Defects;
use super::noise::{hash2, unit};
use super::raycast::{Hit, RayScene};
use semascan_inspection::source::TrueMesh;

/// Class, instance and finish of a triangle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Tag {
    /// Component class; 0 for table and chuck.
    pub(super) class: u16,
    /// Instance; 0 for table and chuck.
    pub(super) instance: u16,
    /// Index into the finishes.
    pub(super) finish: u16,
    /// Index of the texture plus one; 0 = none.
    pub(super) texture: u16,
    /// Whether it belongs to what the inspection looks at (part and chuck) and not to the table.
    pub(super) in_truth: bool,
}

/// Triangles with everything rendering needs.
#[derive(Debug, Default)]
pub(super) struct SceneMesh {
    /// Metres, table frame.
    pub(super) vertices: Vec<[f32; 3]>,
    /// Counter-clockwise seen from outside.
    pub(super) triangles: Vec<[u32; 3]>,
    /// Shading normals of each triangle's corners.
    pub(super) normals: Vec<[Vec3; 3]>,
    /// Texture coordinates of each triangle's corners; zero where there is no texture.
    pub(super) uvs: Vec<[Vec2; 3]>,
    /// What each triangle is.
    pub(super) tags: Vec<Tag>,
    /// Linear vertex colours of the first triangles' corners, for as many as have them.
    pub(super) tints: Vec<[Vec3; 3]>,
}

/// A point of the scene's surface as a ray found it.
#[derive(Clone, Copy, Debug)]
pub(super) struct SurfacePoint {
    /// Metres, table frame.
    pub(super) position: Vec3,
    /// Geometric normal, towards the viewer.
    pub(super) face: Vec3,
    /// Shading normal, bump included.
    pub(super) normal: Vec3,
    /// Colour and gloss.
    pub(super) appearance: Appearance,
    /// Share of the surroundings the point sees, 0..=1.
    pub(super) openness: f32,
    /// What the triangle is.
    pub(super) tag: Tag,
    /// Defect class; 0 = none.
    pub(super) defect: u16,
}

/// How the scene's surfaces look: what may change while the shape stays.
#[derive(Clone, Debug)]
pub(super) struct Dress {
    /// What the tags' finishes name.
    pub(super) finishes: Vec<Finish>,
    /// What the tags' textures name.
    pub(super) textures: Vec<RgbImage>,
    pub(super) grime: Grime,
    pub(super) defects: Defects,
}

/// The scene.
#[derive(Debug)]
pub(super) struct Scene {
    pub(super) mesh: Arc<SceneMesh>,
    pub(super) rays: Arc<RayScene>,
    openness: Arc<Vec<f32>>,
    dress: Dress,
    part_from_table: Affine3A,
    /// Turns directions of the part's frame into the table frame.
    turn: Mat3A,
}

impl Scene {
    /// Prepares `mesh`; `table_from_part` takes the part's millimetres to the table frame's metres.
    pub(super) fn new(mesh: SceneMesh, dress: Dress, table_from_part: Affine3A) -> Self {
        let rays = RayScene::new(&mesh.vertices, &mesh.triangles);
        let openness = openness(&mesh, &rays);
        let part_from_table = table_from_part.inverse();
        let turn = table_from_part.matrix3 * (1.0 / table_from_part.matrix3.x_axis.length());
        let (mesh, rays, openness) = (Arc::new(mesh), Arc::new(rays), Arc::new(openness));
        Self { mesh, rays, openness, dress, part_from_table, turn }
    }

    /// The same shapes in another dress.
    pub(super) fn dressed(&self, dress: Dress) -> Self {
        Self {
            mesh: Arc::clone(&self.mesh),
            rays: Arc::clone(&self.rays),
            openness: Arc::clone(&self.openness),
            dress,
            ..*self
        }
    }

    /// Component and defect class at a hit, without the appearance.
    pub(super) fn labels(&self, hit: &Hit, position: Vec3) -> (Tag, u16) {
        let tag = self.mesh.tags[hit.triangle as usize];
        (tag, self.defect_at(position.to_array(), tag.class))
    }

    /// Defect class at a point (metres, table frame) of a component.
    pub(super) fn defect_at(&self, position: [f32; 3], class: u16) -> u16 {
        self.dress.defects.class_at(self.part_from_table.transform_point3(Vec3::from_array(position)), class)
    }

    /// Everything about the surface at a hit.
    pub(super) fn surface(&self, hit: &Hit, origin: Vec3, direction: Vec3) -> SurfacePoint {
        let i = hit.triangle as usize;
        let ids = self.mesh.triangles[i];
        let [v, w] = hit.barycentric;
        let weights = [1.0 - v - w, v, w];
        let position = origin + direction * hit.t;
        let [a, b, c] = ids.map(|k| Vec3::from_array(self.mesh.vertices[k as usize]));
        let mut face = (b - a).cross(c - a).normalize_or(-direction);
        let smooth = (0..3).map(|k| self.mesh.normals[i][k] * weights[k]).sum::<Vec3>();
        let mut normal = smooth.normalize_or(face);
        if face.dot(direction) > 0.0 {
            (face, normal) = (-face, -normal);
        }
        let openness = (0..3).map(|k| self.openness[ids[k] as usize] * weights[k]).sum::<f32>();
        let (tag, defect) = self.labels(hit, position);
        let p = self.part_from_table.transform_point3(position);
        let mut appearance = self.dress.finishes[tag.finish as usize].at(p);
        if let Some(texture) = self.dress.textures.get((tag.texture as usize).wrapping_sub(1)) {
            let uv = (0..3).map(|k| self.mesh.uvs[i][k] * weights[k]).sum::<Vec2>();
            appearance.base *= texel(texture, uv);
        }
        if let Some(tint) = self.mesh.tints.get(i) {
            appearance.base *= (0..3).map(|k| tint[k] * weights[k]).sum::<Vec3>();
        }
        if tag.class != 0 {
            self.dress.grime.cover(&mut appearance, p, openness);
            self.dress.defects.paint(defect, &mut appearance, p);
        }
        let bumped = (normal + self.turn * appearance.bump).normalize_or(normal);
        // A bump must not turn a visible point away from the viewer.
        let normal = if bumped.dot(direction) < -0.02 { bumped } else { normal };
        SurfacePoint { position, face, normal, appearance, openness, tag, defect }
    }

    /// The true surface above `floor` metres, labelled at the vertices.
    pub(super) fn truth(&self, floor: f32) -> TrueMesh {
        let mut truth = TrueMesh::default();
        let mut index = vec![u32::MAX; self.mesh.vertices.len()];
        for (ids, tag) in self.mesh.triangles.iter().zip(&self.mesh.tags) {
            if !tag.in_truth || ids.iter().all(|&i| self.mesh.vertices[i as usize][2] < floor) {
                continue;
            }
            truth.triangles.push(ids.map(|i| {
                let slot = &mut index[i as usize];
                if *slot == u32::MAX {
                    *slot = truth.vertices.len() as u32;
                    let v = self.mesh.vertices[i as usize];
                    truth.vertices.push(v);
                    truth.labels.push(tag.class);
                    truth.defects.push(self.defect_at(v, tag.class));
                }
                *slot
            }));
        }
        truth
    }
}

/// Bilinear texel in linear colour; `uv` repeats, v upwards.
fn texel(image: &RgbImage, uv: Vec2) -> Vec3 {
    let (w, h) = image.dimensions();
    let x = (uv.x - uv.x.floor()) * w as f32 - 0.5;
    let y = (1.0 - (uv.y - uv.y.floor())) * h as f32 - 0.5;
    let (x0, y0) = (x.floor(), y.floor());
    let at = |dx: f32, dy: f32| {
        let c =
            image.get_pixel((x0 + dx).clamp(0.0, w as f32 - 1.0) as u32, (y0 + dy).clamp(0.0, h as f32 - 1.0) as u32);
        Vec3::from_array(c.0.map(|v| (f32::from(v) / 255.0).powf(2.2)))
    };
    let top = at(0.0, 0.0).lerp(at(1.0, 0.0), x - x0);
    let bottom = at(0.0, 1.0).lerp(at(1.0, 1.0), x - x0);
    top.lerp(bottom, y - y0)
}

/// Ambient occlusion at every vertex: the share of short cosine-weighted rays that escape, smoothed over neighbours.
fn openness(mesh: &SceneMesh, rays: &RayScene) -> Vec<f32> {
    const RAYS: u32 = 14;
    const REACH: f32 = 0.045;
    let mut normals = vec![Vec3::ZERO; mesh.vertices.len()];
    for (ids, corner) in mesh.triangles.iter().zip(&mesh.normals) {
        for k in 0..3 {
            normals[ids[k] as usize] += corner[k];
        }
    }
    let raw: Vec<f32> = (0..mesh.vertices.len())
        .into_par_iter()
        .map(|i| {
            let n = normals[i].normalize_or(Vec3::Z);
            let (tangent, bitangent) = n.any_orthonormal_pair();
            let origin = Vec3::from_array(mesh.vertices[i]) + n * 4e-4;
            let turn = unit(hash2(i as u32, 77));
            let free = (0..RAYS)
                .filter(|&k| {
                    let u = (k as f32 + 0.5) / RAYS as f32;
                    let angle = std::f32::consts::TAU * (k as f32 * 0.618_034 + turn);
                    let (sin, cos) = angle.sin_cos();
                    let d = (tangent * cos + bitangent * sin) * u.sqrt() + n * (1.0 - u).sqrt();
                    !rays.is_blocked(origin, d, REACH)
                })
                .count();
            free as f32 / RAYS as f32
        })
        .collect();
    smooth(&mesh.triangles, smooth(&mesh.triangles, raw))
}

fn smooth(triangles: &[[u32; 3]], values: Vec<f32>) -> Vec<f32> {
    let mut sums: Vec<(f32, f32)> = values.iter().map(|v| (*v, 1.0)).collect();
    for ids in triangles {
        let mean = ids.iter().map(|&i| values[i as usize]).sum::<f32>() / 3.0;
        for &i in ids {
            sums[i as usize].0 += mean;
            sums[i as usize].1 += 1.0;
        }
    }
    sums.into_iter().map(|(sum, n)| sum / n).collect()
}
