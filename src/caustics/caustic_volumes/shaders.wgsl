// The light at each receiver inside of a caustic volume: the twin of `VolumeFragment` in `shaders.rs`.
//
// The geometry stage emits the faces of the hulls. WebGPU has no such stage: the faces are pulled from a buffer.

override paper: bool = false;

const BEAMS_PER_PAGE: u32 = 4096u;

struct VolumeUniform {
    shape: vec4<f32>,
    sigma_t: vec4<f32>,
}

@group(0) @binding(0) var<uniform> camera: CameraUniform;
@group(0) @binding(1) var<uniform> volume: VolumeUniform;
@group(0) @binding(3) var<storage, read> beams: array<Beam>;
@group(0) @binding(4) var positions: texture_2d<f32>;
@group(0) @binding(5) var normals: texture_2d<f32>;
@group(0) @binding(6) var visibilities: texture_2d<f32>;

struct Varyings {
    @builtin(position) position: vec4<f32>,
    @location(0) @interpolate(flat) beam: vec2<f32>,
    @location(1) @interpolate(flat) visibility: vec3<f32>,
}

struct Targets {
    @location(0) irradiance: vec4<f32>,
    @location(1) direction: vec4<f32>,
    @location(2) count: vec4<f32>,
}

@fragment
fn fs(in: Varyings) -> Targets {
    let at_pixel = vec2<i32>(in.position.xy);
    let here = textureLoad(positions, at_pixel, 0);
    // Beams of a light in the water are upside down.
    let turned = vec3<f32>(1.0, volume.sigma_t.w, 1.0);
    let p = here.xyz * turned;
    var beam = beams[u32(in.beam.x) * BEAMS_PER_PAGE + u32(in.beam.y)];

    // Intersect the three rays with the plane y = P.y; the result is a triangle in x and z.
    var depth = vec3<f32>();
    var corners = array<vec2<f32>, 3>();
    for (var i = 0; i < 3; i++) {
        depth[i] = beam.g[i].y - p.y;
        corners[i] = on_ray(beam.g[i], beam.d[i], depth[i]);
    }
    let twice_area = double_area(corners[0], corners[1], corners[2]);
    let positive = twice_area > 0.0;

    // Both beams of an edge evaluate it from the same end.
    let at = p.xz;
    var weight = vec3<f32>();
    var inside = p.y >= volume.shape.x;
    for (var i = 0; i < 3; i++) {
        let j = (i + 1) % 3;
        let first = beam.g[i].w > 0.0;
        let start = select(corners[j], corners[i], first);
        let end = select(corners[i], corners[j], first);
        let side = perp_dot(end - start, at - start);
        inside = inside && ((side >= 0.0) == positive) == first;
        weight[(i + 2) % 3] = select(-side, side, first);
    }
    var b = weight * (1.0 / twice_area);
    var section_area = abs(twice_area) * 0.5;
    let middle = inside;
    // Around a focus a section is narrower than a pixel.
    let width = pixel_m_at(camera, here.xyz);
    var share = 1.0;
    let generator = abs(double_area(beam.g[0].xz, beam.g[1].xz, beam.g[2].xz));
    if is_narrow(corners, twice_area, generator, width) {
        let needle = needle_of(corners, twice_area, width);
        share = needle_coverage(needle, at);
        inside = share > 0.0 && p.y >= volume.shape.x;
        section_area = abs(needle.twice_area) * 0.5;
        b = needle_weights(needle, at);
    }
    if !inside {
        discard;
    }
    let below = dot(b, depth);
    let travelled = path_length(beam.d, b, depth);

    // F_P = A_gen/A_P times I0 is flux over area, attenuated per wavelength over the distance in water.
    let area = lit_area(section_area, beam.flux.w);
    let visible = textureLoad(visibilities, at_pixel, 0).r;
    var scale = visible * clamp(dot(b, in.visibility), 0.0, 1.0) * share / area;
    let ray = beam_ray(beam.d, b);
    if !paper {
        scale *= max(-dot(textureLoad(normals, at_pixel, 0).xyz * turned, ray), 0.0);
    }
    if !(below > 0.0 && here.w == 1.0 && scale > 0.0) {
        discard;
    }
    let irradiance = beam.flux.rgb * beer_lambert_rgb(volume.sigma_t.rgb, travelled) * scale;
    let total = irradiance.r + irradiance.g + irradiance.b;
    return Targets(vec4<f32>(irradiance, 0.0), vec4<f32>(-normalize(ray) * turned * total, total), vec4<f32>(select(0.0, 1.0, middle), 0.0, 0.0, 0.0));
}
