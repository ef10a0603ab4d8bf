//! The model's points: data textures filled block by block, drawn as round splats (see points.wgsl).

use super::frame::FrameUniform;
use super::gpu::Gpu;
use super::lookup::Lookup;
use super::pick::{PICK_FORMAT, Window};
use super::pick_window;
use super::pipeline::{Primitive, buffer, uniform_entry};
use super::point_counts::PointCounts;
use super::pool::{BLOCK_POINTS, Block, PAGE_HEIGHT, PAGE_WIDTH, Pool};
use super::record::{EMPTY, RECORD_WORDS, pack};
use super::request::DrawRequest;
use super::thinning::{assign_slots, slots_within};
use crate::display::ColorMode;
use bytemuck::{Pod, Zeroable};
use semascan_model::SemanticCloud;
use std::collections::BTreeMap;
use wgpu::{
    BindGroup, BindGroupDescriptor, BindGroupEntry, BindGroupLayout, BindGroupLayoutDescriptor, BindGroupLayoutEntry,
    BindingResource, BindingType, Buffer, CompareFunction, Extent3d, Origin3d, PrimitiveTopology, RenderPass,
    RenderPipeline, ShaderStages, TexelCopyBufferLayout, TexelCopyTextureInfo, Texture, TextureDescriptor,
    TextureDimension, TextureFormat, TextureSampleType, TextureUsages, TextureViewDescriptor, TextureViewDimension,
};

/// Radius of a splat in voxels: neighbours on a tilted surface are up to sqrt(3) apart and half of that would just close
/// it; the rest is for points that do not lie in the middle of their voxels.
const RADIUS_VOXELS: f32 = 0.95;

/// How much larger splats grow than their thinned number asks for: the sample is even, but no grid.
const THINNED_GROWTH: f32 = 1.15;

/// Splats are never smaller than this, in device pixels across.
const MIN_PIXELS: f32 = 1.5;

const TEXEL_BYTES: usize = 16;

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Content {
    size: [f32; 4],
    share: [f32; 4],
    select: [u32; 4],
}

struct Page {
    texture: Texture,
    group: BindGroup,
}

pub(super) struct Points {
    pipeline: RenderPipeline,
    uniform: Buffer,
    style: BindGroup,
    style_layout: BindGroupLayout,
    page_layout: BindGroupLayout,
    pages: Vec<Page>,
    pool: Pool,
    counts: BTreeMap<[i32; 3], PointCounts>,
    lookup: Lookup,
    /// Points held, shown or not.
    held: usize,
    slots: u32,
}

impl Points {
    pub(super) fn new(gpu: &Gpu, frame: &FrameUniform) -> Self {
        let device = &gpu.device;
        let lookup = Lookup::new(gpu);
        let style_layout = device.create_bind_group_layout(&BindGroupLayoutDescriptor {
            label: Some("points"),
            entries: &[uniform_entry(0), texture_entry(1, TextureSampleType::Float { filterable: false })],
        });
        let page_layout = device.create_bind_group_layout(&BindGroupLayoutDescriptor {
            label: Some("page"),
            entries: &[texture_entry(0, TextureSampleType::Uint)],
        });
        let uniform = buffer::<Content>(gpu, "points");
        let style = device.create_bind_group(&BindGroupDescriptor {
            label: Some("points"),
            layout: &style_layout,
            entries: &[
                BindGroupEntry { binding: 0, resource: uniform.as_entire_binding() },
                BindGroupEntry { binding: 1, resource: BindingResource::TextureView(&lookup.view) },
            ],
        });
        let pipeline = Primitive {
            name: "points",
            shader: include_str!("points.wgsl"),
            groups: &[&frame.layout, &style_layout, &page_layout],
            vertices: None,
            topology: PrimitiveTopology::TriangleList,
            blend: None,
            writes_depth: true,
            depth_compare: CompareFunction::Less,
            target: None,
        }
        .pipeline(gpu);
        Self {
            pipeline,
            uniform,
            style,
            style_layout,
            page_layout,
            pages: Vec::new(),
            pool: Pool::default(),
            counts: BTreeMap::new(),
            lookup,
            held: 0,
            slots: BLOCK_POINTS as u32,
        }
    }

