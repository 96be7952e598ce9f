//! Structural similarity.

use super::filter::{gaussian, separable, surroundings_count};
use super::pair::{MetricError, Pair};

/// Pixels of the window on each side of its centre: the window has 11x11 [WBSS04 §III.B].
const RADIUS: usize = 5;
/// Standard deviation of the window's weights, in pixels.
const SIGMA_PX: f64 = 1.5;
/// `(K₁·L)²` with `K₁ = 0.01` and the range `L = 1`.
const C1: f64 = 0.01 * 0.01;
/// `(K₂·L)²` with `K₂ = 0.03`.
const C2: f64 = 0.03 * 0.03;

/// Structural similarity (Wang, Bovik, Sheikh & Simoncelli, IEEE TIP 13(4), 2004): 1 for equal pictures, about 0 for unrelated ones, at least −1.
///
/// ```text
/// SSIM = (2·μ_x·μ_r + C₁)·(2·σ_xr + C₂) / ((μ_x² + μ_r² + C₁)·(σ_x² + σ_r² + C₂))     [WBSS04 eq. 13]
/// ```
/// with means, variances and covariance weighted by a Gaussian of 11x11 pixels with σ = 1.5 that sums to 1; averaged over windows and channels.
/// Values lie in `0..=1`: tone-map first, and state how. As in the authors' program, only windows inside the picture count, so the 5 outermost pixels
/// are not centres; with a mask, all pixels of a window must count. Without a mask the result is that of scikit-image's `structural_similarity` with
/// `gaussian_weights`, `sigma = 1.5`, `use_sample_covariance = False` and `data_range = 1`, to 1e-12.
///
/// # Errors
/// If a value lies outside `0..=1`, or no window counts.
pub fn ssim(pair: &Pair) -> Result<f64, MetricError> {
    for (list, pixels) in [("reference", pair.reference()), ("test", pair.test())] {
        let allowed = "structural similarity needs values in 0..=1, so tone-map first";
        pair.check_values(list, pixels, |value| (0.0..=1.0).contains(&value), allowed)?;
    }
    let width = pair.width() as usize;
    let whole = surroundings_count(pair, RADIUS);
    let centres: Vec<usize> = (0..whole.len()).filter(|&index| whole[index]).collect();
    if centres.is_empty() {
        return Err(MetricError::NoWindow { side: 2 * RADIUS + 1 });
    }

    let weights = gaussian(SIGMA_PX, RADIUS);
    let mut sum = 0.0;
    for channel in 0..3 {
        // Pixels that do not count are in no window, and may be NaN.
        let plane = |f: fn(f64, f64) -> f64| {
            let value = |index: usize| f(f64::from(pair.test()[index][channel]), f64::from(pair.reference()[index][channel]));
            let values: Vec<f64> = (0..whole.len()).map(|index| if pair.counts(index) { value(index) } else { 0.0 }).collect();
            separable(&values, width, &weights, &weights)
        };
        let (mean_x, mean_r) = (plane(|x, _| x), plane(|_, r| r));
        let (square_x, square_r, product) = (plane(|x, _| x * x), plane(|_, r| r * r), plane(|x, r| x * r));
        for &at in &centres {
            let (x, r) = (mean_x[at], mean_r[at]);
            let (variance_x, variance_r, covariance) = (square_x[at] - x * x, square_r[at] - r * r, product[at] - x * r);
            sum += (2.0 * x * r + C1) * (2.0 * covariance + C2) / ((x * x + r * r + C1) * (variance_x + variance_r + C2));
        }
    }
    Ok(sum / (3.0 * centres.len() as f64))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nephroid_math::rng::uniform3;

    const WIDTH: u32 = 24;
    const HEIGHT: u32 = 17;

    /// Waves with a different phase in each channel, in 0.1..=0.9.
    fn waves() -> Vec<[f32; 3]> {
        let value =
            |i: u32, channel: u32| 0.5 + 0.4 * libm::sin(0.7 * f64::from(i % WIDTH) + 0.4 * f64::from(i / WIDTH) + f64::from(channel));
        (0..WIDTH * HEIGHT).map(|i| [0, 1, 2].map(|channel| value(i, channel) as f32)).collect()
    }

    fn with_noise(pixels: &[[f32; 3]], strength: f32) -> Vec<[f32; 3]> {
        let noise = |i: usize| uniform3(9, 0, i as u32).map(|u| strength * (u - 0.5));
        (0..pixels.len()).map(|i| [0, 1, 2].map(|channel| (pixels[i][channel] + noise(i)[channel]).clamp(0.0, 1.0))).collect()
    }

    fn measure(reference: &[[f32; 3]], test: &[[f32; 3]]) -> f64 {
        ssim(&Pair::new(WIDTH, HEIGHT, reference, test).unwrap()).unwrap()
    }

    #[test]
    fn equal_pictures_are_wholly_similar() {
        assert!((measure(&waves(), &waves()) - 1.0).abs() < 1.0e-12);
    }

    #[test]
    fn constant_pictures_follow_the_formula() {
        // Without variance the second factor is 1.
        let (a, b) = (0.25_f32, 0.75_f32);
        let expected = (2.0 * 0.1875 + C1) / (0.0625 + 0.5625 + C1);
        assert!((measure(&vec![[a; 3]; 408], &vec![[b; 3]; 408]) - expected).abs() < 1.0e-12);
    }

    #[test]
    fn one_window_is_the_sum_written_out() {
        let (reference, test) = (waves(), with_noise(&waves(), 0.5));
        let cut = |pixels: &[[f32; 3]]| -> Vec<[f32; 3]> { (0..121).map(|i| pixels[(i / 11 + 2) * WIDTH as usize + i % 11 + 3]).collect() };
        let (reference, test) = (cut(&reference), cut(&test));
        let mut expected = 0.0;
        for channel in 0..3 {
            let (mut total, mut sums) = (0.0, [0.0; 5]);
            for i in 0..121_usize {
                let (dx, dy) = ((i % 11) as f64 - 5.0, (i / 11) as f64 - 5.0);
                let weight = libm::exp(-(dx * dx + dy * dy) / 4.5);
                let (x, r) = (f64::from(test[i][channel]), f64::from(reference[i][channel]));
                total += weight;
                for (sum, value) in sums.iter_mut().zip([x, r, x * x, r * r, x * r]) {
                    *sum += weight * value;
                }
            }
            let [x, r, xx, rr, xr] = sums.map(|sum| sum / total);
            expected += (2.0 * x * r + 1.0e-4) * (2.0 * (xr - x * r) + 9.0e-4)
                / ((x * x + r * r + 1.0e-4) * (xx - x * x + rr - r * r + 9.0e-4))
                / 3.0;
        }
        let seen = ssim(&Pair::new(11, 11, &reference, &test).unwrap()).unwrap();
        assert!((seen - expected).abs() < 1.0e-12, "{seen} instead of {expected}");
    }

    #[test]
    fn what_differs_is_less_similar() {
        let reference = waves();
        let weak = measure(&reference, &with_noise(&reference, 0.1));
        let strong = measure(&reference, &with_noise(&reference, 0.6));
        assert!(weak < 0.999 && strong < weak - 0.05, "{weak} {strong}");
        let swapped: Vec<[f32; 3]> = reference.iter().map(|p| [p[1], p[0], p[2]]).collect();
        let mut channel = reference.clone();
        channel.iter_mut().for_each(|p| p[2] *= 0.9);
        let mut moved = reference.clone();
        moved.rotate_right(1);
        let mut pixel = reference.clone();
        pixel.swap(8 * WIDTH as usize + 12, 8 * WIDTH as usize + 14);
        for (name, test) in [("swapped", swapped), ("channel", channel), ("moved", moved), ("pixel", pixel)] {
            let seen = measure(&reference, &test);
            assert!(seen < 0.9995, "{name}: {seen}");
        }
    }

    #[test]
    fn windows_keep_clear_of_the_border_and_of_what_does_not_count() {
        let reference = waves();
        let mut test = reference.clone();
        test[12] = [1.0, 0.0, 1.0];
        assert!(measure(&reference, &test) < 1.0 - 1.0e-6);
        let mut mask = vec![true; test.len()];
        mask[12] = false;
        test[12] = [f32::NAN; 3];
        let masked = Pair::with_mask(WIDTH, HEIGHT, &reference, &test, Some(&mask)).unwrap();
        assert!((ssim(&masked).unwrap() - 1.0).abs() < 1.0e-12);
        let mut rows = vec![false; test.len()];
        rows[..10 * WIDTH as usize].fill(true);
        rows[12] = false;
        let too_few = Pair::with_mask(WIDTH, HEIGHT, &reference, &test, Some(&rows)).unwrap();
        assert_eq!(ssim(&too_few), Err(MetricError::NoWindow { side: 11 }));
    }

    #[test]
    fn values_out_of_range_and_small_pictures_are_refused() {
        let grey = [[0.5; 3]; 110];
        assert_eq!(ssim(&Pair::new(11, 10, &grey, &grey).unwrap()), Err(MetricError::NoWindow { side: 11 }));
        for value in [-0.001, 1.001] {
            let mut test = waves();
            test[3][1] = value;
            let reference = waves();
            let error = ssim(&Pair::new(WIDTH, HEIGHT, &reference, &test).unwrap()).unwrap_err();
            assert!(matches!(error, MetricError::BadValue { list: "test", x: 3, y: 0, channel: 1, .. }), "{error}");
        }
    }
}
