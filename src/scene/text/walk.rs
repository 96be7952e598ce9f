//! The walk over a RON text that builds its [`Tree`](super::tree::Tree), or names the first bracket, quote or comma out of place.
//!
//! It does not judge numbers, identifiers or escapes: a word is any run of the characters that numbers and identifiers are made of.

use std::ops::Range;

use super::tree::{Kind, Node, Span};
use super::{MAX_DEPTH, SyntaxError, excerpt};

/// The nodes of `text`, in the order in which their values begin: a value comes before the values inside it.
pub(super) fn nodes(text: &str) -> Result<Vec<Node>, SyntaxError> {
    if u32::try_from(text.len()).is_err() {
        let found = format!("a text of {} bytes", text.len());
        return Err(SyntaxError { offset: 0, found, expected: format!("at most {} bytes", u32::MAX) });
    }
    let mut walker = Walker { text, at: 0, nesting: 0, nodes: Vec::new() };
    walker.document()?;
    Ok(walker.nodes)
}

struct Walker<'t> {
    text: &'t str,
    at: usize,
    nesting: usize,
    nodes: Vec<Node>,
}

impl Walker<'_> {
    fn document(&mut self) -> Result<(), SyntaxError> {
        self.skip_blank()?;
        while self.text[self.at..].starts_with("#![") {
            self.skip_attribute()?;
        }
        self.value(0..0)?;
        self.skip_blank()?;
        if self.at < self.text.len() { Err(self.unexpected("the end of the file")) } else { Ok(()) }
    }

    /// Walks one value; `self.at` is at its first character, and ends behind its last. `name` is the place of its name, empty without one.
    fn value(&mut self, name: Range<usize>) -> Result<(), SyntaxError> {
        let (start, node) = (self.at, self.nodes.len());
        self.nodes.push(Node::default());
        let kind = match self.peek() {
            Some('(') => self.items(')')?,
            Some('[') => self.items(']')?,
            Some('{') => self.items('}')?,
            Some('"') => self.string()?,
            Some('\'') => self.character()?,
            Some(_) if self.raw_string()? => Kind::Leaf,
            Some(c) if is_word(c) => {
                self.word();
                let end_of_word = self.at;
                self.skip_blank()?;
                if self.peek() == Some('(') {
                    self.items(')')?
                } else {
                    self.at = end_of_word;
                    Kind::Leaf
                }
            }
            _ => return Err(self.unexpected("a value")),
        };
        self.nodes[node] = Node { kind, name: Span::from(name), value: Span::from(start..self.at), past: self.nodes.len() as u32 };
        Ok(())
    }

    /// Walks a bracketed, comma-separated list of values, of `name: value` (in parentheses) or of `key: value` (in braces).
    fn items(&mut self, closing: char) -> Result<Kind, SyntaxError> {
        let opening = self.at;
        self.open()?;
        loop {
            self.skip_blank()?;
            if self.peek() == Some(closing) || self.peek().is_none() {
                break;
            }
            let mut name = 0..0;
            if closing == ')' {
                name = self.field_name()?.unwrap_or(name);
            } else if closing == '}' {
                let (start, node) = (self.at, self.nodes.len());
                self.value(0..0)?;
                // A key is the name of its value, not a value.
                self.nodes.truncate(node);
                name = start..self.at;
                self.skip_blank()?;
                self.expect(':')?;
            }
            self.skip_blank()?;
            self.value(name)?;
            self.skip_blank()?;
            match self.peek() {
                Some(',') => self.at += 1,
                Some(c) if c == closing => break,
                None => break,
                Some(_) => return Err(self.unexpected(&format!("`,` or `{closing}`"))),
            }
        }
        self.close(closing, opening)?;
        Ok(match closing {
            ')' => Kind::Group,
            ']' => Kind::List,
            _ => Kind::Map,
        })
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

    fn word(&mut self) {
        let rest = &self.text[self.at..];
        self.at += rest.find(|c| !is_word(c)).unwrap_or(rest.len());
    }

    fn string(&mut self) -> Result<Kind, SyntaxError> {
        let start = self.at;
        let mut escaped = false;
        for (offset, byte) in self.text.as_bytes()[start + 1..].iter().enumerate() {
            match byte {
                _ if escaped => escaped = false,
                b'\\' => escaped = true,
                b'"' => {
                    self.at = start + 1 + offset + 1;
                    return Ok(Kind::Leaf);
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

    fn character(&mut self) -> Result<Kind, SyntaxError> {
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
                    return Ok(Kind::Leaf);
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
pub(super) fn is_word(c: char) -> bool {
    c.is_alphanumeric() || matches!(c, '_' | '+' | '-' | '.')
}

/// RON's white space: Unicode's Pattern_White_Space.
fn is_blank(c: char) -> bool {
    matches!(c, '\t'..='\r' | ' ' | '\u{85}' | '\u{200e}' | '\u{200f}' | '\u{2028}' | '\u{2029}')
}
