//! The sixteen squares of a block, region or tile: coordinates of lanes, and sets of squares as bits.

/// Columns of the lanes of a block.
pub(crate) const LANE_X: [i32; 16] = [0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3];

/// Rows of the lanes of a block.
pub(crate) const LANE_Y: [i32; 16] = [0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3];

/// Removes the first square of a set and returns its first pixel. The squares are `size` pixels wide, the first of the sixteen at (x, y).
#[inline(always)]
pub(crate) fn next_square(squares: &mut u32, size: i32, x: i32, y: i32) -> Option<(i32, i32)> {
    if *squares == 0 {
        return None;
    }
    let square = squares.trailing_zeros() as i32;
    *squares &= *squares - 1;
    Some((x + (square & 3) * size, y + (square >> 2) * size))
}

/// The squares of the sixteen that lie in columns x0..=x1 and rows y0..=y1; bit = 4·row + column. Columns and rows beyond 0..=3 are ignored.
#[inline(always)]
pub(crate) fn square_range(x0: i32, x1: i32, y0: i32, y1: i32) -> u32 {
    // Columns up to the end minus those before the start, without a branch. An end before the start gives the empty set.
    let below = |end: i32| (1u32 << end.clamp(0, 4)) - 1;
    let rows_below = |end: i32| (1u32 << (4 * end.clamp(0, 4))) - 1;
    let columns = (below(x1 + 1) & !below(x0)) * 0x1111;
    columns & rows_below(y1 + 1) & !rows_below(y0)
}

#[cfg(test)]
mod tests {
    use super::square_range;

    #[test]
    fn square_range_names_the_blocks_of_every_rectangle() {
        for x0 in -2..6 {
            for x1 in -2..6 {
                for y0 in -2..6 {
                    for y1 in -2..6 {
                        let inside = |b: i32| (x0..=x1).contains(&(b & 3)) && (y0..=y1).contains(&(b >> 2));
                        let expected = (0..16).filter(|b| inside(*b)).fold(0, |bits, b| bits | 1 << b);
                        assert_eq!(square_range(x0, x1, y0, y1), expected, "{x0} {x1} {y0} {y1}");
                    }
                }
            }
        }
    }
}
