//! The SIMD levels of this machine, by name: what tests iterate over and reports print.
//!
//! A level never changes a result, only its speed (see [`lanes`](super::lanes)); whoever dispatches takes a
//! [`Level`] as an argument so that a test can ask for any of them.

use fearless_simd::{Level, Simd, dispatch};

/// Every level this machine can run, scalar first and the fastest last.
///
/// At least two entries on any target with SIMD: [`Level::fallback`], which is plain scalar code, is always included. A build with `target-cpu`
/// set has fewer, because the compiler then never goes below that processor.
#[must_use]
pub fn available_levels() -> Vec<(&'static str, Level)> {
    let best = Level::new();
    let mut levels = vec![Level::fallback()];
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    {
        levels.extend(best.as_sse2().map(Simd::level));
        levels.extend(best.as_sse4_2().map(Simd::level));
        levels.extend(best.as_avx2().map(Simd::level));
        levels.extend(best.as_avx512().map(Simd::level));
    }
    #[cfg(not(any(target_arch = "x86", target_arch = "x86_64")))]
    if !best.is_fallback() {
        levels.push(best);
    }
    let mut named: Vec<_> = levels.into_iter().map(|level| (level_name(level), level)).collect();
    // A build for one particular processor runs the levels below its own as its own: each is listed once.
    named.dedup_by_key(|(name, _)| *name);
    named
}

/// Name of a level in lower case: `scalar`, `sse2`, `sse4.2`, `avx2`, `avx512`, `neon` or `simd128`.
#[must_use]
pub fn level_name(level: Level) -> &'static str {
    dispatch!(level, simd => name_of(simd))
}

/// The last path segment of the token's type decides: the tokens have one type per level.
#[inline(always)]
fn name_of<S: Simd>(_simd: S) -> &'static str {
    let type_name = std::any::type_name::<S>();
    match type_name.rsplit("::").next().unwrap_or(type_name) {
        "Fallback" => "scalar",
        "Sse2" => "sse2",
        "Sse4_2" => "sse4.2",
        "Avx2" => "avx2",
        "Avx512" => "avx512",
        "Neon" => "neon",
        "WasmSimd128" => "simd128",
        _ => "unknown",
    }
}

/// The token of the least level that every x86-64 processor has.
#[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
#[must_use]
pub fn baseline() -> impl Simd {
    Level::baseline().as_sse2().unwrap_or_else(|| unreachable!("every x86-64 processor has SSE2"))
}

/// Runs large generic code at a level, with fewer copies of it than [`dispatch!`] makes: AVX-512, AVX2 and the target's baseline.
///
/// `wide_dispatch!(level, simd => wide, narrow)`: `wide` is evaluated with a token where the level has vectors of 8 or more
/// lanes, else `narrow`, which may name `simd` again (the baseline's token) or be scalar. Shaders and the tile loop are
/// large, every copy costs build time, and SSE4.2 gains little over SSE2 there. Results do not depend on it.
#[macro_export]
#[doc(hidden)]
macro_rules! wide_dispatch {
    ($level:expr, $simd:ident => $wide:expr, $narrow:expr) => {{
        let level: fearless_simd::Level = $level;
        #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
        {
            if let Some($simd) = level.as_avx512() {
                $wide
            } else if let Some($simd) = level.as_avx2() {
                $wide
            } else {
                $narrow
            }
        }
        #[cfg(not(any(target_arch = "x86", target_arch = "x86_64")))]
        fearless_simd::dispatch!(level, $simd => $wide)
    }};
}
pub use wide_dispatch;

/// The levels of this machine for which [`wide_dispatch!`] has machine code of its own, lowest first: what runs through it needs no test at
/// any other.
#[must_use]
pub fn wide_levels() -> Vec<(&'static str, Level)> {
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    let own_code = |level: Level| level.as_avx512().is_some() || level.as_avx2().is_some();
    #[cfg(not(any(target_arch = "x86", target_arch = "x86_64")))]
    let own_code = |_: Level| true;
    let levels = available_levels();
    let narrow = levels.iter().rposition(|(_, level)| !own_code(*level));
    levels.into_iter().skip(narrow.unwrap_or(0)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wide_levels_are_one_narrow_level_and_all_wide_ones() {
        let wide: Vec<_> = wide_levels().into_iter().map(|(name, _)| name).collect();
        let all: Vec<_> = available_levels().into_iter().map(|(name, _)| name).collect();
        assert!(all.ends_with(&wide) && !wide.is_empty(), "{wide:?} of {all:?}");
        for (name, level) in available_levels() {
            let copy = wide_dispatch!(level, simd => name_of(simd), "narrow");
            assert_eq!(copy == "narrow", wide[0] == name || !wide.contains(&name), "{name}");
        }
    }

    #[test]
    fn levels_start_scalar_and_end_with_the_best() {
        let levels = available_levels();
        assert_eq!(levels[0].0, "scalar");
        assert_eq!(levels.last().map(|l| l.0), Some(level_name(Level::new())));
    }

    #[test]
    fn levels_have_distinct_known_names() {
        let levels = available_levels();
        for (i, (name, level)) in levels.iter().enumerate() {
            assert_ne!(*name, "unknown");
            assert_eq!(*name, level_name(*level));
            assert!(levels[..i].iter().all(|(other, _)| other != name), "{name} is listed twice");
        }
    }
}
