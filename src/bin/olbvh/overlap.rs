//! The subcommand `olbvh overlap`.

use crate::arguments::vector;
use crate::common::{Common, Failure, Outcome};
use crate::engine;
use crate::input::{self, MemoryArgs, TreeArgs};
use crate::output::{Progress, ResultOutput};
use crate::text::{grouped, milliseconds};
use glam::{DQuat, DVec3};
use olbvh::blocks::{Cost, OverlapRequest};
use olbvh::formats::{OutputFormat, write_json, write_mesh};
use olbvh::mesh::{Bounds, Field, Mesh, On, is_usable, valid_grid};
use olbvh::options::{Assign, BuildOptions, Fineness, Lists};
use olbvh::query::Overlapped;
use olbvh::reference::overlap::{Effort, Overlap};
use serde_json::{Value, json};
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
    let options = args.options(output.format)?;
    let engine = engine::open(common, args.memory.memory)?;
    let a = args.tree.mesh(&args.a, common)?.mesh;
    let mut b = args.tree.mesh(&args.b, common)?.mesh;
    pose(&mut b, &a, args)?;
    let progress = Progress::new(common, "overlap");
    let asked = OverlapRequest { meshes: [&a, &b], options, pairs: args.pairs };
    let start = Instant::now();
    let (Overlapped { overlap, .. }, took) = engine.overlap(&asked, &|done, total| progress.follow(done, total))?;
    let seconds = start.elapsed().as_secs_f64() - took.build_seconds;
    drop(progress);
    for (path, bad) in [&args.a, &args.b].into_iter().zip(took.bad_cells) {
        input::remark_on_bad_cells(path, bad, common);
    }
    if overlap.a.is_empty() {
        let [a, b] = [&a, &b].map(input::reach);
        common.remark(format_args!("no cells intersect; A reaches {a}, B {b}"));
    }
    let cells = Cells::of(&overlap, [&a, &b]);
    match output.format {
        OutputFormat::Vtu => write_mesh(output.path(), &part(&a, &overlap.a))?,
        _ => write_json(output.path(), &cells.json())?,
    }
    let tets = (a.tets.len() + b.tets.len()) as u64;
    Done { cells, effort: overlap.effort, tets, took, seconds, device: engine.name() }.report(args, output, common)
}

impl Args {
    /// The checked options of both trees.
    fn options(&self, format: OutputFormat) -> Outcome<BuildOptions> {
        let options = self.tree.suited(Fineness::Points)?;
        if !self.pairs {
            return Ok(options);
        }
        if format != OutputFormat::Json {
            return Err(Failure::Usage(format!("{}: --pairs needs a .json file; a .vtu file holds no pairs", self.output.display())));
        }
        // Pairs are found through lists; only lists by bounding box find each pair once.
        Ok(BuildOptions { lists: Lists::All, assign: Assign::Aabb, fineness: Fineness::Alpha, ..options })
    }

    /// The failure of a B with coordinates that are too large in those of A.
    fn too_far(&self) -> Failure {
        let (to, by) = match (self.move_b, self.rotate_b) {
            (Some(_), _) => ("--move-b", "move it less far"),
            (None, Some(_)) => ("--rotate-b", "rotate it less"),
            (None, None) => ("B", "bring the meshes nearer to each other"),
        };
        Failure::Usage(format!("{to}: coordinates of B, relative to A, would be 2^125 (4.3e37) or more, too large to compute with; {by}"))
    }
}

/// Transforms the points of B into the coordinates of A: rotated, moved, and relative to A's origin.
fn pose(b: &mut Mesh, a: &Mesh, args: &Args) -> Outcome {
    let wide = |p: [f32; 3]| DVec3::from_array(p.map(f64::from));
    let shift = DVec3::from_array(args.move_b.unwrap_or_default()) + DVec3::from_array(b.origin) - DVec3::from_array(a.origin);
    if args.rotate_b.is_none() && shift == DVec3::ZERO {
        return Ok(());
    }
    let Bounds { lo, hi } = Bounds::from(&valid_grid(b));
    let centre = wide(lo).midpoint(wide(hi));
    let turn = args.rotate_b.map(|(axis, degrees)| DQuat::from_axis_angle(axis.normalize(), degrees.to_radians()));
    for p in &mut b.points {
        let turned = turn.map_or(wide(*p), |turn| turn * (wide(*p) - centre) + centre);
        let posed = (turned + shift).as_vec3().to_array();
        // Outside the bounds are only points that no valid cell has.
        if (0..3).all(|c| (lo[c]..=hi[c]).contains(&p[c])) && !is_usable(posed) {
            return Err(args.too_far());
        }
        *p = posed;
    }
    b.origin = a.origin;
    Ok(())
}

