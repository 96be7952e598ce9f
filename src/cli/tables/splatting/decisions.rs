//! What each decision that the paper leaves open changes. E1 is nothing in air; E3 is in the table of errors.

use std::fmt::Write as _;

use anyhow::Context as _;
use glam::Vec3;
use serde::Serialize;

use crate::caustics::splatting::hits::{Hits, exact_hits};
use crate::caustics::splatting::splats::{FALLOFF, LEAST_DIAMETER_TX, MOST_DIAMETER_TX};
use crate::caustics::splatting::{Splats, Splatting};
use crate::caustics::{Rendered, Techniques};
use crate::cli::output;
use crate::cli::progress::Progress;
use crate::cli::tables::LowArgs;
use crate::image::LayerSet;
use crate::math::vector::v3;
use crate::scene::{Radiometry, Scene};

use super::shipped;

/// Code of photons that have landed, in the fourth channel of their positions.
const LANDED: f32 = 1.0;

/// Positions along an axis between two texels at which a splat's sum is taken.
const POSITIONS: u32 = 50;

/// The effects in a scene, with splats by the lens.
#[derive(Serialize)]
struct Effects {
    scene: &'static str,
    /// E2: shares of the light in splats that the least and the greatest diameter change.
    widened: f64,
    narrowed: f64,
    /// E4: light over that of the photons, if splats had the height of one of light that is not bent, whatever their size.
    of_equal_height: f64,
    /// E6: mean difference of pictures with and without colours in splats of four sizes, over the mean.
    without_colours: f64,
    /// E7: light over that of the photons, if the cosine were that of the photon's own direction; and the root of the mean squared change.
    by_own_cosine: f64,
    own_cosine_rms: f64,
    /// E8: light that lands without losses, over light that lands.
    without_losses: f64,
}

/// Measures and prints the effects.
///
/// # Errors
/// If a scene cannot be loaded or rendered, or stdout cannot be written to.
pub fn run(low: &LowArgs, techniques: Techniques) -> anyhow::Result<()> {
    let scenes = shipped::load_all(techniques, &low.scenes)?;
    let progress = Progress::new(scenes.len() as u64);
    let mut all = Vec::new();
    for &(name, ref scene) in &scenes {
        progress.step(name);
        all.push(effects(name, scene)?);
        progress.done();
    }
    drop(progress);
    if low.json {
        output::json(&all)?
    } else {
        output::text(&report(&all))?
    }
    Ok(())
}

/// Sums over the photons of a scene, in watts summed over RGB.
#[derive(Default)]
struct Sums {
    all: f64,
    widened: f64,
    narrowed: f64,
    equal_height: f64,
    own_cosine: f64,
    own_cosine_squares: f64,
}

fn effects(name: &'static str, scene: &Scene) -> anyhow::Result<Effects> {
    let settings = Splatting { splats: Splats::Lens, ..*scene.techniques.get::<Splatting>() };
    let lens = shipped::with(scene, settings);
    let lights = exact_hits(&lens)?;
    let mut names = Vec::new();
    for k in (0..lights.len()).filter(|&k| lights[k].is_some()) {
        names.extend(["position", "direction", "flux"].map(|part| format!("photons {k}/photon_{part} {k}")));
        names.push(format!("light_buffer receivers {k}/light_buffer receivers {k} normal"));
    }
    let rendered = shipped::render(&lens, &names.iter().map(String::as_str).collect::<Vec<_>>())?;
    let mut sums = Sums::default();
    for (hits, names) in lights.iter().flatten().zip(names.chunks(4)) {
        add(&mut sums, hits, &rendered.layers, names, settings.splat_size)?;
    }
    let of = |change: &dyn Fn(&mut Splatting)| {
        let mut changed = settings;
        change(&mut changed);
        shipped::render(&shipped::with(scene, changed), &["caustic_irradiance"])
    };
    let (with, without) = (of(&|s| s.splats = Splats::Sizes)?, of(&|s| (s.splats, s.size_colours) = (Splats::Sizes, false))?);
    let (physical, paper) = (of(&|_| ())?, of(&|s| s.radiometry = Radiometry::Paper)?);
    let all = sums.all.max(f64::MIN_POSITIVE);
    Ok(Effects {
        scene: name,
        widened: sums.widened / all,
        narrowed: sums.narrowed / all,
        of_equal_height: sums.equal_height / all,
        without_colours: difference(&with, &without)?,
        by_own_cosine: sums.own_cosine / all,
        own_cosine_rms: (sums.own_cosine_squares / all).sqrt(),
        without_losses: landed(&paper)? / landed(&physical)?,
    })
}

