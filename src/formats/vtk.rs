//! Legacy VTK files (`.vtk`), versions 1.0 to 5.1, text and binary (big-endian).

use std::ops::Range;

use super::array::Array;
use super::assemble::Assembly;
use super::cells;
use super::integers::Integers;
use super::report::Fate;
use super::scalar::{Number, Scalar};
use super::source::{Source, Tokens, parse_float, parse_integer, printable};
use super::stored::{Content, Stored};
use crate::error::Result;
use crate::mesh::On;

struct Reader<'a> {
    source: &'a Source,
    tokens: Tokens<'a>,
    binary: bool,
}

/// Cells as the file has them.
struct Cells<'a> {
    count: usize,
    /// Where each begins in `nodes`, and where the last one ends; `None`: every cell's nodes follow their number.
    offsets: Option<Integers<'a>>,
    nodes: Integers<'a>,
}

impl Cells<'_> {
    /// The nodes of cell `i`. `at`: where the one before ended, and then this one.
    fn nodes(&mut self, i: usize, at: &mut usize) -> Result<&[i64]> {
        let (begin, end) = match &mut self.offsets {
            Some(offsets) => (*at, offsets.at(i + 1)? as usize),
            None => (*at + 1, *at + 1 + self.nodes.at(*at)? as usize),
        };
        *at = end;
        self.nodes.slice(begin..end)
    }
}

/// What `POINT_DATA` or `CELL_DATA` said.
type Section = (On, usize);

pub(crate) fn read(source: &Source) -> Result<Assembly<'_>> {
    let mut reader = Reader { source, tokens: Tokens::new(source, 0..source.bytes.len(), None), binary: false };
    let format = reader.header()?;
    let mut assembly = Assembly::new(source, format);
    let (mut points, mut cells, mut types) = (None, None, None);
    let mut section: Option<Section> = None;
    while let Some((token, at)) = reader.tokens.next_token() {
        let keyword = token.to_ascii_uppercase();
        match keyword.as_slice() {
            b"POINTS" => points = Some(reader.points()?),
            b"CELLS" => cells = Some(reader.cells()?),
            b"CELL_TYPES" => types = Some(reader.types()?),
            b"POINT_DATA" | b"CELL_DATA" => {
                let on = if keyword == b"POINT_DATA" { On::Points } else { On::Cells };
                section = Some((on, reader.size("the number of values")?));
            }
            b"METADATA" => reader.metadata(),
            _ => {
                let arrays = reader.attribute(&keyword, at, section)?;
                let Some((on, _)) = section else { continue };
                for (name, components, values) in arrays {
                    assembly.arrays.push(Array { name, on, components, values });
                }
            }
        }
    }
    let missing = |what: &str| source.error_line(source.bytes.len(), format!("the file ends, and there was no {what}"));
    assembly.points = points.ok_or_else(|| missing("POINTS"))?;
    let mut cells: Cells<'_> = cells.ok_or_else(|| missing("CELLS"))?;
    let mut types: Integers<'_> = types.ok_or_else(|| missing("CELL_TYPES"))?;
    if types.len() != cells.count {
        return Err(source.error(format!("CELL_TYPES has {} entries, CELLS has {}", types.len(), cells.count)));
    }
    let marks = |a: &Array| cells::ghost(&a.name).filter(|_| a.on == On::Cells && a.components == 1);
    let ghosts = assembly.arrays.iter().find_map(|a| Some((a, marks(a)?)));
    let ghosts: Vec<bool> = ghosts.map_or_else(Vec::new, |(a, marks)| a.values.iter().map(|&v| marks(v as i64)).collect());
    assembly.reserve(types.len());
    let mut end = 0;
    for cell in 0..cells.count {
        let number = types.at(cell)?;
        let kind = cells::vtk(number);
        let kind = kind.ok_or_else(|| source.error_in(format_args!("cell {cell}"), format!("unknown VTK cell type {number}")))?;
        let nodes = cells.nodes(cell, &mut end)?;
        if ghosts.get(cell) == Some(&true) {
            assembly.skip("ghost cell", Fate::Ghost);
            continue;
        }
        // A polyhedron's entry lists its faces, not its points.
        assembly.push(kind, if number == 42 { &[] } else { nodes }, 0)?;
    }
    for array in &assembly.arrays {
        let (count, what) = if array.on == On::Points { (assembly.points.len(), "POINTS") } else { (types.len(), "CELLS") };
        if array.values.len() != count * array.components {
            let found = array.values.len() / array.components.max(1);
            let message = format!("{found} tuples, but {what} has {count}");
            return Err(source.error_in(format_args!("array `{}`", printable(array.name.as_bytes())), message));
        }
    }
    Ok(assembly)
}

