//! Where things stand in a RON text: a position for every error, without building a tree.
//!
//! Input: the text of a scene file and a [`Path`] such as `lights[1].irradiance`. Output: the [`Position`] (line and column, both from 1,
//! columns counted in characters) of that field's name and value. The values themselves are read by the crate `ron`; it reports where its
//! own cursor stopped, which is after the offending value as often as before it, and knows nothing about values that parse but make no
//! sense. So this walker follows the brackets of the text again, only when an error needs a place, in memory independent of the
//! text's size, and to a depth of at most [`MAX_DEPTH`].
//!
//! It also runs once before `ron`, over the whole text, because a missing bracket is best reported where the open one stands.
//!
//! It does not judge numbers, identifiers or escapes: a word is any run of the characters that numbers and identifiers are made of.

use std::fmt;
use std::ops::Range;

/// Deepest nesting of brackets accepted; the deepest place of a valid scene is nested 10 brackets deep, constructors included.
pub const MAX_DEPTH: usize = 48;

/// Longest excerpt of the text quoted by an error, in characters.
const MAX_EXCERPT: usize = 48;

/// A place in a text: both numbers start at 1, columns are counted in characters (not bytes, not cells).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Position {
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
}

impl Position {
    /// The position of byte `offset` of `text`; an offset past the end gives the end.
    #[must_use]
    pub fn of(text: &str, offset: usize) -> Self {
        let mut end = offset.min(text.len());
        while !text.is_char_boundary(end) {
            end -= 1;
        }
        let before = &text[..end];
        let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
        Self { line: before.bytes().filter(|&b| b == b'\n').count() + 1, column: before[line_start..].chars().count() + 1 }
    }
}

impl fmt::Display for Position {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}", self.line, self.column)
    }
}

/// One step from a value to a value inside it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Step {
    /// A field by its name, or the name of an enum variant, which stays at the same value.
    Name(String),
    /// An element of a list or tuple, from 0.
    Index(usize),
}

/// The way from the scene to one of its values, printed as `objects[3].shape.radius_m`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Path(pub Vec<Step>);

impl fmt::Display for Path {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.0.is_empty() {
            return f.write_str("scene");
        }
        for (index, step) in self.0.iter().enumerate() {
            match step {
                Step::Name(name) if index == 0 => f.write_str(name)?,
                Step::Name(name) => write!(f, ".{name}")?,
                Step::Index(element) => write!(f, "[{element}]")?,
            }
        }
        Ok(())
    }
}

/// A bracket, comma or quote that is missing or too many.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SyntaxError {
    /// Byte offset of what was found.
    pub offset: usize,
    /// What stands there.
    pub found: String,
    /// What could have stood there.
    pub expected: String,
}

/// The deepest value met on the way along a path.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Found {
    /// How many steps of the path were followed; the whole path when equal to its length.
    pub depth: usize,
    /// Byte range of the field's name, where the value has one.
    pub name: Option<Range<usize>>,
    /// Byte range of the value.
    pub value: Range<usize>,
}

/// Checks that brackets, quotes, comments, commas and colons of `text` fit together and are nested at most [`MAX_DEPTH`] deep.
pub fn check(text: &str) -> Result<(), SyntaxError> {
    Walker::new(text, &[], false).document()
}

/// The deepest value of `text` on the way along `path`; of several fields with one name, the first.
///
/// `None` if the text is not well formed ([`check`]).
#[must_use]
pub fn find(text: &str, path: &Path) -> Option<Found> {
    let mut walker = Walker::new(text, &path.0, false);
    walker.document().ok()?;
    walker.found.pop()
}

/// All values of `text` that `path` names in full, in their order: more than one where a field is given twice.
#[must_use]
pub fn find_all(text: &str, path: &Path) -> Vec<Found> {
    let mut walker = Walker::new(text, &path.0, true);
    if walker.document().is_err() {
        return Vec::new();
    }
    walker.found
}

