//! The five scenes of the paper: a body of glass in a room, under a lamp.
//!
//! Eye, lamp, floor, size and index of the body are those of the authors' own program. The lamp hangs above the body. Our light's view holds the box
//! of the scene; walls around the floor stand for the ground that the paper's lamp sees beside the floor, so that the view opens by 90 degrees and
//! is as full as theirs. The wall on the side of the eye is left out.

use std::path::Path;

use anyhow::Context as _;
use glam::{Vec2, Vec3};
use serde::Serialize;

use crate::caustics::Techniques;
use crate::geom::Mesh;
use crate::geom::shapes::{Lathe, TorusKnot, UvSphere};
use crate::scene::mesh_file::{MeshLimits, read_mesh};
use crate::scene::{Material, Object, Scene, Shape, Transform};

/// The room, without the bodies.
const ROOM: &str = "(
    title: \"Glass in a room\",
    image: (width: 512, height: 512),
    camera: Perspective(position: (0, 0, 5), target: (0, 0, 0), fov_deg: 90, near_m: 2, far_m: 25),
    lights: [Point(position: (0, 5, 0), intensity: (400, 400, 400))],
    objects: [
        (name: \"floor\", shape: Grid(size_m: (7.2, 7.2)), transform: (translate: (0, -3.5, 0))),
        (name: \"back\", shape: Grid(size_m: (7.2, 4.9)), transform: (translate: (0, -1.05, -3.6), rotate_deg: (90, 0, 0))),
        (name: \"left\", shape: Grid(size_m: (4.9, 7.2)), transform: (translate: (-3.6, -1.05, 0), rotate_deg: (0, 0, -90))),
        (name: \"right\", shape: Grid(size_m: (4.9, 7.2)), transform: (translate: (3.6, -1.05, 0), rotate_deg: (0, 0, 90))),
    ],
)";

/// Refractive index of all bodies.
const IOR: f32 = 1.2;

/// Largest extent of a body of which there is only one, m.
const EXTENT_M: f32 = 2.8;

/// Bodies of glass in a scene of the paper.
pub struct Body {
    /// Its file among the models; a body without a file is procedural in any case.
    pub file: Option<&'static str>,
    /// What stands for it without models.
    pub shape: fn() -> Shape,
    /// Its middle, m.
    pub place: Vec3,
    /// Its largest extent, m.
    pub extent_m: f32,
}

/// The body of a scene with one.
const fn alone(file: &'static str, shape: fn() -> Shape) -> Body {
    Body { file: Some(file), shape, place: Vec3::ZERO, extent_m: EXTENT_M }
}

/// A scene of the paper.
pub struct PaperScene {
    /// The paper's name of it.
    pub name: &'static str,
    /// Triangles that the paper gives.
    pub triangles: u32,
    /// Bodies of glass.
    pub bodies: &'static [Body],
    /// Frames per second by number of photons and method, see [`super::rates::PHOTONS`] and [`super::rates::METHODS`].
    pub frames: [[f64; 3]; 2],
}

/// The scenes in the paper's order.
pub const SCENES: [PaperScene; 5] = [
    PaperScene {
        name: "Ball & Dragon",
        triangles: 256_000,
        bodies: &[
            Body { file: Some("dragon_250k.ply"), shape: dragon, place: Vec3::new(-0.8, 0.0, 0.0), extent_m: EXTENT_M },
            Body { file: None, shape: ball, place: Vec3::new(1.6, 0.0, 0.0), extent_m: 1.4 },
        ],
        frames: [[25.1, 21.5, 19.5], [11.3, 9.5, 8.0]],
    },
    PaperScene {
        name: "Beethoven",
        triangles: 5_000,
        bodies: &[alone("beethoven_5k.ply", beethoven)],
        frames: [[49.4, 27.7, 38.8], [13.4, 7.9, 11.1]],
    },
    PaperScene {
        name: "Buddha",
        triangles: 50_000,
        bodies: &[alone("buddha_50k.ply", buddha)],
        frames: [[35.1, 25.6, 26.8], [13.5, 8.6, 8.5]],
    },
    PaperScene {
        name: "Bunny",
        triangles: 70_000,
        bodies: &[alone("bunny_70k_closed.ply", bunny)],
        frames: [[30.8, 26.4, 27.6], [12.9, 9.6, 10.3]],
    },
    PaperScene {
        name: "Gargoyle",
        triangles: 205_000,
        bodies: &[alone("gargoyle_20k.ply", gargoyle)],
        frames: [[16.3, 13.3, 14.1], [8.4, 6.4, 6.2]],
    },
];

fn dragon() -> Shape {
    Shape::TorusKnot(TorusKnot { segments: 2600, sides: 48, ..TorusKnot::default() })
}

fn ball() -> Shape {
    Shape::UvSphere(UvSphere { radius_m: 0.7, slices: 80, stacks: 40 })
}

/// A bust on a foot.
fn beethoven() -> Shape {
    let profile = [
        (0.0, 0.0),
        (0.32, 0.0),
        (0.32, 0.0),
        (0.30, 0.08),
        (0.20, 0.16),
        (0.24, 0.24),
        (0.42, 0.36),
        (0.46, 0.46),
        (0.30, 0.56),
        (0.13, 0.62),
        (0.15, 0.68),
        (0.25, 0.78),
        (0.27, 0.90),
        (0.20, 1.02),
        (0.0, 1.08),
    ];
    Shape::Lathe(Lathe { profile: profile.map(Vec2::from).to_vec(), steps: 4, slices: 52 })
}

fn buddha() -> Shape {
    Shape::TorusKnot(TorusKnot { p: 3, q: 2, tube_radius_m: 0.12, segments: 520, sides: 48, ..TorusKnot::default() })
}

fn bunny() -> Shape {
    Shape::UvSphere(UvSphere { radius_m: 1.4, slices: 264, stacks: 132 })
}

fn gargoyle() -> Shape {
    Shape::TorusKnot(TorusKnot { p: 3, q: 4, segments: 2135, sides: 48, ..TorusKnot::default() })
}

/// Bodies that a scene was made of.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Made {
    /// The file or the kind of shape.
    pub mesh: String,
    /// Its triangles.
    pub triangles: usize,
}

/// Makes a scene with the models of a folder, or without models.
///
/// # Errors
/// If a model cannot be read.
pub fn make(paper: &PaperScene, models: Option<&Path>, techniques: Techniques) -> anyhow::Result<(Scene, Vec<Made>)> {
    let mut scene = techniques.parse(ROOM, paper.name, models.unwrap_or(Path::new("")))?;
    let mut made = Vec::new();
    for body in paper.bodies {
        let (shape, name, mesh) = match (models, body.file) {
            (Some(folder), Some(file)) => {
                let mesh = read_mesh(&folder.join(file), &MeshLimits::default()).context("a model cannot be read")?;
                (Shape::Mesh(file.into()), file.to_owned(), mesh)
            }
            _ => {
                let shape = (body.shape)();
                let mesh = shape.build().context("a procedural shape")??;
                (shape.clone(), kind(&shape), mesh)
            }
        };
        made.push(Made { mesh: name, triangles: mesh.triangle_count() });
        let transform = placed(&mesh, body);
        scene.objects.push(Object { name: "glass".to_owned(), shape, transform, material: glass() });
    }
    scene.validate().map_err(|invalid| scene.source.value_error(invalid))?;
    Ok((scene, made))
}

fn glass() -> Material {
    Material::Dielectric { ior: IOR, abbe: None, absorption: Vec3::ZERO }
}

/// The name of a procedural shape's kind.
fn kind(shape: &Shape) -> String {
    let whole = format!("{shape:?}");
    whole.split('(').next().unwrap_or_default().to_owned()
}

/// Where a body stands: its box in the middle of its place, and as large as it should be.
fn placed(mesh: &Mesh, body: &Body) -> Transform {
    let bounds = mesh.bounds();
    let scale = body.extent_m / bounds.size().max_element();
    Transform { translate: body.place - bounds.center() * scale, scale: Vec3::splat(scale), ..Transform::default() }
}

#[cfg(test)]
mod tests {
    use crate::caustics::TECHNIQUES;

    use super::*;

    #[test]
    fn procedural_meshes_are_about_as_fine_as_the_papers() {
        for paper in &SCENES {
            let (scene, made) = make(paper, None, TECHNIQUES).unwrap();
            let triangles: usize = made.iter().map(|made| made.triangles).sum();
            let ratio = triangles as f64 / f64::from(paper.triangles);
            assert!((ratio - 1.0).abs() < 0.1, "{}: {triangles} of {}", paper.name, paper.triangles);
            // Each is closed, centred and of its size, and the lamp sees all of it within the 90 degrees that the walls ask for.
            for (index, body) in (4..scene.objects.len()).zip(paper.bodies) {
                let mesh = scene.mesh(index).unwrap();
                assert!(mesh.is_closed(), "{}: {:?}", paper.name, mesh.edge_report());
                let bounds = mesh.transformed(scene.objects[index].transform.world_from_object()).bounds();
                assert!((bounds.size().max_element() - body.extent_m).abs() < 1.0e-4 && bounds.center().distance(body.place) < 1.0e-4);
                assert!(bounds.max.y <= 1.4 + 1.0e-4 && bounds.max.x.max(-bounds.min.x) < 2.4, "{}: {bounds:?}", paper.name);
            }
        }
    }

    #[test]
    fn models_are_read_from_their_folder_and_a_missing_one_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("beethoven_5k.ply");
        let tetrahedron = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 4\n\
             property list uchar int vertex_indices\nend_header\n0 0 0\n7 0 0\n0 7 0\n0 0 7\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n";
        std::fs::write(&path, tetrahedron).unwrap();
        let (scene, made) = make(&SCENES[1], Some(folder.path()), TECHNIQUES).unwrap();
        assert_eq!(made, [Made { mesh: "beethoven_5k.ply".to_owned(), triangles: 4 }]);
        assert_eq!(scene.mesh(4).unwrap().triangle_count(), 4);
        assert!((scene.objects[4].transform.scale.x - 0.4).abs() < 1.0e-6);
        // Missing, and not a mesh.
        let refused = |index: usize| format!("{:#}", make(&SCENES[index], Some(folder.path()), TECHNIQUES).unwrap_err());
        assert!(refused(2).contains(&folder.path().join("buddha_50k.ply").display().to_string()), "{}", refused(2));
        std::fs::write(&path, "ply\n").unwrap();
        assert!(refused(1).contains("beethoven_5k.ply"), "{}", refused(1));
    }
}
