//! Reader for Medit meshes in text form (`.mesh`). `binary` reads the binary form.

pub(super) mod binary;

use super::LoadOptions;
use super::array::Array;
use super::assemble::Assembly;
use super::cells::{CellType, Shape};
use super::source::{Source, excerpt};
use super::tokens::Tokens;
use crate::error::Result;
use crate::mesh::On;

/// Sections of cells: keyword, number of the keyword in the binary form, and cell type.
#[rustfmt::skip]
pub(crate) const SECTIONS: [(&str, i64, CellType); 22] = [
    ("Edges", 5, cell("line", Shape::Flat, 2)),
    ("Triangles", 6, cell("triangle", Shape::Flat, 3)),
    ("Quadrilaterals", 7, cell("quad", Shape::Flat, 4)),
    ("Tetrahedra", 8, cell("tetrahedron", Shape::Tetrahedron, 4)),
    ("Prisms", 9, cell("wedge", Shape::Wedge, 6)),
    ("Pentahedra", 9, cell("wedge", Shape::Wedge, 6)),
    ("Wedges", 9, cell("wedge", Shape::Wedge, 6)),
    ("Hexahedra", 10, cell("hexahedron", Shape::Hexahedron, 8)),
    ("Hexaedra", 10, cell("hexahedron", Shape::Hexahedron, 8)),
    ("Pyramids", 49, cell("pyramid", Shape::Pyramid, 5)),
    ("EdgesP2", 25, cell("quadratic line", Shape::Flat, 3)),
    ("TrianglesP2", 24, cell("quadratic triangle", Shape::Flat, 6)),
    ("QuadrilateralsQ2", 27, cell("quadratic quad", Shape::Flat, 9)),
    ("TetrahedraP2", 30, cell("quadratic tetrahedron", Shape::Tetrahedron, 10)),
    ("HexahedraQ2", 33, cell("quadratic hexahedron", Shape::Hexahedron, 27)),
    ("PrismsP2", 86, cell("quadratic wedge", Shape::Wedge, 18)),
    ("PyramidsP2", 87, cell("quadratic pyramid", Shape::Pyramid, 14)),
    ("QuadrilateralsQ3", 88, cell("cubic quad", Shape::Flat, 16)),
    ("EdgesP3", 92, cell("cubic line", Shape::Flat, 4)),
    ("TrianglesP3", 90, cell("cubic triangle", Shape::Flat, 10)),
    ("TetrahedraP3", 96, cell("cubic tetrahedron", Shape::Tetrahedron, 20)),
    ("HexahedraQ3", 98, cell("cubic hexahedron", Shape::Hexahedron, 64)),
];

const fn cell(name: &'static str, shape: Shape, nodes: usize) -> CellType {
    CellType { name, shape, nodes: Some(nodes) }
}

/// Sections as stored in the file; cells may come before the points.
#[derive(Default)]
pub(crate) struct Content {
    pub points: Option<Vec<[f64; 3]>>,
    pub point_marks: Vec<f64>,
    pub cells: Vec<(CellType, Vec<i64>)>,
    pub cell_marks: Vec<f64>,
    pub skipped: Vec<String>,
}

impl Content {
    /// Builds the mesh; points are numbered from 1.
    pub fn assemble(self, source: &Source, assembly: &mut Assembly) -> Result<()> {
        let missing = || source.error_line(source.len(), "the file ends, and there was no section Vertices");
        assembly.set_points(self.points.ok_or_else(missing)?);
        assembly.first_point = 1;
        for (kind, mut nodes) in self.cells {
            for node in &mut nodes {
                *node = node.saturating_sub(1);
            }
            let width = kind.nodes.unwrap_or(1).max(1);
            assembly.reserve(nodes.len() / width);
            for cell in nodes.chunks_exact(width) {
                assembly.push(kind, cell)?;
            }
        }
        for (name, on, values) in [("medit:ref", On::Points, self.point_marks), ("medit:ref (cells)", On::Cells, self.cell_marks)] {
            if values.iter().any(|v| *v != 0.0) {
                assembly.arrays.push(Array::whole(name.into(), on, &values));
            }
        }
        if !self.skipped.is_empty() {
            let mut names = self.skipped;
            names.dedup();
            names.truncate(12);
            assembly.warnings.push(format!("sections that are not read: {}", names.join(", ")));
        }
        Ok(())
    }
}