/// Adds the photons of a light.
fn add(sums: &mut Sums, hits: &Hits, layers: &LayerSet, names: &[String], splat_size: f32) -> anyhow::Result<()> {
    let layer = |k: usize| layers.get(&names[k].replace(' ', "_")).context("the frame has no photons");
    let (position, direction, flux, normal) = (layer(0)?, layer(1)?, layer(2)?, layer(3)?);
    let normals = normal.rgb();
    let beams = direction.planes()[3].pixels();
    let photons = position.rgb().into_iter().zip(direction.rgb()).zip(flux.rgb()).zip(&hits.texels);
    for (k, (((p, d), flux), hit)) in photons.enumerate() {
        if hit.is_none() || position.planes()[3].pixels()[k] != LANDED {
            continue;
        }
        let light: f64 = flux.iter().map(|&watts| f64::from(watts)).sum();
        let at = v3(p[0], p[1], p[2]);
        let diameter_tx = splat_size * beams[k] / hits.map.area_at(at).sqrt();
        // Light that is not bent spreads from the view to the receiver as both views' texels do.
        let unbent_tx = splat_size * (hits.photons.area_at(at) / hits.map.area_at(at)).sqrt();
        let bounded = |tx: f32| f64::from(tx.clamp(LEAST_DIAMETER_TX, MOST_DIAMETER_TX));
        let stretch = bounded(diameter_tx) / bounded(unbent_tx);
        sums.all += light;
        sums.widened += if diameter_tx < LEAST_DIAMETER_TX { light } else { 0.0 };
        sums.narrowed += if diameter_tx > MOST_DIAMETER_TX { light } else { 0.0 };
        sums.equal_height += light * stretch * stretch;
        let texel = hits.map.texel_at(at);
        let index = texel.y as usize * normal.width() as usize + texel.x as usize;
        let n = normals.get(index).map_or(Vec3::ZERO, |&n| Vec3::from_array(n));
        let l = hits.map.view.direction_at(at);
        let ratio = f64::from(Vec3::from_array(d).dot(n) / Vec3::new(l.x, l.y, l.z).dot(n));
        if ratio.is_finite() {
            sums.own_cosine += light * ratio;
            sums.own_cosine_squares += light * (ratio - 1.0) * (ratio - 1.0);
        } else {
            sums.own_cosine += light;
        }
    }
    Ok(())
}

/// Mean absolute difference of two pictures over the mean of the first.
fn difference(a: &Rendered, b: &Rendered) -> anyhow::Result<f64> {
    let rgb = |of: &Rendered| Ok::<_, anyhow::Error>(of.layers.get("caustic_irradiance").context("no caustics")?.rgb());
    let (a, b) = (rgb(a)?, rgb(b)?);
    let (mut off, mut sum) = (0.0, 0.0);
    for (a, b) in a.iter().flatten().zip(b.iter().flatten()) {
        off += f64::from((a - b).abs());
        sum += f64::from(*a);
    }
    Ok(off / sum)
}

fn landed(rendered: &Rendered) -> anyhow::Result<f64> {
    Ok(rendered.audit.iter().find(|(name, _)| name == "landed").context("no audit")?.1)
}

