//! Reader for the `.tet` files of Isaac Gym: a line `v x y z` for each point, and a line `t a b c d`, with points
//! numbered from 0, for each tetrahedron.

use super::LoadOptions;
use super::assemble::Assembly;
use super::cells::{CellType, Shape};
use super::source::{Source, excerpt};
use super::tetgen::{Line, Lines};
use super::tokens::{Tokens, parse_float, parse_integer};
use crate::error::Result;

const TETRAHEDRON: CellType = CellType { name: "tetrahedron", shape: Shape::Tetrahedron, nodes: Some(4) };

/// Whether a file that starts with a point has tetrahedra, unlike a surface in the format of Wavefront.
pub(crate) fn has_tetrahedra(source: &Source) -> Result<bool> {
    let mut lines = Tokens::new(source, None);
    while let Some((line, _)) = lines.line()? {
        if matches!(line.trim_ascii_start(), [b't', after, ..] if after.is_ascii_whitespace()) {
            return Ok(true);
        }
    }
    Ok(false)
}

pub(crate) fn read(source: &Source, options: &LoadOptions) -> Result<Assembly> {
    let mut assembly = Assembly::new(source, options, "Isaac Gym .tet".into());
    let mut lines = Lines::new(source);
    let (mut points, mut tets) = (Vec::new(), Vec::<[i64; 4]>::new());
    let mut skipped: Vec<String> = Vec::new();
    while let Some(line) = lines.next()? {
        match line.word(0) {
            b"v" => points.push(numbers(source, &line, parse_float)?),
            b"t" => tets.push(numbers(source, &line, parse_integer)?),
            other => {
                let shown = excerpt(other);
                if skipped.len() < 12 && !skipped.contains(&shown) {
                    skipped.push(shown);
                }
            }
        }
    }
    if !skipped.is_empty() {
        assembly.warnings.push(format!("lines that are not read, as they start with neither v nor t: {}", skipped.join(", ")));
    }
    assembly.set_points(points);
    assembly.reserve(tets.len());
    tets.iter().try_for_each(|tet| assembly.push(TETRAHEDRON, tet))?;
    Ok(assembly)
}

/// The numbers that follow the first word of a line, which must be `N`.
fn numbers<T: Copy + Default, const N: usize>(source: &Source, line: &Line<'_>, parse: fn(&[u8]) -> Option<T>) -> Result<[T; N]> {
    if line.len() != N + 1 {
        let (word, found) = (excerpt(line.word(0)), line.len() - 1);
        return Err(source.error_line(line.at, format!("{found} numbers after `{word}` instead of {N}")));
    }
    let mut numbers = [T::default(); N];
    for (number, word) in numbers.iter_mut().zip((1..=N).map(|i| line.word(i))) {
        *number = parse(word).ok_or_else(|| source.error_line(line.at, format!("`{}` where a number should be", excerpt(word))))?;
    }
    Ok(numbers)
}
