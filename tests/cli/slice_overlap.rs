//! `olbvh slice` and `olbvh overlap` on the command line: files, JSON keys and refusals. They run on the processor, so
//! that no driver is needed.

use serde_json::Value;
use std::path::Path;
use std::process::Command;

fn olbvh(folder: &Path, arguments: &[&str]) -> (i32, Value, String) {
    let output =
        Command::new(env!("CARGO_BIN_EXE_olbvh")).current_dir(folder).args(arguments).args(["--device", "cpu", "--json"]).output().unwrap();
    let json = serde_json::from_slice(&output.stdout).unwrap_or(Value::Null);
    (output.status.code().unwrap(), json, String::from_utf8_lossy(&output.stderr).into_owned())
}

fn files(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn slices_become_files() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let (code, json, text) = olbvh(folder, &["slice", "kuhn:4,3,2", "-o", "a.npy", "--layers", "3", "--size", "10x7", "--owners"]);
    assert_eq!(code, 0, "{text}");
    let count = |key: &str| json[key].as_u64().unwrap();
    assert_eq!((count("layers"), count("inside") + count("touched") + count("empty")), (3, 210));
    assert!(json["seconds"].is_number());
    assert_eq!(files(folder), ["a.kind.npy", "a.npy", "a.owner.npy"]);
    let kinds = std::fs::read(folder.join("a.kind.npy")).unwrap();
    let inside = kinds[kinds.len() - 210..].iter().map(|&k| u64::from(k == 2)).sum::<u64>();
    assert_eq!(inside, count("inside"));
    assert_eq!(
        (&json["origin"], &json["axis"]),
        (&serde_json::json!([0.2, 3.0 / 14.0, 1.0 / 3.0].map(|x: f64| f64::from(x as f32))), &"z".into())
    );
    let near = |key: &str, wanted: [f64; 3]| (0..3).all(|i| (json[key][i].as_f64().unwrap() - wanted[i]).abs() < 1e-6);
    assert!(near("spacing", [0.4, 3.0 / 7.0, 2.0 / 3.0]) && json["axes"][2] == serde_json::json!([0.0, 0.0, 1.0]), "{json:#}");
    assert!((json["thickness"].as_f64().unwrap() - 2.0 / 3.0).abs() < 1e-6, "{json:#}");
    for (name, layers, first, last) in
        [("b.vti", "2", "b.vti", "b.vti"), ("c.png", "1", "c.png", "c.png"), ("d.png", "2", "d-0000.png", "d-0001.png")]
    {
        let normal = ["slice", "kuhn:4,3,2", "-o", name, "--layers", layers, "--size", "8", "--normal", "1,2,3"];
        let (code, json, text) = olbvh(folder, &normal);
        assert_eq!((code, &json["file"], &json["last_file"]), (0, &first.into(), &last.into()), "{name}: {text}");
        assert!(json["axis"].is_null());
    }
    let (code, json, text) = olbvh(folder, &["slice", "kuhn:4,3,2", "-o", "e.svx", "--size", "8"]);
    assert_eq!((code, json["layers"].as_u64(), json["height"].as_u64()), (0, Some(4), Some(6)), "{text}");
    let made = ["a.kind.npy", "a.npy", "a.owner.npy", "b.vti", "c.png", "d-0000.png", "d-0001.png", "e.svx"];
    assert_eq!(files(folder), made);
    for wrong in [
        &["slice", "kuhn:4,3,2", "-o", "x.obj"][..],
        &["slice", "kuhn:4,3,2", "-o", "x.npy", "--thickness", "0"],
        &["slice", "kuhn:4,3,2", "-o", "x.npy", "--thickness", "1e9"],
        &["slice", "kuhn:4,3,2", "-o", "x.npy", "--layers", "0"],
        &["slice", "kuhn:4,3,2", "-o", "x.npy", "--normal", "0,0,0"],
        &["slice", "kuhn:4,3,2", "-o", "x.npy", "--field", "heat"],
        &["slice", "kuhn:4,3,2", "-o", "x.png", "--owners"],
        &["slice", "kuhn:4,3,2", "-o", "x.vti", "--tf", "viridis"],
        &["slice", "kuhn:4,3,2", "-o", "x.npy", "--range", "0:1"],
        &["slice", "kuhn:4,3,2", "-o", "x.png", "--unit", "1"],
        &["slice", "kuhn:4,3,2", "-o", "x.svx", "--thickness", "0.1"],
        &["slice", "kuhn:4,3,2", "-o", "x.npy", "--size", "0x4"],
        &["slice", "kuhn:4,3,2", "-o", "x.npy", "--memory", "1GiB"],
        &["slice", "kuhn:4,3,2", "-o", "x.npy", "--normal", "1,0,0,foo"],
        &["slice", "kuhn:4,3,2", "-o", "x.npy", "--size", "100000x100000", "--layers", "1000"],
        &["slice", "kuhn:4,3,2", "-o", "x.npy", "--target", "nvidia"],
        &["slice", "kuhn:4,3,2", "-o", "x.svx", "--unit", "0"],
        &["slice", "kuhn:4,3,2", "-o", "-"],
    ] {
        let (code, _, text) = olbvh(folder, wrong);
        assert!(code == 2 && !text.is_empty(), "{wrong:?}: {code} {text}");
    }
    assert_eq!(files(folder), made, "a refused slice leaves nothing");
}

