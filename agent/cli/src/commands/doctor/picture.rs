//! What a picture tells of the camera: whether its depth is of the right unit, whether it is sharp, and whether it is exposed well.

use super::{Finding, Health};
use image::RgbImage;
use semascan_perception::view::{DepthImage, View};
use serde_json::json;

/// Distances at which cameras measure where the cell says none, metres.
const MEASURED: [f64; 2] = [0.05, 5.0];
/// Factors by which depth is wrong where its unit is mistaken, and the units.
const FACTORS: [(f64, &str); 4] = [
    (1e-3, "it is in millimetres and taken for metres"),
    (1e3, "it is in metres and taken for millimetres"),
    (0.1, "it is in tenths of what it is taken for"),
    (0.25, "it is in quarters of millimetres, as an L515 has it"),
];
/// Depth that is off the expected range by less than this factor is no matter of units.
const BESIDE: f64 = 2.0;
/// Share of the pixels that are measured at least.
const LEAST_MEASURED: f64 = 0.2;
/// Values that are as good as white and as good as black.
const WHITE: u8 = 252;
const BLACK: u8 = 3;
/// Shares of such pixels beyond which a picture has lost something.
const MOST_WHITE: f64 = 0.1;
const MOST_BLACK: f64 = 0.5;
/// Detail of a picture without edges finer than two pixels is a quarter, that of a sharp edge a half, of noise more.
const LEAST_DETAIL: f64 = 0.32;
/// Squared difference of neighbours at half the size below which a picture has nothing to judge the focus by.
const LEAST_CONTRAST: f64 = 2.0;

/// What is found on a view; `distance` is where the part is, metres.
pub(super) fn findings(view: &View, distance: Option<[f64; 2]>) -> Vec<Finding> {
    vec![depth(&view.depth, distance), focus(&view.rgb), exposure(&view.rgb)]
}

/// The median depth of the middle against the working distance.
fn depth(depth: &DepthImage, distance: Option<[f64; 2]>) -> Finding {
    let what = "depth";
    let (width, height) = (depth.width as usize, depth.height as usize);
    let rows = height / 4..height - height / 4;
    let middle = rows.flat_map(|row| (width / 4..width - width / 4).map(move |column| row * width + column));
    let mut measured: Vec<f32> =
        middle.filter_map(|place| depth.metres.get(place).copied()).filter(|z| *z > 0.0).collect();
    measured.sort_by(f32::total_cmp);
    let share = depth.metres.iter().filter(|z| **z > 0.0).count() as f64 / depth.metres.len().max(1) as f64;
    let Some(median) = measured.get(measured.len() / 2).map(|z| f64::from(*z)) else {
        let text = format!("nothing is measured in the middle of the picture, {:.0} % of it in all", 100.0 * share);
        let mend = "put the part before the camera, within the distances that it measures";
        return Finding::wrong(what, Health::Failed, text, mend);
    };
    let [least, most] = distance.unwrap_or(MEASURED);
    let within = |z: f64| (least..=most).contains(&z);
    let text = format!("{median:.3} m in the middle, {:.0} % of the picture measured", 100.0 * share);
    let details = json!({ "median_m": median, "measured": share, "working_distance_m": [least, most] });
    let found = if within(median) {
        if share >= LEAST_MEASURED {
            Finding::ok(what, text)
        } else {
            let mend =
                "glossy or dark surfaces, sunlight or too short a distance keep the camera from measuring: try each";
            Finding::wrong(what, Health::Warning, text, mend)
        }
    } else {
        let expected = format!("{text}, and {least} m to {most} m are expected");
        // So near to the range the camera may just stand elsewhere.
        let is_beside = (least / BESIDE..=most * BESIDE).contains(&median);
        match FACTORS.into_iter().find(|(factor, _)| !is_beside && within(median * factor)) {
            Some((factor, why)) => {
                let times = if factor < 1.0 {
                    format!("{} times too large", 1.0 / factor)
                } else {
                    format!("{factor} times too small")
                };
                let mend = format!("if {why}, set the unit: source.unit or source.depth_scale_mm in cell.toml");
                Finding::wrong(what, Health::Failed, format!("{expected}: it looks {times}"), mend)
            }
            None => {
                let mend = "put the camera where cell.working_distance says, or say there where it is";
                Finding::wrong(what, Health::Failed, expected, mend)
            }
        }
    };
    Finding { details, ..found }
}

