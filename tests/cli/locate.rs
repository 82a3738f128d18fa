//! `olbvh locate` as its users run it.

use crate::program::{fails, has_keys, json, olbvh, text};
use olbvh::formats::{LoadOptions, load, write_mesh};
use olbvh::mesh::{Field, Mesh, On, kuhn};
use serde_json::Value;
use tempfile::TempDir;

#[test]
fn locate_finds_points_and_values() {
    let folder = TempDir::new().unwrap();
    std::fs::write(folder.path().join("p.csv"), "x,y,z\n0.5,0.25,0.125\n9,9,9\n1,1,1\n").unwrap();
    let result = json(folder.path(), &["locate", "kuhn:3,3,3", "p.csv", "-o", "o.csv", "--device", "cpu"]);
    has_keys(&result, &["points", "found", "seconds", "points_per_second"]);
    assert_eq!((result["points"].as_u64(), result["found"].as_u64()), (Some(3), Some(2)));
    let table = std::fs::read_to_string(folder.path().join("o.csv")).unwrap();
    assert_eq!(table.lines().count(), 4, "{table}");
    json(folder.path(), &["locate", "kuhn:3,3,3", "p.csv", "-o", "all.csv", "--all", "--device", "cpu"]);
    let table = std::fs::read_to_string(folder.path().join("all.csv")).unwrap();
    let of = |point: &str| table.lines().filter(|l| l.starts_with(point)).count();
    assert_eq!((of("0,"), of("1,"), of("2,")), (1, 0, 24), "one cell, none, all round an inner vertex: {table}");
    json(folder.path(), &["locate", "kuhn:3,3,3", "p.csv", "-o", "again.csv", "--all", "--reorder", "--device", "cpu"]);
    assert_eq!(table, std::fs::read_to_string(folder.path().join("again.csv")).unwrap());
    for ending in ["npy", "npz", "vtu", "json"] {
        json(folder.path(), &["locate", "kuhn:3,3,3", "p.csv", "-o", &format!("o.{ending}"), "--device", "cpu"]);
    }
    // So many points for the mesh that they are sorted or, with `--coherent`, located in runs.
    let table = |name: &str, more: &[&str]| {
        json(folder.path(), &[&["locate", "kuhn:1,1,1", "p.csv", "-o", name, "--device", "cpu"], more].concat());
        std::fs::read_to_string(folder.path().join(name)).unwrap()
    };
    assert_eq!(table("a.csv", &[]), table("b.csv", &["--coherent"]));
}

/// Fields by name, all of them, or the first one, which is called `value`.
#[test]
fn locate_interpolates_any_number_of_fields() {
    let folder = TempDir::new().unwrap();
    let mesh = "# vtk DataFile Version 3.0\none\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 float\n0 0 0 1 0 0 0 1 0 0 0 1\nCELLS 1 5\n\
                4 0 1 2 3\nCELL_TYPES 1\n10\nPOINT_DATA 4\nVECTORS v float\n0 3 4 0 3 4 0 3 4 0 3 4\nSCALARS owner float 1\nLOOKUP_TABLE default\n\
                2 2 2 2\nCELL_DATA 1\nSCALARS region float 1\nLOOKUP_TABLE default\n7\n";
    std::fs::write(folder.path().join("one.vtk"), mesh).unwrap();
    std::fs::write(folder.path().join("p.csv"), "0.25,0.25,0.25\n5,5,5\n").unwrap();
    for device in [&["--device", "cpu"][..], &[]] {
        for (more, header, first) in [
            (&[][..], "value", "5"),
            (&["--field", "v.z"], "value", "4"),
            (&["--field", "region", "--field", "v"], "region,v", "7,5"),
            (&["--all-fields"], "v,v.x,v.y,v.z,owner_,region", "5,0,3,4,2,7"),
        ] {
            let result = json(folder.path(), &[&["locate", "one.vtk", "p.csv", "-o", "o.csv"], device, more].concat());
            let table = std::fs::read_to_string(folder.path().join("o.csv")).unwrap();
            let without_coordinates = |line: &str| {
                line.split(',').enumerate().filter(|(i, _)| !(4..8).contains(i)).map(|(_, c)| c.to_owned()).collect::<Vec<_>>().join(",")
            };
            let nan = vec!["NaN"; first.split(',').count()].join(",");
            let wanted = [format!("x,y,z,owner,{header}"), format!("0.25,0.25,0.25,0,{first}"), format!("5,5,5,4294967295,{nan}")];
            assert_eq!(table.lines().map(without_coordinates).collect::<Vec<_>>(), wanted, "{more:?}");
            assert_eq!(result["fields"].as_array().unwrap().len(), first.split(',').count());
        }
    }
    fails(folder.path(), 2, &["locate", "one.vtk", "p.csv", "-o", "o.csv", "--field", "v", "--field", "w", "--device", "cpu"]);
}

