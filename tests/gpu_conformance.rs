//! The conformance suite as tests, with both ways of binding buffers. A test is one or several families of cases (for
//! example `address sort/21-bits`), so that runners that start a process per test do not open the device a thousand
//! times. Its message names every case that failed.
//!
//! The reference driver (lavapipe 25, 256 bits), and a run that names no driver, run all cases that are not `large` by
//! address, a large mesh or a dozen small ones per test: making all pipelines takes longer than the cases of a small
//! mesh, even where the driver has kept what it compiled. Descriptors, other drivers, other subgroup sizes of lavapipe
//! and validation layers run the quick cases, over a few meshes that together record every kernel. There, compiling
//! kernels takes longer than all cases, so cases over meshes are divided by what they compute, descriptors leave out
//! variants that have the same buffers as others; and on SwiftShader, which compiles every kernel anew on every device
//! that is opened, they are one family, with one mesh tested by descriptors. `OLBVH_TEST_GROUP` = `quick`, `full` or
//! `large` overrides this.

mod not_run;

use libtest_mimic::{Arguments, Failed, Trial};
use not_run::not_run;
use olbvh::conformance::{Case, Lab, Outcome, cases, cases_of};
use olbvh::gpu::{Binding, GpuOptions};
use olbvh::mesh::{Mesh, kuhn_jittered};
use std::env;

/// Meshes whose cases take longest; each is a test of its own.
const LONG: [&str; 5] = ["axle-40", "huge-among-small", "identical-1000", "jitter-12x13x11", "jitter-24x24x24"];
/// Other meshes per test.
const AT_ONCE: usize = 12;
/// Meshes that together record every kernel, and also empty dispatches.
const BRIEF: [&str; 6] = ["no-cells", "one-tet", "bad-cells", "jitter-12x13x11", "one-place", "cloud"];

fn families(binding: Binding) -> Vec<(String, Vec<Case>)> {
    let validation = env::var("OLBVH_TEST_VALIDATION").is_ok_and(|v| v == "1");
    let driver = env::var("OLBVH_TEST_DRIVER").unwrap_or_default();
    let reference = binding == Binding::Address && !validation && (driver.is_empty() || driver == "lavapipe25-256");
    if let Ok(group) = env::var("OLBVH_TEST_GROUP") {
        return grouped(&group, |_| true);
    }
    let group = if reference { "full" } else { "quick" };
    // Every row of the table of targets compiles all kernels anew. tests/gpu/targets.rs has them too, but not for every
    // subgroup size of lavapipe.
    let in_shape = |case: &Case| (binding == Binding::Address && driver.starts_with("lavapipe25-")) || !case.name.contains("/row-");
    // Surfaces are drawn from the same buffers as volumes.
    let same = |case: &Case| binding == Binding::Descriptors && case.name.contains("/surfaces");
    let in_brief = |case: &Case| BRIEF.contains(&case.family()) && in_shape(case) && !same(case);
    let mut families = grouped(group, |case| reference || !case.is_over_a_mesh() || in_brief(case));
    if reference {
        let short = |(name, cases): &mut (String, Vec<Case>)| cases.iter().any(Case::is_over_a_mesh) && !LONG.contains(&name.as_str());
        let short: Vec<_> = families.extract_if(.., short).collect();
        for some in short.chunks(AT_ONCE) {
            let name = format!("{} and {} more", some[0].0, some.len() - 1);
            families.push((name, some.iter().flat_map(|family| family.1.clone()).collect()));
        }
        return families;
    }
    let over_meshes: Vec<Case> = families.extract_if(.., |(_, cases)| cases.iter().any(Case::is_over_a_mesh)).flat_map(|f| f.1).collect();
    let part = |case: &Case| match case.name.split('/').next() {
        _ if driver == "swiftshader" => "meshes",
        Some("locate" | "overlap") => "points",
        Some("render") => "pictures",
        Some("slice") => "slices",
        _ => "trees",
    };
    for name in ["trees", "points", "slices", "pictures", "meshes"] {
        let cases: Vec<Case> = over_meshes.iter().filter(|case| part(case) == name).cloned().collect();
        if !cases.is_empty() {
            families.insert(0, (name.to_string(), cases));
        }
    }
    families
}

fn run(binding: Binding, cases: &[Case]) -> Result<(), Failed> {
    let mut lab = Lab::new(&GpuOptions { binding: Some(binding), ..Default::default() }).map_err(|e| e.to_string())?;
    let mut failures = Vec::new();
    for case in cases {
        let report = lab.run(case);
        match report.outcome {
            // Tetrahedra of some built-in meshes overlap, but so little that only owners show it.
            Outcome::Passed => match report.accepted {
                Some(accepted) if !report.name.ends_with("/same-owners") => failures.push(format!("{}: {accepted}", report.name)),
                _ => {}
            },
            Outcome::Failed(failure) => failures.push(format!("{}: {failure}", report.name)),
            Outcome::Skipped(why) => not_run(&format!("{}: {why}", report.name)),
        }
    }
    let text = format!("{} of {} cases failed\n{}", failures.len(), cases.len(), failures.join("\n"));
    if failures.is_empty() { Ok(()) } else { Err(text.into()) }
}

/// Two grids that overlap: a picture of a tree without full lists may differ from that of another tree, and the report
/// says so.
fn overlapping() -> Result<(), Failed> {
    let mut mesh = kuhn_jittered([4; 3], 0.2, 1)?;
    let n = mesh.points.len() as u32;
    mesh.points.extend(mesh.points.clone().into_iter().map(|p| p.map(|x| x + 1.3)));
    mesh.tets.extend(mesh.tets.clone().into_iter().map(|tet| tet.map(|v| v + n)));
    let mut lab = Lab::new(&GpuOptions::default())?;
    let (mut accepted, cases) = (0, cases_of("overlapping", Mesh::new(mesh.points, mesh.tets)));
    for case in cases.iter().filter(|case| case.name.starts_with("render/") || case.name.starts_with("locate/")) {
        let report = lab.run(case);
        if report.outcome != Outcome::Passed {
            return Err(format!("{}: {:?}", report.name, report.outcome).into());
        }
        accepted += usize::from(report.accepted.is_some_and(|why| why.contains("both contain")));
    }
    if accepted > 0 { Ok(()) } else { Err("no difference was accepted".into()) }
}

fn grouped(group: &str, chosen: impl Fn(&Case) -> bool) -> Vec<(String, Vec<Case>)> {
    let mut families: Vec<(String, Vec<Case>)> = Vec::new();
    for case in cases().into_iter().filter(|c| c.matches(Some(group)) && chosen(c)) {
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
        for (family, cases) in families(binding) {
            trials.push(Trial::test(format!("{name} {family}"), move || run(binding, &cases)));
        }
    }
    // SwiftShader is the one driver whose descriptors start at multiples of 256 bytes.
    if env::var("OLBVH_TEST_DRIVER").is_ok_and(|driver| driver == "swiftshader") {
        let cases: Vec<Case> = cases().into_iter().filter(|case| case.matches(Some("quick")) && case.family() == "one-tet").collect();
        trials.push(Trial::test("bindings one-tet", move || run(Binding::Descriptors, &cases)));
    } else {
        trials.push(Trial::test("overlapping parts", overlapping));
    }
    libtest_mimic::run(&Arguments::from_args(), trials).exit();
}
