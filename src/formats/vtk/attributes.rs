//! Reader for the arrays of legacy VTK files.

use super::super::loss::Loss;
use super::super::scalar::Scalar;
use super::super::source::excerpt;
use super::super::tokens::parse_integer;
use super::reader::Reader;
use crate::error::Result;
use crate::mesh::On;

/// What the last `POINT_DATA` or `CELL_DATA` stated: what values belong to, and their number.
pub(super) type Section = (On, usize);

/// Values in single precision.
type Rounded = (Vec<f32>, Loss);

/// Name, number of components, and values of an array.
pub(super) type Named = (String, usize, Rounded);

impl Reader<'_> {
    fn name(&mut self) -> Result<String> {
        let (word, _) = self.tokens.word("the name of an array")?;
        Ok(decode_name(word))
    }

    /// Reads an array in a `POINT_DATA` or `CELL_DATA` section (or before the first one, where it belongs to neither).
    pub(super) fn attribute(&mut self, keyword: &[u8], at: usize, section: Option<Section>) -> Result<Vec<Named>> {
        let unknown = || Err(self.source.error_line(at, format!("`{}` where a keyword should be", excerpt(keyword))));
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
        if typed {
            let values = self.typed(&name, components, n)?;
            return Ok(values.map(|values| (name, components, values)).into_iter().collect());
        }
        // Colours are bytes in binary files and fractions of 255 in text files. VTK writes any bytes so that are the active
        // scalars, such as the numbers of materials.
        let scalar = Some(if self.binary { Scalar::U8 } else { Scalar::F32 });
        let mut values: Vec<f32> = self.values(scalar, n * components, &value_of(&name))?;
        if !self.binary {
            values.iter_mut().for_each(|value| *value = (*value * 255.0).round());
        }
        Ok(vec![(name, components, (values, Loss::default()))])
    }

    /// Reads the type of `tuples` tuples and then their values; `None` if they are text, which is skipped.
    fn typed(&mut self, name: &str, components: usize, tuples: usize) -> Result<Option<Rounded>> {
        let count = components * tuples;
        let kind = self.tokens.peek()?.unwrap_or_default().to_ascii_lowercase();
        match kind.as_slice() {
            b"string" | b"utf8_string" => self.strings(count).map(|()| None),
            b"variant" => self.variants(count).map(|()| None),
            _ => {
                let scalar = self.scalar()?;
                self.rounded(scalar, components, count, &value_of(name)).map(Some)
            }
        }
    }

    fn rounded(&mut self, scalar: Option<Scalar>, components: usize, count: usize, what: &str) -> Result<Rounded> {
        let before = self.tokens.at;
        let values: Vec<f32> = self.values(scalar, count, what)?;
        let loss = Loss::of(scalar, components, &values, || {
            self.tokens.at = before;
            self.values(scalar, count, what)
        })?;
        Ok((values, loss))
    }

    fn components(&mut self) -> Result<usize> {
        let (token, at) = self.tokens.word("a number of components")?;
        let n = parse_integer(token).filter(|n| (1..=9).contains(n));
        n.map(|n| n as usize).ok_or_else(|| self.source.error_line(at, format!("{} components, not 1 to 9", excerpt(token))))
    }

    fn scalars(&mut self, n: usize) -> Result<Vec<Named>> {
        let name = self.name()?;
        let scalar = self.scalar()?;
        let mut components = 1;
        // The format requires the look-up table, but it is often missing, so a number in the next line is a value.
        let is_last = self.tokens.clone().line()?.is_none_or(|(line, _)| line.trim_ascii().is_empty());
        if !self.skip_table()? && !is_last {
            components = self.components()?;
            self.skip_table()?;
        }
        let values = self.rounded(scalar, components, n * components, &value_of(&name))?;
        Ok(vec![(name, components, values)])
    }

    /// Skips the name of the look-up table of scalars, if that comes next.
    fn skip_table(&mut self) -> Result<bool> {
        const KEYWORD: &[u8] = b"LOOKUP_TABLE";
        let before = self.tokens.at;
        self.tokens.skip_space()?;
        let found = self.tokens.bytes(KEYWORD.len())?.is_some_and(|word| word.eq_ignore_ascii_case(KEYWORD));
        if found {
            self.tokens.word("the name of a look-up table")?;
        } else {
            self.tokens.at = before;
        }
        Ok(found)
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
            // VTK writes this and nothing more for a missing array.
            if self.tokens.peek()?.is_some_and(|word| word == b"NULL_ARRAY") {
                self.tokens.next_token()?;
                continue;
            }
            let name = self.name()?;
            let components = self.size("a number of components")?;
            let tuples = self.size("a number of tuples")?;
            arrays.extend(self.typed(&name, components, tuples)?.map(|values| (name, components, values)));
        }
        Ok(arrays)
    }

    /// Skips `variant` and such values: the number of a type and a word each.
    fn variants(&mut self, count: usize) -> Result<()> {
        self.tokens.next_token()?;
        for _ in 0..count {
            self.tokens.word("the type of a value")?;
            self.tokens.word("a value")?;
        }
        Ok(())
    }

    /// Skips the word for strings and the strings: one per line in text files, each preceded by its length in binary files.
    fn strings(&mut self, count: usize) -> Result<()> {
        self.tokens.next_token()?;
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
    format!("a value of array `{}`", excerpt(name.as_bytes()))
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
