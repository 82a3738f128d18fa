//! Nodes and elements of an Abaqus input file, by parts, and their assembly to a mesh.

use std::collections::{HashMap, HashSet};

use glam::{DQuat, DVec3};

use super::super::array::Array;
use super::super::assemble::Assembly;
use super::super::cells::{CellType, vtk};
use super::super::report::Fate;
use super::super::source::Source;
use super::super::tags::Tags;
use crate::error::Result;
use crate::mesh::On;

/// A type of elements.
#[derive(Clone, Copy)]
pub(super) struct Element {
    /// `None`: elements that are only counted, under `name`.
    pub kind: Option<CellType>,
    /// Number of nodes in the file.
    pub nodes: usize,
    name: &'static str,
    fate: Fate,
}

/// What precedes `3D` in the names of solids: stress, heat, acoustic, convection, coupled, Eulerian, fluid, cohesive.
const SOLIDS: [&str; 8] = ["C", "DC", "AC", "DCC", "Q", "EC", "F", "COH"];
/// What precedes it in those of points, lines and surfaces: truss, rigid, membrane, connector, pipe, particle and so on.
const FLAT: [&str; 15] = ["T", "R", "RB", "M", "SFM", "CONN", "DCOUP", "JOINT", "DRAG", "FRAME", "FP", "FPC", "PC", "PD", "ACIN"];
/// What precedes it in the names of solids that are not read; any other may be one as well.
const UNREAD: [(&str, &str); 5] = [
    ("GK", "gasket element"),
    ("FC", "element of fluid dynamics"),
    ("EMC", "electromagnetic element"),
    ("COD", "coupled cohesive element"),
    ("CIN", "infinite element"),
];

impl Element {
    /// The type of this name, such as `C3D10M`.
    pub fn of(name: &str) -> Self {
        let name = name.to_uppercase();
        let (family, rest) = name.split_once("3D").unwrap_or_default();
        let is_solid = SOLIDS.contains(&family);
        // Some shells are described like solids.
        let shell = name.strip_prefix("SC").or_else(|| name.strip_prefix("CSS"));
        let rest = if family.is_empty() { shell.unwrap_or_default() } else { rest };
        let digits = rest.find(|c: char| !c.is_ascii_digit()).unwrap_or(rest.len());
        let nodes = rest[..digits].parse().unwrap_or(0);
        // The order of nodes is that of VTK.
        let number = match nodes {
            // A tetrahedron in CalculiX, the surface of a cavity in Abaqus.
            4 if family == "F" => -1,
            4 => 10,
            5 => 14,
            6 => 13,
            8 => 12,
            10 => 24,
            13 => 27,
            15 => 26,
            20 | 27 => 25,
            _ => -1,
        };
        let kind = if is_solid || family.is_empty() { vtk(number) } else { None };
        // Lines and triangles have up to three nodes, and an L in the name those of gaskets.
        let flat = family.is_empty() || FLAT.contains(&family) || (1..4).contains(&nodes) || rest.contains('L');
        let (name, fate) = if flat {
            ("element without volume", Fate::Boundary)
        } else if family == "F" {
            ("element F3D4 or the like", Fate::Unsupported)
        } else {
            let known = UNREAD.iter().find(|(unread, _)| *unread == family);
            (known.map_or("element of an unknown type", |(_, name)| name), Fate::Unsupported)
        };
        Self { kind, nodes, name, fate }
    }
}

/// Elements of one type.
pub(super) struct Block {
    pub element: Element,
    set: Option<String>,
    pub count: usize,
    /// Numbers of the elements, and of the nodes of each.
    tags: Vec<i64>,
    nodes: Vec<i64>,
}

impl Block {
    pub fn new(element: Element, set: Option<&str>) -> Self {
        Self { element, set: set.map(str::to_uppercase), count: 0, tags: Vec::new(), nodes: Vec::new() }
    }

    /// Adds an element: its number, then its nodes.
    pub fn add(&mut self, numbers: &[i64]) {
        self.count += 1;
        self.tags.push(numbers[0]);
        self.nodes.extend(&numbers[1..]);
    }
}

/// The nodes and elements of the model itself, a part, or an instance.
#[derive(Default)]
pub(super) struct Body {
    pub tags: Vec<i64>,
    pub points: Vec<[f64; 3]>,
    pub blocks: Vec<Block>,
}

/// A part at a place.
pub(super) struct Instance {
    /// The part, and what the instance adds.
    bodies: [usize; 2],
    shift: DVec3,
    /// Two points of an axis, and a rotation about it.
    turn: Option<(DVec3, DQuat)>,
}

impl Instance {
    pub fn new(bodies: [usize; 2]) -> Self {
        Self { bodies, shift: DVec3::ZERO, turn: None }
    }

    /// Takes a line of data: first a shift, then two points of an axis and an angle in degrees. False if it is neither.
    pub fn place(&mut self, lines: usize, numbers: &[f64]) -> bool {
        match (lines, numbers) {
            (0, &[x]) => self.shift = DVec3::new(x, 0.0, 0.0),
            (0, &[x, y]) => self.shift = DVec3::new(x, y, 0.0),
            (0, &[x, y, z]) => self.shift = DVec3::new(x, y, z),
            (1, &[ax, ay, az, bx, by, bz, degrees]) => {
                let (a, b) = (DVec3::new(ax, ay, az), DVec3::new(bx, by, bz));
                let Some(axis) = (b - a).try_normalize() else { return false };
                self.turn = Some((a, DQuat::from_axis_angle(axis, degrees.to_radians())));
            }
            _ => return false,
        }
        true
    }

