//! Fields of several components at located points.

use olbvh::build::{BadCells, DeviceMesh, Tree};
use olbvh::gpu::{Gpu, GpuOptions};
use olbvh::mesh::{On, kuhn_jittered};
use olbvh::options::BuildOptions;
use olbvh::query::{LocateOptions, SILENT, locate};

#[test]
fn each_component_is_interpolated_like_a_field_of_its_own() {
    let gpu = Gpu::new(&GpuOptions::default()).unwrap();
    let mesh = kuhn_jittered([5, 4, 6], 0.2, 3).unwrap();
    let device = DeviceMesh::upload(&gpu, &mesh, BadCells::Skip).unwrap();
    let tree = Tree::build(&gpu, &device, &BuildOptions::default()).unwrap();
    let points: Vec<[f32; 3]> = (0..3000u16).map(|i| [0.618, 0.755, 0.57].map(|step| (f32::from(i) * step).fract() * 7.0 - 0.5)).collect();
    let at = |values: &[f32], on| locate(&tree, &points, Some((values, on)), &LocateOptions::default(), SILENT);
    for (on, items) in [(On::Points, mesh.points.len()), (On::Cells, mesh.tets.len())] {
        for components in [2, 3, 7] {
            let value = |item: usize, k: usize| ((item * 31 + k * 17) % 101) as f32 - 50.0 * k as f32;
            let joined: Vec<f32> = (0..items).flat_map(|item| (0..components).map(move |k| value(item, k))).collect();
            let found = at(&joined, on).unwrap().values;
            assert_eq!(found.len(), components * points.len());
            for k in 0..components {
                let alone: Vec<f32> = (0..items).map(|item| value(item, k)).collect();
                let expected = at(&alone, on).unwrap().values.into_iter().map(f32::to_bits);
                assert!(found[k..].iter().step_by(components).map(|v| v.to_bits()).eq(expected), "{on:?}, component {k} of {components}");
            }
        }
        let odd = at(&vec![0.0; 2 * items + 1], on).unwrap_err().to_string();
        assert!(odd.contains(&format!("{} values", 2 * items + 1)), "{odd}");
        assert!(at(&[], on).is_err());
    }
}
