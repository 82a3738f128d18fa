//! Readers for the vertices of surfaces (`.obj`, `.ply`, `.stl`, `.vtk` with polygons), whose points are located like those of
//! a mesh.

use super::scalar::Scalar;
use super::source::{Source, ending, excerpt};
use super::tokens::{Tokens, parse_float};
use super::vtk;
use crate::error::Result;

/// The vertices of a surface, in the order of the file; `None` if it is neither named like one nor begins like one, as what
/// comes from a stream may.
pub(crate) fn points(source: &Source) -> Option<Result<Vec<[f64; 3]>>> {
    let begins = |with: &[u8]| source.start().starts_with(with);
    match ending(&source.path).as_str() {
        "obj" => Some(obj(source)),
        "ply" => Some(ply(source)),
        "stl" => Some(stl(source)),
        _ if begins(b"# vtk DataFile") => vtk::surface_points(source),
        _ if begins(b"ply\n") || begins(b"ply\r") => Some(ply(source)),
        _ if begins(b"solid") || is_binary_stl(source) => Some(stl(source)),
        _ => None,
    }
}

/// The words of a line.
fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty())
}

/// The point of a line at this position whose other words are `words`. What follows the coordinates, such as a colour, is skipped.
fn vertex<'l>(source: &Source, line: &[u8], at: usize, mut words: impl Iterator<Item = &'l [u8]>) -> Result<[f64; 3]> {
    let point = [(); 3].map(|()| words.next().and_then(parse_float));
    let [Some(x), Some(y), Some(z)] = point else {
        return Err(source.error_line(at, format!("`{}` where a vertex should have three coordinates", excerpt(line))));
    };
    Ok([x, y, z])
}

/// The points of the lines that begin with `v`.
fn obj(source: &Source) -> Result<Vec<[f64; 3]>> {
    let (mut tokens, mut points) = (Tokens::new(source, None), Vec::new());
    while let Some((line, at)) = tokens.line()? {
        let mut words = words(line);
        if words.next() == Some(b"v") {
            points.push(vertex(source, line, at, words)?);
        }
    }
    Ok(points)
}

/// Bytes of the header and the number of triangles in a binary `.stl`, and of a triangle: its normal, its vertices, and two
/// more.
const STL: [usize; 2] = [84, 50];

/// Whether a file has the length that it announces as a binary `.stl`.
fn is_binary_stl(source: &Source) -> bool {
    let count = source.start().get(80..STL[0]).and_then(|bytes| Scalar::U32.one::<i64>(bytes, false));
    let length = count.and_then(|n| usize::try_from(n).ok()?.checked_mul(STL[1])?.checked_add(STL[0]));
    length == Some(source.len())
}

/// Each triangle has three vertices of its own.
fn stl(source: &Source) -> Result<Vec<[f64; 3]>> {
    let mut tokens = Tokens::new(source, None);
    if !is_binary_stl(source) {
        return stl_text(source);
    }
    let mut points = Vec::new();
    tokens.bytes(STL[0])?;
    while let Some(triangle) = tokens.bytes(STL[1])? {
        let values: Vec<f64> = Scalar::F32.convert(&triangle[12..48], false);
        points.extend(values.chunks_exact(3).map(|p| [p[0], p[1], p[2]]));
    }
    Ok(points)
}

fn stl_text(source: &Source) -> Result<Vec<[f64; 3]>> {
    let (mut tokens, mut points) = (Tokens::new(source, None), Vec::new());
    // A solid and a facet that have begun, and the first point of the facet.
    let (mut solid, mut facet, mut first) = (false, None, 0);
    let is = |word: Option<&[u8]>, wanted: &str| word.is_some_and(|word| word.eq_ignore_ascii_case(wanted.as_bytes()));
    while let Some((line, at)) = tokens.line()? {
        let mut words = words(line);
        let word = words.next();
        if is(word, "vertex") {
            points.push(vertex(source, line, at, words)?);
        } else if is(word, "facet") {
            (facet, first) = (Some(at), points.len());
        } else if is(word, "endfacet") {
            let n = points.len() - first;
            if facet.take().is_some() && n != 3 {
                return Err(source.error_line(at, format!("a facet of {n} vertices ends; it must have three")));
            }
        } else if is(word, "solid") {
            solid = true;
        } else if is(word, "endsolid") || is(word, "end") && is(words.next(), "solid") {
            solid = false;
        }
    }
    // A binary file that is cut off may begin like a text, but it has bytes 0.
    let is_text = source.start().trim_ascii_start().starts_with(b"solid") && !source.start().contains(&0);
    if points.is_empty() && !is_text {
        return Err(source.error("neither text (`solid …`) nor binary of the length that it announces"));
    }
    let remedy = "it has been cut off; write or copy it again";
    match facet {
        Some(at) => {
            Err(source.error_line(source.len(), format!("the file ends in the facet that begins in line {}: {remedy}", source.line(at))))
        }
        None if solid => Err(source.error_line(source.len(), format!("the file ends without `endsolid`: {remedy}"))),
        None => Ok(points),
    }
}

