//! The meshes of the suite: procedural, seeded, and so small that a software device quickly builds a tree over each.

use super::Group;
use super::data::Random;
use crate::error::Result;
use crate::mesh::{Mesh, cases::axle, far_field, kuhn, kuhn_jittered};

/// A named mesh.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MeshRecipe {
    pub name: &'static str,
    pub group: Group,
    source: Source,
}

/// Where a mesh comes from.
#[derive(Clone, Copy, Debug)]
enum Source {
    Made(fn() -> Result<Mesh>),
    Given(&'static Mesh),
}

impl MeshRecipe {
    /// A mesh that does not belong to the suite.
    pub(crate) fn given(name: &str, mesh: Mesh) -> Self {
        let name = Box::leak(name.to_owned().into_boxed_str());
        Self { name, group: Group::Quick, source: Source::Given(Box::leak(Box::new(mesh))) }
    }

    /// Makes the mesh.
    pub(crate) fn mesh(&self) -> Result<Mesh> {
        match self.source {
            Source::Made(make) => make(),
            Source::Given(mesh) => Ok(mesh.clone()),
        }
    }
}

/// Name, group and constructor of a mesh.
type Entry = (&'static str, Group, fn() -> Result<Mesh>);

const UNIT: [[f32; 3]; 4] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

#[rustfmt::skip]
const RECIPES: &[Entry] = &[
    ("no-points", Group::Quick, || Ok(Mesh::default())),
    ("no-cells", Group::Quick, || of(&UNIT, &[])),
    ("one-tet", Group::Quick, || of(&UNIT, &[[0, 1, 2, 3]])),
    ("one-tet-negative", Group::Quick, || of(&UNIT, &[[1, 0, 2, 3]])),
    ("one-tet-shifted", Group::Full, || of(&UNIT.map(|p| p.map(|x| 0.1 - x * 0.3)), &[[3, 1, 0, 2]])),
    ("two-share-face", Group::Quick, || of(&with(&[[1.0, 1.0, 1.0]]), &[[0, 1, 2, 3], [4, 1, 2, 3]])),
    ("two-share-edge", Group::Quick, || of(&with(&[[1.0, 1.0, 0.2], [1.5, 0.9, 1.0]]), &[[0, 1, 2, 3], [4, 1, 2, 5]])),
    ("two-share-vertex", Group::Quick, || of(&with(&[[2.0, 0.0, 0.0], [1.0, 1.0, 0.2], [1.5, 0.9, 1.0]]), &[[0, 1, 2, 3], [4, 1, 6, 5]])),
    ("two-apart", Group::Quick, || of(&with(&UNIT.map(|p| p.map(|x| x + 3.0))), &[[0, 1, 2, 3], [4, 5, 6, 7]])),
    ("two-coincident-faces", Group::Full, || of(&with(&[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0; 3]]), &[[0, 1, 2, 3], [4, 5, 6, 7]])),
    ("three-on-a-face", Group::Quick, || of(&with(&[[1.0; 3], [0.4; 3]]), &[[0, 1, 2, 3], [4, 1, 2, 3], [5, 3, 2, 1]])),
    ("crowd-on-a-face", Group::Quick, || of(&with(&(0..300u16).map(f32::from).map(|i| [1.0 + i * 0.01, 0.5, 1.0 - i * 0.02]).collect::<Vec<_>>()), &(4..304).map(|i| [i, 1, 2, 3]).collect::<Vec<_>>())),
    ("fold", Group::Quick, || of(&with(&[[-0.5, 0.1, 0.2]]), &[[0, 1, 2, 3], [4, 3, 2, 1]])),
    ("coplanar", Group::Quick, || of(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0], [2.0, 2.0, 0.0]], &[[0, 1, 2, 3], [1, 2, 3, 4]])),
    ("collinear", Group::Quick, || of(&[[0.0; 3], [1.0; 3], [2.0; 3], [3.0; 3]], &[[0, 1, 2, 3]])),
    ("one-place", Group::Quick, || of(&[[2.0; 3]; 4], &[[0, 1, 2, 3], [3, 2, 1, 0]])),
    ("identical-1000", Group::Quick, || Ok(Mesh::new(UNIT.to_vec(), vec![[0, 1, 2, 3]; 1000]))),
    ("identical-boxes-2000", Group::Full, || Ok(Mesh::new(with(&UNIT.map(|p| p.map(|x| x + 9.0))), [[0, 1, 2, 3], [4, 5, 6, 7]].repeat(1000)))),
    ("bad-cells", Group::Quick, bad_cells),
    ("only-bad-cells", Group::Quick, || of(&with(&[[f32::NAN; 3]]), &[[0, 1, 2, 4], [0, 1, 1, 2], [0, 1, 2, 5], [9, 9, 9, 9]])),
    ("unused-nan-points", Group::Quick, unused_points),
    ("beyond-the-limit", Group::Full, || of(&with(&[[3e38, 0.0, 0.0], [4.2e37, 0.5, 0.5]]), &[[0, 1, 2, 3], [4, 1, 2, 3], [5, 1, 2, 3]])),
    ("kuhn-1x1x1", Group::Quick, || kuhn([1, 1, 1])),
    ("kuhn-5x3x7", Group::Quick, || kuhn([5, 3, 7])),
    ("kuhn-16x16x16", Group::Quick, || kuhn([16; 3])),
    ("kuhn-17x1x1", Group::Full, || kuhn([17, 1, 1])),
    ("jitter-12x13x11", Group::Quick, || kuhn_jittered([12, 13, 11], 0.4, 3)),
    ("jitter-24x24x24", Group::Full, || kuhn_jittered([24; 3], 0.45, 9)),
    ("tangled", Group::Quick, || kuhn_jittered([8, 7, 6], 1.7, 4)),
    ("scaled-1e30", Group::Quick, || scaled(1e30)),
    ("scaled-1e-30", Group::Quick, || scaled(1e-30)),
    ("scaled-1e-38", Group::Full, || scaled(1e-38)),
    ("scaled-1e-42", Group::Full, || scaled(1e-42)),
    ("scaled-7e-10", Group::Full, || scaled(7e-10)),
    ("scaled-1-1e12-1e-12", Group::Full, || moved([6; 3], |[x, y, z]| [x, y * 1e12, z * 1e-12])),
    ("far", Group::Quick, || moved([6; 3], |p| p.map(|x| x + 1e5))),
    ("far-1e7", Group::Full, || moved([6; 3], |p| p.map(|x| x - 1e7))),
    ("flat", Group::Quick, || moved([6; 3], |[x, y, _]| [x, y, 0.0])),
    ("plate", Group::Quick, || moved([20, 20, 1], |[x, y, z]| [x * 0.05, y * 0.05, z * 8e-6])),
    ("slivers", Group::Quick, slivers),
    ("huge-among-small", Group::Quick, huge_among_small),
    ("outlier-1e12", Group::Quick, outlier),
    ("far-field-8", Group::Quick, || far_field(8)),
    ("far-field-16", Group::Full, || far_field(16)),
    ("renumbered", Group::Quick, renumbered),
    ("signs-mixed", Group::Full, signs_mixed),
    ("cloud", Group::Quick, || cloud(500)),
    ("cloud-31", Group::Full, || cloud(31)),
    ("cloud-32", Group::Full, || cloud(32)),
    ("cloud-33", Group::Full, || cloud(33)),
    ("cloud-65", Group::Full, || cloud(65)),
    ("fan-700", Group::Full, || fan(700)),
    ("axle-40", Group::Full, || axle(40)),
];

