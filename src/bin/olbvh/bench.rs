//! The subcommand `olbvh bench`.

use crate::common::{Common, Failure, Outcome};
use crate::{engine, input, output};
use olbvh::bench::{Report, Settings, Suite, compare, markdown, plots, run as measure, text};
use olbvh::error::Error;
use olbvh::formats::OutputFormat;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Measure the octree on one device and compare it with an LBVH and with the device's hardware ray tracing, as the
/// paper does.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  olbvh bench                               two small meshes, within a minute on two cores
  olbvh bench --suite paper -o results      the paper's sizes; a folder for tables and plots
  olbvh bench --suite scaling -o scaling    construction and location from 1k to 12.3M tetrahedra
  olbvh bench bracket.vtu -o bracket.md     this mesh, with the sizes of the quick suite
  olbvh bench graded:40 shell:200 --suite paper --repeat 9 --seconds 1 --json
  olbvh bench --compare a.json b.json       which times differ by more than their spread

Procedural meshes: kuhn:NX,NY,NZ[,jitter=J], graded:N (cells of very different sizes), far-field:N (a box 1,000 times as large as the hole in its middle), shell:N (thin walls), slivers:N (flat cells). The suite \
determines the numbers of points, pixels and voxels, and the meshes unless MESH is given. Answers are verified before anything is timed. A mesh for which \
one is wrong is not measured, nor is one that cannot be read or held; the others are, and the run ends with code 1. Times are medians on the device (on the host if its queue has no timestamps); the JSON result has all of them, with bytes \
and ratios. Each stage of the construction is compared with the rate at which the device copies memory: the bytes that the stage has to read and \
write, at the minimum, divided by its time.

--compare measures nothing. For every measurement that both files have, it shows the ratio of the times and the range of ratios that the repetitions \
allow. It also lists what only one of the files has, and every difference in device, driver, target, program and settings.")]
pub struct Args {
    /// Mesh files or procedural meshes to measure instead of those of the suite.
    #[arg(value_name = "MESH")]
    meshes: Vec<PathBuf>,
    /// Selection of meshes and query sizes.
    #[arg(long, default_value = "quick", value_name = "quick|paper|full|scaling")]
    suite: Suite,
    /// Output: a .json or .md file, or a folder for both and the plots. Default: only the text on standard output.
    #[arg(short, long, value_name = "OUT")]
    output: Option<PathBuf>,
    /// Number of points to locate, up to 67,108,864 (2^26). Default: set by the suite (quick 16,384, paper and full
    /// 1,048,576, scaling 262,144).
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1 << 26), allow_negative_numbers = true)]
    points: Option<u32>,
    /// Width and height of the picture in pixels, and voxels per row of the slice, up to 8,192. Default: set by the
    /// suite (quick 96 and 256, paper and full 1,024 and 999, scaling none).
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=8192), allow_negative_numbers = true)]
    pixels: Option<u32>,
    /// Maximum number of repetitions of a measurement. Default: set by the suite (quick, paper and full 50, scaling
    /// 15).
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..), allow_negative_numbers = true)]
    repeat: Option<u32>,
    /// Time in seconds after which a measurement is not repeated again. Default: set by the suite (quick 0.05, others
    /// 5).
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    seconds: Option<f64>,
    /// Compare two .json result files instead of measuring.
    #[arg(long, num_args = 2, value_names = ["A", "B"], conflicts_with_all = ["meshes", "suite", "points", "pixels", "repeat", "seconds", "merge"])]
    compare: Option<Vec<PathBuf>>,
    #[command(flatten)]
    read: input::ReadArgs,
}

/// Kind of output that OUT names.
enum Target {
    Folder,
    File(OutputFormat),
}

