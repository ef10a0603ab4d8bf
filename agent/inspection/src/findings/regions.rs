//! Connected regions of one component with one defect on the mesh. Instances of a component belong to one region where they
//! touch: they are parts of the component.

use super::surface::Surface;

/// A connected piece of surface.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Region {
    /// Component class.
    pub(crate) component: u16,
    /// Defect class; 0 where the region is none of a defect.
    pub(crate) defect: u16,
    /// Its vertices, in order.
    pub(crate) vertices: Vec<u32>,
}

impl Region {
    /// Area in square metres.
    pub(crate) fn area(&self, surface: &Surface<'_>) -> f64 {
        self.vertices.iter().map(|v| surface.areas[*v as usize]).sum()
    }

    /// Whether a vertex belongs to it.
    pub(crate) fn holds(&self, v: u32) -> bool {
        self.vertices.binary_search(&v).is_ok()
    }

    /// Mean of `value` over its vertices, weighted by the area that they stand for.
    pub(crate) fn mean(&self, surface: &Surface<'_>, value: impl Fn(u32) -> f64) -> f64 {
        let weigh = |v: &u32| surface.areas[*v as usize].max(f64::MIN_POSITIVE);
        let all: f64 = self.vertices.iter().map(weigh).sum();
        self.vertices.iter().map(|v| weigh(v) * value(*v)).sum::<f64>() / all
    }
}

/// The regions with a defect, by component, defect and area, the largest first.
pub(crate) fn defect_regions(surface: &Surface<'_>) -> Vec<Region> {
    let class = |v: u32| match surface.defect(v) {
        0 => None,
        defect => Some((surface.component(v), defect)),
    };
    let mut regions = connected(surface, class);
    let key = |r: &Region| (r.component, r.defect);
    regions.sort_by(|a, b| {
        key(a).cmp(&key(b)).then(b.area(surface).total_cmp(&a.area(surface))).then(a.vertices[0].cmp(&b.vertices[0]))
    });
    regions
}

/// Connected pieces of surface whose vertices have the same class (component and defect), in the order of their first vertex;
/// vertices without one are in none.
pub(crate) fn connected(surface: &Surface<'_>, class: impl Fn(u32) -> Option<(u16, u16)>) -> Vec<Region> {
    let mut seen = vec![false; surface.mesh.len()];
    let mut regions = Vec::new();
    for first in 0..surface.mesh.len() as u32 {
        let Some(wanted) = class(first).filter(|_| !seen[first as usize]) else { continue };
        seen[first as usize] = true;
        let mut vertices = vec![first];
        let mut next = 0;
        while let Some(&v) = vertices.get(next) {
            next += 1;
            for &w in surface.neighbours(v) {
                if !seen[w as usize] && class(w) == Some(wanted) {
                    seen[w as usize] = true;
                    vertices.push(w);
                }
            }
        }
        vertices.sort_unstable();
        regions.push(Region { component: wanted.0, defect: wanted.1, vertices });
    }
    regions
}

#[cfg(test)]
mod tests {
    use super::super::fixtures::{grid, with_defect};
    use super::*;

    #[test]
    fn regions_end_where_component_or_defect_changes() {
        // Two spots, one of them across the border of two components.
        let mut mesh = with_defect(grid(30, 20, |_, _| 0.0), |x, y| {
            (x - 8.0).hypot(y - 8.0) < 4.5 || (x - 22.0).hypot(y - 8.0) < 3.5
        });
        for v in 0..mesh.len() {
            mesh.vertices.labels[v] = if mesh.vertices.positions[v][0] < 8.4e-3 { 1 } else { 2 };
            mesh.vertices.instances[v] = (v % 3) as u16;
        }
        let surface = Surface::new(&mesh, 1e-3);
        let regions = defect_regions(&surface);
        let found: Vec<_> = regions.iter().map(|r| (r.component, r.defect)).collect();
        assert_eq!(found, [(1, 1), (2, 1), (2, 1)], "whatever their instances");
        assert!(regions[1].area(&surface) > regions[2].area(&surface));
        let all: usize = regions.iter().map(|r| r.vertices.len()).sum();
        assert_eq!(all, mesh.vertices.defects.iter().filter(|d| **d != 0).count());
        assert!(regions[0].holds(regions[0].vertices[3]) && !regions[0].holds(regions[1].vertices[0]));
    }
}
