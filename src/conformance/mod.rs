//! The conformance suite: compares every primitive, stage and query of the device with the reference implementation in
//! [`crate::reference`].
//!
//! Cases are data ([`cases`]): a name, a group, and what is computed from which seeded input. One runner ([`Lab`])
//! serves both the tests and the command line; it needs nothing but a device. For a case that fails, [`Failure`] names
//! the kernel or stage, the array, the first index that differs, the expected value and the value found.
//!
//! Some cases also compare answers from different trees. Where tetrahedra of the mesh overlap, these may differ without
//! any fault of the device; such a case passes, and its [`Report`] names the difference and two of the tetrahedra.
//!
//! ```text
//! scan/100003/indirect-below/narrow        length, where the count is known [, target]
//! sort/21-bits/100000/indirect/reversed    bits of the keys, length, count [, keys] [, target]
//! mesh/two-share-face                      topology: bounds, bad cells, neighbours, boundary
//! scan/100003/host/in-place/row-amd        … with the target for a kind of device
//! build/slivers/exact/alpha-1.5/recorded   mesh, assignment [, lists], α [, boxes], how it is built [, target]
//! locate/cloud/aabb/alpha-0.5/stack-3      mesh, assignment [, lists], α, path, or `nearest`: the surface closest to points
//! ranges/slivers/exact/alpha-1/cells       mesh, assignment [, lists], α, field
//! render/one-tet/iso/points/shaded         mesh, camera, field [, light] [, transfer function] [, clips] [, parts]
//! slice/plate/aabb/alpha-2/oblique         mesh, assignment [, lists], α, stack of layers
//! overlap/cloud/exact/alpha-1/grid         mesh, assignment [, lists], α, the other mesh
//! ```

mod buffers;
mod build;
mod build_cases;
mod build_expected;
mod data;
mod failure;
mod lab;
mod locate;
mod meshes;
mod overlap;
mod picture;
mod points;
mod primitive_cases;
mod primitives;
mod query_cases;
mod ranges;
mod slice;
mod tangles;
mod topology;
mod twin;

pub use failure::Failure;
pub use lab::{Lab, Outcome, Report};
#[doc(hidden)]
pub use overlap::{HostAndDevice, check_overlap};

use build::BuildCase;
use locate::LocateCase;
use meshes::MeshRecipe;
use overlap::OverlapCase;
use picture::PictureCase;
use primitives::{ScanCase, SortCase, TargetKind};
use ranges::RangesCase;
use slice::SliceCase;

use crate::mesh::Mesh;
use crate::named::named;

/// Group of cases by the time that they take.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Group {
    /// Cases that together take less than two minutes on two cores with lavapipe.
    Quick,
    /// Further cases; together with `Quick`, everything except `Large`.
    Full,
    /// Cases with buffers of more than 2^26 words, which run only on request.
    Large,
}

named!(Group, "group of cases", [Quick = "quick", Full = "full", Large = "large"]);

/// One comparison.
#[derive(Clone, Debug)]
pub struct Case {
    /// Name of the case: parts separated by `/`, from the general to the particular.
    pub name: String,
    /// Group of the case.
    pub group: Group,
    work: Work,
}

/// What a case computes.
#[derive(Clone, Debug)]
enum Work {
    SelfTest,
    Scan(ScanCase),
    Sort(SortCase),
    Topology(MeshRecipe),
    Build(BuildCase),
    Locate(LocateCase),
    Ranges(RangesCase),
    Picture(PictureCase),
    Slice(SliceCase),
    Overlap(OverlapCase),
}

impl Case {
    /// Whether a filter selects this case. A filter is the name of a group (`quick`; `full`, which includes `quick`;
    /// `large`) or a part of the case's name. Without a filter, all cases except those of `large` are selected.
    pub fn matches(&self, filter: Option<&str>) -> bool {
        match filter {
            None | Some("full") => self.group <= Group::Full,
            Some("quick") => self.group == Group::Quick,
            Some("large") => self.group == Group::Large,
            Some(part) => self.name.contains(part),
        }
    }

    /// The family of the case: all cases of one mesh, or of one primitive (`sort/21-bits`; for a scan `scan`, because
    /// the second part of its name is a length).
    pub fn family(&self) -> &str {
        let mut parts = self.name.match_indices('/').map(|(at, _)| at);
        let (first, second) = (parts.next().unwrap_or(self.name.len()), parts.next().unwrap_or(self.name.len()));
        match self.work {
            _ if self.is_over_a_mesh() => &self.name[first + 1..second],
            Work::Scan(_) => &self.name[..first],
            _ => &self.name[..second],
        }
    }

    /// Whether the case concerns a mesh rather than a primitive of the device.
    pub fn is_over_a_mesh(&self) -> bool {
        !matches!(self.work, Work::SelfTest | Work::Scan(_) | Work::Sort(_))
    }
}

/// All cases, in the order in which they depend on each other: primitives, meshes, trees, queries.
pub fn cases() -> Vec<Case> {
    let mut cases = vec![Case { name: "device/self-test".into(), group: Group::Quick, work: Work::SelfTest }];
    primitive_cases::add(&mut cases);
    build_cases::add(&mut cases);
    query_cases::add(&mut cases);
    cases
}

/// The cases for a mesh of the caller: its topology, trees of every assignment, every query. The mesh stays in memory
/// until the program ends.
pub fn cases_of(name: &str, mesh: Mesh) -> Vec<Case> {
    let mesh = MeshRecipe::given(name, mesh);
    let mut cases = vec![Case { name: format!("mesh/{name}"), group: Group::Quick, work: Work::Topology(mesh) }];
    build_cases::add_given(&mut cases, mesh);
    query_cases::add_given(&mut cases, mesh);
    cases
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    #[test]
    fn names_are_unique_and_well_formed() {
        let cases = cases();
        let names: HashSet<_> = cases.iter().map(|c| c.name.as_str()).collect();
        assert_eq!(names.len(), cases.len());
        for case in &cases {
            assert!(case.name.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || "/-.".contains(c)), "{}", case.name);
        }
    }

    #[test]
    fn filters_choose() {
        let cases = cases();
        let count = |f: Option<&str>| cases.iter().filter(|c| c.matches(f)).count();
        assert!(count(Some("quick")) > 100 && count(Some("quick")) < count(None));
        assert!(count(Some("large")) > 0);
        assert_eq!(count(Some("large")) + count(None), cases.len());
        assert_eq!(count(Some("no such case")), 0);
        let case = cases.iter().find(|c| c.name.starts_with("sort/21-bits/")).unwrap();
        assert_eq!(case.family(), "sort/21-bits");
        let case = cases.iter().find(|c| c.name.starts_with("build/slivers/")).unwrap();
        assert_eq!(case.family(), "slivers");
    }
}
