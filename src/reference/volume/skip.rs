//! Stretches of a ray in which nothing is visible. Twin of `glsl/shared/skip.glsl`.

use crate::grid::{MAX_LEVEL, morton, reciprocal};
use crate::layout::bit;
use crate::reference::leaves::cell_side;
use crate::render::PicturePlan;
use crate::render::rays::LEAST;
use crate::tree::TreeArrays;

/// The reciprocals of the components of a direction.
pub fn inverse_of(direction: [f32; 3]) -> [f32; 3] {
    direction.map(|d| if d.abs() < LEAST { 1.0 / LEAST.copysign(d) } else { reciprocal(d) })
}

/// The nodes of a tree in which something is visible.
pub struct Skips<'a> {
    /// The tree.
    pub tree: &'a TreeArrays,
    /// One bit per node, set if something is visible there.
    pub visible: &'a [u32],
    /// The plan of the picture.
    pub plan: &'a PicturePlan,
}

impl Skips<'_> {
    /// The end of a stretch of samples, and whether nothing is visible in it. The stretch consists of the samples from
    /// `k` on and before `end` that lie in the same node as sample `k`: the highest such node in which nothing is
    /// visible, or else its leaf. Rounding cannot lose a sample: the positions of a ray's samples and their cells are
    /// monotone, so what lies between two samples of a node also lies in it.
    pub fn stretch(&self, (origin, direction): ([f32; 3], [f32; 3]), inverse: [f32; 3], k: u32, end: u32) -> (u32, bool) {
        let (tree, plan, grid) = (self.tree, self.plan, &self.tree.grid);
        let at = |k: u32| grid.quantize(plan.sample((origin, direction), k));
        let finest = at(k);
        let code = morton(finest);
        let (mut node, mut level) = (0, 0);
        let mut hidden = !bit(self.visible, node);
        while !hidden && level < grid.level {
            level += 1;
            let child = tree.child(node, code >> (3 * (MAX_LEVEL - level)) & 7);
            hidden = child.is_none_or(|child| !bit(self.visible, child));
            node = child.unwrap_or(node);
        }
        let shift = MAX_LEVEL - level;
        let cell = finest.map(|q| q >> shift);
        let leave = (0..3).filter(|&c| grid.inv[c] != 0.0).map(|c| {
            let side = cell_side(grid, c, level, cell[c] + u32::from(inverse[c] > 0.0));
            (side - origin[c]) * inverse[c]
        });
        let number = (leave.fold(f32::MAX, f32::min) * plan.inverse_step() - 0.5).floor();
        let last = number.clamp(k as f32, (end - 1) as f32) as u32;
        let fits = |last: u32| last > k && at(last).map(|q| q >> shift) == cell;
        let behind = [last, last.saturating_sub(1)].into_iter().find(|&last| fits(last)).map_or(k + 1, |last| last + 1);
        (behind, hidden)
    }
}
