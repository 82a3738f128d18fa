//! Hexahedra, wedges, pyramids and polyhedra are split into tetrahedra that fit together and fill the same space.

use std::collections::HashMap;

use crate::small::{CORNERS, faces, shared, volume};
use olbvh::formats::{Curved, Fate, LoadOptions, Loaded, load, load_bytes};
use olbvh::mesh::Mesh;

/// Checks that tetrahedra fit together: no face belongs to more than two, and the boundary is closed.
fn check(mesh: &Mesh, wanted: f64, boundary: usize) {
    let total: f64 = mesh.tets.iter().map(|&t| volume(mesh, t)).sum();
    assert!((total - wanted).abs() < 1e-5 * wanted, "volume {total}, not {wanted}");
    let faces = faces(mesh);
    assert!(faces.values().all(|&n| n <= 2));
    let single: Vec<_> = faces.iter().filter(|f| *f.1 == 1).map(|f| *f.0).collect();
    assert_eq!(single.len(), boundary, "triangles on the boundary");
    let mut edges: HashMap<[u32; 2], u32> = HashMap::new();
    for [a, b, c] in single {
        for edge in [[a, b], [b, c], [a, c]] {
            *edges.entry(edge).or_insert(0) += 1;
        }
    }
    assert!(edges.values().all(|&n| n == 2));
}

/// The faces of a hexahedron.
const SIDES: [[usize; 4]; 6] = [[0, 1, 2, 3], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]];

/// A grid of hexahedra with shuffled vertex numbers; some are voxels, some polyhedra, and others are cut into six pyramids.
fn grid(n: usize, seed: u64) -> String {
    let mut state = seed;
    let mut random = move |m: usize| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % m
    };
    let corners = (n + 1).pow(3);
    let mut name: Vec<usize> = (0..corners).collect();
    for i in (1..corners).rev() {
        name.swap(i, random(i + 1));
    }
    let mut points = vec![[0.0; 3]; corners];
    let id = |x: usize, y: usize, z: usize| x + (n + 1) * (y + (n + 1) * z);
    for (i, &p) in name.iter().enumerate() {
        points[p] = [i % (n + 1), i / (n + 1) % (n + 1), i / (n + 1) / (n + 1)].map(|v| v as f64);
    }
    let (mut cells, mut types) = (Vec::new(), Vec::new());
    for cell in 0..n * n * n {
        let (x, y, z) = (cell % n, cell / n % n, cell / n / n);
        let v = |dx, dy, dz| name[id(x + dx, y + dy, z + dz)];
        let hex = [v(0, 0, 0), v(1, 0, 0), v(1, 1, 0), v(0, 1, 0), v(0, 0, 1), v(1, 0, 1), v(1, 1, 1), v(0, 1, 1)];
        match random(5) {
            0 => {
                cells.push(vec![hex[0], hex[1], hex[3], hex[2], hex[4], hex[5], hex[7], hex[6]]);
                types.push(11);
            }
            1 => {
                let centre = points.len();
                let h = hex.map(|v| points[v]);
                points.push([0, 1, 2].map(|c| h.iter().map(|p| p[c]).sum::<f64>() / 8.0));
                for face in SIDES {
                    cells.push(face.map(|c| hex[c]).into_iter().chain([centre]).collect());
                    types.push(14);
                }
            }
            2 => {
                let list = |face: [usize; 4]| std::iter::once(4).chain(face.map(|c| hex[c]));
                cells.push(std::iter::once(6).chain(SIDES.into_iter().flat_map(list)).collect());
                types.push(42);
            }
            _ => {
                cells.push(hex.to_vec());
                types.push(12);
            }
        }
    }
    file(&points, &cells, &types)
}

fn file(points: &[[f64; 3]], cells: &[Vec<usize>], types: &[u8]) -> String {
    let mut text = format!("# vtk DataFile Version 3.0\ngrid\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS {} double\n", points.len());
    for p in points {
        text += &format!("{} {} {}\n", p[0], p[1], p[2]);
    }
    text += &format!("CELLS {} {}\n", cells.len(), cells.iter().map(|c| c.len() + 1).sum::<usize>());
    for c in cells {
        text += &format!("{} {}\n", c.len(), c.iter().map(usize::to_string).collect::<Vec<_>>().join(" "));
    }
    text += &format!("CELL_TYPES {}\n", cells.len());
    for t in types {
        text += &format!("{t}\n");
    }
    text
}

