//! The order in which methods that sort ([`super::LocateMethod::is_sorted`]) locate points: along the Morton curve.

use super::PointInput;
use crate::error::Result;
use crate::gpu::{Arena, BufferRef, Gpu, Groups, Recorder};
use crate::kernels::{PointCodes, PointCodesSpec};
use crate::options::POINT_CODE_BITS;
use crate::primitives::{Count, SortScratch, Unsorted, cmd_sort};

/// An order of points, and the scratch memory of the sort: 16 bytes per point, and the sort's tables of counts.
#[derive(Clone, Copy, Debug)]
pub struct PointOrder {
    /// One word per place: the point that is located there.
    pub order: BufferRef,
    codes: BufferRef,
    sort: SortScratch,
}

impl PointOrder {
    /// Carves the memory for up to `count` points.
    ///
    /// # Errors
    /// [`crate::Error::Invalid`] if the arena is too small.
    pub fn carve(gpu: &Gpu, arena: &mut Arena, count: u32) -> Result<Self> {
        let n = u64::from(count);
        Ok(Self { order: arena.words(n)?, codes: arena.words(n)?, sort: SortScratch::carve(gpu, arena, count, code_bits(gpu))? })
    }
}

/// Fewest bits of the Morton code that points are sorted by, 16 points to a cell where 2^20 are sorted: one more pass of a
/// sort takes longer than finer cells save (H100).
const LEAST_CODE_BITS: u32 = 16;

/// How many bits of the Morton code points are sorted by: all those of as many passes of the device's sort as
/// [`LEAST_CODE_BITS`] take. 16 on most GPUs, 22 on processors.
pub(crate) fn code_bits(gpu: &Gpu) -> u32 {
    let digit = gpu.target().sort.digit_bits.max(1);
    LEAST_CODE_BITS.next_multiple_of(digit).min(POINT_CODE_BITS)
}

/// Records the sorting of points along the Morton curve over a mesh's `grid` ([`crate::build::MeshArrays::grid`]);
/// [`PointOrder::order`] is then what [`PointInput::order`] takes. Points with equal codes keep their order. Points
/// that are far outside the bounds or not finite come last. This call only records: nothing is submitted, waited for,
/// allocated or read back.
///
/// Entry: grid and points are read by compute shaders. First use of `memory`: compute writes. Last use: compute and
/// transfer writes; no barrier before or after.
///
/// # Errors
/// [`crate::Error::Vulkan`] if a pipeline cannot be made; [`crate::Error::Invalid`] if the points or the memory are
/// fewer than `count`; [`crate::Error::TooLarge`] as [`super::cmd_locate`].
pub fn cmd_sort_points(r: &mut Recorder<'_>, grid: BufferRef, input: &PointInput, memory: &PointOrder) -> Result<()> {
    let PointInput { points, stride, count, .. } = *input;
    let PointOrder { order, codes, ref sort } = *memory;
    input.check()?;
    order.check(4 * u64::from(count), "an order of points")?;
    let workgroup = r.gpu().target().query;
    let code_bits = code_bits(r.gpu());
    r.stage("query.sort_points", |r| {
        let spec = PointCodesSpec { workgroup, code_bits, ..Default::default() };
        let pairs = Unsorted::place(r.gpu(), (codes, order), code_bits, count, sort);
        let Unsorted { keys: codes, values: order, .. } = pairs;
        r.dispatch(&PointCodes { grid, points, codes, order, count, stride }, spec, Groups::Count(count.div_ceil(workgroup)))?;
        cmd_sort(r, &pairs, Count::host(count), sort)
    })
}
