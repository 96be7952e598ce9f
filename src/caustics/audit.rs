//! The energy audit: where the light of a frame goes. One table of entries, [`ENTRIES`], for all techniques: a name means the same in each.
//!
//! Every entry is counted where it happens, by an expression of its own; none is what the others leave. Two sums can therefore be checked:
//!
//! - what comes in is what has an end at the surfaces that bend it, and what is sent on: `light_in = ends there + entered`;
//! - what is carried on is what has an end behind them: `carried = ends behind`.
//!
//! Photons are followed from the first surface to their end, and their technique has neither `entered` nor `carried`: all their ends together are
//! `light_in`. [`imbalance`] is how far the sums are from closing; in single precision that is at most [`CLOSES_TO`].

/// Relative error to which the sums of an audit close: the rounding of shares in single precision, over some dozens of events.
pub const CLOSES_TO: f64 = 1.0e-5;

/// Which sum an entry is part of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// What comes in.
    In,
    /// An end before or at the surfaces that bend the light.
    AtSurface,
    /// What is sent on from there.
    Entered,
    /// What the technique carries on: `entered`, but by a paper's equation.
    Carried,
    /// An end behind the surfaces.
    Behind,
}

macro_rules! entries {
    ($($entry:ident, $name:literal, $part:ident, $meaning:literal;)+) => {
        /// An entry of the audit, W, summed over RGB and all lights.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum Entry {
            $(#[doc = $meaning] $entry),+
        }

        /// All entries in the order in which they are printed: name, the sum that it is part of, meaning.
        pub const ENTRIES: &[(Entry, &str, Part, &str)] = &[$((Entry::$entry, $name, Part::$part, $meaning)),+];
    };
}

entries! {
    LightIn, "light_in", In, "light sent towards water, mirrors and glass that it meets first";
    AbsorbedBefore, "absorbed_before_surface", AtSurface, "absorbed by the water between a light in it and the surface";
    Reflected, "reflected", AtSurface, "reflected by Fresnel's law and not followed";
    TotallyReflected, "totally_reflected", AtSurface, "reflected totally and not followed";
    ByMirrors, "absorbed_by_mirrors", AtSurface, "absorbed by mirrors";
    InGlass, "absorbed_in_glass", AtSurface, "absorbed in glass";
    TurnedAway, "turned_away", AtSurface, "on corners of the water that face away from the light, of triangles that face it";
    GoesAway, "goes_away", AtSurface, "leaves upwards, or for light in the water downwards, where beams are not followed";
    NearlyLevel, "nearly_level", AtSurface, "leaves within a thousandth of level";
    SplitPaths, "split_paths", AtSurface, "of corners whose neighbours in the triangle send no light the same way";
    TooManyEvents, "too_many_events", AtSurface, "still in mirrors and glass after the greatest number of events";
    TooWeak, "too_weak", AtSurface, "less than a thousandth of the light that came in on the ray";
    WrongSide, "wrong_side", AtSurface, "sent to the wrong side of a face by its interpolated normal";
    StaysInGlass, "stays_in_glass", AtSurface, "in glass without a way out that is found";
    OtherPaths, "other_paths", AtSurface, "on rays whose path image space does not follow (exact photons in paper radiometry)";
    Entered, "entered", Entered, "sent on from the surfaces";
    Carried, "carried", Carried, "flux of the beams";
    Shaded, "shaded", Behind, "kept from the water by objects before it";
    Culled, "culled", Behind, "lit, but in beams that are culled as shaded";
    AbsorbedBehind, "absorbed_behind_surface", Behind, "absorbed by the medium behind the water's surface";
    Clamped, "clamped", Behind, "cut off by the end of the beams before it lands";
    Missed, "missed", Behind, "meets no receiver";
    NotFound, "not_found", Behind, "of photons whose search for a receiver has not converged";
    BeyondTheMap, "beyond_the_map", Behind, "lands outside of the caustic map";
    ReachedBottom, "reached_bottom", Behind, "at the end of beams that pass through everything";
    Landed, "landed", Behind, "lands on receivers";
}