fn loaded(text: &str) -> Loaded {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("grid.vtk");
    std::fs::write(&path, text).unwrap();
    load(path, &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"))
}

fn read(text: &str) -> Mesh {
    loaded(text).mesh
}

#[test]
fn random_numberings_conform() {
    let mut counts = [0; 13];
    for seed in 0..20 {
        let n = 3;
        let mesh = read(&grid(n, seed));
        check(&mesh, 27.0, 2 * 6 * n * n);
        assert!(mesh.tets.iter().all(|&t| volume(&mesh, t) > 0.0));
        let ids = mesh.cell_ids.unwrap();
        for cell in 0..mesh.source_cells {
            counts[ids.iter().filter(|&&id| id == cell).count()] += 1;
        }
    }
    let of = [2, 5, 6, 12].map(|n| counts[n]);
    assert!(of.iter().all(|&n| n > 0), "pyramids of 2, hexahedra of 5 and of 6, polyhedra of 12 tetrahedra: {counts:?}");
    assert_eq!(counts.iter().sum::<usize>(), of.iter().sum::<usize>());
}

#[test]
fn wedges_of_both_orientations() {
    let p = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.], [1., 0., 1.], [0., 1., 1.], [1., 1., 0.], [1., 1., 1.]];
    for second in [[1, 6, 2, 4, 7, 5], [1, 2, 6, 4, 5, 7]] {
        for first in [[0, 1, 2, 3, 4, 5], [0, 2, 1, 3, 5, 4], [3, 4, 5, 0, 1, 2]] {
            let mesh = read(&file(&p, &[first.to_vec(), second.to_vec()], &[13, 13]));
            assert_eq!(mesh.tets.len(), 6);
            check(&mesh, 1.0, 12);
        }
    }
}

/// A hexahedron whose nodes go round the other way is no more warped than another.
#[test]
fn inverted_cells_are_not_tangled() {
    let p = [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.], [0., 0., 1.], [1., 0., 1.], [1., 1., 1.], [0., 1., 1.]];
    let mut warped = p;
    warped[6] = [-2.0, -2.0, -2.0];
    for (points, tangled) in [(p, 0), (warped, 1)] {
        for hex in [[0, 1, 2, 3, 4, 5, 6, 7], [0, 3, 2, 1, 4, 7, 6, 5]] {
            let report = loaded(&file(&points, &[hex.to_vec()], &[12])).report;
            assert_eq!(report.tangled, tangled, "{hex:?}: {report}");
        }
    }
}

#[test]
fn collapsed_cells_lose_their_empty_pieces() {
    let p = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.], [1., 0., 1.], [0., 1., 1.]];
    for hex in [[0, 1, 2, 2, 3, 4, 5, 5], [2, 2, 0, 1, 5, 5, 3, 4]] {
        let mesh = read(&file(&p, &[hex.to_vec()], &[12]));
        assert_eq!(mesh.tets.len(), 3);
        check(&mesh, 0.5, 8);
    }
}

/// The second hexahedron starts at the end of the seam where the first one does not, so that its own numbers would cut
/// the shared face along the other diagonal.
#[test]
fn pieces_fit_at_the_seam() {
    let piece = |points: &str| {
        format!(
            "<Piece NumberOfPoints='8' NumberOfCells='1'><Points><DataArray type='Float64' NumberOfComponents='3'>{points}</DataArray>\
             </Points><Cells><DataArray type='Int32' Name='connectivity'>0 1 2 3 4 5 6 7</DataArray>\
             <DataArray type='Int32' Name='offsets'>8</DataArray><DataArray type='UInt8' Name='types'>12</DataArray></Cells></Piece>"
        )
    };
    let pieces = [piece("0 0 0 1 0 0 1 1 0 0 1 0 0 0 1 1 0 1 1 1 1 0 1 1"), piece("1 1 0 1 0 0 2 0 0 2 1 0 1 1 1 1 0 1 2 0 1 2 1 1")];
    let file = format!("<VTKFile type='UnstructuredGrid'><UnstructuredGrid>{}</UnstructuredGrid></VTKFile>", pieces.concat());
    let mesh = load_bytes("two.vtu", file.into_bytes(), &LoadOptions::default()).unwrap().mesh;
    assert_eq!(mesh.points.len(), 12);
    check(&mesh, 2.0, 20);
}

