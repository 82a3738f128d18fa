//! Readers of mesh files and writers of results.
//!
//! [`load`] reads every mesh format; the [`Report`] says what was found in the file and what became of it. A format is
//! recognised by the content of the file, or else by its name.
//!
//! # Why the crate has its own readers
//! Existing libraries were measured on 420 hostile files and on one mesh stored in 60 variants. `vtkio` 0.7.0-rc2
//! refuses 16 of 39 healthy VTK files (all of them with appended raw data, the default of many writers; 0.6.3 refuses
//! 25), panics on 2 (0.6.3 also asks for 22 GB on a third), and accepts 15 of 85 broken ones, including files with
//! indices out of range. `mshio` 0.4.2 reads only Gmsh 4.1, neither 4.0 nor 2.2, and trusts a file that announces 2^40
//! nodes. Neither library names a line or an array in its errors. The readers here therefore build on quick-xml,
//! base64, flate2, `lz4_flex` and lzma-rust2, and check every count against the size of the file before they allocate
//! memory.

mod abaqus;
mod array;
mod assemble;
mod budget;
mod cells;
mod curved;
mod detect;
mod gmsh;
mod integers;
mod isaac;
mod lattice;
mod listed;
mod loss;
mod medit;
mod npy;
mod points;
mod procedural;
mod report;
mod scalar;
mod source;
mod steps;
mod stored;
mod surfaces;
mod tags;
mod tetgen;
mod tokens;
mod unpack;
mod vega;
mod vtk;
mod vtu;
mod write;

use std::path::Path;
use std::time::Instant;

use crate::error::Result;
use crate::mesh::Mesh;
use crate::named::named;
pub use array::without_lengths;
use assemble::Assembly;
use detect::Format;
pub use listed::listed_files;
pub use points::{load_points, read_points};
pub use report::{CellCount, Fate, Report};
use source::Source;
pub use source::printable;
pub use steps::TimeStep;
pub use write::{
    Channel, Located, NpyNumber, OutputFile, OutputFormat, SliceGrid, SliceWriter, VoxelPackage, VoxelWriter, destination, is_part,
    write_json, write_located, write_mesh, write_npy, write_png, xml_attribute,
};

/// How to read a mesh.
#[derive(Clone, Debug)]
pub struct LoadOptions {
    /// Which points that have equal coordinates become one. Of each array, the first value that there is at them counts.
    pub merge: Merge,
    /// Compressed arrays may unpack to this many times the size of the file plus 64 MiB; a file that needs more is
    /// refused. Within the same limit, arrays that do not cover the mesh are filled up with NaN; those that would need
    /// more are left out. Default 100.
    pub expansion: u64,
    /// Which time step of a series is read: of a `.pvd` or `.series`, or of a `.vtu` or `.msh` with several. What has no
    /// time steps is the same at all of them.
    pub step: TimeStep,
    /// What becomes of curved cells.
    pub curved: Curved,
}

/// What becomes of curved cells, that is cells with nodes besides their corners.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Curved {
    /// Only their corners are used: edges are straight, and fields are linear in a cell.
    #[default]
    Corners,
    /// Quadratic cells, which have a node in the middle of each edge, are split into tetrahedra that use all nodes and the
    /// values there: one of ten nodes into eight, others around their middle, where a point is added if there is no node.
    /// Cells of still higher order are taken by their corners.
    Split,
}

named!(Curved, "treatment of curved cells", [Corners = "corners", Split = "split"]);

impl Default for LoadOptions {
    fn default() -> Self {
        Self { merge: Merge::default(), expansion: 100, step: TimeStep::Number(0), curved: Curved::default() }
    }
}

/// Which points that have equal coordinates become one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Merge {
    /// None of them.
    Nothing,
    /// A point and the first one of an earlier piece of the file, or of an earlier file of a list, so that the seams
    /// between pieces do not become boundary. Where files of different blocks (of a `.vtm`, `.vtpc` or `.pvd`) have
    /// different values at a point, it stays two, so that a field may jump between blocks; each then keeps its boundary
    /// there. The pieces of a `.vtu`, `.pvtu` or `.vtpd` are one mesh, and so are those of one block.
    #[default]
    Pieces,
    /// All of them: for files in which each cell has points of its own. Slits, that is boundaries whose two sides
    /// coincide, close as well.
    All,
}

named!(Merge, "kind of merging", [Nothing = "nothing", Pieces = "pieces", All = "all"]);

/// A mesh and the report about its file.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// The mesh.
    pub mesh: Mesh,
    /// What was found in the file.
    pub report: Report,
}

/// Reads a mesh file, or makes a procedural mesh: `kuhn:NX,NY,NZ` (optionally with `,jitter=J` and `,seed=S`) calls
/// [`crate::mesh::kuhn`]; `graded:N`, `shell:N` and `slivers:N` call the functions of [`crate::mesh`] with these names.
///
/// Fields have no value (NaN) at points that only ghost cells use, which are left out.
///
/// # Errors
/// [`crate::Error::Io`] if the file cannot be read, [`crate::Error::File`] with the place if it is broken or in no
/// known format, [`crate::Error::Invalid`] for a malformed name of a procedural mesh, [`crate::Error::TooLarge`] if the
/// mesh exceeds 32-bit indices.
pub fn load(spec: impl AsRef<Path>, options: &LoadOptions) -> Result<Loaded> {
    let start = Instant::now();
    let path = spec.as_ref();
    if let Some(made) = path.to_str().and_then(procedural::make) {
        return made.map(|(format, mesh)| procedural::loaded(format, mesh, start));
    }
    read(&Source::open(path, detect::READABLE)?, options, start)
}

/// Reads a mesh from the content of a file. `name` is the path used in messages, and its extension helps to recognise
/// the format. The second file of a TetGen pair and the files that a `.pvtu` or the like lists, or an `.inp` includes, are
/// searched for next to `name`.
///
/// # Errors
/// As [`load`].
pub fn load_bytes(name: impl AsRef<Path>, bytes: Vec<u8>, options: &LoadOptions) -> Result<Loaded> {
    read(&Source::new(name.as_ref(), bytes), options, Instant::now())
}

fn read(source: &Source, options: &LoadOptions, start: Instant) -> Result<Loaded> {
    let (mesh, mut report) = assembled(source, options)?.finish()?;
    report.seconds = start.elapsed().as_secs_f64();
    Ok(Loaded { mesh, report })
}

/// What a file contains, before it is checked as a mesh.
fn assembled(source: &Source, options: &LoadOptions) -> Result<Assembly> {
    let companion;
    match detect::detect(source)? {
        Format::VtkXml => vtu::read(source, options),
        Format::Series => vtk::series::read(source, options),
        Format::VtkLegacy => vtk::read(source, options),
        Format::Gmsh => gmsh::read(source, options),
        Format::Medit => medit::read(source, options),
        Format::MeditBinary => medit::binary::read(source, options),
        Format::TetGen => {
            companion = tetgen::companion(source)?;
            tetgen::read(source, &companion, options)
        }
        Format::Isaac => isaac::read(source, options),
        Format::Abaqus => abaqus::read(source, options),
        Format::Vega => vega::read(source, options),
    }
}
