//! Reader for binary Medit meshes (`.meshb`), versions 1 to 4, either byte order.

use super::super::LoadOptions;
use super::super::assemble::Assembly;
use super::super::scalar::{Number, Scalar};
use super::super::source::Source;
use super::super::tokens::Tokens;
use super::{Content, SECTIONS};
use crate::error::Result;

const DIMENSION: i64 = 3;
const VERTICES: i64 = 4;
const END: i64 = 54;

struct Reader<'a> {
    source: &'a Source,
    tokens: Tokens<'a>,
    big_endian: bool,
    version: i64,
}

pub(crate) fn read(source: &Source, options: &LoadOptions) -> Result<Assembly> {
    let mut tokens = Tokens::new(source, None);
    let big_endian = tokens.bytes(4)?.is_some_and(|code| code[0] == 0);
    let mut reader = Reader { source, tokens, big_endian, version: 1 };
    reader.version = reader.number(Scalar::I32)?;
    if !(1..=4).contains(&reader.version) {
        return Err(source.error_byte(4, format!("version {}; 1 to 4 can be read", reader.version)));
    }
    let mut content = Content::default();
    loop {
        let start = reader.tokens.at;
        let keyword: i64 = reader.number(Scalar::I32)?;
        let next: i64 = reader.number(reader.position())?;
        if keyword == END {
            break;
        }
        let past = usize::try_from(next).ok().filter(|&n| n > start && n <= source.len());
        let past = past.ok_or_else(|| source.error_byte(start, format!("section {keyword} is said to end at byte {next}")))?;
        if keyword == DIMENSION {
            let n: i64 = reader.number(Scalar::I32)?;
            if n != 3 {
                return Err(source.error_byte(start, format!("a mesh of dimension {n}, not 3")));
            }
        } else if keyword == VERTICES {
            if content.points.is_some() {
                return Err(source.error_byte(start, "a second section Vertices"));
            }
            let (float, int) = (if reader.version == 1 { Scalar::F32 } else { Scalar::F64 }, reader.int());
            let n = reader.count(3 * float.size() + int.size())?;
            let mut points = Vec::with_capacity(n);
            for _ in 0..n {
                points.push([reader.number(float)?, reader.number(float)?, reader.number(float)?]);
                content.point_marks.push(reader.number(int)?);
            }
            content.points = Some(points);
        } else if let Some((_, _, kind)) = SECTIONS.iter().find(|s| s.1 == keyword) {
            let (width, int) = (kind.nodes.unwrap_or(0), reader.int());
            let n = reader.count((width + 1) * int.size())?;
            let mut nodes = Vec::with_capacity(n * width);
            for _ in 0..n {
                for _ in 0..width {
                    nodes.push(reader.number(int)?);
                }
                content.cell_marks.push(reader.number(int)?);
            }
            content.cells.push((*kind, nodes));
        } else {
            content.skipped.push(format!("number {keyword}"));
        }
        if reader.tokens.at > past {
            return Err(source.error_byte(start, format!("section {keyword} is longer than the {} bytes it is said to have", past - start)));
        }
        reader.tokens.at = past;
    }
    let mut assembly = Assembly::new(source, options, format!("Medit binary, version {}", reader.version));
    content.assemble(source, &mut assembly)?;
    Ok(assembly)
}

impl Reader<'_> {
    fn position(&self) -> Scalar {
        if self.version < 3 { Scalar::I32 } else { Scalar::I64 }
    }

    fn int(&self) -> Scalar {
        if self.version < 4 { Scalar::I32 } else { Scalar::I64 }
    }

    fn number<T: Number>(&mut self, scalar: Scalar) -> Result<T> {
        let at = self.tokens.at;
        let value = self.tokens.bytes(scalar.size())?.and_then(|bytes| scalar.one(bytes, self.big_endian));
        value.ok_or_else(|| self.source.error_byte(at, "the file ends here, without a section End"))
    }

    /// Reads a count of things that take `each` bytes in the rest of the file.
    fn count(&mut self, each: usize) -> Result<usize> {
        let at = self.tokens.at;
        let n: i64 = self.number(self.int())?;
        let room = self.tokens.left() / each;
        let fits = usize::try_from(n).ok().filter(|&n| n <= room);
        fits.ok_or_else(|| self.source.error_byte(at, format!("a count of {n}, but the rest of the file has room for {room} at most")))
    }
}
