//! Measures of a whole mesh.

use super::{Field, Mesh, On};
use glam::DVec3;

impl Mesh {
    /// Volume of the tetrahedra that are `valid`, each of which counts as positive, in units of the mesh to the third
    /// power. Tetrahedra that overlap count twice.
    pub fn volume(&self, valid: impl Fn(u32) -> bool) -> f64 {
        // Six times the volume, which is a whole number where coordinates are.
        let of = |tet: &[u32; 4]| {
            let [a, b, c, d] = tet.map(|v| DVec3::from_array(self.points[v as usize].map(f64::from)));
            (b - a).cross(c - a).dot(d - a).abs()
        };
        self.valid(valid).map(of).sum::<f64>() / 6.0
    }

    /// Smallest and largest finite value of a field in the tetrahedra that are `valid`: points that none of them uses do not
    /// count. `None` if there is no such value.
    pub fn range(&self, field: &Field, valid: impl Fn(u32) -> bool) -> Option<[f32; 2]> {
        let mut used = Vec::new();
        let values = &field.values;
        if field.on == On::Points {
            used = vec![false; self.points.len()];
            self.valid(valid).flatten().for_each(|&v| used[v as usize] = true);
        } else {
            used.extend((0..self.tets.len() as u32).map(valid));
        }
        let counted = values.iter().zip(used).filter(|(v, used)| *used && v.is_finite()).map(|(v, _)| *v);
        counted.fold(None, |range, v| Some(range.map_or([v, v], |[lo, hi]: [f32; 2]| [lo.min(v), hi.max(v)])))
    }

    /// The tetrahedra that are `valid`; never those with vertices that the mesh lacks.
    fn valid(&self, valid: impl Fn(u32) -> bool) -> impl Iterator<Item = &[u32; 4]> {
        let has_points = |tet: &[u32; 4]| tet.iter().all(|&v| (v as usize) < self.points.len());
        (0..).zip(&self.tets).filter(move |&(t, tet)| valid(t) && has_points(tet)).map(|(_, tet)| tet)
    }

    /// Number of parts into which the tetrahedra that are `valid` fall: two that have a point in common belong together.
    pub fn parts(&self, valid: impl Fn(u32) -> bool) -> usize {
        const UNUSED: u32 = u32::MAX;
        // The parent of each point; the root of a part is its own.
        let mut parents = vec![UNUSED; self.points.len()];
        let mut parts = 0;
        for tet in self.valid(valid) {
            let mut part = UNUSED;
            for &v in tet {
                if parents[v as usize] == UNUSED {
                    parents[v as usize] = v;
                    parts += 1;
                }
                let root = root(&mut parents, v);
                if part == UNUSED {
                    part = root;
                } else if part != root {
                    parents[root as usize] = part;
                    parts -= 1;
                }
            }
        }
        parts
    }
}

/// The root of a point's part. Halves the way there for those that ask next.
fn root(parents: &mut [u32], mut v: u32) -> u32 {
    while parents[v as usize] != v {
        let above = parents[parents[v as usize] as usize];
        parents[v as usize] = above;
        v = above;
    }
    v
}

#[cfg(test)]
mod tests {
    use crate::mesh::{Field, On, kuhn};

    #[test]
    fn a_grid_and_a_copy_of_it() {
        let mut mesh = kuhn([2, 3, 4]).unwrap();
        assert_eq!((mesh.volume(|_| true), mesh.parts(|_| true)), (24.0, 1));
        let (points, n) = (mesh.points.clone(), mesh.points.len() as u32);
        mesh.points.extend(points.iter().map(|p| [p[0] + 9.0, p[1], p[2]]));
        let copies: Vec<_> = mesh.tets.iter().map(|&[a, b, c, d]| [b, a, c, d].map(|v| v + n)).collect();
        mesh.tets.extend(copies);
        assert_eq!((mesh.volume(|_| true), mesh.parts(|_| true)), (48.0, 2));
        assert_eq!((mesh.volume(|t| t < 144), mesh.parts(|t| t >= 144)), (24.0, 1));
        assert_eq!((mesh.volume(|_| false), mesh.parts(|_| false)), (0.0, 0));
        mesh.tets.push([0, 1, n, n + 1]);
        assert_eq!(mesh.parts(|_| true), 1);
        let field = |on, n: usize| Field { name: "i".into(), on, values: (0..n).map(|i| i as f32).collect() };
        mesh.points.push([-9.0; 3]); // of no cell
        let (points, cells) = (field(On::Points, mesh.points.len()), field(On::Cells, mesh.tets.len()));
        assert_eq!((mesh.range(&points, |_| true), mesh.range(&points, |t| t < 144)), (Some([0.0, 119.0]), Some([0.0, 59.0])));
        assert_eq!((mesh.range(&cells, |t| t > 143), mesh.range(&cells, |_| false)), (Some([144.0, 288.0]), None));
        mesh.tets.push([0, 1, 2, u32::MAX]);
        assert_eq!((mesh.volume(|t| t > 288), mesh.parts(|t| t > 288)), (0.0, 0), "a vertex that is not there");
    }
}
