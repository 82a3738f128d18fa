//! Walks to a point across shared faces (SPEC 2.6). Twin of `glsl/shared/walk.glsl`.
//!
//! A walk leads to a point x in a leaf's cell that lies entirely within the mesh, starting at the leaf's seed. It has
//! up to three parts:
//! 1. **Through the outermost face**, the one with the most negative weight of x. This is the cheapest step, and nearly
//!    always leads to x, but it may go in circles or leave the mesh.
//! 2. **Straight on** from the cell's centre to x, through the face that the segment meets first. The mesh has no
//!    surface in the cell, so the segment crosses interior faces only, each of them nearer to x than the one before.
//!    Rounding can still mislead this walk where the segment meets an edge.
//! 3. **By detours**: part 2 by way of other points of the cell, so that the two segments meet other edges.
//!
//! A *stride* is tried before all that. It takes the steps of part 1, but ends only in a tetrahedron that contains x
//! clearly, as is the case for most points, or at one of its faces.
//!
//! Each part is bounded. If all of them fail, the best of the tetrahedra in which they ended is the answer, so no point
//! is lost. A walk that comes near x ends with the *star* of x: the tetrahedra reached across faces that are so near x
//! that rounding could put it on either side. The owner is chosen among them, so it does not depend on the way taken.

use super::best_owner::Best;
use super::tet::{Bounds, Sides, Tet, Vec3, Weights, least_of, sides_of};
use crate::grid::{per_axis, reciprocal, two_to};
use crate::layout::NONE;
use crate::layout::constants::walk::{self as constants, GAP, ROUND};
use crate::mesh::{Field, Mesh, On};

pub use crate::layout::constants::walk::{DETOURS, HINTED, LEG, STEPS, STRIDE};

/// Most tetrahedra of a star. A vertex of more is crowded, and never walked to; see [`super::corners`].
pub const STAR: usize = constants::STAR as usize;

/// The cell of a leaf in normalised coordinates.
#[derive(Clone, Copy, Debug)]
pub struct LeafCell {
    /// Centre.
    pub centre: Vec3,
    /// Half the size.
    pub half: Vec3,
}

/// How a walk ended.
#[derive(Clone, Copy, Debug, Default)]
pub struct Walked {
    /// The owner, or the nearest tetrahedron.
    pub best: Best,
    /// Number of tetrahedra passed.
    pub steps: u32,
    /// Number of points of the cell gone by; 0 if part 1 was sufficient.
    pub detours: u32,
}

/// The tetrahedron in which a stride currently is. Its vertices are in ascending index, so that what is computed from
/// them does not depend on the way taken.
#[derive(Clone, Copy, Debug)]
pub struct Stand {
    /// Number of the tetrahedron.
    pub t: u32,
    /// Its vertices in the caller's order.
    cell: [u32; 4],
    /// Its vertices in ascending index.
    pub ids: [u32; 4],
    v: [Vec3; 4],
}

impl Stand {
    /// The value of a field at barycentric coordinates `b`, given in ascending index of the vertices.
    pub fn value(&self, field: &Field, b: [f32; 4]) -> f32 {
        match field.on {
            On::Points => weighed(b, self.ids.map(|i| field.values[i as usize])),
            On::Cells => field.values[self.t as usize],
        }
    }

    /// The weights of x in this tetrahedron.
    pub fn sides(&self, x: Vec3) -> Sides {
        sides_of(self.v, &Bounds::new(self.v), x)
    }
}

/// Interpolates the values `v` at the vertices to barycentric coordinates `b`.
pub fn weighed(b: [f32; 4], v: [f32; 4]) -> f32 {
    let beside = per_axis(|k| v[k] - v[3]);
    ((b[0] * beside[0] + b[1] * beside[1]) + b[2] * beside[2]) + v[3]
}

/// The outermost face: the one with the smallest weight, the first of several.
pub fn outermost(own: [f32; 4]) -> usize {
    (1..4).fold(0, |face, f| if own[f] < own[face] { f } else { face })
}

