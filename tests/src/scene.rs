//! A small BOP scene on disk, to be broken in every way.

use anyhow::Result;
use image::{ImageBuffer, Luma, Rgb, RgbImage};
use serde_json::{Map, Value, json};
use std::path::Path;

/// Columns and rows of the pictures.
pub const SIZE: (u32, u32) = (64, 48);

/// Writes a scene of `views` views: a wall at half a metre with one object on it, the camera moving sideways.
///
/// # Errors
/// If the folder cannot be written.
pub fn write(folder: &Path, views: u32) -> Result<()> {
    let (width, height) = SIZE;
    for kind in ["rgb", "depth", "mask_visib"] {
        std::fs::create_dir_all(folder.join(kind))?;
    }
    let (mut cameras, mut truth) = (Map::new(), Map::new());
    for view in 0..views {
        let name = format!("{view:06}.png");
        RgbImage::from_fn(width, height, |x, y| Rgb([x as u8 * 3, y as u8 * 4, 90]))
            .save(folder.join("rgb").join(&name))?;
        let depth: ImageBuffer<Luma<u16>, Vec<u16>> = ImageBuffer::from_fn(width, height, |_, _| Luma([5000]));
        depth.save(folder.join("depth").join(&name))?;
        let mask = ImageBuffer::from_fn(width, height, |x, _| Luma([if x < width / 2 { 255_u8 } else { 0 }]));
        mask.save(folder.join("mask_visib").join(format!("{view:06}_000000.png")))?;
        let camera = json!({
            "cam_K": [60.0, 0.0, 31.5, 0.0, 60.0, 23.5, 0.0, 0.0, 1.0],
            "depth_scale": 0.1,
            "cam_R_w2c": [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            "cam_t_w2c": [-10.0 * f64::from(view), 0.0, 0.0],
        });
        cameras.insert(view.to_string(), camera);
        truth.insert(view.to_string(), json!([{ "obj_id": 4 }]));
    }
    std::fs::write(folder.join("scene_camera.json"), Value::Object(cameras).to_string())?;
    std::fs::write(folder.join("scene_gt.json"), Value::Object(truth).to_string())?;
    std::fs::write(folder.join("objects.json"), json!({ "4": "oil_filter" }).to_string())?;
    Ok(())
}

/// Replaces the first `from` in a text file of the scene.
///
/// # Errors
/// If the file cannot be read or does not hold `from`.
pub fn edit(file: &Path, from: &str, to: &str) -> Result<()> {
    let text = std::fs::read_to_string(file)?;
    anyhow::ensure!(text.contains(from), "{} does not hold {from}", file.display());
    std::fs::write(file, text.replacen(from, to, 1))?;
    Ok(())
}
