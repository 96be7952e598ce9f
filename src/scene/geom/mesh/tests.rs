use glam::{Mat4, Quat, Vec2, Vec3};

use super::*;
use crate::geom::{TessellateError, mesh::topology::place_ids};

/// A unit cube as eight shared vertices.
fn cube() -> Mesh {
    let positions: Vec<Vec3> = (0..8).map(|i| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32)).collect();
    let quads = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let indices = quads.iter().flat_map(|&[a, b, c, d]: &[u32; 4]| [a, b, c, a, c, d]).collect();
    let mut mesh = Mesh { normals: vec![Vec3::Y; 8], positions, uvs: Vec::new(), indices };
    mesh.smooth_normals();
    mesh
}

#[test]
fn cube_is_closed_and_measures_one() {
    let cube = cube();
    assert_eq!(cube.validate(), Ok(()));
    assert_eq!(cube.edge_report(), EdgeReport { edge_count: 18, ..EdgeReport::default() });
    assert!(cube.is_closed());
    assert!((cube.signed_volume() - 1.0).abs() < 1e-12);
    assert!((cube.area() - 6.0).abs() < 1e-12);
    assert_eq!(cube.bounds(), Aabb::from_corners(Vec3::ZERO, Vec3::ONE));
}

#[test]
fn edge_report_finds_each_fault() {
    let mut open = cube();
    open.indices.truncate(33);
    assert_eq!(open.edge_report().border_count, 3);
    let mut turned = cube();
    turned.indices.swap(0, 1);
    assert_eq!(turned.edge_report().inconsistent_count, 3);
    let mut doubled = cube();
    doubled.indices.extend([0, 4, 6]);
    assert_eq!(doubled.edge_report().non_manifold_count, 3);
    let mut collapsed = cube();
    collapsed.indices.extend([0, 0, 6]);
    assert_eq!(collapsed.edge_report().collapsed_count, 1);
    for bad in [open, turned, doubled] {
        assert!(!bad.is_closed());
    }
    assert!(!Mesh::default().is_closed());
}

#[test]
fn smooth_normals_do_not_depend_on_the_diagonals() {
    // Angle weights: every corner of a cube sees 90 degrees of each of its three faces, whichever way the faces are cut.
    for (p, n) in cube().positions.iter().zip(&cube().normals) {
        let expected = (*p - 0.5).normalize();
        assert!(n.distance(expected) < 1e-6, "{p}: {n}");
    }
}

#[test]
fn smooth_normals_are_shared_across_seams() {
    let mut split = cube();
    split.flat_normals();
    assert_eq!(split.vertex_count(), 36);
    split.smooth_normals();
    for (p, n) in split.positions.iter().zip(&split.normals) {
        assert!(n.distance((*p - 0.5).normalize()) < 1e-6);
    }
}

#[test]
fn creases_split_a_cube_into_its_faces() {
    let mut mesh = cube();
    mesh.crease(std::f32::consts::FRAC_PI_4);
    assert_eq!((mesh.vertex_count(), mesh.triangle_count()), (24, 12));
    assert!(mesh.is_closed());
    for t in mesh.triangles() {
        let normal = normals::face_normal(mesh.corners(t));
        assert!(t.iter().all(|&i| mesh.normals[i as usize].distance(normal) < 1e-6));
    }

    let mut mesh = cube();
    mesh.crease(std::f32::consts::PI * 0.75);
    assert_eq!(mesh.vertex_count(), 8);
    assert_eq!(mesh.validate(), Ok(()));
}

