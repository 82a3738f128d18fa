//! Rules of the source: which module may use which, and how things are named.

#![allow(clippy::unwrap_used)]

use std::collections::HashSet;
use std::fs;
use std::path::{Path, PathBuf};

/// The modules that each module uses besides itself, lower ones first: dependencies point one way (see "Layers" in
/// src/lib.rs). `lib.rs` may use all.
#[rustfmt::skip]
const LAYERS: &[(&str, &[&str])] = &[
    ("error", &[]),
    ("named", &[]),
    ("times", &[]),
    ("layout", &[]),
    ("grid", &["layout"]),
    ("mesh", &["error", "grid", "layout"]),
    ("options", &["error", "grid", "layout", "named"]),
    ("tree", &["grid", "layout", "options"]),
    ("slicing", &["error", "grid", "layout", "named"]),
    ("render", &["error", "grid", "layout", "mesh"]),
    ("reference", &["error", "grid", "layout", "mesh", "options", "render", "slicing", "times", "tree"]),
    ("formats", &["error", "grid", "mesh", "named"]),
    ("gpu", &["error", "kernels", "named", "primitives", "times"]),
    ("kernels", &["gpu"]),
    ("primitives", &["error", "gpu", "kernels"]),
    ("build", &["error", "gpu", "grid", "kernels", "layout", "mesh", "options", "primitives", "reference", "times", "tree"]),
    ("glsl", &["build", "error", "gpu", "layout", "options"]),
    ("query", &["build", "error", "gpu", "grid", "kernels", "layout", "mesh", "options", "primitives", "reference", "render", "slicing", "times"]),
    ("blocks", &["build", "error", "gpu", "grid", "layout", "mesh", "options", "query", "reference", "render", "slicing", "times"]),
    ("baseline", &["build", "error", "gpu", "kernels", "layout", "mesh", "named", "primitives", "query", "reference", "render", "slicing", "times"]),
    ("conformance", &["build", "error", "gpu", "grid", "layout", "mesh", "named", "options", "primitives", "query", "reference", "render", "slicing", "tree"]),
    ("capi", &["build", "error", "glsl", "gpu", "grid", "layout", "mesh", "options", "query", "reference", "render", "slicing"]),
    ("bench", &["baseline", "build", "error", "gpu", "grid", "mesh", "named", "options", "primitives", "query", "reference", "render", "slicing", "times", "tree"]),
    ("tune", &["bench", "build", "error", "formats", "gpu", "mesh", "options", "query", "reference", "render", "slicing", "times", "tree"]),
];

/// `kernels` contains what is generated for the pipelines of `gpu`, and `gpu` runs the self-test of `primitives` before
/// it trusts a device, so these three are one layer.
const ONE_LAYER: &[&str] = &["gpu", "kernels", "primitives"];

fn files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files(&path, found);
        } else if path.extension().is_some_and(|e| e == "rs") {
            found.push(path);
        }
    }
}

fn sources() -> Vec<(PathBuf, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut found = Vec::new();
    files(&root, &mut found);
    found.sort();
    found.into_iter().map(|f| (f.strip_prefix(&root).unwrap().to_path_buf(), fs::read_to_string(f).unwrap())).collect()
}

/// The module of a file; `None` for the program and `lib.rs`.
fn module(file: &Path) -> Option<String> {
    let first = file.components().next()?.as_os_str().to_string_lossy().into_owned();
    let name = first.strip_suffix(".rs").unwrap_or(&first);
    (name != "bin" && name != "lib").then(|| name.to_string())
}

/// The identifiers after every `crate::`, also in groups in braces.
fn used(text: &str) -> Vec<String> {
    let ident = |s: &str| s.trim().chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect::<String>();
    let mut used = Vec::new();
    let code = text.lines().filter(|l| !l.trim_start().starts_with("//")).collect::<Vec<_>>().join("\n");
    for rest in code.split("crate::").skip(1) {
        match rest.strip_prefix('{') {
            Some(group) => {
                let mut depth = 0;
                let mut item = String::new();
                for c in group.chars() {
                    match c {
                        '{' => depth += 1,
                        '}' if depth == 0 => break,
                        '}' => depth -= 1,
                        ',' if depth == 0 => used.push(ident(&std::mem::take(&mut item))),
                        _ => {}
                    }
                    if depth == 0 && c != ',' {
                        item.push(c);
                    }
                }
                used.push(ident(&item));
            }
            None => used.push(ident(rest)),
        }
    }
    used.retain(|u| u.chars().next().is_some_and(char::is_lowercase));
    used
}

