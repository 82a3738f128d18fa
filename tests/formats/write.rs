//! Files that are written can be read back.

use std::path::Path;

use olbvh::Error;
use olbvh::formats::{
    LoadOptions, Located, OutputFormat, SliceGrid, SliceWriter, load, load_points, write_json, write_located, write_mesh, write_npy,
    write_png,
};
use olbvh::mesh::{Field, Mesh, On, kuhn};

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<_> = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

/// The text of the header and the data of a `.npy` file.
fn split_npy(bytes: &[u8]) -> (String, &[u8]) {
    assert_eq!(&bytes[..8], b"\x93NUMPY\x01\x00");
    let end = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    assert_eq!(end % 64, 0);
    assert_eq!(bytes[end - 1], b'\n');
    (String::from_utf8(bytes[10..end].to_vec()).unwrap(), &bytes[end..])
}

#[test]
fn meshes() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.vtu");
    let mut mesh = load("kuhn:20,20,20,jitter=0.3,seed=3", &LoadOptions::default()).unwrap().mesh;
    let ugly = "a\nb\t<x attr=\"1\">&amp; \u{1}'\u{202e}🚀";
    let cells = (0..mesh.tets.len()).map(|i| if i == 3 { f32::NAN } else { i as f32 }).collect();
    mesh.fields.push(Field { name: ugly.into(), on: On::Cells, values: cells });
    write_mesh(&path, &mesh).unwrap();
    let read = load(&path, &LoadOptions::default()).unwrap();
    let bits = |m: &Mesh| m.fields.iter().map(|f| (f.on, f.values.iter().map(|v| v.to_bits()).collect::<Vec<_>>())).collect::<Vec<_>>();
    assert_eq!((&read.mesh.points, &read.mesh.tets), (&mesh.points, &mesh.tets));
    assert_eq!(bits(&read.mesh), bits(&mesh));
    assert_eq!(read.mesh.fields[1].name, ugly.replace('\u{1}', "\u{fffd}"));
    let far = Mesh { origin: [1e7, 0.25, -3e8], ..mesh };
    write_mesh(&path, &far).unwrap();
    let read = load(&path, &LoadOptions::default()).unwrap();
    assert_eq!(read.report.bounds[0], [1e7, 0.25, -3e8]);
    assert_eq!(read.mesh.points[100][0], far.points[100][0]);
    assert_eq!(names(folder.path()), ["out.vtu"]);
}

/// The same mesh with its points and cells in the opposite order.
fn reversed(mut mesh: Mesh) -> Mesh {
    let (points, cells) = (mesh.points.len() as u32, mesh.tets.len() as u32);
    mesh.points.reverse();
    mesh.tets.reverse();
    mesh.tets.as_flattened_mut().iter_mut().for_each(|v| *v = points - 1 - *v);
    mesh.fields.iter_mut().for_each(|field| field.values.reverse());
    Mesh { cell_ids: Some((0..cells).rev().collect()), point_ids: Some((0..points).rev().collect()), ..mesh }
}

/// Ids are those of the file that was read last, however often a mesh is written and read.
#[test]
fn ids_replace_those_of_earlier_files() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.vtu");
    let mut mesh = load("kuhn:1,2,3", &LoadOptions::default()).unwrap().mesh;
    let others = mesh.points.iter().map(|p| p[0]).collect();
    mesh.fields = vec![Field { name: "other".into(), on: On::Points, values: others }];
    for round in 0..3 {
        write_mesh(&path, &reversed(mesh)).unwrap();
        let read = load(&path, &LoadOptions::default()).unwrap();
        mesh = read.mesh;
        let mut names: Vec<_> = mesh.fields.iter().map(|f| (f.name.as_str(), f.on)).collect();
        names.sort_by_key(|name| name.0);
        let wanted = [("cell_id", On::Cells), ("other", On::Points), ("point_id", On::Points)];
        assert!(names == wanted && read.report.warnings.is_empty(), "round {round}: {names:?}, {}", read.report);
        for name in ["cell_id", "point_id"] {
            let ids = &mesh.field(name).unwrap().values;
            assert!(ids.iter().rev().zip(0u16..).all(|(&id, i)| id == f32::from(i)), "round {round}: {ids:?}");
        }
    }
}