    /// Puts `cloud` in the place of whatever chunk `id` held.
    pub(super) fn set_chunk(&mut self, gpu: &Gpu, id: [i32; 3], cloud: &SemanticCloud) {
        let placement = self.pool.place(id, cloud.len());
        for (block, slots) in placement.blocks.iter().zip(assign_slots(&cloud.positions)) {
            let mut records = [EMPTY; BLOCK_POINTS];
            for (record, point) in records.iter_mut().zip(slots) {
                *record = point.and_then(|i| cloud.get(i)).map_or(EMPTY, |p| pack(&p));
            }
            self.write(gpu, *block, &records);
        }
        for block in placement.emptied {
            self.write(gpu, block, &[EMPTY; BLOCK_POINTS]);
        }
        self.pages.truncate(self.pool.trim());
        let before = self.counts.insert(id, PointCounts::of(cloud));
        self.held = self.held + cloud.len() - before.map_or(0, |counts| counts.points());
    }

    /// Takes chunk `id` out.
    pub(super) fn remove_chunk(&mut self, gpu: &Gpu, id: [i32; 3]) {
        for block in self.pool.remove(id) {
            self.write(gpu, block, &[EMPTY; BLOCK_POINTS]);
        }
        self.pages.truncate(self.pool.trim());
        self.held -= self.counts.remove(&id).map_or(0, |counts| counts.points());
    }

    /// Takes everything out and gives the memory back.
    pub(super) fn clear(&mut self) {
        self.pool.clear();
        self.pages.clear();
        self.counts.clear();
        self.held = 0;
    }

    /// How many points the frame shows.
    pub(super) fn shown(&self, request: &DrawRequest) -> usize {
        let all: usize =
            self.counts.values().map(|c| c.shown(&request.content.visible_classes, request.content.hidden_flags)).sum();
        all * self.slots as usize / BLOCK_POINTS
    }

