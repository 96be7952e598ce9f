//! What is known only once a frame has run: what has become of its photons and beams, and where the search for what the eye sees has not converged.

use rayon::prelude::*;

use nephroid_pipeline::Texture;
use nephroid_pipeline::frame::{FrameOutput, TextureId};

use super::audit::{Audit, Entry};
use super::beams::BeamTally;

/// Values with names.
pub(crate) type Named<T> = Vec<(String, T)>;

/// Something that the renderer counts once the frame has run.
#[derive(Clone, Debug)]
pub enum Tally {
    /// Photons in textures.
    Photons(PhotonTally),
    /// Beams, which end where a shadow map says that there is a receiver.
    Beams(Box<BeamTally>),
    /// Texels of a texture whose fourth channel is 2 are counted under a name.
    Marked(TextureId, &'static str),
}

/// Texels that carry light, each with a fate.
#[derive(Clone, Debug)]
pub struct PhotonTally {
    /// Texture with the fate of each texel in its fourth channel, a whole number; 0 for texels without light.
    pub fates: TextureId,
    /// Texture of the same size: light at its end, W, linear RGB, and in the fourth channel what came in, summed over RGB.
    pub values: TextureId,
    /// Texture of the same size: light that was lost on the way, W, summed over RGB.
    pub losses: TextureId,
    /// Fates, with their counters and the entries for the light at its end.
    pub ends: &'static [(u32, &'static str, Entry)],
    /// Entries of the four channels of `losses`.
    pub lost_to: [Option<Entry>; 4],
}

/// Counters and audit of all tallies. Counters of equal names are added up, in the order of their first appearance.
pub(super) fn count(tallies: &[Tally], output: &FrameOutput<'_>) -> (Named<u64>, Audit) {
    let (mut counters, mut audit) = (Vec::new(), Audit::default());
    for tally in tallies {
        match tally {
            Tally::Photons(photons) => {
                let sums = photons.sums(output);
                for (&(_, name, _), sum) in photons.ends.iter().zip(&sums.ends) {
                    add(&mut counters, name, sum.count);
                }
                audit.merge(&photons.audit(&sums));
            }
            Tally::Beams(beams) => audit.merge(&beams.audit(output)),
            Tally::Marked(texture, name) => add(&mut counters, name, marked(output.texture(*texture))),
        }
    }
    (counters, audit)
}

/// What the texels of a tally add up to.
struct Sums {
    light_in: f64,
    lost: [f64; 4],
    ends: Vec<Sum>,
}

/// The texels of one fate.
#[derive(Clone, Default)]
struct Sum {
    count: u64,
    light: f64,
}

impl PhotonTally {
    /// Rows are summed in parallel and added up in order: the same bits for any number of threads.
    fn sums(&self, output: &FrameOutput<'_>) -> Sums {
        let [fates, values, losses] = [self.fates, self.values, self.losses].map(|texture| output.texture(texture).surface(0, 0));
        let row = |y: u32| {
            let mut sums = Sums { light_in: 0.0, lost: [0.0; 4], ends: vec![Sum::default(); self.ends.len()] };
            for x in 0..fates.width {
                let fate = fates.get(x, y, 3);
                let Some(k) = self.ends.iter().position(|(code, ..)| *code as f32 == fate) else { continue };
                sums.ends[k].count += 1;
                sums.ends[k].light += (0..3).map(|c| f64::from(values.get(x, y, c))).sum::<f64>();
                sums.light_in += f64::from(values.get(x, y, 3));
                for (c, lost) in sums.lost.iter_mut().enumerate() {
                    *lost += f64::from(losses.get(x, y, c));
                }
            }
            sums
        };
        let rows: Vec<Sums> = (0..fates.height).into_par_iter().map(row).collect();
        let start = Sums { light_in: 0.0, lost: [0.0; 4], ends: vec![Sum::default(); self.ends.len()] };
        rows.iter().fold(start, |mut all, row| {
            all.light_in += row.light_in;
            (0..4).for_each(|c| all.lost[c] += row.lost[c]);
            for (sum, more) in all.ends.iter_mut().zip(&row.ends) {
                sum.count += more.count;
                sum.light += more.light;
            }
            all
        })
    }

    fn audit(&self, sums: &Sums) -> Audit {
        let mut audit = Audit::default();
        audit.add(Entry::LightIn, sums.light_in);
        for (entry, watts) in self.lost_to.iter().zip(sums.lost) {
            if let Some(entry) = entry {
                audit.add(*entry, watts);
            }
        }
        for (&(_, _, entry), sum) in self.ends.iter().zip(&sums.ends) {
            audit.add(entry, sum.light);
        }
        audit
    }
}

/// Number of texels whose fourth channel is 2.
fn marked(texture: &Texture) -> u64 {
    let surface = texture.surface(0, 0);
    let (width, height) = (surface.width, surface.height);
    // Blocks of 4x4 texels; those at the right and at the bottom are larger than what they show.
    let in_block = |x: u32, y: u32| {
        if x + 4 <= width && y + 4 <= height {
            return surface.block(x as usize, y as usize, 3).iter().filter(|&&mark| mark == 2.0).count() as u64;
        }
        let texels = (y..height.min(y + 4)).flat_map(|y| (x..width.min(x + 4)).map(move |x| (x, y)));
        texels.filter(|&(x, y)| surface.get(x, y, 3) == 2.0).count() as u64
    };
    let row = |row: u32| (0..width).step_by(4).map(|x| in_block(x, 4 * row)).sum::<u64>();
    (0..height.div_ceil(4)).into_par_iter().map(row).collect::<Vec<_>>().iter().sum()
}

fn add(counters: &mut Named<u64>, name: &str, value: u64) {
    match counters.iter_mut().find(|(known, _)| known == name) {
        Some((_, sum)) => *sum += value,
        None => counters.push((name.to_owned(), value)),
    }
}
