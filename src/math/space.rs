//! Maps between spaces: rotations, views, projections, the viewport, and back.
//!
//! World and view space are right-handed, in metres, y up; a camera looks along −z of its view. Clip space is WebGPU's: after the divide
//! x and y are in `[−1, 1]` with y up and depth is in `[0, 1]`, near to far. Framebuffer pixels have y down and centres at .5. Matrices
//! multiply column vectors and are named `to_from`, so that spaces cancel: `clip_from_view · view_from_world`.
//!
//! All functions compute in 64 bits with `libm` and round once, so the bits are the same everywhere. They return `None` if the input spans no space
//! (no direction, no volume, or NaN).

use glam::{DMat3, DMat4, DVec3, DVec4, Mat3, Mat4, Quat, Vec2, Vec3, Vec4Swizzles};

#[cfg(test)]
mod tests;

/// `view_from_world` of an eye at `eye_ws` that looks at `target_ws`, with `up_ws` upwards in the picture.
///
/// `None` if eye and target coincide, `up_ws` is parallel to the view, or a component is not finite.
#[must_use]
pub fn look_at(eye_ws: Vec3, target_ws: Vec3, up_ws: Vec3) -> Option<Mat4> {
    look_along(eye_ws, target_ws.as_dvec3() - eye_ws.as_dvec3(), up_ws)
}

/// `view_from_world` of an eye at `eye_ws` that looks along `direction_ws` (any length); otherwise as [`look_at`].
#[must_use]
pub fn look_to(eye_ws: Vec3, direction_ws: Vec3, up_ws: Vec3) -> Option<Mat4> {
    look_along(eye_ws, direction_ws.as_dvec3(), up_ws)
}

fn look_along(eye_ws: Vec3, direction: DVec3, up_ws: Vec3) -> Option<Mat4> {
    let back = -direction.try_normalize()?;
    let up = up_ws.as_dvec3().try_normalize()?;
    let right = up.cross(back);
    // With an `up` within 1e-6 rad of the view, rounding would decide the roll.
    let right = (right.length_squared() > 1e-12).then(|| right.normalize())?;
    let world_from_view = DMat3::from_cols(right, back.cross(right), back);
    let rotation = world_from_view.transpose();
    let translation = -(rotation * eye_ws.as_dvec3());
    finite(DMat4::from_cols(rotation.x_axis.extend(0.0), rotation.y_axis.extend(0.0), rotation.z_axis.extend(0.0), translation.extend(1.0)))
}

/// `clip_from_view` of a perspective with the vertical opening angle `fov_y_rad` in `(0, π)`, `aspect` = width/height, and `0 < near_m < far_m`.
///
/// Depth is `far·(z + near)/(z·(far − near))` for view z < 0: 0 at the near plane, 1 at the far plane. `far_m` may be infinite: `1 + near/z`.
#[must_use]
pub fn perspective(fov_y_rad: f32, aspect: f32, near_m: f32, far_m: f32) -> Option<Mat4> {
    let valid = fov_y_rad > 0.0 && fov_y_rad < std::f32::consts::PI && aspect > 0.0 && near_m > 0.0 && far_m > near_m;
    if !valid {
        return None;
    }
    let focal = 1.0 / libm::tan(0.5 * f64::from(fov_y_rad));
    let (near, far) = (f64::from(near_m), f64::from(far_m));
    let depth = if far_m.is_infinite() { -1.0 } else { far / (near - far) };
    finite(DMat4::from_cols(
        DVec4::new(focal / f64::from(aspect), 0.0, 0.0, 0.0),
        DVec4::new(0.0, focal, 0.0, 0.0),
        DVec4::new(0.0, 0.0, depth, -1.0),
        DVec4::new(0.0, 0.0, near * depth, 0.0),
    ))
}