#[test]
fn arrays_of_points() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("p.npy");
    let points: Vec<f64> = (0..30).map(|i| f64::from(i) * 0.1 - 1e9).collect();
    let wanted: Vec<[f64; 3]> = points.chunks(3).map(|p| [p[0], p[1], p[2]]).collect();
    write_npy(&path, &[10, 3], &points).unwrap();
    assert_eq!(load_points(&path).unwrap(), wanted);
    // The same array in Fortran order and big-endian, and in single precision.
    let bytes = std::fs::read(&path).unwrap();
    let header = bytes[..bytes.len() - 240].to_vec();
    let text = String::from_utf8_lossy(&header[10..]).replace("<f8", ">f8").replace("False", "True ");
    let mut fortran = [&header[..10], text.as_bytes()].concat();
    for c in 0..3 {
        fortran.extend(wanted.iter().flat_map(|p| p[c].to_be_bytes()));
    }
    std::fs::write(&path, fortran).unwrap();
    assert_eq!(load_points(&path).unwrap(), wanted);
    write_npy(&path, &[1, 3], &[0.5f32, -2.0, 1e30]).unwrap();
    assert_eq!(load_points(&path).unwrap(), [[0.5, -2.0, f64::from(1e30f32)]]);
    for (shape, data) in [(vec![2, 2], vec![0.0f32; 4]), (vec![3, 1], vec![0.0; 3]), (vec![1, 1, 3], vec![0.0; 3])] {
        write_npy(&path, &shape, &data).unwrap();
        assert!(matches!(load_points(&path), Err(Error::File { .. })), "{shape:?}");
    }
    assert!(matches!(write_npy(&path, &[2, 3], &[0.0f32; 5]), Err(Error::Invalid(_))));
}

#[test]
fn arrays_of_other_types_are_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("p.npy");
    write_npy(&path, &[2, 3], &[1u32, 2, 3, 4, 5, 6]).unwrap();
    assert_eq!(load_points(&path).unwrap(), [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]);
    let bytes = std::fs::read(&path).unwrap();
    let (header, data) = split_npy(&bytes);
    for (descr, found) in [
        ("'<f2'", "half-precision numbers (`<f2`)"),
        ("'<f16'", "extended-precision numbers (`<f16`)"),
        ("'<c8'", "complex numbers (`<c8`)"),
        ("'|b1'", "truth values (`|b1`)"),
        ("'|O'", "Python objects (`|O`)"),
        ("'<U4'", "texts (`<U4`)"),
        ("[('x', '<f4'), ('y', '<f4')]", "records with fields"),
        ("7", "an unreadable type"),
    ] {
        let header = header.replacen("'<u4'", descr, 1);
        let length = (header.len() as u16).to_le_bytes();
        std::fs::write(&path, [&bytes[..8], &length, header.as_bytes(), data].concat()).unwrap();
        let error = load_points(&path).unwrap_err().to_string();
        let wanted = format!("p.npy: header: an array of {found}; points need type f4 or f8, or whole numbers (i1 to i8, u1 to u8)");
        assert!(error.ends_with(&wanted), "{error}");
    }
}