#[test]
fn mirrored_transform_keeps_front_faces_in_front() {
    let cube = cube();
    let rotation = Mat4::from_quat(Quat::from_xyzw(0.5, 0.5, 0.5, 0.5));
    for scale in [Vec3::new(2.0, 3.0, 0.5), Vec3::new(-2.0, 3.0, 0.5), Vec3::new(-2.0, -3.0, 0.5), Vec3::splat(-1.0)] {
        let m = Mat4::from_translation(Vec3::new(5.0, 6.0, 7.0)) * rotation * Mat4::from_scale(scale);
        let mut flat = cube.clone();
        flat.flat_normals();
        let moved = flat.transformed(m);
        assert_eq!(moved.validate(), Ok(()));
        assert!(moved.is_closed());
        assert!((moved.signed_volume() - f64::from(scale.x * scale.y * scale.z).abs()).abs() < 1e-4, "{}", moved.signed_volume());
        for t in moved.triangles() {
            let normal = normals::face_normal(moved.corners(t));
            assert!(t.iter().all(|&i| moved.normals[i as usize].dot(normal) > 0.999), "{scale}");
        }
    }
}

#[test]
fn normals_follow_the_inverse_transpose() {
    // A 45 degree slope flattened to half its height: the normal tilts up, (1, 1) becomes (1, 2).
    let mesh = Mesh {
        positions: vec![Vec3::ZERO, Vec3::Z, Vec3::new(-1.0, 1.0, 0.0)],
        normals: vec![Vec3::new(1.0, 1.0, 0.0).normalize(); 3],
        uvs: vec![],
        indices: vec![0, 2, 1],
    };
    let flattened = mesh.transformed(Mat4::from_scale(Vec3::new(1.0, 0.5, 1.0)));
    assert!(flattened.normals[0].distance(Vec3::new(1.0, 2.0, 0.0).normalize()) < 1e-6);
    let tiny = mesh.transformed(Mat4::from_scale(Vec3::new(1e-25, 0.5e-25, 1e-25)));
    assert!(tiny.normals[0].distance(flattened.normals[0]) < 1e-6, "{}", tiny.normals[0]);
    let singular = mesh.transformed(Mat4::from_scale(Vec3::new(1.0, 0.0, 1.0)));
    assert!(singular.normals[0].distance(Vec3::Y) < 1e-6);
    assert_eq!(mesh.transformed(Mat4::ZERO).normals[0], Vec3::Y);
}

#[test]
fn append_shifts_indices_and_fills_texture_coordinates() {
    let mut a = cube();
    let mut b = cube();
    b.uvs = vec![Vec2::ONE; 8];
    a.append(&b);
    assert_eq!(a.validate(), Ok(()));
    assert_eq!((a.vertex_count(), a.triangle_count()), (16, 24));
    assert_eq!((a.uvs[7], a.uvs[8]), (Vec2::ZERO, Vec2::ONE));
    b.append(&cube());
    assert_eq!((b.uvs[7], b.uvs[8]), (Vec2::ONE, Vec2::ZERO));
    assert_eq!(Mesh::merged([&cube(), &cube()]).vertex_count(), 16);
}

#[test]
fn compact_keeps_what_is_used() {
    let mut mesh = cube();
    mesh.uvs = mesh.positions.iter().map(|p| p.truncate()).collect();
    mesh.indices = vec![7, 3, 5];
    let corners = mesh.corners([7, 3, 5]);
    mesh.compact();
    assert_eq!(mesh.validate(), Ok(()));
    assert_eq!(mesh.vertex_count(), 3);
    let triangle = mesh.triangles().next().unwrap();
    assert_eq!(mesh.corners(triangle), corners);
    assert_eq!(triangle.map(|i| mesh.uvs[i as usize]), corners.map(|p| p.truncate()));
}

#[test]
fn places_treat_both_zeros_alike() {
    assert_eq!(place_ids(&[Vec3::ONE, Vec3::ZERO, Vec3::ONE, Vec3::new(-0.0, 0.0, -0.0)]), [0, 1, 0, 1]);
}

#[test]
fn weld_closes_a_soup_with_gaps() {
    let mut soup = cube();
    soup.flat_normals();
    for (i, p) in soup.positions.iter_mut().enumerate() {
        *p += Vec3::new((i % 3) as f32, (i % 5) as f32, (i % 7) as f32) * 1e-5;
    }
    assert!(!soup.is_closed());
    assert!(!soup.welded(0.0).is_closed());
    let welded = soup.welded(1e-3);
    assert!(welded.is_closed());
    assert_eq!((welded.vertex_count(), welded.triangle_count()), (8, 12));
    assert_eq!(welded.validate(), Ok(()));
    assert_eq!(soup.welded(10.0).triangle_count(), 0);
}

