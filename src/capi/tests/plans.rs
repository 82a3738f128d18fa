//! Tests of plans and of recorded builds: their limits, and what they report.

use super::queries::{Stage, place, plan, read};
use super::*;
use crate::build::{Capacity, TreeMemory};
use crate::gpu::Arena;
use crate::layout::{BuildStatus, MeshStatus, NearState, OverlapStatus, RenderStatus, SliceStatus};
use crate::mesh::kuhn;
use crate::reference::build::build as build_tree;
use std::mem::offset_of;

fn open() -> *mut OlbvhGpu {
    made(|out| call!(olbvh_gpu_open(null(), out)))
}

fn arrays(stage: &Stage) -> OlbvhSceneArrays {
    made(|out| call!(olbvh_scene_arrays(stage.scene, null(), out)))
}

/// Builds a tree within a plan; returns the scene and both statuses.
fn built(gpu: *const OlbvhGpu, mesh: &Mesh, level: u32, build: OlbvhBuildOptions) -> (Stage, BuildStatus, MeshStatus) {
    let (stage, device) = (place(gpu, mesh, level, build), &call!(handle(gpu, "gpu")).unwrap().0);
    let recording: *mut OlbvhRecording = made(|out| call!(olbvh_recording_new(gpu, out)));
    let record = |r: &mut Recorder<'_>| {
        ok(call!(olbvh_recording_begin(recording, r.commands().as_raw(), 0, 0)));
        ok(call!(olbvh_cmd_build(recording, stage.scene)));
        ok(call!(olbvh_recording_end(recording)));
        Ok(())
    };
    device.submit("olbvh.test.build", record).unwrap();
    call!(olbvh_recording_free(recording));
    let OlbvhSceneArrays { status, mesh_status, .. } = arrays(&stage);
    let (status, mesh_status) = (read(device, status, 1)[0], read(device, mesh_status, 1)[0]);
    (stage, status, mesh_status)
}

/// The status of a tree within a plan.
fn status(gpu: *const OlbvhGpu, mesh: &Mesh, level: u32, build: OlbvhBuildOptions) -> BuildStatus {
    let (stage, status, _) = built(gpu, mesh, level, build);
    call!(olbvh_scene_free(stage.scene));
    status
}

/// A limit that is stated gives the tree that fits it, not one whose candidates, of which the entries are chosen, do.
#[test]
fn a_stated_limit_gives_the_deepest_tree_that_fits() {
    let (gpu, mesh) = (open(), kuhn_jittered([6; 3], 0.3, 2).unwrap());
    let (topology, tets) = (topology(&mesh).unwrap(), mesh.tets.len() as u32);
    for lists in [Lists::All, Lists::Boundary] {
        let build = OlbvhBuildOptions { lists: lists as u32, ..olbvh_default_build_options() };
        let usual = status(gpu, &mesh, 8, build);
        let capacity = if lists == Lists::All { 24 } else { 8 } * tets;
        let stated = OlbvhBuildOptions { capacity, ..build };
        assert_eq!(status(gpu, &mesh, 8, stated), usual, "the default capacity");

        let options = BuildOptions { lists, ..BuildOptions::default() };
        let tree = |level: u32| build_tree(&mesh, &topology, &BuildOptions { level: Some(level), ..options }).unwrap().p.len() as u32;
        let entries: Vec<u32> = (0..=usual.level).map(tree).collect();
        assert!(usual.level > 2 && entries.iter().all(|&n| n < usual.candidates));
        let deepest = |room: u32| (0..=usual.level).rev().find(|&level| entries[level as usize] <= room);
        for capacity in entries.iter().map(|&n| n.max(tets)) {
            let limited = OlbvhBuildOptions { capacity, ..build };
            assert_eq!(Some(status(gpu, &mesh, 8, limited).level), deepest(capacity), "{lists}: {capacity} entries");
            let budget = Arena::measure(|a| TreeMemory::carve(a, &Capacity::for_entries(capacity, 8), &options)).unwrap();
            let limited = OlbvhBuildOptions { budget, ..build };
            let room = Capacity::for_bytes(budget, 8, &options).unwrap().entries;
            assert_eq!(Some(status(gpu, &mesh, 8, limited).level), deepest(room), "{lists}: {budget} bytes");
        }
    }
    // More entries than are usual. A budget does not take memory that such a mesh cannot fill.
    let mesh = kuhn([6; 3]).unwrap();
    let fine = OlbvhBuildOptions { level: 6, ..olbvh_default_build_options() };
    let level = |capacity: u32| status(gpu, &mesh, 0, OlbvhBuildOptions { capacity, ..fine }).level;
    assert_eq!([level(1 << 20), level(3 << 20)], [5, 6]);
    let bytes = |slabs: u32| made(|out| call!(olbvh_plan_measure(gpu, &plan(&mesh, 0, OlbvhBuildOptions { slabs, ..fine }), out))).memory;
    assert!(bytes(1) > bytes(0), "slabs take memory");
    let memory =
        |budget: u64| made(|out| call!(olbvh_plan_measure(gpu, &plan(&mesh, 0, OlbvhBuildOptions { budget, ..fine }), out))).memory;
    assert!(memory(1 << 30) == memory(1 << 40) && memory(1 << 40) < 1 << 24);
    // Fewer entries than the root may list.
    for limited in [OlbvhBuildOptions { capacity: tets - 1, ..fine }, OlbvhBuildOptions { budget: 3000, ..fine }] {
        let mut none = std::mem::MaybeUninit::uninit();
        assert_eq!(call!(olbvh_plan_measure(gpu, &plan(&mesh, 0, limited), none.as_mut_ptr())), OlbvhStatus::TooLarge);
        assert!(message().contains(&format!("plan for {tets} or more")), "{}", message());
    }
    call!(olbvh_gpu_free(gpu));
}

