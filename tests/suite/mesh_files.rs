//! Mesh files made by hand: what each format can say, every way in which it can be wrong, and random damage.

use std::{
    fs,
    path::{Path, PathBuf},
};

use glam::{Vec2, Vec3};
use nephroid::{
    geom::Mesh,
    scene::mesh_file::{MeshFileError, MeshFileProblem, MeshLimits, Place, gltf, obj, ply, read_mesh},
};
use proptest::prelude::*;

use crate::support::program;

const SMALL: MeshLimits = MeshLimits { max_vertices: 10_000, max_triangles: 20_000, max_file_bytes: 1 << 20 };

fn read_ply(bytes: impl AsRef<[u8]>) -> Result<Mesh, MeshFileError> {
    checked(ply::from_bytes(Path::new("a.ply"), bytes.as_ref(), &SMALL))
}

fn read_obj(bytes: impl AsRef<[u8]>) -> Result<Mesh, MeshFileError> {
    checked(obj::from_bytes(Path::new("a.obj"), bytes.as_ref(), &SMALL))
}

fn read_gltf(bytes: impl AsRef<[u8]>) -> Result<Mesh, MeshFileError> {
    checked(gltf::from_bytes(Path::new("a.gltf"), bytes.as_ref(), None, &SMALL))
}

/// Whatever a reader lets through must be a mesh.
fn checked(read: Result<Mesh, MeshFileError>) -> Result<Mesh, MeshFileError> {
    if let Ok(mesh) = &read {
        assert_eq!(mesh.validate(), Ok(()));
    }
    read
}

/// What fuzzing started from and what it has found.
#[test]
fn corpora_of_the_fuzz_targets_give_a_mesh_or_an_error() {
    let corpus = |format: &str| {
        let folder = crate::support::path("fuzz/corpus").join(format);
        let files = fs::read_dir(folder).expect("a corpus").map(|entry| fs::read(entry.expect("an entry").path()).expect("a file"));
        files.collect::<Vec<_>>()
    };
    let meshes = corpus("ply").iter().filter(|bytes| read_ply(bytes).is_ok()).count()
        + corpus("obj").iter().filter(|bytes| read_obj(bytes).is_ok()).count()
        + corpus("gltf").iter().filter(|bytes| read_gltf(bytes).is_ok()).count();
    assert!(meshes >= 6, "only {meshes} files gave a mesh");
}

fn message(read: Result<Mesh, MeshFileError>) -> String {
    read.expect_err("the file is broken").to_string()
}

// ---- PLY

const PLY_SQUARE: &str = "ply
format ascii 1.0
comment two triangles and what else exporters write
obj_info nothing
element vertex 4
property float x
property float y
property float z
property uchar red
property float nx
property float ny
property float nz
property float s
property float t
element face 1
property list uchar int vertex_indices
property int material
element edge 1
property int vertex1
property int vertex2
end_header
0 0 0 255 0 0 2 0 0
1 0 0 255 0 0 2 1 0
1 1 .0 255 0 0 2 1. 1
0 1 0 255 0 0 2 0 1e0

4 0 1 2 3 7
0 1
";

fn check_square(mesh: &Mesh) {
    assert_eq!((mesh.vertex_count(), mesh.triangle_count()), (4, 2));
    assert_eq!(mesh.positions, [Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y]);
    assert_eq!(mesh.indices, [0, 1, 2, 0, 2, 3]);
    assert!(mesh.normals.iter().all(|n| n.distance(Vec3::Z) < 1e-6), "{:?}", mesh.normals);
}

#[test]
fn ply_ascii_with_everything() {
    let mesh = read_ply(PLY_SQUARE).unwrap();
    check_square(&mesh);
    assert_eq!(mesh.uvs, [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y]);
    check_square(&read_ply(PLY_SQUARE.replace('\n', "\r\n")).unwrap());
}

/// The square as a binary file: doubles, a colour, a list per vertex, faces with a short index type.
fn binary_square(big_endian: bool) -> Vec<u8> {
    let order = if big_endian { "big" } else { "little" };
    let mut file = format!(
        "ply\nformat binary_{order}_endian 1.0\nelement vertex 4\nproperty double x\nproperty double y\nproperty float z\nproperty uchar alpha\n\
         property list uchar short tags\nelement face 2\nproperty list uint ushort vertex_index\nend_header\n"
    )
    .into_bytes();
    let mut put = |little: &[u8]| {
        let mut bytes = little.to_vec();
        if big_endian {
            bytes.reverse();
        }
        file.extend(bytes);
    };
    for (x, y) in [(0.0_f64, 0.0_f64), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)] {
        put(&x.to_le_bytes());
        put(&y.to_le_bytes());
        put(&0.0_f32.to_le_bytes());
        put(&[9]);
        put(&[2]);
        put(&1_i16.to_le_bytes());
        put(&2_i16.to_le_bytes());
    }
    for face in [[0_u16, 1, 2], [0, 2, 3]] {
        put(&3_u32.to_le_bytes());
        face.iter().for_each(|i| put(&i.to_le_bytes()));
    }
    file
}

#[test]
fn ply_binary_in_both_byte_orders() {
    check_square(&read_ply(binary_square(false)).unwrap());
    check_square(&read_ply(binary_square(true)).unwrap());
}

#[test]
fn ply_faces_may_come_first_and_strips_are_read() {
    let faces_first = "ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int vertex_indices\nelement vertex 4\nproperty float x\n\
                       property float y\nproperty float z\nend_header\n4 0 1 2 3\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n";
    check_square(&read_ply(faces_first).unwrap());
    let strips = "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\nelement tristrips 1\n\
                  property list int int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n0 2 0\n9 0 1 2 3 4 -1 0 1 2\n";
    let mesh = read_ply(strips).unwrap();
    assert_eq!(mesh.indices, [0, 1, 2, 2, 1, 3, 2, 3, 4, 0, 1, 2]);
    assert!(mesh.normals.iter().all(|n| n.distance(Vec3::Z) < 1e-6));
}

#[test]
fn ply_concave_polygon_keeps_its_area() {
    let arrow = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n\
                 property list uchar int vertex_indices\nend_header\n0 0 0\n2 1 0\n4 0 0\n2 5 0\n4 0 1 2 3\n";
    let mesh = read_ply(arrow).unwrap();
    assert!((mesh.area() - 8.0).abs() < 1e-6, "{}", mesh.area());
}

#[test]
fn unused_vertices_go_and_useless_normals_are_replaced() {
    let mesh = read_ply(PLY_SQUARE.replace("4 0 1 2 3 7", "3 0 2 3 7").replace("0 1 0 255 0 0 2", "0 1 0 255 0 0 0")).unwrap();
    assert_eq!((mesh.vertex_count(), mesh.triangle_count()), (3, 1));
    assert!(mesh.normals.iter().all(|n| n.distance(Vec3::Z) < 1e-6));
    let mesh = read_ply(PLY_SQUARE.replace("0 1 0 255 0 0 2", "0 1 0 255 nan 0 2")).unwrap();
    assert!(mesh.normals.iter().all(|n| n.distance(Vec3::Z) < 1e-6));
}

