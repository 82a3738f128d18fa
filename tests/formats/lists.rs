//! Files that list unstructured grids in other files (`.pvtu`, `.vtm`, `.vtpd`, `.vtpc`, `.pvd`).

use crate::small::{shared, small};
use olbvh::formats::{Fate, LoadOptions, Loaded, Merge, TimeStep, listed_files, load};
use olbvh::mesh::{Mesh, On};
use std::fs;
use tempfile::TempDir;

/// The content of a `.vtu` file, or the piece of one with several: a tetrahedron whose field `s` is `value`, beside a
/// ghost cell.
fn piece(points: &str, value: u32) -> String {
    format!(
        "<Piece NumberOfPoints='4' NumberOfCells='2'><CellData><DataArray type='Int32' Name='s'>{value} -1</DataArray>\
         <DataArray type='UInt8' Name='vtkGhostType'>0 1</DataArray></CellData>\
         <Points><DataArray type='Float64' NumberOfComponents='3'>{points}</DataArray></Points>\
         <Cells><DataArray type='Int32' Name='connectivity'>0 1 2 3 0 1 2 3</DataArray>\
         <DataArray type='Int32' Name='offsets'>4 8</DataArray><DataArray type='UInt8' Name='types'>10 10</DataArray></Cells></Piece>"
    )
}

fn file(kind: &str, content: &str) -> String {
    format!("<?xml version='1.0'?>\n<VTKFile type='{kind}' version='1.0'><{kind}>\n{content}\n</{kind}></VTKFile>")
}

/// A folder with two grids that share a face, in folders of their own, and one with both as its pieces.
fn folder() -> TempDir {
    let pieces = [piece("0 0 0 1 0 0 0 1 0 0 0 1", 7), piece("1 1 1 1 0 0 0 1 0 0 0 1", 8)];
    let folder = tempfile::tempdir().unwrap();
    for (name, pieces) in [("a & b", &pieces[..1]), ("c", &pieces[1..])] {
        fs::create_dir(folder.path().join(name)).unwrap();
        fs::write(folder.path().join(name).join("grid.vtu"), file("UnstructuredGrid", &pieces.concat())).unwrap();
    }
    fs::write(folder.path().join("both.vtu"), file("UnstructuredGrid", &pieces.concat())).unwrap();
    folder
}

/// Name, place and values of all fields.
fn fields(mesh: &Mesh) -> Vec<(&str, On, &[f32])> {
    mesh.fields.iter().map(|f| (f.name.as_str(), f.on, f.values.as_slice())).collect()
}

fn read(folder: &TempDir, name: &str, content: &str) -> Result<Loaded, String> {
    let path = folder.path().join(name);
    fs::write(&path, content).unwrap();
    let load = |path| load(path, &LoadOptions::default());
    load(&path).map_err(|error| error.to_string().replace(&format!("{}/", folder.path().display()), ""))
}

/// Points of different pieces that coincide become one, 0 and -0 too, but not those of one piece: that is a crack.
#[test]
fn pieces_are_joined_at_their_points() {
    let folder = tempfile::tempdir().unwrap();
    let piece = |points: &str| {
        format!(
            "<Piece NumberOfPoints='5' NumberOfCells='1'><Points><DataArray type='Float64' NumberOfComponents='3'>{points}</DataArray></Points>\
             <Cells><DataArray type='Int32' Name='connectivity'>0 1 2 3</DataArray><DataArray type='Int32' Name='offsets'>4</DataArray>\
             <DataArray type='UInt8' Name='types'>10</DataArray></Cells></Piece>"
        )
    };
    let pieces = [piece("0 0 0 0 1 0 0 0 1 1 0 0 1 0 0"), piece("-0 0 0 -0 1 0 -0 0 1 -1 0 0 -1 0 0")].concat();
    let read = read(&folder, "two.vtu", &file("UnstructuredGrid", &pieces)).unwrap();
    let points: Vec<_> = read.mesh.tets.iter().flatten().copied().collect::<std::collections::BTreeSet<_>>().into_iter().collect();
    assert_eq!((read.mesh.tets.len(), points.len(), read.mesh.points.len()), (2, 5, 7));
}

