//! Single objects from an instance network, by detection or by centres.
//!
//! **Detection** (Mask R-CNN, [He 2017]): boxes, classes, scores and masks. A class's probability at a pixel is the
//! largest `score * mask` of its objects, what is left is none's, so that a detector serves as a network for components
//! as well.
//! **Centres** (Panoptic-DeepLab, [Cheng 2020]): local maxima of a heat map are objects, and a pixel belongs to the
//! object of its class whose centre its offset points to.

use super::engine::Tensor;

/// Detections below this score are not objects.
const SCORE: f32 = 0.5;
/// A mask covers pixels from here on.
const MASK: f32 = 0.5;
/// Least height of a centre on the heat map.
const CENTRE: f32 = 0.3;
/// Half the window in which a centre is the highest point, cells of the heat map.
const REACH: usize = 3;
/// Pixels for one cell of the heat map.
const STRIDE: usize = 4;
/// Most objects of a picture: noise has no end of maxima.
const MOST: usize = 200;

/// Objects of one picture, numbered from 1; 0 is none.
#[derive(Clone, Debug, PartialEq)]
pub struct Objects {
    /// Object of each pixel.
    pub instances: Vec<u16>,
    /// How many there are.
    pub count: u16,
}

/// Why an instance network's output cannot be read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("output {output}: {shape:?} is not {wanted}")]
pub struct ShapeError {
    /// The output.
    pub output: &'static str,
    /// Its shape.
    pub shape: Vec<usize>,
    /// What it should be.
    pub wanted: String,
}

/// Checks that `tensor` has as many values as `wanted` dimensions say.
fn expect(output: &'static str, tensor: &Tensor, wanted: &[usize]) -> Result<(), ShapeError> {
    let count = wanted.iter().product::<usize>();
    let fits = tensor.data.len() == count && tensor.shape.iter().product::<usize>() == count;
    if fits { Ok(()) } else { Err(ShapeError { output, shape: tensor.shape.clone(), wanted: format!("{wanted:?}") }) }
}

/// Class probabilities (`classes * pixels`, class after class) and objects from what a detector gives: boxes, labels,
/// scores, masks, for a picture of `size` (columns, rows).
///
/// # Errors
/// [`ShapeError`] if the outputs do not fit together.
pub(super) fn from_detections(
    outputs: &[Tensor],
    classes: usize,
    size: (usize, usize),
) -> Result<(Vec<f32>, Objects), ShapeError> {
    let none = Tensor::default();
    let [boxes, labels, scores, masks] = [0, 1, 2, 3].map(|i| outputs.get(i).unwrap_or(&none));
    let (found, pixels) = (scores.data.len(), size.0 * size.1);
    expect("boxes", boxes, &[found, 4])?;
    expect("labels", labels, &[found])?;
    expect("masks", masks, &[found, 1, size.1, size.0])?;
    let mut probabilities = vec![0.0_f32; classes * pixels];
    let mut instances = vec![0; pixels];
    let mut order: Vec<usize> = (0..found).filter(|&d| scores.data[d] >= SCORE).collect();
    order.sort_by(|&a, &b| scores.data[b].total_cmp(&scores.data[a]));
    let mut count = 0;
    for d in order.into_iter().take(MOST) {
        let class = labels.data[d].max(0.0) as usize;
        if class == 0 || class >= classes {
            continue;
        }
        count += 1;
        let mask = &masks.data[d * pixels..(d + 1) * pixels];
        for (i, &covers) in mask.iter().enumerate() {
            let p = &mut probabilities[class * pixels + i];
            *p = p.max((scores.data[d] * covers).clamp(0.0, 1.0));
            // The surer of two objects keeps a pixel that both claim.
            if covers >= MASK && instances[i] == 0 {
                instances[i] = count;
            }
        }
    }
    for i in 0..pixels {
        let sum: f32 = (1..classes).map(|c| probabilities[c * pixels + i]).sum();
        let largest = (1..classes).map(|c| probabilities[c * pixels + i]).fold(0.0, f32::max);
        let all = sum + 1.0 - largest;
        probabilities[i] = 1.0 - largest;
        (0..classes).for_each(|c| probabilities[c * pixels + i] /= all);
    }
    Ok((probabilities, Objects { instances, count }))
}

/// Objects from a heat map of centres and offsets to them, for a picture of `size` (columns, rows) whose pixels have
/// `labels`.
///
/// # Errors
/// [`ShapeError`] if the outputs do not fit the picture.
pub(super) fn from_centres(
    outputs: &[Tensor],
    classes: usize,
    labels: &[u16],
    size: (usize, usize),
) -> Result<Objects, ShapeError> {
    let none = Tensor::default();
    let [heat, offsets] = [0, 1].map(|i| outputs.get(i).unwrap_or(&none));
    let cells = (size.0 / STRIDE, size.1 / STRIDE);
    expect("centres", heat, &[classes, cells.1, cells.0])?;
    expect("offsets", offsets, &[2, cells.1, cells.0])?;
    let centres = peaks(&heat.data, classes, cells);
    let plane = cells.0 * cells.1;
    let mut instances = vec![0; labels.len()];
    for (i, &label) in labels.iter().enumerate().filter(|(_, label)| **label != 0) {
        let (x, y) = (i % size.0, i / size.0);
        let cell = (y / STRIDE).min(cells.1 - 1) * cells.0 + (x / STRIDE).min(cells.0 - 1);
        let from = (middle(x / STRIDE), middle(y / STRIDE));
        let at = (from.0 + offsets.data[cell], from.1 + offsets.data[plane + cell]);
        let distance = |c: &Peak| (c.at.0 - at.0).powi(2) + (c.at.1 - at.1).powi(2);
        let own = centres.iter().enumerate().filter(|(_, c)| c.class == usize::from(label));
        let nearest = own.min_by(|a, b| distance(a.1).total_cmp(&distance(b.1)));
        instances[i] = nearest.map_or(0, |(k, _)| k as u16 + 1);
    }
    Ok(Objects { instances, count: centres.len() as u16 })
}