impl<'a> Reader<'a> {
    fn header(&mut self) -> Result<String> {
        let (first, _) = self.tokens.line().unwrap_or_default();
        let first = first.trim_ascii();
        let Some(version) = first.strip_prefix(b"# vtk DataFile Version") else {
            return Err(self.source.error_line(0, format!("`{}` instead of `# vtk DataFile Version …`", printable(first))));
        };
        let version = printable(version.trim_ascii());
        self.tokens.line();
        let (coding, at) = self.tokens.line().unwrap_or_default();
        self.binary = match coding.trim_ascii().to_ascii_uppercase().as_slice() {
            b"ASCII" => false,
            b"BINARY" => true,
            _ => {
                let message = format!("`{}` where ASCII or BINARY should be (line 2 must be a title)", printable(coding));
                return Err(self.source.error_line(at, message));
            }
        };
        let (word, at) = self.tokens.word("DATASET")?;
        if !word.eq_ignore_ascii_case(b"DATASET") {
            return Err(self.source.error_line(at, format!("`{}` where DATASET should be", printable(word))));
        }
        let (dataset, at) = self.tokens.word("the type of the dataset")?;
        if !dataset.eq_ignore_ascii_case(b"UNSTRUCTURED_GRID") {
            return Err(self.source.error_line(at, format!("a {} dataset, not an UNSTRUCTURED_GRID", printable(dataset))));
        }
        Ok(format!("VTK legacy unstructured grid {version}, {}", if self.binary { "binary" } else { "text" }))
    }

    /// A number type; `None`: bits.
    fn scalar(&mut self) -> Result<Option<Scalar>> {
        let (word, at) = self.tokens.word("a number type")?;
        let name = String::from_utf8_lossy(word).to_ascii_lowercase();
        match name.as_str() {
            "bit" => Ok(None),
            name => Scalar::vtk_legacy(name)
                .map(Some)
                .ok_or_else(|| self.source.error_line(at, format!("unknown number type `{}`", printable(word)))),
        }
    }

    /// `count` numbers; in binary they begin after the end of the line.
    fn values<T: Number>(&mut self, scalar: Option<Scalar>, count: usize, what: &str) -> Result<Vec<T>> {
        if self.binary {
            self.tokens.line();
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
            // Some writers announce a whole-number type and then write fractions.
            let value = value.or_else(|| if T::EXACT { None } else { parse_float(token).map(T::from_f64) });
            values.push(value.ok_or_else(|| self.source.error_line(at, format!("`{}` where {what} should be", printable(token))))?);
        }
        Ok(values)
    }

