use super::*;

/// Unit cubes at whole coordinates.
fn voxels(size: [u32; 2], layers: u32) -> VoxelGrid {
    let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let [next_voxel, next_row, next_layer] = axes;
    VoxelGrid { origin: [0.0; 3], next_voxel, next_row, next_layer, half: axes.map(|a| a.map(|x| 0.5 * x)), size, layers }
}

#[test]
fn stacks_are_limited_in_all() {
    assert_eq!(voxels([1 << 16; 2], 1 << 16).voxels(), MOST_VOXELS);
    assert!(voxels([1 << 16; 2], 1 << 16).check().is_ok());
    for (size, layers) in [([1 << 16; 2], (1 << 16) + 1), ([1 << 22; 2], 1 << 22), ([MOST_PER_AXIS; 2], MOST_PER_AXIS)] {
        let error = voxels(size, layers).check().unwrap_err().to_string();
        assert!(error.contains("more than 2^48 in all; take fewer layers"), "{error}");
    }
    assert_eq!(voxels([1 << 22; 2], 1 << 22).voxels(), u64::MAX);
}

#[test]
fn rows_are_numbered_to_the_last() {
    let rows = Rows { layer: 3, first: 1, count: u32::MAX };
    assert_eq!(rows.row(u32::MAX, MOST_PER_AXIS), [0, 3 + (1 << 8)]);
    assert_eq!(rows.run(rows.runs(MOST_PER_AXIS) - 1, MOST_PER_AXIS), u32::MAX - 63..u32::MAX);
}

#[test]
fn bands_cover_a_stack_once() {
    for (size, layers) in [([7, 5], 11), ([1, 1], 1), ([300, 200], 3), ([1000, 1], 4)] {
        let voxels = voxels(size, layers);
        for most in [1, 10, 35, 40, 100, 1000, 100_000] {
            let rows: Vec<[u32; 2]> = bands(&voxels, most).flat_map(|b| (0..b.count).map(move |i| b.row(i, size[1]))).collect();
            let expected: Vec<[u32; 2]> = (0..layers).flat_map(|k| (0..size[1]).map(move |y| [y, k])).collect();
            assert_eq!(rows, expected, "{size:?} {layers} {most}");
            let largest = bands(&voxels, most).map(|b| u64::from(b.count) * u64::from(size[0])).max();
            assert!(largest.is_some_and(|n| n <= most.max(u64::from(size[0]))));
        }
    }
}

#[test]
fn runs_take_every_row_once_and_are_the_same_in_all_bands() {
    for (size, layers) in [([1, 7], 40), ([2, 64], 3), ([3, 65], 5), ([1, 200], 4), ([5, 1], 3)] {
        let voxels = voxels(size, layers);
        let runs_of = |rows: Rows| -> Vec<Vec<[u32; 2]>> {
            (0..rows.runs(size[1])).map(|i| rows.run(i, size[1]).map(|y| rows.row(y, size[1])).collect()).collect()
        };
        let runs = |most| bands(&voxels, most).flat_map(runs_of).collect::<Vec<_>>();
        let whole = runs(u64::from(u32::MAX));
        let all: Vec<[u32; 2]> = (0..layers).flat_map(|k| (0..size[1]).map(move |y| [y, k])).collect();
        assert_eq!(whole.concat(), all);
        assert!(whole.iter().all(|run| !run.is_empty() && run.len() <= VOXEL_RUN as usize && run.iter().all(|at| at[1] == run[0][1])));
        for rows in [64, 65, 127, 128, 199, 200, 399, 400, 1000] {
            assert_eq!(runs(rows * u64::from(size[0])), whole, "{size:?}, {layers} layers, {rows} rows at a time");
        }
        // Parts of bands have the same runs, and several layers only if these are whole.
        for rows in [64, 65, 127, 130, 199, 200, 201, 399, 450, 1000] {
            for band in bands(&voxels, 520 * u64::from(size[0])) {
                let parts: Vec<Rows> = band.parts(rows, size[1]).collect();
                assert!(parts.iter().all(|p| p.count <= rows && (p.first + p.count <= size[1] || (p.first, p.count % size[1]) == (0, 0))));
                let runs: Vec<_> = parts.into_iter().flat_map(runs_of).collect();
                assert_eq!(runs, runs_of(band), "{band:?} of {size:?}, {rows} rows at a time");
            }
        }
        for rows in (0..400).map(|first| Rows { layer: 0, first, count: 50 + first }) {
            let run = |i| rows.run(i, size[1]);
            assert!((0..rows.runs(size[1])).flat_map(run).eq(0..rows.count), "{rows:?} of {size:?}");
        }
    }
}

