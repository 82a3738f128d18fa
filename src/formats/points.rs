//! Readers for points to locate: NumPy arrays, text tables, and the points of meshes and surfaces.

use rayon::prelude::*;
use std::io::Read;
use std::ops::Range;
use std::path::Path;

use super::assemble::Assembly;
use super::detect;
use super::source::ending;
use super::source::{Source, excerpt};
use super::tokens::parse_float;
use super::{LoadOptions, Merge, assembled, npy, procedural, surfaces};
use crate::error::{Error, Result};

/// Reads points from a `.npy` file of shape (n, 3) and type f4, f8, or whole numbers, or from a text table with one
/// point per line and columns separated by commas, semicolons, tabs or spaces, in the same way throughout. Fields may
/// be in quotation marks, and where commas do not separate columns they may be decimal marks. The first line of a table
/// may name the columns, `x`, `y` and `z` among them (also as in `X [ m ]`, `x-coordinate` or `Points:0`): these are used.
/// Without names there must be three columns. Lines that start with `#` or `%` are comments; the last one before the points
/// may name the columns as well. A table without points is valid, even an empty file. Text is UTF-8, or UTF-16 with a
/// byte-order mark.
///
/// Of a mesh, in any format of [`super::load`] or procedural, these are all points in the order of the file, also those
/// that no cell uses; it may consist of surfaces only. Files named `.vtp`, `.obj`, `.ply` or `.stl`, and a `.vtk` with
/// polygons, are surfaces, whose vertices are taken in their order, in an `.stl` three of each triangle.
///
/// # Errors
/// [`crate::Error::Io`] if the file cannot be read, [`crate::Error::File`] with the place if it is broken, and as
/// [`super::load`] for a mesh.
pub fn load_points(path: impl AsRef<Path>) -> Result<Vec<[f64; 3]>> {
    let path = path.as_ref();
    if let Some(made) = path.to_str().and_then(procedural::make) {
        return made.map(|(_, mesh)| mesh.points.iter().map(|p| p.map(f64::from)).collect());
    }
    of(Source::open(path, ".npy, a table of text, a surface, or a mesh")?)
}

fn of(source: Source) -> Result<Vec<[f64; 3]>> {
    // A mesh in UTF-16 is refused as elsewhere.
    let source = if is_utf16(source.start()) && !detect::is_mesh(&source)? { decoded(&source.whole()?)? } else { source };
    if let Some(points) = surfaces::points(&source) {
        return points;
    }
    if detect::is_mesh(&source)? { of_mesh(&source) } else { points(&source.whole()?) }
}

/// Whether a text is in UTF-16, with a byte-order mark, as Windows writes it.
fn is_utf16(bytes: &[u8]) -> bool {
    [b"\xff\xfe", b"\xfe\xff"].iter().any(|mark| bytes.starts_with(*mark))
}

/// A text in UTF-16, as UTF-8.
fn decoded(source: &Source) -> Result<Source> {
    let (big_endian, bytes) = (source.start().first() == Some(&0xfe), source.start().get(2..).unwrap_or_default());
    let unit = |pair: &[u8]| if big_endian { u16::from_be_bytes([pair[0], pair[1]]) } else { u16::from_le_bytes([pair[0], pair[1]]) };
    let text = char::decode_utf16(bytes.chunks_exact(2).map(unit)).collect::<Result<String, _>>();
    let text = text.ok().filter(|_| bytes.len() % 2 == 0);
    let text = text.ok_or_else(|| source.error("it begins as text in UTF-16, but is none; save it as UTF-8"))?;
    Ok(Source::new(&source.path, text.into_bytes()))
}

/// Reads points from a stream, such as standard input, in the formats of [`load_points`].
///
/// # Errors
/// As for [`load_points`]; the stream's name is `-`.
pub fn read_points(mut stream: impl Read) -> Result<Vec<[f64; 3]>> {
    let (path, mut bytes) = (Path::new("-"), Vec::new());
    stream.read_to_end(&mut bytes).map_err(|source| Error::Io { path: path.into(), source })?;
    of(Source::new(path, bytes))
}

fn of_mesh(source: &Source) -> Result<Vec<[f64; 3]>> {
    assembled(source, &LoadOptions { merge: Merge::Nothing, ..LoadOptions::default() }).map(Assembly::into_points)
}

fn points(source: &Source) -> Result<Vec<[f64; 3]>> {
    if source.start().starts_with(npy::MAGIC) || ending(&source.path) == "npy" && source.start().is_empty() {
        return npy::read_points(source);
    }
    if source.start().starts_with(b"PK\x03\x04") {
        return Err(source.error("an archive (.npz?); save the array of points as .npy"));
    }
    if let Some(at) = source.start().iter().position(|&b| b == 0) {
        return Err(source.error_byte(at, "a byte 0: neither a .npy file nor a table of text"));
    }
    table(source)
}

