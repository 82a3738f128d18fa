//! Options of a build, and limits of queries, the same for the device and the CPU. They do not depend on Vulkan.

use crate::error::{Error, Result};
use crate::grid::MAX_LEVEL;
use crate::named::named;

pub use crate::layout::constants::slice_locate::TOLERANCE;

/// Number of entries of a list that one dispatch searches.
pub const LIST_PART: u32 = 16_384;

/// Most points that are sorted and located together.
pub const POINT_CHUNK: usize = 1 << 20;

/// Most leading bits of the Morton code that points are sorted by.
pub const POINT_CODE_BITS: u32 = 22;

/// Number of consecutive points that are located together as a run, each starting from the owner of the one before.
pub const POINT_RUN: u32 = 8;

/// The assignment: which grid cells list a tetrahedron (SPEC 2.2). A stronger test gives shorter lists and a longer
/// construction.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[repr(u32)]
pub enum Assign {
    /// Every cell of the tetrahedron's quantized bounding box (the paper, Eq. 5–6).
    Aabb = 0,
    /// The cells of the box that no face plane separates from the tetrahedron. Takes about as long to build as
    /// [`Self::Aabb`], since there is less to sort.
    #[default]
    Planes = 1,
    /// The cells of the box that touch the tetrahedron, tested with its face planes and the 18 cross products of edges
    /// and axes.
    Exact = 2,
}

/// The tetrahedra that a leaf lists (SPEC 2.6).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[repr(u32)]
pub enum Lists {
    /// All tetrahedra that the assignment puts there (the paper).
    All = 0,
    /// All of them in boundary leaves; in a leaf that lies entirely within the mesh only the seed, which is the owner
    /// of the cell's centre and from which a walk across faces finds the others. The number of entries grows with the
    /// mesh's surface instead of its volume.
    #[default]
    Boundary = 1,
}

/// How fine the leaves are, beyond what α or a given level sets.
///
/// α refers to the largest extent of a tetrahedron as a fraction of the bounds along that axis. The tree over a plate
/// whose tetrahedra span its thickness is therefore a single node, and points beside thin parts meet long lists. The
/// other variants build finer trees after it, one by one, where that repays the time, as far as capacity and memory allow; with a
/// budget none is built. This applies to [`crate::build::Tree::build`] and the reference implementation, which know the
/// counts in time. A recorded build ignores it, and should be given the level of a tree over the undeformed mesh
/// ([`BuildOptions::level`]).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[repr(u32)]
pub enum Fineness {
    /// As fine as α or the requested level makes them (the paper).
    #[default]
    Alpha = 0,
    /// For points, slices and overlap: a leaf lists up to 128 entries on average.
    Points = 1,
    /// For rendering, which makes far more queries: a leaf lists up to 30 entries on average. (From a mean of 110
    /// entries, one more level renders twice as fast; from 31, 1.4 times; from 20, the gain equals the cost.) Leaves
    /// are in any case as fine as 2^20 entries of `Aabb` allow, since rays pass empty cells immediately.
    Pictures = 2,
}

impl Fineness {
    /// The most entries that a leaf may list on average, and a number of `Aabb` entries that the tree may always have;
    /// `None` if neither limit applies.
    pub(crate) fn limits(self) -> Option<(u64, u64)> {
        match self {
            Self::Alpha => None,
            Self::Points => Some((128, 0)),
            Self::Pictures => Some((30, 1 << 20)),
        }
    }

    /// Whether finer leaves than those of α would suit better, given the mean number of entries per leaf.
    pub fn wants_finer(self, mean: u64) -> bool {
        self.limits().is_some_and(|(most, _)| mean > most)
    }
}

named!(Assign, "assignment", [Aabb = "aabb", Planes = "planes", Exact = "exact"]);
named!(Lists, "kind of lists", [All = "all", Boundary = "boundary"]);
named!(Fineness, "fineness", [Alpha = "alpha", Points = "points", Pictures = "pictures"]);

