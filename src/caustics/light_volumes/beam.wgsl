// A beam and its corners on the slicing planes: the twin of `corner` in `shaders.rs`.

struct Beam {
    g: array<vec4<f32>, 3>,
    d: array<vec4<f32>, 3>,
    flux: vec4<f32>,
}

struct SliceVertex {
    plane_y: f32,
    corner: f32,
}

@group(0) @binding(0) var<uniform> camera: CameraUniform;
@group(0) @binding(3) var<storage, read> slices: array<SliceVertex>;
@group(0) @binding(4) var<uniform> beam: Beam;

struct Corner {
    position: vec3<f32>,
    number: u32,
    depth: f32,
}

fn corner_at(index: u32) -> Corner {
    let slice = slices[index];
    let number = u32(slice.corner);
    let g = beam.g[number];
    let y = min(slice.plane_y, g.y);
    let depth = g.y - y;
    let across = g.xz + beam.d[number].xz * depth;
    return Corner(vec3<f32>(across.x, y, across.y), number, depth);
}
