//! Small procedural meshes that are degenerate, invalid or otherwise difficult, for tests and the conformance suite.

use super::{Mesh, kuhn, kuhn_jittered};
use crate::error::Result;

/// A named mesh.
#[derive(Clone, Debug)]
pub struct Case {
    /// Short name, unique.
    pub name: &'static str,
    /// The mesh.
    pub mesh: Mesh,
}

const UNIT: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// All cases; every call returns the same ones.
///
/// # Errors
/// Those of [`kuhn_jittered`], which do not occur for these sizes.
pub fn cases() -> Result<Vec<Case>> {
    let mut cases = degenerate();
    cases.extend(pairs());
    cases.extend(bad());
    cases.extend(grids()?);
    Ok(cases)
}

/// A solid cylinder of three rings of this many sectors and eight layers, with its cells in no order. Four tetrahedra
/// per sector meet at each vertex inside the axis: vertices 4·(`sectors` + 1), 8·(`sectors` + 1), and so on.
///
/// # Errors
/// Those of [`kuhn`].
pub fn axle(sectors: u32) -> Result<Mesh> {
    const RINGS: u32 = 3;
    const LAYERS: u32 = 8;
    let mut mesh = kuhn([RINGS, sectors, LAYERS])?;
    for p in &mut mesh.points {
        let [radius, sector, height] = *p;
        let (sin, cos) = (sector * std::f32::consts::TAU / sectors as f32).sin_cos();
        *p = [radius * cos, radius * sin, height];
    }
    // The sectors close to a ring, and the innermost ones meet on the axis.
    let welded = |v: u32| {
        let (ring, row) = (v % (RINGS + 1), v / (RINGS + 1));
        let (sector, layer) = (row % (sectors + 1), row / (sectors + 1));
        let sector = if ring == 0 { 0 } else { sector % sectors };
        ring + (RINGS + 1) * (sector + (sectors + 1) * layer)
    };
    let mut tets: Vec<_> = mesh.tets.iter().map(|t| t.map(welded)).collect();
    tets.retain(|t| (1..4).all(|i| !t[..i].contains(&t[i])));
    tets.sort_by_key(|t| t.iter().fold(0u32, |hash, &v| (hash ^ v).wrapping_mul(0x9e37_79b1).rotate_left(13)));
    Ok(Mesh::new(mesh.points, tets))
}

fn case(name: &'static str, points: &[[f32; 3]], tets: &[[u32; 4]]) -> Case {
    Case { name, mesh: Mesh::new(points.to_vec(), tets.to_vec()) }
}

fn degenerate() -> Vec<Case> {
    let fan = |height: f32| -> (Vec<[f32; 3]>, Vec<[u32; 4]>) {
        let ring = (0..60).map(|i| (i as f32 * 0.104_719_76).sin_cos()).map(|(s, c)| [s, c, 0.0]);
        let points = [[0.0, 0.0, height], [0.0, 0.0, -height]].into_iter().chain(ring).collect();
        (points, (0..60).map(|i| [0, 1, 2 + i, 2 + (i + 1) % 60]).collect())
    };
    let mut cases = vec![
        case("empty", &[], &[]),
        case("points-only", &UNIT, &[]),
        case("single", &UNIT, &[[0, 1, 2, 3]]),
        case("single-negative", &UNIT, &[[1, 0, 2, 3]]),
        case("single-sliver", &[[0.0; 3], [1.0, 0.0, 1e-6], [0.0, 1.0, 0.0], [0.9, 1.1, 3e-6]], &[[3, 1, 0, 2]]),
        case("single-needle", &[[0.0; 3], [1.0, 1.0, 1.0], [1.0, 1.000_001, 1.0], [1.000_001, 1.0, 1.0]], &[[0, 1, 2, 3]]),
        case("negative-zero", &[[-0.0; 3], [1e-40, 1.0, -1e-41], [1.0, -1e-39, 0.0], [0.0, -0.0, 1.0]], &[[0, 1, 2, 3]]),
        case("flat-z", &[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]], &[[0, 1, 2, 3], [3, 2, 0, 1]]),
        case("flat-line", &[[0.0; 3], [1.0, 2.0, 3.0], [2.0, 4.0, 6.0], [3.0, 6.0, 9.0]], &[[0, 1, 2, 3]]),
        case("flat-x", &[[7.0, 0.0, 0.0], [7.0, 1.0, 0.0], [7.0, 0.0, 1.0], [7.0, 0.3, 0.3]], &[[0, 1, 2, 3]]),
        case("point", &[[5.0, -3.0, 0.25]; 8], &[[0, 1, 2, 3], [4, 5, 6, 7], [0, 2, 4, 6]]),
        case("identical-1000", &UNIT, &[[2, 0, 3, 1]; 1000]),
    ];
    let (points, tets) = fan(1.0);
    cases.push(case("fan", &points, &tets));
    let (points, tets) = fan(1e-5);
    cases.push(case("fan-thin", &points, &tets));
    cases
}

