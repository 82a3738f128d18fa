//! Hostile files are refused or read as `expect.json` says, quickly and without large allocations. This is the only
//! test of its process, because it watches the allocator.
#![cfg(feature = "formats")]
#![allow(clippy::unwrap_used, clippy::format_push_string, clippy::format_collect)] // also in helpers of tests
#![allow(unsafe_code)] // a global allocator that counts cannot be written otherwise

#[allow(dead_code, reason = "it uses little of it")]
#[path = "formats/small/mod.rs"]
mod small;

use std::alloc::{GlobalAlloc, Layout, System};
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::time::Instant;

use olbvh::Error;
use olbvh::formats::{Fate, LoadOptions, Loaded, load, load_bytes};
use small::not_run::not_run;
use small::shared;

static NOW: AtomicUsize = AtomicUsize::new(0);
static PEAK: AtomicUsize = AtomicUsize::new(0);

struct Counting;

// SAFETY: every call is passed on to the system's allocator unchanged; the counters do not allocate.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let now = NOW.fetch_add(layout.size(), Relaxed) + layout.size();
        PEAK.fetch_max(now, Relaxed);
        // SAFETY: the caller keeps the contract of `alloc`.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        NOW.fetch_sub(layout.size(), Relaxed);
        // SAFETY: the caller keeps the contract of `dealloc`.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

/// Loads a file. Adds a complaint to `broken` if that takes long, or takes more than `times` the memory that a reader
/// may ask for.
fn watched(
    name: &str,
    size: usize,
    times: usize,
    broken: &mut Vec<String>,
    load: impl FnOnce() -> Result<Loaded, Error>,
) -> Result<Loaded, Error> {
    PEAK.store(NOW.load(Relaxed), Relaxed);
    let (before, start) = (NOW.load(Relaxed), Instant::now());
    let result = load();
    let (seconds, peak) = (start.elapsed().as_secs_f64(), PEAK.load(Relaxed) - before);
    if seconds > 5.0 {
        broken.push(format!("{name}: {seconds:.1} s"));
    }
    if peak > times * ((64 << 20) + 100 * size) {
        broken.push(format!("{name}: {} MiB for {size} bytes", peak >> 20));
    }
    result
}

/// Bytes that this process has read so far, and calls that it needed; `None` where the system does not count them.
fn reads() -> Option<[u64; 2]> {
    let text = std::fs::read_to_string("/proc/self/io").ok()?;
    let number = |name: &str| text.lines().find_map(|line| line.strip_prefix(name)?.trim().parse::<u64>().ok());
    Some([number("rchar:")?, number("syscr:")?])
}

/// Loads a file from disk, as [`watched`] does. Adds a complaint to `broken` if more than `limits` bytes or calls are
/// needed to read it.
fn from_disk(path: &Path, limits: [u64; 2], broken: &mut Vec<String>) -> Result<Loaded, Error> {
    let name = format!("{} on disk", path.file_name().unwrap().display());
    let size = std::fs::metadata(path).unwrap().len() as usize;
    let before = reads();
    let result = watched(&name, size, 3, broken, || load(path, &LoadOptions::default()));
    if let (Some(before), Some(after)) = (before, reads()) {
        let [bytes, calls] = [0, 1].map(|i| after[i] - before[i]);
        println!("{name}: {size} bytes, {bytes} read in {calls} calls");
        if bytes > limits[0] || calls > limits[1] {
            broken.push(format!("{name}: {bytes} bytes read in {calls} calls, for {size} bytes"));
        }
    }
    result
}

#[test]
fn hostile_files() {
    let mut broken = Vec::new();
    if reads().is_none() {
        not_run("the limits of what is read from disk, as there is no /proc/self/io");
    }
    made_files(&mut broken);
    foreign_root(&mut broken);
    shared_files(&mut broken);
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}

const ONE: &str = "0 0 0 1 0 0 0 1 0 0 0 1";

