//! The subcommand `olbvh conformance`.

use crate::common::{Common, Failure, Outcome};
use crate::output::{self, Progress};
use crate::{engine, input};
use olbvh::conformance::{Case, Lab, Outcome as Ending, Report, cases, cases_of};
use olbvh::formats::xml_attribute;
use olbvh::gpu::{Binding, GpuOptions};
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Compare the results of a device, kernel by kernel, with the reference implementation.
///
/// Every primitive, every stage of the construction and every query runs on inputs that the program generates, and its
/// results are compared word by word with those of the same computation on the CPU. For a case that fails, the report
/// names the kernel or stage, the array, the first index that differs, the expected value and the value found.
#[derive(clap::Args)]
#[command(after_help = "Examples:
  olbvh conformance --filter quick                  less than two minutes on a software device
  olbvh conformance --filter locate/one-tet         the cases whose name contains this text
  olbvh conformance bracket.vtu                     trees and queries of this mesh
  olbvh conformance --filter large                  the cases with buffers of more than 2^26 words
  olbvh conformance --device 1 --junit report.xml   all but the large ones, with a report for CI

Exit codes: 0 all passed, 1 a case failed, 2 wrong usage, 3 bad mesh file, 4 no suitable device, 130 interrupted.")]
pub struct Args {
    /// Mesh files or procedural meshes (kuhn:NX,NY,NZ) to use instead of the built-in ones. The reference
    /// implementation is slow on large meshes.
    #[arg(value_name = "MESH")]
    meshes: Vec<PathBuf>,
    /// List the cases, without --filter all of them, and run none.
    #[arg(long)]
    list: bool,
    /// Run only the cases of a group: quick, full (all but large) or large; any other S selects the cases of all groups
    /// whose name contains it. Default: full.
    #[arg(long, value_name = "S")]
    filter: Option<String>,
    /// How kernels receive their buffers. Default: both ways, if the device supports them.
    #[arg(long, value_enum, default_value_t = Bindings::Both)]
    binding: Bindings,
    /// Also write a `JUnit` report to this .xml file.
    #[arg(long, value_name = "FILE.xml")]
    junit: Option<PathBuf>,
    #[command(flatten)]
    read: input::ReadArgs,
}

/// Ways of binding buffers to test.
#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Bindings {
    /// Every case by address and by descriptors.
    Both,
    /// By device address only.
    Address,
    /// By descriptors only.
    Descriptors,
}

fn name(binding: Binding) -> &'static str {
    match binding {
        Binding::Address => "address",
        Binding::Descriptors => "descriptors",
    }
}

/// Runs the subcommand.
pub fn run(args: &Args, common: &Common) -> Outcome {
    if let Some(file) = &args.junit {
        let inputs: Vec<&Path> = args.meshes.iter().map(PathBuf::as_path).collect();
        output::announce_file(file, &inputs)?;
        if !file.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("xml")) {
            return Err(Failure::Usage(format!("{}: a JUnit report is an .xml file; name it so", file.display())));
        }
    }
    let all = if args.meshes.is_empty() { cases() } else { cases_of_meshes(args, common)? };
    // A list without filter names all cases, so that one sees what can be run.
    let filter = args.filter.as_deref().or(args.list.then_some(""));
    let chosen: Vec<Case> = all.into_iter().filter(|c| c.matches(filter)).collect();
    if chosen.is_empty() {
        let filter = filter.unwrap_or_default();
        return Err(Failure::Usage(format!("no name of a case contains `{filter}`; `olbvh conformance --list` lists all cases")));
    }
    if args.list {
        let list: Vec<_> = chosen.iter().map(|c| json!({ "name": c.name, "group": c.group.name() })).collect();
        let lines = chosen.iter().fold(String::new(), |lines, c| format!("{lines}{:<6} {}\n", c.group.name(), c.name));
        return output::result(common, &json!({ "cases": list }), &lines);
    }
    if common.means_cpu() {
        return Err(Failure::Usage("--device cpu: the cases compare a Vulkan device with the CPU; name a Vulkan device".into()));
    }
    let (device, runs) = run_cases(args, common, &chosen)?;
    finish(args, common, &device, &runs)
}

/// The cases of mesh files; each is named after its file.
fn cases_of_meshes(args: &Args, common: &Common) -> Outcome<Vec<Case>> {
    let mut all = Vec::new();
    for file in &args.meshes {
        let stem = file.file_stem().unwrap_or(file.as_os_str()).to_string_lossy();
        all.extend(cases_of(&stem, args.read.mesh(file, common)?.mesh));
    }
    Ok(all)
}