    pub(super) fn prepare(&mut self, gpu: &Gpu, request: &DrawRequest) {
        self.lookup.prepare(gpu, request);
        self.slots = slots_within(request.point_budget, self.held);
        let thinned = BLOCK_POINTS as f32 / self.slots as f32;
        let growth = if thinned > 1.0 { thinned.sqrt() * THINNED_GROWTH } else { 1.0 };
        let voxel = if request.voxel.is_finite() && request.voxel > 0.0 { request.voxel } else { 1e-3 };
        let (mode, shading) = match request.content.color_mode {
            // The picture of the part carries its own light: only a hint of ours. Photographs lie on the mesh alone.
            ColorMode::Appearance | ColorMode::Photo => (0, 0.55),
            // Deviations are those of the mesh.
            ColorMode::Component | ColorMode::Deviation => (1, 0.85),
            ColorMode::Confidence => (2, 0.6),
            ColorMode::Views => (3, 0.6),
            ColorMode::Defect => (4, 0.85),
            ColorMode::Sigma => (6, 0.6),
        };
        let views_scale = 1.0 / f32::from(request.content.views_top.max(1));
        let content = Content {
            size: [voxel * RADIUS_VOXELS * growth, MIN_PIXELS / 2.0, views_scale, shading],
            share: request.content.share_scale(),
            select: [self.slots, mode, u32::from(request.content.hidden_flags.bits()), 0],
        };
        gpu.queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&content));
    }

    /// Draws the slots from number `from` on, at most so many. Returns where to go on; `None` once all are drawn.
    pub(super) fn draw(&self, pass: &mut RenderPass<'_>, from: usize, most: Option<usize>) -> Option<usize> {
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(1, &self.style, &[]);
        let end = most.map_or(usize::MAX, |most| from.saturating_add(most.max(1)));
        let mut first = 0;
        for (page, blocks) in self.pages.iter().zip(self.pool.used_blocks()) {
            let slots = blocks * self.slots as usize;
            let (begin, stop) = (from.saturating_sub(first).min(slots), end.saturating_sub(first).min(slots));
            if begin < stop {
                pass.set_bind_group(2, &page.group, &[]);
                pass.draw(begin as u32 * 3..stop as u32 * 3, 0..1);
            }
            first += slots;
        }
        (end < first).then_some(end)
    }

    /// The pipeline that draws numbers in place of colours.
    pub(super) fn pick_pipeline(&self, gpu: &Gpu, frame: &FrameUniform, window: &Window) -> RenderPipeline {
        Primitive {
            name: "points_pick",
            shader: concat!(include_str!("points.wgsl"), include_str!("pick.wgsl"), include_str!("points_pick.wgsl")),
            groups: &[&frame.layout, &self.style_layout, &self.page_layout, &window.layout],
            vertices: None,
            topology: PrimitiveTopology::TriangleList,
            blend: None,
            writes_depth: true,
            depth_compare: CompareFunction::Less,
            target: Some(PICK_FORMAT),
        }
        .pipeline(gpu)
    }

    /// Draws the numbers of the points that the last frame showed.
    pub(super) fn draw_pick(&self, pass: &mut RenderPass<'_>, pipeline: &RenderPipeline, window: &Window) {
        pass.set_pipeline(pipeline);
        pass.set_bind_group(1, &self.style, &[]);
        pass.set_bind_group(3, &window.group, &[]);
        for (index, (page, blocks)) in (0_u32..).zip(self.pages.iter().zip(self.pool.used_blocks())) {
            pass.set_bind_group(2, &page.group, &[]);
            pass.draw(0..blocks as u32 * self.slots * 3, index..index + 1);
        }
    }

    /// The chunk that a point drawn under `number` belongs to, which of its blocks and which slot of that.
    pub(super) fn place_of(&self, number: u32) -> Option<([i32; 3], usize, usize)> {
        let (page, slot) = pick_window::page_and_slot(number);
        let (chunk, block) = self.pool.owner(Block { page, index: slot / BLOCK_POINTS })?;
        Some((chunk, block, slot % BLOCK_POINTS))
    }

    fn write(&mut self, gpu: &Gpu, block: Block, records: &[[u32; RECORD_WORDS]; BLOCK_POINTS]) {
        while self.pages.len() <= block.page {
            self.pages.push(Page::new(gpu, &self.page_layout));
        }
        let [x, y] = block.texel();
        let width = 2 * BLOCK_POINTS as u32;
        gpu.queue.write_texture(
            TexelCopyTextureInfo { origin: Origin3d { x, y, z: 0 }, ..self.pages[block.page].texture.as_image_copy() },
            bytemuck::cast_slice(records),
            TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(width * TEXEL_BYTES as u32), rows_per_image: None },
            Extent3d { width, height: 1, depth_or_array_layers: 1 },
        );
    }
}

impl Page {
    fn new(gpu: &Gpu, layout: &BindGroupLayout) -> Self {
        let texture = gpu.device.create_texture(&TextureDescriptor {
            label: Some("page"),
            size: Extent3d { width: PAGE_WIDTH as u32, height: PAGE_HEIGHT as u32, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: TextureDimension::D2,
            format: TextureFormat::Rgba32Uint,
            usage: TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let view = texture.create_view(&TextureViewDescriptor::default());
        let group = gpu.device.create_bind_group(&BindGroupDescriptor {
            label: Some("page"),
            layout,
            entries: &[BindGroupEntry { binding: 0, resource: BindingResource::TextureView(&view) }],
        });
        Self { texture, group }
    }
}

impl Drop for Page {
    fn drop(&mut self) {
        // At once, not at the garbage collector's leisure: an inspection may replace a gigabyte.
        self.texture.destroy();
    }
}

fn texture_entry(binding: u32, sample_type: TextureSampleType) -> BindGroupLayoutEntry {
    BindGroupLayoutEntry {
        binding,
        visibility: ShaderStages::VERTEX,
        ty: BindingType::Texture { sample_type, view_dimension: TextureViewDimension::D2, multisampled: false },
        count: None,
    }
}
