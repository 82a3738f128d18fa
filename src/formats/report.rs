//! What was found in a mesh file and what became of it.

use std::fmt;

use serde::Serialize;

/// What became of the cells of one type.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Fate {
    /// Taken as they are.
    Kept,
    /// Curved tetrahedra, taken as straight ones by their corners.
    Straightened,
    /// Split into tetrahedra (curved ones by their corners).
    Split,
    /// Points, lines and surfaces, which have no volume.
    Boundary,
    /// Copies of cells of a neighbouring piece, marked so by the writer of a parallel file.
    Ghost,
    /// Volumes that cannot be read: they are missing in the mesh.
    Unsupported,
}

/// The cells of one type in a file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct CellCount {
    /// Name of the type.
    pub name: String,
    /// Number of cells.
    pub count: u64,
    /// What became of them.
    pub fate: Fate,
    /// Number of tetrahedra they gave.
    pub tetrahedra: u64,
}

/// What was found in a mesh file and what became of it. `Display` gives a few lines of text.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Report {
    /// Format, version, encoding.
    pub format: String,
    /// Size of the file or files in bytes.
    pub bytes: u64,
    /// Seconds it took to read them.
    pub seconds: f64,
    /// Number of points.
    pub points: u64,
    /// Points that no tetrahedron uses.
    pub unused_points: u64,
    /// Cell types in the order in which they first appear.
    pub cells: Vec<CellCount>,
    /// Number of tetrahedra of the mesh.
    pub tetrahedra: u64,
    /// Tetrahedra of the file whose vertices are numbered against the convention (pieces of split cells are not counted).
    pub negative: u64,
    /// Tetrahedra whose volume is exactly zero in double precision.
    pub flat: u64,
    /// Split cells so warped that pieces of them are turned inside out.
    pub tangled: u64,
    /// Smallest and largest coordinates of the used points, in the file's coordinates.
    pub bounds: [[f64; 3]; 2],
    /// What was subtracted from all coordinates ([`crate::mesh::Mesh::origin`]).
    pub origin: [f64; 3],
    /// What the reader wants to be known, one sentence each.
    pub warnings: Vec<String>,
}

/// What became of them, in words.
impl fmt::Display for CellCount {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.fate {
            Fate::Kept => write!(f, "taken as they are"),
            Fate::Straightened => write!(f, "taken by their corners, with straight edges"),
            Fate::Split => write!(f, "split into {} tetrahedra that keep the id of their cell", self.tetrahedra),
            Fate::Boundary => write!(f, "left out, no volume"),
            Fate::Ghost => write!(f, "left out, ghost copies"),
            Fate::Unsupported => write!(f, "NOT READ, so the mesh has holes there; tetrahedralise them first"),
        }
    }
}

impl Report {
    /// Number of cells with that fate.
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
        if self.tangled > 0 {
            writeln!(f, "  {} split cells are so warped that pieces of them overlap", self.tangled)?;
        }
        if self.origin != [0.0; 3] {
            let [x, y, z] = self.origin;
            writeln!(f, "  coordinates are kept relative to ({x}, {y}, {z}), for precision")?;
        }
        self.warnings.iter().try_for_each(|w| writeln!(f, "  warning: {w}"))
    }
}