/// `clip_from_view` of a parallel projection of the box `min_vs..max_vs` in view space; note that the near plane is at the *larger* z, `max_vs.z`.
///
/// Depth is 0 at `max_vs.z` and 1 at `min_vs.z`, linear between. `None` unless every side is positive.
#[must_use]
pub fn orthographic(min_vs: Vec3, max_vs: Vec3) -> Option<Mat4> {
    let (min, max) = (min_vs.as_dvec3(), max_vs.as_dvec3());
    let size = max - min;
    if !size.cmpgt(DVec3::ZERO).all() {
        return None;
    }
    finite(DMat4::from_cols(
        DVec4::new(2.0 / size.x, 0.0, 0.0, 0.0),
        DVec4::new(0.0, 2.0 / size.y, 0.0, 0.0),
        DVec4::new(0.0, 0.0, -1.0 / size.z, 0.0),
        DVec4::new(-(max.x + min.x) / size.x, -(max.y + min.y) / size.y, max.z / size.z, 1.0),
    ))
}

/// Distance in metres along the view axis (−view z) from the `depth` in `0..=1` that [`perspective`] wrote.
#[must_use]
pub fn perspective_distance_m(depth: f32, near_m: f32, far_m: f32) -> f32 {
    let (depth, near) = (f64::from(depth), f64::from(near_m));
    let reciprocal_far = 1.0 / f64::from(far_m);
    (1.0 / ((1.0 - depth) / near + depth * reciprocal_far)) as f32
}

/// Rotation by `angle_rad` about `axis` (any length), anticlockwise seen against the axis. `None` for an axis of no length.
///
/// Rodrigues' formula.
#[must_use]
pub fn rotation(axis: Vec3, angle_rad: f32) -> Option<Mat3> {
    let k = axis.as_dvec3().try_normalize()?;
    let (s, c) = libm::sincos(f64::from(angle_rad));
    let cross = DMat3::from_cols(DVec3::new(0.0, k.z, -k.y), DVec3::new(-k.z, 0.0, k.x), DVec3::new(k.y, -k.x, 0.0));
    let outer = DMat3::from_cols(k * k.x, k * k.y, k * k.z);
    let rotation = (DMat3::IDENTITY * c + cross * s + outer * (1.0 - c)).as_mat3();
    rotation.is_finite().then_some(rotation)
}

/// The quaternion of [`rotation`].
#[must_use]
pub fn rotation_quat(axis: Vec3, angle_rad: f32) -> Option<Quat> {
    let k = axis.as_dvec3().try_normalize()?;
    let (s, c) = libm::sincos(0.5 * f64::from(angle_rad));
    let quat = Quat::from_xyzw((k.x * s) as f32, (k.y * s) as f32, (k.z * s) as f32, c as f32);
    quat.is_finite().then_some(quat)
}

/// Rotation by `degrees.x` about the x axis, then `degrees.y` about the y axis, then `degrees.z` about the z axis, all of them fixed axes: `R_z·R_y·R_x`.
///
/// Multiples of 90° give exact zeros and ones. NaN in gives NaN out.
#[must_use]
pub fn rotation_euler_deg(degrees: Vec3) -> Mat3 {
    let [(sx, cx), (sy, cy), (sz, cz)] = degrees.to_array().map(sin_cos_deg);
    let x = DMat3::from_cols(DVec3::X, DVec3::new(0.0, cx, sx), DVec3::new(0.0, -sx, cx));
    let y = DMat3::from_cols(DVec3::new(cy, 0.0, -sy), DVec3::Y, DVec3::new(sy, 0.0, cy));
    let z = DMat3::from_cols(DVec3::new(cz, sz, 0.0), DVec3::new(-sz, cz, 0.0), DVec3::Z);
    (z * y * x).as_mat3()
}

/// Sine and cosine of an angle in degrees, exact at multiples of 90.
#[must_use]
pub fn sin_cos_deg(degrees: f32) -> (f64, f64) {
    let quarter = libm::round(f64::from(degrees) / 90.0);
    let rest = f64::from(degrees) - quarter * 90.0;
    let (s, c) = libm::sincos(rest.to_radians());
    match quarter.rem_euclid(4.0) {
        1.0 => (c, -s),
        2.0 => (-s, -c),
        3.0 => (-c, s),
        _ => (s, c),
    }
}

