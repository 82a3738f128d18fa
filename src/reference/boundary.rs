//! Topology of a mesh: bad tetrahedra, neighbours across faces, boundary tetrahedra, bounds (SPEC 2.3). Twin of
//! `glsl/build/0*`.

use super::corners::crowded_vertices;
use super::tet::Tet;
use crate::error::{Error, Result};
use crate::grid::Grid;
use crate::layout::{NONE, bit};
use crate::mesh::{Fault, Mesh, fault_of, grid_of, words};
use rayon::prelude::*;
use std::sync::atomic::{AtomicU32, Ordering};

/// Numbers of tetrahedra of a mesh by kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// All tetrahedra, including bad ones.
    pub cells: u32,
    /// Bad tetrahedra, which are left out of every structure; see [`Fault`].
    pub bad: u32,
    /// Boundary tetrahedra: flat, without neighbour across a face, at a fold, or at a crowded vertex.
    pub boundary: u32,
    /// Tetrahedra of negative signed volume in the caller's order of vertices.
    pub negative: u32,
    /// Tetrahedra of zero volume.
    pub flat: u32,
    /// Crowded vertices; see [`super::corners`].
    pub crowded: u32,
    /// Faces that more than two valid tetrahedra share, none of which are neighbours there.
    pub branched: u32,
}

/// Topology of a mesh, computed before any tree is built over it.
#[derive(Clone, Debug, PartialEq)]
pub struct Topology {
    /// For each tetrahedron, the neighbour across the face opposite to each vertex in the caller's order; [`NONE`]
    /// unless exactly two valid tetrahedra share the face.
    pub neighbours: Vec<[u32; 4]>,
    /// One bit per tetrahedron (bit t % 32 of word t / 32), set for boundary tetrahedra.
    pub boundary: Vec<u32>,
    /// One bit per tetrahedron, set for those that are not bad.
    pub valid: Vec<u32>,
    /// Grid over the bounds of the vertices that valid tetrahedra use, at the finest level.
    pub grid: Grid,
    /// Numbers of tetrahedra by kind.
    pub counts: Counts,
    /// The bad tetrahedra in ascending order, each with the first fault found.
    pub bad: Vec<(u32, Fault)>,
}

impl Topology {
    /// Determines bad tetrahedra, bounds and grid only: no neighbours, no boundary.
    ///
    /// # Errors
    /// As [`topology`].
    pub fn bare(mesh: &Mesh) -> Result<Self> {
        if mesh.tets.len() >= (u32::MAX / 4) as usize || mesh.points.len() >= u32::MAX as usize {
            let (tets, points) = (mesh.tets.len(), mesh.points.len());
            return Err(Error::TooLarge(format!("{tets} tetrahedra on {points} points; at most 2^30 and 2^32 can be indexed")));
        }
        let bad: Vec<_> = (0..mesh.tets.len() as u32).into_par_iter().filter_map(|t| Some((t, fault_of(mesh, t)?))).collect();
        let valid = words(mesh.tets.len(), &|t| bad.binary_search_by_key(&t, |b| b.0).is_err());
        let counts = Counts { cells: mesh.tets.len() as u32, bad: bad.len() as u32, ..Counts::default() };
        let grid = grid_of(mesh, &valid);
        Ok(Self { neighbours: Vec::new(), boundary: Vec::new(), valid, grid, counts, bad })
    }

    /// Whether tetrahedron `tet` is valid, that is, part of every structure.
    pub fn is_valid(&self, tet: u32) -> bool {
        bit(&self.valid, tet)
    }

    /// Whether `tet` is a boundary tetrahedron.
    pub fn is_boundary(&self, tet: u32) -> bool {
        bit(&self.boundary, tet)
    }

    /// Number of valid tetrahedra.
    pub fn valid_cells(&self) -> u32 {
        self.counts.cells - self.counts.bad
    }
}

/// Computes the topology of `mesh`. Bad tetrahedra are counted and listed; they are never an error.
///
/// # Errors
/// [`Error::TooLarge`] if the faces of the mesh, or its points, do not fit 32-bit indices.
pub fn topology(mesh: &Mesh) -> Result<Topology> {
    let Topology { valid, grid, bad, counts, .. } = Topology::bare(mesh)?;
    let (neighbours, branched) = neighbours(mesh, &valid);
    let normalised: Vec<_> = mesh.points.par_iter().map(|&p| grid.normalise(p)).collect();
    let signs: Vec<Signs> = mesh.tets.par_iter().enumerate().map(|(t, &ids)| Signs::new(bit(&valid, t as u32), ids, &normalised)).collect();
    let crowded = crowded_vertices(mesh, &grid, &valid);
    let at_crowded = |t: u32| !crowded.is_empty() && mesh.tets[t as usize].iter().any(|v| crowded.binary_search(v).is_ok());
    let is_boundary = |t: u32| bit(&valid, t) && (on_boundary(mesh, &neighbours, &signs, t) || at_crowded(t));
    let boundary = words(mesh.tets.len(), &is_boundary);
    let count = |pick: fn(&Signs) -> bool| signs.par_iter().filter(|s| pick(s)).count() as u32;
    let counts = Counts {
        boundary: boundary.iter().map(|w| w.count_ones()).sum(),
        negative: count(|s| s.caller < 0),
        flat: count(|s| s.valid && s.sorted == 0),
        crowded: crowded.len() as u32,
        branched,
        ..counts
    };
    Ok(Topology { neighbours, boundary, valid, grid, counts, bad })
}

