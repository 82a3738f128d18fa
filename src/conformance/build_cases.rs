//! The cases of meshes and trees.

use super::build::{BuildCase, Way};
use super::meshes::{MeshRecipe, recipes};
use super::primitive_cases::push;
use super::{Case, Group, TargetKind, Work};
use crate::options::{Assign, Lists};

/// α of the quick group, one per assignment so that all of them are seen, and the rest.
const ALPHAS: [f32; 9] = [0.0, 0.3, 0.5, 1.0, 1.5, 2.0, 4.0, 7.0, 10.0];
/// Meshes that are built in every way and under every target.
const THOROUGH: [&str; 7] = ["one-tet", "bad-cells", "jitter-12x13x11", "slivers", "huge-among-small", "one-place", "no-cells"];

pub(super) fn add(cases: &mut Vec<Case>) {
    for mesh in recipes() {
        push(cases, format!("mesh/{}", mesh.name), mesh.group, Work::Topology(mesh));
    }
    for mesh in recipes() {
        add_builds(cases, mesh);
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
    for (i, assign) in Assign::ALL.into_iter().enumerate() {
        let case = BuildCase { assign, ..case };
        // Quick: the record-only layer with boxes at α = 0, ours at a larger α.
        build(cases, mesh.group, BuildCase { boxes: true, ..case });
        build(cases, mesh.group, BuildCase { alpha: [0.5, 1.0, 2.0][i], way: Way::Owned, ..case });
        for alpha in ALPHAS {
            build(cases, Group::Full, BuildCase { alpha, ..case });
            build(cases, Group::Full, BuildCase { alpha, boxes: true, way: Way::Owned, ..case });
        }
        let thorough = THOROUGH.contains(&mesh.name);
        let group = if thorough { mesh.group } else { Group::Full };
        for way in [Way::Tight, Way::Clipped, Way::Root, Way::Nothing, Way::Shallow] {
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

/// Trees over a mesh of the caller's.
pub(super) fn add_given(cases: &mut Vec<Case>, mesh: MeshRecipe) {
    for assign in Assign::ALL {
        for alpha in [0.0, 1.0, 2.0] {
            let case = BuildCase { mesh, alpha, assign, boxes: alpha == 0.0, way: Way::Owned, target: TargetKind::Device };
            build(cases, Group::Quick, case);
        }
        build(cases, Group::Quick, BuildCase { mesh, alpha: 0.0, assign, boxes: false, way: Way::Tight, target: TargetKind::Device });
    }
}

fn build(cases: &mut Vec<Case>, group: Group, case: BuildCase) {
    let boxes = if case.boxes { "/boxes" } else { "" };
    let (mesh, assign, alpha, way) = (case.mesh.name, case.assign, case.alpha, case.way.name());
    push(cases, format!("build/{mesh}/{assign}/alpha-{alpha}{boxes}/{way}{}", case.target.suffix()), group, Work::Build(case));
}
