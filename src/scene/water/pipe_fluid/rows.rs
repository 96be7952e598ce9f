//! Loops over one row of columns, compiled for the machine's vectors as well as for every machine: nothing is fused or reordered, so the bits
//! are the same.
//!
//! Each loop writes to one slice: with more, the compiler cannot tell that they do not overlap, and leaves vectors unused.

use fearless_simd::{Level, Simd};
use fearless_simd_macros::simd;
use nephroid_math::level::wide_dispatch;

/// `Q ← damping · Q + gain · (H_i − H_n)` for a run of pipes with heads `from` and `to` at their ends.
pub(super) fn accelerate(level: Level, flows: &mut [f64], from: &[f64], to: &[f64], damping: f64, gain: f64) {
    wide_dispatch!(level, simd => wide_accelerate(simd, flows, from, to, damping, gain), plain_accelerate(flows, from, to, damping, gain));
}

#[simd]
fn wide_accelerate<S: Simd>(simd: S, flows: &mut [f64], from: &[f64], to: &[f64], damping: f64, gain: f64) {
    plain_accelerate(flows, from, to, damping, gain);
}

#[inline(always)]
fn plain_accelerate(flows: &mut [f64], from: &[f64], to: &[f64], damping: f64, gain: f64) {
    for (flow, (head, other)) in flows.iter_mut().zip(from.iter().zip(to)) {
        *flow = damping * *flow + gain * (head - other);
    }
}

/// The flows of the pipes of a row of columns, pair by pair: the pipes that a positive flow leaves by and those that it comes in by. All slices
/// have the row's length.
#[derive(Clone, Copy, Debug)]
pub(super) struct RowFlows<'a> {
    pub east: [&'a [f64]; 2],
    pub south: [&'a [f64]; 2],
    pub south_east: [&'a [f64]; 2],
    pub south_west: [&'a [f64]; 2],
}

/// What becomes of a row of columns: slices of its length.
#[derive(Debug)]
pub(super) struct Moved<'a> {
    pub volumes: &'a mut [f64],
    pub inflows: &'a mut [f64],
    pub heads: &'a mut [f64],
}

/// Moves the volumes of a row on by a step, with `scale` heads per volume; whether any column does not hold what leaves it.
pub(super) fn move_volumes(level: Level, flows: RowFlows<'_>, volumes: &[f64], step_s: f64, scale: f64, moved: Moved<'_>) -> bool {
    wide_dispatch!(level, simd => wide_move(simd, flows, volumes, step_s, scale, moved), plain_move(flows, volumes, step_s, scale, moved))
}

#[simd]
fn wide_move<S: Simd>(simd: S, flows: RowFlows<'_>, volumes: &[f64], step_s: f64, scale: f64, moved: Moved<'_>) -> bool {
    plain_move(flows, volumes, step_s, scale, moved)
}

/// A flow if it leaves by this end, else zero.
#[inline(always)]
pub(super) fn out(flow: f64) -> f64 {
    if flow > 0.0 { flow } else { 0.0 }
}

#[inline(always)]
fn plain_move(flows: RowFlows<'_>, volumes: &[f64], step_s: f64, scale: f64, moved: Moved<'_>) -> bool {
    let count = volumes.len();
    let RowFlows { east: [e_out, e_in], south: [s_out, s_in], south_east: [d_out, d_in], south_west: [a_out, a_in] } = flows;
    let (e_out, e_in, s_out, s_in) = (&e_out[..count], &e_in[..count], &s_out[..count], &s_in[..count]);
    let (d_out, d_in, a_out, a_in) = (&d_out[..count], &d_in[..count], &a_out[..count], &a_in[..count]);
    let (next, inflows, heads) = (&mut moved.volumes[..count], &mut moved.inflows[..count], &mut moved.heads[..count]);
    // First what leaves, where the new volumes will be.
    for c in 0..count {
        next[c] = out(e_out[c]) + out(-e_in[c]) + out(s_out[c]) + out(-s_in[c]);
    }
    for c in 0..count {
        next[c] = next[c] + (out(d_out[c]) + out(-d_in[c])) + (out(a_out[c]) + out(-a_in[c]));
    }
    let dry = next.iter().zip(volumes).fold(false, |dry, (total, volume)| dry | (total * step_s > *volume));
    for c in 0..count {
        inflows[c] = (e_in[c] - e_out[c]) + (s_in[c] - s_out[c]);
    }
    for c in 0..count {
        inflows[c] += (d_in[c] - d_out[c]) + (a_in[c] - a_out[c]);
    }
    for c in 0..count {
        next[c] = volumes[c] + step_s * inflows[c];
    }
    for c in 0..count {
        heads[c] = next[c] * scale;
    }
    dry
}

#[cfg(test)]
mod tests {
    use nephroid_math::level::available_levels;
    use nephroid_math::rng::uniform3;

    use super::*;

    #[test]
    fn rows_are_the_same_at_every_level() {
        const COUNT: usize = 133;
        let numbers = |stream: u32| -> Vec<f64> { (0..COUNT as u32).map(|i| f64::from(uniform3(5, stream, i)[0]) - 0.5).collect() };
        let pipes: Vec<Vec<f64>> = (0..8).map(numbers).collect();
        let pair = |k: usize| [&pipes[k][..], &pipes[k + 1][..]];
        let flows = RowFlows { east: pair(0), south: pair(2), south_east: pair(4), south_west: pair(6) };
        let at = |level: Level, least: f64| {
            let volumes: Vec<f64> = numbers(9).into_iter().map(|v| v + least).collect();
            let (mut next, mut inflows, mut heads) = (vec![0.0; COUNT], vec![0.0; COUNT], vec![0.0; COUNT]);
            let moved = Moved { volumes: &mut next, inflows: &mut inflows, heads: &mut heads };
            let dry = move_volumes(level, flows, &volumes, 0.7, 1.3, moved);
            let mut pushed = numbers(10);
            accelerate(level, &mut pushed, &volumes, &next, 0.99, 0.3);
            (dry, [next, inflows, heads, pushed].concat().into_iter().map(f64::to_bits).collect::<Vec<_>>())
        };
        for least in [0.5, 9.0] {
            let expected = at(Level::fallback(), least);
            assert_eq!(expected.0, least < 1.0);
            for (name, level) in available_levels() {
                assert!(at(level, least) == expected, "{name}");
            }
        }
    }
}
