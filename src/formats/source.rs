//! Contents of a file, and errors that name a place in it.

use std::borrow::Cow;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::error::{Error, Result};

/// Bytes that are read at a time.
const CHUNK: usize = 1 << 18;

/// Bytes after comments by which formats are told apart.
const TOLD_BY: usize = 256;

const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// The content of a file, without a UTF-8 byte-order mark. Large files stay on disk and are read a window at a time. (A
/// memory map would do that, too, but if another process truncates a mapped file, this process is killed.)
pub(crate) struct Source {
    /// Path of the file, for messages.
    pub path: PathBuf,
    /// All contents, or, if `rest` remains on disk, their start.
    start: Arc<Vec<u8>>,
    rest: Option<Rest>,
}

/// The extension of a path in lower case, without the dot.
pub(crate) fn ending(path: &Path) -> String {
    path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default()
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
    /// Opens a file; `kinds` names the readable formats for messages. As many chunks are read as hold what tells its
    /// format.
    pub fn open(path: &Path, kinds: &str) -> Result<Self> {
        let tells = |bytes: &[u8]| bytes.len() >= skip_comments(bytes) + TOLD_BY;
        let open = || {
            let mut file = File::open(path)?;
            let length = usize::try_from(file.metadata()?.len()).unwrap_or(usize::MAX);
            let mut bytes = Vec::new();
            // Twice as much each time, as comments are then searched from the start again.
            while Read::take(&mut file, bytes.len().max(CHUNK) as u64).read_to_end(&mut bytes)? > 0 && !tells(&bytes) {}
            let remains = bytes.len() < length;
            if !remains {
                file.read_to_end(&mut bytes)?; // of a pipe
            }
            bytes.shrink_to_fit();
            let (read, source) = (bytes.len(), Self::new(path, bytes));
            let mark = read - source.start.len();
            Ok(Self { rest: remains.then_some(Rest { file, mark, length: length - mark }), ..source })
        };
        match open() {
            Ok(source) => Ok(source),
            Err(_) if path.is_dir() => Err(Self::new(path, Vec::new()).error(format!("a folder; name a file in it ({kinds})"))),
            Err(source) => Err(Error::Io { path: path.into(), source }),
        }
    }

    /// Reads what remains on disk.
    pub fn whole(self) -> Result<Self> {
        let Some(Rest { length, .. }) = self.rest else { return Ok(self) };
        let bytes = self.window(0..length).map_err(|why| self.error(why))?.into_owned();
        Ok(Self { path: self.path, start: Arc::new(bytes), rest: None })
    }

    /// The contents of a file that are already in memory.
    pub fn new(path: &Path, mut bytes: Vec<u8>) -> Self {
        if bytes.starts_with(BYTE_ORDER_MARK) {
            bytes.drain(..BYTE_ORDER_MARK.len());
        }
        Self { path: path.into(), start: Arc::new(bytes), rest: None }
    }

    /// The path of a file that this one names, which is relative to its folder. Where there is none of this name, its
    /// backslashes are taken for slashes, as Windows writes paths.
    pub fn beside(&self, name: &str) -> PathBuf {
        let within = |name: &str| self.path.parent().unwrap_or(Path::new("")).join(name);
        let path = within(name);
        if !name.contains('\\') || path.is_file() {
            return path;
        }
        Some(within(&name.replace('\\', "/"))).filter(|slashed| slashed.is_file()).unwrap_or(path)
    }

    /// Length of the contents in bytes.
    pub fn len(&self) -> usize {
        self.rest.as_ref().map_or(self.start.len(), |rest| rest.length)
    }

    /// The start of the contents: all of them if the file was read as a whole.
    pub fn start(&self) -> &[u8] {
        &self.start
    }

    /// Contents around byte `at`, at least `least` bytes from there on or all that there are before `end`, and the
    /// position where they begin. Nothing beyond `end` is read.
    pub fn chunk(&self, at: usize, least: usize, end: usize) -> Result<(usize, Arc<Vec<u8>>)> {
        let end = end.min(self.len());
        let wanted = at.saturating_add(least).min(end);
        if wanted <= self.start.len() {
            return Ok((0, self.start.clone()));
        }
        let end = at.saturating_add(least.saturating_mul(2).max(CHUNK)).min(end); // for long lines, twice what is needed
        let bytes = self.window(at..end).map_err(|why| self.error_byte(at, why))?;
        Ok((at, Arc::new(bytes.into_owned())))
    }

    /// A range of the contents, read from disk if it is not in memory.
    pub fn window(&self, range: Range<usize>) -> Result<Cow<'_, [u8]>, String> {
        let Some(rest) = self.rest.as_ref().filter(|_| range.end > self.start.len()) else {
            return self.start.get(range).map(Cow::Borrowed).ok_or_else(|| "it lies beyond the end of the file".into());
        };
        let (mut file, mut bytes) = (&rest.file, Vec::new());
        bytes.try_reserve_exact(range.len()).map_err(|error| error.to_string())?;
        bytes.resize(range.len(), 0);
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
        let (mut line, mut before) = (1, 0);
        for begin in (0..at.min(self.len())).step_by(CHUNK) {
            let Ok(bytes) = self.window(begin..at.min(self.len()).min(begin + CHUNK)) else { break };
            for &byte in bytes.iter() {
                line += usize::from(byte == b'\r' || (byte == b'\n' && before != b'\r'));
                before = byte;
            }
        }
        line
    }
}