#[test]
fn listed_grids_are_pieces_of_one_mesh() {
    let folder = folder();
    let both = load(folder.path().join("both.vtu"), &LoadOptions::default()).unwrap();
    assert_eq!(fields(&both.mesh), [("s", On::Cells, &[7.0, 8.0][..])]);
    assert_eq!((both.mesh.points.len(), both.mesh.source_cells, both.report.count(Fate::Ghost)), (5, 4, 2));
    let size = |name: &str| fs::metadata(folder.path().join(name)).ok().filter(fs::Metadata::is_file).map_or(0, |file| file.len());
    let sets = "<DataSet index='0' file='a &amp; b/grid.vtu'/>\n<DataSet index='1' name='empty'/><DataSet index='2' file='c/grid.vtu'/>";
    for (name, content) in [
        ("both.pvtu", file("PUnstructuredGrid", "<PPointData/><Piece Source='a &amp; b/grid.vtu'/><Piece Source='c/grid.vtu'/>")),
        ("both.vtm", file("vtkMultiBlockDataSet", &format!("<Block index='0'>{sets}</Block>"))),
        ("both.vtpd", file("vtkPartitionedDataSet", sets)),
        ("both.vtpc", file("vtkPartitionedDataSetCollection", &format!("<Partitions index='0'>{sets}</Partitions>"))),
        ("both.pvd", file("Collection", &sets.replace("index", "timestep='0.5' part"))),
        // Lists may list lists.
        ("more.pvd", file("Collection", "<DataSet timestep='1' file='both.pvtu'/>")),
    ] {
        let Loaded { mesh, report } = read(&folder, name, &content).unwrap();
        assert_eq!((&mesh.points, &mesh.tets, &mesh.cell_ids), (&both.mesh.points, &both.mesh.tets, &both.mesh.cell_ids), "{name}");
        assert_eq!(fields(&mesh), fields(&both.mesh), "{name}");
        assert_eq!(report.cells, both.report.cells, "{name}");
        let read: u64 =
            ["a & b/grid.vtu", "c/grid.vtu", name, if name == "more.pvd" { "both.pvtu" } else { "" }].into_iter().map(size).sum();
        assert_eq!(report.bytes, read, "{name}");
        assert!(report.format.ends_with(" 1.0, 2 listed files"), "{name}: {report}");
    }
}

/// Such lists name files with backslashes. A file that has one in its name is still found.
#[test]
fn lists_written_on_windows_are_read() {
    let folder = folder();
    let sets = ["a &amp; b", "c"].map(|name| format!("<DataSet timestep='0' file='.\\{name}\\grid.vtu'/>")).concat();
    let found = read(&folder, "both.pvd", &file("Collection", &sets)).unwrap().mesh;
    assert_eq!(fields(&found), [("s", On::Cells, &[7.0, 8.0][..])]);
    let pieces = "<Piece Source='a &amp; b\\grid.vtu'/><Piece Source='c\\grid.vtu'/>";
    assert_eq!(read(&folder, "both.pvtu", &file("PUnstructuredGrid", pieces)).unwrap().mesh.tets.len(), 2);
    let series = "{\"files\": [{\"name\": \".\\\\c\\\\grid.vtu\", \"time\": 0}]}";
    assert_eq!(read(&folder, "c.vtu.series", series).unwrap().mesh.field("s").unwrap().values, [8.0]);
    // A result must not replace a file that is listed like this.
    assert_eq!(listed_files(&folder.path().join("both.pvtu")), ["a & b/grid.vtu", "c/grid.vtu"].map(|name| folder.path().join(name)));
    fs::copy(folder.path().join("both.vtu"), folder.path().join("c\\grid.vtu")).unwrap();
    let twin = file("PUnstructuredGrid", "<Piece Source='c\\grid.vtu'/>");
    assert_eq!(read(&folder, "twin.pvtu", &twin).unwrap().mesh.tets.len(), 2);
    // The same file, written in two ways.
    let twice = file("PUnstructuredGrid", "<Piece Source='a &amp; b/grid.vtu'/>\n<Piece Source='a &amp; b\\grid.vtu'/>");
    let error = read(&folder, "twice.pvtu", &twice).unwrap_err();
    assert!(error.ends_with("the file is listed twice"), "{error}");
    let gone = read(&folder, "gone.pvtu", &file("PUnstructuredGrid", "<Piece Source='d\\grid.vtu'/>")).unwrap_err();
    assert_eq!(gone, "gone.pvtu: line 3: `d\\grid.vtu`: there is no such file");
}

