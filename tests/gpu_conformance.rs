//! The conformance suite as tests, on both ways of binding buffers. A test is a family of cases (`address sort/21-bits`), so that runners which
//! start a process per test do not open the device a thousand times; its message names every case that failed.
//!
//! The reference driver (lavapipe 25, 256 bits), and a run that names no driver, runs all cases that are not `large` by address; other drivers, runs
//! under a validation layer, and the descriptors run the quick ones. `OLBVH_TEST_GROUP` = `quick`, `full` or `large` says otherwise.

use libtest_mimic::{Arguments, Failed, Trial};
use olbvh::conformance::{Case, Lab, Outcome, cases};
use olbvh::gpu::{Binding, GpuOptions};
use std::env;

fn group(binding: Binding) -> String {
    let validation = env::var("OLBVH_TEST_VALIDATION").is_ok_and(|v| v == "1");
    let driver = env::var("OLBVH_TEST_DRIVER").unwrap_or_default();
    let full = binding == Binding::Address && !validation && (driver.is_empty() || driver == "lavapipe25-256");
    env::var("OLBVH_TEST_GROUP").unwrap_or_else(|_| if full { "full" } else { "quick" }.into())
}

fn run(binding: Binding, cases: &[Case]) -> Result<(), Failed> {
    let mut lab = Lab::new(&GpuOptions { binding: Some(binding), ..Default::default() }).map_err(|e| e.to_string())?;
    let mut failures = Vec::new();
    for case in cases {
        let report = lab.run(case);
        match report.outcome {
            Outcome::Passed => {}
            Outcome::Failed(failure) => failures.push(format!("{}: {failure}", report.name)),
            Outcome::Skipped(why) => println!("SKIPPED {}: {why}", report.name),
        }
    }
    let text = format!("{} of {} cases failed\n{}", failures.len(), cases.len(), failures.join("\n"));
    if failures.is_empty() { Ok(()) } else { Err(text.into()) }
}

fn families(group: &str) -> Vec<(String, Vec<Case>)> {
    let mut families: Vec<(String, Vec<Case>)> = Vec::new();
    for case in cases().into_iter().filter(|c| c.matches(Some(group))) {
        let family = case.family().to_string();
        match families.iter_mut().find(|f| f.0 == family) {
            Some((_, cases)) => cases.push(case),
            None => families.push((family, vec![case])),
        }
    }
    families
}

fn main() {
    let mut trials = Vec::new();
    for (name, binding) in [("address", Binding::Address), ("descriptors", Binding::Descriptors)] {
        for (family, cases) in families(&group(binding)) {
            trials.push(Trial::test(format!("{name} {family}"), move || run(binding, &cases)));
        }
    }
    libtest_mimic::run(&Arguments::from_args(), trials).exit();
}
