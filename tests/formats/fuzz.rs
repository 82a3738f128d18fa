//! Files cut short and files with wrong bytes give an error or a sound mesh, never a panic.

use std::path::Path;

use crate::small::{all, polyhedra, shared, structured};
use olbvh::formats::{LoadOptions, load, load_bytes, load_points, write_mesh};

fn check(path: &Path, bytes: Vec<u8>) {
    if let Ok(loaded) = load_bytes(path, bytes, &LoadOptions::default()) {
        let mesh = loaded.mesh;
        let sound = |v: &u32| mesh.points[*v as usize].iter().all(|x| x.is_finite());
        assert!(mesh.tets.as_flattened().iter().all(sound));
        assert_eq!(loaded.report.points as usize, mesh.points.len());
        for field in &mesh.fields {
            let n = if field.on == olbvh::mesh::On::Points { mesh.points.len() } else { mesh.tets.len() };
            assert_eq!(field.values.len(), n);
        }
        assert!(mesh.cell_ids.is_none_or(|ids| ids.len() == mesh.tets.len() && ids.iter().all(|&id| id < mesh.source_cells)));
        assert!(!loaded.report.to_string().is_empty());
    }
}

/// Checks cuts and wrong bytes at every `step`-th byte.
fn damage(path: &Path, bytes: &[u8], step: usize) {
    for at in (0..bytes.len()).step_by(step) {
        check(path, bytes[..at].to_vec());
        for wrong in [bytes[at] ^ 1 << (at % 8), 0xff, 0, b'-', b'9', b' '] {
            let mut bytes = bytes.to_vec();
            bytes[at] = wrong;
            check(path, bytes);
        }
        let mut longer = bytes.to_vec();
        longer.splice(at..at, *b"99999999999999999999");
        check(path, longer);
        let mut shorter = bytes.to_vec();
        shorter.drain(at..(at + 13).min(bytes.len()));
        check(path, shorter);
    }
}

#[test]
fn small_files_of_every_format() {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in all() {
        std::fs::write(folder.path().join(name), bytes).unwrap();
    }
    for (name, bytes) in all().into_iter().chain(polyhedra()).chain(structured::files()) {
        damage(&folder.path().join(name), &bytes, 1);
    }
}

#[test]
fn compressed_files() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("kuhn.vtu");
    let mesh = load("kuhn:2,2,2", &LoadOptions::default()).unwrap().mesh;
    write_mesh(&path, &mesh).unwrap();
    damage(&path, &std::fs::read(&path).unwrap(), 1);
    let Some(shared) = shared("formats") else { return };
    for (name, step) in [("bracket_5k_vtk97_lz4.vtu", 20011), ("bracket_5k_vtk97_lzma.vtu", 20011), ("bracket_5k_appraw_lzma.vtu", 9001)] {
        damage(Path::new(name), &std::fs::read(shared.join(name)).unwrap(), step);
    }
}

#[test]
fn damaged_points_never_panic() {
    let folder = tempfile::tempdir().unwrap();
    let npy = folder.path().join("points.npy");
    olbvh::formats::write_npy(&npy, &[4, 3], &[0.5f32; 12]).unwrap();
    let csv = folder.path().join("points.csv");
    std::fs::write(&csv, "x,y,z\n1,2,3\n4.5,-1e3,nan\n").unwrap();
    for path in [npy, csv] {
        let bytes = std::fs::read(&path).unwrap();
        for at in 0..bytes.len() {
            for wrong in [bytes[at] ^ 1 << (at % 8), 0xff, 0, b'9', b'(', b'\n'] {
                let mut bytes = bytes.clone();
                bytes[at] = wrong;
                std::fs::write(&path, bytes).unwrap();
                drop(load_points(&path));
            }
            std::fs::write(&path, &bytes[..at]).unwrap();
            drop(load_points(&path));
        }
    }
}