#[test]
fn files_without_volumes_are_left_out() {
    let folder = folder();
    let sets = "<DataSet file='walls.vtp'/><DataSet file='c/grid.vtu'/><DataSet file='inlet.VTP'/>";
    let content = file("vtkMultiBlockDataSet", sets);
    let report = read(&folder, "case.vtm", &content).unwrap().report;
    assert_eq!(report.warnings, ["listed files without volume cells are left out: 2 .vtp"]);
    let with_volumes = file("vtkMultiBlockDataSet", &format!("{sets}<DataSet file='air.htg'/><DataSet file='box.vth'/>"));
    let warnings = read(&folder, "case.vtm", &with_volumes).unwrap().report.warnings;
    assert_eq!(warnings.len(), 2);
    assert!(warnings[1].starts_with("listed files are left out: 1 .htg, 1 .vth; they cannot be read, so the mesh has holes"));
    let none = read(&folder, "case.vtm", &content.replace("c/grid.vtu", "grid.vth")).unwrap_err();
    assert_eq!(none, "case.vtm: it lists no file with volume cells, only 1 .vth, 2 .vtp");
}

#[test]
fn errors_name_the_list_or_the_listed_file() {
    let folder = folder();
    let list = |sources: &[&str]| format!("<Piece Source='{}'/>", sources.join("'/>\n<Piece Source='"));
    let broken = file("UnstructuredGrid", &piece("0 0 0 1 0 0 0 1 0 0 0 1", 7).replace(">0 1 2 3 0 1 2 3<", ">0 1 2 3 0 1 2 4<"));
    fs::write(folder.path().join("broken.vtu"), broken.replace("Name='vtkGhostType'", "Name='g'")).unwrap();
    fs::write(folder.path().join("far.vtu"), file("UnstructuredGrid", &piece("0 0 0 1 0 nan 0 1 0 0 0 1", 7))).unwrap();
    fs::write(folder.path().join("case.vtk"), small("ascii.vtk")).unwrap();
    for (sources, wanted) in [
        (&["c/grid.vtu", "gone.vtu"][..], "case.pvtu: line 4: `gone.vtu`: there is no such file"),
        (&["c/grid.vtu", "c/grid.vtu"], "case.pvtu: line 4: `c/grid.vtu`: the file is listed twice"),
        (&["c/grid.vtu", "broken.vtu"], "broken.vtu: cell 1 (tetrahedron): names point 4, but points are 0 to 3"),
        (&["c/grid.vtu", "far.vtu"], "far.vtu: a point (of cell 0): (1.0, 0.0, NaN): its coordinates must be finite"),
        // Neither folders nor devices, which may have no end.
        (&["c"], "case.pvtu: line 3: `c`: there is no such file"),
        (&["/dev/zero"], "case.pvtu: line 3: `/dev/zero`: there is no such file"),
        (&["case.vtk"], "case.pvtu: line 3: `case.vtk`: no VTK XML file, as such a list needs; read it by itself"),
        // A list of itself.
        (&["case.pvtu"], "case.pvtu: line 3: `case.pvtu`: the file is listed twice"),
    ] {
        let error = read(&folder, "case.pvtu", &file("PUnstructuredGrid", &list(sources))).unwrap_err();
        assert!(error.starts_with(wanted), "{error}");
    }
    for n in 1..=6 {
        fs::write(folder.path().join(format!("{n}.pvtu")), file("PUnstructuredGrid", &list(&[&format!("{}.pvtu", n + 1)]))).unwrap();
    }
    let error = load(folder.path().join("1.pvtu"), &LoadOptions::default()).unwrap_err().to_string();
    assert!(error.ends_with("4.pvtu: line 3: `5.pvtu`: lists lie more than 4 deep within each other"), "{error}");
    let empty = read(&folder, "case.pvtu", &file("PUnstructuredGrid", "<PPointData/>")).unwrap_err();
    assert_eq!(empty, "case.pvtu: it lists no file with volume cells");
}