/// How the lines of a table hold points.
struct Columns {
    /// The bytes that separate columns.
    separator: &'static [u8],
    /// Number of columns.
    width: usize,
    /// The columns of x, y and z.
    at: [usize; 3],
}

fn table(source: &Source) -> Result<Vec<[f64; 3]>> {
    let mut rest = 0..source.len();
    let Some(columns) = columns(source, &mut rest)? else { return Ok(Vec::new()) };
    let parts: Vec<_> = parts(source, rest).collect();
    let points: Vec<Result<Vec<_>>> = parts.into_par_iter().map(|part| columns.points(source, part)).collect();
    Ok(points.into_iter().collect::<Result<Vec<_>>>()?.concat())
}

/// Parts of a text that end at the ends of lines.
fn parts(source: &Source, range: Range<usize>) -> impl Iterator<Item = Range<usize>> {
    const BYTES: usize = 1 << 20;
    let mut start = range.start;
    std::iter::from_fn(move || {
        let rest = source.start().get(start..range.end).filter(|rest| !rest.is_empty())?;
        let line_end = rest.iter().skip(BYTES).position(|&b| b == b'\n');
        let part = start..line_end.map_or(range.end, |at| start + BYTES + at + 1);
        start = part.end;
        Some(part)
    })
}

/// Whether a line is a comment: `#` as in NumPy and many others, `%` as in COMSOL and MATLAB.
fn is_comment(line: &[u8]) -> bool {
    line.starts_with(b"#") || line.starts_with(b"%")
}

/// The next line of `rest` that holds something, and its position. Spreadsheets leave lines of separators behind.
fn next_line<'s>(source: &'s Source, rest: &mut Range<usize>) -> Option<(&'s [u8], usize)> {
    let holds = |line: &[u8]| !is_comment(line) && line.iter().any(|b| !b";,".contains(b) && !b.is_ascii_whitespace());
    while let Some(bytes) = source.start().get(rest.clone()).filter(|bytes| !bytes.is_empty()) {
        let length = memchr::memchr2(b'\n', b'\r', bytes).unwrap_or(bytes.len());
        let (line, at) = (bytes[..length].trim_ascii(), rest.start);
        rest.start = rest.end.min(at + length + 1);
        if holds(line) {
            return Some((line, at));
        }
    }
    None
}

/// Finds the columns by the first lines, and leaves those of the points in `rest`; `None` if there are none.
fn columns(source: &Source, rest: &mut Range<usize>) -> Result<Option<Columns>> {
    let mut first = rest.clone();
    let Some((line, at)) = next_line(source, &mut first) else { return Ok(None) };
    let separator = separator(line, None);
    let names: Vec<_> = fields(line, separator).collect();
    let (width, numbers) = (names.len(), names.iter().filter(|name| number(name).is_some()).count());
    let ambiguous = |at: usize| {
        move |axis: usize| {
            let axis = ["x", "y", "z"][axis];
            source.error_line(at, format!("several columns are named {axis}; rename all but the one to be read, or remove them"))
        }
    };
    if numbers == width
        && let Some((names, line)) = commented(&source.start()[..at], width)
        && let Some(at) = named(&names).map_err(ambiguous(line))?
    {
        return Ok(Some(Columns { separator, width, at }));
    }
    let named = if numbers == width { None } else { named(&names).map_err(ambiguous(at))? };
    // Other names may stand for anything in any order.
    if numbers == 0 && named.is_none() && width == 3 {
        let found = excerpt(line);
        return Err(
            source.error_line(at, format!("`{found}` are no names of coordinates; name the columns x, y and z, or leave this line out"))
        );
    }
    let at = named.or_else(|| (width == 3).then_some([0, 1, 2])).ok_or_else(|| {
        source.error_line(at, format!("{width} columns; there must be three, or a first line that names x, y and z among them"))
    })?;
    // A line of column names contains no numbers. If some fields are numbers, this is a point with a typing error, not
    // a header.
    if named.is_none() && numbers > 0 {
        return Ok(Some(Columns { separator, width, at }));
    }
    *rest = first.clone();
    Ok(next_line(source, &mut first).map(|(line, _)| Columns { separator: self::separator(line, Some(separator)), width, at }))
}

/// The names in the last comment before the points, if there are as many as columns, as NumPy writes a header, and its
/// position. COMSOL writes names with spaces in them, and several spaces between names.
fn commented(before: &[u8], width: usize) -> Option<(Vec<&[u8]>, usize)> {
    let mut lines = before.split(|b| b"\r\n".contains(b)).map(<[u8]>::trim_ascii);
    let line = lines.rfind(|line| is_comment(line))?;
    let at = memchr::memmem::rfind(before, line)?;
    let names: Vec<_> = fields(&line[1..], separator(&line[1..], None)).collect();
    if names.len() == width {
        return Some((names, at));
    }
    let (mut names, mut rest) = (Vec::new(), line[1..].trim_ascii());
    while !rest.is_empty() {
        let length = memchr::memmem::find(rest, b"  ").unwrap_or(rest.len());
        names.push(&rest[..length]);
        rest = rest[length..].trim_ascii_start();
    }
    (names.len() == width).then_some((names, at))
}

