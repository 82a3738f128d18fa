//! The runner of cases on a device.

use super::failure::{Stop, Verdict};
use super::meshes::MeshRecipe;
use super::twin::Twin;
use super::{Case, Failure, TargetKind, Work, build, locate, overlap, picture, primitives, ranges, slice, topology};
use crate::build::{BadCells, DeviceMesh};
use crate::error::Result;
use crate::gpu::{Gpu, GpuOptions};
use std::time::{Duration, Instant};

/// Bytes of dropped buffers that are kept for other cases, since fresh memory costs more than most cases.
const POOL: u64 = 256 << 20;

/// How a case ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// The device and the reference implementation agree.
    Passed,
    /// They differ.
    Failed(Failure),
    /// The device cannot hold the case; the text says why.
    Skipped(String),
}

/// The result of a case.
#[derive(Clone, Debug)]
pub struct Report {
    /// Name of the case.
    pub name: String,
    /// The outcome.
    pub outcome: Outcome,
    /// For a case that passed, a difference between two trees that was accepted, and why: tetrahedra of the mesh
    /// overlap.
    pub accepted: Option<String>,
    /// The time that it took.
    pub time: Duration,
}

/// A device to run cases on.
#[derive(Debug)]
pub struct Lab {
    device: Gpu,
    messages: usize,
    subject: Option<(Twin, DeviceMesh)>,
}

impl Lab {
    /// Opens a lab on the device and binding that `options` name. The self-test is not run here but in the case
    /// `device/self-test`, so that a device that fails it can still be examined.
    ///
    /// # Errors
    /// As [`Gpu::new`].
    pub fn new(options: &GpuOptions) -> Result<Self> {
        let device = Gpu::new(&GpuOptions { trust: true, ..options.clone() })?.with_pool(POOL);
        Ok(Self { device, messages: 0, subject: None })
    }

    /// The device, with the target of the options or its own choice.
    pub fn device(&self) -> &Gpu {
        &self.device
    }

    /// The device with another target.
    fn gpu(&self, kind: TargetKind) -> Result<Gpu> {
        match kind.target(&self.device.report().room) {
            Some(target) => self.device.with_target(target),
            None => Ok(self.device.clone()),
        }
    }

    /// Runs a case. It fails if a validation layer reports a message.
    pub fn run(&mut self, case: &Case) -> Report {
        let begin = Instant::now();
        let outcome = match self.work(&case.work) {
            Ok(()) => Outcome::Passed,
            Err(Stop::Failed(failure)) => Outcome::Failed(failure),
            Err(Stop::Skipped(why)) => Outcome::Skipped(why),
        };
        let messages = self.device.validation_messages();
        let fresh = messages.len().saturating_sub(self.messages);
        self.messages = messages.len();
        let outcome = match (outcome, messages.last()) {
            (Outcome::Passed | Outcome::Skipped(_), Some(last)) if fresh > 0 => Outcome::Failed(Failure {
                stage: "validation".into(),
                array: "messages".into(),
                index: None,
                expected: "none".into(),
                found: format!("{fresh}: {last}"),
            }),
            (outcome, _) => outcome,
        };
        let accepted = self.subject.as_mut().and_then(|(twin, _)| twin.accepted.take());
        Report { name: case.name.clone(), outcome, accepted, time: begin.elapsed() }
    }

    fn work(&mut self, work: &Work) -> Verdict {
        match work {
            Work::SelfTest => Ok(crate::primitives::self_test(&self.device)?),
            Work::Scan(case) => primitives::scan(&self.gpu(case.target)?, *case),
            Work::Sort(case) => primitives::sort(&self.gpu(case.target)?, *case),
            Work::Topology(recipe) => self.over(recipe, |gpu, twin, device| {
                topology::check(twin, device)?;
                topology::check_moved(gpu, twin, device)
            }),
            Work::Build(case) if case.target != TargetKind::Device => {
                let gpu = self.gpu(case.target)?;
                self.over(&case.mesh, |_, twin, _| build::check(&gpu, case, twin, &DeviceMesh::upload(&gpu, &twin.mesh, BadCells::Skip)?))
            }
            Work::Build(case) => self.over(&case.mesh, |gpu, twin, device| build::check(gpu, case, twin, device)),
            Work::Locate(case) => self.over(&case.mesh, |gpu, twin, device| locate::check(gpu, case, twin, device)),
            Work::Ranges(case) => self.over(&case.mesh, |gpu, twin, device| ranges::check(gpu, case, twin, device)),
            Work::Picture(case) => self.over(&case.mesh, |gpu, twin, device| picture::check(gpu, case, twin, device)),
            Work::Slice(case) => self.over(&case.mesh, |gpu, twin, device| slice::check(gpu, case, twin, device)),
            Work::Overlap(case) => self.over(&case.mesh, |gpu, twin, device| overlap::check(gpu, case, twin, device)),
        }
    }

    /// Runs a check over a mesh. The mesh is kept, on host and device, until a case of another mesh follows.
    fn over(&mut self, recipe: &MeshRecipe, check: impl FnOnce(&Gpu, &mut Twin, &DeviceMesh) -> Verdict) -> Verdict {
        // Two meshes of the caller may have equal names, but not the same one.
        let subject = if let Some(kept) = self.subject.take().filter(|(twin, _)| std::ptr::eq(twin.name, recipe.name)) {
            kept
        } else {
            let twin = Twin::new(recipe)?;
            let device = DeviceMesh::upload(&self.device, &twin.mesh, BadCells::Skip)?;
            (twin, device)
        };
        let (twin, device) = self.subject.insert(subject);
        check(&self.device, twin, device)
    }
}
