//! Tells of tests, or parts of tests, that cannot run here.

use std::io::Write as _;

/// Prints what is not run and why. Runners hide what a passing test prints, so the line also goes to the file that
/// `scripts/test` names and lists at the end.
pub fn not_run(what: &str) {
    println!("NOT RUN: {what}");
    if let Some(list) = std::env::var_os("OLBVH_TEST_NOT_RUN") {
        let file = std::fs::OpenOptions::new().create(true).append(true).open(&list);
        let written = file.and_then(|mut file| file.write_all(format!("{what}\n").as_bytes()));
        written.unwrap_or_else(|error| panic!("{}: {error}", list.display()));
    }
}
