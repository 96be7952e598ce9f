//! Counts and sums of what a frame has drawn.

use nephroid_pipeline::Texture;
use nephroid_pipeline::frame::FrameOutput;

use super::Tally;

/// Values with names.
pub(crate) type Named<T> = Vec<(String, T)>;

/// Counters and audit entries of all tallies: equal names are added up, in the order of their first appearance.
pub(super) fn count(tallies: &[Tally], output: &FrameOutput<'_>) -> (Named<u64>, Named<f64>) {
    let (mut counters, mut audit) = (Vec::new(), Vec::new());
    for tally in tallies {
        let sums = sums(output.texture(tally.fates), output.texture(tally.values), tally.names);
        add(&mut audit, tally.arrived, sums.iter().map(|sum| sum.arrived).sum());
        for (sum, (_, name)) in sums.iter().zip(tally.names) {
            add(&mut counters, name, sum.count);
            add(&mut audit, name, sum.light);
        }
    }
    (counters, audit)
}

/// What the texels of one fate add up to.
#[derive(Clone, Default)]
struct Sum {
    count: u64,
    light: f64,
    arrived: f64,
}

fn sums(fates: &Texture, values: &Texture, names: &[(u32, &str)]) -> Vec<Sum> {
    let (fates, values) = (fates.surface(0, 0), values.surface(0, 0));
    let mut sums = vec![Sum::default(); names.len()];
    for y in 0..fates.height {
        for x in 0..fates.width {
            let fate = fates.get(x, y, 3);
            if let Some(k) = names.iter().position(|(code, _)| *code as f32 == fate) {
                sums[k].count += 1;
                sums[k].light += (0..3).map(|c| f64::from(values.get(x, y, c))).sum::<f64>();
                sums[k].arrived += f64::from(values.get(x, y, 3));
            }
        }
    }
    sums
}

fn add<T: std::ops::AddAssign>(entries: &mut Named<T>, name: &str, value: T) {
    match entries.iter_mut().find(|(known, _)| known == name) {
        Some((_, sum)) => *sum += value,
        None => entries.push((name.to_owned(), value)),
    }
}
