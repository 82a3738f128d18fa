//! The subcommand `olbvh locate`.

use crate::common::{Common, Failure, Outcome};
use crate::engine::{self, Engine, OnProgress};
use crate::input::{self, MemoryArgs, TreeArgs, WarpArgs};
use crate::output::{Progress, ResultOutput};
use crate::text::{counted, grouped, in_blocks, milliseconds, single};
use olbvh::blocks::{Cost, LocateRequest};
use olbvh::formats::{
    Fate, LoadOptions, Loaded, Located, Merge, OutputFile, OutputFormat, load, load_points, read_points, without_lengths, write_json,
    write_located, write_npy,
};
use olbvh::mesh::{Field, Mesh};
use olbvh::options::Fineness;
use olbvh::query::{self, LocateMethod, LocateOptions};
use olbvh::reference::locate::Location;
use rayon::prelude::*;
use serde_json::json;
use std::collections::HashSet;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Find the cell that contains each point, and interpolate a field there.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  olbvh locate bracket.vtu points.csv -o values.csv
  olbvh locate bracket.vtu points.npy -o values.npz --field temperature --field von_mises
  olbvh locate bracket.vtu points.csv -o values.csv --all-fields
  olbvh locate bracket.vtu points.csv -o cells.csv --all   every cell that contains the point
  olbvh locate coarse.vtu fine.vtu -o fine-with-fields.vtu --all-fields   fields of one mesh at the points of another
  olbvh locate bracket.vtu points.csv -o values.csv --within 0.5   points up to 0.5 outside have the closest values
  echo 40,30,20 | olbvh locate bracket.vtu - -o -   without files

Points are in the coordinates of the mesh file. Each has one owner: the cell with the lowest id of those that contain it (with --reorder, the first \
along the curve). Where cells of the mesh overlap each other, another of the cells that contain the point may be named, which depends on \
the options; --all then finds all of them only with --lists all. Ids count the cells of the file from 0; 4294967295 means that there is no owner. The \
barycentric coordinates b0 to b3 belong to the vertices of the tetrahedron in file order. For a cell that was split into tetrahedra (hexahedron, voxel, \
wedge, pyramid, prism or polyhedron), they belong to the tetrahedron of the split that contains the point; the result does not name its vertices. \
A .npy result is an array of records (owner, bary, value); an .npz has one array for each of them; a .csv has a line per point (x, y, z, owner, b0 to \
b3, value); .vtu and .json are other formats. If the points are those of a mesh, a .vtu has that mesh (split into tetrahedra, if it has volume cells) with the \
results at its points, and with --all-fields vectors are vectors again. With --all-fields or more than one --field, each field has its own name instead of `value`. Values are \
NaN (in JSON null) where there is no owner. \
If there is at least one point for every four cells (for at most 4,194,304 cells), points are sorted along a Z curve before they are searched for. \
--coherent saves the sorting. Results are always in the order of the points. \
With --all, the result has one row per point and cell: .csv, .npy (n×2) or .json.")]
pub struct Args {
    /// Mesh file, or a procedural mesh such as kuhn:NX,NY,NZ.
    mesh: PathBuf,
    /// File with the points, in the coordinates of the mesh: .npy (n×3 numbers), .csv (x,y,z), or another mesh or a
    /// surface (.vtp, .obj, .ply, .stl), whose points are taken in the order of its file. `-`: standard input, with any of these but an .obj.
    points: PathBuf,
    /// Output file; its extension selects the format: .csv, .npy, .npz, .vtu or .json (with --all .csv, .npy or .json).
    /// `-`: a .csv on standard output, while the summary goes to standard error.
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,
    /// Name of a field to interpolate; can be given several times. A vector's name stands for its length at the points,
    /// and name.x, name.y and name.z for its components. The interpolated length is not that of the interpolated vector,
    /// but as long or longer. Default: the first field of points, or else the first field of cells.
    #[arg(long)]
    field: Vec<String>,
    /// Interpolate every field of the mesh.
    #[arg(long, conflicts_with = "field")]
    all_fields: bool,
    /// Find every cell that contains a point, not only its owner.
    #[arg(long, conflicts_with_all = ["field", "all_fields"])]
    all: bool,
    /// How far outside the surface a point may lie and still count as inside: its smallest barycentric coordinate may
    /// be down to -T. T is between 0 and 1, without unit. Whether such a point is found may depend on options of the
    /// tree.
    #[arg(long, default_value_t = olbvh::options::TOLERANCE, value_name = "T", allow_hyphen_values = true)]
    tolerance: f32,
    /// Points outside the mesh get the closest place of its surface, if that is at most D away (in units of the mesh; places
    /// farther than the mesh's largest extent are not found, and those beyond half of it not always): owner, barycentric coordinates and values are those of that place. Adds a column
    /// `distance`, which is 0 in the mesh.
    #[arg(long, value_name = "D", conflicts_with = "all", allow_hyphen_values = true)]
    within: Option<f32>,
    /// Search for the points in the given order, without sorting them first. This is faster for points that follow each
    /// other closely, such as samples on a line or of a scan. Answers do not depend on it.
    #[arg(long, conflicts_with = "all")]
    coherent: bool,
    #[command(flatten)]
    warp: WarpArgs,
    #[command(flatten)]
    tree: TreeArgs,
    #[command(flatten)]
    memory: MemoryArgs,
}

