//! A RON text as a flat tree of places: which value begins and ends where, and what it is called.

use std::ops::Range;

use super::walk::{self, is_word};
use super::{Path, Step, SyntaxError};

/// What kind of value stands at a place, as far as brackets tell.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Kind {
    /// A number, a name, a string or a character.
    #[default]
    Leaf,
    /// Values in `[]`.
    List,
    /// Values, or names and values, in `()`; before the parenthesis there may be the name of a type or variant.
    Group,
    /// Keys and values in `{}`.
    Map,
}

/// Bytes `start..end` of the text.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Span {
    start: u32,
    end: u32,
}

impl From<Range<usize>> for Span {
    fn from(range: Range<usize>) -> Self {
        Self { start: range.start as u32, end: range.end as u32 }
    }
}

impl Span {
    /// The bytes as a range of offsets.
    pub(crate) fn range(self) -> Range<usize> {
        self.start as usize..self.end as usize
    }
}

/// One value of the text.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Node {
    pub(super) kind: Kind,
    /// The field's name or the map's key; empty where there is none.
    pub(super) name: Span,
    pub(super) value: Span,
    /// The first node that is not inside this one: its next sibling, if it has one.
    pub(super) past: u32,
}

/// The values of a text. Node 0 is the outermost one; the nodes inside a value follow it.
pub(crate) struct Tree<'t> {
    /// The text.
    pub(crate) text: &'t str,
    nodes: Vec<Node>,
}

impl<'t> Tree<'t> {
    /// The outermost value.
    pub(crate) const ROOT: usize = 0;

    /// Checks that brackets, quotes, comments, commas and colons of `text` fit together and are nested at most
    /// [`MAX_DEPTH`](super::MAX_DEPTH) deep, and notes its values.
    pub(crate) fn parse(text: &'t str) -> Result<Self, SyntaxError> {
        Ok(Self { text, nodes: walk::nodes(text)? })
    }

    /// What stands before the outermost value: comments and attributes such as `#![enable(implicit_some)]`.
    pub(crate) fn header(&self) -> &'t str {
        &self.text[..self.value(Self::ROOT).start]
    }

    pub(crate) fn kind(&self, node: usize) -> Kind {
        self.nodes[node].kind
    }

    /// Where the value stands, with the name before its parenthesis.
    pub(crate) fn value(&self, node: usize) -> Range<usize> {
        self.nodes[node].value.range()
    }

    /// The source text of the value.
    pub(crate) fn source(&self, node: usize) -> &'t str {
        &self.text[self.value(node)]
    }

    /// Where the field's name stands, or the value if it has none.
    pub(crate) fn start(&self, node: usize) -> usize {
        let Node { name, value, .. } = self.nodes[node];
        if name == Span::default() { value.range().start } else { name.range().start }
    }

    /// The field's name, without the `r#` or the quotes that mark it as one.
    pub(crate) fn name(&self, node: usize) -> Option<&'t str> {
        let name = &self.text[self.nodes[node].name.range()];
        (!name.is_empty()).then(|| name.strip_prefix("r#").unwrap_or(name).trim_matches('"'))
    }

    /// The name before the parenthesis, empty where there is none; of a leaf, the whole leaf.
    pub(crate) fn head(&self, node: usize) -> &'t str {
        let source = self.source(node);
        match self.kind(node) {
            Kind::Leaf => source,
            _ => &source[..source.find(|c| !is_word(c)).unwrap_or(source.len())],
        }
    }

    /// The first node behind all that is inside this one.
    pub(crate) fn past(&self, node: usize) -> usize {
        self.nodes[node].past as usize
    }

    /// The nodes directly inside this one.
    fn children(&self, node: usize) -> impl Iterator<Item = usize> {
        let (first, end) = (node + 1, self.past(node));
        let inside = move |child: usize| (child < end).then_some(child);
        std::iter::successors(inside(first), move |&child| inside(self.past(child)))
    }

    /// The only value in a parenthesis, if it has no name: the 5 in `Some(5)`.
    pub(crate) fn only_value(&self, node: usize) -> Option<usize> {
        let child = node + 1;
        let only = self.kind(node) == Kind::Group && child < self.past(node) && self.past(child) == self.past(node);
        (only && self.name(child).is_none()).then_some(child)
    }

    /// The argument of `Some` or of a variant with one value. Paths have no step for it: its place follows from the variant.
    fn argument(&self, node: usize) -> Option<usize> {
        self.only_value(node).filter(|_| !self.head(node).is_empty())
    }

    /// The deepest value on the way along `path`, and how many of its steps lead there; of several fields with one name, the first.
    pub(crate) fn find(&self, path: &Path) -> (usize, usize) {
        let mut node = Self::ROOT;
        for (depth, step) in path.0.iter().enumerate() {
            let next = match step {
                // A step that names the variant stays at this value, or leads to the variant's argument.
                Step::Name(name) if self.kind(node) == Kind::Group && self.head(node) == name => Some(self.argument(node).unwrap_or(node)),
                _ => self.child(node, step),
            };
            let Some(next) = next else { return (node, depth) };
            node = next;
        }
        (node, path.0.len())
    }

    fn child(&self, mut node: usize, step: &Step) -> Option<usize> {
        // A path may leave out the name of a variant: `Waves([a, b])` has an element 1 as `[a, b]` has.
        while let Some(argument) = self.argument(node).filter(|&argument| self.kind(argument) != Kind::Leaf) {
            node = argument;
        }
        match step {
            Step::Name(wanted) => self.children(node).find(|&child| self.name(child) == Some(wanted)),
            Step::Index(index) => self.children(node).nth(*index).filter(|&child| self.name(child).is_none()),
        }
    }

    /// The way from the outermost value to `target`, without the names of variants.
    pub(crate) fn path_to(&self, target: usize) -> Path {
        let mut steps = Vec::new();
        let mut node = Self::ROOT;
        while node != target {
            // The first child that ends behind the target is the one around it.
            let Some((index, child)) = self.children(node).enumerate().find(|&(_, child)| target < self.past(child)) else { break };
            match self.name(child) {
                Some(name) => steps.push(Step::Name(name.to_owned())),
                None if self.argument(node) == Some(child) => {}
                None => steps.push(Step::Index(index)),
            }
            node = child;
        }
        Path(steps)
    }
}
