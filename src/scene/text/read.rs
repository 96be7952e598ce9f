//! From a tree of places to a serde type, by the rules of RON with its extensions `implicit_some` and `unwrap_variant_newtypes`.
//!
//! `water: (...)` stands for `water: Some((...))`, and `Torus(radius_m: 1)` for `Torus((radius_m: 1))`; both notations are read.
//!
//! The methods that serde makes generic are compiled once for every type of a scene, some sixty times. They are a few lines each; what
//! can be decided about the tree alone is decided in functions that are compiled once. So an error carries no place: the reader keeps
//! the node that it is at, and whoever receives the error takes the place from there.

use std::cell::Cell;
use std::fmt;

use ron::extensions::Extensions;
use serde::de::value::StrDeserializer;
use serde::de::{self, DeserializeOwned, DeserializeSeed, Expected, IntoDeserializer, Unexpected, Visitor};

use super::tree::{Kind, Tree};
use crate::names::nearest;

/// What is wrong with a value.
#[derive(Debug, PartialEq)]
pub(crate) enum Problem {
    /// A field that does not exist.
    UnknownField { found: String, allowed: Vec<&'static str> },
    /// A field that has to be given and is not.
    MissingField(&'static str),
    /// A field given twice.
    DuplicateField(&'static str),
    /// A value without a name among fields: the node of that value.
    Unnamed(usize),
    /// A value of another type, with what could stand there.
    Expected(String),
}

/// A value that the type has no room for.
#[derive(Debug)]
pub(crate) struct Misfit {
    /// The node that the problem is about: the value, or the one that lacks a field.
    pub(crate) node: usize,
    /// What is wrong with it.
    pub(crate) problem: Problem,
}

/// Reads the tree's outermost value. `extensions` are those that the file enables; the two that all files have need not be among them.
pub(crate) fn read<T: DeserializeOwned>(tree: &Tree<'_>, extensions: Extensions) -> Result<T, Misfit> {
    read_with(tree, extensions, Tree::ROOT, |value| T::deserialize(value))
}

/// Gives the value at a node to a function that reads it.
pub(crate) fn read_with<T>(
    tree: &Tree<'_>,
    extensions: Extensions,
    node: usize,
    read: impl FnOnce(Value<'_>) -> Result<T, Error>,
) -> Result<T, Misfit> {
    let reader = Reader { tree, names: extensions.contains(Extensions::EXPLICIT_STRUCT_NAMES), place: Cell::new(node) };
    read(Value { reader: &reader, node, is_payload: false })
        .map_err(|Error(problem)| Misfit { node: reader.place.get(), problem: *problem })
}

/// The tree, and the node that is being read.
struct Reader<'t> {
    tree: &'t Tree<'t>,
    /// Whether structs need their names before the parenthesis.
    names: bool,
    place: Cell<usize>,
}

impl Reader<'_> {
    /// The error that `expected` should stand where `node` does.
    fn refuse<T>(&self, node: usize, expected: impl Into<String>) -> Result<T, Error> {
        self.place.set(node);
        Err(Error::expected(expected))
    }

    fn items(&self, node: usize) -> Items<'_> {
        Items { reader: self, parent: node, at: node, next: node + 1 }
    }
}

/// A value to be read.
#[derive(Clone, Copy)]
pub struct Value<'r> {
    reader: &'r Reader<'r>,
    node: usize,
    /// Whether the value is what stands in the parentheses of `node`, behind `Some` or the name of a variant.
    is_payload: bool,
}

impl<'r> Value<'r> {
    /// The value as one that is not spread over the parentheses of a variant.
    fn single(self) -> Result<Self, Error> {
        self.reader.place.set(self.node);
        if !self.is_payload {
            return Ok(self);
        }
        let mut items = self.reader.items(self.node);
        match items.take_unnamed()? {
            Some(only) => {
                items.finish()?;
                self.reader.place.set(only.node);
                Ok(only)
            }
            None => self.reader.refuse(self.node, "a value in the parentheses"),
        }
    }

    /// A number, truth value or text as `ron` reads it; `expected` says which.
    fn leaf<T: DeserializeOwned>(self, expected: &str) -> Result<T, Error> {
        ron::from_str(self.leaf_source(expected)?).map_err(|error| leaf_error(&error.code, expected))
    }

