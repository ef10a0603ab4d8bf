//! A file with those that were opened together with it: its shape is read at once, its pictures are decoded by whoever can.

use super::model::{OpenError, OpenedModel};
use super::picture::Picture;
use crate::words::t;
use semascan_formats::{Geometry, Texture, ply};
use std::io;
use std::sync::Arc;

/// A file that was opened together with a model: its name and its content. A material library, for instance, or a picture.
pub type Beside = (String, Arc<[u8]>);

/// A file whose pictures are still to be decoded.
#[derive(Debug)]
pub struct OpenedFile {
    name: String,
    content: Content,
}

#[derive(Debug)]
enum Content {
    /// Semascan's own, with the edge of its voxels.
    Own(Box<ply::PlyModel>, f32),
    Foreign(Box<Geometry>),
}

impl OpenedFile {
    /// Reads a file by the ending of its name.
    ///
    /// * `beside`: what was opened with it.
    ///
    /// # Errors
    /// [`OpenError`] if it cannot be read.
    pub fn read(name: &str, bytes: &[u8], beside: &[Beside]) -> Result<Self, OpenError> {
        let is_ply = name.rsplit_once('.').is_some_and(|(_, ending)| ending.eq_ignore_ascii_case("ply"));
        let content = match is_ply {
            true => {
                let file = ply::read(name, bytes)?;
                match file.voxel() {
                    Some(voxel) => Content::Own(Box::new(file), voxel),
                    None => Content::Foreign(Box::new(Geometry::of_ply(name, file)?)),
                }
            }
            false => Content::Foreign(Box::new(Geometry::read(name, bytes, &|named: &str| find(beside, named))?)),
        };
        Ok(Self { name: name.to_owned(), content })
    }

    /// Its pictures as they are stored.
    pub fn textures(&self) -> &[Texture] {
        match &self.content {
            Content::Own(..) => &[],
            Content::Foreign(geometry) => &geometry.textures,
        }
    }

    /// The model.
    ///
    /// * `pictures`: those of [`Self::textures`] that could be decoded, in their order.
    ///
    /// # Errors
    /// [`OpenError`] if it holds nothing or too much.
    pub fn model(self, pictures: &[Option<Picture>]) -> Result<OpenedModel, OpenError> {
        match self.content {
            Content::Own(file, voxel) => OpenedModel::own(&self.name, *file).checked(Some(voxel)),
            Content::Foreign(geometry) => OpenedModel::foreign(&self.name, *geometry, pictures).checked(None),
        }
    }
}

/// What a model calls `named` among the files that were opened with it, wherever it stands there.
fn find(beside: &[Beside], named: &str) -> io::Result<Vec<u8>> {
    let last = named.rsplit('/').next().unwrap_or(named);
    let found = beside.iter().find(|(name, _)| name.eq_ignore_ascii_case(last));
    let missing = || io::Error::new(io::ErrorKind::NotFound, t!("file.beside", name = last));
    found.map(|(_, bytes)| bytes.to_vec()).ok_or_else(missing)
}

#[cfg(test)]
#[allow(clippy::expect_used)]
mod tests {
    use super::*;

    #[test]
    fn pictures_that_were_opened_with_a_model_colour_its_vertices() {
        let obj =
            b"mtllib C:\\scans\\box.mtl\nv 0 0 0\nv 10 0 0\nv 10 10 0\nv 0 10 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n\
                    usemtl skin\nf 1/1 2/2 3/3 4/4\n";
        let library: Beside = ("BOX.MTL".into(), b"newmtl skin\nKd 0.1 0.1 0.1\nmap_Kd skin.png\n"[..].into());
        let picture: Beside = ("skin.png".into(), [1, 2, 3][..].into());
        let file = OpenedFile::read("box.obj", obj, &[library.clone(), picture]).expect("a mesh");
        assert_eq!(file.textures().iter().map(|t| t.bytes.as_slice()).collect::<Vec<_>>(), [[1, 2, 3]]);
        // Large enough that the vertices, in its corners, see one colour each.
        let side = 64;
        let color = |k: u32| match (k % side < side / 2, k / side < side / 2) {
            (true, true) => [255, 0, 0, 255],
            (false, true) => [0, 255, 0, 255],
            (true, false) => [0, 0, 255, 255],
            (false, false) => [255, 255, 0, 255],
        };
        let pixels: Vec<u8> = (0..side * side).flat_map(color).collect();
        let model = file.model(&[Picture::new(side, side, &pixels)]).expect("a mesh");
        assert_eq!(model.mesh.vertices.colors, [[0, 0, 255], [255, 255, 0], [0, 255, 0], [255, 0, 0]]);
        assert!(model.remarks.iter().any(|remark| remark == t!("file.pictures_at_vertices")), "{:?}", model.remarks);

        let alone = OpenedFile::read("box.obj", obj, &[library]).expect("a mesh").model(&[]).expect("a mesh");
        assert!(alone.remarks.iter().any(|remark| remark.contains("skin.png")), "{:?}", alone.remarks);
        assert!(
            alone.mesh.vertices.colors.iter().all(|c| c[0] == c[2] && c[0] < 128),
            "{:?}",
            alone.mesh.vertices.colors
        );
    }

    #[test]
    fn a_picture_that_nobody_can_decode_is_named() {
        let obj = b"mtllib a.mtl\nv 0 0 0\nv 10 0 0\nv 10 10 0\nvt 0 0\nusemtl skin\nf 1/1 2/1 3/1\n";
        let library: Beside = ("a.mtl".into(), b"newmtl skin\nmap_Kd skin.tga\n"[..].into());
        let file = OpenedFile::read("a.obj", obj, &[library, ("skin.tga".into(), [7][..].into())]).expect("a mesh");
        let model = file.model(&[None]).expect("a mesh");
        assert!(model.remarks.iter().any(|remark| remark.contains("skin.tga")), "{:?}", model.remarks);
    }
}