/// A `.vtu` of one tetrahedron per piece of four points or more; pieces with fewer have no cells.
fn vtu(pieces: &[(usize, String, String)]) -> Vec<u8> {
    let mut text = "<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid>".to_owned();
    for (points, point_data, cell_data) in pieces {
        let positions = if *points < 4 { "0 0 0".repeat(*points) } else { ONE.to_owned() + &" 0 0 0".repeat(points - 4) };
        text += &format!(
            "<Piece NumberOfPoints=\"{points}\" NumberOfCells=\"{}\"><PointData>{point_data}</PointData><CellData>{cell_data}</CellData>\
             <Points><DataArray type=\"Float64\" NumberOfComponents=\"3\">{positions}</DataArray></Points>\
             <Cells><DataArray type=\"Int32\" Name=\"connectivity\">0 1 2 3</DataArray><DataArray type=\"Int32\" Name=\"offsets\">4</DataArray>\
             <DataArray type=\"UInt8\" Name=\"types\">10</DataArray></Cells></Piece>",
            u8::from(*points >= 4)
        );
    }
    (text + "</UnstructuredGrid></VTKFile>").into_bytes()
}

/// A Gmsh file with views of nodes, given by name, number of components and values.
fn msh(points: usize, views: impl Iterator<Item = (String, usize, &'static str)>) -> Vec<u8> {
    let mut text = format!("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n{points}\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n");
    text.extend((5..=points).map(|i| format!("{i} 0 0 0\n")));
    text += "$EndNodes\n$Elements\n1\n1 4 0 1 2 3 4\n$EndElements\n";
    for (name, components, values) in views {
        text += &format!("$NodeData\n1\n\"{name}\"\n0\n3\n0\n{components}\n{}\n{values}\n$EndNodeData\n", values.lines().count());
    }
    text.into_bytes()
}

/// A Gmsh file of `n` tetrahedra, each a volume of its own with its own physical group.
fn volumes(n: usize) -> Vec<u8> {
    let mut text = format!("$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Entities\n0 0 0 {n}\n");
    text.extend((1..=n).map(|i| format!("{i} 0 0 0 1 1 1 1 {} 0\n", 2 * i)));
    text += &format!("$EndEntities\n$Nodes\n1 4 1 4\n3 1 0 4\n1\n2\n3\n4\n{ONE}\n$EndNodes\n$Elements\n{n} {n} 1 {n}\n");
    text.extend((1..=n).map(|i| format!("3 {i} 4 1\n{i} 1 2 3 4\n")));
    (text + "$EndElements\n").into_bytes()
}

/// A legacy VTK file of one tetrahedron with cell arrays of these names.
fn vtk(names: impl Iterator<Item = String>) -> Vec<u8> {
    let arrays: Vec<String> = names.map(|name| format!("{name} 1 1 int 7\n")).collect();
    let head = format!(
        "# vtk DataFile Version 3.0\n\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 int\n{ONE}\nCELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10\n"
    );
    format!("{head}CELL_DATA 1\nFIELD F {}\n{}", arrays.len(), arrays.concat()).into_bytes()
}

/// Files that once took time, memory or bytes from disk in proportion to the square of their size. Arrays that need more
/// NaN than the size of the file allows are left out.
fn made_files(broken: &mut Vec<String>) {
    let array = |i: usize, components: usize| {
        let values = "7 ".repeat(components);
        format!("<DataArray type=\"Int32\" Name=\"a{i:06}\" NumberOfComponents=\"{components}\">{values}</DataArray>")
    };
    let first = (50_000, String::new(), String::new());
    let pieces: Vec<_> = std::iter::once(first).chain((0..500).map(|i| (1, array(i, 9), String::new()))).collect();
    let arrays: String = (0..100_000).map(|i| array(i, 1)).collect();
    let empty = (0, "<DataArray type=\"Int8\" format=\"binary\"/>\n".repeat(200_000), String::new());
    let tags = (4, "<b/>".repeat(1_000_000), String::new());
    let view = |i: usize| format!("v{i:06}");
    let many = 100_000;
    let files = [
        ("pieces.vtu", vtu(&pieces), None),
        ("arrays.vtu", vtu(&[(4, String::new(), arrays)]), Some(many)),
        ("empty_arrays.vtu", vtu(&[empty, (4, String::new(), String::new())]), Some(0)),
        ("tags.vtu", vtu(&[tags]), Some(0)),
        ("empty_views.msh", msh(20_000, (0..1000).map(|i| (view(i), 9, ""))), Some(0)),
        ("views_of_one.msh", msh(20_000, (0..1000).map(|i| (view(i), 9, "1 1 2 3 4 5 6 7 8 9"))), None),
        ("views.msh", msh(4, (0..many).map(|i| (view(i), 1, "1 1"))), Some(many)),
        ("volumes.msh", volumes(200_000), Some(2)),
        ("names.vtk", vtk((0..many).map(view)), Some(many)),
        ("name.vtk", vtk((0..many).map(|_| "a".into())), Some(many)),
    ];
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes, wanted) in files {
        let path = folder.path().join(name);
        std::fs::write(&path, &bytes).unwrap();
        let size = bytes.len() as u64;
        let disk = from_disk(&path, [3 * size + (1 << 20), size / 32 + 1000], broken);
        let memory = watched(name, bytes.len(), 3, broken, || load_bytes(name, bytes, &LoadOptions::default()));
        for loaded in [disk, memory] {
            let Loaded { mesh, report } = loaded.unwrap_or_else(|e| panic!("{e}"));
            let fields = mesh.fields.len();
            match wanted {
                Some(wanted) if fields != wanted => broken.push(format!("{name}: {fields} fields, not {wanted}")),
                None if fields == 0 || !report.warnings.iter().any(|w| w.contains("times the size of the file")) => {
                    broken.push(format!("{name}: {fields} fields, and no word of the others"));
                }
                _ => {}
            }
        }
    }
}

