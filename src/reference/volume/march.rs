//! Marching: takes the samples of a ray, front to back.

use super::Drawing;
use super::skip::{Skips, inverse_of};
use crate::grid::{canonical, per_axis, reciprocal};
use crate::layout::constants::volume_march::WALK;
use crate::reference::tet::Sides;
use crate::reference::walk::{Stand, way_before, weighed};
use crate::render::{Lighting, PicturePlan};

/// Marches rays, one after the other.
pub struct Marcher<'a> {
    scene: &'a Drawing<'a>,
    plan: &'a PicturePlan,
    /// The tetrahedron of the last sample, if it lay in one. After a gap the tree is searched first.
    cell: Option<u32>,
    /// Number of samples taken so far.
    pub samples: u64,
    /// Number of samples skipped, since nothing is visible in their nodes.
    pub skipped_samples: u64,
    /// Number of samples taken that lie in the mesh.
    pub found_samples: u64,
}

/// What a ray has gathered so far, and its light.
struct Gathered<'a> {
    sum: [f32; 4],
    direction: [f32; 3],
    light: Option<(Lighting, [f32; 3])>,
    normals: &'a [[f32; 3]],
    /// How many steps from its origin the ray became opaque.
    opaque_at: Option<f32>,
    /// Opacity at which that is.
    termination: f32,
    /// The stretch that neither clip nor depth leaves out, and the clip at which it begins.
    kept: ([f32; 2], Option<usize>),
}

/// A place of a ray: its distance from the origin in steps, and the field's value there.
#[derive(Clone, Copy)]
struct Place {
    at: f32,
    value: f32,
}

impl Gathered<'_> {
    /// The normal at barycentric coordinates `b` in a tetrahedron.
    fn normal_at(&self, stand: &Stand, b: [f32; 4]) -> [f32; 3] {
        per_axis(|c| weighed(b, stand.ids.map(|i| self.normals[i as usize][c])))
    }

    /// Adds a colour at a place `at` steps from the ray's origin with normal `n`.
    fn add(&mut self, at: f32, [red, green, blue, mut a]: [f32; 4], n: [f32; 3]) {
        let mut color = [red, green, blue];
        if let Some((light, half)) = &self.light {
            let shade = light.shade(n, self.direction, *half);
            color = color.map(|c| (c * shade.factor + shade.added).min(1.0));
            a += (1.0 - a) * shade.rim;
        }
        let w = (1.0 - self.sum[3]) * a;
        for (sum, color) in self.sum.iter_mut().zip(color) {
            *sum += w * color;
        }
        self.sum[3] += w;
        if self.sum[3] >= self.termination {
            self.opaque_at = Some(at);
        }
    }
}

impl<'a> Marcher<'a> {
    /// A marcher for any rays of the scene.
    pub fn new(scene: &'a Drawing<'a>) -> Self {
        Self { scene, plan: scene.plan(), cell: None, samples: 0, skipped_samples: 0, found_samples: 0 }
    }