#[test]
fn tables_of_points() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("p.csv");
    let wanted = [[1.0, 2.5, -3.0], [4.0, 5.0, 6e3]];
    for text in [
        "1,2.5,-3\n4,5,6e3\n",
        "x,y,z\r\n1,2.5,-3\r\n4,5,6e3",
        "# comment\n\n  1 2.5\t-3\n4 5 6e3\n",
        "\u{feff}x;y;z\n1;2,5;-3\n4;5;6e3\n",
        "id,\"Z\",\"X\",\"Y\"\n7,-3,1,2.5\n8,6e3,4,5\n",
        "Points:0,Points:1,Points:2,v\n1,2.5,-3,0\n4,5,6e3,0\n",
        "v,Points_0,Points_1,Points_2\n0,1,2.5,-3\n0,4,5,6e3\n",
        "\"1\",\"2.5\",\"-3\"\n\"4\",\"5\",\"6e3\"\n",
        "\"part, id\",x,y,z\n\"a, b\",1,2.5,-3\nc d,4,5,6e3\n",
        "Point ID\tx\ty\tz\n0\t1\t2,5\t-3\n1\t4\t5\t6e3\n",
        "1,0\t2,5\t-3,0\n4,0\t5,0\t6e3\n",
        "1,0 2,5 -3\n4 5 6e3\n",
        "1.0,\t2.5,\t-3\n4,\t5,\t6e3\n",
        "x,y,z\n1,2.5,-3\n4,5,6e3\n,,\n , ,\n",
        "x;y;z\n1;2.5;-3\n4;5;6e3\n;;\n",
        ",,,,\n1,2.5,-3\n4,5,6e3\n",
        "x,y,z\n1 2.5 -3\n4 5 6e3\n",
        "x,y,z,name\n1,2.5,-3,a;b\n4,5,6e3,c;d\n",
        "z (mm),y (mm),x (mm)\n-3,2.5,1\n6e3,5,4\n",
        "X [ m ], Y [ m ], Z [ m ], P\n1,2.5,-3,7\n4,5,6e3,7\n",
        "nodenumber,    x-coordinate,    y-coordinate,    z-coordinate\n1,1,2.5,-3\n2,4,5,6e3\n",
        "# by NumPy\n# z y x\n-3 2.5 1\n6e3 5 4\n",
        "#v,x,y,z\n0,1,2.5,-3\n# x y z v\n0,4,5,6e3\n",
        "# Z [mm], Y, X\n# z y x of two places\n1 2.5 -3\n4 5 6e3\n",
        "zone,x_pos,y,y_pos,z,x,z_pos\n9,9,2.5,9,-3,1,9\n9,9,5,9,6e3,4,9\n",
        "% x y z\n1 2.5 -3\n4 5 6e3\n",
        "% z y x\n-3 2.5 1\n% the next\n6e3 5 4\n",
        "% Model:    a.mph\n% T (K)      X           Y           Z\n293 1 2.5 -3\n293 4 5 6e3\n",
    ] {
        let read = |bytes: &[u8]| {
            std::fs::write(&path, bytes).unwrap();
            load_points(&path).unwrap_or_else(|e| panic!("{text}: {e}"))
        };
        assert_eq!(read(text.as_bytes()), wanted, "{text}");
        let units: Vec<u16> = format!("\u{feff}{}", text.trim_start_matches('\u{feff}')).encode_utf16().collect();
        assert_eq!(read(&units.iter().flat_map(|unit| unit.to_le_bytes()).collect::<Vec<u8>>()), wanted, "{text}");
        assert_eq!(read(&units.iter().flat_map(|unit| unit.to_be_bytes()).collect::<Vec<u8>>()), wanted, "{text}");
    }
    for odd in [&b"\xff\xfe1\0,"[..], b"\xfe\xff\xd8\0\0,"] {
        std::fs::write(&path, odd).unwrap();
        assert!(load_points(&path).unwrap_err().to_string().ends_with("p.csv: it begins as text in UTF-16, but is none; save it as UTF-8"));
    }
    for nothing in ["", "x,y,z\n", "# comment\n\n"] {
        std::fs::write(&path, nothing).unwrap();
        assert!(load_points(&path).unwrap().is_empty(), "{nothing:?}");
    }
    let array = folder.path().join("p.npy");
    std::fs::write(&array, "").unwrap();
    assert!(load_points(&array).unwrap_err().to_string().contains("ends inside the header"));
    for (text, place) in [
        ("1,2,3\n4,5\n", "line 2"),
        ("x,y,z\n1,2,3\n4,five,6\n", "line 3"),
        ("1,2,3,4\n", "line 1"),
        ("1.o,2,3\n4,4,4\n", "line 1: `1.o` is not a number"),
        ("a,b,c,d\n1,2,3,4\n", "line 1"),
        ("x,y,z\n1, ,3\n", "line 2: `` is not a number"),
        ("\"1\",\"2\",\"three\"\n", "line 1: `three` is not a number"),
        ("1,2\0,3", "byte 3"),
        ("t,x,y\n1,2,3\n", "line 1: `t,x,y` are no names of coordinates; name the columns x, y and z"),
        ("x,x,y,z\n1,2,3,4\n", "line 1: several columns are named x; rename all but the one to be read, or remove them"),
        ("v,Points:0,y,Points:1,z,Points:2\n1,2,3,4,5,6\n", "line 1: several columns are named y; "),
        ("# a b c d\n% x y Z z\n1,2,3,4\n", "line 2: several columns are named z; "),
        ("id,temperature,pressure\n1,2,3\n", "line 1: `id,temperature,pressure` are no names"),
    ] {
        std::fs::write(&path, text).unwrap();
        let error = load_points(&path).unwrap_err().to_string();
        assert!(error.contains(place), "{text}: {error}");
    }
    assert!(matches!(load_points(folder.path().join("none.csv")), Err(Error::Io { .. })));
}

