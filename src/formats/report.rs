//! The report about a mesh file: what was found in it and what became of it.

use std::fmt;

use serde::Serialize;

/// What became of the file cells of one type.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Fate {
    /// Tetrahedra that were taken unchanged.
    Kept,
    /// Curved tetrahedra, of which only the corners were used.
    Straightened,
    /// Cells that were split into tetrahedra (curved cells by their corners only, unless [`crate::formats::Curved::Split`] is asked for).
    Split,
    /// Points, lines and surfaces, which have no volume.
    Boundary,
    /// Copies of cells of a neighbouring piece, marked as such by the writer of a parallel file, and cells that are
    /// marked as hidden.
    Ghost,
    /// Volumes of a type that cannot be read; they are missing in the mesh.
    Unsupported,
}

/// The file cells of one type.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct CellCount {
    /// Name of the type.
    pub name: String,
    /// Number of cells.
    pub count: u64,
    /// What became of them.
    pub fate: Fate,
    /// Number of tetrahedra made from them.
    pub tetrahedra: u64,
}

/// What was found in a mesh file and what became of it. `Display` formats it as a few lines of text.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Report {
    /// Format, version, encoding.
    pub format: String,
    /// Size of the file, or of all files read, in bytes.
    pub bytes: u64,
    /// Time for reading in seconds.
    pub seconds: f64,
    /// Number of points.
    pub points: u64,
    /// Points that no tetrahedron uses.
    pub unused_points: u64,
    /// Points that were added to those of the file, in the middle of polyhedra and quadratic cells, with values that follow
    /// from those around them.
    pub added_points: u64,
    /// Cell types in the order in which they first appear.
    pub cells: Vec<CellCount>,
    /// Number of tetrahedra of the mesh.
    pub tetrahedra: u64,
    /// Tetrahedra of the file whose vertices are ordered against the convention (pieces of split cells are not
    /// counted).
    pub negative: u64,
    /// Tetrahedra whose volume is exactly zero in double precision.
    pub flat: u64,
    /// Split cells that are so warped, or so far from convex, that some of their pieces overlap.
    pub tangled: u64,
    /// Smallest and largest coordinates of the points in use, in the coordinates of the file.
    pub bounds: [[f64; 3]; 2],
    /// The vector that was subtracted from all coordinates ([`crate::mesh::Mesh::origin`]).
    pub origin: [f64; 3],
    /// Warnings of the reader, one sentence each.
    pub warnings: Vec<String>,
}

/// Describes what became of the cells.
impl fmt::Display for CellCount {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.fate {
            Fate::Kept => write!(f, "taken as they are"),
            Fate::Straightened => write!(f, "taken by their corners, with straight edges"),
            Fate::Split => write!(f, "split into {} tetrahedra that keep the id of their cell", self.tetrahedra),
            Fate::Boundary => write!(f, "left out, no volume"),
            Fate::Ghost => write!(f, "left out, ghost copies or hidden"),
            Fate::Unsupported => write!(f, "NOT READ, so the mesh has holes there; tetrahedralise them first"),
        }
    }
}

impl Report {
    /// Number of file cells with this fate.
    pub fn count(&self, fate: Fate) -> u64 {
        self.cells.iter().filter(|c| c.fate == fate).map(|c| c.count).sum()
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}, {} bytes", self.format, self.bytes)?;
        write!(f, "{} points", self.points)?;
        if self.unused_points > 0 {
            write!(f, " ({} of them in no cell)", self.unused_points)?;
        }
        if self.added_points > 0 {
            write!(f, " ({} of them added in the middle of cells)", self.added_points)?;
        }
        writeln!(f, ", {} tetrahedra", self.tetrahedra)?;
        for c in &self.cells {
            writeln!(f, "  {} {}: {c}", c.count, c.name)?;
        }
        if self.negative > 0 {
            writeln!(f, "  {} tetrahedra are numbered the other way round (harmless)", self.negative)?;
        }
        if self.flat > 0 {
            writeln!(f, "  {} tetrahedra have no volume", self.flat)?;
        }
        if self.origin != [0.0; 3] {
            let [x, y, z] = self.origin;
            writeln!(f, "  coordinates are kept relative to ({x}, {y}, {z}), for precision")?;
        }
        self.warnings.iter().try_for_each(|w| writeln!(f, "  warning: {w}"))
    }
}
