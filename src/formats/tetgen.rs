//! Reader for TetGen's pairs of `.node` and `.ele` files, numbered from 0, from 1, or in any way.

use super::LoadOptions;
use super::array::Array;
use super::assemble::Assembly;
use super::cells::{CellType, Shape};
use super::detect::ending;
use super::source::{Source, Tokens, parse_float, parse_integer, printable};
use super::tags::Tags;
use crate::error::Result;
use crate::mesh::On;

/// Reads the other file of the pair.
pub(crate) fn companion(source: &Source) -> Result<Source> {
    let other = if ending(&source.path) == "node" { "ele" } else { "node" };
    let upper = source.path.extension().is_some_and(|e| e.to_string_lossy().chars().all(|c| c.is_ascii_uppercase()));
    let path = source.path.with_extension(if upper { other.to_ascii_uppercase() } else { other.to_owned() });
    Source::read(&path, other).map_err(|error| {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        source.error(format!("`{name}` is needed beside it ({error})"))
    })
}

/// Reads a mesh. `main` is the file that the user named; errors about the whole mesh refer to it.
pub(crate) fn read<'a>(main: &'a Source, companion: &Source, options: &LoadOptions) -> Result<Assembly<'a>> {
    let (node, ele) = if ending(&main.path) == "node" { (main, companion) } else { (companion, main) };
    let mut assembly = Assembly::new(main, options, "TetGen .node and .ele".into());
    assembly.bytes = (node.bytes.len() + ele.bytes.len()) as u64;
    let tags = nodes(node, &mut assembly)?;
    elements(ele, &tags, &mut assembly)?;
    Ok(assembly)
}

/// The lines of a file that are neither empty nor comments.
pub(super) struct Lines<'a> {
    source: &'a Source,
    tokens: Tokens<'a>,
}

impl<'a> Lines<'a> {
    pub(super) fn new(source: &'a Source) -> Self {
        Self { source, tokens: Tokens::new(source, 0..source.bytes.len(), Some(b'#')) }
    }

    /// Puts the words of the next line into `words` and returns the position of the line.
    pub(super) fn next(&mut self, words: &mut Vec<&'a [u8]>) -> Option<usize> {
        self.tokens.skip_space();
        let (line, at) = self.tokens.line()?;
        let mut rest = Tokens::new(self.source, at..at + line.len(), Some(b'#'));
        words.clear();
        while let Some((word, _)) = rest.next_token() {
            words.push(word);
        }
        Some(at)
    }

    /// The next line, as [`Self::next`] returns it; an error at the end of the file.
    fn need(&mut self, words: &mut Vec<&'a [u8]>, what: &str) -> Result<usize> {
        let end = self.source.bytes.len();
        self.next(words).ok_or_else(|| self.source.error_line(end, format!("the file ends where {what} should be")))
    }

    /// Returns an error if anything follows.
    fn end(mut self, words: &mut Vec<&'a [u8]>, n: usize, what: &str) -> Result<()> {
        match self.next(words) {
            None => Ok(()),
            Some(at) => Err(self.source.error_line(at, format!("more than the {n} {what} that are announced"))),
        }
    }
}

/// Reads the counts in the first line: at least `need` numbers; missing further ones are 0.
fn header<const N: usize>(source: &Source, at: usize, words: &[&[u8]], need: usize, what: &str) -> Result<[usize; N]> {
    let mut counts = [0; N];
    for (i, count) in counts.iter_mut().enumerate() {
        let Some(word) = words.get(i) else {
            if i < need {
                return Err(source.error_line(at, format!("the first line must be `{what}`")));
            }
            break;
        };
        let n = parse_integer(word).and_then(|n| usize::try_from(n).ok());
        let n = n.ok_or_else(|| source.error_line(at, format!("`{}` in the first line, which must be `{what}`", printable(word))))?;
        // Everything that is counted takes at least two bytes of the file.
        let room = source.bytes.len() / 2;
        if n > room {
            return Err(source.error_line(at, format!("{n} in the first line (`{what}`), but the file has room for {room} at most")));
        }
        *count = n;
    }
    Ok(counts)
}

fn nodes(source: &Source, assembly: &mut Assembly<'_>) -> Result<Tags> {
    let mut lines = Lines::new(source);
    let mut words = Vec::new();
    let at = lines.need(&mut words, "the first line")?;
    let [n, dimension, attributes, markers] = header(source, at, &words, 2, "<points> <dimension 3> <attributes> <markers 0 or 1>")?;
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
        let at = lines.need(&mut words, "a point")?;
        if words.len() < 4 + attributes {
            let wanted = 4 + attributes;
            return Err(source.error_line(at, format!("point {i} has {} numbers instead of {wanted}", words.len())));
        }
        let wrong = |word: &[u8]| source.error_line(at, format!("`{}` where a number should be", printable(word)));
        tags.push(parse_integer(words[0]).ok_or_else(|| wrong(words[0]))?);
        let mut point = [0.0; 3];
        for (x, word) in point.iter_mut().zip(&words[1..4]) {
            *x = parse_float(word).ok_or_else(|| wrong(word))?;
        }
        points.push(point);
        for (c, column) in columns.iter_mut().enumerate() {
            let value = words.get(4 + c).map_or(Ok(0.0), |word| parse_float(word).ok_or_else(|| wrong(word)));
            column.push(value? as f32);
        }
    }
    lines.end(&mut words, n, "points")?;
    for (c, values) in columns.into_iter().enumerate() {
        let name = if c < attributes { format!("attribute{c}") } else { "boundary_marker".into() };
        assembly.arrays.push(Array { name, on: On::Points, components: 1, values });
    }
    assembly.set_points(points, &[0]);
    let numbers = Tags::new(&tags, false).map_err(|tag| source.error(format!("two points have the number {tag}")))?;
    assembly.point_tags = tags;
    Ok(numbers)
}

fn elements(source: &Source, points: &Tags, assembly: &mut Assembly<'_>) -> Result<()> {
    let mut lines = Lines::new(source);
    let mut words = Vec::new();
    let at = lines.need(&mut words, "the first line")?;
    let [n, width, attributes] = header(source, at, &words, 2, "<tetrahedra> <points per tetrahedron> <attributes>")?;
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
        let at = lines.need(&mut words, "a tetrahedron")?;
        if words.len() < 1 + width + attributes {
            let wanted = 1 + width + attributes;
            return Err(source.error_line(at, format!("tetrahedron {i} has {} numbers instead of {wanted}", words.len())));
        }
        let wrong = |word: &[u8]| source.error_line(at, format!("`{}` where a number should be", printable(word)));
        for (node, word) in nodes.iter_mut().zip(&words[1..=width]) {
            let tag = parse_integer(word).ok_or_else(|| wrong(word))?;
            let found = points.get(tag).map(i64::from);
            *node = found.ok_or_else(|| source.error_line(at, format!("cell {i}: point {tag} does not exist")))?;
        }
        assembly.push(kind, &nodes)?;
        for (c, column) in columns.iter_mut().enumerate() {
            let word = words[1 + width + c];
            column.push(parse_float(word).ok_or_else(|| wrong(word))? as f32);
        }
    }
    lines.end(&mut words, n, "tetrahedra")?;
    for (c, values) in columns.into_iter().enumerate() {
        let name = if c == 0 { "region".into() } else { format!("region{c}") };
        assembly.arrays.push(Array { name, on: On::Cells, components: 1, values });
    }
    Ok(())
}
