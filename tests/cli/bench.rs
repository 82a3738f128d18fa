//! `olbvh bench` on a tiny mesh: the files that it writes, and that their figures agree.

use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output};

fn bench(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_olbvh")).arg("bench").args(arguments).current_dir(folder).output().unwrap()
}

fn strings<'a>(list: &'a Value, key: &str) -> Vec<&'a str> {
    list.as_array().unwrap().iter().map(|entry| entry[key].as_str().unwrap()).collect()
}

/// The median of the device times, or of the host times where there are none.
fn milliseconds(figure: &Value) -> f64 {
    figure["device_ms"].get("median").unwrap_or(&figure["wall_ms"]["median"]).as_f64().unwrap()
}

/// The stages agree with the figure of the build, the sizes of the tree, and the copy rate.
fn check_stages(report: &Value, mesh: &Value, structure: &Value) {
    let timed = structure["figures"][0]["stages_ms"].as_object().unwrap();
    let stages = structure["stages"].as_array().unwrap();
    let copied = report["copy"]["gb_per_s"].as_f64().unwrap();
    assert!(copied > 0.0);
    for stage in stages {
        let [ms, bytes, rate, part] = ["ms", "bytes", "gb_per_s", "of_copy_rate"].map(|key| stage[key].as_f64().unwrap());
        assert!((rate * ms * 1e6 / bytes - 1.0).abs() < 1e-9 && (part * copied / rate - 1.0).abs() < 1e-9, "{stage}");
        let name = stage["stage"].as_str().unwrap();
        let of_mesh = &mesh["topology"]["stages_ms"];
        assert_eq!(if name.starts_with("mesh.") { &of_mesh[name] } else { &timed[name] }.as_f64(), Some(ms), "{stage}");
        let entries = structure["entries"].as_f64().unwrap();
        if name == "build.emit" || name == "build.sort" {
            assert!(bytes >= 8.0 * entries, "{stage} for {entries} entries");
        }
    }
    let missing: Vec<_> =
        timed.iter().filter(|(name, ms)| ms.as_f64() > Some(0.0) && stages.iter().all(|s| s["stage"] != **name)).collect();
    // A tree of its root alone has nothing to sort and no levels.
    assert!(
        missing.iter().all(|(name, _)| structure["level"] == 0 && ["build.sort", "build.levels"].contains(&name.as_str())),
        "{missing:?}"
    );
}

#[test]
fn time_per_item_is_told_over_sizes() {
    let folder = tempfile::tempdir().unwrap();
    let sizes = ["--suite", "scaling", "--points", "300", "--repeat", "3", "--seconds", "0.02", "--quiet"];
    // A folder that exists may have a name with a dot in it.
    std::fs::create_dir(folder.path().join("results.v1")).unwrap();
    let out = bench(folder.path(), &[&["kuhn:2,2,2", "kuhn:7,6,5", "-o", "results.v1", "--json"], &sizes[..]].concat());
    assert_eq!(out.status.code(), Some(0), "{}", String::from_utf8_lossy(&out.stderr));
    let report: Value = serde_json::from_slice(&out.stdout).unwrap();
    let scaling = report["scaling"].as_array().unwrap();
    assert_eq!(scaling.len(), 3 * 2 * 3, "measurements × meshes × structures");
    for scale in scaling {
        let mesh = report["meshes"].as_array().unwrap().iter().find(|m| m["name"] == scale["mesh"]).unwrap();
        let structure = mesh["structures"].as_array().unwrap().iter().find(|s| s["name"] == scale["structure"]).unwrap();
        let figure = structure["figures"].as_array().unwrap().iter().find(|f| f["quantity"] == scale["quantity"]).unwrap();
        let per_item = scale["ns_per_item"].as_f64().unwrap();
        assert!((per_item * figure["per_second"].as_f64().unwrap() / 1e9 - 1.0).abs() < 1e-9, "{scale}");
        // The larger mesh is nearer to 200,000 tetrahedra.
        assert!(scale["mesh"] != "kuhn:7,6,5" || scale["ratio"] == 1.0, "{scale}");
    }
    assert!(std::fs::read_to_string(folder.path().join("results.v1/bench.md")).unwrap().contains("## Scaling: Construction"));
    for plot in ["fig06_construction", "location_random", "location_coherent"] {
        let svg = std::fs::read_to_string(folder.path().join(format!("results.v1/scaling_{plot}.svg"))).unwrap();
        assert!(svg.matches("<circle").count() == 6 && svg.matches("<polyline").count() == 3 && !svg.contains("NaN"), "{svg}");
    }
}

