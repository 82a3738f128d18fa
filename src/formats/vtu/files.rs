//! The grids of a VTK XML file: its own, or those of the files that it lists (`.pvtu`, `.vtm`, `.vtpd`, `.vtpc`, `.pvd`).

use std::collections::{BTreeMap, BTreeSet, HashSet};
use std::path::PathBuf;

use super::super::budget::Budget;
use super::super::lattice::GridKind;
use super::super::listed::MOST_FILES;
use super::super::source::ending;
use super::super::source::{Source, excerpt};
use super::super::{LoadOptions, TimeStep};
use super::data::Codec;
use super::parser::{Document, List, Piece, Skeleton, parse};
use crate::error::Result;

/// Most lists within each other.
const MOST_DEEP: usize = 4;
/// Endings of files of VTK with surfaces and tables.
const NO_VOLUMES: [&str; 3] = ["vtp", "pvtp", "vtt"];
/// Endings of files of VTK with volumes of another kind.
const OTHERS: [&str; 2] = ["vth", "htg"];

/// Where a grid is.
pub(crate) enum Origin<'a> {
    /// In the file that was named.
    Named(&'a Source),
    /// In a file that is listed. It is opened whenever it is read: there may be more files than a process may keep open.
    Listed(PathBuf),
}

impl Origin<'_> {
    /// The file; `opened` keeps it open.
    pub fn open<'s>(&'s self, opened: &'s mut Option<Source>) -> Result<&'s Source> {
        match self {
            Self::Named(source) => Ok(source),
            Self::Listed(path) => Ok(opened.insert(Source::open(path, ".vtu")?)),
        }
    }
}

/// A grid, without the values of its arrays.
pub(crate) struct Grid<'a> {
    pub origin: Origin<'a>,
    pub codec: Codec,
    pub kind: GridKind,
    pub pieces: Vec<Piece>,
    /// Number of the block of a list; the grids of a block are pieces of one mesh.
    pub block: usize,
}

impl<'a> Grid<'a> {
    fn new(origin: Origin<'a>, skeleton: Skeleton, block: usize, bytes: usize, options: &LoadOptions) -> Self {
        let Skeleton { mut codec, kind, pieces, .. } = skeleton;
        codec.budget = Budget::new(bytes, options);
        Self { origin, codec, kind, pieces, block }
    }
}

/// What a file, or those that it lists, consist of.
pub(crate) struct Files<'a> {
    pub format: String,
    pub grids: Vec<Grid<'a>>,
    /// Size of all files read.
    pub bytes: usize,
    pub warnings: Vec<String>,
}

/// Finds the grids of a file.
pub(crate) fn grids<'a>(source: &'a Source, options: &LoadOptions) -> Result<Files<'a>> {
    let bytes = source.len();
    let list = match parse(source, options.step)? {
        Document::Grid(mut skeleton) => {
            let (format, warnings) = (std::mem::take(&mut skeleton.format), std::mem::take(&mut skeleton.warnings));
            return Ok(Files { format, grids: vec![Grid::new(Origin::Named(source), skeleton, 0, bytes, options)], bytes, warnings });
        }
        Document::List(list) => list,
    };
    let mut found =
        Found { options, grids: Vec::new(), bytes, blocks: 0, seen: HashSet::new(), others: BTreeMap::new(), warnings: BTreeSet::new() };
    found.add(source, &list, 1)?;
    if found.grids.is_empty() {
        let others = found.others(|_| true);
        let others = if others.is_empty() { others } else { format!(", only {others}") };
        return Err(source.error(format!("it lists no file with volume cells{others}")));
    }
    let format = format!("{}, {} listed files", list.format, found.grids.len());
    let mut warnings: Vec<String> = found.warnings.iter().cloned().collect();
    let (surfaces, unread) = (found.others(|kind| NO_VOLUMES.contains(&kind)), found.others(|kind| OTHERS.contains(&kind)));
    if !surfaces.is_empty() {
        warnings.push(format!("listed files without volume cells are left out: {surfaces}"));
    }
    if !unread.is_empty() {
        let why = "they cannot be read, so the mesh has holes there; save them as unstructured grids (.vtu)";
        warnings.push(format!("listed files are left out: {unread}; {why}"));
    }
    Ok(Files { format, grids: found.grids, bytes: found.bytes, warnings })
}

/// What has been found in lists.
struct Found<'a, 'o> {
    options: &'o LoadOptions,
    grids: Vec<Grid<'a>>,
    bytes: usize,
    /// Number of blocks.
    blocks: usize,
    seen: HashSet<PathBuf>,
    /// Files of other kinds, by ending.
    others: BTreeMap<String, usize>,
    /// Warnings about the grids.
    warnings: BTreeSet<String>,
}

impl Found<'_, '_> {
    /// How many files there are of those other kinds that `chosen` names.
    fn others(&self, chosen: impl Fn(&str) -> bool) -> String {
        let counts = self.others.iter().filter(|(kind, _)| chosen(kind)).map(|(kind, n)| format!("{n} .{kind}"));
        counts.collect::<Vec<_>>().join(", ")
    }

    /// Adds the grids of a list that lies in `deep - 1` others.
    fn add(&mut self, source: &Source, list: &List, deep: usize) -> Result<()> {
        let mut steps: Vec<&str> = Vec::new();
        let mut known = HashSet::new();
        steps.extend(list.files.iter().filter_map(|file| file.step.as_deref()).filter(|step| known.insert(*step)));
        let step = if steps.len() > 1 {
            let chosen = self.options.step.chosen(source, &mut steps)?;
            self.warnings.insert(TimeStep::remark(chosen, steps.len()));
            Some(steps[chosen])
        } else {
            None
        };
        let mut block = None;
        // What has no time belongs to all steps.
        for listed in list.files.iter().filter(|file| step.is_none() || file.step.is_none() || file.step.as_deref() == step) {
            if block.replace(listed.block) != Some(listed.block) {
                self.blocks += 1;
            }
            let fail = |message: String| Err(source.error_line(listed.at, format!("`{}`: {message}", excerpt(listed.path.as_bytes()))));
            let path = source.beside(&listed.path);
            let kind = ending(&path);
            if NO_VOLUMES.contains(&kind.as_str()) || OTHERS.contains(&kind.as_str()) {
                *self.others.entry(kind).or_default() += 1;
                continue;
            }
            if !self.seen.insert(path.clone()) {
                return fail("the file is listed twice".into());
            }
            if self.seen.len() > MOST_FILES {
                return fail(format!("more than {MOST_FILES} files are listed"));
            }
            if !path.is_file() {
                return fail("there is no such file".into());
            }
            let opened = match Source::open(&path, ".vtu") {
                Ok(opened) => opened,
                Err(error) => return fail(format!("the listed file cannot be read ({error})")),
            };
            if !opened.start().trim_ascii_start().starts_with(b"<") {
                return fail("no VTK XML file, as such a list needs; read it by itself, or save it as .vtu".into());
            }
            self.bytes += opened.len();
            match parse(&opened, self.options.step)? {
                Document::Grid(mut skeleton) => {
                    self.warnings.extend(std::mem::take(&mut skeleton.warnings));
                    let grid = Grid::new(Origin::Listed(path), skeleton, self.blocks, opened.len(), self.options);
                    self.grids.push(grid);
                }
                Document::List(list) if deep < MOST_DEEP => self.add(&opened, &list, deep + 1)?,
                Document::List(_) => return fail(format!("lists lie more than {MOST_DEEP} deep within each other")),
            }
        }
        Ok(())
    }
}
