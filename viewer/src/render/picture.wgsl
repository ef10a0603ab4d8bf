// The finished picture: eye-dome lighting (Boucheny 2009), then the mean of each pixel's samples.
//
// A sample is the darker the farther it lies behind its neighbours in the picture, on a logarithmic scale of distance: steps
// between surfaces become dark lines on the farther one, and hollows become darker than ridges, without any normal.

struct Picture {
    // Samples along an edge of a pixel; 1 if they are shaded; unused.
    samples: vec4<u32>,
}

@group(1) @binding(0) var<uniform> picture: Picture;
@group(1) @binding(1) var colors: texture_2d<f32>;
@group(1) @binding(2) var depths: texture_2d<f32>;
// WebGL2 has no access to depths but by a sampler that does not interpolate.
@group(1) @binding(3) var nearest: sampler;

// How far the neighbours are, CSS pixels.
const REACH: f32 = 1.2;
// Darkness by relative distance, and the most that one neighbour adds: a silhouette is a thin line, however deep the step.
const STRENGTH: f32 = 12.0;
const MOST: f32 = 0.02;

@vertex
fn vs_picture(@builtin(vertex_index) vertex: u32) -> @builtin(position) vec4<f32> {
    // One triangle that covers the screen.
    let at = vec2<f32>(f32((vertex << 1u) & 2u), f32(vertex & 2u)) * 2.0 - 1.0;
    return vec4<f32>(at, 0.0, 1.0);
}

// Logarithm of the distance at a sample.
fn log_distance(depth: f32) -> f32 {
    return log2(frame.depth.y / min(depth - frame.depth.x, -1e-9));
}

fn depth_at(at: vec2<i32>, size: vec2<f32>) -> f32 {
    return textureSampleLevel(depths, nearest, (vec2<f32>(at) + 0.5) / size, 0.0).x;
}

// Beyond the rim the sampler repeats it.
fn shade(at: vec2<i32>, size: vec2<f32>) -> f32 {
    if picture.samples.y == 0u {
        return 1.0;
    }
    let depth = depth_at(at, size);
    // The ground behind everything is no surface.
    if depth >= 1.0 {
        return 1.0;
    }
    let own = log_distance(depth);
    let reach = max(i32(round(REACH * frame.viewport.w)), 1);
    var darkness = 0.0;
    for (var i = 0; i < 4; i++) {
        // To the right, left, below, above.
        let along = select(vec2<i32>(0, 1), vec2<i32>(1, 0), i < 2) * select(-reach, reach, (i & 1) == 0);
        darkness += clamp(own - log_distance(depth_at(at + along, size)), 0.0, MOST);
    }
    return exp(-STRENGTH * darkness);
}

@fragment
fn fs_picture(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    let samples = i32(picture.samples.x);
    let first = vec2<i32>(position.xy) * samples;
    let size = textureDimensions(colors);
    let last = vec2<i32>(size) - 1;
    var sum = vec3<f32>(0.0);
    for (var i = 0; i < samples * samples; i++) {
        let at = min(first + vec2<i32>(i % samples, i / samples), last);
        let color = textureLoad(colors, at, 0).rgb * shade(at, vec2<f32>(size));
        // Light adds up, its encoding does not; the square is close enough to it.
        sum += color * color;
    }
    return vec4<f32>(sqrt(sum / f32(samples * samples)), 1.0);
}
