//! Reader for the numbers of legacy VTK files, as text or binary.

use std::ops::Range;

use super::super::integers::Integers;
use super::super::scalar::{Number, Scalar};
use super::super::source::{Source, excerpt};
use super::super::stored::{Content, Stored};
use super::super::tokens::{Tokens, parse_float, parse_integer};
use crate::error::Result;

/// Position in the file, and how its numbers are stored.
pub(super) struct Reader<'a> {
    pub source: &'a Source,
    pub tokens: Tokens<'a>,
    pub binary: bool,
}

impl<'a> Reader<'a> {
    /// Reads a number type; `None`: bits.
    pub(super) fn scalar(&mut self) -> Result<Option<Scalar>> {
        let (word, at) = self.tokens.word("a number type")?;
        let name = String::from_utf8_lossy(word).to_ascii_lowercase();
        match name.as_str() {
            "bit" => Ok(None),
            name => Scalar::vtk_legacy(name)
                .map(Some)
                .ok_or_else(|| self.source.error_line(at, format!("unknown number type `{}`", excerpt(word)))),
        }
    }

    /// Reads `count` numbers; in binary files they start after the end of the line.
    pub(super) fn values<T: Number>(&mut self, scalar: Option<Scalar>, count: usize, what: &str) -> Result<Vec<T>> {
        if self.binary {
            self.tokens.line()?;
            return self.binary_values(scalar, count, what);
        }
        let room = self.tokens.left() / 2 + 1;
        if count > room {
            let message = format!("{count} numbers ({what} each) are announced, but the rest of the file has room for {room} at most");
            return Err(self.source.error_line(self.tokens.at, message));
        }
        let mut values = Vec::with_capacity(count);
        let float = scalar.is_some_and(Scalar::is_float);
        for _ in 0..count {
            let (token, at) = self.tokens.word(what)?;
            let value = if float { parse_float(token).map(T::from_f64) } else { parse_integer(token).map(T::from_i64) };
            // Some writers announce an integer type and then write fractions.
            let value = value.or_else(|| if T::EXACT { None } else { parse_float(token).map(T::from_f64) });
            values.push(value.ok_or_else(|| self.source.error_line(at, format!("`{}` where {what} should be", excerpt(token))))?);
        }
        Ok(values)
    }

    /// Reads `count` integers.
    pub(super) fn integers(&mut self, scalar: Option<Scalar>, count: usize, what: &str) -> Result<Integers<'a>> {
        let Some(scalar) = scalar.filter(|_| self.binary) else { return self.values(scalar, count, what).map(Integers::parsed) };
        self.tokens.line()?;
        let range = self.range(Some(scalar), count, what)?;
        let stored = Stored::new(self.source, what.to_owned(), range.start, Content::File(range), None);
        Ok(Integers::stored(stored, scalar, true))
    }

    /// The range of the bytes of `count` binary numbers, which is consumed.
    fn range(&mut self, scalar: Option<Scalar>, count: usize, what: &str) -> Result<Range<usize>> {
        let at = self.tokens.at;
        let size = scalar.map_or(Some(count.div_ceil(8)), |s| count.checked_mul(s.size()));
        let size = size.filter(|&s| s <= self.tokens.left()).ok_or_else(|| {
            self.source
                .error_byte(at, format!("{count} numbers ({what} each) are announced, but only {} bytes are left", self.tokens.left()))
        })?;
        self.tokens.at += size;
        Ok(at..at + size)
    }

    fn binary_values<T: Number>(&mut self, scalar: Option<Scalar>, count: usize, what: &str) -> Result<Vec<T>> {
        let range = self.range(scalar, count, what)?;
        let stored = Stored::new(self.source, what.to_owned(), range.start, Content::File(range), None);
        if let Some(scalar) = scalar {
            return stored.convert(scalar, true);
        }
        let bytes = stored.read(0..stored.len())?;
        Ok((0..count).map(|i| T::from_i64(i64::from(bytes[i / 8] >> (7 - i % 8) & 1))).collect())
    }

    /// Reads a number of values that may or may not follow; if they do, their number is checked then.
    pub(super) fn size(&mut self, what: &str) -> Result<usize> {
        let (token, at) = self.tokens.word(what)?;
        let n = parse_integer(token).and_then(|n| u32::try_from(n).ok());
        n.map(|n| n as usize).ok_or_else(|| self.source.error_line(at, format!("`{}` as {what}", excerpt(token))))
    }

    /// Skips a block of metadata, which ends with an empty line.
    pub(super) fn metadata(&mut self) -> Result<()> {
        self.tokens.line()?;
        while self.tokens.line()?.is_some_and(|(line, _)| !line.trim_ascii().is_empty()) {}
        Ok(())
    }
}
