//! The words and numbers of a text, and the bytes of binary data between them.

use std::borrow::Cow;
use std::ops::Range;
use std::sync::Arc;

use super::source::{Source, excerpt};
use crate::error::Result;
use memchr::{memchr2, memmem};

/// A cursor in a file, of which it holds a chunk. Its tokens are numbers and words, separated by white space.
#[derive(Clone)]
pub(crate) struct Tokens<'a> {
    source: &'a Source,
    /// Position of the next unread byte of the source.
    pub at: usize,
    end: usize,
    /// The character that starts a comment, which extends to the end of the line.
    comment: Option<u8>,
    chunk: Arc<Vec<u8>>,
    /// Position of the chunk in the source.
    chunk_at: usize,
}

impl<'a> Tokens<'a> {
    /// A cursor at the start of a file.
    pub fn new(source: &'a Source, comment: Option<u8>) -> Self {
        Self { source, at: 0, end: source.len(), comment, chunk: Arc::default(), chunk_at: 0 }
    }

    /// The cursor, limited to a part of the file.
    pub fn within(self, range: Range<usize>) -> Self {
        Self { at: range.start, end: range.end.min(self.end), ..self }
    }

    /// The unread bytes of the chunk.
    fn loaded(&self) -> &[u8] {
        let begin = self.at.wrapping_sub(self.chunk_at);
        self.chunk.get(begin..self.chunk.len().min(self.end.saturating_sub(self.chunk_at))).unwrap_or_default()
    }

    /// Loads more than `n` bytes; false if that many are not left.
    fn load(&mut self, n: usize) -> Result<bool> {
        if self.loaded().len() > n {
            return Ok(true);
        }
        if self.left() <= n {
            return Ok(false);
        }
        (self.chunk_at, self.chunk) = self.source.chunk(self.at, n + 1, self.end)?;
        Ok(true)
    }

    /// The number of bytes before those that `find` finds, or before the end.
    fn until(&mut self, find: impl Fn(&[u8]) -> Option<usize>) -> Result<usize> {
        let mut length = 0;
        loop {
            let rest = self.loaded().get(length..).unwrap_or_default();
            if let Some(found) = find(rest) {
                return Ok(length + found);
            }
            length += rest.len();
            if !self.load(length)? {
                return Ok(length);
            }
        }
    }

    /// Consumes `n` loaded bytes, and returns them with their position.
    fn take(&mut self, n: usize) -> (&[u8], usize) {
        let at = self.at;
        self.at += n;
        let begin = at.wrapping_sub(self.chunk_at);
        (self.chunk.get(begin..begin.wrapping_add(n)).unwrap_or_default(), at)
    }