/// The part of a straight way that lies before a face, whose weight is `here` at the start and `there`, below 0, at the
/// end.
pub fn way_before(here: f32, there: f32) -> f32 {
    let from = here.max(0.0);
    from * reciprocal(from - there)
}

/// Walks through one mesh.
#[derive(Clone, Copy, Debug)]
pub struct Walker<'a> {
    /// The mesh.
    pub mesh: &'a Mesh,
    /// Its neighbours.
    pub neighbours: &'a [[u32; 4]],
    /// Its normalised points.
    pub normalised: &'a [Vec3],
}

impl Walker<'_> {
    fn weights(&self, t: u32, x: Vec3) -> (Tet, Weights) {
        let tet = Tet::new(self.mesh.tets[t as usize], self.normalised);
        (tet, tet.weights(x))
    }

    /// Visits the star of x, starting with `first`, a tetrahedron near x, until `visit` returns true.
    pub fn star(&self, first: u32, x: Vec3, mut visit: impl FnMut(u32, &Tet, &Weights) -> bool) {
        let mut star = vec![first];
        let mut next = 0;
        while let Some(&t) = star.get(next) {
            next += 1;
            let (tet, weights) = self.weights(t, x);
            if visit(t, &tet, &weights) {
                return;
            }
            for (rank, &u) in tet.rank.iter().zip(&self.neighbours[t as usize]) {
                let beside = weights.w[*rank] <= weights.margin && u != NONE;
                if beside && star.len() < STAR && !star.contains(&u) && self.weights(u, x).1.near() {
                    star.push(u);
                }
            }
        }
    }

    /// Searches the star of x for the owner, and returns whether it is settled.
    fn arrive(&self, t: u32, x: Vec3, best: &mut Best) -> bool {
        self.star(t, x, |t, tet, weights| {
            best.consider(t, tet, weights);
            false
        });
        best.inside || (best.in_box && best.smallest >= GAP)
    }

    /// A stand in tetrahedron `t`, if it exists.
    pub fn stand_in(&self, t: u32) -> Option<Stand> {
        let cell = *self.mesh.tets.get(t as usize)?;
        let mut ids = cell;
        ids.sort_unstable();
        Some(Stand { t, cell, ids, v: ids.map(|id| self.normalised[id as usize]) })
    }

    /// The tetrahedron on the other side of the outermost face; `None` if x is not outside of a face or there is no
    /// neighbour.
    fn step_on(&self, from: &Stand, at: &Sides) -> Option<Stand> {
        let face = outermost(at.w);
        let place = from.cell.iter().position(|&id| id == from.ids[face])?;
        (at.w[face] < 0.0).then(|| self.stand_in(self.neighbours[from.t as usize][place])).flatten()
    }

    /// Steps from `t` to the tetrahedron that contains x clearly; `None` if the first `most` tetrahedra do not include
    /// it.
    pub fn stride(&self, t: u32, x: Vec3, most: u32) -> Option<(Stand, Sides)> {
        let mut stand = self.stand_in(t)?;
        for _ in 0..most {
            let at = stand.sides(x);
            if at.clear {
                return Some((stand, at));
            }
            stand = self.step_on(&stand, &at)?;
        }
        None
    }

    /// The owner of x, which is near a face of the stand, if in both tetrahedra at this face x is well inside of all
    /// other faces.
    fn owner_at_face(&self, stand: &Stand, x: Vec3) -> Option<u32> {
        let (tet, here) = self.weights(stand.t, x);
        if !here.near_one_face() {
            return None;
        }
        let u = self.neighbours[stand.t as usize][outermost(tet.rank.map(|r| here.w[r]))];
        if u == NONE {
            return None;
        }
        let there = self.weights(u, x).1;
        // The weight of the shared face is the same from either side, except for its sign.
        let shared = there.near_one_face() && least_of(there.w) == -least_of(here.w);
        let own = here.inside && (!there.inside || stand.t < u);
        (shared && (own || there.inside)).then_some(if own { stand.t } else { u })
    }

    /// Steps from `t` to the owner of x; `None` if the first `most` tetrahedra do not lead to it, or if x is near an
    /// edge.
    pub fn stride_to(&self, t: u32, x: Vec3, most: u32) -> Option<u32> {
        let mut stand = self.stand_in(t)?;
        for _ in 0..most {
            let at = stand.sides(x);
            if at.clear || at.near {
                return if at.clear { Some(stand.t) } else { self.owner_at_face(&stand, x) };
            }
            stand = self.step_on(&stand, &at)?;
        }
        None
    }

    /// Part 1, from `t`. Returns whether the owner is settled.
    fn towards(&self, mut t: u32, x: Vec3, walked: &mut Walked) -> bool {
        let (mut arrived, mut step) = (false, 0);
        while step < STEPS {
            walked.steps += 1;
            let (tet, weights) = self.weights(t, x);
            if weights.clear {
                walked.best = Best::inside(t);
                return true;
            }
            let is_there = if arrived { weights.inside } else { weights.near() };
            if is_there {
                self.arrive(t, x, &mut walked.best);
                if walked.best.inside {
                    break;
                }
                arrived = true;
                step = step.max(STEPS - ROUND);
            }
            let own = tet.rank.map(|r| weights.w[r]);
            let face = outermost(own);
            let next = self.neighbours[t as usize][face];
            if own[face] >= 0.0 || next == NONE {
                break;
            }
            t = next;
            step += 1;
        }
        walked.best.inside || (walked.best.in_box && walked.best.smallest >= GAP)
    }

    /// Walks along the segment from `a`, which lies in `t`, to `b`. Returns the tetrahedron in which it ends, or the last
    /// one before it leaves the mesh.
    fn leg(&self, mut t: u32, a: Vec3, b: Vec3, walked: &mut Walked) -> u32 {
        let mut from = t;
        for _ in 0..LEG {
            walked.steps += 1;
            let (tet, at_b) = self.weights(t, b);
            let at_a = tet.weights(a);
            let (mut first, mut next) = (f32::MAX, NONE);
            for (&rank, &u) in tet.rank.iter().zip(&self.neighbours[t as usize]) {
                if at_b.w[rank] < 0.0 && u != from {
                    let at = way_before(at_a.w[rank], at_b.w[rank]);
                    if at < first {
                        (first, next) = (at, u);
                    }
                }
            }
            if next == NONE {
                break;
            }
            (from, t) = (t, next);
        }
        t
    }

    /// Walks to a point x of the cell `cell`, which lies entirely within the mesh, from the leaf's seed.
    pub fn walk(&self, seed: u32, cell: &LeafCell, x: Vec3) -> Walked {
        let mut walked = Walked::default();
        if self.towards(seed, x, &mut walked) {
            return walked;
        }
        for k in 0..DETOURS {
            walked.detours += 1;
            let by = cell.point(k);
            let t = if k == 0 { seed } else { self.leg(seed, cell.centre, by, &mut walked) };
            let t = self.leg(t, by, x, &mut walked);
            if self.arrive(t, x, &mut walked.best) {
                break;
            }
        }
        walked
    }
}

impl LeafCell {
    /// Point number `k` of the cell; number 0 is the centre.
    fn point(&self, k: u32) -> Vec3 {
        per_axis(|c| {
            // A pseudorandom place in the cell, by Fibonacci hashing.
            let part = ((3 * k + c as u32).wrapping_mul(0x9e37_79b9) >> 8) as f32 * two_to(-23) - 1.0;
            let away = if k == 0 { 0.0 } else { part };
            let at = self.centre[c] + self.half[c] * away;
            (at * two_to(42)).floor() * two_to(-42)
        })
    }
}