/// Runs the subcommand.
pub fn run(args: &Args, common: &Common) -> Outcome {
    args.check()?;
    let formats: &[_] = if args.all { &[OutputFormat::Csv, OutputFormat::Npy, OutputFormat::Json] } else { &Located::FORMATS };
    let output = ResultOutput::announce(&args.output, formats, &[&args.mesh, &args.points], common)?;
    let options = args.tree.suited(Fineness::Points)?;
    let engine = engine::open(common, args.memory.memory)?;
    let mut loaded = args.tree.mesh(&args.mesh, common)?;
    args.warp.apply(&mut loaded.mesh, common)?;
    let mesh = &loaded.mesh;
    let fields = args.fields(mesh, output.format)?;
    let (points, of) = args.points(output.format, common)?;
    // The difference is taken in double precision, which is what the mesh's origin is for.
    let local: Vec<[f32; 3]> = points.iter().map(|p| [0, 1, 2].map(|c| (p[c] - mesh.origin[c]) as f32)).collect();
    let method = if args.coherent { LocateMethod::Descent } else { LocateMethod::Suited };
    let asked = LocateRequest { mesh, options, points: &local };
    let how = LocateOptions { method, tolerance: args.tolerance };
    let progress = Progress::new(common, "locating");
    let report = |done: u64, total: u64| progress.follow(done, total);
    let start = Instant::now();
    let (found, beside, took, seconds) = if args.all {
        let (all, took) = engine.locate_all(&asked, args.tolerance, &report)?;
        let seconds = start.elapsed().as_secs_f64();
        (write_every_owner(&output, mesh, &all.owners)?, 0, took, seconds)
    } else {
        let (mut located, took) = engine.locate(&asked, &how, &report)?;
        let found = with_owner(&located);
        let distances = args.within.map(|within| move_beside(&*engine, &asked, &mut located, within, &report)).transpose()?;
        let values = columns(mesh, &fields, args.all_fields, &located, distances);
        let seconds = start.elapsed().as_secs_f64();
        let owner: Vec<u32> = located.owners.iter().map(|&tet| if tet == u32::MAX { tet } else { mesh.cell_id(tet) }).collect();
        let written = Located { points: &points, of: of.as_ref(), owner: &owner, bary: &located.barycentrics, values: &values };
        write_located(output.path(), &written)?;
        (found, with_owner(&located) - found, took, seconds)
    };
    drop(progress);
    if found + beside == 0 && !points.is_empty() {
        common.remark(format_args!("no point lies in the mesh, which reaches {}", input::reach(mesh)));
    }
    input::remark_on_bad_cells(&args.mesh, took.bad_cells[0], common);
    let seconds = seconds - took.build_seconds;
    Done { points: points.len(), found, beside, fields, took, seconds, device: engine.name() }.report(args, output, common)
}

