//! A whole picture, drawn by the recorded form: memory of our own, a round per submission until every ray is done.

use super::{RenderInput, RenderMemory, Shown, cmd_render};
use crate::build::{DeviceMesh, cmd_ranges, range_bytes};
use crate::error::{Error, Result};
use crate::layout::RenderStatus;
use crate::mesh::On;
use crate::primitives::Arena;
use crate::query::{Rounds, Searched, Structure};
use crate::render::Plan;

/// What a drawn picture holds.
#[derive(Clone, Debug, Default)]
pub struct Drawn {
    /// Premultiplied colour and opacity, row 0 on top.
    pub colors: Vec<[f32; 4]>,
    /// Samples taken.
    pub samples: u64,
    /// Samples within the intervals that were not taken: their nodes have nothing to see.
    pub skipped_samples: u64,
    /// Samples taken that lie in the mesh.
    pub found_samples: u64,
    /// Device time of the field's ranges and of the marks of visible nodes, where values are transparent.
    pub ranges_ms: f64,
    /// Device time of the ray intervals.
    pub interval_ms: f64,
    /// Device time of the march.
    pub march_ms: f64,
    /// Submissions that the march took.
    pub submissions: u32,
}

/// Draws a plan of a field (values per point or per tetrahedron); `normals`: one per point, for shading. `report` is told how many rays
/// are done.
///
/// # Errors
/// [`Error::Memory`], [`Error::TooLarge`], a failed Vulkan call, or [`Error::Invalid`] if field or normals have the wrong length.
pub fn render(
    mesh: &DeviceMesh,
    structure: impl Into<Structure>,
    plan: &Plan,
    (values, on): (&[f32], On),
    normals: Option<&[[f32; 3]]>,
    report: &dyn Fn(u64, u64),
) -> Result<Drawn> {
    let gpu = mesh.gpu();
    let searched = Searched::new(mesh, structure);
    let expected = if on == On::Points { mesh.input().points } else { mesh.input().tets };
    if values.len() != expected as usize || normals.is_some_and(|n| n.len() != mesh.input().points as usize) {
        return Err(Error::Invalid(format!(
            "a field of {} values where the mesh has {expected}, or normals for another mesh",
            values.len()
        )));
    }
    let field = gpu.upload("olbvh.query.field", values)?;
    let normals = normals.map(|n| gpu.upload("olbvh.query.normals", n)).transpose()?;
    let [table, drawn] =
        [("olbvh.query.table", bytemuck::cast_slice(&plan.table)), ("olbvh.query.drawn", bytemuck::cast_slice(&plan.drawn))]
            .map(|(name, words): (&str, &[f32])| gpu.upload(name, words));
    let (table, drawn, view) = (table?, drawn?, gpu.upload("olbvh.query.view", &[plan.view()])?);
    let skipped = match &searched.structure {
        Structure::Octree(tree) if plan.hides(values) => Some(tree),
        _ => None,
    };
    let carve = |a: &mut Arena| {
        let memory = RenderMemory::carve(a, plan.size, skipped.map(|tree| &tree.capacity))?;
        Ok((memory, skipped.map(|tree| a.take(range_bytes(tree.capacity.nodes))).transpose()?))
    };
    let buffer = gpu.buffer("olbvh.query.picture", Arena::measure(carve)?)?;
    let (memory, ranges) = carve(&mut Arena::new(buffer.all()))?;
    let shown = ranges.map(|ranges| Shown { ranges, drawn: drawn.all(), count: plan.drawn.len() as u32 });
    let (field, normals) = ((field.all(), on), normals.as_ref().map(crate::gpu::Buffer::all));
    let iso = !plan.iso.is_empty();
    let input = RenderInput { size: plan.size, view: view.all(), iso, table: table.all(), field, normals, shown };
    let ((), time) = gpu.run("olbvh.query.intervals", |r| {
        if let (Some(tree), Some(ranges)) = (skipped, ranges) {
            cmd_ranges(r, &searched.mesh, tree, field, ranges)?;
        }
        cmd_render(r, &searched, &input, &memory, Rounds::begin(0))
    })?;
    let ranges_ms = skipped.map_or(0.0, |_| time.milliseconds("build.ranges") + time.milliseconds("query.visible"));
    let mut drawn = Drawn { ranges_ms, interval_ms: time.milliseconds("query.intervals"), ..Drawn::default() };
    let rays = u64::from(plan.size[0]) * u64::from(plan.size[1]);
    let status = loop {
        let ((), time) = gpu.run("olbvh.query.march", |r| cmd_render(r, &searched, &input, &memory, Rounds::resume(1)))?;
        drawn.march_ms += time.milliseconds("query.march");
        drawn.submissions += 1;
        let status = gpu.download::<RenderStatus>(&buffer, memory.status)?.first().copied().unwrap_or_default();
        report(rays.saturating_sub(u64::from(status.unfinished)), rays);
        if status.unfinished == 0 {
            break status;
        }
    };
    let wide = |w: [u32; 2]| u64::from(w[0]) | u64::from(w[1]) << 32;
    (drawn.samples, drawn.skipped_samples, drawn.found_samples) = (wide(status.samples), wide(status.skipped), wide(status.found));
    drawn.colors = gpu.download(&buffer, memory.colors.part(0, 16 * rays))?;
    Ok(drawn)
}
