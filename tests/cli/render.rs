//! The program as its users run it: exit codes, JSON keys, messages and files.

use crate::program::{fails, has_keys, json, olbvh, text};
use std::path::Path;
use std::process::Command;
use tempfile::TempDir;

const RENDER: &[&str] = &["render", "kuhn:5,4,3", "-o", "a.png", "--size", "40x30", "--device", "cpu"];

#[test]
fn render_writes_a_picture_and_its_figures() {
    let folder = TempDir::new().unwrap();
    let result = json(folder.path(), RENDER);
    has_keys(&result, &["samples", "found_samples", "interval_ms", "march_ms"]);
    assert!(result["found_samples"].as_u64() > Some(1000) && result["field"] == "jet", "{result:#}");
    let file = std::io::BufReader::new(std::fs::File::open(folder.path().join("a.png")).unwrap());
    let info = png::Decoder::new(file).read_info().unwrap().info().size();
    assert_eq!(info, (40, 30));
    let names: Vec<_> = std::fs::read_dir(folder.path()).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert_eq!(names, ["a.png"], "nothing else is left");
    let same = json(folder.path(), &[RENDER, &["--camera", result["camera"].as_str().unwrap()]].concat());
    assert_eq!([&same["samples"], &same["found_samples"]], [&result["samples"], &result["found_samples"]], "its camera draws it again");
}

/// Width of a picture, and the four bytes of each of its pixels.
fn pixels(file: &Path) -> (usize, Vec<[u8; 4]>) {
    let mut reader = png::Decoder::new(std::io::BufReader::new(std::fs::File::open(file).unwrap())).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut bytes).unwrap();
    assert_eq!(info.color_type, png::ColorType::Rgba);
    (info.width as usize, bytes.chunks_exact(4).map(|pixel| pixel.try_into().unwrap()).collect())
}

/// A legend takes a strip at the right, with the colours from the largest value down to the smallest; what is left of
/// the picture is as large as without it.
#[test]
fn a_legend_stands_beside_the_mesh() {
    let folder = TempDir::new().unwrap();
    let picture = |name: &str, more: &[&str]| {
        let grey = ["--tf", "grey", "--no-shading", "--background", "#ff0000"];
        json(folder.path(), &[&["render", "kuhn:5,4,3", "-o", name, "--device", "cpu"], &grey[..], more].concat());
        pixels(&folder.path().join(name))
    };
    let (width, all) = picture("legend.png", &["--size", "230x150", "--legend"]);
    assert_eq!((width, all.len()), (230, 230 * 150));
    let strip = 102;
    let (left, drawn) = picture("drawn.png", &["--size", "128x150"]);
    assert_eq!(left + strip, width);
    for (row, drawn) in all.chunks(width).zip(drawn.chunks(left)) {
        assert!(row[..left] == *drawn);
    }
    let bar: Vec<u8> = all.chunks(width).map(|row| row[left + 10]).filter(|p| p[0] == p[1] && p[1] == p[2]).map(|p| p[0]).collect();
    let end = bar.iter().rposition(|&grey| grey == 0).unwrap();
    let bar = &bar[end + 1 - 90..=end]; // below the name, whose letters are black
    assert!(bar.first() == Some(&255) && bar.is_sorted_by(|a, b| a >= b), "{bar:?}");
    let labels = all.chunks(width).flat_map(|row| &row[left + 40..]).filter(|pixel| pixel[..3] != [255, 0, 0]).count();
    assert!(labels > 50, "{labels} pixels of labels");
    let message = fails(folder.path(), 2, &["render", "kuhn:5,4,3", "-o", "a.png", "--size", "100x100", "--legend"]);
    assert!(message.contains("too small for --legend; take at least 204x128"), "{message}");
    picture("narrow.png", &["--size", "210x1500", "--legend"]);
}

