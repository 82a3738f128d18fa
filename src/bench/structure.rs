//! One structure of any kind over one mesh.

use super::quantity::Quantity;
use crate::baseline::{Lbvh, RayMethod, Rays};
use crate::build::{DeviceMesh, Tree};
use crate::error::Result;
use crate::gpu::Gpu;
use crate::options::{Assign, BuildOptions, Fineness, Lists, TOLERANCE};
use crate::query::{self, LocateMethod, LocateOptions, Located, MOST_TRAVERSED, Overlapped, SILENT};
use crate::times::StageTimes;

/// A kind of structure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// The octree.
    Octree {
        /// The paper's α.
        alpha: u8,
        /// How tetrahedra are assigned to leaves.
        assign: Assign,
        /// Which leaves list all of their tetrahedra; in the paper every one does.
        lists: Lists,
    },
    /// The octree as the program builds it for pictures: leaves as fine as suits these, with slabs.
    Fine,
    /// The binary tree of the paper's comparison.
    Lbvh,
    /// The device's ray-tracing acceleration structure over the faces.
    Rays(RayMethod),
}

impl Kind {
    /// Every kind, in the order of the tables; the answers of the first one are those that the others must give.
    pub fn all() -> Vec<Self> {
        let [aabb, planes, exact] = Assign::EVERY.map(|assign| (assign, Lists::All));
        let choices = [aabb, planes, exact, (Assign::default(), Lists::Boundary)];
        let octrees = (0..3).flat_map(|alpha| choices.map(|(assign, lists)| Self::Octree { alpha, assign, lists }));
        octrees.chain([Self::Fine, Self::Lbvh]).chain(RayMethod::EVERY.map(Self::Rays)).collect()
    }

    /// How tetrahedra are assigned to the leaves of an octree, and which leaves list all of theirs.
    pub(super) fn lists(self) -> Option<(Assign, Lists)> {
        match self {
            Self::Octree { assign, lists, .. } => Some((assign, lists)),
            Self::Fine => Some((Assign::default(), Lists::default())),
            Self::Lbvh | Self::Rays(_) => None,
        }
    }

    /// Whether the structure can find the overlap of two meshes.
    pub(super) fn overlaps(self) -> bool {
        !matches!(self, Self::Rays(_))
    }
}

impl std::fmt::Display for Kind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Octree { alpha, assign, lists: Lists::All } => write!(f, "OLBVH α={alpha} {assign}"),
            Self::Octree { alpha, lists, .. } => write!(f, "OLBVH α={alpha} lists {lists}"),
            Self::Fine => f.write_str("OLBVH fine, slabs"),
            Self::Lbvh => f.write_str("LBVH"),
            Self::Rays(method) => f.write_str(method.name()),
        }
    }
}

/// A structure on the device.
#[expect(clippy::large_enum_variant, reason = "there are few, and they are not moved about")]
pub(super) enum Structure {
    Octree(Tree),
    Lbvh(Lbvh),
    Rays(Rays),
}

impl Structure {
    /// Builds a structure; `None` if the device lacks a required feature.
    pub(super) fn build(gpu: &Gpu, mesh: &DeviceMesh, kind: Kind) -> Result<Option<Self>> {
        let octree = |options: BuildOptions| Tree::build(gpu, mesh, &options).map(Self::Octree);
        Ok(match kind {
            Kind::Octree { alpha, assign, lists } => {
                Some(octree(BuildOptions { alpha: f32::from(alpha), assign, lists, ..BuildOptions::default() })?)
            }
            Kind::Fine => Some(octree(BuildOptions { fineness: Fineness::Pictures, slabs: true, ..BuildOptions::default() })?),
            Kind::Lbvh => Some(Self::Lbvh(Lbvh::build(gpu, mesh)?)),
            Kind::Rays(method) => Rays::build(gpu, mesh, method)?.map(Self::Rays),
        })
    }

    /// Whether points are also located by the paper's own traversal, which cuts off long lists.
    pub(super) fn traverses(&self, kind: Kind) -> bool {
        let paper = matches!(kind, Kind::Octree { assign: Assign::Aabb, lists: Lists::All, .. });
        paper && matches!(self, Self::Octree(tree) if tree.status().longest_leaf <= MOST_TRAVERSED)
    }

    /// Device times of the stages of the construction.
    pub(super) fn times(&self) -> &StageTimes {
        match self {
            Self::Octree(tree) => tree.times(),
            Self::Lbvh(lbvh) => lbvh.times(),
            Self::Rays(rays) => rays.times(),
        }
    }

    /// Locates points in the way that suits those of `quantity`: samples of rays each independently, as the paper does;
    /// others, where leaves within the mesh have no lists, as [`LocateMethod::fastest`] chooses.
    pub(super) fn locate(&self, points: &[[f32; 3]], quantity: Quantity) -> Result<Located> {
        match self {
            Self::Octree(tree) => {
                let fastest = |in_order| LocateMethod::fastest(tree.gpu(), points.len(), tree.mesh().input.tets as usize, in_order);
                let method = match (quantity, tree.memory().lists) {
                    (Quantity::TraverseRandom | Quantity::TraverseCoherent, _) => LocateMethod::Traversal(8),
                    (Quantity::LocateRandom, Lists::Boundary) => fastest(false),
                    (Quantity::LocateCoherent, Lists::Boundary) => fastest(true),
                    _ => LocateMethod::Descent,
                };
                query::locate(tree, points, None, &LocateOptions { method, ..LocateOptions::default() }, SILENT)
            }
            Self::Lbvh(lbvh) => lbvh.locate(points, TOLERANCE),
            Self::Rays(rays) => rays.locate(points),
        }
    }

    /// The tetrahedra of the two meshes that intersect the other mesh; `None` if the structures cannot find them.
    pub(super) fn overlap(&self, other: &Self) -> Result<Option<Overlapped>> {
        match (self, other) {
            (Self::Octree(a), Self::Octree(b)) => query::overlap(a, b, SILENT).map(Some),
            (Self::Lbvh(a), Self::Lbvh(b)) => a.overlap(b, SILENT).map(Some),
            _ => Ok(None),
        }
    }
}
