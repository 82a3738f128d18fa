//! Slicing of a whole stack of layers by means of [`cmd_slice`]: allocates memory, divides the stack into bands of
//! rows, and submits until every voxel is done.

use super::{SliceInput, SliceMemory, cmd_slice_in};
use crate::build::Tree;
use crate::error::Result;
use crate::gpu::{Arena, Buffer, Gpu, Recorder};
use crate::grid::CellRange;
use crate::layout::constants::voxels::SLICE_TOUCHED;
use crate::layout::{Grid, RunState, SliceStatus};
use crate::mesh::On;
use crate::query::searched::Searched;
use crate::query::{Progress, until_done, upload_field};
use crate::slicing::{BAND_VOXELS, Band, EMPTY, Extrapolate, INSIDE, Rows, TOUCHED, Tally, VOXEL_RUN, VoxelGrid, bands};
use crate::times::StageTimes;

/// Bytes of device memory per voxel of a band, including transfers but not runs, and a fixed reserve.
const PER_VOXEL: u64 = 40;
const RESERVE: u64 = 1 << 14;

/// A stack that was sliced.
#[derive(Clone, Debug, Default)]
pub struct Sliced {
    /// Numbers of voxels by kind.
    pub tally: Tally,
    /// What it took.
    pub times: StageTimes,
}

/// What the bands of a stack over a mesh and its structure have in common, in memory owned by this crate.
pub(crate) struct Slicing<'a> {
    gpu: &'a Gpu,
    searched: Searched,
    voxels: &'a VoxelGrid,
    field: Option<(Buffer, On)>,
    extrapolate: Extrapolate,
    cells: Option<CellRange>,
    memory: SliceMemory,
    buffer: Buffer,
    /// Rows of the largest band.
    pub(crate) rows: u32,
    /// What was sliced so far.
    pub(crate) sliced: Sliced,
}

impl<'a> Slicing<'a> {
    /// Prepares slicing in bands of as many rows as the memory that is left allows, of a mesh in this grid. `cells` are
    /// those of [`cmd_slice_in`].
    ///
    /// # Errors
    /// As [`slice`].
    pub(crate) fn new(
        gpu: &'a Gpu,
        (searched, grid): (&Searched, &Grid),
        field: Option<(&[f32], On)>,
        (voxels, extrapolate): (&'a VoxelGrid, Extrapolate),
        cells: Option<CellRange>,
    ) -> Result<Self> {
        voxels.check_over(grid)?;
        let field = field.map(|field| upload_field(gpu, &searched.mesh.input, field)).transpose()?;
        let [width, height] = voxels.size;
        let per_run = size_of::<RunState>() as u64;
        let per_voxel = PER_VOXEL + per_run / u64::from(height.clamp(1, VOXEL_RUN));
        let most = BAND_VOXELS.min(gpu.memory_left().saturating_sub(RESERVE + per_run * u64::from(width)) / per_voxel);
        // The first band is the largest.
        let rows = bands(voxels, most).next().map_or(1, |rows| rows.count);
        let carve = |a: &mut Arena| SliceMemory::carve(a, voxels.size, rows);
        let (buffer, memory) = Arena::reserve(gpu, "olbvh.query.slice", carve)?;
        Ok(Self { gpu, searched: *searched, voxels, field, extrapolate, cells, memory, buffer, rows, sliced: Sliced::default() })
    }

    /// Slices one band of at most [`Self::rows`] rows. Submits until every voxel is done; usually one submission
    /// suffices.
    ///
    /// # Errors
    /// As [`super::cmd_slice`], or a failed Vulkan call.
    pub(crate) fn band(&mut self, rows: Rows) -> Result<Band> {
        let (gpu, memory, sliced) = (self.gpu, &self.memory, &mut self.sliced);
        let field = self.field.as_ref().map(|(buffer, on)| (buffer.all(), *on));
        let input = SliceInput { voxels: self.voxels, rows, field, extrapolate: self.extrapolate };
        let record = |r: &mut Recorder<'_>, rounds| cmd_slice_in(r, &self.searched, &input, self.cells, memory, rounds);
        let status = until_done(gpu, "olbvh.query.slice", 1, &mut sliced.times, record, || {
            let status: SliceStatus = gpu.download_one(&self.buffer, memory.status)?;
            Ok((status.locating + status.touching == 0).then_some(status))
        })?;
        sliced.tally.inside += u64::from(status.inside);
        sliced.tally.touched += u64::from(status.touched);
        sliced.tally.empty += u64::from(status.empty);
        let words = 4 * u64::from(input.count());
        let answers: Vec<u32> = gpu.download(&self.buffer, memory.answers.part(0, words))?;
        let values = match input.field {
            Some(_) => gpu.download(&self.buffer, memory.values.part(0, words))?,
            None => vec![f32::NAN; answers.len()],
        };
        let kind = |a: u32| match a {
            u32::MAX => EMPTY,
            a if a & SLICE_TOUCHED != 0 => TOUCHED,
            _ => INSIDE,
        };
        let owner = |a: u32| if a == u32::MAX { a } else { a & !SLICE_TOUCHED };
        let kinds = answers.iter().map(|&a| kind(a)).collect();
        Ok(Band { rows, values, kinds, owners: answers.into_iter().map(owner).collect() })
    }
}

/// Slices the mesh of a tree and hands the voxels to `sink` band by band, in order. `field` has values and says whether
/// they belong to points or tetrahedra. `report` receives the number of voxels done and their total.
///
/// # Errors
/// [`crate::Error::Invalid`] for a field of the wrong length, or for voxels that [`VoxelGrid::check_over`] refuses;
/// [`crate::Error::Memory`]; a failed Vulkan call; errors of `sink`.
pub fn slice(
    tree: &Tree,
    field: Option<(&[f32], On)>,
    voxels: &VoxelGrid,
    extrapolate: Extrapolate,
    report: Progress<'_>,
    sink: &mut dyn FnMut(Band) -> Result<()>,
) -> Result<Sliced> {
    slice_in(tree.gpu(), (&tree.into(), tree.grid()), field, (voxels, extrapolate), report, sink)
}

/// [`slice`], of any structure over a mesh in this grid.
pub(crate) fn slice_in(
    gpu: &Gpu,
    searched: (&Searched, &Grid),
    field: Option<(&[f32], On)>,
    (voxels, extrapolate): (&VoxelGrid, Extrapolate),
    report: Progress<'_>,
    sink: &mut dyn FnMut(Band) -> Result<()>,
) -> Result<Sliced> {
    let mut slicing = Slicing::new(gpu, searched, field, (voxels, extrapolate), None)?;
    let mut done = 0;
    for rows in bands(voxels, u64::from(slicing.rows) * u64::from(voxels.size[0])) {
        let band = slicing.band(rows)?;
        done += band.kinds.len() as u64;
        sink(band)?;
        report(done, voxels.voxels())?;
    }
    log::debug!("slice: {}", slicing.sliced.times);
    Ok(slicing.sliced)
}