/// The edges of a solid block's bounds are those of the block: the box changes only pixels there, and few beside it.
#[test]
fn a_box_lies_around_the_mesh() {
    let folder = TempDir::new().unwrap();
    let picture = |name: &str, more: &[&str]| {
        let red =
            ["--tf", "grey", "--no-shading", "--opacity", "1", "--background", "#ff0000", "--size", "120x90", "--camera", "iso,fov=50"];
        json(folder.path(), &[&["render", "kuhn:5,4,3", "-o", name, "--device", "cpu"], &red[..], more].concat());
        pixels(&folder.path().join(name)).1
    };
    let (plain, boxed) = (picture("plain.png", &[]), picture("box.png", &["--box"]));
    let red = |i: usize| plain[i][..3] == [255, 0, 0];
    let changed: Vec<usize> = (0..plain.len()).filter(|&i| plain[i] != boxed[i]).collect();
    let inside = changed.iter().filter(|&&i| !red(i)).count();
    // Nine edges are seen, three of them within the block's outline.
    assert!(inside > 100 && changed.len() < 900, "{inside} of {} changed pixels on the block", changed.len());
    let around = |i: usize| (0..25).map(move |k| i + 120 * (k / 5) + k % 5 - 242);
    assert!(changed.iter().all(|&i| around(i).any(|j| !red(j))), "lines lie on the block's outline, or less than three pixels beside it");
}

/// A pixel is the mean of its rays: of black and white ones, as the mesh is seen or the background.
#[test]
fn rays_of_a_pixel_are_averaged() {
    let folder = TempDir::new().unwrap();
    let picture = |name: &str, more: &[&str]| {
        let white = ["--tf", "grey", "--range=-9:-8", "--opacity", "1", "--opacity-scale", "1000", "--no-shading", "--background", "black"];
        let result = json(folder.path(), &[&["render", "kuhn:5,4,3", "-o", name, "--device", "cpu"], &white[..], more].concat());
        (result, pixels(&folder.path().join(name)).1.into_iter().map(|pixel| u32::from(pixel[0])).collect::<Vec<_>>())
    };
    let (rays, of_rays) = picture("rays.png", &["--size", "80x60"]);
    let (result, of_pixels) = picture("pixels.png", &["--size", "40x30", "--supersample", "2"]);
    assert_eq!([&result["width"], &result["height"], &result["supersample"]], [40, 30, 2]);
    assert_eq!(result["samples"], rays["samples"], "the same rays");
    for (i, &pixel) in of_pixels.iter().enumerate() {
        let corner = i / 40 * 2 * 80 + i % 40 * 2;
        let sum: u32 = [0, 1, 80, 81].iter().map(|beside| of_rays[corner + beside]).sum();
        assert!(pixel.abs_diff(sum / 4) <= 1, "pixel {i} is {pixel}, its rays sum up to {sum}");
    }
    assert!(of_pixels.iter().filter(|&&pixel| (60..200).contains(&pixel)).count() > 40, "edges are smooth");
    let message = fails(folder.path(), 2, &["render", "kuhn:5,4,3", "-o", "a.png", "--size", "9000", "--supersample", "2"]);
    assert!(message.contains("16384 rays"), "{message}");
}

/// Two tetrahedra with points of their own and a common face.
#[test]
fn points_that_coincide_are_merged_on_demand() {
    let folder = TempDir::new().unwrap();
    let points = "0 0 0 1 0 0 0 1 0 0 0 1 1 0 0 0 1 0 0 0 1 1 1 1";
    let cells = "CELLS 2 10 4 0 1 2 3 4 4 5 6 7 CELL_TYPES 2 10 10";
    let file = format!("# vtk DataFile Version 3.0\ntwo\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 8 float {points}\n{cells}\n");
    std::fs::write(folder.path().join("two.vtk"), file).unwrap();
    let info = ["info", "two.vtk", "--device", "cpu"];
    assert!(text(&olbvh(folder.path(), &info).stderr).contains("--merge all"));
    for (merge, points) in [("nothing", 8), ("pieces", 8), ("all", 5)] {
        assert_eq!(json(folder.path(), &[&info[..], &["--merge", merge]].concat())["points"], points);
    }
    let message = fails(folder.path(), 2, &[&info[..], &["--merge", "some"]].concat());
    assert!(message.contains("known are nothing, pieces, all"), "{message}");
}

