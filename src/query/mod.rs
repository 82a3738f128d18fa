//! Queries on the device: point location and closest places (SPEC 3.1, 3.2), volume rendering (3.3), slicing (3.4) and mesh
//! overlap (3.5).

mod all_owners;
mod locate;
mod nearest;
mod order;
mod overlap;
pub(crate) mod searched;
mod slice;
mod visible;
mod volume;

pub use all_owners::{AllOwners, OwnersMemory, cmd_count_owners, cmd_list_owners, locate_all};
pub use locate::{LocateMethod, LocateOptions, LocateOutput, Located, MOST_TRAVERSED, PointInput, cmd_interpolate, cmd_locate, locate};
pub(crate) use locate::{check_tolerance, numbered};
pub(crate) use nearest::nearest_in;
pub use nearest::{Nearest, NearestMemory, cmd_nearest, nearest};
pub(crate) use order::code_bits;
pub use order::{PointOrder, cmd_sort_points};
pub use overlap::{OverlapMemory, Overlapped, PairMemory, cmd_count_pairs, cmd_list_pairs, cmd_overlap, overlap, overlap_pairs};
pub use slice::{SliceInput, SliceMemory, Sliced, cmd_slice, slice};
pub(crate) use slice::{Slicing, slice_in};
pub use visible::{cmd_visible, visible_bytes};
pub(crate) use volume::{Canvas, Rays, render_in};
pub use volume::{RenderInput, RenderMemory, Rendered, Visibility, cmd_depths, cmd_render, prepare_picture, render};

/// What an overlap is, and what it takes to find, is defined with the reference.
pub use crate::reference::overlap::{Effort, Overlap};

use crate::build::{MeshInput, MeshView, Tree, TreeMemory};
use crate::error::{Error, Result};
use crate::gpu::{Buffer, BufferRef, DeviceKind, Gpu, Recorder};
use crate::mesh::On;
use crate::options::LIST_PART;
use crate::times::StageTimes;

/// Receives the progress of an owning call: how much is done, and the total. Each call says what it counts. An error ends the
/// call, which returns it: [`Error::Cancelled`] to stop, from another thread or a window, between two submissions.
pub type Progress<'a> = &'a dyn Fn(u64, u64) -> Result<()>;

/// Receives progress and ignores it.
pub const SILENT: &(dyn Fn(u64, u64) -> Result<()> + Sync) = &|_, _| Ok(());

/// How many dispatches one recording spends on work of unknown length. Each dispatch tests a limited number of
/// candidates per item, so that no dispatch keeps the device busy for seconds. Later dispatches skip items that are
/// finished. To begin with none is an error, but for [`cmd_render`], which then only prepares the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rounds {
    /// Number of dispatches recorded, one after the other.
    pub count: u32,
    /// Continues where an earlier recording stopped.
    pub resume: bool,
}

impl Rounds {
    /// `count` dispatches, from the beginning of the work.
    pub fn begin(count: u32) -> Self {
        Self { count, resume: false }
    }

    /// `count` more dispatches, after those of an earlier recording.
    pub fn resume(count: u32) -> Self {
        Self { count, resume: true }
    }

    /// Rejects a beginning without a dispatch: what a resumed recording would read, no dispatch would have written.
    pub(crate) fn check(self) -> Result<()> {
        if self.count == 0 && !self.resume {
            return Err(Error::Invalid("a query that begins with no rounds; it takes at least one".into()));
        }
        Ok(())
    }
}

