//! Reader for VTK XML unstructured grids (`.vtu`), versions 0.1 to 2.x: the XML structure. `vtu_data` reads the arrays.

use std::collections::HashMap;
use std::ops::Range;

use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

use super::LoadOptions;
use super::array::Array;
use super::assemble::Assembly;
use super::budget::Budget;
use super::cells::{self, CellType};
use super::report::Fate;
use super::scalar::Scalar;
use super::source::{Source, excerpt};
use super::tokens::Tokens;
use super::vtu_data::{Appended, Codec, Place, StoredArray};
use super::vtu_outline::Outline;
use crate::error::Result;
use crate::mesh::On;

/// One `Piece` of the grid.
#[derive(Default)]
struct Piece {
    at: usize,
    points: u64,
    cells: u64,
    /// Arrays, by the element that contains them.
    point_data: Vec<StoredArray>,
    cell_data: Vec<StoredArray>,
    positions: Option<StoredArray>,
    topology: Vec<StoredArray>,
}

/// The content of the XML elements, without the values of arrays.
struct Skeleton {
    codec: Codec,
    pieces: Vec<Piece>,
    format: String,
}

pub(crate) fn read<'a>(source: &'a Source, options: &LoadOptions) -> Result<Assembly<'a>> {
    let outline = Outline::read(source)?;
    let reader = Reader::from_str(&outline.text);
    let skeleton = Parser { source, outline: &outline, reader, stack: Vec::new(), codec: None, pieces: Vec::new() }.run()?;
    let mut codec = skeleton.codec;
    codec.budget = Budget::new(source.len(), options);
    let mut assembly = Assembly::new(source, options, skeleton.format);
    let (mut points, mut starts) = (Vec::new(), Vec::with_capacity(skeleton.pieces.len()));
    for (i, piece) in skeleton.pieces.iter().enumerate() {
        starts.push(points.len());
        read_points(source, &mut codec, &mut points, piece, i)?;
    }
    assembly.set_points(points, &starts);
    let mut places = Places::new();
    for (i, (piece, &start)) in skeleton.pieces.iter().zip(&starts).enumerate() {
        let first_cell = assembly.cells();
        read_cells(source, &mut codec, &mut assembly, piece, i, start)?;
        read_arrays(source, &mut codec, &mut assembly, &mut places, piece, [start, first_cell])?;
    }
    assembly.complete_arrays();
    Ok(assembly)
}

struct Parser<'a, 't> {
    source: &'a Source,
    outline: &'t Outline,
    reader: Reader<&'t [u8]>,
    stack: Vec<String>,
    codec: Option<(Codec, String)>,
    pieces: Vec<Piece>,
}

impl Parser<'_, '_> {
    fn run(mut self) -> Result<Skeleton> {
        let mut appended = None;
        loop {
            let start = self.outline.in_file(self.reader.buffer_position() as usize);
            let event = self.reader.read_event();
            let end = self.reader.buffer_position() as usize;
            let fail = |message: String| Err(self.source.error_line(start, message));
            match event {
                Err(error) => {
                    let at = self.outline.in_file(self.reader.error_position() as usize);
                    return Err(self.source.error_line(at, format!("not well-formed XML: {error}")));
                }
                Ok(Event::Eof) if self.stack.is_empty() => break,
                Ok(Event::Eof) => return fail(format!("the file ends inside <{}>", self.stack.join("><"))),
                Ok(Event::DocType(e)) if e.trim_start().get(..4).is_some_and(|t| t.eq_ignore_ascii_case("html")) => {
                    return fail("an HTML page, not a mesh".into());
                }
                Ok(Event::DocType(_)) => {
                    return fail("a document type declaration; VTK files have none, and entities are not expanded".into());
                }
                Ok(Event::GeneralRef(_)) if self.stack.last().is_some_and(|element| element == "DataArray") => {
                    return fail("an entity reference in the data".into());
                }
                Ok(Event::Text(_)) => self.text(start..self.outline.in_file(end)),
                Ok(Event::CData(_)) => self.text(start + "<![CDATA[".len()..self.outline.in_file(end) - "]]>".len()),
                Ok(Event::Start(e)) => {
                    if e.name().as_ref() == "AppendedData" {
                        appended = Some((self.attributes(&e, start)?, self.outline.in_file(end)));
                        break;
                    }
                    if self.stack.len() > 32 {
                        return fail("elements nested more than 32 deep".into());
                    }
                    self.open(&e, start)?;
                    self.stack.push(excerpt(e.name().as_ref().as_bytes()));
                    if let Some(range) = self.outline.cut_at(end) {
                        self.text(range);
                    }
                }
                Ok(Event::Empty(e)) => self.open(&e, start)?,
                Ok(Event::End(_)) => {
                    self.stack.pop();
                }
                Ok(Event::Comment(_) | Event::Decl(_) | Event::PI(_) | Event::GeneralRef(_)) => {}
            }
        }
        let Some((mut codec, format)) = self.codec.take() else {
            return Err(self.source.error("no element <VTKFile>: not a VTK file"));
        };
        if self.pieces.is_empty() {
            return Err(self.source.error("there is no element <Piece>"));
        }
        if let Some((attributes, end)) = appended {
            codec.appended = self.appended(&attributes, end)?;
        }
        Ok(Skeleton { codec, pieces: self.pieces, format })
    }

