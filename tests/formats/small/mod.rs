//! Small mesh files of every format, made in memory: a cube of 8 points and 6 tetrahedra with a point field `s` and a
//! cell field `c`.
#![allow(clippy::format_push_string, clippy::format_collect, clippy::unwrap_used)] // simple code matters more than speed here

#[path = "../../not_run/mod.rs"]
pub mod not_run;
pub mod structured;

use not_run::not_run;
use olbvh::formats::{LoadOptions, Loaded, load_bytes};
use olbvh::mesh::Mesh;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

pub const POINTS: [[f64; 3]; 8] =
    [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [1., 1., 0.], [0., 0., 1.], [1., 0., 1.], [0., 1., 1.], [1., 1., 1.25]];
pub const TETS: [[u32; 4]; 6] = [[0, 1, 3, 7], [0, 1, 5, 7], [0, 2, 3, 7], [0, 2, 6, 7], [0, 4, 5, 7], [0, 4, 6, 7]];

/// The folder with the shared meshes; `None`, with a message, if it does not exist.
pub fn shared(folder: &str) -> Option<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/meshes");
    let root = if root.is_dir() { root } else { Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/meshes") };
    if root.is_dir() {
        return Some(root.join(folder));
    }
    not_run(&format!("the files of ../shared/meshes/{folder}, which is missing"));
    None
}

pub fn join<T: ToString>(values: impl IntoIterator<Item = T>) -> String {
    values.into_iter().map(|v| v.to_string()).collect::<Vec<_>>().join(" ")
}

/// Every spelling, as file name and content. A companion file follows its main file.
pub fn all() -> Vec<(&'static str, Vec<u8>)> {
    vec![
        ("ascii.vtu", vtu_ascii()),
        ("raw.vtu", vtu_binary(false, false)),
        ("big.vtu", vtu_binary(true, false)),
        ("base64.vtu", vtu_binary(false, true)),
        ("ascii.vtk", vtk_ascii()),
        ("binary.vtk", vtk_binary()),
        ("v51.vtk", vtk_51()),
        ("v22.msh", msh_22()),
        ("v22b.msh", msh_22_binary()),
        ("v40.msh", msh_40()),
        ("v41.msh", msh_41()),
        ("v41b.msh", msh_41_binary()),
        ("text.mesh", medit()),
        ("binary.meshb", meditb()),
        ("pair.ele", tetgen(1).1),
        ("pair.node", tetgen(1).0),
        ("zero.ele", tetgen(0).1),
        ("zero.node", tetgen(0).0),
        ("isaac.tet", isaac()),
        ("cube.inp", abaqus()),
        ("cube.veg", vega()),
        ("quoted.vtu", vtu_quoted()),
        ("texts.vtk", vtk_texts()),
    ]
}

/// One of the small files.
pub fn small(name: &str) -> Vec<u8> {
    all().into_iter().find(|f| f.0 == name).unwrap().1
}

/// One of the small files, with the bytes `old` replaced by `new`.
pub fn replace(name: &str, old: &[u8], new: &[u8]) -> Vec<u8> {
    let mut bytes = small(name);
    let at = bytes.windows(old.len()).position(|w| w == old).unwrap();
    bytes.splice(at..at + old.len(), new.iter().copied());
    bytes
}

/// Reads a file from memory.
pub fn open_bytes(name: &str, bytes: Vec<u8>) -> Loaded {
    load_bytes(name, bytes, &LoadOptions::default()).unwrap_or_else(|e| panic!("{name}: {e}"))
}

fn vtu_ascii() -> Vec<u8> {
    let array = |kind: &str, name: &str, n: usize, text: String| {
        format!("<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{n}\" format=\"ascii\">{text}</DataArray>\n")
    };
    format!(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\">\n<UnstructuredGrid>\n<Piece NumberOfPoints=\"8\" NumberOfCells=\"6\">\n<PointData>{}</PointData><CellData>{}</CellData>\n<Points>{}</Points>\n<Cells>{}{}{}</Cells>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>\n",
        array("Float32", "s", 1, join(0..8)),
        array("Int16", "c", 1, join(0..6)),
        array("Float64", "Points", 3, join(POINTS.as_flattened())),
        array("Int64", "connectivity", 1, join(TETS.as_flattened())),
        array("Int32", "offsets", 1, join((1..=6).map(|i| 4 * i))),
        array("UInt8", "types", 1, join([10; 6])),
    )
    .into_bytes()
}