/// Least and greatest sum of a splat over texels, by where it lies between them. `share`: of a texel, by its offset from the middle.
fn sums_of(radius_tx: f64, share: &dyn Fn(f64, f64) -> f64) -> (f64, f64) {
    let reach = radius_tx.ceil() as i32 + 1;
    let (mut least, mut most) = (f64::INFINITY, 0.0_f64);
    for (ix, iy) in (0..POSITIONS).flat_map(|y| (0..POSITIONS).map(move |x| (x, y))) {
        // Away from positions at which texels lie on the very edge of a splat.
        let at = |i: u32| (f64::from(i) + 0.5) / f64::from(POSITIONS);
        let texels = (-reach..=reach).flat_map(|y| (-reach..=reach).map(move |x| (f64::from(x), f64::from(y))));
        let sum: f64 = texels.map(|(x, y)| share(x - at(ix), y - at(iy))).sum();
        (least, most) = (least.min(sum), most.max(sum));
    }
    (least, most)
}

/// The sum of our Gaussian of a diameter, divided by its integral as the paper does.
fn gaussian_sums(diameter_tx: f64) -> (f64, f64) {
    let falloff = f64::from(FALLOFF) / (diameter_tx * diameter_tx);
    let radius = diameter_tx * 0.5;
    let bell = |t: f64| if t.abs() < radius { libm::exp(-falloff * t * t) } else { 0.0 };
    sums_of(radius, &|x, y| bell(x) * bell(y) * falloff / std::f64::consts::PI)
}

/// The sum of the splat of the authors' program: α[1 + (e^(−2βr²/s²) − 1)/(1 − e^(−β))] within r² < s²/4, over 10.5 s²/25, with s = 2.5 texels.
fn authors_sums() -> (f64, f64) {
    let (s, alpha, beta) = (2.5_f64, 0.918, 1.953);
    let share = |x: f64, y: f64| {
        let squared = x * x + y * y;
        let height = alpha * (1.0 + (libm::exp(-2.0 * beta * squared / (s * s)) - 1.0) / (1.0 - libm::exp(-beta)));
        if squared < s * s / 4.0 { height / (10.5 * s * s / 25.0) } else { 0.0 }
    };
    sums_of(s, &share)
}

fn report(all: &[Effects]) -> String {
    let mut text = String::from(
        "E5: sum of the shares of a splat over the texels, by where it lies between them, if it is not divided by this sum.\n\n| splat | least | most |\n|---|---:|---:|\n",
    );
    let splats = [3.0, 5.0, 7.0, 15.0].map(|diameter| (format!("Gaussian of {diameter} texels"), gaussian_sums(diameter)));
    for (name, (least, most)) in splats.into_iter().chain([("the authors' program".to_owned(), authors_sums())]) {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "| {name} | {least:.3} | {most:.3} |");
    }
    text.push_str(
        "\nSplats by the lens, 512² photons. E2: light in splats that the least and the greatest diameter change, %. E4: light over that of the photons, if \
         all splats had the height of one of light that is not bent. E6: difference of method A's picture without colours, over the mean. E7: light, if \
         the receiver's cosine were that of the photon's own direction, and the root of the mean squared change of a photon. E8: light without losses at \
         surfaces and in glass.\n\n| scene | E2, widened | narrowed | E4 | E6 | E7 | rms | E8 |\n|---|---:|---:|---:|---:|---:|---:|---:|\n",
    );
    for of in all {
        let _ = writeln!(
            text,
            "| {} | {:.1} | {:.1} | {:.2} | {:.3} | {:.3} | {:.3} | {:.3} |",
            of.scene,
            of.widened * 100.0,
            of.narrowed * 100.0,
            of.of_equal_height,
            of.without_colours,
            of.by_own_cosine,
            of.own_cosine_rms,
            of.without_losses
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The authors' splat: 0.889 to 1.097; a wide Gaussian adds up to what its cut leaves of it.
    #[test]
    fn sums_of_splats_depend_on_where_they_lie() {
        let (least, most) = authors_sums();
        assert!((least - 0.889).abs() < 0.005 && (most - 1.097).abs() < 0.005, "{least} {most}");
        let (least, most) = gaussian_sums(40.0);
        let along = libm::erf(2.5 / std::f64::consts::SQRT_2);
        let kept = along * along;
        assert!((least - kept).abs() < 0.005 && (most - kept).abs() < 0.005, "{least} {most} {kept}");
        let (least, most) = gaussian_sums(3.0);
        assert!(most - least > 0.02, "{least} {most}");
    }
}