/// The vertices of face `i` (opposite to vertex `i`) in ascending order.
fn face(ids: [u32; 4], i: usize) -> [u32; 3] {
    let mut face = [ids[usize::from(i == 0)], ids[1 + usize::from(i <= 1)], ids[2 + usize::from(i <= 2)]];
    face.sort_unstable();
    face
}

/// The neighbours across faces, and the number of faces that more than two tetrahedra share. Faces are bucketed by their
/// smallest vertex, and equal faces are matched within a bucket.
pub(crate) fn neighbours(mesh: &Mesh, valid: &[u32]) -> (Vec<[u32; 4]>, u32) {
    let faces_of = |t: usize| (0..4).map(move |i| (4 * t + i, face(mesh.tets[t], i)[0] as usize));
    let valid_tets = || (0..mesh.tets.len()).filter(|&t| bit(valid, t as u32));
    let mut ends = vec![0u32; mesh.points.len() + 1];
    for (_, v) in valid_tets().flat_map(faces_of) {
        ends[v + 1] += 1;
    }
    for v in 1..ends.len() {
        ends[v] += ends[v - 1];
    }
    // Filling moves each bucket's start to its end.
    let mut slots = vec![0u32; *ends.last().unwrap_or(&0) as usize];
    for (slot, v) in valid_tets().flat_map(faces_of) {
        slots[ends[v] as usize] = slot as u32;
        ends[v] += 1;
    }
    let partner: Vec<[AtomicU32; 4]> = mesh.tets.par_iter().map(|_| [NONE; 4].map(AtomicU32::new)).collect();
    let branched = AtomicU32::new(0);
    let set = |slot: u32, tet: u32| partner[slot as usize / 4][slot as usize % 4].store(tet, Ordering::Relaxed);
    (0..mesh.points.len()).into_par_iter().with_min_len(1024).for_each_init(Vec::new, |bucket, v| {
        let begin = if v == 0 { 0 } else { ends[v - 1] };
        let key = |&slot: &u32| {
            let [_, b, c] = face(mesh.tets[slot as usize / 4], slot as usize % 4);
            (b, c, slot)
        };
        bucket.clear();
        bucket.extend(slots[begin as usize..ends[v] as usize].iter().map(key));
        bucket.sort_unstable();
        for same in bucket.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            match same {
                [_] => {}
                [a, b] => {
                    set(a.2, b.2 / 4);
                    set(b.2, a.2 / 4);
                }
                _ => _ = branched.fetch_add(1, Ordering::Relaxed),
            }
        }
    });
    (partner.into_par_iter().map(|p| p.map(AtomicU32::into_inner)).collect(), branched.into_inner())
}

/// Signs of a tetrahedron's volume; 0 for bad tetrahedra.
#[derive(Clone, Copy)]
struct Signs {
    valid: bool,
    /// Sign with the vertices in ascending order of index.
    sorted: i8,
    /// Sign with the vertices in the caller's order: `sorted` times the parity of that order.
    caller: i8,
}

impl Signs {
    fn new(valid: bool, ids: [u32; 4], normalised: &[[f32; 3]]) -> Self {
        if !valid {
            return Self { valid, sorted: 0, caller: 0 };
        }
        let tet = Tet::new(ids, normalised);
        let volume = tet.volume();
        let sorted = i8::from(volume > 0.0) - i8::from(volume < 0.0);
        let inversions = (0..4).flat_map(|j| (0..j).map(move |i| (i, j))).filter(|&(i, j)| tet.rank[i] > tet.rank[j]).count();
        Self { valid, sorted, caller: if inversions % 2 == 0 { sorted } else { -sorted } }
    }
}

/// The side of a face (with its vertices ascending) on which the opposite vertex, of rank `rank`, lies; 0 for flat
/// tetrahedra.
fn side(signs: Signs, rank: usize) -> i8 {
    if rank % 2 == 1 { signs.sorted } else { -signs.sorted }
}

/// Whether a valid tetrahedron is boundary: flat, without neighbour across a face, or on the same side of a face as its
/// neighbour (a fold).
fn on_boundary(mesh: &Mesh, neighbours: &[[u32; 4]], signs: &[Signs], t: u32) -> bool {
    let ids = mesh.tets[t as usize];
    let mine = signs[t as usize];
    let rank = |ids: [u32; 4], vertex: u32| ids.iter().filter(|&&other| other < vertex).count();
    mine.sorted == 0
        || (0..4).any(|i| {
            let n = neighbours[t as usize][i];
            if n == NONE {
                return true;
            }
            let theirs = mesh.tets[n as usize];
            let shared = face(ids, i);
            let opposite = theirs.into_iter().find(|v| !shared.contains(v)).unwrap_or(NONE);
            // A flat neighbour has side 0, so it never equals this side; it is boundary itself.
            side(mine, rank(ids, ids[i])) == side(signs[n as usize], rank(theirs, opposite))
        })
}
