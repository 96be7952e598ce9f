//! Means and standard errors of measurements.
//!
//! Photons of one batch are spread evenly and therefore not independent; batches are independent. Each texel keeps the sum and the sum of squares of
//! its batches' results, from which mean and standard error follow. All sums are in 64 bits and in a fixed order.

use rayon::prelude::*;

use super::volume::Canvas;

/// The contribution of one photon to a texel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Deposit {
    /// Index of the texel.
    pub texel: u32,
    /// The contribution, linear RGB.
    pub value: [f32; 3],
}

/// Texels that one thread sums at a time: few enough that their sums stay in the cache.
pub(super) const STRIP: usize = 4096;

/// A texel by channel: sum in the current batch, sum over all batches, sum of squares over all batches.
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(super) struct Texel {
    batch: [f64; 3],
    sum: [f64; 3],
    squares: [f64; 3],
}

/// A picture of sums.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Accumulator {
    /// Number of texels along a row.
    pub columns: u32,
    /// Number of rows.
    pub rows: u32,
    texels: Vec<Texel>,
    batches: u64,
}

/// Deposits of one chunk of photons, sorted by strip of texels.
#[derive(Default)]
pub(super) struct Sorted {
    deposits: Vec<Deposit>,
    /// End of each strip's deposits.
    ends: Vec<u32>,
}

impl Sorted {
    /// Sorts deposits by strip. Within a strip their order is kept.
    pub fn new(deposits: &[Deposit], texel_count: usize) -> Self {
        let strips = texel_count.div_ceil(STRIP);
        let mut ends = vec![0_u32; strips];
        for deposit in deposits {
            ends[deposit.texel as usize / STRIP] += 1;
        }
        let mut start = 0;
        let mut next: Vec<u32> = ends
            .iter_mut()
            .map(|end| {
                let first = start;
                start += *end;
                *end = start;
                first
            })
            .collect();
        let mut sorted = vec![Deposit { texel: 0, value: [0.0; 3] }; deposits.len()];
        for deposit in deposits {
            let place = &mut next[deposit.texel as usize / STRIP];
            sorted[*place as usize] = *deposit;
            *place += 1;
        }
        Self { deposits: sorted, ends }
    }

    fn strip(&self, strip: usize) -> &[Deposit] {
        let start = if strip == 0 { 0 } else { self.ends[strip - 1] };
        &self.deposits[start as usize..self.ends[strip] as usize]
    }
}

impl Accumulator {
    /// A picture of zeros.
    pub fn new(columns: u32, rows: u32) -> Self {
        Self { columns, rows, texels: vec![Texel::default(); columns as usize * rows as usize], batches: 0 }
    }

    /// Number of texels.
    pub fn len(&self) -> usize {
        self.texels.len()
    }

    /// Adds deposits to the current batch, chunk by chunk. Strips of texels are processed in parallel.
    pub fn add(&mut self, chunks: &[&Sorted]) {
        self.texels.par_chunks_mut(STRIP).enumerate().for_each(|(strip, texels)| {
            for chunk in chunks {
                for deposit in chunk.strip(strip) {
                    let texel = &mut texels[deposit.texel as usize % STRIP];
                    for (sum, value) in texel.batch.iter_mut().zip(deposit.value) {
                        *sum += f64::from(value);
                    }
                }
            }
        });
    }

    /// Adds values, each with the index of its texel, to the current batch.
    pub fn add_values(&mut self, values: impl IntoIterator<Item = (u32, [f64; 3])>) {
        for (index, value) in values {
            for (sum, value) in self.texels[index as usize].batch.iter_mut().zip(value) {
                *sum += value;
            }
        }
    }

    /// Adds pictures to the current batch, one after the other.
    pub fn add_pictures(&mut self, pictures: &[Canvas]) {
        self.texels.par_iter_mut().enumerate().with_min_len(STRIP).for_each(|(index, texel)| {
            for picture in pictures {
                for (sum, value) in texel.batch.iter_mut().zip(picture.pixels[index]) {
                    *sum += f64::from(value);
                }
            }
        });
    }

    /// Forgets the current batch.
    pub fn drop_batch(&mut self) {
        self.texels.par_iter_mut().with_min_len(STRIP).for_each(|texel| texel.batch = [0.0; 3]);
    }

