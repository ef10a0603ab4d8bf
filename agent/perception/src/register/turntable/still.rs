//! What stays the same over all views of a fixed camera, and what changes: the background, and what turns before it.
//!
//! Per pixel the depths and grey values of all views are compared. How far they scatter where nothing moves is not known
//! beforehand: it is that of the half of the pixels that scatter least, as most of such a picture stands still.

use super::thinned::TurningView;
use super::{FEWEST_VIEWS, TurntableError};

/// Standard deviations beyond which a pixel's depth changes.
const DEPTH_CHANGES: f32 = 6.0;
/// Largest scatter of depth that is taken for noise: a share of the depth, at a metre and nearer; farther away it grows with
/// the square of the depth, as the noise of stereo cameras does.
const DEPTH_NOISE: f32 = 0.012;
/// A pixel's grey value changes if its variance is so many times that of those that stand still.
const GREY_CHANGES: f32 = 3.0;
/// Smallest variance of normalised grey values that is believed.
const GREY_FLOOR: f32 = 0.01;
/// The same of grey values of 255.
const RAW_FLOOR: f32 = 4.0;
/// Half the window in which the majority of the pixels must change.
const HALF_WINDOW: usize = 2;
/// Fewest pixels that change.
const FEWEST_PIXELS: usize = 150;
/// Least share of the measured pixels that stand still, for the camera to be fixed.
const LEAST_STILL: f64 = 0.25;

/// What changes from view to view; row-major pictures of the thinned size.
#[derive(Clone, Debug)]
pub struct Still {
    /// Pixels whose depth or colour changes, in one region.
    pub(super) changes: Vec<bool>,
    /// Of these: those whose depth changes.
    pub(super) depth_changes: Vec<bool>,
    /// Median depth of each pixel, metres; 0 where hardly anything was measured.
    pub(super) middle: Vec<f32>,
    /// Depth of the nearest that was measured often enough, metres.
    pub(super) nearest: Vec<f32>,
    /// Share of the measured pixels that stand still.
    pub still_share: f64,
    /// Share of the measured pixels that change.
    pub changing_share: f64,
}

/// What stays the same in `views`.
///
/// # Errors
/// [`TurntableError`] where the views are too few, of several cameras, or nothing turns or nothing stands still.
pub fn look(views: &[TurningView]) -> Result<Still, TurntableError> {
    let first = views.first().ok_or(TurntableError::FewViews { views: 0 })?;
    if let Some(view) = views.iter().position(|v| v.camera != first.camera) {
        return Err(TurntableError::AnotherCamera { view });
    }
    if views.len() < FEWEST_VIEWS {
        return Err(TurntableError::FewViews { views: views.len() });
    }
    let (width, height) = (first.camera.width as usize, first.camera.height as usize);
    let n = width * height;
    let (mut middle, mut nearest, mut spread) = (vec![0.0_f32; n], vec![0.0_f32; n], vec![0.0_f32; n]);
    let mut scatter: Vec<f32> = Vec::with_capacity(n);
    let mut variance = vec![0.0_f32; n];
    let mut raw_variance = vec![0.0_f32; n];
    let mut depths: Vec<f32> = Vec::with_capacity(views.len());
    for i in 0..n {
        depths.clear();
        depths.extend(views.iter().map(|v| v.depth[i]).filter(|z| *z > 0.0));
        depths.sort_unstable_by(f32::total_cmp);
        if depths.len() * 2 > views.len() && depths.len() >= FEWEST_VIEWS {
            let last = depths.len() - 1;
            // One stray of either side is none.
            let (low, high) = if depths.len() > 4 { (1, last - 1) } else { (0, last) };
            (middle[i], nearest[i], spread[i]) = (depths[last / 2], depths[low], depths[high] - depths[low]);
            // Disparity is what such cameras measure: its noise is the same at all depths.
            scatter.push(spread[i] / (middle[i] * middle[i]));
        }
        let mean = views.iter().map(|v| v.grey[i]).sum::<f32>() / views.len() as f32;
        let raw_mean = views.iter().map(|v| f32::from(v.raw[i])).sum::<f32>() / views.len() as f32;
        raw_variance[i] =
            views.iter().map(|v| (f32::from(v.raw[i]) - raw_mean).powi(2)).sum::<f32>() / views.len() as f32;
        variance[i] = views.iter().map(|v| (v.grey[i] - mean).powi(2)).sum::<f32>() / views.len() as f32;
    }
    if scatter.len() < FEWEST_PIXELS {
        return Err(TurntableError::NothingTurns { pixels: 0 });
    }
    let noise = quantile(&mut scatter, 0.4);
    // The range of a few values is about two and a half of their standard deviations.
    let limit = |z: f32| (DEPTH_CHANGES / 2.5 * noise * z * z).clamp(0.004 * z, DEPTH_NOISE * z * z.max(1.0));
    let smooth = box_mean(&variance, width, height, 1);
    let raw_smooth = box_mean(&raw_variance, width, height, 1);
    let still_in_depth: Vec<usize> = (0..n).filter(|i| middle[*i] > 0.0 && spread[*i] <= limit(middle[*i])).collect();
    let mut still_grey: Vec<f32> = still_in_depth.iter().map(|i| smooth[*i]).collect();
    let mut still_raw: Vec<f32> = still_in_depth.iter().map(|i| raw_smooth[*i]).collect();
    let share_of_depth = still_grey.len() as f64 / scatter.len() as f64;
    if share_of_depth < LEAST_STILL {
        return Err(TurntableError::NothingStandsStill { share: 100.0 * share_of_depth });
    }
    let grey_limit = (GREY_CHANGES * quantile(&mut still_grey, 0.4)).max(GREY_FLOOR);
    let raw_limit = (GREY_CHANGES * quantile(&mut still_raw, 0.4)).max(RAW_FLOOR);
    // The normalised value is free of exposure and shading but changes beside what moves, too; the raw one is the opposite.
    let by_colour = |i: usize| smooth[i] > grey_limit && raw_smooth[i] > raw_limit;
    let by_depth: Vec<f32> =
        (0..n).map(|i| f32::from(u8::from(middle[i] > 0.0 && spread[i] > limit(middle[i])))).collect();
    let by_either: Vec<f32> =
        (0..n).map(|i| f32::from(u8::from(middle[i] > 0.0 && (by_depth[i] > 0.0 || by_colour(i))))).collect();
    let measured: Vec<f32> = middle.iter().map(|z| f32::from(u8::from(*z > 0.0))).collect();
    let around = box_mean(&measured, width, height, HALF_WINDOW);
    let majority = |of: &[f32]| -> Vec<bool> {
        let mean = box_mean(of, width, height, HALF_WINDOW);
        mean.iter().zip(&around).map(|(m, a)| *a > 0.2 && *m > 0.5 * a).collect()
    };
    let (either, by_depth) = (majority(&by_either), majority(&by_depth));
    let changes = largest_region(&either, width);
    let changing = changes.iter().filter(|c| **c).count();
    let (all, still) = (scatter.len() as f64, (0..n).filter(|i| middle[*i] > 0.0 && !either[*i]).count() as f64);
    if changing < FEWEST_PIXELS {
        return Err(TurntableError::NothingTurns { pixels: changing });
    }
    if still / all < LEAST_STILL {
        return Err(TurntableError::NothingStandsStill { share: 100.0 * still / all });
    }
    let depth_changes = by_depth.iter().zip(&changes).map(|(d, c)| *d && *c).collect();
    Ok(Still {
        changes,
        depth_changes,
        middle,
        nearest,
        still_share: still / all,
        changing_share: changing as f64 / all,
    })
}

