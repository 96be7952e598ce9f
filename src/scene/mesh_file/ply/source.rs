//! The body: numbers, one after the other, in any of the three encodings.

use super::{
    super::{Fault, Place, error::quote},
    header::{Element, Encoding, Header, Kind, Property, Scalar, line_length},
};

/// Reads numbers and knows where it is.
pub(super) struct PlyReader<'a> {
    bytes: &'a [u8],
    encoding: Encoding,
    offset: usize,
    /// ASCII: rest of the current line, and its number from 1.
    line: &'a [u8],
    line_number: u64,
}

impl<'a> PlyReader<'a> {
    pub(super) fn new(bytes: &'a [u8], header: &Header) -> Self {
        Self { bytes, encoding: header.encoding, offset: header.byte_count, line: &[], line_number: header.line_count }
    }

    /// Where the number read last stands.
    pub(super) fn place(&self) -> Place {
        match self.encoding {
            Encoding::Ascii => Place::Line(self.line_number),
            _ => Place::Byte(self.offset as u64),
        }
    }

    fn left(&self) -> u64 {
        (self.bytes.len() - self.offset) as u64
    }

    /// Refuses a declared count that the bytes left cannot hold.
    pub(super) fn check_count(&self, element: &Element) -> Result<(), Fault> {
        let size = |p: &Property| match (self.encoding, p.kind) {
            // A digit and what separates it from the next.
            (Encoding::Ascii, _) => 2,
            (_, Kind::Scalar(scalar)) => scalar.size() as u64,
            (_, Kind::List { count, .. }) => count.size() as u64,
        };
        let each: u64 = element.properties.iter().map(size).sum();
        // The very last number needs nothing after it.
        let spared = u64::from(self.encoding == Encoding::Ascii && each > 0 && element.count > 0);
        let needed = element.count.saturating_mul(each) - spared;
        if needed > self.left() {
            let what = format!("element {} (declared {} times in line {})", element.name, element.count, element.line);
            return Err(Fault::truncated(self.place(), what, needed, self.left()));
        }
        Ok(())
    }

    /// Goes to the next instance of an element: the next line that is not empty, in ASCII.
    pub(super) fn begin(&mut self, element: &Element, instance: u64) -> Result<(), Fault> {
        if self.encoding != Encoding::Ascii || element.properties.is_empty() {
            return Ok(());
        }
        loop {
            if self.offset == self.bytes.len() {
                let seen = format!("the end of the file after {instance} of {} {} lines", element.count, element.name);
                return Err(Fault::syntax(Place::Line(self.line_number + 1), format!("{} {instance}", element.name), seen));
            }
            let (end, next) = line_length(&self.bytes[self.offset..]);
            self.line = self.bytes[self.offset..self.offset + end].trim_ascii();
            self.offset += next;
            self.line_number += 1;
            if !self.line.is_empty() {
                return Ok(());
            }
        }
    }

    /// The next number.
    pub(super) fn scalar(&mut self, scalar: Scalar, name: &str) -> Result<f64, Fault> {
        match self.encoding {
            Encoding::Ascii => self.word(scalar, name),
            Encoding::LittleEndian => self.binary(scalar, name, false),
            Encoding::BigEndian => self.binary(scalar, name, true),
        }
    }

    fn word(&mut self, scalar: Scalar, name: &str) -> Result<f64, Fault> {
        let line = self.line.trim_ascii_start();
        let length = line.iter().position(u8::is_ascii_whitespace).unwrap_or(line.len());
        let (word, rest) = line.split_at(length);
        self.line = rest;
        if word.is_empty() {
            return Err(Fault::syntax(self.place(), format!("a number for property {name}"), "the end of the line"));
        }
        let text = std::str::from_utf8(word).ok();
        // A float is rounded once, from the digits.
        let value = match scalar {
            Scalar::F32 => text.and_then(|t| t.parse::<f32>().ok()).map(f64::from),
            _ => text.and_then(|t| t.parse::<f64>().ok()),
        };
        value.ok_or_else(|| Fault::syntax(self.place(), format!("a number for property {name}"), quote(word)))
    }

    fn binary(&mut self, scalar: Scalar, name: &str, big_endian: bool) -> Result<f64, Fault> {
        let size = scalar.size();
        let Some(read) = self.bytes[self.offset..].get(..size) else {
            return Err(Fault::truncated(self.place(), format!("property {name}"), size as u64, self.left()));
        };
        self.offset += size;
        let mut raw = [0; 8];
        raw[..size].copy_from_slice(read);
        if big_endian {
            raw[..size].reverse();
        }
        let [a, b, c, d, ..] = raw;
        Ok(match scalar {
            Scalar::I8 => f64::from(a as i8),
            Scalar::U8 => f64::from(a),
            Scalar::I16 => f64::from(i16::from_le_bytes([a, b])),
            Scalar::U16 => f64::from(u16::from_le_bytes([a, b])),
            Scalar::I32 => f64::from(i32::from_le_bytes([a, b, c, d])),
            Scalar::U32 => f64::from(u32::from_le_bytes([a, b, c, d])),
            Scalar::F32 => f64::from(f32::from_le_bytes([a, b, c, d])),
            Scalar::F64 => f64::from_le_bytes(raw),
        })
    }

    /// The length of a list, refused if what is left cannot hold it.
    pub(super) fn list_count(&mut self, count: Scalar, item: Scalar, name: &str) -> Result<u64, Fault> {
        let seen = self.scalar(count, name)?;
        if !(seen >= 0.0 && seen.fract() == 0.0) {
            return Err(Fault::out_of_range(self.place(), format!("length of list {name}"), seen as i64, "a whole number from 0"));
        }
        let seen = seen as u64;
        let (each, left) = match self.encoding {
            Encoding::Ascii => (2, self.line.len() as u64),
            _ => (item.size() as u64, self.left()),
        };
        let needed = seen.saturating_mul(each);
        if needed > left {
            return Err(Fault::truncated(self.place(), format!("list {name} of {seen} numbers"), needed, left));
        }
        Ok(seen)
    }

    /// Reads a property and forgets it.
    pub(super) fn pass_over(&mut self, property: &Property) -> Result<(), Fault> {
        match property.kind {
            Kind::Scalar(scalar) => self.scalar(scalar, &property.name).map(|_| ()),
            Kind::List { count, item } => {
                let length = self.list_count(count, item, &property.name)?;
                (0..length).try_for_each(|_| self.scalar(item, &property.name).map(|_| ()))
            }
        }
    }
}