#[test]
fn a_tiny_mesh_is_measured() {
    let folder = tempfile::tempdir().unwrap();
    let sizes = ["--points", "500", "--pixels", "16", "--repeat", "3", "--seconds", "0.02"];
    let arguments = [&["kuhn:4,5,3", "shell:8", "-o", "out", "--json"], &sizes[..]].concat();
    let out = bench(folder.path(), &arguments);
    let messages = String::from_utf8_lossy(&out.stderr);
    assert_eq!(out.status.code(), Some(0), "{messages}");
    assert!(messages.contains("kuhn:4,5,3: OLBVH α=0 aabb"), "{messages}");
    let report: Value = serde_json::from_slice(&out.stdout).unwrap();
    for key in ["version", "commit", "suite", "settings", "device", "copy", "meshes"] {
        assert!(report.get(key).is_some(), "no {key} in {report:#}");
    }
    assert_eq!(report["settings"]["budget"]["repetitions"], 3);
    assert!(report["device"]["name"].is_string() && report["device"]["target"].is_string());
    assert_eq!(strings(&report["meshes"], "name"), ["kuhn:4,5,3", "shell:8"]);
    let has = |way: &str| report["device"][way].as_bool().unwrap();
    for mesh in report["meshes"].as_array().unwrap() {
        let structures = mesh["structures"].as_array().unwrap();
        let kinds = strings(&mesh["structures"], "kind");
        assert_eq!(kinds.iter().filter(|&&k| k == "olbvh").count(), 13);
        assert!(kinds.contains(&"lbvh"));
        assert!(["ray_query", "ray_pipeline"].iter().all(|way| kinds.contains(way) == has(way)), "{kinds:?}");
        let lbvh = structures.iter().find(|s| s["kind"] == "lbvh").unwrap();
        for structure in structures {
            let memory = &structure["memory"];
            let sum: u64 = memory["arrays"].as_array().unwrap().iter().map(|a| a[1].as_u64().unwrap()).sum();
            assert_eq!(Some(sum), memory["total"].as_u64());
            let quantities = strings(&structure["figures"], "quantity");
            let expected = ["build", "locate_random", "locate_coherent", "locate_samples", "intervals", "march", "slice", "overlap"];
            // The paper's traversal is measured on the paper's trees.
            let (traversed, others): (Vec<&str>, Vec<&str>) = quantities.into_iter().partition(|q| q.starts_with("traverse_"));
            let papers = structure["kind"] == "olbvh" && structure["assign"] == "aabb" && structure["lists"] == "all";
            assert_eq!(traversed, if papers { vec!["traverse_random", "traverse_coherent"] } else { vec![] });
            assert!(others.starts_with(&expected[..4]), "{others:?}");
            if !structure["kind"].as_str().unwrap().starts_with("ray_") {
                assert_eq!(others, expected);
            }
            if structure["kind"] == "olbvh" {
                assert!(memory["paper"].as_u64().is_some() && structure["nodes"].as_u64().is_some());
                check_stages(&report, mesh, structure);
            }
            for figure in structure["figures"].as_array().unwrap() {
                let time = milliseconds(figure);
                let spread = &figure["wall_ms"];
                let [min, median, max] = ["min", "median", "max"].map(|k| spread[k].as_f64().unwrap());
                assert!(time > 0.0 && min <= median && median <= max, "{figure}");
                assert!((1..=3).contains(&figure["repetitions"].as_u64().unwrap()));
                if let Some(items) = figure["items"].as_f64() {
                    let rate = figure["per_second"].as_f64().unwrap();
                    assert!((rate * time / 1e3 / items - 1.0).abs() < 1e-9, "{figure}");
                }
                // The ratio is the one of the times printed.
                let baseline = lbvh["figures"].as_array().unwrap().iter().find(|f| f["quantity"] == figure["quantity"]);
                let ratio = baseline.map(|b| milliseconds(b) / time);
                match (figure["speedup"].as_f64(), ratio) {
                    (Some(speedup), Some(ratio)) => assert!((speedup / ratio - 1.0).abs() < 1e-9, "{figure}"),
                    (speedup, ratio) => assert_eq!(speedup, ratio, "{figure}"),
                }
            }
        }
        let lost = structures.iter().map(|s| s["lost"]["points"].as_u64());
        assert!(lost.zip(&kinds).all(|(lost, &kind)| lost.is_some() == kind.starts_with("ray_")));
    }
    let out = folder.path().join("out");
    let stored: Value = serde_json::from_slice(&std::fs::read(out.join("bench.json")).unwrap()).unwrap();
    assert_eq!(stored, report);
    let tables = std::fs::read_to_string(out.join("bench.md")).unwrap();
    for title in [
        "## Bytes that each stage moves at least, shell:8",
        "## Meshes (Table 1)",
        "## Construction (Fig. 6)",
        "## Memory (Table 2)",
        "## Every measurement, shell:8",
    ] {
        assert!(tables.contains(title), "no {title} in {tables}");
    }
    for plot in ["fig06_construction", "table2_memory", "fig07_samples", "fig08_slicing", "fig10_overlap", "location_random"] {
        let svg = std::fs::read_to_string(out.join(plot).with_extension("svg")).unwrap();
        assert!(svg.starts_with("<svg") && svg.ends_with("</svg>\n") && svg.contains("LBVH") && !svg.contains("NaN"), "{plot}");
    }
}

