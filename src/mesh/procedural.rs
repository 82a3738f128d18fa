//! Procedural meshes that are hard on a spatial data structure: tetrahedra of very different size, thin walls, bad
//! shapes.

use super::{Mesh, kuhn_jittered};
use crate::error::{Error, Result};

/// Ratio of the widths of the last and the first cubes of [`graded`], per axis.
const GRADE: f32 = 100.0;
/// How many times the last cubes of [`far_field`] are as far from the middle as the first ones are wide.
const FIELD: f32 = 1e4;
/// Layers of cubes in the wall of [`shell`].
const LAYERS: u32 = 4;

/// A unit cube of 6·n³ tetrahedra that grow from one corner to the opposite one, with volume ratios of some 10^6.
///
/// # Errors
/// Those of [`super::kuhn`].
pub fn graded(n: u32) -> Result<Mesh> {
    let mut mesh = kuhn_jittered([n; 3], 0.2, 2)?;
    for x in mesh.points.iter_mut().flatten() {
        *x = (GRADE.powf(*x / n as f32) - 1.0) / (GRADE - 1.0);
    }
    Ok(mesh)
}

/// A box of ±1 around a small hole, as meshes for the flow around a body are: 6·n³ tetrahedra, without those of the n/4
/// cubes along each axis in the middle, whose sizes grow from there on by some 10^4. Nearly all of them lie where a
/// regular grid over the box has a few cells.
///
/// # Errors
/// [`Error::Invalid`] unless n is a multiple of 8 and not 0, otherwise those of [`super::kuhn`].
pub fn far_field(n: u32) -> Result<Mesh> {
    if n == 0 || !n.is_multiple_of(8) {
        return Err(Error::Invalid(format!("a far field of {n} cubes: a multiple of 8 is needed")));
    }
    let Mesh { mut points, mut tets, fields, .. } = kuhn_jittered([n; 3], 0.1, 5)?;
    let in_hole = |v: u32| (0..3).all(|c| (3 * n / 8..=5 * n / 8).contains(&(v / (n + 1).pow(c) % (n + 1))));
    tets.retain(|t| !t.iter().all(|&v| in_hole(v)));
    for x in points.iter_mut().flatten() {
        let from_middle = 2.0 * *x / n as f32 - 1.0;
        *x = (FIELD.powf(from_middle.abs()) - 1.0).copysign(from_middle) / (FIELD - 1.0);
    }
    let mut mesh = Mesh::new(points, tets);
    mesh.fields = fields;
    Ok(mesh)
}

/// A plate of 6·n³ squeezed and sheared tetrahedra, n × n × 0.06 n units: flat, and some of them nearly without volume.
///
/// # Errors
/// Those of [`super::kuhn`].
pub fn slivers(n: u32) -> Result<Mesh> {
    let mut mesh = kuhn_jittered([n; 3], 0.2, 3)?;
    for [x, y, z] in &mut mesh.points {
        *x += 0.8 * *y;
        *z = 0.06 * *z + 0.04 * (*x + *y);
    }
    Ok(mesh)
}

/// A closed tube, bent to a ring, with a wall of four layers: 12·n² tetrahedra for even n. Most of its bounds is empty.
///
/// # Errors
/// [`Error::Invalid`] for fewer than 8 cubes around the ring, otherwise those of [`super::kuhn`].
pub fn shell(n: u32) -> Result<Mesh> {
    if n < 8 {
        return Err(Error::Invalid(format!("a shell of {n} cubes around the ring; it needs at least 8")));
    }
    let size = [n, n / 2, LAYERS];
    let grid = kuhn_jittered(size, 0.0, 0)?;
    // The grid's first and last points along the ring and around the tube are merged.
    let row = n + 1;
    let wrapped = |v: u32| (v % row % n) + n * ((v / row) % (n / 2 + 1) % (n / 2)) + n * (n / 2) * (v / row / (n / 2 + 1));
    let mut mesh = Mesh::new(vec![[0.0; 3]; (n * (n / 2) * (LAYERS + 1)) as usize], grid.tets);
    let mut values = vec![0.0; mesh.points.len()];
    mesh.tets.iter_mut().flatten().for_each(|v| *v = wrapped(*v));
    let mut field = grid.fields.into_iter().next();
    for (v, [x, y, z]) in (0u32..).zip(&grid.points) {
        let (around, across) = (std::f32::consts::TAU * x / n as f32, std::f32::consts::TAU * y / (n / 2) as f32);
        let radius = 0.36 + 0.04 * z / LAYERS as f32;
        let from_axis = 1.0 + radius * across.cos();
        let at = wrapped(v) as usize;
        // Among merged points the first one counts.
        if mesh.points[at] == [0.0; 3] {
            mesh.points[at] = [from_axis * around.cos(), from_axis * around.sin(), radius * across.sin()];
            values[at] = field.as_ref().map_or(0.0, |f| f.values[v as usize]);
        }
    }
    if let Some(field) = &mut field {
        field.values = values;
    }
    mesh.fields.extend(field);
    Ok(mesh)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashMap;

    #[test]
    fn cells_fit_each_other() {
        for (mesh, surface) in [(graded(6).unwrap(), 6 * 2 * 36), (slivers(5).unwrap(), 6 * 2 * 25), (shell(12).unwrap(), 2 * 2 * 12 * 6)] {
            let mut faces: HashMap<[u32; 3], u32> = HashMap::new();
            for [a, b, c, d] in &mesh.tets {
                for mut face in [[*b, *c, *d], [*a, *c, *d], [*a, *b, *d], [*a, *b, *c]] {
                    face.sort_unstable();
                    *faces.entry(face).or_default() += 1;
                }
            }
            assert!(faces.values().all(|&n| n <= 2));
            assert_eq!(faces.values().filter(|&&n| n == 1).count(), surface);
            assert_eq!(mesh.fields[0].values.len(), mesh.points.len());
            assert_eq!(mesh.source_cells as usize, mesh.tets.len());
        }
        assert_eq!(shell(12).unwrap().tets.len(), 12 * 12 * 12);
    }
}
