//! Reader for the arrays of VTK XML files: text, base64 and raw bytes, compressed or not.
//!
//! Every size is checked against the bytes that are present, and against what the number of points and cells requires,
//! before memory of that size is allocated.

use std::borrow::Cow;
use std::ops::Range;

use base64::Engine as _;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};

use super::super::budget::Budget;
use super::super::integers::Integers;
use super::super::scalar::{Number, Scalar};
use super::super::source::{Source, excerpt};
use super::super::stored::{Blocks, Content, Stored};
use super::super::tokens::{Tokens, parse_float, parse_integer};
use super::super::unpack::Compressor;
use crate::error::{Error, Result};

/// An array as described by the XML.
pub(crate) struct StoredArray {
    pub name: String,
    /// `None`: text or bits.
    pub scalar: Option<Scalar>,
    pub components: u64,
    pub place: Place,
    /// Position of its XML element.
    pub at: usize,
}

/// Where the values of an array are.
pub(crate) enum Place {
    /// As text, in these ranges of the file.
    Ascii(Vec<Range<usize>>),
    /// As base64, in these ranges of the file.
    Inline(Vec<Range<usize>>),
    /// In the appended data, at this offset.
    Appended(u64),
}

/// The appended data.
pub(crate) struct Appended {
    pub base64: bool,
    pub range: Range<usize>,
}

/// How a file stores binary arrays.
pub(crate) struct Codec {
    big_endian: bool,
    /// Size in bytes of a number in the headers of arrays: 4 or 8.
    word: usize,
    compressor: Option<Compressor>,
    pub appended: Option<Appended>,
    /// Limit for decompressed data.
    pub budget: Budget,
}