fn pairs() -> Vec<Case> {
    let with = |more: &[[f32; 3]]| UNIT.iter().chain(more).copied().collect::<Vec<_>>();
    let [back, far] = [[-1.0, -1.0, -0.5], [4.0, 5.0, 6.0]];
    vec![
        case("share-face", &with(&[[1.0, 1.0, 1.0]]), &[[0, 1, 2, 3], [4, 1, 3, 2]]),
        case("share-edge", &with(&[back, [0.0, -1.0, 0.0]]), &[[0, 1, 2, 3], [0, 3, 4, 5]]),
        case("share-vertex", &with(&[back, [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]), &[[0, 1, 2, 3], [0, 4, 5, 6]]),
        case("share-nothing", &with(&[far, [5.0, 5.0, 6.0], [4.0, 6.0, 6.0], [4.0, 5.0, 7.0]]), &[[0, 1, 2, 3], [7, 6, 5, 4]]),
        case("fold", &with(&[[0.25, 0.25, 3.0]]), &[[0, 1, 2, 3], [0, 2, 4, 1]]),
        case("three-on-a-face", &with(&[[1.0, 1.0, 1.0], [0.5, 0.5, 3.0]]), &[[0, 1, 2, 3], [4, 1, 3, 2], [5, 1, 2, 3]]),
        case(
            "flat-between",
            &[[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.5, 0.5, 1.0], [0.5, 0.5, -1.0]],
            &[[0, 1, 2, 4], [0, 2, 3, 4], [0, 1, 2, 3], [0, 1, 3, 5], [1, 2, 3, 5]],
        ),
    ]
}

fn bad() -> Vec<Case> {
    let points = [UNIT[0], UNIT[1], UNIT[2], UNIT[3], [f32::NAN, 0.0, 0.0], [0.0, f32::INFINITY, 0.0], [0.0, 0.0, 3e38], [1.0, 1.0, 1.0]];
    let tets = [
        [0, 1, 2, 3],
        [0, 1, 2, 8],
        [u32::MAX, 1, 2, 3],
        [0, 1, 1, 3],
        [3, 3, 3, 3],
        [0, 1, 2, 4],
        [5, 1, 2, 0],
        [0, 6, 2, 1],
        [1, 2, 3, 7],
        [9, 9, 4, 4],
    ];
    vec![case("bad-some", &points, &tets), case("bad-all", &points, &tets[1..8])]
}

fn grids() -> Result<Vec<Case>> {
    let jittered = kuhn_jittered([6, 5, 4], 0.2, 1)?;
    let moved = |name, map: fn([f32; 3]) -> [f32; 3]| {
        let mut mesh = jittered.clone();
        for p in &mut mesh.points {
            *p = map(*p);
        }
        Case { name, mesh }
    };
    // Overlapping tetrahedra of all sizes, from a linear congruential generator.
    let mut state = 1u32;
    let mut random = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / 16_777_216.0
    };
    let mut soup = Mesh::default();
    for i in 0..200 {
        let (at, size) = ([random(), random(), random()], 0.3 * random() * random() * random());
        soup.points.extend((0..4).map(|_| at.map(|x| x + size * random())));
        soup.tets.push([0, 1, 2, 3].map(|k| 4 * i + k));
    }
    soup.source_cells = 200;
    Ok(vec![
        Case { name: "kuhn", mesh: kuhn_jittered([4, 3, 2], 0.0, 0)? },
        Case { name: "kuhn-long", mesh: kuhn_jittered([40, 1, 1], 0.0, 0)? },
        Case { name: "kuhn-jittered", mesh: jittered.clone() },
        Case { name: "kuhn-tangled", mesh: kuhn_jittered([5, 5, 5], 0.7, 3)? },
        Case { name: "soup", mesh: soup },
        moved("huge", |p| p.map(|x| (x - 2.0) * 1e30)),
        moved("tiny", |p| p.map(|x| (x - 2.0) * 1e-30)),
        moved("near-denormal", |p| p.map(|x| (x - 2.0) * 1e-37)),
        moved("far", |p| p.map(|x| x + 3e5)),
        moved("very-far", |p| p.map(|x| x + 1e7)),
        moved("long-axes", |p| [p[0] * 1e-6, p[1], p[2] * 1e6]),
        moved("nearly-flat", |p| [p[0], p[1] * 1e-12, p[2]]),
    ])
}
