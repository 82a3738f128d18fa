//! Reader for the series of ParaView (`.vtu.series` and the like): a file for each time step, listed in JSON.

use super::source::Source;
use super::vtu_parser::{List, Listed};
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

/// Whether a file is such a series.
pub(super) fn is_series(source: &Source) -> bool {
    source.start().trim_ascii_start().starts_with(b"{")
}

/// The list of its files.
pub(super) fn read(source: &Source) -> Result<List> {
    let text = source.window(0..source.len()).map_err(|why| source.error(why))?;
    let series: Series = serde_json::from_slice(&text).map_err(|error| source.error(format!("as a series in JSON: {error}")))?;
    let listed = |(i, file): (usize, Entry)| {
        let step = file.time.map_or_else(|| i.to_string(), |time| time.to_string());
        let at = memchr::memmem::find(&text, file.name.as_bytes()).unwrap_or(0);
        Listed { path: file.name, step: Some(step), block: 0, at }
    };
    Ok(List { format: "ParaView series".into(), files: series.files.into_iter().enumerate().map(listed).collect() })
}
