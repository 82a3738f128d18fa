//! Procedural meshes, made from names such as `kuhn:31,31,31,jitter=0.3` or `graded:24`.

use super::{CellCount, Fate, Loaded, Report};
use crate::error::{Error, Result};
use crate::mesh::{Mesh, far_field, graded, kuhn_jittered, shell, slivers};
use std::time::Instant;

/// The mesh that a text names, and its description; `None` if the text is not the name of a procedural mesh.
pub(crate) fn make(text: &str) -> Option<Result<(String, Mesh)>> {
    let (name, size) = text.split_once(':')?;
    let of: fn(u32) -> Result<Mesh> = match name {
        "kuhn" => return Some(kuhn(size)),
        "far-field" => far_field,
        "graded" => graded,
        "shell" => shell,
        "slivers" => slivers,
        _ => return None,
    };
    let n = size.trim().parse().map_err(|_| Error::Invalid(format!("{text}: write {name}:N with a whole number")));
    Some(n.and_then(of).map(|mesh| (text.to_owned(), mesh)))
}

fn kuhn(text: &str) -> Result<(String, Mesh)> {
    let wrong = |why: &str| Error::Invalid(format!("kuhn:{text}: {why}; write kuhn:NX,NY,NZ or kuhn:NX,NY,NZ,jitter=0.3,seed=7"));
    let mut parts = text.split(',').map(str::trim);
    let mut size = [0; 3];
    for n in &mut size {
        *n = parts.next().and_then(|p| p.parse().ok()).ok_or_else(|| wrong("three whole numbers are needed"))?;
    }
    let (mut jitter, mut seed) = (0.0f32, 0);
    for part in parts {
        match part.split_once('=') {
            Some(("jitter", v)) => jitter = v.parse().ok().filter(|j| (0.0..=1.0).contains(j)).ok_or_else(|| wrong("jitter is 0 to 1"))?,
            Some(("seed", v)) => seed = v.parse().map_err(|_| wrong("seed is a whole number"))?,
            _ => return Err(wrong("unknown part")),
        }
    }
    Ok((format!("Kuhn grid {}×{}×{}", size[0], size[1], size[2]), kuhn_jittered(size, jitter, seed)?))
}

/// Adds a report like that of a file reader.
pub(crate) fn loaded(format: String, mesh: Mesh, start: Instant) -> Loaded {
    let n = mesh.tets.len() as u64;
    let wide = |p: &[f32; 3]| p.map(f64::from);
    let bounds = mesh.points.iter().map(wide).fold([[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]], |[lo, hi], p| {
        [[0, 1, 2].map(|c| lo[c].min(p[c])), [0, 1, 2].map(|c| hi[c].max(p[c]))]
    });
    let report = Report {
        format,
        seconds: start.elapsed().as_secs_f64(),
        points: mesh.points.len() as u64,
        cells: vec![CellCount { name: "tetrahedron".into(), count: n, fate: Fate::Kept, tetrahedra: n }],
        tetrahedra: n,
        bounds,
        ..Report::default()
    };
    Loaded { mesh, report }
}
