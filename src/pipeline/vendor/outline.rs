//! SwiftShader's coverage of a clipped polygon: the rows between its left and right outline.
//!
//! SwiftShader writes every edge of the snapped polygon into one of two lists of columns, by whether the edge goes down or up; later edges overwrite
//! earlier ones. Then it fills each row from the left list to the right one. For a convex outline, this gives the polygon by the top-left rule. An
//! outline that rounding has dented or reversed loses rows, where a fan would cover pixels twice. Which list an edge belongs to depends on the
//! winding of the triangle before it is clipped.

use crate::api::state::PixelRect;
use crate::primitive::window::HALF;

/// Sub-pixel units per pixel.
const UNITS: i64 = 16;

/// The covered pixels of a polygon.
#[derive(Debug, PartialEq)]
pub(crate) enum Outline {
    /// Those of the polygon by the top-left rule.
    Convex,
    /// Those of these rectangles, each a run of columns in one row.
    Rows(Vec<PixelRect>),
}

/// The outline through snapped corners in 1/256 pixel, on the grid of sixteenths around pixel centres.
pub(crate) fn outline(corners: &[[i32; 2]], counter_clockwise: bool, scissor: PixelRect) -> Outline {
    let mut points: Vec<[i64; 2]> = corners.iter().map(|c| c.map(|v| i64::from((v - HALF) >> 4))).collect();
    points.dedup();
    if points.len() > 1 && points.first() == points.last() {
        points.pop();
    }
    let sense = if counter_clockwise { -1 } else { 1 };
    match sense_of_convex(&points) {
        Some(s) if s == sense => Outline::Convex,
        // A convex outline of the other winding: every row ends before it starts.
        Some(_) => Outline::Rows(Vec::new()),
        None => Outline::Rows(rows(&points, counter_clockwise, scissor)),
    }
}

/// Winding of a convex outline: 1 if it is clockwise on the screen, -1 if counter-clockwise; `None` if it is not convex.
fn sense_of_convex(points: &[[i64; 2]]) -> Option<i64> {
    let count = points.len();
    if count < 3 {
        return None;
    }
    let mut sense = 0;
    for k in 0..count {
        let [a, b, c] = [0, 1, 2].map(|i| points[(k + i) % count]);
        let (u, v) = ([b[0] - a[0], b[1] - a[1]], [c[0] - b[0], c[1] - b[1]]);
        let turn = (u[0] * v[1] - u[1] * v[0]).signum();
        let is_spike = turn == 0 && u[0] * v[0] + u[1] * v[1] < 0;
        if is_spike || turn * sense < 0 {
            return None;
        }
        sense = if turn == 0 { sense } else { turn };
    }
    (sense != 0).then_some(sense)
}

fn rows(points: &[[i64; 2]], counter_clockwise: bool, scissor: PixelRect) -> Vec<PixelRect> {
    let first_at = |v: i64| v.div_euclid(UNITS) + i64::from(v.rem_euclid(UNITS) != 0);
    let row_of = |v: i64| first_at(v).clamp(scissor.y0.into(), scissor.y1.into());
    let top = points.iter().map(|p| row_of(p[1])).min().unwrap_or(0);
    let bottom = points.iter().map(|p| row_of(p[1])).max().unwrap_or(0);
    let mut columns = vec![[0_i64; 2]; (bottom - top) as usize];
    for k in 0..points.len() {
        let (mut from, mut to) = (points[k], points[(k + 1) % points.len()]);
        if !counter_clockwise {
            std::mem::swap(&mut from, &mut to);
        }
        // Downward edges are left edges.
        let is_right = to[1] < from[1];
        let [upper, lower] = if is_right { [to, from] } else { [from, to] };
        let height = lower[1] - upper[1];
        for row in row_of(upper[1])..row_of(lower[1]) {
            let across = upper[0] * height + (lower[0] - upper[0]) * (row * UNITS - upper[1]);
            let units = height * UNITS;
            let column = across.div_euclid(units) + i64::from(across.rem_euclid(units) != 0);
            columns[(row - top) as usize][usize::from(is_right)] = column.clamp(scissor.x0.into(), scissor.x1.into());
        }
    }
    let filled = columns.iter().zip(top..).filter(|([left, right], _)| left < right);
    filled.map(|(&[left, right], row)| PixelRect { x0: left as u32, y0: row as u32, x1: right as u32, y1: row as u32 + 1 }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const TARGET: PixelRect = PixelRect { x0: 0, y0: 0, x1: 8, y1: 8 };

    fn at(x: f64, y: f64) -> [i32; 2] {
        [(x * 256.0) as i32, (y * 256.0) as i32]
    }

    #[test]
    fn outline_of_a_square_is_convex_and_its_rows_are_its_pixels() {
        // Clockwise on the screen.
        let square = [at(1.5, 1.5), at(4.5, 1.5), at(4.5, 3.5), at(1.5, 3.5)];
        assert_eq!(outline(&square, false, TARGET), Outline::Convex);
        let points = square.map(|c| c.map(|v| i64::from((v - HALF) >> 4)));
        let row = |y| PixelRect { x0: 1, y0: y, x1: 4, y1: y + 1 };
        assert_eq!(rows(&points, false, TARGET), [row(1), row(2)]);
        assert_eq!(rows(&points, true, TARGET), []);
    }

    #[test]
    fn outline_turned_over_covers_nothing() {
        let triangle = [at(1.5, 1.5), at(4.5, 1.5), at(1.5, 4.5)];
        assert_eq!(outline(&triangle, true, TARGET), Outline::Rows(Vec::new()));
    }

    #[test]
    fn outline_with_a_dent_is_filled_by_its_last_edges() {
        let dented = [at(1.5, 1.5), at(3.0, 2.5), at(4.5, 1.5), at(4.5, 4.5), at(1.5, 4.5)];
        let Outline::Rows(rows) = outline(&dented, false, TARGET) else { panic!("it is not convex") };
        assert_eq!(rows.len(), 3);
        assert_eq!(rows[1], PixelRect { x0: 1, y0: 2, x1: 4, y1: 3 });
    }
}
