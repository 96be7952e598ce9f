//! Axes, ranges and round trips.

use super::*;

fn close(got: Vec3, expected: Vec3, tolerance: f32) {
    assert!((got - expected).abs().max_element() <= tolerance, "got {got}, expected {expected}");
}

#[test]
fn look_at_puts_the_target_ahead_and_up_above() {
    let (eye, target) = (Vec3::new(3.0, 2.0, 1.0), Vec3::new(3.0, 2.0, -9.0));
    let view = look_at(eye, target, Vec3::Y).unwrap();
    close(view.transform_point3(eye), Vec3::ZERO, 1e-6);
    close(view.transform_point3(target), Vec3::new(0.0, 0.0, -10.0), 1e-6);
    close(view.transform_point3(eye + Vec3::Y), Vec3::Y, 1e-6);
    close(view.transform_point3(eye + Vec3::X), Vec3::X, 1e-6);

    // From above, looking down +x: right is then +z.
    let view = look_at(Vec3::ZERO, Vec3::X, Vec3::Y).unwrap();
    close(view.transform_vector3(Vec3::Z), Vec3::X, 1e-6);
    assert!((view.determinant() - 1.0).abs() < 1e-6);
}

#[test]
fn look_at_refuses_what_has_no_direction() {
    assert_eq!(look_at(Vec3::ONE, Vec3::ONE, Vec3::Y), None);
    assert_eq!(look_at(Vec3::ZERO, Vec3::Y, Vec3::Y), None);
    assert_eq!(look_at(Vec3::ZERO, Vec3::X, Vec3::ZERO), None);
    assert_eq!(look_at(Vec3::splat(f32::NAN), Vec3::X, Vec3::Y), None);
    assert_eq!(look_to(Vec3::ZERO, Vec3::new(f32::INFINITY, 0.0, 0.0), Vec3::Y), None);
}

#[test]
fn perspective_maps_the_frustum_to_the_clip_volume() {
    let clip_from_view = perspective(90_f32.to_radians(), 2.0, 0.1, 50.0).unwrap();
    close(clip_from_view.project_point3(Vec3::new(0.0, 0.0, -0.1)), Vec3::ZERO, 1e-6);
    close(clip_from_view.project_point3(Vec3::new(20.0, 10.0, -10.0)), Vec3::new(1.0, 1.0, 50.0 * 9.9 / (10.0 * 49.9)), 1e-6);
    close(clip_from_view.project_point3(Vec3::new(-100.0, -50.0, -50.0)), Vec3::new(-1.0, -1.0, 1.0), 1e-6);
    assert_eq!(clip_from_view.mul_vec4(glam::Vec4::new(1.0, 2.0, -3.0, 1.0)).w, 3.0);
    for distance in [0.1, 1.0, 7.5, 50.0] {
        let depth = clip_from_view.project_point3(Vec3::new(0.0, 0.0, -distance)).z;
        assert!((perspective_distance_m(depth, 0.1, 50.0) / distance - 1.0).abs() < 1e-4);
    }
}

#[test]
fn perspective_reaches_infinity() {
    let clip_from_view = perspective(1.0, 1.0, 0.5, f32::INFINITY).unwrap();
    assert_eq!(clip_from_view.project_point3(Vec3::new(0.0, 0.0, -0.5)).z, 0.0);
    assert!((clip_from_view.project_point3(Vec3::new(0.0, 0.0, -1e6)).z - 1.0).abs() < 1e-6);
    assert!((perspective_distance_m(0.75, 0.5, f32::INFINITY) - 2.0).abs() < 1e-6);
}

#[test]
fn perspective_refuses_what_is_no_frustum() {
    for (fov, aspect, near, far) in [
        (0.0, 1.0, 0.1, 1.0),
        (3.2, 1.0, 0.1, 1.0),
        (1.0, 0.0, 0.1, 1.0),
        (1.0, 1.0, 0.0, 1.0),
        (1.0, 1.0, 2.0, 1.0),
        (1.0, 1.0, f32::NAN, 1.0),
        (1.0, 1.0, f32::INFINITY, f32::INFINITY),
    ] {
        assert_eq!(perspective(fov, aspect, near, far), None);
    }
}

#[test]
fn orthographic_maps_its_box() {
    let clip_from_view = orthographic(Vec3::new(-2.0, -1.0, -30.0), Vec3::new(4.0, 3.0, -10.0)).unwrap();
    close(clip_from_view.project_point3(Vec3::new(-2.0, -1.0, -10.0)), Vec3::new(-1.0, -1.0, 0.0), 1e-6);
    close(clip_from_view.project_point3(Vec3::new(4.0, 3.0, -30.0)), Vec3::new(1.0, 1.0, 1.0), 1e-6);
    assert_eq!(orthographic(Vec3::ZERO, Vec3::new(1.0, 0.0, 1.0)), None);
    assert_eq!(orthographic(Vec3::ZERO, Vec3::new(1.0, f32::NAN, 1.0)), None);
}

