//! Separable filters over 64-bit planes.

use rayon::prelude::*;

use super::pair::Pair;

/// Weights `exp(−i²/(2σ²))` for `i` in `−radius..=radius`, scaled to sum to 1.
pub(super) fn gaussian(sigma_px: f64, radius: usize) -> Vec<f64> {
    let weight = |tap: usize| {
        let distance = tap as f64 - radius as f64;
        libm::exp(-0.5 * distance * distance / (sigma_px * sigma_px))
    };
    let weights: Vec<f64> = (0..=2 * radius).map(weight).collect();
    let sum: f64 = weights.iter().sum();
    weights.iter().map(|weight| weight / sum).collect()
}

/// Correlates every row of a plane with `along_x`, then every column with `along_y`: `out(x, y) = Σᵢⱼ along_x[i]·along_y[j]·in(x+i−rx, y+j−ry)`.
///
/// Both lists have odd lengths, `2·rx + 1` and `2·ry + 1`. Beyond its border the plane is continued by the values at the border.
pub(super) fn separable(plane: &[f64], width: usize, along_x: &[f64], along_y: &[f64]) -> Vec<f64> {
    let height = plane.len() / width;
    let radius = along_x.len() / 2;
    let mut rows = vec![0.0; plane.len()];
    rows.par_chunks_exact_mut(width).zip(plane.par_chunks_exact(width)).for_each(|(out, row)| {
        let mut padded = vec![row[0]; radius];
        padded.extend_from_slice(row);
        padded.resize(width + 2 * radius, row[width - 1]);
        for (tap, weight) in along_x.iter().enumerate() {
            for (out, value) in out.iter_mut().zip(&padded[tap..]) {
                *out += weight * value;
            }
        }
    });
    let radius = along_y.len() / 2;
    let mut filtered = vec![0.0; plane.len()];
    filtered.par_chunks_exact_mut(width).enumerate().for_each(|(y, out)| {
        for (tap, weight) in along_y.iter().enumerate() {
            let from = (y + tap).saturating_sub(radius).min(height - 1);
            for (out, value) in out.iter_mut().zip(&rows[from * width..]) {
                *out += weight * value;
            }
        }
    });
    filtered
}

/// Whether all pixels up to `radius` columns and rows away from each pixel are inside the picture and count.
pub(super) fn surroundings_count(pair: &Pair, radius: usize) -> Vec<bool> {
    let (width, height) = (pair.width() as usize, pair.height() as usize);
    let ignored: Vec<f64> = (0..width * height).map(|index| f64::from(u8::from(!pair.counts(index)))).collect();
    let ones = vec![1.0; 2 * radius + 1];
    let is_inside = |at: usize, size: usize| at >= radius && at + radius < size;
    let ignored = separable(&ignored, width, &ones, &ones);
    (0..width * height).map(|at| ignored[at] == 0.0 && is_inside(at % width, width) && is_inside(at / width, height)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn filters_are_the_double_sum_with_clamped_borders() {
        let (width, height) = (5_usize, 4_usize);
        let plane: Vec<f64> = (0..20).map(|i| f64::from(i * i % 7)).collect();
        let (along_x, along_y) = ([1.0, -2.0, 3.0], [0.5, 0.25, -1.0, 4.0, 2.0]);
        let filtered = separable(&plane, width, &along_x, &along_y);
        for y in 0..height {
            for x in 0..width {
                let mut sum = 0.0;
                for (j, wy) in along_y.iter().enumerate() {
                    for (i, wx) in along_x.iter().enumerate() {
                        let column = (x + i).saturating_sub(1).min(width - 1);
                        let row = (y + j).saturating_sub(2).min(height - 1);
                        sum += wx * wy * plane[row * width + column];
                    }
                }
                assert!((filtered[y * width + x] - sum).abs() < 1.0e-12, "({x}, {y})");
            }
        }
    }

    #[test]
    fn weights_of_a_gaussian_sum_to_one() {
        let weights = gaussian(1.5, 5);
        assert_eq!(weights.len(), 11);
        assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1.0e-15);
        assert!((weights[5] / weights[6] - libm::exp(0.5 / 2.25)).abs() < 1.0e-14);
    }

    #[test]
    fn one_ignored_pixel_spoils_its_surroundings() {
        let mut mask = [true; 49];
        mask[3 * 7 + 3] = false;
        let grey = [[0.5; 3]; 49];
        let good = surroundings_count(&Pair::with_mask(7, 7, &grey, &grey, Some(&mask)).unwrap(), 1);
        assert_eq!(good.iter().filter(|good| **good).count(), 25 - 9);
        assert!(!good[2 * 7 + 2] && good[7 + 1] && !good[0] && !good[48]);
    }
}
