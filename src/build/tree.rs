//! A tree in device memory owned by this crate.

use super::MeshView;
use super::mesh::{DeviceMesh, KeptMesh};
use super::plan::{Capacity, CountScratch, FilterScratch, MAX_ENTRIES, SortedScratch, TreeMemory, filtered};
use super::stages::Build;
use crate::error::Result;
use crate::gpu::{Arena, Buffer, BufferRef, Gpu};
use crate::grid::MAX_LEVEL;
use crate::layout::{BuildStatus, Grid, wide};
use crate::options::BuildOptions;
use crate::reference::depth::{finer, too_large};
use crate::times::StageTimes;
use crate::tree::stored::{split_entries, split_slabs};
use crate::tree::{TreeArrays, TreeBytes};

/// An OLBVH in device memory.
#[derive(Debug)]
pub struct Tree {
    gpu: Gpu,
    mesh: KeptMesh,
    options: BuildOptions,
    memory: TreeMemory,
    status: BuildStatus,
    grid: Grid,
    times: StageTimes,
    scratch_bytes: u64,
    entry_buffer: Buffer,
    node_buffer: Buffer,
}

impl Tree {
    /// Builds a tree over a mesh in four submissions (three if every candidate is an entry, as with the paper's lists),
    /// not counting those that read numbers back where the host cannot do so itself. Between them the numbers of
    /// candidates, entries and nodes are read back, so that exactly the needed memory is allocated. If
    /// [`BuildOptions::fineness`] calls for a finer tree, that is built afterwards, provided there is memory for both, until
    /// none is finer.
    ///
    /// # Errors
    /// [`crate::Error::Invalid`] for α outside 0…10, a level beyond 10 or a mesh on another device,
    /// [`crate::Error::TooLarge`] if the tree does not fit 32-bit entries or the given capacity, [`crate::Error::Memory`]
    /// if it does not fit the device.
    pub fn build(gpu: &Gpu, mesh: &DeviceMesh, options: &BuildOptions) -> Result<Self> {
        let mut tree = Self::build_once(gpu, mesh, options)?;
        let mut room = MAX_LEVEL; // the finest level that fits the memory
        while let Some(finer) = tree.finer() {
            let level = finer.level.unwrap_or(MAX_LEVEL).min(room);
            if level <= tree.status.level {
                break;
            }
            match Self::build_once(gpu, mesh, &BuildOptions { level: Some(level), ..finer }) {
                Ok(finer) => {
                    tree.times.add(finer.times);
                    room = if finer.status.level < level { finer.status.level } else { room };
                    tree = Self { times: tree.times, ..finer };
                }
                Err(e) if e.is_lack_of_room() => room = level - 1,
                Err(e) => return Err(e),
            }
        }
        Ok(tree)
    }

    /// The options of a finer tree, if one suits better.
    fn finer(&self) -> Option<BuildOptions> {
        let BuildStatus { level, entries, leaves, .. } = self.status;
        finer(&self.options, level, u64::from(entries), u64::from(leaves), &candidates(&self.status))
    }

    fn build_once(gpu: &Gpu, mesh: &DeviceMesh, options: &BuildOptions) -> Result<Self> {
        mesh.check_device(gpu)?;
        let view = mesh.view();
        let tets = view.input.tets;
        let mut times = StageTimes::default();

        // First submission: the level, and the number of candidates.
        let (head, (status, grid)) = Arena::reserve(gpu, "olbvh.build.head", TreeMemory::carve_head)?;
        let (counts_buffer, counts) = Arena::reserve(gpu, "olbvh.build.counts", |a| CountScratch::carve(gpu, a, tets))?;
        let build = Build { mesh: &view, options, status, grid, counts: &counts, filter: None };
        let ((), time) = gpu.submit("olbvh.build.counts", |r| {
            // Without a filter, every candidate is an entry.
            build.depth(r, if filtered(options) { u32::MAX } else { MAX_ENTRIES }, MAX_LEVEL)?;
            build.count(r)
        })?;
        times.add(time);
        let measured: BuildStatus = gpu.download_one(&head, status)?;
        refuse_overflow(&measured, options)?;
        let level = measured.level;
        let mut capacity = Capacity { candidates: measured.candidates, entries: measured.candidates, nodes: 0, level };

        // Second submission: which candidates are entries.
        let (filter_buffer, filter) =
            Arena::reserve(gpu, "olbvh.build.filter", |a| FilterScratch::carve(gpu, a, tets, options, &capacity))?;
        let build = Build { filter: filter.as_ref(), ..build };
        if let Some(filter) = &filter {
            let ((), time) = gpu.submit("olbvh.build.filter", |r| build.filter(r, false))?;
            times.add(time);
            capacity.entries = gpu.download_one(&filter_buffer, filter.entries)?;
        }

        // Third submission: codes, and the number of nodes. P is part of the tree; the rest is scratch memory.
        capacity.nodes = Capacity::for_entries(capacity.entries, level).nodes;
        let entry_buffer = gpu.buffer("olbvh.tree.p", 4 * u64::from(capacity.entries.max(4)))?;
        let (sorted_buffer, sorted) = Arena::reserve(gpu, "olbvh.build.scratch", |a| SortedScratch::carve(gpu, a, &capacity))?;
        let ((), time) = gpu.submit("olbvh.build.codes", |r| {
            build.codes(r, entry_buffer.all(), &capacity, &sorted)?;
            build.count_splits(r, &capacity, &sorted)
        })?;
        times.add(time);
        let planned: BuildStatus = gpu.download_one(&head, status)?;
        refuse_overflow(&planned, options)?;
        capacity.nodes = planned.nodes;

        // Fourth submission: the nodes.
        let carve_nodes = |a: &mut Arena| {
            let head = TreeMemory::carve_head(a)?;
            let sizes = [planned.nodes, planned.internal, planned.leaves].map(u64::from);
            TreeMemory::carve_nodes(a, head, entry_buffer.all(), sizes, &capacity, options)
        };
        let (node_buffer, memory) = Arena::reserve(gpu, "olbvh.tree.nodes", carve_nodes)?;
        let ((), time) = gpu.submit("olbvh.build.nodes", |r| {
            r.copy(status.part(0, size_of::<BuildStatus>() as u64), memory.status);
            r.copy(grid.part(0, size_of::<Grid>() as u64), memory.grid);
            r.barrier("head → splits");
            let build = Build { status: memory.status, grid: memory.grid, ..build };
            build.splits(r, &memory, &sorted)?;
            build.leaves(r, &memory, &sorted)?;
            build.slabs(r, &memory, &sorted)?;
            build.levels(r, &memory, &sorted)
        })?;
        times.add(time);
        let status: BuildStatus = gpu.download_one(&node_buffer, memory.status)?;
        refuse_overflow(&status, options)?;
        let grid: Grid = gpu.download_one(&node_buffer, memory.grid)?;
        let scratch_bytes = head.size() + counts_buffer.size() + filter_buffer.size() + sorted_buffer.size();
        Ok(Self {
            gpu: gpu.clone(),
            mesh: mesh.kept(),
            options: *options,
            memory,
            status,
            grid,
            times,
            scratch_bytes,
            entry_buffer,
            node_buffer,
        })
    }