/// Options of a build.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BuildOptions {
    /// The paper's α in 0…10: how many levels coarser than the cells' size the leaves are.
    pub alpha: f32,
    /// The assignment of tetrahedra to grid cells.
    pub assign: Assign,
    /// The tetrahedra that a leaf lists.
    pub lists: Lists,
    /// Whether to store a box per node (24 bytes each), as the paper does. No query of this crate reads them, as boxes follow
    /// from the grid: they are for those who download the tree ([`crate::build::Tree::download`]).
    pub boxes: bool,
    /// Whether the leaves at the surface get slabs ([`crate::reference::slabs`]), which tell most points beside the mesh
    /// without a search. They take 4 bytes per leaf, and a build of thin bodies up to a third longer. They pay for pictures
    /// and slices, which ask for many such points. There are none with [`Lists::All`].
    pub slabs: bool,
    /// Most entries the tree may have; the tree gets coarser until it fits. `Planes` and `Exact` are limited by the
    /// entry count of `Aabb`, which bounds theirs and is known without their tests. `None`: [`usual_capacity`].
    pub capacity: Option<u32>,
    /// Most bytes that the arrays of the tree may have together ([`crate::tree::TreeBytes::total`]), while α sets the
    /// finest level; the tree gets coarser until it fits. The budget is compared with [`crate::tree::TreeBytes::most`],
    /// which is known before anything is built. `None`: no limit.
    pub budget: Option<u64>,
    /// Level of the leaves, up to 10, which replaces the choice by α; capacity and budget still apply. `None`: by α.
    pub level: Option<u32>,
    /// Whether to build finer leaves than that where they suit the queries better.
    pub fineness: Fineness,
}

/// Entries per tetrahedron of [`usual_capacity`]; a mesh of even tetrahedra has about 8 at α = 0.
pub const USUAL_ENTRIES: u32 = 64;
/// The smallest value of [`usual_capacity`].
pub const LEAST_USUAL: u32 = 1 << 20;

/// Most entries of a tree over `tets` tetrahedra if [`BuildOptions::capacity`] is not given. Without a limit, where
/// tetrahedra differ much in size, the mean that α refers to is that of the small ones, and each large one would be
/// listed by hundreds of leaves.
pub fn usual_capacity(tets: u32) -> u32 {
    tets.saturating_mul(USUAL_ENTRIES).max(LEAST_USUAL)
}

impl BuildOptions {
    /// α in units of 1/65536, rounded to nearest, so that every device chooses the same level.
    ///
    /// # Errors
    /// [`Error::Invalid`] if α is not in 0…10.
    pub fn alpha_fixed(&self) -> Result<u32> {
        if (0.0..=10.0).contains(&self.alpha) {
            Ok((f64::from(self.alpha) * 65536.0).round() as u32)
        } else {
            Err(Error::Invalid(format!("alpha is {}, it must be from 0 to 10", self.alpha)))
        }
    }

    /// Whether leaves have slabs.
    pub(crate) fn has_slabs(&self) -> bool {
        self.slabs && self.lists == Lists::Boundary
    }

    /// The level that is asked for instead of the one that α gives.
    ///
    /// # Errors
    /// [`Error::Invalid`] if it is not in 0…10.
    pub fn checked_level(&self) -> Result<Option<u32>> {
        match self.level {
            Some(level) if level > MAX_LEVEL => Err(Error::Invalid(format!("level is {level}, it must be from 0 to {MAX_LEVEL}"))),
            level => Ok(level),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn alpha_is_checked_and_rounded() {
        let fixed = |alpha| BuildOptions { alpha, ..BuildOptions::default() }.alpha_fixed();
        assert_eq!(fixed(0.0).unwrap(), 0);
        assert_eq!(fixed(0.5).unwrap(), 32768);
        assert_eq!(fixed(10.0).unwrap(), 655_360);
        for bad in [-0.001, 10.001, f32::NAN, f32::INFINITY] {
            assert!(matches!(fixed(bad), Err(Error::Invalid(_))), "{bad}");
        }
    }

    #[test]
    fn assignments_have_names() {
        for a in Assign::EVERY {
            assert_eq!(a.to_string().parse::<Assign>().unwrap(), a);
        }
        for lists in Lists::EVERY {
            assert_eq!(lists.to_string().parse::<Lists>().unwrap(), lists);
        }
        assert!("boxes".parse::<Assign>().is_err_and(|e| e.to_string().contains("aabb, planes, exact")));
    }
}
