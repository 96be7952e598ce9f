//! The header: lines of text up to `end_header`, in binary files too.

use super::super::{Fault, Place, error::quote};

/// How numbers are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

/// A number type.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    const NAMES: [(&'static str, Self); 16] = [
        ("char", Self::I8),
        ("int8", Self::I8),
        ("uchar", Self::U8),
        ("uint8", Self::U8),
        ("short", Self::I16),
        ("int16", Self::I16),
        ("ushort", Self::U16),
        ("uint16", Self::U16),
        ("int", Self::I32),
        ("int32", Self::I32),
        ("uint", Self::U32),
        ("uint32", Self::U32),
        ("float", Self::F32),
        ("float32", Self::F32),
        ("double", Self::F64),
        ("float64", Self::F64),
    ];

    /// Size in binary files, in bytes.
    pub(super) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }
}

/// One number, or a count and as many numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Scalar(Scalar),
    List { count: Scalar, item: Scalar },
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Property {
    pub name: String,
    pub kind: Kind,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Element {
    pub name: String,
    pub count: u64,
    pub properties: Vec<Property>,
    /// Line that declares it, from 1.
    pub line: u64,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Header {
    pub encoding: Encoding,
    pub elements: Vec<Element>,
    /// Lines of the header, `end_header` included.
    pub line_count: u64,
    /// Bytes of the header, up to the first of the body.
    pub byte_count: usize,
}

/// Length of the line that starts at the beginning of `bytes`, without and with its end: `\n`, `\r\n` or `\r`.
pub(super) fn line_length(bytes: &[u8]) -> (usize, usize) {
    match bytes.iter().position(|b| matches!(b, b'\n' | b'\r')) {
        Some(end) if bytes[end..].starts_with(b"\r\n") => (end, end + 2),
        Some(end) => (end, end + 1),
        None => (bytes.len(), bytes.len()),
    }
}

pub(super) fn parse_header(bytes: &[u8]) -> Result<Header, Fault> {
    let mut encoding = None;
    let mut elements: Vec<Element> = Vec::new();
    let (mut offset, mut line) = (0, 0);
    loop {
        if offset == bytes.len() {
            return Err(Fault::syntax(
                Place::Line(line + 1),
                if line == 0 { "\"ply\"" } else { "a header line or end_header" },
                "the end of the file",
            ));
        }
        let (end, next) = line_length(&bytes[offset..]);
        let text = &bytes[offset..offset + end];
        offset += next;
        line += 1;
        let at = Place::Line(line);
        if line == 1 {
            if text.trim_ascii() != b"ply" {
                return Err(Fault::syntax(at, "\"ply\"", quote(text)));
            }
            continue;
        }
        let Ok(text) = std::str::from_utf8(text) else {
            // Comments may be in any encoding.
            if text.starts_with(b"comment") || text.starts_with(b"obj_info") {
                continue;
            }
            return Err(Fault::syntax(at, "a header line in ASCII", quote(text)));
        };
        let words: Vec<&str> = text.split_ascii_whitespace().collect();
        match words.as_slice() {
            [] | ["comment" | "obj_info", ..] => {}
            ["format", form, version] if encoding.is_none() => {
                if *version != "1.0" {
                    return Err(Fault::unsupported(at, format!("PLY version {}", quote(version.as_bytes())), "must be 1.0"));
                }
                encoding = Some(match *form {
                    "ascii" => Encoding::Ascii,
                    "binary_little_endian" => Encoding::LittleEndian,
                    "binary_big_endian" => Encoding::BigEndian,
                    _ => return Err(Fault::syntax(at, "ascii, binary_little_endian or binary_big_endian", quote(form.as_bytes()))),
                });
            }
            ["element", name, count] => {
                let Ok(count) = count.parse() else {
                    return Err(Fault::syntax(at, "a count, a whole number from 0", quote(count.as_bytes())));
                };
                elements.push(Element { name: (*name).into(), count, properties: Vec::new(), line });
            }
            ["property", rest @ ..] => {
                let Some(element) = elements.last_mut() else {
                    return Err(Fault::syntax(at, "an element before the first property", quote(text.as_bytes())));
                };
                element.properties.push(parse_property(rest, at)?);
            }
            ["end_header"] => break,
            _ => return Err(Fault::syntax(at, "format, comment, obj_info, element, property or end_header", quote(text.as_bytes()))),
        }
    }
    let Some(encoding) = encoding else {
        return Err(Fault::syntax(Place::Line(line), "a format line in the header", "none"));
    };
    Ok(Header { encoding, elements, line_count: line, byte_count: offset })
}

fn parse_property(words: &[&str], at: Place) -> Result<Property, Fault> {
    let scalar = |word: &str| match Scalar::NAMES.iter().find(|(name, _)| *name == word) {
        Some((_, scalar)) => Ok(*scalar),
        None => Err(Fault::syntax(
            at.clone(),
            "a number type (char, uchar, short, ushort, int, uint, float, double or int8 to float64)",
            quote(word.as_bytes()),
        )),
    };
    match words {
        ["list", count, item, name] => {
            let (count, item) = (scalar(count)?, scalar(item)?);
            if matches!(count, Scalar::F32 | Scalar::F64) {
                return Err(Fault::syntax(at, "an integer type for the count of a list", quote(words[1].as_bytes())));
            }
            Ok(Property { name: (*name).into(), kind: Kind::List { count, item } })
        }
        [kind, name] => Ok(Property { name: (*name).into(), kind: Kind::Scalar(scalar(kind)?) }),
        _ => Err(Fault::syntax(at, "property TYPE NAME or property list TYPE TYPE NAME", quote(words.join(" ").as_bytes()))),
    }
}
