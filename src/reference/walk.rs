//! Walking to a point across shared faces (SPEC 2.6). Twin of `glsl/shared/walk.glsl`.
//!
//! A walk goes to a point x of a cell that is full of mesh, from the cell's seed.
//! 1. **Through the face that says outside most.** The cheapest step; ends nearly always where x is. It may circle, or leave the mesh.
//! 2. **Straight on** from the cell's centre to x: through the face that the segment meets first. The cell is a box without surface, so the segment
//!    crosses interior faces only, and each of them nearer to x than the one before. Rounding can still mislead where it meets an edge, so
//! 3. the same again by way of other points of the cell, whose two segments meet other edges.
//!
//! Before all that, a *stride*: part 1 without a look at anything but cells that hold x clearly, as most points are held, or on one of their faces.
//!
//! Each part is bounded. Where all of them fail, the best of the tetrahedra in which they ended is the answer: no point is lost. A walk that comes
//! near to x ends with the *star* of x: the tetrahedra reached across faces that x is so near to that rounding could put it on either side. The
//! owner is chosen among them, so it does not depend on the way.

use super::boundary::NONE;
use super::candidates::Best;
use super::grid::{reciprocal, two_to};
use super::tet::{Bounds, Sides, Tet, Vec3, Weights, least_of, sides_of};
use crate::mesh::{Field, Mesh, On};

/// Most tetrahedra of a star.
pub const STAR: usize = 128;
/// Most steps of part 1.
pub const STEPS: u32 = 512;
/// Most steps of a stride from a hint.
pub const HINTED: u32 = 16;
/// Most steps of a stride through a leaf.
pub const STRIDE: u32 = 64;
/// Most steps along one segment.
pub const LEG: u32 = 1024;
/// Points to go by, the first being x itself.
pub const DETOURS: u32 = 8;
/// Stars that part 1 looks at: the second is that of the same gap between faces, or x is not there.
const ARRIVALS: u32 = 2;
/// With a smallest barycentric coordinate of at least this (−2^-17), x lies in a gap of rounding between cells, and the nearest owns it.
const GAP: f32 = -two_to(-17);

/// Cell of a leaf in normalised coordinates.
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
    /// The owner, or the nearest.
    pub best: Best,
    /// Tetrahedra passed.
    pub steps: u32,
    /// Points gone by, 0 if the first part was enough.
    pub detours: u32,
}

/// The tetrahedron that a stride stands in, its corners in ascending index, so that what is worked out of them does not depend on the way.
#[derive(Clone, Copy, Debug)]
pub struct Stand {
    /// Its number.
    pub t: u32,
    /// Its vertices in the caller's order.
    cell: [u32; 4],
    /// Its vertices ascending.
    pub ids: [u32; 4],
    v: [Vec3; 4],
}

impl Stand {
    /// The value of a field in it, at barycentric coordinates in ascending index of the corners.
    pub fn value(&self, field: &Field, b: [f32; 4]) -> f32 {
        match field.on {
            On::Points => weighed(b, self.ids.map(|i| field.values[i as usize])),
            On::Cells => field.values[self.t as usize],
        }
    }

    /// The sides of x on which its faces lie.
    pub fn sides(&self, x: Vec3) -> Sides {
        sides_of(self.v, &Bounds::new(self.v), x)
    }
}

/// What has these values at the corners, at barycentric coordinates.
pub fn weighed(b: [f32; 4], v: [f32; 4]) -> f32 {
    (b[0] * v[0] + b[1] * v[1]) + (b[2] * v[2] + b[3] * v[3])
}

