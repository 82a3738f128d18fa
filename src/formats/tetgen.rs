//! Reader for TetGen's pairs of `.node` and `.ele` files, numbered from 0, from 1, or in any way.

use std::ops::Range;

use super::LoadOptions;
use super::array::Array;
use super::assemble::Assembly;
use super::cells::{CellType, Shape};
use super::source::ending;
use super::source::{Source, excerpt};
use super::tags::Tags;
use super::tokens::{Tokens, parse_float, parse_integer, words};
use crate::error::Result;
use crate::mesh::On;

/// Reads the other file of the pair.
pub(crate) fn companion(source: &Source) -> Result<Source> {
    let other = if ending(&source.path) == "node" { "ele" } else { "node" };
    let upper = source.path.extension().is_some_and(|e| e.to_string_lossy().chars().all(|c| c.is_ascii_uppercase()));
    let path = source.path.with_extension(if upper { other.to_ascii_uppercase() } else { other.to_owned() });
    Source::open(&path, other).map_err(|error| {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        source.error(format!("`{name}` is needed beside it ({error})"))
    })
}

/// Reads a mesh. `main` is the file that the user named; errors about the whole mesh refer to it.
pub(crate) fn read(main: &Source, companion: &Source, options: &LoadOptions) -> Result<Assembly> {
    let (node, ele) = if ending(&main.path) == "node" { (main, companion) } else { (companion, main) };
    let mut assembly = Assembly::new(main, options, "TetGen .node and .ele".into());
    assembly.bytes = (node.len() + ele.len()) as u64;
    let tags = nodes(node, &mut assembly)?;
    elements(ele, &tags, &mut assembly)?;
    Ok(assembly)
}

/// The lines of a file that are neither empty nor comments.
pub(super) struct Lines<'a> {
    source: &'a Source,
    tokens: Tokens<'a>,
    words: Vec<Range<usize>>,
}

/// A line, and where its words are.
pub(super) struct Line<'l> {
    /// Position in the file.
    pub at: usize,
    text: &'l [u8],
    words: &'l [Range<usize>],
}

impl<'l> Line<'l> {
    /// Number of words.
    pub(super) fn len(&self) -> usize {
        self.words.len()
    }

    /// Word number `i`; empty if there are not that many.
    pub(super) fn word(&self, i: usize) -> &'l [u8] {
        self.words.get(i).map_or(&[], |word| &self.text[word.clone()])
    }
}

impl<'a> Lines<'a> {
    pub(super) fn new(source: &'a Source) -> Self {
        Self { source, tokens: Tokens::new(source, Some(b'#')), words: Vec::new() }
    }

    /// The next line.
    pub(super) fn next(&mut self) -> Result<Option<Line<'_>>> {
        self.tokens.skip_space()?;
        self.words.clear();
        let Some((text, at)) = self.tokens.line()? else { return Ok(None) };
        self.words.extend(words(text, Some(b'#')));
        Ok(Some(Line { at, text, words: &self.words }))
    }

    /// The next line; an error at the end of the file.
    fn need(&mut self, what: &str) -> Result<Line<'_>> {
        let source = self.source;
        self.next()?.ok_or_else(|| source.error_line(source.len(), format!("the file ends where {what} should be")))
    }

    /// Returns an error if anything follows.
    fn end(mut self, n: usize, what: &str) -> Result<()> {
        let source = self.source;
        match self.next()? {
            None => Ok(()),
            Some(line) => Err(source.error_line(line.at, format!("more than the {n} {what} that are announced"))),
        }
    }
}

/// Reads the counts in the first line: at least `need` numbers; missing further ones are 0.
fn header<const N: usize>(source: &Source, line: &Line<'_>, need: usize, what: &str) -> Result<[usize; N]> {
    let mut counts = [0; N];
    for (i, count) in counts.iter_mut().enumerate() {
        let word = line.word(i);
        if word.is_empty() {
            if i < need {
                return Err(source.error_line(line.at, format!("the first line must be `{what}`")));
            }
            break;
        }
        let n = parse_integer(word).and_then(|n| usize::try_from(n).ok());
        let n = n.ok_or_else(|| source.error_line(line.at, format!("`{}` in the first line, which must be `{what}`", excerpt(word))))?;
        // Everything that is counted takes at least two bytes of the file.
        let room = source.len() / 2;
        if n > room {
            return Err(source.error_line(line.at, format!("{n} in the first line (`{what}`), but the file has room for {room} at most")));
        }
        *count = n;
    }
    Ok(counts)
}