#[test]
fn levels_have_a_default_and_a_limit() {
    let (gpu, mesh) = (open(), kuhn([3; 3]).unwrap());
    let of = |level: u32| OlbvhBuildOptions { level, ..olbvh_default_build_options() };
    let sizes = |level: u32, build: u32| {
        let sizes: OlbvhPlanSizes = made(|out| call!(olbvh_plan_measure(gpu, &plan(&mesh, level, of(build)), out)));
        (sizes.memory, sizes.scratch)
    };
    assert_eq!((sizes(0, 0), sizes(0, 5), sizes(4, 9)), (sizes(7, 0), sizes(5, 0), sizes(4, 0)));
    assert_ne!(sizes(0, 0), sizes(1, 0));
    for (level, build) in [(11, 0), (0, 11), (7, 11)] {
        let mut none = std::mem::MaybeUninit::uninit();
        assert_eq!(call!(olbvh_plan_measure(gpu, &plan(&mesh, level, of(build)), none.as_mut_ptr())), OlbvhStatus::Invalid);
        assert!(message().contains("level 11; the deepest is 10"), "{}", message());
    }
    call!(olbvh_gpu_free(gpu));
}

#[test]
fn recorded_builds_report_bad_cells() {
    let (gpu, mut mesh) = (open(), kuhn([4; 3]).unwrap());
    let count = mesh.points.len() as u32;
    let bad = [3, 70, 71];
    mesh.tets[3][0] = count;
    mesh.tets[70][1] = mesh.tets[70][2];
    let lost = mesh.points.len() - 1;
    mesh.points[lost][1] = f32::NAN;
    mesh.tets[71][3] = lost as u32;
    let at_lost = |tet: &[u32; 4]| tet.contains(&(lost as u32));
    let all: Vec<u32> = (0..).zip(&mesh.tets).filter(|(i, tet)| bad.contains(i) || at_lost(tet)).map(|(i, _)| i).collect();
    let (stage, status, mesh_status) = built(gpu, &mesh, 0, olbvh_default_build_options());
    assert_eq!((mesh_status.bad as usize, mesh_status.overflow, status.overflow), (all.len(), 0, 0));
    assert!(mesh_status.boundary > 0 && status.entries > 0);
    let words: Vec<u32> = read(&call!(handle(gpu, "gpu")).unwrap().0, arrays(&stage).bad, mesh.tets.len().div_ceil(32));
    assert!((0..mesh.tets.len() as u32).filter(|&i| crate::layout::bit(&words, i)).eq(all));
    call!(olbvh_scene_free(stage.scene));
    call!(olbvh_gpu_free(gpu));
}

/// The structs of the header are those that the device writes.
#[test]
fn statuses_have_the_layout_of_the_device() {
    macro_rules! same {
        ($header:ty, $device:ty: $($field:ident)*) => {
            assert_eq!((size_of::<$header>(), align_of::<$header>()), (size_of::<$device>(), align_of::<$device>()));
            $(assert_eq!(offset_of!($header, $field), offset_of!($device, $field), stringify!($field));)*
        };
    }
    same!(OlbvhMeshStatus, MeshStatus: lo hi bad boundary zero_volume negative crowded overflow branched parted);
    same!(OlbvhBuildStatus, BuildStatus: level wanted_level candidates entries nodes internal leaves boundary_leaves longest_leaf
        large_levels sum total levels overflow);
    same!(OlbvhNearState, NearState: code entry owner square);
    same!(OlbvhPictureStatus, RenderStatus: met samples found skipped unfinished);
    same!(OlbvhSliceStatus, SliceStatus: locating touching refused inside touched empty);
    same!(OlbvhOverlapStatus, OverlapStatus: waiting by_vertex by_node located unfinished unfilled narrow pairs empty pad);
}

#[test]
fn a_scene_is_recorded_on_its_device() {
    let (gpu, other, mesh) = (open(), open(), kuhn([2; 3]).unwrap());
    let (here, there) = (place(gpu, &mesh, 0, olbvh_default_build_options()), place(other, &mesh, 0, olbvh_default_build_options()));
    let recording: *mut OlbvhRecording = made(|out| call!(olbvh_recording_new(gpu, out)));
    ok(call!(olbvh_recording_begin(recording, 0, 0, 0)));
    ok(call!(olbvh_cmd_build(recording, here.scene)));
    assert_eq!(call!(olbvh_cmd_build(recording, there.scene)), OlbvhStatus::Invalid);
    assert!(message().contains("scene lies on another device"), "{}", message());
    let (nothing, once) = (OlbvhBuffer::default(), OlbvhRounds { count: 1, resume: 0 });
    assert_eq!(call!(olbvh_cmd_overlap(recording, here.scene, there.scene, nothing, once)), OlbvhStatus::Invalid);
    assert!(message().contains("b lies on another device"), "{}", message());
    call!(olbvh_recording_free(recording));
    for scene in [here.scene, there.scene] {
        call!(olbvh_scene_free(scene));
    }
    for gpu in [gpu, other] {
        call!(olbvh_gpu_free(gpu));
    }
}
