//! Light that media scatter once towards the eye, after it met water, mirrors or glass: photon beams onto pixels.
//!
//! Every straight part of a photon's path through a medium that scatters is a [`Beam`]. The views of a pixel fill a volume, and the pixel receives the
//! light of all parts of beams in it: there is no kernel and no width, so nothing is blurred over more than a pixel, and all of a pixel counts, not only
//! its middle. A beam is followed from pixel to pixel in the picture ([`screen`]); behind the water's surface, where views are refracted, tubes that
//! it may pass are found in a hierarchy ([`tubes`]).
//!
//! What is approximated: surfaces at which views end are flat within a pixel, or within a sixteenth of one at edges ([`looks`]); within a tube, views are
//! bilinear between those through its corners; where the corners of a sixteenth of a pixel took different ways, at silhouettes, the rest of the pixel
//! stands for it. Phase function and attenuation are exact in the middle of the part of a beam in a pixel.

mod beam;
mod columns;
mod hull;
mod looks;
mod screen;
mod tubes;
mod view;

use std::collections::BTreeMap;

use fearless_simd::{Level, Simd, f32x16};
use fearless_simd_macros::simd;
use glam::Vec3;
use rayon::prelude::*;

use nephroid_math::lanes::Lanes;
use nephroid_math::level::wide_dispatch;
use nephroid_scene::Medium;

use super::eye::{Eye, MAX_CROSSINGS};
use super::media::{Place, SmokeBox};

pub(super) use beam::Beam;
pub(super) use columns::MOST_VALUES;
pub(super) use view::{View, passed};

use beam::Lit;
use looks::{Look, Part, Plane, parts_of_row};
use screen::{Crossings, Ends, Screen};
use tubes::{Tube, Tubes};

/// Values that are computed together.
const LANES: usize = 16;

/// Least share of a pixel that its tubes stand for.
const LEAST_SHARE: f32 = 0.2;

/// The media of a scene.
#[derive(Clone, Copy)]
pub(super) struct Media<'a> {
    pub medium: Medium,
    pub smoke: Option<&'a SmokeBox>,
}

impl Media<'_> {
    /// Whether a medium scatters light.
    pub fn scatters(&self, place: Place) -> bool {
        match place {
            Place::Air => self.smoke.is_some_and(SmokeBox::scatters),
            Place::Water => self.medium.sigma_s != Vec3::ZERO,
            Place::Glass(_) => false,
        }
    }
}

/// Sums of radiance by pixel, linear RGB.
pub(super) struct Canvas {
    pub pixels: Vec<[f32; 4]>,
}

impl Canvas {
    /// A picture of zeros.
    pub fn new(pixels: usize) -> Self {
        Self { pixels: vec![[0.0; 4]; pixels] }
    }

    #[inline(always)]
    fn add(&mut self, pixel: u32, [r, g, b]: [f32; 3]) {
        let sum = &mut self.pixels[pixel as usize];
        *sum = [sum[0] + r, sum[1] + g, sum[2] + b, 0.0];
    }
}

/// The views of all pixels.
pub(super) struct Views {
    screen: Screen,
    /// Later straight parts that run through media that scatter, by the way that views took to them.
    tubes: Vec<Tubes>,
    reach: f32,
    /// Pixels that see through the surface of the water, but whose views part so much that none of it is measured.
    pub left_out: u64,
}

impl Views {
    /// Follows the views of all pixels. Neither they, behind the water's surface, nor beams are followed farther than `reach` metres.
    pub fn new(eye: &Eye<'_>, media: Media<'_>, reach: f32) -> Self {
        let rows: Vec<_> = (0..eye.rows())
            .into_par_iter()
            .map(|row| {
                let (mut ends, mut tubes, mut of_pixel, mut left_out) = (Ends::default(), Vec::new(), PixelTubes::default(), 0);
                parts_of_row(eye, row, |column, part| {
                    ends.add(&part);
                    of_pixel.add(&part, (media, reach), row * eye.columns() + column);
                    if part.number + 1 == part.count {
                        left_out += u64::from(of_pixel.is_left_out());
                        std::mem::take(&mut of_pixel).put(&mut tubes);
                    }
                });
                (ends, tubes, left_out)
            })
            .collect();
        let (mut ends, mut ways, mut left_out) = (Vec::new(), BTreeMap::<Way, Vec<Tube>>::new(), 0);
        for (row, tubes, of_row) in rows {
            ends.push(row);
            left_out += of_row;
            for (way, tube) in tubes {
                ways.entry(way).or_default().push(tube);
            }
        }
        let place = |way: &Way| if way.last() == Some(&true) { Place::Water } else { Place::Air };
        let tubes = ways.into_iter().map(|(way, tubes)| Tubes::new(place(&way), tubes, eye.columns())).collect();
        Self { screen: Screen::new(eye, media, ends), tubes, reach, left_out }
    }

