//! The surface of a cell that is split around a point in its middle.

use super::super::cells::cut;

/// How much of a cell's volume its pieces may overlap by before it counts as tangled: the rounded coordinates of a file
/// leave triangles along straight sides, whose pieces have a little volume of either sign.
const OVERLAP: f64 = 1e-3;

/// The triangles of the surface of a cell.
#[derive(Default)]
pub(super) struct Star {
    /// The number of each corner's place, see [`Assembly::place`](super::Assembly::place), and of the point; sorted, each
    /// place once.
    pub corners: Vec<(u32, u32)>,
    /// Triangles between places.
    pub triangles: Vec<[u32; 3]>,
}

impl Star {
    /// Adds a face with these points.
    pub fn add(&mut self, points: impl Iterator<Item = u32> + Clone, place: impl Fn(u32) -> u32) {
        let places: Vec<u32> = points.clone().map(place).collect();
        cut(&places, |triangle| self.triangles.push(triangle));
        self.corners.extend(places.into_iter().zip(points));
    }

    /// To be called once all faces are added.
    pub fn sort(&mut self) {
        self.corners.sort_unstable();
        self.corners.dedup_by_key(|corner| corner.0);
    }

    pub fn point(&self, place: u32) -> u32 {
        self.corners[self.corners.partition_point(|corner| corner.0 < place)].1
    }

    /// Whether the pieces of the cell overlap: those between its triangles and its middle, which have these volumes, signed
    /// as the triangles are wound. False if the surface is not closed, as nobody knows then what is inside.
    pub fn is_tangled(&self, volumes: &[f64]) -> bool {
        !self.fits(volumes) && self.turns().is_some_and(|turns| overlap(&turns, volumes))
    }

    /// Whether all triangles, wound such that their pieces have positive volumes, go round a closed surface: each side is
    /// passed in both directions. That is so for nearly all cells, and takes no sorting: each side has a number, with a
    /// sign for its direction, and these cancel out. By Euler's formula, the surface is then in one part.
    fn fits(&self, volumes: &[f64]) -> bool {
        let side = |a: u32, b: u32| {
            let number = mixed(edge(a, b));
            if a < b { number } else { number.wrapping_neg() }
        };
        let around = |&[a, b, c]: &[u32; 3]| side(a, b).wrapping_add(side(b, c)).wrapping_add(side(c, a));
        let sum = self.triangles.iter().zip(volumes).fold(0u64, |sum, (triangle, &volume)| {
            let around = around(triangle);
            if volume < 0.0 { sum.wrapping_sub(around) } else { sum.wrapping_add(around) }
        });
        sum == 0 && 2 * self.corners.len() == self.triangles.len() + 4
    }

    /// For each triangle, the first one of its part of the surface, and whether it is wound the other way than that one.
    /// `None`: an edge does not have two triangles, or the surface has one side only.
    fn turns(&self) -> Option<Vec<(usize, bool)>> {
        let mut edges: Vec<(u64, u32)> = Vec::with_capacity(3 * self.triangles.len());
        for (i, &[a, b, c]) in (0u32..).zip(&self.triangles) {
            edges.extend([[a, b], [b, c], [c, a]].map(|[a, b]| (edge(a, b), i << 1 | u32::from(a < b))));
        }
        edges.sort_unstable();
        let mut neighbours = vec![[(0, false); 3]; self.triangles.len()];
        let mut found = vec![0; self.triangles.len()];
        for shared in edges.chunk_by(|p, q| p.0 == q.0) {
            let &[(_, p), (_, q)] = shared else { return None };
            for (one, other) in [(p, q), (q, p)] {
                let (triangle, same_way) = ((one >> 1) as usize, (one ^ other) & 1 == 0);
                neighbours[triangle][found[triangle]] = ((other >> 1) as usize, same_way);
                found[triangle] += 1;
            }
        }
        let mut turns = vec![None; self.triangles.len()];
        let mut next = Vec::new();
        for first in 0..turns.len() {
            if turns[first].is_none() {
                turns[first] = Some((first, false));
                next.push((first, false));
            }
            while let Some((triangle, turned)) = next.pop() {
                for (neighbour, same_way) in neighbours[triangle] {
                    let turn = turned ^ same_way;
                    match turns[neighbour] {
                        Some((_, before)) if before != turn => return None,
                        Some(_) => {}
                        None => {
                            turns[neighbour] = Some((first, turn));
                            next.push((neighbour, turn));
                        }
                    }
                }
            }
        }
        turns.into_iter().collect()
    }
}

/// A number for an edge, the same in both directions.
fn edge(a: u32, b: u32) -> u64 {
    u64::from(a.min(b)) << 32 | u64::from(a.max(b))
}

/// Whether pieces with these volumes overlap, given [`Star::turns`]: some of a part are inverted, or there are several
/// parts, all of them around the same middle.
fn overlap(turns: &[(usize, bool)], volumes: &[f64]) -> bool {
    let all: f64 = volumes.iter().map(|volume| volume.abs()).sum();
    let mut sums = vec![[0.0; 2]; turns.len()];
    for (&(part, turned), &volume) in turns.iter().zip(volumes) {
        sums[part][usize::from(turned ^ (volume < 0.0))] += volume.abs();
    }
    let inner: f64 = sums.iter().map(|[a, b]| a.min(*b)).sum();
    let outer = sums.iter().map(|[a, b]| a.max(*b)).fold(0.0, f64::max);
    inner > OVERLAP * all || all - inner - outer > OVERLAP * all
}

/// A number that depends on all bits of another.
fn mixed(number: u64) -> u64 {
    let number = number.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let number = (number ^ number >> 32).wrapping_mul(0xd6e8_feb8_6659_fd93);
    number ^ number >> 29
}
