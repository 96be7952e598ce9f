//! A program's WGSL twin, completed for a driver: the bindings it uses, and the entry points that the twin does not have.

use std::fmt::Write as _;

use naga::front::wgsl;
use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};

use super::GpuError;
use super::layout::{Used, used_bindings};
use nephroid_pipeline::BindingKind;
use nephroid_pipeline::shader::{Interpolation, Program};

/// Entry point that reads vertices from a buffer instead of shading them.
pub(super) const PULLED_VERTEX: &str = "nephroid_pulled";
/// Entry point of fragments that also adds one to a counter target.
pub(super) const COUNTED_FRAGMENT: &str = "nephroid_counted";
/// Entry point that runs the vertex stage and writes its output to a buffer.
pub(super) const STREAMED_VERTEX: &str = "nephroid_streamed";
/// Vertices per workgroup of [`STREAMED_VERTEX`].
pub(super) const STREAM_GROUP: u32 = 64;
/// Bind group of the pulled vertices and of the streamed ones.
pub(super) const PULLED_GROUP: u32 = 1;

/// The vertices that a pipeline draws.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum VertexSource {
    /// Vertices shaded by the twin's `vs`.
    Shaded,
    /// Vertices from a buffer; with `point_coord`, each has its position inside a sprite.
    Pulled { point_coord: bool },
}

/// A twin with all that a pipeline needs.
#[derive(Debug)]
pub(super) struct Twin {
    pub source: String,
    pub vertex_entry: &'static str,
    pub fragment_entry: Option<&'static str>,
    /// Bindings of group 0 that the entry points use.
    pub bindings: Vec<Used>,
}

impl Twin {
    /// Completes a program's twin. `counter` is the location of the target that counts fragments.
    ///
    /// # Errors
    /// If the program has no WGSL, the WGSL is not valid, or it lacks an entry point.
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
        let used = |name: &str| name == vertex_entry || Some(name) == fragment_entry;
        let entries: Vec<usize> = (0..module.entry_points.len()).filter(|&k| used(&module.entry_points[k].name)).collect();
        let bindings = used_bindings(&module, &info, &entries, &program.bindings).map_err(&fail)?;
        if !module.entry_points.iter().any(|e| e.name == vertex_entry) {
            return Err(fail(format!("its twin has no entry point `{vertex_entry}`")));
        }
        Ok(Self { source, vertex_entry, fragment_entry, bindings })
    }
}

/// A twin whose `vs` runs in a compute shader, for the vertices of many draws. Position and varyings of each vertex are written to a buffer in
/// stream-out's layout.
///
/// Bindings of group [`PULLED_GROUP`]: 0 for each vertex its index and the number of its draw, 1 the stream. A uniform whose offset each draw gives
/// becomes an array with one element per draw.
#[derive(Debug)]
pub(super) struct StreamedTwin {
    pub twin: Twin,
    /// The dynamic uniform, if the program has one: its binding, and the bytes from one draw's to the next draw's.
    pub dynamic: Option<(u32, usize)>,
}

/// Completes a program's twin with [`STREAMED_VERTEX`].
///
/// # Errors
/// If the program has no WGSL, or its `vs` cannot be called from a compute shader.
pub(super) fn streamed_vertex(program: &Program) -> Result<StreamedTwin, GpuError> {
    let fail = |why: String| GpuError::Twin { program: program.name, why };
    let original = program.wgsl.ok_or_else(|| fail("it has no WGSL twin".to_owned()))?;
    let (source, dynamic) = streamed_source(original, program).map_err(&fail)?;
    let (module, info) = parse(&source).map_err(&fail)?;
    let index = module.entry_points.iter().position(|e| e.name == STREAMED_VERTEX).ok_or_else(|| fail("no entry point".to_owned()))?;
    let bindings = used_bindings(&module, &info, &[index], &program.bindings).map_err(&fail)?;
    Ok(StreamedTwin { twin: Twin { bindings, source, vertex_entry: STREAMED_VERTEX, fragment_entry: None }, dynamic })
}

/// A dynamic uniform of a twin.
struct DynamicUniform {
    binding: u32,
    name: String,
    /// Name of its type.
    ty: String,
    /// Bytes of an array's element of this type.
    stride: usize,
}

