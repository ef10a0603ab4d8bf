//! Fusion segmentation, [Eye-in-hand 2020], section 3.1.3: geometry gives the borders, the network the names.
//!
//! A patch takes an object's label when more than half of its points lie in that object's mask, and none where no
//! object has so many; all patches of an object together are its cloud. This cleans the rims of masks and fills holes.
//!
//! The paper's rule trusts every patch. Where convexity joined two things, it would swallow the smaller one. So a piece
//! of a patch is given back to an object if the patch's own supervoxels, by the same rule, vote for that object, and
//! hold a good part of its mask together. Scattered flips do not: they win few supervoxels. This can be switched off.

use super::voxel_grid::{NONE, sort_by_key};
use crate::segment::class_field::{ClassField, UNKNOWN_PART};
use crate::segment::segmentation::Segmentation;
use std::collections::{BTreeMap, BTreeSet};

/// When a patch takes a label.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FusionConfig {
    /// Share of a patch's points that an object's mask must exceed.
    pub share: f32,
    /// An object gets those supervoxels of another's patch back that vote for it, if they hold this share of its mask.
    pub rescue: f32,
    /// ... and are at least so many.
    pub rescued_pieces: u32,
}

impl FusionConfig {
    /// The paper's rule alone.
    pub const PAPER: Self = Self { share: 0.5, rescue: f32::INFINITY, rescued_pieces: 0 };
}

impl Default for FusionConfig {
    fn default() -> Self {
        Self { share: 0.5, rescue: 0.5, rescued_pieces: 3 }
    }
}

/// Patches of a view, row-major, one a pixel; [`NONE`] where there is no point.
#[derive(Clone, Copy, Debug)]
pub struct PatchImage<'a> {
    /// The patches that take a label.
    pub patches: &'a [u32],
    /// A finer partition within them.
    pub fine: Option<&'a [u32]>,
}

/// Class and instance of an object in the view; class 0 is no object.
type Object = (u16, u16);

/// Index of "no object" in the list of objects.
const NOTHING: u32 = 0;

/// `segmentation` with its component masks fitted to `image`. Pixels without a patch keep what they have, as do defects.
pub fn fuse(segmentation: &Segmentation, image: &PatchImage<'_>, config: &FusionConfig) -> Segmentation {
    let (objects, given) = objects(segmentation, image.patches.len());
    let decided = Votes::count(image.patches, &given).decide(config.share);
    let mut fused = apply(image.patches, &decided, &given);
    if let Some(fine) = image.fine.filter(|f| f.len() == image.patches.len() && config.rescue.is_finite()) {
        rescue(image.patches, fine, &given, &mut fused, config);
    }
    relabel(segmentation, image, &objects, &given, &fused)
}

/// Gives objects their coherent pieces of others' patches back.
fn rescue(patches: &[u32], fine: &[u32], given: &[u32], fused: &mut [u32], config: &FusionConfig) {
    let by_fine = Votes::count(fine, given).decide(config.share);
    let claim = |i: usize| match by_fine.get(fine[i] as usize).copied() {
        Some(object) if object != NOTHING && object != fused[i] => Some(object),
        _ => None,
    };
    let mut mask: BTreeMap<u32, u32> = BTreeMap::new();
    given.iter().for_each(|&o| *mask.entry(o).or_default() += 1);
    // Points and pieces that an object would get of a patch.
    let mut claims: BTreeMap<(u32, u32), (u32, BTreeSet<u32>)> = BTreeMap::new();
    for i in (0..fused.len()).filter(|&i| patches[i] != NONE) {
        if let Some(object) = claim(i).filter(|&o| o == given[i]) {
            let (points, pieces) = claims.entry((patches[i], object)).or_default();
            *points += 1;
            pieces.insert(fine[i]);
        }
    }
    claims.retain(|(_, object), (points, pieces)| {
        let whole = mask.get(object).copied().unwrap_or(0) as f32;
        *points as f32 >= config.rescue * whole && pieces.len() as u32 >= config.rescued_pieces
    });
    let given_back: Vec<(usize, u32)> = (0..fused.len())
        .filter_map(|i| Some((i, claim(i)?)))
        .filter(|&(i, object)| claims.contains_key(&(patches[i], object)))
        .collect();
    for (i, object) in given_back {
        fused[i] = object;
    }
}

/// The objects of a view (the first is none) and, for each of the first `pixels`, its index.
fn objects(segmentation: &Segmentation, pixels: usize) -> (Vec<Object>, Vec<u32>) {
    let per_pixel: Vec<Object> = (0..pixels)
        .map(|i| match segmentation.components.best(i) {
            0 => (0, 0),
            class => (class, segmentation.instances.get(i).copied().unwrap_or(0)),
        })
        .collect();
    let mut index: BTreeMap<Object, u32> = per_pixel.chunk_by(|a, b| a == b).map(|run| (run[0], 0)).collect();
    index.insert((0, 0), NOTHING);
    for (slot, i) in index.values_mut().zip(0..) {
        *slot = i;
    }
    let given = per_pixel.chunk_by(|a, b| a == b).flat_map(|run| std::iter::repeat_n(index[&run[0]], run.len()));
    let given = given.collect();
    (index.into_keys().collect(), given)
}

