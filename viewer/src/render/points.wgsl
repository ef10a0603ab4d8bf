// Points as round, depth-correct splats.
//
// Vertices are pulled: vertex v is corner v % 3 of the triangle around point v / 3, whose record lies in a data texture
// (see record.rs; WebGL2 has no storage buffers, and instanced quads were ten times slower where it was measured).
// The triangle faces the screen and holds a disc, so a splat is round from everywhere and never thins out at the
// silhouette. Its depth is that of the tangent plane plus a paraboloid: splats of one surface lie in one surface,
// intersecting surfaces cut where they should, and between neighbours each pixel goes to the nearer centre.

struct Points {
    // Radius in metres; least radius in pixels; 1 / top of the scale of views; strength of shading, 0..1.
    size: vec4<f32>,
    // Low end of the scale of shares; 1 / its length; 1 if shares are known; unused.
    share: vec4<f32>,
    // Slots drawn of each block; colour mode; flags that hide; unused.
    select: vec4<u32>,
}

@group(1) @binding(0) var<uniform> points: Points;
// Row 0: component classes (alpha: shown or not), row 1: defect classes, row 2: ramp.
@group(1) @binding(1) var lookup: texture_2d<f32>;
@group(2) @binding(0) var page: texture_2d<u32>;

const BLOCK_POINTS: u32 = 256u;
const PAGE_WIDTH: u32 = 2048u;

const APPEARANCE: u32 = 0u;
const COMPONENT: u32 = 1u;
const CONFIDENCE: u32 = 2u;
const VIEWS: u32 = 3u;
const SIGMA: u32 = 6u;

// What is not known (color_ramp.rs).
const UNKNOWN: vec3<f32> = vec3<f32>(140.0, 147.0, 156.0) / 255.0;

// How far the paraboloid falls away at the rim, in radii.
const BULGE: f32 = 0.5;
// The steepest slope of a tangent plane; beyond it a splat would reach too deep.
const STEEPEST: f32 = 3.0;

struct Splat {
    @builtin(position) position: vec4<f32>,
    // Across the disc, 1 at its rim.
    @location(0) disc: vec2<f32>,
    // Slope of the tangent plane and height of the bulge over the disc, distance of the centre; metres.
    @location(1) @interpolate(flat, either) plane: vec4<f32>,
    @location(2) @interpolate(flat, either) color: vec3<f32>,
    // On the tangent plane, table frame.
    @location(3) place: vec3<f32>,
}

fn unfold_normal(word: u32) -> vec3<f32> {
    let f = unpack2x16snorm(word);
    var n = vec3<f32>(f, 1.0 - abs(f.x) - abs(f.y));
    let t = max(-n.z, 0.0);
    n.x += select(t, -t, n.x >= 0.0);
    n.y += select(t, -t, n.y >= 0.0);
    return normalize(n);
}

fn class_color(class_id: u32, row: u32) -> vec4<f32> {
    return textureLoad(lookup, vec2<u32>(min(class_id, 255u), row), 0);
}

fn ramp(share: f32) -> vec3<f32> {
    return textureLoad(lookup, vec2<u32>(u32(clamp(share, 0.0, 1.0) * 255.0 + 0.5), 2u), 0).rgb;
}

// A share of the evidence on its scale; without evidence for a component there is none.
fn share_color(share: f32, label: u32) -> vec3<f32> {
    if label == 0u || points.share.z < 0.5 {
        return UNKNOWN;
    }
    return ramp((share - points.share.x) * points.share.y);
}

fn base_color(record: vec4<u32>) -> vec3<f32> {
    let own = unpack4x8unorm(record.x);
    let mode = points.select.y;
    if mode == APPEARANCE {
        return own.rgb;
    }
    if mode == COMPONENT {
        return class_color(record.y & 0xffffu, 0u).rgb;
    }
    if mode == CONFIDENCE {
        return share_color(own.a, record.y & 0xffffu);
    }
    if mode == VIEWS {
        return ramp(f32(record.z & 0xffffu) * points.size.z);
    }
    if mode == SIGMA {
        return share_color(f32(record.w & 0xffu) / 255.0, record.y & 0xffffu);
    }
    let defect = record.y >> 16u;
    if defect == 0u {
        let luma = dot(own.rgb, vec3<f32>(0.2126, 0.7152, 0.0722));
        return vec3<f32>(mix(0.62, luma, 0.35));
    }
    return class_color(defect, 1u).rgb;
}

// The slot of the page whose point vertex `vertex` belongs to.
fn slot_of(vertex: u32) -> u32 {
    let slots = points.select.x;
    let point = vertex / 3u;
    return (point / slots) * BLOCK_POINTS + point % slots;
}

