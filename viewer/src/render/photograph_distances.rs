//! The mesh as a photograph's camera sees it, distances in place of colours: the shaders know by it what the camera did not see.
//! A distance is the bits of a float in an unsigned integer, the one format of such that WebGL2 is sure to draw on.

use super::frame::FrameUniform;
use super::gpu::Gpu;
use super::mesh::Mesh;
use super::photograph_camera::PhotographCamera;
use super::pick::numbers_pass;
use super::pipeline::{Primitive, Uniform};
use bytemuck::{Pod, Zeroable};
use wgpu::{CommandEncoderDescriptor, CompareFunction, PrimitiveTopology, RenderPipeline, TextureFormat, TextureView};

/// Format of the distances.
pub(super) const DISTANCE_FORMAT: TextureFormat = TextureFormat::R32Uint;
/// How far a surface may lie behind the distance at its pixel, voxels.
const TOLERANCE: f32 = 1.5;

/// A photograph's camera as shaders take it: see photograph.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub(super) struct CameraContent {
    camera_from_table: [[f32; 4]; 4],
    camera: [f32; 4],
    size: [f32; 4],
}

impl CameraContent {
    /// * `strength`: how much its photograph counts; 0 for none.
    /// * `voxel`: voxel edge of the model, metres.
    pub(super) fn of(camera: &PhotographCamera, strength: f32, voxel: f32) -> Self {
        Self {
            camera_from_table: camera.camera_from_table.to_cols_array_2d(),
            camera: [camera.focal.x, camera.focal.y, camera.center.x, camera.center.y],
            size: [camera.size.x, camera.size.y, strength, TOLERANCE * voxel],
        }
    }
}

/// Draws distances.
pub(super) struct DistancePass {
    uniform: Uniform<CameraContent>,
    pipeline: RenderPipeline,
}

impl DistancePass {
    pub(super) fn new(gpu: &Gpu, frame: &FrameUniform, mesh: &Mesh) -> Self {
        let uniform = Uniform::new(gpu, "photograph");
        let pipeline = Primitive {
            name: "mesh_distance",
            shader: concat!(include_str!("photograph.wgsl"), include_str!("photograph_distance.wgsl")),
            groups: &[&frame.layout, &uniform.layout],
            vertices: Some(mesh.positions()),
            topology: PrimitiveTopology::TriangleList,
            blend: None,
            writes_depth: true,
            depth_compare: CompareFunction::Less,
            target: Some(DISTANCE_FORMAT),
        }
        .pipeline(gpu);
        Self { uniform, pipeline }
    }

    /// Draws the whole mesh, what is hidden or cut away of it too: it hid the rest from the camera all the same.
    ///
    /// * `target`: in [`DISTANCE_FORMAT`]. * `depth`: of the same size.
    pub(super) fn draw(
        &self,
        gpu: &Gpu,
        frame: &FrameUniform,
        mesh: &Mesh,
        camera: &CameraContent,
        target: &TextureView,
        depth: &TextureView,
    ) {
        self.uniform.write(gpu, camera);
        let mut encoder = gpu.device.create_command_encoder(&CommandEncoderDescriptor { label: Some("photograph") });
        {
            let mut pass = numbers_pass(&mut encoder, "photograph", target, depth);
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, &frame.group, &[]);
            pass.set_bind_group(1, &self.uniform.group, &[]);
            mesh.draw_whole(&mut pass);
        }
        gpu.queue.submit([encoder.finish()]);
    }
}
