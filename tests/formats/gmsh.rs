//! Sections of Gmsh files that only some options of Gmsh write.

use crate::small::{POINTS, TETS, open_bytes, small};
use olbvh::formats::{LoadOptions, TimeStep, load_bytes};
use olbvh::mesh::Mesh;

/// Gmsh writes the mesh again with each view that is appended to a file.
#[test]
fn gmsh_repeats_the_mesh_with_each_view() {
    for name in ["v22.msh", "v22b.msh", "v40.msh", "v41.msh", "v41b.msh"] {
        let bytes = small(name);
        let [data, view] = [&b"$NodeData"[..], b"$ElementData"].map(|key| bytes.windows(key.len()).position(|w| w == key).unwrap());
        let twice = [&bytes[..view], &bytes[..data], &bytes[view..]].concat();
        let (plain, mesh) = (open_bytes(name, bytes.clone()).mesh, open_bytes(name, twice).mesh);
        let values = |mesh: &Mesh| mesh.fields.iter().map(|f| (f.name.clone(), f.values.clone())).collect::<Vec<_>>();
        assert_eq!((&mesh.points, &mesh.tets, values(&mesh)), (&plain.points, &plain.tets, values(&plain)), "{name}");
        let other = [&bytes[..view], b"$Nodes\n1\n1 0 0 0\n$EndNodes\n"].concat();
        if name == "v22.msh" {
            let error = load_bytes(name, other, &LoadOptions::default()).unwrap_err().to_string();
            assert!(error.contains("a second section $Nodes, with 1 entries instead of 8"), "{error}");
        }
    }
}

/// Version 2 with the option Mesh.SaveParametric: the dimension and number of an entity, and one or two parameters on curves
/// and surfaces.
#[test]
fn gmsh_nodes_may_have_parameters() {
    let text = String::from_utf8(small("v22.msh")).unwrap();
    let (before, rest) = text.split_once("$Nodes\n8\n").unwrap();
    let (nodes, after) = rest.split_once("$EndNodes").unwrap();
    let more = ["0 1", "1 2 0.5", "2 3 0.5 0.25", "3 4"];
    let nodes: String = nodes.lines().zip(more.iter().cycle()).map(|(node, more)| format!("{node} {more}\n")).collect();
    let whole = format!("{before}$ParametricNodes\n8\n{nodes}$EndParametricNodes{after}");
    let mesh = open_bytes("parametric.msh", whole.into_bytes()).mesh;
    let mut binary = small("v22b.msh");
    let end = binary.windows(10).position(|w| w == b"\n$EndNodes").unwrap();
    let start = end - 8 * 28;
    let nodes: Vec<u8> = (0..8)
        .flat_map(|i| {
            let more: Vec<u8> = [i as i32 % 4, 9].into_iter().flat_map(i32::to_le_bytes).collect();
            [&binary[start + 28 * i..][..28], &more, &[7; 16][..[0, 8, 16, 0][i % 4]]].concat()
        })
        .collect();
    binary.splice(start..end + 10, [nodes.as_slice(), b"\n$EndParametricNodes"].concat());
    let at = binary.windows(6).position(|w| w == b"$Nodes").unwrap();
    binary.splice(at..at + 6, b"$ParametricNodes".iter().copied());
    let other = open_bytes("parametric.msh", binary).mesh;
    let points: Vec<[f32; 3]> = POINTS.iter().map(|p| p.map(|x| x as f32)).collect();
    assert_eq!((&mesh.points, &other.points), (&points, &points));
    assert_eq!((mesh.tets.as_slice(), other.tets.as_slice()), (&TETS[..], &TETS[..]));
}

/// A series has a view for each step; what has only one belongs to all.
#[test]
fn gmsh_views_of_several_time_steps() {
    let text = String::from_utf8(small("v22.msh")).unwrap();
    let nodes: Vec<&str> = text.lines().skip_while(|line| *line != "$Nodes").skip(2).take(8).collect();
    let tags: Vec<&str> = nodes.iter().filter_map(|node| node.split(' ').next()).collect();
    let view = |name: &str, step: u32, value: u32| {
        let values: String = tags.iter().zip(1..).map(|(tag, i)| format!("{tag} {}\n", value + i)).collect();
        format!("$NodeData\n1\n\"{name}\"\n1\n0.5\n3\n{step}\n1\n8\n{values}$EndNodeData\n")
    };
    let (mesh, _) = text.split_once("$NodeData").unwrap();
    let text = [mesh, &view("t", 10, 100), &view("still", 0, 0), &view("t", 9, 90), &view("t", 11, 110)].concat();
    let open = |step: TimeStep| load_bytes("a.msh", text.clone().into_bytes(), &LoadOptions { step, ..LoadOptions::default() });
    for (step, first, read) in [(TimeStep::Number(0), 91.0, 0), (TimeStep::Number(1), 101.0, 1), (TimeStep::Last, 111.0, 2)] {
        let loaded = open(step).unwrap();
        let fields: Vec<_> = loaded.mesh.fields.iter().map(|f| (f.name.as_str(), f.values[0])).filter(|f| !f.0.contains(':')).collect();
        assert!(
            fields.contains(&("t", first)) && fields.contains(&("still", 1.0)) && fields.len() == 2,
            "{fields:?} {:?}",
            loaded.report.warnings
        );
        let remark = format!("time step {read} of 0 to 2 is read");
        assert!(loaded.report.warnings.iter().any(|w| w.starts_with(&remark)), "{:?}", loaded.report.warnings);
    }
    let short = text.clone() + &view("s", 9, 0) + &view("s", 10, 0);
    let options = LoadOptions { step: TimeStep::Last, ..LoadOptions::default() };
    let warnings = load_bytes("a.msh", short.into_bytes(), &options).unwrap().report.warnings;
    assert!(warnings.contains(&"array `s` is left out: it has no values at this time step".into()), "{warnings:?}");
    assert!(open(TimeStep::Number(3)).unwrap_err().to_string().contains("there is no time step 3; the steps are 0 to 2"));
}
