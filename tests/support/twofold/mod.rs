//! `twofold`: the smallest technique there can be. It lights every receiver with its own direct irradiance times two, which no paper asks for,
//! and shows what a technique has to state: this folder, and a line of a table.

mod settings;
mod shaders;

#[cfg(test)]
mod tests;

use glam::Vec4;
use nephroid::caustics::builder::state::clear;
use nephroid::caustics::builder::{Contributions, FrameBuilder, ViewOptions, cut_level};
use nephroid::caustics::{Builder, Feature, Layout, Receivers, RenderError, Technique, TechniqueFrame, layout};
use nephroid::frame::{BindEntry, Draw, Pass};
use nephroid::metrics::bounds::{ACCUMULATED, EXACT, PassBounds, VERTEX};
use nephroid::passes::fullscreen;
use nephroid::pipeline::Device;
use nephroid::pipeline::state::TextureFormat;
use nephroid::scene::{Group, Scene, Settings};

pub use settings::Twofold;
use shaders::TwofoldUniform;

/// The technique, as a line of the table.
pub const TECHNIQUE: &dyn Technique = &TwofoldTechnique;

struct TwofoldTechnique;

impl Technique for TwofoldTechnique {
    fn name(&self) -> &'static str {
        "twofold"
    }
    fn summary(&self) -> &'static str {
        "every receiver lit by its own direct irradiance, times two"
    }
    fn paper(&self) -> &'static str {
        "none: for tests"
    }
    fn settings(&self) -> &'static dyn Settings {
        Twofold::DEFAULTS
    }
    fn covers(&self, _: Feature) -> bool {
        false
    }
    fn bounds(&self) -> &'static [PassBounds] {
        &[PassBounds { pass: "twofold", vertices: VERTEX, textures: &[("", EXACT, ACCUMULATED)] }]
    }
    fn layouts(&self) -> Vec<Layout> {
        vec![layout!(TwofoldUniform: factor)]
    }
    fn prepare(&self, scene: &Scene) -> Result<Box<dyn Builder>, RenderError> {
        let receivers = Receivers::new(scene, cut_level(scene, scene.techniques.get::<Twofold>().eye_refraction))?;
        Ok(Box::new(TwofoldBuilder { receivers }))
    }
}

struct TwofoldBuilder {
    receivers: Receivers,
}

impl Builder for TwofoldBuilder {
    fn frame(&mut self, scene: &Scene, _: &Device, _: &[&str]) -> Result<TechniqueFrame, RenderError> {
        let settings = scene.techniques.get::<Twofold>();
        let view = ViewOptions {
            eye_refraction: settings.eye_refraction,
            samples: settings.samples,
            surface_shadows: true,
            underwater_shadows: true,
            shadow_map_size: settings.shadow_map_size,
            stencil: false,
        };
        let mut builder = FrameBuilder::new(scene, &self.receivers, None, &view);
        builder.lights(|_, _| Ok(()))?;
        let format = TextureFormat::Rgba32Float;
        let irradiance = builder.target("caustic_irradiance", format);
        let uniform = builder.uniform("twofold", &TwofoldUniform { factor: Vec4::splat(settings.factor) });
        let bindings = builder.frame.bind_group(vec![BindEntry::Uniform(uniform, 0), BindEntry::texture(builder.direct)]);
        let pipeline = builder.fullscreen("twofold", shaders::program(), &[format], None);
        builder.frame.passes.push(Pass {
            label: "twofold".into(),
            color: vec![clear(irradiance)],
            draws: vec![Draw::new(pipeline, bindings, fullscreen::VERTICES)],
            ..Pass::default()
        });
        Ok(builder.finish(Contributions::new(irradiance)))
    }
}
