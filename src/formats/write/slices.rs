//! Writer for stacks of slices, layer by layer, because they may be larger than memory.

use std::fmt::Write as _;
use std::io::{Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use super::vtu::{BYTE_ORDER, Block};
use super::{NpyNumber, OutputFile, OutputFormat};
use crate::error::{Error, Result};
use crate::formats::npy;

/// Geometry of a stack of slices.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SliceGrid {
    /// Width, height, number of layers.
    pub size: [u32; 3],
    /// Centre of the first voxel, in the coordinates of the mesh file.
    pub origin: [f64; 3],
    /// Distance between neighbouring voxels along width, height and layers, negative where they go against the axis.
    pub spacing: [f64; 3],
    /// Unit vectors along width, height and layers.
    pub axes: [[f64; 3]; 3],
}

/// Writes slices as `X.npy` (layers × height × width, f32, NaN = empty) together with `X.kind.npy` (u8: 0 empty, 1
/// touched, 2 inside) and, on request, `X.owner.npy` (u32); or as one `.vti`, an image whose points are the voxels'
/// centres, with arrays `value`, `kind` and `owner`.
pub struct SliceWriter {
    grid: SliceGrid,
    layer: u32,
    /// The files, and in `places`, for value, kind and owner, the index of the file and the byte where the data start.
    files: Vec<OutputFile>,
    places: Vec<(usize, u64)>,
    tail: &'static [u8],
}

impl SliceWriter {
    /// Formats that the writer supports.
    pub const FORMATS: [OutputFormat; 2] = [OutputFormat::Npy, OutputFormat::Vti];

    /// Creates the files.
    ///
    /// # Errors
    /// [`Error::Invalid`] for another extension, for slices without voxels, and for an image with several layers at one
    /// place; [`Error::Io`] if the files cannot be written.
    pub fn create(path: impl AsRef<Path>, grid: SliceGrid, owners: bool) -> Result<Self> {
        let path = path.as_ref();
        let format = OutputFormat::of(path, &Self::FORMATS)?;
        let mut writer = Self { grid, layer: 0, files: Vec::new(), places: Vec::new(), tail: b"" };
        if grid.size.contains(&0) {
            return Err(Error::Invalid(format!("slices of size {:?}", grid.size)));
        }
        match format {
            OutputFormat::Npy => writer.arrays(path, owners)?,
            _ => writer.image(path, owners)?,
        }
        Ok(writer)
    }

    fn arrays(&mut self, path: &Path, owners: bool) -> Result<()> {
        let [width, height, layers] = self.grid.size.map(|n| n as usize);
        let all = [("", f32::DESCR), ("kind", u8::DESCR), ("owner", u32::DESCR)];
        for (name, descr) in &all[..2 + usize::from(owners)] {
            let path = if name.is_empty() { PathBuf::from(path) } else { path.with_extension(format!("{name}.npy")) };
            let mut file = OutputFile::create(path)?;
            let header = npy::header(descr, &[layers, height, width]);
            file.write_all(&header).map_err(|e| file.fail(e))?;
            self.places.push((self.files.len(), header.len() as u64));
            self.files.push(file);
        }
        Ok(())
    }

