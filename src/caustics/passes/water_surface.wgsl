// The water surface: the twin of `SurfaceVertex` and `SurfaceFragment` in `water_surface.rs`.

override snell: bool = true;

const SEARCH_STEPS: i32 = 8;
const ENDLESS: f32 = 1.0e4;
const OFF_RAY_PX: f32 = 4.0;
const UNCONVERGED: f32 = 2.0;

struct WaterVertex {
    position_ws: vec4<f32>,
    normal_ws: vec4<f32>,
}

@group(0) @binding(0) var<uniform> camera: CameraUniform;
@group(0) @binding(1) var<uniform> environment: EnvironmentUniform;
@group(0) @binding(2) var positions: texture_2d<f32>;
@group(0) @binding(3) var radiances: texture_2d<f32>;
@group(0) @binding(4) var<storage, read> vertices: array<WaterVertex>;
@group(0) @binding(5) var albedos: texture_2d<f32>;

struct Varyings {
    @builtin(position) position: vec4<f32>,
    @location(0) position_ws: vec3<f32>,
    @location(1) normal_ws: vec3<f32>,
}

// The radiance behind a surface point, the distance in water to the point seen, m, and 1 or UNCONVERGED.
struct Seen {
    radiance: vec3<f32>,
    distance: f32,
    mark: f32,
}

@vertex
fn vs(@builtin(vertex_index) vertex_index: u32) -> Varyings {
    let vertex = vertices[vertex_index];
    // The surface appears at its own position: only points under it are raised.
    return Varyings(camera.clip_from_world * vec4<f32>(vertex.position_ws.xyz, 1.0), vertex.position_ws.xyz, vertex.normal_ws.xyz);
}

// Linear filtering, clamped to the edge; spelled out, because 32-bit float textures need not be filterable.
fn radiance_at(pixel: vec2<f32>) -> vec3<f32> {
    let size = vec2<f32>(textureDimensions(radiances));
    let scaled = clamp(pixel * camera.size_px.zw * size, vec2<f32>(-1.0e9), vec2<f32>(1.0e9));
    let base = floor(scaled - 0.5);
    let weight = scaled - 0.5 - base;
    let near = vec2<i32>(clamp(base, vec2<f32>(0.0), size - 1.0));
    let far = vec2<i32>(clamp(base + 1.0, vec2<f32>(0.0), size - 1.0));
    let a = textureLoad(radiances, near, 0).rgb;
    let b = textureLoad(radiances, vec2<i32>(far.x, near.y), 0).rgb;
    let c = textureLoad(radiances, vec2<i32>(near.x, far.y), 0).rgb;
    let d = textureLoad(radiances, far, 0).rgb;
    let upper = a + (b - a) * weight.x;
    let lower = c + (d - c) * weight.x;
    return upper + (lower - upper) * weight.y;
}

// The paper's lookup, at this surface point moved vertically onto the mean plane.
fn virtual_plane(surface: vec3<f32>) -> Seen {
    let on_plane = vec3<f32>(surface.x, camera.level.x, surface.z);
    let pixel = pixel_of(camera, camera.clip_from_world * vec4<f32>(on_plane, 1.0));
    let at = texel_or_zero(positions, pixel);
    return Seen(radiance_at(pixel), select(ENDLESS * camera.level.y, length(at.xyz - surface), at.w > 0.0), 1.0);
}

// Follows a refracted ray from the surface to the first receiver under water.
fn follow(surface: vec3<f32>, ray: vec3<f32>) -> Seen {
    var pixel = pixel_of(camera, camera.clip_from_world * vec4<f32>(surface, 1.0));
    var distance = min(-(1.0 / ray.y), 4.0) * camera.level.y;
    // At a jump in depth the iteration has no fixed point and oscillates. Of the points found, the one nearest to the ray is taken.
    var best = pixel;
    var best_distance = ENDLESS * camera.level.y;
    var best_miss = 3.0e38;
    for (var step = 0; step < SEARCH_STEPS; step++) {
        let at = texel_or_zero(positions, pixel);
        // A receiver above the water hides the water at this pixel; the ray continues below it.
        if at.w > 0.0 && texel_or_zero(albedos, pixel).w > 0.0 {
            let to = at.xyz - surface;
            let guess = length(to);
            let beside = to - ray * dot(to, ray);
            if dot(beside, beside) < best_miss {
                best = pixel;
                best_distance = guess;
                best_miss = dot(beside, beside);
            }
            distance = select((guess + distance) * 0.5, guess, step == 0);
        }
        pixel = pixel_of(camera, project(camera, surface + ray * distance));
    }
    let tolerance = pixel_m_at(camera, surface + ray * best_distance) * OFF_RAY_PX;
    return Seen(radiance_at(best), best_distance, select(UNCONVERGED, 1.0, best_miss <= tolerance * tolerance));
}

// The surface as an eye under water sees it: Snell's window, and total reflection around it.
fn from_below(surface: vec3<f32>, up: vec3<f32>, view: vec3<f32>, ior: f32) -> vec3<f32> {
    let down = -up;
    let leaves = refracts(view, down, ior);
    let water = environment.inscatter.rgb;
    var at_surface = water;
    if leaves {
        let reflectance = fresnel_reflectance(max(-dot(view, down), 1.0e-3), ior, 1.0);
        let seen = sky(environment, normalize(refract_ray(view, down, ior))) * (ior * ior);
        at_surface = seen * (1.0 - reflectance) + water * reflectance;
    }
    return through_medium(environment.sigma_t.rgb, water, at_surface, length(surface - camera.eye_ws.xyz));
}

@fragment
fn fs(in: Varyings) -> @location(0) vec4<f32> {
    let surface = in.position_ws;
    let up = normalize(in.normal_ws);
    let view = view_direction(camera, surface);
    let ior = environment.inscatter.w;
    if camera.water.z > 0.0 {
        return vec4<f32>(from_below(surface, up, view, ior), 1.0);
    }
    // The far side of a wave can face away from the eye; the cosine is then that of a nearly grazing view.
    let reflectance = fresnel_reflectance(max(-dot(view, up), 0.02), 1.0, ior);
    var seen: Seen;
    if snell {
        seen = follow(surface, refract_ray(view, up, 1.0 / ior));
    } else {
        seen = virtual_plane(surface);
    }
    // Radiance in the thinner medium is less by n²; the paper shows the water's own.
    let below = through_medium(environment.sigma_t.rgb, environment.inscatter.rgb, seen.radiance, seen.distance) * select(1.0, 1.0 / (ior * ior), snell);
    // Light that a wave reflects downwards would hit the water again; the sky just above the horizon is taken instead.
    var mirrored = reflect_ray(view, up);
    mirrored = normalize(vec3<f32>(mirrored.x, max(mirrored.y, 0.01), mirrored.z));
    return vec4<f32>(below * (1.0 - reflectance) + sky(environment, mirrored) * reflectance, seen.mark);
}
