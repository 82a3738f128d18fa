//! Definition of a slice (SPEC 3.4): a stack of layers of voxels. Does not depend on Vulkan: the kernels and the
//! reference slice a [`VoxelGrid`] with the same operations in the same order.
//!
//! # Definition
//! - The centre of voxel (x, y) of layer k is `((origin + k·next_layer) + y·next_row) + x·next_voxel`.
//! - The box of a voxel is the closed set of its centre ± the three half axes of [`VoxelGrid::half`]; on an oblique
//!   plane it is rotated with the plane. The box is tested in normalised coordinates, in which its half axes are
//!   rounded to multiples of 2^-42.
//! - A voxel whose centre lies in the mesh (has an owner, SPEC 3.1) has the kind [`INSIDE`], and the value interpolated
//!   at its centre.
//! - Otherwise the boundary tetrahedra that touch the box are determined, by separating axes with the allowance that
//!   [`crate::reference::separate`] states. If there are any, the kind is [`TOUCHED`], and the tetrahedron nearest to
//!   the centre (by squared distances as computed; ties: lowest id) is the owner. The value is that of its point
//!   closest to the centre, or is continued linearly to the centre.
//! - All other voxels have the kind [`EMPTY`] and the value NaN.

pub mod settings;
pub use settings::{Plane, SliceSettings};

use crate::error::{Error, Result};
use crate::grid::{CellRange, canonical, two_to};
use crate::layout::{Grid, SliceUniforms};
use crate::named::named;
use glam::DVec3;
use std::ops::Range;

pub use crate::layout::constants::voxels::VOXEL_RUN;

/// Kind of a voxel that the mesh does not touch.
pub const EMPTY: u8 = 0;
/// Kind of a voxel whose box the mesh touches, but whose centre lies outside.
pub const TOUCHED: u8 = 1;
/// Kind of a voxel whose centre lies in the mesh.
pub const INSIDE: u8 = 2;

/// Most voxels that are sliced at a time, unless a single row has more.
pub const BAND_VOXELS: u64 = 1 << 20;
/// Most voxels along an axis; numbers up to this are exact in single precision.
pub const MOST_PER_AXIS: u32 = 1 << 24;
/// Most voxels of a stack, so that their numbers and bytes can be counted with 64 bits.
pub const MOST_VOXELS: u64 = 1 << 48;

/// The value that a touched voxel gets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Extrapolate {
    /// The value at the closest point of the closest tetrahedron.
    #[default]
    Nearest,
    /// The field of the closest tetrahedron, continued to the centre of the voxel. (For a flat tetrahedron: as
    /// `Nearest`.)
    Linear,
}

named!(Extrapolate, "extrapolation", [Nearest = "nearest", Linear = "linear"]);

/// The positions of the voxels of a stack of layers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VoxelGrid {
    /// Centre of voxel (0, 0) of layer 0.
    pub origin: [f32; 3],
    /// Vector from one voxel to the next in a row.
    pub next_voxel: [f32; 3],
    /// Vector from one row to the next.
    pub next_row: [f32; 3],
    /// Vector from one layer to the next.
    pub next_layer: [f32; 3],
    /// Half axes of a voxel's box.
    pub half: [[f32; 3]; 3],
    /// Voxels per row, and rows per layer.
    pub size: [u32; 2],
    /// Number of layers.
    pub layers: u32,
}

impl VoxelGrid {
    /// Centre of a voxel. Denormals, which devices may flush, count as 0.
    pub fn centre(&self, [x, y, k]: [u32; 3]) -> [f32; 3] {
        let steps_from = |at: f32, n: u32, each: f32| canonical(at + canonical(n as f32 * canonical(each)));
        [0, 1, 2].map(|c| {
            let row = steps_from(steps_from(canonical(self.origin[c]), k, self.next_layer[c]), y, self.next_row[c]);
            steps_from(row, x, self.next_voxel[c])
        })
    }

