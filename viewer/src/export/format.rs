//! The files that points and mesh are exported to.

/// A file to export the model's points to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PointFormat {
    /// A point cloud.
    Ply,
    /// A scene with a node by component.
    Glb,
}

/// A file to export the model's mesh to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeshFormat {
    /// With all it knows.
    Ply,
    /// Objects and materials by component, in two files.
    Obj,
    /// Solids without more, by component or as one.
    Stl,
    /// A scene with a node by component.
    Glb,
}

/// What is exported, and to which file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// The points.
    Points(PointFormat),
    /// The mesh.
    Mesh(MeshFormat),
}

impl Format {
    /// All of them.
    pub const ALL: [Self; 6] = [
        Self::Points(PointFormat::Ply),
        Self::Points(PointFormat::Glb),
        Self::Mesh(MeshFormat::Ply),
        Self::Mesh(MeshFormat::Obj),
        Self::Mesh(MeshFormat::Stl),
        Self::Mesh(MeshFormat::Glb),
    ];

    /// Media type of the files.
    pub fn mime(self) -> &'static str {
        match self {
            Self::Points(PointFormat::Ply) | Self::Mesh(MeshFormat::Ply) => "application/octet-stream",
            Self::Points(PointFormat::Glb) | Self::Mesh(MeshFormat::Glb) => "model/gltf-binary",
            Self::Mesh(MeshFormat::Obj) => "model/obj",
            Self::Mesh(MeshFormat::Stl) => "model/stl",
        }
    }
}
