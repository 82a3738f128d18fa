//! Meshes, fields and tree options that the command line names.

use crate::arguments::named;
use crate::common::{Common, Failure, Outcome};
use crate::output::Progress;
use crate::text::counted;
use olbvh::error::Error;
use olbvh::formats::{Curved, LoadOptions, Loaded, Merge, TimeStep, load, printable};
use olbvh::mesh::{Bounds, Field, Mesh, On, valid_grid};
use olbvh::options::{Assign, BuildOptions, Fineness, Lists};
use olbvh::render::TransferFunction;
use std::io::ErrorKind;
use std::path::Path;
use std::time::Instant;

/// Arguments that say how a tree is built.
#[derive(clap::Args)]
pub struct TreeArgs {
    /// Coarseness of the tree, from 0 (fine) to 10: every whole number makes the leaves one level coarser. Coarser
    /// trees are smaller and faster to build. Answers do not depend on it where cells do not overlap.
    #[arg(long, default_value_t = 0.0, value_name = "A", allow_hyphen_values = true)]
    pub alpha: f32,
    /// Level of the leaves, from 0 to 10, instead of the level that --alpha selects; leaves of the next level are half
    /// as large. By default, and unless --alpha, --lists or --budget is changed, leaves become finer than --alpha 0
    /// selects where parts of the mesh are thin and lists are long, and for pictures of small meshes (not in `info`).
    /// Answers do not depend on it where cells do not overlap.
    #[arg(long, value_name = "L", conflicts_with = "alpha", value_parser = clap::value_parser!(u32).range(0..=10), allow_negative_numbers = true)]
    pub level: Option<u32>,
    /// Which octree cells list a tetrahedron. aabb: all that meet its bounding box, as in the paper. planes: of these,
    /// the cells that none of its face planes separates from it. exact: only the cells that it touches, which gives the
    /// shortest lists and takes longest to build. Answers do not depend on it where cells do not overlap.
    #[arg(long, default_value_t = BuildOptions::default().assign, value_parser = named::<Assign>, value_name = "aabb|planes|exact")]
    pub assign: Assign,
    /// Which tetrahedra a leaf lists. boundary: all of them in leaves at the surface of the mesh, and a single one
    /// elsewhere, from which points are found by walking across faces. all: all of them in every leaf, as in the paper.
    /// Answers do not depend on it where cells do not overlap.
    #[arg(long, default_value_t = BuildOptions::default().lists, value_parser = named::<Lists>, value_name = "all|boundary")]
    pub lists: Lists,
    /// Maximum memory for the arrays of the tree, for example 64MiB (units B, KiB, MiB, GiB, kB, MB, GB; K, M and G are
    /// KiB, MiB and GiB; a plain number is in bytes). The tree is made coarser than --alpha selects until it fits,
    /// judged by the most that it could need with `--lists all --assign aabb`. Default: no limit. Answers do not depend
    /// on it where cells do not overlap.
    #[arg(long, value_name = "BYTES", value_parser = bytes, allow_negative_numbers = true)]
    pub budget: Option<u64>,
    /// Sort cells and points along a Z-order curve first. This pays if the file has them in no spatial order and there
    /// are many queries; most meshes gain nothing. Ids in results stay those of the file, but a point that several
    /// cells contain, on a face, edge or vertex or where cells overlap, may be owned by another of them: the first
    /// along the curve instead of the one with the lowest id.
    #[arg(long)]
    pub reorder: bool,
    #[command(flatten)]
    read: ReadArgs,
}

/// Arguments that say how a mesh file is read.
#[derive(clap::Args)]
pub struct ReadArgs {
    /// Which points that have equal coordinates become one. pieces: those of different pieces of a .vtu or .pvtu, or of
    /// different files of another list, so that no boundary lies between them; but not where blocks, the files of a .vtm,
    /// .vtpc or .pvd, have different values, as a field may jump from one block to the next. all: any, for files in which
    /// each cell has points of its own; closes slits as well. nothing: none, so that the pieces remain separate parts. Of
    /// points that become one, the first counts that has a value.
    #[arg(long, default_value_t = Merge::default(), value_parser = named::<Merge>, value_name = "nothing|pieces|all")]
    merge: Merge,
    /// Time step to read, counted from 0, or `last`: of a .pvd or .series, or of a .vtu or .msh with several. What has
    /// no time steps is the same at all of them.
    #[arg(long, default_value_t = TimeStep::Number(0), value_parser = named::<TimeStep>, value_name = "N|last", allow_hyphen_values = true)]
    time_step: TimeStep,
    /// What becomes of curved cells. corners: edges are straight, and fields are linear in a cell. split: quadratic cells,
    /// which have a node in the middle of each edge, become 8 to 48 tetrahedra that use all nodes and the values there; cells
    /// of still higher order are taken by their corners.
    #[arg(long, default_value_t = Curved::default(), value_parser = named::<Curved>, value_name = "corners|split")]
    curved: Curved,
}