/// `world_from_object` that scales, then rotates, then moves.
#[must_use]
pub fn transform(scale: Vec3, rotation: Mat3, translation: Vec3) -> Mat4 {
    let columns = [rotation.x_axis * scale.x, rotation.y_axis * scale.y, rotation.z_axis * scale.z];
    Mat4::from_cols(columns[0].extend(0.0), columns[1].extend(0.0), columns[2].extend(0.0), translation.extend(1.0))
}

/// Unit vector towards a point of the sky: `azimuth_deg` from +x towards +z, `elevation_deg` above the horizon.
#[must_use]
pub fn direction_deg(azimuth_deg: f32, elevation_deg: f32) -> Vec3 {
    let (sa, ca) = sin_cos_deg(azimuth_deg);
    let (se, ce) = sin_cos_deg(elevation_deg);
    DVec3::new(ca * ce, se, sa * ce).as_vec3()
}

/// Two unit vectors that make a right-handed frame `(tangent, bitangent, n)` with the unit vector `n`.
///
/// Without a branch on the largest component (Duff et al., "Building an Orthonormal Basis, Revisited", JCGT 6(1), 2017). `n` may be any unit vector.
#[must_use]
pub fn orthonormal_basis(n: Vec3) -> (Vec3, Vec3) {
    let sign = 1.0_f32.copysign(n.z);
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    (Vec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x), Vec3::new(b, sign + n.y * n.y * a, -n.y))
}

/// Inverse of a matrix, computed in 64 bits; `None` if the matrix is singular or not finite.
///
/// `glam`'s 32-bit inverse loses half of its digits on a projection with a distant far plane.
#[must_use]
pub fn invert(matrix: &Mat4) -> Option<Mat4> {
    let matrix = matrix.as_dmat4();
    (matrix.determinant() != 0.0).then(|| finite(matrix.inverse()))?
}

/// Pixels from normalised device coordinates: `x` to the right, `y` down, the whole `size_px` from −1 to 1.
#[must_use]
pub fn px_from_ndc(ndc: Vec2, size_px: Vec2) -> Vec2 {
    Vec2::new((ndc.x * 0.5 + 0.5) * size_px.x, (0.5 - ndc.y * 0.5) * size_px.y)
}

/// The inverse of [`px_from_ndc`]; `size_px` must not have a zero.
#[must_use]
pub fn ndc_from_px(position_px: Vec2, size_px: Vec2) -> Vec2 {
    Vec2::new(2.0 * position_px.x / size_px.x - 1.0, 1.0 - 2.0 * position_px.y / size_px.y)
}

/// The point in world space (or the space that `world_from_clip` leads to) at normalised device coordinates and depth `ndc`.
///
/// `None` if the point is at infinity.
#[must_use]
pub fn unproject(world_from_clip: &Mat4, ndc: Vec3) -> Option<Vec3> {
    unproject_f64(&world_from_clip.as_dmat4(), ndc.as_dvec3()).map(|p| p.as_vec3()).filter(|p| p.is_finite())
}

/// The ray through a framebuffer position: its point on the near plane and its unit direction, in world space.
///
/// For a perspective whose matrix was inverted by [`invert`] the direction is accurate to about 1e-6 rad. `None` for a singular matrix.
#[must_use]
pub fn ray_through_px(world_from_clip: &Mat4, position_px: Vec2, size_px: Vec2) -> Option<(Vec3, Vec3)> {
    let matrix = world_from_clip.as_dmat4();
    let ndc = ndc_from_px(position_px, size_px).as_dvec2();
    let near = unproject_f64(&matrix, ndc.extend(0.0))?;
    // The point at half the depth range lies beyond the near plane, and is finite even if the far plane is not.
    let beyond = unproject_f64(&matrix, ndc.extend(0.5))?;
    Some((near.as_vec3(), (beyond - near).try_normalize()?.as_vec3()))
}

fn unproject_f64(world_from_clip: &DMat4, ndc: DVec3) -> Option<DVec3> {
    let p = *world_from_clip * ndc.extend(1.0);
    (p.w != 0.0).then(|| p.xyz() / p.w).filter(|p| p.is_finite())
}

fn finite(matrix: DMat4) -> Option<Mat4> {
    let matrix = matrix.as_mat4();
    matrix.is_finite().then_some(matrix)
}