    /// Reads the arrays back to host memory.
    ///
    /// # Errors
    /// A failed transfer.
    pub fn download(&self) -> Result<TreeArrays> {
        let words = |part: BufferRef, n: u64| self.gpu.download::<u32>(&self.node_buffer, part.part(0, 4 * n));
        let (nodes, internal) = (u64::from(self.status.nodes), u64::from(self.status.internal));
        let boxes = match self.memory.boxes {
            Some(part) => Some(self.gpu.download(&self.node_buffer, part.part(0, 24 * nodes))?),
            None => None,
        };
        let entries = self.gpu.download(&self.entry_buffer, self.memory.p.part(0, 4 * u64::from(self.status.entries)))?;
        let (p, quarters) = split_entries(entries, &self.grid);
        let leaves = u64::from(self.status.leaves);
        let behind_po = if self.memory.slabs { leaves } else { 0 };
        let (po, slabs) = split_slabs(words(self.memory.po, leaves + 1 + behind_po)?, leaves as usize);
        Ok(TreeArrays {
            assign: self.options.assign,
            lists: self.options.lists,
            grid: self.grid,
            p,
            quarters,
            po,
            slabs,
            co: words(self.memory.co, internal + 1)?,
            no: self.status.levels[..=self.status.level as usize].to_vec(),
            flags: words(self.memory.flags, nodes.div_ceil(32))?,
            masks: words(self.memory.masks, nodes.div_ceil(4))?,
            boxes,
        })
    }

    /// The device that the tree lies on.
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// The mesh that the tree was built over, whose memory the tree keeps.
    pub fn mesh(&self) -> MeshView {
        self.mesh.view
    }

    /// The arrays in device memory.
    pub fn memory(&self) -> &TreeMemory {
        &self.memory
    }

    /// The sizes of the tree and the outcome of the build.
    pub fn status(&self) -> &BuildStatus {
        &self.status
    }

    /// The grid with the level of the leaves.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// The options that the tree was built with.
    pub fn options(&self) -> &BuildOptions {
        &self.options
    }

    /// What the build took, coarser trees before this one included.
    pub fn times(&self) -> &StageTimes {
        &self.times
    }

    /// Bytes of each array.
    pub fn sizes(&self) -> TreeBytes {
        let BuildStatus { entries, nodes, internal, level, .. } = self.status;
        TreeBytes::new(u64::from(entries), u64::from(nodes), u64::from(internal), level, self.options.boxes, self.memory.slabs)
    }

    /// Bytes of scratch memory that the build used in addition to the tree.
    pub fn scratch_bytes(&self) -> u64 {
        self.scratch_bytes
    }
}

/// The number of `Aabb` entries on every level.
fn candidates(status: &BuildStatus) -> [u64; 11] {
    std::array::from_fn(|k| wide([status.total[2 * k], status.total[2 * k + 1]]))
}

fn refuse_overflow(status: &BuildStatus, options: &BuildOptions) -> Result<()> {
    if status.overflow != 0 {
        return Err(too_large(&candidates(status), options));
    }
    Ok(())
}
