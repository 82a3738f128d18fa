//! The whole construction, as described in section 3.2 of the paper. Twin of `src/build`.

use super::boundary::Topology;
use super::codes::Stage;
use super::marks::Marks;
use super::vertices::Vertices;
use super::{depth, leaves, levels, quarters, slabs};
use crate::error::{Error, Result};
use crate::grid::{Grid, MAX_LEVEL};
use crate::mesh::Mesh;
use crate::options::{BuildOptions, Lists};
use crate::tree::TreeArrays;
use crate::tree::stored::ids_in;

/// A tree, and the intermediate results that its arrays do not contain.
#[derive(Clone, Debug)]
pub struct Construction {
    /// Morton codes of the entries, sorted; [`TreeArrays::p`] holds their tetrahedra.
    pub codes: Vec<u32>,
    /// The tree.
    pub tree: TreeArrays,
}

/// Builds the tree over the valid tetrahedra of `mesh`. `topology` is that of the mesh, computed by stage 0 (bounds and
/// boundary marking, see [`super::boundary::topology`]).
///
/// # Errors
/// [`Error::Invalid`] if α is not in 0…10 or the topology is that of another mesh; [`Error::TooLarge`] if the entries
/// do not fit the capacity or the budget even in a single node, or 32 bits cannot count them.
pub fn build(mesh: &Mesh, topology: &Topology, options: &BuildOptions) -> Result<TreeArrays> {
    if topology.neighbours.len() != mesh.tets.len() {
        let (of, is) = (topology.neighbours.len(), mesh.tets.len());
        return Err(Error::Invalid(format!("the topology is of a mesh of {of} tetrahedra, this mesh has {is}")));
    }
    let vertices = Vertices::new(mesh, &topology.grid);

    // Stage 1: determine the depth of the tree.
    let sizes = depth::measure(mesh, topology, &vertices);
    let at = |level: u32, options: &BuildOptions| Ok(construct(mesh, topology, &vertices, level, options)?.tree);

    let mut tree = at(sizes.level(options)?, options)?;
    let finer = |tree: &TreeArrays| {
        let (entries, leaves) = (tree.p.len() as u64, tree.leaves().len() as u64);
        depth::finer(options, tree.grid.level, entries, leaves, &sizes.entries)
    };
    while let Some(finer) = finer(&tree) {
        tree = at(finer.level.unwrap_or(MAX_LEVEL), &finer)?;
    }
    Ok(tree)
}

/// Stages 2 to 4: builds the tree whose leaves are cells of `level`, regardless of α and the limits in `options`.
///
/// # Errors
/// [`Error::TooLarge`] if 32 bits cannot count the entries.
pub fn construct(mesh: &Mesh, topology: &Topology, vertices: &Vertices, level: u32, options: &BuildOptions) -> Result<Construction> {
    let grid = Grid { level, ids: ids_in(&topology.grid, options.lists, mesh.tets.len()), ..topology.grid };

    // Stage 2: calculate and sort the Morton codes of the entries.
    let all = Stage { mesh, topology, vertices, grid: &grid, assign: options.assign, marks: None };
    let marks = (options.lists == Lists::Boundary).then(|| Marks::new(&all));
    let stage = Stage { marks: marks.as_ref(), ..all };
    let counts = stage.count();
    let entries = stage.emit(&counts)?.sorted(level);

    // Stage 3: record at which levels the codes split.
    let splits = super::splits::splits(&entries.codes, level);

    // Stage 4: construct the nodes bottom-up.
    let leaf_flags = leaves::flags(&entries.primitives, &splits, options.lists, mesh, topology, vertices, &grid);
    let quarters = quarters::quarters(&entries.codes, &entries.primitives, &grid, mesh, vertices);
    let octants = leaves::masks(&splits, &leaf_flags, &quarters, &grid);
    let slabs = if options.has_slabs() {
        slabs::slabs(&entries.primitives, &splits, &leaf_flags, mesh, topology, vertices, &grid)
    } else {
        Vec::new()
    };
    let flags = levels::flags(leaf_flags, &splits);
    let boxes = options.boxes.then(|| levels::boxes(leaves::boxes(&splits, &grid), &splits));
    let masks = levels::masks(&octants, &splits);
    let (p, po, co, no) = (entries.primitives, splits.po, splits.co, splits.no);
    let slabs_at = if slabs.is_empty() { 0 } else { po.len() as u32 };
    let grid = Grid { first_leaf: co.len() as u32 - 1, slabs: slabs_at, longest: leaves::longest_list(&po), ..grid };
    let tree = TreeArrays { assign: options.assign, lists: options.lists, grid, p, quarters, po, slabs, co, no, flags, masks, boxes };
    Ok(Construction { codes: entries.codes, tree })
}