/// All meshes of the suite.
pub(crate) fn recipes() -> impl Iterator<Item = MeshRecipe> {
    RECIPES.iter().map(|&(name, group, make)| MeshRecipe { name, group, source: Source::Made(make) })
}

/// The `Result` keeps the table above short.
#[allow(clippy::unnecessary_wraps)]
fn of(points: &[[f32; 3]], tets: &[[u32; 4]]) -> Result<Mesh> {
    Ok(Mesh::new(points.to_vec(), tets.to_vec()))
}

/// The vertices of the unit tetrahedron, followed by others.
fn with(more: &[[f32; 3]]) -> Vec<[f32; 3]> {
    [&UNIT, more].concat()
}

fn moved(cells: [u32; 3], place: fn([f32; 3]) -> [f32; 3]) -> Result<Mesh> {
    let mut mesh = kuhn_jittered(cells, 0.3, 1)?;
    mesh.points.iter_mut().for_each(|p| *p = place(*p));
    Ok(mesh)
}

fn scaled(by: f32) -> Result<Mesh> {
    let mut mesh = kuhn_jittered([6; 3], 0.3, 1)?;
    mesh.points.iter_mut().flatten().for_each(|x| *x *= by);
    Ok(mesh)
}

/// Every kind of bad cell, between good ones.
fn bad_cells() -> Result<Mesh> {
    let mut mesh = kuhn_jittered([4; 3], 0.3, 2)?;
    let n = mesh.points.len() as u32;
    mesh.points.extend([[f32::NAN, 0.0, 0.0], [0.0, f32::INFINITY, 0.0], [0.0, 0.0, f32::NEG_INFINITY], [3e38, 1.0, 1.0]]);
    for (i, cell) in mesh.tets.iter_mut().enumerate().filter(|(i, _)| i % 7 == 3) {
        match i % 5 {
            0 => cell[i % 4] = u32::MAX,
            1 => cell[i % 4] = n + 4,
            2 => cell[0] = cell[3],
            3 => cell[i % 4] = n + i as u32 % 4,
            _ => *cell = [cell[0]; 4],
        }
    }
    Ok(mesh)
}