    /// Locates the appended data, whose element starts before byte `end` of the file; `None` if it is empty.
    fn appended(&self, attributes: &[(String, String)], end: usize) -> Result<Option<Appended>> {
        let encoding = get(attributes, "encoding").unwrap_or("base64");
        let base64 = match encoding {
            "raw" => false,
            "base64" => true,
            other => return Err(self.source.error_line(end, format!("appended data in encoding `{}`", excerpt(other.as_bytes())))),
        };
        let mut tokens = Tokens::new(self.source, None);
        tokens.at = end;
        tokens.skip_space()?;
        if tokens.starts_with(b"</AppendedData")? {
            return Ok(None);
        }
        if !tokens.starts_with(b"_")? {
            return Err(self.source.error_byte(tokens.at, "the appended data must begin with an underscore"));
        }
        let start = tokens.at + 1;
        let mut stop = self.source.len();
        if base64 {
            tokens.skip_until(|bytes| memchr::memchr(b'<', bytes))?;
            stop = tokens.at;
        }
        Ok(Some(Appended { base64, range: start..stop }))
    }

    fn attributes(&self, element: &BytesStart<'_>, at: usize) -> Result<Vec<(String, String)>> {
        let mut found = Vec::new();
        // The check for duplicates is quadratic, so it is disabled; no element of this format has more than 64
        // attributes.
        for attribute in element.attributes().with_checks(false).take(64) {
            let attribute = attribute.map_err(|e| self.source.error_line(at, format!("not well-formed XML: {e}")))?;
            let value = quick_xml::escape::unescape(&attribute.value);
            let value = value.map_err(|e| self.source.error_line(at, format!("not well-formed XML: {e}")))?;
            found.push((attribute.key.as_ref().to_owned(), value.into_owned()));
        }
        Ok(found)
    }

    fn open(&mut self, element: &BytesStart<'_>, at: usize) -> Result<()> {
        let parent = self.stack.last().map(String::as_str);
        match (element.name().as_ref(), parent) {
            ("VTKFile", None) => {
                let attributes = self.attributes(element, at)?;
                let kind = get(&attributes, "type").unwrap_or("");
                if kind != "UnstructuredGrid" {
                    let hint = if kind.starts_with('P') { "; open the pieces it lists, or let ParaView save it as one file" } else { "" };
                    let message = format!("a VTK XML file of type `{}`, not UnstructuredGrid{hint}", excerpt(kind.as_bytes()));
                    return Err(self.source.error_line(at, message));
                }
                let codec = Codec::new(|name| get(&attributes, name)).map_err(|message| self.source.error_line(at, message))?;
                let version = get(&attributes, "version").unwrap_or("without a version");
                let format = format!("VTK XML unstructured grid {}{}", excerpt(version.as_bytes()), codec.describe());
                self.codec = Some((codec, format));
            }
            (name, None) => {
                let message = format!("an XML or HTML document <{}>, not a VTK file", excerpt(name.as_bytes()));
                return Err(self.source.error_line(at, message));
            }
            ("Piece", _) => {
                let attributes = self.attributes(element, at)?;
                let number = |name: &str| {
                    let text = get(&attributes, name).unwrap_or("");
                    let wrong = || self.source.error_line(at, format!("{name}=\"{}\" is not a count", excerpt(text.as_bytes())));
                    text.trim().parse::<u64>().map_err(|_| wrong())
                };
                let piece = Piece { at, points: number("NumberOfPoints")?, cells: number("NumberOfCells")?, ..Piece::default() };
                self.pieces.push(piece);
            }
            ("DataArray", Some(group @ ("PointData" | "CellData" | "Points" | "Cells"))) => {
                let group = group.to_owned();
                let array = self.array(&self.attributes(element, at)?, at)?;
                if let Some(piece) = self.pieces.last_mut() {
                    match group.as_str() {
                        "PointData" => piece.point_data.push(array),
                        "CellData" => piece.cell_data.push(array),
                        "Points" => piece.positions = Some(array),
                        _ => piece.topology.push(array),
                    }
                }
            }
            _ => {}
        }
        Ok(())
    }