/// With the data of its arrays in sections of CDATA, and without appended data.
fn vtu_quoted() -> Vec<u8> {
    let text = String::from_utf8(vtu_ascii()).unwrap().replace("</VTKFile>", "<AppendedData encoding=\"raw\"/></VTKFile>");
    text.replace("ascii\">", "ascii\"><![CDATA[").replace("</DataArray>", "]]></DataArray>").into_bytes()
}

fn isaac() -> Vec<u8> {
    let line = |keyword: &str, numbers: String| format!("{keyword} {numbers}\n");
    let points: String = POINTS.iter().map(|p| line("v", join(p))).collect();
    let tets: String = TETS.iter().map(|t| line("t", join(t))).collect();
    format!("# a cube\n{points}\n{tets}").into_bytes()
}

fn abaqus() -> Vec<u8> {
    let nodes: String = (1..).zip(POINTS).map(|(i, p)| format!("{i}, {}\n", join(p).replace(' ', ", "))).collect();
    let tets: String = (1..).zip(TETS).map(|(i, t)| format!("{i}, {}\n", join(t.map(|v| v + 1)).replace(' ', ", "))).collect();
    format!("*HEADING\na cube\n** of six tetrahedra\n*NODE\n{nodes}*ELEMENT, TYPE=C3D4\n{tets}*STEP\n*END STEP\n").into_bytes()
}

fn vega() -> Vec<u8> {
    let nodes: String = (1..).zip(POINTS).map(|(i, p)| format!("{i} {}\n", join(p))).collect();
    let tets: String = (1..).zip(TETS).map(|(i, t)| format!("{i} {}\n", join(t.map(|v| v + 1)))).collect();
    format!("# a cube\n*VERTICES\n8 3 0 0\n{nodes}\n*ELEMENTS\nTET\n6 4 0\n{tets}*MATERIAL a\nENU, 1000, 1E7, 0.45\n").into_bytes()
}

fn base64(bytes: &[u8]) -> Vec<u8> {
    const TABLE: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut out = Vec::new();
    for chunk in bytes.chunks(3) {
        let word = chunk.iter().chain([0, 0].iter()).take(3).fold(0u32, |n, &b| n << 8 | u32::from(b));
        for i in 0..4 {
            out.push(if i <= chunk.len() { TABLE[(word >> (18 - 6 * i) & 63) as usize] } else { b'=' });
        }
    }
    out
}

fn vtu_binary(big: bool, text: bool) -> Vec<u8> {
    let f = |v: f64| if big { v.to_be_bytes() } else { v.to_le_bytes() };
    let i = |v: i32| if big { v.to_be_bytes() } else { v.to_le_bytes() };
    let arrays: [(&str, &str, &str, usize, Vec<u8>); 6] = [
        ("PointData", "Float64", "s", 1, (0..8).flat_map(|v| f(f64::from(v))).collect()),
        ("CellData", "Int32", "c", 1, (0..6).flat_map(i).collect()),
        ("Points", "Float64", "Points", 3, POINTS.as_flattened().iter().flat_map(|v| f(*v)).collect()),
        ("Cells", "Int32", "connectivity", 1, TETS.as_flattened().iter().flat_map(|v| i(*v as i32)).collect()),
        ("Cells", "Int32", "offsets", 1, (1..=6).flat_map(|v| i(4 * v)).collect()),
        ("Cells", "UInt8", "types", 1, vec![10; 6]),
    ];
    let order = if big { "BigEndian" } else { "LittleEndian" };
    let mut xml = format!(
        "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"{order}\" header_type=\"UInt32\">\n<UnstructuredGrid>\n<Piece NumberOfPoints=\"8\" NumberOfCells=\"6\">\n"
    );
    let mut data = Vec::new();
    for (group, kind, name, n, bytes) in arrays {
        let head = format!("<{group}><DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{n}\" ");
        let head = if xml.ends_with("</Cells>\n") && group == "Cells" {
            xml.truncate(xml.len() - "</Cells>\n".len());
            head["<Cells>".len()..].to_owned()
        } else {
            head
        };
        xml += &head;
        let mut block = i(bytes.len() as i32).to_vec();
        block.extend(bytes);
        if text {
            xml += &format!("format=\"binary\">{}</DataArray>", String::from_utf8_lossy(&base64(&block)));
        } else {
            xml += &format!("format=\"appended\" offset=\"{}\"/>", data.len());
            data.extend(block);
        }
        xml += &format!("</{group}>\n");
    }
    xml += "</Piece>\n</UnstructuredGrid>\n";
    let mut out = xml.into_bytes();
    if !text {
        out.extend(b"<AppendedData encoding=\"raw\">_");
        out.extend(data);
        out.extend(b"</AppendedData>");
    }
    out.extend(b"</VTKFile>\n");
    out
}