    /// Whether the boxes of these voxels may meet the closed box `[lo, hi]` in a mesh with this grid, that is, whether
    /// no face of either separates them.
    pub fn meets(&self, rows: Rows, [lo, hi]: [[f64; 3]; 2], grid: &Grid) -> bool {
        let wide = |v: [f32; 3]| DVec3::from_array(v.map(f64::from));
        let [x, y] = self.size.map(|n| f64::from(n) - 1.0);
        let ([first, layer], [last, top]) = (rows.row(0, self.size[1]), rows.row(rows.count.saturating_sub(1), self.size[1]));
        let [low, high] = if layer == top { [first, last].map(f64::from) } else { [0.0, y] };
        let (top_layer, layer) = (f64::from(top), f64::from(layer));
        let [origin, next_voxel, next_row, next_layer] = [self.origin, self.next_voxel, self.next_row, self.next_layer].map(wide);
        let sides = [next_voxel * x, next_row * (high - low), next_layer * (top_layer - layer)];
        let corner = origin + next_layer * layer + next_row * low;
        let (lo, hi) = (DVec3::from_array(lo), DVec3::from_array(hi));
        let largest = (0..3).map(|c| f64::from(grid.hi[c]) - f64::from(grid.lo[c])).fold(0.0, f64::max);
        // A centre is summed in single precision: no term passes through more than four roundings, each of which adds
        // 2^-24 of it at most. A term may be much larger than the sum. The fifth part exceeds products of errors.
        let terms = origin.abs() + next_layer.abs() * top_layer + next_row.abs() * high + next_voxel.abs() * x;
        let rounding = terms * (5.0 / f64::from(1 << 24));
        // The other allowance exceeds the rounding errors of boxes, and the distance that the tolerance adds to owners;
        // the last one, what half axes gain in `over`.
        let farthest = (0..3).map(|c| f64::from(grid.lo[c].abs().max(grid.hi[c].abs()))).fold(0.0, f64::max);
        let more = rounding + DVec3::splat(largest / 1024.0 + farthest / f64::from(1 << 18));
        let half = (hi - lo) * 0.5 + more + self.half.iter().map(|&axis| wide(axis).abs()).sum::<DVec3>();
        let from_middle = corner - (lo + hi) * 0.5;
        let normals = [[0, 1], [1, 2], [2, 0]].map(|[i, j]| self.half_normal(i, j));
        DVec3::AXES.into_iter().chain(normals).all(|d| {
            let (at, along) = (from_middle.dot(d), sides.map(|side| side.dot(d)));
            let begin = at + along.iter().map(|a| a.min(0.0)).sum::<f64>();
            let end = at + along.iter().map(|a| a.max(0.0)).sum::<f64>();
            let reach = half.dot(d.abs());
            begin <= reach && -reach <= end
        })
    }

    /// A unit vector perpendicular to two of the half axes.
    fn half_normal(&self, i: usize, j: usize) -> DVec3 {
        let wide = |v: [f32; 3]| DVec3::from_array(v.map(f64::from));
        wide(self.half[i]).cross(wide(self.half[j])).normalize_or_zero()
    }

    /// Number of voxels of a layer.
    pub fn layer_voxels(&self) -> u64 {
        u64::from(self.size[0]) * u64::from(self.size[1])
    }

    /// Number of voxels of all layers; `u64::MAX` if there are more than that, which [`VoxelGrid::check`] refuses.
    pub fn voxels(&self) -> u64 {
        self.layer_voxels().saturating_mul(self.layers.into())
    }

    /// Checks that this is a stack of voxels.
    ///
    /// # Errors
    /// [`Error::Invalid`] if there are no voxels, more than [`MOST_PER_AXIS`] along an axis, more than
    /// [`MOST_VOXELS`] in all, or if coordinates are not finite or 1e37 or more.
    pub fn check(&self) -> Result<()> {
        let [w, h] = self.size;
        if w == 0 || h == 0 || self.layers == 0 || w.max(h).max(self.layers) > MOST_PER_AXIS {
            return Err(Error::Invalid(format!("{w}×{h} voxels in {} layers; 1 to {MOST_PER_AXIS} along each axis", self.layers)));
        }
        if self.voxels() > MOST_VOXELS {
            let text = format!("{w}×{h} voxels in {} layers, more than 2^48 in all; take fewer layers or larger voxels", self.layers);
            return Err(Error::Invalid(text));
        }
        let last = self.centre([w - 1, h - 1, self.layers - 1]);
        let vectors = [self.origin, self.next_voxel, self.next_row, self.next_layer, last, self.half[0], self.half[1], self.half[2]];
        if vectors.iter().flatten().any(|x| !x.is_finite() || x.abs() >= 1e37) {
            return Err(Error::Invalid("voxels with coordinates that are not finite or beyond 1e37".into()));
        }
        Ok(())
    }