impl Args {
    /// Checks numbers.
    fn check(&self) -> Outcome {
        if !(0.0..=1.0).contains(&self.tolerance) {
            return Err(Failure::Usage(format!("--tolerance {}: a number from 0 to 1 is needed", self.tolerance)));
        }
        if self.within.is_some_and(|within| within.is_nan() || within < 0.0) {
            return Err(Failure::Usage("--within: a distance of 0 or more is needed".into()));
        }
        Ok(())
    }

    /// The fields to interpolate.
    fn fields<'a>(&self, mesh: &'a Mesh, format: OutputFormat) -> Outcome<Vec<&'a Field>> {
        Ok(if self.all {
            Vec::new()
        } else if self.all_fields && format == OutputFormat::Vtu {
            without_lengths(&mesh.fields)
        } else if self.all_fields {
            mesh.fields.iter().collect()
        } else if self.field.is_empty() {
            input::field(mesh, None)?.into_iter().collect()
        } else {
            self.field.iter().map(|name| input::field_named(mesh, name)).collect::<Outcome<_>>()?
        })
    }

    /// The points and, if a mesh is to be written with results at its points, the mesh that they are those of.
    fn points(&self, format: OutputFormat, common: &Common) -> Outcome<(Vec<[f64; 3]>, Option<Mesh>)> {
        let points = if self.points == Path::new("-") { read_points(std::io::stdin()) } else { load_points(&self.points) };
        let mut points = points.map_err(Failure::input)?;
        if points.is_empty() {
            common.remark(format_args!("{}: no points in it", self.points.display()));
        }
        let of = if format == OutputFormat::Vtu && !self.all { probed(&self.points, points.len(), common) } else { None };
        if let Some(Mesh { points: all, origin, .. }) = &of {
            // Those in the middle of cells are not in the file.
            points.extend(all[points.len()..].iter().map(|p| [0, 1, 2].map(|c| f64::from(p[c]) + origin[c])));
        }
        Ok((points, of))
    }
}

/// Points that were located.
struct Done<'a> {
    points: usize,
    found: usize,
    /// Points outside that have a place of the surface instead.
    beside: usize,
    fields: Vec<&'a Field>,
    took: Cost,
    seconds: f64,
    device: String,
}

impl Done<'_> {
    /// Prints the summary.
    fn report(&self, args: &Args, output: ResultOutput, common: &Common) -> Outcome {
        let Self { points, found, beside, fields, took, seconds, device } = self;
        let per_second = if *seconds > 0.0 { *points as f64 / seconds } else { 0.0 };
        let names: Vec<_> = fields.iter().map(|f| &f.name).collect();
        let json = json!({
            "file": args.output.display().to_string(), "points": points, "found": found, "beside": beside, "seconds": seconds,
            "points_per_second": per_second, "field": names.first(), "fields": names, "tolerance": single(args.tolerance),
            "build_ms": took.build_seconds * 1e3, "blocks": took.trees, "peak_bytes": took.peak, "bad_cells": took.bad_cells[0],
            "device": device,
        });
        // With few points, most of the time passes before the first one, so no rate is printed.
        let rate = if *points < 1000 { String::new() } else { format!(", {} points a second", grouped(per_second as u64)) };
        let near = args.within.map_or(String::new(), |within| format!(", {} more at most {within} away", grouped(*beside as u64)));
        let text = format!(
            "{}: {}, {} of them in the mesh{near}; {} on {device}{rate}{}\n",
            args.output.display(),
            counted(*points as u64, "point"),
            grouped(*found as u64),
            milliseconds(seconds * 1e3),
            in_blocks(took)
        );
        output.finish(common, &json, &text)
    }
}

/// Number of points that have an owner.
fn with_owner(located: &query::Located) -> usize {
    located.owners.iter().filter(|&&tet| tet != u32::MAX).count()
}