fn rows<const N: usize, T: ToString + Copy>(values: &[[T; N]], prefix: &str) -> String {
    values.iter().map(|v| format!("{prefix}{}\n", join(v.iter().copied()))).collect()
}

fn vtk_ascii() -> Vec<u8> {
    let cells = rows(&TETS, "4 ");
    let types = "10\n".repeat(6);
    format!("# vtk DataFile Version 3.0\nsmall\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 8 double\n{}CELLS 6 30\n{cells}CELL_TYPES 6\n{types}CELL_DATA 6\nSCALARS c int 1\nLOOKUP_TABLE default\n{}\nPOINT_DATA 8\nFIELD FieldData 1\ns 1 8 float\n{}\n", rows(&POINTS, ""), join(0..6), join(0..8)).into_bytes()
}

/// With texts, and without an array.
fn vtk_texts() -> Vec<u8> {
    let text = String::from_utf8(vtk_ascii()).unwrap();
    let fields = "FIELD FieldData 4\nNULL_ARRAY\nt 1 2 utf8_string\na b\n\nv 1 2 variant\n6 1 13 b\ns";
    let text = text.replace("SCALARS c int 1", "PEDIGREE_IDS p string\na\nb\n\nc\nd\ne\nSCALARS c int\n");
    text.replace("FIELD FieldData 1\ns", fields).into_bytes()
}

fn vtk_binary() -> Vec<u8> {
    let mut out = b"# vtk DataFile Version 3.0\nsmall\nBINARY\nDATASET UNSTRUCTURED_GRID\nPOINTS 8 double\n".to_vec();
    out.extend(POINTS.as_flattened().iter().flat_map(|v| v.to_be_bytes()));
    out.extend(b"\nCELLS 6 30\n");
    out.extend(TETS.iter().flat_map(|t| [4, t[0], t[1], t[2], t[3]]).flat_map(u32::to_be_bytes));
    out.extend(b"\nCELL_TYPES 6\n");
    out.extend([10i32; 6].into_iter().flat_map(i32::to_be_bytes));
    out.extend(b"\nPOINT_DATA 8\nSCALARS s float\nLOOKUP_TABLE default\n");
    out.extend((0..8u8).flat_map(|v| f32::from(v).to_be_bytes()));
    out.extend(b"\nCELL_DATA 6\nSCALARS c short\nLOOKUP_TABLE default\n");
    out.extend((0..6i16).flat_map(i16::to_be_bytes));
    out.push(b'\n');
    out
}

fn vtk_51() -> Vec<u8> {
    let offsets = join((0..=6).map(|i| 4 * i));
    format!("# vtk DataFile Version 5.1\nsmall\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 8 double\n{}CELLS 7 24\nOFFSETS vtktypeint64\n{offsets}\nCONNECTIVITY vtktypeint64\n{}\nCELL_TYPES 6\n{}\nPOINT_DATA 8\nSCALARS s double\nLOOKUP_TABLE default\n{}\nMETADATA\nINFORMATION 0\n\nCELL_DATA 6\nSCALARS c int\nLOOKUP_TABLE default\n{}\n", rows(&POINTS, ""), join(TETS.as_flattened()), join([10; 6]), join(0..8), join(0..6)).into_bytes()
}

fn data_22(section: &str, name: &str, count: usize) -> String {
    let rows: String = (0..count).map(|i| format!("{} {i}\n", 10 * (i + 1))).collect();
    format!("${section}\n1\n\"{name}\"\n1\n0.0\n3\n0\n1\n{count}\n{rows}$End{section}\n")
}

