//! Triangle meshes from files: PLY, OBJ, glTF and GLB.
//!
//! Each format has one file with a function from bytes; this one chooses by extension, reads the file and checks what came out.
//! The rules all formats share:
//!
//! - polygons are cut into triangles; several objects become one mesh; points, lines, materials, skins and animations are left out;
//! - vertices no triangle uses are dropped; positions and texture coordinates must be finite;
//! - normals of no use (zero, not finite, missing at a corner) are replaced by smooth ones; a file without any gets smooth ones (PLY,
//!   OBJ) or flat ones (glTF, whose specification asks for it);
//! - texture coordinates have v up, as PLY and OBJ write them; glTF's are turned over;
//! - no memory is taken for a count before the bytes it promises are known to be there, and nothing grows beyond [`MeshLimits`].
//!
//! Two formats have readers of their own although there are crates for them. `ply-rs-bw` gives the element number as the line in
//! binary files, refuses the numbers `.5` and `1.`, builds one element per declared count for elements without properties and
//! allocates a list per face. `tobj` has no line numbers, makes a triangle of a three-point line, loses step between texture
//! coordinates and positions where only some corners have them, and overflows on a negative texture index out of range.

mod error;
pub mod gltf;
pub mod obj;
pub mod ply;

use std::{
    fs,
    io::{self, Read},
    path::{Path, PathBuf},
};

use glam::Vec3;

use crate::geom::{Mesh, direction};
use crate::reach::{Astray, Reach};

use error::{Fault, quote};
pub use error::{MeshFileError, MeshFileProblem, Place};

/// How large a mesh may become.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MeshLimits {
    /// Vertices, counted as they are read and again once split or instanced. Default: 50 million.
    pub max_vertices: u64,
    /// Triangles, instances included. Default: 100 million.
    pub max_triangles: u64,
    /// Bytes of the file, and of each buffer file of a glTF. Default: 8 GiB.
    pub max_file_bytes: u64,
}

impl Default for MeshLimits {
    fn default() -> Self {
        Self { max_vertices: 50_000_000, max_triangles: 100_000_000, max_file_bytes: 8 << 30 }
    }
}

impl MeshLimits {
    fn check(seen: u64, limit: u64, what: &'static str, at: impl FnOnce() -> Place) -> Result<(), Fault> {
        if seen <= limit { Ok(()) } else { Err(Fault { at: at(), problem: MeshFileProblem::TooLarge { what, seen, limit } }) }
    }

    /// Refuses a number of vertices above the limit, or above what 32-bit indices can count.
    fn check_vertices(&self, seen: u64, at: impl FnOnce() -> Place) -> Result<(), Fault> {
        Self::check(seen, self.max_vertices.min(u64::from(u32::MAX)), "vertices", at)
    }

    fn check_triangles(&self, seen: u64, at: impl FnOnce() -> Place) -> Result<(), Fault> {
        Self::check(seen, self.max_triangles, "triangles", at)
    }
}

/// Reads a mesh; the extension (`.ply`, `.obj`, `.gltf`, `.glb`, in any case) says which format.
///
/// # Errors
/// If the file cannot be read, is malformed, exceeds a limit or has no triangle. The message names file and place.
pub fn read_mesh(path: &Path, limits: &MeshLimits) -> Result<Mesh, MeshFileError> {
    read_as(path, limits, || Ok(path.to_owned()))
}

/// Where the meshes are that a scene may name.
pub(super) const MESH_REACH: &str = "to a file below the scene's folder or below a folder beside it";

/// Reads the mesh that a scene in `folder` names. Where the name leads is settled before anything is opened.
pub(super) fn read_named_mesh(folder: &Path, name: &Path, limits: &MeshLimits) -> Result<Mesh, MeshFileError> {
    let shown = folder.join(name);
    read_as(&shown, limits, || {
        let located = name.to_str().ok_or(Astray::Refused("which is not UTF-8")).and_then(|name| Reach::Beside.locate(folder, name));
        located.map_err(|astray| match astray {
            Astray::Io(error) => io_fault(error),
            Astray::Refused(why) => {
                let feature = format!("the path {}, {why},", quote(name.to_string_lossy().as_bytes()));
                Fault::unsupported(Place::File, feature, format!("must lead {MESH_REACH}, links included"))
            }
        })
    })
}

/// Reads the mesh at the place that `locate` finds, under the name `path` in messages.
fn read_as(path: &Path, limits: &MeshLimits, locate: impl FnOnce() -> Result<PathBuf, Fault>) -> Result<Mesh, MeshFileError> {
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or("").to_ascii_lowercase();
    let in_file = |fault: Fault| fault.in_file(path);
    let parse: fn(&Path, &[u8], &MeshLimits) -> Result<Mesh, Fault> = match extension.as_str() {
        "ply" => |_, bytes, limits| ply::parse(bytes, limits),
        "obj" => |_, bytes, limits| obj::parse(bytes, limits),
        "gltf" | "glb" => |path, bytes, limits| gltf::parse(bytes, Some(path.parent().unwrap_or(Path::new(""))), limits),
        _ => return Err(in_file(Fault { at: Place::File, problem: MeshFileProblem::UnknownFormat { seen: extension } })),
    };
    let place = locate().map_err(in_file)?;
    let bytes = read_bounded(&place, limits.max_file_bytes).map_err(in_file)?;
    parse(path, &bytes, limits).map_err(in_file)
}

/// The bytes of a regular file, refused unread if there are more than `max_bytes`.
fn read_bounded(path: &Path, max_bytes: u64) -> Result<Vec<u8>, Fault> {
    // Asked before it is opened: opening a pipe would wait for a writer.
    if !fs::metadata(path).map_err(io_fault)?.is_file() {
        return Err(io_fault(io::Error::other("not a regular file")));
    }
    let file = fs::File::open(path).map_err(io_fault)?;
    let length = file.metadata().map_err(io_fault)?.len();
    MeshLimits::check(length, max_bytes, "bytes", || Place::File)?;
    // A file that grows meanwhile is cut off rather than followed.
    let mut bytes = Vec::new();
    file.take(max_bytes).read_to_end(&mut bytes).map_err(io_fault)?;
    Ok(bytes)
}

/// What the file system says, of the file as a whole.
fn io_fault(error: io::Error) -> Fault {
    Fault { at: Place::File, problem: MeshFileProblem::Io { message: error.to_string() } }
}

/// Common last steps: something must be left, unused vertices go, normals become usable.
///
/// Normals that could not be read are zero on entry.
fn finish(mut mesh: Mesh) -> Result<Mesh, Fault> {
    if mesh.indices.is_empty() {
        return Err(Fault { at: Place::File, problem: MeshFileProblem::NoTriangles });
    }
    mesh.compact();
    let mut missing = 0_usize;
    for n in &mut mesh.normals {
        // Only direction counts: lengths may be far from 1.
        *n = direction(*n);
        missing += usize::from(*n == Vec3::ZERO);
    }
    if missing > 0 {
        let read = std::mem::take(&mut mesh.normals);
        mesh.smooth_normals();
        for (n, read) in mesh.normals.iter_mut().zip(read).filter(|(_, read)| *read != Vec3::ZERO) {
            *n = read;
        }
    }
    debug_assert_eq!(mesh.validate(), Ok(()), "a reader let something through");
    Ok(mesh)
}

/// Converts a fault into an error of the named source.
impl Fault {
    fn in_file(self, file: &Path) -> MeshFileError {
        MeshFileError { file: PathBuf::from(file), at: self.at, problem: self.problem }
    }
}
