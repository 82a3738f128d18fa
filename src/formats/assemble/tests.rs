//! Names of fields and warnings of an assembly.

use super::*;

/// Adds arrays to a mesh of one tetrahedron; returns the names of the resulting fields, and the warnings.
fn finish(arrays: &[(&str, On, usize, usize)]) -> (Vec<String>, Vec<String>) {
    let source = Source::new("one".as_ref(), Vec::new());
    let mut assembly = Assembly::new(&source, &LoadOptions::default(), "one tetrahedron".into());
    assembly.set_points(vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
    assembly.push(crate::formats::cells::vtk(10).unwrap(), &[0, 1, 2, 3]).unwrap();
    for &(name, on, components, values) in arrays {
        assembly.arrays.push(Array { name: name.into(), on, components, values: vec![0.0; values] });
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
