//! Fewer points: the iterative simplification of point clouds that [Wang 2023] uses, which is that of [Pauly 2002].
//!
//! Each point `v` has a symmetric matrix `Q_v`: the squared distances from the planes along the edges to its
//! neighbours. The pair whose `Q_v1 + Q_v2` is least at its best place is contracted, its matrix becomes the sum
//! `Qv1 + Qv2`, and so on until few enough are left. Points of different components are never contracted.

use super::blend::blend;
use super::collapse_queue::Queue;
use super::options::MeshError;
use super::progress::Progress;
use super::quadric::Quadric;
use crate::grid::cell;
use crate::vector::{cross, dot, squared_distance, sub, unit};
use semascan_model::SemanticCloud;

/// Neighbours of a point that count, at most.
const NEIGHBOURS: usize = 8;
/// How far a neighbour may be away, in voxels.
const REACH: f64 = 2.0;
/// A trace of the distance from the point itself: in a plane the best place would be open.
const STAY: f64 = 1e-3;
/// Contractions between two reports of progress.
const REPORT: usize = 1024;

/// Contracts pairs of points until at most `points` are left or no pair within reach is. `voxel` is the distance of points
/// from each other, in metres. Points without a finite position are dropped.
///
/// # Errors
/// [`MeshError::Voxel`] if `voxel` is not a length, [`MeshError::Cancelled`] if `progress` says so.
pub fn simplify_points(
    cloud: &SemanticCloud,
    voxel: f32,
    points: usize,
    progress: &dyn Progress,
) -> Result<SemanticCloud, MeshError> {
    if !(voxel.is_finite() && voxel > 0.0) {
        return Err(MeshError::Voxel { voxel });
    }
    let mut cloud: SemanticCloud = cloud.iter().filter(|p| p.position.iter().all(|c| c.is_finite())).collect();
    let total = cloud.len().saturating_sub(points);
    if total == 0 {
        return Ok(cloud);
    }
    let mut work = Simplification::new(&cloud, f64::from(voxel));
    for done in 0..total {
        let Some(pair) = work.queue.pop() else { break };
        work.contract(&mut cloud, pair.a, pair.b);
        if done % REPORT == 0 && progress.advance(done, total).is_break() {
            return Err(MeshError::Cancelled);
        }
    }
    Ok((0..cloud.len()).filter(|&i| !work.queue.is_gone(i as u32)).filter_map(|i| cloud.get(i)).collect())
}

struct Simplification {
    quadrics: Vec<Quadric>,
    neighbours: Vec<Vec<u32>>,
    queue: Queue,
}

impl Simplification {
    fn new(cloud: &SemanticCloud, voxel: f64) -> Self {
        let neighbours = neighbours(cloud, REACH * voxel);
        let quadrics = (0..cloud.len()).map(|i| quadric(cloud, i, &neighbours[i])).collect();
        let mut work = Self { quadrics, neighbours, queue: Queue::new(cloud.len()) };
        for a in 0..cloud.len() {
            for k in 0..work.neighbours[a].len() {
                let b = work.neighbours[a][k];
                if b as usize > a || work.neighbours[b as usize].binary_search(&(a as u32)).is_err() {
                    work.offer(cloud, a as u32, b);
                }
            }
        }
        work
    }

    fn offer(&mut self, cloud: &SemanticCloud, a: u32, b: u32) {
        if cloud.labels[a as usize] == cloud.labels[b as usize] {
            let cost = self.target(cloud, a, b).2;
            self.queue.push(cost, a, b);
        }
    }

    /// Where a pair would meet, how far that is from `a` to `b`, and the error there.
    fn target(&self, cloud: &SemanticCloud, a: u32, b: u32) -> ([f64; 3], f64, f64) {
        let mut q = self.quadrics[a as usize];
        q.add(&self.quadrics[b as usize]);
        let [pa, pb] = [a, b].map(|v| cloud.positions[v as usize].map(f64::from));
        let along = sub(pb, pa);
        let length = dot(along, along).max(f64::MIN_POSITIVE);
        let middle = std::array::from_fn(|k| pa[k] + 0.5 * along[k]);
        let p = q.least().filter(|p| squared_distance(*p, middle) <= length).unwrap_or(middle);
        (p, dot(sub(p, pa), along) / length, q.error(p))
    }

    /// Contracts `b` into `a`.
    fn contract(&mut self, cloud: &mut SemanticCloud, a: u32, b: u32) {
        let (position, share, _) = self.target(cloud, a, b);
        let (Some(pa), Some(pb)) = (cloud.get(a as usize), cloud.get(b as usize)) else { return };
        cloud.set(a as usize, blend(&pa, &pb, share, position));
        let other = self.quadrics[b as usize];
        self.quadrics[a as usize].add(&other);
        let mut joined = std::mem::take(&mut self.neighbours[a as usize]);
        joined.append(&mut self.neighbours[b as usize]);
        joined.retain(|&v| v != a && v != b && !self.queue.is_gone(v));
        joined.sort_unstable();
        joined.dedup();
        self.queue.gone(b);
        self.queue.changed(a);
        for &v in &joined {
            let list = &mut self.neighbours[v as usize];
            list.retain(|&u| u != b);
            if let Err(at) = list.binary_search(&a) {
                list.insert(at, a);
            }
            self.offer(cloud, a, v);
        }
        self.neighbours[a as usize] = joined;
    }
}

/// Squared distances from the planes along the edges of point `i` ([Pauly 2002], section 3.2): a plane holds the edge
/// and stands square to the plane of edge and normal.
fn quadric(cloud: &SemanticCloud, i: usize, neighbours: &[u32]) -> Quadric {
    let p = cloud.positions[i].map(f64::from);
    let n = cloud.normals[i].map(f64::from);
    let share = 1.0 / neighbours.len().max(1) as f64;
    let mut q = Quadric::point(p, STAY);
    for &j in neighbours {
        let edge = sub(cloud.positions[j as usize].map(f64::from), p);
        if let Some(normal) = unit(cross(edge, cross(edge, n)), 0.0) {
            q.add(&Quadric::plane(normal, p, share));
        } else {
            q.add(&Quadric::point(p, share));
        }
    }
    q
}

/// The nearest points of each point within `reach`, by index.
fn neighbours(cloud: &SemanticCloud, reach: f64) -> Vec<Vec<u32>> {
    let cell_of = |p: [f32; 3]| cell(p, reach).map(|c| c.clamp(-1e9, 1e9) as i32);
    let mut cells: Vec<([i32; 3], u32)> =
        cloud.positions.iter().enumerate().map(|(i, p)| (cell_of(*p), i as u32)).collect();
    cells.sort_unstable();
    let mut found: Vec<(f64, u32)> = Vec::new();
    let mut near = |p: [f32; 3], own: u32| {
        found.clear();
        let [x, y, z] = cell_of(p);
        for (dx, dy) in (-1..=1).flat_map(|dx| (-1..=1).map(move |dy| (dx, dy))) {
            let start = cells.partition_point(|(c, _)| *c < [x + dx, y + dy, z - 1]);
            for (_, j) in cells[start..].iter().take_while(|(c, _)| *c <= [x + dx, y + dy, z + 1]) {
                let squared = squared_distance(cloud.positions[*j as usize].map(f64::from), p.map(f64::from));
                if *j != own && squared <= reach * reach {
                    found.push((squared, *j));
                }
            }
        }
        found.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut list: Vec<u32> = found.iter().take(NEIGHBOURS).map(|f| f.1).collect();
        list.sort_unstable();
        list
    };
    cloud.positions.iter().enumerate().map(|(i, p)| near(*p, i as u32)).collect()
}
