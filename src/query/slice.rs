//! Conservative slicing on the device (SPEC 3.4): rows of voxels at a time, so that memory does not grow with the number of layers.

use super::{Searched, Structure, dispatch};
use crate::build::DeviceMesh;
use crate::error::{Error, Result};
use crate::gpu::{BufferRef, Groups, Recorder};
use crate::kernels::{
    LbvhSliceLocate, LbvhSliceLocateSpec, LbvhSliceTouch, LbvhSliceTouchSpec, SliceLocate, SliceLocateSpec, SliceTouch, SliceTouchSpec,
    SliceValues, SliceValuesSpec,
};
use crate::layout::{RunState, SliceStatus, TouchState};
use crate::mesh::On;
use crate::options::TOLERANCE;
use crate::primitives::Arena;
use crate::slicing::{Band, EMPTY, Extrapolate, INSIDE, RUN, Rows, TOUCHED, Tally, VoxelGrid, WALK, bands};

/// Voxels of one band, unless a single row has more.
const CHUNK: u64 = 1 << 20;
/// Candidates that a run of voxels may test in one dispatch.
const LOCATE_BUDGET: u32 = 4096;
/// Nodes and candidates that a voxel may test in one dispatch.
const TOUCH_BUDGET: u32 = 1024;
/// Added to the owner of a touched voxel; see `glsl/shared/voxels.glsl`.
const TOUCHED_BIT: u32 = 1 << 31;

/// Memory of one band on the device.
#[derive(Clone, Copy, Debug)]
pub struct SliceMemory {
    /// [`crate::layout::SlicePlan`].
    pub plan: BufferRef,
    /// Per voxel: the owner, plus 2^31 if touched only; all ones: empty.
    pub answers: BufferRef,
    /// Per voxel: the value; used with a field only.
    pub values: BufferRef,
    runs: BufferRef,
    touches: BufferRef,
    status: BufferRef,
}

impl SliceMemory {
    /// Takes the memory for bands of up to `rows` rows of `width` voxels from an arena. `plan` is the caller's.
    ///
    /// # Errors
    /// [`Error::Invalid`] if the arena is too small.
    pub fn carve(arena: &mut Arena, plan: BufferRef, width: u32, rows: u32) -> Result<Self> {
        let (width, rows) = (u64::from(width), u64::from(rows));
        Ok(Self {
            plan,
            answers: arena.words(width * rows)?,
            values: arena.words(width * rows)?,
            runs: arena.take(size_of::<RunState>() as u64 * rows * width.div_ceil(u64::from(RUN)))?,
            touches: arena.take(size_of::<TouchState>() as u64 * width * rows)?,
            status: arena.take(2 * size_of::<SliceStatus>() as u64)?,
        })
    }

    fn status_of(&self, kernel: u64) -> BufferRef {
        let size = size_of::<SliceStatus>() as u64;
        self.status.part(kernel * size, size)
    }
}

/// Which rows, and how wide they are.
#[derive(Clone, Copy, Debug)]
struct Part {
    rows: Rows,
    width: u32,
}

impl Part {
    fn voxels(self) -> u32 {
        self.rows.count * self.width
    }
}

fn cmd_locate_voxels(r: &mut Recorder<'_>, searched: &Searched, memory: &SliceMemory, part: Part, fresh: bool) -> Result<()> {
    let (input, arrays) = (&searched.mesh.input, &searched.mesh.arrays);
    let items = part.rows.count * part.width.div_ceil(RUN);
    let (run, walk, lists) = (RUN, WALK, searched.lists());
    r.stage("query.slice_locate", |r| {
        dispatch!(r, items, searched, SliceLocate SliceLocateSpec {} { lists }, LbvhSliceLocate LbvhSliceLocateSpec, {
            cells: input.cells,
            vertices: arrays.vertices,
            neighbours: arrays.neighbours,
            plans: memory.plan,
            states: memory.runs,
            answers: memory.answers,
            status: memory.status_of(0),
            layer: part.rows.layer,
            first: part.rows.first,
            rows: part.rows.count,
            fresh: u32::from(fresh),
            budget: LOCATE_BUDGET,
            tolerance: TOLERANCE,
        }, { run, walk })
    })
}

fn cmd_touch_voxels(r: &mut Recorder<'_>, searched: &Searched, memory: &SliceMemory, part: Part, fresh: bool) -> Result<()> {
    let (input, arrays) = (&searched.mesh.input, &searched.mesh.arrays);
    let boundary = arrays.boundary;
    r.stage("query.slice_touch", |r| {
        dispatch!(r, part.voxels(), searched, SliceTouch SliceTouchSpec { boundary } {}, LbvhSliceTouch LbvhSliceTouchSpec, {
            cells: input.cells,
            vertices: arrays.vertices,
            plans: memory.plan,
            states: memory.touches,
            answers: memory.answers,
            status: memory.status,
            layer: part.rows.layer,
            first: part.rows.first,
            voxels: part.voxels(),
            fresh: u32::from(fresh),
            budget: TOUCH_BUDGET,
        }, {})
    })
}

/// Slices one mesh with one field.
struct Job<'a> {
    searched: Searched,
    memory: SliceMemory,
    field: Option<(BufferRef, On)>,
    extrapolate: Extrapolate,
    buffer: &'a crate::gpu::Buffer,
    gpu: &'a crate::gpu::Gpu,
}

/// Device time of a stack.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sliced {
    /// Voxels by kind.
    pub tally: Tally,
    /// Milliseconds to locate the centres.
    pub locate_ms: f64,
    /// Milliseconds for the boxes of the others.
    pub touch_ms: f64,
    /// Milliseconds for the values.
    pub values_ms: f64,
    /// Submissions.
    pub submissions: u32,
}

