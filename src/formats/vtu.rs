//! Reader for VTK XML grids (`.vtu`, `.vts`, `.vtr`, `.vti`), versions 0.1 to 2.x, and for files that list such grids.
//! `parser` reads the structure, `data` the arrays, `faces` polyhedra; `files` opens what is listed.

mod data;
mod faces;
mod files;
mod outline;
pub(super) mod parser;

use std::collections::HashMap;

use super::LoadOptions;
use super::array::Array;
use super::assemble::Assembly;
use super::budget::Budget;
use super::cells::{self, CellType, Shape};
use super::lattice::{GridKind, Lattice};
use super::loss::Loss;
use super::report::Fate;
use super::source::{Source, excerpt};
use crate::error::Result;
use crate::mesh::On;
use data::Codec;
use faces::Faces;
use files::{Files, Grid, Origin, grids};
use parser::Piece;

/// Reads a mesh from a grid, or from the grids that the file lists, which are taken as pieces of one.
pub(crate) fn read(source: &Source, options: &LoadOptions) -> Result<Assembly> {
    let Files { format, mut grids, bytes, warnings } = grids(source, options)?;
    let mut assembly = Assembly::new(source, options, format);
    (assembly.bytes, assembly.padding, assembly.warnings) = (bytes as u64, Budget::new(bytes, options), warnings);
    let (mut points, mut starts) = (Vec::new(), Vec::new());
    for Grid { origin, codec, kind, pieces, block } in &mut grids {
        let mut opened = None;
        let source = origin.open(&mut opened)?;
        for (i, piece) in pieces.iter().enumerate() {
            starts.push([points.len(), *block]);
            read_points(source, codec, *kind, &mut points, piece, i)?;
        }
    }
    assembly.set_pieces(points, starts.clone());
    let (mut places, mut starts) = (Places::new(), starts.into_iter());
    for Grid { origin, codec, pieces, .. } in &mut grids {
        let mut opened = None;
        let source = origin.open(&mut opened)?;
        if let Origin::Listed(path) = &*origin {
            assembly.enter(path);
        }
        for (i, (piece, [start, _])) in pieces.iter().zip(&mut starts).enumerate() {
            let first_cell = assembly.cells();
            read_cells(source, codec, &mut assembly, piece, i, start)?;
            read_arrays(source, codec, &mut assembly, &mut places, piece, [start, first_cell])?;
        }
    }
    assembly.complete_arrays();
    Ok(assembly)
}

/// Identifies an array across pieces: arrays of different pieces with the same key continue each other.
type Key<'p> = (On, &'p str, u64);

/// Position of each array in the assembly. If a piece has several arrays with the same key, the n-th of them continues
/// the n-th of the other pieces.
type Places<'p> = HashMap<(Key<'p>, usize), usize>;

fn read_points(source: &Source, codec: &mut Codec, kind: GridKind, points: &mut Vec<[f64; 3]>, piece: &Piece, index: usize) -> Result<()> {
    if piece.points == 0 {
        return Ok(());
    }
    let fail = |message: &str| source.error_line(piece.at, format!("piece {index}: {message}"));
    match (kind, &piece.lattice) {
        (GridKind::Rectilinear, Some(lattice)) => {
            let [x, y, z] = piece.topology.as_slice() else { return Err(fail("<Coordinates> must have three arrays")) };
            if [x, y, z].iter().any(|array| array.components != 1) {
                return Err(fail("coordinates must have 1 component"));
            }
            lattice.spend(&mut codec.budget).map_err(|message| fail(&message))?;
            let [nx, ny, nz] = lattice.size();
            let axes = [codec.floats(source, x, nx)?, codec.floats(source, y, ny)?, codec.floats(source, z, nz)?];
            Lattice::at_coordinates(&axes, points);
            return Ok(());
        }
        (GridKind::Image(frame), Some(lattice)) => {
            lattice.spend(&mut codec.budget).map_err(|message| fail(&message))?;
            lattice.in_frame(&frame, points);
            return Ok(());
        }
        _ => {}
    }
    let positions = piece.positions.as_ref().ok_or_else(|| fail("no <Points>"))?;
    if positions.components != 3 {
        return Err(fail("the points must have 3 components"));
    }
    let values: Vec<f64> = codec.floats(source, positions, piece.points)?;
    points.extend(values.chunks_exact(3).map(|p| [p[0], p[1], p[2]]));
    Ok(())
}

