//! Rasterizers written a second time, from the rules alone and as plainly as possible.
//!
//! They share no code with the library. A sample is inside when, for each edge, it lies on the same side as the third vertex, or exactly on
//! an edge that is a top edge (horizontal, interior below) or a left edge (interior to the right) [D3D11.3 §3.4.2.1].

/// A snapped position in 1/256 pixel, y down.
pub type Fx = [i64; 2];

/// How a sample exactly on an edge is treated: the rule, and a wrong one for tests that must fail.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fill {
    TopLeft,
    /// Planted mistake.
    BottomRight,
}

fn cross(a: Fx, b: Fx, p: Fx) -> i64 {
    (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])
}

/// Whether a sample is inside the triangle.
pub fn covers(triangle: [Fx; 3], sample: Fx, fill: Fill) -> bool {
    (0..3).all(|i| {
        let (a, b, third) = (triangle[i], triangle[(i + 1) % 3], triangle[(i + 2) % 3]);
        let (here, inside) = (cross(a, b, sample), cross(a, b, third));
        if inside == 0 {
            return false;
        }
        if here != 0 {
            return (here > 0) == (inside > 0);
        }
        let owns = if a[1] == b[1] {
            third[1] > a[1]
        } else {
            // Where the edge crosses the third vertex's row, is the vertex to the right?
            let (top, bottom) = if a[1] < b[1] { (a, b) } else { (b, a) };
            cross(top, bottom, third) < 0
        };
        owns == (fill == Fill::TopLeft)
    })
}

/// Calls `visit(x, y)` for every pixel of a `width` by `height` target that the triangle covers.
pub fn for_each_pixel(triangle: [Fx; 3], (width, height): (u32, u32), fill: Fill, mut visit: impl FnMut(usize, usize)) {
    let low = |axis: usize| triangle.iter().map(|v| v[axis]).min().unwrap_or(0).div_euclid(256).max(0);
    let high = |axis: usize, size: u32| (triangle.iter().map(|v| v[axis]).max().unwrap_or(0).div_euclid(256) + 1).min(i64::from(size));
    for y in low(1)..high(1, height) {
        for x in low(0)..high(0, width) {
            if covers(triangle, [x * 256 + 128, y * 256 + 128], fill) {
                visit(x as usize, y as usize);
            }
        }
    }
}

/// Framebuffer position before snapping under the reference rules: `n·s + t`, each operation rounded to f32.
pub fn window(size: (u32, u32), clip: [f32; 4]) -> [f32; 2] {
    let reciprocal = 1.0 / clip[3];
    let (half_width, half_height) = (size.0 as f32 * 0.5, size.1 as f32 * 0.5);
    [clip[0] * reciprocal * half_width + half_width, clip[1] * reciprocal * -half_height + half_height]
}

/// Snapped position under the reference rules: nearest 1/256 pixel, ties to even.
pub fn snap(size: (u32, u32), clip: [f32; 4]) -> Fx {
    window(size, clip).map(|v| (f64::from(v) * 256.0).round_ties_even() as i64)
}

#[test]
fn covers_follows_the_top_left_rule() {
    // A square of 2x2 pixels whose sides run through pixel centres, as two triangles.
    let [a, b, c, d] = [[128, 128], [640, 128], [128, 640], [640, 640]];
    let mut count = [[0; 4]; 4];
    for triangle in [[a, b, c], [b, d, c]] {
        for_each_pixel(triangle, (4, 4), Fill::TopLeft, |x, y| count[y][x] += 1);
    }
    assert_eq!(count, [[1, 1, 0, 0], [1, 1, 0, 0], [0; 4], [0; 4]], "top and left samples belong to it, bottom and right ones do not");
    let mut wrong = [[0; 4]; 4];
    for triangle in [[a, b, c], [b, d, c]] {
        for_each_pixel(triangle, (4, 4), Fill::BottomRight, |x, y| wrong[y][x] += 1);
    }
    assert_ne!(count, wrong, "the planted rule must be told apart");
}