impl Job<'_> {
    fn cmd_values(&self, r: &mut Recorder<'_>, part: Part) -> Result<()> {
        let Some((field, on)) = self.field else { return Ok(()) };
        let workgroup = r.gpu().target().each;
        let arguments = SliceValues {
            grid: self.searched.mesh.arrays.grid,
            cells: self.searched.mesh.input.cells,
            vertices: self.searched.mesh.arrays.vertices,
            field,
            plans: self.memory.plan,
            answers: self.memory.answers,
            values: self.memory.values,
            status: self.memory.status,
            layer: part.rows.layer,
            first: part.rows.first,
            voxels: part.voxels(),
        };
        let linear = u32::from(self.extrapolate == Extrapolate::Linear);
        let spec = SliceValuesSpec { workgroup, on_cells: u32::from(on == On::Cells), linear, ..Default::default() };
        r.stage("query.slice_values", |r| r.dispatch(&arguments, spec, Groups::Count(part.voxels().div_ceil(workgroup))))
    }

    /// One band. Submissions are repeated until every voxel is done: locate, then touch, then values; usually one is enough.
    fn band(&self, part: Part, sliced: &mut Sliced) -> Result<Band> {
        let memory = &self.memory;
        let [mut begun, mut located] = [false; 2];
        loop {
            let ((), time) = self.gpu.run("olbvh.query.slice", |r| {
                r.fill(if located { memory.status_of(1) } else { memory.status }, 0);
                r.barrier("slice.clear → slice");
                if !located {
                    cmd_locate_voxels(r, &self.searched, memory, part, !begun)?;
                    r.barrier("slice.locate → slice.touch");
                }
                // Does nothing as long as centres wait to be located.
                cmd_touch_voxels(r, &self.searched, memory, part, !located)?;
                r.barrier("slice.touch → slice.values");
                self.cmd_values(r, part)
            })?;
            begun = true;
            sliced.submissions += 1;
            sliced.locate_ms += time.milliseconds("query.slice_locate");
            sliced.touch_ms += time.milliseconds("query.slice_touch");
            sliced.values_ms += time.milliseconds("query.slice_values");
            let status = self.gpu.download::<SliceStatus>(self.buffer, memory.status)?;
            let unfinished = |i: usize| status.get(i).is_some_and(|s| s.unfinished > 0);
            located = !unfinished(0);
            if located && !unfinished(1) {
                break;
            }
        }
        let words = 4 * u64::from(part.voxels());
        let answers: Vec<u32> = self.gpu.download(self.buffer, memory.answers.part(0, words))?;
        let values = match self.field {
            Some(_) => self.gpu.download(self.buffer, memory.values.part(0, words))?,
            None => vec![f32::NAN; answers.len()],
        };
        let kind = |a: u32| match a {
            u32::MAX => EMPTY,
            a if a & TOUCHED_BIT != 0 => TOUCHED,
            _ => INSIDE,
        };
        let owner = |a: u32| if a == u32::MAX { a } else { a & !TOUCHED_BIT };
        let band = Band {
            rows: part.rows,
            values,
            kinds: answers.iter().map(|&a| kind(a)).collect(),
            owners: answers.into_iter().map(owner).collect(),
        };
        sliced.tally.add(&band.kinds);
        Ok(band)
    }
}

/// Slices a mesh: hands the voxels to `sink` band by band, in order. `field`: values and what they belong to; `report` is told how many voxels are
/// done.
///
/// # Errors
/// [`Error::Invalid`] for a field of the wrong length or voxels that [`VoxelGrid::plan`] refuses, [`Error::Memory`], a failed Vulkan call, or those of
/// `sink`.
pub fn slice(
    mesh: &DeviceMesh,
    structure: impl Into<Structure>,
    field: Option<(&[f32], On)>,
    voxels: &VoxelGrid,
    extrapolate: Extrapolate,
    report: &dyn Fn(u64, u64),
    sink: &mut dyn FnMut(Band) -> Result<()>,
) -> Result<Sliced> {
    let gpu = mesh.gpu();
    let plan = gpu.upload("olbvh.query.voxels", &[voxels.plan(mesh.grid())?])?;
    if let Some((values, on)) = field {
        let expected = if on == On::Points { mesh.input().points } else { mesh.input().tets };
        if values.len() != expected as usize {
            return Err(Error::Invalid(format!("a field of {} values where the mesh has {expected}", values.len())));
        }
    }
    let uploaded = field.map(|(values, on)| Ok::<_, Error>((gpu.upload("olbvh.query.field", values)?, on))).transpose()?;
    let width = voxels.size[0];
    let most = bands(voxels, CHUNK).map(|rows| rows.count).max().unwrap_or(1);
    let carve = |a: &mut Arena| SliceMemory::carve(a, plan.all(), width, most);
    let buffer = gpu.buffer("olbvh.query.slice", Arena::measure(carve)?)?;
    let memory = carve(&mut Arena::new(buffer.all()))?;
    let field = uploaded.as_ref().map(|(buffer, on)| (buffer.all(), *on));
    let job = Job { searched: Searched::new(mesh, structure), memory, field, extrapolate, buffer: &buffer, gpu };
    let mut sliced = Sliced::default();
    let mut done = 0;
    for rows in bands(voxels, CHUNK) {
        let part = Part { rows, width };
        let band = job.band(part, &mut sliced)?;
        done += u64::from(part.voxels());
        sink(band)?;
        report(done, voxels.voxels());
    }
    let Sliced { locate_ms, touch_ms, values_ms, submissions, .. } = sliced;
    log::debug!("slice: locate {locate_ms:.1} ms, touch {touch_ms:.1} ms, values {values_ms:.1} ms, {submissions} submissions");
    Ok(sliced)
}