/// Three steps, of which the first and the last have two files; another file belongs to all of them.
#[test]
fn a_step_of_a_series_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let sets = [(0, "0"), (1, "0"), (2, "0.5"), (3, "1e1"), (4, "1e1")];
    let mut list: String = sets.map(|(x, step)| format!("<DataSet timestep='{step}' file='{x}.vtu'/>")).concat();
    list += "<DataSet file='9.vtu'/>";
    for x in [0, 1, 2, 3, 4, 9] {
        let tet = piece(&format!("{x}0 0 0 {x}1 0 0 {x}0 1 0 {x}0 0 1"), x);
        fs::write(folder.path().join(format!("{x}.vtu")), file("UnstructuredGrid", &tet)).unwrap();
    }
    fs::write(folder.path().join("case.pvd"), file("Collection", &list)).unwrap();
    let read = |step: TimeStep| load(folder.path().join("case.pvd"), &LoadOptions { step, ..LoadOptions::default() });
    for (step, number, wanted) in
        [("0", 0, &[0.0, 1.0, 9.0][..]), ("1", 1, &[2.0, 9.0]), ("2", 2, &[3.0, 4.0, 9.0]), ("Last", 2, &[3.0, 4.0, 9.0])]
    {
        let Loaded { mesh, report } = read(step.parse().unwrap()).unwrap();
        assert_eq!(mesh.field("s").unwrap().values, wanted, "{step}");
        assert!(report.warnings.iter().any(|w| w.starts_with(&format!("time step {number} of 0 to 2 is read; --time-step"))), "{report}");
    }
    let error = read(TimeStep::Number(3)).unwrap_err().to_string();
    assert!(error.ends_with("case.pvd: there is no time step 3; the steps are 0 to 2"), "{error}");
    assert!(["", "-1", "first", "1.5"].iter().all(|text| text.parse::<TimeStep>().is_err()));
}

/// The content of a `.vtu` file: points, cells of one type with the nodes of all one after the other, marks of ghosts, and
/// fields of the points.
fn grid(points: &str, (kind, n): (u8, usize), nodes: &str, ghosts: &str, fields: &[(&str, &str)]) -> String {
    let array = |name: &str, kind: &str, n: usize, values: &str| {
        format!("<DataArray type='{kind}' Name='{name}' NumberOfComponents='{n}'>{values}</DataArray>")
    };
    let fields: String = fields.iter().map(|(name, values)| array(name, "Float32", 1, values)).collect();
    let (n_points, n_cells) = (points.split_whitespace().count() / 3, nodes.split_whitespace().count() / n);
    let ends: Vec<String> = (1..=n_cells).map(|cell| (n * cell).to_string()).collect();
    let cells = [
        array("connectivity", "Int32", 1, nodes),
        array("offsets", "Int32", 1, &ends.join(" ")),
        array("types", "UInt8", 1, &format!("{kind} ").repeat(n_cells)),
    ];
    let piece = format!(
        "<Piece NumberOfPoints='{n_points}' NumberOfCells='{n_cells}'><PointData>{fields}</PointData><CellData>{}</CellData>\
         <Points>{}</Points><Cells>{}</Cells></Piece>",
        array("vtkGhostType", "UInt8", 1, ghosts),
        array("p", "Float64", 3, points),
        cells.concat()
    );
    file("UnstructuredGrid", &piece)
}