/// Two tetrahedra of ten nodes that share a curved face, the second with its middles in another order. The value at each
/// node is its number.
#[test]
fn curved_tetrahedra_use_all_their_nodes() {
    let corners = [[0., 0., 0.], [2., 0., 0.], [0., 2., 0.], [0., 0., 2.], [2., 2., 2.]];
    let edges = [[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3], [1, 4], [2, 4], [3, 4]];
    let mut points = corners.to_vec();
    points.extend(edges.map(|[i, j]: [usize; 2]| [0, 1, 2].map(|c| 0.5 * (corners[i][c] + corners[j][c]))));
    points[6][2] += 0.25; // the edge that both have
    let cells = [vec![0, 1, 2, 3, 5, 6, 7, 8, 9, 10], vec![1, 2, 3, 4, 11, 9, 12, 13, 10, 6]];
    let values = (0..14).map(|i| i.to_string()).collect::<Vec<_>>().join(" ");
    let text = file(&points, &cells, &[24, 24]) + &format!("POINT_DATA 14\nSCALARS s float\nLOOKUP_TABLE default\n{values}\n");
    let read = |curved| load_bytes("curved.vtk", text.clone().into_bytes(), &LoadOptions { curved, ..LoadOptions::default() }).unwrap();
    let Loaded { mesh, report } = read(Curved::Split);
    assert!(mesh.tets.len() == 16 && report.warnings.is_empty() && report.count(Fate::Split) == 2 && report.tangled == 0, "{report}");
    assert!(mesh.tets.iter().all(|&t| volume(&mesh, t) > 0.0));
    // The volumes of the corners' tetrahedra, without what the bend cuts off at two outer faces: a third of its height
    // times that of a face, seen from below, which moves.
    check(&mesh, 8.0 / 6.0 + 16.0 / 6.0 - 2.0 * (0.25 * 1.5 / 3.0), 24);
    for v in 0..14 {
        assert_eq!((mesh.fields[0].values[v], mesh.tets.as_flattened().contains(&(v as u32))), (v as f32, true));
    }
    let Loaded { mesh, report } = read(Curved::Corners);
    assert_eq!((mesh.tets.len(), report.count(Fate::Straightened)), (2, 2));
    assert!(report.warnings.len() == 1 && report.warnings[0].contains("--curved split"), "{report}");
    // A node that lies far from its edge: the corners count.
    let far = text.replacen("1 1 0.25", "1 1 9", 1);
    let options = LoadOptions { curved: Curved::Split, ..LoadOptions::default() };
    assert_eq!(load_bytes("far.vtk", far.into_bytes(), &options).unwrap().report.count(Fate::Straightened), 2);
    let Some(folder) = shared("formats") else { return };
    let whole = load(folder.join("bracket_tet10_7k.vtu"), &options).unwrap();
    let straight = load(folder.join("bracket_tet10_7k.vtu"), &LoadOptions::default()).unwrap();
    assert_eq!((whole.mesh.tets.len(), whole.report.tangled), (8 * straight.mesh.tets.len(), 0));
    let sum = |mesh: &Mesh| mesh.tets.iter().map(|&t| volume(mesh, t)).sum::<f64>();
    check(&whole.mesh, sum(&whole.mesh), 4 * faces(&straight.mesh).values().filter(|&&n| n == 1).count());
}

