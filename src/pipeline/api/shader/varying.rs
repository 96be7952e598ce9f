//! Varyings: the scalars that one programmable stage passes to the next.

/// How a varying is interpolated over a primitive. WGSL: `@interpolate`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interpolation {
    /// Linear in the world: `Σ bᵢfᵢ/wᵢ / Σ bᵢ/wᵢ`.
    Perspective,
    /// Linear on the screen: `Σ bᵢfᵢ`.
    Linear,
    /// Not interpolated: the value of the provoking vertex, which is the first.
    Flat,
}

/// One varying of a program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Varying {
    /// Name, for captures and the WGSL twin.
    pub name: &'static str,
    /// Scalars, 1 to 4.
    pub components: usize,
    /// How it is interpolated.
    pub interpolation: Interpolation,
}

impl Varying {
    /// Scalars that are interpolated in perspective: linear in the world.
    #[must_use]
    pub const fn perspective(name: &'static str, components: usize) -> Self {
        Self { name, components, interpolation: Interpolation::Perspective }
    }
    /// Scalars that are interpolated linearly on the screen.
    #[must_use]
    pub const fn linear(name: &'static str, components: usize) -> Self {
        Self { name, components, interpolation: Interpolation::Linear }
    }
    /// Scalars of the provoking vertex.
    #[must_use]
    pub const fn flat(name: &'static str, components: usize) -> Self {
        Self { name, components, interpolation: Interpolation::Flat }
    }
}

/// The interpolation of each scalar of some varyings, in order.
#[must_use]
pub fn flatten_varyings(varyings: &[Varying]) -> Vec<Interpolation> {
    varyings.iter().flat_map(|v| std::iter::repeat_n(v.interpolation, v.components)).collect()
}