fn splat_corner(vertex: u32) -> Splat {
    var splat: Splat;
    splat.position = vec4<f32>(0.0, 0.0, 2.0, 1.0); // behind the far plane: draws nothing
    splat.disc = vec2<f32>(0.0);
    splat.plane = vec4<f32>(0.0);
    splat.color = vec3<f32>(0.0);
    splat.place = vec3<f32>(0.0);

    let slot = slot_of(vertex);
    let texel = vec2<u32>((slot * 2u) % PAGE_WIDTH, (slot * 2u) / PAGE_WIDTH);
    let record = textureLoad(page, texel + vec2<u32>(1u, 0u), 0);
    let marks = record.w;
    let hidden = ((record.z >> 16u) & points.select.z) != 0u;
    if (marks & 0x80000000u) == 0u || hidden || class_color(record.y & 0xffffu, 0u).a < 0.5 {
        return splat;
    }
    let place = textureLoad(page, texel, 0);
    let center_table = vec3<f32>(bitcast<f32>(place.x), bitcast<f32>(place.y), bitcast<f32>(place.z));
    let center = (frame.view_from_table * vec4<f32>(center_table, 1.0)).xyz;
    let distance = -center.z;
    // A point that is cut away shows nothing of itself, and another one's splat ends where the cut is.
    if distance < frame.depth.z || is_cut_away(center_table) {
        return splat;
    }

    // The incircle of a triangle with corners at distance 2 has radius 1.
    let angle = f32(vertex % 3u) * 2.0943951 + 1.5707963;
    let corner = vec2<f32>(cos(angle), sin(angle)) * 2.0;
    let metres_per_pixel = distance / frame.viewport.z;
    let radius = max(points.size.x, points.size.y * metres_per_pixel);
    let rim = center.xy + corner * radius;
    let eye = frame.viewport.z * 2.0 / frame.viewport.xy;
    splat.position = vec4<f32>(rim * eye, (frame.depth.x * distance + frame.depth.y), distance);
    splat.disc = corner;

    var shade = 1.0;
    var slope = vec2<f32>(0.0);
    if (marks & 0x40000000u) != 0u {
        let normal_table = unfold_normal(place.w);
        let normal = normalize((frame.view_from_table * vec4<f32>(normal_table, 0.0)).xyz);
        let facing = dot(normal, normalize(-center));
        let outward = select(-normal, normal, facing >= 0.0);
        shade = mix(1.0, light(outward, normal_table, facing), points.size.w);
        slope = -outward.xy / max(outward.z, 1e-3);
        slope *= min(1.0, STEEPEST / max(length(slope), 1e-3));
    }
    splat.plane = vec4<f32>(slope * radius, BULGE * radius, distance);
    let on_tangent = vec4<f32>(corner * radius, dot(slope, corner) * radius, 0.0);
    splat.place = center_table + (transpose(frame.view_from_table) * on_tangent).xyz;
    splat.color = srgb_from_linear(linear_from_srgb(base_color(record)) * shade);
    return splat;
}

@vertex
fn vs_points(@builtin(vertex_index) vertex: u32) -> Splat {
    return splat_corner(vertex);
}

// How much of its tilt a splat takes on: the rest keeps surfaces closed whose normals are not known well.
const TILT: f32 = 0.6;

// Whether a splat, a round piece of the tilted surface, covers this place of its square.
fn covers(disc: vec2<f32>, plane: vec4<f32>) -> bool {
    let rise = TILT * BULGE * dot(plane.xy, disc) / plane.z;
    return dot(disc, disc) + rise * rise <= 1.0;
}

// Distance along the direction of view to the surface of a splat, metres.
fn surface_distance(disc: vec2<f32>, plane: vec4<f32>) -> f32 {
    let towards_eye = dot(plane.xy, disc) - plane.z * dot(disc, disc);
    return max(plane.w - towards_eye, frame.depth.z);
}

struct Pixel {
    @location(0) color: vec4<f32>,
    @builtin(frag_depth) depth: f32,
}

@fragment
fn fs_points(splat: Splat) -> Pixel {
    if !covers(splat.disc, splat.plane) || is_cut_away(splat.place) {
        discard;
    }
    let distance = surface_distance(splat.disc, splat.plane);
    var pixel: Pixel;
    pixel.color = vec4<f32>(splat.color, 1.0);
    pixel.depth = clamp(frame.depth.x + frame.depth.y / distance, 0.0, 1.0);
    return pixel;
}