#[test]
fn ply_errors_name_line_value_and_what_is_allowed() {
    let with = |from: &str, to: &str| {
        assert!(PLY_SQUARE.contains(from), "{from}");
        message(read_ply(PLY_SQUARE.replacen(from, to, 1)))
    };
    assert_eq!(message(read_ply("")), "a.ply:1: expected \"ply\", saw the end of the file");
    assert_eq!(message(read_ply("solid cube")), "a.ply:1: expected \"ply\", saw \"solid cube\"");
    assert_eq!(with("ascii 1.0", "ascii 2.0"), "a.ply:2: PLY version \"2.0\" is not supported: must be 1.0");
    assert_eq!(with("ascii", "text"), "a.ply:2: expected ascii, binary_little_endian or binary_big_endian, saw \"text\"");
    assert_eq!(with("element vertex 4", "element vertex -4"), "a.ply:5: expected a count, a whole number from 0, saw \"-4\"");
    assert_eq!(
        with("float x", "half x"),
        "a.ply:6: expected a number type (char, uchar, short, ushort, int, uint, float, double or int8 to float64), saw \"half\""
    );
    assert_eq!(with("float y", "float why"), "a.ply:5: expected a scalar vertex property y, saw none");
    assert_eq!(with("element vertex", "element vortex"), "a.ply:21: expected an element named vertex in the header, saw none");
    assert_eq!(
        with("list uchar int vertex_indices", "list uchar int corners"),
        "a.ply:15: expected a list property vertex_indices or vertex_index of element face, saw none"
    );
    assert_eq!(with("list uchar", "list float"), "a.ply:16: expected an integer type for the count of a list, saw \"float\"");
    assert_eq!(
        with("end_header", "the end"),
        "a.ply:21: expected format, comment, obj_info, element, property or end_header, saw \"the end\""
    );
    assert_eq!(with("1 1 .0", "1 nan .0"), "a.ply:24: vertex 2: y is NaN: must be finite");
    assert_eq!(with("1 1 .0", "1 -1e39 .0"), "a.ply:24: vertex 2: y is -inf: must be finite");
    assert_eq!(with("1 1 .0", "1 one .0"), "a.ply:24: expected a number for property y, saw \"one\"");
    assert_eq!(with("1 1 .0 255 0 0 2 1. 1", "1 1"), "a.ply:24: expected a number for property z, saw the end of the line");
    assert_eq!(with("4 0 1 2 3 7", "4 0 1 2 4 7"), "a.ply:27: face 0: vertex index is 4: must be 0 to 3 (the file has 4 vertices)");
    assert_eq!(with("4 0 1 2 3 7", "4 0 1 -2 3 7"), "a.ply:27: face 0: vertex index is -2: must be 0 to 3 (the file has 4 vertices)");
    assert_eq!(with("4 0 1 2 3 7", "4 0 1 2.5 3 7"), "a.ply:27: expected face 0: vertex index, a whole number, saw 2.5");
    assert_eq!(with("4 0 1 2 3 7", "-4 0 1 2 3 7"), "a.ply:27: length of list vertex_indices is -4: must be a whole number from 0");
    assert_eq!(with("4 0 1 2 3 7", "2 0 1 7"), "a.ply: no triangles: at least 1 is needed");
    assert_eq!(with("element vertex 4", "element vertex 20000"), "a.ply:5: 20000 vertices: at most 10000 are allowed");
    // The text ends: the last element's line is missing.
    assert_eq!(
        with("\n0 1\n", "\n"),
        "a.ply:27: element edge (declared 1 times in line 18) needs 3 bytes, but only 0 are there: the file is truncated or the count is wrong"
    );
}

#[test]
fn a_count_of_a_billion_takes_no_memory() {
    let huge = |count: &str, format: &str, limits: &MeshLimits| {
        let mut file = format!("ply\nformat {format} 1.0\nelement vertex {count}\nproperty float x\nproperty float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n").into_bytes();
        file.extend([0; 800]);
        ply::from_bytes(Path::new("a.ply"), &file, limits).unwrap_err()
    };
    let unlimited = MeshLimits { max_vertices: u64::MAX, max_triangles: u64::MAX, max_file_bytes: u64::MAX };
    for format in ["ascii", "binary_little_endian", "binary_big_endian"] {
        assert!(matches!(
            huge("1000000000", format, &MeshLimits::default()).problem,
            MeshFileProblem::TooLarge { seen: 1_000_000_000, .. }
        ));
        assert!(matches!(huge("1000000000", format, &unlimited).problem, MeshFileProblem::Truncated { .. }));
        assert!(matches!(huge("18446744073709551615", format, &unlimited).problem, MeshFileProblem::TooLarge { .. }));
    }
    // An element without properties has no bytes to check: it must cost nothing either.
    let empty = PLY_SQUARE.replace("element vertex 4", "element nothing 18446744073709551615\nelement vertex 4");
    check_square(&read_ply(empty).unwrap());
    // A list that promises four billion numbers.
    let mut list = b"ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nelement face 1\nproperty list uint int vertex_indices\nend_header\n".to_vec();
    list.extend([0; 12]);
    list.extend(u32::MAX.to_le_bytes());
    list.extend([0; 100]);
    let error = read_ply(&list).unwrap_err();
    assert!(matches!(error.problem, MeshFileProblem::Truncated { needed: 17_179_869_180, present: 100, .. }), "{error}");
}

#[test]
fn every_truncation_is_an_error() {
    let whole = binary_square(false);
    for length in 0..whole.len() {
        assert!(read_ply(&whole[..length]).is_err(), "{length} of {} bytes", whole.len());
    }
    let end = whole.len() - 1;
    let error = read_ply(&whole[..end]).unwrap_err();
    assert!(matches!(error.at, Place::Byte(_)), "{error}");
    assert!(error.to_string().contains("truncated"), "{error}");
    for length in 0..PLY_SQUARE.len() - "0 1\n".len() {
        assert!(read_ply(&PLY_SQUARE[..length]).is_err(), "{length}");
    }
}

// ---- OBJ

const OBJ_SQUARE: &str = "# a comment
mtllib none.mtl
o first
v 0 0 0
v 1 0 0 1.0
v 1 1 0 0.5 0.5 0.5
v 0 1 0
vt 0 0
vt 1 0 0
vt 1 1
vt 0 1
vn 0 0 3
usemtl stone
s 1
f 1/1/1 2/2/1 \\
  3/3/1 4/4/1 # a quad on two lines
l 1 2 3
p 1
";

