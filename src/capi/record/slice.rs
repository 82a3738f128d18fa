//! The C interface to slices.

use super::scene::{OlbvhScene, begun_with};
use super::{OlbvhBuffer, OlbvhField, OlbvhRecording, OlbvhRounds};
use crate::capi::query::OlbvhVoxels;
use crate::capi::{OlbvhStatus, border, handle, place};
use crate::query::{SliceInput, SliceMemory, cmd_slice};
use crate::slicing::{Extrapolate, Rows};

/// Which voxels are sliced, and where the results go.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct OlbvhSlicing {
    /// The whole stack.
    pub voxels: OlbvhVoxels,
    /// Layer of the first row that is sliced now.
    pub layer: u32,
    /// Number of this row in its layer.
    pub first: u32,
    /// Number of rows; the last row of a layer is followed by the first row of the next. If whole layers are sliced, or
    /// parts of one layer that start at multiples of 64 rows, voxels have the same owners as in the whole stack even
    /// where tetrahedra overlap.
    pub rows: u32,
    /// Which value touched voxels get, as for `olbvh_slice`.
    pub linear: u32,
    /// Optional (`values` of size 0: none): the field.
    pub field: OlbvhField,
    /// Memory of the size that `olbvh_slicing_parts` reports.
    pub memory: OlbvhBuffer,
    /// Rounds of the search; one is enough unless leaves hold thousands of tetrahedra.
    pub rounds: OlbvhRounds,
}

/// Memory for a slice, and where in it the results are.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct OlbvhSlicingParts {
    /// Size of the memory in bytes: 28 per voxel, and 32 per run of 64 voxels in the same column of a layer.
    pub bytes: u64,
    /// A word per voxel, row by row, as for `olbvh_slice`.
    pub answers: OlbvhBuffer,
    /// A float per voxel: the value, NaN if the voxel is empty; not written without a field.
    pub values: OlbvhBuffer,
    /// An `olbvh_slice_status`.
    pub status: OlbvhBuffer,
}

/// Progress and result of a slice, which the device writes to `olbvh_slicing_parts_data.status`. No result may be used,
/// and the numbers of voxels say nothing, until `locating` and `touching` are 0.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
#[allow(dead_code, reason = "the device writes it, and C programs read it")]
pub struct OlbvhSliceStatus {
    /// Number of runs of voxels that need another round for their centres.
    pub locating: u32,
    /// Number of voxels that need another round for their boxes.
    pub touching: u32,
    /// Why all voxels are empty: 1 if the boxes are flat, 2 if they are larger than two to four times the mesh. 0
    /// otherwise.
    pub refused: u32,
    /// Number of voxels whose centre lies in the mesh.
    pub inside: u32,
    /// Number of voxels that the mesh merely touches.
    pub touched: u32,
    /// Number of voxels that the mesh does not touch.
    pub empty: u32,
}

/// Reports how much memory a slice needs, and where in its `memory` (size 0 if it does not exist yet) the results are.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn olbvh_slicing_parts(slicing: *const OlbvhSlicing, out: *mut OlbvhSlicingParts) -> OlbvhStatus {
    border(|| {
        // SAFETY: the caller keeps the rules of `capi`.
        let (slicing, out) = unsafe { (handle(slicing, "slicing")?, place(out)?) };
        let (bytes, memory) =
            slicing.memory.carve(|a| SliceMemory::carve(a, [slicing.voxels.width, slicing.voxels.height], slicing.rows))?;
        let SliceMemory { answers, values, status, .. } = memory;
        out.write(OlbvhSlicingParts { bytes, answers: answers.into(), values: values.into(), status: status.into() });
        Ok(())
    })
}

/// Records the slicing of rows of voxels. Transfers write the status as well.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn olbvh_cmd_slice(
    recording: *mut OlbvhRecording,
    scene: *const OlbvhScene,
    slicing: *const OlbvhSlicing,
) -> OlbvhStatus {
    border(|| {
        // SAFETY: the caller keeps the rules of `capi`.
        let ((r, OlbvhScene { scene, .. }), slicing) = unsafe { (begun_with(recording, scene, "scene")?, handle(slicing, "slicing")?) };
        let OlbvhSlicing { layer, first, rows, field, .. } = *slicing;
        let field = (field.values.size > 0).then(|| field.read());
        let extrapolate = if slicing.linear == 0 { Extrapolate::Nearest } else { Extrapolate::Linear };
        let input = SliceInput { voxels: &slicing.voxels.read(), rows: Rows { layer, first, count: rows }, field, extrapolate };
        let memory = slicing.memory.place(|a| SliceMemory::carve(a, [slicing.voxels.width, slicing.voxels.height], rows))?;
        cmd_slice(r, scene, &input, &memory, slicing.rounds.into())
    })
}