#[test]
fn dependencies_point_one_way() {
    let mut wrong = Vec::new();
    let mut seen = HashSet::new();
    for (file, text) in sources() {
        let Some(module) = module(&file) else { continue };
        let Some((_, allowed)) = LAYERS.iter().find(|l| l.0 == module) else {
            wrong.push(format!("{}: module `{module}` has no layer", file.display()));
            continue;
        };
        let place = |name: &str| LAYERS.iter().position(|l| l.0 == name);
        for other in used(&text) {
            let one_layer = ONE_LAYER.contains(&other.as_str()) && ONE_LAYER.contains(&module.as_str());
            if place(&other) > place(&module) && !one_layer {
                wrong.push(format!("{}: `{module}` is below `{other}`", file.display()));
            }
            if other != module && !allowed.contains(&other.as_str()) {
                wrong.push(format!("{}: `{module}` may not use `{other}`", file.display()));
            }
            seen.insert((module.clone(), other));
        }
    }
    for (module, allowed) in LAYERS {
        let unused = allowed.iter().filter(|other| !seen.contains(&((*module).to_string(), (**other).to_string())));
        wrong.extend(unused.map(|other| format!("`{module}` is allowed to use `{other}`, but does not")));
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn the_rule_sees_uses() {
    assert_eq!(used("use crate::gpu::{A, B};\nuse crate::{error::Error, tree, mesh::{x, y}};"), ["gpu", "error", "tree", "mesh"]);
    assert!(used("// crate::gpu\nuse crate::Error;").is_empty());
}

/// Whether a name has the form `olbvh.<stage>.<thing>`; the thing may have parts.
fn is_name(name: &str) -> bool {
    let parts: Vec<&str> = name.split('.').collect();
    let word =
        |p: &&str| !p.is_empty() && p.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_' || c == '{' || c == '}');
    parts.len() >= 3 && parts[0] == "olbvh" && parts.iter().all(word)
}

#[test]
fn kernels_are_named_by_stage_and_thing() {
    let mut n = 0;
    for (kernel, buffers) in olbvh::kernels::interfaces() {
        assert!(is_name(kernel), "{kernel}");
        // What a ray meets is returned in its payload, not in a buffer.
        let told = kernel.ends_with("_missed") || kernel.ends_with("_hit");
        assert!(buffers.is_empty() == told && buffers.iter().all(|b| !b.is_empty()), "{kernel}: {buffers:?}");
        n += 1;
    }
    assert!(n > 20, "{n} kernels");
}

/// The string literals that directly follow `call`, after an optional first argument such as `gpu`.
fn literals<'a>(text: &'a str, call: &str) -> Vec<&'a str> {
    let follows = |rest: &'a str| {
        let rest = rest.trim_start();
        let rest = rest.strip_prefix("self,").or_else(|| rest.strip_prefix("gpu,")).unwrap_or(rest).trim_start();
        rest.strip_prefix('"').and_then(|r| r.split('"').next())
    };
    text.split(call).skip(1).filter_map(follows).collect()
}

#[test]
fn buffers_submissions_and_stages_are_named() {
    let mut wrong = Vec::new();
    let mut n = 0;
    for (file, text) in sources() {
        let text = text.split("#[cfg(test)]").next().unwrap_or_default();
        for call in [".buffer(", ".upload(", "Buffer::staging(", "reserve(", "Guarded::new(", "Guarded::scratch("] {
            for name in literals(text, call) {
                n += 1;
                if !is_name(name) {
                    wrong.push(format!("{}: buffer `{name}`", file.display()));
                }
            }
        }
        for name in literals(text, ".stage(") {
            n += 1;
            if !is_name(&format!("olbvh.{name}")) {
                wrong.push(format!("{}: stage `{name}`", file.display()));
            }
        }
        for name in literals(text, "gpu.submit(").into_iter().chain(literals(text, "until_done(")) {
            n += 1;
            if !name.starts_with("olbvh.") {
                wrong.push(format!("{}: submission `{name}`", file.display()));
            }
        }
        for label in literals(text, "r.barrier(") {
            n += 1;
            if !label.contains(" → ") {
                wrong.push(format!("{}: barrier `{label}` does not say by whom and for whom", file.display()));
            }
        }
    }
    assert!(n > 50, "{n} names found");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
