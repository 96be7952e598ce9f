//! Wavefront OBJ.
//!
//! Read are `v`, `vt`, `vn` and `f`; all objects and groups become one mesh, one vertex per different `position/texture/normal` corner.
//! Indices count from 1, or back from the last if negative. Weights and colours after the three coordinates are ignored, as are
//! points, lines, free-form surfaces, materials, groups and smoothing groups.

use std::path::Path;

use glam::{Vec2, Vec3};

use super::{Fault, MeshFileError, MeshLimits, Place, error::quote, finish};
use crate::geom::{Mesh, triangulate_polygon};

/// Reads an OBJ file from memory. `name` is the file's name in messages.
///
/// # Errors
/// If the bytes are no OBJ file, exceed a limit or hold no triangle.
pub fn from_bytes(name: &Path, bytes: &[u8], limits: &MeshLimits) -> Result<Mesh, MeshFileError> {
    parse(bytes, limits).map_err(|fault| fault.in_file(name))
}

/// A corner of a face as numbers into the lists; `NONE` where it has no texture coordinate or normal.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct FaceVertex {
    position: u32,
    uv: u32,
    normal: u32,
}

const NONE: u32 = u32::MAX;

/// How many of each there are in the whole file: a face may name what comes after it.
#[derive(Default)]
struct Totals {
    positions: u64,
    uvs: u64,
    normals: u64,
}

#[derive(Default)]
struct Lists {
    positions: Vec<Vec3>,
    uvs: Vec<Vec2>,
    normals: Vec<Vec3>,
}

pub(super) fn parse(bytes: &[u8], limits: &MeshLimits) -> Result<Mesh, Fault> {
    let mut totals = Totals::default();
    for_each_line(bytes, |line, words| {
        let count = match keyword(words) {
            (b"v", _) => &mut totals.positions,
            (b"vt", _) => &mut totals.uvs,
            (b"vn", _) => &mut totals.normals,
            _ => return Ok(()),
        };
        *count += 1;
        limits.check_vertices(*count, || Place::Line(line))
    })?;

    // Every count is of lines that are there: the lists cannot outgrow the file.
    let mut lists = Lists::default();
    let mut corners: Vec<FaceVertex> = Vec::new();
    let mut polygons: Vec<u32> = Vec::new();
    let mut triangle_count = 0;
    for_each_line(bytes, |line, words| {
        match keyword(words) {
            (b"v", words) => lists.positions.push(Vec3::from(numbers(line, words, "v", true)?)),
            (b"vt", words) => {
                // The second coordinate may be missing, a third is for solid textures.
                let has_v = words.split(u8::is_ascii_whitespace).filter(|w| !w.is_empty()).count() > 1;
                let uv = if has_v {
                    Vec2::from(numbers::<2>(line, words, "vt", true)?)
                } else {
                    Vec2::new(numbers::<1>(line, words, "vt", true)?[0], 0.0)
                };
                lists.uvs.push(uv);
            }
            (b"vn", words) => lists.normals.push(Vec3::from(numbers(line, words, "vn", false)?)),
            (b"f", words) => {
                let first = corners.len();
                for word in words.split(u8::is_ascii_whitespace).filter(|w| !w.is_empty()) {
                    corners.push(parse_corner(line, word, &lists, &totals)?);
                }
                let count = corners.len() - first;
                if count < 3 {
                    return Err(Fault::syntax(Place::Line(line), "at least 3 corners of a face", format!("{count}")));
                }
                triangle_count += count as u64 - 2;
                limits.check_triangles(triangle_count, || Place::Line(line))?;
                polygons.push(count as u32);
            }
            _ => {}
        }
        Ok(())
    })?;

    let (mut mesh, vertices) = unify(&corners, &lists);
    limits.check_vertices(mesh.positions.len() as u64, || Place::File)?;
    let mut rest = vertices.as_slice();
    let mut points = Vec::new();
    for n in polygons {
        let (polygon, after) = rest.split_at(n as usize);
        rest = after;
        points.clear();
        points.extend(polygon.iter().map(|&i| mesh.positions[i as usize]));
        triangulate_polygon(&points, |t| mesh.indices.extend(t.map(|corner| polygon[corner])));
    }
    finish(mesh)
}