    fn leaf_source(self, expected: &str) -> Result<&'r str, Error> {
        let Self { reader, node, .. } = self.single()?;
        if reader.tree.kind(node) == Kind::Leaf { Ok(reader.tree.source(node)) } else { reader.refuse(node, expected) }
    }

    /// The value of an option, if there is one.
    fn option(self) -> Result<Option<Self>, Error> {
        let value = self.single()?;
        let tree = self.reader.tree;
        Ok(match (tree.head(value.node), tree.kind(value.node)) {
            ("None", Kind::Leaf) => None,
            ("Some", Kind::Group) => Some(Self { is_payload: true, ..value }),
            _ => Some(value),
        })
    }

    fn list(self) -> Result<Items<'r>, Error> {
        let Self { reader, node, .. } = self.single()?;
        if reader.tree.kind(node) == Kind::List { Ok(reader.items(node)) } else { reader.refuse(node, "a list in [square brackets]") }
    }

    /// The fields of a struct or the elements of a tuple, which may be called `name`.
    fn group(self, name: &'static str) -> Result<Items<'r>, Error> {
        let Self { reader, mut node, is_payload } = self;
        let tree = reader.tree;
        if is_payload {
            // `Torus((radius_m: 1))` has parentheses of its own, `Torus(radius_m: 1)` uses the variant's.
            match tree.only_value(node).filter(|&only| tree.kind(only) == Kind::Group) {
                Some(own) => node = own,
                None => return Ok(reader.items(node)),
            }
        }
        if tree.kind(node) != Kind::Group {
            return reader.refuse(node, "values in (parentheses)");
        }
        match tree.head(node) {
            "" if reader.names && !name.is_empty() => reader.refuse(node, format!("`{name}` before the parenthesis")),
            "" => Ok(reader.items(node)),
            seen if seen == name => Ok(reader.items(node)),
            _ if name.is_empty() => reader.refuse(node, "no name before the parenthesis"),
            _ => reader.refuse(node, format!("`{name}` or no name before the parenthesis")),
        }
    }

    /// The parentheses behind the name of a variant, as a value.
    fn payload(self) -> Result<Self, Error> {
        if self.reader.tree.kind(self.node) == Kind::Group {
            Ok(Self { is_payload: true, ..self })
        } else {
            self.reader.refuse(self.node, "values in (parentheses)")
        }
    }

    /// Reads a struct whose fields are known at run time: `read` is given the place of each field's name among `names`, and its value.
    pub(crate) fn fields(
        self,
        name: &'static str,
        names: &[&'static str],
        mut read: impl FnMut(usize, Self) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let mut items = self.group(name)?;
        let mut seen = vec![false; names.len()];
        while let Some(found) = items.take_name()? {
            let place = names.iter().position(|name| *name == found).ok_or_else(|| Error::unknown_field_of(found, names))?;
            if std::mem::replace(&mut seen[place], true) {
                return Err(de::Error::duplicate_field(names[place]));
            }
            read(place, items.value())?;
            items.leave();
        }
        Ok(())
    }

    /// One of a few names, which stands alone: its place among them.
    pub(crate) fn one_of(self, names: &'static [&'static str]) -> Result<usize, Error> {
        let value = self.single()?;
        let found = value.reader.tree.head(value.node);
        let place = names.iter().position(|name| *name == found).ok_or_else(|| <Error as de::Error>::unknown_variant(found, names))?;
        de::VariantAccess::unit_variant(value)?;
        Ok(place)
    }

    /// The name of an enum's variant.
    fn variant(self) -> StrDeserializer<'r, Error> {
        self.reader.tree.head(self.node).into_deserializer()
    }
}

