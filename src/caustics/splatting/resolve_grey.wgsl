
@group(0) @binding(1) var fluxes: texture_2d<f32>;
@group(0) @binding(2) var counts: texture_2d<f32>;

@fragment
fn fs(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    let at = vec2<i32>(position.xy);
    let flux = textureLoad(fluxes, at, 0);
    let sizes = array<vec3<f32>, 4>(colour.rgb * flux.x, colour.rgb * flux.y, colour.rgb * flux.z, colour.rgb * flux.w);
    return pick(sizes, flux, textureLoad(counts, at, 0));
}
