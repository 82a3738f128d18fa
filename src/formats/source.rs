//! Contents of a file, and errors that name a place in it.

use std::borrow::Cow;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};
use memchr::memmem;

/// Bytes read at a time while searching for the start of raw data in a file.
const PIECE: u64 = 1 << 14;

const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// The content of a file.
pub(crate) struct Source {
    /// Path of the file, for messages.
    pub path: PathBuf,
    /// Contents without a UTF-8 byte-order mark: the whole file, or only its start if `rest` remains on disk.
    pub bytes: Vec<u8>,
    rest: Option<Rest>,
}

/// An open file whose start has been read.
struct Rest {
    file: File,
    /// Length in bytes of the byte-order mark before the contents.
    mark: usize,
    /// Length of the contents in bytes.
    length: usize,
}

impl Source {
    /// Reads a file; `kinds` names the readable formats for messages. The whole file is read, except raw data appended
    /// to XML, which are read on demand. (A memory map would do that for all files, but if another process truncates a
    /// mapped file, this process is killed.)
    pub fn read(path: &Path, kinds: &str) -> Result<Self> {
        match Self::open(path) {
            Ok(source) => Ok(source),
            Err(_) if path.is_dir() => Err(Self::new(path, Vec::new()).error(format!("a folder; name a file in it ({kinds})"))),
            Err(source) => Err(Error::Io { path: path.into(), source }),
        }
    }

    fn open(path: &Path) -> std::io::Result<Self> {
        let mut file = File::open(path)?;
        let about = file.metadata()?;
        let length = usize::try_from(about.len()).unwrap_or(usize::MAX);
        let mut bytes = Vec::new();
        bytes.try_reserve_exact(length.saturating_add(1))?;
        let mut search = RawData::default();
        while !search.failed && Read::take(&mut file, PIECE).read_to_end(&mut bytes)? > 0 {
            if search.found_in(&bytes) && bytes.len() < length {
                let read = bytes.len();
                let mut source = Self::new(path, bytes);
                source.bytes.shrink_to_fit();
                let mark = read - source.bytes.len();
                return Ok(Self { rest: Some(Rest { file, mark, length: length - mark }), ..source });
            }
        }
        file.read_to_end(&mut bytes)?;
        Ok(Self::new(path, bytes))
    }

    /// The contents of a file that are already in memory.
    pub fn new(path: &Path, mut bytes: Vec<u8>) -> Self {
        if bytes.starts_with(BYTE_ORDER_MARK) {
            bytes.drain(..BYTE_ORDER_MARK.len());
        }
        Self { path: path.into(), bytes, rest: None }
    }

    /// Length of the contents in bytes.
    pub fn len(&self) -> usize {
        self.rest.as_ref().map_or(self.bytes.len(), |rest| rest.length)
    }

    /// A range of the contents, read from disk if it is not in memory.
    pub fn window(&self, range: Range<usize>) -> Result<Cow<'_, [u8]>, String> {
        let Some(rest) = self.rest.as_ref().filter(|_| range.end > self.bytes.len()) else {
            return self.bytes.get(range).map(Cow::Borrowed).ok_or_else(|| "it lies beyond the end of the file".into());
        };
        let mut file = &rest.file;
        let mut bytes = vec![0; range.len()];
        let read = file.seek(SeekFrom::Start((range.start + rest.mark) as u64)).and_then(|_| file.read_exact(&mut bytes));
        read.map_err(|error| format!("the file cannot be read further: {error}"))?;
        Ok(Cow::Owned(bytes))
    }

    /// An error without a place.
    pub fn error(&self, message: impl Into<String>) -> Error {
        Error::File { path: self.path.clone(), place: String::new(), message: message.into() }
    }

    /// An error at a place described in words.
    pub fn error_in(&self, place: impl std::fmt::Display, message: impl Into<String>) -> Error {
        Error::File { path: self.path.clone(), place: format!("{place}: "), message: message.into() }
    }

    /// An error in the line of text that holds byte `at`.
    pub fn error_line(&self, at: usize, message: impl Into<String>) -> Error {
        self.error_in(format_args!("line {}", self.line(at)), message)
    }

    /// An error about something that starts at byte `at`. Lines are counted here and not in advance, as that takes
    /// time.
    pub fn error_at(&self, what: &str, at: usize, message: impl Into<String>) -> Error {
        self.error_in(format_args!("{what} (line {})", self.line(at)), message)
    }

    /// An error at a byte of binary data.
    pub fn error_byte(&self, at: usize, message: impl Into<String>) -> Error {
        self.error_in(format_args!("byte {at}"), message)
    }

    /// Number, counted from 1, of the line that contains byte `at`; a lone carriage return also ends a line.
    pub fn line(&self, at: usize) -> usize {
        let before = &self.bytes[..at.min(self.bytes.len())];
        let feed_follows = |i: usize| self.bytes.get(i + 1) == Some(&b'\n');
        1 + before.iter().enumerate().filter(|&(i, &b)| b == b'\n' || (b == b'\r' && !feed_follows(i))).count()
    }
}

/// Search for raw data appended to XML, in contents that are still being read.
#[derive(Default)]
struct RawData {
    /// Bytes searched so far.
    done: usize,
    /// Position where the element `AppendedData` starts.
    tag: Option<usize>,
    /// Whether it is certain that there are no raw data.
    failed: bool,
}