const TET: (u8, usize) = (10, 4);
const HEX: (u8, usize) = (12, 8);

/// Reads two files as the two blocks of one list, and as the two pieces of one mesh.
fn blocks_and_pieces(files: &[String; 2], merge: Merge) -> [Loaded; 2] {
    let folder = tempfile::tempdir().unwrap();
    files.iter().zip(["0.vtu", "1.vtu"]).for_each(|(content, name)| fs::write(folder.path().join(name), content).unwrap());
    let sets = "<DataSet file='0.vtu'/><DataSet file='1.vtu'/>";
    [("l.vtm", "vtkMultiBlockDataSet", sets.to_owned()), ("l.pvtu", "PUnstructuredGrid", sets.replace("DataSet file", "Piece Source"))].map(
        |(name, kind, sets)| {
            fs::write(folder.path().join(name), file(kind, &sets)).unwrap();
            load(folder.path().join(name), &LoadOptions { merge, ..LoadOptions::default() }).unwrap()
        },
    )
}

/// The values of a field of points; 99 where there is none.
fn values(loaded: &Loaded, field: &str) -> Vec<f32> {
    loaded.mesh.field(field).unwrap().values.iter().map(|v| if v.is_nan() { 99.0 } else { *v }).collect()
}

#[test]
fn merged_points_have_the_first_value_that_there_is() {
    let first = grid("0 0 0 1 0 0 0 1 0 0 0 1", TET, "0 1 2 3", "0", &[("t", "1 2 3 4")]);
    let second = grid("1 1 1 1 0 0 0 1 0 0 0 1", TET, "0 1 2 3", "0", &[("t", "9 2 nan 4.000002"), ("p", "5 6 7 8")]);
    for loaded in blocks_and_pieces(&[first, second], Merge::Pieces) {
        assert_eq!((values(&loaded, "t"), values(&loaded, "p")), (vec![1.0, 2.0, 3.0, 4.0, 9.0], vec![99.0, 6.0, 7.0, 8.0, 5.0]));
        let wanted = [
            "2 pieces; 3 points that coincide with others are merged",
            "array `p` has no value, or none that is finite in single precision, at 1 of 5 points",
        ];
        assert_eq!(loaded.report.warnings, wanted);
    }
}

#[test]
fn a_field_may_jump_between_blocks() {
    let first = grid("0 0 0 1 0 0 0 1 0 0 0 1", TET, "0 1 2 3", "0", &[("t", "1 2 3 4")]);
    let second = grid("1 1 1 1 0 0 0 1 0 0 0 1", TET, "0 1 2 3", "0", &[("t", "9 2 3.1 5")]);
    let [blocks, pieces] = blocks_and_pieces(&[first.clone(), second.clone()], Merge::Pieces);
    assert_eq!(values(&blocks, "t"), [1.0, 2.0, 3.0, 4.0, 9.0, 3.1, 5.0]);
    assert_eq!(blocks.mesh.tets, [[0, 1, 2, 3], [4, 1, 5, 6]]);
    let wanted = "2 points coincide with one of another block, but have another value of `t` or of other arrays: ";
    assert!(blocks.report.warnings[1].starts_with(wanted), "{}", blocks.report);
    assert_eq!((values(&pieces, "t"), pieces.report.warnings.len()), (vec![1.0, 2.0, 3.0, 4.0, 9.0], 1));
    for loaded in blocks_and_pieces(&[first, second], Merge::All) {
        assert_eq!((values(&loaded, "t"), loaded.report.warnings.len()), (vec![1.0, 2.0, 3.0, 4.0, 9.0], 1));
    }
}

