//! Checks the rules that every tree must satisfy (SPEC 2.5).

use super::boundary::Topology;
use super::codes::Stage;
use super::leaves::{cell_box, flag, longest_list, octants};
use super::levels::union;
use super::marks::Marks;
use super::quarters::quarters_near;
use super::slabs::Fit;
use super::vertices::Vertices;
use crate::error::{Error, Result};
use crate::grid::{MAX_LEVEL, unmorton};
use crate::layout::NONE;
use crate::mesh::Mesh;
use crate::options::Lists;
use crate::tree::stored::ids_in;
use crate::tree::{TreeArrays, TreeStats};
use rayon::prelude::*;

/// Outcome of a rule; the text says what is wrong, with indices.
type Rule = Result<(), String>;

/// Fails with `text` unless `holds`.
fn rule(holds: bool, text: impl FnOnce() -> String) -> Rule {
    if holds { Ok(()) } else { Err(text()) }
}

impl TreeArrays {
    /// Checks every rule of the data structure against the mesh that the tree was built over, and gathers statistics.
    /// Never panics, whatever the arrays contain.
    ///
    /// # Errors
    /// [`Error::BrokenTree`] with the first broken rule and the indices that break it; [`Error::Invalid`] if `topology`
    /// does not belong to `mesh`.
    pub fn validate(&self, mesh: &Mesh, topology: &Topology) -> Result<TreeStats> {
        if topology.neighbours.len() != mesh.tets.len() {
            let (of, is) = (topology.neighbours.len(), mesh.tets.len());
            return Err(Error::Invalid(format!("the topology is of a mesh of {of} tetrahedra, this mesh has {is}")));
        }
        let exists = |n: &u32| *n == NONE || (*n as usize) < mesh.tets.len();
        if !topology.neighbours.as_flattened().iter().all(exists) {
            return Err(Error::Invalid("the topology names neighbours that this mesh does not have".into()));
        }
        let rules = || -> Rule {
            self.check_grid(topology)?;
            self.check_lengths()?;
            self.check_levels()?;
            self.check_children()?;
            let codes = self.check_masks()?;
            self.check_offsets()?;
            self.check_lists(mesh, topology, &codes)?;
            self.check_flags(mesh, topology, &codes)?;
            self.check_boxes(&codes)
        };
        rules().map_err(Error::BrokenTree)?;
        Ok(self.stats())
    }

    /// The grid is that of the mesh.
    fn check_grid(&self, topology: &Topology) -> Rule {
        let level = self.grid.level;
        rule(level <= MAX_LEVEL, || format!("grid: level {level} is beyond {MAX_LEVEL}"))?;
        let mut expected = topology.grid;
        (expected.level, expected.first_leaf) = (level, self.grid.first_leaf);
        expected.ids = ids_in(&topology.grid, self.lists, topology.neighbours.len());
        expected.slabs = if self.slabs.is_empty() { 0 } else { self.po.len() as u32 };
        expected.longest = self.grid.longest;
        rule(self.grid == expected, || format!("grid: {:?} is not that of the mesh, {expected:?}", self.grid))
    }

    /// All arrays have the lengths that follow from NO; bits and bytes beyond the last node are 0.
    fn check_lengths(&self) -> Rule {
        let (level, nodes) = (self.grid.level as usize, self.nodes() as usize);
        rule(self.no.len() == level + 1, || format!("NO has {} levels, the grid {}", self.no.len(), level + 1))?;
        let internal = if level == 0 { 0 } else { self.no[level - 1] as usize };
        let first = self.grid.first_leaf;
        rule(first as usize == internal, || format!("the grid says that node {first} is the first leaf, NO that {internal} is"))?;
        let length =
            |name: &str, is: usize, needs: usize| rule(is == needs, || format!("{name} has {is} elements, {nodes} nodes need {needs}"));
        let quarters = if self.grid.ids == u32::MAX { 0 } else { self.p.len() };
        length("quarters", self.quarters.len(), quarters)?;
        length("PO", self.po.len(), (nodes + 1).saturating_sub(internal))?;
        let slabs = if self.slabs.is_empty() { 0 } else { nodes.saturating_sub(internal) };
        length("slabs", self.slabs.len(), slabs)?;
        length("CO", self.co.len(), internal + 1)?;
        length("BF", self.flags.len(), nodes.div_ceil(32))?;
        length("mask", self.masks.len(), nodes.div_ceil(4))?;
        length("BV", self.boxes.as_ref().map_or(nodes, Vec::len), nodes)?;
        let tail = |words: &[u32], used: usize| used == 0 || words.last().is_none_or(|w| w >> used == 0);
        rule(tail(&self.flags, nodes % 32), || format!("BF has bits past node {nodes}"))?;
        rule(tail(&self.masks, nodes % 4 * 8), || format!("mask has bits past node {nodes}"))
    }