#[test]
fn validate_names_each_breach() {
    let with = |change: fn(&mut Mesh)| {
        let mut mesh = cube();
        change(&mut mesh);
        mesh.validate()
    };
    assert_eq!(with(|m| m.normals.truncate(7)), Err(MeshError::LengthMismatch { array: "normals", seen: 7, vertex_count: 8 }));
    assert_eq!(with(|m| m.uvs.push(Vec2::ZERO)), Err(MeshError::LengthMismatch { array: "uvs", seen: 1, vertex_count: 8 }));
    assert_eq!(with(|m| m.indices.truncate(35)), Err(MeshError::PartialTriangle { seen: 35 }));
    assert_eq!(with(|m| m.indices.clear()), Err(MeshError::NoTriangles));
    assert_eq!(with(|m| m.indices[4] = 8), Err(MeshError::IndexOutOfRange { triangle: 1, seen: 8, vertex_count: 8 }));
    assert!(matches!(with(|m| m.positions[3].y = f32::NAN), Err(MeshError::NotFinite { array: "position", vertex: 3, .. })));
    assert!(matches!(with(|m| m.normals[2].y = f32::INFINITY), Err(MeshError::NotFinite { array: "normal", vertex: 2, .. })));
    assert_eq!(with(|m| m.normals[5] = Vec3::Y * 2.0), Err(MeshError::NotUnit { vertex: 5, length: 2.0 }));
}

#[test]
fn tessellation_bounds_every_edge_and_leaves_no_cracks() {
    let mut mesh = cube().transformed(Mat4::from_scale(Vec3::new(5.0, 1.0, 0.2)));
    mesh.crease(0.5);
    mesh.uvs = mesh.positions.iter().map(|p| Vec2::new(p.x, p.y + p.z)).collect();
    let fine = mesh.tessellated(0.13, 1_000_000).unwrap();
    assert_eq!(fine.validate(), Ok(()));
    assert!(fine.is_closed());
    assert!((fine.signed_volume() - 1.0).abs() < 1e-5 && (fine.area() - mesh.area()).abs() < 1e-5);
    for t in fine.triangles() {
        let [a, b, c] = fine.corners(t);
        assert!(a.distance(b).max(b.distance(c)).max(c.distance(a)) <= 0.13);
    }
    for (p, uv) in fine.positions.iter().zip(&fine.uvs) {
        assert!(uv.distance(Vec2::new(p.x, p.y + p.z)) < 1e-5);
    }
    assert_eq!(mesh.tessellated(100.0, 1_000_000).unwrap(), mesh);
}

#[test]
fn tessellation_refuses_what_it_cannot_hold() {
    assert_eq!(cube().tessellated(0.0, 1000), Err(TessellateError::EdgeLength { seen_m: 0.0 }));
    assert!(matches!(cube().tessellated(f32::NAN, 1000), Err(TessellateError::EdgeLength { .. })));
    assert_eq!(cube().tessellated(1e-3, 1000), Err(TessellateError::TooManyTriangles { max_triangles: 1000 }));
}

#[test]
fn directions_are_unit_at_every_scale() {
    for exponent in -149..=127 {
        let scale = libm::exp2f(exponent as f32);
        for v in [Vec3::new(1.0, 0.0, 0.0), Vec3::new(1.0, -1.0, 1.0), Vec3::new(0.6, 0.0, 0.8) * 1.5] {
            let unit = direction(v * scale);
            // The smallest numbers have few digits left, so what is asked is a unit vector along what they say.
            assert!((unit.length() - 1.0).abs() < 1e-6, "{v} * 2^{exponent}: {unit}");
        }
    }
    for none in [Vec3::ZERO, Vec3::NAN, Vec3::new(f32::INFINITY, 0.0, 1.0)] {
        assert_eq!(direction(none), Vec3::ZERO);
    }
}
