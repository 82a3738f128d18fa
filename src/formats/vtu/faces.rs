//! The faces of polyhedra in VTK XML unstructured grids, which older and newer versions of VTK store differently.

use super::super::assemble::Assembly;
use super::super::integers::Integers;
use super::super::source::Source;
use super::data::{Codec, StoredArray};
use super::parser::Piece;
use crate::error::Result;

/// The faces of the polyhedra of a piece.
#[allow(clippy::large_enum_variant, reason = "there is one per piece")]
pub(super) enum Faces<'a> {
    /// The file describes none.
    None,
    /// Until VTK 9.3. For each polyhedron, the number of its faces, and for each face the number of its points and these.
    Listed {
        lists: Integers<'a>,
        /// Where the list of each cell ends; -1: the cell is no polyhedron.
        ends: Integers<'a>,
        /// Where the list of the next polyhedron begins.
        begin: usize,
    },
    /// Since VTK 9.4. Two cells may share a face.
    Numbered {
        /// The points of all faces.
        points: Integers<'a>,
        /// Where those of each face end.
        point_ends: Integers<'a>,
        /// The faces of all cells.
        faces: Integers<'a>,
        /// Where those of each cell end.
        ends: Integers<'a>,
        /// The list of the cell that was asked for last, in the form of `Listed`.
        list: Vec<i64>,
    },
}

impl<'a> Faces<'a> {
    /// Finds the faces of a piece.
    pub fn of(piece: &Piece, source: &'a Source, codec: &mut Codec) -> Result<Self> {
        let find = |name: &str| piece.topology.iter().find(|array| array.name == name);
        let mut read = |array: &StoredArray, count| codec.integers(source, array, count);
        let all = Some(piece.cells);
        if let [Some(points), Some(point_ends), Some(faces), Some(ends)] =
            ["face_connectivity", "face_offsets", "polyhedron_to_faces", "polyhedron_offsets"].map(find)
        {
            let (mut points, mut point_ends) = (read(points, None)?, read(point_ends, None)?);
            // Faces may be asked for in any order, so these are kept as a whole.
            points.slice(0..points.len())?;
            point_ends.slice(0..point_ends.len())?;
            return Ok(Self::Numbered { points, point_ends, faces: read(faces, None)?, ends: read(ends, all)?, list: Vec::new() });
        }
        match (find("faces"), find("faceoffsets")) {
            (Some(lists), Some(ends)) => Ok(Self::Listed { lists: read(lists, None)?, ends: read(ends, all)?, begin: 0 }),
            _ => Ok(Self::None),
        }
    }

    /// The list of the faces of a polyhedron, as [`Assembly::push_polyhedron`] takes it. All polyhedra must be asked
    /// for, in ascending order.
    pub fn list(&mut self, cell: usize, source: &Source, assembly: &mut Assembly) -> Result<&[i64]> {
        let fail = |message: String| source.error_in(format_args!("cell {cell}"), message);
        let range = |begin: i64, end: i64, most: usize, what: &str| {
            let fits = 0 <= begin && begin <= end && end <= most as i64;
            let range = fits.then_some(begin as usize..end as usize);
            range.ok_or_else(|| fail(format!("{what} would reach from {begin} to {end} of {most} values")))
        };
        match self {
            Self::None => Err(fail("a polyhedron, but its piece has no arrays of faces".into())),
            Self::Listed { lists, ends, begin } => {
                let found = range(*begin as i64, ends.at(cell)?, lists.len(), "its list in `faces`")?;
                *begin = found.end;
                lists.slice(found)
            }
            Self::Numbered { points, point_ends, faces, ends, list } => {
                let begin = |ends: &mut Integers<'_>, i: usize| if i == 0 { Ok(0) } else { ends.at(i - 1) };
                let of_cell = range(begin(ends, cell)?, ends.at(cell)?, faces.len(), "its list in `polyhedron_to_faces`")?;
                list.clear();
                list.push(of_cell.len() as i64);
                for i in of_cell {
                    let face = faces.at(i)?;
                    let number = usize::try_from(face).ok().filter(|&face| face < point_ends.len());
                    let number = number.ok_or_else(|| fail(format!("has face {face}, but there are {} faces", point_ends.len())))?;
                    let of_face = range(begin(point_ends, number)?, point_ends.at(number)?, points.len(), "a face in `face_connectivity`")?;
                    list.push(of_face.len() as i64);
                    let size = (of_face.len() * size_of::<i64>()) as u64;
                    assembly.padding.spend(size).map_err(|limit| fail(format!("the faces of all cells would take {limit}")))?;
                    list.extend_from_slice(points.slice(of_face)?);
                }
                Ok(list)
            }
        }
    }
}