/// A hexahedron with a wedge and a pyramid at its faces, and a tetrahedron at the pyramid, all quadratic, with the nodes of
/// their edges in any order. The field is x² + yz.
#[test]
fn quadratic_cells_fit_each_other() {
    let corners = [&CORNERS[..8], &[[2., 0.5, 0.], [2., 0.5, 1.], [0.5, 0.5, 2.], [2., 0.5, 2.]]].concat();
    let quad = |a, b, c, d| vec![[a, b], [b, c], [c, d], [d, a]];
    let cells: [(u8, Vec<usize>, Vec<[usize; 2]>); 4] = [
        (25, (0..8).collect(), [quad(4, 5, 6, 7), vec![[0, 4], [1, 5], [2, 6], [3, 7]], quad(0, 1, 2, 3)].concat()),
        (26, vec![1, 2, 8, 5, 6, 9], vec![[1, 5], [1, 2], [2, 8], [8, 1], [2, 6], [8, 9], [5, 6], [6, 9], [9, 5]]),
        (27, vec![4, 5, 6, 7, 10], [vec![[7, 10], [4, 10], [5, 10], [6, 10]], quad(4, 5, 6, 7)].concat()),
        (24, vec![5, 6, 10, 11], vec![[10, 11], [5, 6], [6, 10], [10, 5], [5, 11], [6, 11]]),
    ];
    for bend in [0.0, 0.04] {
        let mut points = corners.clone();
        let mut middles = HashMap::new();
        let mut middle = |&[i, j]: &[usize; 2]| {
            *middles.entry([i.min(j), i.max(j)]).or_insert_with(|| {
                let bent = [bend, -0.5 * bend, 0.7 * bend];
                points.push([0, 1, 2].map(|c| 0.5 * (corners[i][c] + corners[j][c]) + bent[(c + i + j) % 3]));
                points.len() - 1
            })
        };
        let nodes: Vec<Vec<usize>> =
            cells.iter().map(|(_, corners, edges)| corners.iter().copied().chain(edges.iter().map(&mut middle)).collect()).collect();
        let f = |[x, y, z]: [f64; 3]| x * x + y * z;
        let values = points.iter().map(|&p| f(p).to_string()).collect::<Vec<_>>().join(" ");
        let data = format!("POINT_DATA {}\nSCALARS f double\nLOOKUP_TABLE default\n{values}\n", points.len());
        let text = file(&points, &nodes, &cells.each_ref().map(|cell| cell.0)) + &data;
        let options = LoadOptions { curved: Curved::Split, ..LoadOptions::default() };
        let Loaded { mesh, report } = load_bytes("quadratic.vtk", text.into_bytes(), &options).unwrap();
        assert_eq!((report.count(Fate::Split), report.added_points, report.tangled, report.warnings.len()), (4, 3, 0, 0), "{report}");
        assert_eq!(mesh.tets.len(), 6 * 6 + (2 * 4 + 3 * 6) + (6 + 4 * 4) + 8);
        assert!(mesh.tets.iter().all(|&t| volume(&mesh, t) > 0.0));
        let total: f64 = mesh.tets.iter().map(|&t| volume(&mesh, t)).sum();
        check(&mesh, if bend == 0.0 { 1.0 + 0.5 + 1.0 / 3.0 + 0.25 } else { total }, 4 * 6 + (2 * 4 + 2 * 6) + 3 * 4 + 3 * 4);
        let added = mesh.points.iter().zip(&mesh.fields[0].values).skip(points.len());
        for (place, (&p, &value)) in [[0.5; 3], [4.0 / 3.0, 0.5, 0.5], [0.5, 0.5, 1.25]].into_iter().zip(added) {
            assert!((0..3).all(|c| (f64::from(p[c]) - place[c]).abs() < 1e-6 + 3.0 * bend), "{p:?}");
            // The values of a quadratic field are exact, but in the pyramid.
            assert!(bend > 0.0 || place[2] > 1.0 || (f64::from(value) - f(place)).abs() < 1e-6, "{value}");
        }
    }
}

/// Corners of a cell of one of four quadratic kinds, and what its other nodes are in the middle of.
fn nodes_of(kind: u8) -> (Vec<[f64; 3]>, Vec<Vec<usize>>) {
    let cube = &CORNERS[..8];
    let ring = |n: usize| (0..2 * n).map(move |i| vec![i, i / n * n + (i + 1) % n]).chain((0..n).map(move |i| vec![i, i + n]));
    let quads = |n: usize| (0..n).map(move |i| vec![i, (i + 1) % n, (i + 1) % n + n, i + n]);
    let wedge = [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 0., 1.], [1., 0., 1.], [1., 1., 1.]];
    match kind {
        25 => (cube.to_vec(), ring(4).collect()),
        29 => (cube.to_vec(), ring(4).chain(quads(4)).chain([vec![0, 1, 2, 3], vec![4, 5, 6, 7], (0..8).collect()]).collect()),
        26 => (wedge.to_vec(), ring(3).collect()),
        _ => (wedge.to_vec(), ring(3).chain(quads(3)).collect()),
    }
}