#[test]
fn two_results_are_compared() {
    let folder = tempfile::tempdir().unwrap();
    let measured = |mesh: &str, file: &str, pixels: &str| {
        let sizes = ["--points", "500", "--pixels", pixels, "--repeat", "3", "--seconds", "0.02", "--quiet"];
        let out = bench(folder.path(), &[&[mesh, "-o", file], &sizes[..]].concat());
        assert_eq!(out.status.code(), Some(0), "{}", String::from_utf8_lossy(&out.stderr));
    };
    measured("kuhn:3,2,2", "a.json", "16");
    measured("kuhn:3,2,2", "b.json", "24");
    let out = bench(folder.path(), &["--compare", "a.json", "b.json", "-o", "changes.md", "--json"]);
    assert_eq!(out.status.code(), Some(0), "{}", String::from_utf8_lossy(&out.stderr));
    let json: Value = serde_json::from_slice(&out.stdout).unwrap();
    assert_eq!(json["different"]["settings.picture"], serde_json::json!([16, 24]));
    assert_eq!(json["same"]["settings.points"], 500);
    let compared = json["compared"].as_array().unwrap();
    let of = |name: &str| compared.iter().filter(|c| c["measurement"] == name).count();
    assert!(of("copy") == 2 && of("build") >= 13 && of("locate_random") == of("build") && of("intervals") == 0, "{json:#}");
    let report: Value = serde_json::from_slice(&std::fs::read(folder.path().join("a.json")).unwrap()).unwrap();
    let first = &report["meshes"][0]["structures"][0]["figures"][0];
    assert_eq!(
        compared.iter().find(|c| c["measurement"] == "build").unwrap()["ms"][0],
        first[if first["device_ms"].is_null() { "wall_ms" } else { "device_ms" }]
    );
    let tables = std::fs::read_to_string(folder.path().join("changes.md")).unwrap();
    assert!(tables.contains("## Summary") && tables.contains("## Times, kuhn:3,2,2") && tables.contains("WHAT DIFFERS"), "{tables}");
    let replacing = bench(folder.path(), &["--compare", "a.json", "b.json", "-o", "b.json"]);
    assert_eq!(replacing.status.code(), Some(2));
    let missing = bench(folder.path(), &["--compare", "a.json", "nothing.json"]);
    assert_eq!(missing.status.code(), Some(3));
    assert_eq!(bench(folder.path(), &["--compare", "a.json"]).status.code(), Some(2));
    assert_eq!(bench(folder.path(), &["--compare", "a.json", "changes.md"]).status.code(), Some(3));
    assert_eq!(bench(folder.path(), &["kuhn:2,2,2", "--compare", "a.json", "b.json"]).status.code(), Some(2));
}