/// Submits rounds until `read` returns what it has read back of finished work; it returns `None` if more rounds are needed. A
/// submission has `at_once` of them. `times` receives what they take.
pub(crate) fn until_done<T>(
    gpu: &Gpu,
    label: &'static str,
    at_once: u32,
    times: &mut StageTimes,
    record: impl Fn(&mut Recorder<'_>, Rounds) -> Result<()>,
    read: impl Fn() -> Result<Option<T>>,
) -> Result<T> {
    let mut rounds = Rounds::begin(at_once);
    loop {
        times.add(gpu.submit(label, |r| record(r, rounds))?.1);
        if let Some(done) = read()? {
            return Ok(done);
        }
        rounds = Rounds::resume(at_once);
    }
}

/// Uploads the values of a field, one per point or tetrahedron of the mesh.
fn upload_field(gpu: &Gpu, mesh: &MeshInput, (values, on): (&[f32], On)) -> Result<(Buffer, On)> {
    on.check(values, mesh.sizes())?;
    Ok((gpu.upload("olbvh.query.field", values)?, on))
}

/// A mesh and its tree, as queries take them.
#[derive(Clone, Copy, Debug)]
pub struct Scene {
    /// The mesh.
    pub mesh: MeshView,
    /// The tree over it.
    pub tree: TreeMemory,
    /// Number of entries of the longest leaf. Lists are searched in parts, up to this length, so too small a number
    /// loses points. [`Scene::recorded`] gives the number of tetrahedra, which no list exceeds; that records up
    /// to [`MAX_LIST_PARTS`] dispatches on a GPU, and one for every [`LIST_PART`] tetrahedra on a processor, of which those end
    /// at once that begin behind the end of the longest list, which the device knows. A host that reads back
    /// [`crate::layout::BuildStatus::longest_leaf`] spares them. A list of N entries is a loop of up to N /
    /// [`MAX_LIST_PARTS`] passes on a GPU: where a tree had to be built much coarser than its mesh asks for, record few points
    /// at a time.
    pub longest_leaf: u32,
}

/// Most dispatches for one search of the lists on a GPU. For long lists the parts get longer than [`LIST_PART`] instead of
/// more numerous; not on a processor, whose driver may end the loops of an invocation after 65,535 passes.
pub const MAX_LIST_PARTS: u32 = 16;

/// Number of items of `bytes` bytes that `found` holds, as far as shaders number them: an index is a signed word.
fn capacity_of(found: BufferRef, bytes: u64) -> u32 {
    (found.size() / bytes).min(i32::MAX as u64) as u32
}

/// The number of entries of a list that one dispatch searches, and the number of dispatches that the longest list
/// takes.
fn list_parts(device: DeviceKind, longest: u32) -> (u32, u32) {
    let few = longest.div_ceil(MAX_LIST_PARTS).next_power_of_two();
    let part = if device == DeviceKind::Cpu { LIST_PART } else { LIST_PART.max(few) };
    (part, longest.div_ceil(part).max(1))
}

impl Scene {
    /// A tree in memory owned by this crate, and its mesh. It must outlive what is recorded with the scene.
    pub fn of(tree: &Tree) -> Self {
        Self { mesh: tree.mesh(), tree: *tree.memory(), longest_leaf: tree.status().longest_leaf }
    }

    /// A tree that is built in memory of the host, which does not know how long its lists get.
    pub fn recorded(mesh: MeshView, tree: TreeMemory) -> Self {
        Self { mesh, tree, longest_leaf: mesh.input.tets }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_parts_hold_the_longest_list() {
        for longest in [0, 1, LIST_PART, LIST_PART + 1, MAX_LIST_PARTS * LIST_PART, MAX_LIST_PARTS * LIST_PART + 1, 12_290_298, 536_870_911]
        {
            let (part, count) = list_parts(DeviceKind::Cpu, longest);
            assert!(part == LIST_PART && u64::from(part) * u64::from(count) >= u64::from(longest), "{longest}: {count} of {part}");
            let (part, count) = list_parts(DeviceKind::Discrete, longest);
            assert!(part >= LIST_PART && count <= MAX_LIST_PARTS && part * count >= longest, "{longest}: {count} of {part}");
            assert!(longest > MAX_LIST_PARTS * LIST_PART || (part, count) == (LIST_PART, longest.div_ceil(LIST_PART).max(1)), "{longest}");
        }
    }
}
