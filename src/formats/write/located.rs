//! Writer for the results of point location.

use std::borrow::Cow;
use std::collections::HashSet;
use std::io::Write;
use std::path::Path;

use serde::ser::{Serialize, SerializeMap, Serializer};
use zip::write::SimpleFileOptions;

use super::quiet::Quiet;
use super::vtu::{Block, Column, Grid};
use super::{NpyNumber, OutputFile, OutputFormat, write_file, write_json};
use crate::error::{Error, Result};
use crate::formats::array::suffixes;
use crate::formats::loss::MOST_COMPONENTS;
use crate::formats::npy;
use crate::mesh::Mesh;

/// Owners, barycentric coordinates and values of points.
#[derive(Clone, Copy, Debug)]
pub struct Located<'a> {
    /// The points, in the coordinates of the mesh file.
    pub points: &'a [[f64; 3]],
    /// Given if these are the points of another mesh, which a `.vtu` then shows.
    pub of: Option<&'a Mesh>,
    /// Id of the cell that owns each point; `u32::MAX`: none.
    pub owner: &'a [u32],
    /// Barycentric coordinates in that cell.
    pub bary: &'a [[f32; 4]],
    /// Names of fields, each with its value at every point.
    pub values: &'a [(String, Vec<f32>)],
}

impl Located<'_> {
    /// Formats that [`write_located`] supports.
    pub const FORMATS: [OutputFormat; 5] = [OutputFormat::Csv, OutputFormat::Npy, OutputFormat::Npz, OutputFormat::Vtu, OutputFormat::Json];
    /// What the other columns are called, in any of the formats.
    pub const TAKEN: [&'static str; 9] = ["x", "y", "z", "owner", "bary", "b0", "b1", "b2", "b3"];
}

/// Writes owners, barycentric coordinates and values in the format that the extension of `path` selects: `.npy` (an
/// array of records `owner` u4, `bary` 4×f4, and an f4 per field), `.npz` (an array for each of these), `.csv` (columns
/// x, y, z, owner, b0 to b3, and one per field), `.vtu` (the points as vertices, or the mesh whose points they are; fields
/// `v.x`, `v.y` and `v.z` without a field `v`, and `s.0`, `s.1` and so on, are one array) or `.json` (lists).
///
/// # Errors
/// [`Error::Invalid`] for another extension, for arrays of different lengths, for a mesh of other points, or for a field
/// whose name is that of another or one of [`Located::TAKEN`]; [`Error::Io`] if the file cannot be written.
pub fn write_located(path: impl AsRef<Path>, located: &Located<'_>) -> Result<()> {
    let path = path.as_ref();
    let format = OutputFormat::of(path, &Located::FORMATS)?;
    let n = located.owner.len();
    if located.points.len() != n || located.bary.len() != n || located.values.iter().any(|(_, v)| v.len() != n) {
        return Err(Error::Invalid(format!("{}: points, owners, coordinates and values of different number", path.display())));
    }
    if located.of.is_some_and(|mesh| mesh.points.len() != n) {
        return Err(Error::Invalid(format!("{}: {n} points of a mesh with another number of them", path.display())));
    }
    let mut taken: HashSet<&str> = Located::TAKEN.into();
    if let Some((name, _)) = located.values.iter().find(|(name, _)| !taken.insert(name)) {
        return Err(Error::Invalid(format!("{}: two columns `{name}`", path.display())));
    }
    match format {
        OutputFormat::Npy => write_file(path, |file| records(file, located)),
        OutputFormat::Npz => write_file(path, |file| archive(file, located)),
        OutputFormat::Csv => write_file(path, |file| table(file, located)),
        OutputFormat::Vtu => write_file(path, |file| grid(file, located)),
        _ => write_json(path, located),
    }
}

/// What JSON has: numbers as short as in the other texts, and `null` for those that are not finite.
impl Serialize for Located<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> std::result::Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(None)?;
        map.serialize_entry("owner", self.owner)?;
        map.serialize_entry("bary", self.bary)?;
        for (name, values) in self.values {
            map.serialize_entry(name, values)?;
        }
        map.end()
    }
}

fn records(file: &mut OutputFile, located: &Located<'_>) -> std::io::Result<()> {
    let fields: String = located.values.iter().map(|(name, _)| [", (", &npy::literal(name), ", '<f4')"].concat()).collect();
    let descr = format!("[('owner', '<u4'), ('bary', '<f4', (4,)){fields}]");
    file.write_all(&npy::header(&descr, &[located.owner.len()]))?;
    for (i, (owner, bary)) in located.owner.iter().zip(located.bary).enumerate() {
        file.write_all(&owner.to_le_bytes())?;
        for number in bary.iter().chain(located.values.iter().map(|(_, values)| &values[i])) {
            file.write_all(&number.to_le_bytes())?;
        }
    }
    Ok(())
}

