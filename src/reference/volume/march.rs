//! Marching: samples of a ray, front to back.

use super::Scene;
use super::skip::{Skips, inverse_of};
use crate::mesh::On;
use crate::reference::boundary::NONE;
use crate::reference::tet::Tet;
use crate::reference::walk::outermost;
use crate::render::Plan;

/// Steps of a walk across faces before the tree is asked.
const WALK: u32 = 6;

/// Marches rays, one after the other.
pub struct Marcher<'a> {
    scene: &'a Scene<'a>,
    plan: &'a Plan,
    cell: Option<Cell>,
    /// Samples taken so far.
    pub samples: u64,
    /// Samples left out: nothing is to be seen in their nodes.
    pub skipped_samples: u64,
    /// Samples taken that lie in the mesh.
    pub found_samples: u64,
}

/// A tetrahedron and what its samples need.
#[derive(Clone, Copy)]
struct Cell {
    id: u32,
    tet: Tet,
    values: [f32; 4],
    normals: [[f32; 3]; 4],
}

impl<'a> Marcher<'a> {
    /// Ready for any ray of the scene.
    pub fn new(scene: &'a Scene<'a>) -> Self {
        Self { scene, plan: scene.plan(), cell: None, samples: 0, skipped_samples: 0, found_samples: 0 }
    }

    /// Colour (premultiplied) and opacity that a ray gathers over its samples `[begin, end)`.
    pub fn march(&mut self, ray: ([f32; 3], [f32; 3]), [begin, end]: [u32; 2]) -> [f32; 4] {
        let direction = ray.1;
        let plan = self.plan;
        let light = plan.lighting.filter(|_| !self.scene.prepared.normals.is_empty()).map(|light| (light, light.half(direction)));
        let mut sum = [0.0f32; 4];
        // Each ray begins without a hint, so that no pixel depends on another one.
        self.cell = None;
        let skips = self.scene.visible.as_deref().map(|visible| Skips { tree: self.scene.tree, visible, plan });
        let inverse = inverse_of(direction);
        let (mut next, mut check) = (begin, 0);
        while next < end {
            if let Some(skips) = skips.as_ref().filter(|_| next >= check) {
                let (behind, hidden) = skips.stretch(ray, inverse, next, end);
                if hidden {
                    self.cell = self.cell.filter(|_| behind - next < WALK);
                    self.skipped_samples += u64::from(behind - next);
                    next = behind;
                    continue;
                }
                check = behind;
            }
            let p = plan.sample(ray, next);
            next += 1;
            self.samples += 1;
            let Some((cell, b)) = self.locate(p) else {
                // Behind a gap the tree is asked first.
                self.cell = None;
                continue;
            };
            self.found_samples += 1;
            let v = cell.values;
            let value = if self.scene.field.on == On::Cells { v[0] } else { (b[0] * v[0] + b[1] * v[1]) + (b[2] * v[2] + b[3] * v[3]) };
            if !value.is_finite() {
                continue;
            }
            let [red, green, blue, mut a] = plan.lookup(value);
            if a <= 0.0 {
                continue;
            }
            check = check.max(next + 1);
            let mut color = [red, green, blue];
            if let Some((light, half)) = &light {
                let m = cell.normals;
                let n = [0, 1, 2].map(|c| (b[0] * m[0][c] + b[1] * m[1][c]) + (b[2] * m[2][c] + b[3] * m[3][c]));
                let shade = light.shade(n, direction, *half);
                color = color.map(|c| (c * shade.factor + shade.added).min(1.0));
                a += (1.0 - a) * shade.rim;
            }
            let w = (1.0 - sum[3]) * a;
            for c in 0..3 {
                sum[c] += w * color[c];
            }
            sum[3] += w;
            if sum[3] >= plan.termination {
                break;
            }
        }
        sum
    }

    /// Owner and barycentric coordinates of a point: of the last cell or one a short walk across faces away, if that contains the point
    /// clearly, which makes it the owner in a mesh whose cells do not overlap; or else by the tree.
    fn locate(&mut self, p: [f32; 3]) -> Option<(Cell, [f32; 4])> {
        if let Some(mut cell) = self.cell {
            let x = self.scene.tree.grid.normalise(p);
            for _ in 0..WALK {
                let weights = cell.tet.weights(x);
                if weights.clear {
                    self.cell = Some(cell);
                    return Some((cell, weights.barycentric(cell.tet.rank)));
                }
                let own = cell.tet.rank.map(|r| weights.w[r]);
                let face = outermost(own);
                let next = self.scene.topology.neighbours[cell.id as usize][face];
                if own[face] >= 0.0 || next == NONE {
                    break;
                }
                cell = self.cell(next);
            }
        }
        let location = self.scene.locator.locate(p);
        let cell = self.cell(location.found()?);
        self.cell = Some(cell);
        Some((cell, location.barycentric))
    }

    /// Gathers what samples in a tetrahedron (a valid one) need.
    fn cell(&self, id: u32) -> Cell {
        let scene = self.scene;
        let ids = scene.mesh.tets[id as usize];
        let values = match scene.field.on {
            On::Points => ids.map(|i| scene.field.values[i as usize]),
            On::Cells => [scene.field.values[id as usize]; 4],
        };
        let normals = ids.map(|i| scene.prepared.normals.get(i as usize).copied().unwrap_or_default());
        Cell { id, tet: Tet::new(ids, &scene.normalised), values, normals }
    }
}