/// The face that says outside most.
pub fn outermost(own: [f32; 4]) -> usize {
    (1..4).fold(0, |face, f| if own[f] < own[face] { f } else { face })
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

    /// Visits the star of x in a tetrahedron near to it, until `visit` returns true.
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

    /// Looks for the owner in the star of x; whether it is settled.
    fn arrive(&self, t: u32, x: Vec3, best: &mut Best) -> bool {
        self.star(t, x, |t, tet, weights| {
            best.consider(t, tet, weights);
            false
        });
        best.inside || (best.in_box && best.smallest >= GAP)
    }

    /// Stands in a tetrahedron, if there is one of that number.
    pub fn stand_in(&self, t: u32) -> Option<Stand> {
        let cell = *self.mesh.tets.get(t as usize)?;
        let mut ids = cell;
        ids.sort_unstable();
        Some(Stand { t, cell, ids, v: ids.map(|id| self.normalised[id as usize]) })
    }

    /// The tetrahedron behind the face that says outside most.
    fn step_on(&self, from: &Stand, at: &Sides) -> Option<Stand> {
        let face = outermost(at.w);
        let place = from.cell.iter().position(|&id| id == from.ids[face])?;
        (at.w[face] < 0.0).then(|| self.stand_in(self.neighbours[from.t as usize][place])).flatten()
    }

    /// Goes from `t` to the tetrahedron that holds x clearly, if it is not far.
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

    /// The owner of x near to a face of the stand, if it is far from all other faces of the two beside that one.
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
        // The face weighs the same from either side.
        let shared = there.near_one_face() && least_of(there.w) == -least_of(here.w);
        let own = here.inside && (!there.inside || stand.t < u);
        (shared && (own || there.inside)).then_some(if own { stand.t } else { u })
    }

    /// Goes from `t` towards x, to its owner if that is not far, and if x does not lie near an edge.
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

    /// Part 1, from `t`; whether the owner is settled.
    fn towards(&self, mut t: u32, x: Vec3, walked: &mut Walked) -> bool {
        let mut arrivals = 0;
        for _ in 0..STEPS {
            walked.steps += 1;
            let (tet, weights) = self.weights(t, x);
            if weights.clear {
                walked.best = Best::inside(t);
                return true;
            }
            if weights.near() {
                arrivals += 1;
                if self.arrive(t, x, &mut walked.best) || arrivals == ARRIVALS {
                    break;
                }
            }
            let own = tet.rank.map(|r| weights.w[r]);
            let face = outermost(own);
            let next = self.neighbours[t as usize][face];
            if own[face] >= 0.0 || next == NONE {
                break;
            }
            t = next;
        }
        walked.best.inside || (walked.best.in_box && walked.best.smallest >= GAP)
    }

    /// Straight on from `a`, which lies in `t`, to `b`: where the segment ends.
    fn leg(&self, mut t: u32, a: Vec3, b: Vec3, walked: &mut Walked) -> u32 {
        let mut from = NONE;
        for _ in 0..LEG {
            walked.steps += 1;
            let (tet, at_b) = self.weights(t, b);
            let at_a = tet.weights(a);
            let (mut first, mut next) = (f32::MAX, NONE);
            for (&rank, &u) in tet.rank.iter().zip(&self.neighbours[t as usize]) {
                let (before, behind) = (at_a.w[rank].max(0.0), at_b.w[rank]);
                if behind < 0.0 && u != from {
                    // Where the segment meets the face, from 0 at a to 1 at b.
                    let at = before * reciprocal(before - behind);
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

    /// Walks to a point x of a cell that is full of mesh, from its seed.
    pub fn walk(&self, seed: u32, room: &LeafCell, x: Vec3) -> Walked {
        let mut walked = Walked::default();
        if self.towards(seed, x, &mut walked) {
            return walked;
        }
        for k in 0..DETOURS {
            walked.detours += 1;
            let by = room.point(k);
            let t = if k == 0 { seed } else { self.leg(seed, room.centre, by, &mut walked) };
            let t = self.leg(t, by, x, &mut walked);
            if self.arrive(t, x, &mut walked.best) {
                break;
            }
        }
        walked
    }
}

impl LeafCell {
    /// Point number `k` of the cell, the first its centre.
    fn point(&self, k: u32) -> Vec3 {
        [0, 1, 2].map(|c| {
            // Anywhere in the cell, by Fibonacci hashing.
            let part = ((3 * k + c as u32).wrapping_mul(0x9e37_79b9) >> 8) as f32 * two_to(-23) - 1.0;
            let away = if k == 0 { 0.0 } else { part };
            let at = self.centre[c] + self.half[c] * away;
            (at * two_to(42)).floor() * two_to(-42)
        })
    }
}
