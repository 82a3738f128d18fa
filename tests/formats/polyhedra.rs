//! Polyhedra and prisms: how files describe them, and what becomes of them.

use crate::small::{CORNERS, faces, open_bytes, polyhedra, replace, shared, volume};
use olbvh::formats::{Fate, LoadOptions, Loaded, load, load_bytes, load_points};
use olbvh::mesh::Mesh;

/// The volume of each cell of the file.
fn volumes(mesh: &Mesh) -> Vec<f64> {
    let mut volumes = vec![0.0; mesh.source_cells as usize];
    for (&tet, &id) in mesh.tets.iter().zip(mesh.cell_ids.as_ref().unwrap()) {
        assert!(volume(mesh, tet) > 0.0, "cell {id}");
        volumes[id as usize] += volume(mesh, tet);
    }
    volumes
}

/// Number of triangles that only one tetrahedron has.
fn boundary(mesh: &Mesh) -> usize {
    let faces = faces(mesh);
    assert!(faces.values().all(|&n| n <= 2));
    faces.values().filter(|&&n| n == 1).count()
}

#[test]
fn all_forms_give_the_same_mesh() {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in polyhedra() {
        let Loaded { mesh, report } = open_bytes(name, bytes.clone());
        // The cube has 12 triangles, the pyramid 6.
        assert_eq!((mesh.tets.len(), report.added_points, report.count(Fate::Split)), (12 + 6 + 1 + 1, 2, 3), "{name}");
        let wanted = [1.0, 1.0 / 3.0, 1.25 / 6.0, 1.25 / 6.0];
        assert!(volumes(&mesh).iter().zip(wanted).all(|(v, w)| (v - w).abs() < 1e-6), "{name}: {:?}", volumes(&mesh));
        // Ten triangles of the cube, two of the pyramid, three of either tetrahedron.
        assert_eq!(boundary(&mesh), 18, "{name}");
        assert_eq!(mesh.points[11..], [[0.5; 3], [0.5, 0.5, 1.2]], "{name}");
        assert_eq!(mesh.field("s").unwrap().values[9..], [9.0, 10.0, 3.5, 6.0], "{name}");
        assert_eq!(mesh.field("c").unwrap().values[17..], [1.0, 2.0, 3.0], "{name}");
        assert!(
            report.warnings.is_empty() && report.to_string().contains("13 points (2 of them added in the middle of cells)"),
            "{report}"
        );
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        assert_eq!(load_points(&path).unwrap(), CORNERS, "{name}");
    }
}

/// What is left out is not read as a part of the next polyhedron.
#[test]
fn ghosts_are_left_out() {
    for (name, bytes) in polyhedra() {
        let text = String::from_utf8(bytes).unwrap();
        let xml = text.replace("<CellData>", "<CellData><DataArray type='UInt8' Name='vtkGhostType'>1 0 0 1</DataArray>");
        let marks = xml.replace("CELL_DATA 4\n", "CELL_DATA 4\nSCALARS vtkGhostType int\nLOOKUP_TABLE default\n1 0 0 1\n");
        let Loaded { mesh, report } = open_bytes(name, marks.into_bytes());
        assert_eq!((report.count(Fate::Ghost), mesh.tets.len(), report.added_points), (2, 7, 1), "{name}");
        assert!(volumes(&mesh)[1] > 0.3, "{name}");
    }
}

/// Some writers store empty arrays of faces where there are no polyhedra.
#[test]
fn empty_arrays_of_faces_do_no_harm() {
    let empty = ["faces", "faceoffsets"].map(|name| format!("<DataArray type='Int64' Name='{name}' format='ascii'></DataArray></Cells>"));
    let bytes = replace("ascii.vtu", b"</Cells>", empty.concat().replacen("</Cells>", "", 1).as_bytes());
    assert_eq!(open_bytes("empty.vtu", bytes).mesh.tets.len(), 6);
}

