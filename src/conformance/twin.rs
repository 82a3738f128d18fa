//! Trees and answers of the reference implementation over one mesh, cached while cases need them: most cases differ in
//! how the device computes, not in what it should find.

use super::failure::{Stop, Verdict};
use super::meshes::MeshRecipe;
use super::points::points;
use super::tangles::overlap;
use crate::mesh::Mesh;
use crate::options::{Assign, BuildOptions, Lists};
use crate::reference::boundary::{Topology, topology};
use crate::reference::build::{Construction, construct};
use crate::reference::depth::{Sizes, measure};
use crate::reference::locate::{Location, Locator};
use crate::reference::vertices::Vertices;
use crate::tree::TreeArrays;
use std::collections::HashMap;
use std::sync::{Arc, OnceLock};

/// What determines a tree over a given mesh: assignment, lists, level.
type Kind = (Assign, Lists, u32);

/// A mesh and what the reference implementation has computed for it.
#[derive(Debug)]
pub(crate) struct Twin {
    /// Name of the mesh.
    pub name: &'static str,
    /// The mesh.
    pub mesh: Mesh,
    /// Topology of the mesh.
    pub topology: Topology,
    /// Sizes from which the depth is chosen.
    pub sizes: Sizes,
    /// Vertices of the mesh in the grid.
    pub vertices: Vertices,
    /// The difference between trees that the running case has accepted, and why.
    pub accepted: Option<String>,
    trees: HashMap<Kind, Arc<Built>>,
    points: OnceLock<(Vec<[f32; 3]>, usize)>,
}

/// A tree of the reference implementation.
#[derive(Debug)]
pub(crate) struct Built {
    /// The tree, including boxes, and its sorted codes.
    pub made: Construction,
    locations: OnceLock<Vec<Location>>,
}

impl Built {
    /// The tree's arrays.
    pub fn tree(&self) -> &TreeArrays {
        &self.made.tree
    }
}

impl Twin {
    pub(crate) fn new(recipe: &MeshRecipe) -> Verdict<Self> {
        let mesh = recipe.mesh()?;
        let topology = topology(&mesh)?;
        let vertices = Vertices::new(&mesh, &topology.grid);
        let sizes = measure(&mesh, &topology, &vertices);
        let (trees, points) = (HashMap::new(), OnceLock::new());
        Ok(Self { name: recipe.name, mesh, topology, sizes, vertices, accepted: None, trees, points })
    }

    /// The tree with leaves at `level`; fails if the tree breaks a rule.
    pub(crate) fn built(&mut self, assign: Assign, lists: Lists, level: u32) -> Verdict<Arc<Built>> {
        let kind = (assign, lists, level);
        if let Some(built) = self.trees.get(&kind) {
            return Ok(built.clone());
        }
        let options = BuildOptions { assign, lists, boxes: true, slabs: true, ..BuildOptions::default() };
        let made = construct(&self.mesh, &self.topology, &self.vertices, level, &options)?;
        made.tree.validate(&self.mesh, &self.topology)?;
        let built = Arc::new(Built { made, locations: OnceLock::new() });
        self.trees.insert(kind, built.clone());
        Ok(built)
    }

    /// The tree for options without limits of size.
    pub(crate) fn tree(&mut self, options: &BuildOptions) -> Verdict<Arc<Built>> {
        let level = self.sizes.level(options)?;
        self.built(options.assign, options.lists, level)
    }

    /// Accepts a difference between trees if tetrahedra of the mesh overlap, since then only full lists always name the
    /// lowest-numbered tetrahedron that contains a point (SPEC 3.1).
    pub(crate) fn same_unless_tangled(&mut self, verdict: Verdict) -> Verdict {
        let Err(Stop::Failed(failure)) = verdict else { return verdict };
        if self.accepted.is_none() {
            self.accepted = overlap(&self.mesh, &self.topology, &self.vertices)?.map(|why| format!("{failure}; that may be, since {why}"));
        }
        if self.accepted.is_some() { Ok(()) } else { Err(Stop::Failed(failure)) }
    }

    /// Points to locate, and the number of those, from the first on, that lie in tetrahedra.
    pub(crate) fn points(&self) -> (&[[f32; 3]], usize) {
        let (all, inside) = self.points.get_or_init(|| points(&self.mesh));
        (all, *inside)
    }

    /// Locations of these points.
    pub(crate) fn locations<'a>(&self, built: &'a Built) -> &'a [Location] {
        built.locations.get_or_init(|| self.locator(built).locate_each(self.points().0))
    }

    /// The reference implementation of point location over a tree.
    pub(crate) fn locator<'a>(&'a self, built: &'a Built) -> Locator<'a> {
        Locator::new(&self.mesh, &self.topology, built.tree())
    }
}
