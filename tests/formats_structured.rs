//! Structured, rectilinear and uniform grids of VTK become hexahedra, which are split.
#![cfg(feature = "formats")]
#![allow(clippy::unwrap_used, clippy::format_collect, clippy::format_push_string)] // also in helpers of tests

mod formats_small;

use formats_small::open_bytes;
use olbvh::formats::{Fate, LoadOptions, Loaded, load_bytes, load_points};
use olbvh::mesh::{Mesh, On};

/// Number of points along each axis, and their coordinates.
const SIZE: [usize; 3] = [4, 3, 2];
const AXES: [&[f64]; 3] = [&[1.0, 1.5, 2.0, 2.5], &[-1.0, 0.0, 1.0], &[3.0, 5.0]];

fn join<T: ToString>(values: impl IntoIterator<Item = T>) -> String {
    values.into_iter().map(|v| v.to_string()).collect::<Vec<_>>().join(" ")
}

/// The points of a part of the grid, given by the numbers of the first and the last point along each axis.
fn points([x, y, z]: [[usize; 2]; 3]) -> Vec<[f64; 3]> {
    let range = |[first, last]: [usize; 2]| first..=last;
    range(z).flat_map(|k| range(y).flat_map(move |j| range(x).map(move |i| [AXES[0][i], AXES[1][j], AXES[2][k]]))).collect()
}

const WHOLE: [[usize; 2]; 3] = [[0, 3], [0, 2], [0, 1]];

/// The grid as cells of type hexahedron.
fn hexahedra() -> Mesh {
    let at = |i: usize, j: usize, k: usize| i + SIZE[0] * (j + SIZE[1] * k);
    let cell = |c: usize| {
        let (i, j, k) = (c % 3, c / 3 % 2, c / 6);
        join([
            8,
            at(i, j, k),
            at(i + 1, j, k),
            at(i + 1, j + 1, k),
            at(i, j + 1, k),
            at(i, j, k + 1),
            at(i + 1, j, k + 1),
            at(i + 1, j + 1, k + 1),
            at(i, j + 1, k + 1),
        ])
    };
    let cells: String = (0..6).map(|c| cell(c) + "\n").collect();
    let text = format!(
        "# vtk DataFile Version 3.0\n\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 24 double\n{}\nCELLS 6 54\n{cells}CELL_TYPES 6\n{}",
        join(points(WHOLE).as_flattened()),
        join([12; 6]),
    );
    open_bytes("cells.vtk", text.into_bytes()).mesh
}

fn array(name: &str, components: usize, values: &str) -> String {
    format!("<DataArray type='Float64' Name='{name}' NumberOfComponents='{components}' format='ascii'>{values}</DataArray>")
}

fn extent(part: [[usize; 2]; 3]) -> String {
    join(part.as_flattened())
}

/// A piece of a structured grid with the field `s`, the numbers of the points in it, and the field `c` of its cells.
fn piece(part: [[usize; 2]; 3], more: &str) -> String {
    let [n, cells] = [1, 0].map(|more| part.iter().map(|[first, last]| (last - first + more).max(1)).product::<usize>());
    let data = format!("<PointData>{}</PointData><CellData>{}</CellData>", array("s", 1, &join(0..n)), array("c", 1, &join(0..cells)));
    format!("<Piece Extent='{}'>{data}{more}</Piece>", extent(part))
}

fn xml(kind: &str, attributes: &str, pieces: &str) -> Vec<u8> {
    format!("<VTKFile type='{kind}'><{kind} WholeExtent='0 3 0 2 0 1' {attributes}>{pieces}</{kind}></VTKFile>").into_bytes()
}

fn structured(part: [[usize; 2]; 3]) -> String {
    piece(part, &format!("<Points>{}</Points>", array("Points", 3, &join(points(part).as_flattened()))))
}