/// The encoded bytes of an array.
enum Stream<'a> {
    Raw(&'a Source, Range<usize>),
    Base64(&'a Source, Vec<Range<usize>>),
}

impl Codec {
    /// Makes a codec from the attributes of the root element.
    pub fn new<'s>(get: impl Fn(&str) -> Option<&'s str>) -> Result<Self, String> {
        let quote = |s: &str| excerpt(s.as_bytes());
        let big_endian = match get("byte_order") {
            None | Some("LittleEndian") => false,
            Some("BigEndian") => true,
            Some(other) => return Err(format!("unknown byte_order `{}`", quote(other))),
        };
        let word = match get("header_type") {
            None | Some("UInt32") => 4,
            Some("UInt64") => 8,
            Some(other) => return Err(format!("unknown header_type `{}`", quote(other))),
        };
        let compressor = match get("compressor") {
            None | Some("") => None,
            Some("vtkZLibDataCompressor") => Some(Compressor::Zlib),
            Some("vtkLZ4DataCompressor") => Some(Compressor::Lz4),
            Some("vtkLZMADataCompressor") => Some(Compressor::Xz),
            Some(other) => return Err(format!("unknown compressor `{}`; save the file with zlib or uncompressed", quote(other))),
        };
        Ok(Self { big_endian, word, compressor, appended: None, budget: Budget::default() })
    }

    /// Byte order and compressor, as text for the report.
    pub fn describe(&self) -> String {
        let order = if self.big_endian { ", big-endian" } else { "" };
        self.compressor.map_or(order.to_owned(), |c| format!("{order}, {}", c.name()))
    }

    /// Reads all values of an array of `tuples` tuples.
    pub fn floats<T: Number + Send>(&mut self, source: &Source, array: &StoredArray, tuples: u64) -> Result<Vec<T>> {
        let count = tuples.checked_mul(array.components).filter(|&n| n < 1 << 60);
        let count = count.ok_or_else(|| place(source, array, &format!("{tuples} × {} values", array.components)))?;
        self.values(source, array, Some(count))
    }

    /// Reads all values of an array of indices; there must be `count` of them if it is given.
    pub fn integers<'a>(&mut self, source: &'a Source, array: &StoredArray, count: Option<u64>) -> Result<Integers<'a>> {
        let scalar = array.scalar.filter(|s| !s.is_float()).ok_or_else(|| place(source, array, "its type must be an integer type"))?;
        if array.components != 1 {
            return Err(place(source, array, &format!("it must have 1 component, not {}", array.components)));
        }
        Ok(match &array.place {
            Place::Ascii(parts) => Integers::parsed(ascii(source, array, scalar, parts, count)?),
            _ => Integers::stored(self.stored(source, array, scalar, count)?, scalar, self.big_endian),
        })
    }

    fn values<T: Number>(&mut self, source: &Source, array: &StoredArray, count: Option<u64>) -> Result<Vec<T>> {
        let scalar = array.scalar.ok_or_else(|| place(source, array, "it holds text"))?;
        if let Place::Ascii(parts) = &array.place {
            return ascii(source, array, scalar, parts, count);
        }
        self.stored(source, array, scalar, count)?.convert(scalar, self.big_endian)
    }

    /// The bytes of an array that is not stored as text.
    fn stored<'a>(&mut self, source: &'a Source, array: &StoredArray, scalar: Scalar, count: Option<u64>) -> Result<Stored<'a>> {
        let what = described(array);
        if count == Some(0) {
            return Ok(Stored::new(source, what, array.at, Content::Decoded(Vec::new()), None));
        }
        let stream = self.stream(source, array)?;
        let found = match self.compressor {
            None => self.plain(&stream, scalar, count).map(|content| (content, None)),
            Some(compressor) => self.packed(&stream, compressor, scalar, count).map(|(content, blocks)| (content, Some(blocks))),
        };
        let (content, blocks) = found.map_err(|message| place(source, array, &message))?;
        Stored::new(source, what, array.at, content, blocks).ready(scalar)
    }

    fn stream<'a>(&self, source: &'a Source, array: &StoredArray) -> Result<Stream<'a>> {
        match &array.place {
            Place::Ascii(parts) | Place::Inline(parts) => Ok(Stream::Base64(source, parts.clone())),
            Place::Appended(offset) => {
                let appended = self.appended.as_ref().ok_or_else(|| place(source, array, "the file has no appended data"))?;
                let start = usize::try_from(*offset).ok().and_then(|o| appended.range.start.checked_add(o));
                let start = start.filter(|&s| s < appended.range.end);
                let beyond = || format!("offset {offset} lies beyond the end of the file, which seems to be cut off; copy it again");
                let start = start.ok_or_else(|| place(source, array, &beyond()))?;
                let range = start..appended.range.end;
                Ok(if appended.base64 { Stream::Base64(source, vec![range]) } else { Stream::Raw(source, range) })
            }
        }
    }

    /// Number `i` of an array's header.
    fn header(&self, bytes: &[u8], i: usize) -> u64 {
        let word = bytes.get(i * self.word..(i + 1) * self.word).unwrap_or_default();
        let mut wide = [0; 8];
        if self.big_endian {
            wide[8 - word.len()..].copy_from_slice(word);
            u64::from_be_bytes(wide)
        } else {
            wide[..word.len()].copy_from_slice(word);
            u64::from_le_bytes(wide)
        }
    }

    fn plain(&self, stream: &Stream<'_>, scalar: Scalar, count: Option<u64>) -> Result<Content, String> {
        let size = self.header(&stream.prefix(self.word as u64)?, 0);
        check_size(size, scalar, count)?;
        let all = size.checked_add(self.word as u64).ok_or("its size overflows")?;
        stream.content(self.word, all)
    }

    /// Locates the compressed blocks of an array, and determines their sizes.
    fn packed(
        &mut self,
        stream: &Stream<'_>,
        compressor: Compressor,
        scalar: Scalar,
        count: Option<u64>,
    ) -> Result<(Content, Blocks), String> {
        let word = self.word as u64;
        let start = stream.prefix(3 * word)?;
        let [blocks, block, last] = [0, 1, 2].map(|i| self.header(&start, i));
        let mut found = Blocks { compressor, packed: Vec::new(), block: block as usize, size: 0 };
        if blocks == 0 {
            check_size(0, scalar, count)?;
            return Ok((Content::Decoded(Vec::new()), found));
        }
        if block == 0 || last > block {
            return Err(format!("{blocks} compressed blocks of {block} bytes with a last one of {last}"));
        }
        let final_block = if last == 0 { block } else { last };
        let size = (blocks - 1).checked_mul(block).and_then(|n| n.checked_add(final_block)).ok_or("its size overflows")?;
        check_size(size, scalar, count)?;
        let refused = |limit: String| format!("it would unpack to {size} bytes, {limit}; save it without compression");
        self.budget.spend(size).map_err(refused)?;
        found.size = size as usize;
        let header = blocks.checked_add(3).and_then(|n| n.checked_mul(word)).ok_or("its number of blocks overflows")?;
        let sizes = stream.prefix(header)?;
        let mut end = 0u64;
        for i in 0..blocks as usize {
            let begin = end;
            end = end.checked_add(self.header(&sizes, i + 3)).ok_or("the sizes of its blocks overflow")?;
            found.packed.push(begin as usize..end as usize);
        }
        let all = end.checked_add(header).ok_or("the sizes of its blocks overflow")?;
        Ok((stream.content(header as usize, all)?, found))
    }
}

