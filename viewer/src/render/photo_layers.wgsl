// Several photographs on the surface at once: each place takes the one that shows it best from where it is looked at, and two that
// show it nearly as well are mixed, so that there are no seams. `worth` in features/photo/choice.rs is the same rule.

// As many as photo_layers.rs gives at most.
const MOST_LAYERS: u32 = 8u;

struct Layer {
    // Strength: how good its pixels are against those of others.
    photograph: Photograph,
    // Where its camera stood; layer of the textures.
    eye: vec4<f32>,
}

struct Layers {
    // How many there are; unused.
    count: vec4<u32>,
    list: array<Layer, 8>,
}

@group(3) @binding(0) var<uniform> layers: Layers;
@group(3) @binding(1) var layer_pictures: texture_2d_array<f32>;
@group(3) @binding(2) var layer_sampler: sampler;
// Distances of the mesh as each camera sees it: photograph_distance.wgsl.
@group(3) @binding(3) var layer_distances: texture_2d_array<u32>;

// Least share of the best photograph's worth at which another still shows.
const TIE: f32 = 0.8;
// Width of the soft rim of a picture, as a share of it.
const RIM: f32 = 0.04;
// Worth of pixels that lie beside a step of the surface: they may show what lies beyond.
const BESIDE_STEP: f32 = 0.6;

// Where a place lies in a picture, as shares of it.
fn layer_share(photograph: Photograph, at: vec3<f32>) -> vec2<f32> {
    let place = (photograph.camera_from_table * vec4<f32>(at, 1.0)).xyz;
    return (camera_pixel(photograph, vec3<f32>(place.xy, max(place.z, 1e-3))) + 0.5) / photograph.size.xy;
}

// Whether a camera sees a place at `distance`, 0..1, and whether the surface around it has no step, 0..1.
fn layer_sight(slot: u32, share: vec2<f32>, distance: f32, tolerance: f32) -> vec2<f32> {
    let size = vec2<f32>(textureDimensions(layer_distances));
    var sight = vec2<f32>(0.0);
    for (var i = 0u; i < 4u; i++) {
        let aside = vec2<f32>(select(-1.5, 1.5, (i & 1u) == 0u), select(-1.5, 1.5, i < 2u));
        let texel = vec2<u32>(clamp(share * size + aside, vec2<f32>(0.0), size - 1.0));
        let nearest = bitcast<f32>(textureLoad(layer_distances, texel, slot, 0).r);
        let is_hidden = nearest > 0.0 && nearest + tolerance < distance;
        let is_step = nearest <= 0.0 || nearest > distance + 2.0 * tolerance;
        sight += 0.25 * vec2<f32>(select(1.0, 0.0, is_hidden), select(1.0, 0.0, is_step));
    }
    return sight;
}

// How well a photograph shows a place, and whether it shows it at all, 0..1.
fn layer_worth(index: u32, at: vec3<f32>, normal: vec3<f32>, toward_eye: vec3<f32>) -> vec2<f32> {
    let photograph = layers.list[index].photograph;
    let eye = layers.list[index].eye;
    let distance = (photograph.camera_from_table * vec4<f32>(at, 1.0)).z;
    let share = layer_share(photograph, at);
    let rim = min(min(share.x, share.y), min(1.0 - share.x, 1.0 - share.y));
    let toward = normalize(eye.xyz - at);
    let facing = dot(normal, toward);
    if distance < 1e-2 || rim <= 0.0 || facing < 0.08 {
        return vec2<f32>(0.0);
    }
    let pixels = 3.0 * photograph.size.x / f32(textureDimensions(layer_distances).x);
    let tolerance = distance_tolerance(photograph, facing, distance, pixels);
    let sight = layer_sight(u32(eye.w + 0.5), share, distance, tolerance);
    let cover = smoothstep(0.25, 1.0, sight.x) * smoothstep(0.0, RIM, rim) * smoothstep(0.08, 0.25, facing);
    let density = sqrt(photograph.camera.x * photograph.camera.y * facing) / distance;
    // Any photograph is better than none.
    let closeness = 0.1 + 0.9 * pow(max(0.5 + 0.5 * dot(toward, toward_eye), 0.0), 8.0);
    return vec2<f32>(cover * photograph.size.z * density * closeness * mix(BESIDE_STEP, 1.0, sight.y), cover);
}

// What the photographs show at a place with this normal (table frame), and how much of it they cover.
//
// along_x, along_y: from there to the places of the neighbouring samples. toward_eye: the direction to whom it is shown.
fn layers_color(
    at: vec3<f32>,
    along_x: vec3<f32>,
    along_y: vec3<f32>,
    normal: vec3<f32>,
    toward_eye: vec3<f32>,
) -> vec4<f32> {
    let count = min(layers.count.x, MOST_LAYERS);
    var worths: array<f32, 8>;
    var best = 0.0;
    var cover = 0.0;
    for (var i = 0u; i < count; i++) {
        let worth = layer_worth(i, at, normal, toward_eye);
        worths[i] = worth.x;
        best = max(best, worth.x);
        cover = max(cover, worth.y);
    }
    var sum = vec4<f32>(0.0);
    for (var i = 0u; i < count; i++) {
        let weight = smoothstep(TIE, 1.0, worths[i] / max(best, 1e-9));
        if weight > 0.0 {
            let photograph = layers.list[i].photograph;
            let share = layer_share(photograph, at);
            let across_x = layer_share(photograph, at + along_x) - share;
            let across_y = layer_share(photograph, at + along_y) - share;
            let slot = u32(layers.list[i].eye.w + 0.5);
            let color = textureSampleGrad(layer_pictures, layer_sampler, share, slot, across_x, across_y).rgb;
            sum += weight * vec4<f32>(color, 1.0);
        }
    }
    return vec4<f32>(sum.rgb / max(sum.a, 1e-6), cover);
}