/// Arguments that deform a mesh.
#[derive(clap::Args)]
pub struct WarpArgs {
    /// Move the points by a vector of theirs, such as a displacement, times FACTOR (1 by default): the deformed shape.
    #[arg(long, value_name = "VECTOR[=FACTOR]")]
    warp: Option<String>,
}

impl WarpArgs {
    /// Deforms the mesh if that is asked for. A name may contain `=`.
    pub fn apply(&self, mesh: &mut Mesh, common: &Common) -> Outcome {
        let Some(text) = &self.warp else { return Ok(()) };
        let (vector, factor): (&str, f64) = match text.rsplit_once('=') {
            Some((vector, factor)) if mesh.field(&format!("{text}.x")).is_none() => {
                let factor = factor.trim().parse().ok().filter(|f: &f64| f.is_finite());
                (vector.trim_end(), factor.ok_or_else(|| Failure::Usage(format!("--warp {text}: a number is needed after `=`")))?)
            }
            _ => (text.as_str(), 1.0),
        };
        let still = mesh.warp(vector, factor).map_err(|error| match error {
            Error::Invalid(why) => Failure::Usage(format!("--warp: {why}; {}", fields(mesh))),
            other => other.into(),
        })?;
        if still > 0 {
            common.remark(format_args!("--warp: {} left in place, for want of a finite vector", counted(still as u64, "point")));
        }
        Ok(())
    }
}

/// Arguments that limit how much of a device is used.
#[derive(clap::Args)]
pub struct MemoryArgs {
    /// Maximum device memory to use, including buffers for transfers, for example 512MiB (units as for --budget). A
    /// mesh that does not fit is built and queried in blocks, one after the other. Default: the memory of the device.
    /// Answers do not depend on it where cells do not overlap.
    #[arg(long, value_name = "BYTES", value_parser = bytes, allow_negative_numbers = true)]
    pub memory: Option<u64>,
}

/// Parses a number of bytes with an optional unit.
fn bytes(text: &str) -> Result<u64, String> {
    let digits = text.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(text.len());
    let (number, unit) = (&text[..digits], text[digits..].trim());
    let units = [("", 0), ("B", 0), ("KiB", 10), ("K", 10), ("MiB", 20), ("M", 20), ("GiB", 30), ("G", 30)]
        .map(|(name, power)| (name, f64::from(1u32 << power)));
    let decimal = [("kB", 1e3), ("MB", 1e6), ("GB", 1e9)];
    let factor = units.into_iter().chain(decimal).find(|(name, _)| name.eq_ignore_ascii_case(unit)).map(|u| u.1);
    let bytes = number.parse::<f64>().ok().zip(factor).map(|(n, factor)| (n * factor).floor());
    // Any such number below 2^63 fits u64.
    bytes.filter(|b| (0.0..9e18).contains(b)).map(|b| b as u64).ok_or_else(|| "a number and a unit, such as 64MiB, 1.5GiB or 500000".into())
}

impl TreeArgs {
    /// The checked options of a build for queries. Leaves are as fine as suits the queries, unless the arguments say
    /// how fine they should be.
    pub fn suited(&self, fineness: Fineness) -> Outcome<BuildOptions> {
        let options = self.options()?;
        let by_default = options.alpha == 0.0 && options.level.is_none() && options.lists == Lists::Boundary && options.budget.is_none();
        Ok(BuildOptions { fineness: if by_default { fineness } else { Fineness::Alpha }, ..options })
    }

    /// The checked options of a build.
    pub fn options(&self) -> Outcome<BuildOptions> {
        let options = BuildOptions {
            alpha: self.alpha,
            level: self.level,
            assign: self.assign,
            lists: self.lists,
            budget: self.budget,
            ..BuildOptions::default()
        };
        options.alpha_fixed()?;
        Ok(options)
    }

    /// Reads a mesh and reorders it if `--reorder` is given.
    pub fn mesh(&self, path: &Path, common: &Common) -> Outcome<Loaded> {
        let loaded = self.read.mesh(path, common)?;
        if !self.reorder {
            return Ok(loaded);
        }
        let start = Instant::now();
        let ordered = loaded.mesh.along_curve()?;
        log::info!("{}: reordered in {:.2} s", path.display(), start.elapsed().as_secs_f64());
        Ok(Loaded { mesh: ordered, ..loaded })
    }
}

