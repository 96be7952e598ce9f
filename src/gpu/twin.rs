//! A program's WGSL twin, made ready for a driver: what it binds, and the entry points that the twin itself does not have.

use std::fmt::Write as _;

use naga::front::wgsl;
use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};

use super::GpuError;
use crate::pipeline::shader::{Interpolation, Program};

/// Entry point that pulls finished vertices from a buffer instead of shading them.
pub(super) const PULLED_VERTEX: &str = "nephroid_pulled";
/// Entry point of fragments that also count themselves.
pub(super) const COUNTED_FRAGMENT: &str = "nephroid_counted";
/// Bind group of the pulled vertices.
pub(super) const PULLED_GROUP: u32 = 1;

/// What a texture binding is to the shader.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct TextureUse {
    pub dimension: wgpu::TextureViewDimension,
    pub depth: bool,
}

/// Which vertices a pipeline draws.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum VertexSource {
    /// The twin's `vs`.
    Shaded,
    /// Finished ones, with the place inside a sprite if they are corners of one.
    Pulled { point_coord: bool },
}

/// A twin with everything a pipeline needs.
#[derive(Debug)]
pub(super) struct Twin {
    pub source: String,
    pub vertex_entry: &'static str,
    pub fragment_entry: Option<&'static str>,
    /// Bindings of group 0 that the entry points use, and what those are that are textures.
    pub bindings: Vec<(u32, Option<TextureUse>)>,
}

impl Twin {
    /// Completes a program's twin. `counter` is the location of the target that counts fragments.
    pub fn new(program: &Program, vertices: VertexSource, has_targets: bool, counter: Option<u32>) -> Result<Self, GpuError> {
        let fail = |why: String| GpuError::Twin { program: program.name, why };
        let original = program.wgsl.ok_or_else(|| fail("it has no WGSL twin".to_owned()))?;
        let mut source = original.to_owned();
        let mut vertex_entry = "vs";
        if let VertexSource::Pulled { point_coord } = vertices {
            source.push_str(&pulled_vertex(program, point_coord));
            vertex_entry = PULLED_VERTEX;
        }
        let discards = program.may_discard || program.writes_depth;
        let mut fragment_entry = (program.fragment.is_some() && (has_targets || discards)).then_some("fs");
        if let Some(location) = counter {
            source = counted_fragment(&source, program, location).map_err(&fail)?;
            fragment_entry = Some(COUNTED_FRAGMENT);
        }
        let (module, info) = parse(&source).map_err(&fail)?;
        let mut bindings = Vec::new();
        for (index, entry) in module.entry_points.iter().enumerate() {
            if entry.name != vertex_entry && Some(entry.name.as_str()) != fragment_entry {
                continue;
            }
            for (handle, variable) in module.global_variables.iter() {
                let Some(binding) = variable.binding.as_ref().filter(|b| b.group == 0) else { continue };
                let is_new = bindings.iter().all(|(number, _)| *number != binding.binding);
                if is_new && !info.get_entry_point(index)[handle].is_empty() {
                    bindings.push((binding.binding, texture_use(&module.types[variable.ty].inner)));
                }
            }
        }
        if !module.entry_points.iter().any(|e| e.name == vertex_entry) {
            return Err(fail(format!("its twin has no entry point `{vertex_entry}`")));
        }
        bindings.sort_by_key(|b| b.0);
        Ok(Self { source, vertex_entry, fragment_entry, bindings })
    }
}

fn parse(source: &str) -> Result<(naga::Module, ModuleInfo), String> {
    let module = wgsl::parse_str(source).map_err(|error| error.emit_to_string(source))?;
    let mut validator = Validator::new(ValidationFlags::all(), Capabilities::all());
    let info = validator.validate(&module).map_err(|error| error.emit_to_string(source))?;
    Ok((module, info))
}

fn texture_use(inner: &naga::TypeInner) -> Option<TextureUse> {
    let naga::TypeInner::Image { dim, arrayed, class } = *inner else { return None };
    let dimension = match (dim, arrayed) {
        (naga::ImageDimension::D1, _) => wgpu::TextureViewDimension::D1,
        (naga::ImageDimension::D2, false) => wgpu::TextureViewDimension::D2,
        (naga::ImageDimension::D2, true) => wgpu::TextureViewDimension::D2Array,
        (naga::ImageDimension::D3, _) => wgpu::TextureViewDimension::D3,
        (naga::ImageDimension::Cube, false) => wgpu::TextureViewDimension::Cube,
        (naga::ImageDimension::Cube, true) => wgpu::TextureViewDimension::CubeArray,
    };
    Some(TextureUse { dimension, depth: matches!(class, naga::ImageClass::Depth { .. }) })
}