/// A file of colours serves pictures of slices, too; its range is that of the colours.
#[test]
fn slices_have_the_colours_of_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    std::fs::write(folder.join("t.json"), r##"{"colors": [[0, "#f00"], [1, "#00f"]], "range": [1000, 2000]}"##).unwrap();
    let (code, _, text) = olbvh(folder, &["slice", "kuhn:4,3,2", "-o", "a.png", "--size", "8", "--tf", "t.json"]);
    assert_eq!(code, 0, "{text}");
    let mut picture = png::Decoder::new(std::io::BufReader::new(std::fs::File::open(folder.join("a.png")).unwrap())).read_info().unwrap();
    let mut pixels = vec![0; picture.output_buffer_size().unwrap()];
    picture.next_frame(&mut pixels).unwrap();
    assert!(pixels.chunks_exact(4).all(|pixel| pixel == [255, 0, 0, 255]), "the field lies below the range");
    std::fs::write(folder.join("t.json"), "{\"map\": ").unwrap();
    let (code, _, text) = olbvh(folder, &["slice", "kuhn:4,3,2", "-o", "b.png", "--tf", "t.json"]);
    assert!(code == 3 && text.contains("error: t.json: line 1, column 8: the file ends in the middle"), "{code} {text}");
}

/// Requests that look like mistakes are carried out, with a remark.
#[test]
fn remarks() {
    let folder = tempfile::tempdir().unwrap();
    for (arguments, wanted) in [
        (
            &["slice", "kuhn:4,3,2", "-o", "a.npy", "--size", "8", "--at", "90"][..],
            "along z the mesh lies from 0 to 2, the layers from 89.75 to 90.25",
        ),
        (&["slice", "kuhn:4,3,2", "-o", "a.svx", "--size", "8", "--layers", "2"], "2 of the 4 layers"),
        (&["render", "kuhn:4,3,2", "-o", "a.png", "--size", "8", "--iso", "7,9"], "no surface to be seen"),
        (&["render", "kuhn:4,3,2", "-o", "a.png", "--size", "8", "--iso", "0.2,9"], ""),
        (&["slice", "kuhn:4,3,2", "-o", "a.svx", "--size", "8"], ""),
        (
            &["overlap", "kuhn:4,3,2", "kuhn:1,1,1", "--move-b", "0,0,9", "-o", "a.json"],
            "no cells intersect; A reaches from (0, 0, 0) to (4, 3, 2), B from (0, 0, 9) to (1, 1, 10)",
        ),
        (&["overlap", "kuhn:4,3,2", "kuhn:1,1,1", "-o", "a.json"], ""),
        (&["devices"], "these are all devices"),
    ] {
        let (code, _, text) = olbvh(folder.path(), arguments);
        assert!(code == 0 && text.contains(wanted) && text.is_empty() == wanted.is_empty(), "{arguments:?}: {text}");
    }
}