    /// NO: there is one root; every level has at least one node, and at most 8 per node of the level above.
    fn check_levels(&self) -> Rule {
        rule(self.no[0] == 1, || format!("NO[0] = {}, there is one root", self.no[0]))?;
        let mut above = 1;
        for (k, pair) in self.no.windows(2).enumerate() {
            let here = i64::from(pair[1]) - i64::from(pair[0]);
            rule((1..=8 * above).contains(&here), || format!("NO[{}] = {} puts {here} nodes below {above}", k + 1, pair[1]))?;
            above = here;
        }
        Ok(())
    }

    /// CO: every internal node has 1 to 8 children, which are contiguous; the children of a level's nodes are exactly
    /// the next level.
    fn check_children(&self) -> Rule {
        rule(self.co[0] == 0, || format!("CO[0] = {}, children begin at node 1", self.co[0]))?;
        for (i, pair) in self.co.windows(2).enumerate() {
            let n = i64::from(pair[1]) - i64::from(pair[0]);
            rule((1..=8).contains(&n), || format!("node {i} has {n} children: CO[{i}] = {}, CO[{}] = {}", pair[0], i + 1, pair[1]))?;
        }
        for pair in self.no.windows(2) {
            let (last, end) = (pair[0] as usize, self.co[pair[0] as usize]);
            rule(end == pair[1] - 1, || format!("CO[{last}] = {end}, but the level of its children ends at node {}", pair[1] - 1))?;
        }
        Ok(())
    }

    /// The masks of internal nodes match their numbers of children. Returns the Morton codes of all nodes, which have
    /// their parents' codes as prefixes by construction, after checking that they ascend on each level.
    fn check_masks(&self) -> Result<Vec<u32>, String> {
        let mut codes = vec![0; self.nodes() as usize];
        for i in 0..self.internal_nodes() {
            let (mask, children) = (self.child_mask(i), self.children(i));
            let n = children.len() as u32;
            rule(mask.count_ones() == n, || format!("mask of node {i} is {mask:#010b}, it has {n} children"))?;
            for (child, digit) in children.zip((0..8).filter(|d| mask >> d & 1 != 0)) {
                codes[child as usize] = codes[i as usize] << 3 | digit;
            }
        }
        for level in 0..=self.grid.level {
            for j in self.level_nodes(level).skip(1).map(|j| j as usize) {
                let (a, b) = (codes[j - 1], codes[j]);
                rule(a < b, || format!("nodes {} and {j} on level {level} have codes {a:#o} and {b:#o}, not ascending", j - 1))?;
            }
        }
        Ok(codes)
    }

    /// PO: offsets ascend over the leaves, up to the number of entries; the grid knows the longest list.
    fn check_offsets(&self) -> Rule {
        let n_m = self.p.len() as u64;
        rule(self.po[0] == 0, || format!("PO[0] = {}, entries begin at 0", self.po[0]))?;
        for (i, pair) in self.po.windows(2).enumerate() {
            let (begin, end) = (pair[0], pair[1]);
            let room = end > begin || (n_m == 0 && end == 0 && self.nodes() == 1);
            let leaf = self.leaves().start + i as u32;
            rule(room, || format!("PO[{}] = {end}: leaf {leaf} has no entry, the one before ends at {begin}", i + 1))?;
        }
        let end = self.po[self.po.len() - 1];
        rule(u64::from(end) == n_m, || format!("the leaves end at entry {end}, P has {n_m} entries"))?;
        let (told, longest) = (self.grid.longest, longest_list(&self.po));
        rule(told == longest, || format!("the grid says that the longest list has {told} entries, PO that it has {longest}"))
    }