/// A face that is not plane is cut in the same way on both sides, also where its points stay two.
#[test]
fn blocks_fit_each_other_where_a_field_jumps() {
    let first = "0 0 0 1 0 0 1.3 1 0 0 1 0 0 0 1 1.2 0 1 1 1 1 0 1 1";
    // The corners of the shared face in another order.
    let second = "1.3 1 0 1 1 1 1.2 0 1 1 0 0 2 1 0 2 1 1 2 0 1 2 0 0";
    let files =
        [(first, "1"), (second, "2")].map(|(points, t)| grid(points, HEX, "0 1 2 3 4 5 6 7", "0", &[("t", &format!("{t} ").repeat(8))]));
    let [blocks, pieces] = blocks_and_pieces(&files, Merge::Pieces);
    assert_eq!((blocks.mesh.points.len(), pieces.mesh.points.len()), (16, 12));
    let corners = |mesh: &Mesh| mesh.tets.iter().map(|tet| tet.map(|v| mesh.points[v as usize])).collect::<Vec<_>>();
    assert_eq!(corners(&blocks.mesh), corners(&pieces.mesh));
}

/// Points that only ghost cells use have values that may mean nothing.
#[test]
fn points_of_ghost_cells_do_not_count() {
    let first = grid("0 0 0 1 0 0 0 1 0 0 0 1 1 1 1", TET, "0 1 2 3 4 1 2 3", "0 1", &[("t", "1 2 3 4 -999")]);
    let second = grid("1 1 1 1 0 0 0 1 0 0 0 1 0 0 0", TET, "0 1 2 3 4 1 2 3", "0 1", &[("t", "9 2 3 4 -999")]);
    for loaded in blocks_and_pieces(&[first.clone(), second], Merge::Pieces) {
        assert_eq!(values(&loaded, "t"), [1.0, 2.0, 3.0, 4.0, 9.0]);
        assert_eq!((loaded.mesh.tets.as_slice(), loaded.report.warnings.len()), (&[[0, 1, 2, 3], [4, 1, 2, 3]][..], 1));
    }
    let alone = crate::small::open_bytes("ghost.vtu", first.into_bytes());
    assert_eq!((alone.mesh.field("t").unwrap().range(), alone.report.warnings), (Some([1.0, 4.0]), Vec::new()));
}

/// Which of listed files are pieces of one block.
#[test]
fn parts_of_a_block_are_one_mesh() {
    let folder = tempfile::tempdir().unwrap();
    let one = |points: &str, t: &str| grid(points, TET, "0 1 2 3", "0", &[("t", t)]);
    fs::write(folder.path().join("0.vtu"), one("0 0 0 1 0 0 0 1 0 0 0 1", "1 1 1 1")).unwrap();
    fs::write(folder.path().join("1.vtu"), one("1 1 1 1 0 0 0 1 0 0 0 1", "2 2 2 2")).unwrap();
    let sets = "<DataSet file='0.vtu'/><DataSet file='1.vtu'/>";
    let apart = sets.replace("/><", "/></Partitions><Partitions><");
    for (name, kind, content, points) in [
        ("l.vtm", "vtkMultiBlockDataSet", format!("<Block>{sets}</Block>"), 8),
        ("l.vtm", "vtkMultiBlockDataSet", format!("<Block><Piece>{sets}</Piece></Block>"), 5),
        ("l.vtpd", "vtkPartitionedDataSet", sets.to_owned(), 5),
        ("l.vtpc", "vtkPartitionedDataSetCollection", format!("<Partitions>{sets}</Partitions>"), 5),
        ("l.vtpc", "vtkPartitionedDataSetCollection", format!("<Partitions>{apart}</Partitions>"), 8),
        ("l.pvd", "Collection", sets.to_owned(), 8),
    ] {
        assert_eq!(read(&folder, name, &file(kind, &content)).unwrap().mesh.points.len(), points, "{content}");
    }
}