    /// What the kernels and the reference need to know of these voxels over a mesh with grid `grid`. Twin of
    /// `glsl/query/slice_plan`.
    pub(crate) fn over(&self, grid: &Grid) -> SliceUniforms {
        // 2·2^e, see `check_over`. Larger half axes are refused as they are, since scaling them could overflow.
        let most = f32::from_bits((255 << 23) - grid.scale.to_bits());
        let beyond = self.half.iter().flatten().any(|x| x.abs() > most);
        let normalise = |x: f32| {
            let unit = if x.abs() > most { 0.0 } else { canonical(x * grid.scale) };
            (unit * two_to(82)).round() * two_to(-42)
        };
        // A component of a centre passes through four roundings of values up to twice the largest coordinate of the mesh,
        // in a stack that is not much larger. The longest component of each half axis grows by 2^-20 of that coordinate,
        // more than half of which counts along an oblique axis, so that boxes side by side leave no gap.
        let far = (0..3).map(|c| canonical(grid.lo[c].abs().max(grid.hi[c].abs()))).fold(0.0, f32::max);
        let gap = (canonical(far * grid.scale) * two_to(62)).ceil() * two_to(-42);
        let grown = |axis: [f32; 3]| {
            let longest = (1..3).fold(0, |best, c| if axis[c].abs() > axis[best].abs() { c } else { best });
            let more = if axis[longest] < 0.0 { -gap } else { gap };
            [0, 1, 2].map(|c| if c == longest { axis[c] + more } else { axis[c] })
        };
        let normalised = self.half.map(|axis| axis.map(normalise));
        let sum = |axes: &[[f32; 3]; 3], c: usize| (axes[0][c].abs() + axes[1][c].abs()) + axes[2][c].abs();
        let flat = normalised.iter().any(|axis| axis.iter().all(|&x| x == 0.0));
        let large = beyond || (0..3).any(|c| sum(&normalised, c) > two_to(41));
        let largest = (0..3).map(|c| canonical(grid.hi[c] - grid.lo[c])).fold(0.0, f32::max);
        let reach = |c: usize| sum(&self.half, c) * (1.0 + two_to(-10)) + (largest * two_to(-14) + canonical(far * two_to(-18)));
        let pad = |v: [f32; 3]| [v[0], v[1], v[2], 0.0];
        SliceUniforms {
            origin: pad(self.origin),
            next_voxel: pad(self.next_voxel),
            next_row: pad(self.next_row),
            next_layer: pad(self.next_layer),
            half0: pad(grown(normalised[0])),
            half1: pad(grown(normalised[1])),
            half2: pad(grown(normalised[2])),
            reach: pad([0, 1, 2].map(reach)),
            width: self.size[0],
            height: self.size[1],
            refused: if large { 2 } else { u32::from(flat) },
            last_cell: CellRange::WHOLE.words()[1],
            ..SliceUniforms::default()
        }
    }

    /// Checks that the voxels can be sliced over a mesh with this grid.
    ///
    /// # Errors
    /// [`Error::Invalid`] as [`VoxelGrid::check`], and if their boxes are flat or too large: along each axis a box
    /// measures at most 4·2^e, where the largest extent of the mesh lies in [2^e, 2^(e+1)).
    pub fn check_over(&self, grid: &Grid) -> Result<()> {
        self.check()?;
        match self.over(grid).refused {
            0 => Ok(()),
            1 => Err(Error::Invalid("voxels without volume; size and thickness must be above 0".into())),
            _ => Err(Error::Invalid(format!(
                "voxels that measure more than {} along an axis, which is 2 to 4 times the size of the mesh; take a smaller thickness or \
                 more voxels",
                4.0 / grid.scale
            ))),
        }
    }
}