/// The mesh whose points were located, if it has volume cells.
fn probed(path: &Path, points: usize, common: &Common) -> Option<Mesh> {
    let options = LoadOptions { merge: Merge::Nothing, ..LoadOptions::default() };
    let Loaded { mesh, report } = load(path, &options).ok()?;
    if mesh.points.len() as u64 != points as u64 + report.added_points {
        return None;
    }
    for cells in report.cells.iter().filter(|cells| cells.fate == Fate::Unsupported) {
        common.remark(format_args!("{}: {}: {cells}", path.display(), counted(cells.count, &cells.name)));
    }
    Some(mesh)
}

/// Gives points without an owner the closest place of the surface within a distance. Returns the distance of every point,
/// 0 in the mesh, NaN if nothing is so near.
fn move_beside(
    engine: &dyn Engine,
    asked: &LocateRequest<'_>,
    located: &mut query::Located,
    within: f32,
    report: OnProgress<'_>,
) -> Outcome<Vec<f32>> {
    let outside: Vec<usize> = (0..located.owners.len()).filter(|&i| located.owners[i] == u32::MAX).collect();
    let points: Vec<[f32; 3]> = outside.iter().map(|&i| asked.points[i]).collect();
    let mut distances = vec![0.0; located.owners.len()];
    if points.is_empty() {
        return Ok(distances);
    }
    let (nearest, _) = engine.nearest(&LocateRequest { points: &points, ..*asked }, within, report)?;
    for (k, (&i, distance)) in outside.iter().zip(nearest.distances()).enumerate() {
        (located.owners[i], located.barycentrics[i], distances[i]) = (nearest.owners[k], nearest.barycentrics[k], distance);
    }
    Ok(distances)
}

/// The columns of values: `value` for the one field (NaN without any), or each field by its name; and the distances.
/// Names have an underscore behind them where other columns have that name.
fn columns(mesh: &Mesh, fields: &[&Field], named: bool, located: &query::Located, distances: Option<Vec<f32>>) -> Vec<(String, Vec<f32>)> {
    let at = |field: &Field| {
        let points = located.owners.par_iter().zip(&located.barycentrics);
        points.map(|(&owner, &barycentric)| Location { owner, barycentric }.value(mesh, field)).collect()
    };
    let mut taken: HashSet<String> = Located::TAKEN.map(str::to_owned).into();
    let mut free = |name: &str| {
        let mut name = name.to_owned();
        while !taken.insert(name.clone()) {
            name.push('_');
        }
        name
    };
    let mut columns = match fields {
        [] => vec![(free("value"), vec![f32::NAN; located.owners.len()])],
        [field] if !named => vec![(free("value"), at(field))],
        _ => fields.iter().map(|field| (free(&field.name), at(field))).collect(),
    };
    columns.extend(distances.map(|distances| (free("distance"), distances)));
    columns
}

/// Writes every owner of every point as rows (point, cell); returns how many points have an owner.
fn write_every_owner(output: &ResultOutput, mesh: &Mesh, owners: &[Vec<u32>]) -> Outcome<usize> {
    let cells = |tets: &Vec<u32>| {
        let mut cells: Vec<u32> = tets.iter().map(|&tet| mesh.cell_id(tet)).collect();
        cells.sort_unstable();
        cells.dedup();
        cells
    };
    let owners: Vec<Vec<u32>> = owners.iter().map(cells).collect();
    let rows: Vec<[u32; 2]> = (0..).zip(&owners).flat_map(|(i, cells)| cells.iter().map(move |&cell| [i, cell])).collect();
    match output.format {
        OutputFormat::Csv => write_rows(output.path(), &rows)?,
        OutputFormat::Json => write_json(output.path(), &json!({ "owners": owners }))?,
        _ => write_npy(output.path(), &[rows.len(), 2], rows.as_flattened())?,
    }
    Ok(owners.iter().filter(|o| !o.is_empty()).count())
}

/// Writes a table of rows (point, cell).
fn write_rows(path: &Path, rows: &[[u32; 2]]) -> Outcome {
    let mut file = OutputFile::create(path)?;
    let mut write = || {
        writeln!(file, "point,cell")?;
        rows.iter().try_for_each(|[point, cell]| writeln!(file, "{point},{cell}"))
    };
    write().map_err(|e: std::io::Error| Failure::Failed(format!("{}: {e}", path.display())))?;
    Ok(file.commit()?)
}
