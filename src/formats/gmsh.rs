//! Reader for Gmsh files (`.msh`), versions 2.0–2.2, 4.0 and 4.1, text and binary of either byte order, with node and
//! element data.

mod data;
mod elements;
mod reader;

use std::collections::HashMap;

use super::array::Array;
use super::assemble::Assembly;
use super::scalar::Scalar;
use super::source::{Source, excerpt};
use super::tags::Tags;
use super::{LoadOptions, TimeStep};
use crate::error::Result;
use crate::mesh::On;
use data::{View, keep_step};
use elements::{Elements, kinds};
use reader::{Reader, Version, old};

#[derive(Default)]
struct Content {
    tags: Vec<i64>,
    points: Vec<[f64; 3]>,
    elements: Elements,
    /// First physical group of each volume entity.
    groups: HashMap<i64, i64>,
    views: Vec<View>,
    has: [bool; 2],
    /// Sections that are not read but may matter.
    skipped: Vec<String>,
}

pub(crate) fn read(source: &Source, options: &LoadOptions) -> Result<Assembly> {
    let mut reader = Reader::new(source);
    let mut version = None;
    let mut content = Content::default();
    while let Some((token, at)) = reader.tokens.next_token()? {
        let Some(name) = token.strip_prefix(b"$").map(<[u8]>::to_vec) else {
            return Err(source.error_line(at, format!("`{}` where a section ($…) should be", excerpt(token))));
        };
        let name = name.as_slice();
        match (name, version) {
            (b"MeshFormat", None) => version = Some(reader.format()?),
            (b"MeshFormat", Some(version)) => {
                if reader.format()? != version {
                    return Err(source.error_line(at, "a second section $MeshFormat, with another version"));
                }
            }
            (b"NOD" | b"ELM", _) => return Err(old(source, at, "1.0")),
            (b"Comments", None) => reader.skip(name, at)?,
            (_, None) => return Err(source.error_line(at, format!("section ${} before $MeshFormat", excerpt(name)))),
            (b"Nodes" | b"Elements" | b"ParametricNodes", Some(version)) if content.has[usize::from(name == b"Elements")] => {
                let n = if name == b"Elements" { content.elements.types.len() } else { content.points.len() };
                reader.repeated(version, name, at, n)?;
            }
            (b"Nodes", Some(version)) => {
                content.has[0] = true;
                reader.nodes(version, false, &mut content)?;
                reader.end(b"$EndNodes")?;
            }
            (b"ParametricNodes", Some(Version::V2)) => {
                content.has[0] = true;
                reader.nodes(Version::V2, true, &mut content)?;
                reader.end(b"$EndParametricNodes")?;
            }
            (b"Elements", Some(version)) => {
                content.has[1] = true;
                match version {
                    Version::V2 => reader.elements_2(&mut content.elements)?,
                    _ => reader.elements_4(version, &mut content.elements)?,
                }
                reader.end(b"$EndElements")?;
            }
            (b"Entities", Some(version @ (Version::V40 | Version::V41))) => {
                reader.entities(version, false, &mut content.groups)?;
                reader.end(b"$EndEntities")?;
            }
            (b"PartitionedEntities", Some(version @ (Version::V40 | Version::V41))) => {
                reader.entities(version, true, &mut content.groups)?;
                reader.end(b"$EndPartitionedEntities")?;
            }
            (b"NodeData", Some(_)) => content.views.push(reader.view(On::Points, b"$EndNodeData")?),
            (b"ElementData", Some(_)) => content.views.push(reader.view(On::Cells, b"$EndElementData")?),
            _ => {
                let shown = format!("${}", excerpt(name));
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
            return Err(source.error_line(source.len(), format!("the file ends, and there was no {name}")));
        }
    }
    let name = match version {
        Version::V2 => "2.2",
        Version::V40 => "4.0",
        Version::V41 => "4.1",
    };
    let mut assembly = Assembly::new(source, options, format!("Gmsh {name}, {}", if reader.binary { "binary" } else { "text" }));
    if !content.skipped.is_empty() {
        assembly.warnings.push(format!("sections that are not read: {}", content.skipped.join(", ")));
    }
    content.assemble(source, options.step, &mut assembly)?;
    Ok(assembly)
}

impl Content {
    fn assemble(mut self, source: &Source, step: TimeStep, assembly: &mut Assembly) -> Result<()> {
        if let Some(bad) = self.tags.iter().find(|&&t| t < 1) {
            return Err(source.error_in("$Nodes", format!("node number {bad}; they must be positive")));
        }
        let points = Tags::new(&self.tags, false);
        let points = points.map_err(|tag| source.error_in("$Nodes", format!("two nodes have the number {tag}")))?;
        assembly.set_points(std::mem::take(&mut self.points));
        assembly.point_tags = std::mem::take(&mut self.tags);
        let elements = &mut self.elements;
        assembly.reserve(elements.types.len());
        let mut rest = elements.nodes.as_mut_slice();
        for (i, kind) in kinds(&elements.types).enumerate() {
            let (nodes, after) = rest.split_at_mut(kind.nodes.unwrap_or(0));
            rest = after;
            for node in &mut *nodes {
                let found = points.get(*node).map(i64::from);
                *node = found.ok_or_else(|| {
                    let place = format!("cell {i} ({}, element {} of the file)", kind.name, elements.tags[i]);
                    source.error_in(place, format!("node {node} does not exist"))
                })?;
            }
            assembly.push(kind, nodes)?;
        }
        let repeated = self.elements.repeated();
        if repeated > 0 {
            let why = "their volume belongs to several physical groups, so all of them count as boundary";
            assembly.warnings.push(format!("{repeated} repeated cells: {why}; save the file as version 4.1"));
        }
        self.marks(assembly);
        let cells = Tags::new(&self.elements.tags, true).unwrap_or(Tags::Dense { first: 0, table: Vec::new() });
        assembly.warnings.extend(keep_step(&mut self.views, step, source)?);
        for view in std::mem::take(&mut self.views) {
            let (tags, count) = if view.on == On::Points { (&points, assembly.n_points()) } else { (&cells, self.elements.types.len()) };
            match view.array(tags, count, &mut assembly.padding) {
                Ok(array) => assembly.arrays.push(array),
                Err(warning) => assembly.warnings.push(warning),
            }
        }
        Ok(())
    }

    /// Adds the physical group and the geometric entity of each element as fields, if any of them is not 0.
    fn marks(&self, assembly: &mut Assembly) {
        let physical: Vec<i64> = if self.groups.is_empty() {
            self.elements.physical.clone()
        } else {
            let group = |entity: &i64| self.groups.get(entity).copied().unwrap_or(0);
            self.elements.entities.iter().map(group).collect()
        };
        for (name, marks) in [("gmsh:physical", &physical), ("gmsh:geometrical", &self.elements.entities)] {
            if marks.len() == self.elements.types.len() && marks.iter().any(|m| *m != 0) {
                let values: Vec<f64> = marks.iter().map(|&m| m as f64).collect();
                assembly.arrays.push(Array::whole(name.into(), On::Cells, &values));
            }
        }
    }
}

impl Reader<'_> {
    /// Reads nodes. `parametric` tells that those of version 2 have parameters on the geometric entity that they lie on; in
    /// version 4, each block tells.
    fn nodes(&mut self, version: Version, parametric: bool, content: &mut Content) -> Result<()> {
        if version == Version::V2 {
            let n = self.tokens.integer("the number of nodes")?;
            if self.binary {
                self.tokens.line()?;
            }
            let n = self.bounded(n, 28, "nodes")?;
            content.tags.reserve(n);
            content.points.reserve(n);
            for _ in 0..n {
                content.tags.push(self.int("the number of a node")?);
                content.points.push(self.point()?);
                if parametric {
                    let dimension = self.int("the dimension of an entity")?;
                    self.int("the number of an entity")?;
                    // Points and volumes have no parameters.
                    for _ in 0..if matches!(dimension, 1 | 2) { dimension } else { 0 } {
                        self.real("a parametric coordinate")?;
                    }
                }
            }
            return Ok(());
        }
        if self.binary {
            self.tokens.line()?;
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
                if self.binary {
                    self.rows(Scalar::U64, [in_block, 1], "numbers of nodes", |row| content.tags.push(row[0]))?;
                    let width = 3 + extra as usize;
                    self.rows(Scalar::F64, [in_block, width], "nodes", |row| content.points.push([row[0], row[1], row[2]]))?;
                    continue;
                }
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

    /// Reads the first physical group of each volume entity. In a mesh that is partitioned, the elements belong to
    /// parts of entities; a part without a group belongs to the group of its parent.
    fn entities(&mut self, version: Version, partitioned: bool, groups: &mut HashMap<i64, i64>) -> Result<()> {
        if self.binary {
            self.tokens.line()?;
        }
        if partitioned {
            self.long("the number of partitions")?;
            let n = self.long("the number of ghost entities")?;
            for _ in 0..self.bounded(n, 8, "ghost entities")? {
                self.int("the number of a ghost entity")?;
                self.int("the partition of a ghost entity")?;
            }
        }
        let mut counts = [0; 4];
        for count in &mut counts {
            let n = self.long("the number of entities")?;
            *count = self.bounded(n, 36, "entities")?;
        }
        for (dimension, count) in counts.into_iter().enumerate() {
            for _ in 0..count {
                let tag = self.int("the number of an entity")?;
                let parent = if partitioned { self.parent()? } else { None };
                // In version 4.0 a point has a bounding box as well.
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
                if let Some(&group) = parent.filter(|_| dimension == 3).and_then(|parent| groups.get(&parent)) {
                    groups.entry(tag).or_insert(group);
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

    /// Reads the parent and the partitions of a part of an entity; returns the number of the parent if it is a volume.
    fn parent(&mut self) -> Result<Option<i64>> {
        let [dimension, tag] = [self.int("the dimension of a parent entity")?, self.int("the number of a parent entity")?];
        let n = self.long("the number of partitions of an entity")?;
        for _ in 0..self.bounded(n, 4, "partitions of an entity")? {
            self.int("a partition")?;
        }
        Ok((dimension == 3).then_some(tag))
    }
}