/// Describes an array for messages.
fn described(array: &StoredArray) -> String {
    format!("array `{}`", excerpt(array.name.as_bytes()))
}

/// Makes an error about an array.
fn place(source: &Source, array: &StoredArray, message: &str) -> Error {
    source.error_at(&described(array), array.at, message)
}

fn check_size(size: u64, scalar: Scalar, count: Option<u64>) -> Result<(), String> {
    let each = scalar.size() as u64;
    if let Some(count) = count {
        let wanted = count.checked_mul(each).ok_or("its size overflows")?;
        if size != wanted {
            return Err(format!("it has {size} bytes where {count} values of {each} bytes need {wanted}"));
        }
    }
    if size.is_multiple_of(each) { Ok(()) } else { Err(format!("{size} bytes are not a whole number of values of {each} bytes")) }
}

fn ascii<T: Number>(source: &Source, array: &StoredArray, scalar: Scalar, parts: &[Range<usize>], count: Option<u64>) -> Result<Vec<T>> {
    let length: usize = parts.iter().map(|part| part.len() / 2 + 1).sum();
    if count.is_some_and(|n| n > length as u64) {
        let wanted = count.unwrap_or(0);
        return Err(place(source, array, &format!("{wanted} values are announced, but its text has room for {length} at most")));
    }
    let mut values = Vec::with_capacity(count.unwrap_or(0) as usize);
    for part in parts {
        let mut tokens = Tokens::new(source, None).within(part.clone());
        while let Some((token, at)) = tokens.next_token()? {
            let value = if scalar.is_float() {
                parse_float(token).map(T::from_f64)
            } else {
                let wide = || std::str::from_utf8(token).ok()?.parse().ok().map(T::from_u64);
                parse_integer(token).map(T::from_i64).or_else(wide)
            };
            values.push(value.ok_or_else(|| {
                let kind = if scalar.is_float() { "number" } else { "whole number" };
                source.error_line(at, format!("{}: `{}` is not a {kind}", described(array), excerpt(token)))
            })?);
        }
    }
    match count {
        Some(n) if n != values.len() as u64 => Err(place(source, array, &format!("it has {} values instead of {n}", values.len()))),
        _ => Ok(values),
    }
}

impl<'a> Stream<'a> {
    /// Converts `n` to a size, if that many bytes are left.
    fn within(&self, n: u64) -> Result<usize, String> {
        let room = match self {
            Stream::Raw(_, range) => range.len(),
            Stream::Base64(_, parts) => parts.iter().map(Range::len).sum::<usize>() / 4 * 3 + 3,
        };
        let fits = usize::try_from(n).ok().filter(|&n| n <= room);
        fits.ok_or_else(|| format!("it is longer than the {room} bytes that are left of the file"))
    }

    /// The first `n` bytes.
    fn prefix(&self, n: u64) -> Result<Cow<'a, [u8]>, String> {
        let n = self.within(n)?;
        match self {
            Stream::Raw(source, range) => source.window(range.start..range.start + n),
            Stream::Base64(source, parts) => decode_base64(windows(source, parts, n), n).map(Cow::Owned),
        }
    }

    /// The bytes that follow a header of `header` bytes, up to byte `n`.
    fn content(&self, header: usize, n: u64) -> Result<Content, String> {
        let n = self.within(n)?;
        Ok(match self {
            Stream::Raw(_, range) => Content::File(range.start + header..range.start + n),
            Stream::Base64(source, parts) => {
                let mut bytes = decode_base64(windows(source, parts, n), n)?;
                bytes.drain(..header);
                Content::Decoded(bytes)
            }
        })
    }
}

