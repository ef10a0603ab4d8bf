//! Where the vertices of a mesh stand: at their node, once or many times (`EXT_mesh_gpu_instancing`), or where the joints of a
//! skin hold them (glTF 2.0, section 3.7.3.3: the node of a skinned mesh does not place it).

use super::accessor::Buffers;
use super::document::{Document, Instancing, Primitive};
use super::read::{transform, z_up};
use glam::{DMat4, DQuat, DVec3, DVec4};

/// Deepest nesting of joints.
const MAX_DEPTH: usize = 256;

/// Table frame from the frame of a primitive's vertices.
#[derive(Debug)]
pub(super) enum Placement {
    /// The same for all.
    Rigid(DMat4),
    /// One for each vertex.
    Skinned(Vec<DMat4>),
}

impl Placement {
    /// The placement of vertex `index`.
    pub(super) fn of_vertex(&self, index: usize) -> DMat4 {
        match self {
            Self::Rigid(placed) => *placed,
            Self::Skinned(vertices) => vertices.get(index).copied().unwrap_or_else(z_up),
        }
    }

    /// Where the joints of a skin hold a primitive's vertices: the mean of the joints' transforms by the vertex's weights. A
    /// primitive that names no joints stays where its vertices say.
    pub(super) fn of_skin(joints: &[DMat4], buffers: &Buffers<'_>, primitive: &Primitive) -> Result<Self, String> {
        let mut sums: Vec<(DMat4, f64)> = Vec::new();
        for set in 0.. {
            let of = |name: &str| primitive.attributes.get(&format!("{name}_{set}")).copied();
            let (Some(indices), Some(weights)) = (of("JOINTS"), of("WEIGHTS")) else { break };
            let (indices, weights) = (buffers.numbers(indices, 4)?, buffers.shares(weights, 4)?);
            sums.resize(sums.len().max(indices.len() / 4), (DMat4::ZERO, 0.0));
            for ((sum, indices), weights) in sums.iter_mut().zip(indices.chunks_exact(4)).zip(weights.chunks_exact(4)) {
                for (&joint, &weight) in indices.iter().zip(weights).filter(|(_, weight)| **weight > 0.0) {
                    let joint =
                        joints.get(joint as usize).ok_or_else(|| format!("joint {joint} is not in the skin"))?;
                    sum.0 += *joint * weight;
                    sum.1 += weight;
                }
            }
        }
        if sums.is_empty() {
            return Ok(Self::Rigid(z_up()));
        }
        let mean = |(sum, weight): (DMat4, f64)| if weight > 0.0 { sum * weight.recip() } else { z_up() };
        Ok(Self::Skinned(sums.into_iter().map(mean).collect()))
    }
}

/// Table from the vertices' frame as each joint of a skin holds them.
pub(super) fn joints(document: &Document, buffers: &Buffers<'_>, skin: usize) -> Result<Vec<DMat4>, String> {
    let skin = document.skins.get(skin).ok_or_else(|| format!("skin {skin} is not there"))?;
    let inverse = skin.inverse_bind_matrices.map(|accessor| buffers.numbers(accessor, 16)).transpose()?;
    let inverse = |k: usize| -> Result<DMat4, String> {
        let Some(numbers) = &inverse else { return Ok(DMat4::IDENTITY) };
        let columns = numbers.get(16 * k..16 * (k + 1)).ok_or("a joint has no inverse bind matrix")?;
        Ok(DMat4::from_cols_slice(columns))
    };
    let mut parents = vec![None; document.nodes.len()];
    for (parent, node) in document.nodes.iter().enumerate() {
        for &child in &node.children {
            if let Some(slot) = parents.get_mut(child) {
                *slot = Some(parent);
            }
        }
    }
    skin.joints
        .iter()
        .enumerate()
        .map(|(k, &joint)| Ok(z_up() * global(document, &parents, joint)? * inverse(k)?))
        .collect()
}

/// Scene from node; `parents` has that of each node.
fn global(document: &Document, parents: &[Option<usize>], node: usize) -> Result<DMat4, String> {
    let (mut at, mut placed) = (node, DMat4::IDENTITY);
    for _ in 0..MAX_DEPTH {
        let this = document.nodes.get(at).ok_or_else(|| format!("node {at} is not there"))?;
        placed = transform(this) * placed;
        match parents.get(at).copied().flatten() {
            Some(parent) => at = parent,
            None => return Ok(placed),
        }
    }
    Err(format!("node {node}: joints nest without end"))
}

/// Node from instance, for each instance of a node's mesh.
pub(super) fn instances(buffers: &Buffers<'_>, instancing: &Instancing) -> Result<Vec<DMat4>, String> {
    let column = |name: &str, width: usize| -> Result<Vec<f64>, String> {
        let Some(&accessor) = instancing.attributes.get(name) else { return Ok(Vec::new()) };
        // Whole numbers of rotations are shares.
        if name == "ROTATION" { buffers.shares(accessor, width) } else { buffers.numbers(accessor, width) }
    };
    let (translations, rotations, scales) = (column("TRANSLATION", 3)?, column("ROTATION", 4)?, column("SCALE", 3)?);
    let count = (translations.len() / 3).max(rotations.len() / 4).max(scales.len() / 3);
    if count == 0 {
        return Err("its instances have neither translation, rotation nor scale".into());
    }
    let three = |column: &[f64], k: usize, default| column.get(3 * k..3 * k + 3).map_or(default, DVec3::from_slice);
    let instance = |k: usize| {
        let rotation = rotations.get(4 * k..4 * k + 4).map(|q| DQuat::from_vec4(DVec4::from_slice(q)));
        let rotation = rotation.filter(|q| q.length_squared() > 0.0).map_or(DQuat::IDENTITY, DQuat::normalize);
        let (scale, translation) = (three(&scales, k, DVec3::ONE), three(&translations, k, DVec3::ZERO));
        DMat4::from_scale_rotation_translation(scale, rotation, translation)
    };
    Ok((0..count).map(instance).collect())
}