/// Calls `f` with number and text of each line; a line that ends in a backslash goes on in the next. Comments are cut off.
fn for_each_line(bytes: &[u8], mut f: impl FnMut(u64, &[u8]) -> Result<(), Fault>) -> Result<(), Fault> {
    let mut joined = Vec::new();
    let mut joined_from = 0;
    for (at, line) in bytes.split(|&b| b == b'\n').enumerate() {
        let number = at as u64 + 1;
        let text = line.split(|&b| b == b'#').next().unwrap_or(&[]).trim_ascii();
        if let Some(text) = text.strip_suffix(b"\\") {
            if joined.is_empty() {
                joined_from = number;
            }
            joined.extend_from_slice(text);
            joined.push(b' ');
        } else if joined.is_empty() {
            f(number, text)?;
        } else {
            joined.extend_from_slice(text);
            f(joined_from, &joined)?;
            joined.clear();
        }
    }
    if joined.is_empty() { Ok(()) } else { f(joined_from, &joined) }
}

/// First word of a line, and the rest.
fn keyword(line: &[u8]) -> (&[u8], &[u8]) {
    let line = line.trim_ascii_start();
    line.split_at(line.iter().position(u8::is_ascii_whitespace).unwrap_or(line.len()))
}

/// The first `N` numbers of a line.
fn numbers<const N: usize>(line: u64, words: &[u8], what: &str, must_be_finite: bool) -> Result<[f32; N], Fault> {
    let mut words = words.split(u8::is_ascii_whitespace).filter(|w| !w.is_empty());
    let mut values = [0.0; N];
    for (i, value) in values.iter_mut().enumerate() {
        let Some(word) = words.next() else {
            return Err(Fault::syntax(Place::Line(line), format!("{N} numbers after {what}"), format!("{i}")));
        };
        *value = match std::str::from_utf8(word).ok().and_then(|w| w.parse::<f32>().ok()) {
            Some(value) => value,
            None => return Err(Fault::syntax(Place::Line(line), format!("a number after {what}"), quote(word))),
        };
        if must_be_finite && !value.is_finite() {
            return Err(Fault::not_finite(Place::Line(line), format!("{what} coordinate {}", i + 1), String::from_utf8_lossy(word)));
        }
    }
    Ok(values)
}

/// `v`, `v/t`, `v//n` or `v/t/n`.
fn parse_corner(line: u64, word: &[u8], lists: &Lists, totals: &Totals) -> Result<FaceVertex, Fault> {
    let mut parts = word.split(|&b| b == b'/');
    let mut index = |what: &str, so_far: usize, total: u64| -> Result<Option<u32>, Fault> {
        let Some(part) = parts.next().filter(|p| !p.is_empty()) else { return Ok(None) };
        let Some(seen) = std::str::from_utf8(part).ok().and_then(|p| p.parse::<i64>().ok()) else {
            return Err(Fault::syntax(Place::Line(line), "a face corner as v, v/t, v//n or v/t/n", quote(word)));
        };
        // Negative numbers count back from the last one before this line.
        let zero_based = if seen < 0 { (so_far as i64).checked_add(seen) } else { seen.checked_sub(1) };
        match zero_based {
            Some(i) if i >= 0 && (i as u64) < total => Ok(Some(i as u32)),
            _ => Err(Fault::out_of_range(Place::Line(line), format!("{what} index"), seen, format!("1 to {total} or -{so_far} to -1"))),
        }
    };
    let position = index("vertex", lists.positions.len(), totals.positions)?;
    let uv = index("texture coordinate", lists.uvs.len(), totals.uvs)?;
    let normal = index("normal", lists.normals.len(), totals.normals)?;
    match (position, parts.next()) {
        (Some(position), None) => Ok(FaceVertex { position, uv: uv.unwrap_or(NONE), normal: normal.unwrap_or(NONE) }),
        _ => Err(Fault::syntax(Place::Line(line), "a face corner as v, v/t, v//n or v/t/n", quote(word))),
    }
}

/// One vertex per different corner, in the order of the positions; also the vertex of each corner.
fn unify(corners: &[FaceVertex], lists: &Lists) -> (Mesh, Vec<u32>) {
    let has_uvs = corners.iter().any(|c| c.uv != NONE);
    let mut order: Vec<u32> = (0..corners.len() as u32).collect();
    order.sort_unstable_by_key(|&i| (corners[i as usize], i));
    let mut mesh = Mesh::default();
    let mut vertices = vec![0; corners.len()];
    for run in order.chunk_by(|&a, &b| corners[a as usize] == corners[b as usize]) {
        let corner = corners[run[0] as usize];
        // Zero means missing: `finish` puts a smooth normal there.
        let normal = lists.normals.get(corner.normal as usize).copied().unwrap_or(Vec3::ZERO);
        let uv = has_uvs.then(|| lists.uvs.get(corner.uv as usize).copied().unwrap_or(Vec2::ZERO));
        let vertex = mesh.push_vertex(lists.positions[corner.position as usize], normal, uv);
        for &i in run {
            vertices[i as usize] = vertex;
        }
    }
    (mesh, vertices)
}