pub(crate) fn read(source: &Source, options: &LoadOptions) -> Result<Assembly> {
    let mut tokens = Tokens::new(source, Some(b'#'));
    let mut content = Content::default();
    let mut version = None;
    let mut dimension = None;
    while let Some((token, at)) = tokens.next_token()? {
        let token = token.to_vec();
        let is = |name: &str| token.eq_ignore_ascii_case(name.as_bytes());
        if is("MeshVersionFormatted") {
            version = Some(tokens.integer("the version")?);
        } else if is("Dimension") {
            let n = tokens.integer("the dimension")?;
            if n != 3 {
                return Err(source.error_line(at, format!("a mesh of dimension {n}, not 3")));
            }
            dimension = Some(n);
        } else if is("Vertices") {
            vertices(source, &mut tokens, &mut content, at)?;
        } else if let Some((name, _, kind)) = SECTIONS.iter().find(|s| is(s.0)) {
            cells(&mut tokens, &mut content, name, *kind)?;
        } else if is("End") {
            break;
        } else if token[0].is_ascii_alphabetic() {
            content.skipped.push(excerpt(&token));
            skip(&mut tokens)?;
        } else {
            return Err(
                source.error_line(at, format!("`{}` where a keyword should be; is the count of the section right?", excerpt(&token)))
            );
        }
    }
    let name = version.map_or_else(|| "without a version".into(), |v| format!("version {v}"));
    let mut assembly = Assembly::new(source, options, format!("Medit text, {name}"));
    if let Some(version) = version.filter(|v| !(1..=4).contains(v)) {
        assembly.warnings.push(format!("version {version} of the format is unknown; the file is read like version 2"));
    }
    if dimension.is_none() {
        assembly.warnings.push("there is no keyword Dimension; 3 is assumed".into());
    }
    content.assemble(source, &mut assembly)?;
    if let Some((token, at)) = tokens.next_token()? {
        assembly.warnings.push(format!("line {}: `{}` and what follows after End is not read", source.line(at), excerpt(token)));
    }
    Ok(assembly)
}

fn vertices(source: &Source, tokens: &mut Tokens<'_>, content: &mut Content, at: usize) -> Result<()> {
    if content.points.is_some() {
        return Err(source.error_line(at, "a second section Vertices"));
    }
    let n = tokens.count("the number of vertices")?;
    let mut points = Vec::with_capacity(n);
    content.point_marks.reserve(n);
    for _ in 0..n {
        points.push([tokens.float("a coordinate")?, tokens.float("a coordinate")?, tokens.float("a coordinate")?]);
        content.point_marks.push(tokens.float("the reference of a vertex")?);
    }
    content.points = Some(points);
    Ok(())
}

fn cells(tokens: &mut Tokens<'_>, content: &mut Content, name: &str, kind: CellType) -> Result<()> {
    let n = tokens.count("the number of cells")?;
    let width = kind.nodes.unwrap_or(0);
    let mut nodes = Vec::with_capacity(n.saturating_mul(width).min(tokens.left() / 2 + 1));
    for _ in 0..n {
        for _ in 0..width {
            nodes.push(tokens.integer(name)?);
        }
        content.cell_marks.push(tokens.float("the reference of a cell")?);
    }
    content.cells.push((kind, nodes));
    Ok(())
}

/// Skips the numbers of a section that is not used.
fn skip(tokens: &mut Tokens<'_>) -> Result<()> {
    while tokens.peek()?.is_some_and(|t| !t[0].is_ascii_alphabetic()) {
        tokens.next_token()?;
    }
    Ok(())
}
