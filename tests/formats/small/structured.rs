//! A structured grid with the point field `s` and the cell field `c`, in all forms of VTK, XML and legacy.

use super::join;

/// Number of points along each axis, and their coordinates.
pub const SIZE: [usize; 3] = [4, 3, 2];
pub const AXES: [&[f64]; 3] = [&[1.0, 1.5, 2.0, 2.5], &[-1.0, 0.0, 1.0], &[3.0, 5.0]];

/// The points of a part of the grid, given by the numbers of the first and the last point along each axis.
pub fn points([x, y, z]: [[usize; 2]; 3]) -> Vec<[f64; 3]> {
    let range = |[first, last]: [usize; 2]| first..=last;
    range(z).flat_map(|k| range(y).flat_map(move |j| range(x).map(move |i| [AXES[0][i], AXES[1][j], AXES[2][k]]))).collect()
}

pub const WHOLE: [[usize; 2]; 3] = [[0, 3], [0, 2], [0, 1]];

pub fn array(name: &str, components: usize, values: &str) -> String {
    format!("<DataArray type='Float64' Name='{name}' NumberOfComponents='{components}' format='ascii'>{values}</DataArray>")
}

pub fn extent(part: [[usize; 2]; 3]) -> String {
    join(part.as_flattened())
}

/// A piece of a structured grid with the field `s`, the numbers of the points in it, and the field `c` of its cells.
pub fn piece(part: [[usize; 2]; 3], more: &str) -> String {
    let [n, cells] = [1, 0].map(|more| part.iter().map(|[first, last]| (last - first + more).max(1)).product::<usize>());
    let data = format!("<PointData>{}</PointData><CellData>{}</CellData>", array("s", 1, &join(0..n)), array("c", 1, &join(0..cells)));
    format!("<Piece Extent='{}'>{data}{more}</Piece>", extent(part))
}

pub fn xml(kind: &str, attributes: &str, pieces: &str) -> Vec<u8> {
    format!("<VTKFile type='{kind}'><{kind} WholeExtent='0 3 0 2 0 1' {attributes}>{pieces}</{kind}></VTKFile>").into_bytes()
}

pub fn structured(part: [[usize; 2]; 3]) -> String {
    piece(part, &format!("<Points>{}</Points>", array("Points", 3, &join(points(part).as_flattened()))))
}

pub fn legacy(dataset: &str, geometry: &str) -> Vec<u8> {
    let data = format!("POINT_DATA 24\nSCALARS s float\nLOOKUP_TABLE default\n{}\n", join(0..24));
    let cells = format!("CELL_DATA 6\nSCALARS c float\nLOOKUP_TABLE default\n{}\n", join(0..6));
    format!("# vtk DataFile Version 3.0\n\nASCII\nDATASET {dataset}\nDIMENSIONS 4 3 2\n{geometry}\n{data}{cells}").into_bytes()
}

/// The same grid in every form.
pub fn files() -> Vec<(&'static str, Vec<u8>)> {
    let coordinates = ["x", "y", "z"].iter().zip(AXES).map(|(name, axis)| array(name, 1, &join(axis))).collect::<String>();
    let axes = ["X", "Y", "Z"].iter().zip(AXES).map(|(name, axis)| format!("{name}_COORDINATES {} double\n{}\n", axis.len(), join(axis)));
    let points = points(WHOLE);
    vec![
        ("a.vts", xml("StructuredGrid", "", &structured(WHOLE))),
        ("a.vtr", xml("RectilinearGrid", "", &piece(WHOLE, &format!("<Coordinates>{coordinates}</Coordinates>")))),
        ("a.vti", xml("ImageData", "Origin='1 -1 3' Spacing='0.5 1 2'", &piece(WHOLE, ""))),
        // Rows along y, and the numbers start elsewhere.
        (
            "turned.vti",
            String::from_utf8(xml("ImageData", "Origin='0 -3 1' Spacing='0.5 1 2' Direction='1 0 0 0 1 0 0 0 1'", &piece(WHOLE, "")))
                .unwrap()
                .replace("Extent='0 3 0 2 0 1'", "Extent='2 5 2 4 1 2'")
                .into_bytes(),
        ),
        ("structured.vtk", legacy("STRUCTURED_GRID", &format!("POINTS 24 float\n{}", join(points.as_flattened())))),
        ("rectilinear.vtk", legacy("RECTILINEAR_GRID", &axes.collect::<String>())),
        ("image.vtk", legacy("STRUCTURED_POINTS", "ORIGIN 1 -1 3\nSPACING 0.5 1 2")),
        ("aspect.vtk", legacy("STRUCTURED_POINTS", "ASPECT_RATIO 0.5 1 2\nORIGIN 1 -1 3")),
    ]
}