impl ReadArgs {
    /// Reads a mesh and prints the warnings of its reader.
    pub fn mesh(&self, path: &Path, common: &Common) -> Outcome<Loaded> {
        let options = LoadOptions { merge: self.merge, step: self.time_step, curved: self.curved, ..LoadOptions::default() };
        let progress = Progress::new(common, "reading");
        let loaded = load(path, &options).map_err(|error| refused(path, error))?;
        drop(progress);
        for warning in &loaded.report.warnings {
            common.remark(format_args!("{}: {warning}", path.display()));
        }
        log::info!("{}: {} tetrahedra in {:.2} s", path.display(), loaded.mesh.tets.len(), loaded.report.seconds);
        Ok(loaded)
    }
}

/// The failure of a mesh that cannot be read or made. A procedural mesh that cannot be made is wrong usage.
fn refused(path: &Path, error: Error) -> Failure {
    let text = path.to_string_lossy();
    let wrong = |why: &str| Failure::Usage(if why.starts_with(&*text) { why.to_owned() } else { format!("{text}: {why}") });
    match &error {
        Error::Invalid(why) => wrong(why),
        Error::TooLarge(why) if !path.exists() => wrong(why),
        Error::Io { source, .. } if source.kind() == ErrorKind::NotFound && text.contains(':') => Failure::Input(format!(
            "{text}: neither a file nor a procedural mesh, which are kuhn:NX,NY,NZ, graded:N, far-field:N, shell:N and slivers:N"
        )),
        _ => Failure::input(error),
    }
}

/// Remarks on the bad cells of a mesh, if there are any, since answers leave them out.
pub fn remark_on_bad_cells(path: &Path, bad: u32, common: &Common) {
    if bad > 0 {
        let (are, them) = if bad == 1 { ("is", "it") } else { ("are", "them") };
        let cells = counted(bad.into(), "bad cell");
        common.remark(format_args!("{}: {cells} {are} left out (`olbvh info --bad-cells` lists {them})", path.display()));
    }
}

/// Where the valid cells of a mesh are, in words: `from (…) to (…)`.
pub fn reach(mesh: &Mesh) -> String {
    let (Bounds { lo, hi }, [x, y, z]) = (Bounds::from(&valid_grid(mesh)), mesh.origin);
    let corner = |p: [f32; 3]| format!("({}, {}, {})", f64::from(p[0]) + x, f64::from(p[1]) + y, f64::from(p[2]) + z);
    format!("from {} to {}", corner(lo), corner(hi))
}

/// The field with this name; without a name, the first field of points, or else the first field of cells.
pub fn field<'a>(mesh: &'a Mesh, name: Option<&str>) -> Outcome<Option<&'a Field>> {
    let first = || mesh.fields.iter().find(|f| f.on == On::Points).or(mesh.fields.first());
    name.map_or_else(|| Ok(first()), |name| field_named(mesh, name).map(Some))
}

/// The field with this name.
pub fn field_named<'a>(mesh: &'a Mesh, name: &str) -> Outcome<&'a Field> {
    mesh.field(name).ok_or_else(|| Failure::Usage(format!("no field `{name}`; {}", fields(mesh))))
}

/// The transfer function of a .json file, or the colour map of this name.
pub fn transfer(name: &str) -> Outcome<TransferFunction> {
    if !name.to_ascii_lowercase().ends_with(".json") {
        return Ok(TransferFunction::named(name)?);
    }
    let text = std::fs::read_to_string(name).map_err(|source| Failure::input(Error::Io { path: name.into(), source }))?;
    TransferFunction::from_json(&text).map_err(|error| match error {
        Error::Invalid(why) => Failure::Input(format!("{name}: {why}")),
        other => other.into(),
    })
}

/// The names of a mesh's fields as part of a sentence, without characters that would change the terminal.
pub fn fields(mesh: &Mesh) -> String {
    let list = |on: On| mesh.fields.iter().filter(|f| f.on == on).map(|f| printable(&f.name)).collect::<Vec<_>>().join(", ");
    match (list(On::Points), list(On::Cells)) {
        (points, cells) if points.is_empty() && cells.is_empty() => "the mesh has no fields".into(),
        (points, cells) if cells.is_empty() => format!("the mesh has {points}"),
        (points, cells) if points.is_empty() => format!("the mesh has {cells} (per cell)"),
        (points, cells) => format!("the mesh has {points} (per point) and {cells} (per cell)"),
    }
}

#[cfg(test)]
mod tests {
    use super::bytes;

    #[test]
    fn bytes_have_units() {
        for (text, wanted) in
            [("7", 7), ("1.5KiB", 1536), ("8G", 8 << 30), ("2m", 2 << 20), ("3 MB", 3_000_000), ("1kB", 1000), ("4K", 4096)]
        {
            assert_eq!(bytes(text), Ok(wanted), "{text}");
        }
        assert!(["", "G", "1T", "-1", "1e3"].iter().all(|text| bytes(text).is_err()));
    }
}
