//! Procedural meshes: the Kuhn split of a regular grid.

use super::{Field, Mesh, On};
use crate::error::{Error, Result};

/// The six paths from corner 0 to corner 7 of a cube along its edges; bit 0 of a corner is x, bit 1 y, bit 2 z.
const PATHS: [[usize; 4]; 6] = [[0, 1, 3, 7], [0, 1, 5, 7], [0, 2, 3, 7], [0, 2, 6, 7], [0, 4, 5, 7], [0, 4, 6, 7]];

/// The Kuhn grid of `cells` unit cubes, with six tetrahedra each and the analytic point field `jet`. The paper's *Jets*
/// is `kuhn([127; 3])`; its *Bar* has as many tetrahedra as `kuhn([32, 32, 80])`.
///
/// # Errors
/// [`Error::Invalid`] if an axis has no cell, [`Error::TooLarge`] if points or tetrahedra do not fit 32-bit indices.
pub fn kuhn(cells: [u32; 3]) -> Result<Mesh> {
    kuhn_jittered(cells, 0.0, 0)
}

/// The grid of [`kuhn`], with every inner vertex moved by up to `jitter` cube edges along each axis, reproducibly for a
/// `seed`. Below 0.5 the cubes stay in order, though single tetrahedra may be inverted.
///
/// # Errors
/// Those of [`kuhn`].
pub fn kuhn_jittered(cells: [u32; 3], jitter: f32, seed: u32) -> Result<Mesh> {
    if cells.contains(&0) {
        return Err(Error::Invalid(format!("a grid needs at least one cube along each axis, not {}×{}×{}", cells[0], cells[1], cells[2])));
    }
    let [nx, ny, nz] = cells.map(u64::from);
    let (n_points, n_tets) =
        ((nx + 1).saturating_mul(ny + 1).saturating_mul(nz + 1), nx.saturating_mul(ny).saturating_mul(nz).saturating_mul(6));
    if n_points > u64::from(u32::MAX) || n_tets > u64::from(u32::MAX / 4) {
        let most = format!("at most {} and {} can be numbered", u32::MAX, u32::MAX / 4);
        return Err(Error::TooLarge(format!("a grid of {nx}×{ny}×{nz} cubes has {n_points} points and {n_tets} tetrahedra; {most}")));
    }
    let mut points = Vec::with_capacity(n_points as usize);
    let mut jet = Vec::with_capacity(n_points as usize);
    for z in 0..=cells[2] {
        for y in 0..=cells[1] {
            for x in 0..=cells[0] {
                let at = [x, y, z];
                let inner = (0..3).all(|c| at[c] > 0 && at[c] < cells[c]);
                let mut p = at.map(|v| v as f32);
                if inner && jitter != 0.0 {
                    for (c, v) in p.iter_mut().enumerate() {
                        let h = hash(seed ^ hash(points.len() as u32 * 3 + c as u32));
                        *v += ((h >> 8) as f32 / 8_388_608.0 - 1.0) * jitter;
                    }
                }
                jet.push(jet_value(p, cells));
                points.push(p);
            }
        }
    }
    let (row, slab) = (cells[0] + 1, (cells[0] + 1) * (cells[1] + 1));
    let mut tets = Vec::with_capacity(n_tets as usize);
    for z in 0..cells[2] {
        for y in 0..cells[1] {
            for x in 0..cells[0] {
                let base = x + y * row + z * slab;
                let corner = |i: usize| base + (i as u32 & 1) + (i as u32 >> 1 & 1) * row + (i as u32 >> 2) * slab;
                tets.extend(PATHS.map(|path| path.map(corner)));
            }
        }
    }
    let mut mesh = Mesh::new(points, tets);
    mesh.fields.push(Field { name: "jet".into(), on: On::Points, values: jet });
    Ok(mesh)
}

/// A jet along x that widens and rolls up in vortices; values are in 0…1.
fn jet_value(p: [f32; 3], cells: [u32; 3]) -> f32 {
    let [x, y, z] = [0, 1, 2].map(|c| p[c] / cells[c] as f32);
    let (dy, dz) = (y - 0.5 - 0.06 * (9.0 * x).sin() * x, z - 0.5 - 0.06 * (11.0 * x + 1.0).cos() * x);
    let width = 0.06 + 0.22 * x;
    let radius = (dy * dy + dz * dz).sqrt() / width;
    let angle = dz.atan2(dy);
    let roll = 0.25 * x * (3.0 * angle + 14.0 * x).sin() * (-(radius - 1.0) * (radius - 1.0) * 4.0).exp();
    ((-radius * radius).exp() * (1.0 - 0.35 * x) + roll).clamp(0.0, 1.0)
}

/// A well-mixing 32-bit permutation (Wellons' lowbias32).
pub(crate) fn hash(mut h: u32) -> u32 {
    h ^= h >> 16;
    h = h.wrapping_mul(0x7feb_352d);
    h ^= h >> 15;
    h = h.wrapping_mul(0x846c_a68b);
    h ^ (h >> 16)
}
