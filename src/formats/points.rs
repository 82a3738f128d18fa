//! Readers for points to locate: NumPy arrays and text tables.

use std::io::Read;
use std::path::Path;

use super::detect::ending;
use super::npy;
use super::source::{Source, Tokens, parse_float, printable};
use crate::error::{Error, Result};

/// Reads points from a `.npy` file of shape (n, 3) and type f4, f8, or whole numbers, or from a text table with one
/// point per line and columns separated by commas, semicolons, tabs or spaces. Fields may be in quotation marks, and where
/// commas do not separate columns they may be decimal marks. The first line of a table may name the columns: if it names
/// `x`, `y` and `z`, these columns are used; otherwise there must be three columns. Lines that start with `#` are
/// comments. A table without points is valid, even an empty file.
///
/// # Errors
/// [`crate::Error::Io`] if the file cannot be read, [`crate::Error::File`] with the line if it is broken.
pub fn load_points(path: impl AsRef<Path>) -> Result<Vec<[f64; 3]>> {
    points(&Source::read(path.as_ref(), ".npy or a table of text")?)
}

/// Reads points from a stream, such as standard input, in the formats of [`load_points`].
///
/// # Errors
/// As for [`load_points`]; the stream's name is `-`.
pub fn read_points(mut stream: impl Read) -> Result<Vec<[f64; 3]>> {
    let (path, mut bytes) = (Path::new("-"), Vec::new());
    stream.read_to_end(&mut bytes).map_err(|source| Error::Io { path: path.into(), source })?;
    points(&Source::new(path, bytes))
}

fn points(source: &Source) -> Result<Vec<[f64; 3]>> {
    if source.bytes.starts_with(npy::MAGIC) || ending(&source.path) == "npy" && source.bytes.is_empty() {
        return npy::read_points(source);
    }
    if source.bytes.starts_with(b"PK\x03\x04") {
        return Err(source.error("an archive (.npz?); save the array of points as .npy"));
    }
    if let Some(at) = source.bytes.iter().position(|&b| b == 0) {
        return Err(source.error_byte(at, "a byte 0: neither a .npy file nor a table of text"));
    }
    table(source)
}

fn table(source: &Source) -> Result<Vec<[f64; 3]>> {
    let mut points = Vec::new();
    let mut columns: Option<[usize; 3]> = None;
    let mut width = 0;
    let mut lines = Tokens::new(source, 0..source.bytes.len(), None);
    while let Some((line, at)) = lines.line() {
        let line = line.trim_ascii();
        if line.is_empty() || line.starts_with(b"#") {
            continue;
        }
        let fields = split(line);
        // Spreadsheets leave rows of separators behind.
        if fields.iter().all(|field| field.is_empty()) {
            continue;
        }
        let Some(columns) = columns else {
            width = fields.len();
            let numbers = fields.iter().filter(|f| number(f).is_some()).count();
            let named = if numbers == width { None } else { named(&fields) };
            let chosen = named.or_else(|| (width == 3).then_some([0, 1, 2])).ok_or_else(|| {
                let message = format!("{width} columns; there must be three, or a first line that names x, y and z among them");
                source.error_line(at, message)
            })?;
            columns = Some(chosen);
            // A line of column names contains no numbers. If some fields are numbers, this is a point with a typing
            // error, not a header.
            if named.is_none() && numbers > 0 {
                points.push(point(source, at, &fields, chosen)?);
            }
            continue;
        };
        if fields.len() != width {
            return Err(source.error_line(at, format!("{} columns instead of {width}", fields.len())));
        }
        points.push(point(source, at, &fields, columns)?);
    }
    Ok(points)
}

/// The bytes that may separate columns, the most certain first: a comma may also be a decimal mark, and a space may be
/// part of a name.
const SEPARATORS: [&[u8]; 4] = [b";", b"\t", b",", b" \t\x0b\x0c"];

/// The fields of a line, by the first separator that makes all of them numbers, or else by the first one that the line
/// contains.
fn split(line: &[u8]) -> Vec<&[u8]> {
    let mut found = SEPARATORS.iter().map(|separator| fields(line, separator)).filter(|fields| fields.len() > 1).peekable();
    let first = found.peek().cloned().unwrap_or_else(|| fields(line, b""));
    found.find(|fields| fields.iter().all(|field| number(field).is_some())).unwrap_or(first)
}

/// The fields between separators outside quotation marks. Only commas and semicolons enclose empty fields.
fn fields<'l>(line: &'l [u8], separator: &[u8]) -> Vec<&'l [u8]> {
    let mut quoted = false;
    let ends = |b: &u8| {
        quoted ^= *b == b'"';
        !quoted && separator.contains(b)
    };
    let unquoted = |field: &'l [u8]| {
        let field = field.trim_ascii();
        field.strip_prefix(b"\"").and_then(|f| f.strip_suffix(b"\"")).unwrap_or(field).trim_ascii()
    };
    let keep_empty = !separator.contains(&b'\t');
    line.split(ends).map(unquoted).filter(|field| keep_empty || !field.is_empty()).collect()
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

/// The columns that hold x, y and z, found by their names.
fn named(fields: &[&[u8]]) -> Option<[usize; 3]> {
    let find = |names: [&str; 3]| {
        let at = names.map(|name| fields.iter().position(|f| f.eq_ignore_ascii_case(name.as_bytes())));
        Some([at[0]?, at[1]?, at[2]?])
    };
    // The last two sets of names are those of different ParaView versions.
    [["x", "y", "z"], ["Points:0", "Points:1", "Points:2"], ["Points_0", "Points_1", "Points_2"]].into_iter().find_map(find)
}

fn point(source: &Source, at: usize, fields: &[&[u8]], columns: [usize; 3]) -> Result<[f64; 3]> {
    let mut point = [0.0; 3];
    for (x, column) in point.iter_mut().zip(columns) {
        let field = fields.get(column).copied().unwrap_or_default();
        let value = number(field);
        *x = value.ok_or_else(|| source.error_line(at, format!("`{}` is not a number", printable(field))))?;
    }
    Ok(point)
}