/// Consecutive rows of a stack.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Rows {
    /// Layer of the first row.
    pub layer: u32,
    /// Number of the first row in that layer; 0 if the rows span several layers.
    pub first: u32,
    /// Number of rows; the last row of a layer is followed by the first row of the next one.
    pub count: u32,
}

impl Rows {
    /// Divides the rows into parts of at most `most` rows, in a stack with layers of `height` rows. A part has several
    /// layers only if they are whole, and parts of a layer are multiples of [`VOXEL_RUN`] rows if that many fit: the runs
    /// of the parts are then those of the rows.
    pub fn parts(self, most: u32, height: u32) -> impl Iterator<Item = Self> + use<> {
        let unit = if most >= height { height.max(1) } else { VOXEL_RUN };
        let step = if most > unit { most / unit * unit } else { most }.max(1);
        let group = if most >= height { self.count } else { self.count.min(height) };
        (0..self.count).step_by(group.max(1) as usize).flat_map(move |begin| {
            let end = self.count.min(begin.saturating_add(group));
            (begin..end).step_by(step as usize).map(move |i| {
                let [first, layer] = self.row(i, height);
                Self { layer, first, count: step.min(end - i) }
            })
        })
    }

    /// Number of runs in each column. The rows of each layer are divided into runs of [`VOXEL_RUN`] rows, so that no
    /// run spans two layers. (Rows that start in the middle of a layer and continue in others are divided as if a layer
    /// started there.)
    pub fn runs(self, height: u32) -> u32 {
        let most = self.count.min(height).max(1);
        self.count / most * most.div_ceil(VOXEL_RUN) + (self.count % most).div_ceil(VOXEL_RUN)
    }

    /// The rows of run number `i`.
    pub fn run(self, i: u32, height: u32) -> Range<u32> {
        let most = self.count.min(height).max(1);
        let (of_layer, in_layer) = (i / most.div_ceil(VOXEL_RUN) * most, i % most.div_ceil(VOXEL_RUN) * VOXEL_RUN);
        of_layer + in_layer..self.count.min(of_layer.saturating_add(most.min(in_layer + VOXEL_RUN)))
    }

    /// Row and layer of the `i`-th row.
    pub fn row(&self, i: u32, height: u32) -> [u32; 2] {
        let (at, height) = (u64::from(self.first) + u64::from(i), u64::from(height.max(1)));
        [(at % height) as u32, self.layer + (at / height) as u32]
    }
}

/// The voxels of whole rows: part of a layer, or several whole layers.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Band {
    /// Which rows.
    pub rows: Rows,
    /// Value of each voxel; NaN if the voxel is empty or there is no field.
    pub values: Vec<f32>,
    /// Kind of each voxel.
    pub kinds: Vec<u8>,
    /// Owner of each voxel, or `u32::MAX`.
    pub owners: Vec<u32>,
}

/// Numbers of voxels by kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Voxels with their centre in the mesh.
    pub inside: u64,
    /// Voxels that the mesh merely touches.
    pub touched: u64,
    /// All other voxels.
    pub empty: u64,
}

impl Tally {
    /// Adds the voxels of a band.
    pub fn add(&mut self, kinds: &[u8]) {
        for &kind in kinds {
            match kind {
                INSIDE => self.inside += 1,
                TOUCHED => self.touched += 1,
                _ => self.empty += 1,
            }
        }
    }
}

/// The parts in which a stack is sliced, each with as many rows as make at most `most` voxels, but at least one row, and
/// divided as by [`Rows::parts`]. The first part is the largest. If [`VOXEL_RUN`] rows fit, runs start at the same rows
/// whatever `most` is, and owners are the same even where tetrahedra overlap.
pub fn bands(grid: &VoxelGrid, most: u64) -> impl Iterator<Item = Rows> + use<> {
    let ([w, h], layers) = (grid.size, grid.layers);
    let rows = (most / u64::from(w.max(1))).clamp(1, u64::from(u32::MAX)) as u32;
    let whole = (rows / h.max(1)).clamp(1, layers.max(1));
    let of_layers = move |layer: u32| Rows { layer, first: 0, count: h * whole.min(layers - layer) }.parts(rows, h);
    (0..layers).step_by(whole as usize).flat_map(of_layers)
}

#[cfg(test)]
mod tests;
