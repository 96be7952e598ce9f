// The size of a photon's beam after the lens that it has passed: the twin of `lens.rs`.

struct Faces {
    index: f32,
    front: f32,
    back: f32,
    thickness: f32,
}

fn beam_diameter(faces: Faces, mirror: bool, divergence: f32, distance: f32) -> f32 {
    let bend = faces.index - 1.0;
    let inside = (bend * faces.front - divergence) / faces.index;
    let path = select(0.0, faces.thickness, thick);
    let left = 1.0 - path * inside;
    let through_body = faces.index * inside - bend * faces.back * left;
    let narrowing = select(select(inside, through_body, faces.thickness > 0.0), -(faces.front * 2.0) - divergence, mirror);
    return abs(left - distance * narrowing);
}
