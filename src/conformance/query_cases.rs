//! The list of cases for queries.

use super::locate::{How, LocateCase};
use super::meshes::{MeshRecipe, recipes};
use super::overlap::{Other, OverlapCase};
use super::picture::PictureCase;
use super::primitive_cases::push;
use super::ranges::RangesCase;
use super::slice::{STACKS, SliceCase};
use super::{Case, Group, Work};
use crate::mesh::On;
use crate::options::{Assign, Lists};

/// Meshes that fill their space without overlap: every point of a tetrahedron has an owner, which does not depend on
/// the tree.
const CLOSED: [&str; 7] = ["kuhn-5x3x7", "kuhn-16x16x16", "jitter-12x13x11", "renumbered", "scaled-1e30", "far", GRADED];
/// A mesh whose grid is graded.
const GRADED: &str = "far-field-8";
/// Meshes so small that voxels have denormal centres, which devices may flush to 0.
const NEAR_DENORMAL: [&str; 2] = ["scaled-1e-38", "scaled-1e-42"];
/// Meshes without extent, in which there is nothing to slice.
const WITHOUT_EXTENT: [&str; 4] = ["no-points", "no-cells", "one-place", "only-bad-cells"];
/// A mesh whose overlap takes the reference implementation minutes.
const LARGE: &str = "jitter-24x24x24";
/// Cases for ranges of a field: mesh, α, assignment, lists, and what the values belong to.
const RANGED: [(&str, f32, Assign, Lists, On); 9] = [
    (GRADED, 0.0, Assign::Planes, Lists::Boundary, On::Points),
    ("no-cells", 0.0, Assign::Aabb, Lists::All, On::Points),
    ("one-tet", 0.0, Assign::Exact, Lists::All, On::Cells),
    ("bad-cells", 1.0, Assign::Aabb, Lists::Boundary, On::Cells),
    ("tangled", 1.0, Assign::Exact, Lists::All, On::Points),
    ("slivers", 3.0, Assign::Exact, Lists::All, On::Points),
    ("slivers", 0.0, Assign::Planes, Lists::Boundary, On::Cells),
    ("jitter-12x13x11", 3.0, Assign::Aabb, Lists::All, On::Cells),
    ("jitter-12x13x11", 0.0, Assign::Planes, Lists::Boundary, On::Points),
];
/// A transfer function that shows few values. [`PEAKED`] is drawn with it from all directions with the same kernels,
/// because kernels take long to compile.
const PEAK: &str = "0:0,0.3:0,0.33:0.8,0.36:0,0.7:0,0.7:0.1,0.72:0.1,0.72:0,1:0";
const PEAKED: &str = "jitter-12x13x11";
/// A camera in this mesh, with a wide angle.
const WITHIN: &str = "eye=6.3,6.1,5.2,target=1,2,11,fov=110";
/// A camera close to the hole of [`GRADED`].
const MIDDLE: &str = "eye=0.02,0.015,0.01,target=0,0,0,fov=40";
/// Clips across the view and, from the top, along it.
const CLIPS: &str = "view=60% x=70%";
/// Meshes that are drawn.
const DRAWN: [&str; 6] = ["one-tet", "kuhn-5x3x7", "jitter-12x13x11", "two-apart", "renumbered", GRADED];

pub(super) fn add(cases: &mut Vec<Case>) {
    for mesh in recipes() {
        for (alpha, assign) in [(0.0, Assign::Exact), (1.0, Assign::Planes), (3.0, Assign::Aabb)] {
            for lists in Lists::EVERY {
                add_location(cases, alpha == 0.0, LocateCase { mesh, alpha, assign, lists, how: How::Descent });
            }
        }
        let hows = [How::Traversal(8), How::Traversal(1), How::Traversal(3), How::Hints, How::All, How::Values];
        for how in hows.into_iter().chain([How::Runs, How::Sorted, How::SortedRuns, How::Nearest]) {
            for lists in Lists::EVERY {
                let quick = !matches!(how, How::Traversal(8 | 1) | How::Values);
                add_location(cases, quick, LocateCase { mesh, alpha: 0.5, assign: Assign::Aabb, lists, how });
            }
        }
        if CLOSED.contains(&mesh.name) {
            add_location(cases, true, LocateCase { mesh, alpha: 0.0, assign: Assign::Aabb, lists: Lists::All, how: How::Same });
        }
        if DRAWN.contains(&mesh.name) {
            add_pictures(cases, mesh);
        }
        add_slices(cases, mesh);
        if mesh.name != LARGE {
            add_overlaps(cases, mesh);
        }
        for (_, alpha, assign, lists, on) in RANGED.into_iter().filter(|of| of.0 == mesh.name) {
            add_ranges(cases, RangesCase { mesh, alpha, assign, lists, on });
        }
        if mesh.name == GRADED {
            // The camera sees the middle.
            for (camera, parts) in [("iso", true), (MIDDLE, false)] {
                let opacity = Some(PEAK);
                let case = PictureCase { mesh, camera, clips: "", on: On::Points, shading: true, opacity, iso: &[], parts };
                add_picture(cases, Group::Quick, case);
            }
        }
        // Iso-surfaces that are seen through one another, and opaque ones.
        let surfaces: &[f32] = &[0.2, -0.3, 0.9];
        for (camera, clips, opacity, iso, parts) in [
            ("iso", "", Some(PEAK), &[][..], false),
            ("top,ortho", "", Some(PEAK), &[], false),
            (WITHIN, "", Some(PEAK), &[], false),
            ("front", "", Some(PEAK), &[], true),
            ("iso", "", Some("0.4"), surfaces, true),
            ("top,ortho", "", None, surfaces, false),
            ("iso", CLIPS, Some(PEAK), &[], true),
            ("top,ortho", CLIPS, Some(PEAK), &[], false),
            ("iso", CLIPS, Some("0.4"), surfaces, true),
        ]
        .into_iter()
        .filter(|_| mesh.name == PEAKED)
        {
            add_picture(cases, Group::Quick, PictureCase { mesh, camera, clips, on: On::Points, shading: true, opacity, iso, parts });
        }
    }
}

