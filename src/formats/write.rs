//! Writers for result files. Every file is written under a temporary name in the same folder and renamed when it is
//! complete, so that a reader never sees half a file, and a failure leaves an existing file unchanged. The new file has
//! the permissions of the one that it replaces.

mod image;
mod located;
mod quiet;
mod slices;
mod voxels;
mod vtu;

use std::ffi::OsStr;
use std::fs::File;
use std::io::{BufWriter, ErrorKind, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use serde::Serialize;
use tempfile::NamedTempFile;

use super::npy;
use super::source::ending;
use crate::error::{Error, Result};
pub use image::write_png;
pub use located::{Located, write_located};
pub use slices::{SliceGrid, SliceWriter};
pub use voxels::{Channel, VoxelPackage, VoxelWriter};
pub use vtu::write_mesh;

/// A format of results, selected by the extension of the path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OutputFormat {
    /// A NumPy array.
    Npy,
    /// A zip archive of NumPy arrays.
    Npz,
    /// Comma-separated text.
    Csv,
    /// A VTK XML unstructured grid.
    Vtu,
    /// A VTK XML image.
    Vti,
    /// A picture.
    Png,
    /// A package of voxels for printers.
    Svx,
    /// JSON.
    Json,
    /// Markdown.
    Md,
}

impl OutputFormat {
    const ALL: [(Self, &str); 9] = [
        (Self::Npy, ".npy"),
        (Self::Npz, ".npz"),
        (Self::Csv, ".csv"),
        (Self::Vtu, ".vtu"),
        (Self::Vti, ".vti"),
        (Self::Png, ".png"),
        (Self::Svx, ".svx"),
        (Self::Json, ".json"),
        (Self::Md, ".md"),
    ];

    /// The format of `path`, which must be one of `allowed`. Call this before long work.
    ///
    /// # Errors
    /// [`Error::Invalid`] that lists the allowed extensions.
    pub fn of(path: impl AsRef<Path>, allowed: &[Self]) -> Result<Self> {
        let path = path.as_ref();
        let ending = ending(path);
        let found = Self::ALL.iter().find(|(format, name)| name[1..] == ending && allowed.contains(format));
        found.map(|f| f.0).ok_or_else(|| {
            let names: Vec<&str> = Self::ALL.iter().filter(|f| allowed.contains(&f.0)).map(|f| f.1).collect();
            Error::Invalid(format!("{}: the ending of the output must be one of {}", path.display(), names.join(", ")))
        })
    }

    /// The extension of files in this format, with its dot.
    pub fn ending(self) -> &'static str {
        Self::ALL.iter().find(|f| f.0 == self).map_or("", |f| f.1)
    }
}

/// Maximum number of symbolic links that are followed one after the other, as on Linux.
const MAX_LINKS: usize = 40;

/// Maximum number of bytes of the name of a result in that of its temporary file, which must not exceed 255 bytes.
const MAX_PREFIX: usize = 200;

/// Ending of the names of temporary files.
const PART: &str = ".part";

/// A file that appears at its path when it is complete; if it is dropped before that, nothing remains of it. Symbolic
/// links are followed ([`destination`]).
pub struct OutputFile {
    target: PathBuf,
    file: Target,
}

enum Target {
    Temporary(BufWriter<NamedTempFile>),
    /// A device or pipe, which cannot be replaced by renaming.
    Direct(BufWriter<File>),
}

impl OutputFile {
    /// Creates a file that will appear at `path`, with the permissions of the file that is there now.
    ///
    /// # Errors
    /// [`Error::Io`] if the folder is not writable, or the file that is there is read-only.
    pub fn create(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let fail = |source| Error::Io { path: path.into(), source: nameless(source) };
        let existing = std::fs::metadata(path).ok();
        if existing.as_ref().is_some_and(|existing| !existing.is_file()) {
            let file = File::options().write(true).open(path).map_err(fail)?;
            return Ok(Self { target: path.into(), file: Target::Direct(BufWriter::new(file)) });
        }
        let permissions = existing.map(|existing| existing.permissions());
        if permissions.as_ref().is_some_and(std::fs::Permissions::readonly) {
            let why = "the file is read-only; allow writing to it, or choose another name";
            return Err(fail(std::io::Error::new(ErrorKind::PermissionDenied, why)));
        }
        let target = destination(path);
        let folder = target.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or_else(|| Path::new("."));
        let prefix = part_prefix(&target);
        let mut builder = tempfile::Builder::new();
        builder.prefix(&prefix).suffix(PART);
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt as _;
            // The system takes away what its mask forbids to new files.
            builder.permissions(permissions.clone().unwrap_or_else(|| std::fs::Permissions::from_mode(0o666)));
        }
        let file = builder.tempfile_in(folder).map_err(fail)?;
        if let Some(permissions) = permissions {
            file.as_file().set_permissions(permissions).map_err(fail)?;
        }
        Ok(Self { target, file: Target::Temporary(BufWriter::with_capacity(1 << 18, file)) })
    }

    /// Completes the file and moves it to its path.
    ///
    /// # Errors
    /// [`Error::Io`] if the remaining data cannot be written.
    pub fn commit(self) -> Result<()> {
        let path = self.target.clone();
        let fail = |source| Error::Io { path: path.clone(), source: nameless(source) };
        match self.file {
            Target::Direct(mut file) => file.flush().map_err(fail),
            Target::Temporary(file) => {
                let file = file.into_inner().map_err(|e| fail(e.into_error()))?;
                file.persist(&self.target).map(drop).map_err(|e| fail(e.error))
            }
        }
    }

    /// Makes an error that names the file.
    pub(crate) fn fail(&self, source: std::io::Error) -> Error {
        Error::Io { path: self.target.clone(), source: nameless(source) }
    }
}

