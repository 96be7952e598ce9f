//! The size of a photon's beam after the lens that it has passed [WD06 §4.2].
//!
//! A beam of diameter a meets a lens of the power 1/f in diverging light, from a point at the distance d_front. Right behind it, it narrows by a·V per
//! metre, with `V = 1/f − 1/d_front`: eq. 1 with V = 1/d_image. At the distance d_bg its diameter is
//!
//! `D = a·|1 − d_bg·V|`
//!
//! which is eq. 7 without its quotients: D₀·d_front/(d_front + d_bg) is a, and (d_bg − d_image)/d_image is d_bg·V − 1. Written so, parallel light, a
//! lens without power and light in focus need no case of their own (decision E2). The power is that of eq. 2, divided by the outer index (decision
//! E1): `1/f = (n − 1)(κ_front + κ_back)` in mean curvatures κ = 1/r, positive where the body bulges. For a mirror it is `−2κ`, and for water alone
//! `V = ((n − 1)κ − 1/d_front)/n`.

use nephroid_math::lanes::Lanes;

/// The surfaces that a photon has passed.
#[derive(Clone, Copy)]
pub struct Faces<L> {
    /// Refractive index behind the front face over the one before it; 1 for a mirror.
    pub index: L,
    /// Mean curvature of the front face, 1/m, positive where it bulges towards the light.
    pub front: L,
    /// Mean curvature of the back face, 1/m, likewise: negative for a body that bulges. 0 where there is none.
    pub back: L,
    /// Path between the faces, m; 0 where light stays behind the front face or is reflected there.
    pub thickness: L,
}

/// Diameter of a beam at a distance behind the last face, over its diameter at the first. `mirror`: lanes whose face reflects. `divergence`: 1/d_front, 1/m.
#[inline(always)]
pub fn beam_diameter<L: Lanes>(faces: &Faces<L>, mirror: L::Mask, divergence: L, distance: L, thick: bool) -> L {
    let one = distance.like(1.0);
    let bend = faces.index - 1.0;
    // Narrowing inside of the body, and what is left of the diameter at the back face.
    let inside = (bend * faces.front - divergence) / faces.index;
    let path = if thick { faces.thickness } else { one.like(0.0) };
    let left = one - path * inside;
    let through_body = faces.index * inside - bend * faces.back * left;
    let passes = faces.thickness.gt(one.like(0.0));
    let narrowing = L::select(mirror, -(faces.front * 2.0) - divergence, L::select(passes, through_body, inside));
    (left - distance * narrowing).abs()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ball of radius r: 1/f = (n − 1)·2/r for a thin lens; for a thick one the focus is r(2 − n)/(2(n − 1)) behind the back face.
    #[test]
    fn parallel_light_meets_in_the_focus_of_a_ball() {
        let (r, n) = (0.3_f32, 1.5);
        let ball = Faces { index: n, front: 1.0 / r, back: -1.0 / r, thickness: 2.0 * r };
        let thin = r / (2.0 * (n - 1.0));
        assert!(beam_diameter(&ball, false, 0.0, thin, false) < 1.0e-6);
        assert!((beam_diameter(&ball, false, 0.0, 3.0 * thin, false) - 2.0).abs() < 1.0e-5);
        let thick = r * (2.0 - n) / (2.0 * (n - 1.0));
        assert!(beam_diameter(&ball, false, 0.0, thick, true) < 1.0e-6);
        // At the back face a third of the aperture is left: the focus inside is n·r/(n − 1) = 3r behind the front face.
        assert!((beam_diameter(&ball, false, 0.0, 0.0, true) - 1.0 / 3.0).abs() < 1.0e-6);
    }

    /// WD06 eq. 7, with the quotients of eq. 1 and 3, against the form without them.
    #[test]
    fn the_published_equation_gives_the_same_diameter() {
        for (front, back, n, d_front, d_bg) in [(2.0, -1.0, 1.5, 3.0, 0.7), (0.5, -3.0, 1.2, 9.0, 4.0), (-1.0, 0.5, 1.33, 2.0, 1.0)] {
            let faces = Faces { index: n, front, back, thickness: 0.1 };
            let power = (n - 1.0) * (front - back);
            let d_image: f32 = 1.0 / (power - 1.0 / d_front);
            let published = (d_front / (d_front + d_bg) * ((d_bg - d_image) / d_image)).abs();
            // D₀ at the background is a·(d_front + d_bg)/d_front.
            let ours = beam_diameter(&faces, false, 1.0 / d_front, d_bg, false) * (d_front / (d_front + d_bg));
            assert!((published - ours).abs() < 1.0e-5, "{published} {ours}");
        }
    }

    #[test]
    fn equal_indices_and_plane_mirrors_leave_the_beam_as_it_is() {
        let body = Faces { index: 1.0, front: 4.0, back: -7.0, thickness: 0.2 };
        for thick in [false, true] {
            assert_eq!(beam_diameter(&body, false, 0.0, 5.0, thick), 1.0);
            // Twice as far from the light, twice as wide; the thickness of the body counts.
            let path = if thick { 2.2 } else { 2.0 };
            assert!((beam_diameter(&body, false, 0.5, 2.0, thick) - (1.0 + path * 0.5)).abs() < 1.0e-6);
        }
        let plane = Faces { index: 1.0, front: 0.0, back: 0.0, thickness: 0.0 };
        assert_eq!(beam_diameter(&plane, true, 0.0, 5.0, true), 1.0);
    }

    #[test]
    fn a_hollow_mirror_and_a_wave_have_their_foci() {
        let mirror = Faces { index: 1.0, front: -2.0, back: 0.0, thickness: 0.0 };
        assert!(beam_diameter(&mirror, true, 0.0, 0.25, true) < 1.0e-6);
        // Under the crest of a cos kx water focuses at n/((n − 1)a k²), across x alone: half of that curvature is the mean.
        let (n, a, k) = (1.333_f32, 0.02_f32, 6.0_f32);
        let wave = Faces { index: n, front: a * k * k, back: 0.0, thickness: 0.0 };
        assert!(beam_diameter(&wave, false, 0.0, n / ((n - 1.0) * a * k * k), true) < 1.0e-5);
    }
}
