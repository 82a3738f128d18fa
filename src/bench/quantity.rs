//! The quantities that are measured.

use crate::named::named;
use serde::Serialize;

/// A quantity that is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    /// Construction.
    Build,
    /// Ray intervals of a picture.
    Intervals,
    /// March of a picture, counting the samples in the mesh.
    March,
    /// Conservative slicing.
    Slice,
    /// Overlap with the moved mesh.
    Overlap,
    /// Location of points in no order.
    LocateRandom,
    /// Location of points along a Z curve.
    LocateCoherent,
    /// Location of the samples of a picture, each independently.
    LocateSamples,
    /// Location of points in no order by the paper's traversal.
    TraverseRandom,
    /// Location of points along a Z curve by the paper's traversal.
    TraverseCoherent,
}

// In the paper's order; files have these names, too.
named!(
    Quantity,
    "quantity",
    [
        Build = "fig06_construction",
        Intervals = "table3_ray_intervals",
        March = "fig07_samples",
        LocateSamples = "fig07_samples_located",
        Slice = "fig08_slicing",
        Overlap = "fig10_overlap",
        LocateRandom = "location_random",
        LocateCoherent = "location_coherent",
        TraverseRandom = "location_random_traversal",
        TraverseCoherent = "location_coherent_traversal",
    ]
);

impl Quantity {
    /// The quantity for the same points, located by the paper's traversal; `None` if there is none.
    pub(super) fn traversed(self) -> Option<Self> {
        match self {
            Self::LocateRandom => Some(Self::TraverseRandom),
            Self::LocateCoherent => Some(Self::TraverseCoherent),
            _ => None,
        }
    }

    /// Title of a table, with the figure or table of the paper.
    pub fn title(self) -> &'static str {
        match self {
            Self::Build => "Construction (Fig. 6)",
            Self::Intervals => "Ray intervals (Table 3)",
            Self::March => "Samples inside the mesh, ray marching (Fig. 7)",
            Self::Slice => "Conservative slicing (Fig. 8)",
            Self::Overlap => "Overlap with the moved mesh (Fig. 10)",
            Self::LocateRandom => "Point location, random points",
            Self::LocateCoherent => "Point location, points along a Z curve",
            Self::LocateSamples => "Samples inside the mesh, each located by itself (Fig. 7)",
            Self::TraverseRandom => "Point location by the paper's traversal, random points",
            Self::TraverseCoherent => "Point location by the paper's traversal, points along a Z curve",
        }
    }

    /// Whether it is reported in items per second instead of milliseconds.
    pub fn is_rate(self) -> bool {
        !matches!(self, Self::Build | Self::Intervals | Self::Slice | Self::Overlap)
    }
}
