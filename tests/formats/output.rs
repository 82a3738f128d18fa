//! Files that are written appear when they are complete, in the place of those that were there.

use std::io::Write as _;
use std::path::Path;

use olbvh::Error;
use olbvh::formats::{OutputFile, is_part};

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<_> = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn no_half_written_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.bin");
    std::fs::write(&path, "old").unwrap();
    let mut file = OutputFile::create(&path).unwrap();
    file.write_all(b"new").unwrap();
    file.flush().unwrap();
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "old");
    drop(file);
    assert_eq!(names(folder.path()), ["out.bin"]);
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "old");
    let mut file = OutputFile::create(&path).unwrap();
    file.write_all(b"new").unwrap();
    file.commit().unwrap();
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "new");
    assert_eq!(names(folder.path()), ["out.bin"]);
    assert!(matches!(OutputFile::create(folder.path().join("no/such/out.bin")), Err(Error::Io { .. })));
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        let plain = folder.path().join("plain");
        std::fs::write(&plain, "").unwrap();
        let mode = |p: &Path| std::fs::metadata(p).unwrap().permissions().mode();
        assert_eq!(mode(&path), mode(&plain), "permissions as of any other new file");
        let link = folder.path().join("link");
        std::os::unix::fs::symlink(&path, &link).unwrap();
        let file = OutputFile::create(&link).unwrap();
        file.commit().unwrap();
        assert!(link.is_symlink() && std::fs::read(&path).unwrap().is_empty());
        // A pipe is written to, not replaced by a file.
        let pipe = folder.path().join("pipe");
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        let reader = std::thread::spawn({
            let pipe = pipe.clone();
            move || std::fs::read(pipe).unwrap()
        });
        let mut file = OutputFile::create(&pipe).unwrap();
        file.write_all(b"x").unwrap();
        file.commit().unwrap();
        assert_eq!(reader.join().unwrap(), b"x");
    }
}

/// Writes a file that appears at a path.
fn write(path: &Path, text: &str) -> Result<(), Error> {
    let mut file = OutputFile::create(path)?;
    file.write_all(text.as_bytes()).unwrap();
    file.commit()
}

#[cfg(unix)]
#[test]
fn permissions_are_those_of_the_file_that_was_there() {
    use std::os::unix::fs::PermissionsExt as _;
    let folder = tempfile::tempdir().unwrap();
    let (path, link) = (folder.path().join("out.bin"), folder.path().join("link"));
    std::os::unix::fs::symlink(&path, &link).unwrap();
    for mode in [0o600, 0o640, 0o755, 0o666, 0o200] {
        for name in [&path, &link] {
            std::fs::write(&path, "old").unwrap();
            std::fs::set_permissions(&path, std::fs::Permissions::from_mode(mode)).unwrap();
            write(name, "new").unwrap();
            let found = std::fs::metadata(&path).unwrap();
            assert_eq!((found.permissions().mode() & 0o7777, found.len()), (mode, 3), "{mode:o}");
            std::fs::remove_file(&path).unwrap();
        }
    }
    std::fs::write(&path, "old").unwrap();
    std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o444)).unwrap();
    for name in [&path, &link] {
        let error = write(name, "new").unwrap_err();
        assert!(matches!(&error, Error::Io { path, .. } if path == name), "{error:?}");
        assert!(error.to_string().ends_with("the file is read-only; allow writing to it, or choose another name"), "{error}");
    }
    assert_eq!((std::fs::read_to_string(&path).unwrap().as_str(), names(folder.path()).len()), ("old", 2));
}

/// A name may have 255 bytes on most systems, of the temporary file as well.
#[test]
fn long_names() {
    let folder = tempfile::tempdir().unwrap();
    for (name, times) in [("n", 251), ("é", 125), ("🚀", 62)] {
        let path = folder.path().join(name.repeat(times) + ".bin");
        for text in ["first", "second"] {
            write(&path, text).unwrap();
            assert_eq!(std::fs::read_to_string(&path).unwrap(), text);
        }
        std::fs::remove_file(&path).unwrap();
    }
    #[cfg(target_os = "linux")]
    {
        use std::os::unix::ffi::OsStrExt as _;
        let path = folder.path().join(std::ffi::OsStr::from_bytes(&[0xff; 255]));
        write(&path, "not UTF-8").unwrap();
        std::fs::remove_file(&path).unwrap();
    }
    assert!(names(folder.path()).is_empty());
}

#[test]
fn temporary_files_are_told_by_their_names() {
    let folder = tempfile::tempdir().unwrap();
    let long = "long".repeat(60);
    let targets = ["a.npy", "a.npy.b.npy", "a", long.as_str()].map(|name| folder.path().join(name));
    for target in &targets {
        let file = OutputFile::create(target).unwrap();
        let found = names(folder.path());
        assert_eq!(found.len(), 1, "{found:?}");
        let part = &found[0];
        for other in &targets {
            assert_eq!(is_part(part.as_ref(), other), target == other, "{part} of {}", other.display());
        }
        assert!(!is_part(target.file_name().unwrap(), target));
        drop(file);
    }
}
