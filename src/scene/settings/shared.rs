//! The rows that many techniques have: their names, types, defaults, ranges and documentation, said once.

crate::choices! {
    /// Whether light is counted as the paper prints it, or so that none is made or lost.
    pub enum Radiometry {
        /// The published equation, to the letter.
        Paper,
        /// Flux is conserved: transmittance and both cosines are in, and receivers answer to the angle of the light.
        Physical,
    }
}

crate::choices! {
    /// How the eye sees through the water surface.
    pub enum EyeRefraction {
        /// The picture of what is under water, looked up through a plane at the mean level and shifted by the waves [SF05 §3.5].
        VirtualPlane,
        /// Each pixel's ray refracted by Snell's law and followed to what it hits.
        Snell,
    }
}

/// Largest side of the water grid that a technique may ask for, in vertices.
pub const MAX_GRID: u32 = 4096;

/// A row that many techniques have, put into the table of [`settings!`](macro@crate::settings) where it says `shared NAME`. Types and limits go
/// by the names that this crate exports, which must be in scope there.
#[macro_export]
macro_rules! shared_row {
    (radiometry $($rest:tt)+) => {
        $crate::shared_row!(@row {
            /// Whether light is counted as the paper prints it, or so that none is made or lost.
            radiometry: Radiometry = Radiometry::Physical
        } {paper Radiometry::Paper} {} $($rest)+);
    };
    (grid $($rest:tt)+) => {
        $crate::shared_row!(@row {
            /// Columns and rows of vertices of the water mesh that light goes through, in place of the water's own.
            grid: Option<(u32, u32)> = None, in 2..=MAX_GRID, unit "vertices"
        } {} {, coarse Some((33, 33))} $($rest)+);
    };
    (depth_below_floor $($rest:tt)+) => {
        $crate::shared_row!(@row {
            /// How far light is followed behind the farthest receiver, as a share of the way from the surface to it; above 0, so that it is lit.
            depth_below_floor: f32 = 0.04, in 0.0..=1.0e3, unit "of the depth"
        } {} {} $($rest)+);
    };
    (eye_refraction $($rest:tt)+) => {
        $crate::shared_row!(@row {
            /// How the eye sees through the water surface.
            eye_refraction: EyeRefraction = EyeRefraction::Snell
        } {paper EyeRefraction::VirtualPlane} {} $($rest)+);
    };
    (underwater_shadows $($rest:tt)+) => {
        $crate::shared_row!(@row {
            /// Whether objects under water cut off the light behind them.
            underwater_shadows: bool = true
        } {paper false} {} $($rest)+);
    };
    (shadow_map_size $($rest:tt)+) => {
        $crate::shared_row!(@row {
            /// Width and height of the shadow maps.
            shadow_map_size: u32 = 2048, in 16..=16384, unit "texels"
        } {} {, coarse 512} $($rest)+);
    };
    (samples $($rest:tt)+) => {
        $crate::shared_row!(@row {
            /// Samples along each side of a pixel: the picture is rendered that many times larger and averaged.
            samples: u32 = 1, in 1..=8
        } {} {, coarse 1} $($rest)+);
    };

    // The technique's word on its paper wins over that of the row.
    (@row {$($row:tt)+} {paper $usual:expr} $coarse:tt $state:tt {} $texts:tt) => {
        $crate::shared_row!(@put {$($row)+, paper $usual} $coarse $state $texts);
    };
    (@row {$($row:tt)+} {} $coarse:tt $state:tt {} $texts:tt) => {
        $crate::shared_row!(@put {$($row)+} $coarse $state $texts);
    };
    (@row {$($row:tt)+} {$(paper $usual:expr)?} $coarse:tt $state:tt {paper $paper:expr} $texts:tt) => {
        $crate::shared_row!(@put {$($row)+, paper $paper} $coarse $state $texts);
    };
    (@put {$($row:tt)+} {$($coarse:tt)*} {$head:tt $done:tt {$($rest:tt)*}} {$($texts:tt)*}) => {
        $crate::settings!(@rows $head $done {$($row)+ $($texts)* $($coarse)*; $($rest)*});
    };
}
