//! Detection of a file's format: by its content, or else by its name.

use super::isaac;
use super::source::{Source, ending, skip_comments};
use crate::error::Result;

/// A format that can be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Format {
    VtkXml,
    Series,
    VtkLegacy,
    Gmsh,
    Medit,
    MeditBinary,
    TetGen,
    Isaac,
    Abaqus,
    Vega,
}

/// File name extensions of the formats that can be read.
pub(crate) const READABLE: &str =
    ".vtu, .pvtu, .vts, .vtr, .vti, .vtm, .pvd, .vtk, .msh, .mesh, .meshb, .node with .ele, .inp of Abaqus, .veg, .tet of Isaac Gym";
const CONVERT: &str = "convert it to .vtu, for example with meshio (`meshio convert IN OUT.vtu`) or ParaView";
/// For what meshio cannot read.
const SAVE_AS: &str = "save it as .vtu, for example with ParaView (File, Save Data)";

/// Keywords that input files of Abaqus begin with.
const ABAQUS: [&[u8]; 6] = [b"*HEADING", b"*NODE", b"*PART", b"*INCLUDE", b"*PREPRINT", b"*ASSEMBLY"];

/// The format that the content of a file tells.
fn told(source: &Source) -> Result<Option<Format>> {
    let (bytes, ending) = (source.start(), ending(&source.path));
    let start = &bytes[skip_comments(bytes)..];
    let is = |prefix: &[u8]| start.get(..prefix.len()).is_some_and(|b| b.eq_ignore_ascii_case(prefix));
    Ok(if bytes.trim_ascii_start().starts_with(b"# vtk DataFile") {
        Some(Format::VtkLegacy)
    } else if is(b"<") {
        Some(Format::VtkXml)
    } else if ending == "series" && is(b"{") {
        Some(Format::Series)
    } else if is(b"$") {
        Some(Format::Gmsh)
    } else if is(b"MeshVersionFormatted") {
        Some(Format::Medit)
    } else if is(b"*VERTICES") || is(b"*ELEMENTS") || ending == "veg" && is(b"*") {
        Some(Format::Vega)
    } else if ABAQUS.iter().any(|keyword| is(keyword)) || ending == "inp" && is(b"*") {
        Some(Format::Abaqus)
    } else if is(b"v ") && isaac::has_tetrahedra(source)? {
        Some(Format::Isaac)
    } else {
        None
    })
}

/// The format that the name of a file tells.
fn named(source: &Source) -> Option<Format> {
    let is_binary = [[1, 0, 0, 0], [0, 0, 0, 1]].iter().any(|one| source.start().starts_with(one));
    match ending(&source.path).as_str() {
        "vtu" | "pvtu" | "vts" | "pvts" | "vtr" | "pvtr" | "vti" | "pvti" | "vtm" | "vtpd" | "vtpc" | "pvd" => Some(Format::VtkXml),
        "vtk" => Some(Format::VtkLegacy),
        "msh" => Some(Format::Gmsh),
        "mesh" | "meshb" => Some(if is_binary { Format::MeditBinary } else { Format::Medit }),
        "node" | "ele" => Some(Format::TetGen),
        _ => None,
    }
}

/// Whether a file is a mesh, or named like one, and not an array or a table of points.
pub(crate) fn is_mesh(source: &Source) -> Result<bool> {
    Ok(named(source).is_some() || told(source)?.is_some())
}

/// Detects the format of a file; for a file that cannot be read, returns an error that names what was found.
pub(crate) fn detect(source: &Source) -> Result<Format> {
    let bytes = source.start();
    let ending = ending(&source.path);
    if bytes.iter().all(u8::is_ascii_whitespace) {
        return Err(source.error(if bytes.is_empty() { "the file is empty" } else { "the file has nothing but white space" }));
    }
    if let Some(found) = foreign_binary(bytes, &ending) {
        return Err(source.error(found));
    }
    if let Some(format) = told(source)? {
        return Ok(format);
    }
    let start = skip_comments(bytes);
    let is = |prefix: &[u8]| bytes[start..].get(..prefix.len()).is_some_and(|b| b.eq_ignore_ascii_case(prefix));
    let has_dollar = bytes.trim_ascii_start().starts_with(b"$");
    if let Some(found) = foreign_text(&is, has_dollar, &ending) {
        return Err(source.error(found));
    }
    named(source).ok_or_else(|| {
        source.error(match ending.as_str() {
            "inp" => format!("looks like AVS UCD, which cannot be read; {CONVERT}"),
            "" => format!("its content is not recognised, and it has no ending; readable are {READABLE}"),
            other => format!("neither its content nor the ending .{other} is one of {READABLE}; {CONVERT}"),
        })
    })
}

