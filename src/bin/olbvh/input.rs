//! Meshes, fields and tree options from the command line.

use crate::arguments::named;
use crate::common::{Common, Failure, Outcome};
use olbvh::formats::{LoadOptions, Loaded, load};
use olbvh::mesh::{Field, Mesh, On};
use olbvh::options::{Assign, BuildOptions, Fineness, Lists};
use std::path::Path;
use std::time::Instant;

/// How a tree is built.
#[derive(clap::Args)]
pub struct TreeArgs {
    /// Coarseness of the tree, 0 to 10: each whole number takes one level off. Coarser trees are smaller and quicker to build; answers are the same.
    #[arg(long, default_value_t = 0.0, value_name = "A", allow_hyphen_values = true)]
    pub alpha: f32,
    /// Level of the leaves, 0 to 10, instead of the one that alpha asks for; each has cells half as large. Without this, at alpha 0, leaves
    /// are finer where parts are thin and lists long, and for pictures of small meshes (but not in `info`). Answers are the same.
    #[arg(long, value_name = "L", conflicts_with = "alpha", value_parser = clap::value_parser!(u32).range(0..=10))]
    pub level: Option<u32>,
    /// Which octree cells list a tetrahedron: those its box meets, as in the paper; of those the ones that its face planes leave; or exactly those it touches,
    /// the shortest lists, which take longest to build. Answers are the same.
    #[arg(long, default_value_t = BuildOptions::default().assign, value_parser = named::<Assign>, value_name = "aabb|planes|exact")]
    pub assign: Assign,
    /// Which tetrahedra a leaf lists: all where the surface is and elsewhere one, from which points are walked to; or all everywhere, as in the
    /// paper. Answers are the same.
    #[arg(long, default_value_t = BuildOptions::default().lists, value_parser = named::<Lists>, value_name = "all|boundary")]
    pub lists: Lists,
    /// Most memory for the arrays of the tree, such as 64MiB (units B, KiB, MiB, GiB; kB, MB, GB): the tree gets coarser than --alpha asks for until
    /// it fits, by what `--lists all --assign aabb` could take at most. Answers are the same.
    #[arg(long, value_name = "BYTES", value_parser = bytes)]
    pub budget: Option<u64>,
    /// Bring cells and points into the order of a Z curve first. It pays where the file has them in no order and there is much to be asked; most meshes
    /// gain nothing. Ids stay those of the file, but a point on a face, edge or vertex is owned by the first along the curve of the cells that share it.
    #[arg(long)]
    pub reorder: bool,
}

/// How much of a device is used.
#[derive(clap::Args)]
pub struct MemoryArgs {
    /// Most device memory to use, transfers included, such as 512MiB; by default what the device has. A mesh that does not fit is built and asked in blocks,
    /// one after the other. Answers are the same.
    #[arg(long, value_name = "BYTES", value_parser = bytes)]
    pub memory: Option<u64>,
}

/// A number of bytes with a unit.
fn bytes(text: &str) -> Result<u64, String> {
    let digits = text.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(text.len());
    let (number, unit) = (&text[..digits], text[digits..].trim());
    let units =
        [("", 1.0), ("B", 1.0), ("KiB", 1024.0), ("MiB", 1_048_576.0), ("GiB", 1_073_741_824.0), ("kB", 1e3), ("MB", 1e6), ("GB", 1e9)];
    let factor = units.into_iter().find(|(name, _)| name.eq_ignore_ascii_case(unit)).map(|u| u.1);
    let bytes = number.parse::<f64>().ok().zip(factor).map(|(n, factor)| (n * factor).floor());
    // Any such number below 2^63 is one of u64 too.
    bytes.filter(|b| (0.0..9e18).contains(b)).map(|b| b as u64).ok_or_else(|| "a number and a unit, such as 64MiB, 1.5GiB or 500000".into())
}

impl TreeArgs {
    /// The options of a build to ask questions of, checked. Leaves are as fine as suits the questions, unless it is said how fine they should be.
    pub fn suited(&self, fineness: Fineness) -> Outcome<BuildOptions> {
        let options = self.options(false)?;
        let by_default = options.alpha == 0.0 && options.level.is_none() && options.lists == Lists::Boundary && options.budget.is_none();
        Ok(BuildOptions { fineness: if by_default { fineness } else { Fineness::Alpha }, ..options })
    }

    /// The options of a build, checked.
    pub fn options(&self, boxes: bool) -> Outcome<BuildOptions> {
        let options = BuildOptions {
            alpha: self.alpha,
            level: self.level,
            assign: self.assign,
            lists: self.lists,
            boxes,
            budget: self.budget,
            ..BuildOptions::default()
        };
        options.alpha_fixed()?;
        Ok(options)
    }

    /// Reads a mesh, into the order asked for.
    pub fn mesh(&self, path: &Path, common: &Common) -> Outcome<Loaded> {
        let loaded = mesh(path, common)?;
        if !self.reorder {
            return Ok(loaded);
        }
        let start = Instant::now();
        let ordered = loaded.mesh.along_curve()?;
        log::info!("{}: reordered in {:.2} s", path.display(), start.elapsed().as_secs_f64());
        Ok(Loaded { mesh: ordered, ..loaded })
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