/// Tables are read in parts of a mebibyte.
#[test]
fn large_tables_of_points() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("p.csv");
    let wanted: Vec<_> = (0..200_000).map(f64::from).map(|i| [i, 0.5 * i, -i]).collect();
    let lines: Vec<String> = wanted.iter().map(|p| format!("{},{},{}", p[0], p[1], p[2])).collect();
    for end in ["\n", "\r\n"] {
        let text = lines.join(end);
        assert!(text.len() > 3 << 20);
        std::fs::write(&path, &text).unwrap();
        assert_eq!(load_points(&path).unwrap(), wanted);
        std::fs::write(&path, format!("{text}{end}1,2{end}{text}{end}1,two,3")).unwrap();
        let error = load_points(&path).unwrap_err().to_string();
        assert!(error.contains("line 200001: 2 instead of 3 columns, separated by commas"), "{error}");
    }
}

/// Vectors and tensors are arrays of the file again, and become the same fields when it is read.
#[test]
fn components_are_gathered_in_arrays() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.vtu");
    let mut mesh = kuhn([1, 1, 1]).unwrap();
    let n = mesh.points.len();
    let mut add = |on: On, n: usize, name: &str, value: f32| {
        mesh.fields.push(Field { name: name.into(), on, values: (0..n).map(|i| value * i as f32).collect() });
    };
    for (name, value) in
        [("v", 5.0), ("v.x", 3.0), ("v.y", 0.0), ("v.z", -4.0), ("odd", 5.0), ("odd.x", 1.0), ("odd.y", 1.0), ("odd.z", 1.0)]
    {
        add(On::Points, n, name, value);
    }
    for c in 0..6 {
        add(On::Cells, 6, &format!("s.{c}"), c as f32);
    }
    write_mesh(&path, &mesh).unwrap();
    let text = String::from_utf8_lossy(&std::fs::read(&path).unwrap()).into_owned();
    for (name, components) in [("jet", 1), ("v", 3), ("odd", 1), ("odd.z", 1), ("s", 6)] {
        assert!(text.contains(&format!("Name=\"{name}\" NumberOfComponents=\"{components}\"")), "{name}");
    }
    let read = load(&path, &LoadOptions::default()).unwrap().mesh;
    let fields = |mesh: &Mesh| mesh.fields.iter().map(|f| (f.name.clone(), f.on, f.values.clone())).collect::<Vec<_>>();
    assert_eq!(fields(&read), fields(&mesh));
}

#[test]
fn located_points() {
    let folder = tempfile::tempdir().unwrap();
    let points = [[0.5, 1.5, 2.5], [9.0, 9.0, 9.0]];
    let bary = [[0.25f32, 0.5, 0.25, -0.0], [f32::NAN; 4]];
    let located =
        Located { points: &points, of: None, owner: &[7, u32::MAX], bary: &bary, values: &[("value".into(), vec![1.5, f32::NAN])] };
    for ending in ["npy", "npz", "csv", "vtu", "json"] {
        write_located(folder.path().join(format!("out.{ending}")), &located).unwrap();
    }
    assert_eq!(names(folder.path()), ["out.csv", "out.json", "out.npy", "out.npz", "out.vtu"]);
    let read = |ending: &str| std::fs::read(folder.path().join(format!("out.{ending}"))).unwrap();
    let bytes = read("npy");
    let (header, data) = split_npy(&bytes);
    assert!(header.contains("[('owner', '<u4'), ('bary', '<f4', (4,)), ('value', '<f4')]") && header.contains("(2,)"), "{header}");
    assert_eq!(data.len(), 48);
    assert_eq!((&data[..4], &data[20..24], &data[24..28]), (&7u32.to_le_bytes()[..], &1.5f32.to_le_bytes()[..], &[255u8; 4][..]));
    assert_eq!(
        String::from_utf8(read("csv")).unwrap(),
        "x,y,z,owner,b0,b1,b2,b3,value\n0.5,1.5,2.5,7,0.25,0.5,0.25,0,1.5\n9,9,9,4294967295,NaN,NaN,NaN,NaN,NaN\n"
    );
    let json: serde_json::Value = serde_json::from_slice(&read("json")).unwrap();
    assert_eq!((&json["owner"][0], &json["value"][0], &json["value"][1]), (&7.into(), &1.5.into(), &serde_json::Value::Null));
    let mut zip = zip::ZipArchive::new(std::io::Cursor::new(read("npz"))).unwrap();
    for (name, shape, size) in [("owner.npy", "(2,)", 8), ("bary.npy", "(2, 4)", 32), ("value.npy", "(2,)", 8)] {
        let mut bytes = Vec::new();
        std::io::copy(&mut zip.by_name(name).unwrap(), &mut bytes).unwrap();
        let (header, data) = split_npy(&bytes);
        assert!(header.contains(shape) && data.len() == size, "{name}: {header}");
    }
    // A file of vertices alone is not a mesh for this program, and the message says so.
    let error = load(folder.path().join("out.vtu"), &LoadOptions::default()).unwrap_err().to_string();
    assert!(error.contains("2 vertex"), "{error}");
    assert!(matches!(write_located(folder.path().join("out.txt"), &located), Err(Error::Invalid(m)) if m.contains(".npz")));
    let short = Located { owner: &[7], ..located };
    assert!(matches!(write_located(folder.path().join("out.npy"), &short), Err(Error::Invalid(_))));
}