fn foreign_binary(bytes: &[u8], ending: &str) -> Option<String> {
    let is = |magic: &[u8]| bytes.starts_with(magic);
    let found = if is(b"\xff\xfe") || is(b"\xfe\xff") || bytes.starts_with(b"<\0") || bytes.starts_with(b"\0<") {
        return Some("text in UTF-16; save it as UTF-8".into());
    } else if is(b"\x1f\x8b") {
        return Some("compressed with gzip; unpack it first (gunzip)".into());
    } else if is(b"\xfd7zXZ") || is(b"BZh") || is(b"\x28\xb5\x2f\xfd") || is(b"PK\x03\x04") || is(b"7z\xbc\xaf") {
        return Some("a compressed file or archive; unpack it first".into());
    } else if is(b"\x89PNG") || is(b"\xff\xd8\xff") || is(b"GIF8") || is(b"%PDF") {
        return Some("an image or document, not a mesh".into());
    } else if is(b"\x89HDF\r\n") {
        match ending {
            "vtkhdf" | "hdf" => "VTKHDF",
            "e" | "ex2" | "exo" | "exii" => "Exodus II (in HDF5)",
            "med" | "rmed" => "MED (in HDF5)",
            "cgns" => "CGNS (in HDF5)",
            "h5m" => "MOAB (in HDF5)",
            _ => "HDF5 (Exodus II, VTKHDF, CGNS, MED …)",
        }
    } else if is(b"CDF\x01") || is(b"CDF\x02") || is(b"CDF\x05") {
        "Exodus II (in NetCDF)"
    } else {
        return None;
    };
    let advice = if found == "VTKHDF" { SAVE_AS } else { CONVERT };
    Some(format!("a file in {found}, which cannot be read; {advice}"))
}

/// Names a foreign format of text. `is` tells whether the first line that is no comment starts like this, `has_dollar`
/// whether the file starts with a comment after `$`.
fn foreign_text(is: &dyn Fn(&[u8]) -> bool, has_dollar: bool, ending: &str) -> Option<String> {
    let any = |prefixes: &[&str]| prefixes.iter().any(|p| is(p.as_bytes()));
    let save = || format!("save it in a format that can be read ({READABLE}) with the program that made it");
    let (found, advice) = if any(&["MFEM "]) {
        ("an MFEM mesh, which cannot be read", save())
    } else if any(&["*KEYWORD"]) {
        ("an LS-DYNA keyword file, which cannot be read", save())
    } else if ["bdf", "nas"].contains(&ending) || (ending == "dat" && (has_dollar || any(&["SOL ", "CEND", "BEGIN BULK", "GRID"]))) {
        ("a Nastran file, which cannot be read", CONVERT.into())
    } else if any(&["FoamFile", "/*--------------------------------*- C++ -*-"]) {
        ("an OpenFOAM file, which cannot be read", "convert it to .vtu, for example with ParaView".into())
    } else if any(&["TITLE", "VARIABLES"]) && ["dat", "plt", "tec"].contains(&ending) {
        ("a Tecplot file, which cannot be read", CONVERT.into())
    } else if any(&["(0 ", "(1 ", "(2 "]) {
        ("a Fluent mesh, which cannot be read", CONVERT.into())
    } else if any(&["solid ", "OFF\n", "ply\n", "ply\r", "v "]) {
        ("a surface or other geometry without volume cells", "fill it with tetrahedra first, for example with TetGen or Gmsh".into())
    } else {
        return None;
    };
    Some(format!("{found}; {advice}"))
}
