//! The passes of a picture on the device.

use std::ops::Range;

use encase::UniformBuffer;
use glam::Vec4;
use wgpu::util::{BufferInitDescriptor, DeviceExt};
use wgpu::{BufferUsages, ShaderStages, TextureFormat, TextureUsages};

use super::camera::{self, Camera, SUPERSAMPLING, Tile, View};
use super::cull::{Parts, drawn};
use super::neighbours::Neighbours;
use super::picture::SHADER;
use super::stage::{Face, Stage};
use crate::{Error, Result};

/// Largest side of a tile, pixels: keeps the textures of one below a quarter of a gigabyte.
const MAX_TILE: u32 = 2048;
/// Largest side of the shadow map.
const SHADOW_TEXELS: u32 = 3072;
const SEEN: TextureFormat = TextureFormat::R32Uint;
const OPENNESS: TextureFormat = TextureFormat::R8Unorm;
const DEPTH: TextureFormat = TextureFormat::Depth32Float;
const COLOR: TextureFormat = TextureFormat::Rgba8UnormSrgb;

/// Draws a stage tile by tile: `width * height * 4` bytes.
pub fn draw(device: &wgpu::Device, queue: &wgpu::Queue, stage: &Stage, width: u32, height: u32) -> Result<Vec<u8>> {
    let memory = device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
    let validation = device.push_error_scope(wgpu::ErrorFilter::Validation);
    let drawn = Painter::new(device, queue, stage, width, height).and_then(|painter| painter.picture(width, height));
    let failed = pollster::block_on(validation.pop()).or(pollster::block_on(memory.pop()));
    match failed {
        Some(error) => Err(Error::Device(format!("picture of {width} x {height} pixels: {error}"))),
        None => drawn,
    }
}

/// The stage on the device, and how to draw it.
struct Painter<'a> {
    device: &'a wgpu::Device,
    queue: &'a wgpu::Queue,
    stage: &'a Stage,
    camera: Camera,
    module: wgpu::ShaderModule,
    uniform: wgpu::Buffer,
    /// Uniform and storage buffers: group 0 of every pass.
    scene: wgpu::BindGroup,
    scene_layout: wgpu::BindGroupLayout,
    /// Vertices of each kind.
    parts: Parts,
    corners: u32,
    lines: u32,
    tile: u32,
    shadow_texels: u32,
}

/// The format of a pass's colour target and how it is blended.
type Target = (TextureFormat, Option<wgpu::BlendState>);

/// What distinguishes one pipeline from another.
struct Recipe<'a> {
    vertex: &'a str,
    fragment: &'a str,
    target: Option<Target>,
    depth: Option<wgpu::CompareFunction>,
    textures: Option<&'a wgpu::BindGroupLayout>,
}

