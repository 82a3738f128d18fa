//! NumPy array files (`.npy`). The header, a dictionary with three keys, is parsed by hand: existing crates bring a
//! whole parser of Python literals, and trust the announced shape before they look at the size of the file.

use super::scalar::Scalar;
use super::source::{Source, excerpt};
use crate::error::Result;

pub(crate) const MAGIC: &[u8] = b"\x93NUMPY";

/// The file header for an array of this type and shape, padded so that the data are aligned. `descr` is a Python
/// literal.
pub(crate) fn header(descr: &str, shape: &[usize]) -> Vec<u8> {
    let shape: Vec<String> = shape.iter().map(usize::to_string).collect();
    let comma = if shape.len() == 1 { "," } else { "" };
    let mut text = format!("{{'descr': {descr}, 'fortran_order': False, 'shape': ({}{comma}), }}", shape.join(", "));
    let whole = (12 + text.len() + 1).next_multiple_of(64);
    // Version 2 differs by four bytes of length instead of two; readers that know only version 1 read all but the longest.
    let start = if u16::try_from(whole - 10).is_ok() { 10 } else { 12 };
    let length = whole - start;
    text.extend(std::iter::repeat_n(' ', length - 1 - text.len()));
    text.push('\n');
    let mut out = MAGIC.to_vec();
    out.extend([if start == 10 { 1 } else { 2 }, 0]);
    out.extend(&(length as u32).to_le_bytes()[..start - 8]);
    out.extend(text.as_bytes());
    out
}

/// A text as a Python literal, in ASCII.
pub(crate) fn literal(text: &str) -> String {
    let plain = |c: char| (c.is_ascii_graphic() || c == ' ') && !"'\\".contains(c);
    let escaped = text.chars().map(|c| if plain(c) { c.to_string() } else { format!("\\U{:08x}", u32::from(c)) });
    format!("'{}'", escaped.collect::<String>())
}

/// Reads points from an array of shape (n, 3), or of shape (3,) for a single point.
pub(crate) fn read_points(source: &Source) -> Result<Vec<[f64; 3]>> {
    let bytes = source.start();
    let short = || source.error_byte(bytes.len(), "the file ends inside the header");
    let (size, start) = match bytes.get(6) {
        Some(1) => (2, 10),
        Some(2 | 3) => (4, 12),
        Some(other) => return Err(source.error_byte(6, format!("version {other} of the format; 1 to 3 can be read"))),
        None => return Err(short()),
    };
    let length = bytes.get(8..8 + size).ok_or_else(short)?.iter().rev().fold(0usize, |n, &b| n << 8 | b as usize);
    let text = bytes.get(start..start + length).ok_or_else(short)?;
    let text = String::from_utf8_lossy(text);
    let field = |key: &str| {
        let at = text.find(&format!("'{key}'")).or_else(|| text.find(&format!("\"{key}\"")));
        let rest = at.and_then(|at| text[at + key.len() + 2..].trim_start().strip_prefix(':'));
        rest.map(str::trim_start).ok_or_else(|| source.error_in("header", format!("no key {key}")))
    };
    let descr = field("descr")?;
    let quote = descr.chars().next().filter(|c| "'\"".contains(*c));
    let name = quote.and_then(|q| descr[1..].split_once(q)).map(|(name, _)| name);
    let kind = name.and_then(scalar);
    let (scalar, big_endian) = kind.ok_or_else(|| {
        let found = describe(descr, name);
        source.error_in("header", format!("an array of {found}; points need type f4 or f8, or whole numbers (i1 to i8, u1 to u8)"))
    })?;
    let fortran = field("fortran_order")?.starts_with("True");
    let shape = field("shape")?.strip_prefix('(').and_then(|s| s.split_once(')')).map(|(s, _)| s);
    let shape: Option<Vec<usize>> =
        shape.and_then(|s| s.split(',').map(str::trim).filter(|s| !s.is_empty()).map(|s| s.parse().ok()).collect());
    let n = match shape.as_deref() {
        Some([n, 3]) => *n,
        Some([3]) => 1,
        other => {
            return Err(
                source.error_in("header", format!("shape {}; (n, 3) is needed", other.map_or("unreadable".into(), |s| format!("{s:?}"))))
            );
        }
    };
    let data = &bytes[start + length..];
    let wanted = n.checked_mul(3 * scalar.size()).filter(|&w| w <= data.len());
    let wanted = wanted
        .ok_or_else(|| source.error_byte(start + length, format!("{n} points are announced, but only {} bytes follow", data.len())))?;
    let values: Vec<f64> = scalar.convert(&data[..wanted], big_endian);
    Ok(if fortran {
        (0..n).map(|i| [values[i], values[n + i], values[2 * n + i]]).collect()
    } else {
        values.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect()
    })
}

/// Names the type of an array that cannot be read; `descr` is the header from that type on.
fn describe(descr: &str, name: Option<&str>) -> String {
    let Some(name) = name else {
        return if descr.starts_with('[') { "records with fields" } else { "an unreadable type" }.into();
    };
    let kind = name.trim_start_matches(['<', '>', '|', '=']);
    let what = match kind.chars().next() {
        Some('f') if kind == "f2" => "half-precision numbers",
        Some('f') => "extended-precision numbers",
        Some('c') => "complex numbers",
        Some('b' | '?') => "truth values",
        Some('O') => "Python objects",
        Some('U' | 'S' | 'a') => "texts",
        Some('M' | 'm') => "times",
        _ => "another type",
    };
    format!("{what} (`{}`)", excerpt(name.as_bytes()))
}

/// Parses a NumPy type such as `<f8` into number type and byte order (`true`: big-endian).
fn scalar(name: &str) -> Option<(Scalar, bool)> {
    let (order, kind) = name.split_at_checked(1)?;
    let big_endian = match order {
        "<" | "|" | "=" => false,
        ">" => true,
        _ => return None,
    };
    let scalar = match kind {
        "f4" => Scalar::F32,
        "f8" => Scalar::F64,
        "i1" => Scalar::I8,
        "u1" => Scalar::U8,
        "i2" => Scalar::I16,
        "u2" => Scalar::U16,
        "i4" => Scalar::I32,
        "u4" => Scalar::U32,
        "i8" => Scalar::I64,
        "u8" => Scalar::U64,
        _ => return None,
    };
    Some((scalar, big_endian))
}
