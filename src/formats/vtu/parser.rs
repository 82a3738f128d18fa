//! Parser for the structure of VTK XML files: unstructured grids, without the values of their arrays, and files that list
//! other files.

use std::ops::Range;

use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

use super::super::lattice::{Frame, GridKind, Lattice};
use super::super::scalar::Scalar;
use super::super::source::{Source, excerpt, passage};
use super::super::steps::{Steps, TimeStep};
use super::super::tokens::{Tokens, parse_float};
use super::data::{Appended, Codec, Place, StoredArray};
use super::outline::Outline;
use crate::error::{Error, Result};

/// What a file contains.
#[allow(clippy::large_enum_variant, reason = "there is one per file")]
pub(crate) enum Document {
    Grid(Skeleton),
    List(List),
}

/// The content of the XML elements of a grid, without the values of arrays.
pub(crate) struct Skeleton {
    pub codec: Codec,
    pub kind: GridKind,
    pub pieces: Vec<Piece>,
    pub format: String,
    pub warnings: Vec<String>,
    /// The time steps of the file, by the names that it gives them.
    pub steps: Vec<String>,
}

/// One `Piece` of the grid.
#[derive(Default)]
pub(crate) struct Piece {
    pub at: usize,
    pub points: u64,
    pub cells: u64,
    /// Arrays, by the element that contains them.
    pub point_data: Vec<StoredArray>,
    pub cell_data: Vec<StoredArray>,
    pub positions: Option<StoredArray>,
    /// Arrays that describe cells; those of the coordinates along the axes.
    pub topology: Vec<StoredArray>,
    /// The points of a piece of a structured grid.
    pub lattice: Option<Lattice>,
}

/// A file that lists other files.
pub(crate) struct List {
    pub format: String,
    pub files: Vec<Listed>,
}

/// A file that is listed.
pub(crate) struct Listed {
    /// Path, relative to the folder of the list.
    pub path: String,
    /// Time step in a series.
    pub step: Option<String>,
    /// Number of the block in the list. The files of a block are pieces of one mesh.
    pub block: usize,
    /// Position of the XML element.
    pub at: usize,
}

/// The root of a file.
enum Root {
    Grid(Codec, String),
    /// A list, and whether all its files are of one block.
    List(List, bool),
}

/// Types of files that list others in elements `DataSet`.
const LISTS: [&str; 4] = ["vtkMultiBlockDataSet", "vtkPartitionedDataSet", "vtkPartitionedDataSetCollection", "Collection"];

/// Parses a file, of several time steps this one.
pub(crate) fn parse(source: &Source, step: TimeStep) -> Result<Document> {
    let outline = Outline::read(source)?;
    let parsed = |wanted: Option<String>| {
        Parser {
            source,
            outline: &outline,
            reader: Reader::from_str(&outline.text),
            stack: Vec::new(),
            root: None,
            pieces: Vec::new(),
            block: 0,
            steps: Steps::of(wanted),
            left_out: false,
            second_points: false,
            kind: GridKind::Cells,
        }
        .run()
    };
    let mut document = parsed(None)?;
    let Document::Grid(Skeleton { steps, .. }) = &mut document else { return Ok(document) };
    if steps.len() < 2 {
        return Ok(document);
    }
    let chosen = step.chosen(source, steps)?;
    let remark = TimeStep::remark(chosen, steps.len());
    let mut document = parsed(Some(steps.swap_remove(chosen)))?;
    if let Document::Grid(Skeleton { warnings, .. }) = &mut document {
        warnings.push(remark);
    }
    Ok(document)
}

struct Parser<'a, 't> {
    source: &'a Source,
    outline: &'t Outline,
    reader: Reader<&'t [u8]>,
    stack: Vec<String>,
    root: Option<Root>,
    pieces: Vec<Piece>,
    /// Number of the block that was begun last in a list.
    block: usize,
    steps: Steps,
    /// Whether the innermost array is left out.
    left_out: bool,
    /// Whether a piece has more than one array of points.
    second_points: bool,
    kind: GridKind,
}

