//! The work that is timed, and the answers that it must give.

use super::search::Work;
use crate::bench::Load;
use crate::build::{BadCells, DeviceMesh, Tree};
use crate::error::{Error, Result};
use crate::gpu::{DeviceKind, Gpu, Target};
use crate::mesh::{Bounds, Field, Mesh, On};
use crate::options::{BuildOptions, Lists};
use crate::query::{self, LocateMethod, LocateOptions, SILENT};
use crate::reference::boundary::topology;
use crate::reference::build::build;
use crate::reference::locate::Locator;
use crate::render::{PicturePlan, RenderSettings};
use crate::slicing::{Extrapolate, SliceSettings, VoxelGrid};
use crate::times::{StageTime, StageTimes};
use crate::tree::TreeArrays;
use std::cell::RefCell;
use std::rc::Rc;
use std::time::Instant;

/// Number of points to locate on a processor, and on a GPU, which has as many invocations at once.
const POINTS: [u32; 2] = [1 << 16, 1 << 20];
/// Width and height of the picture, and voxels per row of the slice, on the two.
const PIXELS: [u32; 2] = [192, 768];
/// Meshes of up to this many tetrahedra are also compared with the reference implementation.
const REFERENCE_TETS: usize = 300_000;

/// A mesh and the queries over it.
pub struct Workload<'a> {
    gpu: Gpu,
    mesh: &'a Mesh,
    points: Vec<[f32; 3]>,
    field: Field,
    plan: PicturePlan,
    voxels: VoxelGrid,
    expected: Answers,
    load: Load,
    /// Mesh and trees for the two targets used last.
    prepared: RefCell<Vec<Rc<Prepared>>>,
}

/// A mesh and its trees, built with a target.
struct Prepared {
    target: Target,
    mesh: DeviceMesh,
    whole: Tree,
    boundary: Tree,
}

/// Everything that must not depend on the target.
#[derive(Default, PartialEq)]
struct Answers {
    neighbours: Vec<[u32; 4]>,
    trees: Vec<TreeArrays>,
    owners: Vec<Vec<u32>>,
    barycentrics: Vec<[f32; 4]>,
    colors: Vec<[f32; 4]>,
    kinds: Vec<u8>,
    voxels: Vec<u32>,
}

impl<'a> Workload<'a> {
    /// Computes the expected answers with the target of `gpu`; for meshes that are not too large, these are compared
    /// with the reference implementation.
    ///
    /// # Errors
    /// [`Error::Mismatch`] if the device gives other answers than the reference implementation, [`Error::Memory`] or
    /// another error if it cannot hold the mesh.
    pub fn new(gpu: &Gpu, mesh: &'a Mesh) -> Result<Self> {
        let device = DeviceMesh::upload(gpu, mesh, BadCells::Skip)?;
        let bounds = Bounds::from(device.grid());
        let Bounds { lo, hi } = bounds;
        let of = usize::from(gpu.report().kind != DeviceKind::Cpu);
        // Fractional parts of multiples of a generalised golden ratio: in no order, and spread evenly.
        let at = |i: u32, share: f64, c: usize| lo[c] + (hi[c] - lo[c]) * (f64::from(i) * share).fract() as f32;
        let points = (0..POINTS[of]).map(|i| [at(i, 0.819_172_513_4, 0), at(i, 0.671_043_606_7, 1), at(i, 0.549_700_477_9, 2)]).collect();
        let along_x = || Field { name: "x".into(), on: On::Points, values: mesh.points.iter().map(|p| p[0]).collect() };
        let field = mesh.fields.iter().find(|f| f.on == On::Points).cloned().unwrap_or_else(along_x);
        let picture = RenderSettings { size: [PIXELS[of]; 2], shading: false, ..RenderSettings::default() };
        let plan = PicturePlan::new(&picture, &bounds, mesh.origin, field.range())?;
        let voxels = SliceSettings { size: [PIXELS[of], 0], ..SliceSettings::default() }.voxels(lo, hi, [0.0; 3])?;
        let gpu = gpu.clone();
        let (expected, load, prepared) = (Answers::default(), Load::new(&gpu)?, RefCell::default());
        let mut workload = Self { gpu, mesh, points, field, plan, voxels, expected, load, prepared };
        let target = workload.gpu.target().clone();
        workload.expected = workload.answers(&target)?;
        if mesh.tets.len() <= REFERENCE_TETS {
            workload.check_reference()?;
        }
        Ok(workload)
    }

