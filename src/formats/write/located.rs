//! Writer for the results of point location.

use std::io::Write;
use std::path::Path;

use serde::Serialize;
use zip::write::SimpleFileOptions;

use super::vtu::{Block, Column, Grid};
use super::{NpyNumber, OutputFile, OutputFormat, write_file, write_json};
use crate::error::{Error, Result};
use crate::formats::npy;

/// Owners, barycentric coordinates and values of points.
#[derive(Clone, Copy, Debug)]
pub struct Located<'a> {
    /// The points, in the coordinates of the mesh file.
    pub points: &'a [[f64; 3]],
    /// Id of the cell that owns each point; `u32::MAX`: none.
    pub owner: &'a [u32],
    /// Barycentric coordinates in that cell.
    pub bary: &'a [[f32; 4]],
    /// Value of the field, if there is one.
    pub value: Option<&'a [f32]>,
}

impl Located<'_> {
    /// Formats that [`write_located`] supports.
    pub const FORMATS: [OutputFormat; 5] = [OutputFormat::Csv, OutputFormat::Npy, OutputFormat::Npz, OutputFormat::Vtu, OutputFormat::Json];

    fn value(&self, i: usize) -> f32 {
        self.value.map_or(f32::NAN, |v| v[i])
    }
}

/// Writes owners, barycentric coordinates and values in the format that the extension of `path` selects: `.npy` (an
/// array of records `owner` u4, `bary` 4×f4, `value` f4), `.npz` (arrays `owner`, `bary` and, with a field, `value`),
/// `.csv` (columns owner, b0 to b3, value), `.vtu` (the points as vertices) or `.json`. Without a field, values are NaN
/// (`null` in JSON).
///
/// # Errors
/// [`Error::Invalid`] for another extension or for arrays of different lengths, [`Error::Io`] if the file cannot be
/// written.
pub fn write_located(path: impl AsRef<Path>, located: &Located<'_>) -> Result<()> {
    let path = path.as_ref();
    let format = OutputFormat::of(path, &Located::FORMATS)?;
    let n = located.owner.len();
    if located.points.len() != n || located.bary.len() != n || located.value.is_some_and(|v| v.len() != n) {
        return Err(Error::Invalid(format!("{}: points, owners, coordinates and values of different number", path.display())));
    }
    match format {
        OutputFormat::Npy => write_file(path, |file| records(file, located)),
        OutputFormat::Npz => write_file(path, |file| archive(file, located)),
        OutputFormat::Csv => write_file(path, |file| table(file, located)),
        OutputFormat::Vtu => write_file(path, |file| vertices(file, located)),
        _ => write_json(path, &Json { owner: located.owner, bary: located.bary, value: located.value }),
    }
}

/// What JSON has: numbers as short as in the other texts, and `null` for those that are not finite.
#[derive(Serialize)]
struct Json<'a> {
    owner: &'a [u32],
    bary: &'a [[f32; 4]],
    value: Option<&'a [f32]>,
}

fn records(file: &mut OutputFile, located: &Located<'_>) -> std::io::Result<()> {
    let descr = "[('owner', '<u4'), ('bary', '<f4', (4,)), ('value', '<f4')]";
    file.write_all(&npy::header(descr, &[located.owner.len()]))?;
    for (i, (owner, bary)) in located.owner.iter().zip(located.bary).enumerate() {
        let mut record = [0; 24];
        record[..4].copy_from_slice(&owner.to_le_bytes());
        for (slot, b) in record[4..20].chunks_exact_mut(4).zip(bary) {
            slot.copy_from_slice(&b.to_le_bytes());
        }
        record[20..].copy_from_slice(&located.value(i).to_le_bytes());
        file.write_all(&record)?;
    }
    Ok(())
}

fn archive(file: &mut OutputFile, located: &Located<'_>) -> std::io::Result<()> {
    let n = located.owner.len();
    let mut zip = zip::ZipWriter::new(&mut *file);
    let mut member = |name: &str, descr: &str, shape: &[usize], bytes: &[u8]| {
        let large = bytes.len() as u64 > 0xf000_0000;
        zip.start_file(name, SimpleFileOptions::default().compression_method(zip::CompressionMethod::Stored).large_file(large))?;
        zip.write_all(&npy::header(descr, shape))?;
        zip.write_all(bytes)
    };
    member("owner.npy", u32::DESCR, &[n], bytemuck::cast_slice(located.owner))?;
    member("bary.npy", f32::DESCR, &[n, 4], bytemuck::cast_slice(located.bary))?;
    if let Some(value) = located.value {
        member("value.npy", f32::DESCR, &[n], bytemuck::cast_slice(value))?;
    }
    zip.finish()?;
    file.flush()
}

fn table(file: &mut OutputFile, located: &Located<'_>) -> std::io::Result<()> {
    writeln!(file, "owner,b0,b1,b2,b3,value")?;
    for (i, (owner, [a, b, c, d])) in located.owner.iter().zip(located.bary).enumerate() {
        writeln!(file, "{owner},{a},{b},{c},{d},{}", located.value(i))?;
    }
    Ok(())
}

fn vertices(file: &mut OutputFile, located: &Located<'_>) -> std::io::Result<()> {
    let n = located.owner.len();
    let ids: Vec<u32> = (0..n as u32).collect();
    let ends: Vec<u32> = (1..=n as u32).collect();
    let mut arrays = vec![
        Column { name: "owner", components: 1, block: Block::U32(located.owner) },
        Column { name: "bary", components: 4, block: Block::F32(located.bary.as_flattened()) },
    ];
    if let Some(value) = located.value {
        arrays.push(Column { name: "value", components: 1, block: Block::F32(value) });
    }
    let types = vec![1; n];
    let points = Column { name: "Points", components: 3, block: Block::F64(located.points.as_flattened()) };
    Grid { points, connectivity: &ids, ends: &ends, types: &types, point_data: &arrays, cell_data: &[] }.write(file)
}