#[test]
fn obj_with_everything() {
    let mesh = read_obj(OBJ_SQUARE).unwrap();
    check_square(&mesh);
    assert_eq!(mesh.uvs, [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y]);
    check_square(&read_obj(OBJ_SQUARE.replace('\n', "\r\n")).unwrap());
}

#[test]
fn obj_relative_indices_and_missing_parts() {
    check_square(&read_obj("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf -4 -3 -2 -1\n").unwrap());
    // Faces before the vertices they name, normals on some corners only.
    check_square(&read_obj("f 1 2 3\nf 1//1 3//1 4\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvn 0 0 1\n").map(|m| m.welded(0.0)).unwrap());
    // A texture coordinate with one number, and corners without any.
    let mesh = read_obj("v 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0.5\nf 1/1 2 3\n").unwrap();
    assert_eq!(mesh.uvs, [Vec2::new(0.5, 0.0), Vec2::ZERO, Vec2::ZERO]);
}

#[test]
fn obj_objects_are_merged_and_corners_split_where_they_differ() {
    let text = "o a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf 1//1 2//1 3//1\no b\nv 0 0 1\nvn 1 0 0\ng c\nf 1//2 3//2 4//2\n";
    let mesh = read_obj(text).unwrap();
    // Vertices 1 and 3 have two normals each.
    assert_eq!((mesh.vertex_count(), mesh.triangle_count()), (6, 2));
    assert_eq!(mesh.positions.iter().filter(|p| **p == Vec3::ZERO).count(), 2);
    let triangles: Vec<[u32; 3]> = mesh.triangles().collect();
    assert_eq!(triangles[1].map(|i| mesh.normals[i as usize]), [Vec3::X; 3]);
}

#[test]
fn obj_normals_without_any_are_smooth_across_texture_seams() {
    let roof = "v 0 0 0\nv 0 0 1\nv 1 1 0\nv 1 1 1\nv 2 0 0\nv 2 0 1\nvt 0 0\nvt 1 1\nf 1/1 2/1 4/1 3/1\nf 3/2 4/2 6/2 5/2\n";
    let mesh = read_obj(roof).unwrap();
    assert_eq!(mesh.vertex_count(), 8);
    for (p, n) in mesh.positions.iter().zip(&mesh.normals) {
        let expected = if p.x == 1.0 { Vec3::Y } else { Vec3::new(p.x - 1.0, 1.0, 0.0).normalize() };
        assert!(n.distance(expected) < 1e-6, "{p}: {n}");
    }
}

#[test]
fn obj_errors_name_line_value_and_what_is_allowed() {
    let with = |from: &str, to: &str| {
        assert!(OBJ_SQUARE.contains(from), "{from}");
        message(read_obj(OBJ_SQUARE.replacen(from, to, 1)))
    };
    assert_eq!(message(read_obj("")), "a.obj: no triangles: at least 1 is needed");
    assert_eq!(message(read_obj("v 0 0 0\nv 1 0 0\nv 1 1 0\n")), "a.obj: no triangles: at least 1 is needed");
    assert_eq!(with("v 0 1 0\n", "v 0 1\n"), "a.obj:7: expected 3 numbers after v, saw 2");
    assert_eq!(with("v 0 1 0\n", "v 0 1 zero\n"), "a.obj:7: expected a number after v, saw \"zero\"");
    assert_eq!(with("v 0 1 0\n", "v 0 inf 0\n"), "a.obj:7: v coordinate 2 is inf: must be finite");
    assert_eq!(with("vt 0 1\n", "vt 0 nan\n"), "a.obj:11: vt coordinate 2 is nan: must be finite");
    assert_eq!(with("4/4/1", "5/4/1"), "a.obj:15: vertex index is 5: must be 1 to 4 or -4 to -1");
    assert_eq!(with("4/4/1", "0/4/1"), "a.obj:15: vertex index is 0: must be 1 to 4 or -4 to -1");
    assert_eq!(with("4/4/1", "-5/4/1"), "a.obj:15: vertex index is -5: must be 1 to 4 or -4 to -1");
    assert_eq!(with("4/4/1", "4/-9/1"), "a.obj:15: texture coordinate index is -9: must be 1 to 4 or -4 to -1");
    assert_eq!(with("4/4/1", "4/4/2"), "a.obj:15: normal index is 2: must be 1 to 1 or -1 to -1");
    assert_eq!(with("4/4/1", "-9223372036854775808/4/1"), "a.obj:15: vertex index is -9223372036854775808: must be 1 to 4 or -4 to -1");
    assert_eq!(with("4/4/1", "4/4/1/1"), "a.obj:15: expected a face corner as v, v/t, v//n or v/t/n, saw \"4/4/1/1\"");
    assert_eq!(with("4/4/1", "four"), "a.obj:15: expected a face corner as v, v/t, v//n or v/t/n, saw \"four\"");
    assert_eq!(with("4/4/1", "/4/1"), "a.obj:15: expected a face corner as v, v/t, v//n or v/t/n, saw \"/4/1\"");
    assert_eq!(with("l 1 2 3", "f 1 2"), "a.obj:17: expected at least 3 corners of a face, saw 2");
    let limits = MeshLimits { max_vertices: 3, ..SMALL };
    let error = obj::from_bytes(Path::new("a.obj"), OBJ_SQUARE.as_bytes(), &limits).unwrap_err();
    assert_eq!(error.to_string(), "a.obj:7: 4 vertices: at most 3 are allowed");
    let limits = MeshLimits { max_triangles: 1, ..SMALL };
    let error = obj::from_bytes(Path::new("a.obj"), OBJ_SQUARE.as_bytes(), &limits).unwrap_err();
    assert_eq!(error.to_string(), "a.obj:15: 2 triangles: at most 1 are allowed");
}

// ---- glTF

/// Bytes of numbers, little-endian.
fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|v| v.to_le_bytes()).collect()
}

fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let digits = bytes.chunks(3).flat_map(|three| {
        let bits = three.iter().fold(0_u32, |bits, b| bits << 8 | u32::from(*b)) << (8 * (3 - three.len()));
        (0..4).map(move |i| if i <= three.len() { DIGITS[(bits >> (18 - 6 * i)) as usize & 63] } else { b'=' })
    });
    String::from_utf8(digits.collect()).unwrap()
}

/// The corners of the square: 48 bytes.
fn square_bytes() -> Vec<u8> {
    floats(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0])
}

/// A document of one buffer: positions in the first 48 bytes, then six 16-bit indices.
struct Document {
    buffer: Vec<u8>,
    nodes: &'static str,
    primitive: &'static str,
    views: &'static str,
    accessors: &'static str,
    extra: &'static str,
}

