//! `include/olbvh.h` is the header that cbindgen generates from `src/capi`.

#![allow(clippy::unwrap_used)]

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

#[test]
fn the_header_in_the_repository_is_the_generated_one() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    // All in one module, since cbindgen does not follow private ones.
    let mut source = String::new();
    let files =
        ["mod", "host", "query", "lists", "record", "record/scene", "record/locate", "record/render", "record/slice", "record/overlap"];
    for file in files.map(|stem| format!("{stem}.rs")) {
        let text = fs::read_to_string(root.join("src/capi").join(file)).unwrap();
        let left_out = ["//!", "#![", "mod ", "#[cfg(test)]"];
        for line in text.lines().filter(|l| !left_out.iter().any(|begin| l.starts_with(begin))) {
            writeln!(source, "{line}").unwrap();
        }
    }
    let folder = tempfile::tempdir().unwrap();
    let module = folder.path().join("capi.rs");
    fs::write(&module, source).unwrap();
    let mut config = cbindgen::Config::from_file(root.join(".config/cbindgen.toml")).unwrap();
    config.language = cbindgen::Language::C;
    let mut generated = Vec::new();
    cbindgen::Builder::new().with_config(config).with_src(module).generate().unwrap().write(&mut generated);

    let header = root.join("include/olbvh.h");
    let same = fs::read(&header).unwrap() == generated;
    if !same && std::env::var_os("OLBVH_BLESS").is_some() {
        fs::write(&header, generated).unwrap();
    }
    assert!(same, "include/olbvh.h is old; OLBVH_BLESS=1 writes it anew");
    let text = fs::read_to_string(header).unwrap();
    assert!(!text.contains("struct Olbvh"), "a struct lacks its name in C: `[export.rename]` of .config/cbindgen.toml");
}
