//! Supervoxels: Voxel Cloud Connectivity Segmentation [Papon 2013], the over-segmentation that [Eye-in-hand 2020],
//! section 3.1.2, starts from.
//!
//! Seeds stand a seed cell apart. Each grows over touching voxels, a ring a round, and takes every voxel that is nearer
//! to it than to its owner: `D = l_n (1 - |n.n'|) + l_c |dRGB|/255 + l_s |dx|/R`. Centroids move after each round.
//! Supervoxels take their turn in the Morton order of their seed cells, so the result depends on the points alone.

use super::normals::voxel_normals;
use super::points::ColoredPoints;
use super::seed_cells::SeedCells;
use super::voxel_grid::{NONE, VoxelGrid};
use semascan_geometry::vector::{dot, squared_distance, unit};

/// How supervoxels are grown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VccsConfig {
    /// Voxel edge r, metres.
    pub voxel: f32,
    /// Seed cell edge R, metres.
    pub seed: f32,
    /// Weight of colour, l_c.
    pub color: f32,
    /// Weight of distance, l_s.
    pub spatial: f32,
    /// Weight of the normal, l_n.
    pub normal: f32,
    /// How often supervoxels are grown anew from the voxels nearest to their centroids.
    pub refinements: u32,
}

impl VccsConfig {
    /// The usual ratio of lengths and weights (R = 4 r, l = (0, 1, 4)) for a voxel edge in metres.
    pub fn new(voxel: f32) -> Self {
        Self { voxel, seed: 4.0 * voxel, color: 0.0, spatial: 1.0, normal: 4.0, refinements: 0 }
    }
}

/// A voxel or the mean of several.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Patch {
    /// Metres.
    pub position: [f32; 3],
    /// Unit normal towards the sensor; zero where unknown.
    pub normal: [f32; 3],
    /// Mean colour, 0 to 255.
    pub color: [f32; 3],
    /// Voxels in it.
    pub voxels: u32,
}

/// Supervoxels of a cloud and which of them touch.
#[derive(Clone, Debug, Default)]
pub struct Supervoxels {
    /// The supervoxels.
    pub patches: Vec<Patch>,
    /// Pairs of touching supervoxels, lower index first, in order.
    pub edges: Vec<[u32; 2]>,
    /// Supervoxel of each point; [`NONE`] for points that are missing or that none reached.
    pub of_point: Vec<u32>,
}

impl Supervoxels {
    /// Grows supervoxels over `points`. None are grown where a setting is no length.
    pub fn grow(points: &ColoredPoints, config: &VccsConfig) -> Self {
        let grid = VoxelGrid::new(points, config.voxel);
        let mut growth = Growth::new(&grid, config);
        for round in 0..=config.refinements {
            if round > 0 {
                growth.reseed();
            }
            growth.run();
        }
        growth.finish()
    }
}

struct Growth<'a> {
    grid: &'a VoxelGrid,
    config: VccsConfig,
    seeds: SeedCells,
    /// What distances are measured to.
    voxels: Vec<Patch>,
    owner: Vec<u32>,
    distance: Vec<f32>,
    patches: Vec<Patch>,
    members: Vec<Vec<u32>>,
}

impl<'a> Growth<'a> {
    fn new(grid: &'a VoxelGrid, config: &VccsConfig) -> Self {
        let normals = voxel_normals(grid);
        let voxel =
            |i: usize| Patch { position: grid.positions[i], normal: normals[i], color: grid.colors[i], voxels: 1 };
        let mut growth = Self {
            owner: vec![NONE; grid.len()],
            distance: vec![f32::INFINITY; grid.len()],
            voxels: (0..grid.len()).map(voxel).collect(),
            patches: Vec::new(),
            members: Vec::new(),
            config: *config,
            seeds: SeedCells::new(&grid.positions, config.seed),
            grid,
        };
        // A twentieth of the voxels of a plane through a ball as wide as a seed cell.
        let radius = 0.5 * config.seed;
        let fewest = 0.05 * std::f32::consts::PI * radius * radius / (config.voxel * config.voxel);
        for voxel in growth.seeds.seeds(&grid.positions, radius, fewest) {
            growth.plant(voxel);
        }
        growth
    }

    fn plant(&mut self, voxel: u32) {
        let v = voxel as usize;
        if self.owner[v] != NONE {
            return;
        }
        self.owner[v] = self.patches.len() as u32;
        self.patches.push(self.voxels[v]);
        self.members.push(vec![voxel]);
    }