/// The innermost value around byte `offset` of `text`, and the path to it, without the names of variants.
///
/// `None` if the text is not well formed ([`check`]) or `offset` is outside of the outermost value.
#[must_use]
pub fn find_at(text: &str, offset: usize) -> Option<(Path, Range<usize>)> {
    let mut walker = Walker::new(text, &[], false);
    walker.target = Some(offset);
    walker.document().ok()?;
    walker.hit
}

/// The byte offset of `position` in `text`; the text's end for a place past it. The inverse of [`Position::of`].
#[must_use]
pub fn offset_of(text: &str, position: Position) -> usize {
    let mut line_start = 0;
    for _ in 1..position.line {
        line_start = text[line_start..].find('\n').map_or(text.len(), |newline| line_start + newline + 1);
    }
    text[line_start..].char_indices().nth(position.column.saturating_sub(1)).map_or(text.len(), |(offset, _)| line_start + offset)
}

/// At most [`MAX_EXCERPT`] characters of the first line of `text[range]`, to be quoted in an error.
#[must_use]
pub fn excerpt(text: &str, range: Range<usize>) -> String {
    let slice = text.get(range).unwrap_or_default();
    let first_line = slice.lines().next().unwrap_or_default().trim_end();
    let mut short: String = first_line.chars().take(MAX_EXCERPT).collect();
    if short.len() < slice.trim_end().len() {
        short.push('…');
    }
    short
}

/// What of the path is still wanted inside the value being walked.
#[derive(Clone, Copy)]
struct Want<'p> {
    rest: &'p [Step],
    depth: usize,
}

struct Walker<'t, 'p> {
    text: &'t str,
    at: usize,
    nesting: usize,
    path: &'p [Step],
    all: bool,
    found: Vec<Found>,
    /// The offset that [`find_at`] looks for, the steps to the value being walked, and the innermost value around the offset.
    target: Option<usize>,
    trail: Vec<Step>,
    hit: Option<(Path, Range<usize>)>,
}

impl<'t, 'p> Walker<'t, 'p> {
    fn new(text: &'t str, path: &'p [Step], all: bool) -> Self {
        Self { text, at: 0, nesting: 0, path, all, found: Vec::new(), target: None, trail: Vec::new(), hit: None }
    }

    fn document(&mut self) -> Result<(), SyntaxError> {
        self.skip_blank()?;
        while self.text[self.at..].starts_with("#![") {
            self.skip_attribute()?;
        }
        self.value(Some(Want { rest: self.path, depth: 0 }), None)?;
        self.skip_blank()?;
        if self.at < self.text.len() { Err(self.unexpected("the end of the file")) } else { Ok(()) }
    }

    /// Walks one value; `self.at` is at its first character, and ends behind its last.
    fn value(&mut self, want: Option<Want<'p>>, name: Option<Range<usize>>) -> Result<(), SyntaxError> {
        let start = self.at;
        match self.peek() {
            Some('(') => self.items(')', want)?,
            Some('[') => self.items(']', want)?,
            Some('{') => self.items('}', want)?,
            Some('"') => self.string()?,
            Some('\'') => self.character()?,
            Some(_) if self.raw_string()? => {}
            Some(c) if is_word(c) => {
                let word = self.word();
                let end_of_word = self.at;
                self.skip_blank()?;
                if self.peek() == Some('(') {
                    self.constructor(want, start, word)?;
                } else {
                    self.at = end_of_word;
                }
            }
            _ => return Err(self.unexpected("a value")),
        }
        if let Some(want) = want {
            self.record(want, name, start..self.at);
        }
        if self.hit.is_none() && self.target.is_some_and(|target| (start..self.at).contains(&target)) {
            self.hit = Some((Path(self.trail.clone()), start..self.at));
        }
        Ok(())
    }