#[test]
fn results_larger_than_the_disk_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let huge = ["slice", "kuhn:4,3,2", "-o", "a.npy", "--size", "1000000x1000000"];
    let (code, _, text) = olbvh(folder.path(), &huge);
    assert!(code == 1 && text.contains("a.npy: the result takes 4.55 TiB, and its disk has "), "{code} {text}");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn inputs_are_not_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let mesh = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/bracket_50k.vtu");
    std::fs::copy(mesh, folder.join("m.vtu")).unwrap();
    std::fs::write(folder.join("p.csv"), "1,2,3\n").unwrap();
    let inputs = ["m.vtu", "p.csv"].map(|name| std::fs::read(folder.join(name)).unwrap());
    let list = |kind: &str, entries: &str| format!("<VTKFile type='{kind}'><{kind}>{entries}</{kind}></VTKFile>");
    let steps = "<DataSet timestep='0' file='m.vtu'/><DataSet timestep='1' file='other.vtu'/>";
    std::fs::write(folder.join("list.pvd"), list("Collection", steps)).unwrap();
    std::fs::write(folder.join("blocks.vtm"), list("vtkMultiBlockDataSet", "<DataSet index='0' file='list.pvd'/>")).unwrap();
    for wrong in [
        &["overlap", "m.vtu", "kuhn:1,1,1", "-o", "m.vtu"][..],
        &["overlap", "kuhn:1,1,1", "m.vtu", "-o", "./m.vtu"],
        &["locate", "m.vtu", "p.csv", "-o", "m.vtu"],
        &["locate", "m.vtu", "p.csv", "-o", "p.csv"],
        &["conformance", "m.vtu", "--junit", "m.vtu"],
        &["locate", "list.pvd", "p.csv", "-o", "m.vtu", "--time-step", "last"],
        &["locate", "kuhn:1,1,1", "blocks.vtm", "-o", "m.vtu"],
        &["overlap", "blocks.vtm", "kuhn:1,1,1", "-o", "m.vtu"],
    ] {
        let (code, _, text) = olbvh(folder, wrong);
        assert!(code == 2 && text.contains("would replace"), "{wrong:?}: {code} {text}");
    }
    let (code, _, text) = olbvh(folder, &["conformance", "m.vtu", "--junit", "p.csv"]);
    assert!(code == 2 && text.contains("p.csv: a JUnit report is an .xml file"), "{code} {text}");
    assert_eq!(["m.vtu", "p.csv"].map(|name| std::fs::read(folder.join(name)).unwrap()), inputs);
}

