//! The two containers, and the buffers a document names.

use std::path::Path;

use base64::Engine;
use gltf_json as json;

use super::super::{Fault, MeshFileProblem, MeshLimits, Place, error::quote, io_fault, read_bounded};
use super::accessor::Buffers;
use crate::reach::{Astray, Reach};

/// JSON and binary part of a file; a file that does not start as GLB is all JSON.
pub(super) fn split(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), Fault> {
    if !bytes.starts_with(b"glTF") {
        return Ok((bytes, None));
    }
    let word = |at: usize| -> Result<u64, Fault> {
        let four = bytes.get(at..at + 4).and_then(|b| b.try_into().ok());
        four.map(|four| u64::from(u32::from_le_bytes(four)))
            .ok_or_else(|| Fault::truncated(Place::Byte(at as u64), "a GLB header", 4, bytes.len().saturating_sub(at) as u64))
    };
    let (version, length) = (word(4)?, word(8)?);
    if version != 2 {
        return Err(Fault::unsupported(Place::Byte(4), format!("GLB version {version}"), "must be 2"));
    }
    if length > bytes.len() as u64 {
        return Err(Fault::truncated(Place::Byte(8), "the GLB", length, bytes.len() as u64));
    }
    let (mut at, mut json, mut blob) = (12, None, None);
    while (at as u64) < length {
        let (size, kind) = (word(at)?, word(at + 4)?);
        let data = usize::try_from(size).ok().and_then(|size| bytes.get(at + 8..)?.get(..size));
        let Some(data) = data else {
            return Err(Fault::truncated(Place::Byte(at as u64), "a GLB chunk", size, (bytes.len() - (at + 8).min(bytes.len())) as u64));
        };
        match &(kind as u32).to_le_bytes() {
            b"JSON" if json.is_none() => json = Some(data),
            b"BIN\0" if blob.is_none() => blob = Some(data),
            // The specification asks to pass over unknown chunks.
            _ => {}
        }
        // Chunks start at multiples of four.
        at += 8 + data.len().next_multiple_of(4);
    }
    match json {
        Some(json) => Ok((json, blob)),
        None => Err(Fault::syntax(Place::Byte(12), "a JSON chunk", "none")),
    }
}

/// The bytes of all buffers.
pub(super) fn load_buffers<'a>(
    root: &json::Root,
    blob: Option<&'a [u8]>,
    base: Option<&Path>,
    limits: &MeshLimits,
) -> Result<Buffers<'a>, Fault> {
    let mut buffers = Buffers::default();
    for (index, buffer) in root.buffers.iter().enumerate() {
        let place = || Place::Item(format!("buffers[{index}]"));
        let data = match (&buffer.uri, blob) {
            (Some(uri), _) => load(uri, base, limits).map_err(|fault| Fault { at: place(), ..fault })?.into(),
            (None, Some(blob)) if index == 0 => blob.into(),
            _ => return Err(Fault::syntax(place(), "a uri, or a GLB with a binary chunk for buffer 0", "neither")),
        };
        buffers.push(data, buffer.byte_length.0, place)?;
    }
    Ok(buffers)
}

fn load(uri: &str, base: Option<&Path>, limits: &MeshLimits) -> Result<Vec<u8>, Fault> {
    let at = Place::File;
    if let Some(rest) = uri.strip_prefix("data:") {
        let Some((_, data)) = rest.split_once(";base64,") else {
            return Err(Fault::unsupported(
                at,
                format!("the URI {}", quote(uri.as_bytes())),
                "a data URI must be \"data:TYPE;base64,DATA\"",
            ));
        };
        return base64::engine::general_purpose::STANDARD
            .decode(data)
            .map_err(|e| Fault { at, problem: MeshFileProblem::Syntax { expected: "base64 data".into(), seen: e.to_string() } });
    }
    let refused = |why: &str| {
        let allowed =
            "must be a data URI, or a path relative to a .gltf file on disk, to a regular file in its folder or below, links included";
        Fault::unsupported(at.clone(), format!("the URI {}, {why},", quote(uri.as_bytes())), allowed)
    };
    let name = decoded(uri).map_err(refused)?;
    let Some(base) = base else { return Err(refused("which is not in this file")) };
    let in_buffer = |fault: Fault| match fault.problem {
        MeshFileProblem::Io { message } => {
            Fault { at: at.clone(), problem: MeshFileProblem::Io { message: format!("{}: {message}", base.join(&name).display()) } }
        }
        problem => Fault { at: at.clone(), problem },
    };
    let path = Reach::Below.locate(base, &name).map_err(|astray| match astray {
        Astray::Refused(why) => refused(why),
        Astray::Io(error) => in_buffer(io_fault(error)),
    })?;
    read_bounded(&path, limits.max_file_bytes).map_err(in_buffer)
}

/// The path that a relative URI writes. Its parts are decoded one by one: a separator that is percent-encoded is part of a name, which no
/// file of ours can have.
fn decoded(uri: &str) -> Result<String, &'static str> {
    let mut parts = Vec::new();
    for part in uri.split('/') {
        let part = percent_encoding::percent_decode_str(part).decode_utf8().map_err(|_| "which is not UTF-8")?;
        if part.contains('/') {
            return Err("which holds a percent-encoded separator");
        }
        parts.push(part);
    }
    Ok(parts.join("/"))
}