#[test]
fn a_shared_list_is_the_file_with_its_pieces() {
    let Some(folder) = shared("formats") else { return };
    let [list, file] =
        ["bracket_5k.pvtu", "bracket_5k_twopieces.vtu"].map(|name| load(folder.join(name), &LoadOptions::default()).unwrap());
    assert_eq!(fields(&list.mesh), fields(&file.mesh));
    assert_eq!((list.mesh.points, list.mesh.tets), (file.mesh.points, file.mesh.tets));
}

/// ParaView's own list of the files of time steps.
#[test]
fn a_series_in_json() {
    let folder = folder();
    let entries = r#"{"name": "c/grid.vtu", "time": 10},
        {"name": "a & b/grid.vtu", "time": 9.5}"#;
    let series = format!(r#"{{ "file-series-version": "1.0", "files": [{entries}] }}"#);
    let path = folder.path().join("run.vtu.series");
    fs::write(&path, &series).unwrap();
    for (step, value, number) in [(TimeStep::Number(0), 7.0, 0), (TimeStep::Last, 8.0, 1)] {
        let Loaded { mesh, report } = load(&path, &LoadOptions { step, ..LoadOptions::default() }).unwrap();
        assert_eq!(mesh.field("s").unwrap().values, [value]);
        assert!(report.warnings[0].starts_with(&format!("time step {number} of 0 to 1 is read")), "{:?}", report.warnings);
    }
    // Each file is a step of its own; of those at one time, the last counts.
    let Loaded { mesh, report } = read(&folder, "one.vtu.series", &series.replace("9.5", "1e1")).unwrap();
    assert_eq!((fields(&mesh), report.warnings.len()), (vec![("s", On::Cells, &[7.0][..])], 0), "{report}");
    // A step may have any format.
    fs::write(folder.path().join("c/old.vtk"), small("ascii.vtk")).unwrap();
    let legacy = read(&folder, "old.vtk.series", r#"{"files": [{"name": "c/old.vtk"}, {"name": "c/old.vtk"}]}"#).unwrap();
    assert!(legacy.mesh.tets.len() > 1 && legacy.report.format.starts_with("ParaView series: VTK"), "{}", legacy.report);
    for (content, wanted) in [
        (r#"{"files": []}"#, "self.series: it lists no file"),
        (
            r#"{"files": [{"name": "self.series"}]}"#,
            "self.series: line 1: `self.series`: a series in a series; list the files of its steps",
        ),
    ] {
        assert_eq!(read(&folder, "self.series", content).unwrap_err(), wanted);
    }
    let error = read(&folder, "run.vtu.series", &series.replace("a & b/", "d/")).unwrap_err();
    assert!(error.contains("line 2: `d/grid.vtu`: there is no such file"), "{error}");
    let error = read(&folder, "run.vtu.series", "{\n\"files\": 3}").unwrap_err();
    assert!(error.starts_with("run.vtu.series: as a series in JSON: invalid type: integer `3`, expected a sequence at line 2"), "{error}");
    assert_eq!(listed_files(&path).len(), 0, "a broken list names nothing");
    fs::write(&path, &series).unwrap();
    assert_eq!(listed_files(&path), ["c/grid.vtu", "a & b/grid.vtu"].map(|name| folder.path().join(name)));
}

/// A list that names itself many times is read once.
#[test]
fn lists_of_themselves_name_few_files() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("self.pvtu");
    fs::write(&path, file("PUnstructuredGrid", &"<Piece Source='self.pvtu'/><Piece Source='./self.pvtu'/>".repeat(500))).unwrap();
    assert_eq!(listed_files(&path).len(), 1000);
}