/// How much of the picture's contrast is as fine as its pixels: differences of neighbours against those at half the size. A picture
/// that is blurred over more than two pixels is a ramp to both, and has a quarter of them; a sharp edge has a half.
fn focus(picture: &RgbImage) -> Finding {
    let what = "focus";
    let (width, height) = (picture.width() as usize, picture.height() as usize);
    let grey: Vec<f32> = picture.pixels().map(|p| p.0.iter().map(|c| f32::from(*c)).sum::<f32>() / 3.0).collect();
    let half: Vec<f32> = (0..height / 2)
        .flat_map(|y| (0..width / 2).map(move |x| 2 * y * width + 2 * x))
        .map(|at| [at, at + 1, at + width, at + width + 1].iter().filter_map(|at| grey.get(*at)).sum::<f32>() / 4.0)
        .collect();
    let (fine, coarse) = (contrast(&grey, width), contrast(&half, width / 2));
    if coarse < LEAST_CONTRAST {
        let text = "the picture has no edges by which it could be judged";
        return Finding::wrong(what, Health::Warning, text, "put the part before the camera, and light on it");
    }
    let detail = fine / coarse;
    let text = format!("detail {detail:.2} (0.25 is blurred, 0.5 and more sharp)");
    let found = if detail < LEAST_DETAIL {
        Finding::wrong(
            what,
            Health::Failed,
            text,
            "focus the lens, clean it, or shorten the exposure if the camera moves",
        )
    } else {
        Finding::ok(what, text)
    };
    Finding { details: json!({ "detail": detail }), ..found }
}

/// Mean squared difference of neighbours in a row.
fn contrast(grey: &[f32], width: usize) -> f64 {
    if width < 2 {
        return 0.0;
    }
    let squares = grey.chunks_exact(width).flat_map(|row| row.windows(2)).map(|pair| match pair {
        [a, b] => f64::from(a - b).powi(2),
        _ => 0.0,
    });
    squares.sum::<f64>() / (grey.len().max(1) as f64)
}

/// Shares of the picture that are as good as white and as good as black.
fn exposure(picture: &RgbImage) -> Finding {
    let what = "exposure";
    let all = (picture.width() * picture.height()).max(1) as f64;
    let share = |is_it: fn(&[u8; 3]) -> bool| picture.pixels().filter(|pixel| is_it(&pixel.0)).count() as f64 / all;
    let (white, black) = (share(|p| p.iter().any(|c| *c >= WHITE)), share(|p| p.iter().all(|c| *c <= BLACK)));
    let text = format!("{:.1} % of the picture is white, {:.1} % black", 100.0 * white, 100.0 * black);
    let found = if white > MOST_WHITE {
        Finding::wrong(what, Health::Failed, text, "shorten the exposure, close the iris, or diffuse the light")
    } else if black > MOST_BLACK {
        Finding::wrong(what, Health::Failed, text, "lengthen the exposure, open the iris, or add light")
    } else {
        Finding::ok(what, text)
    };
    Finding { details: json!({ "white": white, "black": black }), ..found }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgb;

    /// A checkerboard of fields of 8 pixels, blurred by a box of so many.
    fn board(blur: i64) -> RgbImage {
        let grey = |x: i64, y: i64| if (x.div_euclid(8) + y.div_euclid(8)) % 2 == 0 { 200.0 } else { 40.0 };
        RgbImage::from_fn(160, 120, |x, y| {
            let (x, y) = (i64::from(x), i64::from(y));
            let window = (-blur..=blur).flat_map(|v| (-blur..=blur).map(move |u| (u, v)));
            let sum: f64 = window.map(|(u, v)| grey(x + u, y + v)).sum();
            Rgb([(sum / ((2 * blur + 1) * (2 * blur + 1)) as f64) as u8; 3])
        })
    }

    #[test]
    fn a_blurred_picture_and_one_without_edges_are_told_from_a_sharp_one() {
        assert_eq!(focus(&board(0)).health, Health::Ok, "{:?}", focus(&board(0)));
        assert_eq!(focus(&board(4)).health, Health::Failed, "{:?}", focus(&board(4)));
        assert_eq!(focus(&RgbImage::from_pixel(160, 120, Rgb([90; 3]))).health, Health::Warning);
        assert_eq!(focus(&RgbImage::new(1, 1)).health, Health::Warning);
    }

    #[test]
    fn a_unit_that_is_mistaken_is_named() {
        let image = |z: f32| DepthImage { width: 8, height: 6, metres: vec![z; 48] };
        let near = Some([0.2, 0.8]);
        assert_eq!(depth(&image(0.5), near).health, Health::Ok);
        assert_eq!(depth(&image(0.5), None).health, Health::Ok);
        for (z, word) in [(500.0, "1000 times too large"), (5e-4, "1000 times too small"), (2.0, "times too large")] {
            let found = depth(&image(z), near);
            assert!(found.health == Health::Failed && found.text.contains(word), "{found:?}");
            assert!(found.mend.contains("source.unit"), "{found:?}");
        }
        let far = depth(&image(1.2), near);
        assert!(far.health == Health::Failed && far.mend.contains("working_distance"), "{far:?}");
        assert_eq!(depth(&image(0.0), near).health, Health::Failed);
    }

    #[test]
    fn a_picture_that_is_burnt_out_or_dark_fails() {
        let of = |value: u8| exposure(&RgbImage::from_pixel(20, 20, Rgb([value; 3]))).health;
        assert_eq!([of(128), of(255), of(0)], [Health::Ok, Health::Failed, Health::Failed]);
    }
}