    /// `count` whole numbers.
    fn integers(&mut self, scalar: Option<Scalar>, count: usize, what: &str) -> Result<Integers<'a>> {
        let Some(scalar) = scalar.filter(|_| self.binary) else { return self.values(scalar, count, what).map(Integers::parsed) };
        self.tokens.line();
        let range = self.range(Some(scalar), count, what)?;
        Ok(Integers::stored(Stored::new(self.source, what.to_owned(), Content::File(range), None), scalar, true))
    }

    /// Where the bytes of `count` binary numbers are.
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
        let bytes = &self.source.bytes[self.range(scalar, count, what)?];
        Ok(match scalar {
            Some(scalar) => scalar.convert(bytes, true),
            None => (0..count).map(|i| T::from_i64(i64::from(bytes[i / 8] >> (7 - i % 8) & 1))).collect(),
        })
    }

    fn points(&mut self) -> Result<Vec<[f64; 3]>> {
        let n = self.tokens.count("the number of points")?;
        let scalar = self.scalar()?;
        let values: Vec<f64> = self.values(scalar, 3 * n, "a coordinate")?;
        Ok(values.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect())
    }

    fn types(&mut self) -> Result<Integers<'a>> {
        let n = self.tokens.count("the number of cell types")?;
        self.integers(Some(Scalar::I32), n, "a cell type")
    }

    /// `CELLS n size` with lists of a count and that many points, or, since 5.0, `CELLS n+1 size` with offsets and connectivity.
    fn cells(&mut self) -> Result<Cells<'a>> {
        let at = self.tokens.at;
        let n = self.tokens.count("the number of cells")?;
        let size = self.tokens.count("the size of the cell list")?;
        if self.tokens.peek().is_some_and(|t| t.eq_ignore_ascii_case(b"OFFSETS")) {
            return self.offsets(at, n, size);
        }
        let mut list = self.integers(Some(Scalar::I32), size, "a point of a cell")?;
        let mut next = 0;
        for cell in 0..n {
            let fail = |message: String| self.source.error_line(at, format!("CELLS: cell {cell} {message}"));
            if next == list.len() {
                return Err(fail(format!("lies beyond the {size} numbers of the list")));
            }
            let (length, left) = (list.at(next)?, list.len() - next - 1);
            let fits = usize::try_from(length).ok().filter(|&l| l <= left);
            next += 1 + fits.ok_or_else(|| fail(format!("announces {length} points, but {left} numbers are left")))?;
        }
        if next < list.len() {
            let left = list.len() - next;
            return Err(self.source.error_line(at, format!("CELLS: {left} of {size} numbers are left over after {n} cells")));
        }
        Ok(Cells { count: n, offsets: None, nodes: list })
    }

    fn offsets(&mut self, at: usize, n: usize, size: usize) -> Result<Cells<'a>> {
        self.tokens.next_token();
        let scalar = self.scalar()?;
        let mut offsets = self.integers(scalar, n, "an offset")?;
        let (word, word_at) = self.tokens.word("CONNECTIVITY")?;
        if !word.eq_ignore_ascii_case(b"CONNECTIVITY") {
            return Err(self.source.error_line(word_at, format!("`{}` where CONNECTIVITY should be", printable(word))));
        }
        let scalar = self.scalar()?;
        let nodes = self.integers(scalar, size, "a point of a cell")?;
        let fail = |message: String| self.source.error_line(at, format!("CELLS: {message}"));
        let (count, first) = (offsets.len().saturating_sub(1), offsets.at(0)?);
        if first != 0 {
            return Err(fail(format!("the first offset is {first}, not 0")));
        }
        let mut last = 0;
        for cell in 0..count {
            let end = offsets.at(cell + 1)?;
            if end < last {
                return Err(fail(format!("the offsets of cell {cell} go backwards")));
            }
            last = end;
        }
        if last != nodes.len() as i64 {
            return Err(fail(format!("the last offset is {last}, but there are {} points of cells", nodes.len())));
        }
        Ok(Cells { count, offsets: Some(offsets), nodes })
    }

    /// Skips a block of meta data, which an empty line ends.
    fn metadata(&mut self) {
        self.tokens.line();
        while self.tokens.line().is_some_and(|(line, _)| !line.trim_ascii().is_empty()) {}
    }

    /// A number of values that may come or not; bounded where they do.
    fn size(&mut self, what: &str) -> Result<usize> {
        let (token, at) = self.tokens.word(what)?;
        let n = parse_integer(token).and_then(|n| u32::try_from(n).ok());
        n.map(|n| n as usize).ok_or_else(|| self.source.error_line(at, format!("`{}` as {what}", printable(token))))
    }

    fn name(&mut self) -> Result<String> {
        let (word, _) = self.tokens.word("the name of an array")?;
        Ok(decode_name(word))
    }

    /// An array in a `POINT_DATA` or `CELL_DATA` section (or before them, where it belongs to neither).
    fn attribute(&mut self, keyword: &[u8], at: usize, section: Option<Section>) -> Result<Vec<(String, usize, Vec<f32>)>> {
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
        // Colours are bytes in binary files and fractions in text.
        let scalar = if typed { self.scalar()? } else { Some(if self.binary { Scalar::U8 } else { Scalar::F32 }) };
        let values = self.values(scalar, n * components, &value_of(&name))?;
        Ok(vec![(name, components, values)])
    }

    fn components(&mut self) -> Result<usize> {
        let (token, at) = self.tokens.word("a number of components")?;
        let n = parse_integer(token).filter(|n| (1..=9).contains(n));
        n.map(|n| n as usize).ok_or_else(|| self.source.error_line(at, format!("{} components, not 1 to 9", printable(token))))
    }

    fn scalars(&mut self, n: usize) -> Result<Vec<(String, usize, Vec<f32>)>> {
        let name = self.name()?;
        let scalar = self.scalar()?;
        let mut rest = self.tokens.clone();
        let same_line = rest.line().map_or(&b""[..], |(line, _)| line.trim_ascii());
        let components = if same_line.is_empty() { 1 } else { self.components()? };
        // The look-up table is required, but often missing.
        let mut ahead = self.tokens.clone();
        ahead.line();
        if ahead.line().is_some_and(|(line, _)| line.trim_ascii().get(..12).is_some_and(|w| w.eq_ignore_ascii_case(b"LOOKUP_TABLE"))) {
            self.tokens.next_token();
            self.tokens.next_token();
        }
        let values = self.values(scalar, n * components, &value_of(&name))?;
        Ok(vec![(name, components, values)])
    }

    /// A table of colours, which is of no use here.
    fn lookup_table(&mut self) -> Result<Vec<(String, usize, Vec<f32>)>> {
        self.name()?;
        let n = self.tokens.count("the size of a look-up table")?;
        let scalar = Some(if self.binary { Scalar::U8 } else { Scalar::F32 });
        self.values::<f32>(scalar, 4 * n, "a colour")?;
        Ok(Vec::new())
    }

    fn field(&mut self) -> Result<Vec<(String, usize, Vec<f32>)>> {
        self.name()?;
        let n = self.tokens.count("the number of arrays")?;
        let mut arrays = Vec::new();
        for _ in 0..n {
            while self.tokens.peek().is_some_and(|t| t.eq_ignore_ascii_case(b"METADATA")) {
                self.tokens.next_token();
                self.metadata();
            }
            let name = self.name()?;
            let components = self.size("a number of components")?;
            let count = components * self.size("a number of tuples")?;
            if self.tokens.peek().is_some_and(|t| t.eq_ignore_ascii_case(b"string")) {
                self.tokens.next_token();
                self.strings(count)?;
                continue;
            }
            let scalar = self.scalar()?;
            let values = self.values(scalar, count, &value_of(&name))?;
            arrays.push((name, components, values));
        }
        Ok(arrays)
    }

    /// Skips texts: one per line, or each with its length before it in binary.
    fn strings(&mut self, count: usize) -> Result<()> {
        self.tokens.line();
        for _ in 0..count {
            if !self.binary {
                let at = self.tokens.at;
                self.tokens.line().ok_or_else(|| self.source.error_line(at, "the file ends in an array of texts"))?;
                continue;
            }
            let at = self.tokens.at;
            let rest = &self.source.bytes[at..];
            let head = rest.first().copied().unwrap_or(0);
            // The upper two bits tell how many bytes hold the length: 8, 4, 2 or 1.
            let size = 8usize >> (head >> 6);
            let word = rest.get(..size).ok_or_else(|| self.source.error_byte(at, "the file ends in an array of texts"))?;
            let length = word.iter().fold(0u64, |n, &b| n << 8 | u64::from(b)) & (u64::MAX >> (64 - 8 * size) >> 2);
            let end = usize::try_from(length).ok().and_then(|n| n.checked_add(size)).filter(|&n| n <= rest.len());
            self.tokens.at += end.ok_or_else(|| self.source.error_byte(at, format!("a text of {length} bytes")))?;
        }
        Ok(())
    }
}

fn value_of(name: &str) -> String {
    format!("a value of array `{}`", printable(name.as_bytes()))
}

/// Names have spaces and the like as %20.
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
