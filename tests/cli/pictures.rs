//! Settings of `olbvh render`, and what it says about pictures.

use crate::program::{json, olbvh, text};
use serde_json::Value;
use tempfile::TempDir;

const RENDER: &[&str] = &["render", "kuhn:5,4,3", "-o", "a.png", "--size", "40x30", "--device", "cpu"];

#[test]
fn render_takes_every_setting() {
    let folder = TempDir::new().unwrap();
    std::fs::write(folder.path().join("t.json"), r#"{"map": "magma", "opacity": [[0, 0], [1, 1]]}"#).unwrap();
    let settings = [
        "--camera -x,ortho,zoom=2",
        "--camera azimuth=-40,elevation=10 --tf t.json --supersample 2",
        "--clip -x --clip view=60% --clip 1,1,0=2.5 --clip z=1e2",
        "--tf inferno_r --background black --no-shading",
        "--iso 0.3,-1,0.6 --opacity 0.5",
        "--opacity 0:0,0.5:0.2,1:1 --range -0.5:1.5 --light -1,0,1 --outline 0",
        "--background #ffffff,#aabbcc --opacity 0.2 --opacity-scale 2 --termination 1 --step 0.2",
        "--background transparent --alpha 2 --assign exact --field jet --quiet",
    ];
    for line in settings {
        let arguments: Vec<&str> = RENDER.iter().copied().chain(line.split(' ')).collect();
        let out = olbvh(folder.path(), &arguments);
        assert_eq!(out.status.code(), Some(0), "{line}: {}", text(&out.stderr));
        assert_eq!(out.stdout.is_empty(), line.ends_with("--quiet"), "{line}");
    }
}

#[test]
fn what_nobody_sees_is_skipped() {
    let folder = TempDir::new().unwrap();
    let picture = ["render", "kuhn:24,20,16", "-o", "a.png", "--size", "40x30", "--device", "cpu"];
    let run = |opacity: &str| json(folder.path(), &[&picture[..], &["--opacity", opacity]].concat());
    let (opaque, narrow) = (run("0.2"), run("0:0,0.6:0,0.65:0.9,0.7:0"));
    let of = |result: &Value, key: &str| result[key].as_u64().unwrap();
    assert_eq!(of(&opaque, "skipped_samples"), 0);
    assert!(of(&narrow, "skipped_samples") > 0 && of(&narrow, "samples") < of(&opaque, "samples"), "{narrow:#}");
    let surface = json(folder.path(), &[&picture[..], &["--iso", "0.65"]].concat());
    assert!(of(&surface, "skipped_samples") > of(&surface, "samples") && surface["iso"].as_array().unwrap().len() == 1, "{surface:#}");
}

/// The mesh has 5 x 4 x 3 cubes, and its samples lie evenly in it.
#[test]
fn what_is_cut_away_is_not_drawn() {
    let folder = TempDir::new().unwrap();
    let found = |clips: &str| {
        let clear = ["--camera", "front,ortho", "--opacity", "0.001"];
        let clips: Vec<&str> = clips.split_whitespace().flat_map(|clip| ["--clip", clip]).collect();
        json(folder.path(), &[RENDER, &clear, &clips].concat())["found_samples"].as_f64().unwrap()
    };
    let all = found("");
    assert!(all > 30_000.0, "{all}");
    for (clips, part) in
        [("x", 0.5), ("-x=4", 0.2), ("x=4", 0.8), ("y=75%", 0.75), ("view=-1", 0.75), ("0,0,2=1", 1.0 / 3.0), ("z=2 -z=1 x=40%", 0.4 / 3.0)]
    {
        let share = found(clips) / all;
        assert!((share - part).abs() < 0.03, "{clips}: {share}, not {part}");
    }
    let out = olbvh(folder.path(), &[RENDER, &["--clip", "x=0"]].concat());
    assert!(out.status.success() && text(&out.stderr).contains("the picture is empty"), "{}", text(&out.stderr));
    for (wrong, why) in [("up", "`up` has no direction; a clip is DIRECTION"), ("x=y", "after `=`")] {
        let out = olbvh(folder.path(), &[RENDER, &["--clip", wrong]].concat());
        assert!(out.status.code() == Some(2) && text(&out.stderr).contains(why), "{}", text(&out.stderr));
    }
    let five = olbvh(folder.path(), &[RENDER, &["--clip", "x"].repeat(5)].concat());
    assert!(five.status.code() == Some(2) && text(&five.stderr).contains("up to 4"), "{}", text(&five.stderr));
}

/// A picture that shows nothing, or not what was meant, is no failure, but it is told.
#[test]
fn odd_pictures_are_remarked_on() {
    let folder = TempDir::new().unwrap();
    let told = |more: &[&str]| {
        let out = olbvh(folder.path(), &[RENDER, more].concat());
        assert_eq!(out.status.code(), Some(0), "{more:?}: {}", text(&out.stderr));
        assert!(text(&out.stdout).contains(" pixels, step 0.0138106"), "{}", text(&out.stdout));
        text(&out.stderr)
    };
    let range = json(folder.path(), RENDER)["range"].as_array().unwrap().iter().map(Value::to_string).collect::<Vec<_>>();
    let (empty, ends) = ("the picture is empty", "value of jet: its surface is speckled");
    assert_eq!(told(&[]), "");
    assert!(told(&["--camera", "eye=20,0,0,target=30,0,0"]).contains(empty));
    assert!(told(&["--opacity", "0", "--outline", "0"]).contains(empty));
    for (i, end) in ["smallest", "largest"].into_iter().enumerate() {
        let message = told(&["--iso", &format!("0.5,{}", range[i])]);
        assert!(message.contains(&format!("is the {end} {ends}")) && !message.contains(empty), "{message}");
    }
    let message = told(&["--iso", "9"]);
    assert!(message.contains("no surface to be seen") && !message.contains(empty), "{message}");
    let points = "POINTS 5 float 0 0 0 1 0 0 0 1 0 0 0 1 1 1 0";
    let cells = "CELLS 2 10 4 0 1 2 3 4 0 1 4 2 CELL_TYPES 2 10 10";
    let file = format!("# vtk DataFile Version 3.0\none\nASCII\nDATASET UNSTRUCTURED_GRID\n{points}\n{cells}\n");
    std::fs::write(folder.path().join("flat.vtk"), file.replace("4 0 1 4 2", "4 0 1 1 2")).unwrap();
    let out = olbvh(folder.path(), &["render", "flat.vtk", "-o", "a.png", "--size", "9", "--device", "cpu"]);
    assert!(text(&out.stderr).contains("flat.vtk: 1 bad cell is left out"), "{}", text(&out.stderr));
    assert_eq!(json(folder.path(), &["render", "flat.vtk", "-o", "a.png", "--size", "9", "--device", "cpu"])["bad_cells"], 1);
    // The camera is not to blame for these.
    let told = |name: &str, content: String, more: &[&str]| {
        std::fs::write(folder.path().join(name), content).unwrap();
        text(&olbvh(folder.path(), &[&["render", name, "-o", "a.png", "--size", "64", "--device", "cpu"], more].concat()).stderr)
    };
    let values = |value: &str| format!("{file}POINT_DATA 5\nSCALARS t float 1\nLOOKUP_TABLE default\n{}", format!("{value}\n").repeat(5));
    let message = told("one.vtk", values("1"), &["--iso", "1"]);
    assert!(message.contains("no surface to be seen: all values of t are 1") && !message.contains(empty), "{message}");
    assert!(told("none.vtk", values("nan"), &[]).contains("the picture is empty: t has no value"));
    assert!(told("flat.vtk", values("1").replace("0 0 1 1 1 0", "1 1 0 1 1 0"), &[]).contains("the picture is empty: all cells are flat"));
}
