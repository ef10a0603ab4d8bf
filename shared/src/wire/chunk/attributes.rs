//! Everything a point knows besides its voxel, predicted from the points before it in raster order.
//!
//! Surfaces are smooth: the voxels around a point that are already told lie on the same patch, carry nearly the same
//! colour and almost always the same labels. What is told is the difference.

use super::model::{Coder, Model, Plane, ResidualModel};
use super::octahedral;
use super::planes::Planes;

/// Nodes along an edge of the index grid: a chunk and a border of one.
const STRIDE: usize = 34;

/// Offsets (dx, dy, dz) of the 13 neighbours that come before a point in raster order, and their weights.
const BEFORE: [([i32; 3], i32); 13] = [
    ([-1, 0, 0], 3),
    ([0, -1, 0], 3),
    ([0, 0, -1], 3),
    ([-1, -1, 0], 2),
    ([1, -1, 0], 2),
    ([-1, 0, -1], 2),
    ([1, 0, -1], 2),
    ([0, -1, -1], 2),
    ([0, 1, -1], 2),
    ([-1, -1, -1], 1),
    ([1, -1, -1], 1),
    ([-1, 1, -1], 1),
    ([1, 1, -1], 1),
];

#[derive(Clone, Debug)]
struct Models {
    position: Vec<Model>,
    plane: Vec<Model>,
    normal: Vec<ResidualModel>,
    color: Vec<ResidualModel>,
    changed: Vec<Model>,
    mark: Vec<ResidualModel>,
    shares: Vec<ResidualModel>,
    views: Vec<ResidualModel>,
}

impl Models {
    fn new() -> Self {
        Self {
            position: vec![Model::uniform(14); 12],
            plane: vec![Model::uniform(14); 4],
            normal: vec![ResidualModel::new(); 8],
            color: vec![ResidualModel::new(); 16],
            changed: vec![Model::uniform(16); 3],
            mark: vec![ResidualModel::new(); 8],
            shares: vec![ResidualModel::new(); 8],
            views: vec![ResidualModel::new(); 4],
        }
    }
}

/// Codes all columns but the cells, which are known on both sides.
pub(super) fn code<C: Coder>(coder: &mut C, planes: &mut Planes) {
    let mut index = vec![0_u16; STRIDE * STRIDE * STRIDE];
    let at = |cell: u16| {
        let [x, y, z] = [cell & 31, cell >> 5 & 31, cell >> 10].map(usize::from);
        ((z + 1) * STRIDE + y + 1) * STRIDE + x + 1
    };
    for (i, &cell) in planes.cells.iter().enumerate() {
        index[at(cell)] = i as u16 + 1;
    }
    let steps =
        BEFORE.map(|([dx, dy, dz], _)| -((dz * STRIDE as i32 + dy) * STRIDE as i32 + dx) as usize);
    let mut models = Models::new();
    for i in 0..planes.len() {
        let here = at(planes.cells[i]);
        let mut near = Near {
            count: 0,
            points: [(0, 0); 13],
        };
        for (k, step) in steps.iter().enumerate() {
            if let Some(j) = index[here - step].checked_sub(1) {
                near.points[near.count] = (usize::from(j), k);
                near.count += 1;
            }
        }
        let occupied = |d: i32| usize::from(index[here.wrapping_add_signed(d as isize)] != 0);
        let s = STRIDE as i32;
        let around = [
            [occupied(-1), occupied(1)],
            [occupied(-s), occupied(s)],
            [occupied(-s * s), occupied(s * s)],
        ];
        normal(coder, &mut models, planes, i, &near);
        position(coder, &mut models, planes, i, &near, around);
        color(coder, &mut models, planes, i, &near);
        rest(coder, &mut models, planes, i, &near);
    }
}

struct Near {
    count: usize,
    points: [(usize, usize); 13],
}

impl Near {
    fn iter(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        self.points[..self.count].iter().copied()
    }
}