#[test]
fn overlaps_become_files() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let read = |name: &str| serde_json::from_slice::<Value>(&std::fs::read(folder.join(name)).unwrap()).unwrap();
    let (code, json, text) = olbvh(folder, &["overlap", "kuhn:3,3,3", "kuhn:2,2,2", "-o", "a.json", "--pairs", "--move-b", "1.3,1.2,1.1"]);
    assert_eq!(code, 0, "{text}");
    let result = read("a.json");
    let length = |key: &str| result[key].as_array().unwrap().len() as u64;
    for key in ["a", "b", "pairs"] {
        assert_eq!(json[key].as_u64().unwrap(), length(key), "{key}");
        assert!(length(key) > 10, "{key}");
    }
    assert!(json["narrow_tests"].as_u64().unwrap() >= length("pairs") && json["seconds"].is_number() && json["narrow_share"].is_number());
    let (_, sets, _) = olbvh(folder, &["overlap", "kuhn:3,3,3", "kuhn:2,2,2", "-o", "b.json", "--move-b", "1.3,1.2,1.1", "--reorder"]);
    assert_eq!((&sets["a"], &sets["b"], &sets["pairs"]), (&json["a"], &json["b"], &Value::Null));
    assert_eq!((&read("b.json")["a"], &read("b.json")["b"]), (&result["a"], &result["b"]), "in another order the ids are the same");
    // Turned by 90° about its own centre, a cube covers what it covered before; moved away, it covers nothing.
    let (_, turned, _) = olbvh(folder, &["overlap", "kuhn:2,2,2", "kuhn:2,2,2", "-o", "c.json", "--rotate-b", "z,90"]);
    assert_eq!((turned["a"].as_u64(), turned["b"].as_u64()), (Some(48), Some(48)));
    let (code, away, _) = olbvh(folder, &["overlap", "kuhn:2,2,2", "kuhn:2,2,2", "-o", "d.vtu", "--move-b", "0,-9,0"]);
    assert_eq!((code, away["a"].as_u64(), away["narrow_tests"].as_u64()), (0, Some(0), Some(0)));
    let (code, _, text) = olbvh(folder, &["overlap", "kuhn:2,2,2", "kuhn:2,2,2", "-o", "x.vtu", "--pairs"]);
    assert!(code == 2 && text.contains("--pairs needs a .json file"), "{code} {text}");
    for (wrong, part) in [
        (["--rotate-b", "z"], "--rotate-b"),
        (["--rotate-b", "0,0,0,5"], "--rotate-b"),
        (["--move-b", "1,2"], "--move-b"),
        (["--move-b", "1,2,inf"], "--move-b"),
        (["--move-b", "1e39,0,0"], "--move-b: coordinates of B"),
        (["--move-b", "0,5e37,0"], "2^125"),
    ] {
        let (code, _, text) = olbvh(folder, &[&["overlap", "kuhn:2,2,2", "kuhn:2,2,2", "-o", "x.json"], &wrong[..]].concat());
        assert!(code == 2 && text.contains(part), "{wrong:?}: {code} {text}");
    }
    assert_eq!(files(folder), ["a.json", "b.json", "c.json", "d.vtu"]);
}

/// The unit cube as text: a mesh with these cells, each with its type, and a field with the value 0.1 everywhere. Its
/// last point lies far away.
fn cube(cells: &[(&str, u32)]) -> String {
    let points = "0 0 0 1 0 0 1 1 0 0 1 0 0 0 1 1 0 1 1 1 1 0 1 1 9.1 9 9";
    let n = cells.iter().map(|(ids, _)| ids.split(' ').count()).sum::<usize>();
    let [ids, types] = [0, 1].map(|part| {
        let of = |&(ids, kind): &(&str, u32)| if part == 0 { format!("{} {ids}", ids.split(' ').count()) } else { kind.to_string() };
        cells.iter().map(of).collect::<Vec<_>>().join("\n")
    });
    let values = "0.1 ".repeat(9);
    format!(
        "# vtk DataFile Version 3.0\ncube\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 9 float\n{points}\nCELLS {} {}\n{ids}\n\
         CELL_TYPES {}\n{types}\nPOINT_DATA 9\nSCALARS t float 1\nLOOKUP_TABLE default\n{values}\n",
        cells.len(),
        n + cells.len(),
        cells.len(),
    )
}

/// A point that no cell has does not move the centre about which B is rotated.
#[test]
fn rotations_are_about_the_centre_of_the_cells() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    std::fs::write(folder.join("b.vtk"), cube(&[("0 1 2 3 4 5 6 7", 12)])).unwrap();
    let posed = |more: &[&str]| {
        let (code, json, text) = olbvh(folder, &[&["overlap", "kuhn:1,1,1", "b.vtk", "-o", "a.json"], more].concat());
        assert_eq!(code, 0, "{text}");
        [&json["a"], &json["b"]].map(|n| n.as_u64().unwrap())
    };
    assert_eq!(posed(&["--rotate-b", "z,90"]), [6, 1]);
    assert_eq!(posed(&["--rotate-b", "z,90", "--move-b", "0,0,1.5"]), [0, 0]);
}