    /// Premultiplied colour and opacity that a ray gathers over its samples `[begin, end)`, and how many steps from its
    /// origin it became opaque, if it did. It ends `limit` steps from its origin.
    pub fn march(&mut self, ray: ([f32; 3], [f32; 3]), limit: f32, [begin, end]: [u32; 2]) -> ([f32; 4], Option<f32>) {
        let direction = ray.1;
        let plan = self.plan;
        let light = plan.lighting.filter(|_| !self.scene.prepared.normals.is_empty()).map(|light| (light, light.half(direction)));
        let mut gathered = Gathered {
            sum: [0.0; 4],
            direction,
            light,
            normals: &self.scene.prepared.normals,
            opaque_at: None,
            termination: plan.termination,
            kept: plan.kept_stretch(ray, limit),
        };
        // The last sample, if that showed something; for iso-surfaces, where the ray leaves its tetrahedron.
        let mut last: Option<Place> = None;
        // Each ray starts without a hint, so that no pixel depends on another one.
        self.cell = None;
        let skips = self.scene.visible.as_deref().map(|visible| Skips { tree: self.scene.tree, visible, plan });
        let inverse = inverse_of(direction);
        let (mut next, mut check) = (begin, 0);
        while next < end && gathered.opaque_at.is_none() {
            let mut ahead = 1;
            if let Some(skips) = skips.as_ref().filter(|_| next >= check) {
                let (behind, hidden) = skips.stretch(ray, inverse, next, end);
                if hidden && !plan.iso.is_empty() {
                    // The whole stretch lies on one side of every surface, so its first and its last sample suffice.
                    ahead = (behind - next).max(2) - 1;
                } else if hidden {
                    self.cell = self.cell.filter(|_| behind - next < WALK);
                    self.skipped_samples += u64::from(behind - next);
                    next = behind;
                    last = None; // as after a transparent sample
                    continue;
                } else {
                    check = behind;
                }
            }
            let (k, before) = (next, last.take());
            next += ahead;
            self.skipped_samples += u64::from(ahead - 1);
            self.samples += 1;
            let Some((stand, sides)) = self.locate(plan.sample(ray, k)) else { continue };
            self.found_samples += 1;
            let b = sides.barycentric();
            let value = stand.value(self.scene.field, b);
            if !value.is_finite() {
                continue;
            }
            if !plan.iso.is_empty() {
                let [from, to] = self.ends(ray, k, &stand, &sides, value, before.is_some());
                if let Some(before) = before {
                    self.add_surfaces(&mut gathered, ray, [before, from], &stand);
                }
                self.add_surfaces(&mut gathered, ray, [from, to], &stand);
                last = Some(to);
                continue;
            }
            let color = plan.lookup(value);
            if color[3] > 0.0 {
                last = Some(Place { at: k as f32 + 0.5, value });
                check = check.max(next + 1);
                let normal =
                    if gathered.light.is_some() { self.lit_at(&gathered, ray, k, (&stand, &sides), before.is_some()) } else { [0.0; 3] };
                gathered.add(k as f32 + 0.5, color, normal);
            }
        }
        (gathered.sum, gathered.opaque_at)
    }

    /// The stretch of the ray around sample k, which has this value, in the tetrahedron of the sample, but no farther
    /// than to the samples beside k: where it begins and ends, and the values there. If it joins the stretch of the
    /// sample before, it begins at the sample: two such stretches usually meet at a face, so the value is linear
    /// between them.
    fn ends(&self, ray: ([f32; 3], [f32; 3]), k: u32, stand: &Stand, here: &Sides, value: f32, joins: bool) -> [Place; 2] {
        let at = k as f32 + 0.5;
        let next = stand.sides(self.scene.tree.grid.normalise(self.plan.sample(ray, k + 1)));
        let rise = stand.value(self.scene.field, next.barycentric()) - value;
        let sample = Place { at, value };
        if rise.abs() >= 1e37 || rise.is_nan() {
            return [sample; 2];
        }
        let place = |part: f32| Place { at: at + part, value: value + rise * part };
        let behind = [0, 1, 2, 3].map(|f| here.w[f] - (next.w[f] - here.w[f]));
        let begin = if joins { sample } else { place(-way_within(here.w, behind).min(at)) };
        [begin, place(way_within(here.w, next.w))]
    }

    /// Barycentric coordinates in `stand` of a place of the ray, which lies in it but for rounding.
    fn barycentric_at(&self, ray: ([f32; 3], [f32; 3]), stand: &Stand, steps: f32) -> [f32; 4] {
        let s = steps * self.plan.step;
        let at = per_axis(|c| ray.0[c] + ray.1[c] * s);
        let b = stand.sides(self.scene.tree.grid.normalise(at)).barycentric().map(|b| b.max(0.0));
        let whole = reciprocal(((b[0] + b[1]) + (b[2] + b[3])).max(1.0));
        b.map(|b| b * whole)
    }

