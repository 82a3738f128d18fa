//! The subcommand `olbvh overlap`.

use crate::arguments::vector;
use crate::common::{Common, Failure, Outcome};
use crate::engine;
use crate::input::{MemoryArgs, TreeArgs};
use crate::output::{Progress, ResultOutput};
use crate::text::{grouped, milliseconds};
use glam::{DQuat, DVec3};
use olbvh::blocks::Meshes;
use olbvh::error::Error;
use olbvh::formats::{OutputFormat, write_json, write_mesh};
use olbvh::mesh::{Mesh, On};
use olbvh::options::{Assign, BuildOptions, Fineness, Lists};
use serde_json::json;
use std::path::PathBuf;
use std::time::Instant;

/// Find the cells of each of two meshes that intersect the other mesh.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  olbvh overlap die.vtu box.vtu -o cells.json
  olbvh overlap a.vtu b.vtu -o cells.json --pairs   also every pair of intersecting cells
  olbvh overlap a.vtu b.vtu -o cells.json --move-b 0,0,3.5 --rotate-b z,30
  olbvh overlap a.vtu b.vtu -o touched.vtu          the cells of A that intersect B, as a mesh

The .json result has the lists `a` and `b` of ascending cell ids and, with --pairs, the list `pairs`, sorted by the cell of A, then by that of B. Ids \
count the cells of a file from 0. B is rotated about the centre of its bounds first, then moved. Cells are closed, so cells that touch intersect. Two \
cells that share a vertex with equal coordinates always count; two other cells that touch, or that are nearer to touching than 1e-6 of the diagonal \
of both meshes together, may count or not, but the result is the same on every device.")]
pub struct Args {
    /// Mesh A: a file, or a procedural mesh such as kuhn:NX,NY,NZ.
    a: PathBuf,
    /// Mesh B, likewise.
    b: PathBuf,
    /// Output file: .json, or .vtu for the cells of A that intersect B as a mesh. `-`: the .json on standard output,
    /// while the summary goes to standard error.
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,
    /// Also find all pairs of intersecting cells; only .json files hold them.
    #[arg(long)]
    pairs: bool,
    /// Move B by this vector, in units of the mesh.
    #[arg(long, value_name = "X,Y,Z", value_parser = vector, allow_hyphen_values = true)]
    move_b: Option<[f64; 3]>,
    /// Rotate B counter-clockwise by an angle in degrees about an axis (x, y, z or a direction X,Y,Z) through the
    /// centre of its bounds, before it is moved.
    #[arg(long, value_name = "AXIS,DEGREES", value_parser = rotation, allow_hyphen_values = true)]
    rotate_b: Option<(DVec3, f64)>,
    #[command(flatten)]
    tree: TreeArgs,
    #[command(flatten)]
    memory: MemoryArgs,
}

/// Runs the subcommand.
pub fn run(args: &Args, common: &Common) -> Outcome {
    let output = ResultOutput::announce(&args.output, &[OutputFormat::Json, OutputFormat::Vtu], &[&args.a, &args.b], common)?;
    let format = output.format;
    if args.pairs && format != OutputFormat::Json {
        return Err(Failure::Usage(format!("{}: --pairs needs a .json file; a .vtu file holds no pairs", args.output.display())));
    }
    let mut options = args.tree.suited(Fineness::Points)?;
    if args.pairs {
        // Pairs are found through lists; only lists by bounding box find each pair once.
        options = BuildOptions { lists: Lists::All, assign: Assign::Aabb, fineness: Fineness::Alpha, ..options };
    }
    let engine = engine::open(common)?;
    let a = args.tree.mesh(&args.a, common)?.mesh;
    let mut b = args.tree.mesh(&args.b, common)?.mesh;
    pose(&mut b, &a, args)?;
    let progress = Progress::new(common, "overlap");
    let asked = Meshes { meshes: [&a, &b], options, pairs: args.pairs };
    let start = Instant::now();
    let (overlap, took) = engine.overlap(&asked, args.memory.memory, &|done, total| progress.set(done, total))?.into_parts();
    let seconds = start.elapsed().as_secs_f64() - took.build_seconds;
    drop(progress);
    let cells = |mesh: &Mesh, tets: &[u32]| {
        let mut ids: Vec<u32> = tets.iter().map(|&t| mesh.cell_id(t)).collect();
        ids.sort_unstable();
        ids.dedup();
        ids
    };
    let (ids_a, ids_b) = (cells(&a, &overlap.a), cells(&b, &overlap.b));
    let pairs = overlap.pairs.as_ref().map(|pairs| {
        let mut pairs: Vec<[u32; 2]> = pairs.iter().map(|p| [a.cell_id(p[0]), b.cell_id(p[1])]).collect();
        pairs.sort_unstable();
        pairs.dedup();
        pairs
    });
    let narrow: u64 = overlap.effort.iter().map(|e| e.narrow).sum();
    let primitives = (a.tets.len() + b.tets.len()) as u64;
    let share = narrow as f64 / primitives.max(1) as f64;
    if format == OutputFormat::Vtu {
        write_mesh(output.path(), &part(&a, &overlap.a))?;
    } else {
        let mut result = json!({ "a": ids_a, "b": ids_b });
        if let Some(pairs) = &pairs {
            result["pairs"] = json!(pairs);
        }
        write_json(output.path(), &result)?;
    }
    let effort = |e: &olbvh::reference::overlap::Effort| json!({ "by_vertex": e.by_vertex, "by_node": e.by_node, "searched": e.searched, "located_vertices": e.located, "narrow_tests": e.narrow });
    let json = json!({
        "file": args.output.display().to_string(), "a": ids_a.len(), "b": ids_b.len(), "pairs": pairs.as_ref().map(Vec::len),
        "narrow_tests": narrow, "narrow_share": share, "seconds": seconds, "build_ms": took.build_seconds * 1e3, "blocks": took.trees, "peak_bytes": took.peak,
        "a_effort": effort(&overlap.effort[0]), "b_effort": effort(&overlap.effort[1]), "device": engine.name(),
    });
    let listed = pairs.as_ref().map_or(String::new(), |pairs| format!(", in {} pairs", grouped(pairs.len() as u64)));
    let text = format!(
        "{}: {} cells of A and {} of B intersect{listed}\n{} narrow tests, {:.2} per cell; {} trees {}, overlap {} on {}\n",
        args.output.display(),
        grouped(ids_a.len() as u64),
        grouped(ids_b.len() as u64),
        grouped(narrow),
        share,
        took.trees,
        milliseconds(took.build_seconds * 1e3),
        milliseconds(seconds * 1e3),
        engine.name()
    );
    output.finish(common, &json, &text)
}