/// Watts by entry. An entry that was never counted is not there; one that was counted can be 0.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Audit {
    watts: [Option<f64>; ENTRIES.len()],
}

impl Audit {
    /// An audit in which these entries are counted, all 0.
    #[must_use]
    pub fn of(entries: &[Entry]) -> Self {
        let mut audit = Self::default();
        entries.iter().for_each(|&entry| audit.add(entry, 0.0));
        audit
    }

    /// Adds light to an entry, W.
    pub fn add(&mut self, entry: Entry, watts: f64) {
        *self.watts[entry as usize].get_or_insert(0.0) += watts;
    }

    /// Adds another audit.
    pub fn merge(&mut self, other: &Self) {
        for (sum, more) in self.watts.iter_mut().zip(other.watts) {
            if let Some(more) = more {
                *sum.get_or_insert(0.0) += more;
            }
        }
    }

    /// Names and watts of what was counted, in the order of [`ENTRIES`].
    #[must_use]
    pub fn named(&self) -> Vec<(String, f64)> {
        let counted = ENTRIES.iter().zip(self.watts).filter_map(|(row, watts)| Some((row.1.to_owned(), watts?)));
        counted.collect()
    }
}

/// How far the sums of an audit are from closing, as a share of what they should come to; the greater of both.
#[must_use]
pub fn imbalance(audit: &[(String, f64)]) -> f64 {
    let part = |name: &str| ENTRIES.iter().find(|row| row.1 == name).map(|row| row.2);
    let sum = |wanted: Part| audit.iter().filter(|(name, _)| part(name) == Some(wanted)).map(|(_, watts)| watts).sum::<f64>();
    let off = |whole: f64, parts: f64| (whole - parts).abs() / whole.max(f64::MIN_POSITIVE);
    let has = |wanted: Part| audit.iter().any(|(name, _)| part(name) == Some(wanted));
    let (light_in, ends, behind) = (sum(Part::In), sum(Part::AtSurface), sum(Part::Behind));
    if !has(Part::Entered) {
        return off(light_in, ends + behind);
    }
    off(light_in, ends + sum(Part::Entered)).max(off(sum(Part::Carried), behind))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_are_printed_in_the_order_of_the_table() {
        for (number, (entry, name, ..)) in ENTRIES.iter().enumerate() {
            assert_eq!(*entry as usize, number, "{name}");
        }
        let mut audit = Audit::of(&[Entry::Landed, Entry::LightIn]);
        audit.add(Entry::Landed, 2.0);
        let mut other = Audit::of(&[Entry::Reflected]);
        other.add(Entry::LightIn, 3.0);
        audit.merge(&other);
        assert_eq!(audit.named(), [("light_in", 3.0), ("reflected", 0.0), ("landed", 2.0)].map(|(name, w)| (name.to_owned(), w)));
    }

    #[test]
    fn sums_that_do_not_close_are_told() {
        let audit = |entries: &[(&str, f64)]| entries.iter().map(|(name, w)| ((*name).to_owned(), *w)).collect::<Vec<_>>();
        let photons = [("light_in", 10.0), ("reflected", 2.0), ("missed", 3.0), ("landed", 5.0)];
        assert_eq!(imbalance(&audit(&photons)), 0.0);
        let beams = [("light_in", 10.0), ("reflected", 2.0), ("entered", 8.0), ("carried", 12.0), ("shaded", 3.0), ("landed", 9.0)];
        assert_eq!(imbalance(&audit(&beams)), 0.0);
        for whole in [&photons[..], &beams[..]] {
            for left_out in 0..whole.len() {
                let mut broken = whole.to_vec();
                broken[left_out].1 *= 2.0;
                assert!(imbalance(&audit(&broken)) > 0.1, "{:?}", whole[left_out]);
                broken.remove(left_out);
                assert!(imbalance(&audit(&broken)) > 0.1 || whole[left_out].0 == "entered", "{:?}", whole[left_out]);
            }
        }
    }
}