fn archive(file: &mut OutputFile, located: &Located<'_>) -> std::io::Result<()> {
    let n = located.owner.len();
    let mut zip = zip::ZipWriter::new(Quiet::new(&mut *file));
    let mut member = |name: &str, descr: &str, shape: &[usize], bytes: &[u8]| {
        let large = bytes.len() as u64 > 0xf000_0000;
        zip.start_file(name, SimpleFileOptions::default().compression_method(zip::CompressionMethod::Stored).large_file(large))?;
        zip.write_all(&npy::header(descr, shape))?;
        zip.write_all(bytes)
    };
    member("owner.npy", u32::DESCR, &[n], bytemuck::cast_slice(located.owner))?;
    member("bary.npy", f32::DESCR, &[n, 4], bytemuck::cast_slice(located.bary))?;
    for (name, values) in located.values {
        member(&format!("{name}.npy"), f32::DESCR, &[n], bytemuck::cast_slice(values))?;
    }
    zip.finish()?.into_inner()?.flush()
}

fn table(file: &mut OutputFile, located: &Located<'_>) -> std::io::Result<()> {
    write!(file, "x,y,z,owner,b0,b1,b2,b3")?;
    for (name, _) in located.values {
        write!(file, ",{}", csv_field(name))?;
    }
    writeln!(file)?;
    for (i, (([x, y, z], owner), bary)) in located.points.iter().zip(located.owner).zip(located.bary).enumerate() {
        write!(file, "{x},{y},{z},{owner}")?;
        for b in bary {
            write!(file, ",{}", b + 0.0)?; // 0 instead of -0
        }
        for (_, values) in located.values {
            write!(file, ",{}", values[i])?;
        }
        writeln!(file)?;
    }
    Ok(())
}

/// A name in a table, in quotation marks where it would be taken for several fields or lines.
fn csv_field(name: &str) -> Cow<'_, str> {
    if name.contains([',', '"', '\n', '\r']) { format!("\"{}\"", name.replace('"', "\"\"")).into() } else { name.into() }
}

/// Columns as arrays: name, number of components, and values, tuple by tuple.
fn arrays(mut columns: &[(String, Vec<f32>)]) -> Vec<(&str, usize, Cow<'_, [f32]>)> {
    let names: HashSet<&str> = columns.iter().map(|(name, _)| name.as_str()).collect();
    let mut arrays = Vec::new();
    while let [(first, values), ..] = columns {
        // The suffixes of components are the last ones: a vector's first is that of its length.
        let of = |n: usize| {
            let suffixes = &suffixes(n)[suffixes(n).len() - n..];
            let base = first.strip_suffix(suffixes[0]).filter(|base| !names.contains(base))?;
            let parts = columns.get(..n)?;
            parts.iter().zip(suffixes).all(|((name, _), suffix)| name.strip_prefix(base) == Some(suffix)).then_some((base, parts))
        };
        let (name, n, values) = match (2..=MOST_COMPONENTS).rev().find_map(of) {
            Some((base, parts)) => {
                let tuples = (0..values.len()).flat_map(|i| parts.iter().map(move |(_, values)| values[i]));
                (base, parts.len(), tuples.collect())
            }
            None => (first.as_str(), 1, Cow::Borrowed(&values[..])),
        };
        arrays.push((name, n, values));
        columns = &columns[n..];
    }
    arrays
}

fn grid(file: &mut OutputFile, located: &Located<'_>) -> std::io::Result<()> {
    let values = arrays(located.values);
    // The values come first: viewers show the first array.
    let values = values.iter().map(|(name, components, values)| Column { name, components: *components, block: Block::F32(values) });
    let point_data: Vec<_> = values
        .chain([
            Column { name: "owner", components: 1, block: Block::U32(located.owner) },
            Column { name: "bary", components: 4, block: Block::F32(located.bary.as_flattened()) },
        ])
        .collect();
    let points = Column { name: "Points", components: 3, block: Block::F64(located.points.as_flattened()) };
    let n = located.owner.len();
    let (connectivity, corners, kind) = match located.of {
        Some(mesh) => (Cow::Borrowed(mesh.tets.as_flattened()), 4, 10),
        None => ((0..n as u32).collect(), 1, 1),
    };
    let ends: Vec<u32> = (1..=(connectivity.len() / corners) as u32).map(|i| i * corners as u32).collect();
    let types = vec![kind; ends.len()];
    let ids = located.of.and_then(|mesh| mesh.cell_ids.as_deref());
    let cell_data: Vec<_> = ids.iter().map(|ids| Column { name: "cell_id", components: 1, block: Block::U32(ids) }).collect();
    Grid { points, connectivity: &connectivity, ends: &ends, types: &types, point_data: &point_data, cell_data: &cell_data }.write(file)
}
