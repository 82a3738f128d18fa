//! Stage 2: the cells that list each tetrahedron, as Morton codes, and their order (SPEC 2.2, the paper's Eq. 6). Twin
//! of `glsl/build/2*`.

use super::assign::{Filter, centre_of, half_cell};
use super::boundary::Topology;
use super::marks::{Marks, owns_centre};
use super::sort::sort_pairs;
use super::vertices::Vertices;
use super::walk::Walker;
use crate::error::{Error, Result};
use crate::grid::{Grid, morton};
use crate::mesh::Mesh;
use crate::options::Assign;
use rayon::prelude::*;
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

/// Tetrahedra per task.
const CHUNK: usize = 1 << 14;

/// Entries, each a code and a tetrahedron, in one order.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Entries {
    /// Morton code of each entry's cell, at the level of the leaves.
    pub codes: Vec<u32>,
    /// Tetrahedron of each entry.
    pub primitives: Vec<u32>,
}

/// The inputs of this stage.
#[derive(Clone, Copy, Debug)]
pub struct Stage<'a> {
    /// The mesh.
    pub mesh: &'a Mesh,
    /// Its topology.
    pub topology: &'a Topology,
    /// Its vertices in `grid`.
    pub vertices: &'a Vertices,
    /// The grid, at the level of the leaves.
    pub grid: &'a Grid,
    /// The assignment.
    pub assign: Assign,
    /// With `Lists::Boundary`, the cells that the boundary touches.
    pub marks: Option<&'a Marks>,
}

impl Stage<'_> {
    /// Visits the cells that list tetrahedron `tet`, in the order of its candidates; none if it is bad.
    pub fn each_cell(&self, tet: u32, visit: impl FnMut([u32; 3])) {
        if !self.topology.is_valid(tet) {
            return;
        }
        let cells = self.vertices.cells(self.mesh.tets[tet as usize], self.grid.level).iter();
        if self.boxes() {
            cells.for_each(visit);
        } else {
            let listed = self.lists(tet);
            cells.filter(|&cell| listed(cell)).for_each(visit);
        }
    }

    /// Whether every candidate of a tetrahedron lists it.
    fn boxes(&self) -> bool {
        self.assign == Assign::Aabb && self.marks.is_none()
    }

    /// A predicate on the candidates of the valid tetrahedron `tet`: whether they list it.
    pub fn lists(&self, tet: u32) -> impl Fn([u32; 3]) -> bool {
        let primitive = self.vertices.tet(self.mesh.tets[tet as usize]);
        let (grid, assign) = (self.grid, self.assign);
        let filter_of = move |cell| Filter::new(&primitive, grid, half_cell(grid, grid.level, cell), assign);
        let of_all = (grid.graded == 0).then(|| filter_of([0; 3]));
        let walker = Walker { mesh: self.mesh, neighbours: &self.topology.neighbours, normalised: &self.vertices.normalised };
        let inner = !self.topology.is_boundary(tet);
        move |cell| match self.marks {
            Some(marks) if !marks.contains(cell) => inner && owns_centre(&walker, tet, &primitive, centre_of(grid, grid.level, cell)),
            _ => of_all.as_ref().unwrap_or(&filter_of(cell)).touches(centre_of(grid, grid.level, cell)),
        }
    }

    /// Number of entries of each tetrahedron.
    pub fn count(&self) -> Vec<u32> {
        let count = |tet: usize| {
            let mut n = 0;
            if self.boxes() && self.topology.is_valid(tet as u32) {
                n = self.vertices.cells(self.mesh.tets[tet], self.grid.level).count();
            } else {
                self.each_cell(tet as u32, |_| n += 1);
            }
            n
        };
        (0..self.mesh.tets.len()).into_par_iter().map(count).collect()
    }

    /// Writes all entries, by tetrahedron and for one tetrahedron in the order of its candidates. `counts` is the
    /// result of [`Stage::count`].
    ///
    /// # Errors
    /// [`Error::TooLarge`] if 32 bits cannot count them.
    pub fn emit(&self, counts: &[u32]) -> Result<Entries> {
        let total: u64 = counts.par_iter().map(|&n| u64::from(n)).sum();
        if total > u64::from(u32::MAX) {
            return Err(Error::TooLarge(format!("{total} entries, 32-bit offsets end at {}", u32::MAX)));
        }
        let mut entries = Entries { codes: vec![0; total as usize], primitives: vec![0; total as usize] };
        let (mut codes, mut primitives) = (entries.codes.as_mut_slice(), entries.primitives.as_mut_slice());
        let mut tasks = Vec::new();
        for (i, counts) in counts.chunks(CHUNK).enumerate() {
            let n = counts.iter().map(|&n| n as usize).sum();
            let (c, p);
            (c, codes) = codes.split_at_mut(n);
            (p, primitives) = primitives.split_at_mut(n);
            tasks.push((i * CHUNK, counts.len(), c, p));
        }
        tasks.into_par_iter().for_each(|(first, n, codes, primitives)| {
            let mut slots = codes.iter_mut().zip(primitives);
            for tet in (first..first + n).map(|t| t as u32) {
                self.each_cell(tet, |cell| {
                    if let Some((code, primitive)) = slots.next() {
                        (*code, *primitive) = (morton(cell), tet);
                    }
                });
            }
        });
        Ok(entries)
    }
}

impl Marks {
    /// Marks the cells that boundary tetrahedra of a stage touch.
    pub fn new(stage: &Stage<'_>) -> Self {
        let words: Vec<AtomicU32> = (0..(1usize << (3 * stage.grid.level)).div_ceil(32)).map(|_| AtomicU32::new(0)).collect();
        let all = Stage { marks: None, ..*stage };
        (0..stage.mesh.tets.len() as u32).into_par_iter().filter(|&t| stage.topology.is_boundary(t)).for_each(|t| {
            all.each_cell(t, |cell| {
                let code = morton(cell);
                words[(code / 32) as usize].fetch_or(1 << (code % 32), Relaxed);
            });
        });
        Self(words.into_iter().map(AtomicU32::into_inner).collect())
    }
}

impl Entries {
    /// Sorts the entries by code, and those of one code by tetrahedron (the sort is stable, and the entries come in
    /// order of tetrahedra).
    #[must_use]
    pub fn sorted(self, level: u32) -> Self {
        let (codes, primitives) = sort_pairs(self.codes, self.primitives, 3 * level);
        Self { codes, primitives }
    }
}