/// Start of the first line that is neither empty nor a comment: `#`, `**` as in Abaqus files, or `$` as in those of
/// LS-DYNA and Nastran, unless a letter follows at once as in the sections of Gmsh.
pub(crate) fn skip_comments(bytes: &[u8]) -> usize {
    let mut at = 0;
    loop {
        at += bytes[at..].iter().take_while(|b| b.is_ascii_whitespace()).count();
        let rest = &bytes[at..];
        let dollar = rest.first() == Some(&b'$') && !rest.get(1).is_some_and(u8::is_ascii_alphabetic);
        if !(rest.starts_with(b"#") || rest.starts_with(b"**") || dollar) {
            return at;
        }
        at += rest.iter().position(|&b| b == b'\n' || b == b'\r').unwrap_or(rest.len());
    }
}

/// A word of a file, made fit for a message: [`printable`], and only the start of a long one.
pub(crate) fn excerpt(word: &[u8]) -> String {
    shortened(word, 60)
}

/// A text that names words of a file, such as the message of a parser, made fit for a message as in [`excerpt`].
pub(crate) fn passage(text: &str) -> String {
    shortened(text.as_bytes(), 200)
}

fn shortened(word: &[u8], most: usize) -> String {
    let cut = &word[..word.len().min(most)];
    let (mut text, mut is_whole) = (String::new(), cut.len() == word.len());
    for c in String::from_utf8_lossy(cut).chars() {
        let escaped = c.escape_default();
        if text.chars().count() + if is_escaped(c) { escaped.len() } else { 1 } > most {
            is_whole = false;
            break;
        }
        if is_escaped(c) { text.extend(escaped) } else { text.push(c) }
    }
    text + if is_whole { "" } else { "…" }
}

/// Whether a character controls a terminal, ends a line, or turns the direction of writing.
fn is_escaped(c: char) -> bool {
    c.is_control() || matches!(c, '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

/// A text made fit for a terminal, such as the name of a field, in which a file may have any characters: those that
/// control the terminal, end the line or turn the direction of writing are escaped as in Rust (`\n`, `\u{1b}`).
pub fn printable(text: &str) -> Cow<'_, str> {
    if !text.contains(is_escaped) {
        return Cow::Borrowed(text);
    }
    let mut shown = String::with_capacity(text.len() + 16);
    for c in text.chars() {
        if is_escaped(c) { shown.extend(c.escape_default()) } else { shown.push(c) }
    }
    Cow::Owned(shown)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_shown_in_one_line_as_they_are_read() {
        assert!(matches!(printable("von Mises (σ) \\n"), Cow::Borrowed("von Mises (σ) \\n")));
        let odd = "a\nb\r\t\0\u{1b}[31m\u{7f}\u{9b}\u{202e}x\u{2028}";
        assert_eq!(printable(odd), r"a\nb\r\t\u{0}\u{1b}[31m\u{7f}\u{9b}\u{202e}x\u{2028}");
        let long = "n".repeat(1000) + "\n";
        assert_eq!(printable(&long), "n".repeat(1000) + r"\n");
        assert_eq!((excerpt(long.as_bytes()), excerpt(b"a\x1b\xff")), ("n".repeat(60) + "…", "a\\u{1b}\u{fffd}".into()));
        assert_eq!((excerpt(&[0; 12]), excerpt(&[0; 13])), (r"\u{0}".repeat(12), r"\u{0}".repeat(12) + "…"));
    }
}