impl Default for Document {
    fn default() -> Self {
        let mut buffer = square_bytes();
        buffer.extend([0_u16, 1, 2, 0, 2, 3].iter().flat_map(|i| i.to_le_bytes()));
        Self {
            buffer,
            nodes: r#"{"mesh":0}"#,
            primitive: r#""attributes":{"POSITION":0},"indices":1"#,
            views: r#"{"buffer":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":12}"#,
            accessors: r#"{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","min":[0,0,0],"max":[1,1,0]},
                {"bufferView":1,"componentType":5123,"count":6,"type":"SCALAR"}"#,
            extra: "",
        }
    }
}

impl Document {
    fn json(&self, uri: Option<&str>) -> String {
        let uri = uri.map_or(String::new(), |uri| format!(r#""uri":"{uri}","#));
        format!(
            r#"{{"asset":{{"version":"2.0"}},{}"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{}],
            "meshes":[{{"primitives":[{{{}}}]}}],"accessors":[{}],"bufferViews":[{}],"buffers":[{{{uri}"byteLength":{}}}]}}"#,
            self.extra,
            self.nodes,
            self.primitive,
            self.accessors,
            self.views,
            self.buffer.len()
        )
    }

    fn text(&self) -> String {
        self.json(Some(&format!("data:application/octet-stream;base64,{}", base64(&self.buffer))))
    }

    fn glb(&self) -> Vec<u8> {
        let pad = |mut bytes: Vec<u8>, with: u8| {
            bytes.resize(bytes.len().next_multiple_of(4), with);
            bytes
        };
        let (json, bin) = (pad(self.json(None).into_bytes(), b' '), pad(self.buffer.clone(), 0));
        let mut glb = b"glTF".to_vec();
        for word in [2, 28 + json.len() + bin.len(), json.len()] {
            glb.extend((word as u32).to_le_bytes());
        }
        glb.extend(b"JSON");
        glb.extend(&json);
        glb.extend((bin.len() as u32).to_le_bytes());
        glb.extend(b"BIN\0");
        glb.extend(bin);
        glb
    }

    fn read(&self) -> Result<Mesh, MeshFileError> {
        let (text, glb) = (read_gltf(self.text()), read_gltf(self.glb()));
        assert_eq!(text, glb, "the two containers differ");
        text
    }
}

/// Positions of each triangle.
fn soup(mesh: &Mesh) -> Vec<[Vec3; 3]> {
    mesh.triangles().map(|t| mesh.corners(t)).collect()
}

const A: Vec3 = Vec3::ZERO;
const B: Vec3 = Vec3::X;
const C: Vec3 = Vec3::new(1.0, 1.0, 0.0);
const D: Vec3 = Vec3::Y;

#[test]
fn gltf_square_in_both_containers() {
    let mesh = Document::default().read().unwrap();
    assert_eq!(soup(&mesh), [[A, B, C], [A, C, D]]);
    // The specification asks for flat normals where there are none.
    assert_eq!(mesh.vertex_count(), 6);
    assert!(mesh.normals.iter().all(|n| *n == Vec3::Z));
}

