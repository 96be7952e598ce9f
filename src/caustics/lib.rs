//! The techniques: each builds frames from a scene. One table, [`TECHNIQUES`], drives the command line, the reports, the docs and the tests.
//!
//! A technique is a folder here and a row of the table; nothing else knows its name. It states its settings as rows ([`nephroid_scene::settings!`]),
//! the kinds of light it draws ([`Feature`]), the variants for tests, its bounds against drivers and the structs it shares with WGSL ([`Technique`]),
//! and it builds frames ([`Builder`]). A program with techniques of its own makes a table of them ([`techniques!`], [`Techniques`]) and passes it to
//! [`RenderOptions`] and to the command line.

pub mod account;
pub mod audit;
pub mod beams;
mod bounds;
pub mod builder;
mod error;
mod features;
mod layers;
pub mod layout;
mod output;
pub mod passes;
pub mod readback;
mod receivers;
mod renderer;
mod surfaces;
mod table;
mod tally;
mod technique;

pub use error::RenderError;
pub use features::Feature;
pub use layout::Layout;
pub use output::{LayerSource, LightMask, Resolve, TechniqueFrame};
pub use receivers::{BODIES_TURNED, ReceiverGroup, Receivers};
pub use renderer::{RenderOptions, Rendered, Renderer};
pub use table::Techniques;
pub use tally::{PhotonTally, Tally};
pub use technique::{Builder, Technique, Variant};

techniques! {
    /// All techniques of the library, the default one first.
    pub const TECHNIQUES = [
        caustic_volumes,
        splatting,
        light_volumes,
    ];
}