    /// Walks the brackets behind the constructor `word`; a step that names the constructor is consumed and stays at this value.
    fn constructor(&mut self, want: Option<Want<'p>>, word_start: usize, word: &str) -> Result<(), SyntaxError> {
        let inner = want.map(|want| match want.rest.split_first() {
            Some((Step::Name(name), rest)) if name == word => Want { rest, depth: want.depth + 1 },
            _ => want,
        });
        let consumed = inner.map(|w| w.depth) != want.map(|w| w.depth);
        let start = self.at;
        // A path may leave out the name of a variant: `Waves([a, b])` has an element 1 as `[a, b]` has.
        let indexed = matches!(want, Some(Want { rest: [Step::Index(_), ..], .. }));
        if want.is_some() && (consumed || indexed || word == "Some") && self.is_newtype(indexed && !consumed && word != "Some")? {
            // The only argument of `Some` or of a one-value variant is what the rest of the path is about.
            self.open()?;
            self.skip_blank()?;
            self.value(inner, None)?;
            self.skip_blank()?;
            if self.peek() == Some(',') {
                self.at += 1;
                self.skip_blank()?;
            }
            self.close(')', start)
        } else {
            let result = self.items(')', inner);
            if let (true, Some(inner)) = (consumed, inner) {
                self.record(inner, None, word_start..self.at);
            }
            result
        }
    }

    /// Whether the brackets that open here hold exactly one value without a name, which is a list if `of_list` is set. Leaves the cursor
    /// where it was.
    fn is_newtype(&mut self, of_list: bool) -> Result<bool, SyntaxError> {
        let start = self.at;
        self.open()?;
        self.skip_blank()?;
        let mut newtype = false;
        let right_kind = !of_list || self.peek() == Some('[');
        if right_kind && self.peek() != Some(')') && self.field_name()?.is_none() {
            self.value(None, None)?;
            self.skip_blank()?;
            if self.peek() == Some(',') {
                self.at += 1;
                self.skip_blank()?;
            }
            newtype = self.peek() == Some(')');
        }
        self.at = start;
        self.nesting -= 1;
        Ok(newtype)
    }

    /// Walks a bracketed, comma-separated list of values, of `name: value` (in parentheses) or of `key: value` (in braces).
    fn items(&mut self, closing: char, want: Option<Want<'p>>) -> Result<(), SyntaxError> {
        let opening = self.at;
        self.open()?;
        let mut index = 0;
        loop {
            self.skip_blank()?;
            if self.peek() == Some(closing) || self.peek().is_none() {
                break;
            }
            let mut name = None;
            if closing == ')' {
                name = self.field_name()?;
            } else if closing == '}' {
                let start = self.at;
                self.value(None, None)?;
                name = Some(start..self.at);
                self.skip_blank()?;
                self.expect(':')?;
            }
            let inner = want.and_then(|want| self.step_into(want, name.clone(), index));
            self.skip_blank()?;
            if self.target.is_some() {
                let step = name.clone().map_or(Step::Index(index), |name| Step::Name(self.plain_name(name).to_owned()));
                self.trail.push(step);
            }
            self.value(inner, name)?;
            self.trail.pop();
            self.skip_blank()?;
            index += 1;
            match self.peek() {
                Some(',') => self.at += 1,
                Some(c) if c == closing => break,
                None => break,
                Some(_) => return Err(self.unexpected(&format!("`,` or `{closing}`"))),
            }
        }
        self.close(closing, opening)
    }

    /// What is wanted inside element `index`, called `name`, of a value in which `want` is wanted.
    fn step_into(&self, want: Want<'p>, name: Option<Range<usize>>, index: usize) -> Option<Want<'p>> {
        let (step, rest) = want.rest.split_first()?;
        let matches = match (step, name) {
            (Step::Name(wanted), Some(name)) => self.plain_name(name) == wanted,
            (Step::Index(wanted), None) => *wanted == index,
            _ => false,
        };
        matches.then_some(Want { rest, depth: want.depth + 1 })
    }

    /// A field's name or a map's key without what marks it as one.
    fn plain_name(&self, name: Range<usize>) -> &'t str {
        let name = &self.text[name];
        name.strip_prefix("r#").unwrap_or(name).trim_matches('"')
    }