/// Where the mesh is, but no value of the field.
#[test]
fn slices_without_values_are_remarked_on() {
    let folder = tempfile::tempdir().unwrap();
    let points = "POINTS 8 float 0 0 0 1 0 0 0 1 0 0 0 1 0 0 5 1 0 5 0 1 5 0 0 6";
    let head = "# vtk DataFile Version 3.0\ntwo\nASCII\nDATASET UNSTRUCTURED_GRID";
    let file = |values: &str| {
        let data = format!("CELL_DATA 2 SCALARS t float 1\nLOOKUP_TABLE default\n{values}");
        format!("{head}\n{points}\nCELLS 2 10 4 0 1 2 3 4 4 5 6 7 CELL_TYPES 2 10 10\n{data}\n")
    };
    let some = "no voxel has a value: t has none where the voxels are";
    for (values, at, wanted) in [
        ("nan nan", "0.3", "no voxel has a value: t has none anywhere"),
        ("1 nan", "5.3", some),
        ("1 nan", "0.3", ""),
        ("1 nan", "3", "all"),
    ] {
        std::fs::write(folder.path().join("two.vtk"), file(values)).unwrap();
        for output in ["a.png", "a.npy"] {
            let (code, _, text) = olbvh(folder.path(), &["slice", "two.vtk", "-o", output, "--field", "t", "--size", "9", "--at", at]);
            let remarks: Vec<&str> = text.lines().filter(|line| line.contains("voxel")).collect();
            assert_eq!((code, remarks.len()), (0, usize::from(!wanted.is_empty())), "{text}");
            assert!(remarks.iter().all(|remark| remark.starts_with(wanted)), "{text}");
        }
    }
}

/// Bad cells are left out, but never silently.
#[test]
fn bad_cells_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    std::fs::write(folder.join("good.vtk"), cube(&[("0 1 3 4", 10)])).unwrap();
    std::fs::write(folder.join("one.vtk"), cube(&[("0 1 3 4", 10), ("0 1 1 4", 10)])).unwrap();
    std::fs::write(folder.join("two.vtk"), cube(&[("2 2 2 2", 10), ("0 1 3 4", 10), ("0 1 1 4", 10)])).unwrap();
    std::fs::write(folder.join("p.csv"), "0.1,0.1,0.1\n").unwrap();
    let (one, two) = ("one.vtk: 1 bad cell is left out (`olbvh info --bad-cells` lists it)", "two.vtk: 2 bad cells are left out");
    for (arguments, bad, remarks) in [
        (&["locate", "good.vtk", "p.csv", "-o", "o.csv"][..], 0, &[][..]),
        (&["locate", "one.vtk", "p.csv", "-o", "o.csv"], 1, &[one]),
        (&["locate", "two.vtk", "p.csv", "-o", "o.csv", "--all"], 2, &[two]),
        (&["slice", "two.vtk", "-o", "s.npy", "--size", "4"], 2, &[two]),
        (&["overlap", "one.vtk", "two.vtk", "-o", "o.json"], 3, &[one, two]),
        (&["overlap", "one.vtk", "good.vtk", "-o", "o.json", "--pairs"], 1, &[one]),
    ] {
        let (code, json, text) = olbvh(folder, arguments);
        assert_eq!((code, json["bad_cells"].as_u64()), (0, Some(bad)), "{arguments:?}: {text}");
        assert!(text.lines().count() == remarks.len() && remarks.iter().all(|remark| text.contains(remark)), "{arguments:?}: {text}");
        let (_, json, text) = olbvh(folder, &[arguments, &["--quiet"]].concat());
        assert!(text.is_empty() && json["bad_cells"] == bad, "{arguments:?}: {text}");
    }
}

