//! The files that a file names: those of a list of VTK, or those that an input file of Abaqus includes.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use super::detect::{Format, READABLE, detect};
use super::source::{Source, ending};
use super::vtu::parser::{Document, parse};
use super::{TimeStep, abaqus, vtk};

/// Most files that a list and the lists in it may name.
pub(super) const MOST_FILES: usize = 1 << 16;
/// Most files within each other.
const MOST_DEEP: usize = 8;
/// Endings of lists.
const LISTS: [&str; 9] = ["pvtu", "pvts", "pvtr", "pvti", "vtm", "vtpd", "vtpc", "pvd", "series"];

/// The files that a list (`.pvtu` and the like, `.vtm`, `.vtpd`, `.vtpc`, `.pvd`, `.series`) names, of all time steps, or
/// an `.inp` includes, and those that these name; none if the file names none, or cannot be read. Tells whether a result
/// would replace one of them.
pub fn listed_files(path: &Path) -> Vec<PathBuf> {
    let (mut found, mut seen, mut next) = (Vec::new(), HashSet::new(), vec![path.to_path_buf()]);
    // Data that an input file includes may have any ending.
    let any = path.is_file() && Source::open(path, READABLE).is_ok_and(|source| matches!(detect(&source), Ok(Format::Abaqus)));
    for _ in 0..MOST_DEEP {
        // A file that names itself is read once, and a pipe never.
        next.retain(|path| any || LISTS.contains(&ending(path).as_str()));
        next.retain(|path| path.is_file() && path.canonicalize().is_ok_and(|place| seen.insert(place)));
        next = next.iter().flat_map(|path| named(path, any)).take(MOST_FILES).collect();
        found.extend_from_slice(&next);
    }
    found
}

/// The files that a file itself names.
fn named(path: &Path, is_input: bool) -> Vec<PathBuf> {
    let Ok(source) = Source::open(path, READABLE) else { return Vec::new() };
    if is_input {
        return abaqus::included(&source);
    }
    match detect(&source) {
        Ok(Format::Series) => vtk::series::files(&source),
        Ok(Format::VtkXml) => match parse(&source, TimeStep::Last) {
            Ok(Document::List(list)) => list.files.iter().map(|file| source.beside(&file.path)).collect(),
            _ => Vec::new(),
        },
        _ => Vec::new(),
    }
}