    /// The bytes from `begin` to the cursor. Only if the chunk does not hold all of them are they read again.
    pub fn since(&self, begin: usize) -> Result<Cow<'_, [u8]>> {
        let held = begin.checked_sub(self.chunk_at).and_then(|from| self.chunk.get(from..self.at - self.chunk_at));
        match held {
            Some(bytes) => Ok(Cow::Borrowed(bytes)),
            None => self.source.window(begin..self.at).map_err(|why| self.source.error_byte(begin, why)),
        }
    }

    /// Skips white space and comments.
    pub fn skip_space(&mut self) -> Result<()> {
        loop {
            let next = self.skip_until(|rest| rest.iter().position(|&b| !is_space(b)))?;
            if next.is_none() || next != self.comment {
                return Ok(());
            }
            self.skip_until(line_end)?;
        }
    }

    /// The place of the next token among the loaded bytes, empty at the end; `None` if they do not hold all of it, or a
    /// comment is before it.
    fn loaded_token(&self) -> Option<Range<usize>> {
        let rest = self.loaded();
        let end = (rest.len() == self.left()).then_some(rest.len());
        let begin = rest.iter().position(|&b| !is_space(b)).or(end)?;
        let stop = rest[begin..].iter().position(|&b| is_space(b) || Some(b) == self.comment);
        let token = begin..stop.map(|n| begin + n).or(end)?;
        (!token.is_empty() || Some(begin) == end).then_some(token)
    }

    /// The next token and its position; `None` at the end.
    pub fn next_token(&mut self) -> Result<Option<(&[u8], usize)>> {
        let length = if let Some(token) = self.loaded_token() {
            self.at += token.start;
            token.len()
        } else {
            self.skip_space()?;
            let comment = self.comment;
            self.until(|rest| rest.iter().position(|&b| is_space(b) || Some(b) == comment))?
        };
        Ok((length > 0).then(|| self.take(length)))
    }

    /// The next token without consuming it.
    pub fn peek(&mut self) -> Result<Option<&[u8]>> {
        let before = self.at;
        let found = self.next_token()?.map(|(token, at)| at..at + token.len());
        self.at = before;
        Ok(found.and_then(|range| self.chunk.get(range.start - self.chunk_at..range.end - self.chunk_at)))
    }

    /// The next token; at the end of the text an error that says what was expected.
    pub fn word(&mut self, what: &str) -> Result<(&[u8], usize)> {
        let (source, end, unit) = (self.source, self.end, self.unit());
        self.next_token()?.ok_or_else(|| source.error_line(end, format!("the {unit} ends where {what} should be")))
    }

    /// The next token as an integer.
    pub fn integer(&mut self, what: &str) -> Result<i64> {
        let source = self.source;
        let (token, at) = self.word(what)?;
        parse_integer(token).ok_or_else(|| source.error_line(at, format!("`{}` where {what} should be", excerpt(token))))
    }

    /// The next token as a count of things that take at least two bytes each in the rest of the text, so that a wrong
    /// count is refused before memory is allocated for it.
    pub fn count(&mut self, what: &str) -> Result<usize> {
        let (source, end, unit) = (self.source, self.end, self.unit());
        let (token, at) = self.word(what)?;
        let fail = |why: &str| source.error_line(at, format!("`{}` as {what}: {why}", excerpt(token)));
        let n = parse_integer(token).ok_or_else(|| fail("not an integer in range"))?;
        let n = usize::try_from(n).map_err(|_| fail("negative"))?;
        let room = (end - at - token.len()) / 2 + 1;
        if n > room { Err(fail(&format!("more than the rest of the {unit} can hold"))) } else { Ok(n) }
    }

    /// The next token as a floating-point number.
    pub fn float(&mut self, what: &str) -> Result<f64> {
        let source = self.source;
        let (token, at) = self.word(what)?;
        parse_float(token).ok_or_else(|| source.error_line(at, format!("`{}` where {what} should be", excerpt(token))))
    }

    /// The rest of the current line, consuming the line end; `None` at the end of the text.
    pub fn line(&mut self) -> Result<Option<(&[u8], usize)>> {
        if self.at >= self.end {
            return Ok(None);
        }
        let length = self.until(line_end)?;
        self.load(length + 1)?;
        let rest = &self.loaded()[length..];
        let feed = if rest.starts_with(b"\r\n") { 2 } else { usize::from(!rest.is_empty()) };
        let (line, at) = self.take(length + feed);
        Ok(Some((&line[..length], at)))
    }

    /// Limits the cursor to the rest of the line. Returns what [`Self::widen`] takes to undo that.
    pub fn narrow(&mut self) -> Result<usize> {
        let line_end = self.at + self.until(line_end)?;
        Ok(std::mem::replace(&mut self.end, line_end))
    }

    /// Lets the cursor go on behind the line that it was limited to.
    pub fn widen(&mut self, end: usize) {
        self.end = end;
    }

    /// The next `n` bytes; `None` if that many are not left.
    pub fn bytes(&mut self, n: usize) -> Result<Option<&[u8]>> {
        Ok((n == 0 || self.load(n - 1)?).then(|| self.take(n).0))
    }

    /// Moves to the byte that `find` finds first, or else to the end, and returns it.
    pub fn skip_until(&mut self, find: impl Fn(&[u8]) -> Option<usize>) -> Result<Option<u8>> {
        while self.load(0)? {
            let rest = self.loaded();
            if let Some(found) = find(rest) {
                let byte = rest[found];
                self.at += found;
                return Ok(Some(byte));
            }
            self.at += rest.len();
        }
        Ok(None)
    }

    /// Whether these bytes come next.
    pub fn starts_with(&mut self, bytes: &[u8]) -> Result<bool> {
        Ok(self.load(bytes.len() - 1)? && self.loaded().starts_with(bytes))
    }

    /// Moves behind the next occurrence of some bytes; false, and to the end, if there is none.
    pub fn skip_past(&mut self, sought: &[u8]) -> Result<bool> {
        while self.load(sought.len().saturating_sub(1))? {
            if let Some(found) = memmem::find(self.loaded(), sought) {
                self.at += found + sought.len();
                return Ok(true);
            }
            self.at += self.loaded().len() + 1 - sought.len();
        }
        self.at = self.end;
        Ok(false)
    }

    /// What the text is, for messages.
    fn unit(&self) -> &'static str {
        if self.end < self.source.len() { "line" } else { "file" }
    }

    /// Number of bytes that have not been read.
    pub fn left(&self) -> usize {
        self.end.saturating_sub(self.at)
    }
}