    /// P and the quarters of its entries: ids ascend in every leaf, and the entries are exactly the pairs of
    /// tetrahedron and cell of the assignment. Each entry belongs to the assignment, and without duplicates as many
    /// entries as pairs means that every pair occurs once.
    fn check_lists(&self, mesh: &Mesh, topology: &Topology, codes: &[u32]) -> Rule {
        let vertices = Vertices::new(mesh, &self.grid);
        let all = Stage { mesh, topology, vertices: &vertices, grid: &self.grid, assign: self.assign, marks: None };
        let marks = (self.lists == Lists::Boundary).then(|| Marks::new(&all));
        let stage = Stage { marks: marks.as_ref(), ..all };
        let check = |leaf: u32| -> Rule {
            let (slots, cell) = (self.entries(leaf), unmorton(codes[leaf as usize]));
            let list = &self.p[slots.clone()];
            for (i, &p) in list.iter().enumerate() {
                let at = || format!("P[{}] = {p} in leaf {leaf}, cell {cell:?}", slots.start + i);
                rule(topology.is_valid(p), || format!("{}: no valid cell of the mesh", at()))?;
                rule(i == 0 || list[i - 1] < p, || format!("{}: not above the {} before it", at(), list[i - 1]))?;
                let ids = mesh.tets[p as usize];
                let belongs = vertices.cells(ids, self.grid.level).contains(cell) && stage.lists(p)(cell);
                rule(belongs, || format!("{}: by the assignment {} it does not belong there", at(), self.assign))?;
                let found = self.quarters.get(slots.start + i).map(|&quarters| u32::from(quarters));
                let expected = quarters_near(&self.grid, codes[leaf as usize], &vertices.cells(ids, MAX_LEVEL));
                rule(found.is_none_or(|quarters| quarters == expected), || format!("{}: near quarters {found:?}, not {expected}", at()))?;
            }
            Ok(())
        };
        self.leaves().into_par_iter().map(check).find_map_first(Result::err).map_or(Ok(()), Err)?;
        let pairs: u64 = stage.count().into_par_iter().map(u64::from).sum();
        let n_m = self.p.len();
        rule(pairs == n_m as u64, || format!("P has {n_m} entries, the assignment {} makes {pairs}", self.assign))
    }

    /// BF: a leaf's flag is 0 if one of its tetrahedra touches its cell and none is a boundary tetrahedron; an internal
    /// node's flag is set if a child's is. Also checks the masks and slabs of the leaves.
    fn check_flags(&self, mesh: &Mesh, topology: &Topology, codes: &[u32]) -> Rule {
        let internal = self.internal_nodes();
        let vertices = Vertices::new(mesh, &self.grid);
        let fit = Fit { mesh, topology, vertices: &vertices, grid: &self.grid };
        let check = |j: u32| -> Rule {
            let expected = if j < internal {
                self.children(j).any(|c| self.is_boundary(c))
            } else {
                flag(self.tets(j), codes[j as usize], self.lists, mesh, topology, &vertices, &self.grid)
            };
            let what = if j < internal { "children" } else { "primitives" };
            rule(self.is_boundary(j) == expected, || format!("BF[{j}] = {}, its {what} say {expected}", !expected))?;
            if j < internal {
                return Ok(());
            }
            let (mask, octants) = (self.mask_of(j), octants(self.entries(j), expected, &self.quarters, &self.grid));
            rule(mask == octants, || format!("mask of leaf {j} is {mask:#010b}, its entries say {octants:#010b}"))?;
            let slab = self.slabs.get((j - internal) as usize).copied();
            let fitted = slab.map(|_| fit.slab(self.tets(j), expected, codes[j as usize]));
            rule(slab == fitted, || format!("slab of leaf {j} is {slab:x?}, its tetrahedra say {fitted:x?}"))
        };
        (0..self.nodes()).into_par_iter().map(check).find_map_first(Result::err).map_or(Ok(()), Err)
    }

    /// BV: a leaf's box is its cell's, an internal node's is the union of its children's, bit for bit.
    fn check_boxes(&self, codes: &[u32]) -> Rule {
        let Some(boxes) = &self.boxes else { return Ok(()) };
        let internal = self.internal_nodes();
        for (j, found) in boxes.iter().enumerate() {
            let expected = if (j as u32) < internal {
                self.children(j as u32).map(|c| boxes[c as usize]).reduce(union).unwrap_or_default()
            } else {
                cell_box(&self.grid, self.grid.level, codes[j])
            };
            let same = found.map(f32::to_bits) == expected.map(f32::to_bits);
            rule(same, || format!("BV[{j}] = {found:?}, expected {expected:?}"))?;
        }
        Ok(())
    }
}