impl RawData {
    /// Whether raw data have started, that is whether something follows the start tag of the element.
    fn found_in(&mut self, bytes: &[u8]) -> bool {
        const TAG: &[u8] = b"<AppendedData";
        let text = bytes.strip_prefix(BYTE_ORDER_MARK).unwrap_or(bytes);
        self.failed = !text.trim_ascii_start().starts_with(b"<");
        let from = self.done.saturating_sub(TAG.len());
        self.done = bytes.len();
        self.tag = self.tag.or_else(|| memmem::find(&bytes[from..], TAG).map(|at| from + at));
        let Some(tag) = self.tag.filter(|_| !self.failed) else { return false };
        let Some(end) = bytes[tag..].iter().position(|&b| b == b'>') else { return false };
        self.failed = !bytes[tag..tag + end].windows(3).any(|w| w == b"raw");
        !self.failed && !bytes[tag + end + 1..].trim_ascii_start().is_empty()
    }
}

/// A word of a file, made fit for a message: short, and without control characters.
pub(crate) fn printable(word: &[u8]) -> String {
    let cut = &word[..word.len().min(60)];
    let text = String::from_utf8_lossy(cut);
    let mut text: String = text.chars().map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect();
    if cut.len() < word.len() {
        text.push('…');
    }
    text
}

/// The tokens (numbers and words) of a text, separated by white space.
#[derive(Clone)]
pub(crate) struct Tokens<'a> {
    source: &'a Source,
    /// Position of the next unread byte of the source.
    pub at: usize,
    end: usize,
    /// The character that starts a comment, which extends to the end of the line.
    comment: Option<u8>,
}

impl<'a> Tokens<'a> {
    pub fn new(source: &'a Source, range: std::ops::Range<usize>, comment: Option<u8>) -> Self {
        Self { source, at: range.start, end: range.end.min(source.bytes.len()), comment }
    }

    /// Skips white space and comments.
    pub fn skip_space(&mut self) {
        let bytes = &self.source.bytes[..self.end];
        while let Some(&b) = bytes.get(self.at) {
            if b.is_ascii_whitespace() || b == 0x0b {
                self.at += 1;
            } else if Some(b) == self.comment {
                self.at += bytes[self.at..].iter().position(|&b| b == b'\n' || b == b'\r').unwrap_or(self.end - self.at);
            } else {
                return;
            }
        }
    }

    /// The next token and its position; `None` at the end.
    pub fn next_token(&mut self) -> Option<(&'a [u8], usize)> {
        self.skip_space();
        let start = self.at.min(self.end);
        let rest = &self.source.bytes[start..self.end];
        let stop = |b: u8| b.is_ascii_whitespace() || b == 0x0b || Some(b) == self.comment;
        let length = rest.iter().position(|&b| stop(b)).unwrap_or(rest.len());
        self.at += length;
        (length > 0).then(|| (&rest[..length], start))
    }

    /// The next token without consuming it.
    pub fn peek(&self) -> Option<&'a [u8]> {
        self.clone().next_token().map(|(token, _)| token)
    }

    /// The next token; at the end of the text an error that says what was expected.
    pub fn word(&mut self, what: &str) -> Result<(&'a [u8], usize)> {
        self.next_token().ok_or_else(|| self.source.error_line(self.end, format!("the {} ends where {what} should be", self.unit())))
    }

    /// The next token as an integer.
    pub fn integer(&mut self, what: &str) -> Result<i64> {
        let (token, at) = self.word(what)?;
        parse_integer(token).ok_or_else(|| self.source.error_line(at, format!("`{}` where {what} should be", printable(token))))
    }

    /// The next token as a count of things that take at least two bytes each in the rest of the text, so that a wrong
    /// count is refused before memory is allocated for it.
    pub fn count(&mut self, what: &str) -> Result<usize> {
        let (token, at) = self.word(what)?;
        let fail = |why: &str| self.source.error_line(at, format!("`{}` as {what}: {why}", printable(token)));
        let n = parse_integer(token).ok_or_else(|| fail("not an integer in range"))?;
        let n = usize::try_from(n).map_err(|_| fail("negative"))?;
        let room = self.left() / 2 + 1;
        if n > room { Err(fail(&format!("more than the rest of the {} can hold", self.unit()))) } else { Ok(n) }
    }

    /// The next token as a floating-point number.
    pub fn float(&mut self, what: &str) -> Result<f64> {
        let (token, at) = self.word(what)?;
        parse_float(token).ok_or_else(|| self.source.error_line(at, format!("`{}` where {what} should be", printable(token))))
    }

    /// The rest of the current line, consuming the line end; `None` at the end of the text.
    pub fn line(&mut self) -> Option<(&'a [u8], usize)> {
        if self.at >= self.end {
            return None;
        }
        let start = self.at;
        let rest = &self.source.bytes[start..self.end];
        let length = rest.iter().position(|&b| b == b'\n' || b == b'\r').unwrap_or(rest.len());
        let feed = if rest[length..].starts_with(b"\r\n") { 2 } else { usize::from(length < rest.len()) };
        self.at += length + feed;
        Some((&rest[..length], start))
    }

    /// What the text is, for messages.
    fn unit(&self) -> &'static str {
        if self.end < self.source.bytes.len() { "line" } else { "file" }
    }

    /// Number of bytes that have not been read.
    pub fn left(&self) -> usize {
        self.end.saturating_sub(self.at)
    }
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
