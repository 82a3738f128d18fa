//! Every spelling of every format gives the same mesh.

use crate::small::{POINTS, TETS, all, join, open_bytes, replace, shared};
use olbvh::Error;
use olbvh::formats::{Fate, LoadOptions, Loaded, Merge, load, load_bytes};
use olbvh::mesh::On;

fn open(path: impl AsRef<std::path::Path>) -> Loaded {
    load(&path, &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"))
}

fn write(folder: &tempfile::TempDir, name: &str, bytes: &[u8]) -> std::path::PathBuf {
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    path
}

#[test]
fn small_files_agree() {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in all() {
        write(&folder, name, &bytes);
    }
    for (name, _) in all() {
        let Loaded { mesh, report } = open(folder.path().join(name));
        let points: Vec<[f32; 3]> = POINTS.iter().map(|p| p.map(|x| x as f32)).collect();
        assert_eq!((mesh.points, mesh.tets.as_slice()), (points, TETS.as_slice()), "{name}");
        assert_eq!((mesh.cell_ids, mesh.source_cells, mesh.origin), (None, 6, [0.0; 3]), "{name}");
        assert_eq!((report.points, report.tetrahedra, report.bounds), (8, 6, [[0.0; 3], [1.0, 1.0, 1.25]]), "{name}: {report}");
        for (field, on, count) in [("s", On::Points, 8u8), ("c", On::Cells, 6)] {
            let renamed = ["attribute0", "region", "medit:ref (cells)"];
            let found = mesh.fields.iter().find(|f| f.on == on && (f.name == field || renamed.contains(&f.name.as_str())));
            match found {
                Some(found) => assert_eq!(found.values, (0..count).map(f32::from).collect::<Vec<_>>(), "{name}: {field}"),
                None => assert!(
                    [".tet", ".inp", ".veg"].iter().any(|ending| name.ends_with(ending)) || name.contains("mesh") && on == On::Points,
                    "{name} lost {field}"
                ),
            }
        }
    }
}

#[test]
fn shared_spellings_agree() {
    let Some(folder) = shared("formats") else { return };
    let reference = open(folder.join("bracket_5k_appraw.vtu")).mesh;
    let mut n = 0;
    for entry in std::fs::read_dir(&folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap().to_owned();
        let ending = name.rsplit('.').next().unwrap();
        if !name.starts_with("bracket_5k") || name.contains("piece") && !name.contains("twopieces") {
            continue;
        }
        if ["e", "vtkhdf"].contains(&ending) {
            let error = load(&path, &LoadOptions::default()).unwrap_err();
            assert!(matches!(error, Error::File { .. }) && error.to_string().len() > 60, "{error}");
            continue;
        }
        n += 1;
        let mesh = open(&path).mesh;
        assert_eq!(mesh.source_cells, 5188, "{name}");
        let corner = |mesh: &olbvh::mesh::Mesh, tet: [u32; 4]| tet.map(|v| mesh.points[v as usize].map(|x| (x * 1e4).round()));
        for (a, b) in mesh.tets.iter().zip(&reference.tets) {
            assert_eq!(corner(&mesh, *a), corner(&reference, *b), "{name}");
        }
        for field in &reference.fields {
            let Some(other) = mesh.fields.iter().find(|f| f.name == field.name && f.on == field.on) else {
                assert!(!name.ends_with(".vtu"), "{name} lost {}", field.name);
                continue;
            };
            if (name.contains("twopieces") || ending == "pvtu") && field.on == On::Points {
                continue;
            }
            let close = |(a, b): (&f32, &f32)| (a - b).abs() <= 1e-5 * b.abs().max(1e-3);
            assert!(other.values.iter().zip(&field.values).all(close), "{name}: {}", field.name);
        }
    }
    assert!(n >= 35, "{n} spellings");
}

#[test]
fn pieces_are_joined_or_not() {
    let Some(folder) = shared("formats") else { return };
    let path = folder.join("bracket_5k_twopieces.vtu");
    assert_eq!(open(&path).mesh.points.len(), 1659);
    let apart = LoadOptions { merge: Merge::Nothing, ..LoadOptions::default() };
    assert_eq!(load(&path, &apart).unwrap().mesh.points.len(), 1786);
}

#[test]
fn ids_count_every_cell_of_the_file() {
    let Some(folder) = shared("formats") else { return };
    let loaded = open(folder.join("mixed_hex_pyr_tet_wedge_22a.msh"));
    assert_eq!(loaded.mesh.source_cells, 16 + 200 + 736 + 524 + 1869 + 512 + 590 + 64);
    assert_eq!(loaded.report.count(Fate::Boundary), 16 + 200 + 736 + 524);
    assert_eq!(loaded.report.count(Fate::Split), 512 + 590 + 64);
    let ids = loaded.mesh.cell_ids.unwrap();
    assert!(ids.is_sorted() && ids[0] == 16 + 200 + 736 + 524);
}

#[test]
fn vectors_become_magnitude_and_components() {
    let mesh = open(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/bracket_50k.vtu")).mesh;
    let field = |name: &str| &mesh.field(name).unwrap().values;
    for i in [0, 777, 12321] {
        let v = ["displacement.x", "displacement.y", "displacement.z"].map(|n| f64::from(field(n)[i]));
        let length = (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
        assert!((f64::from(field("displacement")[i]) - length).abs() <= 1e-6 * length);
    }
    assert_eq!(field("von_mises_cell").len(), mesh.tets.len());
}

#[test]
fn far_meshes_keep_their_shape() {
    let folder = tempfile::tempdir().unwrap();
    let (_, bytes) = all().swap_remove(4);
    let text = String::from_utf8(bytes).unwrap();
    let head = text.find("POINTS").unwrap();
    let cells = text.find("CELLS").unwrap();
    let points: String = POINTS.iter().map(|p| format!("{} {} {}\n", p[0] + 1e7 + 0.3, p[1] - 3e7, p[2] + 0.1)).collect();
    let far = format!("{}POINTS 8 double\n{points}{}", &text[..head], &text[cells..]);
    let Loaded { mesh, report } = open(write(&folder, "far.vtk", far.as_bytes()));
    // Only the third axis is close enough to 0 to have no origin.
    assert_eq!(mesh.origin, [1e7 + 0.3, -3e7, 0.0]);
    assert_eq!(report.bounds[0], [1e7 + 0.3, -3e7, 0.1]);
    for (p, q) in mesh.points.iter().zip(POINTS) {
        assert!((p[0] - q[0] as f32).abs() < 1e-6);
        assert_eq!(p[1], q[1] as f32);
        assert!((p[2] - q[2] as f32 - 0.1).abs() < 1e-6);
    }
}

/// A flat body that stands far away is moved as well: the next number to 1e9 is 64 away.
#[test]
fn a_flat_axis_is_moved_to_the_origin() {
    let folder = tempfile::tempdir().unwrap();
    let (_, bytes) = all().swap_remove(4);
    let text = String::from_utf8(bytes).unwrap();
    let (head, cells) = (text.find("POINTS").unwrap(), text.find("CELLS").unwrap());
    let points: String = POINTS.iter().map(|p| format!("{} {} 1000000003\n", p[0], p[1])).collect();
    let flat = format!("{}POINTS 8 double\n{points}{}", &text[..head], &text[cells..]);
    let Loaded { mesh, .. } = open(write(&folder, "flat.vtk", flat.as_bytes()));
    assert_eq!(mesh.origin, [0.0, 0.0, 1_000_000_003.0]);
    assert!(mesh.points.iter().all(|p| p[2] == 0.0));
}

#[test]
fn kuhn_grids() {
    let plain = load("kuhn:3,4,5", &LoadOptions::default()).unwrap();
    assert_eq!((plain.mesh.tets.len(), plain.report.tetrahedra), (360, 360));
    let jittered = load("kuhn:3,4,5,jitter=0.3,seed=7", &LoadOptions::default()).unwrap();
    assert_ne!(plain.mesh.points, jittered.mesh.points);
    for wrong in ["kuhn:", "kuhn:1,2", "kuhn:1,2,x", "kuhn:0,1,1", "kuhn:1,1,1,jitter=9", "kuhn:1,1,1,speed=3", "kuhn:-1,1,1"] {
        assert!(matches!(load(wrong, &LoadOptions::default()), Err(Error::Invalid(_))), "{wrong}");
    }
    assert!(matches!(load("kuhn:4000000000,4000000000,4000000000", &LoadOptions::default()), Err(Error::TooLarge(_))));
}

#[test]
fn content_decides_before_the_name() {
    let folder = tempfile::tempdir().unwrap();
    let files = all();
    let bytes = |name: &str| files.iter().find(|f| f.0 == name).unwrap().1.clone();
    for (content, name) in [
        ("ascii.vtu", "a.vtk"),
        ("ascii.vtk", "b.mesh"),
        ("v22.msh", "c.txt"),
        ("text.mesh", "d.msh"),
        ("cube.inp", "e.txt"),
        ("cube.veg", "f.dat"),
    ] {
        assert_eq!(open(write(&folder, name, &bytes(content))).mesh.tets.len(), 6, "{content} as {name}");
    }
    for (content, name, word) in [
        ("MFEM mesh v1.0\n", "e.mesh", "MFEM"),
        ("# UCD\n8 6 0 0 0\n", "g.inp", "AVS"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1 2 3\n", "o.obj", "fill it with tetrahedra first"),
        ("$# LS-DYNA Keyword file created by LS-PrePost\n$\n*KEYWORD\n", "p.k", "LS-DYNA"),
        ("$ made by hand\n$$ twice\n\n*KEYWORD\n", "q.dat", "LS-DYNA"),
        ("$ made by hand\nGRID,1,,0.,0.,0.\n", "r.bdf", "Nastran file, which cannot be read; convert it"),
        ("$ made by hand\nASSIGN x\n", "s.dat", "Nastran"),
        ("SOL 101\nCEND\nBEGIN BULK\n", "t.dat", "Nastran"),
        ("GRID           1", "u.nas", "Nastran"),
        ("$ made by hand", "v.xyz", "neither its content"),
        ("CDF\x01xxxx", "i.e", "Exodus"),
        ("\u{89}", "j.xyz", ".vtu"),
        ("<!DOCTYPE html><html>", "k.vtu", "HTML"),
        ("<svg xmlns=\"x\"/>", "l.vtu", "svg"),
    ] {
        let error = load(write(&folder, name, content.as_bytes()), &LoadOptions::default()).unwrap_err();
        assert!(matches!(&error, Error::File { .. }) && error.to_string().contains(word), "{name}: {error}");
    }
    assert!(matches!(load(folder.path().join("none.vtu"), &LoadOptions::default()), Err(Error::Io { .. })));
}

/// Every cell has its own copies of its points.
fn unshared() -> Vec<u8> {
    let points: String = TETS.as_flattened().iter().map(|&v| POINTS[v as usize].map(|x| x.to_string()).join(" ") + "\n").collect();
    let cells: String = (0..6).map(|i| format!("4 {} {} {} {}\n", 4 * i, 4 * i + 1, 4 * i + 2, 4 * i + 3)).collect();
    let values: String = TETS.as_flattened().iter().map(|v| format!("{v}\n")).collect();
    let head = "# vtk DataFile Version 3.0\nunshared\nASCII\nDATASET UNSTRUCTURED_GRID\n";
    let data = format!("POINT_DATA 24\nFIELD F 1\ns 1 24 float\n{values}");
    format!("{head}POINTS 24 double\n{points}CELLS 6 30\n{cells}CELL_TYPES 6\n{}{data}", "10\n".repeat(6)).into_bytes()
}

#[test]
fn cells_that_share_no_points() {
    let apart = open_bytes("apart.vtk", unshared());
    assert!(apart.mesh.points.len() == 24 && apart.report.warnings[0].starts_with("each cell has points of its own, so every face"));
    let all = LoadOptions { merge: Merge::All, ..LoadOptions::default() };
    let Loaded { mesh, report } = load_bytes("merged.vtk", unshared(), &all).unwrap();
    assert_eq!((mesh.points.len(), report.warnings), (8, vec!["16 points that coincide with others are merged".to_owned()]));
    let place = |v: u32| (mesh.points[v as usize], mesh.field("s").unwrap().values[v as usize]);
    for (found, wanted) in mesh.tets.as_flattened().iter().zip(TETS.as_flattened()) {
        assert_eq!(place(*found), (POINTS[*wanted as usize].map(|x| x as f32), *wanted as f32));
    }
}

#[test]
fn any_expansion_is_an_option() {
    let (name, bytes) = all().swap_remove(0);
    let options = LoadOptions { expansion: u64::MAX, ..LoadOptions::default() };
    assert_eq!(load_bytes(name, bytes, &options).unwrap().mesh.fields.len(), 2);
}

#[test]
fn gmsh_names_what_it_does_not_read() {
    let known = "$Periodic\n0\n$EndPeriodic\n$Comments\n$EndComments\n$PhysicalNames\n0\n$EndPhysicalNames\n";
    let unknown = "$ElementNodeData\n$EndElementNodeData\n$Odd\n$EndOdd\n$ElementNodeData\n$EndElementNodeData\n";
    let warnings =
        |more: &str| open_bytes("more.msh", replace("v22.msh", b"$NodeData", format!("{more}$NodeData").as_bytes())).report.warnings;
    assert!(warnings(known).is_empty());
    assert_eq!(warnings(&[known, unknown].concat()), ["sections that are not read: $ElementNodeData, $Odd"]);
    let empty = "$NodeData\n1\n\"none\"\n0\n3\n0\n9\n0\n$EndNodeData\n";
    assert_eq!(warnings(empty), ["array `none` is left out: it has no values"]);
}

#[test]
fn gmsh_physical_groups_of_4_0() {
    let (name, bytes) = all().into_iter().find(|f| f.0 == "v40.msh").unwrap();
    assert_eq!(open_bytes(name, bytes).mesh.field("gmsh:physical").unwrap().values, [11.0; 6]);
    let Some(folder) = shared("formats") else { return };
    let mesh = open(folder.join("bracket_5k_40_ascii.msh")).mesh;
    assert!(mesh.field("gmsh:physical").unwrap().values.iter().all(|&v| v == 11.0));
}

/// The elements belong to the entity 0, which has no group of its own but is part of volume 7.
#[test]
fn gmsh_physical_groups_of_partitioned_meshes() {
    let (int, long) = (|v: i32| v.to_le_bytes().to_vec(), |v: u64| v.to_le_bytes().to_vec());
    let bounds = [0.0, 0.0, 0.0, 1.0, 1.0, 1.0].map(|x: f64| x.to_le_bytes()).concat();
    let counts = |points: u64| [long(points), long(0), long(0), long(1)].concat();
    let entities = [counts(0), int(7), bounds.clone(), long(1), int(11), long(0)].concat();
    let ghosts = [long(2), long(1), int(9), int(2)].concat();
    let point = [int(1), int(0), int(4), long(2), int(1), int(2), bounds[..24].to_vec(), long(0)].concat();
    let volume = [int(0), int(3), int(7), long(1), int(1), bounds, long(0), long(1), int(-5)].concat();
    let parts = [ghosts, counts(1), point, volume].concat();
    let sections =
        [b"$Entities\n", &entities[..], b"\n$EndEntities\n$PartitionedEntities\n", &parts, b"\n$EndPartitionedEntities\n$Nodes"].concat();
    let text = "$Entities\n0 0 0 1\n7 0 0 0 1 1 1 1 11 0\n$EndEntities\n$PartitionedEntities\n2\n1\n9 2\n1 0 0 1\n1 0 4 2 1 2 0 0 0 0\n\
                0 3 7 1 1 0 0 0 1 1 1 0 1 -5\n$EndPartitionedEntities\n$Nodes";
    for (name, sections) in [("v41b.msh", sections.as_slice()), ("v41.msh", text.as_bytes())] {
        let Loaded { mesh, report } = open_bytes(name, replace(name, b"$Nodes", sections));
        assert_eq!(mesh.field("gmsh:physical").unwrap().values, [11.0; 6], "{name}");
        assert!(report.warnings.is_empty(), "{report}");
    }
    let own = text.replace("1 1 1 0 1 -5", "1 1 1 1 12 1 -5");
    assert_eq!(open_bytes("own.msh", replace("v41.msh", b"$Nodes", own.as_bytes())).mesh.field("gmsh:physical").unwrap().values, [12.0; 6]);
}

#[test]
fn gmsh_counts_cells_of_several_physical_groups() {
    let again = replace("v22.msh", b"$Elements\n6\n", b"$Elements\n7\n70 4 2 5 0 80 40 20 10\n");
    let warnings = open_bytes("again.msh", again).report.warnings;
    // The repeated cell has no value in the file.
    let found = warnings.iter().filter(|w| w.starts_with("1 repeated cells: their volume")).count();
    assert_eq!((found, warnings.len()), (1, 2), "{warnings:?}");
}

#[test]
fn errors_have_the_numbers_of_the_file() {
    let error = |name: &str, old: &str, new: &str| {
        load_bytes(name, replace(name, old.as_bytes(), new.as_bytes()), &LoadOptions::default()).unwrap_err().to_string()
    };
    assert!(error("v22.msh", "20 1 0 0", "20 nan 0 0").contains("point 20 (of cell 0)"));
    assert!(error("text.mesh", "1 0 0 0", "inf 0 0 0").contains("point 2 (of cell 0)"));
    assert!(error("v22.msh", "10 4 2 0 0 10 20 40 80", "10 4 2 0").contains("the line ends where a tag of an element should be"));
    assert!(error("v22.msh", "10 4 2 0 0 10 20 40 80", "10 4 99").contains("more than the rest of the line can hold"));
    let folder = tempfile::tempdir().unwrap();
    let last = i64::MAX;
    write(&folder, "odd.node", format!("4 3 0 0\n{last} 0 0 0\n5 nan 0 0\n70 0 1 0\n6 0 0 1\n").as_bytes());
    let error = load(write(&folder, "odd.ele", format!("1 4 0\n0 {last} 5 70 6\n").as_bytes()), &LoadOptions::default()).unwrap_err();
    assert!(error.to_string().contains("point 5 (of cell 0)"), "{error}");
}

#[test]
fn keywords_of_binary_medit() {
    for (keyword, nodes, fate) in [(88, 16, Fate::Boundary), (90, 10, Fate::Boundary), (96, 20, Fate::Straightened), (98, 64, Fate::Split)]
    {
        let mut bytes = all().into_iter().find(|f| f.0 == "binary.meshb").unwrap().1;
        bytes.truncate(bytes.len() - 8);
        let past = bytes.len() as i32 + 12 + 4 * (nodes + 1);
        let cell = [[keyword, past, 1].to_vec(), (0..nodes).map(|i| [1, 2, 4, 3, 5, 6, 8, 7][i as usize % 8]).collect(), vec![0, 54, 0]];
        bytes.extend(cell.concat().into_iter().flat_map(i32::to_le_bytes));
        let report = open_bytes("high.meshb", bytes).report;
        let warned = report.warnings.iter().filter(|w| w.contains("1 cells of higher order")).count();
        assert_eq!(
            (report.count(fate), report.warnings.len(), warned),
            (1, warned, usize::from(fate != Fate::Boundary)),
            "{keyword}: {report}"
        );
    }
}

#[test]
fn tetrahedra_of_isaac_gym() {
    let report = open_bytes("a.obj", replace("isaac.tet", b"v 1 0 0", b"f 1 2 3\nvn 0 0 1\nf 1 2 3\nv 1 0 0")).report;
    assert_eq!((report.format.as_str(), report.tetrahedra), ("Isaac Gym .tet", 6));
    assert_eq!(report.warnings, ["lines that are not read, as they start with neither v nor t: f, vn"]);
    for (old, new, wanted) in [
        (&b"v 1 0 0"[..], &b"v 1 0"[..], "line 3: 2 numbers after `v` instead of 3"),
        (b"v 1 0 0", b"v 1 zero 0", "line 3: `zero` where a number should be"),
        (b"t 0 1 3 7", b"t 0 1 3 7 8", "line 11: 5 numbers after `t` instead of 4"),
        (b"t 0 1 3 7", b"t 0 1 3 8", "cell 0 (tetrahedron): names point 8, but points are 0 to 7"),
    ] {
        let error = load_bytes("a.tet", replace("isaac.tet", old, new), &LoadOptions::default()).unwrap_err().to_string();
        assert!(error.contains(wanted), "{error}");
    }
    let Some(folder) = shared("third_party") else { return };
    let Loaded { mesh, report } = open(folder.join("isaac_icosphere.tet"));
    assert_eq!((mesh.points.len(), mesh.tets.len(), report.negative * report.flat), (162, 427, 0));
}

#[test]
fn warnings_name_what_they_are_about() {
    let report = open_bytes("new.mesh", replace("text.mesh", b"MeshVersionFormatted 2", b"MeshVersionFormatted 9")).report;
    assert_eq!(report.warnings, ["version 9 of the format is unknown; the file is read like version 2"]);
    let report = open_bytes("odd.vtk", replace("ascii.vtk", b"CELL_TYPES 6\n10\n10", b"CELL_TYPES 6\n41\n55")).report;
    assert_eq!(
        report.warnings,
        ["volume cells of types that cannot be read are missing in the mesh: 1 convex point set, 1 parametric volume"]
    );
}

#[test]
fn two_sections_of_vertices_are_refused() {
    let text = replace("text.mesh", b"Tetrahedra", b"Vertices\n1\n0 0 0 0\nTetrahedra");
    let mut binary = all().into_iter().find(|f| f.0 == "binary.meshb").unwrap().1;
    // Adds the section of vertices a second time; every section holds the byte where it ends.
    let (start, end) = (20, 256);
    let section = binary[start..end].to_vec();
    let longer = |word: &mut [u8]| {
        let end = i32::from_le_bytes([word[0], word[1], word[2], word[3]]) + section.len() as i32;
        word.copy_from_slice(&end.to_le_bytes());
    };
    longer(&mut binary[end + 4..end + 8]);
    longer(&mut binary[start + 4..start + 8]);
    binary.splice(start..start, section);
    for (name, bytes) in [("twice.mesh", text), ("twice.meshb", binary)] {
        let error = load_bytes(name, bytes, &LoadOptions::default()).unwrap_err().to_string();
        assert!(error.contains("a second section Vertices"), "{error}");
    }
}

/// A block of a binary Gmsh file that is cut off is refused with what was announced and what there is room for.
#[test]
fn cut_blocks_say_how_much_is_there() {
    for (name, cells) in [("v22b.msh", 5 * 4 + 4), ("v41b.msh", 5 * 8)] {
        let whole = all().into_iter().find(|file| file.0 == name).unwrap().1;
        let end = whole.windows(13).position(|w| w == b"\n$EndElements").unwrap();
        let error = load_bytes(name, whole[..end - cells].to_vec(), &LoadOptions::default()).unwrap_err().to_string();
        assert!(error.contains("elements, but the rest of the file has room for "), "{name}: {error}");
        println!("{error}");
    }
}

/// The XML parser quotes the file in its messages, which must not reach the terminal as they are.
#[test]
fn messages_about_xml_are_short_and_printable() {
    for inside in ["\u{1b}[31m\u{7}\nx".to_owned(), "A".repeat(100_000)] {
        for (begin, end) in [("<UnstructuredGrid></P", ">"), ("<P", ">"), ("<UnstructuredGrid a='&", ";'>")] {
            let text = format!("<VTKFile type=\"UnstructuredGrid\">{begin}{inside}{end}");
            let error = load_bytes("a.vtu", text.into_bytes(), &LoadOptions::default()).unwrap_err().to_string();
            assert!(error.len() < 600 && !error.contains(char::is_control) && error.contains("line"), "{error}");
        }
    }
}

/// What single precision makes of values is said in every format.
#[test]
fn losses_by_rounding_are_remarked_on() {
    let near: Vec<f64> = (0..8).map(|i| 1e9 + f64::from(i)).collect();
    let (small, large) = (join(0..8), join(&near));
    let rows = |values: &[f64]| values.iter().zip(1..).map(|(v, i)| format!("{} {v}\n", 10 * i)).collect::<String>();
    let big = |keyword: &str, bytes: Vec<u8>| [format!("SCALARS s {keyword}\nLOOKUP_TABLE default\n").into_bytes(), bytes].concat();
    let floats = big("float", (0..8u8).flat_map(|v| f32::from(v).to_be_bytes()).collect());
    let doubles = big("double", near.iter().flat_map(|v| v.to_be_bytes()).collect());
    let collapsed = "array `s` has several values at 1000000000";
    for (name, old, new, warning) in [
        ("ascii.vtk", format!("float\n{small}").into_bytes(), format!("double\n{large}").into_bytes(), collapsed),
        ("binary.vtk", floats, doubles, collapsed),
        ("v22.msh", rows(&[0., 1., 2., 3., 4., 5., 6., 7.]).into_bytes(), rows(&near).into_bytes(), collapsed),
        ("ascii.vtk", b"0 1 2 3 4 5\n".into(), b"0 1 2 3 4 20000001\n".into(), "array `c` has whole numbers beyond 16777216"),
        ("v22.msh", b"10 4 2 0".into(), b"10 4 2 20000001".into(), "array `gmsh:physical` has whole numbers beyond 16777216"),
        ("text.mesh", b"7 8 5\n".into(), b"7 8 20000001\n".into(), "array `medit:ref (cells)` has whole numbers beyond 16777216"),
    ] {
        let warnings = open_bytes(name, replace(name, &old, &new)).report.warnings;
        assert!(warnings.len() == 1 && warnings[0].starts_with(warning), "{name}: {warnings:?}");
    }
    let vtu = |kind: &str, values: &str| {
        let text = String::from_utf8(crate::small::small("ascii.vtu")).unwrap();
        let text = text
            .replace("type=\"Float32\" Name=\"s\"", &format!("type=\"{kind}\" Name=\"s\""))
            .replace(&format!(">{small}<"), &format!(">{values}<"));
        open_bytes("a.vtu", text.into_bytes()).report.warnings
    };
    for kind in ["Float64", "Int64", "UInt32"] {
        assert!(vtu(kind, &large)[0].starts_with(collapsed), "{kind}");
    }
    let ids = vtu("Int64", &join((1..9).map(|i| 10_000_000 * i)));
    assert!(ids.len() == 1 && ids[0].starts_with("array `s` has whole numbers beyond 16777216"), "{ids:?}");
    assert_eq!([vtu("Int64", &join([20_000_001; 8])), vtu("Float64", &join([1e9 + 0.1; 8]))], [[""; 0]; 2]);
}
