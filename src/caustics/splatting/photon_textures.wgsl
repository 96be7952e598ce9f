
// Photons in textures.

@group(0) @binding(4) var photon_positions: texture_2d<f32>;
@group(0) @binding(5) var photon_directions: texture_2d<f32>;
@group(0) @binding(6) var photon_fluxes: texture_2d<f32>;

fn photon_of(index: u32) -> Photon {
    let columns = u32(splats.shape.y);
    let texel = vec2<i32>(i32(index % columns), i32(index / columns));
    let position = textureLoad(photon_positions, texel, 0);
    let flux = textureLoad(photon_fluxes, texel, 0).rgb;
    return photon_at(texel, position.xyz, textureLoad(photon_directions, texel, 0), flux, position.w == 1.0);
}