/// The twin's dynamic uniform, if the program has one that the twin declares.
fn dynamic_uniform(module: &naga::Module, program: &Program) -> Result<Option<DynamicUniform>, String> {
    let Some(number) = program.bindings.iter().position(|kind| matches!(kind, BindingKind::DynamicUniform(_))) else { return Ok(None) };
    let is_it = |variable: &&naga::GlobalVariable| variable.binding.is_some_and(|b| b.group == 0 && b.binding == number as u32);
    let Some(variable) = module.global_variables.iter().map(|(_, variable)| variable).find(is_it) else { return Ok(None) };
    let ty = &module.types[variable.ty];
    match (&variable.name, &ty.name, &ty.inner) {
        (Some(name), Some(ty), naga::TypeInner::Struct { span, .. }) => {
            Ok(Some(DynamicUniform { binding: number as u32, name: name.clone(), ty: ty.clone(), stride: *span as usize }))
        }
        _ => Err("its dynamic uniform is not a named struct".to_owned()),
    }
}

/// WGSL of a streamed twin, and its dynamic uniform as in [`StreamedTwin`].
fn streamed_source(source: &str, program: &Program) -> Result<(String, Option<(u32, usize)>), String> {
    let (module, _) = parse(source)?;
    let entry = module.entry_points.iter().find(|e| e.name == "vs").ok_or("its twin has no entry point `vs`")?;
    let start = source.find("fn vs(").ok_or("its `vs` is not spelled `fn vs(`")?;
    let body = start + source[start..].find('{').ok_or("its `vs` has no body")?;
    let (arguments, result) = source[start + "fn vs(".len()..body].trim().split_once(") ->").ok_or("its `vs` returns nothing")?;
    if entry.function.arguments.len() != 1 || !arguments.contains("@builtin(vertex_index)") {
        return Err("its `vs` takes more than a vertex index".to_owned());
    }
    let attribute = source[..start].rfind("@vertex").ok_or("its `vs` has no `@vertex`")?;
    // Members of the result: the position, then the varyings in order.
    let members: Vec<String> = match entry.function.result.as_ref().map(|r| &module.types[r.ty].inner) {
        Some(naga::TypeInner::Struct { members, .. }) => {
            members.iter().filter_map(|m| m.name.as_ref()).map(|m| format!("result.{m}")).collect()
        }
        _ => vec!["result".to_owned()],
    };
    let components: Vec<usize> = std::iter::once(4).chain(program.varyings.iter().map(|v| v.components)).collect();
    if members.len() != components.len() {
        return Err(format!("its `vs` returns {} values, the program has {}", members.len(), components.len()));
    }
    let stride: usize = components.iter().sum();
    let mut writes = String::new();
    let mut at = 0;
    for (member, &count) in members.iter().zip(&components) {
        for c in 0..count {
            let value = if count == 1 { member.clone() } else { format!("{member}[{c}]") };
            // Writing to a string cannot fail.
            let _ = writeln!(writes, "    nephroid_stream[at + {at}u] = {value};");
            at += 1;
        }
    }
    let (mut before, mut set, mut stride_of) = (source[..attribute].to_owned(), String::new(), None);
    if let Some(DynamicUniform { binding, name, ty, stride }) = dynamic_uniform(&module, program)? {
        let declared = format!("@group(0) @binding({binding}) var<uniform> {name}: {ty};");
        if !before.contains(&declared) {
            return Err(format!("its dynamic uniform is not spelled `{declared}`"));
        }
        let array = format!("@group(0) @binding({binding}) var<storage, read> nephroid_draws: array<{ty}>;\nvar<private> {name}: {ty};");
        before = before.replace(&declared, &array);
        set = format!("    {name} = nephroid_draws[nephroid_indices[vertex].y];\n");
        stride_of = Some((binding, stride));
    }
    let source = format!(
        "{before}\nfn vs({}) -> {} {}
@group({PULLED_GROUP}) @binding(0) var<storage, read> nephroid_indices: array<vec2<u32>>;
@group({PULLED_GROUP}) @binding(1) var<storage, read_write> nephroid_stream: array<f32>;

@compute @workgroup_size({STREAM_GROUP})
fn {STREAMED_VERTEX}(@builtin(global_invocation_id) id: vec3<u32>) {{
    let vertex = id.x;
    if vertex >= arrayLength(&nephroid_indices) {{
        return;
    }}
{set}    let result = vs(nephroid_indices[vertex].x);
    let at = vertex * {stride}u;
{writes}}}
",
        without_attributes(arguments),
        without_attributes(result.trim()).trim(),
        &source[body..],
    );
    Ok((source, stride_of))
}

