//! Spellings of VTK files, XML and legacy: what VTK reads or writes is read here, too.

use crate::small::{POINTS, all, open_bytes, replace, small};
use olbvh::formats::{Fate, LoadOptions, Loaded, Merge, TimeStep, load_bytes, load_points};

/// The cell field `c`, 0 to 5, serves as marks of ghosts here.
#[test]
fn ghost_cells_are_left_out() {
    for (name, old, new) in [
        ("ascii.vtk", "SCALARS c int", "SCALARS GHOST int"),
        ("binary.vtk", "SCALARS c short", "SCALARS GHOST short"),
        ("v51.vtk", "SCALARS c int", "SCALARS GHOST int"),
        ("ascii.vtu", "Name=\"c\"", "Name=\"GHOST\""),
        ("raw.vtu", "Name=\"c\"", "Name=\"GHOST\""),
    ] {
        for (ghost, wanted) in [("vtkGhostType", &[0, 2, 4][..]), ("vtkGhostLevels", &[0])] {
            let Loaded { mesh, report } = open_bytes(name, replace(name, old.as_bytes(), new.replace("GHOST", ghost).as_bytes()));
            assert_eq!(mesh.cell_ids.as_deref(), Some(wanted), "{name}: {ghost}");
            assert_eq!((mesh.source_cells, report.count(Fate::Ghost)), (6, 6 - wanted.len() as u64), "{name}: {ghost}");
            assert!(mesh.field(ghost).is_none() && mesh.field("s").is_some(), "{name}: {ghost}");
        }
    }
}

#[test]
fn hidden_cells_are_left_out() {
    let marks = "Name=\"vtkGhostType\" NumberOfComponents=\"1\" format=\"ascii\">0 32 0 0 8 40<";
    let old = "Name=\"c\" NumberOfComponents=\"1\" format=\"ascii\">0 1 2 3 4 5<";
    let Loaded { mesh, report } = open_bytes("hidden.vtu", replace("ascii.vtu", old.as_bytes(), marks.as_bytes()));
    assert_eq!(mesh.cell_ids.unwrap(), [0, 2, 3, 4]);
    assert!(report.to_string().contains("2 ghost or hidden cell: left out"), "{report}");
}

#[test]
fn numbers_as_windows_writes_them() {
    let odd = ">1.#QNAN -1.#IND00 1.#INF -1.#inf 1.#SNAN -nan(ind) nan(0x8000000000000) 7<";
    let Loaded { mesh, report } = open_bytes("odd.vtu", replace("ascii.vtu", b">0 1 2 3 4 5 6 7<", odd.as_bytes()));
    assert_eq!(report.warnings, ["array `s` has no value, or none that is finite in single precision, at 7 of 8 points"]);
    let values = &mesh.field("s").unwrap().values;
    assert!(values[..7].iter().all(|v| v.is_nan()) && values[7] == 7.0);
}

#[test]
fn entities_of_xml_matter_in_arrays_only() {
    let key = "<InformationKey name=\"UNITS\">N&amp;m</InformationKey>";
    assert!(
        open_bytes("key.vtu", replace("ascii.vtu", b"</DataArray>", format!("{key}</DataArray>").as_bytes())).report.warnings.is_empty()
    );
    let error = load_bytes("in.vtu", replace("ascii.vtu", b"</DataArray>", b"&amp;</DataArray>"), &LoadOptions::default()).unwrap_err();
    assert!(error.to_string().contains("line 5: an entity reference in the data"), "{error}");
}

#[test]
fn arrays_of_bits_are_named_as_such() {
    let report = open_bytes("bits.vtu", replace("ascii.vtu", b"type=\"Float32\"", b"type=\"Bit\"")).report;
    assert_eq!(report.warnings, ["array `s` holds text or bits and is left out"]);
}

#[test]
fn empty_lines_before_the_coding_of_legacy_files() {
    assert_eq!(open_bytes("lines.vtk", replace("ascii.vtk", b"ASCII", b"\n\nASCII")).mesh.tets.len(), 6);
    assert_eq!(open_bytes("lines.vtk", replace("binary.vtk", b"BINARY", b"\nBINARY ")).mesh.tets.len(), 6);
}

/// Text files have them as fractions of 255, binary files as they are.
#[test]
fn bytes_that_are_the_active_scalars() {
    let fractions = "COLOR_SCALARS c 1\n0 0.00392157 0.00784314 0.0117647 0.0156863 0.0196078\n";
    is_whole("colours.vtk", replace("ascii.vtk", b"SCALARS c int 1\nLOOKUP_TABLE default\n0 1 2 3 4 5\n", fractions.as_bytes()));
    let shorts: Vec<u8> = (0..6i16).flat_map(i16::to_be_bytes).collect();
    let old = [b"SCALARS c short\nLOOKUP_TABLE default\n", shorts.as_slice()].concat();
    is_whole("colours.vtk", replace("binary.vtk", &old, b"COLOR_SCALARS c 1\n\x00\x01\x02\x03\x04\x05"));
}

