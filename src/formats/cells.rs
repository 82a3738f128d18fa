//! Cell types of the file formats, and the splitting of cells into tetrahedra.

/// Shape of a cell, by its corners.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Shape {
    /// Points, lines and surfaces, that is boundary elements.
    Flat,
    Tetrahedron,
    Hexahedron,
    /// A hexahedron whose corners are numbered with x varying fastest.
    Voxel,
    Wedge,
    Pyramid,
    PentagonalPrism,
    HexagonalPrism,
    /// A cell that the file describes by its faces.
    Polyhedron,
    /// A volume that cannot be split.
    Other,
}

/// A cell type of a format.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CellType {
    pub name: &'static str,
    pub shape: Shape,
    /// Number of nodes, of which the corners come first; `None`: any number that is at least the number of corners.
    pub nodes: Option<usize>,
}

impl Shape {
    /// Number of corners of a volume that can be split; a polyhedron may have any number.
    pub const fn corners(self) -> usize {
        match self {
            Shape::Tetrahedron => 4,
            Shape::Pyramid => 5,
            Shape::Wedge => 6,
            Shape::Hexahedron | Shape::Voxel => 8,
            Shape::PentagonalPrism => 10,
            Shape::HexagonalPrism => 12,
            Shape::Polyhedron | Shape::Flat | Shape::Other => 0,
        }
    }

    /// The faces as corner numbers, counter-clockwise as seen from outside (in VTK's numbering).
    pub const fn faces(self) -> &'static [&'static [u8]] {
        match self {
            Shape::Pyramid => &[&[0, 3, 2, 1], &[0, 1, 4], &[1, 2, 4], &[2, 3, 4], &[3, 0, 4]],
            Shape::Wedge => &[&[0, 2, 1], &[3, 4, 5], &[0, 1, 4, 3], &[1, 2, 5, 4], &[2, 0, 3, 5]],
            Shape::Hexahedron => &[&[0, 3, 2, 1], &[4, 5, 6, 7], &[0, 1, 5, 4], &[1, 2, 6, 5], &[2, 3, 7, 6], &[3, 0, 4, 7]],
            Shape::Voxel => &[&[0, 2, 3, 1], &[4, 5, 7, 6], &[0, 1, 5, 4], &[1, 3, 7, 5], &[3, 2, 6, 7], &[2, 0, 4, 6]],
            Shape::PentagonalPrism => {
                &[&[0, 4, 3, 2, 1], &[5, 6, 7, 8, 9], &[0, 1, 6, 5], &[1, 2, 7, 6], &[2, 3, 8, 7], &[3, 4, 9, 8], &[4, 0, 5, 9]]
            }
            Shape::HexagonalPrism => &[
                &[0, 5, 4, 3, 2, 1],
                &[6, 7, 8, 9, 10, 11],
                &[0, 1, 7, 6],
                &[1, 2, 8, 7],
                &[2, 3, 9, 8],
                &[3, 4, 10, 9],
                &[4, 5, 11, 10],
                &[5, 0, 6, 11],
            ],
            Shape::Tetrahedron | Shape::Polyhedron | Shape::Flat | Shape::Other => &[],
        }
    }
}

/// Most corners of a cell that is not a polyhedron.
pub(crate) const MOST_CORNERS: usize = 12;

/// Cuts a face into triangles along the diagonals through its smallest vertex id, so two cells that share the face cut
/// it in the same way, whatever their types. Vertices that are repeated give fewer triangles.
pub(crate) fn cut(face: &[u32], mut emit: impl FnMut([u32; 3])) {
    let Some(smallest) = (0..face.len()).min_by_key(|&i| face[i]) else { return };
    let vertex = |i: usize| face[(smallest + i) % face.len()];
    for i in 2..face.len() {
        let triangle = [vertex(0), vertex(i - 1), vertex(i)];
        if triangle[0] != triangle[1] && triangle[1] != triangle[2] && triangle[2] != triangle[0] {
            emit(triangle);
        }
    }
}