impl<'a> Painter<'a> {
    fn new(
        device: &'a wgpu::Device,
        queue: &'a wgpu::Queue,
        stage: &'a Stage,
        width: u32,
        height: u32,
    ) -> Result<Self> {
        let limits = device.limits();
        let binding = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        let most = (binding / 16).min(u64::from(u32::MAX / 18));
        if stage.balls.len() as u64 > most {
            let count = stage.balls.len();
            return Err(Error::Lacking(format!("picture of {count} grains: this device can draw {most}")));
        }
        let camera = Camera::new(stage, width, height);
        let solid = stage.dimension == 3;
        let shadow_texels = SHADOW_TEXELS.min(limits.max_texture_dimension_2d);
        // Walls between the eye and the grains are left open.
        let walls: Vec<&Face> =
            stage.faces.iter().filter(|face| face.plane.dot(camera.eye.extend(-1.0)) > 0.0).collect();
        let faces: Vec<[Vec4; 2]> = walls.iter().map(|face| [face.plane, face.round]).collect();
        let corners: Vec<Vec4> = (0..).zip(&walls).flat_map(|(number, face)| triangles(number, face)).collect();
        let lists = Neighbours::new(if solid { &stage.balls } else { &[] }, binding as usize / 4);
        let (drawn, parts) = if solid { drawn(stage, &camera, &walls, (width, height)) } else { Default::default() };
        let uniform = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("view"),
            size: <View as encase::ShaderSize>::SHADER_SIZE.get(),
            usage: BufferUsages::UNIFORM | BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let storage: [&[u8]; 8] = [
            bytemuck::cast_slice(&stage.balls),
            bytemuck::cast_slice(&stage.colors),
            bytemuck::cast_slice(&lists.starts),
            bytemuck::cast_slice(&lists.list),
            bytemuck::cast_slice(&corners),
            bytemuck::cast_slice(&faces),
            bytemuck::cast_slice(&stage.lines),
            bytemuck::cast_slice(&drawn),
        ];
        let scene_layout = scene_layout(device);
        Ok(Self {
            device,
            queue,
            stage,
            camera,
            module: device.create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some("render"),
                source: wgpu::ShaderSource::Wgsl(SHADER.into()),
            }),
            scene: scene_group(device, &scene_layout, &uniform, &storage),
            uniform,
            scene_layout,
            parts,
            corners: corners.len() as u32,
            lines: 6 * stage.lines.len() as u32,
            tile: MAX_TILE.min(limits.max_texture_dimension_2d / SUPERSAMPLING),
            shadow_texels,
        })
    }

    fn picture(&self, width: u32, height: u32) -> Result<Vec<u8>> {
        let mut rgba = vec![0; width as usize * height as usize * 4];
        let shadow = (self.stage.dimension == 3).then(|| self.shadow_map());
        for y in (0..height).step_by(self.tile as usize) {
            for x in (0..width).step_by(self.tile as usize) {
                let tile = Tile { x, y, width: self.tile.min(width - x), height: self.tile.min(height - y) };
                let pixels = self.tile(tile, shadow.as_ref())?;
                let row_bytes = tile.width as usize * 4;
                for (row, bytes) in pixels.chunks_exact(row_bytes).enumerate() {
                    let start = ((y as usize + row) * width as usize + x as usize) * 4;
                    rgba[start..start + row_bytes].copy_from_slice(bytes);
                }
            }
        }
        Ok(rgba)
    }

    fn set_view(&self, tile: Tile) {
        let mut view = self.camera.view(tile);
        camera::add_light(&mut view, self.stage, self.shadow_texels);
        let mut bytes = UniformBuffer::new(Vec::<u8>::new());
        bytes.write(&view).expect("a Vec takes any number of bytes");
        self.queue.write_buffer(&self.uniform, 0, &bytes.into_inner());
    }

    /// Depth of the grains as the key light sees them.
    fn shadow_map(&self) -> wgpu::TextureView {
        self.set_view(Tile { x: 0, y: 0, width: 1, height: 1 });
        let map = self.texture(DEPTH, self.shadow_texels, self.shadow_texels, TextureUsages::TEXTURE_BINDING);
        let pipeline = self.pipeline(&Recipe {
            vertex: "shadow_ball",
            fragment: "shadow_depth",
            target: None,
            depth: Some(wgpu::CompareFunction::Less),
            textures: None,
        });
        let mut encoder = self.device.create_command_encoder(&Default::default());
        self.pass(&mut encoder, None, Some(clear_depth(&map)), &[(&pipeline, None, self.parts.lit.clone())]);
        self.queue.submit([encoder.finish()]);
        map
    }

    /// Pixels of a tile without gaps between rows.
    fn tile(&self, tile: Tile, shadow: Option<&wgpu::TextureView>) -> Result<Vec<u8>> {
        self.set_view(tile);
        let (width, height) = (SUPERSAMPLING * tile.width, SUPERSAMPLING * tile.height);
        let fine = self.texture(COLOR, width, height, TextureUsages::TEXTURE_BINDING);
        let mut encoder = self.device.create_command_encoder(&Default::default());
        match shadow {
            Some(shadow) => self.solid(&mut encoder, &fine, shadow),
            None => self.flat(&mut encoder, &fine),
        }
        let coarse = self.texture(COLOR, tile.width, tile.height, TextureUsages::COPY_SRC);
        let (layout, group) = self.textures(&[(4, wgpu::TextureSampleType::Float { filterable: false }, &fine)]);
        let resolve = self.full_screen("resolve", &layout);
        self.pass(&mut encoder, Some(clear(&coarse)), None, &[(&resolve, Some(&group), 0..3)]);
        self.read_back(encoder, coarse.texture(), tile)
    }

    fn flat(&self, encoder: &mut wgpu::CommandEncoder, fine: &wgpu::TextureView) {
        let pipeline = |vertex, fragment| {
            self.pipeline(&Recipe { vertex, fragment, target: Some((COLOR, None)), depth: None, textures: None })
        };
        let backdrop = pipeline("whole_tile", "backdrop");
        let walls = pipeline("thick_line", "thick_line_color");
        let disks = pipeline("disk", "disk_color");
        let draws = [
            (&backdrop, None, 0..3),
            (&walls, None, 0..self.lines),
            (&disks, None, 0..6 * self.stage.balls.len() as u32),
        ];
        self.pass(encoder, Some(clear(fine)), None, &draws);
    }

    fn solid(&self, encoder: &mut wgpu::CommandEncoder, fine: &wgpu::TextureView, shadow: &wgpu::TextureView) {
        let (width, height) = (fine.texture().width(), fine.texture().height());
        let [seen, openness, depth] =
            [SEEN, OPENNESS, DEPTH].map(|format| self.texture(format, width, height, TextureUsages::TEXTURE_BINDING));
        self.see(encoder, &seen, &depth);

        let numbers = (0, wgpu::TextureSampleType::Uint, &seen);
        let (layout, group) = self.textures(&[numbers]);
        let darken = self.pipeline(&Recipe {
            vertex: "reach_of_ball",
            fragment: "darken_wall",
            target: Some((OPENNESS, Some(MULTIPLY))),
            depth: None,
            textures: Some(&layout),
        });
        self.pass(encoder, Some(clear(&openness)), None, &[(&darken, Some(&group), self.parts.near_walls.clone())]);

        let (layout, group) = self.textures(&[
            numbers,
            (1, wgpu::TextureSampleType::Float { filterable: false }, &openness),
            (2, wgpu::TextureSampleType::Depth, shadow),
        ]);
        let lit = self.full_screen("lit", &layout);
        self.pass(encoder, Some(clear(fine)), None, &[(&lit, Some(&group), 0..3)]);

        let edges = self.pipeline(&Recipe {
            vertex: "thin_line",
            fragment: "thin_line_color",
            target: Some((COLOR, Some(wgpu::BlendState::ALPHA_BLENDING))),
            depth: Some(wgpu::CompareFunction::LessEqual),
            textures: None,
        });
        self.pass(encoder, Some(keep(fine)), Some(keep_depth(&depth)), &[(&edges, None, 0..self.lines)]);
    }

    /// The visibility buffer.
    fn see(&self, encoder: &mut wgpu::CommandEncoder, seen: &wgpu::TextureView, depth: &wgpu::TextureView) {
        let pipeline = |vertex, fragment| {
            self.pipeline(&Recipe {
                vertex,
                fragment,
                target: Some((SEEN, None)),
                depth: Some(wgpu::CompareFunction::Less),
                textures: None,
            })
        };
        let (balls, walls) = (pipeline("see_ball", "seen_ball"), pipeline("see_wall", "seen_wall"));
        let mut nothing = clear(seen);
        nothing.ops.load = wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT);
        let draws = [(&walls, None, 0..self.corners), (&balls, None, self.parts.seen.clone())];
        self.pass(encoder, Some(nothing), Some(clear_depth(depth)), &draws);
    }

    /// One render pass of several draws, each a pipeline, its textures and its vertices.
    fn pass(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        color: Option<wgpu::RenderPassColorAttachment>,
        depth: Option<wgpu::RenderPassDepthStencilAttachment>,
        draws: &[(&wgpu::RenderPipeline, Option<&wgpu::BindGroup>, Range<u32>)],
    ) {
        let attachments: Vec<_> = color.into_iter().map(Some).collect();
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &attachments,
            depth_stencil_attachment: depth,
            ..Default::default()
        });
        pass.set_bind_group(0, &self.scene, &[]);
        for (pipeline, textures, vertices) in draws {
            pass.set_pipeline(pipeline);
            if let Some(textures) = textures {
                pass.set_bind_group(1, *textures, &[]);
            }
            if !vertices.is_empty() {
                pass.draw(vertices.clone(), 0..1);
            }
        }
    }

    fn full_screen(&self, fragment: &str, textures: &wgpu::BindGroupLayout) -> wgpu::RenderPipeline {
        let target = Some((COLOR, None));
        self.pipeline(&Recipe { vertex: "whole_tile", fragment, target, depth: None, textures: Some(textures) })
    }

    fn pipeline(&self, recipe: &Recipe) -> wgpu::RenderPipeline {
        let groups = [Some(&self.scene_layout), recipe.textures];
        let layout = self.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            bind_group_layouts: &groups[..1 + usize::from(recipe.textures.is_some())],
            ..Default::default()
        });
        let targets = recipe
            .target
            .map(|(format, blend)| Some(wgpu::ColorTargetState { format, blend, write_mask: wgpu::ColorWrites::ALL }));
        self.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(recipe.fragment),
            layout: Some(&layout),
            vertex: wgpu::VertexState {
                module: &self.module,
                entry_point: Some(recipe.vertex),
                compilation_options: Default::default(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: recipe.depth.map(|compare| wgpu::DepthStencilState {
                format: DEPTH,
                depth_write_enabled: Some(compare == wgpu::CompareFunction::Less),
                depth_compare: Some(compare),
                stencil: Default::default(),
                bias: Default::default(),
            }),
            multisample: Default::default(),
            fragment: Some(wgpu::FragmentState {
                module: &self.module,
                entry_point: Some(recipe.fragment),
                compilation_options: Default::default(),
                targets: targets.as_slice(),
            }),
            multiview_mask: None,
            cache: None,
        })
    }

    fn texture(&self, format: TextureFormat, width: u32, height: u32, usage: TextureUsages) -> wgpu::TextureView {
        let texture = self.device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: usage | TextureUsages::RENDER_ATTACHMENT,
            view_formats: &[],
        });
        texture.create_view(&Default::default())
    }

    /// Group 1 of a pass from (binding, type, texture); a depth texture brings the sampler of the next binding along.
    fn textures(
        &self,
        textures: &[(u32, wgpu::TextureSampleType, &wgpu::TextureView)],
    ) -> (wgpu::BindGroupLayout, wgpu::BindGroup) {
        let sampler = self.device.create_sampler(&wgpu::SamplerDescriptor {
            compare: Some(wgpu::CompareFunction::LessEqual),
            ..Default::default()
        });
        let (mut layout, mut group) = (Vec::new(), Vec::new());
        for &(binding, sample_type, texture) in textures {
            layout.push(entry(binding, ShaderStages::FRAGMENT, texture_2d(sample_type)));
            group.push(wgpu::BindGroupEntry { binding, resource: wgpu::BindingResource::TextureView(texture) });
            if sample_type == wgpu::TextureSampleType::Depth {
                let comparison = wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Comparison);
                layout.push(entry(binding + 1, ShaderStages::FRAGMENT, comparison));
                let resource = wgpu::BindingResource::Sampler(&sampler);
                group.push(wgpu::BindGroupEntry { binding: binding + 1, resource });
            }
        }
        let descriptor = wgpu::BindGroupLayoutDescriptor { label: None, entries: &layout };
        let layout = self.device.create_bind_group_layout(&descriptor);
        let descriptor = wgpu::BindGroupDescriptor { label: None, layout: &layout, entries: &group };
        let group = self.device.create_bind_group(&descriptor);
        (layout, group)
    }

    fn read_back(&self, mut encoder: wgpu::CommandEncoder, texture: &wgpu::Texture, tile: Tile) -> Result<Vec<u8>> {
        let row_bytes = tile.width * 4;
        let padded = row_bytes.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("pixels"),
            size: u64::from(padded) * u64::from(tile.height),
            usage: BufferUsages::COPY_DST | BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let rows = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(padded), rows_per_image: None };
        let to = wgpu::TexelCopyBufferInfo { buffer: &buffer, layout: rows };
        encoder.copy_texture_to_buffer(texture.as_image_copy(), to, texture.size());
        self.queue.submit([encoder.finish()]);
        let failed = |error: &dyn std::fmt::Display| Error::Device(format!("the picture could not be read: {error}"));
        buffer.map_async(wgpu::MapMode::Read, .., |_| ());
        self.device.poll(wgpu::PollType::wait_indefinitely()).map_err(|error| failed(&error))?;
        let mapped = buffer.get_mapped_range(..).map_err(|error| failed(&error))?;
        let rows = mapped.chunks_exact(padded as usize);
        Ok(rows.flat_map(|row| &row[..row_bytes as usize]).copied().collect())
    }
}