fn msh_22() -> Vec<u8> {
    let nodes: String = POINTS.iter().enumerate().map(|(i, p)| format!("{} {}\n", 10 * (i + 1), join(p))).collect();
    let cells: String =
        TETS.iter().enumerate().map(|(i, t)| format!("{} 4 2 0 0 {}\n", 10 * (i + 1), join(t.map(|v| 10 * (v + 1))))).collect();
    format!(
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n8\n{nodes}$EndNodes\n$Elements\n6\n{cells}$EndElements\n{}{}",
        data_22("NodeData", "s", 8),
        data_22("ElementData", "c", 6)
    )
    .into_bytes()
}

fn msh_22_binary() -> Vec<u8> {
    let int = |v: i32| v.to_le_bytes();
    let mut out = b"$MeshFormat\n2.2 1 8\n".to_vec();
    out.extend(int(1));
    out.extend(b"\n$EndMeshFormat\n$Nodes\n8\n");
    for (i, p) in POINTS.iter().enumerate() {
        out.extend(int(i as i32 + 1));
        out.extend(p.iter().flat_map(|v| v.to_le_bytes()));
    }
    out.extend(b"\n$EndNodes\n$Elements\n6\n");
    out.extend([4, 6, 2].into_iter().flat_map(int));
    for (i, t) in TETS.iter().enumerate() {
        out.extend([i as i32 + 1, 0, 0].into_iter().flat_map(int));
        out.extend(t.iter().flat_map(|v| int(*v as i32 + 1)));
    }
    out.extend(b"\n$EndElements\n");
    for (section, name, n) in [("NodeData", "s", 8), ("ElementData", "c", 6)] {
        out.extend(format!("${section}\n1\n\"{name}\"\n1\n0\n3\n0\n1\n{n}\n").bytes());
        for i in 0..n {
            out.extend(int(i + 1));
            out.extend(f64::from(i).to_le_bytes());
        }
        out.extend(format!("\n$End{section}\n").bytes());
    }
    out
}

/// Version 4.0. One volume, with the physical groups 11 and 12, is the entity of all elements; points have a box in
/// this version.
fn msh_40() -> Vec<u8> {
    let nodes: String = POINTS.iter().enumerate().map(|(i, p)| format!("{} {}\n", 10 * (i + 1), join(p))).collect();
    let cells: String = TETS.iter().enumerate().map(|(i, t)| format!("{} {}\n", 10 * (i + 1), join(t.map(|v| 10 * (v + 1))))).collect();
    let volume = "7 0 0 0 1 1 1.25";
    format!(
        "$MeshFormat\n4 0 8\n$EndMeshFormat\n$Entities\n1 0 0 2\n1 0 0 0 0 0 0 1 5\n{volume} 2 11 12 0\n{volume} 1 13 0\n$EndEntities\n$Nodes\n1 8\n7 3 0 8\n{nodes}$EndNodes\n$Elements\n1 6\n7 3 4 6\n{cells}$EndElements\n{}{}",
        data_22("NodeData", "s", 8),
        data_22("ElementData", "c", 6)
    )
    .into_bytes()
}

fn msh_41() -> Vec<u8> {
    let tags: String = (1..=8).map(|i| format!("{}\n", 10 * i)).collect();
    let cells: String = TETS.iter().enumerate().map(|(i, t)| format!("{} {}\n", 10 * (i + 1), join(t.map(|v| 10 * (v + 1))))).collect();
    format!("$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n1 8 10 80\n3 0 0 8\n{tags}{}$EndNodes\n$Elements\n1 6 10 60\n3 0 4 6\n{cells}$EndElements\n{}{}", rows(&POINTS, ""), data_22("NodeData", "s", 8), data_22("ElementData", "c", 6)).into_bytes()
}

fn msh_41_binary() -> Vec<u8> {
    let int = |v: i32| v.to_le_bytes();
    let long = |v: u64| v.to_le_bytes();
    let mut out = b"$MeshFormat\n4.1 1 8\n".to_vec();
    out.extend(int(1));
    out.extend(b"\n$EndMeshFormat\n$Nodes\n");
    out.extend([1, 8, 1, 8].into_iter().flat_map(long));
    out.extend([3, 0, 0].into_iter().flat_map(int));
    out.extend(long(8));
    out.extend((1..=8).flat_map(long));
    out.extend(POINTS.as_flattened().iter().flat_map(|v| v.to_le_bytes()));
    out.extend(b"\n$EndNodes\n$Elements\n");
    out.extend([1, 6, 1, 6].into_iter().flat_map(long));
    out.extend([3, 0, 4].into_iter().flat_map(int));
    out.extend(long(6));
    for (i, t) in TETS.iter().enumerate() {
        out.extend(long(i as u64 + 1));
        out.extend(t.iter().flat_map(|v| long(u64::from(*v) + 1)));
    }
    out.extend(b"\n$EndElements\n");
    let tail = msh_22_binary();
    let at = tail.windows(9).position(|w| w == b"$NodeData").unwrap();
    out.extend(&tail[at..]);
    out
}

