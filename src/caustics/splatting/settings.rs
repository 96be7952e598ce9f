//! Settings of `splatting`.

use nephroid_scene::{EyeRefraction, MAX_GRID, Material, Radiometry, Scene, choices, settings};

choices! {
    /// How the size of a splat is chosen.
    pub enum Splats {
        /// One size for all: Wyman & Davis 2006, the baseline.
        Fixed,
        /// Of four sizes, by the number of photons near a texel: method A [WD06 §4.1].
        Sizes,
        /// One texel in each level of a pyramid of maps, of which each texel takes one: the naive way [WD06 Fig. 4].
        Pyramid,
        /// By the lens that the photon has passed: method B [WD06 §4.2].
        Lens,
        /// By where the neighbours of the photon land: a parallelogram, long where light is drawn out.
        Differential,
    }
}

choices! {
    /// How the results of two sizes are blended.
    pub enum Blend {
        /// Smoothly, and only where the smaller splat is brighter [WD06 §4.1].
        Bernstein,
        /// Linearly: rings, shown for comparison [WD06 Fig. 5].
        Linear,
    }
}

choices! {
    /// What the photons' view and the map hold.
    pub enum Views {
        /// The whole scene in both: many photons meet no mirror and no glass.
        Scene,
        /// Mirrors, glass and water in the photons' view; in the map what their light reaches.
        Fitted,
    }
}

choices! {
    /// How photons meet surfaces.
    pub enum Intersection {
        /// `Exact` in scenes with mirrors or glass and no water, whose light takes ways that pictures do not hold; `Image` in others.
        Auto,
        /// In the pictures that the light sees: one reflection, or one refraction into and one out of a body.
        Image,
        /// In the triangles of the scene: up to 64 reflections and refractions.
        Exact,
    }
}

choices! {
    /// Where splats are drawn.
    pub enum Gather {
        /// Into a map that the light projects onto the scene.
        Light,
        /// Into the picture, where the eye sees the photon; through water only with `eye_refraction: VirtualPlane`.
        Eye,
    }
}

choices! {
    /// How the receiver of a photon is searched in the light's picture of the receivers.
    pub enum Search {
        /// Depth of the receiver under the last estimate [Wyman 2005].
        Wyman,
        /// Distance to the receiver under the last estimate [Shah, Konttinen & Pattanaik 2007].
        Shah,
        /// Steps along the ray, the first one behind a receiver halved until it is found.
        Bracketed,
    }
}

choices! {
    /// The lens that sets the size of a splat.
    pub enum Lens {
        /// Both faces at one place [WD06 eq. 1 to 7].
        Thin,
        /// Faces apart by the photon's path between them.
        Thick,
    }
}

choices! {
    /// Where curvature comes from.
    pub enum CurvatureFrom {
        /// Mean curvature at the vertices of the mesh.
        Mesh,
        /// Both principal curvatures there: splats are parallelograms, as long and as wide as the beam. Exact photons know it from their neighbours.
        Both,
        /// Differences of normals between texels of the photons' view.
        Normals,
    }
}

settings! {
    /// Settings of the technique `splatting`.
    pub struct Splatting("splatting") {
        shared radiometry, note "decisions E4, E5 and E8; also `--radiometry`";
        /// Photons along a side of the light's view, if it is square; their number is the square of it in any view.
        photons: u32 = 512, in 2..=4096, coarse 64;
        /// Texels along a side of the caustic map, if it is square; their number is the square of it in any view.
        map_size: u32 = 1024, in 16..=8192, unit "texels", paper 512, coarse 128;
        /// How the size of a splat is chosen.
        splats: Splats = Splats::Differential, paper Splats::Lens;
        /// Diameter of the splat of light that is neither gathered nor spread, in distances between photons.
        splat_size: f32 = 3.0, in 1.0..=32.0, paper 7.0, note "the paper's 7 is for splats of one size; those of `Sizes` are 3, 7, 11 and 15";
        /// How the results of two sizes are blended.
        blend: Blend = Blend::Bernstein, note "of `Sizes`";
        /// Whether photons of several colours keep them in splats of four sizes, for twice the targets.
        size_colours: bool = true, paper false, note "decision E6";
        /// What the photons' view and the map hold.
        views: Views = Views::Fitted, paper Views::Scene;
        /// How photons meet surfaces.
        intersection: Intersection = Intersection::Auto, paper Intersection::Image;
        /// Where splats are drawn.
        gather: Gather = Gather::Light;
        /// How the receiver of a photon is searched in the light's picture of the receivers.
        search: Search = Search::Bracketed, paper Search::Wyman;
        /// Most steps of the search.
        search_steps: u32 = 32, in 1..=256, paper 10;
        /// Halvings of the path inside glass until it ends at a back face; 0 for the thickness along the light.
        exit_steps: u32 = 12, in 0..=24, paper 0;
        /// Whether back faces are interpolated between texels.
        smooth_exits: bool = true, paper false;
        /// The lens that sets the size of a splat.
        lens: Lens = Lens::Thick, paper Lens::Thin, note "of `Lens`";
        /// Where curvature comes from.
        curvature: CurvatureFrom = CurvatureFrom::Mesh, note "of `Lens`; decision E3";
        /// Frames of which the map is the mean, the last being the frame's own; the photons' grid is shifted by parts of a texel from one to the next.
        frames: u32 = 1, in 1..=8, said "1 in its pictures, 4 in its program";
        /// Time from one of these frames to the next.
        frame_s: f32 = 0.033_333_334, in 0.001..=1.0, unit "s";
        shared grid;
        shared eye_refraction;
        shared shadow_map_size;
        shared samples;
    }
}

impl Splatting {
    /// These settings for a scene, with [`Intersection::Auto`] decided.
    #[must_use]
    pub fn decided(&self, scene: &Scene) -> Self {
        let specular = scene.water.is_none() && scene.objects.iter().any(|object| !matches!(object.material, Material::Diffuse { .. }));
        let by_scene = if specular { Intersection::Exact } else { Intersection::Image };
        Self { intersection: if self.intersection == Intersection::Auto { by_scene } else { self.intersection }, ..*self }
    }

    /// Whether splats by the lens are those of the differentials of rays.
    #[must_use]
    pub fn has_both_curvatures(&self) -> bool {
        self.splats == Splats::Lens && self.curvature == CurvatureFrom::Both
    }
}