impl<'de> de::Deserializer<'de> for Value<'_> {
    type Error = Error;

    fn deserialize_bool<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        visitor.visit_bool(self.leaf("true or false")?)
    }

    fn deserialize_u32<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        visitor.visit_u32(self.leaf("a whole number")?)
    }

    fn deserialize_f32<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        visitor.visit_f32(self.leaf("a number")?)
    }

    fn deserialize_string<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        visitor.visit_string(self.leaf("a text in double quotes")?)
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        match self.option()? {
            None => visitor.visit_none(),
            Some(value) => visitor.visit_some(value),
        }
    }

    fn deserialize_seq<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        let mut items = self.list()?;
        let value = visitor.visit_seq(&mut items)?;
        items.finish()?;
        Ok(value)
    }

    fn deserialize_tuple<V: Visitor<'de>>(self, len: usize, visitor: V) -> Result<V::Value, Error> {
        self.deserialize_tuple_struct("", len, visitor)
    }

    fn deserialize_tuple_struct<V: Visitor<'de>>(self, name: &'static str, _len: usize, visitor: V) -> Result<V::Value, Error> {
        let mut items = self.group(name)?;
        let value = visitor.visit_seq(&mut items)?;
        items.finish()?;
        Ok(value)
    }

    fn deserialize_struct<V: Visitor<'de>>(self, name: &'static str, _: &'static [&'static str], visitor: V) -> Result<V::Value, Error> {
        visitor.visit_map(self.group(name)?)
    }

    fn deserialize_enum<V: Visitor<'de>>(self, _: &'static str, _: &'static [&'static str], visitor: V) -> Result<V::Value, Error> {
        visitor.visit_enum(self.single()?)
    }

    fn deserialize_ignored_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        visitor.visit_unit()
    }

    /// Scenes hold the types above alone, and each of them says what it expects.
    fn deserialize_any<V: Visitor<'de>>(self, _: V) -> Result<V::Value, Error> {
        self.reader.refuse(self.node, "a type that scene files have")
    }

    serde::forward_to_deserialize_any! {
        i8 i16 i32 i64 i128 u8 u16 u64 u128 f64 char str bytes byte_buf unit unit_struct newtype_struct map identifier
    }
}

impl<'de> de::EnumAccess<'de> for Value<'_> {
    type Error = Error;
    type Variant = Self;

    fn variant_seed<V: DeserializeSeed<'de>>(self, seed: V) -> Result<(V::Value, Self), Error> {
        Ok((seed.deserialize(self.variant())?, self))
    }
}

impl<'de> de::VariantAccess<'de> for Value<'_> {
    type Error = Error;

    fn unit_variant(self) -> Result<(), Error> {
        let tree = self.reader.tree;
        if tree.kind(self.node) == Kind::Leaf { Ok(()) } else { self.reader.refuse(self.node, format!("`{}` alone", tree.head(self.node))) }
    }

    fn newtype_variant_seed<T: DeserializeSeed<'de>>(self, seed: T) -> Result<T::Value, Error> {
        seed.deserialize(self.payload()?)
    }

    fn tuple_variant<V: Visitor<'de>>(self, len: usize, visitor: V) -> Result<V::Value, Error> {
        de::Deserializer::deserialize_tuple(self.payload()?, len, visitor)
    }

    fn struct_variant<V: Visitor<'de>>(self, _: &'static [&'static str], visitor: V) -> Result<V::Value, Error> {
        visitor.visit_map(self.reader.items(self.payload()?.node))
    }
}

/// What stands in a pair of brackets, from left to right.
struct Items<'r> {
    reader: &'r Reader<'r>,
    parent: usize,
    /// The item that was taken last.
    at: usize,
    next: usize,
}

impl<'r> Items<'r> {
    /// Moves to the next item, and back to the parent behind the last one.
    fn advance(&mut self) -> bool {
        let more = self.next < self.reader.tree.past(self.parent);
        if more {
            self.at = self.next;
            self.next = self.reader.tree.past(self.at);
        }
        self.reader.place.set(if more { self.at } else { self.parent });
        more
    }