/// VTK writes several time steps into one file on demand; what stays the same names several.
#[test]
fn one_of_several_time_steps_is_read() {
    let text = String::from_utf8(small("ascii.vtu")).unwrap();
    let again = |text: &str, name: &str, first: &str| {
        let at = text.find(&format!("Name=\"{name}\"")).unwrap();
        let [begin, end] = [text[..at].rfind("<DataArray").unwrap(), at + text[at..].find("</DataArray>").unwrap() + 12];
        let array = &text[begin..end];
        let step = |steps: &str| array.replace("Name=", &format!("TimeStep=\"{steps}\" Name="));
        let later = step("5").replace('1', "7").replace(">0 ", ">9 ");
        format!("{}{}{later}{}", &text[..begin], step(first), &text[end..])
    };
    let steps = again(&again(&again(&text, "s", "3"), "Points", "3 4"), "connectivity", "3");
    let at = |step| load_bytes("steps.vtu", steps.clone().into_bytes(), &LoadOptions { step, ..LoadOptions::default() });
    let Loaded { mesh, report } = at(TimeStep::Number(0)).unwrap();
    let plain = open_bytes("ascii.vtu", text.clone().into_bytes()).mesh;
    assert_eq!((&mesh.points, &mesh.tets), (&plain.points, &plain.tets));
    assert_eq!((mesh.fields.len(), &mesh.field("s").unwrap().values), (2, &plain.field("s").unwrap().values));
    assert!(report.warnings.len() == 1 && report.warnings[0].starts_with("time step 0 of 0 to 2 is read; "), "{report}");
    // The second has points only.
    let error = at(TimeStep::Number(1)).unwrap_err().to_string();
    assert!(error.contains("no array `connectivity` in <Cells>"), "{error}");
    let error = at(TimeStep::Number(3)).unwrap_err().to_string();
    assert!(error.ends_with("there is no time step 3; the steps are 0 to 2"), "{error}");
    let array = |steps: &str, first: &str| format!("<DataArray TimeStep=\"{steps}\" type=\"Float32\" Name=\"s\">{first} 1 2 3 4 5 6 7<");
    let old = "<DataArray type=\"Float32\" Name=\"s\" NumberOfComponents=\"1\" format=\"ascii\">0 1 2 3 4 5 6 7<";
    let three = [array("0", "10"), array("1 2", "11"), array("7", "12")].join("/DataArray>\n");
    let series = replace("ascii.vtu", old.as_bytes(), three.as_bytes());
    for (step, number, wanted) in [("0", 0, 10.0), ("1", 1, 11.0), ("2", 2, 11.0), ("3", 3, 12.0), ("last", 3, 12.0)] {
        let options = LoadOptions { step: step.parse().unwrap(), ..LoadOptions::default() };
        let Loaded { mesh, report } = load_bytes("series.vtu", series.clone(), &options).unwrap();
        assert_eq!((mesh.fields.len(), mesh.field("s").unwrap().values[0]), (2, wanted), "{step}");
        assert!(report.warnings[0].starts_with(&format!("time step {number} of 0 to 3 is read; ")), "{report}");
    }
    let plain_step = LoadOptions { step: TimeStep::Number(7), ..LoadOptions::default() };
    assert!(load_bytes("ascii.vtu", text.clone().into_bytes(), &plain_step).is_ok());
    let points = again(&text, "Points", "3").replace(" TimeStep=\"5\"", "").replace(" TimeStep=\"3\"", "");
    let Loaded { mesh, report } = open_bytes("points.vtu", points.into_bytes());
    assert_eq!((mesh.points, report.warnings), (plain.points, vec!["<Points> has several arrays, of which the first is read".to_owned()]));
}

#[test]
fn parametric_volumes_are_missed() {
    let report = open_bytes("odd.vtk", replace("ascii.vtk", b"CELL_TYPES 6\n10", b"CELL_TYPES 6\n55")).report;
    assert_eq!((report.count(Fate::Unsupported), report.count(Fate::Boundary)), (1, 0), "{report}");
}

