//! The SIMD levels of this machine, by name, for tests and reports.
//!
//! A level changes only the speed, never a result (see [`lanes`](super::lanes)). Code that dispatches takes a [`Level`] as an argument, so that a
//! test can choose any level.

use fearless_simd::{Level, Simd, dispatch};

/// Every level this machine can run, scalar first and the fastest last.
///
/// Any target with SIMD has at least two: [`Level::fallback`], which is plain scalar code, is always included. A build with `target-cpu` set has
/// fewer, because the compiler then never uses a level below that processor.
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
    // A build for one particular processor compiles all levels below as that processor's level; each is listed once.
    named.dedup_by_key(|(name, _)| *name);
    named
}

/// Name of a level in lower case: `scalar`, `sse2`, `sse4.2`, `avx2`, `avx512`, `neon` or `simd128`.
#[must_use]
pub fn level_name(level: Level) -> &'static str {
    dispatch!(level, simd => name_of(simd))
}

/// Found from the last path segment of the token's type: there is one type per level.
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

/// The token of the lowest level that every x86-64 processor has.
#[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
#[must_use]
pub fn baseline() -> impl Simd {
    Level::baseline().as_sse2().unwrap_or_else(|| unreachable!("every x86-64 processor has SSE2"))
}

/// Runs large generic code at a level, with fewer copies of it than [`dispatch!`] makes: AVX-512, AVX2 and the target's baseline.
///
/// `wide_dispatch!(level, simd => wide, narrow)` evaluates `wide` with a token if the level has vectors of 8 or more lanes, otherwise `narrow`, which
/// may use `simd` (the baseline's token) or be scalar. Shaders and the tile loop are large, every copy costs build time, and SSE4.2 gains little over
/// SSE2 there. Results are the same in both.
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

/// The levels of this machine for which [`wide_dispatch!`] has machine code of its own, lowest first. Code that runs through the macro needs no test
/// at other levels.
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