/// Two pieces that meet in a square, whose corners have other numbers in the second, as polyhedron and hexahedron.
#[test]
fn polyhedra_fit_hexahedra_of_other_pieces() {
    let piece = |points: &str, kind: u8, faces: &str| {
        format!(
            "<Piece NumberOfPoints='8' NumberOfCells='1'><Points><DataArray type='Float64' NumberOfComponents='3'>{points}</DataArray>\
             </Points><Cells><DataArray type='Int32' Name='connectivity'>0 1 2 3 4 5 6 7</DataArray>\
             <DataArray type='Int32' Name='offsets'>8</DataArray><DataArray type='UInt8' Name='types'>{kind}</DataArray>{faces}</Cells></Piece>"
        )
    };
    let faces = "<DataArray type='Int32' Name='faces'>6 4 0 1 2 3 4 4 5 6 7 4 0 1 5 4 4 1 2 6 5 4 2 3 7 6 4 3 0 4 7</DataArray>\
                 <DataArray type='Int32' Name='faceoffsets'>31</DataArray>";
    let first = piece("0 0 0 1 0 0 1 1 0 0 1 0 0 0 1 1 0 1 1 1 1 0 1 1", 12, "");
    let second = piece("1 1 0 1 0 0 2 0 0 2 1 0 1 1 1 1 0 1 2 0 1 2 1 1", 42, faces);
    let file = format!("<VTKFile type='UnstructuredGrid'><UnstructuredGrid>{first}{second}</UnstructuredGrid></VTKFile>");
    let mesh = load_bytes("two.vtu", file.into_bytes(), &LoadOptions::default()).unwrap().mesh;
    assert_eq!((mesh.points.len(), boundary(&mesh)), (13, 20));
    assert!(volumes(&mesh).iter().all(|v| (v - 1.0).abs() < 1e-6));
}

/// A prism over a regular polygon beside its mirror image as polyhedron.
#[test]
fn prisms_fit_polyhedra() {
    for n in [5usize, 6] {
        let corner = |i: usize| {
            let angle = std::f64::consts::TAU * i as f64 / n as f64;
            format!("{} {}", angle.cos(), angle.sin())
        };
        let ring = |z: f64| (0..n).map(|i| format!("{} {z}\n", corner(i))).collect::<String>();
        let list = |numbers: &[usize]| numbers.iter().map(usize::to_string).collect::<Vec<_>>().join(" ");
        let face = |numbers: &[usize]| format!("{} {}", numbers.len(), list(numbers));
        let prism: Vec<usize> = (0..2 * n).collect();
        let mut faces = vec![face(&prism[n..]), face(&(2 * n..3 * n).collect::<Vec<_>>())];
        faces.extend((0..n).map(|i| face(&[n + i, n + (i + 1) % n, 2 * n + (i + 1) % n, 2 * n + i])));
        let faces = format!("{} {}", faces.len(), faces.join(" "));
        let length = faces.split(' ').count();
        let text = format!(
            "# vtk DataFile Version 3.0\n\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS {} double\n{}{}{}CELLS 2 {}\n{} {}\n{length} {faces}\n\
             CELL_TYPES 2\n{} 42\n",
            3 * n,
            ring(0.0),
            ring(1.0),
            ring(2.0),
            2 * n + 1 + length + 1,
            2 * n,
            list(&prism),
            n + 10,
        );
        let Loaded { mesh, report } = open_bytes("prism.vtk", text.into_bytes());
        // The cone from a corner of the prism, and from the middle of the polyhedron.
        let (cone, star) = (n - 2 + 2 * (n - 2), 2 * (n - 2) + 2 * n);
        assert_eq!((mesh.tets.len(), report.flat, report.tangled), (cone + star, 0, 0), "{report}");
        let area = 0.5 * n as f64 * (std::f64::consts::TAU / n as f64).sin();
        assert!(volumes(&mesh).iter().all(|v| (v - area).abs() < 1e-6), "{:?}", volumes(&mesh));
        assert_eq!(boundary(&mesh), 2 * (n - 2) + 4 * n);
    }
}

/// A file with one polyhedron of these faces; those whose bit is set in `turned` are wound the other way.
fn polyhedron(points: &[[f64; 3]], faces: &[Vec<usize>], turned: u32) -> Loaded {
    let face = |(i, face): (usize, &Vec<usize>)| {
        let mut face = face.clone();
        if turned >> i & 1 == 1 {
            face.reverse();
        }
        format!(" {} {}", face.len(), face.iter().map(usize::to_string).collect::<Vec<_>>().join(" "))
    };
    let faces = format!("{}{}", faces.len(), faces.iter().enumerate().map(face).collect::<String>());
    let length = faces.split(' ').count();
    let points: Vec<String> = points.iter().map(|[x, y, z]| format!("{x} {y} {z}")).collect();
    let text = format!(
        "# vtk DataFile Version 3.0\n\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS {} double\n{}\nCELLS 1 {}\n{length} {faces}\nCELL_TYPES 1\n42\n",
        points.len(),
        points.join("\n"),
        length + 1,
    );
    open_bytes("one.vtk", text.into_bytes())
}

