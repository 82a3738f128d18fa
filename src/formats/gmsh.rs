//! Gmsh files (`.msh`), versions 2.0–2.2, 4.0 and 4.1, text and binary of either byte order, with node and element data.

use std::collections::{HashMap, HashSet};

use super::LoadOptions;
use super::assemble::{Array, Assembly};
use super::budget::Budget;
use super::gmsh_data::View;
use super::gmsh_elements::Elements;
use super::scalar::Scalar;
use super::source::{Source, Tokens, printable};
use super::tags::Tags;
use crate::error::{Error, Result};
use crate::mesh::On;

#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Version {
    V2,
    V40,
    V41,
}

/// Reads numbers as text or binary.
pub(crate) struct Reader<'a> {
    pub source: &'a Source,
    pub tokens: Tokens<'a>,
    pub binary: bool,
    big_endian: bool,
}

#[derive(Default)]
struct Content {
    tags: Vec<i64>,
    points: Vec<[f64; 3]>,
    elements: Elements,
    /// First physical group of each volume.
    groups: HashMap<i64, i64>,
    views: Vec<View>,
    has: [bool; 2],
    /// Sections that are not read, but may matter.
    skipped: Vec<String>,
}

pub(crate) fn read<'a>(source: &'a Source, options: &LoadOptions) -> Result<Assembly<'a>> {
    let tokens = Tokens::new(source, 0..source.bytes.len(), None);
    let mut reader = Reader { source, tokens, binary: false, big_endian: false };
    let mut version = None;
    let mut content = Content::default();
    while let Some((token, at)) = reader.tokens.next_token() {
        let Some(name) = token.strip_prefix(b"$") else {
            return Err(source.error_line(at, format!("`{}` where a section ($…) should be", printable(token))));
        };
        match (name, version) {
            (b"MeshFormat", None) => version = Some(reader.format()?),
            (b"NOD" | b"ELM", _) => return Err(old(source, at, "1.0")),
            (b"Comments", None) => reader.skip(name, at)?,
            (_, None) => return Err(source.error_line(at, format!("section ${} before $MeshFormat", printable(name)))),
            (b"Nodes", Some(version)) => {
                reader.once(&mut content.has[0], name, at)?;
                reader.nodes(version, &mut content)?;
                reader.end(b"$EndNodes")?;
            }
            (b"Elements", Some(version)) => {
                reader.once(&mut content.has[1], name, at)?;
                match version {
                    Version::V2 => reader.elements_2(&mut content.elements)?,
                    _ => reader.elements_4(version, &mut content.elements)?,
                }
                reader.end(b"$EndElements")?;
            }
            (b"Entities", Some(version @ (Version::V40 | Version::V41))) => {
                reader.entities(version, &mut content.groups)?;
                reader.end(b"$EndEntities")?;
            }
            (b"NodeData", Some(_)) => content.views.push(reader.view(On::Points, b"$EndNodeData")?),
            (b"ElementData", Some(_)) => content.views.push(reader.view(On::Cells, b"$EndElementData")?),
            _ => {
                let shown = format!("${}", printable(name));
                let known: [&[u8]; 4] = [b"PhysicalNames", b"Periodic", b"Comments", b"InterpolationScheme"];
                if !known.contains(&name) && content.skipped.len() < 12 && !content.skipped.contains(&shown) {
                    content.skipped.push(shown);
                }
                reader.skip(name, at)?;
            }
        }
    }
    let Some(version) = version else { return Err(source.error("no section $MeshFormat")) };
    for (has, name) in content.has.iter().zip(["$Nodes", "$Elements"]) {
        if !has {
            return Err(source.error_line(source.bytes.len(), format!("the file ends, and there was no {name}")));
        }
    }
    let name = match version {
        Version::V2 => "2.2",
        Version::V40 => "4.0",
        Version::V41 => "4.1",
    };
    let mut assembly = Assembly::new(source, format!("Gmsh {name}, {}", if reader.binary { "binary" } else { "text" }));
    assembly.padding = Budget::new(source.bytes.len(), options);
    if !content.skipped.is_empty() {
        assembly.warnings.push(format!("sections that are not read: {}", content.skipped.join(", ")));
    }
    content.assemble(source, &mut assembly)?;
    Ok(assembly)
}

fn old(source: &Source, at: usize, version: &str) -> Error {
    source.error_line(
        at,
        format!("Gmsh format {version}; 2.2, 4.0 and 4.1 can be read: convert it with `gmsh IN -save -format msh41 -o OUT.msh`"),
    )
}

