//! Structured, rectilinear and uniform grids of VTK become hexahedra, which are split.

use crate::small::structured::{SIZE, WHOLE, extent, files, piece, points, structured, xml};
use crate::small::{join, open_bytes};
use olbvh::formats::{Fate, LoadOptions, Loaded, load_bytes, load_points};
use olbvh::mesh::{Mesh, On};

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
        ("image.vtk", file("image.vtk").replace("SPACING 0.5 1 2", ""), "there was no SPACING"),
        (
            "structured.vtk",
            file("structured.vtk").replace("DIMENSIONS 4", "DIMENSIONS 5"),
            "POINTS has 24 entries, but the dimensions make 30",
        ),
        (
            "rectilinear.vtk",
            file("rectilinear.vtk").replace("2 double\n3 5", "1 double\n3"),
            "4, 3 and 1 coordinates, but the dimensions are 4, 3 and 2",
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