fn medit() -> Vec<u8> {
    let points: String = POINTS.iter().map(|p| format!("{} 0\n", join(p))).collect();
    let cells: String = TETS.iter().enumerate().map(|(i, t)| format!("{} {i}\n", join(t.map(|v| v + 1)))).collect();
    format!("MeshVersionFormatted 2\nDimension 3\nVertices\n8\n{points}Tetrahedra\n6\n{cells}End\n").into_bytes()
}

fn meditb() -> Vec<u8> {
    let int = |v: i32| v.to_le_bytes();
    let mut out: Vec<u8> = [1, 2, 3, 20, 3, 4].into_iter().flat_map(int).collect();
    out.extend(int(20 + 12 + 8 * 28));
    out.extend(int(8));
    for p in POINTS {
        out.extend(p.iter().flat_map(|v| v.to_le_bytes()));
        out.extend(int(0));
    }
    out.extend(int(8));
    out.extend(int(out.len() as i32 + 8 + 6 * 20));
    out.extend(int(6));
    for (i, t) in TETS.iter().enumerate() {
        out.extend(t.iter().flat_map(|v| int(*v as i32 + 1)));
        out.extend(int(i as i32));
    }
    out.extend([54, 0].into_iter().flat_map(int));
    out
}

fn tetgen(first: u32) -> (Vec<u8>, Vec<u8>) {
    let points: String = POINTS.iter().enumerate().map(|(i, p)| format!("{} {} {i}\n", i as u32 + first, join(p))).collect();
    let cells: String =
        TETS.iter().enumerate().map(|(i, t)| format!("{} {} {i}\n", i as u32 + first, join(t.map(|v| v + first)))).collect();
    (format!("# points\n8 3 1 0\n{points}").into_bytes(), format!("6 4 1\n{cells}").into_bytes())
}

/// Points, cells and faces of the files of [`polyhedra`].
pub const CORNERS: [[f64; 3]; 11] = [
    [0., 0., 0.],
    [1., 0., 0.],
    [1., 1., 0.],
    [0., 1., 0.],
    [0., 0., 1.],
    [1., 0., 1.],
    [1., 1., 1.],
    [0., 1., 1.],
    [0.5, 0.5, 2.],
    [2., 0.5, 1.5],
    [0.5, 2., 1.5],
];

/// The faces of a cube, of a pyramid on it, and of a tetrahedron beside the pyramid. Their windings differ.
const FACES: [&[&[u32]]; 3] = [
    &[&[0, 1, 2, 3], &[4, 5, 6, 7], &[0, 1, 5, 4], &[1, 2, 6, 5], &[2, 3, 7, 6], &[4, 7, 3, 0]],
    &[&[6, 5, 4, 7], &[4, 5, 8], &[5, 6, 8], &[6, 7, 8], &[7, 4, 8]],
    &[&[6, 7, 8], &[6, 7, 10], &[7, 8, 10], &[8, 6, 10]],
];

