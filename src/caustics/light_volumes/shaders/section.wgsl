// Vertices of a beam's sections on the slicing planes: the twin of `section.rs`.

struct SliceVertex {
    plane_y: f32,
    corner: f32,
}

@group(0) @binding(0) var<uniform> camera: CameraUniform;
@group(0) @binding(3) var<storage, read> slices: array<SliceVertex>;
@group(0) @binding(4) var<uniform> beam: Beam;

struct SectionVertex {
    position: vec3<f32>,
    number: u32,
    depth: f32,
}

fn section_vertex(index: u32) -> SectionVertex {
    let slice = slices[index];
    let number = u32(slice.corner);
    let g = beam.g[number];
    let y = min(slice.plane_y, g.y);
    let depth = g.y - y;
    let at = on_ray(g, beam.d[number], depth);
    return SectionVertex(vec3<f32>(at.x, y, at.y), number, depth);
}

// Vertex of the section at a height.
fn section_at(number: u32, y: f32) -> vec2<f32> {
    return on_ray(beam.g[number], beam.d[number], beam.g[number].y - y);
}

fn double_area_at(y: f32) -> f32 {
    return double_area(section_at(0u, y), section_at(1u, y), section_at(2u, y));
}