    /// Keeps a value that lies on the path. Inner values are recorded before outer ones.
    fn record(&mut self, want: Want<'p>, name: Option<Range<usize>>, value: Range<usize>) {
        let found = Found { depth: want.depth, name, value };
        if self.all {
            // A value that contains the last one kept is the same value with its constructor around it.
            if want.rest.is_empty() && self.found.last().is_none_or(|last| last.value.end <= found.value.start) {
                self.found.push(found);
            }
        } else if self.found.last().is_none_or(|best| best.depth < found.depth) {
            self.found = vec![found];
        }
    }

    /// The name before a `:`, consumed with it; `None`, and nothing consumed, where the next item is a plain value.
    fn field_name(&mut self) -> Result<Option<Range<usize>>, SyntaxError> {
        let start = self.at;
        if self.text[start..].starts_with("r#") && !self.text[start..].starts_with("r#\"") {
            self.at += 2;
        }
        if self.peek().is_some_and(|c| c == '_' || c.is_alphabetic()) {
            self.word();
            let end = self.at;
            self.skip_blank()?;
            if self.peek() == Some(':') {
                self.at += 1;
                return Ok(Some(start..end));
            }
        }
        self.at = start;
        Ok(None)
    }

    fn peek(&self) -> Option<char> {
        self.text[self.at..].chars().next()
    }

    fn expect(&mut self, wanted: char) -> Result<(), SyntaxError> {
        if self.peek() == Some(wanted) {
            self.at += wanted.len_utf8();
            Ok(())
        } else {
            Err(self.unexpected(&format!("`{wanted}`")))
        }
    }

    fn open(&mut self) -> Result<(), SyntaxError> {
        if self.nesting == MAX_DEPTH {
            return Err(self.unexpected(&format!("at most {MAX_DEPTH} brackets inside each other")));
        }
        self.nesting += 1;
        self.at += 1;
        Ok(())
    }

    fn close(&mut self, closing: char, opening: usize) -> Result<(), SyntaxError> {
        if self.peek() != Some(closing) {
            if self.at >= self.text.len() {
                // The end of the file says nothing: the place to look at is the bracket that was never closed.
                let found = format!("`{}` that is never closed", &self.text[opening..=opening]);
                return Err(SyntaxError { offset: opening, found, expected: format!("`{closing}` before the end of the file") });
            }
            return Err(self.unexpected(&format!("`{closing}`")));
        }
        self.at += 1;
        self.nesting -= 1;
        Ok(())
    }

