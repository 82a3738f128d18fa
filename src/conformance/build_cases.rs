//! The list of cases for meshes and trees.

use super::build::{BuildCase, Way};
use super::meshes::{MeshRecipe, recipes};
use super::primitive_cases::push;
use super::{Case, Group, TargetKind, Work};
use crate::gpu::DeviceClass;
use crate::options::{Assign, Lists};

/// All values of α of the full group.
const ALPHAS: [f32; 9] = [0.0, 0.3, 0.5, 1.0, 1.5, 2.0, 4.0, 7.0, 10.0];
/// Meshes over which trees are built in every way and with every target.
const THOROUGH: [&str; 7] = ["one-tet", "bad-cells", "jitter-12x13x11", "slivers", "huge-among-small", "one-place", "no-cells"];

pub(super) fn add(cases: &mut Vec<Case>) {
    for mesh in recipes() {
        push(cases, format!("mesh/{}", mesh.name), mesh.group, Work::Topology(mesh));
    }
    for mesh in recipes() {
        add_builds(cases, mesh);
        if mesh.name == "jitter-12x13x11" {
            add_rows(cases, mesh);
        }
    }
}

fn add_builds(cases: &mut Vec<Case>, mesh: MeshRecipe) {
    let case = BuildCase {
        mesh,
        alpha: 0.0,
        assign: Assign::Aabb,
        lists: Lists::All,
        boxes: false,
        way: Way::Recorded,
        target: TargetKind::Device,
    };
    for (i, assign) in Assign::EVERY.into_iter().enumerate() {
        let case = BuildCase { assign, ..case };
        // Quick group: recorded with boxes at α = 0, and owned at a larger α.
        build(cases, mesh.group, BuildCase { boxes: true, ..case });
        build(cases, mesh.group, BuildCase { alpha: [0.5, 1.0, 2.0][i], way: Way::Owned, ..case });
        for (alpha, boxes) in ALPHAS.into_iter().zip([false, true].into_iter().cycle()) {
            build(cases, Group::Full, BuildCase { alpha, boxes, way: if boxes { Way::Owned } else { Way::Recorded }, ..case });
        }
        let thorough = THOROUGH.contains(&mesh.name);
        let case = BuildCase { lists: Lists::Boundary, ..case };
        build(cases, mesh.group, BuildCase { alpha: [1.0, 0.0, 0.5][i], way: Way::Owned, ..case });
        for (alpha, way) in [(0.0, Way::Owned), (2.0, Way::Owned), (0.0, Way::Tight), (0.0, Way::Clipped), (0.0, Way::Shallow)] {
            build(cases, if thorough { mesh.group } else { Group::Full }, BuildCase { alpha, way, boxes: true, ..case });
        }
        // Narrow: a build that marks cells at several levels.
        for way in [Way::Narrow, Way::Root, Way::Nothing] {
            build(cases, if thorough { mesh.group } else { Group::Full }, BuildCase { way, ..case });
        }
        let case = BuildCase { lists: Lists::All, ..case };
        let group = if thorough { mesh.group } else { Group::Full };
        for way in [Way::Tight, Way::Clipped, Way::Narrow, Way::Root, Way::Nothing, Way::Shallow] {
            build(cases, group, BuildCase { way, boxes: way == Way::Tight, ..case });
        }
        if thorough {
            for target in [TargetKind::Ballot, TargetKind::Narrow, TargetKind::Serial] {
                build(cases, mesh.group, BuildCase { target, boxes: true, ..case });
                build(cases, Group::Full, BuildCase { target, way: Way::Tight, ..case });
            }
        }
    }
}

/// Adds trees with every row of the table of targets.
fn add_rows(cases: &mut Vec<Case>, mesh: MeshRecipe) {
    for target in DeviceClass::EVERY.map(TargetKind::Row) {
        for (assign, lists) in [(Assign::Aabb, Lists::All), (Assign::Exact, Lists::Boundary)] {
            build(cases, mesh.group, BuildCase { mesh, alpha: 0.0, assign, lists, boxes: true, way: Way::Recorded, target });
        }
    }
}

/// Adds trees over a mesh of the caller.
pub(super) fn add_given(cases: &mut Vec<Case>, mesh: MeshRecipe) {
    for (assign, lists) in Assign::EVERY.into_iter().flat_map(|assign| Lists::EVERY.map(|lists| (assign, lists))) {
        let tight = BuildCase { mesh, alpha: 0.0, assign, lists, boxes: false, way: Way::Tight, target: TargetKind::Device };
        for alpha in [0.0, 1.0, 2.0] {
            build(cases, Group::Quick, BuildCase { alpha, boxes: alpha == 0.0, way: Way::Owned, ..tight });
        }
        build(cases, Group::Quick, tight);
    }
}

fn build(cases: &mut Vec<Case>, group: Group, case: BuildCase) {
    let boxes = if case.boxes { "/boxes" } else { "" };
    let lists = case.lists.suffix();
    let (mesh, assign, alpha, way) = (case.mesh.name, case.assign, case.alpha, case.way);
    push(cases, format!("build/{mesh}/{assign}{lists}/alpha-{alpha}{boxes}/{way}{}", case.target.suffix()), group, Work::Build(case));
}

impl Lists {
    /// Part of the names of cases for these lists.
    pub(super) fn suffix(self) -> &'static str {
        match self {
            Self::All => "",
            Self::Boundary => "/boundary",
        }
    }
}