/// Points that no tetrahedron uses, some of them not finite, some far away.
fn unused_points() -> Result<Mesh> {
    let mut mesh = kuhn_jittered([3; 3], 0.3, 5)?;
    mesh.points.splice(0..0, [[f32::NAN; 3], [1e20, -1e20, 0.0]]);
    mesh.points.extend([[f32::INFINITY; 3], [-1e30; 3]]);
    mesh.tets.iter_mut().flatten().for_each(|v| *v += 2);
    Ok(mesh)
}

/// Tetrahedra squashed until their vertices coincide in single precision.
fn slivers() -> Result<Mesh> {
    let mut mesh = kuhn_jittered([8; 3], 0.3, 6)?;
    let mut random = Random::new(6);
    for p in &mut mesh.points {
        if random.below(3) == 0 {
            p[2] = p[2].round() + (p[2] - p[2].round()) * 1e-6;
            p[0] = p[0].floor() + 1e-7 * random.unit();
        }
    }
    Ok(mesh)
}

/// One tetrahedron that covers all others.
fn huge_among_small() -> Result<Mesh> {
    let mut mesh = kuhn([10; 3])?;
    let n = mesh.points.len() as u32;
    mesh.points.extend([[-1.0, -1.0, -1.0], [32.0, -1.0, -1.0], [-1.0, 32.0, -1.0], [-1.0, -1.0, 32.0]]);
    mesh.tets.insert(777, [n, n + 1, n + 2, n + 3]);
    mesh.source_cells += 1;
    Ok(mesh)
}

/// A small mesh with one vertex at 1e12.
fn outlier() -> Result<Mesh> {
    let mut mesh = kuhn_jittered([5; 3], 0.3, 7)?;
    if let Some(p) = mesh.points.last_mut() {
        *p = [1e12, -1e12, 3.0];
    }
    Ok(mesh)
}

fn renumbered() -> Result<Mesh> {
    let mesh = kuhn_jittered([9, 8, 7], 0.35, 8)?;
    let mut random = Random::new(8);
    let mut number: Vec<u32> = (0..mesh.points.len() as u32).collect();
    random.shuffle(&mut number);
    let mut points = mesh.points.clone();
    for (old, &new) in number.iter().enumerate() {
        points[new as usize] = mesh.points[old];
    }
    let mut tets: Vec<_> = mesh.tets.iter().map(|t| t.map(|v| number[v as usize])).collect();
    random.shuffle(&mut tets);
    for t in &mut tets {
        random.shuffle(t);
    }
    Ok(Mesh::new(points, tets))
}

fn signs_mixed() -> Result<Mesh> {
    let mut mesh = kuhn_jittered([7; 3], 0.3, 10)?;
    mesh.tets.iter_mut().step_by(3).for_each(|t| t.swap(1, 2));
    Ok(mesh)
}

/// Tetrahedra that share no vertices and overlap arbitrarily, of sizes over three decades.
#[allow(clippy::unnecessary_wraps)]
fn cloud(n: u32) -> Result<Mesh> {
    let mut random = Random::new(n);
    let mut points = Vec::new();
    for _ in 0..n {
        let at = [0; 3].map(|_| random.unit());
        let size = 10f32.powi(-1 - random.below(3) as i32);
        for _ in 0..4 {
            points.push(at.map(|x| x + size * random.unit()));
        }
    }
    Ok(Mesh::new(points, (0..n).map(|i| [4 * i, 4 * i + 1, 4 * i + 2, 4 * i + 3]).collect()))
}

/// Tetrahedra around one edge: all faces contain at least one of the same two vertices.
#[allow(clippy::unnecessary_wraps)]
fn fan(n: u32) -> Result<Mesh> {
    let mut points = vec![[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]];
    points.extend((0..n).map(|i| {
        let angle = std::f32::consts::TAU * i as f32 / n as f32;
        [angle.cos(), angle.sin(), 0.0]
    }));
    Ok(Mesh::new(points, (0..n).map(|i| [0, 1, 2 + i, 2 + (i + 1) % n]).collect()))
}
