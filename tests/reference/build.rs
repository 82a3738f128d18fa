//! The construction: depth, capacities, and the rules of a tree.

use super::{ALPHAS, level_of, options, prepared, tree};
use olbvh::mesh::cases::cases;
use olbvh::mesh::{Mesh, kuhn, kuhn_jittered};
use olbvh::options::{Assign, BuildOptions, usual_capacity};
use olbvh::reference::build::build;
use olbvh::reference::depth::{log_extent, measure};
use olbvh::reference::vertices::Vertices;
use olbvh::{Error, tree::TreeArrays};

#[test]
fn every_case_builds_a_valid_tree_at_every_alpha_and_assignment() {
    for case in cases().unwrap() {
        let (mesh, topology) = prepared(case.mesh);
        for alpha in ALPHAS {
            let mut entries = u64::MAX;
            for assign in Assign::EVERY {
                let tree = tree(&mesh, &topology, alpha, assign);
                let stats = tree.validate(&mesh, &topology).unwrap_or_else(|e| panic!("{} α {alpha} {assign}: {e}", case.name));
                assert!(stats.entries <= entries, "{} α {alpha}: {assign} has more entries", case.name);
                assert_eq!(stats.nodes, stats.nodes_per_level.iter().sum::<u64>());
                assert_eq!(stats.entries, tree.tets(0).len() as u64);
                entries = stats.entries;
            }
        }
    }
}

#[test]
fn the_papers_jets_has_the_papers_levels_and_entries() {
    let (mesh, topology) = prepared(kuhn([127; 3]).unwrap());
    let sizes = measure(&mesh, &topology, &Vertices::new(&mesh, &topology.grid));
    assert_eq!(topology.counts.cells, 12_290_298);
    for (alpha, level, entries) in [(0.0, 7, 98_322_384.0), (1.0, 6, 41_154_000.0), (2.0, 5, 23_665_872.0)] {
        assert_eq!(sizes.level(&options(alpha, Assign::Aabb)).unwrap(), level);
        let ratio = sizes.entries[level as usize] as f64 / entries;
        assert!((0.99..1.01).contains(&ratio), "α {alpha}: {} entries", sizes.entries[level as usize]);
    }
}

#[test]
fn measured_sizes_are_those_of_the_trees() {
    for mesh in [kuhn([9, 4, 7]).unwrap(), kuhn_jittered([8; 3], 0.3, 5).unwrap()] {
        let (mesh, topology) = prepared(mesh);
        let sizes = measure(&mesh, &topology, &Vertices::new(&mesh, &topology.grid));
        assert_eq!(sizes.histogram.iter().sum::<u64>(), mesh.tets.len() as u64);
        for alpha in ALPHAS {
            let tree = tree(&mesh, &topology, alpha, Assign::Aabb);
            assert_eq!(tree.p.len() as u64, sizes.entries[tree.grid.level as usize]);
        }
    }
}

/// Eq. 11 and 12, in the paper's own arithmetic.
#[test]
fn the_level_is_that_of_the_formula() {
    for n in [1u32, 2, 3, 5, 11, 20] {
        for jitter in [0.0, 0.3] {
            let (mesh, topology) = prepared(kuhn_jittered([n; 3], jitter, n).unwrap());
            let logs = mesh.tets.iter().map(|t| f64::from(log_extent(t.map(|v| mesh.points[v as usize]), &topology.grid)));
            let mean = logs.sum::<f64>() / mesh.tets.len() as f64;
            for alpha in ALPHAS {
                let expected = (10.5 - (mean + f64::from(alpha))).floor().clamp(0.0, 10.0) as u32;
                assert_eq!(tree(&mesh, &topology, alpha, Assign::Aabb).grid.level, expected, "{n} {jitter} {alpha}");
            }
        }
    }
}

#[test]
fn a_capacity_makes_the_tree_coarser_and_is_never_exceeded() {
    let (mesh, topology) = prepared(kuhn([12; 3]).unwrap());
    let full = tree(&mesh, &topology, 0.0, Assign::Aabb);
    let mut levels = Vec::new();
    for capacity in [full.p.len() as u32, full.p.len() as u32 - 1, 30_000, 10_368] {
        for assign in Assign::EVERY {
            let tree = build(&mesh, &topology, &BuildOptions { capacity: Some(capacity), ..options(0.0, assign) }).unwrap();
            assert!(tree.p.len() <= capacity as usize);
            tree.validate(&mesh, &topology).unwrap();
            levels.push(tree.grid.level);
        }
    }
    assert_eq!((levels[0], levels[levels.len() - 1]), (full.grid.level, 0));
    assert!(levels.is_sorted_by(|a, b| a >= b));
    let small = build(&mesh, &topology, &BuildOptions { capacity: Some(10_367), ..options(0.0, Assign::Exact) });
    assert!(matches!(&small, Err(Error::TooLarge(text)) if text.contains("10368") && text.contains("10367")), "{small:?}");
}