/// Splits a cell other than a tetrahedron or polyhedron into tetrahedra and passes each to `emit`.
///
/// Each tetrahedron is the cone from the cell's smallest vertex over a triangle (see [`cut`]) of a face that does not
/// contain it. The orientation of the numbering does not matter (files disagree about wedges). In a hexahedron, if no
/// diagonal ends at the corner opposite to the smallest vertex, the three tetrahedra around that corner become two: five
/// instead of six in total. Collapsed cells (with repeated vertices) give fewer. All tetrahedra of a convex cell have the
/// same sign.
pub(crate) fn split(shape: Shape, corners: &[u32], mut emit: impl FnMut([u32; 4])) {
    let Some(&apex) = corners.iter().min() else { return };
    let mut triangles = [[0; 3]; MOST_CORNERS]; // no cell has more of them opposite to a corner
    let mut n = 0;
    for face in shape.faces() {
        let mut places = [0; 6];
        face.iter().zip(&mut places).for_each(|(&c, place)| *place = corners[c as usize]);
        let face = &places[..face.len()];
        if !face.contains(&apex) {
            cut(face, |triangle| {
                triangles[n] = triangle;
                n += 1;
            });
        }
    }
    let triangles = &triangles[..n];
    let far = far_corner(shape, corners, apex).filter(|_| n == 6);
    let around: Vec<[u32; 2]> = far.map_or_else(Vec::new, |far| triangles.iter().filter_map(|&t| after(t, far)).collect());
    let cap = match around.as_slice() {
        &[[a, b], [c, d], [e, f]] if (b == c && d == e && f == a) || (d == a && f == c && b == e) => {
            far.map(|far| (far, [a, b, if b == c { d } else { c }]))
        }
        _ => None,
    };
    if let Some((far, [a, b, c])) = cap {
        emit([apex, a, b, c]);
        emit([c, far, a, b]);
    }
    for t in triangles.iter().filter(|t| cap.is_none_or(|(far, _)| !t.contains(&far))) {
        emit([apex, t[0], t[1], t[2]]);
    }
}

/// The other two vertices of a triangle that contains `vertex`, in cyclic order.
fn after([a, b, c]: [u32; 3], vertex: u32) -> Option<[u32; 2]> {
    match vertex {
        v if v == a => Some([b, c]),
        v if v == b => Some([c, a]),
        v if v == c => Some([a, b]),
        _ => None,
    }
}

/// The corner of a hexahedron that is opposite to `apex`.
fn far_corner(shape: Shape, corners: &[u32], apex: u32) -> Option<u32> {
    let at = corners.iter().position(|&v| v == apex)?;
    match shape {
        Shape::Hexahedron => corners.get([6, 7, 4, 5, 2, 3, 0, 1][at]).copied(),
        Shape::Voxel => corners.get(7 - at).copied(),
        _ => None,
    }
}

const fn cell(name: &'static str, shape: Shape, nodes: usize) -> CellType {
    CellType { name, shape, nodes: if nodes == 0 { None } else { Some(nodes) } }
}

/// The cell type with this number in VTK.
pub(crate) fn vtk(number: i64) -> Option<CellType> {
    use Shape::{Flat, HexagonalPrism, Hexahedron, Other, PentagonalPrism, Polyhedron, Pyramid, Tetrahedron, Voxel, Wedge};
    Some(match number {
        0 => cell("empty cell", Flat, 0),
        1 => cell("vertex", Flat, 1),
        2 => cell("poly-vertex", Flat, 0),
        3 => cell("line", Flat, 2),
        4 => cell("poly-line", Flat, 0),
        5 => cell("triangle", Flat, 3),
        6 => cell("triangle strip", Flat, 0),
        7 => cell("polygon", Flat, 0),
        8 => cell("pixel", Flat, 4),
        9 => cell("quad", Flat, 4),
        10 => cell("tetrahedron", Tetrahedron, 4),
        11 => cell("voxel", Voxel, 8),
        12 => cell("hexahedron", Hexahedron, 8),
        13 => cell("wedge", Wedge, 6),
        14 => cell("pyramid", Pyramid, 5),
        15 => cell("pentagonal prism", PentagonalPrism, 10),
        16 => cell("hexagonal prism", HexagonalPrism, 12),
        21 => cell("quadratic edge", Flat, 3),
        22 => cell("quadratic triangle", Flat, 6),
        23 => cell("quadratic quad", Flat, 8),
        24 => cell("quadratic tetrahedron", Tetrahedron, 10),
        25 => cell("quadratic hexahedron", Hexahedron, 20),
        26 => cell("quadratic wedge", Wedge, 15),
        27 => cell("quadratic pyramid", Pyramid, 13),
        28 => cell("biquadratic quad", Flat, 9),
        29 => cell("triquadratic hexahedron", Hexahedron, 27),
        30 => cell("quadratic linear quad", Flat, 6),
        31 => cell("quadratic linear wedge", Wedge, 12),
        32 => cell("biquadratic quadratic wedge", Wedge, 18),
        33 => cell("biquadratic quadratic hexahedron", Hexahedron, 24),
        34 => cell("biquadratic triangle", Flat, 7),
        35 => cell("cubic line", Flat, 4),
        36 => cell("quadratic polygon", Flat, 0),
        37 => cell("triquadratic pyramid", Pyramid, 19),
        41 => cell("convex point set", Other, 0),
        42 => cell("polyhedron", Polyhedron, 0),
        51..=54 | 60..=63 | 68..=70 | 75..=77 => cell("higher-order line or surface", Flat, 0),
        55..=59 => cell("parametric volume", Other, 0),
        64 | 71 | 78 => cell("higher-order tetrahedron", Tetrahedron, 0),
        65 | 73 | 80 => cell("higher-order wedge", Wedge, 0),
        66 | 74 | 81 => cell("higher-order pyramid", Pyramid, 0),
        67 | 72 | 79 => cell("higher-order hexahedron", Hexahedron, 0),
        _ => return None,
    })
}