/// Where layers, rows or voxels begin far from the mesh, centres are rounded by more than the size of a voxel.
#[test]
fn voxels_meet_the_blocks_that_their_rounded_centres_lie_in() {
    let grid = Grid::new([0.0; 3], [24.0; 3]);
    let mut missed_without = 0;
    for k in 0..200 {
        let spacing = 999_999.56 + 0.062_5 * (k % 40) as f32;
        let far = [0.0, 0.0, 2.5 - 10.0 * spacing - 0.5 * (k / 40) as f32];
        let turned = |axis: usize| {
            let mut stack = VoxelGrid { half: [[0.5, 0.0, 0.0], [0.0, 0.5, 0.0], [0.0, 0.0, 0.000_5]], origin: far, ..voxels([4, 3], 11) };
            stack.next_layer = [0.0, 0.0, spacing];
            match axis {
                0 => (stack.next_voxel, stack.next_layer, stack.size, stack.layers) = (stack.next_layer, stack.next_voxel, [11, 3], 4),
                1 => (stack.next_row, stack.next_layer, stack.size, stack.layers) = (stack.next_layer, stack.next_row, [4, 11], 3),
                _ => {}
            }
            stack
        };
        for stack in [0, 1, 2].map(turned) {
            let rows = Rows { layer: 0, first: 0, count: stack.size[1] * stack.layers };
            let last = [stack.size[0] - 1, stack.size[1] - 1, stack.layers - 1];
            let [x, y, z] = stack.centre(last).map(f64::from);
            let exact = f64::from(far[2]) + 10.0 * f64::from(spacing);
            missed_without += u32::from((exact - z).abs() > 0.1);
            let block = [[x, y, z], [x + 1.0, y + 1.0, z + 1e-3]];
            for rows in [rows, Rows { layer: last[2], first: last[1], count: 1 }] {
                assert!(stack.meets(rows, block, &grid), "{stack:?}: {rows:?} of a centre at {z}, exactly {exact}");
            }
            // The allowance is 6 at these coordinates.
            assert!(!stack.meets(rows, [[x, y, z + 8.0], [x + 1.0, y + 1.0, z + 9.0]], &grid), "{stack:?}");
        }
    }
    assert!(missed_without > 100, "{missed_without}");
}

/// The limit is a power of two, and two to four times the size of the mesh.
#[test]
fn too_large_voxels_are_refused_with_the_limit() {
    let grid = Grid::new([0.0; 3], [3.0, 1.0, 1.0]);
    let high = |z: f32| VoxelGrid { half: [[0.5, 0.0, 0.0], [0.0, 0.5, 0.0], [0.0, 0.0, 0.5 * z]], ..voxels([1, 1], 1) }.check_over(&grid);
    assert!(high(8.0).is_ok());
    for z in [8.000_001, 100.0] {
        let error = high(z).unwrap_err().to_string();
        assert!(error.contains("more than 8 along an axis, which is 2 to 4 times the size of the mesh"), "{error}");
    }
}

/// Devices may flush denormals.
#[test]
fn denormal_steps_count_as_none() {
    let stack = |x: f32| VoxelGrid { origin: [1e-38, 0.0, 0.0], next_voxel: [x, 0.0, 2.0], ..voxels([4, 1], 1) };
    assert_eq!(stack(1e-39).centre([3, 0, 0]), [0.0, 0.0, 6.0]);
    assert_eq!(stack(2e-38).centre([3, 0, 0])[0], 3.0 * 2e-38);
}

#[test]
fn normals_have_any_length() {
    let of =
        |normal: [f64; 3]| SliceSettings { plane: Plane::Normal(normal), ..SliceSettings::default() }.voxels([0.0; 3], [1.0; 3], [0.0; 3]);
    let expected = of([1.0, 2.0, -2.0]).unwrap();
    for length in [1e200, 1e-200] {
        assert_eq!(of([length, 2.0 * length, -2.0 * length]).unwrap(), expected);
    }
    assert!(of([0.0; 3]).is_err() && of([f64::NAN, 0.0, 1.0]).is_err() && of([f64::INFINITY, 0.0, 0.0]).is_err());
}