/// Reads the values of points and cells; `before` holds the numbers of points and cells of earlier pieces.
fn read_arrays<'p>(
    source: &Source,
    codec: &mut Codec,
    assembly: &mut Assembly,
    places: &mut Places<'p>,
    piece: &'p Piece,
    before: [usize; 2],
) -> Result<()> {
    let mut turns: HashMap<Key<'p>, usize> = HashMap::new();
    let [points, cells] = before;
    let groups = [(On::Points, &piece.point_data, piece.points, points), (On::Cells, &piece.cell_data, piece.cells, cells)];
    for (on, arrays, count, before) in groups {
        for array in arrays {
            let shown = || excerpt(array.name.as_bytes());
            if array.scalar.is_none() {
                assembly.warn(format!("array `{}` holds text or bits and is left out", shown()));
            } else if array.components == 0 || array.components > 9 {
                assembly.warn(format!("array `{}` has {} components and is left out", shown(), array.components));
            } else {
                let values: Vec<f32> = codec.floats(source, array, count)?;
                let budget = codec.budget.clone();
                let loss = Loss::of(array.scalar, array.components as usize, &values, || codec.floats(source, array, count))?;
                codec.budget = budget; // what is read again takes no more memory than before
                // An empty piece does not require that an array is filled up.
                if values.is_empty() {
                    continue;
                }
                let key = (on, array.name.as_str(), array.components);
                let turn = *turns.entry(key).and_modify(|turn| *turn += 1).or_default();
                let place = *places.entry((key, turn)).or_insert_with(|| {
                    let components = array.components as usize;
                    assembly.arrays.push(Array { name: array.name.clone(), on, components, values: Vec::new(), loss: Loss::default() });
                    assembly.arrays.len() - 1
                });
                // An array that the budget does not allow to be filled up stays too short, and is left out at the end.
                let array = &mut assembly.arrays[place];
                array.loss.add(loss);
                if array.fill(before, &mut assembly.padding).is_ok() {
                    array.values.extend_from_slice(&values);
                }
            }
        }
    }
    Ok(())
}

fn read_cells(source: &Source, codec: &mut Codec, assembly: &mut Assembly, piece: &Piece, index: usize, first: usize) -> Result<()> {
    if piece.cells == 0 {
        return Ok(());
    }
    let points = first..first + piece.points as usize;
    let ghosts = piece.cell_data.iter().find_map(|a| Some((a, cells::ghost(&a.name).filter(|_| a.components == 1)?)));
    let mut ghosts = ghosts.map(|(a, marks)| Ok((codec.integers(source, a, Some(piece.cells))?, marks))).transpose()?;
    let mut is_ghost = |cell: usize| match &mut ghosts {
        Some((values, marks)) => values.at(cell).map(&*marks),
        None => Ok(false),
    };
    if let Some(lattice) = &piece.lattice {
        return lattice.push(assembly, points, is_ghost);
    }
    let find = |name: &str| {
        let found = piece.topology.iter().find(|a| a.name == name);
        found.ok_or_else(|| source.error_line(piece.at, format!("piece {index}: no array `{name}` in <Cells>")))
    };
    let mut types = codec.integers(source, find("types")?, Some(piece.cells))?;
    let mut offsets = codec.integers(source, find("offsets")?, Some(piece.cells))?;
    let mut connectivity = codec.integers(source, find("connectivity")?, None)?;
    let (all, last) = (connectivity.len() as i64, offsets.at(offsets.len() - 1)?);
    if last != all {
        let message = format!("the last cell of piece {index} ends at {last}, but `connectivity` has {all} values");
        return Err(source.error_in("array `offsets`", message));
    }
    let mut faces = None; // read when needed: pieces without polyhedra may have empty arrays of faces
    assembly.reserve(types.len());
    let mut start = 0;
    let mut kind: Option<(i64, CellType)> = None;
    for cell in 0..types.len() {
        let (number, end) = (types.at(cell)?, offsets.at(cell)?);
        if !(start..=all).contains(&end) {
            let message = format!("cell {cell} of piece {index} would reach from {start} to {end} of {all} values");
            return Err(source.error_in("array `offsets`", message));
        }
        let nodes = connectivity.slice(start as usize..end as usize)?;
        start = end;
        if kind.is_none_or(|(n, _)| n != number) {
            let found = cells::vtk(number);
            kind = Some((
                number,
                found.ok_or_else(|| source.error_in(format_args!("cell {cell}"), format!("unknown VTK cell type {number}")))?,
            ));
        }
        let Some((_, kind)) = kind else { continue };
        // That of a ghost is passed over.
        let list = if kind.shape == Shape::Polyhedron {
            let faces = match &mut faces {
                Some(faces) => faces,
                none => none.insert(Faces::of(piece, source, codec)?),
            };
            Some(faces.list(cell, source, assembly)?)
        } else {
            None
        };
        if is_ghost(cell)? {
            assembly.skip("ghost or hidden cell", Fate::Ghost);
        } else if let Some(list) = list {
            assembly.push_polyhedron(kind, list, points.clone())?;
        } else {
            assembly.push_within(kind, nodes, points.clone())?;
        }
    }
    Ok(())
}
