//! Meshes, fields and tree options from the command line.

use crate::common::{Common, Failure, Outcome};
use olbvh::formats::{LoadOptions, Loaded, load};
use olbvh::mesh::{Field, Mesh, On};
use olbvh::options::{Assign, BuildOptions, Lists};
use std::path::Path;

/// How a tree is built.
#[derive(clap::Args)]
pub struct TreeArgs {
    /// Coarseness of the tree, 0 to 10: each whole number takes one level off. Coarser trees are smaller and quicker to build; answers are the same.
    #[arg(long, default_value_t = 0.0, value_name = "A")]
    pub alpha: f32,
    /// Which octree cells list a tetrahedron: those its box meets, those its face planes leave, or exactly those it touches; shorter lists take longer to
    /// build. Answers are the same.
    #[arg(long, default_value = "aabb", value_name = "aabb|planes|exact")]
    pub assign: Assign,
    /// Which tetrahedra a leaf lists: all where the surface is and elsewhere one, from which points are walked to; or all everywhere, as in the
    /// paper. Answers are the same.
    #[arg(long, default_value_t = BuildOptions::default().lists, value_name = "all|boundary")]
    pub lists: Lists,
}

impl TreeArgs {
    /// The options of a build, checked.
    pub fn options(&self, boxes: bool) -> Outcome<BuildOptions> {
        let options = BuildOptions { alpha: self.alpha, assign: self.assign, lists: self.lists, boxes, ..BuildOptions::default() };
        options.alpha_fixed()?;
        Ok(options)
    }
}

/// Reads a mesh and passes on what its reader wants to be known.
pub fn mesh(path: &Path, common: &Common) -> Outcome<Loaded> {
    let loaded = load(path, &LoadOptions::default()).map_err(Failure::input)?;
    for warning in &loaded.report.warnings {
        common.remark(format_args!("{}: {warning}", path.display()));
    }
    log::info!("{}: {} tetrahedra in {:.2} s", path.display(), loaded.mesh.tets.len(), loaded.report.seconds);
    Ok(loaded)
}

/// The field of that name; without one the first field of points, or else of cells.
pub fn field<'a>(mesh: &'a Mesh, name: Option<&str>) -> Outcome<Option<&'a Field>> {
    let Some(name) = name else {
        return Ok(mesh.fields.iter().find(|f| f.on == On::Points).or(mesh.fields.first()));
    };
    mesh.field(name).map(Some).ok_or_else(|| Failure::Usage(format!("no field `{name}`; {}", fields(mesh))))
}

/// The names of a mesh's fields, as a sentence.
pub fn fields(mesh: &Mesh) -> String {
    let list = |on: On| mesh.fields.iter().filter(|f| f.on == on).map(|f| f.name.as_str()).collect::<Vec<_>>().join(", ");
    match (list(On::Points), list(On::Cells)) {
        (points, cells) if points.is_empty() && cells.is_empty() => "the mesh has no fields".into(),
        (points, cells) if cells.is_empty() => format!("the mesh has {points}"),
        (points, cells) if points.is_empty() => format!("the mesh has {cells} (per cell)"),
        (points, cells) => format!("the mesh has {points} (per point) and {cells} (per cell)"),
    }
}