/// Of a file with a foreign root no more than its start is read.
fn foreign_root(broken: &mut Vec<String>) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("root.vtu");
    std::fs::write(&path, "<b/>".repeat(1_000_000)).unwrap();
    let error = from_disk(&path, [1 << 20, 100], broken).unwrap_err().to_string();
    assert!(error.ends_with("line 1: an XML or HTML document <b>, not a VTK file"), "{error}");
}

fn shared_files(broken: &mut Vec<String>) {
    let Some(root) = shared("hostile") else { return };
    let expected: serde_json::Value = serde_json::from_slice(&std::fs::read(root.join("expect.json")).unwrap()).unwrap();
    let expected = expected.as_object().unwrap();
    for (name, expect) in expected {
        let path = root.join(name);
        let size = std::fs::metadata(&path).unwrap().len() as usize;
        let result = watched(name, size, 1, broken, || load(&path, &LoadOptions::default()));
        let mut complain = |what: String| broken.push(format!("{name}: {what}"));
        let want = expect["expect"].as_str().unwrap();
        match result {
            Ok(_) if want == "error" => complain("accepted".into()),
            Err(error) if want == "ok" => complain(format!("refused: {error}")),
            Ok(loaded) => {
                let cells = u64::from(loaded.mesh.source_cells) - loaded.report.count(Fate::Boundary);
                let negative = loaded.report.negative;
                for (key, found) in [("points", loaded.report.points), ("cells", cells), ("negative", negative)] {
                    if expect[key].as_u64().is_some_and(|n| n != found) {
                        complain(format!("{found} {key}, not {}", expect[key]));
                    }
                }
                let used = loaded.mesh.tets.as_flattened();
                if used.iter().any(|&v| loaded.mesh.points[v as usize].iter().any(|x| !x.is_finite())) {
                    complain("a used point is not finite".into());
                }
            }
            Err(error) => {
                let text = error.to_string();
                let stem = name.rsplit(['/', '.']).nth(1).unwrap();
                if !matches!(error, Error::File { .. } | Error::Io { .. }) || !text.contains(stem) {
                    complain(format!("the message does not name the file: {text}"));
                }
                if text.len() > 600 || text.chars().any(char::is_control) {
                    complain(format!("unprintable or endless message: {text}"));
                }
            }
        }
    }
}