/// Thin curved layers around a cylinder, whose nodes are nearer to the middles of other edges and faces than their own:
/// every node counts, the pieces fit, and their volume is that of the layers but for what chords cut off.
#[test]
fn nodes_of_thin_curved_layers_keep_their_edges() {
    const N: usize = 32;
    let radii: [f64; 3] = [1.0, 1.005, 1.3];
    for kind in [25, 29, 26, 32] {
        let (corners, middles) = nodes_of(kind);
        let mean = |middle: &Vec<usize>| [0, 1, 2].map(|c| middle.iter().map(|&i| corners[i][c]).sum::<f64>() / middle.len() as f64);
        let nodes: Vec<[f64; 3]> = corners.iter().copied().chain(middles.iter().map(mean)).collect();
        // Wedges fill a cube in twos.
        let turned = |p: [f64; 3]| if p[0] >= p[1] { [p[1], p[0], p[2]] } else { p };
        let parts = if corners.len() == 6 { vec![nodes.clone(), nodes.iter().map(|&p| turned(p)).collect()] } else { vec![nodes] };
        let (mut numbers, mut points, mut cells) = (HashMap::new(), Vec::new(), Vec::new());
        for (layer, sector) in (0..2).flat_map(|layer| (0..N).map(move |sector| (layer, sector))) {
            for nodes in &parts {
                cells.push(Vec::new());
                for &[u, v, w] in nodes {
                    let [v, w] = if corners.len() == 6 { [w, v] } else { [v, w] }; // layers of wedges have triangles at the cylinder
                    let (r, turn) = (radii[layer] + (radii[layer + 1] - radii[layer]) * v, (sector as f64 + u) / N as f64 % 1.0);
                    let key = [(r * 1e6).round() as i64, (turn * 1e6).round() as i64, (w * 2.0) as i64];
                    let number = *numbers.entry(key).or_insert_with(|| {
                        let (sin, cos) = (turn * std::f64::consts::TAU).sin_cos();
                        points.push([r * cos, r * sin, 0.3 * w]);
                        points.len() - 1
                    });
                    cells.last_mut().unwrap().push(number);
                }
            }
        }
        let text = file(&points, &cells, &vec![kind; cells.len()]);
        let options = LoadOptions { curved: Curved::Split, ..LoadOptions::default() };
        let Loaded { mesh, report } = load_bytes("ring.vtk", text.into_bytes(), &options).unwrap();
        assert!(report.count(Fate::Straightened) == 0 && report.warnings.is_empty() && report.unused_points == 0, "{kind}: {report}");
        assert!(mesh.tets.iter().all(|&t| volume(&mesh, t) > 0.0), "{kind}");
        // The chords are those of twice as many sectors.
        let part = (std::f64::consts::PI / N as f64).sin() / (std::f64::consts::PI / N as f64);
        let wanted = 0.3 * std::f64::consts::PI * (radii[2] * radii[2] - radii[0] * radii[0]) * part;
        let total: f64 = mesh.tets.iter().map(|&t| volume(&mesh, t)).sum();
        assert!((total / wanted - 1.0).abs() < 2e-5, "{kind}: {total} {wanted}");
        let boundary = faces(&mesh).values().filter(|&&n| n == 1).count();
        assert!(faces(&mesh).values().all(|&n| n <= 2) && boundary % (2 * N) == 0, "{kind}: {boundary}");
    }
}

/// A wedge of 18 nodes in which one of a quadrilateral lies nearest to the middle of a triangle, where none can be.
#[test]
fn nodes_of_a_wedge_are_not_in_its_triangles() {
    let at = |p: &str| -> [f64; 3] { p.split(' ').map(|x| x.parse().unwrap()).collect::<Vec<_>>().try_into().unwrap() };
    let points = [
        "1.021168 1.15 .15",
        ".021168 1.15 0",
        "1 .15 .15",
        "1.021168 .937578 1.15",
        ".021168 .937578 1",
        "1 -.062422 1.15",
        ".521168 1.15 .0375",
        ".649624 .65 .0375",
        "1.149624 .65 .15",
        ".521168 .937578 1.0375",
        ".649624 .437578 1.0375",
        "1.149624 .437578 1.15",
        "1.021168 1.081045 .65",
        ".021168 1.081045 .5",
        "1 .081045 .65",
        ".521168 1.081045 .5375",
        ".649624 .581045 .5375",
        "1.149624 .581045 .65",
    ]
    .map(at);
    let text = file(&points, &[(0..18).collect()], &[32]);
    let options = LoadOptions { curved: Curved::Split, ..LoadOptions::default() };
    let Loaded { mesh, report } = load_bytes("wedge.vtk", text.into_bytes(), &options).unwrap();
    assert_eq!((mesh.tets.len(), report.count(Fate::Split), report.tangled), (32, 1, 0), "{report}");
    // VTK's volume of the cell, less what its curved faces have beyond their triangles.
    let total: f64 = mesh.tets.iter().map(|&t| volume(&mesh, t)).sum();
    assert!((total - 0.50179).abs() < 0.004, "{total}");
}

