//! Writer for VTK XML unstructured grids with appended raw data, compressed with zlib.

use std::borrow::Cow;
use std::fmt::Write as _;
use std::io::Write;
use std::path::Path;

use flate2::{Compression, write::ZlibEncoder};
use rayon::prelude::*;

use super::{OutputFile, write_file, xml_attribute};
use crate::error::Result;
use crate::formats::array::{gathered, suffixes};
use crate::mesh::{Field, Mesh, On};

/// The numbers of an array.
#[derive(Clone, Copy)]
pub(crate) enum Block<'a> {
    F32(&'a [f32]),
    F64(&'a [f64]),
    U32(&'a [u32]),
    U8(&'a [u8]),
}

impl<'a> Block<'a> {
    pub fn bytes(self) -> &'a [u8] {
        match self {
            Block::F32(v) => bytemuck::cast_slice(v),
            Block::F64(v) => bytemuck::cast_slice(v),
            Block::U32(v) => bytemuck::cast_slice(v),
            Block::U8(v) => v,
        }
    }

    pub const fn kind(self) -> &'static str {
        match self {
            Block::F32(_) => "Float32",
            Block::F64(_) => "Float64",
            Block::U32(_) => "UInt32",
            Block::U8(_) => "UInt8",
        }
    }
}

/// A named array.
#[derive(Clone, Copy)]
pub(crate) struct Column<'a> {
    pub name: &'a str,
    pub components: usize,
    pub block: Block<'a>,
}

/// An unstructured grid as the arrays of the format.
pub(crate) struct Grid<'a> {
    pub points: Column<'a>,
    pub connectivity: &'a [u32],
    pub ends: &'a [u32],
    pub types: &'a [u8],
    pub point_data: &'a [Column<'a>],
    pub cell_data: &'a [Column<'a>],
}

/// Byte order of this machine, in which the data are written.
pub(crate) const BYTE_ORDER: &str = if cfg!(target_endian = "little") { "LittleEndian" } else { "BigEndian" };

/// Uncompressed size of a block: large enough for compression, small enough to distribute over threads.
const BLOCK: usize = 1 << 18;

impl Grid<'_> {
    pub fn write(&self, file: &mut OutputFile) -> std::io::Result<()> {
        let mut xml = String::new();
        let mut data = Vec::new();
        let n_points = self.points.block.bytes().len() / if matches!(self.points.block, Block::F32(_)) { 12 } else { 24 };
        let open = format!(
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"{BYTE_ORDER}\" header_type=\"UInt64\" compressor=\"vtkZLibDataCompressor\">\n<UnstructuredGrid>\n<Piece NumberOfPoints=\"{n_points}\" NumberOfCells=\"{}\">\n",
            self.types.len()
        );
        xml.push_str(&open);
        let cells = [("connectivity", Block::U32(self.connectivity)), ("offsets", Block::U32(self.ends)), ("types", Block::U8(self.types))];
        let cells = cells.map(|(name, block)| Column { name, components: 1, block });
        let groups = [("PointData", self.point_data), ("CellData", self.cell_data), ("Points", &[self.points]), ("Cells", &cells)];
        for (group, columns) in groups {
            let _ = writeln!(xml, "<{group}>");
            for column in columns {
                let (kind, name, components) = (column.block.kind(), xml_attribute(column.name), column.components);
                let offset = data.len();
                let _ = writeln!(
                    xml,
                    "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\" format=\"appended\" offset=\"{offset}\"/>"
                );
                pack(column.block.bytes(), &mut data)?;
            }
            let _ = writeln!(xml, "</{group}>");
        }
        xml.push_str("</Piece>\n</UnstructuredGrid>\n<AppendedData encoding=\"raw\">\n_");
        file.write_all(xml.as_bytes())?;
        file.write_all(&data)?;
        file.write_all(b"\n</AppendedData>\n</VTKFile>\n")
    }
}

/// Compresses `bytes` in blocks and appends them with their header.
fn pack(bytes: &[u8], data: &mut Vec<u8>) -> std::io::Result<()> {
    let blocks: Vec<Vec<u8>> = bytes
        .par_chunks(BLOCK)
        .map(|block| {
            let mut encoder = ZlibEncoder::new(Vec::new(), Compression::fast());
            encoder.write_all(block)?;
            encoder.finish()
        })
        .collect::<std::io::Result<_>>()?;
    let last = bytes.len() % BLOCK;
    let header = [blocks.len(), BLOCK, last].into_iter().chain(blocks.iter().map(Vec::len));
    data.extend(header.flat_map(|n| (n as u64).to_ne_bytes()));
    data.extend(blocks.into_iter().flatten());
    Ok(())
}

/// Fields as arrays of a file: name, components, what the values belong to, and values. Components are arrays again.
fn arrays(mut fields: &[Field]) -> Vec<(&str, usize, On, Cow<'_, [f32]>)> {
    let mut arrays = Vec::new();
    while let Some((name, parts)) = gathered(fields) {
        let n = parts.len();
        let tuples =
            || (0..parts[0].values.len()).flat_map(|i| parts.iter().map(move |part| part.values.get(i).copied().unwrap_or(f32::NAN)));
        let values = if n == 1 { Cow::Borrowed(&parts[0].values[..]) } else { tuples().collect() };
        arrays.push((name, n, parts[0].on, values));
        fields = &fields[suffixes(n).len()..];
    }
    arrays
}

/// Writes a mesh with its fields as `.vtu`; components of vectors and the like are one array again. If cells were split or reordered, their ids become the array `cell_id`; if
/// points were reordered, theirs become `point_id`. These are ids of the file that the mesh was read from, so a field of
/// that name, which an earlier such file may have left, gives way to them.
///
/// # Errors
/// [`crate::Error::Io`] if the file cannot be written.
pub fn write_mesh(path: impl AsRef<Path>, mesh: &Mesh) -> Result<()> {
    let moved: Option<Vec<[f64; 3]>> =
        (mesh.origin != [0.0; 3]).then(|| mesh.points.iter().map(|p| [0, 1, 2].map(|c| f64::from(p[c]) + mesh.origin[c])).collect());
    let block = moved.as_ref().map_or(Block::F32(mesh.points.as_flattened()), |points| Block::F64(points.as_flattened()));
    let points = Column { name: "Points", components: 3, block };
    let ends: Vec<u32> = (1..=mesh.tets.len() as u32).map(|i| 4 * i).collect();
    let types = vec![10; mesh.tets.len()];
    let arrays = arrays(&mesh.fields);
    let columns = |on: On| -> Vec<Column<'_>> {
        let arrays = arrays.iter().filter(|(_, _, of, _)| *of == on);
        arrays.map(|(name, components, _, values)| Column { name, components: *components, block: Block::F32(values) }).collect()
    };
    let (mut point_data, mut cell_data) = (columns(On::Points), columns(On::Cells));
    for (name, ids, columns) in [("point_id", &mesh.point_ids, &mut point_data), ("cell_id", &mesh.cell_ids, &mut cell_data)] {
        if let Some(ids) = ids {
            columns.retain(|column| column.name != name);
            columns.push(Column { name, components: 1, block: Block::U32(ids) });
        }
    }
    let grid =
        Grid { points, connectivity: mesh.tets.as_flattened(), ends: &ends, types: &types, point_data: &point_data, cell_data: &cell_data };
    write_file(path.as_ref(), |file| grid.write(file))
}
