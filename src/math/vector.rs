//! Vectors of [`Lanes`]: two, three or four components, each a lane type. Sums of products are evaluated left to right, without fused operations.

use std::ops::{Add, Mul, Neg, Sub};

use super::lanes::Lanes;

/// Two components.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct V2<L> {
    /// First component.
    pub x: L,
    /// Second component.
    pub y: L,
}

/// Three components.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct V3<L> {
    /// First component.
    pub x: L,
    /// Second component.
    pub y: L,
    /// Third component.
    pub z: L,
}

/// Four components.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct V4<L> {
    /// First component.
    pub x: L,
    /// Second component.
    pub y: L,
    /// Third component.
    pub z: L,
    /// Fourth component.
    pub w: L,
}

/// Makes a [`V2`].
#[inline(always)]
pub fn v2<L>(x: L, y: L) -> V2<L> {
    V2 { x, y }
}

/// Makes a [`V3`].
#[inline(always)]
pub fn v3<L>(x: L, y: L, z: L) -> V3<L> {
    V3 { x, y, z }
}

/// Makes a [`V4`].
#[inline(always)]
pub fn v4<L>(x: L, y: L, z: L, w: L) -> V4<L> {
    V4 { x, y, z, w }
}

macro_rules! componentwise {
    ($vector:ident, $($c:ident),+) => {
        impl<L: Lanes> Add for $vector<L> {
            type Output = Self;
            #[inline(always)]
            fn add(self, other: Self) -> Self {
                $vector { $($c: self.$c + other.$c),+ }
            }
        }
        impl<L: Lanes> Sub for $vector<L> {
            type Output = Self;
            #[inline(always)]
            fn sub(self, other: Self) -> Self {
                $vector { $($c: self.$c - other.$c),+ }
            }
        }
        impl<L: Lanes> Mul<L> for $vector<L> {
            type Output = Self;
            #[inline(always)]
            fn mul(self, scale: L) -> Self {
                $vector { $($c: self.$c * scale),+ }
            }
        }
        impl<L: Lanes> Neg for $vector<L> {
            type Output = Self;
            #[inline(always)]
            fn neg(self) -> Self {
                $vector { $($c: -self.$c),+ }
            }
        }
        impl<L: Lanes> $vector<L> {
            /// `mask ? if_true : if_false`, lane by lane.
            #[inline(always)]
            pub fn select(mask: L::Mask, if_true: Self, if_false: Self) -> Self {
                $vector { $($c: L::select(mask, if_true.$c, if_false.$c)),+ }
            }
            /// `self·(1 − t) + other·t` [WGSL `mix`]: exactly `self` at `t = 0` and exactly `other` at `t = 1` where both are finite.
            ///
            /// `self + (other − self)·t` would save a product, but misses `other` if the difference is rounded.
            #[inline(always)]
            #[must_use]
            pub fn lerp(self, other: Self, t: L) -> Self {
                let rest = -t + 1.0;
                $vector { $($c: self.$c * rest + other.$c * t),+ }
            }
        }
    };
}
componentwise!(V2, x, y);
componentwise!(V3, x, y, z);
componentwise!(V4, x, y, z, w);

impl<L: Lanes> V2<L> {
    /// Inner product.
    #[inline(always)]
    pub fn dot(self, other: Self) -> L {
        self.x * other.x + self.y * other.y
    }
    /// `x·other.y − y·other.x`: twice the signed area of the triangle spanned.
    #[inline(always)]
    pub fn perp_dot(self, other: Self) -> L {
        self.x * other.y - self.y * other.x
    }
}

impl<L: Lanes> V3<L> {
    /// The same vector in every lane.
    #[cfg(feature = "glam")]
    #[inline(always)]
    pub fn splat(token: L::Token, v: glam::Vec3) -> Self {
        v3(L::splat(token, v.x), L::splat(token, v.y), L::splat(token, v.z))
    }
    /// Inner product.
    #[inline(always)]
    pub fn dot(self, other: Self) -> L {
        self.x * other.x + self.y * other.y + self.z * other.z
    }
    /// Vector product, right-handed.
    #[inline(always)]
    pub fn cross(self, other: Self) -> Self {
        v3(self.y * other.z - self.z * other.y, self.z * other.x - self.x * other.z, self.x * other.y - self.y * other.x)
    }
    /// Euclidean length.
    #[inline(always)]
    pub fn length(self) -> L {
        self.dot(self).sqrt()
    }
    /// Unit vector along `self`; NaN if the length is zero.
    #[inline(always)]
    pub fn normalize(self) -> Self {
        self * (self.x.like(1.0) / self.length())
    }
    /// Component by component product.
    #[inline(always)]
    pub fn hadamard(self, other: Self) -> Self {
        v3(self.x * other.x, self.y * other.y, self.z * other.z)
    }
}