/// Transforms the points of B into the coordinates of A: rotated, moved, and relative to A's origin.
fn pose(b: &mut Mesh, a: &Mesh, args: &Args) -> Outcome {
    let finite = |p: &&[f32; 3]| p.iter().all(|x| x.is_finite());
    let wide = |p: &[f32; 3]| DVec3::from_array(p.map(f64::from));
    let ends = b.points.iter().filter(finite).map(wide).fold((DVec3::MAX, DVec3::MIN), |(lo, hi), p| (lo.min(p), hi.max(p)));
    let centre = if ends.0.x <= ends.1.x { ends.0.midpoint(ends.1) } else { DVec3::ZERO };
    let turn = match args.rotate_b {
        Some((axis, degrees)) => DQuat::from_axis_angle(axis.normalize(), degrees.to_radians()),
        None => DQuat::IDENTITY,
    };
    let shift = DVec3::from_array(args.move_b.unwrap_or_default()) + DVec3::from_array(b.origin) - DVec3::from_array(a.origin);
    if args.rotate_b.is_none() && shift == DVec3::ZERO {
        return Ok(());
    }
    for p in &mut b.points {
        let at = wide(p) - centre;
        let turned = if args.rotate_b.is_some() { turn * at } else { at };
        *p = (turned + centre + shift).as_vec3().to_array();
    }
    b.origin = a.origin;
    if shift.is_finite() { Ok(()) } else { Err(Error::Invalid("--move-b: coordinates of B become infinite".into()).into()) }
}

/// A mesh of some of the cells, in the order of their ids, with all points and fields.
fn part(mesh: &Mesh, tets: &[u32]) -> Mesh {
    let mut part = mesh.clone();
    let mut tets = tets.to_vec();
    tets.sort_by_key(|&t| mesh.cell_id(t));
    part.tets = tets.iter().map(|&t| mesh.tets[t as usize]).collect();
    part.cell_ids = Some(tets.iter().map(|&t| mesh.cell_id(t)).collect());
    for field in part.fields.iter_mut().filter(|f| f.on == On::Cells) {
        field.values = tets.iter().map(|&t| field.values[t as usize]).collect();
    }
    part
}

/// Parses an axis and an angle such as `z,30` or `1,1,0,45`.
fn rotation(text: &str) -> Result<(DVec3, f64), String> {
    let wrong = || "an axis and an angle in degrees, such as z,30 or 1,1,0,45".to_owned();
    let (axis, degrees) = text.rsplit_once(',').ok_or_else(wrong)?;
    let degrees: f64 = degrees.trim().parse().ok().filter(|d: &f64| d.is_finite()).ok_or_else(wrong)?;
    let axis = match axis.trim() {
        "x" => DVec3::X,
        "y" => DVec3::Y,
        "z" => DVec3::Z,
        other => DVec3::from_array(vector(other).map_err(|_| wrong())?),
    };
    if axis.try_normalize().is_some() { Ok((axis, degrees)) } else { Err(wrong()) }
}