/// Corners of the triangles of a face, with its number.
fn triangles(number: u32, face: &Face) -> impl Iterator<Item = Vec4> {
    let corner = move |k: usize| face.outline[k].as_vec3().extend(number as f32);
    (2..face.outline.len()).flat_map(move |k| [corner(0), corner(k - 1), corner(k)])
}

/// Bindings 0 to 8 of group 0: the uniform and eight read-only arrays, each shown only to the stages that read it so
/// that no stage exceeds the default limit.
fn scene_layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    let stages = [
        ShaderStages::VERTEX_FRAGMENT,
        ShaderStages::FRAGMENT,
        ShaderStages::FRAGMENT,
        ShaderStages::FRAGMENT,
        ShaderStages::VERTEX,
        ShaderStages::FRAGMENT,
        ShaderStages::VERTEX,
        ShaderStages::VERTEX,
    ];
    let buffer = |ty| wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None };
    let mut entries = vec![entry(0, ShaderStages::VERTEX_FRAGMENT, buffer(wgpu::BufferBindingType::Uniform))];
    entries.extend(
        (1..).zip(stages).map(|(binding, stage)| {
            entry(binding, stage, buffer(wgpu::BufferBindingType::Storage { read_only: true }))
        }),
    );
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some("scene"), entries: &entries })
}