    fn array(&self, attributes: &[(String, String)], at: usize) -> Result<StoredArray> {
        let name = get(attributes, "Name").unwrap_or("unnamed").to_owned();
        let fail = |message: String| self.source.error_line(at, format!("array `{}`: {message}", excerpt(name.as_bytes())));
        let kind = get(attributes, "type").unwrap_or("");
        let scalar = match kind {
            "String" | "Bit" => None,
            _ => Some(Scalar::vtk_xml(kind).ok_or_else(|| fail(format!("unknown type `{}`", excerpt(kind.as_bytes()))))?),
        };
        let components = match get(attributes, "NumberOfComponents") {
            None => 1,
            Some(text) => {
                let n = text.trim().parse::<u64>().ok().filter(|&n| u32::try_from(n).is_ok());
                n.ok_or_else(|| fail(format!("NumberOfComponents=\"{}\"", excerpt(text.as_bytes()))))?
            }
        };
        let place = match get(attributes, "format").unwrap_or("ascii") {
            "ascii" => Place::Ascii(Vec::new()),
            "binary" => Place::Inline(Vec::new()),
            "appended" => {
                let text = get(attributes, "offset").unwrap_or("");
                let offset = text.trim().parse::<u64>();
                Place::Appended(offset.map_err(|_| fail(format!("offset=\"{}\" is not a number", excerpt(text.as_bytes()))))?)
            }
            other => return Err(fail(format!("unknown format `{}`", excerpt(other.as_bytes())))),
        };
        Ok(StoredArray { name, scalar, components, place, at })
    }

    /// Assigns text to the array whose element is innermost.
    fn text(&mut self, range: Range<usize>) {
        let [.., group, last] = self.stack.as_slice() else { return };
        if last != "DataArray" {
            return;
        }
        let Some(piece) = self.pieces.last_mut() else { return };
        let array = match group.as_str() {
            "PointData" => piece.point_data.last_mut(),
            "CellData" => piece.cell_data.last_mut(),
            "Points" => piece.positions.as_mut(),
            "Cells" => piece.topology.last_mut(),
            _ => None,
        };
        if let Some(StoredArray { place: Place::Ascii(parts) | Place::Inline(parts), .. }) = array {
            parts.push(range);
        }
    }
}

fn get<'s>(attributes: &'s [(String, String)], name: &str) -> Option<&'s str> {
    attributes.iter().find(|(key, _)| key == name).map(|(_, value)| value.as_str())
}

/// Identifies an array across pieces: arrays of different pieces with the same key continue each other.
type Key<'p> = (On, &'p str, u64);

/// Position of each array in the assembly. If a piece has several arrays with the same key, the n-th of them continues
/// the n-th of the other pieces.
type Places<'p> = HashMap<(Key<'p>, usize), usize>;

fn read_points(source: &Source, codec: &mut Codec, points: &mut Vec<[f64; 3]>, piece: &Piece, index: usize) -> Result<()> {
    if piece.points == 0 {
        return Ok(());
    }
    let fail = |message: &str| source.error_line(piece.at, format!("piece {index}: {message}"));
    let positions = piece.positions.as_ref().ok_or_else(|| fail("no <Points>"))?;
    if positions.components != 3 {
        return Err(fail("the points must have 3 components"));
    }
    let values: Vec<f64> = codec.floats(source, positions, piece.points)?;
    points.extend(values.chunks_exact(3).map(|p| [p[0], p[1], p[2]]));
    Ok(())
}