impl<L: Lanes> V4<L> {
    /// The same four numbers in every lane.
    #[inline(always)]
    pub fn from_array(token: L::Token, [x, y, z, w]: [f32; 4]) -> Self {
        v4(L::splat(token, x), L::splat(token, y), L::splat(token, z), L::splat(token, w))
    }
    /// `matrix · self`, where `matrix` is four columns; each row is summed left to right.
    #[inline(always)]
    pub fn transformed(self, matrix: &[[f32; 4]; 4]) -> Self {
        v4(self.row(matrix, 0), self.row(matrix, 1), self.row(matrix, 2), self.row(matrix, 3))
    }
    #[inline(always)]
    fn row(self, [x, y, z, w]: &[[f32; 4]; 4], row: usize) -> L {
        self.x * x[row] + self.y * y[row] + self.z * z[row] + self.w * w[row]
    }
}

impl<L: Copy> V4<L> {
    /// The first three components.
    #[inline(always)]
    pub fn xyz(self) -> V3<L> {
        v3(self.x, self.y, self.z)
    }
}

/// `matrix · (v, 1)`, columns summed left to right.
#[cfg(feature = "glam")]
#[inline(always)]
pub fn transform_point<L: Lanes>(matrix: &glam::Mat4, v: V3<L>) -> V4<L> {
    let c = matrix.to_cols_array();
    v4(affine_row(&c, 0, v), affine_row(&c, 1, v), affine_row(&c, 2, v), affine_row(&c, 3, v))
}

/// The upper 3x3 of `matrix` applied to `v`: for directions.
#[cfg(feature = "glam")]
#[inline(always)]
pub fn transform_vector<L: Lanes>(matrix: &glam::Mat4, v: V3<L>) -> V3<L> {
    let c = matrix.to_cols_array();
    v3(linear_row(&c, 0, v), linear_row(&c, 1, v), linear_row(&c, 2, v))
}

#[cfg(feature = "glam")]
#[inline(always)]
fn linear_row<L: Lanes>(c: &[f32; 16], row: usize, v: V3<L>) -> L {
    v.x * c[row] + v.y * c[4 + row] + v.z * c[8 + row]
}

#[cfg(feature = "glam")]
#[inline(always)]
fn affine_row<L: Lanes>(c: &[f32; 16], row: usize, v: V3<L>) -> L {
    linear_row(c, row, v) + c[12 + row]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ends of very different size, where `a + (b − a)·t` loses `b`: (1e8 + (1 − 1e8)) is 0 or 8, not 1.
    #[test]
    fn lerp_ends_exactly_where_it_should() {
        const ENDS: [[f32; 4]; 6] = [
            [1.0e8, 1.0, 0.1, -3.0],
            [1.0, 1.0e8, 0.3, 7.0],
            [-1.0e30, 1.0e-30, 1.0 / 3.0, 0.7],
            [f32::MAX, f32::MIN_POSITIVE, 1.0e-45, 0.1],
            [16_777_216.0, 0.5, -0.1, 1.0e-7],
            [0.3, 0.1, 0.7, 0.2],
        ];
        for a in ENDS {
            for b in ENDS {
                let (from, to) = (v4(a[0], a[1], a[2], a[3]), v4(b[0], b[1], b[2], b[3]));
                assert_eq!((from.lerp(to, 0.0), from.lerp(to, 1.0)), (from, to));
                assert_eq!((from.xyz().lerp(to.xyz(), 0.0), from.xyz().lerp(to.xyz(), 1.0)), (from.xyz(), to.xyz()));
                assert_eq!(
                    (v2(a[0], a[1]).lerp(v2(b[0], b[1]), 0.0), v2(a[0], a[1]).lerp(v2(b[0], b[1]), 1.0)),
                    (v2(a[0], a[1]), v2(b[0], b[1]))
                );
            }
        }
        // The form with one product is told apart.
        let (a, b) = (1.0e8_f32, 1.0_f32);
        assert_ne!(a + (b - a) * 1.0, b);
        // Between the ends, by hand: 2·0.75 + 10·0.25 = 4.
        assert_eq!(v2(2.0_f32, 0.0).lerp(v2(10.0, 8.0), 0.25), v2(4.0, 2.0));
    }
}
