//! The C interface to the overlap of two meshes: which tetrahedra intersect the other mesh, and which pairs intersect.

use super::scene::{OlbvhScene, begun_with};
use super::{OlbvhBuffer, OlbvhRecording, OlbvhRounds};
use crate::capi::{OlbvhStatus, border, handle, place};
use crate::query::{OverlapMemory, PairMemory, cmd_count_pairs, cmd_list_pairs, cmd_overlap};

/// Memory for the overlap of two meshes, and where in it the results are.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct OlbvhOverlapParts {
    /// Size of the memory in bytes.
    pub bytes: u64,
    /// For A and for B: one bit per tetrahedron, lowest bit of a word first, set if it intersects the other mesh.
    pub hits: [OlbvhBuffer; 2],
    /// For A and for B: an `olbvh_overlap_status`. The bits of unfinished tetrahedra are 0.
    pub status: [OlbvhBuffer; 2],
}

/// Memory for the pairs of two meshes, and where in it the results are.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct OlbvhPairParts {
    /// Size of the memory in bytes.
    pub bytes: u64,
    /// An `olbvh_overlap_status` for A.
    pub status: OlbvhBuffer,
}

/// Progress of the search for the tetrahedra of one mesh that intersect another, or for the pairs of A, which the device
/// writes to `status` of `olbvh_overlap_parts_data` or `olbvh_pair_parts_data`. Numbers of two words have the lower one
/// first.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
#[allow(dead_code, reason = "the device writes it, and C programs read it")]
pub struct OlbvhOverlapStatus {
    /// Number of tetrahedra that are searched for in the other tree, since no vertex decides. This number and the next
    /// three are 0 for pairs.
    pub waiting: u32,
    /// Number of tetrahedra with a vertex in the other mesh, or that contain one of its vertices.
    pub by_vertex: u32,
    /// Number of tetrahedra that touch a node inside of the other mesh.
    pub by_node: u32,
    /// Number of vertices that had to be located in the list of a leaf.
    pub located: u32,
    /// Number of tetrahedra that need another round of `olbvh_cmd_overlap` or `olbvh_cmd_count_pairs`.
    pub unfinished: u32,
    /// Number of tetrahedra that need another round of `olbvh_cmd_list_pairs`, which does nothing before `unfinished` is 0.
    pub unfilled: u32,
    /// Number of tests of two tetrahedra.
    pub narrow: [u32; 2],
    /// Number of pairs, whether or not there was room for them. From 2^32 on, none is written.
    pub pairs: [u32; 2],
    /// Not 0: nothing intersects, since a mesh has no valid tetrahedron, or a tree does not fit its capacity.
    pub empty: u32,
    /// Unused.
    pub pad: u32,
}

/// Reports how much memory the overlap of two meshes needs, and where in `memory` (size 0 if it does not exist yet) the
/// results are.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn olbvh_overlap_parts(
    a: *const OlbvhScene,
    b: *const OlbvhScene,
    memory: OlbvhBuffer,
    out: *mut OlbvhOverlapParts,
) -> OlbvhStatus {
    border(|| {
        // SAFETY: the caller keeps the rules of `capi`.
        let (a, b, out) = unsafe { (&handle(a, "a")?.scene, &handle(b, "b")?.scene, place(out)?) };
        let (bytes, OverlapMemory { hits, status, .. }) = memory.carve(|arena| OverlapMemory::carve(arena, a, b))?;
        out.write(OlbvhOverlapParts { bytes, hits: hits.map(OlbvhBuffer::from), status: status.map(OlbvhBuffer::from) });
        Ok(())
    })
}

/// Records the search for the tetrahedra of A that intersect B, and of B that intersect A. The points of both meshes
/// are in the same coordinate system. Three rounds are enough for most meshes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn olbvh_cmd_overlap(
    recording: *mut OlbvhRecording,
    a: *const OlbvhScene,
    b: *const OlbvhScene,
    memory: OlbvhBuffer,
    rounds: OlbvhRounds,
) -> OlbvhStatus {
    border(|| {
        // SAFETY: the caller keeps the rules of `capi`.
        let ((r, OlbvhScene { scene: a, .. }), b) = unsafe { (begun_with(recording, a, "a")?, handle(b, "b")?) };
        let b = b.on_device_of(r, "b")?;
        let memory = memory.place(|arena| OverlapMemory::carve(arena, a, b))?;
        cmd_overlap(r, a, b, &memory, rounds.into())
    })
}

/// Reports how much memory the pairs of A with another mesh need, and where in `memory` (size 0 if it does not exist
/// yet) the status is.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn olbvh_pair_parts(a: *const OlbvhScene, memory: OlbvhBuffer, out: *mut OlbvhPairParts) -> OlbvhStatus {
    border(|| {
        // SAFETY: the caller keeps the rules of `capi`.
        let (a, out) = unsafe { (handle(a, "a")?, place(out)?) };
        let (bytes, PairMemory { status, .. }) = memory.carve(|arena| PairMemory::carve(&a.gpu, arena, a.scene.mesh.input.tets))?;
        out.write(OlbvhPairParts { bytes, status: status.into() });
        Ok(())
    })
}

/// Records the counting of the pairs of a tetrahedron of A and one of B that touch. The tree over B must have full
/// lists (`lists` 0). Unless its `assign` is 0, a pair is counted once for every leaf that lists both.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn olbvh_cmd_count_pairs(
    recording: *mut OlbvhRecording,
    a: *const OlbvhScene,
    b: *const OlbvhScene,
    memory: OlbvhBuffer,
    rounds: OlbvhRounds,
) -> OlbvhStatus {
    border(|| {
        // SAFETY: the caller keeps the rules of `capi`.
        let ((r, OlbvhScene { gpu, scene: a, .. }), b) = unsafe { (begun_with(recording, a, "a")?, handle(b, "b")?) };
        let b = b.on_device_of(r, "b")?;
        let memory = memory.place(|arena| PairMemory::carve(gpu, arena, a.mesh.input.tets))?;
        cmd_count_pairs(r, a, b, &memory, rounds.into())
    })
}

/// Records the writing of the pairs, after they have been counted: two words each in `found`, the tetrahedron of A and
/// that of B, ascending by A. Only as many as fit `found` are written. Starts with a barrier; if it continues where an
/// earlier recording ended, it starts with a transfer write of the status.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn olbvh_cmd_list_pairs(
    recording: *mut OlbvhRecording,
    a: *const OlbvhScene,
    b: *const OlbvhScene,
    memory: OlbvhBuffer,
    found: OlbvhBuffer,
    rounds: OlbvhRounds,
) -> OlbvhStatus {
    border(|| {
        // SAFETY: the caller keeps the rules of `capi`.
        let ((r, OlbvhScene { gpu, scene: a, .. }), b) = unsafe { (begun_with(recording, a, "a")?, handle(b, "b")?) };
        let b = b.on_device_of(r, "b")?;
        let memory = memory.place(|arena| PairMemory::carve(gpu, arena, a.mesh.input.tets))?;
        cmd_list_pairs(r, a, b, &memory, found.part(), rounds.into())
    })
}