/// The file that a path leads to: a symbolic link is followed, even if it points to nothing yet, so that a result
/// replaces the file and not the link.
pub fn destination(path: &Path) -> PathBuf {
    let mut target = path.to_path_buf();
    for _ in 0..MAX_LINKS {
        let Ok(next) = std::fs::read_link(&target) else { break };
        target = target.parent().unwrap_or_else(|| Path::new("")).join(next);
    }
    target
}

/// Start of the names of the temporary files of a result.
fn part_prefix(target: &Path) -> String {
    let name = target.file_name().unwrap_or_default().to_string_lossy();
    let end = (0..=MAX_PREFIX.min(name.len())).rev().find(|&end| name.is_char_boundary(end));
    format!(".{}.", &name[..end.unwrap_or(0)])
}

/// Whether a file name is that of a temporary file for the result `target`: such a file, in the same folder, remains
/// where a process ends before it has dropped its [`OutputFile`].
pub fn is_part(name: &OsStr, target: &Path) -> bool {
    let name = name.to_string_lossy();
    let random = name.strip_prefix(&part_prefix(target)).and_then(|rest| rest.strip_suffix(PART));
    random.is_some_and(|random| !random.contains('.'))
}

/// The error of the system behind one of a library, which hides the code that tells the remedy, and names the temporary file,
/// which nobody asked for.
fn nameless(error: std::io::Error) -> std::io::Error {
    if error.raw_os_error().is_some() {
        return error;
    }
    let text = error.to_string();
    let reason = text.split(" at path \"").next().unwrap_or_default();
    let code = reason.rsplit_once("(os error ").and_then(|(_, rest)| rest.strip_suffix(')')?.parse().ok());
    code.map_or_else(|| std::io::Error::new(error.kind(), reason), std::io::Error::from_raw_os_error)
}

impl Write for OutputFile {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        match &mut self.file {
            Target::Temporary(file) => file.write(bytes).map_err(nameless),
            Target::Direct(file) => file.write(bytes),
        }
    }

    fn flush(&mut self) -> std::io::Result<()> {
        match &mut self.file {
            Target::Temporary(file) => file.flush().map_err(nameless),
            Target::Direct(file) => file.flush(),
        }
    }
}

impl Seek for OutputFile {
    fn seek(&mut self, to: SeekFrom) -> std::io::Result<u64> {
        match &mut self.file {
            Target::Temporary(file) => file.seek(to).map_err(nameless),
            Target::Direct(file) => file.seek(to),
        }
    }
}

/// Creates a file, lets `write` fill it, and completes it.
pub(crate) fn write_file(path: &Path, write: impl FnOnce(&mut OutputFile) -> std::io::Result<()>) -> Result<()> {
    let mut file = OutputFile::create(path)?;
    write(&mut file).map_err(|error| file.fail(error))?;
    file.commit()
}

/// Writes a value as JSON.
///
/// # Errors
/// [`Error::Io`] if the file cannot be written.
pub fn write_json(path: impl AsRef<Path>, value: &impl Serialize) -> Result<()> {
    write_file(path.as_ref(), |file| {
        serde_json::to_writer(&mut *file, value)?;
        writeln!(file)
    })
}

/// A number type that a NumPy array can hold.
pub trait NpyNumber: bytemuck::Pod {
    /// The type in NumPy's notation, as a Python literal.
    const DESCR: &'static str;
}

impl NpyNumber for f32 {
    const DESCR: &'static str = if cfg!(target_endian = "little") { "'<f4'" } else { "'>f4'" };
}

impl NpyNumber for f64 {
    const DESCR: &'static str = if cfg!(target_endian = "little") { "'<f8'" } else { "'>f8'" };
}

impl NpyNumber for u32 {
    const DESCR: &'static str = if cfg!(target_endian = "little") { "'<u4'" } else { "'>u4'" };
}

impl NpyNumber for u8 {
    const DESCR: &'static str = "'|u1'";
}

/// Writes a NumPy array of this shape, with the last index varying fastest.
///
/// # Errors
/// [`Error::Invalid`] if the shape does not match the data, [`Error::Io`] if the file cannot be written.
pub fn write_npy<T: NpyNumber>(path: impl AsRef<Path>, shape: &[usize], data: &[T]) -> Result<()> {
    let path = path.as_ref();
    if shape.iter().product::<usize>() != data.len() {
        return Err(Error::Invalid(format!("{}: {} values for an array of shape {shape:?}", path.display(), data.len())));
    }
    write_file(path, |file| {
        file.write_all(&npy::header(T::DESCR, shape))?;
        file.write_all(bytemuck::cast_slice(data))
    })
}

/// Escapes text for an XML attribute; characters that XML cannot hold become U+FFFD.
pub fn xml_attribute(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\n' => out.push_str("&#10;"),
            '\r' => out.push_str("&#13;"),
            '\t' => out.push_str("&#9;"),
            '\0'..='\u{1f}' | '\u{fffe}' | '\u{ffff}' => out.push('\u{fffd}'),
            c => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Errors of temporary files and of archives are those of the system.
    #[cfg(unix)]
    #[test]
    fn full_disks_are_named() {
        let full = || std::io::Error::from_raw_os_error(28);
        let of_file = std::io::Error::new(full().kind(), format!("{} at path \"/tmp/.a.csv.x.part\"", full()));
        for error in [full(), of_file, zip::result::ZipError::Io(full()).into()] {
            let shown = Error::Io { path: "a.csv".into(), source: nameless(error) }.to_string();
            assert_eq!(shown, "a.csv: there is no room left on its disk; make room, or take another path");
        }
        let other = nameless(std::io::Error::other("too bad at path \"/tmp/x\""));
        assert_eq!(other.to_string(), "too bad");
    }
}
