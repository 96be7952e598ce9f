// Both principal curvatures of a surface: the twin of `shape_operator.rs`.

struct ShapeOperator {
    diagonal: vec4<f32>,
    beside: vec4<f32>,
}

struct ViewAxes {
    x: vec3<f32>,
    y: vec3<f32>,
}

fn view_axes(m: mat4x4<f32>) -> ViewAxes {
    return ViewAxes(normalize(vec3<f32>(m[0].x, m[1].x, m[2].x)), normalize(vec3<f32>(m[0].y, m[1].y, m[2].y)));
}

fn forms_of(axes: ViewAxes, bends: ShapeOperator) -> vec3<f32> {
    let d = bends.diagonal;
    let s = bends.beside;
    let matrix = mat3x3<f32>(vec3<f32>(d.x, s.z, s.y), vec3<f32>(s.z, d.y, s.x), vec3<f32>(s.y, s.x, d.z));
    let sx = matrix * axes.x;
    let sy = matrix * axes.y;
    return vec3<f32>(dot(axes.x, sx), dot(axes.x, sy), dot(axes.y, sy));
}

// Coordinates of a vector in a plane from its products with the vectors that span it.
fn by_products(gram: vec3<f32>, along: vec2<f32>) -> vec2<f32> {
    let inverse = 1.0 / (gram.x * gram.z - gram.y * gram.y);
    return vec2<f32>(along.x * gram.z - along.y * gram.y, along.y * gram.x - along.x * gram.y) * inverse;
}

// How the normal turns along a tangent.
fn turn_of(axes: ViewAxes, forms: vec3<f32>, normal: vec3<f32>, step: vec3<f32>) -> vec3<f32> {
    let x = axes.x - normal * dot(normal, axes.x);
    let y = axes.y - normal * dot(normal, axes.y);
    let gram = vec3<f32>(dot(x, x), dot(x, y), dot(y, y));
    let t = by_products(gram, vec2<f32>(dot(x, step), dot(y, step)));
    let v = by_products(gram, vec2<f32>(forms.x * t.x + forms.y * t.y, forms.y * t.x + forms.z * t.y));
    let bends = abs(forms.x) + abs(forms.y) + abs(forms.z) > 0.0;
    return select(vec3<f32>(), x * v.x + y * v.y, bends);
}
