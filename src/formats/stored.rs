//! Bytes of an array, plain or compressed, accessed one window at a time, so that no array is in memory twice.

use std::borrow::Cow;
use std::ops::Range;

use rayon::prelude::*;

use super::scalar::{Number, Scalar};
use super::source::Source;
use super::unpack::Compressor;
use crate::error::Result;

/// Numbers per window of conversion.
pub(crate) const WINDOW: usize = 1 << 18;

/// An array of a file.
pub(crate) struct Stored<'a> {
    source: &'a Source,
    /// Description of the array for messages, and the position in the file that they name.
    what: String,
    at: usize,
    content: Content,
    blocks: Option<Blocks>,
}

/// Where the stored bytes of an array are.
pub(crate) enum Content {
    /// In this range of the file.
    File(Range<usize>),
    /// In memory, because they were decoded from text.
    Decoded(Vec<u8>),
}

/// Blocks that were compressed independently.
pub(crate) struct Blocks {
    pub compressor: Compressor,
    /// Range of each block within the content.
    pub packed: Vec<Range<usize>>,
    /// Unpacked size of each block in bytes, except the last.
    pub block: usize,
    /// Unpacked size of all blocks together in bytes.
    pub size: usize,
}

impl<'a> Stored<'a> {
    pub fn new(source: &'a Source, what: String, at: usize, content: Content, blocks: Option<Blocks>) -> Self {
        Self { source, what, at, content, blocks }
    }

    /// The array with all its blocks unpacked, if they are larger than a window, so that none is unpacked for every
    /// window.
    pub fn ready(mut self, scalar: Scalar) -> Result<Self> {
        if self.blocks.as_ref().is_some_and(|blocks| blocks.block > WINDOW * scalar.size()) {
            self.content = Content::Decoded(self.read(0..self.len())?.into_owned());
            self.blocks = None;
        }
        Ok(self)
    }

    /// Size of the array in bytes, unpacked.
    pub fn len(&self) -> usize {
        self.blocks.as_ref().map_or_else(|| self.content.len(), |blocks| blocks.size)
    }

    /// The unpacked bytes in a range, which must lie within the array.
    pub fn read(&self, range: Range<usize>) -> Result<Cow<'_, [u8]>> {
        let bytes = match &self.blocks {
            None => self.content.read(self.source, range),
            Some(blocks) => blocks.read(range, |packed| self.content.read(self.source, packed)).map(Cow::Owned),
        };
        bytes.map_err(|message| self.source.error_at(&self.what, self.at, message))
    }

    /// Converts the whole array to numbers.
    pub fn convert<T: Number>(&self, scalar: Scalar, big_endian: bool) -> Result<Vec<T>> {
        let mut values = Vec::with_capacity(self.len() / scalar.size());
        let window = WINDOW * scalar.size();
        for begin in (0..self.len()).step_by(window) {
            scalar.convert_to(&mut values, &self.read(begin..self.len().min(begin + window))?, big_endian);
        }
        Ok(values)
    }
}

impl Content {
    fn len(&self) -> usize {
        match self {
            Content::File(range) => range.len(),
            Content::Decoded(bytes) => bytes.len(),
        }
    }

    fn read<'c>(&'c self, source: &'c Source, range: Range<usize>) -> Result<Cow<'c, [u8]>, String> {
        match self {
            Content::File(all) => source.window(all.start + range.start..all.start + range.end),
            Content::Decoded(bytes) => Ok(Cow::Borrowed(&bytes[range])),
        }
    }
}

impl Blocks {
    /// Unpacks the blocks that intersect a range, in parallel, and returns the bytes of the range.
    fn read<'c>(&self, range: Range<usize>, content: impl Fn(Range<usize>) -> Result<Cow<'c, [u8]>, String>) -> Result<Vec<u8>, String> {
        if range.is_empty() {
            return Ok(Vec::new());
        }
        let (first, last) = (range.start / self.block, (range.end - 1) / self.block);
        let (begin, end) = (first * self.block, self.size.min((last + 1) * self.block));
        let start = self.packed[first].start;
        let packed = content(start..self.packed[last].end)?;
        let mut bytes = vec![0; end - begin];
        let parts: Vec<_> = bytes.chunks_mut(self.block).zip(&self.packed[first..]).enumerate().collect();
        parts.into_par_iter().try_for_each(|(i, (out, range))| {
            let result = self.compressor.unpack(&packed[range.start - start..range.end - start], out);
            result.map_err(|why| format!("block {} of {} ({}): {why}", first + i, self.packed.len(), self.compressor.name()))
        })?;
        bytes.truncate(range.end - begin);
        bytes.drain(..range.start - begin);
        Ok(bytes)
    }
}

#[cfg(test)]
impl Stored<'_> {
    /// An array of bytes in memory, without a file.
    pub fn decoded(source: &Source, bytes: Vec<u8>) -> Stored<'_> {
        Stored::new(source, String::new(), 0, Content::Decoded(bytes), None)
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write as _;

    use super::*;

    #[test]
    fn only_blocks_larger_than_a_window_are_unpacked_in_advance() {
        let source = Source::new("none".as_ref(), Vec::new());
        let bytes: Vec<u8> = (0..3 * WINDOW).map(|i| (i % 251) as u8).collect();
        for block in [bytes.len(), WINDOW] {
            let (mut content, mut packed) = (Vec::new(), Vec::new());
            for part in bytes.chunks(block) {
                let start = content.len();
                let mut encoder = flate2::write::ZlibEncoder::new(&mut content, flate2::Compression::fast());
                encoder.write_all(part).unwrap();
                encoder.finish().unwrap();
                packed.push(start..content.len());
            }
            let blocks = Blocks { compressor: Compressor::Zlib, packed, block, size: bytes.len() };
            let stored = Stored::new(&source, String::new(), 0, Content::Decoded(content), Some(blocks)).ready(Scalar::U8).unwrap();
            assert_eq!(stored.blocks.is_some(), block == WINDOW);
            assert_eq!(stored.read(0..stored.len()).unwrap(), bytes);
        }
    }
}