/// Runs the subcommand.
pub fn run(args: &Args, common: &Common) -> Outcome {
    if let Some([a, b]) = args.compare.as_deref() {
        return run_compare([a, b], args.output.as_deref(), common);
    }
    let target = args.output.as_deref().map(|path| target(path, &args.meshes)).transpose()?;
    let mut settings = Settings::of(args.suite);
    settings.points = args.points.unwrap_or(settings.points);
    if let Some(pixels) = args.pixels {
        (settings.picture, settings.slice) = (pixels, pixels);
    }
    settings.budget.repetitions = args.repeat.unwrap_or(settings.budget.repetitions);
    if let Some(seconds) = args.seconds {
        if !(seconds.is_finite() && seconds >= 0.0) {
            return Err(Failure::Usage(format!("--seconds {seconds}: a time of 0 or more is needed")));
        }
        settings.budget.seconds = seconds;
    }
    let (gpu, _) = engine::device(common)?;
    let mut report = Report::new(&gpu, args.suite, settings, commit())?;
    let named =
        |(role, mesh): (&str, &str)| (if role.is_empty() { mesh.to_owned() } else { format!("{role} {mesh}") }, PathBuf::from(mesh));
    let meshes: Vec<(String, PathBuf)> = if args.meshes.is_empty() {
        args.suite.meshes().into_iter().map(named).collect()
    } else {
        args.meshes.iter().map(|path| (path.display().to_string(), path.clone())).collect()
    };
    let (total, mut failures) = (meshes.len(), Vec::new());
    for (name, path) in meshes {
        let measured = args.read.mesh(&path, common).and_then(|read| {
            let measured = measure(&gpu, &name, &read.mesh, &report, &|line| common.remark(line));
            measured.map_err(|e| Failure::from(e).about(&name))
        });
        match measured {
            Ok(measured) => report.push(measured),
            Err(failure) => {
                if total > 1 {
                    common.remark(format!("not measured: {failure}"));
                }
                report.failed.push(failure.to_string());
                failures.push(failure);
            }
        }
        // Results are written after every mesh, so that a long run that is stopped leaves those it has.
        if let (Some(path), Some(target), false) = (&args.output, &target, report.meshes.is_empty()) {
            write(path, target, &report)?;
        }
    }
    if report.meshes.is_empty()
        && let Some(failure) = failures.pop()
    {
        return Err(failure);
    }
    let json = serde_json::to_value(&report).map_err(|e| Failure::Failed(e.to_string()))?;
    output::summary(common, &json, &text(&report))?;
    if failures.is_empty() { Ok(()) } else { Err(Failure::Failed(format!("{} of {total} meshes could not be measured", failures.len()))) }
}

/// Compares two result files; the comparison is also written to a file, if one is named.
fn run_compare([a, b]: [&Path; 2], out: Option<&Path>, common: &Common) -> Outcome {
    let format = out.map(|path| output::announce(path, &[OutputFormat::Json, OutputFormat::Md], &[a, b])).transpose()?;
    let comparison = compare([a, b]).map_err(Failure::input)?;
    let json = serde_json::to_value(&comparison).map_err(|e| Failure::Failed(e.to_string()))?;
    if let (Some(path), Some(format)) = (out, format) {
        let content = if format == OutputFormat::Md { comparison.markdown() } else { format!("{json:#}\n") };
        output::write_text(path, &content)?;
    }
    output::summary(common, &json, &comparison.text())
}

/// Determines the kind of output. A file is announced; a folder that exists may have any name.
fn target(path: &Path, meshes: &[PathBuf]) -> Outcome<Target> {
    if path.is_dir() || path.extension().is_none() && !path.exists() {
        return Ok(Target::Folder);
    }
    let inputs: Vec<&Path> = meshes.iter().map(PathBuf::as_path).collect();
    output::announce(path, &[OutputFormat::Json, OutputFormat::Md], &inputs).map(Target::File)
}

fn write(path: &Path, target: &Target, report: &Report) -> Outcome {
    let json = serde_json::to_string(report).map_err(|e| Failure::Failed(e.to_string()))? + "\n";
    let files = match target {
        Target::File(OutputFormat::Md) => vec![(path.to_path_buf(), markdown(report))],
        Target::File(_) => vec![(path.to_path_buf(), json)],
        Target::Folder => {
            std::fs::create_dir_all(path).map_err(|source| Error::Io { path: path.into(), source })?;
            let plots = plots(report).into_iter();
            let tables = [("bench.json".to_owned(), json), ("bench.md".to_owned(), markdown(report))];
            plots.chain(tables).map(|(name, content)| (path.join(name), content)).collect()
        }
    };
    files.iter().for_each(|(path, _)| output::begin(path));
    files.iter().try_for_each(|(path, content)| output::write_text(path, content))
}

/// The commit of this program's sources as they are now, if they still exist and are under Git; ends with `-dirty` if
/// there are uncommitted changes.
fn commit() -> Option<String> {
    let told = Command::new("git").args(["-C", env!("CARGO_MANIFEST_DIR"), "describe", "--always", "--dirty"]).output().ok()?;
    let name = String::from_utf8(told.stdout).ok()?.trim().to_owned();
    (told.status.success() && !name.is_empty()).then_some(name)
}
