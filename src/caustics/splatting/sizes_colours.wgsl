
struct Targets {
    @location(0) red: vec4<f32>,
    @location(1) green: vec4<f32>,
    @location(2) blue: vec4<f32>,
    @location(3) count: vec4<f32>,
}

@fragment
fn fs(in: Varyings) -> Targets {
    let all = bells(in);
    return Targets(all * in.flux.r, all * in.flux.g, all * in.flux.b, inside(in));
}
