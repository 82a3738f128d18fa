//! Conservative slicing on the device (SPEC 3.4). A call slices some rows of voxels, so memory does not grow with the
//! number of layers.
//!
//! ```text
//! plan      prepares the voxels for the kernels, from bounds that only the device knows
//! locate    locates centres, in runs down the rows, and reads the field there        a round: locate, collect, touch
//! collect   lists the voxels whose boxes must be tested
//! touch     tests their boxes
//! values    settles their kinds, and the field there
//! ```

mod stack;
pub use stack::{Sliced, slice};
pub(crate) use stack::{Slicing, slice_in};

use super::searched::{Searched, dispatch};
use super::{Rounds, Scene};
use crate::build::check_field;
use crate::error::{Error, Result};
use crate::gpu::{Arena, BufferRef, Groups, Recorder};
use crate::grid::CellRange;
use crate::kernels::{
    LbvhSliceLocate, LbvhSliceLocateSpec, LbvhSliceTouch, LbvhSliceTouchSpec, SliceCollect, SliceCollectSpec, SliceLocate, SliceLocateSpec,
    SlicePlan, SlicePlanSpec, SliceTouch, SliceTouchSpec, SliceValues, SliceValuesSpec,
};
use crate::layout::{RunState, SliceStatus, SliceUniforms, TouchState};
use crate::mesh::On;
use crate::primitives::Count;
use crate::slicing::{Extrapolate, Rows, VoxelGrid};
use std::mem::offset_of;

/// Nodes and entries that one voxel may test in one dispatch.
const TOUCH_BUDGET: u32 = 1024;

/// What a call slices.
#[derive(Clone, Copy, Debug)]
pub struct SliceInput<'a> {
    /// The whole stack.
    pub voxels: &'a VoxelGrid,
    /// The rows of the stack that this call slices. Rows as [`crate::slicing::bands`] yields them get the same owners
    /// as in the whole stack, also where tetrahedra overlap.
    pub rows: Rows,
    /// A field, one 32-bit float per point of the mesh or per tetrahedron, and which of the two.
    pub field: Option<(BufferRef, On)>,
    /// The value that a touched voxel gets.
    pub extrapolate: Extrapolate,
}

impl SliceInput<'_> {
    /// Number of voxels.
    pub fn count(&self) -> u32 {
        self.rows.count.saturating_mul(self.voxels.size[0])
    }

    /// Number of runs, in all columns together.
    fn runs(&self) -> u32 {
        self.rows.runs(self.voxels.size[1]).saturating_mul(self.voxels.size[0])
    }
}

/// Answers and scratch memory for some rows of voxels: 28 bytes per voxel, and 32 per run.
#[derive(Clone, Copy, Debug)]
pub struct SliceMemory {
    /// Per voxel, row by row: the owner, plus 2^31 if the mesh merely touches the voxel; `u32::MAX` if the voxel is
    /// empty.
    pub answers: BufferRef,
    /// Per voxel: the value of the field, NaN if the voxel is empty. Not written without a field.
    pub values: BufferRef,
    /// [`SliceStatus`]: numbers of voxels by kind, and how much work is left.
    pub status: BufferRef,
    plan: BufferRef,
    runs: BufferRef,
    touches: BufferRef,
    groups: BufferRef,
}

impl SliceMemory {
    /// Carves the memory for up to `rows` rows of `width` voxels, in layers of `height` rows.
    ///
    /// # Errors
    /// [`Error::Invalid`] if the arena is too small, or for no voxels or more than 2^31.
    pub fn carve(arena: &mut Arena, [width, height]: [u32; 2], rows: u32) -> Result<Self> {
        if width.checked_mul(rows).is_none_or(|n| n == 0 || n > 1 << 31) {
            return Err(Error::Invalid(format!("{rows} rows of {width} voxels at a time; at least one, and at most 2^31 in all")));
        }
        let runs = u64::from(Rows { layer: 0, first: 0, count: rows }.runs(height));
        let (width, rows) = (u64::from(width), u64::from(rows));
        Ok(Self {
            answers: arena.words(width * rows)?,
            values: arena.words(width * rows)?,
            status: arena.take(size_of::<SliceStatus>() as u64)?,
            plan: arena.take(size_of::<SliceUniforms>() as u64)?,
            runs: arena.take(size_of::<RunState>() as u64 * width * runs)?,
            touches: arena.take(size_of::<TouchState>() as u64 * width * rows)?,
            groups: arena.words(3)?,
        })
    }
}

