//! Quadratic cells: those with nodes in the middle of their edges and, some of them, of faces and of the cell.
//!
//! Formats disagree about the order of these nodes, so that each belongs to the edge, face or cell whose middle is nearest.

use super::cells::Shape;

/// Whether cells of this shape and this many nodes are quadratic.
pub(crate) fn is_quadratic(shape: Shape, nodes: usize) -> bool {
    matches!(
        (shape, nodes),
        (Shape::Tetrahedron, 10) | (Shape::Pyramid, 13 | 14 | 19) | (Shape::Wedge, 15 | 18 | 21) | (Shape::Hexahedron, 20 | 24 | 26 | 27)
    )
}

/// The surface of a quadratic cell, whose nodes are given by their numbers; the corners come first.
pub(crate) struct Surface {
    /// Polygons without nodes in the middle of their sides.
    pub faces: Vec<Vec<usize>>,
    /// The node in the middle of the cell.
    pub middle: Option<usize>,
    /// Where there is none: nodes, and their weights there. Of hexahedra and wedges, these are the values of the usual shape
    /// functions (of 20 and 15 nodes).
    pub weights: Vec<(usize, f64)>,
}

fn square(p: [f64; 3], q: [f64; 3]) -> f64 {
    (0..3).map(|c| (p[c] - q[c]) * (p[c] - q[c])).sum()
}

/// The mean of some of these places.
fn mean(places: &[[f64; 3]], nodes: impl ExactSizeIterator<Item = usize>) -> [f64; 3] {
    let n = nodes.len() as f64;
    nodes.fold([0.0; 3], |sum, node| [0, 1, 2].map(|c| sum[c] + places[node][c] / n))
}

impl Surface {
    /// The surface of a cell whose nodes are at these places. `None`: some of them are not where they should be.
    pub fn of(shape: Shape, places: &[[f64; 3]]) -> Option<Self> {
        let corners = shape.corners();
        let sides = |face: &'static [u8]| (0..face.len()).map(|i| [face[i], face[(i + 1) % face.len()]].map(usize::from));
        let mut edges: Vec<[usize; 2]> = shape.faces().iter().flat_map(|face| sides(face)).filter(|[i, j]| i < j).collect();
        edges.sort_unstable();
        edges.dedup();
        let mut middles: Vec<_> = edges.iter().map(|edge| mean(places, edge.iter().copied())).collect();
        if places.len() > corners + edges.len() {
            middles.extend(shape.faces().iter().map(|face| mean(places, face.iter().map(|&c| usize::from(c)))));
            middles.push(mean(places, 0..corners));
        }
        let mut node_at = vec![None; middles.len()];
        for (node, &place) in places.iter().enumerate().skip(corners) {
            let distance = |&i: &usize| square(place, middles[i]);
            let nearest = (0..middles.len()).min_by(|i, j| distance(i).total_cmp(&distance(j)))?;
            if node_at[nearest].replace(node).is_some() {
                return None;
            }
        }
        let of_edges = node_at[..edges.len()].iter().copied().collect::<Option<Vec<usize>>>()?;
        let of_edge = |[i, j]: [usize; 2]| edges.binary_search(&[i.min(j), i.max(j)]).ok().map(|edge| of_edges[edge]);
        let mut faces = Vec::new();
        for (i, face) in shape.faces().iter().enumerate() {
            let around = sides(face).map(of_edge).collect::<Option<Vec<usize>>>()?;
            let before = |k: usize| around[(k + around.len() - 1) % around.len()];
            let corner = |k: usize| usize::from(face[k]);
            if let Some(node) = node_at.get(edges.len() + i).copied().flatten() {
                faces.extend((0..face.len()).flat_map(|k| [vec![before(k), corner(k), node], vec![corner(k), around[k], node]]));
            } else {
                faces.extend((0..face.len()).map(|k| vec![before(k), corner(k), around[k]]));
                faces.push(around);
            }
        }
        let corner = match shape {
            Shape::Hexahedron => -1.0 / 4.0,
            Shape::Wedge => -2.0 / 9.0,
            _ => 0.0,
        };
        let edge = |[i, j]: [usize; 2]| match shape {
            Shape::Hexahedron => 1.0 / 4.0,
            Shape::Wedge if j == i + 3 => 1.0 / 3.0,
            Shape::Wedge => 2.0 / 9.0,
            _ => 1.0 / edges.len() as f64,
        };
        let of_edges = of_edges.iter().zip(&edges).map(|(&node, &ends)| (node, edge(ends)));
        let weights = (0..corners).map(|node| (node, corner)).chain(of_edges).collect();
        Some(Self { faces, middle: node_at.get(edges.len() + shape.faces().len()).copied().flatten(), weights })
    }
}

/// Splits a tetrahedron with nodes in the middle of its edges, at these places, into eight, each given by the numbers of
/// its nodes; the corners come first. Every face becomes four triangles, and the octahedron in the middle four tetrahedra
/// around its shortest diagonal. `None`: two edges would have the same node.
pub(crate) fn split_tetrahedron(places: [[f64; 3]; 10]) -> Option<[[usize; 4]; 8]> {
    let nearest = |edge: [usize; 2]| {
        let middle = mean(&places, edge.into_iter());
        (4..10).min_by(|&m, &n| square(places[m], middle).total_cmp(&square(places[n], middle))).unwrap_or(4)
    };
    let [ab, bc, ac, ad, bd, cd] = [[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]].map(nearest);
    if [ab, bc, ac, ad, bd, cd].iter().fold(0, |met, node| met | 1 << node) != 0b11_1111_0000 {
        return None;
    }
    let inner = [(ab, cd, [ac, ad, bd, bc]), (bc, ad, [ab, bd, cd, ac]), (ac, bd, [ab, bc, cd, ad])];
    let lengths = inner.map(|(from, to, _)| square(places[from], places[to]));
    let shortest = (0..3).min_by(|&i, &j| lengths[i].total_cmp(&lengths[j])).unwrap_or(0);
    let (from, to, [p, q, r, s]) = inner[shortest];
    let around = [[from, to, p, q], [from, to, q, r], [from, to, r, s], [from, to, s, p]];
    let [at_a, at_b, at_c, at_d] = [[0, ab, ac, ad], [ab, 1, bc, bd], [ac, bc, 2, cd], [ad, bd, cd, 3]];
    Some([at_a, at_b, at_c, at_d, around[0], around[1], around[2], around[3]])
}
