//! Conservative slicing (SPEC 3.4): value, kind and owner of every voxel. Twin of `glsl/query/slice_locate` and
//! `slice_touch`.

use super::boundary::Topology;
use super::leaf_walk::{meets, reached_cells, walk_leaves};
use super::locate::{Location, Locator};
use super::separate::{Closest, box_square, box_touches, closest, touch_slack};
use super::tet::{Tet, Vec3, sub};
use super::walk::Stand;
use crate::error::Result;
use crate::grid::CellRange;
use crate::layout::constants::slice_locate::WALK;
use crate::layout::{NONE, SliceUniforms};
use crate::mesh::{Field, Mesh, On};
use crate::slicing::{Band, EMPTY, Extrapolate, INSIDE, Rows, TOUCHED, VoxelGrid};
use crate::tree::TreeArrays;
use rayon::prelude::*;
use std::ops::Range;

/// Slices one mesh.
pub struct Slicer<'a> {
    mesh: &'a Mesh,
    topology: &'a Topology,
    tree: &'a TreeArrays,
    locator: Locator<'a>,
    normalised: Vec<Vec3>,
    field: Option<&'a Field>,
    extrapolate: Extrapolate,
    voxels: VoxelGrid,
    plan: SliceUniforms,
    part: CellRange,
}

/// The result for one voxel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Voxel {
    /// Value; NaN if the voxel is empty or there is no field.
    pub value: f32,
    /// [`EMPTY`], [`TOUCHED`] or [`INSIDE`].
    pub kind: u8,
    /// The tetrahedron that contains the centre, or that is nearest to it, or [`NONE`].
    pub owner: u32,
}

const NOTHING: Voxel = Voxel { value: f32::NAN, kind: EMPTY, owner: NONE };

impl<'a> Slicer<'a> {
    /// Prepares slicing of `mesh` into these voxels. `tree` must have been built over the mesh.
    ///
    /// # Errors
    /// [`crate::Error::Invalid`] as [`VoxelGrid::check_over`].
    pub fn new(
        mesh: &'a Mesh,
        topology: &'a Topology,
        tree: &'a TreeArrays,
        field: Option<&'a Field>,
        voxels: VoxelGrid,
        extrapolate: Extrapolate,
    ) -> Result<Self> {
        voxels.check_over(&tree.grid)?;
        let plan = voxels.over(&tree.grid);
        let normalised = mesh.points.par_iter().map(|&p| tree.grid.normalise(p)).collect();
        Ok(Self {
            mesh,
            topology,
            tree,
            locator: Locator::new(mesh, topology, tree),
            normalised,
            field,
            extrapolate,
            voxels,
            plan,
            part: CellRange::WHOLE,
        })
    }

    /// Restricts slicing to these cells of the finest grid: centres in other cells, and the lists there, belong to
    /// other blocks.
    #[must_use]
    pub fn within(self, part: CellRange) -> Self {
        Self { part, ..self }
    }

    /// The voxels of these rows.
    pub fn band(&self, rows: Rows) -> Band {
        let [width, height] = self.voxels.size;
        let runs = rows.runs(height);
        let columns: Vec<Vec<Voxel>> =
            (0..runs * width).into_par_iter().map(|i| self.run(rows, i % width, rows.run(i / width, height))).collect();
        let row_of = |run: u32, k: usize| columns[(run * width) as usize..][..width as usize].iter().map(move |column| column[k]);
        let all = || (0..runs).flat_map(move |run| (0..rows.run(run, height).len()).flat_map(move |k| row_of(run, k)));
        let (values, kinds) = (all().map(|v| v.value).collect(), all().map(|v| v.kind).collect());
        Band { rows, values, kinds, owners: all().map(|v| v.owner).collect() }
    }