/// Takes the mean of all views from their grey values: light, highlights and outlines that stand still while things turn
/// would speak for no motion.
pub(super) fn subtract_standing_picture(views: &mut [TurningView]) {
    let pixels = views.first().map_or(0, |v| v.grey.len());
    for i in 0..pixels {
        let mean = views.iter().map(|v| v.grey[i]).sum::<f32>() / views.len() as f32;
        views.iter_mut().for_each(|v| v.grey[i] -= mean);
    }
}

/// The value that `share` of the values do not exceed.
fn quantile(values: &mut [f32], share: f64) -> f32 {
    if values.is_empty() {
        return 0.0;
    }
    let at = ((values.len() - 1) as f64 * share) as usize;
    *values.select_nth_unstable_by(at, f32::total_cmp).1
}

/// Mean over the window of `half` pixels to each side, as much of it as lies in the picture.
fn box_mean(values: &[f32], width: usize, height: usize, half: usize) -> Vec<f32> {
    let mut rows = vec![0.0_f32; values.len()];
    for v in 0..height {
        for u in 0..width {
            let (a, b) = (u.saturating_sub(half), (u + half + 1).min(width));
            rows[v * width + u] = values[v * width + a..v * width + b].iter().sum::<f32>() / (b - a) as f32;
        }
    }
    let mut out = vec![0.0_f32; values.len()];
    for v in 0..height {
        let (a, b) = (v.saturating_sub(half), (v + half + 1).min(height));
        for u in 0..width {
            out[v * width + u] = (a..b).map(|k| rows[k * width + u]).sum::<f32>() / (b - a) as f32;
        }
    }
    out
}

/// The largest connected region of `mask`; gaps of up to [`GAP`] pixels do not part it.
fn largest_region(mask: &[bool], width: usize) -> Vec<bool> {
    const GAP: i64 = 4;
    let height = mask.len() / width;
    let mut region = vec![0_u32; mask.len()];
    let (mut best, mut best_size, mut next) = (0, 0, 0);
    for start in 0..mask.len() {
        if !mask[start] || region[start] != 0 {
            continue;
        }
        next += 1;
        region[start] = next;
        let (mut size, mut stack) = (0_usize, vec![start]);
        while let Some(i) = stack.pop() {
            size += 1;
            let (u, v) = ((i % width) as i64, (i / width) as i64);
            for dv in -GAP..=GAP {
                for du in -GAP..=GAP {
                    let (x, y) = (u + du, v + dv);
                    if x < 0 || y < 0 || x >= width as i64 || y >= height as i64 {
                        continue;
                    }
                    let k = y as usize * width + x as usize;
                    if mask[k] && region[k] == 0 {
                        region[k] = next;
                        stack.push(k);
                    }
                }
            }
        }
        if size > best_size {
            (best, best_size) = (next, size);
        }
    }
    region.iter().map(|r| *r == best && best != 0).collect()
}
