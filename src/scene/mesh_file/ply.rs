//! PLY, the polygon file format: ASCII and binary of either byte order.
//!
//! Read are `vertex` with `x y z`, optionally `nx ny nz` and `u v`, `s t` or `texture_u texture_v`; `face` with the list
//! `vertex_indices` or `vertex_index`; and `tristrips`, strips separated by −1. Any other property or element is ignored, whatever
//! its type. ASCII elements take one line each; words beyond the declared properties are ignored.

mod header;
mod source;

use std::path::Path;

use glam::{Vec2, Vec3};

use super::{Fault, MeshFileError, MeshLimits, Place, error::MeshFileProblem, finish};
use crate::geom::{Mesh, triangulate_polygon};

use header::{Element, Header, Kind, parse_header};
use source::PlyReader;

/// Reads a PLY file from memory. `name` is the file's name in messages.
///
/// # Errors
/// If the bytes are no PLY file, exceed a limit or hold no triangle.
pub fn from_bytes(name: &Path, bytes: &[u8], limits: &MeshLimits) -> Result<Mesh, MeshFileError> {
    parse(bytes, limits).map_err(|fault| fault.in_file(name))
}

pub(super) fn parse(bytes: &[u8], limits: &MeshLimits) -> Result<Mesh, Fault> {
    let header = parse_header(bytes)?;
    let vertex_count = vertex_count(&header, limits)?;
    let mut source = PlyReader::new(bytes, &header);
    let mut body = Body { mesh: Mesh::default(), vertex_count, corners: Vec::new(), polygons: Vec::new() };
    for element in &header.elements {
        source.check_count(element)?;
        match element.name.as_str() {
            "vertex" => body.read_vertices(element, &mut source)?,
            "face" => body.read_faces(element, &mut source, limits)?,
            "tristrips" => body.read_strips(element, &mut source, limits)?,
            _ => body.pass_over(element, &mut source)?,
        }
    }
    body.triangulate(limits)?;
    finish(body.mesh)
}

/// The declared number of vertices, known before any face is read.
fn vertex_count(header: &Header, limits: &MeshLimits) -> Result<u64, Fault> {
    let mut vertex_elements = header.elements.iter().filter(|e| e.name == "vertex");
    let Some(element) = vertex_elements.next() else {
        return Err(Fault::syntax(Place::Line(header.line_count), "an element named vertex in the header", "none"));
    };
    if let Some(second) = vertex_elements.next() {
        return Err(Fault::syntax(Place::Line(second.line), "one element named vertex", "a second one"));
    }
    limits.check_vertices(element.count, || Place::Line(element.line))?;
    Ok(element.count)
}

/// What has been read so far.
struct Body {
    mesh: Mesh,
    vertex_count: u64,
    /// Corners of all faces that are no triangles, one after the other.
    corners: Vec<u32>,
    /// Corner count of each of them. Cut when the positions are known: faces may come first.
    polygons: Vec<u32>,
}

/// What a property of a vertex is for.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Use {
    Position(usize),
    Normal(usize),
    Uv(usize),
    Nothing,
}

impl Use {
    fn of(name: &str) -> Self {
        match name {
            "x" => Self::Position(0),
            "y" => Self::Position(1),
            "z" => Self::Position(2),
            "nx" => Self::Normal(0),
            "ny" => Self::Normal(1),
            "nz" => Self::Normal(2),
            "u" | "s" | "texture_u" => Self::Uv(0),
            "v" | "t" | "texture_v" => Self::Uv(1),
            _ => Self::Nothing,
        }
    }
}

impl Body {
    fn read_vertices(&mut self, element: &Element, source: &mut PlyReader<'_>) -> Result<(), Fault> {
        let uses: Vec<Use> =
            element.properties.iter().map(|p| if matches!(p.kind, Kind::Scalar(_)) { Use::of(&p.name) } else { Use::Nothing }).collect();
        let has = |wanted: Use| uses.contains(&wanted);
        if let Some(axis) = (0..3).find(|&axis| !has(Use::Position(axis))) {
            return Err(Fault::syntax(Place::Line(element.line), format!("a scalar vertex property {}", ["x", "y", "z"][axis]), "none"));
        }
        let has_normals = (0..3).all(|axis| has(Use::Normal(axis)));
        let has_uvs = (0..2).all(|axis| has(Use::Uv(axis)));
        for vertex in 0..element.count {
            source.begin(element, vertex)?;
            let (mut position, mut normal, mut uv) = (Vec3::ZERO, Vec3::ZERO, Vec2::ZERO);
            for (property, target) in element.properties.iter().zip(&uses) {
                let Kind::Scalar(scalar) = property.kind else {
                    source.pass_over(property)?;
                    continue;
                };
                let read = source.scalar(scalar, &property.name)?;
                let value = read as f32;
                let checked = |what: &str| {
                    if value.is_finite() {
                        Ok(value)
                    } else {
                        Err(Fault::not_finite(source.place(), format!("vertex {vertex}: {what}"), read))
                    }
                };
                match *target {
                    Use::Position(axis) => position[axis] = checked(&property.name)?,
                    Use::Normal(axis) => normal[axis] = value,
                    Use::Uv(axis) => uv[axis] = checked(&property.name)?,
                    Use::Nothing => {}
                }
            }
            self.mesh.push_vertex(position, if has_normals { normal } else { Vec3::ZERO }, has_uvs.then_some(uv));
        }
        Ok(())
    }

