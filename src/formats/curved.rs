//! Quadratic cells: those with nodes in the middle of their edges and, some of them, of faces and of the cell.
//!
//! Formats disagree about the order of these nodes, so that they belong to the edges, faces or cell whose middles they are
//! nearest to, all of them taken together.

use super::cells::Shape;

type Place = [f64; 3];

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

fn square(p: Place, q: Place) -> f64 {
    (0..3).map(|c| (p[c] - q[c]) * (p[c] - q[c])).sum()
}

/// The sum of some of these places with one weight.
fn sum(places: &[Place], nodes: impl Iterator<Item = usize>, weight: f64) -> Place {
    nodes.fold([0.0; 3], |sum, node| [0, 1, 2].map(|c| sum[c] + places[node][c] * weight))
}

/// The mean of some of these places.
fn mean(places: &[Place], nodes: impl ExactSizeIterator<Item = usize>) -> Place {
    let weight = 1.0 / nodes.len() as f64;
    sum(places, nodes, weight)
}

/// For each node, the middle that it belongs to, each another one, so that the sum of their squared distances is the least
/// there is. That does not depend on what all nodes are moved by together: those of a thin curved cell lie nearer to the
/// middles of other edges. There are no more nodes than middles.
fn assign(nodes: &[Place], middles: &[Place]) -> Vec<usize> {
    let cost = |node: usize, middle: usize| square(nodes[node], middles[middle]);
    let nearest = |node| (0..middles.len()).min_by(|&i, &j| cost(node, i).total_cmp(&cost(node, j))).unwrap_or(0);
    let all: Vec<usize> = (0..nodes.len()).map(nearest).collect();
    let mut taken = vec![false; middles.len()];
    if all.iter().all(|&middle| !std::mem::replace(&mut taken[middle], true)) {
        return all;
    }
    // The Hungarian method: one node after the other, along the shortest augmenting path. Column 0 is that of the new node.
    let columns = middles.len() + 1;
    let (mut of_node, mut of_column) = (vec![0.0; nodes.len()], vec![0.0; columns]); // potentials
    let mut node_in: Vec<Option<usize>> = vec![None; columns];
    for node in 0..nodes.len() {
        node_in[0] = Some(node);
        let (mut least, mut before, mut done) = (vec![f64::INFINITY; columns], vec![0; columns], vec![false; columns]);
        let mut at = 0;
        while let Some(of) = node_in[at] {
            done[at] = true;
            let (mut step, mut next) = (f64::INFINITY, at);
            for column in (1..columns).filter(|&column| !done[column]) {
                let reduced = cost(of, column - 1) - of_node[of] - of_column[column];
                if reduced < least[column] {
                    (least[column], before[column]) = (reduced, at);
                }
                if least[column] < step {
                    (step, next) = (least[column], column);
                }
            }
            if next == at {
                return all; // distances that are not finite
            }
            for column in 0..columns {
                if let (true, Some(node)) = (done[column], node_in[column]) {
                    of_node[node] += step;
                    of_column[column] -= step;
                } else {
                    least[column] -= step;
                }
            }
            at = next;
        }
        while at != 0 {
            node_in[at] = node_in[before[at]];
            at = before[at];
        }
    }
    let mut found = all;
    (1..columns).for_each(|column| node_in[column].into_iter().for_each(|node| found[node] = column - 1));
    found
}

/// The middles that the nodes behind the corners belong to; `None`: some lie farther from theirs than half a circle over
/// the longest edge would.
fn nodes_at(places: &[Place], edges: &[[usize; 2]], middles: &[Place]) -> Option<Vec<Option<usize>>> {
    let corners = edges.iter().flatten().max()? + 1;
    let longest = edges.iter().map(|&[i, j]| square(places[i], places[j])).fold(0.0, f64::max);
    let mut node_at = vec![None; middles.len()];
    for (node, middle) in (corners..).zip(assign(&places[corners..], middles)) {
        let distance = square(places[node], middles[middle]);
        if distance.is_nan() || distance > 0.3 * longest || node_at[middle].replace(node).is_some() {
            return None;
        }
    }
    Some(node_at)
}