/// The cell type with this number in VTK of a cell with so many nodes. Gmsh writes quadratic pyramids under the number of
/// those with straight edges.
pub(crate) fn vtk_of(number: i64, nodes: usize) -> Option<CellType> {
    match (number, nodes) {
        (14, 13 | 14) => Some(cell("quadratic pyramid", Shape::Pyramid, nodes)),
        _ => vtk(number),
    }
}

/// If a cell array of this name marks ghost cells (copies of cells of a neighbouring piece) and hidden ones, the
/// predicate for its values. Older versions of VTK store ghost levels.
pub(crate) fn ghost(array: &str) -> Option<fn(i64) -> bool> {
    match array {
        "vtkGhostType" => Some(|bits| bits & (DUPLICATE | HIDDEN) != 0),
        "vtkGhostLevels" => Some(|level| level > 0),
        _ => None,
    }
}

/// Bits of `vtkGhostType` for cells.
const DUPLICATE: i64 = 1;
const HIDDEN: i64 = 32;

/// The cell type with this element number in Gmsh.
pub(crate) fn gmsh(number: i64) -> Option<CellType> {
    use Shape::{Flat, Hexahedron, Other, Pyramid, Tetrahedron, Wedge};
    let nodes = *GMSH_NODES.get(usize::try_from(number).ok()?)? as usize;
    let (linear, higher, shape) = match number {
        1 => ("line", "", Flat),
        2 => ("triangle", "", Flat),
        3 => ("quad", "", Flat),
        15 => ("point", "", Flat),
        4 | 11 | 29..=33 | 71..=75 | 79..=83 => ("tetrahedron", "higher-order tetrahedron", Tetrahedron),
        5 | 12 | 17 | 92..=105 => ("hexahedron", "higher-order hexahedron", Hexahedron),
        6 | 13 | 18 | 90 | 91 | 106..=117 => ("wedge", "higher-order wedge", Wedge),
        7 | 14 | 19 | 118..=131 => ("pyramid", "higher-order pyramid", Pyramid),
        87..=89 | 132 => ("cell of one node", "cell of one node", Other),
        _ => ("", "higher-order line or surface", Flat),
    };
    (nodes > 0).then(|| cell(if number <= 7 || number == 15 { linear } else { higher }, shape, nodes))
}

/// Number of nodes of each Gmsh element type; 0: the type does not exist, or has no fixed number.
#[rustfmt::skip]
const GMSH_NODES: [u16; 133] = [
    0, 2, 3, 4, 4, 8, 6, 5, 3, 6, 9, 10, 27, 18, 14, 1, 8, 20, 15, 13, 9, 10, 12, 15, 15, 21, 4, 5, 6, 20, 35, 56, 22, 28, 0, 0,
    16, 25, 36, 12, 16, 20, 28, 36, 45, 55, 66, 49, 64, 81, 100, 121, 18, 21, 24, 27, 30, 24, 28, 32, 36, 40, 7, 8, 9, 10, 11,
    0, 0, 0, 0, 84, 120, 165, 220, 286, 0, 0, 0, 34, 40, 46, 52, 58, 1, 1, 1, 1, 1, 1, 40, 75,
    64, 125, 216, 343, 512, 729, 1000, 32, 44, 56, 68, 80, 92, 104, 126, 196, 288, 405, 550, 24, 33, 42, 51, 60, 69, 78,
    30, 55, 91, 140, 204, 285, 385, 21, 29, 37, 45, 53, 61, 69, 1,
];
