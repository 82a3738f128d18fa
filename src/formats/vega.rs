//! Reader for the volumetric meshes of Vega FEM (`.veg`): tetrahedra, or cubes. Materials and their regions are passed
//! over.

use super::LoadOptions;
use super::assemble::Assembly;
use super::cells::vtk;
use super::source::{Source, excerpt};
use super::tags::Tags;
use super::tokens::Tokens;
use crate::error::Result;

pub(crate) fn read(source: &Source, options: &LoadOptions) -> Result<Assembly> {
    let mut tokens = Tokens::new(source, Some(b'#'));
    let (mut points, mut cells) = (None, None);
    while let Some((token, at)) = tokens.next_token()? {
        match token.to_ascii_uppercase().as_slice() {
            b"*VERTICES" if points.is_none() => points = Some(vertices(source, &mut tokens)?),
            b"*ELEMENTS" if cells.is_none() => cells = Some(elements(source, &mut tokens)?),
            b"*VERTICES" | b"*ELEMENTS" => return Err(source.error_line(at, "a second section of this name")),
            b"*INCLUDE" => return Err(source.error_line(at, "files within each other are not supported; write them into one")),
            _ => {}
        }
    }
    let missing = |what: &str| source.error_line(source.len(), format!("the file ends, and there was no {what}"));
    let (points, tags): (Vec<_>, Vec<_>) = points.ok_or_else(|| missing("*VERTICES"))?;
    let (width, nodes) = cells.ok_or_else(|| missing("*ELEMENTS"))?;
    let mut assembly = Assembly::new(source, options, "Vega FEM".into());
    let numbers = Tags::new(&tags, false).map_err(|tag| source.error_in("*VERTICES", format!("two vertices have the number {tag}")))?;
    assembly.set_points(points);
    assembly.point_tags = tags;
    let Some(kind) = vtk(if width == 4 { 10 } else { 12 }) else { return Ok(assembly) };
    assembly.reserve(nodes.len() / width);
    for (i, cell) in nodes.chunks_exact(width).enumerate() {
        let find = |&node: &i64| numbers.get(node).map(i64::from).ok_or(node);
        let found: Result<Vec<i64>, i64> = cell.iter().map(find).collect();
        let found = found.map_err(|node| source.error_in(format!("cell {i}"), format!("vertex {node} does not exist")))?;
        assembly.push(kind, &found)?;
    }
    Ok(assembly)
}

/// The points, and their numbers.
fn vertices(source: &Source, tokens: &mut Tokens<'_>) -> Result<(Vec<[f64; 3]>, Vec<i64>)> {
    let n = tokens.count("the number of vertices")?;
    let at = tokens.at;
    let [dimension, attributes, marks] = [(); 3].map(|()| tokens.integer("a number of columns"));
    let (dimension, others) = (dimension?, attributes?.saturating_add(marks?));
    if dimension != 3 || !(0..=64).contains(&others) {
        return Err(
            source.error_line(at, format!("vertices of {dimension} coordinates and {others} other columns; there must be 3 coordinates"))
        );
    }
    let (mut points, mut tags) = (Vec::with_capacity(n), Vec::with_capacity(n));
    for _ in 0..n {
        tags.push(tokens.integer("the number of a vertex")?);
        points.push([tokens.float("a coordinate")?, tokens.float("a coordinate")?, tokens.float("a coordinate")?]);
        for _ in 0..others {
            tokens.float("an attribute")?;
        }
    }
    Ok((points, tags))
}

/// The vertices of each element: how many, and all of them.
fn elements(source: &Source, tokens: &mut Tokens<'_>) -> Result<(usize, Vec<i64>)> {
    let (kind, at) = tokens.word("a kind of elements")?;
    let width = match kind.to_ascii_uppercase().as_slice() {
        b"TET" | b"TETS" => 4,
        b"CUBIC" | b"CUBE" | b"CUBES" => 8,
        _ => {
            let found = excerpt(kind);
            return Err(source.error_line(at, format!("elements of the kind `{found}`; TET and CUBIC can be read")));
        }
    };
    let n = tokens.count("the number of elements")?;
    let at = tokens.at;
    let (found, others) = (tokens.integer("the number of vertices of an element")?, tokens.integer("a number of attributes")?);
    if found != width as i64 || !(0..=64).contains(&others) {
        return Err(
            source.error_line(at, format!("{found} vertices and {others} attributes of an element, which must have {width} vertices"))
        );
    }
    let mut nodes = Vec::with_capacity(n.saturating_mul(width).min(tokens.left() / 2 + 1));
    for _ in 0..n {
        tokens.integer("the number of an element")?;
        for _ in 0..width {
            nodes.push(tokens.integer("a vertex")?);
        }
        for _ in 0..others {
            tokens.float("an attribute")?;
        }
    }
    Ok((width, nodes))
}