/// Gmsh writes quadratic pyramids with the number of linear ones, and its own order of nodes.
#[test]
fn quadratic_pyramids_of_gmsh_are_read() {
    let corners = [[0., 0., 0.], [2., 0., 0.], [2., 2., 0.], [0., 2., 0.], [1., 1., 2.]];
    let edges: [[usize; 2]; 8] = [[0, 1], [0, 3], [0, 4], [1, 2], [1, 4], [2, 3], [2, 4], [3, 4]];
    let mut points = corners.to_vec();
    points.extend(edges.map(|[i, j]| [0, 1, 2].map(|c| 0.5 * (corners[i][c] + corners[j][c]))));
    points.push([1., 1., -0.25]);
    for nodes in [13, 14] {
        let text = file(&points, &[(0..nodes).collect()], &[14]);
        for (curved, fate) in [(Curved::Corners, Fate::Straightened), (Curved::Split, Fate::Split)] {
            let Loaded { mesh, report } =
                load_bytes("pyramid.vtk", text.clone().into_bytes(), &LoadOptions { curved, ..LoadOptions::default() }).unwrap();
            assert_eq!((report.cells[0].name.as_str(), report.cells[0].count), ("quadratic pyramid", 1));
            assert_eq!(report.warnings.len(), usize::from(fate == Fate::Straightened), "{report}");
            // The node of the base is the top of a pyramid below it.
            let bend = if curved == Curved::Split && nodes == 14 { 4.0 * 0.25 / 3.0 } else { 0.0 };
            let volume: f64 = mesh.tets.iter().map(|&t| volume(&mesh, t)).sum();
            assert!((volume - (8.0 / 3.0 + bend)).abs() < 1e-6, "{nodes}: {volume}");
        }
    }
    let odd = file(&points, &[(0..12).collect()], &[14]);
    let error = load_bytes("pyramid.vtk", odd.into_bytes(), &LoadOptions::default()).unwrap_err().to_string();
    assert!(error.contains("cell 0 (pyramid): 12 points, but this type has 5"), "{error}");
}

/// The volume of a box of 2.5 × 1 × 1 whose own tetrahedra are folded at 16 faces, so that a little of it is counted
/// twice.
const MIXED: f64 = 2.501_392_23;

#[test]
fn shared_meshes_conform() {
    let Some(folder) = shared("formats") else { return };
    // The boundary triangles are those of the mesh, plus two for each quadrilateral.
    for (name, wanted) in [
        ("mixed_hex_pyr_tet_wedge.vtu", MIXED),
        ("mixed_hex_pyr_tet_wedge_interleaved.vtu", MIXED),
        ("mixed_hex_pyr_tet_wedge.mesh", MIXED),
        ("mixed_hex_pyr_tet_wedge_22a.msh", MIXED),
        ("mixed_hex_pyr_tet_wedge_41b.msh", MIXED),
        ("mixed_quadratic.vtu", MIXED),
        ("voxel_8k.vtu", 1.0),
    ] {
        let mesh = load(folder.join(name), &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}")).mesh;
        let boundary = faces(&mesh).values().filter(|&&n| n == 1).count();
        check(&mesh, wanted, boundary);
    }
    // With all their nodes, the cells still fit, and each face of the boundary has more triangles.
    let options = LoadOptions { curved: Curved::Split, ..LoadOptions::default() };
    let Loaded { mesh, report } = load(folder.join("mixed_quadratic.vtu"), &options).unwrap();
    assert!(report.count(Fate::Straightened) == 0 && report.warnings.is_empty(), "{report}");
    check(&mesh, MIXED, faces(&mesh).values().filter(|&&n| n == 1).count());
    for name in ["hex_wavy_8k.vtu", "wedge_boundarylayer_32k.vtu"] {
        let mesh = load(folder.join(name), &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}")).mesh;
        let faces = faces(&mesh);
        assert!(faces.values().all(|&n| n <= 2), "{name}");
        let per_face = if name.starts_with("hex") { 2 * 2400 } else { faces.values().filter(|&&n| n == 1).count() };
        assert_eq!(faces.values().filter(|&&n| n == 1).count(), per_face, "{name}");
    }
}