    /// The item that was taken last, as a value.
    fn value(&self) -> Value<'r> {
        Value { reader: self.reader, node: self.at, is_payload: false }
    }

    fn take_unnamed(&mut self) -> Result<Option<Value<'r>>, Error> {
        if !self.advance() {
            return Ok(None);
        }
        match self.reader.tree.name(self.at) {
            None => Ok(Some(self.value())),
            Some(_) => self.reader.refuse(self.parent, "values without names"),
        }
    }

    fn take_named(&mut self) -> Result<Option<StrDeserializer<'r, Error>>, Error> {
        Ok(self.take_name()?.map(IntoDeserializer::into_deserializer))
    }

    /// The name of the next item, which must have one.
    fn take_name(&mut self) -> Result<Option<&'r str>, Error> {
        if !self.advance() {
            return Ok(None);
        }
        match self.reader.tree.name(self.at) {
            Some(name) => Ok(Some(name)),
            None => {
                self.leave();
                Err(Error(Box::new(Problem::Unnamed(self.at))))
            }
        }
    }

    /// What is wrong from here on is wrong with the parent.
    fn leave(&self) {
        self.reader.place.set(self.parent);
    }

    /// Refuses an item that is left over.
    fn finish(&mut self) -> Result<(), Error> {
        if self.advance() { self.reader.refuse(self.at, "no more values") } else { Ok(()) }
    }
}

impl<'de> de::SeqAccess<'de> for &mut Items<'_> {
    type Error = Error;

    fn next_element_seed<T: DeserializeSeed<'de>>(&mut self, seed: T) -> Result<Option<T::Value>, Error> {
        let Some(element) = self.take_unnamed()? else { return Ok(None) };
        let value = seed.deserialize(element)?;
        self.leave();
        Ok(Some(value))
    }
}

impl<'de> de::MapAccess<'de> for Items<'_> {
    type Error = Error;

    fn next_key_seed<K: DeserializeSeed<'de>>(&mut self, seed: K) -> Result<Option<K::Value>, Error> {
        let Some(name) = self.take_named()? else { return Ok(None) };
        seed.deserialize(name).map(Some)
    }

    fn next_value_seed<V: DeserializeSeed<'de>>(&mut self, seed: V) -> Result<V::Value, Error> {
        let value = seed.deserialize(self.value())?;
        self.leave();
        Ok(value)
    }
}

/// A [`Problem`] in a box: results of all types are moved about, and errors are rare.
#[derive(Debug)]
pub struct Error(Box<Problem>);

impl Error {
    fn expected(expected: impl Into<String>) -> Self {
        Self(Box::new(Problem::Expected(expected.into())))
    }

    fn unknown_field_of(found: &str, allowed: &[&'static str]) -> Self {
        Self(Box::new(Problem::UnknownField { found: found.to_owned(), allowed: allowed.to_vec() }))
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Debug::fmt(&self.0, f)
    }
}

impl std::error::Error for Error {}

impl de::Error for Error {
    fn custom<T: fmt::Display>(message: T) -> Self {
        Self::expected(message.to_string())
    }

    fn invalid_type(_: Unexpected<'_>, expected: &dyn Expected) -> Self {
        Self::expected(expected.to_string())
    }

    fn invalid_value(_: Unexpected<'_>, expected: &dyn Expected) -> Self {
        Self::expected(expected.to_string())
    }

    fn invalid_length(_: usize, expected: &dyn Expected) -> Self {
        Self::expected(expected.to_string())
    }

    fn unknown_variant(found: &str, allowed: &'static [&'static str]) -> Self {
        let hint = nearest(found, allowed.iter().copied()).map(|name| format!(" (did you mean `{name}`?)")).unwrap_or_default();
        Self::expected(format!("one of: {}{hint}", allowed.join(", ")))
    }

    fn unknown_field(found: &str, allowed: &'static [&'static str]) -> Self {
        Self::unknown_field_of(found, allowed)
    }

    fn missing_field(field: &'static str) -> Self {
        Self(Box::new(Problem::MissingField(field)))
    }

    fn duplicate_field(field: &'static str) -> Self {
        Self(Box::new(Problem::DuplicateField(field)))
    }
}

/// What `ron` refused in a leaf that should be `expected`.
fn leaf_error(error: &ron::Error, expected: &str) -> Error {
    Error::expected(match error {
        ron::Error::IntegerOutOfBounds => format!("a whole number from 0 to {}", u32::MAX),
        ron::Error::InvalidIntegerDigit { base, .. } if *base != 10 => format!("a whole number in base {base}"),
        ron::Error::InvalidEscape(reason) => format!("{expected}, its escapes as in Rust ({reason})"),
        _ => expected.to_owned(),
    })
}

#[cfg(test)]
#[path = "read_tests.rs"]
mod tests;
