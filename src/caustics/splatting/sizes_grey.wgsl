
struct Targets {
    @location(0) flux: vec4<f32>,
    @location(1) count: vec4<f32>,
}

@fragment
fn fs(in: Varyings) -> Targets {
    return Targets(bells(in) * in.flux.w, inside(in));
}