/// Of three pieces, the first and the last have the array `a`, in the last with twice as many components; the second
/// has `b`.
#[test]
fn arrays_of_some_pieces() {
    let values = |name: &str, values: [i32; 4]| {
        let text = values.map(|v| v.to_string()).join(" ");
        format!("<DataArray type=\"Int32\" Name=\"{name}\" format=\"ascii\">{text}</DataArray>")
    };
    let points = "0 0 0 1 0 0 0 1 0 0 0 1";
    let piece = |arrays: [String; 2]| {
        format!(
            "<Piece NumberOfPoints=\"4\" NumberOfCells=\"1\"><PointData>{}</PointData>
            <Points><DataArray type=\"Float64\" NumberOfComponents=\"3\">{points}</DataArray></Points>
            <Cells><DataArray type=\"Int32\" Name=\"connectivity\">0 1 2 3</DataArray><DataArray type=\"Int32\" Name=\"offsets\">4</DataArray>
            <DataArray type=\"UInt8\" Name=\"types\">10</DataArray></Cells></Piece>",
            arrays.concat()
        )
    };
    let pieces = [
        piece([values("a", [0, 1, 2, 3]), values("a", [4, 5, 6, 7])]),
        piece([values("b", [1, 1, 1, 1]), String::new()]),
        piece([values("a", [8, 9, 8, 9]), values("a", [7, 6, 7, 6])]),
    ];
    let file = format!("<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid>{}</UnstructuredGrid></VTKFile>", pieces.concat());
    let apart = LoadOptions { merge: Merge::Nothing, ..LoadOptions::default() };
    let mesh = load_bytes("three.vtu", file.into_bytes(), &apart).unwrap().mesh;
    let found: Vec<_> =
        mesh.fields.iter().map(|f| (f.name.as_str(), f.values.iter().map(|&v| v as i32 - i32::from(v.is_nan())).collect())).collect();
    let wanted: [(&str, Vec<i32>); 3] = [
        ("a", vec![0, 1, 2, 3, -1, -1, -1, -1, 8, 9, 8, 9]),
        ("a (again)", vec![4, 5, 6, 7, -1, -1, -1, -1, 7, 6, 7, 6]),
        ("b", vec![-1, -1, -1, -1, 1, 1, 1, 1, -1, -1, -1, -1]),
    ];
    assert_eq!(found, wanted);
}

/// Checks that a spelling of a small file has its two fields and no others.
fn is_whole(name: &str, bytes: Vec<u8>) {
    let Loaded { mesh, report } = open_bytes(name, bytes);
    let mut fields: Vec<_> = mesh.fields.iter().map(|f| (f.name.as_str(), f.values.clone())).collect();
    fields.sort_by(|a, b| a.0.cmp(b.0));
    let count = |n: u8| (0..n).map(f32::from).collect::<Vec<_>>();
    assert_eq!((mesh.tets.len(), fields), (6, vec![("c", count(6)), ("s", count(8))]), "{name}");
    assert!(report.warnings.is_empty(), "{name}: {report}");
}

#[test]
fn data_of_xml_may_be_quoted() {
    let whole = "<![CDATA[0 1 2 3 4 5 6 7]]>";
    for data in [whole, "\n<![CDATA[0 1 2]]> 3 <![CDATA[4 5 6 7]]>\n", "0 1 <!-- x --> 2 3 <![CDATA[]]> 4 5 6 7"] {
        is_whole("quoted.vtu", replace("ascii.vtu", b">0 1 2 3 4 5 6 7<", format!(">{data}<").as_bytes()));
    }
    let text = String::from_utf8(all().into_iter().find(|f| f.0 == "base64.vtu").unwrap().1).unwrap();
    let quoted = text.replace("binary\">", "binary\"><![CDATA[").replace("</DataArray>", "]]></DataArray>");
    assert_eq!(quoted.matches("CDATA[").count(), 6);
    is_whole("quoted.vtu", quoted.into_bytes());
    let error = load_bytes("odd.vtu", replace("ascii.vtu", b">0 1 2 3 4", b"><![CDATA[0 1 2 3 four]]>"), &LoadOptions::default());
    assert!(error.unwrap_err().to_string().contains("`four` is not a number"));
}

#[test]
fn appended_data_may_be_empty() {
    for empty in ["<AppendedData encoding=\"raw\"/>", "<AppendedData/>", "<AppendedData encoding=\"base64\">\n</AppendedData>"] {
        is_whole("empty.vtu", replace("ascii.vtu", b"</VTKFile>", format!("{empty}\n</VTKFile>").as_bytes()));
        let first = format!("{empty}<UnstructuredGrid>");
        if empty.ends_with("/>") {
            is_whole("first.vtu", replace("ascii.vtu", b"<UnstructuredGrid>", first.as_bytes()));
        }
        let text = String::from_utf8(replace("ascii.vtu", b"</VTKFile>", format!("{empty}\n</VTKFile>").as_bytes())).unwrap();
        let missing = text.replacen("format=\"ascii\"", "format=\"appended\" offset=\"0\"", 1).into_bytes();
        let error = load_bytes("missing.vtu", missing, &LoadOptions::default()).unwrap_err().to_string();
        assert!(error.contains("array `s`") && error.contains("the file has no appended data"), "{error}");
    }
}

