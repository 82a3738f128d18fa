//! Deformed shapes: points moved by a vector field.

use super::{Mesh, On};
use crate::error::{Error, Result};

impl Mesh {
    /// Moves every point by `factor` times a vector of the mesh, such as a displacement: the fields `vector.x`, `vector.y`
    /// and `vector.z`, which must belong to points. Returns how many points of cells stay where they are because their
    /// vector is not finite.
    ///
    /// # Errors
    /// [`Error::Invalid`] if there is no such vector of points, [`Error::TooLarge`] if a point would lie beyond single
    /// precision. The mesh is as it was then.
    pub fn warp(&mut self, vector: &str, factor: f64) -> Result<usize> {
        let component = |axis: &str| {
            let field = self.field(&format!("{vector}.{axis}")).filter(|field| field.on == On::Points);
            field.map(|field| &field.values).filter(|values| values.len() == self.points.len())
        };
        let (Some(x), Some(y), Some(z)) = (component("x"), component("y"), component("z")) else {
            return Err(Error::Invalid(format!("no vector `{vector}` of the points")));
        };
        let mut of_cells = vec![false; self.points.len()];
        self.tets.as_flattened().iter().for_each(|&v| of_cells.get_mut(v as usize).into_iter().for_each(|of_cell| *of_cell = true));
        let mut still = 0;
        let mut moved = self.points.clone();
        for (i, p) in moved.iter_mut().enumerate() {
            let by = [x[i], y[i], z[i]];
            if !by.iter().all(|v| v.is_finite()) {
                still += usize::from(of_cells[i]);
                continue;
            }
            for (x, by) in p.iter_mut().zip(by) {
                let to = (f64::from(*x) + factor * f64::from(by)) as f32;
                if x.is_finite() && !to.is_finite() {
                    return Err(Error::TooLarge(format!(
                        "point {} moved by {factor:e} times `{vector}` lies beyond single precision",
                        self.point_id(i as u32)
                    )));
                }
                *x = to;
            }
        }
        self.points = moved;
        Ok(still)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Field, kuhn};

    fn with_vector(on: On) -> Mesh {
        let mut mesh = kuhn([1, 2, 3]).unwrap();
        let n = if on == On::Points { mesh.points.len() } else { mesh.tets.len() };
        mesh.fields = ["u", "u.x", "u.y", "u.z"].map(|name| Field { name: name.into(), on, values: vec![0.5; n] }).into();
        mesh
    }

    #[test]
    fn points_move_by_the_vector() {
        let (still, mut mesh) = (kuhn([1, 2, 3]).unwrap().points, with_vector(On::Points));
        mesh.fields[2].values[4] = f32::NAN;
        // A point of no cell needs no vector.
        mesh.points.push([0.0; 3]);
        mesh.fields.iter_mut().for_each(|field| field.values.push(f32::NAN));
        assert_eq!(mesh.warp("u", -2.0).unwrap(), 1);
        for (i, (a, b)) in still.iter().zip(&mesh.points).enumerate() {
            assert_eq!(*b, a.map(|x| if i == 4 { x } else { x - 1.0 }));
        }
    }

    #[test]
    fn what_cannot_move_is_refused() {
        let mut mesh = with_vector(On::Points);
        let before = mesh.points.clone();
        assert!(matches!(mesh.warp("v", 1.0), Err(Error::Invalid(why)) if why.contains("`v`")));
        assert!(matches!(mesh.warp("u", 1e39), Err(Error::TooLarge(why)) if why.contains("point 0")));
        assert!(mesh.points == before && with_vector(On::Cells).warp("u", 1.0).is_err());
    }
}
