//! The subcommand `olbvh tune`.

use crate::common::{Common, Failure, Outcome};
use crate::engine::{self, Origin};
use crate::input;
use crate::output::{self, Progress};
use crate::text::{Page, milliseconds};
use olbvh::formats::OutputFormat;
use olbvh::gpu::Gpu;
use olbvh::tune::{Event, Gain, Profile, TUNABLES, Tuned, Workload, folder, tune};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Find the tuning parameters of the kernels (workgroup sizes, items per invocation, kind of sort) that are fastest on
/// this device, and save them as its profile.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  olbvh tune                             takes a minute; later runs use the saved profile
  olbvh tune --seconds 600 bracket.vtu   takes longer, and measures with this mesh
  olbvh tune --no-profile -o mine.json   starts from the built-in parameters; for --target:
  olbvh render m.vtu -o m.png --target mine.json

Every candidate must give the same trees, owners, pictures and voxels, byte for byte, before it is timed. It then runs alternately with the best one \
so far, and is kept only if it is faster by more than the times vary. At the end, the gains are measured again. The profile is a file in the user's \
configuration folder (olbvh/DEVICE.DRIVER.json in $XDG_CONFIG_HOME or ~/.config). `olbvh devices -v` shows its path, --no-profile (or \
OLBVH_NO_PROFILE=1) ignores it, and deleting the file restores the built-in parameters. A profile that is broken, or was made for another device or \
driver, is ignored with a remark.")]
pub struct Args {
    /// Mesh to tune with: a file or a procedural mesh.
    #[arg(default_value = "kuhn:32,32,32,jitter=0.3")]
    mesh: PathBuf,
    /// Time in seconds after which no further candidate is tried.
    #[arg(long, value_name = "S", default_value_t = 60.0, allow_negative_numbers = true)]
    seconds: f64,
    /// File for the profile (.json). Default: a file in the user's configuration folder, which later runs find.
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    #[command(flatten)]
    read: input::ReadArgs,
}

/// Runs the subcommand.
pub fn run(args: &Args, common: &Common) -> Outcome {
    if !(args.seconds.is_finite() && (0.0..=1e6).contains(&args.seconds)) {
        return Err(Failure::Usage(format!("--seconds {}: a time from 0 to 1,000,000 is needed", args.seconds)));
    }
    if let Some(path) = &args.output {
        output::announce(path, &[OutputFormat::Json], &[&args.mesh])?;
    }
    let (gpu, shapes) = engine::device(common)?;
    let file = args.output.clone().or_else(|| Some(folder()?.join(Profile::file_name(gpu.report()))));
    let Some(file) = file else {
        return Err(Failure::Usage(
            "there is no home folder, and so no configuration folder; name a file for the profile with -o FILE".into(),
        ));
    };
    let mesh = args.read.mesh(&args.mesh, common)?.mesh;
    if mesh.tets.is_empty() {
        return Err(Failure::Usage(format!("{}: no tetrahedra to tune with", args.mesh.display())));
    }
    common.remark(format_args!("{}: {} tetrahedra; starting from target {shapes}", args.mesh.display(), mesh.tets.len()));
    let work = Workload::new(&gpu, &mesh)?;
    let progress = Progress::new(common, "tuning");
    let report = |event: &Event, part: f64| {
        tell(event, common);
        progress.set((part.min(1.0) * 1000.0) as u64, 1000);
    };
    let tuned = tune(&work, &gpu.report().room, gpu.target(), Duration::from_secs_f64(args.seconds), &report)?;
    drop(progress);
    // Without a gain there is nothing to save, unless a file was requested.
    let saved = (tuned.kept > 0 || args.output.is_some()).then(|| save(&gpu, args, &tuned, &file)).transpose()?;
    let file = saved.map(|()| file.as_path());
    finish(common, &gpu, &tuned, file, matches!(shapes.origin, Origin::Profile(_)))
}

/// Reports candidates: all of them with `--verbose`, otherwise only those that are kept or refused.
fn tell(event: &Event, common: &Common) {
    match event {
        Event::Tried { change, ratio, kept: true } => common.remark(format_args!("{change}: {:.0} % of the time, kept", 100.0 * ratio)),
        Event::Tried { change, ratio, .. } => log::info!("{change}: {:.0} % of the time", 100.0 * ratio),
        Event::Refused { change, why } => common.remark(format_args!("{change}: refused: {why}")),
    }
}

fn save(gpu: &Gpu, args: &Args, tuned: &Tuned, file: &Path) -> Outcome {
    let device = gpu.report();
    let mut target = tuned.target.clone();
    if tuned.kept > 0 {
        target.name = "tuned".into();
    }
    let profile = Profile {
        device: device.name.clone(),
        driver: device.driver.clone(),
        subgroup: device.subgroup,
        version: env!("CARGO_PKG_VERSION").into(),
        mesh: args.mesh.display().to_string(),
        target,
        gains: tuned.gains.clone(),
    };
    Ok(profile.write(file)?)
}

/// Prints what was gained, stage by stage, and the file that the profile was saved to, if it was.
fn finish(common: &Common, gpu: &Gpu, tuned: &Tuned, saved: Option<&Path>, had_profile: bool) -> Outcome {
    let Tuned { target, kept, tried, refused, complete, gains } = tuned;
    let start = gpu.target();
    let mut page = Page::default();
    let end = if *complete { "nothing left to try" } else { "time is up" };
    page.section(&format!("{}: {tried} candidates timed, {refused} refused, {kept} kept; {end}", gpu.report().name));
    if start.sort.serial != target.sort.serial {
        page.row("sort.serial", format_args!("{} → {}", start.sort.serial, target.sort.serial));
    }
    for tunable in TUNABLES.iter().filter(|t| t.of(start) != t.of(target)) {
        page.row(tunable.name, format_args!("{} → {}  ({})", tunable.of(start), tunable.of(target), tunable.about));
    }
    if !gains.is_empty() {
        page.section("Median times before and after");
    }
    for Gain { stage, before_ms, after_ms } in gains {
        let shown = [milliseconds(*before_ms), milliseconds(*after_ms)];
        page.row(stage, format_args!("{} → {}  ({:.2}×)", shown[0], shown[1], before_ms / after_ms));
    }
    let verdict = match saved {
        Some(file) => format!("Saved: {}", file.display()),
        None if had_profile => "Nothing gained; the profile stays as it is".into(),
        None => format!("Nothing gained over the target `{}`; nothing saved", start.name),
    };
    page.section(&verdict);
    let file = saved.map(|file| file.display().to_string());
    let json = json!({
        "device": gpu.report().name, "driver": gpu.report().driver, "tried": tried, "refused": refused, "kept": kept, "complete": complete,
        "before": start, "after": target, "gains": gains, "file": file, "profile": file,
    });
    output::summary(common, &json, &page.to_string())
}