/// How the points of each patch are labelled.
struct Votes {
    /// Points of each patch.
    sizes: Vec<u32>,
    /// `(patch, object, points)`, in order.
    counts: Vec<(u32, u32, u32)>,
}

impl Votes {
    fn count(patches: &[u32], given: &[u32]) -> Self {
        let patch_count = patches.iter().filter(|&&p| p != NONE).max().map_or(0, |&p| p as usize + 1);
        let mut sizes = vec![0; patch_count];
        let mut runs: Vec<(u64, u32)> = Vec::new();
        for (&patch, &object) in patches.iter().zip(given).filter(|(p, _)| **p != NONE) {
            sizes[patch as usize] += 1;
            let key = u64::from(patch) << 32 | u64::from(object);
            match runs.last_mut().filter(|r| r.0 == key) {
                Some(run) => run.1 += 1,
                None => runs.push((key, 1)),
            }
        }
        sort_by_key(&mut runs);
        let counts = runs
            .chunk_by(|a, b| a.0 == b.0)
            .map(|group| {
                let key = group[0].0;
                ((key >> 32) as u32, key as u32, group.iter().map(|g| g.1).sum())
            })
            .collect();
        Self { sizes, counts }
    }

    /// The object of each patch: the one with most points if these exceed `share` of the patch, else none.
    fn decide(&self, share: f32) -> Vec<u32> {
        let mut best = vec![(0_u32, NOTHING); self.sizes.len()];
        for &(patch, object, points) in self.counts.iter().filter(|c| c.1 != NOTHING) {
            let slot = &mut best[patch as usize];
            if points > slot.0 && points as f32 > share * self.sizes[patch as usize] as f32 {
                *slot = (points, object);
            }
        }
        best.into_iter().map(|b| b.1).collect()
    }
}

fn apply(patches: &[u32], decided: &[u32], given: &[u32]) -> Vec<u32> {
    patches.iter().zip(given).map(|(&patch, &own)| decided.get(patch as usize).copied().unwrap_or(own)).collect()
}

/// The segmentation with the objects of `fused`. A pixel that changes takes the mean probabilities and sigma of the
/// pixels of its patch that had its new label before; where there are none, it is none for certain.
fn relabel(
    segmentation: &Segmentation,
    image: &PatchImage<'_>,
    objects: &[Object],
    given: &[u32],
    fused: &[u32],
) -> Segmentation {
    let mut out = segmentation.clone();
    let changed: Vec<usize> = (0..fused.len()).filter(|&i| fused[i] != given[i]).collect();
    for &i in &changed {
        if let Some(instance) = out.instances.get_mut(i) {
            *instance = objects[fused[i] as usize].1;
        }
    }
    match (&mut out.components, &segmentation.components) {
        (ClassField::Hard(labels), _) => {
            for &i in &changed {
                if let Some(label) = labels.get_mut(i) {
                    *label = objects[fused[i] as usize].0;
                }
            }
        }
        (ClassField::Soft { classes, probabilities, sigma, model_sigma }, before) => {
            let means = means(before, *classes, image.patches, given, fused);
            for &i in &changed {
                let (Some(p), Some(s)) = (probabilities.get_mut(i * *classes..(i + 1) * *classes), sigma.get_mut(i))
                else {
                    continue;
                };
                let class = objects[fused[i] as usize].0;
                match means.get(&(image.patches[i], fused[i])) {
                    Some((mean, mean_sigma)) => {
                        p.copy_from_slice(mean);
                        *s = *mean_sigma;
                        model_sigma.iter_mut().skip(i).take(1).for_each(|part| *part = UNKNOWN_PART);
                    }
                    None => {
                        p.fill(0);
                        if let Some(slot) = p.get_mut(usize::from(class)) {
                            *slot = u8::MAX;
                        }
                    }
                }
            }
        }
    }
    out
}

type Mean = (Vec<u8>, u8);

/// Mean probabilities and sigma of the pixels that keep their label, by patch and object.
fn means(
    field: &ClassField,
    classes: usize,
    patches: &[u32],
    given: &[u32],
    fused: &[u32],
) -> BTreeMap<(u32, u32), Mean> {
    let ClassField::Soft { probabilities, sigma, .. } = field else { return BTreeMap::new() };
    let mut sums: BTreeMap<(u32, u32), (Vec<u64>, u64, u64)> = BTreeMap::new();
    for (i, (&patch, &object)) in patches.iter().zip(given).enumerate() {
        let (Some(p), Some(&s)) = (probabilities.get(i * classes..(i + 1) * classes), sigma.get(i)) else { continue };
        if patch == NONE || fused[i] != object {
            continue;
        }
        let (sum, sigmas, n) = sums.entry((patch, object)).or_insert_with(|| (vec![0; classes], 0, 0));
        sum.iter_mut().zip(p).for_each(|(a, &b)| *a += u64::from(b));
        *sigmas += u64::from(s);
        *n += 1;
    }
    let rounded = |sum: u64, n: u64| ((sum + n / 2) / n) as u8;
    sums.into_iter()
        .map(|(k, (sum, s, n))| (k, (sum.iter().map(|&x| rounded(x, n)).collect(), rounded(s, n))))
        .collect()
}

#[cfg(test)]
mod tests;