/// The vertices must be the first element, as they always are.
fn ply(source: &Source) -> Result<Vec<[f64; 3]>> {
    let mut tokens = Tokens::new(source, None);
    let (mut big_endian, mut count, mut elements) = (None, 0u64, 0);
    let mut properties: Vec<(Scalar, Vec<u8>)> = Vec::new();
    loop {
        let (line, at) = tokens.line()?.ok_or_else(|| source.error("the file ends in the header of a .ply"))?;
        let words: Vec<&[u8]> = line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty()).collect();
        let fail = || source.error_line(at, format!("`{}` in the header of a .ply", excerpt(line)));
        match words.as_slice() {
            [b"end_header"] => break,
            [b"format", b"ascii", ..] => big_endian = None,
            [b"format", b"binary_little_endian", ..] => big_endian = Some(false),
            [b"format", b"binary_big_endian", ..] => big_endian = Some(true),
            [b"element", b"vertex", n] if elements == 0 => {
                (elements, count) = (1, std::str::from_utf8(n).ok().and_then(|n| n.parse().ok()).ok_or_else(fail)?);
            }
            [b"element", ..] if elements > 0 => elements += 1,
            [b"property", kind, name] if elements == 1 => properties.push((Scalar::ply(kind).ok_or_else(fail)?, name.to_vec())),
            [b"property", ..] if elements > 1 => {}
            [b"ply" | b"comment" | b"obj_info", ..] | [] => {}
            _ => return Err(fail()),
        }
    }
    let [Some(x), Some(y), Some(z)] = [b"x", b"y", b"z"].map(|axis| properties.iter().position(|(_, name)| name == axis)) else {
        return Err(source.error("the vertices of the .ply lack a property x, y or z"));
    };
    let (mut points, mut row) = (Vec::new(), Vec::new());
    for _ in 0..count {
        row.clear();
        for (scalar, _) in &properties {
            let at = tokens.at;
            row.push(match big_endian {
                None => tokens.float("a property of a vertex")?,
                Some(big) => {
                    let value = tokens.bytes(scalar.size())?.and_then(|bytes| scalar.one(bytes, big));
                    value.ok_or_else(|| source.error_byte(at, "the file ends where a property of a vertex should be"))?
                }
            });
        }
        points.push([row[x], row[y], row[z]]);
    }
    Ok(points)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(name: &str, bytes: &[u8]) -> Result<Vec<[f64; 3]>, String> {
        points(&Source::new(name.as_ref(), bytes.to_vec())).unwrap().map_err(|error| error.to_string())
    }

    const WANTED: [[f64; 3]; 3] = [[0.0, 0.5, 1.0], [1.0, 0.0, 2.0], [-1.0, 3.0, 0.25]];

    const STL_TEXT: &str = "solid s\n facet normal 0 0 1\n  outer loop\n   vertex 0 0.5 1\n   vertex 1 0 2\n   vertex -1 3 2.5e-1\n  endloop\n \
                            endfacet\nendsolid s\n";

    #[test]
    fn vertices_are_those_of_the_file_in_its_order() {
        let obj = b"# a\nmtllib x\nv 0 0.5 1\nvn 0 0 1\nv 1 0 2 1 0.5 0.5 0.5\r\nvt 0 0\nv\t-1 3 .25\nf 1/1/1 2 3\n";
        assert_eq!(read("a.OBJ", obj).unwrap(), WANTED);
        let header = |format: &str| {
            let vertices = "element vertex 3\nproperty uchar red\nproperty float x\nproperty double y\nproperty float32 z\n";
            format!("ply\nformat {format} 1.0\ncomment c\n{vertices}element face 1\nproperty list uchar int vertex_indices\nend_header\n")
        };
        assert_eq!(read("a.ply", (header("ascii") + "9 0 0.5 1\n9 1 0 2\n9 -1 3 0.25\n3 0 1 2\n").as_bytes()).unwrap(), WANTED);
        for big in [false, true] {
            let mut bytes = header(if big { "binary_big_endian" } else { "binary_little_endian" }).into_bytes();
            for [x, y, z] in WANTED {
                let float = |v: f64| if big { (v as f32).to_be_bytes() } else { (v as f32).to_le_bytes() };
                let double = if big { y.to_be_bytes() } else { y.to_le_bytes() };
                bytes.extend([&b"\n"[..], &float(x), &double, &float(z)].concat());
            }
            assert_eq!(read("a.ply", &bytes).unwrap(), WANTED);
            assert!(read("a.ply", &bytes[..bytes.len() - 1]).unwrap_err().contains("the file ends where a property of a vertex should be"));
        }
        assert_eq!(read("-", (header("ascii") + "9 0 0.5 1\n9 1 0 2\n9 -1 3 0.25\n3 0 1 2\n").as_bytes()).unwrap(), WANTED);
        let field = "FIELD FieldData 1\nTIME 1 1 double\n7\n";
        let points = "POINTS 3 float\n0 0.5 1 1 0 2\n-1 3 0.25\nVERTICES 1 2\n1 0\n";
        let vtk = format!("# vtk DataFile Version 3.0\na\nASCII\nDATASET POLYDATA\n{field}{points}");
        assert_eq!(read("a.vtk", vtk.as_bytes()).unwrap(), WANTED);
        assert_eq!(read("a.stl", STL_TEXT.as_bytes()).unwrap(), WANTED);
        assert_eq!(read("a.stl", STL_TEXT.to_ascii_uppercase().replace("ENDSOLID", "end solid").as_bytes()).unwrap(), WANTED);
        // The header of a binary file may begin like a text.
        let mut binary = [&b"solid s"[..], &[0; 73], &1u32.to_le_bytes(), &[0; 12]].concat();
        binary.extend(WANTED.as_flattened().iter().flat_map(|v| (*v as f32).to_le_bytes()));
        binary.extend([0; 2]);
        assert_eq!(read("a.stl", &binary).unwrap(), WANTED);
        // From a stream, its length tells it.
        binary[..5].copy_from_slice(b"made ");
        assert_eq!(read("-", &binary).unwrap(), WANTED);
        assert!(super::points(&Source::new("-".as_ref(), binary[1..].to_vec())).is_none());
    }

    #[test]
    fn broken_surfaces_are_refused_with_the_place() {
        for (name, content, wanted) in [
            ("a.obj", "v 0 0 0\nv 1 x 0\n", "a.obj: line 2: `v 1 x 0` where a vertex should have three coordinates"),
            ("a.ply", "ply\nformat ascii 1.0\nelement vertex 9", "a.ply: the file ends in the header of a .ply"),
            ("a.ply", "ply\nelement face 9\n", "a.ply: line 2: `element face 9` in the header of a .ply"),
            ("a.ply", "ply\nelement vertex 1\nproperty float x\nend_header\n", "a.ply: the vertices of the .ply lack a property x, y or z"),
            ("a.stl", "\0\0", "a.stl: neither text (`solid …`) nor binary of the length that it announces"),
        ] {
            assert_eq!(read(name, content.as_bytes()).unwrap_err(), wanted);
        }
        // Cut off anywhere but in the last line.
        let end = STL_TEXT.find("endsolid").unwrap();
        for cut in 6..=end {
            let error = read("a.stl", &STL_TEXT.as_bytes()[..cut]).unwrap_err();
            let line = 1 + STL_TEXT[..cut].matches('\n').count();
            assert!(error.starts_with(&format!("a.stl: line {line}: ")), "{error}");
        }
        let whole = |cut: usize| read("a.stl", &STL_TEXT.as_bytes()[..cut]).unwrap_err();
        let remedy = "it has been cut off; write or copy it again";
        assert_eq!(whole(end), format!("a.stl: line 9: the file ends without `endsolid`: {remedy}"));
        let facet = STL_TEXT.find("endloop").unwrap();
        assert_eq!(whole(facet), format!("a.stl: line 7: the file ends in the facet that begins in line 2: {remedy}"));
        let two = STL_TEXT.replace("   vertex 1 0 2\n", "");
        assert_eq!(read("a.stl", two.as_bytes()).unwrap_err(), "a.stl: line 7: a facet of 2 vertices ends; it must have three");
        // Binary, and cut off.
        let binary = [&b"solid s"[..], &[0; 73], &9u32.to_le_bytes(), &[0; 50]].concat();
        assert!(read("a.stl", &binary).unwrap_err().contains("nor binary of the length that it announces"));
    }
}