/// The cells that were found, by their ids in the files, ascending.
struct Cells {
    a: Vec<u32>,
    b: Vec<u32>,
    pairs: Option<Vec<[u32; 2]>>,
}

impl Cells {
    fn of(overlap: &Overlap, [a, b]: [&Mesh; 2]) -> Self {
        Self {
            a: ascending(overlap.a.iter().map(|&t| a.cell_id(t))),
            b: ascending(overlap.b.iter().map(|&t| b.cell_id(t))),
            pairs: overlap.pairs.as_ref().map(|pairs| ascending(pairs.iter().map(|&[s, t]| [a.cell_id(s), b.cell_id(t)]))),
        }
    }

    /// The content of a result file.
    fn json(&self) -> Value {
        let mut result = json!({ "a": self.a, "b": self.b });
        if let Some(pairs) = &self.pairs {
            result["pairs"] = json!(pairs);
        }
        result
    }
}

/// Sorts ids; several tetrahedra may be parts of one cell, which is listed once.
fn ascending<T: Ord>(ids: impl Iterator<Item = T>) -> Vec<T> {
    let mut ids: Vec<T> = ids.collect();
    ids.sort_unstable();
    ids.dedup();
    ids
}

/// An overlap that was computed and written.
struct Done {
    cells: Cells,
    effort: [Effort; 2],
    /// Number of tetrahedra of both meshes.
    tets: u64,
    took: Cost,
    seconds: f64,
    device: String,
}

impl Done {
    /// Prints the summary.
    fn report(&self, args: &Args, output: ResultOutput, common: &Common) -> Outcome {
        let Self { cells: Cells { a, b, pairs }, took, seconds, device, .. } = self;
        let narrow: u64 = self.effort.iter().map(|e| e.narrow).sum();
        let share = narrow as f64 / self.tets.max(1) as f64;
        let [a_effort, b_effort] = self.effort.each_ref().map(|e| {
            json!({
                "by_vertex": e.by_vertex, "by_node": e.by_node, "searched": e.searched, "located_vertices": e.located,
                "narrow_tests": e.narrow,
            })
        });
        let json = json!({
            "file": args.output.display().to_string(), "a": a.len(), "b": b.len(), "pairs": pairs.as_ref().map(Vec::len),
            "narrow_tests": narrow, "narrow_share": share, "seconds": seconds, "build_ms": took.build_seconds * 1e3,
            "blocks": took.trees, "peak_bytes": took.peak, "bad_cells": took.bad_cells.iter().sum::<u32>(),
            "a_effort": a_effort, "b_effort": b_effort, "device": device,
        });
        let listed = pairs.as_ref().map_or(String::new(), |pairs| format!(", in {} pairs", grouped(pairs.len() as u64)));
        let text = format!(
            "{}: {} cells of A and {} of B intersect{listed}\n{} narrow tests, {share:.2} per cell; {} trees {}, overlap {} on {device}\n",
            args.output.display(),
            grouped(a.len() as u64),
            grouped(b.len() as u64),
            grouped(narrow),
            took.trees,
            milliseconds(took.build_seconds * 1e3),
            milliseconds(seconds * 1e3),
        );
        output.finish(common, &json, &text)
    }
}

/// A mesh of some of the cells, in the order of their ids, with their points, and all fields.
fn part(mesh: &Mesh, tets: &[u32]) -> Mesh {
    let mut tets = tets.to_vec();
    tets.sort_by_key(|&t| mesh.cell_id(t));
    let mut points: Vec<u32> = tets.iter().flat_map(|&t| mesh.tets[t as usize]).collect();
    points.sort_unstable();
    points.dedup();
    // Every vertex is among the points.
    let place = |v: u32| points.binary_search(&v).unwrap_or_default() as u32;
    let field = |field: &Field| {
        let chosen = if field.on == On::Points { &points } else { &tets };
        Field { values: chosen.iter().map(|&i| field.values[i as usize]).collect(), ..field.clone() }
    };
    Mesh {
        points: points.iter().map(|&v| mesh.points[v as usize]).collect(),
        tets: tets.iter().map(|&t| mesh.tets[t as usize].map(place)).collect(),
        cell_ids: Some(tets.iter().map(|&t| mesh.cell_id(t)).collect()),
        point_ids: Some(points.iter().map(|&v| mesh.point_id(v)).collect()),
        fields: mesh.fields.iter().map(field).collect(),
        ..*mesh
    }
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