#[test]
fn points_may_be_missing() {
    let folder = TempDir::new().unwrap();
    for (name, content) in [("empty.csv", ""), ("header.csv", "x,y,z\n")] {
        std::fs::write(folder.path().join(name), content).unwrap();
        let out = olbvh(folder.path(), &["locate", "kuhn:2,2,2", name, "-o", "o.csv", "--device", "cpu", "--json"]);
        let message = text(&out.stderr);
        assert_eq!((out.status.code(), message.contains(&format!("{name}: no points"))), (Some(0), true), "{message}");
        assert_eq!(serde_json::from_slice::<Value>(&out.stdout).unwrap()["points"], 0);
    }
}

/// A field and a vector, both linear, on the Kuhn grid.
fn with_linear_fields(mut mesh: Mesh) -> Mesh {
    let of = |f: fn([f32; 3]) -> f32| mesh.points.iter().map(|&p| f(p)).collect();
    let length: fn([f32; 3]) -> f32 = |[x, y, z]| (x * x + y * y + z * z).sqrt();
    let fields: Vec<(&str, Vec<f32>)> = vec![
        ("t", of(|[x, y, z]| x + 2.0 * y + 4.0 * z)),
        ("v", of(length)),
        ("v.x", of(|p| p[0])),
        ("v.y", of(|p| p[1])),
        ("v.z", of(|p| p[2])),
    ];
    mesh.fields = fields.into_iter().map(|(name, values)| Field { name: name.into(), on: On::Points, values }).collect();
    mesh
}

