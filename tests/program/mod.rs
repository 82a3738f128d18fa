//! Runs of the program.

#![allow(clippy::unwrap_used, reason = "helpers of tests")]

use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output};

/// Runs the program in `folder`.
pub fn olbvh(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_olbvh")).args(arguments).current_dir(folder).output().unwrap()
}

pub fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

/// The JSON object of a run that must succeed.
pub fn json(folder: &Path, arguments: &[&str]) -> Value {
    let out = olbvh(folder, &[arguments, &["--json"]].concat());
    assert_eq!(out.status.code(), Some(0), "{arguments:?}: {}", text(&out.stderr));
    serde_json::from_slice(&out.stdout).unwrap()
}
