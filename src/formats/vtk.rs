//! Reader for legacy VTK files (`.vtk`), versions 1.0 to 5.1, text and binary (big-endian).

mod attributes;
mod reader;
pub(super) mod series;

use super::LoadOptions;
use super::array::Array;
use super::assemble::Assembly;
use super::budget::Budget;
use super::cells::{self, Shape};
use super::integers::Integers;
use super::lattice::{Frame, GridKind, Lattice};
use super::report::Fate;
use super::scalar::Scalar;
use super::source::{Source, excerpt};
use super::tokens::{Tokens, parse_float};
use crate::error::Result;
use crate::mesh::On;
use attributes::Section;
use reader::Reader;

/// The cells as stored in the file.
struct Cells<'a> {
    count: usize,
    /// Start of each cell in `nodes`, and end of the last one; `None`: the nodes of each cell are preceded by their
    /// number.
    offsets: Option<Integers<'a>>,
    nodes: Integers<'a>,
}

impl Cells<'_> {
    /// The nodes of cell `i`. `at` is the end of the previous cell, and becomes the end of this one.
    fn nodes(&mut self, i: usize, at: &mut usize) -> Result<&[i64]> {
        let (begin, end) = match &mut self.offsets {
            Some(offsets) => (*at, offsets.at(i + 1)? as usize),
            None => (*at + 1, *at + 1 + self.nodes.at(*at)? as usize),
        };
        *at = end;
        self.nodes.slice(begin..end)
    }
}

/// The points of a surface, a POLYDATA dataset; `None` if it is no such file.
pub(crate) fn surface_points(source: &Source) -> Option<Result<Vec<[f64; 3]>>> {
    let mut reader = Reader { source, tokens: Tokens::new(source, None), binary: false };
    if !matches!(reader.dataset(), Ok((_, dataset, _)) if dataset == b"POLYDATA") {
        return None;
    }
    let mut read = || {
        while let Some((token, at)) = reader.tokens.next_token()? {
            let keyword = token.to_ascii_uppercase();
            if keyword == b"POINTS" {
                return reader.points();
            }
            reader.attribute(&keyword, at, None)?; // fields of the whole file may come first
        }
        Err(source.error_line(source.len(), "the file ends, and there was no POINTS"))
    };
    Some(read())
}

pub(crate) fn read(source: &Source, options: &LoadOptions) -> Result<Assembly> {
    let mut reader = Reader { source, tokens: Tokens::new(source, None), binary: false };
    let (format, dataset) = reader.header()?;
    let mut assembly = Assembly::new(source, options, format);
    let (mut points, mut cells, mut types) = (None, None, None);
    let mut grid = StructuredGrid::default();
    let mut section: Option<Section> = None;
    while let Some((token, at)) = reader.tokens.next_token()? {
        let keyword = token.to_ascii_uppercase();
        match keyword.as_slice() {
            b"POINTS" => points = Some(reader.points()?),
            b"CELLS" => cells = Some(reader.cells()?),
            b"CELL_TYPES" => types = Some(reader.types()?),
            b"POINT_DATA" | b"CELL_DATA" => {
                let on = if keyword == b"POINT_DATA" { On::Points } else { On::Cells };
                section = Some((on, reader.size("the number of values")?));
            }
            b"METADATA" => reader.metadata()?,
            _ if reader.structured(&keyword, &mut grid)? => {}
            _ => {
                let arrays = reader.attribute(&keyword, at, section)?;
                let Some((on, _)) = section else { continue };
                for (name, components, (values, loss)) in arrays {
                    assembly.arrays.push(Array { name, on, components, values, loss });
                }
            }
        }
    }
    let missing = |what: &str| source.error_line(source.len(), format!("the file ends, and there was no {what}"));
    let lattice = if dataset == GridKind::Cells { None } else { Some(grid.lattice.ok_or_else(|| missing("DIMENSIONS"))?) };
    let points = match (&lattice, dataset) {
        (Some(lattice), GridKind::Rectilinear) => grid.at_coordinates(lattice, source, &mut assembly.padding)?,
        (Some(lattice), GridKind::Image(_)) => {
            let frame = grid.frame().ok_or_else(|| missing("SPACING"))?;
            lattice.spend(&mut assembly.padding).map_err(|message| source.error(message))?;
            let mut points = Vec::new();
            lattice.in_frame(&frame, &mut points);
            points
        }
        _ => points.ok_or_else(|| missing("POINTS"))?,
    };
    assembly.set_points(points);
    let marks = |a: &Array| cells::ghost(&a.name).filter(|_| a.on == On::Cells && a.components == 1);
    let ghosts = assembly.arrays.iter().find_map(|a| Some((a, marks(a)?)));
    let ghosts: Vec<bool> = ghosts.map_or_else(Vec::new, |(a, marks)| a.values.iter().map(|&v| marks(v as i64)).collect());
    if let Some(lattice) = lattice {
        let points = assembly.n_points();
        if lattice.points() != points as u64 {
            return Err(source.error(format!("POINTS has {points} entries, but the dimensions make {}", lattice.points())));
        }
        lattice.push(&mut assembly, 0..points, |cell| Ok(ghosts.get(cell) == Some(&true)))?;
        return checked(source, assembly);
    }
    let mut cells: Cells<'_> = cells.ok_or_else(|| missing("CELLS"))?;
    let mut types: Integers<'_> = types.ok_or_else(|| missing("CELL_TYPES"))?;
    if types.len() != cells.count {
        return Err(source.error(format!("CELL_TYPES has {} entries, CELLS has {}", types.len(), cells.count)));
    }
    assembly.reserve(types.len());
    let mut end = 0;
    for cell in 0..cells.count {
        let number = types.at(cell)?;
        let nodes = cells.nodes(cell, &mut end)?;
        let kind = cells::vtk_of(number, nodes.len());
        let kind = kind.ok_or_else(|| source.error_in(format_args!("cell {cell}"), format!("unknown VTK cell type {number}")))?;
        if ghosts.get(cell) == Some(&true) {
            assembly.skip("ghost or hidden cell", Fate::Ghost);
            continue;
        }
        if kind.shape == Shape::Polyhedron {
            assembly.push_polyhedron(kind, nodes, 0..assembly.n_points())?;
        } else {
            assembly.push(kind, nodes)?;
        }
    }
    checked(source, assembly)
}