impl Content {
    fn assemble(mut self, source: &Source, assembly: &mut Assembly<'_>) -> Result<()> {
        if let Some(bad) = self.tags.iter().find(|&&t| t < 1) {
            return Err(source.error_in("$Nodes", format!("node number {bad}; they must be positive")));
        }
        let points = Tags::new(&self.tags, false);
        let points = points.map_err(|tag| source.error_in("$Nodes", format!("two nodes have the number {tag}")))?;
        assembly.points = std::mem::take(&mut self.points);
        let elements = &mut self.elements;
        assembly.reserve(elements.kinds.len());
        let mut rest = elements.nodes.as_mut_slice();
        for (i, &kind) in elements.kinds.iter().enumerate() {
            let (nodes, after) = rest.split_at_mut(kind.nodes.unwrap_or(0));
            rest = after;
            for node in &mut *nodes {
                let found = points.get(*node).map(i64::from);
                *node = found.ok_or_else(|| {
                    let place = format!("cell {i} ({}, element {} of the file)", kind.name, elements.tags[i]);
                    source.error_in(place, format!("node {node} does not exist"))
                })?;
            }
            assembly.push(kind, nodes, 0)?;
        }
        self.marks(assembly);
        let cells = Tags::new(&self.elements.tags, true).unwrap_or(Tags::Dense { first: 0, table: Vec::new() });
        let mut seen = HashSet::new();
        for view in std::mem::take(&mut self.views) {
            let (tags, count) = if view.on == On::Points { (&points, assembly.points.len()) } else { (&cells, self.elements.kinds.len()) };
            match view.array(tags, count, &mut assembly.padding) {
                Ok(mut array) => {
                    if !seen.insert((view.on, view.name)) {
                        array.name = format!("{} (step {})", array.name, view.step);
                    }
                    assembly.arrays.push(array);
                }
                Err(warning) => assembly.warnings.push(warning),
            }
        }
        Ok(())
    }

    /// The group and the geometric entity of each element as fields, where there are several.
    fn marks(&self, assembly: &mut Assembly<'_>) {
        let physical: Vec<i64> = if self.groups.is_empty() {
            self.elements.physical.clone()
        } else {
            let group = |entity: &i64| self.groups.get(entity).copied().unwrap_or(0);
            self.elements.entities.iter().map(group).collect()
        };
        for (name, marks) in [("gmsh:physical", &physical), ("gmsh:geometrical", &self.elements.entities)] {
            if marks.len() == self.elements.kinds.len() && marks.iter().any(|m| *m != 0) {
                let values = marks.iter().map(|&m| m as f32).collect();
                assembly.arrays.push(Array { name: name.into(), on: On::Cells, components: 1, values });
            }
        }
    }
}