fn parse(source: &str) -> Result<(naga::Module, ModuleInfo), String> {
    let module = wgsl::parse_str(source).map_err(|error| error.emit_to_string(source))?;
    let mut validator = Validator::new(ValidationFlags::all(), Capabilities::all());
    let info = validator.validate(&module).map_err(|error| error.emit_to_string(source))?;
    Ok((module, info))
}

/// WGSL of a vertex entry point that reads position and varyings from a buffer.
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

/// WGSL with a fragment entry point that runs `fs` and adds one to a further target.
///
/// `fs` becomes an ordinary function, because an entry point cannot be called.
fn counted_fragment(source: &str, program: &Program, location: u32) -> Result<String, String> {
    if program.fragment.is_none() {
        return Ok(format!(
            "{source}\n@fragment\nfn {COUNTED_FRAGMENT}() -> @location({location}) vec4<f32> {{\n    return vec4<f32>(1.0);\n}}\n"
        ));
    }
    let (module, _) = parse(source)?;
    let entry = module.entry_points.iter().find(|e| e.name == "fs").ok_or("its twin has no entry point `fs`")?;
    // The arguments and the result, in the text of the source.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conformance::program::program;
    use nephroid_caustics::{RenderOptions, Renderer, TECHNIQUES};

    /// Every program of a shipped scene's frame, and the conformance programs.
    fn programs() -> Vec<std::sync::Arc<Program>> {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/pool.ron");
        let mut scene = TECHNIQUES.load(&path).unwrap();
        (scene.image.width, scene.image.height) = (16, 16);
        scene.time_s = 0.0;
        scene.techniques.coarsen();
        let frame = Renderer::new(&scene, &RenderOptions::default()).unwrap().build(&scene).unwrap().frame;
        let mut programs: Vec<_> = frame.pipelines.into_iter().map(|p| p.program).collect();
        programs.extend([Interpolation::Flat, Interpolation::Linear, Interpolation::Perspective].map(program));
        programs
    }

    #[test]
    fn completed_twins_are_valid() {
        let sources = [VertexSource::Shaded, VertexSource::Pulled { point_coord: false }, VertexSource::Pulled { point_coord: true }];
        for program in programs() {
            for vertices in sources {
                for counter in [None, Some(5)] {
                    if vertices == VertexSource::Shaded && program.geometry.is_some() {
                        continue;
                    }
                    let twin = Twin::new(&program, vertices, program.fragment.is_some(), counter);
                    assert!(twin.is_ok(), "{}, {vertices:?}, {counter:?}: {twin:?}", program.name);
                }
            }
        }
    }

    #[test]
    fn vertex_stages_are_streamed() {
        for program in programs() {
            let streamed = streamed_vertex(&program);
            assert_eq!(streamed.is_ok(), program.geometry.is_none(), "{}: {streamed:?}", program.name);
        }
    }

    #[test]
    fn fragments_that_return_nothing_or_one_value_are_counted() {
        let program = program(Interpolation::Flat);
        for fragment in [
            "@fragment\nfn fs(@builtin(position) at: vec4<f32>) {\n    if at.x < 3.0 { discard; }\n}",
            "@fragment\nfn fs(@builtin(position) at: vec4<f32>) -> @builtin(frag_depth) f32 {\n    return at.x * 0.001;\n}",
            "@fragment\nfn fs() -> @location(0) vec4<f32> {\n    return vec4<f32>(1.0);\n}",
        ] {
            let counted = counted_fragment(fragment, &program, 1).unwrap();
            let (module, _) = parse(&counted).unwrap();
            assert_eq!(module.entry_points.iter().map(|e| e.name.as_str()).collect::<Vec<_>>(), [COUNTED_FRAGMENT], "{counted}");
        }
    }

    #[test]
    fn what_cannot_be_completed_says_why() {
        let mut without = (*program(Interpolation::Flat)).clone();
        without.wgsl = None;
        let error = Twin::new(&without, VertexSource::Shaded, true, None).unwrap_err().to_string();
        assert_eq!(error, "program `conformance_flat`: it has no WGSL twin");
        without.wgsl = Some("@fragment fn fs() -> @location(0) vec4<f32> { return vec4<f32>(); }");
        assert!(Twin::new(&without, VertexSource::Shaded, true, None).is_err());
        without.wgsl = Some("not wgsl");
        assert!(Twin::new(&without, VertexSource::Shaded, true, None).is_err());
    }
}