    /// Where a point of the part is: the shift comes before the rotation.
    fn moved(&self, point: [f64; 3]) -> [f64; 3] {
        let shifted = DVec3::from_array(point) + self.shift;
        self.turn.map_or(shifted, |(a, turn)| a + turn * (shifted - a)).to_array()
    }
}

/// The bodies of a file; the first is the model itself.
pub(super) struct Model {
    pub bodies: Vec<Body>,
    pub parts: HashMap<String, usize>,
    pub instances: Vec<Instance>,
}

impl Default for Model {
    fn default() -> Self {
        Self { bodies: vec![Body::default()], parts: HashMap::new(), instances: Vec::new() }
    }
}

impl Model {
    /// A node, by its body and its place there, that has the number of an earlier one at another place. The same place again
    /// is no contradiction.
    pub fn node_given_twice(&self) -> Option<[usize; 2]> {
        let added = self.instances.iter().map(|instance| instance.bodies.to_vec());
        let added = added.filter(|bodies| !self.bodies[bodies[1]].tags.is_empty());
        (0..self.bodies.len()).map(|body| vec![body]).chain(added).find_map(|bodies| {
            let places = |&body: &usize| (0..self.bodies[body].tags.len()).map(move |i| [body, i]);
            let nodes: Vec<[usize; 2]> = bodies.iter().flat_map(places).collect();
            let tags: Vec<i64> = nodes.iter().map(|&[body, i]| self.bodies[body].tags[i]).collect();
            let first = Tags::new(&tags, true).ok()?;
            let point = |[body, i]: [usize; 2]| self.bodies[body].points[i];
            let is_moved = |earlier: [usize; 2], node| earlier != node && point(earlier) != point(node);
            let at = nodes.iter().zip(&tags).position(|(&node, &tag)| first.get(tag).is_some_and(|i| is_moved(nodes[i as usize], node)));
            at.map(|i| nodes[i])
        })
    }

    /// Adds the model, and the instances of its parts, or else the parts.
    pub fn assemble(mut self, source: &Source, assembly: &mut Assembly) -> Result<()> {
        if self.instances.is_empty() {
            let mut parts: Vec<usize> = self.parts.values().copied().collect();
            parts.sort_unstable();
            self.instances = parts.into_iter().map(|part| Instance::new([part, part])).collect();
        }
        let itself = Instance::new([0, 0]);
        let placed: Vec<&Instance> = [&itself].into_iter().chain(&self.instances).collect();
        let bodies = |instance: &Instance| if instance.bodies[0] == instance.bodies[1] { 1 } else { 2 };
        let mut points = Vec::new();
        let mut starts = Vec::new();
        for &instance in &placed {
            starts.push(points.len());
            for &body in &instance.bodies[..bodies(instance)] {
                points.extend(self.bodies[body].points.iter().map(|&point| instance.moved(point)));
            }
        }
        if self.instances.is_empty() {
            assembly.point_tags.clone_from(&self.bodies[0].tags);
        }
        assembly.set_points(points);
        let mut sets = Sets::default();
        for (&instance, &start) in placed.iter().zip(&starts) {
            let bodies: Vec<&Body> = instance.bodies[..bodies(instance)].iter().map(|&body| &self.bodies[body]).collect();
            let tags: Vec<i64> = bodies.iter().flat_map(|body| &body.tags).copied().collect();
            let nodes = Tags::new(&tags, true).map_err(|tag| source.error(format!("two nodes have the number {tag}")))?;
            for block in bodies.iter().flat_map(|body| &body.blocks) {
                block.push(source, assembly, &nodes, start)?;
                sets.add(block);
            }
        }
        sets.give(assembly);
        Ok(())
    }
}

impl Block {
    /// Adds the elements, whose nodes are found by their numbers from point number `start` on.
    fn push(&self, source: &Source, assembly: &mut Assembly, nodes: &Tags, start: usize) -> Result<()> {
        let Some(kind) = self.element.kind else {
            (0..self.count).for_each(|_| assembly.skip(self.element.name, self.element.fate));
            return Ok(());
        };
        assembly.reserve(self.count);
        let mut found = Vec::with_capacity(self.element.nodes);
        for (tag, cell) in self.tags.iter().zip(self.nodes.chunks_exact(self.element.nodes)) {
            found.clear();
            // The 27th node and those of faces have an order of their own.
            for &node in &cell[..kind.nodes.unwrap_or(cell.len()).min(cell.len())] {
                let place = nodes.get(node).map(|place| start as i64 + i64::from(place));
                found.push(place.ok_or_else(|| source.error_in(format!("element {tag}"), format!("node {node} does not exist")))?);
            }
            assembly.push(kind, &found)?;
        }
        Ok(())
    }
}

/// The set that each element is in by its keyword, as a number from 1; 0: none. Elements that are left out do not count.
#[derive(Default)]
struct Sets {
    names: Vec<String>,
    /// The numbers of elements that are read.
    used: HashSet<usize>,
    values: Vec<f64>,
}

impl Sets {
    fn add(&mut self, block: &Block) {
        let is_read = block.element.kind.is_some() && block.count > 0;
        let number = block.set.as_ref().filter(|_| is_read).map_or(0, |set| {
            let known = self.names.iter().position(|name| name == set);
            1 + known.unwrap_or_else(|| {
                self.names.push(set.clone());
                self.names.len() - 1
            })
        });
        if is_read {
            self.used.insert(number);
        }
        self.values.resize(self.values.len() + block.count, number as f64);
    }

    /// Makes a field of cells of them, if there are several.
    fn give(self, assembly: &mut Assembly) {
        if self.used.len() > 1 {
            assembly.arrays.push(Array::whole("elset".into(), On::Cells, &self.values));
        }
    }
}