    fn check_reference(&self) -> Result<()> {
        let topology = topology(self.mesh)?;
        let differ = |what: &str| {
            Err(Error::Mismatch(format!("{what} from those of the reference implementation; `olbvh conformance` shows in which step")))
        };
        let built = |lists| build(self.mesh, &topology, &BuildOptions { lists, ..BuildOptions::default() });
        let trees = [built(Lists::All)?, built(Lists::Boundary)?];
        if self.expected.trees != trees {
            return differ("trees differ");
        }
        for (tree, found) in trees.iter().zip(&self.expected.owners) {
            if !Locator::new(self.mesh, &topology, tree).locate_each(&self.points).iter().map(|l| l.owner).eq(found.iter().copied()) {
                return differ("owners differ");
            }
        }
        Ok(())
    }

    /// Runs stage 0 and both constructions with a target, and returns the times of their stages.
    fn construct(&self, target: &Target) -> Result<(Prepared, StageTimes)> {
        let gpu = self.gpu.with_target(target.clone())?;
        let mesh = DeviceMesh::upload(&gpu, self.mesh, BadCells::Skip)?;
        let tree = |lists| Tree::build(&gpu, &mesh, &BuildOptions { lists, ..BuildOptions::default() });
        let (whole, boundary) = (tree(Lists::All)?, tree(Lists::Boundary)?);
        let mut times = mesh.times().clone();
        [&whole, &boundary].into_iter().for_each(|tree| times.add(tree.times().clone()));
        Ok((Prepared { target: target.clone(), mesh, whole, boundary }, times))
    }

    /// Mesh and trees for a target, from the cache if they are there.
    fn prepared(&self, target: &Target) -> Result<Rc<Prepared>> {
        if let Some(found) = self.prepared.borrow().iter().find(|p| p.target == *target) {
            return Ok(found.clone());
        }
        let made = Rc::new(self.construct(target)?.0);
        let mut prepared = self.prepared.borrow_mut();
        prepared.insert(0, made.clone());
        prepared.truncate(2);
        Ok(made)
    }

    /// Runs every query; stores the answers in `answers` and returns what it took.
    fn ask(&self, on: &Prepared, answers: &mut Answers) -> Result<StageTimes> {
        let mut times = StageTimes::default();
        for (tree, method) in [(&on.whole, LocateMethod::Descent), (&on.boundary, LocateMethod::Sorted)] {
            let options = LocateOptions { method, ..LocateOptions::default() };
            let located = query::locate(tree, &self.points, None, &options, SILENT)?;
            times.add(located.times);
            answers.owners.push(located.owners);
            answers.barycentrics.extend(located.barycentrics);
        }
        let rendered = query::render(&on.whole, &self.plan, (&self.field.values, On::Points), None, SILENT)?;
        answers.colors = rendered.colors;
        times.add(rendered.times);
        let sliced = query::slice(&on.whole, None, &self.voxels, Extrapolate::Nearest, SILENT, &mut |band| {
            answers.kinds.extend(band.kinds);
            answers.voxels.extend(band.owners);
            Ok(())
        })?;
        times.add(sliced.times);
        Ok(times)
    }

    fn answers(&self, target: &Target) -> Result<Answers> {
        let on = self.prepared(target)?;
        let mut answers =
            Answers { neighbours: on.mesh.neighbours()?, trees: vec![on.whole.download()?, on.boundary.download()?], ..Answers::default() };
        self.ask(&on, &mut answers)?;
        Ok(answers)
    }
}

impl Work for Workload<'_> {
    fn verify(&self, target: &Target) -> Result<()> {
        let found = self.answers(target)?;
        let e = &self.expected;
        let same = [
            ("neighbours", e.neighbours == found.neighbours),
            ("trees", e.trees == found.trees),
            ("owners", e.owners == found.owners && e.barycentrics == found.barycentrics),
            ("pictures", e.colors == found.colors),
            ("voxels", e.kinds == found.kinds && e.voxels == found.voxels),
        ];
        let wrong = same.into_iter().find(|(_, same)| !same);
        wrong.map_or(Ok(()), |(what, _)| Err(Error::Mismatch(format!("{what} differ from those of target `{}`", self.gpu.target().name))))
    }

    fn run(&self, target: &Target, stages: &[&str]) -> Result<Vec<StageTime>> {
        let any = |kinds: &[&str]| stages.iter().any(|s| kinds.iter().any(|k| s.starts_with(k)));
        let mut times = StageTimes::default();
        let begin;
        if any(&["query."]) {
            let on = self.prepared(target)?;
            self.load.run()?;
            begin = Instant::now();
            times = self.ask(&on, &mut Answers::default())?;
        } else {
            self.load.run()?;
            begin = Instant::now();
        }
        if any(&["mesh.", "build."]) {
            times.add(self.construct(target)?.1);
        }
        // Without timestamps, the host's clock is used for all stages together.
        let wall =
            StageTime { name: stages.first().copied().unwrap_or_default().into(), milliseconds: begin.elapsed().as_secs_f64() * 1e3 };
        Ok(if times.total() > 0.0 { times.stages } else { vec![wall] })
    }
}