/// Records the slicing of some rows. This call only records: nothing is submitted, waited for, allocated or read back.
///
/// Each round tests a limited number of candidates per run and voxel. One round suffices unless lists have thousands of
/// entries. After the recorded rounds [`SliceStatus::locating`] and [`SliceStatus::touching`] say how much is left;
/// while there is any, answers must not be used, and values are incomplete. Recording again with [`Rounds::resume`]
/// (same input, same memory) continues the work.
///
/// Entry: mesh, tree and field are read by compute shaders. First use of `memory`: transfer and compute writes.
/// Last use: compute reads and writes. There is no barrier before or after, so the caller records one from compute
/// shader writes (and transfer writes of the status) to whatever reads the answers.
///
/// # Errors
/// [`Error::Invalid`] as [`VoxelGrid::check`], for rows that the stack lacks, for memory of too few voxels or runs, for
/// a field of too few values, or for no rounds. Only the device knows whether boxes are flat or too large for the mesh;
/// [`SliceStatus::refused`] reports that.
pub fn cmd_slice(r: &mut Recorder<'_>, scene: &Scene, input: &SliceInput<'_>, memory: &SliceMemory, rounds: Rounds) -> Result<()> {
    cmd_slice_in(r, &scene.into(), input, None, memory, rounds)
}

/// [`cmd_slice`]. If cells of the finest grid are given, whole leaves of an octree, the mesh is a block of another one, and
/// only these cells are searched. A voxel is then inside if its centre lies in them and has an owner, and it is touched by
/// what the leaves among them list.
fn cmd_slice_in(
    r: &mut Recorder<'_>,
    searched: &Searched,
    input: &SliceInput<'_>,
    cells: Option<CellRange>,
    memory: &SliceMemory,
    rounds: Rounds,
) -> Result<()> {
    rounds.check()?;
    input.voxels.check()?;
    let ([width, height], Rows { layer, first, count }) = (input.voxels.size, input.rows);
    let rows = u64::from(layer) * u64::from(height) + u64::from(first) + u64::from(count);
    if count == 0 || first >= height || rows > u64::from(height) * u64::from(input.voxels.layers) {
        return Err(Error::Invalid(format!("{count} rows from row {first} of layer {layer} on, which the stack does not have")));
    }
    let fits = (memory.answers.size / 4, memory.runs.size / size_of::<RunState>() as u64);
    if u64::from(width) * u64::from(count) > fits.0 || u64::from(input.runs()) > fits.1 {
        return Err(Error::Invalid(format!("{count} rows of {width} voxels in memory for {} voxels in {} runs", fits.0, fits.1)));
    }
    input.field.map_or(Ok(()), |field| check_field(field, &searched.mesh.input))?;
    if !rounds.resume {
        cmd_plan(r, searched, input, cells, memory)?;
    }
    for round in 0..rounds.count {
        let fresh = round == 0 && !rounds.resume;
        r.fill(memory.status, 0);
        r.barrier("slice.clear → slice.locate");
        cmd_locate_voxels(r, searched, memory, input, (fresh, cells.is_some()))?;
        r.barrier("slice.locate → slice.collect");
        // Voxels are listed only once all centres are located.
        cmd_touch_voxels(r, searched, memory, input)?;
        r.barrier("slice.touch → next");
    }
    if rounds.count == 0 { Ok(()) } else { cmd_values(r, searched, memory, input) }
}

fn cmd_plan(
    r: &mut Recorder<'_>,
    searched: &Searched,
    input: &SliceInput<'_>,
    cells: Option<CellRange>,
    memory: &SliceMemory,
) -> Result<()> {
    let VoxelGrid { origin, next_voxel, next_row, next_layer, half: [half0, half1, half2], size: [width, height], .. } = *input.voxels;
    let Rows { layer, first, count: rows } = input.rows;
    let (grid, plans, [first_cell, last_cell]) = (searched.mesh.arrays.grid, memory.plan, cells.unwrap_or(CellRange::WHOLE).words());
    let arguments = SlicePlan {
        grid,
        plans,
        origin,
        next_voxel,
        next_row,
        next_layer,
        half0,
        half1,
        half2,
        width,
        height,
        layer,
        first,
        rows,
        first_cell,
        last_cell,
    };
    let spec = SlicePlanSpec { workgroup: r.gpu().subgroup_size(), ..Default::default() };
    r.stage("query.slice_plan", |r| r.dispatch(&arguments, spec, Groups::Count(1)))
}