/// A vertex entry point that reads position and varyings, as many floats per vertex, from a buffer.
fn pulled_vertex(program: &Program, point_coord: bool) -> String {
    let mut fields = String::new();
    let mut values = String::new();
    let mut at = 4;
    let mut field = |components: usize, interpolation: Interpolation, name: &str| {
        let location = fields.lines().count();
        let mode = match interpolation {
            Interpolation::Perspective => "",
            Interpolation::Linear => "@interpolate(linear) ",
            Interpolation::Flat => "@interpolate(flat) ",
        };
        let ty = if components == 1 { "f32".to_owned() } else { format!("vec{components}<f32>") };
        // Writing to a string cannot fail.
        let _ = writeln!(fields, "    @location({location}) {mode}v{location}_{name}: {ty},");
        let numbers: Vec<String> = (at..at + components).map(|k| format!("nephroid_vertices[at + {k}u]")).collect();
        let _ = write!(values, ", {ty}({})", numbers.join(", "));
        at += components;
    };
    for varying in &program.varyings {
        field(varying.components, varying.interpolation, varying.name);
    }
    if point_coord {
        field(2, Interpolation::Linear, "point_coord");
    }
    format!(
        "
@group({PULLED_GROUP}) @binding(0) var<storage, read> nephroid_vertices: array<f32>;

struct NephroidPulled {{
    @builtin(position) position: vec4<f32>,
{fields}}}

@vertex
fn {PULLED_VERTEX}(@builtin(vertex_index) index: u32) -> NephroidPulled {{
    let at = index * {at}u;
    let position = vec4<f32>(nephroid_vertices[at], nephroid_vertices[at + 1u], nephroid_vertices[at + 2u], nephroid_vertices[at + 3u]);
    return NephroidPulled(position{values});
}}
"
    )
}

/// A fragment entry point that does what `fs` does and adds one to a further target.
///
/// `fs` itself becomes an ordinary function: an entry point cannot be called.
fn counted_fragment(source: &str, program: &Program, location: u32) -> Result<String, String> {
    if program.fragment.is_none() {
        return Ok(format!(
            "{source}\n@fragment\nfn {COUNTED_FRAGMENT}() -> @location({location}) vec4<f32> {{\n    return vec4<f32>(1.0);\n}}\n"
        ));
    }
    let (module, _) = parse(source)?;
    let entry = module.entry_points.iter().find(|e| e.name == "fs").ok_or("its twin has no entry point `fs`")?;
    // The arguments and the result as the source spells them.
    let start = source.find("fn fs(").ok_or("its `fs` is not spelled `fn fs(`")?;
    let body = start + source[start..].find('{').ok_or("its `fs` has no body")?;
    let signature = source[start + "fn fs(".len()..body].trim();
    let (arguments, result) = signature.split_once(") ->").unwrap_or((signature.trim_end_matches(')'), ""));
    let result = result.trim();
    let plain = without_attributes(arguments);
    let names: Vec<&str> = plain.split(',').filter_map(|a| a.split_once(':')).map(|(name, _)| name.trim()).collect();
    let attribute = source[..start].rfind("@fragment").ok_or("its `fs` has no `@fragment`")?;
    let mut fields = String::new();
    let mut values = Vec::new();
    match entry.function.result.as_ref().map(|r| &module.types[r.ty]) {
        None => {}
        Some(naga::Type { inner: naga::TypeInner::Struct { members, .. }, name: Some(name) }) => {
            let struct_start = source.find(&format!("struct {name} {{")).ok_or("the struct of its result is not in the source")?;
            let open = struct_start + source[struct_start..].find('{').ok_or("a struct without fields")?;
            let close = open + source[open..].find('}').ok_or("a struct without an end")?;
            fields.push_str(source[open + 1..close].trim());
            values.extend(members.iter().filter_map(|m| m.name.as_ref()).map(|m| format!("result.{m}")));
        }
        Some(_) => {
            let _ = write!(fields, "{} value: {}", attributes(result), without_attributes(result).trim());
            values.push("result".to_owned());
        }
    }
    if !fields.is_empty() && !fields.ends_with(',') {
        fields.push(',');
    }
    let (arrow, keep) = if values.is_empty() { ("", "") } else { (" -> ", "let result = ") };
    values.push("vec4<f32>(1.0)".to_owned());
    Ok(format!(
        "{}\nfn fs({plain}){arrow}{} {}
struct NephroidCounted {{
    {fields}
    @location({location}) nephroid_passed: vec4<f32>,
}}

@fragment
fn {COUNTED_FRAGMENT}({arguments}) -> NephroidCounted {{
    {keep}fs({});
    return NephroidCounted({});
}}
",
        &source[..attribute],
        without_attributes(result).trim(),
        &source[body..],
        names.join(", "),
        values.join(", "),
    ))
}

/// A declaration without its `@...` attributes.
fn without_attributes(text: &str) -> String {
    split_attributes(text).0
}

/// The `@...` attributes of a declaration.
fn attributes(text: &str) -> String {
    split_attributes(text).1
}

fn split_attributes(text: &str) -> (String, String) {
    let (mut plain, mut attributes) = (String::new(), String::new());
    let mut rest = text;
    while let Some(at) = rest.find('@') {
        plain.push_str(&rest[..at]);
        let word = rest[at + 1..].find(|c: char| !c.is_alphanumeric() && c != '_').map_or(rest.len(), |n| at + 1 + n);
        let end = if rest[word..].starts_with('(') { rest[word..].find(')').map_or(rest.len(), |n| word + n + 1) } else { word };
        attributes.push_str(&rest[at..end]);
        rest = rest[end..].trim_start();
    }
    plain.push_str(rest);
    (plain, attributes)
}
