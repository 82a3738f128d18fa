//! The subcommand `olbvh devices`.

use crate::common::{Common, Failure, Outcome};
use crate::engine::{Origin, Shapes};
use crate::{output, text};
use olbvh::error::Error;
use olbvh::gpu::{DeviceReport, Gpu, GpuOptions, RayTracing, list_devices};
use serde_json::{Value, json};
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
    Shapes::check(common)?;
    let devices = match list_devices() {
        Ok(devices) => devices,
        // A missing Vulkan loader is not a failure here: the list is empty, and the reason is printed.
        Err(error @ Error::NoVulkan(_)) => {
            common.remark(&error);
            Vec::new()
        }
        Err(error) => return Err(Failure::from(error)),
    };
    let listed: Vec<Listed> = devices.iter().enumerate().map(|(i, device)| Listed::new(common, i, device)).collect();
    let mut lines: String = listed.iter().map(|one| one.text(common.verbose)).collect();
    lines.push_str("cpu  the reference implementation on the processor, always available\n");
    let json = json!({ "devices": listed.iter().map(Listed::json).collect::<Vec<_>>() });
    output::result(common, &json, &lines)
}

/// A device of the list.
struct Listed<'a> {
    index: usize,
    device: &'a DeviceReport,
    /// Why it cannot be used.
    fault: Option<String>,
    /// The target that kernels would have, or why the one that was asked for does not suit this device.
    target: Outcome<Shapes>,
}

impl<'a> Listed<'a> {
    fn new(common: &Common, index: usize, device: &'a DeviceReport) -> Self {
        Self { index, device, fault: fault_of(index, device), target: Shapes::of(common, device) }
    }

    fn text(&self, verbose: bool) -> String {
        let d = self.device;
        let rays = match d.requirements.ray_tracing {
            RayTracing { queries: true, .. } => "; ray queries",
            RayTracing { pipelines: true, .. } => "; ray-tracing pipelines",
            RayTracing { .. } => "",
        };
        let [memory, at_once] = [d.memory, d.largest_allocation.min(d.largest_buffer).min(d.memory)].map(text::bytes);
        let narrow = if d.query_subgroup == d.subgroup { String::new() } else { format!(" ({} for queries)", d.query_subgroup) };
        let mut lines = format!("{:>3}  {}\n", self.index, d.name);
        let _ = writeln!(
            lines,
            "     {}; Vulkan {}; subgroups of {}{narrow}; {memory} of memory, {at_once} at once; {}{rays}",
            d.driver, d.api, d.subgroup, d.kind
        );
        let _ = match &self.fault {
            None => writeln!(lines, "     qualifies"),
            Some(fault) => writeln!(lines, "     cannot be used; {fault}"),
        };
        let _ = match &self.target {
            Ok(shapes) if verbose => writeln!(lines, "     kernels {shapes}"),
            Ok(_) => Ok(()),
            Err(failure) => writeln!(lines, "     {failure}"),
        };
        lines
    }

    fn json(&self) -> Value {
        let d = self.device;
        let target = self.target.as_ref().ok().map(|shapes| {
            let profile =
                if let Origin::Profile(path) | Origin::File(path) = &shapes.origin { Some(path.display().to_string()) } else { None };
            json!({ "name": shapes.target.name, "profile": profile })
        });
        json!({
            "index": self.index, "name": d.name, "driver": d.driver, "api": d.api, "subgroup": d.subgroup,
            "query_subgroup": d.query_subgroup, "kind": d.kind.name(),
            "memory_bytes": d.memory, "largest_buffer_bytes": d.largest_buffer, "largest_allocation_bytes": d.largest_allocation,
            "qualifies": self.fault.is_none(), "missing": d.requirements.missing, "fault": self.fault,
            "ray_query": d.requirements.ray_tracing.queries, "ray_pipeline": d.requirements.ray_tracing.pipelines, "target": target,
            "target_fault": self.target.as_ref().err().map(Failure::to_string),
        })
    }
}

/// Why device number `index` cannot be used: what it lacks, or how it fails to open or to pass the self-test.
fn fault_of(index: usize, device: &DeviceReport) -> Option<String> {
    let missing = &device.requirements.missing;
    if !missing.is_empty() {
        return Some(format!("it lacks {}", missing.join(", ")));
    }
    Gpu::new(&GpuOptions { device: Some(index.to_string()), ..GpuOptions::default() }).err().map(|error| error.to_string())
}