/// Reads the values of points and cells; `before` holds the numbers of points and cells of earlier pieces.
fn read_arrays<'p>(
    source: &Source,
    codec: &mut Codec,
    assembly: &mut Assembly<'_>,
    places: &mut Places<'p>,
    piece: &'p Piece,
    before: [usize; 2],
) -> Result<()> {
    let mut turns: HashMap<Key<'p>, usize> = HashMap::new();
    let [points, cells] = before;
    let groups = [(On::Points, &piece.point_data, piece.points, points), (On::Cells, &piece.cell_data, piece.cells, cells)];
    for (on, arrays, count, before) in groups {
        for array in arrays {
            if array.scalar.is_none() {
                assembly.warnings.push(format!("array `{}` holds text or bits and is left out", excerpt(array.name.as_bytes())));
            } else if array.components == 0 || array.components > 9 {
                let message = format!("array `{}` has {} components and is left out", excerpt(array.name.as_bytes()), array.components);
                assembly.warnings.push(message);
            } else {
                let values: Vec<f32> = codec.floats(source, array, count)?;
                // An empty piece does not require that an array is filled up.
                if values.is_empty() {
                    continue;
                }
                let key = (on, array.name.as_str(), array.components);
                let turn = *turns.entry(key).and_modify(|turn| *turn += 1).or_default();
                let place = *places.entry((key, turn)).or_insert_with(|| {
                    let components = array.components as usize;
                    assembly.arrays.push(Array { name: array.name.clone(), on, components, values: Vec::new() });
                    assembly.arrays.len() - 1
                });
                // An array that the budget does not allow to be filled up stays too short, and is left out at the end.
                let array = &mut assembly.arrays[place];
                if array.fill(before, &mut assembly.padding).is_ok() {
                    array.values.extend_from_slice(&values);
                }
            }
        }
    }
    Ok(())
}

fn read_cells(source: &Source, codec: &mut Codec, assembly: &mut Assembly<'_>, piece: &Piece, index: usize, first: usize) -> Result<()> {
    if piece.cells == 0 {
        return Ok(());
    }
    let find = |name: &str| {
        let found = piece.topology.iter().find(|a| a.name == name);
        found.ok_or_else(|| source.error_line(piece.at, format!("piece {index}: no array `{name}` in <Cells>")))
    };
    let mut types = codec.integers(source, find("types")?, Some(piece.cells))?;
    let mut offsets = codec.integers(source, find("offsets")?, Some(piece.cells))?;
    let mut connectivity = codec.integers(source, find("connectivity")?, None)?;
    let (all, last) = (connectivity.len() as i64, offsets.at(offsets.len() - 1)?);
    if last != all {
        let message = format!("the last cell of piece {index} ends at {last}, but `connectivity` has {all} values");
        return Err(source.error_in("array `offsets`", message));
    }
    let ghosts = piece.cell_data.iter().find_map(|a| Some((a, cells::ghost(&a.name).filter(|_| a.components == 1)?)));
    let mut ghosts = ghosts.map(|(a, marks)| Ok((codec.integers(source, a, Some(piece.cells))?, marks))).transpose()?;
    let points = first..first + piece.points as usize;
    assembly.reserve(types.len());
    let mut start = 0;
    let mut kind: Option<(i64, CellType)> = None;
    for cell in 0..types.len() {
        let (number, end) = (types.at(cell)?, offsets.at(cell)?);
        if !(start..=all).contains(&end) {
            let message = format!("cell {cell} of piece {index} would reach from {start} to {end} of {all} values");
            return Err(source.error_in("array `offsets`", message));
        }
        let nodes = connectivity.slice(start as usize..end as usize)?;
        start = end;
        if kind.is_none_or(|(n, _)| n != number) {
            let found = cells::vtk(number);
            kind = Some((
                number,
                found.ok_or_else(|| source.error_in(format_args!("cell {cell}"), format!("unknown VTK cell type {number}")))?,
            ));
        }
        let ghost = match &mut ghosts {
            Some((values, marks)) => marks(values.at(cell)?),
            None => false,
        };
        if ghost {
            assembly.skip("ghost or hidden cell", Fate::Ghost);
        } else if let Some((_, kind)) = kind {
            assembly.push_within(kind, nodes, points.clone())?;
        }
    }
    Ok(())
}