impl Columns {
    /// The points of some lines.
    fn points(&self, source: &Source, mut part: Range<usize>) -> Result<Vec<[f64; 3]>> {
        let mut points = Vec::new();
        let mut found = Vec::with_capacity(self.width);
        while let Some((line, at)) = next_line(source, &mut part) {
            found.clear();
            found.extend(fields(line, self.separator));
            if found.len() != self.width {
                let by = separated_by(self.separator);
                return Err(source.error_line(at, format!("{} instead of {} columns, separated by {by}", found.len(), self.width)));
            }
            let mut point = [0.0; 3];
            for (x, column) in point.iter_mut().zip(self.at) {
                let field = found[column];
                *x = number(field).ok_or_else(|| source.error_line(at, format!("`{}` is not a number", excerpt(field))))?;
            }
            points.push(point);
        }
        Ok(points)
    }
}

/// The bytes that may separate columns, the most certain first: a comma may also be a decimal mark, and a space may be
/// part of a name.
const SEPARATORS: [&[u8]; 4] = [b";", b"\t", b",", b" \t\x0b\x0c"];

fn separated_by(separator: &[u8]) -> &'static str {
    match separator {
        b";" => "semicolons",
        b"\t" => "tabs",
        b"," => "commas",
        _ => "spaces",
    }
}

/// What separates the fields of a line: the first separator that makes all of them numbers, or else that of the names,
/// or else the first one that the line contains.
fn separator(line: &[u8], of_names: Option<&'static [u8]>) -> &'static [u8] {
    let mut found = SEPARATORS.into_iter().filter(|separator| fields(line, separator).nth(1).is_some());
    let first = of_names.or_else(|| found.clone().next()).unwrap_or(b"");
    found.find(|separator| fields(line, separator).all(|field| number(field).is_some())).unwrap_or(first)
}

/// The fields between separators outside quotation marks. Only commas and semicolons enclose empty fields.
fn fields<'l>(line: &'l [u8], separator: &'static [u8]) -> impl Iterator<Item = &'l [u8]> {
    let mut quoted = false;
    let ends = move |b: &u8| {
        quoted ^= *b == b'"';
        !quoted && separator.contains(b)
    };
    let unquoted = |field: &'l [u8]| {
        let field = field.trim_ascii();
        field.strip_prefix(b"\"").and_then(|f| f.strip_suffix(b"\"")).unwrap_or(field).trim_ascii()
    };
    let keep_empty = !separator.contains(&b'\t');
    line.split(ends).map(unquoted).filter(move |field| keep_empty || !field.is_empty())
}

/// Parses a number, whose decimal mark may be a comma between two digits.
fn number(field: &[u8]) -> Option<f64> {
    parse_float(field).or_else(|| {
        if field.starts_with(b",") || field.ends_with(b",") {
            return None;
        }
        let dotted: Vec<u8> = field.iter().map(|&b| if b == b',' { b'.' } else { b }).collect();
        parse_float(&dotted)
    })
}

/// The columns that hold x, y and z, found by their names: the axes themselves before names that contain them. An error is
/// the number of an axis that several columns are named after.
fn named(fields: &[&[u8]]) -> Result<Option<[usize; 3]>, usize> {
    let plain = |field: &[u8]| "xyz".bytes().position(|axis| field.eq_ignore_ascii_case(&[axis]));
    for axis_of in [&plain as &dyn Fn(&[u8]) -> Option<usize>, &axis_in] {
        let columns = [0, 1, 2].map(|axis| (0..fields.len()).filter(|&i| axis_of(fields[i]) == Some(axis)).collect::<Vec<_>>());
        if columns.iter().all(|columns| !columns.is_empty()) {
            let several = columns.iter().position(|columns| columns.len() > 1);
            return several.map_or_else(|| Ok(Some(columns.each_ref().map(|columns| columns[0]))), Err);
        }
    }
    Ok(None)
}

/// The axis in the name of a column, as other programs write it: `X [ m ]`, `z (mm)`, `x-coordinate`, `Points:0`.
fn axis_in(field: &[u8]) -> Option<usize> {
    let name = field.split(|b| b"([".contains(b)).next()?.trim_ascii().to_ascii_lowercase();
    let (first, word) = match name.split_first()? {
        (first @ b'x'..=b'z', word) => (usize::from(first - b'x'), word),
        // Different versions of ParaView write a colon or an underscore.
        _ => match name.strip_prefix(b"points")? {
            [b':' | b'_', number @ b'0'..=b'2'] => (usize::from(number - b'0'), &[][..]),
            _ => return None,
        },
    };
    let word = word.trim_ascii_start();
    let word = word.strip_prefix(b"-").or(word.strip_prefix(b"_")).unwrap_or(word);
    [&b""[..], b"coordinate", b"coord", b"position", b"pos"].contains(&word).then_some(first)
}