/// Numbers of single precision have the digits that people gave them.
#[test]
fn json_numbers_are_short() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    std::fs::write(folder.join("m.vtk"), cube(&[("0 1 3 8", 10)])).unwrap();
    std::fs::write(folder.join("p.csv"), "0.1,0.1,0.1\n").unwrap();
    let (_, json, text) = olbvh(folder, &["locate", "m.vtk", "p.csv", "-o", "o.csv"]);
    assert_eq!(json["tolerance"], 1e-5, "{text}");
    let (_, json, text) = olbvh(folder, &["info", "m.vtk", "--alpha", "0.4"]);
    let shown = [&json["fields"][0]["min"], &json["fields"][0]["max"], &json["bounds"]["max"][0], &json["tree"]["alpha"]];
    assert_eq!(shown.map(|n| n.as_f64().unwrap()), [0.1, 0.1, 9.1, 0.4], "{text}");
}

/// Names of fields are any text; on a terminal they neither begin lines nor control it.
#[test]
fn names_are_shown_on_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let of_points = cube(&[("0 1 3 4", 10)]).replace("SCALARS t", "SCALARS a%0aforged%1b[2J");
    std::fs::write(folder.join("points.vtk"), &of_points).unwrap();
    std::fs::write(
        folder.join("cells.vtk"),
        cube(&[("0 1 3 4", 10); 9]).replace("POINT_DATA 9\nSCALARS t", "CELL_DATA 9\nSCALARS a%0aforged%1b[2J"),
    )
    .unwrap();
    for arguments in [
        &["info", "points.vtk"][..],
        &["slice", "points.vtk", "-o", "a.npy", "--field", "t"],
        &["locate", "cells.vtk", "p.csv", "-o", "a.csv", "--field", "t"],
        &["slice", "cells.vtk", "-o", "a.svx", "--size", "4"],
    ] {
        let output =
            Command::new(env!("CARGO_BIN_EXE_olbvh")).current_dir(folder).args(arguments).args(["--device", "cpu"]).output().unwrap();
        let [told, remarks] = [output.stdout, output.stderr].map(|text| String::from_utf8(text).unwrap());
        let text = told + &remarks;
        assert!(text.contains(r"a\nforged\u{1b}[2J") && !text.contains('\u{1b}'), "{arguments:?}: {text}");
    }
    let (_, json, text) = olbvh(folder, &["info", "points.vtk"]);
    assert_eq!(json["fields"][0]["name"], "a\nforged\u{1b}[2J", "{text}");
}

/// The cells that intersect, with their own points only, and vectors as vectors.
#[test]
fn overlaps_become_meshes() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let mesh = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/bracket_50k.vtu");
    let (code, found, text) = olbvh(folder, &["overlap", mesh, "kuhn:3,3,3", "-o", "part.vtu"]);
    assert_eq!(code, 0, "{text}");
    let (_, part, text) = olbvh(folder, &["info", "part.vtu"]);
    assert_eq!(part["cells"], found["a"], "{text}");
    let (_, whole, _) = olbvh(folder, &["info", mesh]);
    let [few, many] = [&part, &whole].map(|info| info["points"].as_u64().unwrap());
    assert!(few > 4 && few < many / 10 && part["volume"].as_f64() < whole["volume"].as_f64(), "{few} points of {many}");
    let file = std::fs::read(folder.join("part.vtu")).unwrap();
    let file = String::from_utf8_lossy(&file);
    assert!(file.contains("Name=\"displacement\" NumberOfComponents=\"3\"") && !file.contains("displacement.x"));
}

/// Points in other units than the mesh are told where the mesh is.
#[test]
fn points_beside_the_mesh_learn_its_bounds() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    for (point, told) in [("50,50,50", true), ("0.5,0.5,0.5", false)] {
        std::fs::write(folder.join("p.csv"), point).unwrap();
        let (code, _, text) = olbvh(folder, &["locate", "kuhn:1,2,3", "p.csv", "-o", "o.csv"]);
        assert_eq!((code, text.contains("from (0, 0, 0) to (1, 2, 3)")), (0, told), "{text}");
    }
}