/// Cuts the polygon between the middles of the four sides of a face along the diagonal that is nearer to the middle of the
/// face by its shape functions, so that a face which is curved in one direction only is cut along the other. Depends on
/// nothing but the places, so that both cells at a face cut it in the same way.
fn cut_middles(places: &[Place], corners: [usize; 4], middles: [usize; 4]) -> Vec<Vec<usize>> {
    let sorted = |mut nodes: [usize; 4]| {
        let order = |&i: &usize, &j: &usize| (0..3).map(|c| places[i][c].total_cmp(&places[j][c])).find(|o| o.is_ne());
        nodes.sort_by(|i, j| order(i, j).unwrap_or(std::cmp::Ordering::Equal));
        nodes
    };
    let outer = sum(places, sorted(corners).into_iter(), -0.25);
    let inner = sum(places, sorted(middles).into_iter(), 0.5);
    let middle = [0, 1, 2].map(|c| outer[c] + inner[c]);
    let [a, b, c, d] = middles;
    let [one, other] = [[a, c], [b, d]].map(|ends| square(mean(places, ends.into_iter()), middle));
    match one.total_cmp(&other) {
        std::cmp::Ordering::Less => vec![vec![a, b, c], vec![c, d, a]],
        std::cmp::Ordering::Greater => vec![vec![b, c, d], vec![d, a, b]],
        std::cmp::Ordering::Equal => vec![middles.to_vec()],
    }
}

impl Surface {
    /// The surface of a cell whose nodes are at these places. `None`: some of them are not where they should be.
    pub fn of(shape: Shape, places: &[Place]) -> Option<Self> {
        let corners = shape.corners();
        let sides = |face: &'static [u8]| (0..face.len()).map(|i| [face[i], face[(i + 1) % face.len()]].map(usize::from));
        let mut edges: Vec<[usize; 2]> = shape.faces().iter().flat_map(|face| sides(face)).filter(|[i, j]| i < j).collect();
        edges.sort_unstable();
        edges.dedup();
        // Nodes besides those of edges are in the middle of quadrilaterals, or of all faces, or of these and the cell.
        let more = places.len().checked_sub(corners + edges.len())?;
        let quads = shape.faces().iter().filter(|face| face.len() == 4).count();
        let has_node = |face: &[u8]| more > 0 && (more != quads || face.len() == 4);
        let mut middles: Vec<_> = edges.iter().map(|edge| mean(places, edge.iter().copied())).collect();
        let with_node = shape.faces().iter().filter(|face| has_node(face));
        middles.extend(with_node.map(|face| mean(places, face.iter().map(|&c| usize::from(c)))));
        if more > shape.faces().len() {
            middles.push(mean(places, 0..corners));
        }
        let node_at = nodes_at(places, &edges, &middles)?;
        let of_edges = node_at[..edges.len()].iter().copied().collect::<Option<Vec<usize>>>()?;
        let of_edge = |[i, j]: [usize; 2]| edges.binary_search(&[i.min(j), i.max(j)]).ok().map(|edge| of_edges[edge]);
        let mut others = node_at[edges.len()..].iter().copied();
        let mut faces = Vec::new();
        for face in shape.faces() {
            let around = sides(face).map(of_edge).collect::<Option<Vec<usize>>>()?;
            let before = |k: usize| around[(k + around.len() - 1) % around.len()];
            let corner = |k: usize| usize::from(face[k]);
            if let Some(node) = if has_node(face) { others.next().flatten() } else { None } {
                faces.extend((0..face.len()).flat_map(|k| [vec![before(k), corner(k), node], vec![corner(k), around[k], node]]));
                continue;
            }
            faces.extend((0..face.len()).map(|k| vec![before(k), corner(k), around[k]]));
            match *around.as_slice() {
                [a, b, c, d] => faces.extend(cut_middles(places, [0, 1, 2, 3].map(corner), [a, b, c, d])),
                _ => faces.push(around),
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
        Some(Self { faces, middle: others.next().flatten(), weights })
    }
}

/// Splits a tetrahedron with nodes in the middle of its edges, at these places, into eight, each given by the numbers of
/// its nodes; the corners come first. Every face becomes four triangles, and the octahedron in the middle four tetrahedra
/// around its shortest diagonal. `None`: some of the nodes are not where they should be.
pub(crate) fn split_tetrahedron(places: [Place; 10]) -> Option<[[usize; 4]; 8]> {
    let edges = [[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]];
    let node_at = nodes_at(&places, &edges, &edges.map(|edge| mean(&places, edge.into_iter())))?;
    let [Some(ab), Some(bc), Some(ac), Some(ad), Some(bd), Some(cd)] = *node_at.as_slice() else { return None };
    let inner = [(ab, cd, [ac, ad, bd, bc]), (bc, ad, [ab, bd, cd, ac]), (ac, bd, [ab, bc, cd, ad])];
    let lengths = inner.map(|(from, to, _)| square(places[from], places[to]));
    let shortest = (0..3).min_by(|&i, &j| lengths[i].total_cmp(&lengths[j])).unwrap_or(0);
    let (from, to, [p, q, r, s]) = inner[shortest];
    let around = [[from, to, p, q], [from, to, q, r], [from, to, r, s], [from, to, s, p]];
    let [at_a, at_b, at_c, at_d] = [[0, ab, ac, ad], [ab, 1, bc, bd], [ac, bc, 2, cd], [ad, bd, cd, 3]];
    Some([at_a, at_b, at_c, at_d, around[0], around[1], around[2], around[3]])
}