/// Polyhedra in the three forms of VTK: a cube, a pyramid on it, beside that a cell of type tetrahedron, and a tetrahedron
/// given as polyhedron. The point field `s` holds the numbers of points, the cell field `c` those of cells.
pub fn polyhedra() -> [(&'static str, Vec<u8>); 3] {
    let stream = |faces: &[&[u32]]| -> Vec<u32> {
        let lists = faces.iter().flat_map(|face| std::iter::once(face.len() as u32).chain(face.iter().copied()));
        std::iter::once(faces.len() as u32).chain(lists).collect()
    };
    let [cube, pyramid, last] = FACES.map(stream);
    let tet = vec![5, 6, 8, 9];
    let lists = [&cube, &pyramid, &tet, &last];
    let legacy = format!(
        "# vtk DataFile Version 3.0\n\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 11 double\n{}\nCELLS 4 {}\n{}\nCELL_TYPES 4\n42 42 10 42\n\
         POINT_DATA 11\nSCALARS s float\nLOOKUP_TABLE default\n{}\nCELL_DATA 4\nSCALARS c int\nLOOKUP_TABLE default\n0 1 2 3\n",
        join(CORNERS.as_flattened()),
        lists.iter().map(|list| list.len() + 1).sum::<usize>(),
        lists.map(|list| format!("{} {}\n", list.len(), join(list))).concat(),
        join(0..11),
    );
    let corners = [&[0, 1, 2, 3, 4, 5, 6, 7][..], &[4, 5, 6, 7, 8], &tet, &[6, 7, 8, 10]];
    let ends = |lengths: &[usize]| {
        join(lengths.iter().scan(0, |end, n| {
            *end += n;
            Some(*end)
        }))
    };
    let array =
        |kind: &str, name: &str, text: String| format!("<DataArray type='{kind}' Name='{name}' format='ascii'>{text}</DataArray>\n");
    let xml = |more: String| {
        format!(
            "<VTKFile type='UnstructuredGrid'><UnstructuredGrid><Piece NumberOfPoints='11' NumberOfCells='4'>\n<PointData>{}</PointData>\
             <CellData>{}</CellData><Points><DataArray type='Float64' NumberOfComponents='3'>{}</DataArray></Points>\n<Cells>{}{}{}{more}\
             </Cells></Piece></UnstructuredGrid></VTKFile>",
            array("Float32", "s", join(0..11)),
            array("Int32", "c", join(0..4)),
            join(CORNERS.as_flattened()),
            array("Int64", "connectivity", join(corners.concat())),
            array("Int64", "offsets", ends(&corners.map(<[u32]>::len))),
            array("UInt8", "types", "42 42 10 42".into()),
        )
        .into_bytes()
    };
    let lengths = [cube.len(), pyramid.len(), last.len()];
    let list_ends = format!("{} {} -1 {}", lengths[0], lengths[0] + lengths[1], lengths.iter().sum::<usize>());
    let listed = xml(array("Int64", "faces", join([&cube[..], &pyramid, &last].concat())) + &array("Int64", "faceoffsets", list_ends));
    // The square and a triangle are shared; the faces are in no order.
    let faces: Vec<&[u32]> =
        FACES.concat().into_iter().rev().filter(|face| ![&[6, 5, 4, 7][..], &[6, 7, 8]].contains(face)).chain([&[6, 7, 8][..]]).collect();
    let number = |face: &[u32]| {
        let same = |other: &[u32]| face.len() == other.len() && face.iter().all(|v| other.contains(v));
        faces.iter().position(|other| same(other)).unwrap()
    };
    let numbers: Vec<usize> = FACES.concat().into_iter().map(number).collect();
    let numbered = xml(array("Int64", "face_connectivity", join(faces.concat()))
        + &array("Int64", "face_offsets", ends(&faces.iter().map(|face| face.len()).collect::<Vec<_>>()))
        + &array("Int64", "polyhedron_to_faces", join(numbers))
        + &array("Int64", "polyhedron_offsets", "6 11 11 15".into()));
    [("polyhedra.vtk", legacy.into_bytes()), ("listed.vtu", listed), ("numbered.vtu", numbered)]
}

/// The signed volume of a tetrahedron.
pub fn volume(mesh: &Mesh, tet: [u32; 4]) -> f64 {
    let [a, b, c, d] = tet.map(|v| mesh.points[v as usize].map(f64::from));
    let [u, v, w] = [b, c, d].map(|p| [p[0] - a[0], p[1] - a[1], p[2] - a[2]]);
    (u[0] * (v[1] * w[2] - v[2] * w[1]) - u[1] * (v[0] * w[2] - v[2] * w[0]) + u[2] * (v[0] * w[1] - v[1] * w[0])) / 6.0
}

/// The number of tetrahedra that share each face.
pub fn faces(mesh: &Mesh) -> HashMap<[u32; 3], u32> {
    let mut faces = HashMap::new();
    for t in &mesh.tets {
        for face in [[t[1], t[2], t[3]], [t[0], t[2], t[3]], [t[0], t[1], t[3]], [t[0], t[1], t[2]]] {
            let mut face = face;
            face.sort_unstable();
            *faces.entry(face).or_insert(0) += 1;
        }
    }
    faces
}
