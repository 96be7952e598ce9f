//! Settings that are one of a few names.

use crate::keys::value::Value;

/// An enum whose variants are names alone, made by [`choices!`](crate::choices).
pub trait Choice: Copy + PartialEq + Send + Sync + 'static {
    /// The variants' names as scene files spell them, such as `FlatWater`.
    const NAMES: &'static [&'static str];
    /// The variants, in the same order.
    const ALL: &'static [Self];
}

/// Declares an enum that settings can have as their type: see [`Choice`]. On the command line `FlatWater` is spelled `flat_water`.
#[macro_export]
macro_rules! choices {
    ($(#[$meta:meta])* $vis:vis enum $name:ident { $($(#[$about:meta])* $variant:ident),+ $(,)? }) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        $vis enum $name { $($(#[$about])* $variant),+ }

        impl $crate::Choice for $name {
            const NAMES: &'static [&'static str] = &[$(stringify!($variant)),+];
            const ALL: &'static [Self] = &[$(Self::$variant),+];
        }
    };
}

/// The name of a choice as scene files spell it.
pub(super) fn name<C: Choice>(choice: C) -> &'static str {
    C::ALL.iter().zip(C::NAMES).find(|(variant, _)| **variant == choice).map_or("", |(_, name)| name)
}

/// `FlatWater` as `flat_water`.
pub(super) fn on_command_line(name: &str) -> String {
    let mut text = String::new();
    for c in name.chars() {
        if c.is_uppercase() && !text.is_empty() {
            text.push('_');
        }
        text.extend(c.to_lowercase());
    }
    text
}

impl<C: Choice> Value for C {
    /// The name in any case, with or without `-` and `_`.
    fn read(text: &str) -> Option<Self> {
        let text: String = text.chars().filter(|c| !matches!(c, '-' | '_')).collect();
        C::ALL.iter().zip(C::NAMES).find(|(_, name)| name.eq_ignore_ascii_case(&text)).map(|(variant, _)| *variant)
    }

    fn write(&self) -> String {
        on_command_line(name(*self))
    }
}