fn nodes(source: &Source, assembly: &mut Assembly) -> Result<Tags> {
    let mut lines = Lines::new(source);
    let line = lines.need("the first line")?;
    let at = line.at;
    let [n, dimension, attributes, markers] = header(source, &line, 2, "<points> <dimension 3> <attributes> <markers 0 or 1>")?;
    if dimension != 3 {
        return Err(source.error_line(at, format!("dimension {dimension} instead of 3: is this a .node file of TetGen?")));
    }
    if markers > 1 {
        return Err(source.error_line(at, format!("{markers} boundary markers instead of 0 or 1")));
    }
    let mut tags = Vec::with_capacity(n);
    let mut columns = vec![Vec::new(); attributes + markers];
    let mut points = Vec::with_capacity(n);
    for i in 0..n {
        let line = lines.need("a point")?;
        let at = line.at;
        if line.len() < 4 + attributes {
            let wanted = 4 + attributes;
            return Err(source.error_line(at, format!("point {i} has {} numbers instead of {wanted}", line.len())));
        }
        let wrong = |word: &[u8]| source.error_line(at, format!("`{}` where a number should be", excerpt(word)));
        tags.push(parse_integer(line.word(0)).ok_or_else(|| wrong(line.word(0)))?);
        let mut point = [0.0; 3];
        for (x, word) in point.iter_mut().zip((1..4).map(|i| line.word(i))) {
            *x = parse_float(word).ok_or_else(|| wrong(word))?;
        }
        points.push(point);
        for (c, column) in columns.iter_mut().enumerate() {
            let word = line.word(4 + c); // empty: a marker that is missing
            let value = if word.is_empty() { Ok(0.0) } else { parse_float(word).ok_or_else(|| wrong(word)) };
            column.push(value?);
        }
    }
    lines.end(n, "points")?;
    for (c, values) in columns.into_iter().enumerate() {
        assembly.arrays.push(if c < attributes {
            Array::rounded(format!("attribute{c}"), On::Points, 1, &values)
        } else {
            Array::whole("boundary_marker".into(), On::Points, &values)
        });
    }
    assembly.set_points(points);
    let numbers = Tags::new(&tags, false).map_err(|tag| source.error(format!("two points have the number {tag}")))?;
    assembly.point_tags = tags;
    Ok(numbers)
}

fn elements(source: &Source, points: &Tags, assembly: &mut Assembly) -> Result<()> {
    let mut lines = Lines::new(source);
    let line = lines.need("the first line")?;
    let at = line.at;
    let [n, width, attributes] = header(source, &line, 2, "<tetrahedra> <points per tetrahedron> <attributes>")?;
    let name = match width {
        4 => "tetrahedron",
        10 => "quadratic tetrahedron",
        _ => {
            return Err(source.error_line(at, format!("{width} points per tetrahedron instead of 4 or 10: is this a .ele file of TetGen?")));
        }
    };
    let kind = CellType { name, shape: Shape::Tetrahedron, nodes: Some(width) };
    let mut columns = vec![Vec::new(); attributes];
    let mut nodes = vec![0; width];
    assembly.reserve(n);
    for i in 0..n {
        let line = lines.need("a tetrahedron")?;
        let at = line.at;
        if line.len() < 1 + width + attributes {
            let wanted = 1 + width + attributes;
            return Err(source.error_line(at, format!("tetrahedron {i} has {} numbers instead of {wanted}", line.len())));
        }
        let wrong = |word: &[u8]| source.error_line(at, format!("`{}` where a number should be", excerpt(word)));
        for (node, word) in nodes.iter_mut().zip((1..=width).map(|i| line.word(i))) {
            let tag = parse_integer(word).ok_or_else(|| wrong(word))?;
            let found = points.get(tag).map(i64::from);
            *node = found.ok_or_else(|| source.error_line(at, format!("cell {i}: point {tag} does not exist")))?;
        }
        assembly.push(kind, &nodes)?;
        for (c, column) in columns.iter_mut().enumerate() {
            let word = line.word(1 + width + c);
            column.push(parse_float(word).ok_or_else(|| wrong(word))?);
        }
    }
    lines.end(n, "tetrahedra")?;
    for (c, values) in columns.into_iter().enumerate() {
        let name = if c == 0 { "region".into() } else { format!("region{c}") };
        assembly.arrays.push(Array::rounded(name, On::Cells, 1, &values));
    }
    Ok(())
}