/// JSON has the numbers that a table has, and not those of another precision.
#[test]
fn located_points_as_json() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.json");
    let bary = [[0.4f32, 0.1, 1e-9, 0.5], [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -0.0]];
    let located = Located {
        points: &[[0.0; 3]; 2],
        of: None,
        owner: &[7, u32::MAX],
        bary: &bary,
        values: &[("value".into(), vec![16_777_216.0, 1.1])],
    };
    write_located(&path, &located).unwrap();
    let wanted = r#"{"owner":[7,4294967295],"bary":[[0.4,0.1,1e-9,0.5],[null,null,null,-0.0]],"value":[16777216.0,1.1]}"#;
    assert_eq!(std::fs::read_to_string(&path).unwrap(), format!("{wanted}\n"));
}

/// Fields have columns with their names, whatever characters these have.
#[test]
fn located_values_of_several_fields() {
    let folder = tempfile::tempdir().unwrap();
    let names = ["Δ 'p'", "a,\"b\"\n", "c<d>"];
    let values = names.map(|name| (name.to_owned(), vec![0.5]));
    let located = Located { points: &[[1.0, 2.0, 3.0]], of: None, owner: &[7], bary: &[[0.25; 4]], values: &values };
    let read = |ending: &str| {
        let path = folder.path().join(format!("out.{ending}"));
        write_located(&path, &located).unwrap();
        std::fs::read(path).unwrap()
    };
    let table = String::from_utf8(read("csv")).unwrap();
    assert_eq!(table, "x,y,z,owner,b0,b1,b2,b3,Δ 'p',\"a,\"\"b\"\"\n\",c<d>\n1,2,3,7,0.25,0.25,0.25,0.25,0.5,0.5,0.5\n");
    let records = read("npy");
    let (header, data) = split_npy(&records);
    let wanted = r#"('\U00000394 \U00000027p\U00000027', '<f4'), ('a,"b"\U0000000a', '<f4'), ('c<d>', '<f4')]"#;
    assert!(header.contains(wanted) && data.len() == 32, "{header}");
    let json: serde_json::Value = serde_json::from_slice(&read("json")).unwrap();
    assert!(names.iter().all(|name| json[name][0] == 0.5), "{json}");
    let mut zip = zip::ZipArchive::new(std::io::Cursor::new(read("npz"))).unwrap();
    assert!(names.iter().all(|name| zip.by_name(&format!("{name}.npy")).is_ok()));
    assert!(String::from_utf8_lossy(&read("vtu")).contains("Name=\"c&lt;d&gt;\""));
    for name in ["owner", names[0]] {
        let twice = [values[0].clone(), (name.to_owned(), vec![0.5])];
        let refused = write_located(folder.path().join("no.csv"), &Located { values: &twice, ..located });
        assert!(matches!(refused, Err(Error::Invalid(m)) if m.contains(name)));
    }
    // Names too long for version 1 of the format.
    let long = [("n".repeat(70_000), vec![0.5])];
    let path = folder.path().join("long.npy");
    write_located(&path, &Located { values: &long, ..located }).unwrap();
    let bytes = std::fs::read(path).unwrap();
    let length = u32::from_le_bytes(bytes[8..12].try_into().unwrap()) as usize;
    assert!(bytes[6] == 2 && (12 + length).is_multiple_of(64) && bytes.len() == 12 + length + 24, "{length}");
}

const GRID: SliceGrid = SliceGrid {
    size: [3, 2, 2],
    origin: [0.5, 1.0, 2.0],
    spacing: [1.0, 1.0, 0.5],
    axes: [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]],
};

