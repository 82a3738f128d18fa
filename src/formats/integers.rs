//! Integers of a file, converted one window at a time: converted to 64-bit words all at once they would take up to
//! eight times the memory that they take in the file.

use std::ops::Range;

use super::scalar::Scalar;
use super::stored::{Stored, WINDOW};
use crate::error::Result;

/// Integers stored in a file.
#[derive(Default)]
pub(crate) struct Integers<'a> {
    /// `None`: all numbers are in `window`.
    stored: Option<(Stored<'a>, Encoding)>,
    /// The numbers converted most recently, starting with number `first`.
    window: Vec<i64>,
    first: usize,
}

struct Encoding {
    scalar: Scalar,
    big_endian: bool,
}

impl<'a> Integers<'a> {
    /// Integers stored as bytes.
    pub fn stored(bytes: Stored<'a>, scalar: Scalar, big_endian: bool) -> Self {
        Self { stored: Some((bytes, Encoding { scalar, big_endian })), ..Self::default() }
    }

    /// Integers that were read from text.
    pub fn parsed(values: Vec<i64>) -> Self {
        Self { window: values, ..Self::default() }
    }

    pub fn len(&self) -> usize {
        self.stored.as_ref().map_or(self.window.len(), |(bytes, encoding)| bytes.len() / encoding.scalar.size())
    }

    /// Number `i`; 0 if `i` is beyond the last number.
    pub fn at(&mut self, i: usize) -> Result<i64> {
        Ok(self.slice(i..i + 1)?.first().copied().unwrap_or(0))
    }

    /// A range of consecutive numbers; empty if the range goes beyond the last number.
    pub fn slice(&mut self, range: Range<usize>) -> Result<&[i64]> {
        if range.end > self.len() || range.start > range.end {
            return Ok(&[]);
        }
        if range.start < self.first || range.end > self.first + self.window.len() {
            let end = range.end.max(range.start + WINDOW).min(self.len());
            if let Some((bytes, Encoding { scalar, big_endian })) = &self.stored {
                let bytes = bytes.read(range.start * scalar.size()..end * scalar.size())?;
                self.window.clear();
                scalar.convert_to(&mut self.window, &bytes, *big_endian);
                self.first = range.start;
            }
        }
        Ok(&self.window[range.start - self.first..range.end - self.first])
    }
}

#[cfg(test)]
mod tests {
    use super::super::source::Source;
    use super::*;

    #[test]
    fn windows_show_what_is_stored() {
        let source = Source::new("none".as_ref(), Vec::new());
        let values: Vec<i64> = (0..3 * WINDOW as i64 + 5).map(|i| i * 7 - 40_000).collect();
        let little = values.iter().flat_map(|&v| (v as i32).to_le_bytes()).collect::<Vec<u8>>();
        let big = values.iter().flat_map(|&v| v.to_be_bytes()).collect::<Vec<u8>>();
        for mut numbers in [
            Integers::stored(Stored::decoded(&source, little), Scalar::I32, false),
            Integers::stored(Stored::decoded(&source, big), Scalar::I64, true),
            Integers::parsed(values.clone()),
        ] {
            assert_eq!(numbers.len(), values.len());
            for range in [0..4, 4..9, WINDOW - 2..WINDOW + 3, 0..2, 5..3 * WINDOW, 7..7, values.len() - 1..values.len(), 0..values.len()] {
                assert_eq!(numbers.slice(range.clone()).unwrap(), &values[range]);
            }
            assert_eq!([3, WINDOW + 1, 0].map(|i| numbers.at(i).unwrap()), [3, WINDOW + 1, 0].map(|i| values[i]));
            assert!(numbers.slice(values.len()..values.len() + 1).unwrap().is_empty() && numbers.at(values.len()).unwrap() == 0);
        }
    }
}