#[test]
fn info_tells_mesh_and_tree() {
    let folder = TempDir::new().unwrap();
    let result = json(folder.path(), &["info", "kuhn:6,5,4", "--device", "cpu"]);
    has_keys(
        &result,
        &[
            "cells",
            "points",
            "bad_cells",
            "boundary_cells",
            "crowded_points",
            "branched_faces",
            "fields",
            "bounds",
            "tree",
            "tangled_cells",
        ],
    );
    assert_eq!((&result["volume"], &result["parts"]), (&120.0.into(), &1.into()));
    assert_eq!(result["neighbour_bytes"], 16 * 720);
    has_keys(&result["tree"], &["l", "entries", "nodes", "leaves", "bytes", "paper_bytes", "build_ms"]);
    assert_eq!((result["cells"].as_u64(), result["points"].as_u64()), (Some(720), Some(210)));
    let bytes = result["tree"]["bytes"].as_object().unwrap();
    let sum: u64 = bytes.iter().filter(|(name, _)| *name != "total").map(|(_, n)| n.as_u64().unwrap()).sum();
    assert_eq!(bytes["total"].as_u64(), Some(sum));
    let finer = json(folder.path(), &["info", "kuhn:6,5,4", "--level", "4", "--device", "cpu"]);
    assert_eq!(
        (result["tree"]["l"].as_u64(), finer["tree"]["l"].as_u64(), finer["tree"]["l_wanted"].as_u64()),
        (Some(2), Some(4), Some(4))
    );
    let page = olbvh(folder.path(), &["info", "kuhn:6,5,4", "--device", "cpu"]);
    for part in ["720", "jet", "volume", "level of the leaves", "as the paper counts"] {
        assert!(text(&page.stdout).contains(part), "no {part} in {}", text(&page.stdout));
    }
}

/// A face of three cells; any device and the CPU count it.
#[test]
fn info_counts_faces_of_more_than_two_cells() {
    let folder = TempDir::new().unwrap();
    let mesh = "# vtk DataFile Version 3.0\nthree cells on a face\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 6 float\n\
        0 0 0 1 0 0 0 1 0 0 0 1 1 1 1 0.5 0.5 3\nCELLS 3 15\n4 0 1 2 3\n4 4 1 3 2\n4 5 1 2 3\nCELL_TYPES 3\n10 10 10\n";
    std::fs::write(folder.path().join("three.vtk"), mesh).unwrap();
    for device in [&["--device", "cpu"][..], &[]] {
        let arguments = [&["info", "three.vtk"], device].concat();
        assert_eq!(json(folder.path(), &arguments)["branched_faces"], 1);
        let page = olbvh(folder.path(), &arguments);
        assert!(text(&page.stdout).contains("branched faces"), "{}", text(&page.stdout));
    }
}

/// `-` stands for standard input and output; they carry what the files would, and nothing else.
#[test]
fn results_go_to_standard_output() {
    use std::io::Write as _;
    let (folder, temporary) = (TempDir::new().unwrap(), TempDir::new().unwrap());
    let piped = |arguments: &[&str], input: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_olbvh"));
        command.args(arguments).args(["--device", "cpu"]).current_dir(folder.path()).env("TMPDIR", temporary.path());
        command.stdin(std::process::Stdio::piped()).stdout(std::process::Stdio::piped()).stderr(std::process::Stdio::piped());
        let mut child = command.spawn().unwrap();
        child.stdin.take().unwrap().write_all(input.as_bytes()).unwrap();
        child.wait_with_output().unwrap()
    };
    let points = "0.5,0.25,0.125\n9,9,9\n";
    std::fs::write(folder.path().join("p.csv"), points).unwrap();
    for (arguments, named, file) in [
        (vec!["locate", "kuhn:3,3,3", "-"], "p.csv", "o.csv"),
        (vec!["locate", "kuhn:3,3,3", "-", "--all"], "p.csv", "all.csv"),
        (vec!["overlap", "kuhn:2,2,2", "kuhn:3,3,3"], "", "o.json"),
        (vec!["render", "kuhn:2,2,2", "--size", "9"], "", "a.png"),
    ] {
        let of_file: Vec<&str> = arguments.iter().map(|&a| if a == "-" { named } else { a }).collect();
        json(folder.path(), &[&of_file[..], &["-o", file, "--device", "cpu"]].concat());
        let out = piped(&[&arguments[..], &["-o", "-"]].concat(), points);
        assert_eq!(out.status.code(), Some(0), "{arguments:?}: {}", text(&out.stderr));
        assert!(out.stdout == std::fs::read(folder.path().join(file)).unwrap(), "{arguments:?}");
        assert!(text(&out.stderr).starts_with("-: "), "the summary: {}", text(&out.stderr));
    }
    let both = piped(&["render", "kuhn:2,2,2", "-o", "-", "--json"], "");
    assert!(both.status.code() == Some(2) && text(&both.stderr).contains("--json") && both.stdout.is_empty());
    let broken = piped(&["locate", "kuhn:2,2,2", "-", "-o", "-"], "1,2,3\n4,five,6\n");
    assert!(broken.status.code() == Some(3) && text(&broken.stderr).contains("-: line 2: `five`"), "{}", text(&broken.stderr));
    assert_eq!(std::fs::read_dir(temporary.path()).unwrap().count(), 0, "nothing is left");
}

