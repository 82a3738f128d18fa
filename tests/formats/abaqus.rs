//! Input files of Abaqus and CalculiX, and meshes of Vega FEM: what the cube in `formats_small` does not have.

use crate::small::{open_bytes, replace, shared};
use olbvh::formats::{Curved, LoadOptions, listed_files, load, load_bytes};
use olbvh::mesh::Mesh;

fn open(text: &str) -> Mesh {
    open_bytes("a.inp", text.as_bytes().to_vec()).mesh
}

fn fails(name: &str, bytes: Vec<u8>) -> String {
    load_bytes(name, bytes, &LoadOptions::default()).unwrap_err().to_string()
}

/// Numbers with gaps, keywords in any case, data in several lines, exponents of Fortran, elements without volume in between,
/// and sets, which become a field.
#[test]
fn elements_and_sets() {
    let text = "*Node, nset=all\n 10, 0., 0., 0.\n20, 1.D0, , 0.\n30, 0, 1\n40, 0., 0., +1.0e+00,\n50, 0, 0, -1\n\
                *ELEMENT , type = s3 , elset=skin\n1, 10, 20, 30\n2, 10, 20, 40\n\
                *Element, TYPE=C3D4,\n** a comment\nELSET=One\n7, 10, 20,\n30,\n40\n** a comment\n\
                *ELEMENT, TYPE=DC3D4, ELSET=Two\n8, 10, 20, 30, 50\n*ELSET, ELSET=One\n7\n";
    let mesh = open(text);
    assert_eq!(mesh.points[1..4], [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
    assert_eq!((mesh.tets.as_slice(), mesh.cell_id(0), mesh.cell_id(1)), (&[[0, 1, 2, 3], [0, 1, 2, 4]][..], 2, 3));
    assert_eq!(mesh.field("elset").unwrap().values, [1.0, 2.0], "the skin does not count");
    assert!(open(&text.replace("ELSET=Two", "ELSET=One")).field("elset").is_none(), "one set of volumes is no field");
}

/// Each type of solid by its number of nodes; those of a quadratic hexahedron take two lines.
#[test]
fn types_of_elements() {
    let nodes: String = (1..=27).map(|i| format!("{i}, {}, {}, {}\n", i % 3, i / 3 % 3, i / 9)).collect();
    let listed = |n: usize| (1..=n).map(|i| i.to_string()).collect::<Vec<_>>();
    for (name, n, cell) in [
        ("C3D10MH", 10, "quadratic tetrahedron"),
        ("C3D5", 5, "pyramid"),
        ("C3D6", 6, "wedge"),
        ("SC6R", 6, "wedge"),
        ("C3D15", 15, "quadratic wedge"),
        ("c3d8r", 8, "hexahedron"),
        ("COH3D8", 8, "hexahedron"),
        ("DC3D20E", 20, "quadratic hexahedron"),
        ("C3D27", 27, "quadratic hexahedron"),
    ] {
        let all = listed(n);
        let lines = all.chunks(15).map(|line| line.join(", ")).collect::<Vec<_>>().join(",\n");
        let text = format!("*NODE\n{nodes}*ELEMENT, TYPE={name}\n1, {lines}\n");
        let report = open_bytes("a.inp", text.into_bytes()).report;
        assert_eq!((report.cells[0].name.as_str(), report.cells[0].count), (cell, 1), "{name}");
    }
    let (rigid, truss) = ("*ELEMENT, TYPE=R3D4\n1, 1, 2, 3, 4\n", "*ELEMENT, TYPE=T3D2\n2, 1, 2\n");
    let error = fails("a.inp", format!("*NODE\n{nodes}{rigid}{truss}").into_bytes());
    assert!(error.contains("only 2 element without volume"), "{error}");
}

/// Volumes that cannot be read are missed; lines and surfaces are not, whatever they are called.
#[test]
fn types_that_are_not_read() {
    let nodes = "*NODE\n1, 0, 0, 0\n2, 1, 0, 0\n3, 0, 1, 0\n4, 0, 0, 1\n5, 1, 1, 1\n";
    let warnings = |name: &str| {
        let text = format!("{nodes}*ELEMENT, TYPE=C3D4\n1, 1, 2, 3, 4\n*ELEMENT, TYPE={name}\n2, 1, 2, 3, 4, 5, 1\n");
        open_bytes("a.inp", text.into_bytes()).report.warnings
    };
    for (name, shown) in [
        ("GK3D6", "1 gasket element"),
        ("FC3D4", "1 element of fluid dynamics"),
        ("emc3d4", "1 electromagnetic element"),
        ("COD3D8P", "1 coupled cohesive element"),
        ("NEW3D6", "1 element of an unknown type"),
        ("C3D7", "1 element of an unknown type"),
        ("F3D4", "1 element F3D4 or the like"),
    ] {
        assert_eq!(warnings(name), [format!("volume cells of types that cannot be read are missing in the mesh: {shown}")], "{name}");
    }
    for name in ["S4R", "M3D4R", "SFM3D8", "R3D4", "T3D2", "CONN3D2", "GK3D2N", "GK3D4L", "ACIN3D4", "F3D3", "MASS", "SPRINGA", "PC3D"] {
        assert_eq!(warnings(name), [""; 0], "{name}");
    }
}

/// Parts number their nodes for themselves, and stand where their instances are: moved, then turned.
#[test]
fn instances_of_parts() {
    let part = "*PART, NAME=Tip\n*NODE\n1, 0, 0, 0\n2, 1, 0, 0\n3, 0, 1, 0\n4, 0, 0, 1\n*ELEMENT, TYPE=C3D4\n1, 1, 2, 3, 4\n*END PART\n";
    assert_eq!(open(part).tets, [[0, 1, 2, 3]], "a part without instances");
    let placed = "*ASSEMBLY, NAME=all\n*INSTANCE, NAME=a, PART=tip\n*END INSTANCE\n*Instance, name=b, part=Tip\n10, 0, 0\n\
                  10, 0, 0, 10, 0, 1, 90\n*End Instance\n*NODE\n1, 5, 5, 5\n*END ASSEMBLY\n";
    let mesh = open(&format!("{part}{placed}"));
    assert_eq!((mesh.tets.as_slice(), mesh.points[0]), (&[[1, 2, 3, 4], [5, 6, 7, 8]][..], [5.0; 3]));
    let turned = [[10.0, 0.0, 0.0], [10.0, 1.0, 0.0], [9.0, 0.0, 0.0], [10.0, 0.0, 1.0]];
    let near = |a: [f32; 3], b: [f32; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-6);
    assert!(mesh.points[5..].iter().zip(turned).all(|(&a, b)| near(a, b)), "{:?}", mesh.points);
    // What is left blank is 0.
    assert_eq!(open(&format!("{part}{}", placed.replace("\n10, 0, 0\n", "\n10,,\n"))).points, mesh.points);
    let quoted = [part.replace("Tip", "\"a, tip\""), part.replace("Tip", "\"a, top\"").replace("4, 0, 0, 1", "4, 0, 0, 3")].concat();
    let mesh = open(&format!("{quoted}*INSTANCE, NAME=\"i, 1\", PART=\"A, Tip\"\n*END INSTANCE\n"));
    assert_eq!((mesh.tets.len(), mesh.points[3]), (1, [0.0, 0.0, 1.0]), "names may have commas");
    assert_eq!(open(&part.replace("*ELEMENT, ", "*ELEMENT, ELSET=5\" pipe, ")).tets, [[0, 1, 2, 3]], "inches");
    let error = fails("a.inp", format!("{part}{part}").into_bytes());
    assert!(error.contains("line 10: a second part `TIP`; give each a name of its own"), "{error}");
    let error = fails("a.inp", format!("{part}*INSTANCE, PART=Top\n").into_bytes());
    assert!(error.contains("line 10: there is no part `TOP`"), "{error}");
}

#[test]
fn files_within_each_other() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("nodes.txt", "1, 0, 0, 0\n2, 1, 0, 0\n3, 0, 1, 0\n4, 0, 0, 1\n");
    write("elements.inp", "*ELEMENT, TYPE=C3D4\n1, 1, 2, 3, 4\n");
    write("main.inp", "*NODE, INPUT=nodes.txt\n*INCLUDE, INPUT=elements.inp\n");
    let open = |name: &str| load(folder.path().join(name), &LoadOptions::default());
    assert_eq!(open("main.inp").unwrap().mesh.tets, [[0, 1, 2, 3]]);
    assert_eq!(listed_files(&folder.path().join("main.inp")), ["nodes.txt", "elements.inp"].map(|name| folder.path().join(name)));
    // Lines stand where they are included: sections, and even an element, may go on in a file and after it.
    write("some.txt", "3, 0, 1, 0\n");
    write("more.txt", "3,\n");
    write(
        "main.inp",
        "*NODE\n1, 0, 0, 0\n2, 1, 0, 0\n*INCLUDE, INPUT=some.txt\n4, 0, 0, 1\n*ELEMENT, TYPE=C3D4\n1, 1, 2,\n*INCLUDE, INPUT=more.txt\n4\n",
    );
    assert_eq!(open("main.inp").unwrap().mesh.tets, [[0, 1, 2, 3]]);
    write("main.inp", "*INCLUDE, INPUT=main.inp\n");
    assert!(open("main.inp").unwrap_err().to_string().contains("more than 8 deep"));
    assert_eq!(listed_files(&folder.path().join("main.inp")), [folder.path().join("main.inp")]);
    write("main.inp", "*INCLUDE, INPUT=none.inp\n");
    assert!(open("main.inp").unwrap_err().to_string().contains("main.inp: line 1: the file that it names cannot be read"));
}

#[test]
fn broken_files_say_where() {
    for (old, new, place) in [
        (&b"TYPE=C3D4"[..], &b"ELSET=x"[..], "line 13: *ELEMENT without TYPE"),
        (b"1, 1, 2, 4, 8\n2", b"1, 1, 2, 4\n2", "line 15: element 1 has 8 nodes, but its type has 4"),
        (b"6, 1, 5, 7, 8", b"6, 1, 5", "line 20: element 6 ends after 2 nodes, fewer than its type has"),
        (b"6, 1, 5, 7, 8", b"6, 1, 5, 7, 99", "element 6: node 99 does not exist"),
        (b"8, 1, 1, 1.25", b"7, 1, 1, 1.25", "line 12: node 7 a second time, at another place; number it anew"),
        (b"8, 1, 1, 1.25", b"8, 1, one", "line 12: `one` where a coordinate should be"),
        (b"*NODE", b"*NODE, SYSTEM=C", "line 4: coordinates of the system `C`; write them as x, y and z"),
        (b"*STEP", b"*NCOPY, CHANGE NUMBER=10", "line 20: *NCOPY makes nodes or elements out of others"),
    ] {
        let error = fails("a.inp", replace("cube.inp", old, new));
        assert!(error.contains(place), "{error}");
    }
    for (old, new, place) in [
        (&b"TET"[..], &b"BRICK"[..], "line 14: elements of the kind `BRICK`; TET and CUBIC can be read"),
        (b"8 3 0 0", b"8 2 0 0", "line 3: vertices of 2 coordinates"),
        (b"6 4 0", b"6 8 0", "line 15: 8 vertices and 0 attributes of an element, which must have 4 vertices"),
        (b"6 1 5 7 8", b"6 1 5 7 9", "cell 5: vertex 9 does not exist"),
        (b"*ELEMENTS", b"*MATERIAL", "there was no *ELEMENTS"),
    ] {
        let error = fails("a.veg", replace("cube.veg", old, new));
        assert!(error.contains(place), "{error}");
    }
}

/// The shared meshes are those of other formats.
#[test]
fn shared_files_agree_with_others() {
    let Some(folder) = shared("formats") else { return };
    let options = LoadOptions { curved: Curved::Split, ..LoadOptions::default() };
    let open = |name: &str| load(folder.join(name), &options).unwrap().mesh;
    for (name, other) in [("bracket_5k.inp", "bracket_5k_ascii.vtu"), ("bracket_tet10_7k.inp", "bracket_tet10_7k.vtu")] {
        let (mesh, other) = (open(name), open(other));
        assert_eq!((mesh.tets == other.tets, mesh.points == other.points), (true, true), "{name}");
    }
    let (vega, other) = (open("bracket_5k.veg"), open("bracket_5k.inp"));
    assert_eq!(vega.tets, other.tets);
}
