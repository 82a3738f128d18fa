//! The error type of the crate.

use std::io;
use std::path::{Path, PathBuf};

/// Result of every fallible call of this crate.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// Every error of the crate. Its message says what went wrong, where, and what to do about it.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// No Vulkan implementation could be loaded on this machine.
    #[error("no Vulkan on this machine: {0}")]
    NoVulkan(String),
    /// No physical device meets the requirements, or the requested one does not exist.
    #[error("no suitable Vulkan device: {0}")]
    NoDevice(String),
    /// The device computes wrong results in the start-up self-test.
    #[error("device {device} failed the self-test `{test}`: {detail}; its driver cannot be trusted with this work")]
    SelfTest {
        /// Device name as the driver reports it.
        device: String,
        /// Name of the failing test.
        test: &'static str,
        /// The first wrong value, and the expected one.
        detail: String,
    },
    /// A Vulkan call returned an error.
    #[error("{call} failed: {result:?}{hint}")]
    Vulkan {
        /// The call that failed.
        call: &'static str,
        /// What it returned.
        result: ash::vk::Result,
        /// A remedy that starts with a separator, or empty.
        hint: String,
    },
    /// Device memory could not be allocated.
    #[error("cannot allocate {bytes} bytes for {name}: {reason}")]
    Memory {
        /// Name of the allocation, `olbvh.<stage>.<thing>`.
        name: String,
        /// Bytes requested.
        bytes: u64,
        /// The reason given by the allocator.
        reason: String,
    },
    /// A problem is larger than the device or the 32-bit indices of the tree can hold.
    #[error("too large: {0}")]
    TooLarge(String),
    /// A caller's [`crate::query::Progress`] ended the call.
    #[error("cancelled")]
    Cancelled,
    /// An argument contradicts another one or lies outside its range.
    #[error("invalid argument: {0}")]
    Invalid(String),
    /// The mesh has bad cells and the caller chose to reject them.
    #[error("{count} bad cells (index out of range, repeated vertex, or coordinate not finite or beyond 2^125); the first: {first}")]
    BadCells {
        /// Number of bad cells.
        count: u64,
        /// The first few, each with its reason.
        first: String,
    },
    /// A tree breaks one of its invariants (see [`crate::tree::TreeArrays::validate`]).
    #[error("the tree breaks a rule: {0}")]
    BrokenTree(String),
    /// Two structures give different answers to the same question.
    #[error("wrong answer: {0}")]
    Mismatch(String),
    /// A file's content is not valid for the format it is read as.
    #[error("{}: {place}{message}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// Line, byte, array or cell; ends with a separator, or is empty.
        place: String,
        /// What is wrong and what to do about it.
        message: String,
    },
    /// Reading or writing failed.
    #[error("{}: {}", path.display(), reason(path, source))]
    Io {
        /// The file.
        path: PathBuf,
        /// The error of the operating system.
        source: io::Error,
    },
}

/// What an error of reading or writing means for a path, and what to do about it.
fn reason(path: &Path, error: &io::Error) -> String {
    if error.raw_os_error().is_none() {
        return error.to_string(); // one of this crate, which says more
    }
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    match (error.kind(), folder) {
        (io::ErrorKind::NotFound, Some(folder)) if !folder.is_dir() => {
            format!("there is no folder {}; correct the path, or make the folder", folder.display())
        }
        (io::ErrorKind::NotFound, _) => "there is no such file; correct its name or folder".into(),
        (io::ErrorKind::PermissionDenied, _) => "this user may not read or write it; change its permissions, or take another path".into(),
        (io::ErrorKind::StorageFull, _) => "there is no room left on its disk; make room, or take another path".into(),
        _ => error.to_string(),
    }
}

impl Error {
    /// Whether the error is a lack of memory or capacity, so that a smaller request may succeed: a coarser tree, or the
    /// same work in blocks ([`crate::blocks`]).
    pub fn is_lack_of_room(&self) -> bool {
        // Any Vulkan call may run out of memory, not only an allocation.
        let full = matches!(self, Self::Vulkan { result: ash::vk::Result::ERROR_OUT_OF_DEVICE_MEMORY, .. });
        full || matches!(self, Self::Memory { .. } | Self::TooLarge(_))
    }
}