fn scene_group(
    device: &wgpu::Device,
    layout: &wgpu::BindGroupLayout,
    uniform: &wgpu::Buffer,
    storage: &[&[u8]],
) -> wgpu::BindGroup {
    // An empty array still needs a buffer to be bound; nothing reads it.
    let upload = |bytes: &&[u8]| {
        device.create_buffer_init(&BufferInitDescriptor {
            label: None,
            contents: if bytes.is_empty() { &[0; 32] } else { bytes },
            usage: BufferUsages::STORAGE,
        })
    };
    let buffers: Vec<_> = storage.iter().map(upload).collect();
    let entries: Vec<_> = (0..)
        .zip(std::iter::once(uniform).chain(&buffers))
        .map(|(binding, buffer)| wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() })
        .collect();
    device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some("scene"), layout, entries: &entries })
}

/// Multiplies what is there by what is drawn.
const MULTIPLY: wgpu::BlendState = {
    let component = wgpu::BlendComponent {
        src_factor: wgpu::BlendFactor::Zero,
        dst_factor: wgpu::BlendFactor::Src,
        operation: wgpu::BlendOperation::Add,
    };
    wgpu::BlendState { color: component, alpha: component }
};

fn entry(binding: u32, visibility: ShaderStages, ty: wgpu::BindingType) -> wgpu::BindGroupLayoutEntry {
    wgpu::BindGroupLayoutEntry { binding, visibility, ty, count: None }
}