    /// The normal of sample k, which lies in `stand`. The first one behind a surface, or behind what is transparent, has that of the place where the ray
    /// enters its tetrahedron, and behind a clip that of the cut: at various depths, even surfaces would have rings.
    fn lit_at(&self, gathered: &Gathered<'_>, ray: ([f32; 3], [f32; 3]), k: u32, (stand, here): (&Stand, &Sides), joins: bool) -> [f32; 3] {
        let at = k as f32 + 0.5;
        if joins {
            return self.plan.beside_cut(at, gathered.normal_at(stand, here.barycentric()), gathered.kept);
        }
        let ([from, _], cut) = gathered.kept;
        if let Some(&[x, y, z, _]) = cut.and_then(|i| self.plan.clips.get(i)).filter(|_| at - from < 1.0) {
            return [x, y, z];
        }
        let next = stand.sides(self.scene.tree.grid.normalise(self.plan.sample(ray, k + 1)));
        let behind = [0, 1, 2, 3].map(|f| here.w[f] - (next.w[f] - here.w[f]));
        let entry = (at - way_within(here.w, behind)).max(from);
        self.plan.beside_cut(entry, gathered.normal_at(stand, self.barycentric_at(ray, stand, entry)), gathered.kept)
    }

    /// Adds the surfaces between two places of the ray, between which the value is linear, but for those beyond a clip or a depth.
    /// Light takes them to lie in `stand`.
    fn add_surfaces(&self, gathered: &mut Gathered<'_>, ray: ([f32; 3], [f32; 3]), [from, to]: [Place; 2], stand: &Stand) {
        let plan = self.plan;
        let (kept, _) = gathered.kept;
        let n = plan.iso.len();
        let in_order = (0..n).map(|i| plan.iso[if from.value < to.value { i } else { n - 1 - i }]);
        for iso in in_order.filter(|&iso| (from.value < iso) != (to.value < iso)) {
            if gathered.opaque_at.is_some() {
                break;
            }
            let rise = (to.value - from.value).clamp(-1e37, 1e37);
            let part = if canonical(rise) == 0.0 { 1.0 } else { ((iso - from.value) * reciprocal(rise)).clamp(0.0, 1.0) };
            let steps = from.at + (to.at - from.at) * part;
            if steps < kept[0] || steps > kept[1] {
                continue;
            }
            let color = plan.lookup(iso);
            if color[3] > 0.0 {
                let normal =
                    if gathered.light.is_some() { gathered.normal_at(stand, self.barycentric_at(ray, stand, steps)) } else { [0.0; 3] };
                gathered.add(steps, color, normal);
            }
        }
    }

    /// The tetrahedron of a point, and the point's weights there. A walk across faces from the last tetrahedron
    /// is tried first. A tetrahedron that contains the point clearly is the owner in a mesh whose tetrahedra do not
    /// overlap. If the walk does not find one, the tree is searched, except outside of the bounds.
    fn locate(&mut self, p: [f32; 3]) -> Option<(Stand, Sides)> {
        let (walker, grid) = (self.scene.locator.walker(), &self.scene.tree.grid);
        let x = grid.normalise(p);
        let found = self.cell.and_then(|cell| walker.stride(cell, x, WALK)).or_else(|| {
            (0..3).all(|c| 0.0 <= x[c] && x[c] <= grid.extent[c]).then_some(())?;
            let stand = walker.stand_in(self.scene.locator.locate(p).found()?)?;
            Some((stand, stand.sides(x)))
        });
        self.cell = found.map(|(stand, _)| stand.t);
        found
    }
}

/// How far a straight way stays in a tetrahedron: the part of it, at most 1, from a point in the tetrahedron, whose
/// weights are `here`, to one whose weights are `there`.
fn way_within(here: [f32; 4], there: [f32; 4]) -> f32 {
    (0..4).filter(|&f| there[f] < 0.0).fold(1.0, |least, f| {
        let part = way_before(here[f], there[f]);
        if part < least { part } else { least }
    })
}