#[test]
fn gltf_topologies() {
    let with = |primitive| soup(&Document { primitive, ..Document::default() }.read().unwrap());
    assert_eq!(with(r#""attributes":{"POSITION":0},"mode":5"#), [[A, B, C], [B, D, C]]);
    assert_eq!(with(r#""attributes":{"POSITION":0},"mode":6"#), [[B, C, A], [C, D, A]]);
    // Four vertices without indices are one triangle and a rest.
    assert_eq!(with(r#""attributes":{"POSITION":0}"#), [[A, B, C]]);
    // Indices 0 1 2 0 2 3 as a strip: the joints fall out.
    assert_eq!(with(r#""attributes":{"POSITION":0},"indices":1,"mode":5"#), [[A, B, C], [B, A, C], [A, D, C]]);
    let lines = Document { primitive: r#""attributes":{"POSITION":0},"mode":1"#, ..Document::default() };
    assert_eq!(lines.read().unwrap_err().problem, MeshFileProblem::NoTriangles);
}

#[test]
fn gltf_index_types() {
    for (component, size) in [(5121, 1), (5123, 2), (5125, 4)] {
        let mut buffer = square_bytes();
        for i in [0_u32, 1, 2, 0, 2, 3] {
            buffer.extend(&i.to_le_bytes()[..size]);
        }
        let text = Document { buffer, ..Document::default() }.text();
        let text = text.replace(r#""byteOffset":48,"byteLength":12"#, &format!(r#""byteOffset":48,"byteLength":{}"#, 6 * size));
        let mesh = read_gltf(text.replace("5123", &component.to_string())).unwrap();
        assert_eq!(soup(&mesh), [[A, B, C], [A, C, D]], "{component}");
    }
    let text = Document::default().text().replace("5123", "5122");
    assert_eq!(
        message(read_gltf(text)),
        "a.gltf, meshes[0].primitives[0].indices: expected unsigned integers (componentType 5121, 5123 or 5125), saw I16"
    );
}

/// Position, normal and texture coordinate interleaved: 32 bytes a vertex.
fn interleaved() -> Document {
    let mut buffer = Vec::new();
    for p in [A, B, C, D] {
        buffer.extend(floats(&[p.x, p.y, p.z, 0.0, 0.0, -2.0, p.x, p.y]));
    }
    Document {
        buffer,
        primitive: r#""attributes":{"POSITION":0,"NORMAL":1,"TEXCOORD_0":2,"_CUSTOM":2},"mode":6"#,
        views: r#"{"buffer":0,"byteLength":128,"byteStride":32}"#,
        accessors: r#"{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"},{"bufferView":0,"byteOffset":12,"componentType":5126,"count":4,"type":"VEC3"},
            {"bufferView":0,"byteOffset":24,"componentType":5126,"count":4,"type":"VEC2"}"#,
        ..Document::default()
    }
}

#[test]
fn gltf_interleaved_attributes() {
    let mesh = interleaved().read().unwrap();
    assert_eq!(mesh.vertex_count(), 4);
    assert!(mesh.normals.iter().all(|n| *n == Vec3::NEG_Z), "the file's normals stand");
    // v runs down in glTF.
    assert_eq!(mesh.uvs, [Vec2::new(0.0, 1.0), Vec2::new(1.0, 1.0), Vec2::new(1.0, 0.0), Vec2::new(0.0, 0.0)]);
}

#[test]
fn gltf_nodes_place_instances() {
    let nodes = r#"{"children":[1,2],"translation":[10,0,0]},{"mesh":0,"scale":[2,2,2]},
        {"mesh":0,"matrix":[0,1,0,0, -1,0,0,0, 0,0,1,0, 0,0,5,1]}"#;
    let mesh = Document { nodes, ..Document::default() }.read().unwrap();
    let at = |p: Vec3| p * 2.0 + Vec3::X * 10.0;
    let turned = |p: Vec3| Vec3::new(10.0 - p.y, p.x, 5.0);
    assert_eq!(
        soup(&mesh),
        [[at(A), at(B), at(C)], [at(A), at(C), at(D)], [turned(A), turned(B), turned(C)], [turned(A), turned(C), turned(D)]]
    );
    // A quaternion a little off unit length, a quarter turn about z.
    let nodes = r#"{"mesh":0,"rotation":[0,0,0.7072,0.7072]}"#;
    let mesh = Document { nodes, ..Document::default() }.read().unwrap();
    assert!(mesh.positions.iter().any(|p| p.distance(Vec3::new(-1.0, 1.0, 0.0)) < 1e-6));
}

#[test]
fn gltf_mirrored_nodes_keep_their_front() {
    let nodes = r#"{"mesh":0,"scale":[-1,1,1]}"#;
    let mesh = Document { nodes, ..Document::default() }.read().unwrap();
    assert_eq!(soup(&mesh)[0], [A, Vec3::new(-1.0, 1.0, 0.0), Vec3::NEG_X]);
    assert!(mesh.normals.iter().all(|n| *n == Vec3::Z));
    // With normals in the file: they are mirrored with the surface.
    let mesh = Document { nodes, ..interleaved() }.read().unwrap();
    assert!(mesh.normals.iter().all(|n| *n == Vec3::NEG_Z));
}

#[test]
fn gltf_sparse_and_quantised_accessors() {
    // Vertex 2 moved by a sparse value.
    let mut buffer = square_bytes();
    buffer.extend([2_u8, 0, 0, 0]);
    buffer.extend(floats(&[3.0, 3.0, 3.0]));
    let sparse = Document {
        buffer,
        primitive: r#""attributes":{"POSITION":0}"#,
        views: r#"{"buffer":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":1},{"buffer":0,"byteOffset":52,"byteLength":12}"#,
        accessors: r#"{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","sparse":{"count":1,"indices":{"bufferView":1,"componentType":5121},
            "values":{"bufferView":2}}}"#,
        ..Document::default()
    };
    assert_eq!(soup(&sparse.read().unwrap()), [[A, B, Vec3::splat(3.0)]]);
    let zero_based = sparse.text().replacen(r#""bufferView":0,"componentType":5126"#, r#""componentType":5126"#, 1);
    assert_eq!(soup(&read_gltf(&zero_based).unwrap()), [[A, A, Vec3::splat(3.0)]]);
    // Nothing but the file's size bounds such a count.
    let error = message(read_gltf(zero_based.replace(r#""count":4"#, r#""count":1000000000"#)));
    assert!(error.contains("expected a bufferView") && error.contains("1000000000"), "{error}");
    let error = message(read_gltf(sparse.text().replace(r#""count":4"#, r#""count":2"#)));
    assert!(error.ends_with("a sparse index is 2: must be below the count, 2"), "{error}");

    // Signed bytes at a stride of four, normalised: 127 is 1.
    let buffer = [[0_i8, 0, 0, 0], [127, 0, 0, 0], [127, 127, 0, 0], [-128, 127, 0, 0]].concat().iter().map(|b| *b as u8).collect();
    let quantised = Document {
        buffer,
        primitive: r#""attributes":{"POSITION":0},"mode":6"#,
        views: r#"{"buffer":0,"byteLength":16,"byteStride":4}"#,
        accessors: r#"{"bufferView":0,"componentType":5120,"normalized":true,"count":4,"type":"VEC3"}"#,
        extra: r#""extensionsUsed":["KHR_mesh_quantization"],"extensionsRequired":["KHR_mesh_quantization"],"#,
        ..Document::default()
    };
    assert_eq!(soup(&quantised.read().unwrap()), [[B, C, A], [C, Vec3::new(-1.0, 1.0, 0.0), A]]);
}

#[test]
fn gltf_scene_selection() {
    // Without a scene every node that is no child is placed; node 1 is a child.
    let nodes = r#"{"children":[1]},{"mesh":0},{"mesh":0,"translation":[0,0,9]}"#;
    let text = Document { nodes, ..Document::default() }.text().replace(r#""scene":0,"scenes":[{"nodes":[0]}],"#, "");
    assert_eq!(read_gltf(text).unwrap().triangle_count(), 4);
    // Without a default scene it is the first.
    let text = Document { nodes, ..Document::default() }.text().replace(r#""scene":0,"#, "");
    assert_eq!(read_gltf(text).unwrap().triangle_count(), 2);
}

#[test]
fn gltf_errors_name_item_value_and_what_is_allowed() {
    let with = |from: &str, to: &str| {
        let text = Document::default().text();
        assert!(text.contains(from), "{from}");
        message(read_gltf(text.replacen(from, to, 1)))
    };
    assert_eq!(message(read_gltf("")), "a.gltf:1:0: expected a glTF 2.0 document, saw EOF while parsing a value");
    assert!(message(read_gltf("{\n \"asset\": 7}")).starts_with("a.gltf:2:11: expected a glTF 2.0 document, saw invalid type"));
    assert_eq!(
        with(r#""version":"2.0""#, r#""version":"1.0""#),
        "a.gltf, asset.version: glTF version \"1.0\" is not supported: must be 2.x"
    );
    let error = with(r#""scene":0"#, r#""extensionsRequired":["KHR_draco_mesh_compression"],"scene":0"#);
    assert!(
        error.starts_with("a.gltf, extensionsRequired: the extension \"KHR_draco_mesh_compression\" is not supported: export without it"),
        "{error}"
    );
    assert!(
        with(r#""scene":0"#, r#""extensionsRequired":["KHR_materials_unlit"],"scene":1"#)
            .starts_with("a.gltf, scene: the index is 1: must be 0 to 0")
    );
    assert_eq!(with(r#"{"nodes":[0]}"#, r#"{"nodes":[4]}"#), "a.gltf, node: the index is 4: must be 0 to 0 (an index of nodes)");
    assert_eq!(with(r#"{"mesh":0}"#, r#"{"mesh":2}"#), "a.gltf, nodes[0].mesh: the index is 2: must be 0 to 0 (an index of meshes)");
    assert_eq!(
        with(r#"{"mesh":0}"#, r#"{"mesh":0,"children":[0]}"#),
        "a.gltf, nodes[0]: expected a tree: every node with one parent, and no cycle, saw a node that is reached twice"
    );
    assert!(
        with(r#"{"mesh":0}"#, r#"{"mesh":0,"rotation":[0,0,0,0]}"#).starts_with("a.gltf, nodes[0].rotation: expected a unit quaternion")
    );
    assert!(
        with(r#"{"mesh":0}"#, r#"{"mesh":0,"matrix":[1,0,0,1, 0,1,0,0, 0,0,1,0, 0,0,0,1]}"#)
            .starts_with("a.gltf, nodes[0].matrix: expected an affine matrix")
    );
    assert!(
        with(r#"{"mesh":0}"#, r#"{"mesh":0,"scale":[3e38,1,1],"translation":[3e38,0,0]}"#)
            .contains("a position, placed by nodes[0], is [inf")
    );
    assert_eq!(with(r#""POSITION":0"#, r#""NORMAL":0"#), "a.gltf, meshes[0].primitives[0]: expected an attribute POSITION, saw none");
    assert!(
        with(r#""indices":1"#, r#""indices":9"#).starts_with("a.gltf, meshes[0].primitives[0].indices: the index is 9: must be 0 to 1")
    );
    assert!(with(r#""indices":1"#, r#""indices":0"#).contains("expected the type Scalar"));
    assert!(with(r#""indices":1"#, r#""indices":1,"mode":9"#).contains("expected 0 to 6"));
    let error = with(r#""count":4"#, r#""count":1000000000"#);
    assert!(
        error.contains("accessors[0]") && error.contains("1000000000 elements needs 12000000000 bytes, but only 48 are there"),
        "{error}"
    );
    let error = with(r#""count":4"#, r#""count":18446744073709551615"#);
    assert!(error.contains("bytes, but only 48 are there"), "{error}");
    assert!(with(r#""count":4"#, r#""count":3"#).ends_with("index 5 is 3: must be below 3, the count of POSITION"));
    assert!(with(r#""byteLength":48}"#, r#""byteLength":48,"byteStride":8}"#).contains("a byteStride of at least 12"));
    assert!(with(r#""byteOffset":48"#, r#""byteOffset":18446744073709551615"#).contains("the range of 12 bytes from 18446744073709551615"));
    assert!(with(r#"{"buffer":0,"byteLength":48}"#, r#"{"buffer":3,"byteLength":48}"#).contains("the buffer is 3"));
    assert!(with(r#""byteLength":60}]"#, r#""byteLength":61}]"#).contains("the buffer needs 61 bytes, but only 60 are there"));
    assert!(with("base64,", "base64,!").contains("base64"));
    assert!(with("data:application/octet-stream;base64,", "data:text/plain,").contains("a data URI must be"));
    assert!(with("data:application/octet-stream;base64,", "https://example.org/").contains("must be a data URI, or a path relative"));
    let nan = Document { buffer: floats(&[f32::NAN; 15]), ..Document::default() };
    assert!(message(nan.read()).contains("must be below 4"), "{}", message(nan.read()));
    let mut buffer = Document::default().buffer;
    buffer[4..8].copy_from_slice(&f32::NAN.to_le_bytes());
    let error = message(Document { buffer, ..Document::default() }.read());
    assert!(error.starts_with("a.gltf, meshes[0].primitives[0].attributes.POSITION: position 0 is [0, NaN, 0]: must be finite"), "{error}");
    // Instances count against the limits.
    let error =
        gltf::from_bytes(Path::new("a.gltf"), Document::default().text().as_bytes(), None, &MeshLimits { max_triangles: 1, ..SMALL })
            .unwrap_err();
    assert!(matches!(error.problem, MeshFileProblem::TooLarge { what: "triangles", seen: 2, limit: 1 }), "{error}");
}

#[test]
fn glb_headers_are_checked() {
    let whole = Document::default().glb();
    for length in 4..whole.len() {
        assert!(read_gltf(&whole[..length]).is_err(), "{length}");
    }
    let with = |at: usize, word: u32| {
        let mut glb = whole.clone();
        glb[at..at + 4].copy_from_slice(&word.to_le_bytes());
        message(read_gltf(glb))
    };
    assert_eq!(with(4, 1), "a.gltf, byte 4: GLB version 1 is not supported: must be 2");
    assert!(with(8, u32::MAX).starts_with("a.gltf, byte 8: the GLB needs 4294967295 bytes"));
    assert!(with(8, 0).contains("expected a JSON chunk"));
    assert!(with(12, u32::MAX).starts_with("a.gltf, byte 12: a GLB chunk needs 4294967295 bytes"));
    assert!(with(16, 7).contains("expected a JSON chunk"));
    // A shorter JSON chunk: what follows it is no chunk.
    assert!(with(12, 8).contains("a GLB chunk needs"));
}

// ---- Files on disk

fn write(folder: &Path, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
    let path = folder.join(name);
    fs::write(&path, bytes).unwrap();
    path
}

#[test]
fn files_are_chosen_by_extension() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    check_square(&read_mesh(&write(folder, "a.ply", PLY_SQUARE), &SMALL).unwrap());
    check_square(&read_mesh(&write(folder, "b.PLY", PLY_SQUARE), &SMALL).unwrap());
    check_square(&read_mesh(&write(folder, "a.obj", OBJ_SQUARE), &SMALL).unwrap());
    assert_eq!(read_mesh(&write(folder, "a.glb", Document::default().glb()), &SMALL).unwrap().triangle_count(), 2);
    // A buffer beside the file, its name percent-encoded.
    let document = Document::default();
    write(folder, "my buffer.bin", &document.buffer);
    let gltf = write(folder, "a.gltf", document.json(Some("my%20buffer.bin")));
    assert_eq!(read_mesh(&gltf, &SMALL).unwrap().triangle_count(), 2);
    let gltf = write(folder, "b.gltf", document.json(Some("missing.bin")));
    let error = message(read_mesh(&gltf, &SMALL));
    assert!(error.contains("b.gltf, buffers[0]: ") && error.contains("missing.bin: "), "{error}");
    let gltf = write(folder, "c.gltf", document.json(Some(folder.join("my buffer.bin").to_str().unwrap())));
    assert!(matches!(read_mesh(&gltf, &SMALL).unwrap_err().problem, MeshFileProblem::Unsupported { .. }));

    let stl = write(folder, "a.stl", "solid");
    assert!(message(read_mesh(&stl, &SMALL)).ends_with("unknown mesh format \"stl\": must be one of \"ply\", \"obj\", \"gltf\", \"glb\""));
    assert!(matches!(read_mesh(&folder.join("none.ply"), &SMALL).unwrap_err().problem, MeshFileProblem::Io { .. }));
    fs::create_dir(folder.join("folder.ply")).unwrap();
    assert!(message(read_mesh(&folder.join("folder.ply"), &SMALL)).ends_with("not a regular file"));
    let large = write(folder, "large.ply", vec![b' '; 2 << 20]);
    assert!(matches!(read_mesh(&large, &SMALL).unwrap_err().problem, MeshFileProblem::TooLarge { what: "bytes", .. }));
}

/// What stands in the file that must not be read: as a buffer it would do.
const SECRET: &[u8] = b"hush, hush, hush, hush, hush, hush, hush, hush, hush, hush, ";

#[test]
fn buffers_elsewhere_are_refused_unopened() {
    let outside = tempfile::tempdir().unwrap();
    let folder = outside.path().join("inside");
    fs::create_dir_all(folder.join("sub")).unwrap();
    let document = Document::default();
    assert_eq!(SECRET.len(), document.buffer.len());
    write(outside.path(), "outside.bin", SECRET);
    let absolute = outside.path().join("outside.bin");
    let absolute = absolute.to_str().unwrap();
    let rule = "must be a data URI, or a path relative to a .gltf file on disk, to a regular file in its folder or below, links included";
    let refused = |uri: &str, why: &str| {
        let gltf = write(&folder, "a.gltf", document.json(Some(&uri.replace('\\', "\\\\"))));
        let message = message(read_mesh(&gltf, &SMALL));
        let start = format!("{}, buffers[0]: the URI ", gltf.display());
        assert!(message.starts_with(&start) && message.ends_with(&format!("{why}, is not supported: {rule}")), "{uri}: {message}");
        assert!(!message.contains("hush"), "{uri}: {message}");
    };
    for uri in
        ["../outside.bin", "%2e%2e/outside.bin", "%2E./outside.bin", "sub/../../outside.bin", "./.././outside.bin", "../inside/ok.bin"]
    {
        refused(uri, "which leads out of reach");
    }
    refused(absolute, "which is absolute");
    refused("//localhost/outside.bin", "which is absolute");
    for uri in [&format!("file://{absolute}"), "file:outside.bin", "http://localhost/outside.bin", "C:outside.bin", "c%3a/outside.bin"] {
        refused(uri, "which holds a colon, as of a scheme or a drive");
    }
    for uri in ["..\\outside.bin", "sub\\..\\..\\outside.bin", "..%5coutside.bin", "%5c%5chost%5coutside.bin"] {
        refused(uri, "which holds a backslash");
    }
    for uri in ["..%2foutside.bin", "%2e%2e%2Foutside.bin", "%2ftmp/outside.bin", "sub%2fok.bin"] {
        refused(uri, "which holds a percent-encoded separator");
    }
    refused("ok.bin%00", "which holds a NUL");
    refused("ok%ff.bin", "which is not UTF-8");
    for uri in ["", ".", "sub/..", "sub/../"] {
        refused(uri, "which names no file");
    }

    // What lies inside is read, by way of `..` and of links, too.
    let read = |uri: &str| read_mesh(&write(&folder, "a.gltf", document.json(Some(uri))), &SMALL);
    write(&folder, "ok.bin", &document.buffer);
    write(&folder.join("sub"), "ok.bin", &document.buffer);
    for uri in ["ok.bin", "./ok.bin", "sub/ok.bin", "sub/../ok.bin", "%6fk.bin", "sub//ok.bin"] {
        assert_eq!(read(uri).map(|mesh| mesh.triangle_count()), Ok(2), "{uri}");
    }
    assert!(message(read("sub")).ends_with("sub: not a regular file"));

    #[cfg(unix)]
    {
        use std::os::unix::fs::symlink;
        for (target, link) in
            [(absolute, "absolute.bin"), ("../outside.bin", "up.bin"), ("up.bin", "again.bin"), ("..", "above"), ("/dev/zero", "zero.bin")]
        {
            symlink(target, folder.join(link)).unwrap();
        }
        for uri in ["absolute.bin", "up.bin", "again.bin", "above/outside.bin", "zero.bin"] {
            refused(uri, "which a link leads out of reach");
        }
        for (target, link) in [("sub/ok.bin", "within.bin"), ("sub", "beneath")] {
            symlink(target, folder.join(link)).unwrap();
        }
        for uri in ["within.bin", "beneath/ok.bin", "above/inside/ok.bin"] {
            assert_eq!(read(uri).map(|mesh| mesh.triangle_count()), Ok(2), "{uri}");
        }
        // A folder that is itself reached by a link keeps its files.
        let alias = outside.path().join("alias");
        symlink(&folder, &alias).unwrap();
        assert_eq!(read_mesh(&write(&alias, "a.gltf", document.json(Some("ok.bin"))), &SMALL).map(|mesh| mesh.triangle_count()), Ok(2));
        // A pipe that nobody writes to would never end.
        let made = std::process::Command::new("mkfifo").arg(folder.join("pipe.bin")).status().unwrap();
        assert!(made.success());
        assert!(message(read("pipe.bin")).ends_with("pipe.bin: not a regular file"));
    }
}

// ---- Random damage

/// Overwrites, removes, repeats or inserts stretches of a valid file.
fn damaged(mut file: Vec<u8>, damage: &[(u8, u16, u16, u8)]) -> Vec<u8> {
    for &(kind, at, length, byte) in damage {
        if file.is_empty() {
            break;
        }
        let at = at as usize % file.len();
        let end = (at + 1 + length as usize % 12).min(file.len());
        match kind % 5 {
            0 => file[at] = byte,
            1 => drop(file.drain(at..end)),
            2 => {
                let piece = file[at..end].to_vec();
                file.splice(at..at, piece);
            }
            // Characters that mean something in all the formats.
            3 => file[at] = b"0123456789-.e \n\"{}[],:/#fvn"[byte as usize % 27],
            _ => file.truncate(end),
        }
    }
    file
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1500, rng_seed: proptest::test_runner::RngSeed::Fixed(11), failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn damaged_files_give_a_mesh_or_an_error(damage in prop::collection::vec(any::<(u8, u16, u16, u8)>(), 1..6)) {
        let _ = read_ply(damaged(PLY_SQUARE.into(), &damage));
        let _ = read_ply(damaged(binary_square(false), &damage));
        let _ = read_ply(damaged(binary_square(true), &damage));
        let _ = read_obj(damaged(OBJ_SQUARE.into(), &damage));
        let _ = read_gltf(damaged(Document::default().text().into(), &damage));
        let _ = read_gltf(damaged(interleaved().glb(), &damage));
    }

    #[test]
    fn noise_gives_a_mesh_or_an_error(noise in prop::collection::vec(any::<u8>(), 0..200)) {
        let _ = read_ply(&noise);
        let _ = read_obj(&noise);
        let _ = read_gltf(&noise);
        let body = |header: &str| [header.as_bytes(), &noise].concat();
        let header = "element vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 2\nproperty list uchar uchar vertex_indices\nend_header\n";
        let _ = read_ply(body(&format!("ply\nformat binary_little_endian 1.0\n{header}")));
        let _ = read_ply(body(&format!("ply\nformat ascii 1.0\n{header}")));
        let _ = read_gltf(body("glTF\u{2}\0\0\0"));
    }

    #[test]
    fn numbers_in_a_document_may_be_anything(at in 0_usize..40, number in prop_oneof![Just("-1"), Just("0"), Just("1e400"), Just("4294967296"), Just("18446744073709551615"), Just("9"), Just("null"), Just("1.5")]) {
        // Replace the n-th number of the document.
        let text = interleaved().json(None);
        let mut ranges = Vec::new();
        let bytes = text.as_bytes();
        let mut i = 0;
        while i < bytes.len() {
            if bytes[i].is_ascii_digit() && matches!(bytes[i - 1], b':' | b'[' | b',') {
                let end = i + bytes[i..].iter().take_while(|b| b.is_ascii_digit()).count();
                ranges.push(i..end);
                i = end;
            }
            i += 1;
        }
        let range = ranges[at % ranges.len()].clone();
        let mut text = text.clone();
        text.replace_range(range, number);
        let bin = interleaved().buffer;
        let text = text.replacen("\"buffers\":[{", &format!("\"buffers\":[{{\"uri\":\"data:;base64,{}\",", base64(&bin)), 1);
        let _ = read_gltf(text);
    }
}

/// A tetrahedron of glass over a floor, as a PLY file with these corners of its four triangles.
fn glass_scene(folder: &Path, name: &str, triangles: &str, far: &str) {
    let count = triangles.lines().count();
    let ply = format!(
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face {count}\nproperty list uchar int \
         vertex_indices\nend_header\n{far} 0.3 0\n-0.3 0.3 0.4\n-0.3 0.3 -0.4\n0 0.8 0\n{triangles}\n"
    );
    fs::write(folder.join(format!("{name}.ply")), ply).expect("the folder is writable");
    let scene = format!(
        "Scene(\n image: (width: 32, height: 32),\n camera: Orthographic(position: (0, 3, 0), target: (0, 0, 0), up: (0, 0, -1), height_m: 2, near_m: 0.5, far_m: 10),\n \
         lights: [Directional(aim: Along((0.1, -1, 0.05)), irradiance: (1, 1, 1))],\n objects: [(shape: Grid(size_m: (4, 4))),\n (name: \"prism\", shape: \
         Mesh(\"{name}.ply\"), material: Dielectric(ior: 1.5))])"
    );
    fs::write(folder.join(format!("{name}.ron")), scene).expect("the folder is writable");
}

/// Glass is one rule for all who follow light: what is open or disagrees about its outside is refused with its place, what faces in is turned over and said.
#[test]
fn glass_is_checked_alike_by_techniques_and_tracer() {
    const OUT: &str = "3 0 1 2\n3 0 3 1\n3 1 3 2\n3 2 3 0";
    const IN: &str = "3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3";
    const MIXED: &str = "3 0 1 2\n3 0 1 3\n3 1 2 3\n3 2 0 3";
    const OPEN: &str = "3 0 1 3\n3 1 2 3\n3 2 0 3";
    const FIN: &str = "3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n3 0 1 3";
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let folder = folder.path();
    for (name, triangles, far) in
        [("out", OUT, "0.4"), ("in", IN, "0.4"), ("mixed", MIXED, "0.4"), ("open", OPEN, "0.4"), ("fin", FIN, "0.4"), ("huge", OUT, "1e38")]
    {
        glass_scene(folder, name, triangles, far);
    }
    let verbs: [&[&str]; 4] = [
        &["render", "--technique", "light-volumes", "-o", "a.exr"],
        &["render", "--technique", "splatting", "-o", "a.exr"],
        &["render", "--technique", "caustic-volumes", "-o", "a.exr"],
        &["trace", "--photons", "1k", "-o", "a.exr"],
    ];
    for (scene, expected) in [
        ("mixed.ron", "prism is glass, but its mesh is open: 0 edges have one triangle only, 0 have more than two, 3 join"),
        ("open.ron", "prism is glass, but its mesh is open: 3 edges"),
        ("fin.ron", "prism is glass, but its mesh is open: "),
        ("huge.ron", "prism has a vertex at (1"),
    ] {
        for verb in verbs {
            let message = program::refuse(folder, &[&[verb[0], scene], &verb[1..]].concat());
            assert!(message.contains(expected) && message.contains(&format!("{scene}:6:")), "{verb:?}: {message}");
        }
    }
    for technique in ["light-volumes", "splatting"] {
        let render = |scene: &str, file: &str| {
            let output = program::run(folder, &["render", scene, "--technique", technique, "--layers", "caustic_irradiance", "-o", file]);
            assert!(output.status.success(), "{technique}, {scene}");
            String::from_utf8(output.stderr).expect("text")
        };
        assert_eq!(render("out.ron", "out.exr"), "");
        assert_eq!(render("in.ron", "in.exr"), "nephroid: in.ron: bodies of glass whose triangles face in were turned over: 1\n");
        let light = |file: &str| -> Vec<f32> {
            let layers = nephroid::image::read(&folder.join(file)).expect("a picture").layers;
            layers.get("caustic_irradiance").expect("the layer").planes()[0].pixels().to_vec()
        };
        let (out, turned) = (light("out.exr"), light("in.exr"));
        let sum = |light: &[f32]| light.iter().map(|&e| f64::from(e)).sum::<f64>();
        assert!(sum(&out) > 0.5 && (sum(&turned) / sum(&out) - 1.0).abs() < 1e-3, "{technique}: {} {}", sum(&out), sum(&turned));
    }
}

/// Every verb that takes a scene says that glass was turned over, in one line and in its JSON.
#[test]
fn every_verb_says_that_glass_was_turned_over() {
    const OUT: &str = "3 0 1 2\n3 0 3 1\n3 1 3 2\n3 2 3 0";
    const IN: &str = "3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3";
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let folder = folder.path();
    glass_scene(folder, "out", OUT, "0.4");
    glass_scene(folder, "in", IN, "0.4");
    let mut verbs: Vec<Vec<&str>> = vec![
        vec!["render", "--technique", "light-volumes", "-o", "a.exr"],
        vec!["render", "--technique", "splatting", "--frames", "2", "-o", "a.exr"],
        vec!["trace", "--photons", "1k", "-o", "a.exr"],
        vec!["compare", "--techniques", "splatting,light-volumes", "--size", "16x16", "--photons", "1k", "-o", "a.png"],
    ];
    // Without a driver there is no cross-check.
    let driver = program::run(folder, &["crosscheck", "out.ron", "--technique", "splatting", "--size", "8x8"]);
    if !String::from_utf8_lossy(&driver.stderr).contains("not run") {
        verbs.push(vec!["crosscheck", "--technique", "splatting", "--size", "8x8"]);
    }
    for verb in &verbs {
        for (scene, count) in [("out", 0), ("in", 1)] {
            let file = format!("{scene}.ron");
            let output = program::run(folder, &[&[verb[0], file.as_str()], &verb[1..], &["--json"]].concat());
            let stderr = String::from_utf8(output.stderr).expect("text");
            let said = format!("nephroid: {file}: bodies of glass whose triangles face in were turned over: 1\n");
            assert_eq!(stderr.matches(&said).count(), count, "{verb:?}: {stderr}");
            let json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
            let reports = match &json {
                serde_json::Value::Array(frames) => frames.clone(),
                report if verb[0] == "crosscheck" => report["frames"].as_array().expect("frames").clone(),
                report => vec![report.clone()],
            };
            assert!(!reports.is_empty() && reports.iter().all(|report| report["bodies_turned"] == count), "{verb:?}: {json}");
        }
    }
}
