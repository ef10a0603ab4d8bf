//! Who is next to whom in a mesh: the neighbours of each vertex and the open edges, as flat lists.

/// Lists of `u32`, one for each of `n` keys, in one array.
#[derive(Debug)]
pub(crate) struct Lists {
    starts: Vec<u32>,
    values: Vec<u32>,
}

impl Lists {
    /// Sorts `pairs` of (key below `n`, value) into lists, each in rising order without repeats.
    pub(crate) fn new(n: usize, pairs: &[(u32, u32)]) -> Self {
        let mut starts = vec![0_u32; n + 1];
        for (key, _) in pairs {
            starts[*key as usize + 1] += 1;
        }
        for i in 0..n {
            starts[i + 1] += starts[i];
        }
        let mut next = starts.clone();
        let mut values = vec![0; pairs.len()];
        for (key, value) in pairs {
            let at = &mut next[*key as usize];
            values[*at as usize] = *value;
            *at += 1;
        }
        let mut kept = 0;
        for i in 0..n {
            let (first, last) = (starts[i] as usize, starts[i + 1] as usize);
            values[first..last].sort_unstable();
            starts[i] = kept as u32;
            for k in first..last {
                if k == first || values[k] != values[k - 1] {
                    values[kept] = values[k];
                    kept += 1;
                }
            }
        }
        starts[n] = kept as u32;
        values.truncate(kept);
        Self { starts, values }
    }

    /// The list of `key`.
    pub(crate) fn of(&self, key: usize) -> &[u32] {
        &self.values[self.starts[key] as usize..self.starts[key + 1] as usize]
    }
}

/// Vertices that share an edge with each vertex.
pub(crate) fn neighbours(n: usize, triangles: &[[u32; 3]]) -> Lists {
    let pairs: Vec<(u32, u32)> =
        triangles.iter().flat_map(|&[a, b, c]| [(a, b), (b, a), (b, c), (c, b), (c, a), (a, c)]).collect();
    Lists::new(n, &pairs)
}

/// Edges with a triangle on one side only, each as that triangle runs through it, in order.
pub(super) fn open_edges(triangles: &[[u32; 3]]) -> Vec<[u32; 2]> {
    let key = |a: u32, b: u32| u64::from(a.min(b)) << 32 | u64::from(a.max(b));
    let mut edges: Vec<(u64, [u32; 2])> =
        triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]).map(|[a, b]| (key(a, b), [a, b])).collect();
    edges.sort_unstable();
    let mut open: Vec<[u32; 2]> = edges.chunk_by(|a, b| a.0 == b.0).filter(|e| e.len() == 1).map(|e| e[0].1).collect();
    open.sort_unstable();
    open
}
