//! A whole stack of layers, sliced by the recorded form: memory of our own, bands of rows, submissions until every voxel is done.

use super::{SliceInput, SliceMemory, cmd_slice};
use crate::build::DeviceMesh;
use crate::error::{Error, Result};
use crate::gpu::{Buffer, Gpu};
use crate::layout::SliceStatus;
use crate::mesh::On;
use crate::primitives::Arena;
use crate::query::{Rounds, Searched, Structure};
use crate::slicing::{Band, EMPTY, Extrapolate, INSIDE, TOUCHED, Tally, VoxelGrid, bands};

/// Voxels of one band, unless a single row has more.
const CHUNK: u64 = 1 << 20;
/// Added to the owner of a touched voxel; see `glsl/shared/voxels.glsl`.
const TOUCHED_BIT: u32 = 1 << 31;

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

/// What the bands of a stack have in common.
struct Job<'a> {
    gpu: &'a Gpu,
    searched: Searched,
    memory: SliceMemory,
    buffer: &'a Buffer,
}

impl Job<'_> {
    /// One band. Submissions are repeated until every voxel is done; usually one is enough.
    fn band(&self, input: &SliceInput<'_>, sliced: &mut Sliced) -> Result<Band> {
        let memory = &self.memory;
        let mut rounds = Rounds::begin(1);
        let status = loop {
            let ((), time) = self.gpu.run("olbvh.query.slice", |r| cmd_slice(r, &self.searched, input, memory, rounds))?;
            rounds = Rounds::resume(1);
            sliced.submissions += 1;
            sliced.locate_ms += time.milliseconds("query.slice_locate");
            sliced.touch_ms += time.milliseconds("query.slice_touch");
            sliced.values_ms += time.milliseconds("query.slice_values");
            let status = self.gpu.download::<SliceStatus>(self.buffer, memory.status)?.first().copied().unwrap_or_default();
            if status.locating + status.touching == 0 {
                break status;
            }
        };
        sliced.tally.inside += u64::from(status.inside);
        sliced.tally.touched += u64::from(status.touched);
        sliced.tally.empty += u64::from(status.empty);
        let words = 4 * u64::from(input.count());
        let answers: Vec<u32> = self.gpu.download(self.buffer, memory.answers.part(0, words))?;
        let values = match input.field {
            Some(_) => self.gpu.download(self.buffer, memory.values.part(0, words))?,
            None => vec![f32::NAN; answers.len()],
        };
        let kind = |a: u32| match a {
            u32::MAX => EMPTY,
            a if a & TOUCHED_BIT != 0 => TOUCHED,
            _ => INSIDE,
        };
        let owner = |a: u32| if a == u32::MAX { a } else { a & !TOUCHED_BIT };
        let kinds = answers.iter().map(|&a| kind(a)).collect();
        Ok(Band { rows: input.rows, values, kinds, owners: answers.into_iter().map(owner).collect() })
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
    voxels.plan(mesh.grid())?;
    if let Some((values, on)) = field {
        let expected = if on == On::Points { mesh.input().points } else { mesh.input().tets };
        if values.len() != expected as usize {
            return Err(Error::Invalid(format!("a field of {} values where the mesh has {expected}", values.len())));
        }
    }
    let uploaded = field.map(|(values, on)| Ok::<_, Error>((gpu.upload("olbvh.query.field", values)?, on))).transpose()?;
    let width = voxels.size[0];
    let most = bands(voxels, CHUNK).map(|rows| rows.count).max().unwrap_or(1);
    let carve = |a: &mut Arena| SliceMemory::carve(a, width, most);
    let buffer = gpu.buffer("olbvh.query.slice", Arena::measure(carve)?)?;
    let memory = carve(&mut Arena::new(buffer.all()))?;
    let field = uploaded.as_ref().map(|(buffer, on)| (buffer.all(), *on));
    let job = Job { gpu, searched: Searched::new(mesh, structure), memory, buffer: &buffer };
    let mut sliced = Sliced::default();
    let mut done = 0;
    for rows in bands(voxels, CHUNK) {
        let input = SliceInput { voxels, rows, field, extrapolate };
        let band = job.band(&input, &mut sliced)?;
        done += u64::from(input.count());
        sink(band)?;
        report(done, voxels.voxels());
    }
    let Sliced { locate_ms, touch_ms, values_ms, submissions, .. } = sliced;
    log::debug!("slice: locate {locate_ms:.1} ms, touch {touch_ms:.1} ms, values {values_ms:.1} ms, {submissions} submissions");
    Ok(sliced)
}
