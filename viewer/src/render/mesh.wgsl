// The surface as a lit mesh. Colours are those of the vertices, mixed between them; deviations are mixed as numbers and
// coloured by pixel, so that the bounds of the tolerance are sharp lines.

struct Mesh {
    // 1 / tolerance (1 / metres); end of the scale in tolerances; 1 / top of the scale of views; strength of shading.
    scale: vec4<f32>,
    // Low end of the scale of shares; 1 / its length; 1 if shares are known; unused.
    share: vec4<f32>,
    // Colour mode; unused.
    select: vec4<u32>,
}

@group(1) @binding(0) var<uniform> mesh: Mesh;
// Row 0: component classes, row 1: defect classes, row 2: ramp, row 3: deviations.
@group(1) @binding(1) var lookup: texture_2d<f32>;

@group(2) @binding(0) var<uniform> photograph: Photograph;
@group(2) @binding(1) var picture: texture_2d<f32>;
@group(2) @binding(2) var picture_sampler: sampler;
// Distances of the mesh as the photograph's camera sees it: photograph_distance.wgsl.
@group(2) @binding(3) var distances: texture_2d<u32>;

const APPEARANCE: u32 = 0u;
const COMPONENT: u32 = 1u;
const CONFIDENCE: u32 = 2u;
const VIEWS: u32 = 3u;
const DEVIATION: u32 = 5u;
const SIGMA: u32 = 6u;
const PHOTO: u32 = 7u;

// What is not known (color_ramp.rs).
const UNKNOWN: vec3<f32> = vec3<f32>(140.0, 147.0, 156.0) / 255.0;

// Deviations from here on are not known.
const UNKNOWN_DEVIATION: f32 = 1e20;

struct Vertex {
    @location(0) position: vec3<f32>,
    @location(1) normal: vec4<f32>,
    @location(2) color: vec4<f32>,
    @location(3) classes: vec4<u32>,
    @location(4) deviation: f32,
}

struct Surface {
    @builtin(position) position: vec4<f32>,
    @location(0) color: vec3<f32>,
    // Normal in the table frame; w: 1 on the rim of what was observed.
    @location(1) normal: vec4<f32>,
    @location(2) view: vec3<f32>,
    // In tolerances, and how much of it is known.
    @location(3) deviation: vec2<f32>,
    // Table frame.
    @location(4) place: vec3<f32>,
}

fn table_color(index: u32, row: u32) -> vec3<f32> {
    return textureLoad(lookup, vec2<u32>(min(index, 255u), row), 0).rgb;
}

fn row_color(share: f32, row: u32) -> vec3<f32> {
    return table_color(u32(clamp(share, 0.0, 1.0) * 255.0 + 0.5), row);
}

// A share of the evidence on its scale; without evidence for a component there is none.
fn share_color(share: f32, label: u32) -> vec3<f32> {
    if label == 0u || mesh.share.z < 0.5 {
        return UNKNOWN;
    }
    return row_color((share - mesh.share.x) * mesh.share.y, 2u);
}

fn own_color(vertex: Vertex) -> vec3<f32> {
    let mode = mesh.select.x;
    if mode == APPEARANCE || mode == PHOTO {
        return vertex.color.rgb;
    }
    if mode == COMPONENT {
        return table_color(vertex.classes.x, 0u);
    }
    if mode == CONFIDENCE {
        return share_color(vertex.color.a, vertex.classes.x);
    }
    if mode == VIEWS {
        return row_color(f32(vertex.classes.z) * mesh.scale.z, 2u);
    }
    if mode == SIGMA {
        return share_color(f32(vertex.classes.w) / 255.0, vertex.classes.x);
    }
    if vertex.classes.y == 0u || mode == DEVIATION {
        let luma = dot(vertex.color.rgb, vec3<f32>(0.2126, 0.7152, 0.0722));
        return vec3<f32>(mix(0.62, luma, 0.35));
    }
    return table_color(vertex.classes.y, 1u);
}

// Whether nothing lies between a place (camera's frame) and the camera of the photograph, by the distance at a pixel, shares.
fn is_seen(share: vec2<f32>, distance: f32, tolerance: f32) -> f32 {
    let side = vec2<f32>(textureDimensions(distances));
    let texel = vec2<u32>(clamp(share * side, vec2<f32>(0.0), side - 1.0));
    let nearest = bitcast<f32>(textureLoad(distances, texel, 0).r);
    return select(1.0, 0.0, nearest > 0.0 && nearest + tolerance < distance);
}