#[test]
fn look_up_tables_may_be_anywhere() {
    let scalars = b"SCALARS c int 1\nLOOKUP_TABLE default\n";
    for spelling in [
        "SCALARS c int\n\n \nLOOKUP_TABLE default\n",
        "SCALARS c int LOOKUP_TABLE default\n",
        "SCALARS c int 1 lookup_table default ",
        "SCALARS c int 1\n\nLOOKUP_TABLE\ndefault\n",
        "SCALARS c int 1\n",
        "SCALARS c int\n",
    ] {
        is_whole(spelling, replace("ascii.vtk", scalars, spelling.as_bytes()));
    }
    let scalars = b"SCALARS s float\nLOOKUP_TABLE default\n";
    for spelling in [
        "SCALARS s float 1\n\nLOOKUP_TABLE default\n",
        "SCALARS s float\r\n\r\nLOOKUP_TABLE default\r\n",
        "SCALARS s float LOOKUP_TABLE default\n",
        "SCALARS s float\n",
    ] {
        is_whole(spelling, replace("binary.vtk", scalars, spelling.as_bytes()));
    }
    let error = load_bytes("odd.vtk", replace("ascii.vtk", b"int 1\n", b"int ten\n"), &LoadOptions::default()).unwrap_err().to_string();
    assert!(error.contains("ten components, not 1 to 9"), "{error}");
}

#[test]
fn texts_of_legacy_files_are_skipped() {
    let lines = "a\n\nb c\n%20\nSCALARS\nf\n";
    let variants = "13 a 6 2\n11 0.5\n6 4 6 5 13 f%20\n";
    for (kind, values) in [("string", lines), ("utf8_string", lines), ("variant", variants), ("VARIANT", variants)] {
        for keyword in ["PEDIGREE_IDS", "EDGE_FLAGS"] {
            let texts = format!("{keyword} p {kind}\n{values}SCALARS c");
            is_whole(&texts, replace("ascii.vtk", b"SCALARS c", texts.as_bytes()));
        }
        let field = format!("FIELD FieldData 4\nNULL_ARRAY\nt 3 2 {kind}\n{values}NULL_ARRAY\ns");
        is_whole(&field, replace("ascii.vtk", b"FIELD FieldData 1\ns", field.as_bytes()));
    }
    let lengths = b"\xc1a\xc0\x80\x03b c\x40\0\0\x01d\0\0\0\0\0\0\0\x01e\xc1\n\n";
    for (kind, values) in [("string", &lengths[..]), ("utf8_string", lengths), ("variant", variants.as_bytes())] {
        let values = |head: String| [head.as_bytes(), values].concat();
        let ids = [values(format!("PEDIGREE_IDS p {kind}\n")), b"SCALARS c".to_vec()].concat();
        is_whole(kind, replace("binary.vtk", b"SCALARS c", &ids));
        let field = [values(format!("FIELD f 3\nNULL_ARRAY\nt 2 3 {kind}\n")), b"NULL_ARRAY\nSCALARS s".to_vec()].concat();
        is_whole(kind, replace("binary.vtk", b"SCALARS s", &field));
    }
    for (kind, wanted) in [("variant", "the file ends where"), ("string", "the file ends in an array of texts")] {
        let texts = format!("FIELD FieldData 1\nt 1 1000000 {kind}\ns");
        let cut = replace("ascii.vtk", b"FIELD FieldData 1\ns", texts.as_bytes());
        let error = load_bytes("cut.vtk", cut, &LoadOptions::default()).unwrap_err().to_string();
        assert!(error.contains(wanted), "{error}");
    }
}

/// As points to locate; there are no cells in it.
#[test]
fn surfaces_have_points() {
    let text = String::from_utf8(small("ascii.vtu")).unwrap();
    let (head, cells) = (text.find("<Cells>").unwrap(), text.find("</Cells>").unwrap() + "</Cells>".len());
    let surface = format!("{}<Polys><DataArray type=\"Int32\" Name=\"offsets\">4</DataArray></Polys>{}", &text[..head], &text[cells..]);
    let surface = surface.replace("UnstructuredGrid", "PolyData").replace("NumberOfCells=\"6\"", "NumberOfPolys=\"6\"");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("surface.vtp");
    std::fs::write(&path, surface).unwrap();
    assert_eq!(load_points(&path).unwrap(), POINTS);
    let error = load_bytes(&path, std::fs::read(&path).unwrap(), &LoadOptions::default()).unwrap_err().to_string();
    assert!(error.ends_with("and no other cells (a surface, of which only the points can be read)"), "{error}");
}