fn legacy(dataset: &str, geometry: &str) -> Vec<u8> {
    let data = format!("POINT_DATA 24\nSCALARS s float\nLOOKUP_TABLE default\n{}\n", join(0..24));
    let cells = format!("CELL_DATA 6\nSCALARS c float\nLOOKUP_TABLE default\n{}\n", join(0..6));
    format!("# vtk DataFile Version 3.0\n\nASCII\nDATASET {dataset}\nDIMENSIONS 4 3 2\n{geometry}\n{data}{cells}").into_bytes()
}

/// The same grid in every form.
fn files() -> Vec<(&'static str, Vec<u8>)> {
    let coordinates = ["x", "y", "z"].iter().zip(AXES).map(|(name, axis)| array(name, 1, &join(axis))).collect::<String>();
    let axes = ["X", "Y", "Z"].iter().zip(AXES).map(|(name, axis)| format!("{name}_COORDINATES {} double\n{}\n", axis.len(), join(axis)));
    let points = points(WHOLE);
    vec![
        ("a.vts", xml("StructuredGrid", "", &structured(WHOLE))),
        ("a.vtr", xml("RectilinearGrid", "", &piece(WHOLE, &format!("<Coordinates>{coordinates}</Coordinates>")))),
        ("a.vti", xml("ImageData", "Origin='1 -1 3' Spacing='0.5 1 2'", &piece(WHOLE, ""))),
        // Rows along y, and the numbers start elsewhere.
        (
            "turned.vti",
            String::from_utf8(xml("ImageData", "Origin='0 -3 1' Spacing='0.5 1 2' Direction='1 0 0 0 1 0 0 0 1'", &piece(WHOLE, "")))
                .unwrap()
                .replace("Extent='0 3 0 2 0 1'", "Extent='2 5 2 4 1 2'")
                .into_bytes(),
        ),
        ("structured.vtk", legacy("STRUCTURED_GRID", &format!("POINTS 24 float\n{}", join(points.as_flattened())))),
        ("rectilinear.vtk", legacy("RECTILINEAR_GRID", &axes.collect::<String>())),
        ("image.vtk", legacy("STRUCTURED_POINTS", "ORIGIN 1 -1 3\nSPACING 0.5 1 2")),
        ("aspect.vtk", legacy("STRUCTURED_POINTS", "ASPECT_RATIO 0.5 1 2\nORIGIN 1 -1 3")),
    ]
}

#[test]
fn every_form_gives_the_same_cells() {
    let cells = hexahedra();
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in files() {
        let Loaded { mesh, report } = open_bytes(name, bytes.clone());
        assert_eq!((&mesh.points, &mesh.tets, &mesh.cell_ids), (&cells.points, &cells.tets, &cells.cell_ids), "{name}");
        assert_eq!((report.count(Fate::Split), report.warnings.len()), (6, 0), "{name}: {report}");
        assert!(mesh.field("s").unwrap().values.iter().zip(0..24).all(|(&v, i)| v == i as f32), "{name}");
        let of_cells = mesh.field("c").unwrap();
        assert!(of_cells.on == On::Cells && of_cells.values.iter().zip(cells.cell_ids.as_ref().unwrap()).all(|(&v, &id)| v == id as f32));
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        assert_eq!(load_points(&path).unwrap(), points(WHOLE), "{name}");
    }
}

#[test]
fn directions_turn_an_image() {
    let turned = "Origin='9 0 0' Spacing='0.5 1 2' Direction='0 -1 0 1 0 0 0 0 1'";
    let mesh = open_bytes("turned.vti", xml("ImageData", turned, &piece(WHOLE, ""))).mesh;
    // Rows lead along y, and from row to row along -x.
    assert_eq!([mesh.points[1], mesh.points[4], mesh.points[12]], [[9.0, 0.5, 0.0], [8.0, 0.0, 0.0], [9.0, 0.0, 2.0]]);
}

