//! The part of a ray that can meet the mesh, from the boundary nodes of the tree.

use super::skip::inverse_of;
use crate::grid::{Box6, CellRange};
use crate::layout::bit;
use crate::reference::leaves::cell_box;
use crate::render::{MAX_SAMPLES, PicturePlan, interval_slack};
use crate::tree::TreeArrays;

/// Ray intervals of a plan.
pub struct Intervals<'a> {
    tree: &'a TreeArrays,
    /// One bit per node, set if the node is to be visited.
    nodes: &'a [u32],
    plan: &'a PicturePlan,
    /// Only samples in these cells of the finest grid are taken.
    part: CellRange,
    /// Boxes are enlarged by this, so that no sample is lost by rounding of samples, boxes and rays.
    slack: [f32; 3],
}

/// A node still to be visited: index, level, Morton code of its cell.
type Node = (u32, u32, u32);

impl<'a> Intervals<'a> {
    /// Prepares the rays of `plan`. `visible` has one bit per node, set if something is visible there.
    pub fn new(tree: &'a TreeArrays, visible: Option<&'a [u32]>, plan: &'a PicturePlan) -> Self {
        Self { tree, nodes: visible.unwrap_or(&tree.flags), plan, part: CellRange::WHOLE, slack: interval_slack(&tree.grid) }
    }

    /// Restricts samples to these cells of the finest grid.
    #[must_use]
    pub fn within(self, part: CellRange) -> Self {
        Self { part, ..self }
    }

    /// The samples `[begin, end)` of a ray (origin, unit direction) that can lie in the mesh: from the first to the
    /// last leaf with the boundary flag (or with something visible) whose box the ray meets, and one more at either
    /// end, without those that a clip leaves out or that lie more than `limit` steps from the origin, where iso-surfaces
    /// need one more. For a ray that starts in a leaf of the mesh they start at 0.
    pub fn of(&self, ray: ([f32; 3], [f32; 3]), limit: f32) -> [u32; 2] {
        let (origin, direction) = ray;
        let inverse = inverse_of(direction);
        let grid = &self.tree.grid;
        let (mut first, mut last) = (f32::MAX, -1.0f32);
        let within = (0..3).all(|c| grid.lo[c] <= origin[c] && origin[c] <= grid.hi[c]);
        if within && self.tree.find_leaf(grid.quantize(origin)).is_some() {
            (first, last) = (0.0, 0.0);
        }
        // Depth first. Nodes within the interval found so far cannot extend it, so the order of visits does not matter.
        let mut stack: Vec<Node> = vec![(0, 0, 0)];
        while let Some((node, level, code)) = stack.pop() {
            if !bit(self.nodes, node) {
                continue;
            }
            let Some([enter, leave]) = self.hit(cell_box(grid, level, code), origin, inverse) else { continue };
            if first <= enter && leave <= last {
                continue;
            }
            if level == grid.level {
                (first, last) = (first.min(enter), last.max(leave));
                continue;
            }
            stack.extend((0..8).filter_map(|digit| Some((self.tree.child(node, digit)?, level + 1, code << 3 | digit))));
        }
        if last < first {
            return [0, 0];
        }
        // Sample k lies at (k + ½)·Δ.
        let number = |x: f32| x.clamp(0.0, MAX_SAMPLES as f32).floor();
        let inverse_step = self.plan.inverse_step();
        let (kept, _) = self.plan.kept_stretch(ray, limit);
        let more = if self.plan.iso.is_empty() { 0.0 } else { 1.0 };
        let begin = number(first * inverse_step - 1.5).max((kept[0] - 0.5).ceil() - more) as u32;
        let end = number(last * inverse_step + 1.5).min((kept[1] - 0.5).floor() + 1.0 + more).max(0.0) as u32;
        let end = end.max(begin);
        if self.part == CellRange::WHOLE {
            return [begin, end];
        }
        let begin = self.first_sample(ray, begin, end, false);
        [begin, self.first_sample(ray, begin, end, true)]
    }

    /// With `past` false, the first of the samples `[k, end)` that has reached the cells of the part; with `past` true,
    /// the first one that has left them again. Binary search suffices, because cells are monotone along a ray.
    fn first_sample(&self, ray: ([f32; 3], [f32; 3]), mut k: u32, mut end: u32, past: bool) -> u32 {
        let CellRange { lo, hi } = self.part;
        while k < end {
            let middle = k.midpoint(end);
            let q = self.tree.grid.quantize(self.plan.sample(ray, middle));
            let is_off = |c: usize| if (ray.1[c] >= 0.0) == past { hi[c] < q[c] } else { q[c] < lo[c] };
            if (0..3).any(is_off) == past {
                end = middle;
            } else {
                k = middle + 1;
            }
        }
        k
    }

    /// Where a ray enters and leaves a box, never before its origin; `None` if it misses the box.
    fn hit(&self, [x0, y0, z0, x1, y1, z1]: Box6, origin: [f32; 3], inverse: [f32; 3]) -> Option<[f32; 2]> {
        let (lo, hi) = ([x0, y0, z0], [x1, y1, z1]);
        let (mut enter, mut leave) = (0.0f32, f32::MAX);
        for c in 0..3 {
            let a = ((lo[c] - self.slack[c]) - origin[c]) * inverse[c];
            let b = ((hi[c] + self.slack[c]) - origin[c]) * inverse[c];
            enter = enter.max(a.min(b));
            leave = leave.min(a.max(b));
        }
        (enter <= leave).then_some([enter, leave])
    }
}
