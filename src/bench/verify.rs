//! The answers of a structure, and their verification.

use super::structure::{Kind, Structure};
use super::structure_report::Lost;
use super::subject::Subject;
use crate::build::Tree;
use crate::error::{Error, Result};
use crate::options::{Lists, TOLERANCE};
use crate::reference::boundary::Topology;
use crate::reference::build::build;
use crate::reference::locate::{Location, Locator, place};
use crate::reference::tet::{Tet, Weights};
use crate::slicing::INSIDE;

/// Allowed difference of pictures per channel; one pixel in 1000 may differ by more (SPEC 3.3).
const COLOR: f32 = 2.0 / 255.0;

/// The answers of a structure; `None`: the structure cannot answer the query.
pub(super) struct Answers {
    /// Owners of the points of every set.
    pub owners: Vec<Vec<u32>>,
    /// Number of samples in the mesh, and colours.
    pub picture: Option<(u64, Vec<[f32; 4]>)>,
    /// Kind and owner of every voxel.
    pub voxels: Option<(Vec<u8>, Vec<u32>)>,
    /// Tetrahedra that intersect the other mesh, for each of the two meshes.
    pub overlap: Option<[Vec<u32>; 2]>,
}

impl Answers {
    /// Answers every query once. `moved` is the same kind of structure over the moved mesh.
    pub(super) fn of(subject: &Subject<'_>, structure: &Structure, moved: Option<&Structure>) -> Result<Self> {
        let owners = subject.points.iter().map(|(of, points)| structure.locate(points, *of).map(|found| found.owners));
        let owners = owners.collect::<Result<_>>()?;
        let picture = subject.render(structure)?.map(|rendered| (rendered.stats.found_samples, rendered.colors));
        let (mut kinds, mut cells) = (Vec::new(), Vec::new());
        let sliced = subject.slice(structure, &mut |band| {
            kinds.extend(band.kinds);
            cells.extend(band.owners);
            Ok(())
        })?;
        let voxels = sliced.map(|_| (kinds, cells));
        let overlap = moved.map(|moved| structure.overlap(moved)).transpose()?.flatten();
        let overlap = overlap.map(|found| [found.overlap.a, found.overlap.b]);
        Ok(Self { owners, picture, voxels, overlap })
    }
}

/// Where a point lies in a tetrahedron; `None` for no tetrahedron, or for a point far from all.
fn weights(subject: &Subject<'_>, tet: u32, point: [f32; 3]) -> Option<Weights> {
    let grid = subject.device.grid();
    let &ids = subject.mesh.tets.get(tet as usize)?;
    let corners = ids.map(|id| grid.normalise(subject.mesh.points[id as usize]));
    // Only the order of the ids matters.
    let order = ids.map(|id| ids.iter().filter(|&&other| other < id).count() as u32);
    let mut by_order = [[0.0; 3]; 4];
    order.iter().zip(corners).for_each(|(&o, corner)| by_order[o as usize] = corner);
    place(grid, point).map(|(_, x)| Tet::new(order, &by_order).weights(x))
}

/// Whether the closed tetrahedron contains the point, by the exact test.
fn holds(subject: &Subject<'_>, tet: u32, point: [f32; 3]) -> bool {
    weights(subject, tet, point).is_some_and(|w| w.inside)
}

/// Whether a point outside of a tetrahedron is so near to it that a structure may accept or reject it; `u32::MAX` means
/// that it was rejected.
fn near(subject: &Subject<'_>, tet: u32, point: [f32; 3]) -> bool {
    tet == u32::MAX || weights(subject, tet, point).is_some_and(|w| !w.inside && w.smallest() >= -TOLERANCE)
}

/// Compares answers with those of the first structure. Rays may lose points, and may name any tetrahedron that contains
/// a point.
pub(super) fn check(subject: &Subject<'_>, kind: Kind, first: &Answers, answers: &Answers) -> Result<Option<Lost>> {
    let wrong = |what: String| Err(Error::Mismatch(format!("{kind}: {what}")));
    let walks = kind.lists().is_some_and(|(_, lists)| lists == Lists::Boundary);
    let mut lost = Lost { points: 0, of: 0 };
    for ((_, points), (expected, found)) in subject.points.iter().zip(first.owners.iter().zip(&answers.owners)) {
        lost.of += expected.iter().filter(|&&owner| owner != u32::MAX).count() as u64;
        let all = points.iter().zip(expected.iter().zip(found));
        for (&point, (&expected, &found)) in all.filter(|(_, (expected, found))| expected != found) {
            let holding = [expected, found].map(|tet| holds(subject, tet, point));
            let outside = [expected, found].iter().all(|&tet| near(subject, tet, point));
            match kind {
                Kind::Rays(_) if found == u32::MAX => lost.points += u64::from(holding[0]),
                // Where tetrahedra overlap, walks may end in another one.
                _ if (matches!(kind, Kind::Rays(_)) || walks) && holding[1] => {}
                // A point that lies outside by less than the tolerance may be found from one leaf and not from another.
                Kind::Octree { .. } | Kind::Fine | Kind::Lbvh if outside => {}
                _ => return wrong(format!("point {point:?} lies in cell {expected}, not {found}")),
            }
        }
    }
    if let (Some((samples, colors)), Some((found, others))) = (&first.picture, &answers.picture) {
        let differs = |(a, b): (&[f32; 4], &[f32; 4])| a.iter().zip(b).any(|(a, b)| (a - b).abs() > COLOR);
        let pixels = colors.iter().zip(others).filter(|&pair| differs(pair)).count();
        if samples != found || 1000 * pixels > colors.len() {
            return wrong(format!("{found} samples in the mesh where there are {samples}; {pixels} pixels differ"));
        }
    }
    if let (Some((kinds, expected)), Some((found_kinds, found))) = (&first.voxels, &answers.voxels) {
        let same = |i: usize| expected[i] == found[i] || (walks && kinds[i] == INSIDE && holds(subject, found[i], subject.centre(i)));
        if kinds != found_kinds || !(0..kinds.len()).all(same) {
            return wrong("the voxels of the slice differ".into());
        }
    }
    if let (Some(expected), Some(found)) = (&first.overlap, &answers.overlap)
        && expected != found
    {
        let counts = [expected, found].map(|sets| sets.each_ref().map(Vec::len));
        return wrong(format!("{:?} tetrahedra of the two meshes intersect the other mesh, not {:?}", counts[1], counts[0]));
    }
    Ok(matches!(kind, Kind::Rays(_)).then_some(lost))
}

/// Compares a tree, and the owners found with it, with the reference implementation.
pub(super) fn check_tree(subject: &Subject<'_>, topology: &Topology, tree: &Tree, answers: &Answers) -> Result<()> {
    let options = tree.options();
    let host = tree.download()?;
    let wrong = |what: &str| Err(Error::Mismatch(format!("α={} {}: {what}", options.alpha, options.assign)));
    if host != build(subject.mesh, topology, options)? {
        return wrong("the tree differs from that of the reference implementation");
    }
    let locator = Locator::new(subject.mesh, topology, &host);
    // Where tetrahedra overlap, points that were sorted may have been found in another one.
    let owns = |(&point, (e, &found)): (&[f32; 3], (Location, &u32))| e.owner == found || holds(subject, found, point);
    let same =
        |(points, owners): (&[[f32; 3]], &Vec<u32>)| points.iter().zip(locator.locate_each(points).into_iter().zip(owners)).all(owns);
    let right = subject.points.iter().map(|(_, points)| points.as_slice()).zip(&answers.owners).all(same);
    if right { Ok(()) } else { wrong("owners differ from those of the reference implementation") }
}