#[test]
fn cells_of_very_different_size_get_a_coarser_tree() {
    // Most tetrahedra are points, which call for level 10, where the others would fill 5,368,709,720 leaves.
    let mut points = vec![[0.5; 3]; 4];
    points.extend([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
    let mut tets = vec![[0, 1, 2, 3]; 600];
    tets.extend(vec![[4, 5, 6, 7]; 5]);
    let (mesh, topology) = prepared(Mesh::new(points, tets));
    let usual = build(&mesh, &topology, &options(0.0, Assign::Aabb)).unwrap();
    assert_eq!(usual.grid.level, 5, "1,048,576 entries: 5·8^6 are more");
    assert!(usual.p.len() <= usual_capacity(605) as usize);
    let clipped = build(&mesh, &topology, &BuildOptions { capacity: Some(100_000), ..options(0.0, Assign::Aabb) }).unwrap();
    assert_eq!(clipped.grid.level, 4);
    clipped.validate(&mesh, &topology).unwrap();
}

#[test]
fn wrong_arguments_are_errors() {
    let (mesh, topology) = prepared(kuhn([2; 3]).unwrap());
    for alpha in [-0.1, 10.5, f32::NAN] {
        assert!(matches!(build(&mesh, &topology, &options(alpha, Assign::Aabb)), Err(Error::Invalid(_))));
    }
    let other = kuhn([3; 3]).unwrap();
    assert!(matches!(build(&other, &topology, &BuildOptions::default()), Err(Error::Invalid(_))));
    assert!(matches!(tree(&mesh, &topology, 0.0, Assign::Aabb).validate(&other, &topology), Err(Error::Invalid(_))));
}

#[test]
fn an_empty_mesh_is_one_empty_leaf() {
    for name in ["empty", "points-only", "bad-all"] {
        let (mesh, topology) = prepared(cases().unwrap().into_iter().find(|c| c.name == name).unwrap().mesh);
        let tree = tree(&mesh, &topology, 0.0, Assign::Exact);
        let TreeArrays { p, po, co, no, flags, masks, .. } = &tree;
        assert_eq!(
            (&p[..], &po[..], &co[..], &no[..], &flags[..], &masks[..]),
            (&[][..], &[0, 0][..], &[0][..], &[1][..], &[0][..], &[0][..])
        );
        assert_eq!(tree.validate(&mesh, &topology).unwrap().leaves, 1);
    }
}

/// Every level has a single node.
#[test]
fn a_mesh_that_is_a_point_has_a_chain_of_single_nodes() {
    let (mesh, topology) = prepared(cases().unwrap().into_iter().find(|c| c.name == "point").unwrap().mesh);
    let tree = tree(&mesh, &topology, 0.0, Assign::Aabb);
    assert_eq!((tree.grid.level, tree.nodes()), (10, 11));
    for node in 0..11 {
        assert_eq!(tree.tets(node), [0, 1, 2]);
        assert_eq!(level_of(&tree, node), node);
    }
}

/// The claim that the queries rest on: a leaf without the boundary flag is full of mesh.
#[test]
fn leaves_without_the_flag_are_inside_the_mesh() {
    let (mesh, topology) = prepared(kuhn_jittered([12; 3], 0.2, 7).unwrap());
    for alpha in [0.0, 1.0, 2.0] {
        for assign in Assign::EVERY {
            let tree = tree(&mesh, &topology, alpha, assign);
            let stats = tree.validate(&mesh, &topology).unwrap();
            let boxes = tree.boxes.as_ref().unwrap();
            for leaf in tree.leaves().filter(|&j| !tree.is_boundary(j)) {
                let b = boxes[leaf as usize];
                assert!((0..3).all(|c| b[c] > 0.0 && b[c + 3] < 12.0), "{b:?}");
            }
            assert!(alpha > 1.0 || stats.boundary_leaves < stats.leaves);
        }
    }
}

#[test]
fn levels_children_and_memory_agree() {
    let (mesh, topology) = prepared(kuhn([10; 3]).unwrap());
    let tree = tree(&mesh, &topology, 0.0, Assign::Aabb);
    for node in 0..tree.nodes() {
        let level = level_of(&tree, node);
        assert!(tree.level_nodes(level).contains(&node));
        let children: Vec<u32> = tree.children(node).collect();
        assert_eq!(children, (0..8).filter_map(|d| tree.child(node, d)).collect::<Vec<_>>());
        assert!(children.iter().all(|&c| level_of(&tree, c) == level + 1));
        let below: usize = children.iter().map(|&c| tree.tets(c).len()).sum();
        assert!(children.is_empty() || below == tree.tets(node).len());
    }
    let memory = tree.memory();
    let (n_m, n_n, n_ni) = (tree.p.len() as u64, u64::from(tree.nodes()), u64::from(tree.internal_nodes()));
    assert_eq!(
        memory.total(),
        4 * (n_m + n_n + 2 + u64::from(tree.grid.level) + 1) + 4 * n_n.div_ceil(32) + 4 * n_n.div_ceil(4) + 24 * n_n
    );
    assert_eq!(tree.memory().paper(), 4 * n_m + 25 * n_n + 4 * n_ni);
}

#[test]
fn builds_are_reproducible() {
    let (mesh, topology) = prepared(kuhn_jittered([20, 10, 15], 0.3, 2).unwrap());
    let build = || tree(&mesh, &topology, 0.0, Assign::Exact);
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap().install(build);
    let many = rayon::ThreadPoolBuilder::new().num_threads(7).build().unwrap().install(build);
    assert_eq!(one, many);
}