    fn image(&mut self, path: &Path, owners: bool) -> Result<()> {
        let join = |v: &[f64]| v.iter().map(f64::to_string).collect::<Vec<_>>().join(" ");
        let SliceGrid { size, origin, spacing, axes } = self.grid;
        if (0..3).any(|c| size[c] > 1 && spacing[c] == 0.0) {
            let message =
                "several layers at one place, with a distance of 0; an image for VTK (.vti) needs another distance, an .npy does not";
            return Err(Error::Invalid(message.into()));
        }
        let [x, y, z] = size.map(|n| i64::from(n) - 1);
        let extent = format!("0 {x} 0 {y} 0 {z}");
        // The matrix whose columns are the axes, row by row; they point from voxel to voxel, since VTK's spacings are
        // positive (whatever that of a single layer is).
        let direction: Vec<f64> = (0..3).flat_map(|row| [0, 1, 2].map(|c| axes[c][row] * 1f64.copysign(spacing[c]) + 0.0)).collect();
        let spacing = spacing.map(|s| if s == 0.0 { 1.0 } else { s.abs() });
        let mut xml = format!(
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"ImageData\" version=\"1.0\" byte_order=\"{BYTE_ORDER}\" header_type=\"UInt64\">\n<ImageData WholeExtent=\"{extent}\" Origin=\"{}\" Spacing=\"{}\" Direction=\"{}\">\n<Piece Extent=\"{extent}\">\n<PointData Scalars=\"value\">\n",
            join(&origin),
            join(&spacing),
            join(&direction)
        );
        let voxels: u64 = size.iter().map(|&n| u64::from(n)).product();
        let all = [("value", "Float32", 4), ("kind", "UInt8", 1), ("owner", "UInt32", 4)];
        let mut offsets = Vec::new();
        let mut offset = 0;
        for (name, kind, width) in &all[..2 + usize::from(owners)] {
            let _ = writeln!(xml, "<DataArray type=\"{kind}\" Name=\"{name}\" format=\"appended\" offset=\"{offset}\"/>");

            offsets.push((offset, width * voxels));
            offset += 8 + width * voxels;
        }
        xml += "</PointData>\n<CellData>\n</CellData>\n</Piece>\n</ImageData>\n<AppendedData encoding=\"raw\">\n_";
        let start = xml.len() as u64;
        let mut file = OutputFile::create(path)?;
        let write = |file: &mut OutputFile| {
            file.write_all(xml.as_bytes())?;
            for (offset, bytes) in &offsets {
                file.seek(SeekFrom::Start(start + offset))?;
                file.write_all(&bytes.to_ne_bytes())?;
            }
            Ok(())
        };
        write(&mut file).map_err(|e| file.fail(e))?;
        self.places = offsets.iter().map(|(offset, _)| (0, start + offset + 8)).collect();
        self.files.push(file);
        self.tail = b"\n</AppendedData>\n</VTKFile>\n";
        Ok(())
    }

    /// Appends a layer, row by row: values (NaN where empty), kinds and, if requested at creation, owners.
    ///
    /// # Errors
    /// [`Error::Invalid`] if the number of voxels is wrong or all layers have been written, [`Error::Io`] if the files
    /// cannot be written.
    pub fn layer(&mut self, values: &[f32], kinds: &[u8], owners: Option<&[u32]>) -> Result<()> {
        let voxels = self.grid.size[0] as usize * self.grid.size[1] as usize;
        let wrong = values.len() != voxels || kinds.len() != voxels || owners.is_some_and(|o| o.len() != voxels);
        if wrong || owners.is_some() != (self.places.len() == 3) || self.layer >= self.grid.size[2] {
            return Err(Error::Invalid(format!("layer {} does not fit slices of size {:?}", self.layer, self.grid.size)));
        }
        let blocks = [Some(Block::F32(values)), Some(Block::U8(kinds)), owners.map(Block::U32)];
        for (block, &(file, start)) in blocks.into_iter().flatten().zip(&self.places) {
            let bytes = block.bytes();
            let at = start + u64::from(self.layer) * bytes.len() as u64;
            let file = &mut self.files[file];
            let write = |file: &mut OutputFile| {
                if file.stream_position()? != at {
                    file.seek(SeekFrom::Start(at))?;
                }
                file.write_all(bytes)
            };
            write(file).map_err(|e| file.fail(e))?;
        }
        self.layer += 1;
        Ok(())
    }

    /// Completes the files.
    ///
    /// # Errors
    /// [`Error::Invalid`] if layers are missing, [`Error::Io`] if the remaining data cannot be written.
    pub fn finish(mut self) -> Result<()> {
        if self.layer != self.grid.size[2] {
            return Err(Error::Invalid(format!("{} of {} layers were written", self.layer, self.grid.size[2])));
        }
        if let (false, Some(file)) = (self.tail.is_empty(), self.files.first_mut()) {
            let tail = self.tail;
            file.seek(SeekFrom::End(0)).and_then(|_| file.write_all(tail)).map_err(|e| file.fail(e))?;
        }
        self.files.into_iter().try_for_each(OutputFile::commit)
    }
}
