//! Quantization and Morton codes (SPEC 2.1, the paper's Eq. 1–6). Twin of `glsl/shared/grid.glsl`.
//!
//! Every operation here is an integer operation or a correctly rounded subtraction, multiplication or floor, in the
//! same order as in the kernels, so results are equal bit for bit on every device.

use crate::layout::constants::check_cells::LIMIT;

pub use crate::layout::Grid;
pub use crate::layout::constants::grid::{MAX_LEVEL, STRETCH_CELLS, STRETCHES};

/// 2^n for |n| ≤ 126.
pub(crate) const fn two_to(n: i32) -> f32 {
    f32::from_bits(((n + 127) as u32) << 23)
}

/// What `of` gives for each axis. It becomes straight code, unlike `[0, 1, 2].map`, which rustc 1.95 leaves a call.
#[inline]
pub(crate) fn per_axis<T>(mut of: impl FnMut(usize) -> T) -> [T; 3] {
    [of(0), of(1), of(2)]
}

/// Coordinates of this magnitude and beyond count as infinite, so that differences and scales stay in the range of
/// normal numbers.
pub const COORDINATE_LIMIT: f32 = f32::from_bits(LIMIT);
/// An axis whose extent is shorter than this (2^-103) is flat.
pub const MIN_EXTENT: f32 = two_to(-103);
/// Normalised coordinates are multiples of 2^-42 and below 2^41, so that products of three differences neither overflow
/// nor become denormal (which devices may flush to zero).
const GRID_UP: f32 = two_to(82);
const GRID_DOWN: f32 = two_to(-42);

/// `x`, with 0 in place of denormals and −0.
pub fn canonical(x: f32) -> f32 {
    if x.to_bits() & 0x7f80_0000 == 0 { 0.0 } else { x }
}

impl Grid {
    /// The grid over the closed box `[lo, hi]`, at the finest level. An empty box (`lo > hi`) gives a flat grid at 0.
    pub fn new(lo: [f32; 3], hi: [f32; 3]) -> Self {
        let empty = (0..3).any(|c| lo[c] > hi[c]);
        let (lo, hi) = if empty { ([0.0; 3], [0.0; 3]) } else { (lo.map(canonical), hi.map(canonical)) };
        let extent = per_axis(|c| canonical(hi[c] - lo[c]));
        let largest = extent.into_iter().fold(MIN_EXTENT, f32::max);
        let exponent = (largest.to_bits() >> 23) as i32 - 127;
        let scale = two_to(-exponent);
        let inv = extent.map(|e| if e < MIN_EXTENT { 0.0 } else { 1024.0 / e });
        let mut grid =
            Self { lo: pad(lo), hi: pad(hi), inv: pad(inv), extent: [0.0; 4], scale, level: MAX_LEVEL, ids: u32::MAX, ..Self::default() };
        grid.extent = pad(grid.normalise(hi));
        grid
    }

    /// The cell of the finest grid that contains `x`; points outside the grid are clamped to it.
    pub fn quantize(&self, x: [f32; 3]) -> [u32; 3] {
        per_axis(|c| {
            let q = self.in_cells(c, canonical(canonical(x[c]) - self.lo[c])).floor();
            q.clamp(0.0, 1023.0) as u32
        })
    }

    /// The distance `d` from the lower corner along axis `c`, in cells of the finest grid. It is monotone, and in a
    /// graded grid in [0, 1024].
    pub fn in_cells(&self, c: usize, d: f32) -> f32 {
        if self.graded == 0 {
            return d * self.inv[c];
        }
        let in_stretch = |(from, rate): (&[f32; 4], &[f32; 4])| ((d - from[c]) * rate[c]).clamp(0.0, STRETCH_CELLS as f32);
        self.knots.iter().zip(&self.rates).map(in_stretch).fold(0.0, |sum, cells| sum + cells)
    }

    /// Where the lower side of cell `k` of the finest grid is along axis `c`, if the grid is graded: its distance from the
    /// lower corner.
    pub fn graded_side(&self, c: usize, k: u32) -> f32 {
        let [from, to] = [0, 1].map(|j| self.knots[(k / STRETCH_CELLS + j).min(STRETCHES) as usize][c]);
        from + ((to - from) * two_to(-6)) * (k % STRETCH_CELLS) as f32
    }

    /// `x` in normalised coordinates, in which the lower corner of the bounds is at 0 and the largest extent is in
    /// [2^40, 2^41).
    pub fn normalise(&self, x: [f32; 3]) -> [f32; 3] {
        per_axis(|c| {
            let unit = canonical(canonical(canonical(x[c]) - self.lo[c]) * self.scale);
            (unit * GRID_UP).floor() * GRID_DOWN
        })
    }
}

