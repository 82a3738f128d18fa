//! Files for zip archives, which make no noise when they fail.

use std::io::{Error, ErrorKind, Result, Seek, SeekFrom, Write};

/// A file that takes anything after an error, and keeps nothing of it: a zip writer that is dropped tries once more to
/// complete its archive, and complains on standard error if that fails.
pub(super) struct Quiet<W> {
    file: W,
    at: u64,
    has_failed: bool,
}

impl<W> Quiet<W> {
    pub fn new(file: W) -> Self {
        Self { file, at: 0, has_failed: false }
    }

    /// The file, unless something is missing in it.
    pub fn into_inner(self) -> Result<W> {
        if self.has_failed { Err(Error::other("an earlier part of the file could not be written")) } else { Ok(self.file) }
    }

    fn told<T>(&mut self, result: Result<T>) -> Result<T> {
        self.has_failed |= result.as_ref().is_err_and(|error| error.kind() != ErrorKind::Interrupted);
        result
    }
}

impl<W: Write> Write for Quiet<W> {
    fn write(&mut self, bytes: &[u8]) -> Result<usize> {
        let written = if self.has_failed { Ok(bytes.len()) } else { self.file.write(bytes) };
        self.at += written.as_ref().map_or(0, |&n| n as u64);
        self.told(written)
    }

    fn flush(&mut self) -> Result<()> {
        let flushed = if self.has_failed { Ok(()) } else { self.file.flush() };
        self.told(flushed)
    }
}

impl<W: Seek> Seek for Quiet<W> {
    fn seek(&mut self, to: SeekFrom) -> Result<u64> {
        let moved = match to {
            to if !self.has_failed => self.file.seek(to),
            SeekFrom::Start(at) => Ok(at),
            SeekFrom::Current(by) => Ok(self.at.saturating_add_signed(by)),
            SeekFrom::End(_) => Ok(self.at),
        };
        self.at = *moved.as_ref().unwrap_or(&self.at);
        self.told(moved)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;
    use zip::ZipWriter;
    use zip::write::SimpleFileOptions;

    /// A disk with room for so many bytes.
    struct Small(Cursor<Vec<u8>>, usize);

    impl Write for Small {
        fn write(&mut self, bytes: &[u8]) -> Result<usize> {
            if self.0.position() as usize + bytes.len() > self.1 { Err(ErrorKind::StorageFull.into()) } else { self.0.write(bytes) }
        }

        fn flush(&mut self) -> Result<()> {
            Ok(())
        }
    }

    impl Seek for Small {
        fn seek(&mut self, to: SeekFrom) -> Result<u64> {
            self.0.seek(to)
        }
    }

    #[test]
    fn archives_fail_once() {
        let options = SimpleFileOptions::default().compression_method(zip::CompressionMethod::Stored);
        for room in 0..400 {
            let mut zip = ZipWriter::new(Quiet::new(Small(Cursor::default(), room)));
            let mut member = |name: &str| -> Result<()> {
                zip.start_file(name, options)?;
                zip.write_all(&[7; 50])
            };
            let written = member("a").and_then(|()| member("b"));
            // What a drop would do succeeds after a failure.
            let finished = zip.finish().map_err(Error::from);
            assert!(written.is_ok() || finished.is_ok(), "{room}");
            let whole = written.and(finished).and_then(Quiet::into_inner);
            assert_eq!(whole.as_ref().err().map(Error::kind), (room < 278).then_some(ErrorKind::StorageFull), "{room}");
        }
    }
}
