//! Overlap of two meshes: which tetrahedra meet the other mesh, and the pairs that meet.

use super::scene::OlbvhScene;
use super::{OlbvhBuffer, OlbvhRecording, OlbvhRounds, recorded};
use crate::capi::{OlbvhStatus, border, handle, put};
use crate::query::{OverlapMemory, PairMemory, cmd_count_pairs, cmd_list_pairs, cmd_overlap};

/// Memory of the overlap of two meshes, and where in it the answers are.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct OlbvhOverlapParts {
    /// Bytes of the memory.
    pub bytes: u64,
    /// For A and for B a bit per tetrahedron, the lowest of a word first: it intersects the other mesh.
    pub hits: [OlbvhBuffer; 2],
    /// For A and for B; the fifth word of either counts the tetrahedra that need another round, whose bits are 0.
    pub status: [OlbvhBuffer; 2],
}

/// Memory of the pairs of two meshes, and where in it the answers are.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct OlbvhPairParts {
    /// Bytes of the memory.
    pub bytes: u64,
    /// Words 4 and 5: tetrahedra of A that need another round to be counted, and to have their pairs written. Words 8 and 9: pairs, the lower first.
    pub status: OlbvhBuffer,
}

/// Tells what memory the overlap of two meshes takes, and where in `memory` (of no bytes, as long as there is none) the answers are.
#[unsafe(no_mangle)]
pub extern "C" fn olbvh_overlap_parts(
    a: *const OlbvhScene,
    b: *const OlbvhScene,
    memory: OlbvhBuffer,
    out: *mut OlbvhOverlapParts,
) -> OlbvhStatus {
    border(|| {
        let (a, b) = (&handle(a, "a")?.scene, &handle(b, "b")?.scene);
        let (bytes, OverlapMemory { hits, status, .. }) = memory.carve(|arena| OverlapMemory::carve(arena, a, b))?;
        put(out, OlbvhOverlapParts { bytes, hits: hits.map(OlbvhBuffer::from), status: status.map(OlbvhBuffer::from) })
    })
}

/// Records which tetrahedra of A intersect B and which of B intersect A; the points of both lie in one space. Three rounds are enough for most.
#[unsafe(no_mangle)]
pub extern "C" fn olbvh_cmd_overlap(
    recording: *mut OlbvhRecording,
    a: *const OlbvhScene,
    b: *const OlbvhScene,
    memory: OlbvhBuffer,
    rounds: OlbvhRounds,
) -> OlbvhStatus {
    recorded(recording, |r| {
        let (a, b) = (&handle(a, "a")?.scene, &handle(b, "b")?.scene);
        let memory = memory.place(|arena| OverlapMemory::carve(arena, a, b))?;
        cmd_overlap(r, a, b, &memory, rounds.into())
    })
}

/// Tells what memory the pairs of A with another mesh take, and where in `memory` (of no bytes, as long as there is none) the status is.
#[unsafe(no_mangle)]
pub extern "C" fn olbvh_pair_parts(a: *const OlbvhScene, memory: OlbvhBuffer, out: *mut OlbvhPairParts) -> OlbvhStatus {
    border(|| {
        let a = handle(a, "a")?;
        let (bytes, PairMemory { status, .. }) = memory.carve(|arena| PairMemory::carve(&a.gpu, arena, a.scene.mesh.input.tets))?;
        put(out, OlbvhPairParts { bytes, status: status.into() })
    })
}

/// Records how many pairs of a tetrahedron of A and one of B touch; the tree over B has all lists (`lists` 0). But for `assign` 0, a pair counts once per
/// leaf that lists both.
#[unsafe(no_mangle)]
pub extern "C" fn olbvh_cmd_count_pairs(
    recording: *mut OlbvhRecording,
    a: *const OlbvhScene,
    b: *const OlbvhScene,
    memory: OlbvhBuffer,
    rounds: OlbvhRounds,
) -> OlbvhStatus {
    recorded(recording, |r| {
        let (OlbvhScene { gpu, scene: a, .. }, b) = (handle(a, "a")?, &handle(b, "b")?.scene);
        let memory = memory.place(|arena| PairMemory::carve(gpu, arena, a.mesh.input.tets))?;
        cmd_count_pairs(r, a, b, &memory, rounds.into())
    })
}

/// Records the pairs themselves, once they are counted: two words each in `found`, the tetrahedron of A and that of B, ascending by A. As many are written
/// as that holds. Begins with a barrier; if it goes on where an earlier recording ended, with a transfer write of the status.
#[unsafe(no_mangle)]
pub extern "C" fn olbvh_cmd_list_pairs(
    recording: *mut OlbvhRecording,
    a: *const OlbvhScene,
    b: *const OlbvhScene,
    memory: OlbvhBuffer,
    found: OlbvhBuffer,
    rounds: OlbvhRounds,
) -> OlbvhStatus {
    recorded(recording, |r| {
        let (OlbvhScene { gpu, scene: a, .. }, b) = (handle(a, "a")?, &handle(b, "b")?.scene);
        let memory = memory.place(|arena| PairMemory::carve(gpu, arena, a.mesh.input.tets))?;
        cmd_list_pairs(r, a, b, &memory, found.part(), rounds.into())
    })
}
