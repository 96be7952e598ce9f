//! Moving, joining and tidying meshes.

use glam::{Mat3, Mat4};

use super::{Mesh, normals::normal_along};

/// A `Mesh` is refused beyond this many vertices: an index has 32 bits.
pub(crate) const MAX_VERTEX_COUNT: usize = u32::MAX as usize;

/// `det(M) · (M⁻¹)ᵀ`, with the sign of the determinant taken out: it maps normals, and exists for singular maps too.
fn normal_matrix(m: Mat3) -> Mat3 {
    let cofactors = Mat3::from_cols(m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis));
    if m.determinant() < 0.0 { -cofactors } else { cofactors }
}

impl Mesh {
    /// The image of the mesh under an affine map.
    ///
    /// Normals go with the inverse transpose, `n' = normalize((M⁻¹)ᵀ n)`. A mirroring map (negative determinant) would turn the surface
    /// inside out: the order of the corners is reversed to keep front faces in front. A map onto a plane or a line gives `+y` for
    /// normals it cannot define.
    #[must_use]
    pub fn transformed(&self, world_from_object: Mat4) -> Self {
        let linear = Mat3::from_mat4(world_from_object);
        // Scaled to about 1, so that the products of two elements stay in range.
        let scale = linear.x_axis.abs().max(linear.y_axis.abs()).max(linear.z_axis.abs()).max_element();
        let linear = if scale > 0.0 && scale.is_finite() { linear * (1.0 / scale) } else { linear };
        let normals = normal_matrix(linear);
        let mut mesh = Self {
            positions: self.positions.iter().map(|&p| world_from_object.transform_point3(p)).collect(),
            normals: self.normals.iter().map(|&n| normal_along(normals * n)).collect(),
            uvs: self.uvs.clone(),
            indices: self.indices.clone(),
        };
        if linear.determinant() < 0.0 {
            mesh.reverse_winding();
        }
        mesh
    }

    /// Turns the surface inside out: corner order and normals.
    pub fn flip(&mut self) {
        self.reverse_winding();
        self.normals.iter_mut().for_each(|n| *n = -*n);
    }

    /// Swaps the second and third corner of every triangle.
    pub(crate) fn reverse_winding(&mut self) {
        self.indices.chunks_exact_mut(3).for_each(|t| t.swap(1, 2));
    }

    /// Appends another mesh. Where only one of the two has texture coordinates, the other's are zero.
    ///
    /// Panics if the vertices together exceed the 2³² − 1 an index can count; readers check before they come here.
    pub fn append(&mut self, other: &Self) {
        let base = self.positions.len();
        assert!(base + other.positions.len() <= MAX_VERTEX_COUNT, "{base} + {} vertices do not fit 32-bit indices", other.positions.len());
        if !self.uvs.is_empty() || !other.uvs.is_empty() {
            self.uvs.resize(base, glam::Vec2::ZERO);
            self.uvs.extend(&other.uvs);
            self.uvs.resize(base + other.positions.len(), glam::Vec2::ZERO);
        }
        self.positions.extend(&other.positions);
        self.normals.extend(&other.normals);
        self.indices.extend(other.indices.iter().map(|i| i + base as u32));
    }

    /// All meshes as one; see [`Mesh::append`].
    #[must_use]
    pub fn merged<'a>(meshes: impl IntoIterator<Item = &'a Self>) -> Self {
        meshes.into_iter().fold(Self::default(), |mut all, mesh| {
            all.append(mesh);
            all
        })
    }

    /// Drops vertices no triangle uses; the others keep their order.
    pub fn compact(&mut self) {
        let mut used = vec![false; self.positions.len()];
        self.indices.iter().for_each(|&i| used[i as usize] = true);
        if !used.contains(&false) {
            return;
        }
        let mut new_index = vec![0; used.len()];
        for (count, (new, _)) in new_index.iter_mut().zip(&used).filter(|(_, used)| **used).enumerate() {
            *new = count as u32;
        }
        let keep = |i: &mut std::slice::Iter<'_, bool>| *i.next().unwrap_or(&false);
        let (mut a, mut b, mut c) = (used.iter(), used.iter(), used.iter());
        self.positions.retain(|_| keep(&mut a));
        self.normals.retain(|_| keep(&mut b));
        self.uvs.retain(|_| keep(&mut c));
        self.indices.iter_mut().for_each(|i| *i = new_index[*i as usize]);
    }
}
