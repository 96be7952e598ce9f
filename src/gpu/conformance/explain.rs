//! Finds the rule that makes a pixel differ: the rules change from the reference's to a preset's, one group at a time.
//!
//! A pixel in which a driver differs from the software GPU under `REFERENCE` is attributed to the last change of rules that changed the pixel. It is
//! explained if after all changes it has the driver's value.

use serde::Serialize;

use super::drawing::Drawing;
use super::image::{Image, on_software};
use nephroid_pipeline::Device;
use nephroid_pipeline::frame::FrameError;
use nephroid_pipeline::state::RasterRules;

/// Rules after some of the changes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// Name of the last change.
    pub rule: &'static str,
    /// The rules after it.
    pub rules: RasterRules,
}

/// A group of fields: its name, and a function that copies it.
type Change = (&'static str, fn(&mut RasterRules, &RasterRules));

/// Groups of fields, in the order in which the pipeline uses them.
const CHANGES: [Change; 8] = [
    ("sub-pixel bits and viewport arithmetic", |rules, to| {
        rules.subpixel_bits = to.subpixel_bits;
        rules.viewport = to.viewport;
    }),
    ("clip volume", |rules, to| rules.clip_volume = to.clip_volume),
    ("clip arithmetic", |rules, to| rules.clip_arithmetic = to.clip_arithmetic),
    ("line corners", |rules, to| rules.line_corners = to.line_corners),
    ("depth plane", |rules, to| rules.depth_plane = to.depth_plane),
    ("interpolation set-up", |rules, to| rules.setup_from = to.setup_from),
    ("depth as an integer", |rules, to| rules.unorm_depth = to.unorm_depth),
    ("f16 rounding", |rules, to| rules.f16_rounding = to.f16_rounding),
];

/// The steps that lead from `REFERENCE` to other rules.
#[must_use]
pub fn chain(to: &RasterRules) -> Vec<Step> {
    let mut rules = RasterRules::REFERENCE;
    let mut steps = Vec::new();
    for (rule, change) in CHANGES {
        let before = rules;
        change(&mut rules, to);
        if rules != before {
            steps.push(Step { rule, rules });
        }
    }
    debug_assert_eq!(rules, *to, "a field of the rules belongs to no change");
    steps
}

/// Number of pixels attributed to a rule.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct RuleCount {
    /// Name of the rule.
    pub rule: &'static str,
    /// Number of pixels.
    pub pixels: u64,
}

/// Differences between `REFERENCE` and a driver, and their rules.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Explanation {
    /// Number of pixels that differ.
    pub differing: u64,
    /// Explained pixels, by rule.
    pub by_rule: Vec<RuleCount>,
    /// Number of pixels that no rule explains.
    pub unexplained: u64,
}

impl Explanation {
    /// Adds the differing pixels of one drawing. `preset` is the software GPU's image under the driver's rules.
    ///
    /// # Errors
    /// If the drawing is not valid.
    pub fn add(
        &mut self,
        device: &Device,
        drawing: &Drawing,
        steps: &[Step],
        preset: &Image,
        driver: &Image,
        tolerance: f64,
    ) -> Result<(), FrameError> {
        let reference = on_software(device, drawing, RasterRules::REFERENCE)?;
        let places = reference.differing(driver, tolerance);
        if places.is_empty() {
            return Ok(());
        }
        let mut images = vec![reference];
        for step in steps.iter().take(steps.len().saturating_sub(1)) {
            images.push(on_software(device, drawing, step.rules)?);
        }
        self.differing += places.len() as u64;
        for place in places {
            if preset.differs_at(driver, place, tolerance) {
                self.unexplained += 1;
                continue;
            }
            // From the last change of the pixel on, it has the preset's value; before that change it does not.
            let changed = (0..steps.len()).rev().find(|&k| {
                let after = images.get(k + 1).unwrap_or(preset);
                images[k].differs_at(after, place, 0.0)
            });
            match changed {
                Some(k) => self.count(steps[k].rule, 1),
                None => self.unexplained += 1,
            }
        }
        Ok(())
    }

    fn count(&mut self, rule: &'static str, pixels: u64) {
        match self.by_rule.iter_mut().find(|entry| entry.rule == rule) {
            Some(entry) => entry.pixels += pixels,
            None => self.by_rule.push(RuleCount { rule, pixels }),
        }
    }
}