/// Runs the cases with each binding.
fn run_cases(args: &Args, common: &Common, chosen: &[Case]) -> Outcome<(Value, Vec<(Binding, Report)>)> {
    let mut bindings = match args.binding {
        Bindings::Both => vec![Binding::Address, Binding::Descriptors],
        Bindings::Address => vec![Binding::Address],
        Bindings::Descriptors => vec![Binding::Descriptors],
    };
    // The target that other subcommands would use; cases that name a row use that row.
    let target = engine::shapes(common)?.target;
    let options = GpuOptions { device: common.device.clone(), target: Some(target), ..GpuOptions::default() };
    let lab = |binding| Lab::new(&GpuOptions { binding: Some(binding), ..options.clone() });
    let mut runs = Vec::new();
    let mut device = Value::Null;
    let progress = Progress::new(common, "cases");
    if args.binding == Bindings::Both {
        // The binding that the device chooses by itself shows whether it has addresses.
        let any = Lab::new(&options)?;
        if any.device().binding() == Binding::Descriptors {
            common.remark("The device has no buffer addresses: cases run by descriptors only.");
            bindings.remove(0);
        }
    }
    let total = (bindings.len() * chosen.len()) as u64;
    for binding in bindings {
        let mut lab = lab(binding)?;
        let report = lab.device().report().clone();
        device = json!({
            "name": report.name, "driver": report.driver, "api": report.api, "subgroup": report.subgroup, "kind": report.kind.name(),
        });
        for case in chosen {
            if common.verbose {
                // Printed before the case runs, because a driver that crashes takes the program with it.
                common.remark(format!("running {} ({})", case.name, name(binding)));
            }
            let report = lab.run(case);
            if !common.json {
                // Printed now, so that a run that is stopped has told what it found.
                progress.pause(|| output::print(&lines(binding, &report, common.verbose)))?;
            }
            runs.push((binding, report));
            progress.set(runs.len() as u64, total);
        }
    }
    Ok((device, runs))
}

/// What is printed about a case; empty if it passed and there is nothing more to say.
fn lines(binding: Binding, report: &Report, verbose: bool) -> String {
    let case = format!("{} ({})", report.name, name(binding));
    match (&report.outcome, &report.accepted) {
        (Ending::Failed(failure), _) => format!("FAILED  {case}\n        {failure}\n"),
        (Ending::Skipped(why), _) => format!("skipped {case}: {why}\n"),
        (Ending::Passed, Some(accepted)) => format!("passed  {case}\n        accepted: {accepted}\n"),
        (Ending::Passed, None) if verbose => format!("passed  {case}, {} ms\n", report.time.as_millis()),
        (Ending::Passed, None) => String::new(),
    }
}

/// Prints the totals, writes the reports, and returns a failure if a case has failed.
fn finish(args: &Args, common: &Common, device: &Value, runs: &[(Binding, Report)]) -> Outcome {
    let count = |wanted: fn(&Ending) -> bool| runs.iter().filter(|r| wanted(&r.1.outcome)).count();
    let passed = count(|o| matches!(o, Ending::Passed));
    let failed = count(|o| matches!(o, Ending::Failed(_)));
    let skipped = runs.len() - passed - failed;
    let time: Duration = runs.iter().map(|r| r.1.time).sum();
    if let Some(file) = &args.junit {
        write_junit(file, runs)?;
    }
    let name = device["name"].as_str().unwrap_or_default();
    let text = format!("{name}\n{passed} passed, {failed} failed, {skipped} skipped in {:.1} s\n", time.as_secs_f64());
    let json = json!({
        "device": device, "passed": passed, "failed": failed, "skipped": skipped, "seconds": time.as_secs_f64(),
        "cases": runs.iter().map(entry).collect::<Vec<_>>(),
    });
    output::result(common, &json, &text)?;
    if failed > 0 { Err(Failure::Failed(format!("{failed} of {} cases failed", runs.len()))) } else { Ok(()) }
}

fn entry((binding, report): &(Binding, Report)) -> Value {
    let mut entry = json!({ "name": report.name, "binding": name(*binding), "seconds": report.time.as_secs_f64() });
    match &report.outcome {
        Ending::Passed => {
            entry["outcome"] = "passed".into();
            if let Some(accepted) = &report.accepted {
                entry["accepted"] = accepted.as_str().into();
            }
        }
        Ending::Skipped(why) => {
            entry["outcome"] = "skipped".into();
            entry["reason"] = why.as_str().into();
        }
        Ending::Failed(f) => {
            entry["outcome"] = "failed".into();
            entry["stage"] = f.stage.as_str().into();
            entry["array"] = f.array.as_str().into();
            entry["index"] = f.index.into();
            entry["expected"] = f.expected.as_str().into();
            entry["found"] = f.found.as_str().into();
        }
    }
    entry
}

/// Writes the `JUnit` report, which CI systems read.
fn write_junit(file: &Path, runs: &[(Binding, Report)]) -> Outcome {
    let failures = runs.iter().filter(|r| matches!(r.1.outcome, Ending::Failed(_))).count();
    let skipped = runs.iter().filter(|r| matches!(r.1.outcome, Ending::Skipped(_))).count();
    let mut text = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
    let _ = writeln!(text, "<testsuite name=\"olbvh conformance\" tests=\"{}\" failures=\"{failures}\" skipped=\"{skipped}\">", runs.len());
    for (binding, report) in runs {
        let (case, seconds) = (xml_attribute(&report.name), report.time.as_secs_f64());
        let _ = write!(text, "  <testcase classname=\"{}\" name=\"{case}\" time=\"{seconds:.3}\"", name(*binding));
        let _ = match &report.outcome {
            Ending::Passed => writeln!(text, "/>"),
            Ending::Failed(f) => writeln!(text, "><failure message=\"{}\"/></testcase>", xml_attribute(&f.to_string())),
            Ending::Skipped(why) => writeln!(text, "><skipped message=\"{}\"/></testcase>", xml_attribute(why)),
        };
    }
    text.push_str("</testsuite>\n");
    output::write_text(file, &text)
}
