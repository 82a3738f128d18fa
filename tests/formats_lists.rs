//! Files that list unstructured grids in other files (`.pvtu`, `.vtm`, `.vtpd`, `.vtpc`, `.pvd`).
#![cfg(feature = "formats")]
#![allow(clippy::unwrap_used)] // also in helpers of tests

mod formats_small;

use formats_small::shared;
use olbvh::formats::{Fate, LoadOptions, Loaded, load};
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

#[test]
fn files_without_volumes_are_left_out() {
    let folder = folder();
    let sets = "<DataSet file='walls.vtp'/><DataSet file='c/grid.vtu'/><DataSet file='inlet.VTP'/>";
    let content = file("vtkMultiBlockDataSet", sets);
    let report = read(&folder, "case.vtm", &content).unwrap().report;
    assert_eq!(report.warnings, ["listed files without volume cells are left out: 2 .vtp"]);
    let with_volumes = file("vtkMultiBlockDataSet", &format!("{sets}<DataSet file='air.vti'/><DataSet file='box.pvts'/>"));
    let warnings = read(&folder, "case.vtm", &with_volumes).unwrap().report.warnings;
    assert_eq!(warnings.len(), 2);
    assert!(warnings[1].starts_with("listed files are left out: 1 .pvts, 1 .vti; structured grids cannot be read, so the mesh has holes"));
    let none = read(&folder, "case.vtm", &content.replace("c/grid.vtu", "grid.vti")).unwrap_err();
    assert_eq!(none, "case.vtm: it lists no file with an unstructured grid, only 1 .vti, 2 .vtp");
}

#[test]
fn errors_name_the_list_or_the_listed_file() {
    let folder = folder();
    let list = |sources: &[&str]| format!("<Piece Source='{}'/>", sources.join("'/>\n<Piece Source='"));
    let broken = file("UnstructuredGrid", &piece("0 0 0 1 0 0 0 1 0 0 0 1", 7).replace(">0 1 2 3 0 1 2 3<", ">0 1 2 3 0 1 2 4<"));
    fs::write(folder.path().join("broken.vtu"), broken.replace("Name='vtkGhostType'", "Name='g'")).unwrap();
    fs::write(folder.path().join("far.vtu"), file("UnstructuredGrid", &piece("0 0 0 1 0 nan 0 1 0 0 0 1", 7))).unwrap();
    for (sources, wanted) in [
        (&["c/grid.vtu", "gone.vtu"][..], "case.pvtu: line 4: `gone.vtu`: there is no such file"),
        (&["c/grid.vtu", "c/grid.vtu"], "case.pvtu: line 4: `c/grid.vtu`: the file is listed twice"),
        (&["c/grid.vtu", "broken.vtu"], "broken.vtu: cell 1 (tetrahedron): names point 4, but points are 0 to 3"),
        (&["c/grid.vtu", "far.vtu"], "far.vtu: a point (of cell 0): (1.0, 0.0, NaN): its coordinates must be finite"),
        // Neither folders nor devices, which may have no end.
        (&["c"], "case.pvtu: line 3: `c`: there is no such file"),
        (&["/dev/zero"], "case.pvtu: line 3: `/dev/zero`: there is no such file"),
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
    assert_eq!(empty, "case.pvtu: it lists no file with an unstructured grid");
    let steps = "<DataSet timestep='0' file='0.vtu'/><DataSet timestep='0' file='1.vtu'/><DataSet timestep='0.5' file='2.vtu'/>";
    let series = |steps: &str| read(&folder, "case.pvd", &file("Collection", steps)).unwrap_err();
    assert!(series(steps).ends_with("open a copy of the list with the files of one step only, for example timestep=\"0.5\""));
    let whole = series(&steps.replace("<DataSet timestep='0' file='1.vtu'/>", ""));
    assert_eq!(whole, "case.pvd: a series of 2 time steps; open one of its files, for example `2.vtu`");
}

#[test]
fn a_shared_list_is_the_file_with_its_pieces() {
    let Some(folder) = shared("formats") else { return };
    let [list, file] =
        ["bracket_5k.pvtu", "bracket_5k_twopieces.vtu"].map(|name| load(folder.join(name), &LoadOptions::default()).unwrap());
    assert_eq!(fields(&list.mesh), fields(&file.mesh));
    assert_eq!((list.mesh.points, list.mesh.tets), (file.mesh.points, file.mesh.tets));
}
