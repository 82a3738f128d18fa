//! Reader for the `.tet` files of Isaac Gym: a line `v x y z` for each point, and a line `t a b c d`, with points
//! numbered from 0, for each tetrahedron.

use super::LoadOptions;
use super::assemble::Assembly;
use super::cells::{CellType, Shape};
use super::source::{Source, parse_float, parse_integer, printable};
use super::tetgen::Lines;
use crate::error::Result;

const TETRAHEDRON: CellType = CellType { name: "tetrahedron", shape: Shape::Tetrahedron, nodes: Some(4) };

/// Whether a file that starts with a point has tetrahedra, unlike a surface in the format of Wavefront.
pub(crate) fn has_tetrahedra(bytes: &[u8]) -> bool {
    let is_tetrahedron = |line: &[u8]| matches!(line.trim_ascii_start(), [b't', after, ..] if after.is_ascii_whitespace());
    bytes.split(|&b| b == b'\n' || b == b'\r').any(is_tetrahedron)
}

pub(crate) fn read<'a>(source: &'a Source, options: &LoadOptions) -> Result<Assembly<'a>> {
    let mut assembly = Assembly::new(source, options, "Isaac Gym .tet".into());
    let (mut lines, mut words) = (Lines::new(source), Vec::new());
    let (mut points, mut tets) = (Vec::new(), Vec::<[i64; 4]>::new());
    let mut skipped: Vec<String> = Vec::new();
    while let Some(at) = lines.next(&mut words) {
        match words[0] {
            b"v" => points.push(numbers(source, at, &words, parse_float)?),
            b"t" => tets.push(numbers(source, at, &words, parse_integer)?),
            other => {
                let shown = printable(other);
                if skipped.len() < 12 && !skipped.contains(&shown) {
                    skipped.push(shown);
                }
            }
        }
    }
    if !skipped.is_empty() {
        assembly.warnings.push(format!("lines that are not read, as they start with neither v nor t: {}", skipped.join(", ")));
    }
    assembly.set_points(points, &[0]);
    assembly.reserve(tets.len());
    tets.iter().try_for_each(|tet| assembly.push(TETRAHEDRON, tet))?;
    Ok(assembly)
}

/// The numbers that follow the first word of a line, which must be `N`.
fn numbers<T: Copy + Default, const N: usize>(
    source: &Source,
    at: usize,
    words: &[&[u8]],
    parse: fn(&[u8]) -> Option<T>,
) -> Result<[T; N]> {
    if words.len() != N + 1 {
        let (word, found) = (printable(words[0]), words.len() - 1);
        return Err(source.error_line(at, format!("{found} numbers after `{word}` instead of {N}")));
    }
    let mut numbers = [T::default(); N];
    for (number, word) in numbers.iter_mut().zip(&words[1..]) {
        *number = parse(word).ok_or_else(|| source.error_line(at, format!("`{}` where a number should be", printable(word))))?;
    }
    Ok(numbers)
}
