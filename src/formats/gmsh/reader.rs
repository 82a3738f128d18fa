//! Reader for the numbers in all sections of Gmsh files: as text or binary, in the version and byte order that the
//! first section states.

use super::super::scalar::{Number, Scalar};
use super::super::source::{Source, excerpt};
use super::super::tokens::Tokens;
use crate::error::{Error, Result};

/// A version of the format.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Version {
    V2,
    V40,
    V41,
}

/// Reads numbers as text or binary.
pub(crate) struct Reader<'a> {
    pub source: &'a Source,
    pub tokens: Tokens<'a>,
    pub binary: bool,
    big_endian: bool,
}

impl<'a> Reader<'a> {
    pub fn new(source: &'a Source) -> Self {
        Self { source, tokens: Tokens::new(source, None), binary: false, big_endian: false }
    }

    /// Skips a section that was read before, with `n` nodes or elements: with each view that is appended to a file, Gmsh
    /// writes the mesh again.
    pub fn repeated(&mut self, version: Version, name: &[u8], at: usize, n: usize) -> Result<()> {
        if version != Version::V2 {
            if self.binary {
                self.tokens.line()?;
            }
            self.long("the number of blocks")?;
        }
        let again = if version == Version::V2 {
            self.tokens.integer("a number of nodes or elements")
        } else {
            self.long("a number of nodes or elements")
        }?;
        if usize::try_from(again) != Ok(n) {
            let remedy = "the file has several meshes; save views without theirs (PostProcessing.SaveMesh=0)";
            return Err(self
                .source
                .error_line(at, format!("a second section ${}, with {again} entries instead of {n}: {remedy}", excerpt(name))));
        }
        self.skip(name, at)
    }

    /// Reads the section that states the format.
    pub fn format(&mut self) -> Result<Version> {
        let (number, at) = self.tokens.word("the version")?;
        let version = match number {
            b"2" | b"2.0" | b"2.1" | b"2.2" => Version::V2,
            b"4" | b"4.0" => Version::V40,
            b"4.1" => Version::V41,
            other => return Err(old(self.source, at, &excerpt(other))),
        };
        self.binary = match self.tokens.integer("the file type (0 or 1)")? {
            0 => false,
            1 => true,
            other => return Err(self.source.error_line(at, format!("file type {other}, neither 0 (text) nor 1 (binary)"))),
        };
        let size = self.tokens.integer("the data size")?;
        if self.binary {
            if size != 8 {
                return Err(self.source.error_line(at, format!("binary data of size {size}; 8 is the only one that can be read")));
            }
            self.tokens.line()?;
            let at = self.tokens.at;
            self.big_endian = match self.tokens.bytes(4)?.unwrap_or_default() {
                [1, 0, 0, 0] => false,
                [0, 0, 0, 1] => true,
                other => {
                    return Err(self.source.error_byte(at, format!("{other:?} where the integer 1 should tell the byte order")));
                }
            };
        }
        self.end(b"$EndMeshFormat")?;
        Ok(version)
    }

    /// Reads the end of a section.
    pub fn end(&mut self, name: &[u8]) -> Result<()> {
        let (token, at) = self.tokens.word(&excerpt(name))?;
        if token == name {
            return Ok(());
        }
        let message = format!("`{}` where {} should be", excerpt(token), excerpt(name));
        Err(if self.binary { self.source.error_byte(at, message) } else { self.source.error_line(at, message) })
    }

    /// Skips a section by searching for its end.
    pub fn skip(&mut self, name: &[u8], at: usize) -> Result<()> {
        let end = [b"$End", name].concat();
        if !self.tokens.skip_past(&end)? {
            return Err(self.source.error_line(at, format!("section ${0} without $End{0}", excerpt(name))));
        }
        Ok(())
    }

    /// Reads `n` bytes of binary data.
    fn bytes(&mut self, n: usize, what: &str) -> Result<&[u8]> {
        let (source, at) = (self.source, self.tokens.at);
        self.tokens.bytes(n)?.ok_or_else(|| source.error_byte(at, format!("the file ends where {what} should be")))
    }

    fn number<T: Number + Default>(&mut self, scalar: Scalar, what: &str) -> Result<T> {
        let big = self.big_endian;
        Ok(scalar.one(self.bytes(scalar.size(), what)?, big).unwrap_or_default())
    }

    /// Reads a block of binary numbers: `rows` rows of `width`, a part of them at a time.
    pub fn rows<T: Number>(&mut self, scalar: Scalar, [rows, width]: [usize; 2], what: &str, mut take: impl FnMut(&[T])) -> Result<()> {
        const PART: usize = 4096;
        let (at, each, big) = (self.tokens.at, scalar.size().saturating_mul(width).max(1), self.big_endian);
        let room = self.tokens.left() / each;
        if rows > room {
            let message = format!("a block of {rows} {what}, but the rest of the file has room for {room}");
            return Err(self.source.error_byte(at, message));
        }
        for part in (0..rows).step_by(PART) {
            let bytes = self.bytes(each * PART.min(rows - part), what)?;
            scalar.convert(bytes, big).chunks_exact(width.max(1)).for_each(&mut take);
        }
        Ok(())
    }

    /// Reads an integer, of 4 bytes in binary files.
    pub fn int(&mut self, what: &str) -> Result<i64> {
        if self.binary { self.number(Scalar::I32, what) } else { self.tokens.integer(what) }
    }

    /// Reads a count or a tag: an unsigned integer, of 8 bytes in binary files.
    pub fn long(&mut self, what: &str) -> Result<i64> {
        if self.binary { self.number(Scalar::U64, what) } else { self.tokens.integer(what) }
    }

    /// Reads a floating-point number, of 8 bytes in binary files.
    pub fn real(&mut self, what: &str) -> Result<f64> {
        if self.binary { self.number(Scalar::F64, what) } else { self.tokens.float(what) }
    }

    /// Checks the count `n` of things that follow, which take at least `each` bytes in binary files and two in text
    /// files.
    pub fn bounded(&self, n: i64, each: usize, what: &str) -> Result<usize> {
        let room = self.tokens.left() / if self.binary { each.max(1) } else { 2 } + 1;
        usize::try_from(n).ok().filter(|&n| n <= room).ok_or_else(|| {
            let message = format!("{n} {what} are announced, but the rest of the file has room for {room} at most");
            if self.binary { self.source.error_byte(self.tokens.at, message) } else { self.source.error_line(self.tokens.at, message) }
        })
    }

    pub fn point(&mut self) -> Result<[f64; 3]> {
        Ok([self.real("a coordinate")?, self.real("a coordinate")?, self.real("a coordinate")?])
    }
}

/// The error for a version that cannot be read.
pub(crate) fn old(source: &Source, at: usize, version: &str) -> Error {
    source.error_line(
        at,
        format!("Gmsh format {version}; 2.2, 4.0 and 4.1 can be read: convert it with `gmsh IN -save -format msh41 -o OUT.msh`"),
    )
}