/// Checks that arrays have as many values as there are points or cells.
fn checked(source: &Source, assembly: Assembly) -> Result<Assembly> {
    for array in &assembly.arrays {
        let (count, what) = if array.on == On::Points { (assembly.n_points(), "POINTS") } else { (assembly.cells(), "CELLS") };
        if array.values.len() != count * array.components {
            let found = array.values.len() / array.components.max(1);
            let message = format!("{found} tuples, but {what} has {count}");
            return Err(source.error_in(format_args!("array `{}`", excerpt(array.name.as_bytes())), message));
        }
    }
    Ok(assembly)
}

/// What a file says of a grid without lists of cells.
#[derive(Default)]
struct StructuredGrid {
    lattice: Option<Lattice>,
    origin: Option<[f64; 3]>,
    spacing: Option<[f64; 3]>,
    /// The coordinates along the axes.
    axes: [Vec<f64>; 3],
}

impl StructuredGrid {
    /// Where the points are; `None`: the file does not say how far apart.
    fn frame(&self) -> Option<Frame> {
        let [dx, dy, dz] = self.spacing?;
        Some(Frame { origin: self.origin.unwrap_or_default(), steps: [[dx, 0.0, 0.0], [0.0, dy, 0.0], [0.0, 0.0, dz]] })
    }

    /// The points that the coordinates along the axes make.
    fn at_coordinates(&self, lattice: &Lattice, source: &Source, budget: &mut Budget) -> Result<Vec<[f64; 3]>> {
        let mut points = Vec::new();
        lattice.spend(budget).map_err(|message| source.error(message))?;
        let counts = self.axes.each_ref().map(|axis| axis.len() as u64);
        if counts != lattice.size() {
            let [[x, y, z], [nx, ny, nz]] = [counts, lattice.size()];
            return Err(source.error(format!("{x}, {y} and {z} coordinates, but the dimensions are {nx}, {ny} and {nz}")));
        }
        Lattice::at_coordinates(&self.axes, &mut points);
        Ok(points)
    }
}

impl<'a> Reader<'a> {
    /// Reads a section of a grid without lists of cells; false if this is none.
    fn structured(&mut self, keyword: &[u8], grid: &mut StructuredGrid) -> Result<bool> {
        let axis = match keyword {
            b"DIMENSIONS" => {
                let at = self.tokens.at;
                let size = [self.size("a dimension")?, self.size("a dimension")?, self.size("a dimension")?];
                let lattice = Lattice::of(size.map(|n| n as u64));
                grid.lattice = Some(lattice.ok_or_else(|| self.source.error_line(at, "dimensions of 2^32 points or more"))?);
                return Ok(true);
            }
            b"ORIGIN" => {
                grid.origin = Some(self.triple()?);
                return Ok(true);
            }
            b"SPACING" | b"ASPECT_RATIO" => {
                grid.spacing = Some(self.triple()?);
                return Ok(true);
            }
            b"X_COORDINATES" => 0,
            b"Y_COORDINATES" => 1,
            b"Z_COORDINATES" => 2,
            _ => return Ok(false),
        };
        let n = self.tokens.count("the number of coordinates")?;
        let scalar = self.scalar()?;
        grid.axes[axis] = self.values(scalar, n, "a coordinate")?;
        Ok(true)
    }

    /// Three numbers, which are text in any file.
    fn triple(&mut self) -> Result<[f64; 3]> {
        let mut triple = [0.0; 3];
        for number in &mut triple {
            let (word, at) = self.tokens.word("a number")?;
            let found = parse_float(word);
            *number = found.ok_or_else(|| self.source.error_line(at, format!("`{}` where a number should be", excerpt(word))))?;
        }
        Ok(triple)
    }

