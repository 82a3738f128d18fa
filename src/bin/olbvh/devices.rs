//! The subcommand `olbvh devices`.

use crate::common::{Common, Failure, Outcome};
use crate::engine::{Origin, Shapes};
use crate::{output, text};
use olbvh::error::Error;
use olbvh::gpu::{DeviceReport, Gpu, GpuOptions, RayTracing, list_devices};
use serde_json::json;
use std::fmt::Write as _;

/// List all Vulkan devices: whether each can be used and, if not, what it lacks. Each that lacks nothing is opened and
/// computes a self-test.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  olbvh devices            then choose one by number or part of its name:\n  olbvh render m.vtu -o m.png --device 1\n  olbvh devices -v         also the tuning parameters of each, and where they come from"
)]
pub struct Args {}

/// Runs the subcommand.
pub fn run(_: &Args, common: &Common) -> Outcome {
    if common.device.is_some() {
        common.remark("--device has no effect here; these are all devices");
    }
    let devices = match list_devices() {
        Ok(devices) => devices,
        // A missing Vulkan loader is not a failure here: the list is empty, and the reason is printed.
        Err(error @ Error::NoVulkan(_)) => {
            common.remark(&error);
            Vec::new()
        }
        Err(error) => return Err(Failure::from(error)),
    };
    let mut lines = String::new();
    // Once per device, because a profile that is ignored causes a remark.
    let targets: Vec<Option<Shapes>> = devices.iter().map(|d| Shapes::of(common, d).ok()).collect();
    let faults: Vec<Option<String>> = devices.iter().enumerate().map(|(i, d)| fault_of(i, d)).collect();
    for (i, ((d, target), fault)) in devices.iter().zip(&targets).zip(&faults).enumerate() {
        let verdict = fault.as_ref().map_or("qualifies".to_owned(), |fault| format!("cannot be used; {fault}"));
        let rays = match d.requirements.ray_tracing {
            RayTracing { queries: true, .. } => "; ray queries",
            RayTracing { pipelines: true, .. } => "; ray-tracing pipelines",
            RayTracing { .. } => "",
        };
        let _ = writeln!(
            lines,
            "{i:>3}  {}\n     {}; Vulkan {}; subgroups of {}; {} of memory; {}{rays}\n     {verdict}",
            d.name,
            d.driver,
            d.api,
            d.subgroup,
            text::bytes(d.memory),
            d.kind
        );
        if let Some(shapes) = target.as_ref().filter(|_| common.verbose) {
            let _ = writeln!(lines, "     kernels {shapes}");
        }
    }
    lines.push_str("cpu  the reference implementation on the processor, always available\n");
    let entry = |(i, ((d, target), fault)): (usize, ((&DeviceReport, &Option<Shapes>), &Option<String>))| {
        json!({
            "index": i, "name": d.name, "driver": d.driver, "api": d.api, "subgroup": d.subgroup, "kind": d.kind, "memory_bytes": d.memory,
            "qualifies": fault.is_none(), "missing": d.requirements.missing, "fault": fault,
            "ray_query": d.requirements.ray_tracing.queries, "ray_pipeline": d.requirements.ray_tracing.pipelines,
            "target": target.as_ref().map(|shapes| json!({
                "name": shapes.target.name,
                "profile": if let Origin::Profile(path) | Origin::File(path) = &shapes.origin { Some(path.display().to_string()) } else { None },
            })),
        })
    };
    let json = json!({ "devices": devices.iter().zip(&targets).zip(&faults).enumerate().map(entry).collect::<Vec<_>>() });
    output::result(common, &json, &lines)
}

/// Why device number `index` cannot be used: what it lacks, or how it fails to open or to pass the self-test.
fn fault_of(index: usize, device: &DeviceReport) -> Option<String> {
    let missing = &device.requirements.missing;
    if !missing.is_empty() {
        return Some(format!("it lacks {}", missing.join(", ")));
    }
    Gpu::new(&GpuOptions { device: Some(index.to_string()), ..GpuOptions::default() }).err().map(|error| error.to_string())
}
