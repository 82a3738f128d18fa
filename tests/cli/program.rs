//! Runs of the program.

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

/// Runs the program, which must fail with `code`; returns its message.
pub fn fails(folder: &Path, code: i32, arguments: &[&str]) -> String {
    let out = olbvh(folder, arguments);
    let message = text(&out.stderr);
    assert_eq!(out.status.code(), Some(code), "{arguments:?}: {message}");
    assert!(!message.contains("panicked") && !message.is_empty(), "{arguments:?}: {message}");
    assert!(out.stdout.is_empty(), "{arguments:?} must not print results");
    message
}

pub fn has_keys(value: &Value, keys: &[&str]) {
    for key in keys {
        assert!(value.get(key).is_some(), "no {key} in {value:#}");
    }
}

/// The JSON object of a run that must succeed.
pub fn json(folder: &Path, arguments: &[&str]) -> Value {
    let out = olbvh(folder, &[arguments, &["--json"]].concat());
    assert_eq!(out.status.code(), Some(0), "{arguments:?}: {}", text(&out.stderr));
    serde_json::from_slice(&out.stdout).unwrap()
}