    /// The format, and the kind of the grid.
    fn header(&mut self) -> Result<(String, GridKind)> {
        let (version, dataset, at) = self.dataset()?;
        let (what, kind) = match dataset.as_slice() {
            b"UNSTRUCTURED_GRID" => ("unstructured grid", GridKind::Cells),
            b"STRUCTURED_GRID" => ("structured grid", GridKind::Structured),
            b"RECTILINEAR_GRID" => ("rectilinear grid", GridKind::Rectilinear),
            b"STRUCTURED_POINTS" => ("image", GridKind::Image(Frame::default())),
            _ => return Err(self.source.error_line(at, format!("a {} dataset, which has no volume cells", excerpt(&dataset)))),
        };
        Ok((format!("VTK legacy {what} {version}, {}", if self.binary { "binary" } else { "text" }), kind))
    }

    /// The version, and the type of the dataset with its position.
    fn dataset(&mut self) -> Result<(String, Vec<u8>, usize)> {
        let (first, _) = self.tokens.line()?.unwrap_or_default();
        let first = first.trim_ascii();
        let Some(version) = first.strip_prefix(b"# vtk DataFile Version") else {
            return Err(self.source.error_line(0, format!("`{}` instead of `# vtk DataFile Version …`", excerpt(first))));
        };
        let version = excerpt(version.trim_ascii());
        self.tokens.line()?;
        let (coding, at) = self.tokens.word("ASCII or BINARY")?;
        self.binary = match coding.to_ascii_uppercase().as_slice() {
            b"ASCII" => false,
            b"BINARY" => true,
            _ => {
                let message = format!("`{}` where ASCII or BINARY should be (line 2 must be a title)", excerpt(coding));
                return Err(self.source.error_line(at, message));
            }
        };
        let (word, at) = self.tokens.word("DATASET")?;
        if !word.eq_ignore_ascii_case(b"DATASET") {
            return Err(self.source.error_line(at, format!("`{}` where DATASET should be", excerpt(word))));
        }
        let (dataset, at) = self.tokens.word("the type of the dataset")?;
        Ok((version, dataset.to_ascii_uppercase(), at))
    }

    fn points(&mut self) -> Result<Vec<[f64; 3]>> {
        let n = self.tokens.count("the number of points")?;
        let scalar = self.scalar()?;
        let values: Vec<f64> = self.values(scalar, 3 * n, "a coordinate")?;
        Ok(values.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect())
    }

    fn types(&mut self) -> Result<Integers<'a>> {
        let n = self.tokens.count("the number of cell types")?;
        self.integers(Some(Scalar::I32), n, "a cell type")
    }

    /// Reads `CELLS n size` with lists of a count and that many points, or, since version 5.0, `CELLS n+1 size` with
    /// offsets and connectivity.
    fn cells(&mut self) -> Result<Cells<'a>> {
        let at = self.tokens.at;
        let n = self.tokens.count("the number of cells")?;
        let size = self.tokens.count("the size of the cell list")?;
        if self.tokens.peek()?.is_some_and(|t| t.eq_ignore_ascii_case(b"OFFSETS")) {
            return self.offsets(at, n, size);
        }
        let mut list = self.integers(Some(Scalar::I32), size, "a point of a cell")?;
        let mut next = 0;
        for cell in 0..n {
            let fail = |message: String| self.source.error_line(at, format!("CELLS: cell {cell} {message}"));
            if next == list.len() {
                return Err(fail(format!("lies beyond the {size} numbers of the list")));
            }
            let (length, left) = (list.at(next)?, list.len() - next - 1);
            let fits = usize::try_from(length).ok().filter(|&l| l <= left);
            next += 1 + fits.ok_or_else(|| fail(format!("announces {length} points, but {left} numbers are left")))?;
        }
        if next < list.len() {
            let left = list.len() - next;
            return Err(self.source.error_line(at, format!("CELLS: {left} of {size} numbers are left over after {n} cells")));
        }
        Ok(Cells { count: n, offsets: None, nodes: list })
    }

    fn offsets(&mut self, at: usize, n: usize, size: usize) -> Result<Cells<'a>> {
        self.tokens.next_token()?;
        let scalar = self.scalar()?;
        let mut offsets = self.integers(scalar, n, "an offset")?;
        let (word, word_at) = self.tokens.word("CONNECTIVITY")?;
        if !word.eq_ignore_ascii_case(b"CONNECTIVITY") {
            return Err(self.source.error_line(word_at, format!("`{}` where CONNECTIVITY should be", excerpt(word))));
        }
        let scalar = self.scalar()?;
        let nodes = self.integers(scalar, size, "a point of a cell")?;
        let fail = |message: String| self.source.error_line(at, format!("CELLS: {message}"));
        let (count, first) = (offsets.len().saturating_sub(1), offsets.at(0)?);
        if first != 0 {
            return Err(fail(format!("the first offset is {first}, not 0")));
        }
        let mut last = 0;
        for cell in 0..count {
            let end = offsets.at(cell + 1)?;
            if end < last {
                return Err(fail(format!("the offsets of cell {cell} go backwards")));
            }
            last = end;
        }
        if last != nodes.len() as i64 {
            return Err(fail(format!("the last offset is {last}, but there are {} points of cells", nodes.len())));
        }
        Ok(Cells { count, offsets: Some(offsets), nodes })
    }
}