/// The points may be those of another mesh, of any format, which then has the fields of the first one.
#[test]
fn fields_go_from_one_mesh_to_another() {
    let folder = TempDir::new().unwrap();
    write_mesh(folder.path().join("from.vtu"), &with_linear_fields(kuhn([3, 3, 3]).unwrap())).unwrap();
    // A hexahedron and a point of no cell, a surface, and tetrahedra, of which a part lies outside.
    let hexahedron = "# vtk DataFile Version 3.0\nto\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 9 double\n2 2 2 1 0 0 1 1 0 0 1 0 0 0 1 \
                      1 0 1 1 1 1 0 1 1 0 0 0\nCELLS 1 9\n8 8 1 2 3 4 5 6 7\nCELL_TYPES 1\n12\n";
    let triangle = "# vtk DataFile Version 3.0\nto\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 3 float\n0 0 0 1 0 0 9 1 0\nCELLS 1 4\n\
                    3 0 1 2\nCELL_TYPES 1\n5\n";
    std::fs::write(folder.path().join("hexahedron.vtk"), hexahedron).unwrap();
    let faces = "31 6 4 8 1 2 3 4 4 5 6 7 4 8 1 5 4 4 1 2 6 5 4 2 3 7 6 4 3 8 4 7";
    let polyhedron = hexahedron.replace("1 9\n8 8 1 2 3 4 5 6 7", &format!("1 32\n{faces}")).replace("1\n12", "1\n42");
    std::fs::write(folder.path().join("polyhedron.vtk"), polyhedron).unwrap();
    std::fs::write(folder.path().join("triangle.vtk"), triangle).unwrap();
    let mut beyond = kuhn([2, 2, 2]).unwrap();
    beyond.points.iter_mut().for_each(|p| p[0] = 1.5 * p[0] + 0.25);
    write_mesh(folder.path().join("beyond.vtu"), &beyond).unwrap();
    let locate = |to: &str, out: &str| json(folder.path(), &["locate", "from.vtu", to, "-o", out, "--all-fields", "--device", "cpu"]);
    for (to, points, found) in [("hexahedron.vtk", 9, 9), ("polyhedron.vtk", 10, 10), ("beyond.vtu", 27, 18), ("kuhn:1,2,3", 24, 24)] {
        let result = locate(to, "out.vtu");
        assert_eq!((result["points"].as_u64(), result["found"].as_u64()), (Some(points), Some(found)), "{to}");
        let to = load(if to.contains(':') { to.into() } else { folder.path().join(to) }, &LoadOptions::default()).unwrap().mesh;
        let out = load(folder.path().join("out.vtu"), &LoadOptions::default()).unwrap().mesh;
        assert_eq!((&out.points, &out.tets), (&to.points, &to.tets));
        for (i, &[x, y, z]) in to.points.iter().enumerate() {
            let is = |name: &str, wanted: f32| {
                let value = out.field(name).unwrap_or_else(|| panic!("no field {name}")).values[i];
                assert!(if x > 3.0 { value.is_nan() } else { (value - wanted).abs() < 1e-5 }, "{name} at {x} {y} {z}: {value}");
            };
            is("t", x + 2.0 * y + 4.0 * z);
            // One vector again, whose length is read from its components.
            [("v.x", x), ("v.y", y), ("v.z", z)].into_iter().for_each(|(name, wanted)| is(name, wanted));
            is("v", (x * x + y * y + z * z).sqrt());
        }
    }
    // Cells that cannot be read are missing in the result, which is told where it has cells.
    let with_set = hexahedron.replace("CELLS 1 9\n", "CELLS 2 14\n4 0 1 2 3\n").replace("CELL_TYPES 1\n", "CELL_TYPES 2\n41 ");
    for (content, out, is_told) in [(hexahedron, "out.vtu", false), (&with_set, "out.vtu", true), (&with_set, "out.csv", false)] {
        std::fs::write(folder.path().join("set.vtk"), content).unwrap();
        let run = olbvh(folder.path(), &["locate", "from.vtu", "set.vtk", "-o", out, "--device", "cpu"]);
        let told = text(&run.stderr);
        assert_eq!(told.contains("set.vtk: 1 convex point set: NOT READ, so the mesh has holes there"), is_told, "{out}: {told}");
    }
    // A mesh without volume cells has its points located, too.
    let result = locate("triangle.vtk", "out.vtu");
    assert_eq!((result["points"].as_u64(), result["found"].as_u64()), (Some(3), Some(2)));
    let written = std::fs::read(folder.path().join("out.vtu")).unwrap();
    assert!(String::from_utf8_lossy(&written).contains("NumberOfPoints=\"3\" NumberOfCells=\"3\""));
    // In a table, the points are in the order of the file.
    locate("hexahedron.vtk", "out.csv");
    let table = std::fs::read_to_string(folder.path().join("out.csv")).unwrap();
    assert!(table.lines().nth(1).unwrap().starts_with("2,2,2,") && table.lines().count() == 10, "{table}");
    let message = fails(folder.path(), 3, &["locate", "from.vtu", "missing.vtu", "-o", "out.vtu", "--device", "cpu"]);
    assert!(message.contains("missing.vtu: there is no such file; correct its name or folder"), "{message}");
    let message = fails(folder.path(), 3, &["locate", "from.vtu", "nowhere/in.vtu", "-o", "out.vtu", "--device", "cpu"]);
    assert!(message.contains("nowhere/in.vtu: there is no folder nowhere; correct the path, or make the folder"), "{message}");
}

