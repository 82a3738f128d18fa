//! Reader for the series of ParaView (`.vtu.series`, `.vtk.series` and the like): a file for each time step, listed in JSON.

use std::path::PathBuf;

use super::super::assemble::Assembly;
use super::super::detect::{Format, READABLE, detect};
use super::super::source::{Source, excerpt};
use super::super::{LoadOptions, TimeStep, assembled};
use crate::error::Result;

#[derive(serde::Deserialize)]
struct Series {
    files: Vec<Entry>,
}

#[derive(serde::Deserialize)]
struct Entry {
    name: String,
    /// By default, steps have the order of the file.
    time: Option<f64>,
}

/// The entries of a series, and its text.
fn entries(source: &Source) -> Result<(Vec<Entry>, std::borrow::Cow<'_, [u8]>)> {
    let text = source.window(0..source.len()).map_err(|why| source.error(why))?;
    let series: Series = serde_json::from_slice(&text).map_err(|error| source.error(format!("as a series in JSON: {error}")))?;
    Ok((series.files, text))
}

/// The files of all steps.
pub(in crate::formats) fn files(source: &Source) -> Vec<PathBuf> {
    entries(source).map(|(entries, _)| entries.iter().map(|entry| source.beside(&entry.name)).collect()).unwrap_or_default()
}

/// Reads the file of one step, in whatever format it is.
pub(in crate::formats) fn read(source: &Source, options: &LoadOptions) -> Result<Assembly> {
    let (entries, text) = entries(source)?;
    let mut steps: Vec<(f64, &str)> = entries.iter().zip(0..).map(|(e, i)| (e.time.unwrap_or(f64::from(i)), e.name.as_str())).collect();
    // Of several files at one time, the last counts, as in ParaView.
    steps.reverse();
    steps.sort_by(|a, b| a.0.total_cmp(&b.0));
    steps.dedup_by_key(|step| step.0);
    let chosen = options.step.of(source, steps.len())?;
    let Some((_, name)) = steps.get(chosen) else { return Err(source.error("it lists no file")) };
    let fail = |why: String| {
        let at = memchr::memmem::find(&text, name.as_bytes()).unwrap_or(0);
        source.error_line(at, format!("`{}`: {why}", excerpt(name.as_bytes())))
    };
    let path = source.beside(name);
    if !path.is_file() {
        return Err(fail("there is no such file".into()));
    }
    let listed = Source::open(&path, READABLE).map_err(|error| fail(format!("the listed file cannot be read ({error})")))?;
    if detect(&listed)? == Format::Series {
        return Err(fail("a series in a series; list the files of its steps".into()));
    }
    let mut assembly = assembled(&listed, options)?;
    assembly.format = format!("ParaView series: {}", assembly.format);
    assembly.bytes += source.len() as u64;
    if steps.len() > 1 {
        assembly.warnings.insert(0, TimeStep::remark(chosen, steps.len()));
    }
    Ok(assembly)
}
