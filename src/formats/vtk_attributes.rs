//! Reader for the arrays of legacy VTK files.

use super::scalar::Scalar;
use super::source::printable;
use super::tokens::parse_integer;
use super::vtk_reader::Reader;
use crate::error::Result;
use crate::mesh::On;

/// What the last `POINT_DATA` or `CELL_DATA` stated: what values belong to, and their number.
pub(super) type Section = (On, usize);

/// Name, number of components, and values of an array.
pub(super) type Named = (String, usize, Vec<f32>);

impl Reader<'_> {
    fn name(&mut self) -> Result<String> {
        let (word, _) = self.tokens.word("the name of an array")?;
        Ok(decode_name(word))
    }

    /// Reads an array in a `POINT_DATA` or `CELL_DATA` section (or before the first one, where it belongs to neither).
    pub(super) fn attribute(&mut self, keyword: &[u8], at: usize, section: Option<Section>) -> Result<Vec<Named>> {
        let unknown = || Err(self.source.error_line(at, format!("`{}` where a keyword should be", printable(keyword))));
        if keyword == b"FIELD" {
            return self.field();
        }
        let Some((_, n)) = section else { return unknown() };
        let (components, typed) = match keyword {
            b"SCALARS" => return self.scalars(n),
            b"LOOKUP_TABLE" => return self.lookup_table(),
            b"VECTORS" | b"NORMALS" => (3, true),
            b"TENSORS" => (9, true),
            b"TENSORS6" => (6, true),
            b"GLOBAL_IDS" | b"PEDIGREE_IDS" | b"EDGE_FLAGS" => (1, true),
            b"TEXTURE_COORDINATES" => (0, true),
            b"COLOR_SCALARS" => (0, false),
            _ => return unknown(),
        };
        let name = self.name()?;
        let components = if components == 0 { self.components()? } else { components };
        // Colours are bytes in binary files and fractions in text files.
        let scalar = if typed { self.scalar()? } else { Some(if self.binary { Scalar::U8 } else { Scalar::F32 }) };
        let values = self.values(scalar, n * components, &value_of(&name))?;
        Ok(vec![(name, components, values)])
    }

    fn components(&mut self) -> Result<usize> {
        let (token, at) = self.tokens.word("a number of components")?;
        let n = parse_integer(token).filter(|n| (1..=9).contains(n));
        n.map(|n| n as usize).ok_or_else(|| self.source.error_line(at, format!("{} components, not 1 to 9", printable(token))))
    }

    fn scalars(&mut self, n: usize) -> Result<Vec<Named>> {
        let name = self.name()?;
        let scalar = self.scalar()?;
        let mut rest = self.tokens.clone();
        let is_last = rest.line()?.is_none_or(|(line, _)| line.trim_ascii().is_empty());
        let components = if is_last { 1 } else { self.components()? };
        // The format requires the look-up table, but it is often missing.
        let mut ahead = self.tokens.clone();
        ahead.line()?;
        if ahead.line()?.is_some_and(|(line, _)| line.trim_ascii().get(..12).is_some_and(|w| w.eq_ignore_ascii_case(b"LOOKUP_TABLE"))) {
            self.tokens.next_token()?;
            self.tokens.next_token()?;
        }
        let values = self.values(scalar, n * components, &value_of(&name))?;
        Ok(vec![(name, components, values)])
    }

    /// Skips a table of colours, which is not used.
    fn lookup_table(&mut self) -> Result<Vec<Named>> {
        self.name()?;
        let n = self.tokens.count("the size of a look-up table")?;
        let scalar = Some(if self.binary { Scalar::U8 } else { Scalar::F32 });
        self.values::<f32>(scalar, 4 * n, "a colour")?;
        Ok(Vec::new())
    }

    fn field(&mut self) -> Result<Vec<Named>> {
        self.name()?;
        let n = self.tokens.count("the number of arrays")?;
        let mut arrays = Vec::new();
        for _ in 0..n {
            while self.tokens.peek()?.is_some_and(|t| t.eq_ignore_ascii_case(b"METADATA")) {
                self.tokens.next_token()?;
                self.metadata()?;
            }
            let name = self.name()?;
            let components = self.size("a number of components")?;
            let count = components * self.size("a number of tuples")?;
            if self.tokens.peek()?.is_some_and(|t| t.eq_ignore_ascii_case(b"string")) {
                self.tokens.next_token()?;
                self.strings(count)?;
                continue;
            }
            let scalar = self.scalar()?;
            let values = self.values(scalar, count, &value_of(&name))?;
            arrays.push((name, components, values));
        }
        Ok(arrays)
    }

    /// Skips strings: one per line in text files, each preceded by its length in binary files.
    fn strings(&mut self, count: usize) -> Result<()> {
        self.tokens.line()?;
        for _ in 0..count {
            if !self.binary {
                let at = self.tokens.at;
                self.tokens.line()?.ok_or_else(|| self.source.error_line(at, "the file ends in an array of texts"))?;
                continue;
            }
            let at = self.tokens.at;
            let cut = || self.source.error_byte(at, "the file ends in an array of texts");
            let head = self.tokens.bytes(1)?.map(|b| b[0]).ok_or_else(cut)?;
            // The upper two bits encode how many bytes hold the length: 8, 4, 2 or 1.
            let (rest, upper) = ((8usize >> (head >> 6)) - 1, u64::from(head & 0x3f));
            let length = self.tokens.bytes(rest)?.ok_or_else(cut)?.iter().fold(upper, |n, &b| n << 8 | u64::from(b));
            let fits = usize::try_from(length).ok().filter(|&n| n <= self.tokens.left());
            self.tokens.at += fits.ok_or_else(|| self.source.error_byte(at, format!("a text of {length} bytes")))?;
        }
        Ok(())
    }
}

fn value_of(name: &str) -> String {
    format!("a value of array `{}`", printable(name.as_bytes()))
}

/// Decodes a name, in which spaces and other characters are percent-encoded (%20).
fn decode_name(word: &[u8]) -> String {
    let mut out = Vec::with_capacity(word.len());
    let mut rest = word;
    while let [first, tail @ ..] = rest {
        let hex = tail.get(..2).filter(|_| *first == b'%').and_then(|h| std::str::from_utf8(h).ok());
        if let Some(byte) = hex.and_then(|h| u8::from_str_radix(h, 16).ok()) {
            out.push(byte);
            rest = &tail[2..];
        } else {
            out.push(*first);
            rest = tail;
        }
    }
    String::from_utf8_lossy(&out).into_owned()
}
