//! What a caller may ask of a build. One set of options for the device and the CPU; knows no Vulkan.

use crate::error::{Error, Result};

/// How far below 0 the smallest barycentric coordinate of a point's owner may be in a boundary leaf, unless the caller says otherwise (SPEC 3.1).
pub const TOLERANCE: f32 = 1e-5;

/// Points that are located one after the other, each from the owner of the one before, where they lie near each other.
pub const POINT_RUN: u32 = 8;

/// Which cells list a primitive (SPEC 2.2). The stronger the test, the shorter the lists and the longer the construction.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[repr(u32)]
pub enum Assign {
    /// Every cell of the primitive's quantized bounding box (the paper, Eq. 5–6).
    Aabb = 0,
    /// Of those, the cells that no face plane separates from the primitive. Takes about as long to build as [`Self::Aabb`], since there is less to sort.
    #[default]
    Planes = 1,
    /// Of those, the cells that touch the primitive: face planes and the 18 crosses of edges and axes.
    Exact = 2,
}

/// Which primitives a leaf lists (SPEC 2.6).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[repr(u32)]
pub enum Lists {
    /// All that the assignment puts there (the paper).
    All = 0,
    /// The same in leaves that the boundary touches; in a leaf that is full of mesh one primitive, the owner of the cell's centre, from which a
    /// walk across faces finds the others. Entries grow with the mesh's surface instead of its volume.
    #[default]
    Boundary = 1,
}

/// How fine leaves are, where nothing else says it.
///
/// α goes by the largest extent of a cell in parts of the bounds along that axis, so the tree over a plate, whose cells reach through it, is a single node, and
/// points beside thin parts meet long lists. A finer tree than α's is built after it where that repays the time, as far as capacity and memory allow. It is for
/// trees in memory of our own ([`crate::build::Tree::build`]) and the reference, where counts are known in time; a recorded build takes no notice, and is given
/// the level that a tree over the mesh at rest came to ([`BuildOptions::level`]).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[repr(u32)]
pub enum Fineness {
    /// As α or the level asked for says (the paper).
    #[default]
    Alpha = 0,
    /// As suits points, slices and overlap: a leaf lists up to 128 entries on average.
    Points = 1,
    /// As suits pictures, which ask far more: up to 30 entries on average (of 110 a level more draws twice as fast, of 31 1.4 times, of 20 it costs what it
    /// gains), and anyway as fine as 2^20 entries of `Aabb` go, since rays pass by empty cells at once.
    Pictures = 2,
}

impl Fineness {
    /// Entries that a leaf lists at most on average, and entries of `Aabb` that a tree may have anyway; nothing where neither matters.
    pub(crate) fn limits(self) -> Option<(u64, u64)> {
        match self {
            Self::Alpha => None,
            Self::Points => Some((128, 0)),
            Self::Pictures => Some((30, 1 << 20)),
        }
    }

    /// Whether finer leaves than α's would suit better, by their mean number of entries.
    pub fn wants_finer(self, mean: u64) -> bool {
        self.limits().is_some_and(|(most, _)| mean > most)
    }
}

/// Names of the variants, as the command line and reports use them.
macro_rules! named {
    ($type:ident, $what:literal, [$($variant:ident = $name:literal),+ $(,)?]) => {
        impl $type {
            /// Every variant, in order.
            pub const EVERY: [Self; [$($name),+].len()] = [$(Self::$variant),+];

            /// The name used on the command line and in reports.
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $name),+
                }
            }
        }

        impl std::fmt::Display for $type {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str(self.name())
            }
        }

        impl std::str::FromStr for $type {
            type Err = $crate::Error;

            fn from_str(name: &str) -> $crate::Result<Self> {
                let found = Self::EVERY.into_iter().find(|v| v.name().eq_ignore_ascii_case(name));
                let known = || Self::EVERY.map(Self::name).join(", ");
                found.ok_or_else(|| $crate::Error::Invalid(format!("unknown {} `{name}`; known are {}", $what, known())))
            }
        }
    };
}

pub(crate) use named;

named!(Assign, "assignment", [Aabb = "aabb", Planes = "planes", Exact = "exact"]);
named!(Lists, "kind of lists", [All = "all", Boundary = "boundary"]);
named!(Fineness, "fineness", [Alpha = "alpha", Points = "points", Pictures = "pictures"]);

/// How to build a tree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BuildOptions {
    /// The paper's α in 0…10: how many levels coarser than the cells' size the leaves are.
    pub alpha: f32,
    /// Which cells list a primitive.
    pub assign: Assign,
    /// Which primitives a leaf lists.
    pub lists: Lists,
    /// Store a box per node (24 bytes each). Without, boxes follow from the grid.
    pub boxes: bool,
    /// Most entries (primitive ids in leaves) the tree may have; the tree gets coarser until it fits. `Planes` and `Exact` are held to the
    /// count of `Aabb`, which bounds theirs and is known without their tests. `None`: [`usual_capacity`].
    pub capacity: Option<u32>,
    /// Most bytes that the arrays of the tree may have together ([`crate::tree::TreeBytes::total`]), α being the finest that is asked for: the tree gets
    /// coarser until it fits. What is held to the budget is [`crate::tree::TreeBytes::most`], which is known before anything is built. `None`: no limit.
    pub budget: Option<u64>,
    /// Level that the leaves should have, up to 10, whatever α and the size of the cells ask for; capacity and budget still hold. `None`: by α.
    pub level: Option<u32>,
    /// How fine leaves are beyond that.
    pub fineness: Fineness,
}

/// Entries per tetrahedron of the usual capacity; even cells have about 8 at α = 0.
pub const USUAL_ENTRIES: u32 = 64;
/// The least usual capacity.
pub const LEAST_USUAL: u32 = 1 << 20;

/// Most entries of the tree over so many tetrahedra where no capacity is asked for: where cells differ much in size, the mean that α refers to is that of
/// the small ones, and the large ones would fill hundreds of leaves each.
pub fn usual_capacity(tets: u32) -> u32 {
    tets.saturating_mul(USUAL_ENTRIES).max(LEAST_USUAL)
}

impl Default for BuildOptions {
    fn default() -> Self {
        Self {
            alpha: 0.0,
            assign: Assign::default(),
            lists: Lists::default(),
            boxes: false,
            capacity: None,
            budget: None,
            level: None,
            fineness: Fineness::Alpha,
        }
    }
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