/// Middle of the cell numbered `c`, in pixels.
fn middle(c: usize) -> f32 {
    (c * STRIDE) as f32 + (STRIDE as f32 - 1.0) / 2.0
}

/// A centre, in pixels.
struct Peak {
    class: usize,
    at: (f32, f32),
}

/// Local maxima of each class's heat map but none's, the highest first where there are too many.
fn peaks(heat: &[f32], classes: usize, cells: (usize, usize)) -> Vec<Peak> {
    let plane = cells.0 * cells.1;
    let mut found: Vec<(f32, Peak)> = Vec::new();
    for class in 1..classes {
        let heat = &heat[class * plane..(class + 1) * plane];
        for (i, &height) in heat.iter().enumerate().filter(|(_, h)| **h >= CENTRE) {
            let (x, y) = (i % cells.0, i / cells.0);
            let columns = x.saturating_sub(REACH)..(x + REACH + 1).min(cells.0);
            let mut around = (y.saturating_sub(REACH)..(y + REACH + 1).min(cells.1))
                .flat_map(|y| columns.clone().map(move |x| y * cells.0 + x));
            // Of equal heights the first counts.
            if around.all(|j| heat[j] < height || heat[j] == height && j >= i) {
                found.push((height, Peak { class, at: (middle(x), middle(y)) }));
            }
        }
    }
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    found.into_iter().take(MOST).map(|(_, peak)| peak).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tensor(shape: &[usize], data: Vec<f32>) -> Tensor {
        Tensor { shape: shape.to_vec(), data }
    }

    #[test]
    fn detections_become_probabilities_and_objects() {
        // A picture of 4 x 1: an object of class 2 on the left half, a weaker one of class 1 on the middle.
        let outputs = [
            tensor(&[3, 4], vec![0.0; 12]),
            tensor(&[3], vec![1.0, 2.0, 2.0]),
            tensor(&[3], vec![0.6, 0.9, 0.4]),
            tensor(&[3, 1, 1, 4], vec![0.0, 1.0, 1.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0]),
        ];
        let (p, objects) = from_detections(&outputs, 3, (4, 1)).expect("fits");
        assert_eq!((objects.instances, objects.count), (vec![1, 1, 2, 0], 2));
        // Pixel 1: 0.9 and 0.6 are claimed, 0.1 is left for none.
        for (c, wanted) in [0.1, 0.6, 0.9].into_iter().enumerate() {
            assert!((p[c * 4 + 1] - wanted / 1.6).abs() < 1e-6);
        }
        assert_eq!((p[3], p[4 + 3], p[8 + 3]), (1.0, 0.0, 0.0));
        let wrong = [outputs[0].clone(), outputs[1].clone(), outputs[2].clone(), tensor(&[1], vec![0.0])];
        let error = from_detections(&wrong, 3, (4, 1)).expect_err("no masks");
        assert!(error.to_string().contains("masks"), "{error}");
    }

    #[test]
    fn pixels_go_to_the_centre_their_offsets_point_to() {
        // 64 x 16 pixels: two objects of class 1 with centres in cells 3 and 12 of row 1.
        let (columns, rows) = (16, 4);
        let mut heat = vec![0.0; 2 * columns * rows];
        heat[columns * rows + columns + 3] = 0.9;
        heat[columns * rows + columns + 12] = 0.8;
        heat[columns * rows + columns + 13] = 0.7;
        let target = |cell: usize| if cell % columns < 8 { 13.5 } else { 49.5 };
        let dx = |cell: usize| target(cell) - middle(cell % columns);
        let mut offsets: Vec<f32> = (0..columns * rows).map(dx).collect();
        offsets.extend((0..columns * rows).map(|cell| 5.5 - middle(cell / columns)));
        let outputs = [tensor(&[1, 2, 4, 16], heat), tensor(&[1, 2, 4, 16], offsets)];
        let mut labels = vec![1; 64 * 16];
        labels[0] = 0;
        let objects = from_centres(&outputs, 2, &labels, (64, 16)).expect("fits");
        assert_eq!(objects.count, 2, "the lower neighbour of a centre is none");
        assert_eq!((objects.instances[0], objects.instances[1], objects.instances[63]), (0, 1, 2));
        // A class without a centre has no objects.
        let objects = from_centres(&outputs, 2, &vec![5; 64 * 16], (64, 16)).expect("fits");
        assert!(objects.instances.iter().all(|i| *i == 0));
    }
}