    fn run(&mut self) {
        let rounds = (1.8 * self.config.seed / self.config.voxel) as u32;
        for _ in 1..rounds.min(1000) {
            for i in 0..self.patches.len() {
                self.expand(i as u32);
            }
            for i in 0..self.patches.len() {
                self.recentre(i as u32);
            }
        }
    }

    /// One ring of growth. What others took is dropped from the members first.
    fn expand(&mut self, i: u32) {
        let (owner, patch) = (&mut self.owner, self.patches[i as usize]);
        let mut members = std::mem::take(&mut self.members[i as usize]);
        members.retain(|&v| owner[v as usize] == i);
        let before = members.len();
        for at in 0..before {
            for &v in self.grid.neighbours(members[at]) {
                let u = v as usize;
                if owner[u] == i {
                    continue;
                }
                if let Some(d) = distance_below(self.distance[u], &self.config, &patch, &self.voxels[u]) {
                    self.distance[u] = d;
                    owner[u] = i;
                    members.push(v);
                }
            }
        }
        self.members[i as usize] = members;
    }

    fn recentre(&mut self, i: u32) {
        let (mut mean, mut n) = (Patch::default(), 0_u32);
        for &v in self.members[i as usize].iter().filter(|&&v| self.owner[v as usize] == i) {
            n += 1;
            let voxel = &self.voxels[v as usize];
            for a in 0..3 {
                mean.position[a] += voxel.position[a];
                mean.normal[a] += voxel.normal[a];
                mean.color[a] += voxel.color[a];
            }
        }
        let patch = &mut self.patches[i as usize];
        patch.voxels = n;
        if n > 0 {
            let share = 1.0 / n as f32;
            *patch = Patch {
                position: mean.position.map(|x| x * share),
                normal: unit(mean.normal, 1e-6).unwrap_or_default(),
                color: mean.color.map(|c| c * share),
                voxels: n,
            };
        }
    }

    /// Every supervoxel begins again from the voxel nearest to its centroid.
    fn reseed(&mut self) {
        let centres: Vec<[f32; 3]> = self.patches.iter().filter(|p| p.voxels > 0).map(|p| p.position).collect();
        self.owner.fill(NONE);
        self.distance.fill(f32::INFINITY);
        self.patches.clear();
        self.members.clear();
        for centre in centres {
            if let Some(voxel) = self.seeds.nearest(&self.grid.positions, centre) {
                self.plant(voxel);
            }
        }
    }

    /// Numbers the supervoxels that hold voxels, and finds which touch.
    fn finish(self) -> Supervoxels {
        let mut number = vec![NONE; self.patches.len()];
        let mut patches = Vec::with_capacity(self.patches.len());
        for (i, patch) in self.patches.iter().enumerate().filter(|(_, p)| p.voxels > 0) {
            number[i] = patches.len() as u32;
            patches.push(*patch);
        }
        let of_voxel: Vec<u32> = self.owner.iter().map(|&o| number.get(o as usize).copied().unwrap_or(NONE)).collect();
        let mut edges = Vec::new();
        for (v, &a) in of_voxel.iter().enumerate().filter(|(_, a)| **a != NONE) {
            let others = self.grid.neighbours(v as u32).iter().map(|&u| of_voxel[u as usize]);
            edges.extend(others.filter(|&b| b != NONE && a < b).map(|b| [a, b]));
        }
        edges.sort_unstable();
        edges.dedup();
        let of_point = self.grid.of_point.iter().map(|&v| of_voxel.get(v as usize).copied().unwrap_or(NONE)).collect();
        Supervoxels { patches, edges, of_point }
    }
}

/// D of VCCS between a supervoxel and a voxel, if it is below `bound`. Most are not, and need no root.
fn distance_below(bound: f32, c: &VccsConfig, a: &Patch, b: &Patch) -> Option<f32> {
    let bend = c.normal * (1.0 - dot(a.normal, b.normal).abs());
    let left = bound - bend;
    let apart = squared_distance(a.position, b.position) * (c.spatial / c.seed).powi(2);
    if !(left > 0.0 && apart < left * left) {
        return None;
    }
    let mut d = bend + apart.sqrt();
    if c.color != 0.0 {
        d += c.color * squared_distance(a.color, b.color).sqrt() / 255.0;
    }
    (d < bound).then_some(d)
}

#[cfg(test)]
mod tests;