fn cmd_locate_voxels(
    r: &mut Recorder<'_>,
    searched: &Searched,
    memory: &SliceMemory,
    input: &SliceInput<'_>,
    (fresh, part): (bool, bool),
) -> Result<()> {
    let (cells, arrays) = (searched.mesh.input.cells, &searched.mesh.arrays);
    let groups = Groups::Count(input.runs().div_ceil(r.gpu().target().query));
    let (part, lists) = (u32::from(part), searched.lists());
    let (buffer, field, on_cells) = of_field(r, input);
    r.stage("query.slice_locate", |r| {
        dispatch!(r, groups, searched, SliceLocate SliceLocateSpec {} { lists }, LbvhSliceLocate LbvhSliceLocateSpec, {
            cells: cells,
            vertices: arrays.vertices,
            neighbours: arrays.neighbours,
            plans: memory.plan,
            states: memory.runs,
            answers: memory.answers,
            status: memory.status,
            field: buffer,
            values: memory.values,
            fresh: u32::from(fresh),
        }, { part, field, on_cells })
    })
}

/// The field's buffer, and two flags for the kernels: whether there is a field, and whether it has a value per
/// tetrahedron.
fn of_field(r: &Recorder<'_>, input: &SliceInput<'_>) -> (BufferRef, u32, u32) {
    let (buffer, on) = input.field.unwrap_or((r.gpu().nothing(), On::Points));
    (buffer, u32::from(input.field.is_some()), u32::from(on == On::Cells))
}

fn cmd_touch_voxels(r: &mut Recorder<'_>, searched: &Searched, memory: &SliceMemory, input: &SliceInput<'_>) -> Result<()> {
    let (cells, arrays) = (searched.mesh.input.cells, &searched.mesh.arrays);
    let (boundary, voxels) = (arrays.boundary, input.count());
    let workgroup = r.gpu().target().query;
    r.stage("query.slice_touch", |r| {
        let SliceMemory { answers, status, plan: plans, runs, touches: states, .. } = *memory;
        let ([width, height], rows) = (input.voxels.size, input.rows.count);
        let collect = SliceCollect { answers, status, plans, runs, states, width, height, rows };
        r.dispatch(&collect, SliceCollectSpec { workgroup, ..Default::default() }, Groups::Count(input.runs().div_ceil(workgroup)))?;
        r.barrier("slice.collect → slice.arguments");
        let listed = Count::device(voxels, plans.part(offset_of!(SliceUniforms, listed) as u64, 16));
        let groups = listed.groups(r, workgroup, memory.groups, "slice.arguments → slice.touch")?;
        dispatch!(r, groups, searched, SliceTouch SliceTouchSpec { boundary } {}, LbvhSliceTouch LbvhSliceTouchSpec, {
            cells: cells,
            vertices: arrays.vertices,
            plans: plans,
            states: states,
            answers: answers,
            status: status,
            budget: TOUCH_BUDGET,
        }, {})
    })
}

fn cmd_values(r: &mut Recorder<'_>, searched: &Searched, memory: &SliceMemory, input: &SliceInput<'_>) -> Result<()> {
    let SliceMemory { answers, values, status, plan: plans, touches: states, groups, .. } = *memory;
    let (buffer, field, on_cells) = of_field(r, input);
    let arguments = SliceValues {
        grid: searched.mesh.arrays.grid,
        cells: searched.mesh.input.cells,
        vertices: searched.mesh.arrays.vertices,
        field: buffer,
        plans,
        states,
        answers,
        values,
        status,
        voxels: input.count(),
    };
    let linear = u32::from(input.extrapolate == Extrapolate::Linear);
    let spec = SliceValuesSpec { workgroup: r.gpu().target().query, on_cells, linear, field, ..Default::default() };
    // Uses the same number of workgroups as the test of the boxes.
    r.stage("query.slice_values", |r| r.dispatch(&arguments, spec, Groups::Indirect(groups)))
}
