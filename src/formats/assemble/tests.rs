//! Names of fields and warnings of an assembly.

use super::*;

/// Adds arrays to a mesh of one tetrahedron; returns the names of the resulting fields, and the warnings.
fn finish(arrays: &[(&str, On, usize, usize)]) -> (Vec<String>, Vec<String>) {
    let source = Source::new("one".as_ref(), Vec::new());
    let mut assembly = Assembly::new(&source, &LoadOptions::default(), "one tetrahedron".into());
    assembly.set_points(vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
    assembly.push(crate::formats::cells::vtk(10).unwrap(), &[0, 1, 2, 3]).unwrap();
    for &(name, on, components, values) in arrays {
        assembly.arrays.push(Array::rounded(name.into(), on, components, &vec![0.0; values]));
    }
    let (mesh, report) = assembly.finish().unwrap();
    (mesh.fields.into_iter().map(|f| f.name).collect(), report.warnings)
}

#[test]
fn no_two_fields_have_one_name() {
    let (points, cells) = (On::Points, On::Cells);
    let arrays = [
        ("a", points, 1, 4),
        ("a", points, 1, 4),
        ("a", cells, 1, 1),
        ("a", points, 1, 4),
        ("a", cells, 1, 1),
        ("a (again)", points, 1, 4),
    ];
    let (names, warnings) = finish(&arrays);
    assert_eq!(names, ["a", "a (again)", "a (cells)", "a (again 2)", "a (cells 2)", "a (again) (again)"]);
    assert_eq!((warnings.len(), warnings[2].as_str()), (5, "another array `a` is called `a (again 2)`"));
    let (names, _) = finish(&[("v.y", points, 1, 4), ("v", points, 3, 12), ("v", cells, 2, 2), ("v", cells, 2, 2)]);
    let others = ["v (again)", "v (again).x", "v (again).y", "v (again).z", "v.0", "v.1", "v (cells).0", "v (cells).1"];
    assert_eq!(names, [&["v.y"][..], &others].concat());
}

#[test]
fn arrays_left_out_say_why() {
    let (names, warnings) = finish(&[("short", On::Points, 3, 11), ("wide", On::Cells, 10, 10), ("none", On::Cells, 0, 0)]);
    let wanted = ["`short` is left out: 11 values instead of 12", "`wide` is left out: 10 components", "`none` is left out: 0 components"];
    assert!(names.is_empty());
    assert_eq!(warnings, wanted.map(|w| format!("array {w}")));
}

/// Cells of a millimetre some 800 kilometres from another one: single precision leaves little of them.
#[test]
fn small_cells_far_from_others_are_remarked_on() {
    let source = Source::new("far".as_ref(), Vec::new());
    for (far, remarks) in [(8e5, 1), (8.0, 0)] {
        let mut assembly = Assembly::new(&source, &LoadOptions::default(), "two tetrahedra".into());
        let corner = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        assembly.set_points(corner.iter().chain(&corner.map(|p| p.map(|x| far + 1e-3 * x))).copied().collect());
        for first in [0, 4] {
            assembly.push(crate::formats::cells::vtk(10).unwrap(), &[first, first + 1, first + 2, first + 3]).unwrap();
        }
        let warnings = assembly.finish().unwrap().1.warnings;
        let found = warnings.iter().filter(|w| w.starts_with("1 of 2 tetrahedra are so small") && w.contains("the first of cell 1"));
        assert_eq!(found.count(), remarks, "{warnings:?}");
    }
}

/// Tiny cells in the middle of a mesh around 0 are exact, but not relative to its corner.
#[test]
fn small_cells_in_the_middle_are_remarked_on() {
    let source = Source::new("middle".as_ref(), Vec::new());
    for (far, remarks) in [(100.0, 1), (0.1, 0)] {
        let mut assembly = Assembly::new(&source, &LoadOptions::default(), "three tetrahedra".into());
        let corner = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let of = |scale: f64| corner.map(|p| p.map(|x| scale * x));
        assembly.set_points([of(-far), of(far), of(1e-5)].concat());
        for first in [0, 4, 8] {
            assembly.push(crate::formats::cells::vtk(10).unwrap(), &[first, first + 1, first + 2, first + 3]).unwrap();
        }
        let warnings = assembly.finish().unwrap().1.warnings;
        let found = warnings.iter().filter(|w| w.starts_with("1 of 3 tetrahedra are so small") && w.contains("the first of cell 2"));
        assert_eq!(found.count(), remarks, "{warnings:?}");
    }
}

/// A plate whose box is thick, as it lies askew. A tetrahedron between the four corners of a hexahedron's face is flat but
/// for rounding, and so is each in a mesh of thick cells.
#[test]
fn thin_plates_askew_are_remarked_on() {
    let source = Source::new("plate".as_ref(), Vec::new());
    let n = 6;
    let point = |i: usize, thickness: f64| {
        let [x, y, z] = [i % (n + 1), i / (n + 1) % (n + 1), i / (n + 1) / (n + 1)].map(|i| i as f64 / n as f64);
        let ([x, y], z) = ([0.8 * x - 0.6 * y, 0.6 * x + 0.8 * y], n as f64 * thickness * z);
        [0.28 * x + 0.96 * z, y, 0.28 * z - 0.96 * x].map(|x| x + 0.1)
    };
    let corners = [0, 1, n + 2, n + 1].map(|i| i as i64);
    for (thickness, remarks) in [(1e-7, 1), (1e-6, 1), (1e-4, 0), (1e-2, 0), (1.0 / 6.0, 0)] {
        let mut assembly = Assembly::new(&source, &LoadOptions::default(), "a plate".into());
        assembly.set_points((0..2 * (n + 1) * (n + 1)).map(|i| point(i, thickness)).collect());
        for first in (0..n * (n + 1)).filter(|i| i % (n + 1) < n).map(|i| i as i64) {
            let bottom = corners.map(|i| first + i);
            let top = bottom.map(|i| i + ((n + 1) * (n + 1)) as i64);
            assembly.push(crate::formats::cells::vtk(12).unwrap(), &[bottom, top].concat()).unwrap();
            assembly.push(crate::formats::cells::vtk(10).unwrap(), &bottom).unwrap();
        }
        let warnings = assembly.finish().unwrap().1.warnings;
        let found = warnings.iter().filter(|w| w.contains("so small or thin beside the mesh"));
        assert_eq!((found.count(), warnings.len()), (remarks, remarks), "{thickness}: {warnings:?}");
    }
}

#[test]
fn fields_that_vary_little_are_remarked_on() {
    let of = |components: usize, values: &[f64]| remark_on_resolution(&Array::rounded("p".into(), On::Points, components, values));
    let starts = |remark: Option<String>, with: &str| assert!(remark.as_deref().is_some_and(|w| w.starts_with(with)), "{remark:?}");
    starts(of(1, &[1e7, 1e7 + 1.0, f64::NAN, 1e7 + 2.0]), "array `p` goes from 10000000 to 10000002");
    starts(of(3, &[1.0, 1e7, 2.0, 2.0, 1e7 + 1.0, 3.0]), "array `p.y` goes from 10000000 to 10000001");
    // Different values that become one.
    starts(of(1, &[1e9, 1e9 + 1.0, f64::NAN, 1e300]), "array `p` has several values at 1000000000, which are one in single precision");
    starts(of(2, &[1.0, 1e9, 2.0, 1e9 + 1.0]), "array `p.1` has several values at 1000000000");
    starts(of(1, &[1e-60, 2e-60]), "array `p` has several values at 0");
    // Neither constants nor what differs by rounding only.
    for values in [&[1e7; 4][..], &[0.0, 1.0, 2.0, 3.0], &[1.0, 1.0001, 1.0, 1.0], &[0.1, 0.1 + 1e-15], &[1e300, f64::NAN], &[1e9]] {
        assert_eq!(of(1, values), None);
    }
    let whole = |values: &[f64]| remark_on_resolution(&Array::whole("p".into(), On::Points, values));
    starts(whole(&[1.0, 20_000_001.0]), "array `p` has whole numbers beyond 16777216");
    starts(whole(&[16_777_220.0, 16_777_224.0]), "array `p` goes from");
    assert_eq!([&[16_777_217.0; 2][..], &[-1.0, 16_777_216.0]].map(whole), [None, None]);
}

/// A chain of small cells, and one cell far away.
#[test]
fn many_small_cells_are_remarked_on() {
    let source = Source::new("chain".as_ref(), Vec::new());
    for (far, remarks) in [(1e7, 1), (1e5, 0), (1e3, 0)] {
        let mut assembly = Assembly::new(&source, &LoadOptions::default(), "a chain".into());
        let place = |i: u32| [f64::from(i % 3), f64::from(i / 3 % 5), f64::from(i / 15 % 11)];
        assembly.set_points((0..6000).map(place).chain([[far; 3]]).collect());
        for i in 0..5000 {
            assembly.push(crate::formats::cells::vtk(10).unwrap(), &[i, i + 1, i + 3, i + 15]).unwrap();
        }
        assembly.push(crate::formats::cells::vtk(10).unwrap(), &[0, 3, 15, 6000]).unwrap();
        let warnings = assembly.finish().unwrap().1.warnings;
        assert_eq!(warnings.iter().filter(|w| w.contains("smaller than 1/8192 of the mesh")).count(), remarks, "{warnings:?}");
    }
}