/// The places of the tokens of a line.
pub(crate) fn words(line: &[u8], comment: Option<u8>) -> impl Iterator<Item = Range<usize>> {
    let mut at = 0;
    let stops = move |b: &u8| is_space(*b) || Some(*b) == comment;
    std::iter::from_fn(move || {
        let begin = at + line[at..].iter().position(|b| !is_space(*b))?;
        at = line[begin..].iter().position(stops).map_or(line.len(), |n| begin + n);
        (at > begin).then_some(begin..at)
    })
}

fn line_end(bytes: &[u8]) -> Option<usize> {
    memchr2(b'\n', b'\r', bytes)
}

fn is_space(b: u8) -> bool {
    matches!(b, b'\t'..=b'\r' | b' ')
}

/// Parses a decimal integer; `None` if the token is not an integer or does not fit.
pub(crate) fn parse_integer(token: &[u8]) -> Option<i64> {
    let (negative, digits) = match token {
        [b'-', rest @ ..] => (true, rest),
        [b'+', rest @ ..] | rest => (false, rest),
    };
    if digits.is_empty() {
        return None;
    }
    let mut value = 0i64;
    for &b in digits {
        let digit = i64::from(b.wrapping_sub(b'0'));
        if digit > 9 {
            return None;
        }
        value = value.checked_mul(10)?.checked_sub(digit)?;
    }
    if negative { Some(value) } else { value.checked_neg() }
}

/// Parses a floating-point number; Fortran's exponent letter D is accepted, and what C libraries write for NaN and
/// infinity.
pub(crate) fn parse_float(token: &[u8]) -> Option<f64> {
    let text = std::str::from_utf8(token).ok()?;
    text.parse().ok().or_else(|| {
        let text = Some(text).filter(|text| text.len() <= 64)?.to_ascii_lowercase();
        let looks_fortran = text.bytes().all(|b| b.is_ascii_digit() || b"+-.d".contains(&b));
        if looks_fortran { text.replace('d', "e").parse().ok() } else { parse_special(&text) }
    })
}

/// Parses `nan(…)`, and the older spellings `1.#QNAN` and the like, which may be filled up with zeros.
fn parse_special(text: &str) -> Option<f64> {
    let size = text.trim_start_matches(['+', '-']);
    match size.trim_end_matches('0') {
        "1.#inf" => Some(if text.starts_with('-') { f64::NEG_INFINITY } else { f64::INFINITY }),
        "1.#ind" | "1.#nan" | "1.#qnan" | "1.#snan" => Some(f64::NAN),
        _ => (size.starts_with("nan(") && size.ends_with(')')).then_some(f64::NAN),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_shrinks_meanwhile_is_an_error() {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), "12 ".repeat(1 << 18)).unwrap();
        let source = Source::open(file.path(), "").unwrap();
        file.as_file().set_len(1 << 19).unwrap();
        let mut tokens = Tokens::new(&source, None);
        let error = loop {
            if let Err(error) = tokens.integer("a number") {
                break error.to_string();
            }
        };
        assert!(error.contains("byte") && error.contains("cannot be read further"), "{error}");
    }
}