#[test]
fn rotations_turn_anticlockwise() {
    let quarter = std::f32::consts::FRAC_PI_2;
    close(rotation(Vec3::Y * 3.0, quarter).unwrap() * Vec3::Z, Vec3::X, 1e-7);
    close(rotation_quat(Vec3::Y * 3.0, quarter).unwrap() * Vec3::Z, Vec3::X, 1e-6);
    assert_eq!(rotation(Vec3::ZERO, 1.0), None);
    assert_eq!(rotation_quat(Vec3::ZERO, 1.0), None);
    let axis = Vec3::new(1.0, -2.0, 0.5);
    let matrix = rotation(axis, 0.7).unwrap();
    close(matrix * axis, axis, 1e-6);
    close(matrix * Vec3::X, rotation_quat(axis, 0.7).unwrap() * Vec3::X, 1e-6);
    assert!((matrix.determinant() - 1.0).abs() < 1e-6);
}

#[test]
fn euler_angles_apply_x_then_y_then_z_and_are_exact_at_right_angles() {
    assert_eq!(rotation_euler_deg(Vec3::new(90.0, 0.0, 0.0)) * Vec3::Y, Vec3::Z);
    assert_eq!(rotation_euler_deg(Vec3::new(0.0, 90.0, 0.0)) * Vec3::Z, Vec3::X);
    assert_eq!(rotation_euler_deg(Vec3::new(0.0, 0.0, -270.0)) * Vec3::X, Vec3::Y);
    assert_eq!(rotation_euler_deg(Vec3::splat(360.0)), Mat3::IDENTITY);
    let angles = Vec3::new(20.0, -35.0, 110.0);
    let by_axes = rotation(Vec3::Z, angles.z.to_radians()).unwrap()
        * rotation(Vec3::Y, angles.y.to_radians()).unwrap()
        * rotation(Vec3::X, angles.x.to_radians()).unwrap();
    close(rotation_euler_deg(angles) * Vec3::new(1.0, 2.0, 3.0), by_axes * Vec3::new(1.0, 2.0, 3.0), 1e-6);
}

#[test]
fn directions_and_transforms() {
    assert_eq!(direction_deg(0.0, 0.0), Vec3::X);
    assert_eq!(direction_deg(90.0, 0.0), Vec3::Z);
    assert_eq!(direction_deg(123.0, 90.0), Vec3::Y);
    let world_from_object = transform(Vec3::new(2.0, 1.0, 1.0), rotation_euler_deg(Vec3::new(0.0, 90.0, 0.0)), Vec3::Y);
    close(world_from_object.transform_point3(Vec3::X), Vec3::new(0.0, 1.0, -2.0), 1e-6);
}

#[test]
fn orthonormal_basis_is_right_handed_for_any_unit_vector() {
    for n in [Vec3::X, Vec3::Y, Vec3::Z, -Vec3::Z, Vec3::new(0.6, 0.0, -0.8), Vec3::new(1e-4, 1e-4, -1.0).normalize()] {
        let (t, b) = orthonormal_basis(n);
        close(t.cross(b), n, 1e-6);
        assert!((t.length() - 1.0).abs() < 1e-6 && (b.length() - 1.0).abs() < 1e-6 && t.dot(b).abs() < 1e-6);
    }
}

#[test]
fn inverse_undoes_a_camera() {
    let clip_from_world = perspective(0.8, 1.5, 0.01, 1e4).unwrap() * look_at(Vec3::new(3.0, 4.0, 5.0), Vec3::ZERO, Vec3::Y).unwrap();
    let world_from_clip = invert(&clip_from_world).unwrap();
    let p = Vec3::new(0.3, -0.2, 1.1);
    close(unproject(&world_from_clip, clip_from_world.project_point3(p)).unwrap(), p, 0.1);
    assert_eq!(invert(&Mat4::ZERO), None);
    assert_eq!(invert(&Mat4::from_cols_array(&[f32::NAN; 16])), None);
}

#[test]
fn rays_go_through_what_projects_to_their_pixel() {
    let eye = Vec3::new(3.0, 4.0, 5.0);
    let size = Vec2::new(640.0, 480.0);
    let view = look_at(eye, Vec3::ZERO, Vec3::Y).unwrap();
    for far in [100.0, f32::INFINITY] {
        let clip_from_world = perspective(0.8, size.x / size.y, 0.1, far).unwrap() * view;
        let world_from_clip = invert(&clip_from_world).unwrap();
        let p = Vec3::new(0.5, -0.7, 1.0);
        let px = px_from_ndc(clip_from_world.project_point3(p).truncate(), size);
        let (origin, direction) = ray_through_px(&world_from_clip, px, size).unwrap();
        let offset = (p - eye) - direction * (p - eye).dot(direction);
        assert!(offset.length() < 1e-4, "far {far}: off by {}", offset.length());
        assert!((view.transform_point3(origin).z + 0.1).abs() < 1e-5);
    }
}

#[test]
fn pixels_have_y_down() {
    let size = Vec2::new(200.0, 100.0);
    assert_eq!(px_from_ndc(Vec2::new(-1.0, 1.0), size), Vec2::ZERO);
    assert_eq!(px_from_ndc(Vec2::new(1.0, -1.0), size), size);
    assert_eq!(ndc_from_px(Vec2::new(150.0, 25.0), size), Vec2::new(0.5, 0.5));
}