    /// Ends the current batch.
    pub fn end_batch(&mut self) {
        self.batches += 1;
        self.texels.par_iter_mut().with_min_len(STRIP).for_each(|texel| {
            for c in 0..3 {
                let batch = texel.batch[c];
                texel.sum[c] += batch;
                texel.squares[c] += batch * batch;
            }
            texel.batch = [0.0; 3];
        });
    }

    /// Mean and standard error of a texel, multiplied by `scale`. The error is infinite before the second batch.
    fn measure(&self, index: usize, scale: f64) -> ([f64; 3], [f64; 3]) {
        let texel = &self.texels[index];
        let n = self.batches as f64;
        let mean = texel.sum.map(|sum| if n > 0.0 { sum / n } else { 0.0 });
        let error = std::array::from_fn(|c| {
            if self.batches < 2 {
                return f64::INFINITY;
            }
            let variance = ((texel.squares[c] - n * mean[c] * mean[c]) / (n - 1.0)).max(0.0);
            (variance / n).sqrt() * scale
        });
        (mean.map(|m| m * scale), error)
    }

    /// Means and standard errors of all texels, each multiplied by its `scale`.
    pub fn measured(&self, scale: impl Fn(usize) -> f64) -> Measured {
        let (mean, standard_error) = (0..self.len()).map(|index| self.measure(index, scale(index))).unzip();
        Measured { columns: self.columns, rows: self.rows, mean, standard_error, valid: None }
    }

    /// Relative noise: root mean square of the standard errors over the mean of the means, in the brightest channel, over the `count` texels that
    /// measure anything.
    pub fn noise(&self, count: usize) -> f64 {
        let mut totals = [[0.0_f64; 2]; 3];
        for index in 0..self.len() {
            let (mean, error) = self.measure(index, 1.0);
            for c in 0..3 {
                totals[c][0] += mean[c];
                totals[c][1] += error[c] * error[c];
            }
        }
        let count = count as f64;
        let brightest = totals.iter().fold([0.0, f64::INFINITY], |best: [f64; 2], total| if total[0] > best[0] { *total } else { best });
        if brightest[0] > 0.0 { (brightest[1] / count).sqrt() / (brightest[0] / count) } else { f64::INFINITY }
    }

    /// The sums as bytes, and the number of batches.
    pub fn state(&self) -> (&[u8], u64) {
        (bytemuck::cast_slice(&self.texels), self.batches)
    }

    /// Restores saved sums; `None` if they have another size.
    pub fn restore(&mut self, bytes: &[u8], batches: u64) -> Option<()> {
        let size = size_of::<Texel>();
        if bytes.len() != size * self.texels.len() {
            return None;
        }
        for (texel, bytes) in self.texels.iter_mut().zip(bytes.chunks_exact(size)) {
            *texel = bytemuck::pod_read_unaligned(bytes);
        }
        self.batches = batches;
        Some(())
    }
}

/// A rectangle of measurements with their errors.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured {
    /// Number of texels or pixels along a row.
    pub columns: u32,
    /// Number of rows.
    pub rows: u32,
    /// Means, row by row, linear RGB.
    pub mean: Vec<[f64; 3]>,
    /// Standard errors of the means; infinite before the second batch.
    pub standard_error: Vec<[f64; 3]>,
    /// Whether each texel measures anything; `None` if all do.
    pub valid: Option<Vec<bool>>,
}

impl Measured {
    fn index(&self, column: u32, row: u32) -> usize {
        assert!(column < self.columns && row < self.rows, "({column}, {row}) of {} x {}", self.columns, self.rows);
        row as usize * self.columns as usize + column as usize
    }

    /// Mean of a texel. Panics outside of the rectangle.
    #[must_use]
    pub fn mean(&self, column: u32, row: u32) -> [f64; 3] {
        self.mean[self.index(column, row)]
    }

    /// Standard error of a texel's mean. Panics outside of the rectangle.
    #[must_use]
    pub fn standard_error(&self, column: u32, row: u32) -> [f64; 3] {
        self.standard_error[self.index(column, row)]
    }

    /// Whether a texel measures anything. Panics outside of the rectangle.
    #[must_use]
    pub fn is_valid(&self, column: u32, row: u32) -> bool {
        let index = self.index(column, row);
        self.valid.as_ref().is_none_or(|valid| valid[index])
    }
}
