//! Reader for `$Elements` of Gmsh files.

use std::collections::{HashMap, HashSet};

use super::super::cells::{self, CellType};
use super::super::scalar::Scalar;
use super::super::source::{Source, excerpt};
use super::super::tokens::parse_integer;
use super::reader::{Reader, Version};
use crate::error::Result;

/// The elements as stored in the file.
#[derive(Default)]
pub(crate) struct Elements {
    pub tags: Vec<i64>,
    /// Number of the type of each element.
    pub types: Vec<u8>,
    /// Node tags of all elements, one after the other.
    pub nodes: Vec<i64>,
    pub physical: Vec<i64>,
    pub entities: Vec<i64>,
}

/// The element types with these numbers, which are known to exist.
pub(crate) fn kinds(types: &[u8]) -> impl Iterator<Item = CellType> {
    types.iter().filter_map(|&number| cells::gmsh(number.into()))
}

impl Reader<'_> {
    /// An element type, and its number.
    fn kind(&self, number: i64, at: usize) -> Result<(CellType, u8)> {
        cells::gmsh(number).zip(u8::try_from(number).ok()).ok_or_else(|| {
            let message = format!("unknown element type {number}");
            if self.binary { self.source.error_byte(at, message) } else { self.source.error_line(at, message) }
        })
    }

    /// Limits the reader to the next line that is not empty, so that a short line is reported at its own position.
    /// Returns the position of the line, and what undoes that.
    fn line(&mut self, what: &str) -> Result<(usize, usize)> {
        self.tokens.skip_space()?;
        let at = self.tokens.at;
        if self.tokens.left() == 0 {
            return Err(self.source.error_line(at, format!("the file ends where {what} should be")));
        }
        Ok((at, self.tokens.narrow()?))
    }

    pub(crate) fn elements_2(&mut self, elements: &mut Elements) -> Result<()> {
        let n = self.tokens.integer("the number of elements")?;
        if self.binary {
            self.tokens.line()?;
            let n = self.bounded(n, 8, "elements")?;
            return self.elements_2_binary(n, elements);
        }
        let n = self.bounded(n, 8, "elements")?;
        for _ in 0..n {
            let (at, end) = self.line("an element")?;
            let tag = self.tokens.integer("the number of an element")?;
            let number = self.tokens.integer("the type of an element")?;
            let marks = self.tokens.count("the number of tags of an element")?;
            let mut two = [0; 2];
            for i in 0..marks {
                let mark = self.tokens.integer("a tag of an element")?;
                if let Some(slot) = two.get_mut(i) {
                    *slot = mark;
                }
            }
            let first = elements.nodes.len();
            self.line_of_nodes(elements)?;
            self.tokens.widen(end);
            let (kind, number) = self.kind(number, at)?;
            elements.check(self.source, at, kind, tag, first)?;
            elements.mark(number, tag, two);
        }
        Ok(())
    }

    /// Reads the nodes in the rest of a line.
    fn line_of_nodes(&mut self, elements: &mut Elements) -> Result<()> {
        while let Some((token, at)) = self.tokens.next_token()? {
            let node = parse_integer(token);
            let node = node.ok_or_else(|| self.source.error_line(at, format!("`{}` where a node should be", excerpt(token))))?;
            elements.nodes.push(node);
        }
        Ok(())
    }

    fn elements_2_binary(&mut self, n: usize, elements: &mut Elements) -> Result<()> {
        while elements.types.len() < n {
            let at = self.tokens.at;
            let number = self.int("the type of elements")?;
            let follow = self.int("the number of elements in a block")?;
            let marks = self.int("the number of tags of elements")?;
            let (kind, number) = self.kind(number, at)?;
            let fail = |message: String| self.source.error_byte(at, message);
            let follow = usize::try_from(follow).ok().filter(|&f| f > 0 && f <= n - elements.types.len());
            let follow =
                follow.ok_or_else(|| fail(format!("a block of elements that goes past the {n} that are announced, or is empty")))?;
            let marks = usize::try_from(marks).ok().filter(|&m| m <= self.tokens.left() / 4);
            let marks = marks.ok_or_else(|| fail("more tags than the rest of the file can hold".into()))?;
            let width = 1 + marks + kind.nodes.unwrap_or(0);
            self.rows(Scalar::I32, [follow, width], "elements", |row| {
                let (tag, nodes) = (row[0], &row[1 + marks..]);
                elements.nodes.extend_from_slice(nodes);
                elements.mark(number, tag, [0, 1].map(|i| if i < marks { row[1 + i] } else { 0 }));
            })?;
        }
        Ok(())
    }

    pub(crate) fn elements_4(&mut self, version: Version, elements: &mut Elements) -> Result<()> {
        if self.binary {
            self.tokens.line()?;
        }
        let blocks = self.long("the number of blocks")?;
        let n = self.long("the number of elements")?;
        let n = self.bounded(n, 8, "elements")?;
        if version == Version::V41 {
            self.long("the smallest number of an element")?;
            self.long("the largest number of an element")?;
        }
        for _ in 0..blocks.max(0) {
            let at = self.tokens.at;
            let [first, second] = [self.int("an entity")?, self.int("an entity")?];
            let (dimension, entity) = if version == Version::V41 { (first, second) } else { (second, first) };
            let number = self.int("the type of elements")?;
            let in_block = self.long("the number of elements in a block")?;
            let (kind, number) = self.kind(number, at)?;
            let in_block = usize::try_from(in_block).ok().filter(|&b| b <= n - elements.types.len());
            let in_block =
                in_block.ok_or_else(|| self.source.error_byte(at, format!("a block of elements goes past the {n} that are announced")))?;
            let two = [0, if dimension == 3 { entity } else { 0 }];
            if self.binary {
                let scalar = if version == Version::V41 { Scalar::U64 } else { Scalar::I32 };
                self.rows(scalar, [in_block, 1 + kind.nodes.unwrap_or(0)], "elements", |row| {
                    elements.nodes.extend_from_slice(&row[1..]);
                    elements.mark(number, row[0], two);
                })?;
                continue;
            }
            for _ in 0..in_block {
                let (at, end) = self.line("an element")?;
                let tag = self.tokens.integer("the number of an element")?;
                let first = elements.nodes.len();
                self.line_of_nodes(elements)?;
                self.tokens.widen(end);
                elements.check(self.source, at, kind, tag, first)?;
                elements.mark(number, tag, two);
            }
        }
        if elements.types.len() != n {
            let message = format!("$Elements: {n} elements are announced, {} are there", elements.types.len());
            return Err(self.source.error_byte(self.tokens.at, message));
        }
        Ok(())
    }
}

