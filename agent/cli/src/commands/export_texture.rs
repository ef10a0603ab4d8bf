//! `semascan export --texture`: the photographs on the mesh that is written.

use super::photographs::InspectedPhotographs;
use super::{Failure, numbers};
use anyhow::anyhow;
use clap::Args;
use semascan_formats::MeshTexture;
use semascan_formats::ply::PlyModel;
use semascan_model::SemanticMesh;
use semascan_store::read_record;
use semascan_texture::{TextureError, TextureOptions, TexturedMesh, UNSEEN_COLOR, texture};
use std::path::Path;

/// Arguments of `semascan export` about textures.
#[derive(Debug, Args)]
pub(super) struct TextureArgs {
    /// Lay the photographs onto the mesh, as one picture in a GLB and beside an OBJ (mesh.png). What no photograph shows is grey
    /// (128) with alpha 0, and said
    #[arg(long)]
    pub(super) texture: bool,
    /// Length of a texel on the surface in millimetres [default: a pixel of the photographs]; longer where 8192 x 8192 are too few
    #[arg(
        long, value_name = "MM", requires = "texture", value_parser = numbers::length::<f64>, allow_negative_numbers = true
    )]
    texel: Option<f64>,
    /// Where the inspection's photographs are [default: its capture in the data folder, else its source]
    #[arg(long, value_name = "SOURCE", requires = "texture")]
    photographs: Option<String>,
}

/// A textured mesh and its picture.
pub(super) struct Textured {
    pub(super) made: TexturedMesh,
    pub(super) png: Vec<u8>,
}

impl TextureArgs {
    /// The photographs of the inspection in the folder `source`, if a texture is asked for. That they are there is known before
    /// anything is computed.
    ///
    /// # Errors
    /// [`Failure::Call`] if there are none.
    pub(super) fn photographs(&self, source: &Path) -> Result<Option<InspectedPhotographs>, Failure> {
        if !self.texture {
            return Ok(None);
        }
        if !source.is_dir() {
            let reason = "--texture needs the folder of an inspection: a file alone has no photographs";
            return Err(Failure::Call(anyhow!("{}: {reason}", source.display())));
        }
        let record = read_record(source)?;
        InspectedPhotographs::open(source, &record, self.photographs.as_deref()).map(Some)
    }

    /// `mesh` of `model` with the photographs on it.
    ///
    /// # Errors
    /// [`Failure`] if none of them can be used.
    pub(super) fn of(
        &self,
        mesh: &SemanticMesh,
        model: &PlyModel,
        mut photographs: InspectedPhotographs,
    ) -> Result<Textured, Failure> {
        if model.shift != [0.0; 3] {
            return Err(Failure::Call(anyhow!(
                "the model is shifted against the table frame, which poses of photographs are given in"
            )));
        }
        let options = TextureOptions { texel: self.texel.map(|mm| mm * 1e-3), ..TextureOptions::default() };
        let count = photographs.len();
        let made = texture(mesh, count, |number| photographs.photograph(number), &options);
        let made = made.map_err(|error| match error {
            TextureError::NoPhotograph { .. } => Failure::Call(error.into()),
            error => Failure::Work(error.into()),
        })?;
        made.figures.left_out.iter().for_each(|reason| tracing::warn!("a photograph is left out: {reason}"));
        let png = made.png().map_err(|error| Failure::Work(error.into()))?;
        log_made(&made, png.len(), self.texel);
        Ok(Textured { made, png })
    }
}

impl Textured {
    /// What the formats' writers need.
    pub(super) fn picture(&self) -> MeshTexture<'_> {
        let figures = &self.made.figures;
        MeshTexture {
            png: &self.png,
            size: self.made.atlas.dimensions(),
            places: &self.made.places,
            texel: figures.texel,
            unseen: figures.unseen,
            unseen_color: UNSEEN_COLOR,
        }
    }
}

/// Says what the texture is.
fn log_made(made: &TexturedMesh, bytes: usize, wanted_mm: Option<f64>) {
    let figures = &made.figures;
    let (width, height) = made.atlas.dimensions();
    let (texel, pixel) = (figures.texel * 1e3, figures.pixel * 1e3);
    tracing::info!(
        "texture {width} x {height}, {:.1} MB, texel {texel:.3} mm: {} charts of {} photographs",
        bytes as f64 * 1e-6,
        figures.charts,
        figures.photographs
    );
    if figures.is_coarser {
        tracing::warn!("shorter texels than {texel:.3} mm do not fit into 8192 x 8192");
    } else if wanted_mm.is_some_and(|mm| mm < 0.7 * pixel) {
        tracing::warn!("the photographs' pixels are {pixel:.3} mm long: shorter texels show nothing more");
    }
    tracing::info!(
        "  {:.1} % of the surface ({} of {} triangles) is in no photograph: grey, alpha 0",
        figures.unseen * 1e2,
        figures.unseen_faces,
        figures.faces
    );
}