fn pad(v: [f32; 3]) -> [f32; 4] {
    [v[0], v[1], v[2], 0.0]
}

/// A box as `[lo, hi]`, with x, y and z of each corner.
pub type Box6 = [f32; 6];

/// A box of cells of one level, including both corners.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CellRange {
    /// Lowest cell.
    pub lo: [u32; 3],
    /// Highest cell.
    pub hi: [u32; 3],
}

impl CellRange {
    /// All cells of the finest grid.
    pub const WHOLE: Self = Self { lo: [0; 3], hi: [(1 << MAX_LEVEL) - 1; 3] };

    /// The first and the last cell, one word each, as kernels take cells of the finest grid.
    pub fn words(&self) -> [u32; 2] {
        [self.lo, self.hi].map(|[x, y, z]| x | y << MAX_LEVEL | z << (2 * MAX_LEVEL))
    }

    /// Converts a box of cells of `level` into cells of the finest grid.
    #[must_use]
    pub fn finest(&self, level: u32) -> Self {
        let shift = MAX_LEVEL.saturating_sub(level);
        Self { lo: self.lo.map(|k| k << shift), hi: self.hi.map(|k| ((k + 1) << shift) - 1) }
    }

    /// The intersection of two boxes; `None` if it is empty.
    pub fn common(&self, other: &Self) -> Option<Self> {
        let range = Self { lo: per_axis(|c| self.lo[c].max(other.lo[c])), hi: per_axis(|c| self.hi[c].min(other.hi[c])) };
        (0..3).all(|c| range.lo[c] <= range.hi[c]).then_some(range)
    }

    /// Number of cells per axis.
    pub fn size(&self) -> [u32; 3] {
        per_axis(|c| self.hi[c] - self.lo[c] + 1)
    }

    /// Number of cells.
    pub fn count(&self) -> u32 {
        let [x, y, z] = self.size();
        x * y * z
    }

    /// Whether the range contains `cell`.
    pub fn contains(&self, cell: [u32; 3]) -> bool {
        (0..3).all(|c| self.lo[c] <= cell[c] && cell[c] <= self.hi[c])
    }

    /// Cell number `index` of [`CellRange::count`], with x varying fastest: index = (x−x0) + nx·((y−y0) + ny·(z−z0)).
    pub fn cell(&self, index: u32) -> [u32; 3] {
        let [nx, ny, _] = self.size();
        let (x, rest) = (index % nx, index / nx);
        [self.lo[0] + x, self.lo[1] + rest % ny, self.lo[2] + rest / ny]
    }

    /// All cells in that order.
    pub fn iter(&self) -> impl Iterator<Item = [u32; 3]> + use<> {
        let CellRange { lo, hi } = *self;
        (lo[2]..=hi[2]).flat_map(move |z| (lo[1]..=hi[1]).flat_map(move |y| (lo[0]..=hi[0]).map(move |x| [x, y, z])))
    }
}

/// Morton code of a cell: bits (x, y, z) from the most significant level down (Eq. 1).
pub fn morton(q: [u32; 3]) -> u32 {
    spread(q[0]) << 2 | spread(q[1]) << 1 | spread(q[2])
}

/// The cell of a Morton code.
pub fn unmorton(code: u32) -> [u32; 3] {
    [gather(code >> 2), gather(code >> 1), gather(code)]
}

/// Inserts two zero bits between neighbouring bits of the low ten bits of `v`.
fn spread(v: u32) -> u32 {
    let v = (v | v << 16) & 0x0300_00ff;
    let v = (v | v << 8) & 0x0300_f00f;
    let v = (v | v << 4) & 0x030c_30c3;
    (v | v << 2) & 0x0924_9249
}

/// Inverse of [`spread`].
fn gather(v: u32) -> u32 {
    let v = v & 0x0924_9249;
    let v = (v | v >> 2) & 0x030c_30c3;
    let v = (v | v >> 4) & 0x0300_f00f;
    let v = (v | v >> 8) & 0x0300_00ff;
    (v | v >> 16) & 0x0000_03ff
}

/// Deterministic reciprocal of a normal `x`. It takes an estimate from the bits of `x` and refines it by four Newton
/// steps of correctly rounded operations, because Vulkan's division is not correctly rounded. The relative error is
/// below 2^-22; 0 has none (the result is NaN).
pub fn reciprocal(x: f32) -> f32 {
    let mut r = f32::from_bits(0x7ef3_11c7u32.wrapping_sub(x.to_bits() & 0x7fff_ffff));
    let a = x.abs();
    for _ in 0..4 {
        r *= 2.0 - a * r;
    }
    if x < 0.0 { -r } else { r }
}