/// A part of a file, or why it cannot be read.
type Window<'a> = Result<Cow<'a, [u8]>, String>;

/// The contents of some ranges of a file, in windows that suit the decoding of `n` bytes.
fn windows<'a>(source: &'a Source, ranges: &[Range<usize>], n: usize) -> impl Iterator<Item = Window<'a>> {
    let size = (n / 3 * 4 + 1024).min(1 << 20);
    let cut = move |range: &Range<usize>| {
        let end = range.end;
        range.clone().step_by(size).map(move |begin| begin..end.min(begin + size))
    };
    ranges.iter().flat_map(cut).map(|range| source.window(range))
}

/// Decodes the first `n` bytes of a text in parts. The header and the data of an array may be encoded separately, with
/// padding between them.
fn decode_base64<'a>(mut parts: impl Iterator<Item = Window<'a>>, n: usize) -> Result<Vec<u8>, String> {
    const CONFIG: GeneralPurposeConfig =
        GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent).with_decode_allow_trailing_bits(true);
    const ENGINE: GeneralPurpose = GeneralPurpose::new(&base64::alphabet::STANDARD, CONFIG);
    let decode = |out: &mut Vec<u8>, text: &[u8]| {
        let done = out.len();
        ENGINE.decode_vec(text, out).map_err(|e| format!("bad base64 after {done} bytes: {e}"))
    };
    let mut out = Vec::with_capacity(n + 3);
    let mut group = Vec::with_capacity(4); // that white space has cut
    while let Some(part) = if out.len() < n { parts.next() } else { None } {
        for mut run in part?.split(u8::is_ascii_whitespace) {
            while !run.is_empty() && out.len() < n {
                // Padding ends a group; what follows it is encoded separately.
                let most = if group.is_empty() { (n - out.len()).div_ceil(3) * 4 } else { 4 - group.len() };
                let most = most.min(run.len());
                let padding = run[..most].iter().position(|&b| b == b'=').filter(|_| group.is_empty());
                let end = padding.map_or(most, |at| (at / 4 + 1) * 4).min(run.len());
                let whole = if group.is_empty() { end / 4 * 4 } else { 0 };
                decode(&mut out, &run[..whole])?;
                group.extend_from_slice(&run[whole..end]);
                if group.len() == 4 {
                    decode(&mut out, &group)?;
                    group.clear();
                }
                run = &run[end..];
            }
        }
    }
    decode(&mut out, &group)?;
    if out.len() < n {
        return Err(format!("its base64 data end after {} of {n} bytes", out.len()));
    }
    out.truncate(n);
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two texts that are encoded separately, cut by white space at any places and into any parts.
    #[test]
    fn white_space_and_padding_may_be_anywhere() {
        let coded = |bytes: &[u8]| base64::engine::general_purpose::STANDARD.encode(bytes);
        let data: Vec<u8> = (0..60).map(|i| (i * 37) as u8).collect();
        for first in [1, 2, 3, 8, 16] {
            let text = coded(&data[..first]) + &coded(&data[first..]);
            for width in 1..12 {
                for parts in [1, 3, 20] {
                    let lines: Vec<u8> = text.as_bytes().chunks(width).flat_map(|line| [line, b"\r\n "].concat()).collect();
                    let part = lines.len().div_ceil(parts);
                    let decode = |n| decode_base64(lines.chunks(part).map(|part| Ok(part.into())), n);
                    for n in [0, 1, first, first + 1, 59, 60] {
                        assert_eq!(decode(n).as_deref(), Ok(&data[..n]), "{first} {width} {n}");
                    }
                    assert!(decode(61).unwrap_err().starts_with("its base64 data end after 60 of 61 bytes"));
                }
            }
        }
        let parts = [&b"AAAA"[..], b"A*AA"].into_iter().map(|part| Ok(part.into()));
        assert!(decode_base64(parts, 6).unwrap_err().starts_with("bad base64 after 3 bytes"));
    }
}