/// The other meshes are measured, their results are written with what failed, and the run ends with code 1.
#[test]
fn a_mesh_that_fails_does_not_end_the_run() {
    let folder = tempfile::tempdir().unwrap();
    let brief = ["--suite", "scaling", "--points", "64", "--repeat", "1", "--seconds", "0"];
    let out = bench(folder.path(), &[&["nothing.vtu", "kuhn:1,1,1", "-o", "out.json"][..], &brief].concat());
    let message = String::from_utf8_lossy(&out.stderr);
    assert!(out.status.code() == Some(1) && message.contains("1 of 2 meshes could not be measured"), "{message}");
    let report: Value = serde_json::from_str(&std::fs::read_to_string(folder.path().join("out.json")).unwrap()).unwrap();
    assert_eq!(strings(&report["meshes"], "name"), ["kuhn:1,1,1"]);
    let failed = report["failed"].as_array().unwrap();
    assert!(failed.len() == 1 && failed[0].as_str().unwrap().starts_with("nothing.vtu: "), "{failed:?}");
    assert!(String::from_utf8_lossy(&out.stdout).contains("not measured: nothing.vtu: "), "the text tells as well");
}

#[test]
fn wrong_arguments_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let wrong: [&[&str]; 6] = [
        &["--suite", "huge"],
        &["--repeat", "0"],
        &["kuhn:2,2,2", "-o", "a.csv"],
        &["kuhn:2,2,2", "--seconds=-1"],
        &["shell:3"],
        &["kuhn:2,2,2", "--device", "cpu"],
    ];
    for arguments in wrong {
        let out = bench(folder.path(), arguments);
        assert_eq!(out.status.code(), Some(2), "{arguments:?}: {}", String::from_utf8_lossy(&out.stderr));
    }
    let message = String::from_utf8(bench(folder.path(), &["--seconds", "-3"]).stderr).unwrap();
    assert!(message.contains("--seconds -3: a time"), "{message}");
    assert_eq!(bench(folder.path(), &["nothing.vtu"]).status.code(), Some(3));
    for wrong in [&["kuhn:2,2,2", "--seconds", "-1"][..], &["kuhn:2,2,2", "--device", "no such device"], &["nothing.vtu"]] {
        assert_ne!(bench(folder.path(), &[wrong, &["-o", "a/b/c"]].concat()).status.code(), Some(0), "{wrong:?}");
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0, "a refused run leaves nothing");
    for (output, part) in [("file", ".json"), ("mesh.md", "would replace")] {
        std::fs::write(folder.path().join(output), "").unwrap();
        let out = bench(folder.path(), &["mesh.md", "-o", output]);
        let message = String::from_utf8_lossy(&out.stderr);
        assert!(out.status.code() == Some(2) && message.contains(part), "{output}: {message}");
    }
}