/// The corners of a prism of height 1 over a polygon, and its faces, wound consistently.
fn prism(polygon: &[[f64; 2]]) -> (Vec<[f64; 3]>, Vec<Vec<usize>>) {
    let n = polygon.len();
    let points = [0.0, 1.0].iter().flat_map(|&z| polygon.iter().map(move |&[x, y]| [x, y, z])).collect();
    let sides = (0..n).map(|i| vec![i, (i + 1) % n, n + (i + 1) % n, n + i]);
    (points, sides.chain([(0..n).rev().collect(), (n..2 * n).collect()]).collect())
}

/// However the faces are wound, also if all of them turn away from the middle of the corners.
#[test]
fn polyhedra_whose_pieces_overlap_are_tangled() {
    let l_shape = [[0., 0.], [4., 0.], [4., 1.], [1., 1.], [1., 4.], [0., 4.]];
    let convex = [[0., 0.], [4., 0.], [4., 1.], [2., 3.], [1., 4.], [0., 4.]];
    // A node on a straight side is not quite on it in single precision, which makes little difference.
    let hanging = [[0., 0.], [4., 0.], [4., 1.], [2.5, 2.499_999_9], [1., 4.], [0., 4.]];
    for (polygon, area, tangled) in [(l_shape, 7.0, 1), (convex, 11.5, 0), (hanging, 11.5, 0)] {
        let (points, faces) = prism(&polygon);
        for turned in (0..256).step_by(5) {
            let Loaded { mesh, report } = polyhedron(&points, &faces, turned);
            assert_eq!((report.tangled, report.warnings.len()), (tangled, tangled as usize), "{turned}: {report}");
            assert!(tangled == 0 || report.warnings[0].starts_with("1 split cells are so warped, or so far from convex"), "{report}");
            assert_eq!((volumes(&mesh)[0] - area).abs() < 1e-5, tangled == 0);
        }
    }
    // A surface that is not closed has no inside that pieces could leave.
    let (points, faces) = prism(&l_shape);
    assert_eq!(polyhedron(&points, &faces[1..], 0).report.tangled, 0);
    // A cavity around the middle, each of whose surfaces is seen from there.
    let cube = |half: f64| CUBE.map(|corner| corner.map(|x| half * x)).to_vec();
    let shifted: Vec<Vec<usize>> = SIDES.iter().map(|face| face.iter().map(|v| v + 8).collect()).collect();
    let sides = SIDES.map(|face| face.to_vec()).to_vec();
    assert_eq!(polyhedron(&cube(1.0), &sides, 0).report.tangled, 0);
    assert_eq!(polyhedron(&[cube(1.0), cube(0.5)].concat(), &[sides, shifted].concat(), 0).report.tangled, 1);
}

const CUBE: [[f64; 3]; 8] =
    [[-1., -1., -1.], [1., -1., -1.], [1., 1., -1.], [-1., 1., -1.], [-1., -1., 1.], [1., -1., 1.], [1., 1., 1.], [-1., 1., 1.]];
/// Its faces.
const SIDES: [[usize; 4]; 6] = [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]];

