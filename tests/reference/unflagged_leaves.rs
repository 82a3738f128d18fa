//! A leaf without the boundary flag lies inside the mesh as a whole (SPEC 2.3), even where the boxes of inner
//! tetrahedra reach out of the mesh.

use super::{Random, prepared, tree};
use olbvh::mesh::kuhn_jittered;
use olbvh::options::Assign;
use olbvh::reference::locate::Locator;

#[test]
fn unflagged_leaves_are_inside() {
    let mut mesh = kuhn_jittered([8; 3], 0.2, 1).unwrap();
    // Turned by 45° about z, then about x.
    let s = 0.5f32.sqrt();
    mesh.points.iter_mut().for_each(|p| {
        let a = [s * (p[0] - p[1]), s * (p[0] + p[1]), p[2]];
        *p = [a[0], s * (a[1] - a[2]), s * (a[1] + a[2])];
    });
    let (mesh, topology) = prepared(mesh);
    for assign in Assign::EVERY {
        for alpha in [0.0, 1.0, 2.0] {
            let tree = tree(&mesh, &topology, alpha, assign);
            let locator = Locator::new(&mesh, &topology, &tree);
            let mut random = Random(3);
            let (mut wrong, mut outside, mut in_leaves) = (0, 0, 0);
            for _ in 0..20_000 {
                let p = [0, 1, 2].map(|c| tree.grid.lo[c] + (tree.grid.hi[c] - tree.grid.lo[c]) * random.next());
                let a = [p[0], s * (p[1] + p[2]), s * (p[2] - p[1])];
                let q = [s * (a[0] + a[1]), s * (a[1] - a[0]), a[2]];
                if q.iter().any(|x| !(-0.01..=8.01).contains(x)) {
                    outside += 1;
                    in_leaves += u32::from(tree.find_leaf(tree.grid.quantize(p)).is_some());
                    wrong += u32::from(locator.locate(p).found().is_some());
                }
            }
            assert!(outside > 10_000 && in_leaves > 5_000, "{assign} {alpha}: {outside} points outside, {in_leaves} of them in leaves");
            assert_eq!(wrong, 0, "{assign} {alpha}: {wrong} of {outside} points outside have an owner");
        }
    }
}