fn texture_2d(sample_type: wgpu::TextureSampleType) -> wgpu::BindingType {
    wgpu::BindingType::Texture { sample_type, view_dimension: wgpu::TextureViewDimension::D2, multisampled: false }
}

fn attachment(view: &wgpu::TextureView, load: wgpu::LoadOp<wgpu::Color>) -> wgpu::RenderPassColorAttachment<'_> {
    let ops = wgpu::Operations { load, store: wgpu::StoreOp::Store };
    wgpu::RenderPassColorAttachment { view, depth_slice: None, resolve_target: None, ops }
}

fn clear(view: &wgpu::TextureView) -> wgpu::RenderPassColorAttachment<'_> {
    attachment(view, wgpu::LoadOp::Clear(wgpu::Color::WHITE))
}

fn keep(view: &wgpu::TextureView) -> wgpu::RenderPassColorAttachment<'_> {
    attachment(view, wgpu::LoadOp::Load)
}

fn clear_depth(view: &wgpu::TextureView) -> wgpu::RenderPassDepthStencilAttachment<'_> {
    let ops = wgpu::Operations { load: wgpu::LoadOp::Clear(1.0), store: wgpu::StoreOp::Store };
    wgpu::RenderPassDepthStencilAttachment { view, depth_ops: Some(ops), stencil_ops: None }
}

fn keep_depth(view: &wgpu::TextureView) -> wgpu::RenderPassDepthStencilAttachment<'_> {
    // No operations: the pass may not write it.
    wgpu::RenderPassDepthStencilAttachment { view, depth_ops: None, stencil_ops: None }
}