#[test]
fn devices_are_listed() {
    let folder = TempDir::new().unwrap();
    let result = json(folder.path(), &["devices"]);
    let devices = result["devices"].as_array().unwrap();
    // The other tests of a row need its driver.
    assert!(!devices.is_empty() || std::env::var_os("OLBVH_TEST_DRIVER").is_none(), "no device");
    for device in devices {
        has_keys(device, &["name", "driver", "api", "subgroup", "qualifies", "missing", "fault"]);
        assert_eq!(device["qualifies"].as_bool().unwrap(), device["fault"].is_null(), "{device}");
    }
}

#[test]
fn help_is_there_for_everything() {
    let folder = TempDir::new().unwrap();
    for command in ["", "devices", "info", "locate", "render", "slice", "overlap", "conformance", "bench", "tune"] {
        for help in ["--help", "-h"] {
            let arguments: Vec<_> = [command, help].into_iter().filter(|word| !word.is_empty()).collect();
            let out = olbvh(folder.path(), &arguments);
            assert_eq!(out.status.code(), Some(0));
            assert!(text(&out.stdout).contains("Example"), "{arguments:?} has no example");
        }
    }
    assert!(text(&olbvh(folder.path(), &["--help"]).stdout).contains("130"));
    let help = text(&olbvh(folder.path(), &["render", "--help"]).stdout);
    for part in ["viridis", "\"colors\"", "azimuth", "--opacity"] {
        assert!(help.contains(part), "no {part} in {help}");
    }
}