    fn word(&mut self) -> &'t str {
        let rest = &self.text[self.at..];
        let length = rest.find(|c| !is_word(c)).unwrap_or(rest.len());
        self.at += length;
        &rest[..length]
    }

    fn string(&mut self) -> Result<(), SyntaxError> {
        let start = self.at;
        let mut escaped = false;
        for (offset, byte) in self.text.as_bytes()[start + 1..].iter().enumerate() {
            match byte {
                _ if escaped => escaped = false,
                b'\\' => escaped = true,
                b'"' => {
                    self.at = start + 1 + offset + 1;
                    return Ok(());
                }
                _ => {}
            }
        }
        Err(self.never_closed(start, "a string", "`\"`"))
    }

    /// `r"..."`, `r#"..."#`, and the byte strings `b"..."`, `br"..."`; `false`, and nothing consumed, where none starts here.
    fn raw_string(&mut self) -> Result<bool, SyntaxError> {
        let start = self.at;
        let rest = &self.text[start..];
        let prefix = rest.len() - rest.trim_start_matches(['r', 'b']).len();
        if prefix == 0 || prefix > 2 {
            return Ok(false);
        }
        let hashes = rest[prefix..].bytes().take_while(|&b| b == b'#').count();
        if !rest[prefix + hashes..].starts_with('"') {
            if prefix == 1 && rest.starts_with("b'") {
                self.at += 1;
                self.character()?;
                return Ok(true);
            }
            return Ok(false);
        }
        if !rest[..prefix].contains('r') {
            self.at += prefix;
            self.string()?;
            return Ok(true);
        }
        let terminator = format!("\"{}", "#".repeat(hashes));
        let body = start + prefix + hashes + 1;
        match self.text[body..].find(&terminator) {
            Some(length) => {
                self.at = body + length + terminator.len();
                Ok(true)
            }
            None => Err(self.never_closed(start, "a raw string", &format!("`{terminator}`"))),
        }
    }

    fn character(&mut self) -> Result<(), SyntaxError> {
        let start = self.at;
        let inside = self.text[start + 1..].char_indices();
        let mut escaped = false;
        for (offset, c) in inside {
            match c {
                '\n' => break,
                _ if escaped => escaped = false,
                '\\' => escaped = true,
                '\'' if offset > 0 => {
                    self.at = start + 1 + offset + 1;
                    return Ok(());
                }
                _ => {}
            }
        }
        Err(self.never_closed(start, "a character", "`'`"))
    }

    fn skip_attribute(&mut self) -> Result<(), SyntaxError> {
        let start = self.at;
        match self.text[start..].find(']') {
            Some(length) => self.at = start + length + 1,
            None => return Err(self.never_closed(start, "an attribute", "`]`")),
        }
        self.skip_blank()
    }

    /// Skips white space, `// ...` and nested `/* ... */`.
    fn skip_blank(&mut self) -> Result<(), SyntaxError> {
        loop {
            let rest = &self.text[self.at..];
            let trimmed = rest.trim_start_matches(is_blank);
            self.at += rest.len() - trimmed.len();
            if trimmed.starts_with("//") {
                self.at += trimmed.find('\n').unwrap_or(trimmed.len());
            } else if trimmed.starts_with("/*") {
                self.block_comment()?;
            } else {
                return Ok(());
            }
        }
    }

    fn block_comment(&mut self) -> Result<(), SyntaxError> {
        let start = self.at;
        let mut nesting = 0_usize;
        let bytes = self.text.as_bytes();
        let mut at = start;
        while at + 1 < bytes.len() {
            match &bytes[at..at + 2] {
                b"/*" => nesting += 1,
                b"*/" => nesting -= 1,
                _ => {
                    at += 1;
                    continue;
                }
            }
            at += 2;
            if nesting == 0 {
                self.at = at;
                return Ok(());
            }
        }
        Err(self.never_closed(start, "a comment", "`*/`"))
    }

    fn never_closed(&self, offset: usize, what: &str, closing: &str) -> SyntaxError {
        SyntaxError { offset, found: format!("{what} that is never closed"), expected: format!("{closing} before the end of the file") }
    }

    fn unexpected(&self, expected: &str) -> SyntaxError {
        let rest = &self.text[self.at..];
        let found = match rest.chars().next() {
            None => "the end of the file".to_owned(),
            Some(c) if is_word(c) => {
                let end = rest.find(|c| !is_word(c)).unwrap_or(rest.len());
                format!("`{}`", excerpt(rest, 0..end))
            }
            Some(c) => format!("`{}`", c.escape_debug()),
        };
        SyntaxError { offset: self.at, found, expected: expected.to_owned() }
    }
}

/// The characters of numbers and identifiers.
fn is_word(c: char) -> bool {
    c.is_alphanumeric() || matches!(c, '_' | '+' | '-' | '.')
}

/// RON's white space: Unicode's Pattern_White_Space.
fn is_blank(c: char) -> bool {
    matches!(c, '\t'..='\r' | ' ' | '\u{85}' | '\u{200e}' | '\u{200f}' | '\u{2028}' | '\u{2029}')
}

#[cfg(test)]
#[path = "text_tests.rs"]
mod tests;
