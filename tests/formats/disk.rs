//! Files that stay on disk while they are read give what they give in memory.

use crate::small::all;
use olbvh::formats::{LoadOptions, load, load_bytes};
use olbvh::mesh::kuhn;

fn write(folder: &tempfile::TempDir, name: &str, bytes: &[u8]) -> std::path::PathBuf {
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    path
}

/// A grid of cubes in uncompressed raw data.
fn raw_vtu() -> Vec<u8> {
    let mesh = kuhn([8, 8, 8]).unwrap();
    let floats: Vec<u8> = mesh.points.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
    let nodes: Vec<u8> = mesh.tets.iter().flatten().flat_map(|&v| i64::from(v).to_le_bytes()).collect();
    let ends: Vec<u8> = (1..=mesh.tets.len()).flat_map(|i| (4 * i as i64).to_le_bytes()).collect();
    let types = vec![10; mesh.tets.len()];
    let (mut offset, mut data) = (0, Vec::new());
    let mut array = |name: &str, kind: &str, components: u32, bytes: &[u8]| {
        let xml = format!("<DataArray Name='{name}' type='{kind}' NumberOfComponents='{components}' format='appended' offset='{offset}'/>");
        data.extend((bytes.len() as u64).to_le_bytes());
        data.extend(bytes);
        offset = data.len();
        xml
    };
    let points = array("Points", "Float32", 3, &floats);
    let cells = [("connectivity", "Int64", nodes), ("offsets", "Int64", ends), ("types", "UInt8", types)];
    let cells: String = cells.iter().map(|(name, kind, bytes)| array(name, kind, 1, bytes)).collect();
    let (n, m) = (mesh.points.len(), mesh.tets.len());
    let head = format!(
        "<VTKFile type='UnstructuredGrid' header_type='UInt64'><UnstructuredGrid><Piece NumberOfPoints='{n}' NumberOfCells='{m}'>\
         <Points>{points}</Points><Cells>{cells}</Cells></Piece></UnstructuredGrid><AppendedData encoding='raw'>_"
    );
    [b"\xef\xbb\xbf", head.as_bytes(), &data, b"</AppendedData></VTKFile>"].concat()
}

#[test]
fn what_stays_on_the_disk_is_read_as_from_memory() {
    let folder = tempfile::tempdir().unwrap();
    let packed = std::fs::read("tests/data/bracket_50k.vtu").unwrap();
    for (name, bytes) in [("raw.vtu", raw_vtu()), ("packed.vtu", packed)] {
        for part in [32, 31, 30, 16, 4, 1] {
            let bytes = &bytes[..bytes.len() / 32 * part + bytes.len() % 32 * part / 32];
            let path = write(&folder, name, bytes);
            let (disk, memory) = (load(&path, &LoadOptions::default()), load_bytes(&path, bytes.to_vec(), &LoadOptions::default()));
            match (disk, memory) {
                (Ok(disk), Ok(memory)) => {
                    assert!(part >= 31, "{name}: {part} of 32 parts are enough");
                    assert_eq!(disk.report.bytes, memory.report.bytes);
                    assert!(disk.mesh.tets.len() > 3000 && disk.mesh.tets == memory.mesh.tets && disk.mesh.points == memory.mesh.points);
                    assert!(disk.mesh.fields.iter().zip(&memory.mesh.fields).all(|(a, b)| a.name == b.name && a.values == b.values));
                }
                (disk, memory) => assert_eq!(disk.unwrap_err().to_string(), memory.unwrap_err().to_string(), "{name}"),
            }
        }
    }
}

/// The content of a small file with `n` bytes more, which mean nothing, before its data.
fn padded(name: &str, bytes: &[u8], n: usize) -> Option<Vec<u8>> {
    let n = n.max(16);
    let filler = match name.rsplit('.').next()? {
        "msh" => format!("$Comments\n{}\n$EndComments\n", ".".repeat(n)).into_bytes(),
        "mesh" | "ele" | "node" | "tet" | "veg" => format!("#{}\n", ".".repeat(n)).into_bytes(),
        "inp" => format!("**{}\n", ".".repeat(n)).into_bytes(),
        "vtu" => {
            let start = if bytes.starts_with(b"<?xml") { bytes.iter().position(|&b| b == b'\n')? + 1 } else { 0 };
            let comment = format!("<!--{}-->", ".".repeat(n));
            return Some([&bytes[..start], comment.as_bytes(), &bytes[start..]].concat());
        }
        "vtk" => {
            let title = bytes.iter().position(|&b| b == b'\n')? + 1;
            return Some([&bytes[..title], &vec![b'.'; n], &bytes[title..]].concat());
        }
        "meshb" => {
            let mut padded = bytes.to_vec();
            let int = |bytes: &[u8], at: usize| i32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
            let mut next = 24; // of the section that comes after those of 8 and 12 bytes
            while int(&padded, next) != 0 {
                let moved = int(bytes, next) + n as i32;
                padded[next..next + 4].copy_from_slice(&moved.to_le_bytes());
                next = int(bytes, next) as usize + 4;
            }
            let section = [99, 20 + n as i32].into_iter().flat_map(i32::to_le_bytes).chain(vec![0; n - 8]);
            padded.splice(20..20, section);
            return Some(padded);
        }
        _ => return None,
    };
    Some([filler, bytes.to_vec()].concat())
}

/// Large files are read a chunk at a time. Wherever a chunk ends in the data, the mesh is the same, and so is the error
/// of a file that is cut.
#[test]
fn chunks_may_end_anywhere() {
    const CHUNK: usize = 1 << 18;
    let folder = tempfile::tempdir().unwrap();
    let options = LoadOptions::default();
    let mut formats = std::collections::BTreeSet::new();
    for (name, bytes) in all() {
        write(&folder, name, &bytes); // companions are read, too
    }
    for (name, small) in all() {
        let ends: Vec<_> = (1..=small.len()).step_by(37).collect();
        for (i, end) in ends.into_iter().enumerate() {
            let Some(mut bytes) = padded(name, &small, CHUNK - end) else { continue };
            formats.insert(name);
            if i % 4 == 3 {
                bytes.truncate(bytes.len() - end % 50);
            }
            let path = write(&folder, name, &bytes);
            match (load(&path, &options), load_bytes(&path, bytes, &options)) {
                (Ok(disk), Ok(memory)) => {
                    assert_eq!((disk.mesh.tets.len(), disk.report.bytes), (6, memory.report.bytes), "{name} {end}");
                    assert_eq!((&disk.mesh.tets, &disk.mesh.points), (&memory.mesh.tets, &memory.mesh.points), "{name} {end}");
                    let fields =
                        |mesh: &olbvh::mesh::Mesh| mesh.fields.iter().map(|f| (f.name.clone(), f.values.clone())).collect::<Vec<_>>();
                    assert_eq!(fields(&disk.mesh), fields(&memory.mesh), "{name} {end}");
                    assert_eq!(disk.report.warnings, memory.report.warnings, "{name} {end}");
                }
                (disk, memory) => {
                    assert!(i % 4 == 3, "{name} {end}: {:?}", disk.err());
                    assert_eq!(disk.unwrap_err().to_string(), memory.unwrap_err().to_string(), "{name} {end}");
                }
            }
        }
        write(&folder, name, &small);
    }
    assert_eq!(formats.len(), all().len(), "{formats:?}");
}
