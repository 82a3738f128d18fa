//! Output of results on standard output and in files, and progress bars.

use crate::common::{Common, Failure, Outcome};
use crate::text;
use indicatif::{ProgressBar, ProgressStyle};
use olbvh::error::Error;
use olbvh::formats::{OutputFile, OutputFormat, destination, is_part, listed_files};
use std::io::{IsTerminal as _, Write as _};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

/// Prints text, which ends with a newline, on standard output.
pub fn print(text: &str) -> Outcome {
    to_standard_output(|out| out.write_all(text.as_bytes()))
}

fn to_standard_output(write: impl FnOnce(&mut std::io::StdoutLock<'_>) -> std::io::Result<()>) -> Outcome {
    let mut out = std::io::stdout().lock();
    write(&mut out).and_then(|()| out.flush()).map_err(|e| match e.kind() {
        std::io::ErrorKind::BrokenPipe => Failure::Closed,
        _ => Failure::Failed(format!("standard output: {e}")),
    })
}

/// Prints the JSON object with `--json`, otherwise the text.
pub fn result(common: &Common, json: &serde_json::Value, text: &str) -> Outcome {
    if common.json { print(&format!("{json:#}\n")) } else { print(text) }
}

/// Results that have been announced and may be incomplete, and whether the file is itself a temporary one.
static PENDING: Mutex<Vec<(PathBuf, bool)>> = Mutex::new(Vec::new());

/// Makes Ctrl-C remove the temporary files of unfinished results and end the program with code 130, as is usual for
/// shells.
pub fn clean_up_on_interrupt() {
    let handler = || {
        for (path, temporary) in PENDING.lock().unwrap_or_else(PoisonError::into_inner).iter() {
            remove_parts(path);
            if *temporary {
                let _ = std::fs::remove_file(path);
            }
        }
        let _ = writeln!(std::io::stderr(), "olbvh: interrupted");
        std::process::exit(130);
    };
    if let Err(e) = ctrlc::set_handler(handler) {
        log::warn!("no handler for interrupts: {e}");
    }
}

/// Removes the temporary files of `path`, which are in the same folder.
fn remove_parts(path: &Path) {
    for entry in std::fs::read_dir(folder(path)).into_iter().flatten().flatten() {
        if is_part(&entry.file_name(), path) {
            let _ = std::fs::remove_file(entry.path());
        }
    }
}

fn folder(path: &Path) -> &Path {
    path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or_else(|| Path::new("."))
}

/// Announces a result before long work, like [`announce_file`]; its extension must be that of one of `formats`.
pub fn announce(path: &Path, formats: &[OutputFormat], inputs: &[&Path]) -> Outcome<OutputFormat> {
    announce_file(path, inputs)?;
    Ok(OutputFormat::of(path, formats)?)
}

/// The one file of a result, or standard output, for which `-` stands. What goes there is collected in a temporary
/// file first: half a result could not be taken back.
pub struct ResultOutput {
    name: PathBuf,
    collected: Option<tempfile::TempPath>,
    /// The format of the result.
    pub format: OutputFormat,
}

impl ResultOutput {
    /// Announces a result like [`announce`]; standard output gets the first of `formats`, and does not go with
    /// `--json`.
    pub fn announce(name: &Path, formats: &[OutputFormat], inputs: &[&Path], common: &Common) -> Outcome<Self> {
        let (collected, format) = match formats {
            [first, ..] if name == Path::new("-") => {
                if common.json {
                    return Err(Failure::Usage("-o - and --json both need standard output; name a file for one of them".into()));
                }
                let file = tempfile::Builder::new().prefix("olbvh.").suffix(first.ending()).tempfile();
                let file = file.map_err(|e| Failure::Failed(format!("no temporary file for the result: {e}")))?;
                let path = file.into_temp_path();
                pending(path.to_path_buf(), true);
                (Some(path), *first)
            }
            _ => (None, announce(name, formats, inputs)?),
        };
        Ok(Self { name: name.into(), collected, format })
    }

    /// The file to write.
    pub fn path(&self) -> &Path {
        self.collected.as_deref().unwrap_or(&self.name)
    }

    /// Sends what was collected to standard output, and prints the summary, then on standard error.
    pub fn finish(self, common: &Common, json: &serde_json::Value, text: &str) -> Outcome {
        let Some(collected) = self.collected else { return summary(common, json, text) };
        let failed = |e| Failure::Failed(format!("the collected result: {e}"));
        let mut file = std::fs::File::open(&collected).map_err(failed)?;
        to_standard_output(|out| std::io::copy(&mut file, out).map(drop))?;
        common.remark(text.trim_end());
        Ok(())
    }
}

/// Announces a result with any extension: it must not be a folder, device, pipe or socket, nor one of the `inputs`, and
/// its folder must exist and take new files.
pub fn announce_file(path: &Path, inputs: &[&Path]) -> Outcome {
    let existing = std::fs::metadata(path).ok();
    if existing.as_ref().is_some_and(std::fs::Metadata::is_dir) {
        return Err(Failure::Usage(format!("{}: a folder; name a file in it", path.display())));
    }
    if path == Path::new("-") || existing.is_some_and(|existing| !existing.is_file()) {
        return Err(Failure::Usage(format!("{}: this result goes to a file, not to a stream or device", path.display())));
    }
    let place = std::fs::canonicalize(path).ok();
    let is_it = |input: &Path| std::fs::canonicalize(input).ok() == place;
    if place.is_some() && inputs.iter().any(|input| is_it(input) || listed_files(input).iter().any(|listed| is_it(listed))) {
        return Err(Failure::Usage(format!("{}: the result would replace an input; choose another name", path.display())));
    }
    let destination = destination(path);
    if !folder(&destination).is_dir() {
        return Err(Failure::Failed(format!(
            "{}: there is no folder {}; correct the path, or make the folder",
            path.display(),
            folder(&destination).display()
        )));
    }
    begin(path);
    drop(OutputFile::create(path)?); // better refused now than after the work
    Ok(())
}

/// Refuses a result of about this many bytes if its disk has no room for them. Where that cannot be told, nothing is refused.
pub fn check_room(path: &Path, bytes: u64) -> Outcome {
    match fs4::available_space(folder(&destination(path))) {
        Ok(free) if free < bytes => Err(Failure::Failed(format!(
            "{}: the result takes {}, and its disk has {} left; make room, or take another path",
            path.display(),
            text::bytes(bytes),
            text::bytes(free)
        ))),
        _ => Ok(()),
    }
}

/// Registers a file of a result that consists of several files, before it is written.
pub fn begin(path: &Path) {
    pending(destination(path), false);
}

fn pending(path: PathBuf, temporary: bool) {
    PENDING.lock().unwrap_or_else(PoisonError::into_inner).push((path, temporary));
}

/// Writes a text file, completely or not at all.
pub fn write_text(path: &Path, text: &str) -> Outcome {
    let mut file = OutputFile::create(path)?;
    file.write_all(text.as_bytes()).map_err(|source| Error::Io { path: path.into(), source })?;
    Ok(file.commit()?)
}

/// The progress of long work, on standard error, if that is a terminal and neither `--quiet` nor `--verbose`, which tells
/// more, is given: what is done and for how long, and, once that is known, how much of it.
pub struct Progress(Option<ProgressBar>);

impl Progress {
    /// Shows that work called `label` has begun.
    pub fn new(common: &Common, label: &'static str) -> Self {
        let shown = !common.quiet && !common.verbose && std::io::stderr().is_terminal();
        Self(shown.then(|| {
            let bar = ProgressBar::new_spinner().with_message(label);
            restyle(&bar, "{spinner} {msg} … {elapsed}");
            bar.enable_steady_tick(Duration::from_millis(100));
            bar
        }))
    }

    /// Shows that `done` of `total` units of work are finished. Never an error: it does as a [`olbvh::query::Progress`].
    #[expect(clippy::unnecessary_wraps)]
    pub fn follow(&self, done: u64, total: u64) -> Result<(), olbvh::Error> {
        self.set(done, total);
        Ok(())
    }

    /// Shows that `done` of `total` units of work are finished.
    pub fn set(&self, done: u64, total: u64) {
        let Some(bar) = &self.0 else { return };
        if bar.length() != Some(total) {
            bar.set_length(total);
            restyle(bar, "{spinner} {msg:10} {wide_bar} {percent:>3} % {eta:>5}");
        }
        bar.set_position(done);
    }

    /// Hides the bar while something is printed.
    pub fn pause<T>(&self, print: impl FnOnce() -> T) -> T {
        match &self.0 {
            Some(bar) => bar.suspend(print),
            None => print(),
        }
    }
}

fn restyle(bar: &ProgressBar, template: &str) {
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style);
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some(bar) = &self.0 {
            bar.finish_and_clear();
        }
    }
}

/// Prints a summary like [`result`], except that `--quiet` suppresses the text: the result itself is in a file.
pub fn summary(common: &Common, json: &serde_json::Value, text: &str) -> Outcome {
    if common.quiet && !common.json { Ok(()) } else { result(common, json, text) }
}