fn normal<C: Coder>(
    coder: &mut C,
    models: &mut Models,
    planes: &mut Planes,
    i: usize,
    near: &Near,
) {
    coder.enter(Plane::Normal);
    let mut p = [127u8; 2];
    let (mut s, mut w, mut spread) = ([0i32; 2], 0, 0);
    for (j, k) in near.iter() {
        let n = planes.normals[j];
        if n == octahedral::UNKNOWN {
            continue;
        }
        let wk = BEFORE[k].1;
        if w > 0 {
            spread =
                spread.max((s[0] / w - i32::from(n[0])).abs() + (s[1] / w - i32::from(n[1])).abs());
        }
        w += wk;
        for a in 0..2 {
            s[a] += wk * i32::from(n[a]);
        }
    }
    if w > 0 {
        p = s.map(|c| ((c + w / 2) / w) as u8);
    } else if i > 0 {
        p = planes.normals[i - 1];
    }
    let ctx = match spread {
        0..=3 => 0,
        4..=15 => 1,
        16..=40 => 2,
        _ => 3,
    };
    let mut n = planes.normals[i];
    for a in 0..2 {
        n[a] = models.normal[ctx * 2 + a].code(coder, n[a], p[a]);
    }
    planes.normals[i] = n;
}

fn position<C: Coder>(
    coder: &mut C,
    models: &mut Models,
    planes: &mut Planes,
    i: usize,
    near: &Near,
    around: [[usize; 2]; 3],
) {
    coder.enter(Plane::Position);
    let n = planes.normals[i];
    let mut q = planes.inner[i];
    let (nx, ny) = (i32::from(n[0]) - 127, i32::from(n[1]) - 127);
    let mut nv = [nx, ny, 127 - nx.abs() - ny.abs()];
    if nv[2] < 0 {
        let (x, y) = (nv[0], nv[1]);
        nv[0] = (127 - y.abs()) * if x < 0 { -1 } else { 1 };
        nv[1] = (127 - x.abs()) * if y < 0 { -1 } else { 1 };
    }
    let known = n != octahedral::UNKNOWN && near.count > 0;
    let dom = if !known {
        3
    } else {
        let m = nv.map(i32::abs);
        if m[0] >= m[1] && m[0] >= m[2] {
            0
        } else if m[1] >= m[2] {
            1
        } else {
            2
        }
    };
    for a in 0..3 {
        if a == dom {
            continue;
        }
        let ctx = a * 4 + around[a][0] * 2 + around[a][1];
        q[a] = coder.symbol(&mut models.position[ctx], q[a]);
    }
    if dom < 3 {
        let mut sum = 0i32;
        let mut w = 0;
        for (j, k) in near.iter() {
            let (d, wk) = BEFORE[k];
            let u = planes.inner[j];
            let rel = [0, 1, 2].map(|a| 14 * d[a] + i32::from(u[a]));
            let mut t = 0;
            for a in 0..3 {
                if a != dom {
                    t += nv[a] * (rel[a] - i32::from(q[a]));
                }
            }
            sum += wk * (rel[dom] * 16 + 16 * t / nv[dom]);
            w += wk;
        }
        let pred = ((sum + 8 * w).div_euclid(16 * w)).clamp(0, 13);
        let ctx = match w {
            0..=2 => 0,
            3..=5 => 1,
            6..=9 => 2,
            _ => 3,
        };
        let r = (i32::from(q[dom]) - pred).rem_euclid(14) as u8;
        let r = coder.symbol(&mut models.plane[ctx], r);
        q[dom] = (i32::from(r) + pred).rem_euclid(14) as u8;
    }
    planes.inner[i] = q;
}