    /// The voxels of a run, at column `x` of the rows `lines`. Centres are located one after the other, each first
    /// around the owner of the one before. Voxels with their centre outside are decided by their boxes.
    fn run(&self, rows: Rows, x: u32, lines: Range<u32>) -> Vec<Voxel> {
        let mut hint = NONE;
        lines
            .map(|row| {
                let [y, layer] = rows.row(row, self.voxels.size[1]);
                let centre = self.voxels.centre([x, y, layer]);
                if !self.part.contains(self.tree.grid.quantize(centre)) {
                    return self.touched(centre);
                }
                let location = self.locator.stride_to(centre, hint, WALK).unwrap_or_else(|| self.locator.locate(centre));
                hint = location.owner;
                match location.found() {
                    Some(owner) => Voxel { value: self.value(owner, centre), kind: INSIDE, owner },
                    None => self.touched(centre),
                }
            })
            .collect()
    }

    /// The value of a voxel whose centre lies in the mesh.
    fn value(&self, owner: u32, centre: [f32; 3]) -> f32 {
        let (field, stand) = (self.field, self.locator.walker().stand_in(owner));
        let at = |(field, stand): (&Field, Stand)| stand.value(field, stand.sides(self.tree.grid.normalise(centre)).barycentric());
        field.zip(stand).map_or(f32::NAN, at)
    }

    /// The tetrahedron `t`, and its vertices relative to a point, in normalised coordinates.
    fn around(&self, t: u32, x: Vec3) -> (Tet, [Vec3; 4]) {
        let tet = Tet::new(self.mesh.tets[t as usize], &self.normalised);
        (tet, tet.v.map(|v| sub(v, x)))
    }

    /// The result for a voxel whose centre is in no tetrahedron.
    fn touched(&self, centre: [f32; 3]) -> Voxel {
        let three = |v: [f32; 4]| [v[0], v[1], v[2]];
        let grid = &self.tree.grid;
        let Some(cells) = reached_cells(grid, centre, three(self.plan.reach)).and_then(|cells| cells.common(&self.part)) else {
            return NOTHING;
        };
        let x = grid.normalise(centre);
        let half = [self.plan.half0, self.plan.half1, self.plan.half2].map(three);
        let mut best = (f32::MAX, NONE);
        let enters = |node: super::traverse::Node| self.tree.is_boundary(node.index) && meets(node, &cells);
        walk_leaves(self.tree, enters, |leaf| {
            for &t in self.tree.tets(leaf.index) {
                if self.topology.is_boundary(t) {
                    let (_, v) = self.around(t, x);
                    let closer = touching(&v, &half, best.0).filter(|&square| square < best.0 || t < best.1);
                    best = closer.map_or(best, |square| (square, t));
                }
            }
            false
        });
        if best.1 == NONE { NOTHING } else { Voxel { value: self.extrapolated(best.1, x), kind: TOUCHED, owner: best.1 } }
    }

    /// The value that tetrahedron `t` gives to a voxel with its centre at `x`.
    fn extrapolated(&self, t: u32, x: Vec3) -> f32 {
        let (Some(field), (tet, v)) = (self.field, self.around(t, x)) else { return f32::NAN };
        let weights = tet.weights(x);
        let solid = weights.sum > 0.0 && tet.volume() != 0.0;
        let linear = self.extrapolate == Extrapolate::Linear && field.on == On::Points && solid;
        let barycentric = if linear {
            weights.barycentric(tet.rank)
        } else {
            let Closest { weights, .. } = closest(&v);
            tet.rank.map(|r| weights[r])
        };
        Location { owner: t, barycentric }.value(self.mesh, field)
    }
}

/// The squared distance from the centre of a box (at 0) to the tetrahedron `v`, if this touches the box and is not
/// farther away than `most`.
pub fn touching(v: &[Vec3; 4], half: &[Vec3; 3], most: f32) -> Option<f32> {
    let near = box_square(v) <= most && box_touches(v, half, touch_slack(v, half));
    near.then(|| closest(v).square).filter(|&square| square <= most)
}
