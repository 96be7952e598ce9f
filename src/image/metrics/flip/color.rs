//! Colour spaces of FLIP: linear RGB, the linearised opponent space YCxCz, and CIELAB with Hunt's effect.

/// Rows of the matrix from linear RGB (BT.709 primaries, white D65) to CIE XYZ, as quotients of integers.
const XYZ_FROM_RGB: [[f32; 3]; 3] = [
    [10_135_552.0 / 24_577_794.0, 8_788_810.0 / 24_577_794.0, 4_435_075.0 / 24_577_794.0],
    [2_613_072.0 / 12_288_897.0, 8_788_810.0 / 12_288_897.0, 887_015.0 / 12_288_897.0],
    [1_425_312.0 / 73_733_382.0, 8_788_810.0 / 73_733_382.0, 70_074_185.0 / 73_733_382.0],
];

/// Rows of the inverse matrix.
const RGB_FROM_XYZ: [[f32; 3]; 3] =
    [[3.241_003_3, -1.537_399, -0.498_615_86], [-0.969_224_3, 1.875_930_1, 0.041_554_224], [0.055_639_423, -0.204_011_2, 1.057_149]];

/// XYZ of white: D65 with `Y = 1`.
const WHITE: [f32; 3] = [0.950_428_55, 1.0, 1.088_900_4];
/// One over each component of [`WHITE`].
const INVERSE_WHITE: [f32; 3] = [1.052_156_9, 1.0, 0.918_357_7];

fn transform(rows: &[[f32; 3]; 3], v: [f32; 3]) -> [f32; 3] {
    rows.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

fn scale(v: [f32; 3], by: [f32; 3]) -> [f32; 3] {
    [v[0] * by[0], v[1] * by[1], v[2] * by[2]]
}

/// Linear RGB to YCxCz: `Y = 116·y − 16`, `Cx = 500·(x − y)`, `Cz = 200·(y − z)` with XYZ relative to white [AN20 §4.1].
pub(super) fn opponent_from_rgb(rgb: [f32; 3]) -> [f32; 3] {
    let [x, y, z] = scale(transform(&XYZ_FROM_RGB, rgb), INVERSE_WHITE);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// YCxCz to linear RGB, clamped to `0..=1`: filtering may have left the gamut.
pub(super) fn rgb_from_opponent([y, cx, cz]: [f32; 3]) -> [f32; 3] {
    let y = (y + 16.0) / 116.0;
    let xyz = scale([y + cx / 500.0, y, y - cz / 200.0], WHITE);
    transform(&RGB_FROM_XYZ, xyz).map(|channel| channel.clamp(0.0, 1.0))
}

/// The cube root of CIELAB, straight below `(6/29)³`.
fn lab_curve(t: f32) -> f32 {
    const DELTA: f32 = 6.0 / 29.0;
    if t > DELTA * (DELTA * DELTA) { libm::cbrtf(t) } else { 1.0 / (3.0 * (DELTA * DELTA)) * t + 4.0 / 29.0 }
}

/// Linear RGB to CIELAB whose chroma shrinks with lightness, `a·L/100` and `b·L/100`: Hunt's effect [AN20 §4.1].
pub(super) fn hunt_lab_from_rgb(rgb: [f32; 3]) -> [f32; 3] {
    let [x, y, z] = scale(transform(&XYZ_FROM_RGB, rgb), INVERSE_WHITE).map(lab_curve);
    let lightness = 116.0 * y - 16.0;
    let hunt = |chroma: f32| 0.01 * lightness * chroma;
    [lightness, hunt(500.0 * (x - y)), hunt(200.0 * (y - z))]
}

/// Distance for large colour differences: city block in lightness, Euclidean in chroma (HyAB) [AN20 §4.1].
pub(super) fn hyab(p: [f32; 3], q: [f32; 3]) -> f32 {
    let (l, a, b) = (p[0] - q[0], p[1] - q[1], p[2] - q[2]);
    l.abs() + (a * a + b * b).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn white_and_black_are_neutral() {
        for (rgb, lightness) in [([1.0; 3], 100.0), ([0.0; 3], 0.0)] {
            let [l, a, b] = hunt_lab_from_rgb(rgb);
            assert!((l - lightness).abs() < 1.0e-4 && a.abs() < 1.0e-3 && b.abs() < 1.0e-3, "{l} {a} {b}");
        }
        let [y, cx, cz] = opponent_from_rgb([1.0; 3]);
        assert!((y - 100.0).abs() < 1.0e-4 && cx.abs() < 1.0e-3 && cz.abs() < 1.0e-3);
    }

    #[test]
    fn the_opponent_space_is_left_as_it_was_entered() {
        for rgb in [[0.2, 0.5, 0.7], [1.0, 0.0, 0.0], [0.0, 0.01, 1.0]] {
            let back = rgb_from_opponent(opponent_from_rgb(rgb));
            assert!((0..3).all(|i| (back[i] - rgb[i]).abs() < 2.0e-6), "{rgb:?} became {back:?}");
        }
        assert_eq!(rgb_from_opponent([300.0, 0.0, 0.0]), [1.0; 3]);
    }

    #[test]
    fn the_curve_of_lab_is_continuous() {
        let joint = libm::powf(6.0 / 29.0, 3.0);
        assert!((lab_curve(joint * 1.0001) - lab_curve(joint * 0.9999)).abs() < 1.0e-4);
    }
}