// The photograph at a place with this normal (table frame), and how strongly it covers what is below.
fn photograph_color(at: vec3<f32>, normal: vec3<f32>) -> vec4<f32> {
    let place = (photograph.camera_from_table * vec4<f32>(at, 1.0)).xyz;
    if photograph.size.z <= 0.0 || place.z < 1e-3 {
        return vec4<f32>(0.0);
    }
    let share = (camera_pixel(photograph, place) + 0.5) / photograph.size.xy;
    if any(share < vec2<f32>(0.0)) || any(share > vec2<f32>(1.0)) {
        return vec4<f32>(0.0);
    }
    let facing = dot((photograph.camera_from_table * vec4<f32>(normal, 0.0)).xyz, normalize(-place));
    let texel = 1.0 / vec2<f32>(textureDimensions(distances));
    let tolerance = distance_tolerance(photograph, facing, place.z, 2.0 * photograph.size.x * texel.x);
    let step = 0.75 * texel;
    let seen = is_seen(share + step, place.z, tolerance) + is_seen(share - step, place.z, tolerance)
        + is_seen(share + vec2<f32>(step.x, -step.y), place.z, tolerance)
        + is_seen(share + vec2<f32>(-step.x, step.y), place.z, tolerance);
    let cover = photograph.size.z * smoothstep(0.08, 0.2, facing) * seen / 4.0;
    return vec4<f32>(textureSampleLevel(picture, picture_sampler, share, 0.0).rgb, cover);
}

@vertex
fn vs_mesh(vertex: Vertex) -> Surface {
    var surface: Surface;
    surface.position = frame.clip_from_table * vec4<f32>(vertex.position, 1.0);
    surface.view = (frame.view_from_table * vec4<f32>(vertex.position, 1.0)).xyz;
    surface.normal = vertex.normal;
    surface.place = vertex.position;
    surface.color = own_color(vertex);
    let known = vertex.deviation < UNKNOWN_DEVIATION;
    surface.deviation = vec2<f32>(select(0.0, vertex.deviation * mesh.scale.x, known), select(0.0, 1.0, known));
    return surface;
}

// Surface that no photograph shows: its own colour, nearly grey, with thin lines across the picture.
fn unseen_color(color: vec3<f32>, position: vec2<f32>) -> vec3<f32> {
    let luma = dot(color, vec3<f32>(0.2126, 0.7152, 0.0722));
    let stripe = fract((position.x + position.y) / (7.0 * frame.viewport.w));
    return mix(vec3<f32>(luma), color, 0.3) * select(1.0, 0.72, stripe < 0.18);
}

@fragment
fn fs_mesh(surface: Surface) -> @location(0) vec4<f32> {
    // Before anything is discarded: what the neighbours do counts.
    let along_x = dpdx(surface.place);
    let along_y = dpdy(surface.place);
    if is_cut_away(surface.place) {
        discard;
    }
    var color = surface.color;
    if mesh.select.x == DEVIATION && surface.deviation.y > 0.5 {
        let top = mesh.scale.y;
        color = row_color(surface.deviation.x / surface.deviation.y / (2.0 * top) + 0.5, 3u);
    }
    let table = normalize(surface.normal.xyz + vec3<f32>(0.0, 0.0, 1e-6));
    let normal = normalize((frame.view_from_table * vec4<f32>(table, 0.0)).xyz);
    let facing = dot(normal, normalize(-surface.view));
    let outward = select(-normal, normal, facing >= 0.0);
    var covered = 0.0;
    if mesh.select.x == PHOTO && layers.count.x > 0u {
        let toward_eye = normalize((vec4<f32>(-surface.view, 0.0) * frame.view_from_table).xyz);
        let photo = layers_color(surface.place, along_x, along_y, table, toward_eye);
        color = mix(unseen_color(color, surface.position.xy), photo.rgb, photo.a);
        covered = photo.a;
    }
    let photo = photograph_color(surface.place, table);
    color = mix(color, photo.rgb, photo.a);
    // A photograph has its own light.
    covered = max(covered, photo.a);
    let shade = mix(1.0, light(outward, table, facing), mesh.scale.w * (1.0 - covered));
    // A thin dark line where what lies beyond was not observed.
    let rim = mix(1.0, 0.45, smoothstep(0.35, 0.9, surface.normal.w) * select(1.0, 1.0 - covered, mesh.select.x == PHOTO));
    return vec4<f32>(srgb_from_linear(linear_from_srgb(color) * shade * rim), 1.0);
}
