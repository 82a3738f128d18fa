//! Marching: samples of a ray, front to back.

use super::Scene;
use super::skip::{Skips, inverse_of};
use crate::mesh::On;
use crate::reference::walk::Stand;
use crate::render::Plan;

/// Steps of a walk across faces before the tree is asked.
const WALK: u32 = 6;

/// Marches rays, one after the other.
pub struct Marcher<'a> {
    scene: &'a Scene<'a>,
    plan: &'a Plan,
    /// That of the last sample, if it lay in one: behind a gap the tree is asked first.
    cell: Option<u32>,
    /// Samples taken so far.
    pub samples: u64,
    /// Samples left out: nothing is to be seen in their nodes.
    pub skipped_samples: u64,
    /// Samples taken that lie in the mesh.
    pub found_samples: u64,
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
            let Some((stand, b)) = self.locate(p) else { continue };
            self.found_samples += 1;
            let at = |v: [f32; 4]| (b[0] * v[0] + b[1] * v[1]) + (b[2] * v[2] + b[3] * v[3]);
            let field = self.scene.field;
            let value =
                if field.on == On::Cells { field.values[stand.t as usize] } else { at(stand.ids.map(|i| field.values[i as usize])) };
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
                let normals = &self.scene.prepared.normals;
                let n = [0, 1, 2].map(|c| at(stand.ids.map(|i| normals[i as usize][c])));
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

    /// Where a point lies, and its barycentric coordinates: in the last cell or one a short walk across faces away, if that contains the point
    /// clearly, which makes it the owner in a mesh whose cells do not overlap; or else where the tree says. Outside of the bounds there is nothing to ask for.
    fn locate(&mut self, p: [f32; 3]) -> Option<(Stand, [f32; 4])> {
        let (walker, grid) = (self.scene.locator.walker(), &self.scene.tree.grid);
        let x = grid.normalise(p);
        let found = self.cell.and_then(|cell| walker.stride(cell, x, WALK)).or_else(|| {
            (0..3).all(|c| 0.0 <= x[c] && x[c] <= grid.extent[c]).then_some(())?;
            let stand = walker.stand_in(self.scene.locator.locate(p).found()?)?;
            Some((stand, stand.sides(x)))
        });
        self.cell = found.map(|(stand, _)| stand.t);
        found.map(|(stand, sides)| (stand, sides.barycentric()))
    }
}
