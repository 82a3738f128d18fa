//! The paper's measurements on one device in one run: the octree for α = 0, 1, 2 and every assignment, compared with
//! the LBVH and with the device's hardware ray tracing. Every answer is verified before anything is timed.
//!
//! ```text
//! subject           a mesh on the device, and the queries that all structures answer
//! structure         one structure: built and queried
//! verify            comparison of its answers with those of the first structure and of the reference implementation
//! measure           repetitions within a budget     load      keeps the device at its clock between them
//! structure_report  the figures of one structure, by quantity
//! mesh_report       the figures of all structures over a mesh, and their ratios to the LBVH
//! report            all figures of a run     → report_tables (text, Markdown), report_plots (SVG)
//!
//! table, plot       what all tables and all plots share
//! copy              how fast the device copies     traffic    what each stage must move at least, to compare with that
//! scaling           time per item over the size of the mesh     → report_tables, scaling_plots
//! compare           two files of reports: ratios, and which of them are more than noise
//! ```

mod compare;
mod copy;
mod load;
mod measure;
mod mesh_report;
mod plot;
mod quantity;
mod report;
mod report_plots;
mod report_tables;
mod scaling;
mod scaling_plots;
mod stored;
mod structure;
mod structure_report;
mod subject;
mod suite;
mod table;
mod traffic;
mod verify;

pub use compare::{Compared, Comparison, Verdict, compare};
pub use copy::CopyRate;
pub(crate) use load::Load;
pub use measure::{Budget, Spread, Timing};
pub use mesh_report::{MeshReport, Quality};
pub use quantity::Quantity;
pub use report::{DeviceFacts, Report};
pub use report_plots::plots;
pub use report_tables::{markdown, text};
pub use scaling::Scale;
pub use structure::Kind;
pub use structure_report::{Figure, Lost, MemoryFigures, StageFigure, StructureReport};
pub use suite::{Settings, Suite};

use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::mesh::Mesh;
use crate::reference::boundary::{Topology, topology};
use crate::times::StageTimes;
use measure::{Runs, repeat};
use structure::Structure;
use subject::Subject;
use verify::{Answers, check, check_tree};

/// Measures the structures of a report's suite over a mesh; `progress` receives what is being done.
///
/// # Errors
/// [`crate::Error::Mismatch`] if two structures give different answers, [`crate::Error::Memory`] or another error if
/// the device cannot hold the mesh.
pub fn run(gpu: &Gpu, name: &str, mesh: &Mesh, whole: &Report, progress: &dyn Fn(&str)) -> Result<MeshReport> {
    let settings = &whole.settings;
    progress(&format!("{name}: {} tetrahedra", mesh.tets.len()));
    let subject = Subject::new(gpu, name, mesh, settings)?;
    let mut report = MeshReport::new(&subject);
    let topology = (mesh.tets.len() <= settings.reference_tets).then(|| topology(mesh)).transpose()?;
    let mut expected: Option<Answers> = None;
    for kind in whole.suite.kinds() {
        match measure_structure(&subject, kind, expected.as_ref(), topology.as_ref(), whole, progress) {
            Ok(Some((measured, answers))) => {
                report.structures.push(measured);
                expected.get_or_insert(answers);
            }
            Ok(None) => report.skip(kind, "the device traces no rays that way", progress),
            // This structure is too large for the device or for 32-bit offsets; others may not be.
            Err(error) if error.is_lack_of_room() => report.skip(kind, &error.to_string(), progress),
            Err(error) => return Err(error),
        }
    }
    report.set_ratios();
    Ok(report)
}

/// Builds a structure, verifies its answers, and measures it; `None` if the device lacks what it needs. `expected` are the
/// answers of the first structure, `topology` is that of a mesh for which trees are compared with the reference.
fn measure_structure(
    subject: &Subject<'_>,
    kind: Kind,
    expected: Option<&Answers>,
    topology: Option<&Topology>,
    whole: &Report,
    progress: &dyn Fn(&str),
) -> Result<Option<(StructureReport, Answers)>> {
    let Some(structure) = Structure::build(subject.gpu, &subject.device, kind)? else { return Ok(None) };
    progress(&format!("{}: {kind}", subject.name));
    let moved = subject.moved.as_ref().filter(|_| kind.overlaps());
    let moved = moved.map(|moved| Structure::build(subject.gpu, moved, kind)).transpose()?.flatten();
    let answers = Answers::of(subject, &structure, moved.as_ref())?;
    if let (Structure::Octree(tree), Some(topology)) = (&structure, topology) {
        check_tree(subject, topology, tree, &answers)?;
    }
    let lost = expected.map(|first| check(subject, kind, first, &answers)).transpose()?.flatten();
    let mut measured = measure(subject, kind, (&structure, moved.as_ref()), &answers, lost, &whole.settings.budget)?;
    measured.set_stages(subject, &structure, &whole.copy);
    Ok(Some((measured, answers)))
}

/// Times one structure.
fn measure(
    subject: &Subject<'_>,
    kind: Kind,
    (structure, moved): (&Structure, Option<&Structure>),
    answers: &Answers,
    lost: Option<Lost>,
    budget: &Budget,
) -> Result<StructureReport> {
    let mut report = StructureReport::new(kind, structure, lost);
    let mut add = |quantity, runs: Option<Runs>, stage: Option<&str>, work: Option<u64>| {
        if let Some(runs) = runs.as_ref().filter(|runs| !runs.is_empty()) {
            report.figures.push(Figure::new(quantity, runs.timing(stage), work));
        }
    };
    let (gpu, load) = (subject.gpu, &subject.load);
    let rebuilt = || Ok(Structure::build(gpu, &subject.device, kind)?.map_or(StageTimes::default(), |s| s.times().clone()));
    rebuilt()?; // `structure` still holds its memory, so the first one gets memory that the system has yet to give
    add(Quantity::Build, Some(repeat(load, budget, rebuilt)?), None, Some(u64::from(subject.device.input().tets)));
    for ((quantity, points), owners) in subject.points.iter().zip(&answers.owners) {
        let found = owners.iter().filter(|&&owner| owner != u32::MAX).count();
        let traversed = quantity.traversed().filter(|_| structure.traverses(kind));
        for quantity in [*quantity].into_iter().chain(traversed) {
            let locate = || structure.locate(points, quantity);
            if traversed == Some(quantity) && locate()?.owners != *owners {
                return Err(Error::Mismatch(format!("{kind}: the traversal finds other owners than the descent")));
            }
            let runs = repeat(load, budget, || Ok(locate()?.times))?;
            add(quantity, Some(runs), None, Some(found as u64));
        }
    }
    if let Some((found, _)) = &answers.picture {
        let runs = repeat(load, budget, || Ok(subject.render(structure)?.map_or(StageTimes::default(), |drawn| drawn.times)))?;
        add(Quantity::Intervals, Some(runs.clone()), Some("query.intervals"), None);
        add(Quantity::March, Some(runs), Some("query.march"), Some(*found));
    }
    if let Some((kinds, _)) = &answers.voxels {
        let sliced = || Ok(subject.slice(structure, &mut |_| Ok(()))?.unwrap_or_default().times);
        add(Quantity::Slice, Some(repeat(load, budget, sliced)?), None, Some(kinds.len() as u64));
    }
    if let Some(moved) = moved {
        let runs = repeat(load, budget, || Ok(structure.overlap(moved)?.map_or(StageTimes::default(), |found| found.times)))?;
        add(Quantity::Overlap, Some(runs), None, None);
    }
    Ok(report)
}