impl Reader<'_> {
    fn once(&self, seen: &mut bool, name: &[u8], at: usize) -> Result<()> {
        if std::mem::replace(seen, true) {
            return Err(self.source.error_line(at, format!("a second section ${}", printable(name))));
        }
        Ok(())
    }

    fn format(&mut self) -> Result<Version> {
        let (number, at) = self.tokens.word("the version")?;
        let version = match number {
            b"2" | b"2.0" | b"2.1" | b"2.2" => Version::V2,
            b"4" | b"4.0" => Version::V40,
            b"4.1" => Version::V41,
            other => return Err(old(self.source, at, &printable(other))),
        };
        self.binary = match self.tokens.integer("the file type (0 or 1)")? {
            0 => false,
            1 => true,
            other => return Err(self.source.error_line(at, format!("file type {other}, neither 0 (text) nor 1 (binary)"))),
        };
        let size = self.tokens.integer("the data size")?;
        if self.binary {
            if size != 8 {
                return Err(self.source.error_line(at, format!("binary data of size {size}; 8 is the only one that can be read")));
            }
            self.tokens.line();
            let probe = self.source.bytes.get(self.tokens.at..self.tokens.at + 4).unwrap_or_default();
            self.big_endian = match probe {
                [1, 0, 0, 0] => false,
                [0, 0, 0, 1] => true,
                other => {
                    return Err(self
                        .source
                        .error_byte(self.tokens.at, format!("{other:?} where the integer 1 should tell the byte order")));
                }
            };
            self.tokens.at += 4;
        }
        self.end(b"$EndMeshFormat")?;
        Ok(version)
    }

    pub fn end(&mut self, name: &[u8]) -> Result<()> {
        let (token, at) = self.tokens.word(&printable(name))?;
        if token == name {
            return Ok(());
        }
        let message = format!("`{}` where {} should be", printable(token), printable(name));
        Err(if self.binary { self.source.error_byte(at, message) } else { self.source.error_line(at, message) })
    }

    /// Skips a section by looking for its end.
    fn skip(&mut self, name: &[u8], at: usize) -> Result<()> {
        let end = [b"$End", name].concat();
        let rest = &self.source.bytes[self.tokens.at..];
        let found = rest.windows(end.len()).position(|w| w == end);
        let found = found.ok_or_else(|| self.source.error_line(at, format!("section ${0} without $End{0}", printable(name))))?;
        self.tokens.at += found + end.len();
        Ok(())
    }

    /// Bytes of binary data.
    fn bytes(&mut self, n: usize, what: &str) -> Result<&[u8]> {
        let at = self.tokens.at;
        let end = at.checked_add(n).filter(|&end| end <= self.source.bytes.len());
        let end = end.ok_or_else(|| self.source.error_byte(at, format!("the file ends where {what} should be")))?;
        self.tokens.at = end;
        Ok(&self.source.bytes[at..end])
    }

    fn number<T: super::scalar::Number + Default>(&mut self, scalar: Scalar, what: &str) -> Result<T> {
        let big = self.big_endian;
        let bytes = self.bytes(scalar.size(), what)?;
        Ok(scalar.convert(bytes, big).first().copied().unwrap_or_default())
    }

    /// An integer of 4 bytes in binary.
    pub fn int(&mut self, what: &str) -> Result<i64> {
        if self.binary { self.number(Scalar::I32, what) } else { self.tokens.integer(what) }
    }

    /// An unsigned integer of 8 bytes in binary, which counts or numbers something.
    pub fn long(&mut self, what: &str) -> Result<i64> {
        if self.binary { self.number(Scalar::U64, what) } else { self.tokens.integer(what) }
    }

    pub fn real(&mut self, what: &str) -> Result<f64> {
        if self.binary { self.number(Scalar::F64, what) } else { self.tokens.float(what) }
    }

    /// How many things follow, of at least `each` bytes in binary and two in text.
    pub fn bounded(&self, n: i64, each: usize, what: &str) -> Result<usize> {
        let room = self.tokens.left() / if self.binary { each.max(1) } else { 2 } + 1;
        usize::try_from(n).ok().filter(|&n| n <= room).ok_or_else(|| {
            let message = format!("{n} {what} are announced, but the rest of the file has room for {room} at most");
            if self.binary { self.source.error_byte(self.tokens.at, message) } else { self.source.error_line(self.tokens.at, message) }
        })
    }

    fn nodes(&mut self, version: Version, content: &mut Content) -> Result<()> {
        if version == Version::V2 {
            let n = self.tokens.integer("the number of nodes")?;
            if self.binary {
                self.tokens.line();
            }
            let n = self.bounded(n, 28, "nodes")?;
            content.tags.reserve(n);
            content.points.reserve(n);
            for _ in 0..n {
                content.tags.push(self.int("the number of a node")?);
                content.points.push(self.point()?);
            }
            return Ok(());
        }
        if self.binary {
            self.tokens.line();
        }
        let blocks = self.long("the number of blocks")?;
        let n = self.long("the number of nodes")?;
        let n = self.bounded(n, 28, "nodes")?;
        if version == Version::V41 {
            self.long("the smallest number of a node")?;
            self.long("the largest number of a node")?;
        }
        content.tags.reserve(n);
        content.points.reserve(n);
        for _ in 0..blocks.max(0) {
            let at = self.tokens.at;
            let [first, second] = [self.int("an entity")?, self.int("an entity")?];
            let dimension = if version == Version::V41 { first } else { second };
            let parametric = self.int("0 or 1 (parametric)")?;
            let fail = |message: String| self.source.error_byte(at, message);
            if !(0..=3).contains(&dimension) || !(0..=1).contains(&parametric) {
                return Err(fail(format!("a block of nodes of dimension {dimension} with parametric = {parametric}")));
            }
            let extra = if parametric == 1 { dimension } else { 0 };
            let in_block = self.long("the number of nodes in a block")?;
            let in_block = usize::try_from(in_block).ok().filter(|&b| b <= n - content.points.len());
            let in_block =
                in_block.ok_or_else(|| self.source.error_byte(at, format!("a block of nodes goes past the {n} that are announced")))?;
            if version == Version::V41 {
                for _ in 0..in_block {
                    content.tags.push(self.long("the number of a node")?);
                }
            }
            for _ in 0..in_block {
                if version == Version::V40 {
                    content.tags.push(self.int("the number of a node")?);
                }
                content.points.push(self.point()?);
                for _ in 0..extra {
                    self.real("a parametric coordinate")?;
                }
            }
        }
        if content.points.len() != n {
            let message = format!("$Nodes: {n} nodes are announced, {} are there", content.points.len());
            return Err(self.source.error_byte(self.tokens.at, message));
        }
        Ok(())
    }

    fn point(&mut self) -> Result<[f64; 3]> {
        Ok([self.real("a coordinate")?, self.real("a coordinate")?, self.real("a coordinate")?])
    }

    /// The first physical group of each volume.
    fn entities(&mut self, version: Version, groups: &mut HashMap<i64, i64>) -> Result<()> {
        if self.binary {
            self.tokens.line();
        }
        let mut counts = [0; 4];
        for count in &mut counts {
            let n = self.long("the number of entities")?;
            *count = self.bounded(n, 36, "entities")?;
        }
        for (dimension, count) in counts.into_iter().enumerate() {
            for _ in 0..count {
                let tag = self.int("the number of an entity")?;
                // A point has a box as well in 4.0.
                for _ in 0..if dimension == 0 && version == Version::V41 { 3 } else { 6 } {
                    self.real("the bounds of an entity")?;
                }
                let n = self.long("the number of physical groups")?;
                for i in 0..self.bounded(n, 4, "physical groups")? {
                    let group = self.int("a physical group")?;
                    if i == 0 && dimension == 3 {
                        groups.entry(tag).or_insert(group);
                    }
                }
                if dimension > 0 {
                    let n = self.long("the number of bounding entities")?;
                    for _ in 0..self.bounded(n, 4, "bounding entities")? {
                        self.int("a bounding entity")?;
                    }
                }
            }
        }
        Ok(())
    }
}