impl Parser<'_, '_> {
    fn run(mut self) -> Result<Document> {
        let mut appended = None;
        loop {
            let start = self.outline.in_file(self.reader.buffer_position() as usize);
            let event = self.reader.read_event();
            let end = self.reader.buffer_position() as usize;
            let fail = |message: String| Err(self.source.error_line(start, message));
            match event {
                Err(error) => {
                    let at = self.outline.in_file(self.reader.error_position() as usize);
                    return Err(self.ill_formed(at, &error));
                }
                Ok(Event::Eof) if self.stack.is_empty() => break,
                Ok(Event::Eof) => return fail(format!("the file ends inside <{}>", passage(&self.stack.join("><")))),
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
        let (mut codec, format) = match self.root.take() {
            None => return Err(self.source.error("no element <VTKFile>: not a VTK file")),
            Some(Root::List(list, _)) => return Ok(Document::List(list)),
            Some(Root::Grid(codec, format)) => (codec, format),
        };
        if self.pieces.is_empty() {
            return Err(self.source.error("there is no element <Piece>"));
        }
        if let Some((attributes, end)) = appended {
            codec.appended = self.appended(&attributes, end)?;
        }
        let mut warnings = Vec::new();
        if self.kind == GridKind::Surface {
            warnings.push("a surface, of which only the points can be read".into());
        }
        if self.second_points {
            warnings.push("<Points> has several arrays, of which the first is read".into());
        }
        Ok(Document::Grid(Skeleton { codec, kind: self.kind, pieces: self.pieces, format, warnings, steps: self.steps.all }))
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

    /// The parser quotes the file in its messages.
    fn ill_formed(&self, at: usize, error: &dyn std::fmt::Display) -> Error {
        self.source.error_line(at, format!("not well-formed XML: {}", passage(&error.to_string())))
    }

    fn attributes(&self, element: &BytesStart<'_>, at: usize) -> Result<Vec<(String, String)>> {
        let mut found = Vec::new();
        // The check for duplicates is quadratic, so it is disabled; no element of this format has more than 64
        // attributes.
        for attribute in element.attributes().with_checks(false).take(64) {
            let attribute = attribute.map_err(|e| self.ill_formed(at, &e))?;
            let value = quick_xml::escape::unescape(&attribute.value);
            let value = value.map_err(|e| self.ill_formed(at, &e))?;
            found.push((attribute.key.as_ref().to_owned(), value.into_owned()));
        }
        Ok(found)
    }

    fn root(&self, attributes: &[(String, String)], at: usize) -> Result<Root> {
        let kind = get(attributes, "type").unwrap_or("");
        let version = excerpt(get(attributes, "version").unwrap_or("without a version").as_bytes());
        let is_parallel = kind.strip_prefix('P').and_then(GridKind::of).is_some_and(|kind| kind != GridKind::Surface);
        if is_parallel || LISTS.contains(&kind) {
            let list = List { format: format!("VTK XML {kind} {version}"), files: Vec::new() };
            return Ok(Root::List(list, is_parallel || kind == "vtkPartitionedDataSet"));
        }
        if GridKind::of(kind).is_none() {
            return Err(self.source.error_line(
                at,
                format!(
                    "a VTK XML file of type `{}`, which cannot be read; save it as an unstructured grid (.vtu)",
                    excerpt(kind.as_bytes())
                ),
            ));
        }
        let codec = Codec::new(|name| get(attributes, name)).map_err(|message| self.source.error_line(at, message))?;
        let grid = match GridKind::of(kind) {
            Some(GridKind::Surface) => "surface",
            Some(GridKind::Structured) => "structured grid",
            Some(GridKind::Rectilinear) => "rectilinear grid",
            Some(GridKind::Image(_)) => "image",
            _ => "unstructured grid",
        };
        let format = format!("VTK XML {grid} {version}{}", codec.describe());
        Ok(Root::Grid(codec, format))
    }

    fn open(&mut self, element: &BytesStart<'_>, at: usize) -> Result<()> {
        let parent = self.stack.last().map(String::as_str);
        match (element.name().as_ref(), parent) {
            ("VTKFile", None) => {
                let attributes = self.attributes(element, at)?;
                self.root = Some(self.root(&attributes, at)?);
                self.kind = get(&attributes, "type").and_then(GridKind::of).unwrap_or(GridKind::Cells);
            }
            (name, None) => {
                let message = format!("an XML or HTML document <{}>, not a VTK file", excerpt(name.as_bytes()));
                return Err(self.source.error_line(at, message));
            }
            (name @ ("Piece" | "Partitions" | "DataSet"), parent) if matches!(self.root, Some(Root::List(..))) => {
                let is_part = name == "DataSet" && matches!(parent, Some("Piece" | "Partitions"));
                let attributes = self.attributes(element, at)?;
                let path = get(&attributes, if name == "Piece" { "Source" } else { "file" });
                if let Some(Root::List(list, one_block)) = &mut self.root {
                    self.block += usize::from(!*one_block && !is_part);
                    // A block without a file is empty.
                    let step = get(&attributes, "timestep").map(Into::into);
                    list.files.extend(path.map(|path| Listed { path: path.into(), step, block: self.block, at }));
                }
            }
            ("ImageData", Some("VTKFile")) => {
                let attributes = self.attributes(element, at)?;
                if matches!(self.kind, GridKind::Image(_)) {
                    self.kind = GridKind::Image(self.frame(&attributes, at)?);
                }
            }
            ("Piece", _) if self.kind.has_lattice() => {
                let attributes = self.attributes(element, at)?;
                let text = get(&attributes, "Extent").unwrap_or("");
                let wrong = || format!("Extent=\"{}\" is not the extent of fewer than 2^32 points", excerpt(text.as_bytes()));
                let lattice = Lattice::parse(text).ok_or_else(|| self.source.error_line(at, wrong()))?;
                self.pieces.push(Piece {
                    at,
                    points: lattice.points(),
                    cells: lattice.cells(),
                    lattice: Some(lattice),
                    ..Piece::default()
                });
            }
            ("Piece", _) => {
                let attributes = self.attributes(element, at)?;
                let number = |name: &str| {
                    let text = get(&attributes, name).unwrap_or("");
                    let wrong = || self.source.error_line(at, format!("{name}=\"{}\" is not a count", excerpt(text.as_bytes())));
                    text.trim().parse::<u64>().map_err(|_| wrong())
                };
                let cells = if self.kind == GridKind::Surface { 0 } else { number("NumberOfCells")? };
                let piece = Piece { at, points: number("NumberOfPoints")?, cells, ..Piece::default() };
                self.pieces.push(piece);
            }
            ("DataArray", Some("CellData")) if self.kind == GridKind::Surface => self.left_out = true,
            ("DataArray", Some(group @ ("PointData" | "CellData" | "Points" | "Cells" | "Coordinates"))) => {
                let group = group.to_owned();
                let attributes = self.attributes(element, at)?;
                self.left_out = get(&attributes, "TimeStep").is_some_and(|steps| !self.steps.are_wanted(steps));
                if group == "Points" && !self.left_out && self.pieces.last().is_some_and(|piece| piece.positions.is_some()) {
                    (self.left_out, self.second_points) = (true, true);
                }
                if self.left_out {
                    return Ok(());
                }
                let array = self.array(&attributes, at)?;
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

    /// The frame of an image.
    fn frame(&self, attributes: &[(String, String)], at: usize) -> Result<Frame> {
        let numbers = |name: &str, count: usize| {
            let Some(text) = get(attributes, name) else { return Ok(None) };
            let numbers = text.split_ascii_whitespace().map(|number| parse_float(number.as_bytes())).collect::<Option<Vec<f64>>>();
            let found = numbers.filter(|numbers| numbers.len() == count).map(Some);
            found.ok_or_else(|| self.source.error_line(at, format!("{name}=\"{}\" is not {count} numbers", excerpt(text.as_bytes()))))
        };
        let unit = Frame::default();
        let (origin, spacing, direction) = (numbers("Origin", 3)?, numbers("Spacing", 3)?, numbers("Direction", 9)?);
        let column = |c: usize| direction.as_ref().map_or(unit.steps[c], |d| [d[c], d[3 + c], d[6 + c]]);
        let spacing = spacing.unwrap_or_else(|| vec![1.0; 3]);
        let steps = [0, 1, 2].map(|c| column(c).map(|x| x * spacing[c]));
        Ok(Frame { origin: origin.map_or(unit.origin, |o| [o[0], o[1], o[2]]), steps })
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
        if last != "DataArray" || self.left_out {
            return;
        }
        let Some(piece) = self.pieces.last_mut() else { return };
        let array = match group.as_str() {
            "PointData" => piece.point_data.last_mut(),
            "CellData" => piece.cell_data.last_mut(),
            "Points" => piece.positions.as_mut(),
            "Cells" | "Coordinates" => piece.topology.last_mut(),
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