/// Points outside get what is closest, with the distance, if they ask for it.
#[test]
fn points_outside_have_the_closest_place() {
    let folder = TempDir::new().unwrap();
    write_mesh(folder.path().join("from.vtu"), &with_linear_fields(kuhn([3, 3, 3]).unwrap())).unwrap();
    std::fs::write(folder.path().join("p.csv"), "1.5,1.25,1\n1,2,3.25\n-0.3,3.4,2\n1,1,3.75\n4,4,4\n").unwrap();
    let locate = |within: &[&str], out: &str, device: &[&str]| {
        let result = json(folder.path(), &[&["locate", "from.vtu", "p.csv", "-o", out, "--field", "t"], within, device].concat());
        (result["found"].as_u64().unwrap(), result["beside"].as_u64().unwrap(), std::fs::read_to_string(folder.path().join(out)).unwrap())
    };
    for device in [&["--device", "cpu"][..], &[]] {
        let (found, beside, table) = locate(&["--within", "0.51"], "o.csv", device);
        assert_eq!((found, beside), (1, 2), "{table}");
        let rows: Vec<Vec<f32>> = table.lines().skip(1).map(|line| line.split(',').map(|v| v.parse().unwrap()).collect()).collect();
        assert!(table.starts_with("x,y,z,owner,b0,b1,b2,b3,value,distance\n"), "{table}");
        let near = |a: f32, b: f32| a.is_nan() && b.is_nan() || (a - b).abs() < 1e-5;
        let nan = f32::NAN;
        for (row, (value, distance)) in rows.iter().zip([(8.0, 0.0), (17.0, 0.25), (14.0, 0.5), (nan, nan), (nan, nan)]) {
            assert!(near(row[8], value) && near(row[9], distance), "{row:?}: {value} and {distance}");
            assert_eq!(row[3] < 1000.0, !value.is_nan(), "{row:?}");
        }
        let (found, beside, table) = locate(&[], "without.csv", device);
        assert!((found, beside) == (1, 0) && !table.contains("distance"), "{table}");
    }
    for wrong in ["-1", "nan", "near"] {
        fails(folder.path(), 2, &["locate", "from.vtu", "p.csv", "-o", "o.csv", "--within", wrong, "--device", "cpu"]);
    }
}

/// A deformed mesh is asked about instead of the mesh itself.
#[test]
fn meshes_are_deformed_by_a_vector() {
    let folder = TempDir::new().unwrap();
    let mut mesh = with_linear_fields(kuhn([3, 3, 3]).unwrap());
    mesh.fields.iter_mut().for_each(|field| field.values[0] = if field.name.starts_with('v') { f32::NAN } else { field.values[0] });
    write_mesh(folder.path().join("from.vtu"), &mesh).unwrap();
    std::fs::write(folder.path().join("p.csv"), "5,4,2\n").unwrap();
    // The vector is the place of each point, so the mesh is twice as large, with the values of half the place.
    for (warp, wanted) in [("v", 10.5), ("v=1", 10.5), ("v = 3", 5.25)] {
        let out = olbvh(folder.path(), &["locate", "from.vtu", "p.csv", "-o", "o.csv", "--warp", warp, "--field", "t", "--device", "cpu"]);
        let message = text(&out.stderr);
        assert_eq!((out.status.code(), message.contains("1 point left in place")), (Some(0), true), "{message}");
        let table = std::fs::read_to_string(folder.path().join("o.csv")).unwrap();
        let value: f32 = table.lines().nth(1).unwrap().rsplit(',').next().unwrap().parse().unwrap();
        assert!((value - wanted).abs() < 1e-4, "{warp}: {table}");
    }
    for wrong in ["w", "t", "v=", "v=much", "v=inf"] {
        let arguments = ["locate", "from.vtu", "p.csv", "-o", "o.csv", "--warp", wrong, "--device", "cpu"];
        assert!(fails(folder.path(), 2, &arguments).contains("--warp"), "{wrong}");
    }
}