    fn read_faces(&mut self, element: &Element, source: &mut PlyReader<'_>, limits: &MeshLimits) -> Result<(), Fault> {
        let list = index_list(element)?;
        let mut polygon = Vec::new();
        for face in 0..element.count {
            source.begin(element, face)?;
            for (at, property) in element.properties.iter().enumerate() {
                let Kind::List { count, item } = property.kind else {
                    source.pass_over(property)?;
                    continue;
                };
                if at != list {
                    source.pass_over(property)?;
                    continue;
                }
                let corner_count = source.list_count(count, item, &property.name)?;
                polygon.clear();
                for _ in 0..corner_count {
                    let index = source.scalar(item, &property.name)?;
                    polygon.push(self.checked_index(index, face, source)?);
                }
            }
            let triangle_count = self.mesh.triangle_count() as u64 + self.corners.len() as u64 - 2 * self.polygons.len() as u64;
            limits.check_triangles(triangle_count + (polygon.len() as u64).saturating_sub(2), || source.place())?;
            match polygon.len() {
                // A face of one or two corners has no area; writers use them for what they do not want.
                0..3 => {}
                3 => self.mesh.indices.extend(&polygon),
                n => {
                    self.corners.extend(&polygon);
                    self.polygons.push(n as u32);
                }
            }
        }
        Ok(())
    }

    fn read_strips(&mut self, element: &Element, source: &mut PlyReader<'_>, limits: &MeshLimits) -> Result<(), Fault> {
        let list = index_list(element)?;
        for strip in 0..element.count {
            source.begin(element, strip)?;
            for (at, property) in element.properties.iter().enumerate() {
                let Kind::List { count, item } = property.kind else {
                    source.pass_over(property)?;
                    continue;
                };
                if at != list {
                    source.pass_over(property)?;
                    continue;
                }
                // The last two corners, and how many the strip had before them.
                let (mut last, mut length) = ([0; 2], 0_u64);
                for _ in 0..source.list_count(count, item, &property.name)? {
                    let index = source.scalar(item, &property.name)?;
                    if index == -1.0 {
                        length = 0;
                        continue;
                    }
                    let index = self.checked_index(index, strip, source)?;
                    if length >= 2 && last[0] != last[1] && last[1] != index && index != last[0] {
                        limits.check_triangles(self.mesh.triangle_count() as u64 + 1, || source.place())?;
                        let [a, b] = if length % 2 == 0 { last } else { [last[1], last[0]] };
                        self.mesh.indices.extend([a, b, index]);
                    }
                    last = [last[1], index];
                    length += 1;
                }
            }
        }
        Ok(())
    }

    fn pass_over(&self, element: &Element, source: &mut PlyReader<'_>) -> Result<(), Fault> {
        // An element without properties has no bytes, however many it declares.
        let count = if element.properties.is_empty() { 0 } else { element.count };
        for instance in 0..count {
            source.begin(element, instance)?;
            element.properties.iter().try_for_each(|property| source.pass_over(property))?;
        }
        Ok(())
    }

    fn checked_index(&self, index: f64, face: u64, source: &PlyReader<'_>) -> Result<u32, Fault> {
        if index >= 0.0 && index < self.vertex_count as f64 && index.fract() == 0.0 {
            return Ok(index as u32);
        }
        let what = format!("face {face}: vertex index");
        if index.is_finite() && index.fract() != 0.0 {
            return Err(Fault::syntax(source.place(), format!("{what}, a whole number"), index.to_string()));
        }
        Err(Fault::out_of_range(
            source.place(),
            what,
            index as i64,
            format!("0 to {} (the file has {} vertices)", self.vertex_count.saturating_sub(1), self.vertex_count),
        ))
    }

    /// Cuts the polygons, now that all positions are there.
    fn triangulate(&mut self, limits: &MeshLimits) -> Result<(), Fault> {
        limits.check_triangles(self.mesh.triangle_count() as u64 + self.corners.len() as u64 - 2 * self.polygons.len() as u64, || {
            Place::File
        })?;
        let mut rest = self.corners.as_slice();
        let mut points = Vec::new();
        for &n in &self.polygons {
            let (polygon, after) = rest.split_at(n as usize);
            rest = after;
            points.clear();
            points.extend(polygon.iter().map(|&i| self.mesh.positions[i as usize]));
            triangulate_polygon(&points, |t| self.mesh.indices.extend(t.map(|corner| polygon[corner])));
        }
        Ok(())
    }
}

/// Which property holds the corners of a face.
fn index_list(element: &Element) -> Result<usize, Fault> {
    let is_list =
        |p: &header::Property| matches!(p.kind, Kind::List { .. }) && matches!(p.name.as_str(), "vertex_indices" | "vertex_index");
    element.properties.iter().position(is_list).ok_or_else(|| Fault {
        at: Place::Line(element.line),
        problem: MeshFileProblem::Syntax {
            expected: format!("a list property vertex_indices or vertex_index of element {}", element.name),
            seen: "none".into(),
        },
    })
}
