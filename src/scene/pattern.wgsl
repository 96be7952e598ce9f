// The albedo patterns: the twin of `pattern.rs` and of the space noise in `noise.rs`. Hashes are integers and agree in every bit.

struct PatternUniform {
    kind: vec4<u32>,
    numbers: vec4<f32>,
    first: vec4<f32>,
    colours: array<vec4<f32>, 8>,
}

// Coordinates of a point in its pattern, and the axis its surface faces.
fn pattern_point(p: vec3<f32>, normal_ws: vec3<f32>) -> vec3<f32> {
    let n = abs(normal_ws);
    let along_y = n.y >= n.x && n.y >= n.z;
    let along_x = !along_y && n.x >= n.z;
    let face = select(select(2.0, 0.0, along_x), 1.0, along_y);
    return vec3<f32>(select(p.x, p.z, along_x), select(p.y, p.z, along_y), face);
}

fn tile_hash(seed: u32, face: u32, tile: vec2<f32>) -> u32 {
    var bits = seed ^ 0x9e3779b9u;
    let words = array<u32, 3>(face, bitcast<u32>(i32(tile.x)), bitcast<u32>(i32(tile.y)));
    for (var i = 0; i < 3; i++) {
        bits = (bits * 0x85ebca6bu) ^ words[i];
        bits ^= bits >> 16u;
        bits *= 0x85ebca6bu;
        bits ^= bits >> 13u;
        bits *= 0xc2b2ae35u;
        bits ^= bits >> 16u;
    }
    return bits;
}

fn noise_mix(word: u32) -> u32 {
    var h = word;
    h ^= h >> 16u;
    h *= 0x85ebca6bu;
    h ^= h >> 13u;
    h *= 0xc2b2ae35u;
    return h ^ (h >> 16u);
}

fn noise_fold(h: u32, coordinate: i32) -> u32 {
    return noise_mix((h + bitcast<u32>(coordinate)) * 0x9e3779b1u);
}

fn noise_direction(index: u32) -> vec3<f32> {
    var directions = array<vec3<f32>, 16>(
        vec3<f32>(1.0, 1.0, 0.0), vec3<f32>(-1.0, 1.0, 0.0), vec3<f32>(1.0, -1.0, 0.0), vec3<f32>(-1.0, -1.0, 0.0),
        vec3<f32>(1.0, 0.0, 1.0), vec3<f32>(-1.0, 0.0, 1.0), vec3<f32>(1.0, 0.0, -1.0), vec3<f32>(-1.0, 0.0, -1.0),
        vec3<f32>(0.0, 1.0, 1.0), vec3<f32>(0.0, -1.0, 1.0), vec3<f32>(0.0, 1.0, -1.0), vec3<f32>(0.0, -1.0, -1.0),
        vec3<f32>(1.0, 1.0, 0.0), vec3<f32>(0.0, -1.0, 1.0), vec3<f32>(-1.0, 1.0, 0.0), vec3<f32>(0.0, -1.0, -1.0),
    );
    return directions[index];
}

fn perlin3(p: vec3<f32>, seed: u32) -> f32 {
    let cell = floor(p);
    let lattice = vec3<i32>(cell);
    let f = p - cell;
    var c = array<f32, 8>();
    for (var corner = 0; corner < 8; corner++) {
        let offset = vec3<i32>(corner & 1, (corner >> 1u) & 1, corner >> 2u);
        let at = lattice + offset;
        let bits = noise_fold(noise_fold(noise_fold(noise_mix(seed), at.x), at.y), at.z) >> 28u;
        let g = noise_direction(bits);
        let d = f - vec3<f32>(offset);
        c[corner] = g.x * d.x + g.y * d.y + g.z * d.z;
    }
    let w = f * f * f * (f * (f * 6.0 - 15.0) + 10.0);
    return c[0] + w.x * (c[1] - c[0]) + w.y * (c[2] - c[0]) + w.z * (c[4] - c[0])
        + w.x * w.y * (c[0] - c[1] - c[2] + c[3]) + w.y * w.z * (c[0] - c[2] - c[4] + c[6]) + w.z * w.x * (c[0] - c[1] - c[4] + c[5])
        + w.x * w.y * w.z * (c[1] + c[2] + c[4] + c[7] - c[0] - c[3] - c[5] - c[6]);
}

fn fbm3(p: vec3<f32>, octaves: u32, seed: u32) -> f32 {
    var amplitude = 1.0;
    var frequency = 1.0;
    var sum = 0.0;
    var amplitudes = 0.0;
    for (var octave = 0u; octave < min(octaves, 32u); octave++) {
        sum += amplitude * perlin3(p * frequency, noise_fold(seed, i32(octave)));
        amplitudes += amplitude;
        amplitude *= 0.5;
        frequency *= 2.0;
    }
    return select(0.0, sum / amplitudes, amplitudes > 0.0);
}

fn tile_colour(pattern: PatternUniform, face: u32, tile: vec2<f32>) -> vec3<f32> {
    var colours = pattern.colours;
    let bits = tile_hash(pattern.kind.z, face, tile);
    let colour = colours[(bits >> 8u) % clamp(pattern.kind.y, 1u, 8u)].rgb;
    let brightness = 1.0 + pattern.numbers.w * (f32(bits & 0xffffu) * (2.0 / 65535.0) - 1.0);
    return min(colour * brightness, vec3<f32>(1.0));
}

fn pattern_at(pattern: PatternUniform, position_ws: vec3<f32>, normal_ws: vec3<f32>) -> vec3<f32> {
    let first = pattern.first.rgb;
    let second = pattern.colours[0].rgb;
    switch pattern.kind.x {
        case 1u: {
            let at = pattern_point(position_ws, normal_ws);
            let size = pattern.numbers.xy;
            let tile = floor(at.xy / size);
            let inside = at.xy - tile * size;
            let to_edge = min(inside, size - inside);
            if min(to_edge.x, to_edge.y) < 0.5 * pattern.numbers.z {
                return first;
            }
            return tile_colour(pattern, u32(at.z), tile);
        }
        case 2u: {
            let square = floor(pattern_point(position_ws, normal_ws).xy / pattern.numbers.x);
            let sum = square.x + square.y;
            return select(second, first, sum == floor(sum * 0.5) * 2.0);
        }
        case 3u: {
            let noise = fbm3(position_ws / pattern.numbers.x, pattern.kind.w, pattern.kind.z);
            return first + (second - first) * clamp(noise * (0.5 / 0.6) + 0.5, 0.0, 1.0);
        }
        default: {
            return first;
        }
    }
}
