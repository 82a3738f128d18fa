//! The places of the surface that are closest to points, in blocks: each block tells the closest in its own cells.

use super::Cost;
use super::locate::{Blocks, LocateRequest, each};
use crate::error::Result;
use crate::gpu::Gpu;
use crate::layout::NONE;
use crate::query::{Nearest, Progress, SILENT, nearest_in};
use crate::times::StageTimes;

/// Finds the place of the surface that is closest to each point, at most `within` away, as [`crate::query::nearest`]
/// does, within the memory limit of `gpu`. `report` receives the number of points done, and of all.
///
/// # Errors
/// Those of [`super::locate`].
pub fn nearest(gpu: &Gpu, asked: &LocateRequest<'_>, within: f32, report: Progress<'_>) -> Result<(Nearest, Cost)> {
    let n = asked.points.len();
    let (owners, barycentrics, squares) = (vec![NONE; n], vec![[0.0; 4]; n], vec![f32::INFINITY; n]);
    let mut all = Nearest { owners, barycentrics, squares, scale: 1.0, times: StageTimes::default() };
    let cost = each(gpu, asked, Blocks::All, report, &mut |ids, points, placed, cells| {
        let found = nearest_in(&placed.tree, points, within, cells, SILENT)?;
        all.scale = found.scale;
        all.times.add(found.times);
        for (k, i) in ids.iter().map(|&i| i as usize).enumerate() {
            let (owner, square) = (placed.tet(found.owners[k]), found.squares[k]);
            if owner != NONE && (square, owner) < (all.squares[i], all.owners[i]) {
                (all.owners[i], all.squares[i], all.barycentrics[i]) = (owner, square, found.barycentrics[k]);
            }
        }
        Ok(())
    })?;
    Ok((all, cost))
}