fn slices(path: &Path, grid: SliceGrid, owners: bool) {
    let mut writer = SliceWriter::create(path, grid, owners).unwrap();
    for layer in 0..2u8 {
        let values: Vec<f32> = (0..6).map(|i| f32::from(i + 6 * layer)).collect();
        let ids = [u32::from(layer); 6];
        writer.layer(&values, &[layer + 1; 6], owners.then_some(&ids[..])).unwrap();
    }
    assert!(writer.layer(&[0.0; 6], &[0; 6], None).is_err());
    writer.finish().unwrap();
}

#[test]
fn stacks_of_slices() {
    let folder = tempfile::tempdir().unwrap();
    slices(&folder.path().join("s.npy"), GRID, true);
    slices(&folder.path().join("s.vti"), GRID, false);
    assert_eq!(names(folder.path()), ["s.kind.npy", "s.npy", "s.owner.npy", "s.vti"]);
    let values: Vec<u8> = (0..12u8).flat_map(|i| f32::from(i).to_ne_bytes()).collect();
    let bytes = std::fs::read(folder.path().join("s.npy")).unwrap();
    let (header, data) = split_npy(&bytes);
    assert!(header.contains("(2, 2, 3)") && data == values, "{header}");
    let bytes = std::fs::read(folder.path().join("s.kind.npy")).unwrap();
    assert_eq!(split_npy(&bytes).1, [[1; 6], [2; 6]].concat());
    let image = std::fs::read(folder.path().join("s.vti")).unwrap();
    let start = image.windows(2).position(|w| w == b"\n_").unwrap() + 2;
    let text = String::from_utf8_lossy(&image[..start]);
    assert!(text.contains("WholeExtent=\"0 2 0 1 0 1\" Origin=\"0.5 1 2\" Spacing=\"1 1 0.5\" Direction=\"0 0 1 1 0 0 0 1 0\""), "{text}");
    assert!(text.contains("Name=\"kind\" format=\"appended\" offset=\"56\""), "{text}");
    assert_eq!(image[start..start + 8], 48u64.to_ne_bytes());
    assert_eq!(image[start + 8..start + 56], values);
    assert_eq!(image[start + 56..start + 64], 12u64.to_ne_bytes());
    assert_eq!(image[start + 64..start + 76], [[1; 6], [2; 6]].concat());
    assert!(image.ends_with(b"\n</AppendedData>\n</VTKFile>\n"));
}

/// VTK takes positive spacings only: layers that go downwards have the opposite direction.
#[test]
fn images_have_positive_spacings() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("down.vti");
    let spaced = |spacing: f64, layers: u32| SliceGrid { spacing: [1.0, 1.0, spacing], size: [3, 2, layers], ..GRID };
    slices(&path, spaced(-0.5, 2), false);
    let text = String::from_utf8_lossy(&std::fs::read(&path).unwrap()).into_owned();
    assert!(text.contains("Origin=\"0.5 1 2\" Spacing=\"1 1 0.5\" Direction=\"0 0 -1 1 0 0 0 1 0\""), "{text}");
    let refused = SliceWriter::create(&path, spaced(0.0, 2), false).map(drop);
    assert!(matches!(&refused, Err(Error::Invalid(why)) if why.contains("distance of 0")), "{refused:?}");
    assert!(SliceWriter::create(&path, spaced(0.0, 1), false).is_ok());
    assert!(SliceWriter::create(folder.path().join("flat.npy"), spaced(0.0, 2), false).is_ok());
}

#[test]
fn pictures_and_json() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("p.png");
    let pixels: Vec<u8> = (0..24).map(|i| i * 10).collect();
    write_png(&path, 3, 2, &pixels).unwrap();
    let mut reader = png::Decoder::new(std::io::Cursor::new(std::fs::read(&path).unwrap())).read_info().unwrap();
    let mut read = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut read).unwrap();
    assert_eq!(read, pixels);
    assert!(matches!(write_png(&path, 3, 3, &pixels), Err(Error::Invalid(_))));
    write_json(folder.path().join("j.json"), &vec![1, 2]).unwrap();
    assert_eq!(std::fs::read_to_string(folder.path().join("j.json")).unwrap(), "[1,2]\n");
    assert_eq!(OutputFormat::of("A.PNG", &[OutputFormat::Png]).unwrap(), OutputFormat::Png);
    assert!(matches!(OutputFormat::of("a.png", &[OutputFormat::Npy]), Err(Error::Invalid(m)) if m.contains(".npy")));
}