/// Pieces of a grid share the points of their seam, in one file or in several.
#[test]
fn pieces_are_joined() {
    let parts = [[[0, 1], [0, 2], [0, 1]], [[1, 3], [0, 2], [0, 1]]];
    let together = xml("StructuredGrid", "", &parts.map(structured).concat());
    let folder = tempfile::tempdir().unwrap();
    let mut sources = String::new();
    for (i, part) in parts.into_iter().enumerate() {
        std::fs::write(folder.path().join(format!("{i}.vts")), xml("StructuredGrid", "", &structured(part))).unwrap();
        sources += &format!("<Piece Extent='{}' Source='{i}.vts'/>", extent(part));
    }
    let list = folder.path().join("grid.pvts");
    std::fs::write(&list, format!("<VTKFile type='PStructuredGrid'><PStructuredGrid>{sources}</PStructuredGrid></VTKFile>")).unwrap();
    for mesh in [open_bytes("two.vts", together).mesh, olbvh::formats::load(&list, &LoadOptions::default()).unwrap().mesh] {
        assert_eq!((mesh.points.len(), mesh.tets.len(), mesh.source_cells), (24, hexahedra().tets.len(), 6));
    }
}

#[test]
fn hidden_cells_are_left_out() {
    let ghosts = "<DataArray type='UInt8' Name='vtkGhostType'>0 32 0 1 0 0</DataArray></CellData>";
    let text = String::from_utf8(files().remove(0).1).unwrap().replace("</CellData>", ghosts);
    let Loaded { mesh, report } = open_bytes("hidden.vts", text.into_bytes());
    let mut ids = mesh.cell_ids.unwrap();
    ids.dedup();
    assert_eq!((ids, report.count(Fate::Ghost)), (vec![0, 2, 4, 5], 2));
}

#[test]
fn what_is_wrong_is_named() {
    let file = |name: &str| String::from_utf8(files().into_iter().find(|file| file.0 == name).unwrap().1).unwrap();
    let flat = xml("ImageData", "", &piece([[0, 3], [0, 2], [0, 0]], ""));
    for (name, text, wanted) in [
        (
            "a.vts",
            file("a.vts").replace("Piece Extent='0 3", "Piece Extent='0 4"),
            "90 values are announced, but its text has room for 88 at most",
        ),
        ("a.vts", file("a.vts").replace("Piece Extent='0 3 ", "Piece Extent='0 "), "Extent=\"0 0 2 0 1\" is not the extent of"),
        ("a.vti", file("a.vti").replace("Spacing='0.5 1 2'", "Spacing='0.5 1'"), "Spacing=\"0.5 1\" is not 3 numbers"),
        ("a.vtr", file("a.vtr").replace("3 5<", "3 5 7<"), "array `z` (line 1): it has 3 values instead of 2"),
        ("image.vtk", file("image.vtk").replace("SPACING 0.5", "SPACING a"), "`a` where a number should be"),
        ("image.vtk", file("image.vtk").replace("SPACING 0.5 1 2", ""), "0, 0 and 0 coordinates, but the dimensions are 4, 3 and 2"),
        (
            "structured.vtk",
            file("structured.vtk").replace("DIMENSIONS 4", "DIMENSIONS 5"),
            "POINTS has 24 entries, but the dimensions make 30",
        ),
        ("structured.vtk", file("structured.vtk").replace("DIMENSIONS 4 3 2", ""), "there was no DIMENSIONS"),
        (
            "flat.vti",
            String::from_utf8(flat).unwrap(),
            "the file has no tetrahedra or cells that can be split into some, only 6 cell of a flat grid",
        ),
        // Points and cells that are not in the file.
        (
            "a.vti",
            file("a.vti").replace("Extent='0 3 0 2 0 1'", "Extent='0 999 0 999 0 999'"),
            "1000000000 points would take more than 100 times the size of the file",
        ),
        (
            "a.vti",
            file("a.vti").replace("Extent='0 3 0 2 0 1'", "Extent='0 99999 0 99999 0 9'"),
            "is not the extent of fewer than 2^32 points",
        ),
        (
            "image.vtk",
            file("image.vtk").replace("DIMENSIONS 4 3 2", "DIMENSIONS 999 999 999"),
            "997002999 points would take more than 100 times the size of the file",
        ),
    ] {
        let error = load_bytes(name, text.into_bytes(), &LoadOptions::default()).unwrap_err().to_string();
        assert!(error.contains(wanted), "{name}: {error}");
    }
}