impl Elements {
    /// Checks the number of nodes of the next element, of which `first` is the first.
    fn check(&self, source: &Source, at: usize, kind: CellType, tag: i64, first: usize) -> Result<()> {
        let (found, wanted) = (self.nodes.len() - first, kind.nodes.unwrap_or(0));
        if found == wanted {
            return Ok(());
        }
        Err(source.error_line(at, format!("element {tag} ({}) has {found} nodes instead of {wanted}", kind.name)))
    }

    /// The number of volume cells that are repeats: version 2 has the cells of a volume once for each physical group.
    pub fn repeated(&self) -> usize {
        let mut groups = HashMap::new();
        let marks = kinds(&self.types).zip(&self.entities).zip(&self.physical).filter(|((kind, _), _)| kind.shape.corners() > 0);
        if marks.into_iter().all(|((_, entity), group)| *groups.entry(entity).or_insert(group) == group) {
            return 0;
        }
        let mut rest = self.nodes.as_slice();
        let mut seen = HashSet::new();
        let again = |kind: &CellType| {
            let (nodes, after) = rest.split_at(kind.nodes.unwrap_or(0));
            rest = after;
            let mut corners = [i64::MAX; 8];
            let n = kind.shape.corners();
            corners[..n].copy_from_slice(&nodes[..n]);
            corners.sort_unstable();
            n > 0 && !seen.insert(corners)
        };
        kinds(&self.types).filter(again).count()
    }

    fn mark(&mut self, number: u8, tag: i64, marks: [i64; 2]) {
        self.types.push(number);
        self.tags.push(tag);
        self.physical.push(marks[0]);
        self.entities.push(marks[1]);
    }
}