/// Adds queries of a mesh of the caller.
pub(super) fn add_given(cases: &mut Vec<Case>, mesh: MeshRecipe) {
    for how in [How::Descent, How::Traversal(8), How::Runs, How::Sorted, How::SortedRuns, How::Hints, How::All, How::Nearest] {
        for lists in Lists::EVERY {
            add_location(cases, true, LocateCase { mesh, alpha: 0.0, assign: Assign::Aabb, lists, how });
        }
    }
    add_picture(
        cases,
        Group::Quick,
        PictureCase { mesh, camera: "iso", clips: "", on: On::Points, shading: true, opacity: None, iso: &[], parts: false },
    );
    add_ranges(cases, RangesCase { mesh, alpha: 0.0, assign: Assign::Aabb, lists: Lists::All, on: On::Points });
    add_slices(cases, mesh);
    for lists in Lists::EVERY {
        add_overlap(cases, Group::Quick, OverlapCase { mesh, alpha: 0.0, assign: Assign::Aabb, lists, other: Other::Itself });
    }
}

fn add_location(cases: &mut Vec<Case>, quick: bool, case: LocateCase) {
    let group = if quick { case.mesh.group } else { Group::Full };
    let name = format!("locate/{}/{}{}/alpha-{}/{}", case.mesh.name, case.assign, case.lists.suffix(), case.alpha, case.how.name());
    push(cases, name, group, Work::Locate(case));
}

fn add_ranges(cases: &mut Vec<Case>, case: RangesCase) {
    let RangesCase { mesh, alpha, assign, lists, on } = case;
    let name = format!("ranges/{}/{assign}{}/alpha-{alpha}/{}", mesh.name, lists.suffix(), values(on));
    push(cases, name, Group::Quick, Work::Ranges(case));
}

fn add_pictures(cases: &mut Vec<Case>, mesh: MeshRecipe) {
    for camera in ["iso", "top,ortho"] {
        for (on, shading) in [(On::Points, true), (On::Points, false), (On::Cells, false)] {
            let group = if camera == "iso" && shading { mesh.group } else { Group::Full };
            add_picture(cases, group, PictureCase { mesh, camera, clips: "", on, shading, opacity: None, iso: &[], parts: false });
        }
    }
}

fn add_picture(cases: &mut Vec<Case>, group: Group, case: PictureCase) {
    let PictureCase { mesh, camera, clips, on, shading, opacity, iso, parts } = case;
    let camera = if camera == WITHIN || camera == MIDDLE { "within" } else { camera.split(',').next().unwrap_or(camera) };
    let parts = if parts { "/parts" } else { "" };
    let clipped = if clips.is_empty() { "" } else { "/clipped" };
    let light = if shading { "/shaded" } else { "" };
    let transfer = if !iso.is_empty() {
        "/surfaces"
    } else if opacity.is_some() {
        "/peak"
    } else {
        ""
    };
    push(cases, format!("render/{}/{camera}/{}{light}{transfer}{clipped}{parts}", mesh.name, values(on)), group, Work::Picture(case));
}

fn values(on: On) -> &'static str {
    if on == On::Points { "points" } else { "cells" }
}

fn add_slices(cases: &mut Vec<Case>, mesh: MeshRecipe) {
    if NEAR_DENORMAL.contains(&mesh.name) || WITHOUT_EXTENT.contains(&mesh.name) {
        return;
    }
    for (i, stack) in STACKS.into_iter().enumerate() {
        for (k, (alpha, assign)) in [(0.0, Assign::Aabb), (1.0, Assign::Planes), (2.0, Assign::Exact)].into_iter().enumerate() {
            // Quick cases use both kinds of lists, others one of them each.
            let quick = (i + k) % 3 == 0;
            for lists in Lists::EVERY.into_iter().skip(if quick { 0 } else { k % 2 }).take(if quick { 2 } else { 1 }) {
                let group = if quick { mesh.group } else { Group::Full };
                let name = format!("slice/{}/{assign}{}/alpha-{alpha}/{}", mesh.name, lists.suffix(), stack.name);
                push(cases, name, group, Work::Slice(SliceCase { mesh, alpha, assign, lists, stack }));
            }
        }
    }
}

fn add_overlaps(cases: &mut Vec<Case>, mesh: MeshRecipe) {
    for (alpha, assign, lists, other) in [
        (0.0, Assign::Aabb, Lists::All, Other::Itself),
        (1.0, Assign::Exact, Lists::Boundary, Other::Grid),
        (0.0, Assign::Planes, Lists::Boundary, Other::Itself),
        (2.0, Assign::Planes, Lists::All, Other::Grid),
    ] {
        let group = if assign == Assign::Planes { Group::Full } else { mesh.group };
        add_overlap(cases, group, OverlapCase { mesh, alpha, assign, lists, other });
    }
}

fn add_overlap(cases: &mut Vec<Case>, group: Group, case: OverlapCase) {
    let OverlapCase { mesh, alpha, assign, lists, other } = case;
    let name = format!("overlap/{}/{assign}{}/alpha-{alpha}/{other}", mesh.name, lists.suffix());
    push(cases, name, group, Work::Overlap(case));
}