fn color<C: Coder>(coder: &mut C, models: &mut Models, planes: &mut Planes, i: usize, near: &Near) {
    coder.enter(Plane::Color);
    let mut s = [0i32; 3];
    let mut w = 0;
    let (mut lo, mut hi) = (255i32, 0i32);
    for (j, k) in near.iter() {
        let c = planes.colors[j];
        let wk = BEFORE[k].1;
        for a in 0..3 {
            s[a] += wk * i32::from(c[a]);
        }
        w += wk;
        lo = lo.min(c[1].into());
        hi = hi.max(c[1].into());
    }
    let p = if w > 0 {
        s.map(|c| ((c + w / 2) / w) as u8)
    } else if i > 0 {
        planes.colors[i - 1]
    } else {
        [128; 3]
    };
    let ctx = if near.count < 2 {
        3
    } else {
        match hi - lo {
            0..=6 => 0,
            7..=14 => 1,
            15..=30 => 2,
            _ => 4,
        }
    };
    let c = planes.colors[i];
    let g = models.color[ctx * 3].code(coder, c[1], p[1]);
    let dg = g.wrapping_sub(p[1]);
    let clampadd = |p: u8, d: u8| (i32::from(p) + i32::from(d as i8)).clamp(0, 255) as u8;
    let r = models.color[ctx * 3 + 1].code(coder, c[0], clampadd(p[0], dg));
    let b = models.color[ctx * 3 + 2].code(coder, c[2], clampadd(p[2], dg));
    planes.colors[i] = [r, g, b];
}

fn rest<C: Coder>(coder: &mut C, models: &mut Models, planes: &mut Planes, i: usize, near: &Near) {
    coder.enter(Plane::Label);
    let j = near.iter().next().map_or(i.wrapping_sub(1), |p| p.0);
    let p = planes.marks.get(j).copied().unwrap_or_default();
    let uniform = near.iter().all(|(j, _)| planes.marks[j] == p);
    let mut m = planes.marks[i];
    let changed = (0..4).map(|k| u8::from(m[k] != p[k]) << k).sum();
    let ctx = if near.count == 0 {
        2
    } else {
        usize::from(uniform)
    };
    let changed = coder.symbol(&mut models.changed[ctx], changed);
    for k in 0..4 {
        if changed >> k & 1 == 0 {
            m[k] = p[k];
            continue;
        }
        if k == 1 {
            coder.enter(Plane::Marks);
        }
        let lo = models.mark[k * 2].code(coder, m[k] as u8, 0);
        let hi = models.mark[k * 2 + 1].code(coder, (m[k] >> 8) as u8, 0);
        m[k] = u16::from_le_bytes([lo, hi]);
    }
    planes.marks[i] = m;
    coder.enter(Plane::Shares);
    let mut s = planes.shares[i];
    for k in 0..4 {
        let (mut sum, mut w, mut lo, mut hi) = (0i32, 0, 255, 0);
        for (j, kk) in near.iter() {
            let v = planes.shares[j][k];
            sum += BEFORE[kk].1 * i32::from(v);
            w += BEFORE[kk].1;
            lo = lo.min(v);
            hi = hi.max(v);
        }
        let p = if w > 0 {
            ((sum + w / 2) / w) as u8
        } else {
            planes.shares.get(i.wrapping_sub(1)).map_or(255, |s| s[k])
        };
        let ctx = usize::from(w > 0 && lo == hi);
        s[k] = models.shares[k * 2 + ctx].code(coder, s[k], p);
    }
    planes.shares[i] = s;
    coder.enter(Plane::Views);
    let (mut sum, mut w) = (0u32, 0);
    for (j, k) in near.iter() {
        sum += BEFORE[k].1 as u32 * u32::from(planes.views[j]);
        w += BEFORE[k].1 as u32;
    }
    let p = if w > 0 {
        ((sum + w / 2) / w) as u16
    } else {
        planes.views.get(i.wrapping_sub(1)).copied().unwrap_or(1)
    };
    let v = planes.views[i].wrapping_sub(p);
    let lo = models.views[0].code(coder, v as u8, 0);
    let hi = models.views[1].code(coder, (v >> 8) as u8, if lo >= 128 { 255 } else { 0 });
    planes.views[i] = u16::from_le_bytes([lo, hi]).wrapping_add(p);
}