#[test]
fn broken_lists_of_faces_are_refused() {
    let files = polyhedra();
    let [legacy, listed, numbered] = &files;
    for ((name, bytes), old, new, wanted) in [
        (legacy, "31 6 4 0 1", "31 6 9 0 1", "cell 0 (polyhedron): its list of 6 faces ends in face 5"),
        (legacy, "31 6 4 0 1", "31 5 4 0 1", "cell 0 (polyhedron): its list goes on for 5 numbers after its 5 faces"),
        (legacy, "31 6 4 0 1", "31 6 4 0 11", "cell 0 (polyhedron): names point 11, but points are 0 to 10"),
        (legacy, "31 6 4 0 1", "31 6 -4 0 1", "cell 0 (polyhedron): its list of 6 faces ends in face 0"),
        (legacy, "0.5 0.5 2 2", "0.5 0.5 nan 2", "point 8 (of cell 1): (0.5, 0.5, NaN): its coordinates must be finite"),
        (listed, "Name='faces'", "Name='other'", "cell 0: a polyhedron, but its piece has no arrays of faces"),
        (listed, "31 53 -1 70", "31 30 -1 70", "cell 1: its list in `faces` would reach from 31 to 30 of 70 values"),
        (listed, "31 53 -1 70", "31 53 -1 71", "cell 3: its list in `faces` would reach from 53 to 71 of 70 values"),
        (listed, "31 53 -1 70", "31 53 54 70", ""), // what stands at other cells does not matter
        (numbered, "6 11 11 15", "6 11 11 16", "cell 3: its list in `polyhedron_to_faces` would reach from 11 to 16 of 15 values"),
        (numbered, "6 11 11 15", "7 11 11 15", ""), // a face more
        (numbered, "'polyhedron_to_faces' format='ascii'>", "'polyhedron_to_faces' format='ascii'>9", "has face 9"),
    ] {
        let text = String::from_utf8(bytes.clone()).unwrap();
        assert!(text.contains(old), "{name}: {old}");
        match load_bytes(name, text.replacen(old, new, 1).into_bytes(), &LoadOptions::default()) {
            Ok(_) => assert!(wanted.is_empty(), "{name}: {new}"),
            Err(error) => assert!(!wanted.is_empty() && error.to_string().contains(wanted), "{name}: {error}"),
        }
    }
}

/// Many cells that share one large face would take far more memory than the file has bytes.
#[test]
fn faces_that_are_shared_too_often_are_refused() {
    let (face, cells) = (10_000, 20_000);
    let numbers = |n: usize, number: &dyn Fn(usize) -> usize| (0..n).map(|i| number(i).to_string()).collect::<Vec<_>>().join(" ");
    let array = |name: &str, text: String| format!("<DataArray type='Int64' Name='{name}' format='ascii'>{text}</DataArray>");
    let text = format!(
        "<VTKFile type='UnstructuredGrid'><UnstructuredGrid><Piece NumberOfPoints='4' NumberOfCells='{cells}'><Points>\
         <DataArray type='Float64' NumberOfComponents='3'>0 0 0 1 0 0 0 1 0 0 0 1</DataArray></Points><Cells>{}{}{}{}{}{}{}</Cells>\
         </Piece></UnstructuredGrid></VTKFile>",
        array("connectivity", numbers(cells, &|_| 0)),
        array("offsets", numbers(cells, &|i| i + 1)),
        array("types", numbers(cells, &|_| 42)),
        array("face_connectivity", numbers(face, &|i| i % 4)),
        array("face_offsets", face.to_string()),
        array("polyhedron_to_faces", numbers(cells, &|_| 0)),
        array("polyhedron_offsets", numbers(cells, &|i| i + 1)),
    );
    let options = LoadOptions { expansion: 1, ..LoadOptions::default() };
    let error = load_bytes("shared.vtu", text.into_bytes(), &options).unwrap_err().to_string();
    assert!(error.contains("the faces of all cells would take more than 1 times the size of the file"), "{error}");
}

#[test]
fn shared_polyhedra_conform() {
    let Some(folder) = shared("formats") else { return };
    let open = |name: &str| load(folder.join(name), &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"));
    let meshes = ["voronoi_poly_200.vtk", "voronoi_poly_200.vtu", "voronoi_poly_200_vtk97.vtu", "voronoi_poly_3000.vtu"].map(open);
    for Loaded { mesh, report } in &meshes {
        let sum: f64 = volumes(mesh).iter().sum();
        assert!((sum - 1.0).abs() < 1e-5 && report.added_points == u64::from(mesh.source_cells), "{sum}: {report}");
        boundary(mesh);
    }
    // The legacy file has fewer digits.
    assert_eq!(meshes[0].mesh.tets, meshes[1].mesh.tets);
    assert_eq!(meshes[1].mesh.tets, meshes[2].mesh.tets);
    let Loaded { mesh, .. } = open("poly_and_hex.vtu");
    assert!((volumes(&mesh).iter().sum::<f64>() - 2.0).abs() < 1e-5);
}