    /// Adds the light of beams to the pixels that see them.
    pub fn add(&self, level: Level, beams: &[Beam], media: Media<'_>, canvas: &mut Canvas) {
        wide_dispatch!(level, simd => wide(simd, self, beams, media, canvas), self.add_all::<f32>((), beams, media, canvas));
    }

    #[inline(always)]
    fn add_all<L: Lanes>(&self, token: L::Token, beams: &[Beam], media: Media<'_>, canvas: &mut Canvas) {
        let (mut columns, mut crossings) = (Vec::new(), Crossings::default());
        for &beam in beams {
            let beam = Beam { length: beam.length.min(self.reach), ..beam };
            let lit = Lit::new(beam, media, columns);
            if self.screen.place == beam.place {
                self.screen.add::<L>(token, &lit, &mut crossings, canvas);
            }
            for tubes in &self.tubes {
                if tubes.place == beam.place {
                    tubes.add::<L>(token, &lit, canvas);
                }
            }
            columns = lit.into_columns();
        }
    }
}

#[simd]
fn wide<S: Simd>(simd: S, views: &Views, beams: &[Beam], media: Media<'_>, canvas: &mut Canvas) {
    views.add_all::<f32x16<S>>(simd, beams, media, canvas);
}

/// Whether views were in water, for each of their straight parts.
type Way = Vec<bool>;

/// The tubes of a pixel, and by number of the straight part the share of the pixel whose views part there, so that it has no more tubes.
#[derive(Default)]
struct PixelTubes {
    tubes: Vec<(Way, Tube)>,
    lost: [f32; MAX_CROSSINGS as usize],
}

impl PixelTubes {
    /// Adds the tubes of a part of the pixel: one for every straight part but the first, as far as the views through its corners take the same way.
    fn add(&mut self, part: &Part<'_>, (media, reach): (Media<'_>, f32), pixel: u32) {
        let [first, ..] = part.corners;
        let share = 1.0 / part.count as f32;
        let longest = part.corners.iter().map(|corner| corner.stretches.len()).max().unwrap_or(0);
        for number in 1..longest {
            if !part.corners.iter().all(|corner| first.agrees(corner, number)) {
                let goes_on = |corner: &&Look| corner.stretches.iter().skip(number).any(|stretch| media.scatters(stretch.place));
                self.lost[number] += if part.corners.iter().any(goes_on) { share } else { 0.0 };
                return;
            }
            let stretches = &first.stretches;
            if !media.scatters(stretches[number].place) {
                continue;
            }
            let stretch = |corner: &Look| corner.stretches[number];
            let edges = part.corners.map(|corner| (stretch(corner).origin, stretch(corner).direction));
            let length = part.corners.iter().map(|corner| stretch(corner).length.min(reach)).fold(0.0, f32::max);
            let at_end = if first.agrees(part.middle, number) { part.middle } else { first };
            let passed = part.corners.iter().map(|corner| passed(&corner.stretches, media)[number]).sum::<Vec3>() * 0.25;
            let end = Plane::at_end(&at_end.stretches[number]);
            let way = stretches[..=number].iter().map(|stretch| stretch.place == Place::Water).collect();
            self.tubes.push((way, Tube { edges, length, end, passed, share, pixel, part: part.number }));
        }
    }

    /// Whether so much of the pixel has no more tubes that the rest cannot stand for it.
    fn is_left_out(&self) -> bool {
        1.0 - self.lost.iter().sum::<f32>() < LEAST_SHARE
    }

    /// Moves the tubes to others; they stand for all of the pixel.
    fn put(self, others: &mut Vec<(Way, Tube)>) {
        for (way, tube) in self.tubes {
            let kept = 1.0 - self.lost[..way.len()].iter().sum::<f32>();
            others.push((way, Tube { share: tube.share / kept.max(LEAST_SHARE), ..tube }));
        }
    }
}
