//! Slices.

use super::scene::OlbvhScene;
use super::{OlbvhBuffer, OlbvhField, OlbvhRecording, OlbvhRounds, recorded};
use crate::capi::query::OlbvhVoxels;
use crate::capi::{OlbvhStatus, border, handle, put};
use crate::query::{SliceInput, SliceMemory, StructureView, cmd_slice};
use crate::slicing::{Extrapolate, Rows};

/// Which voxels are sliced, and where the answers go.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct OlbvhSlicing {
    /// The whole stack.
    pub voxels: OlbvhVoxels,
    /// Layer of the first row that is sliced now.
    pub layer: u32,
    /// Number of that row in its layer.
    pub first: u32,
    /// Rows; behind the last of a layer comes the first of the next. In whole layers, or parts of one that begin at multiples of 64 rows, voxels have the same
    /// owners as in the whole stack where cells overlap, too.
    pub rows: u32,
    /// As `olbvh_slice` takes it.
    pub linear: u32,
    /// The field, or one whose values are of no bytes: none.
    pub field: OlbvhField,
    /// Memory of `olbvh_slicing_parts`.
    pub memory: OlbvhBuffer,
    /// One is enough but where leaves hold thousands of tetrahedra.
    pub rounds: OlbvhRounds,
}

/// Memory of a slice, and where in it the answers are.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct OlbvhSlicingParts {
    /// Bytes of the memory: 29 per voxel, and 32 per run of 64 voxels below each other in a layer.
    pub bytes: u64,
    /// A word per voxel, row by row, as `olbvh_slice` gives it.
    pub answers: OlbvhBuffer,
    /// A float per voxel: the value, NaN where it is empty; not written without a field.
    pub values: OlbvhBuffer,
    /// Words: runs of voxels and voxels that need another round, and until there are none nothing else is to be used; why all are empty (1: the boxes are flat,
    /// 2: they are more than twice as large as the mesh), or 0; voxels with their centre in the mesh, those that it merely touches, those that it does not.
    pub status: OlbvhBuffer,
}

/// Tells what memory a slice takes, and where in its `memory` (of no bytes, as long as there is none) the answers are.
#[unsafe(no_mangle)]
pub extern "C" fn olbvh_slicing_parts(slicing: *const OlbvhSlicing, out: *mut OlbvhSlicingParts) -> OlbvhStatus {
    border(|| {
        let slicing = handle(slicing, "slicing")?;
        let (bytes, memory) =
            slicing.memory.carve(|a| SliceMemory::carve(a, [slicing.voxels.width, slicing.voxels.height], slicing.rows))?;
        let SliceMemory { answers, values, status, .. } = memory;
        put(out, OlbvhSlicingParts { bytes, answers: answers.into(), values: values.into(), status: status.into() })
    })
}

/// Records the slicing of rows of voxels. The status is written by transfers as well.
#[unsafe(no_mangle)]
pub extern "C" fn olbvh_cmd_slice(recording: *mut OlbvhRecording, scene: *const OlbvhScene, slicing: *const OlbvhSlicing) -> OlbvhStatus {
    recorded(recording, |r| {
        let (scene, slicing) = (&handle(scene, "scene")?.scene, handle(slicing, "slicing")?);
        let OlbvhSlicing { layer, first, rows, field, .. } = *slicing;
        let field = (field.values.size > 0).then(|| field.read(scene)).transpose()?;
        let extrapolate = if slicing.linear == 0 { Extrapolate::Nearest } else { Extrapolate::Linear };
        let input = SliceInput { voxels: &slicing.voxels.read(), rows: Rows { layer, first, count: rows }, field, extrapolate, part: None };
        let memory = slicing.memory.place(|a| SliceMemory::carve(a, [slicing.voxels.width, slicing.voxels.height], rows))?;
        cmd_slice(r, &StructureView::from(scene), &input, &memory, slicing.rounds.into())
    })
}