#[test]
fn wrong_usage_ends_with_2() {
    let folder = TempDir::new().unwrap();
    let with = |more: &[&'static str]| [RENDER, more].concat();
    let none: [&[&str]; 4] = [&[], &["bake"], &["render", "kuhn:2,2,2"], &["info", "kuhn:2,2,2", "--alpha", "11"]];
    for arguments in none {
        fails(folder.path(), 2, arguments);
    }
    for (more, part) in [
        (&["--camera", "sideways"][..], "sideways"),
        (&["--tf", "jet"], "viridis"),
        (&["--opacity", "2"], "outside 0 to 1"),
        (&["--step", "0"], "step"),
        (&["--step", "1e39"], "a step of 1e39 is longer than"),
        (&["--camera", "ortho=1e39"], "a picture 1e39 high"),
        (&["--camera", "eye=1e39,0,0,ortho"], "an eye at a distance of 1.0e39"),
        (&["--camera", "up=0,0,0"], "`up=0,0,0` needs a direction"),
        (&["--iso", "0.2,x"], "separated by commas"),
        (&["--iso", "1,2,3,4,5,6,7,8,9"], "up to 8"),
        (&["--background", "pink"], "pink"),
        (&["--range", "3:1"], "LO must be below HI"),
        (&["--range", "1:1"], "LO must be below HI"),
        (&["--step", "-1"], "a step of -1"),
        (&["--opacity", "-1"], "-1 lies outside 0 to 1"),
        (&["--opacity-scale", "-1"], "an opacity scale of -1"),
        (&["--outline", "-1"], "an outline of -1"),
        (&["--camera", "eye=1,2"], "'--camera <CAMERA>': `eye=1,2` needs three numbers"),
        (&["--camera", "iso,top"], "'--camera <CAMERA>': `top` is a second view"),
        (&["--background", "sky"], "'--background <COLOR>': `sky` is no background"),
        (&["--field", "pressure"], "jet"),
        (&["--assign", "boxes"], "planes"),
    ] {
        let message = fails(folder.path(), 2, &with(more));
        assert!(message.contains(part), "{more:?}: {message}");
        assert!(!message.contains("unexpected argument"), "{more:?}: {message}");
    }
    let message = fails(folder.path(), 2, &["info", "kuhn:2,2,2", "--device", ""]);
    assert!(message.contains("a value is required for '--device"), "{message}");
    let message = fails(folder.path(), 2, &["render", "kuhn:2,2,2", "-o", "a.jpg"]);
    assert!(message.contains(".png"), "{message}");
    fails(folder.path(), 2, &["render", "kuhn:2,2,2", "-o", "a.png", "--size", "0x5"]);
    for (mesh, part) in [
        ("kuhn:0,1,2", "kuhn:0,1,2: a grid needs at least one cube along each axis"),
        ("graded:0", "graded:0: a grid needs"),
        ("kuhn:100000,100000,100000", "1000030000300001 points"),
        ("kuhn:2,2", "kuhn:2,2: three whole numbers"),
    ] {
        let message = fails(folder.path(), 2, &["info", mesh, "--device", "cpu"]);
        assert!(message.matches(&mesh).count() == 1 && message.contains(part), "{message}");
    }
    assert!(!folder.path().join("a.png").exists());
}

#[test]
fn bad_files_end_with_3_and_are_named() {
    let folder = TempDir::new().unwrap();
    std::fs::write(folder.path().join("bad.vtu"), "<VTKFile type=\"UnstructuredGrid\"><Unstruct").unwrap();
    std::fs::write(folder.path().join("p.csv"), "x,y\n1,2\n").unwrap();
    for (mesh, part) in [
        ("bad.vtu", "bad.vtu"),
        ("missing.vtu", "missing.vtu"),
        ("cube:3", "kuhn:NX,NY,NZ, graded:N"),
        (".", "folder; name a file in it (.vtu"),
    ] {
        let message = fails(folder.path(), 3, &["info", mesh, "--device", "cpu"]);
        assert!(message.contains(part), "{message}");
    }
    fails(folder.path(), 3, &["locate", "kuhn:2,2,2", "p.csv", "-o", "o.csv", "--device", "cpu"]);
    fails(folder.path(), 3, &["render", "kuhn:2,2,2", "-o", "a.png", "--tf", "missing.json"]);
}

#[test]
fn unknown_devices_end_with_4_and_failures_with_1() {
    let folder = TempDir::new().unwrap();
    let message = fails(folder.path(), 4, &["info", "kuhn:2,2,2", "--device", "no such device"]);
    assert!(message.contains("no Vulkan") || message.contains("no device `no such device`; there are: 0 "), "{message}");
    fails(folder.path(), 1, &["render", "kuhn:2,2,2", "-o", "no/such/folder/a.png", "--device", "cpu"]);
}

/// What an existing path is decides whether it can be a result; links are kept.
#[cfg(unix)]
#[test]
fn results_go_to_files_of_any_folder() {
    let folder = TempDir::new().unwrap();
    let place = |name: &str| folder.path().join(name);
    let render = |code: i32, output: &str| {
        let out = olbvh(folder.path(), &["render", "kuhn:2,2,2", "-o", output, "--size", "4", "--device", "cpu"]);
        assert_eq!(out.status.code(), Some(code), "{output}: {}", text(&out.stderr));
        text(&out.stderr)
    };
    let (old, new) = (place("old.png"), place("new.png"));
    std::fs::write(&old, "").unwrap();
    for (target, link) in [(&old, "a.png"), (&new, "b.png")] {
        std::os::unix::fs::symlink(target.file_name().unwrap(), place(link)).unwrap();
        render(0, link);
        assert!(place(link).is_symlink() && !target.is_symlink() && std::fs::metadata(target).unwrap().len() > 0, "{link}");
    }
    assert!(Command::new("mkfifo").arg(place("pipe.png")).status().unwrap().success());
    std::fs::create_dir(place("folder.png")).unwrap();
    std::os::unix::fs::symlink("/dev/null", place("null.png")).unwrap();
    for (output, part) in [("pipe.png", "stream or device"), ("null.png", "stream or device"), ("folder.png", "a folder")] {
        let message = render(2, output);
        assert!(message.contains(part), "{output}: {message}");
    }
    if Path::new("/dev/shm").is_dir() {
        let shared = tempfile::tempdir_in("/dev/shm").unwrap();
        render(0, shared.path().join("a.png").to_str().unwrap());
    }
    if Path::new("/proc/self").is_dir() {
        let message = render(1, "/proc/a.png");
        assert!(message.contains("/proc/a.png: ") && !message.contains(".part"), "{message}");
        // It is told before the mesh is read.
        let message = fails(folder.path(), 1, &["render", "missing.vtu", "-o", "/proc/a.png", "--device", "cpu"]);
        assert!(message.contains("/proc/a.png: ") && !message.contains("missing.vtu"), "{message}");
    }
}

/// A list names the large cases, too, and a name selects them.
#[test]
fn conformance_lists_what_it_can_run() {
    let folder = TempDir::new().unwrap();
    let groups = |arguments: &[&str]| {
        let told = json(folder.path(), &[&["conformance", "--list"], arguments].concat());
        let names = |group: &str| told["cases"].as_array().unwrap().iter().filter(|case| case["group"] == group).count();
        ["quick", "full", "large"].map(names)
    };
    let all = groups(&[]);
    assert!(all.iter().all(|&n| n > 0), "{all:?}");
    assert_eq!(groups(&["--filter", "large"]), [0, 0, all[2]]);
    assert_eq!(groups(&["--filter", "full"]), [all[0], all[1], 0]);
    assert!(groups(&["--filter", "sort/21-bits"])[2] > 0);
}

#[test]
fn a_closed_pipe_is_no_panic() {
    let folder = TempDir::new().unwrap();
    let mut child = Command::new(env!("CARGO_BIN_EXE_olbvh"));
    child.args(["info", "kuhn:9,9,9", "--device", "cpu"]).current_dir(folder.path());
    let mut child = child.stdout(std::process::Stdio::piped()).stderr(std::process::Stdio::piped()).spawn().unwrap();
    drop(child.stdout.take());
    let out = child.wait_with_output().unwrap();
    assert_eq!((out.status.code(), text(&out.stderr)), (Some(0), String::new()));
}

/// Unless a level is given, trees are as fine as suits the query.
#[test]
fn leaves_suit_what_is_asked() {
    let folder = TempDir::new().unwrap();
    std::fs::write(folder.path().join("p.csv"), "x,y,z\n5.3,6.1,0.5\n").unwrap();
    let told = |arguments: &[&str]| {
        let out = olbvh(folder.path(), &[arguments, &["--device", "cpu", "-v"]].concat());
        let message = text(&out.stderr);
        assert_eq!(out.status.code(), Some(0), "{arguments:?}: {message}");
        assert!(!message.contains("INFO") && !message.contains("olbvh::"), "messages are plain sentences: {message}");
        ["points", "pictures"].map(|what| message.contains(&format!("suits {what} better")))
    };
    let (locate, slice) = (["locate", "kuhn:30,30,1", "p.csv", "-o", "o.csv"], ["slice", "kuhn:30,30,1", "-o", "s.npy", "--size", "8"]);
    let render = ["render", "kuhn:30,30,1", "-o", "a.png", "--size", "60x60"];
    let overlap = ["overlap", "kuhn:30,30,1", "kuhn:9,9,1", "-o", "c.json"];
    for asked in [&locate[..], &slice, &overlap] {
        assert_eq!(told(asked), [true, false], "{asked:?}");
        assert_eq!(told(&[asked, &["--level", "1"]].concat()), [false; 2], "{asked:?}");
    }
    assert_eq!(told(&render), [false, true]);
    // With few pixels for this many cells, a second build pays only for very long lists.
    assert_eq!(told(&[&render[..5], &["20x20"]].concat()), [true, false]);
    assert_eq!(told(&["info", "kuhn:30,30,1"]), [false; 2]);
}
