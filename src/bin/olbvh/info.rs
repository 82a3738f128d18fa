//! The subcommand `olbvh info`.

use crate::common::{Common, Outcome};
use crate::engine::{self, Engine, Shapes, Summary};
use crate::input::TreeArgs;
use crate::output::{self, Progress};
use crate::text::{Page, bytes, grouped, joined, milliseconds, single};
use olbvh::formats::{Fate, Loaded, printable};
use olbvh::grid::MAX_LEVEL;
use olbvh::mesh::{Fault, Field, Mesh, On, fault_of};
use olbvh::options::{Fineness, Lists};
use serde_json::{Value, json};
use std::path::PathBuf;

/// Show the contents of a mesh, build the tree over it, and show the tree's properties.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  olbvh info bracket.vtu
  olbvh info bracket.vtu --alpha 1 --assign exact
  olbvh info bracket.vtu --budget 2MiB
  olbvh info bracket.vtu --level 6            leaves of level 6
  olbvh info kuhn:127,127,127 --json          the mesh `Jets` of the paper

Bad cells, in which a vertex occurs twice, are left out of the tree. (A file with a cell whose vertex does not exist, or has a coordinate that is not \
finite or of a magnitude of 2^125 (4.3e37) or more, is refused as a whole.) Boundary cells have a face on the surface or no volume, or overlap a \
neighbour, or lie at a crowded point (where more than 128 cells may meet). Negative cells have their vertices in the other order, which does no harm where cells do not overlap.")]
pub struct Args {
    /// Mesh file, or a procedural mesh such as kuhn:NX,NY,NZ.
    mesh: PathBuf,
    #[command(flatten)]
    tree: TreeArgs,
    /// List every bad cell with the reason.
    #[arg(long)]
    bad_cells: bool,
}

/// Runs the subcommand.
pub fn run(args: &Args, common: &Common) -> Outcome {
    let options = args.tree.options()?;
    let engine = engine::open(common, None)?;
    let loaded = args.tree.mesh(&args.mesh, common)?;
    let progress = Progress::new(common, "building");
    let summary = engine.summary(&loaded.mesh, &options)?;
    let solid = Solid::of(&loaded.mesh);
    drop(progress);
    let json = json(args, engine.as_ref(), &loaded, &solid, &summary);
    output::result(common, &json, &page(args, engine.as_ref(), &loaded, &solid, &summary, common.verbose).to_string())
}

/// What the valid tetrahedra are together.
struct Solid {
    volume: f64,
    parts: usize,
}

impl Solid {
    fn of(mesh: &Mesh) -> Self {
        let valid = |tet| fault_of(mesh, tet).is_none();
        Self { volume: mesh.volume(valid), parts: mesh.parts(valid) }
    }
}

/// Lower and upper corner in the coordinates of the source.
fn bounds(mesh: &Mesh, summary: &Summary) -> [[f64; 3]; 2] {
    [summary.bounds.lo, summary.bounds.hi].map(|corner| [0, 1, 2].map(|c| mesh.origin[c] + single(corner[c])))
}

fn json(args: &Args, engine: &dyn Engine, loaded: &Loaded, solid: &Solid, s: &Summary) -> Value {
    let (mesh, tree) = (&loaded.mesh, &args.tree);
    let [lo, hi] = bounds(mesh, s);
    let field = |f: &Field| {
        let on = if f.on == On::Points { "points" } else { "cells" };
        let [min, max] = [0, 1].map(|end| mesh.range(f, |_| true).map(|range| single(range[end])));
        json!({ "name": f.name, "on": on, "min": min, "max": max })
    };
    let mut arrays: serde_json::Map<String, Value> = s.memory.arrays().into_iter().map(|(name, n)| (name.to_owned(), n.into())).collect();
    arrays.insert("total".into(), s.memory.total().into());
    let mut all = json!({
        "file": args.mesh.display().to_string(),
        "format": loaded.report.format,
        "cells": mesh.tets.len(),
        "source_cells": mesh.source_cells,
        "cell_types": loaded.report.cells,
        "points": mesh.points.len(),
        "added_points": loaded.report.added_points,
        "bad_cells": s.counts.bad,
        "boundary_cells": s.counts.boundary,
        "negative_cells": s.counts.negative,
        "flat_cells": s.counts.flat,
        "crowded_points": s.counts.crowded,
        "branched_faces": s.counts.branched,
        "tangled_cells": loaded.report.tangled,
        "fields": mesh.fields.iter().map(field).collect::<Vec<_>>(),
        "bounds": { "min": lo, "max": hi },
        "volume": solid.volume,
        "parts": solid.parts,
        "warnings": loaded.report.warnings,
        "device": engine.name(),
        "target": engine.target().map(|shapes| shapes.target.name.clone()),
        "load_ms": loaded.report.seconds * 1e3,
        "topology_ms": s.topology_ms,
        "neighbour_bytes": s.neighbour_bytes,
        "tree": {
            "graded": s.graded, "l": s.level, "l_wanted": s.wanted, "alpha": tree.level.is_none().then_some(single(tree.alpha)), "level": tree.level,
            "assign": tree.assign.name(), "lists": tree.lists.name(), "budget": tree.budget,
            "entries": s.entries, "nodes": s.nodes, "leaves": s.leaves, "bytes": arrays, "paper_bytes": s.paper_bytes, "build_ms": s.build_ms,
            "stages_ms": s.stages.iter().map(|(name, ms)| (name.clone(), json!(ms))).collect::<serde_json::Map<_, _>>(),
        },
    });
    if args.bad_cells {
        let entry = |(tet, fault): &(u32, Fault)| json!({ "cell": mesh.cell_id(*tet), "reason": fault.to_string() });
        all["bad_cell_list"] = s.bad.iter().map(entry).collect();
    }
    all
}

fn page(args: &Args, engine: &dyn Engine, loaded: &Loaded, solid: &Solid, s: &Summary, verbose: bool) -> Page {
    let mut page = Page::default();
    add_mesh(&mut page, args, loaded, solid, s);
    add_fields(&mut page, &loaded.mesh);
    add_tree(&mut page, args, &engine.name(), s);
    add_memory(&mut page, s);
    if verbose {
        add_stages(&mut page, engine.target(), s);
    }
    if args.bad_cells && !s.bad.is_empty() {
        add_bad_cells(&mut page, &loaded.mesh, s);
    }
    page
}

fn add_mesh(page: &mut Page, args: &Args, loaded: &Loaded, solid: &Solid, s: &Summary) {
    let Loaded { mesh, report } = loaded;
    page.section(&format!("Mesh {}", args.mesh.display()));
    page.row("format", format_args!("{}, read in {}", report.format, milliseconds(report.seconds * 1e3)));
    let added = match report.added_points {
        0 => String::new(),
        n => format!(", {} of them added in the middle of cells", grouped(n)),
    };
    page.row("points", grouped(mesh.points.len() as u64) + &added);
    page.row("tetrahedra", grouped(mesh.tets.len() as u64));
    for cells in report.cells.iter().filter(|cells| cells.fate != Fate::Kept) {
        page.row(&cells.name, format_args!("{}, {cells}", grouped(cells.count)));
    }
    let counts = &s.counts;
    page.row(
        "bad cells",
        format_args!(
            "{}{}",
            grouped(counts.bad),
            if counts.bad > 0 && !args.bad_cells { ", left out (--bad-cells lists them)" } else { "" }
        ),
    );
    page.row("boundary cells", grouped(counts.boundary));
    page.row("negative cells", grouped(counts.negative));
    page.row("flat cells", grouped(counts.flat));
    if counts.crowded > 0 {
        page.row("crowded points", format_args!("{}, whose many cells count as boundary", grouped(counts.crowded)));
    }
    if counts.branched > 0 {
        page.row("branched faces", format_args!("{}, each of more than two cells, some of which overlap", grouped(counts.branched)));
    }
    if report.tangled > 0 {
        page.row("tangled cells", format_args!("{}, whose pieces overlap", grouped(report.tangled)));
    }
    let [lo, hi] = bounds(mesh, s);
    page.row("bounds", format_args!("({}) to ({})", joined(&lo, ", "), joined(&hi, ", ")));
    page.row("extent", joined(&[0, 1, 2].map(|c| s.bounds.hi[c] - s.bounds.lo[c]), " × "));
    page.row("volume", solid.volume as f32);
    page.row("parts", format_args!("{}, each connected by points", grouped(solid.parts as u64)));
}

fn add_fields(page: &mut Page, mesh: &Mesh) {
    page.section(if mesh.fields.is_empty() { "No fields" } else { "Fields" });
    for f in &mesh.fields {
        let range = mesh.range(f, |_| true).map_or_else(|| "no finite value".into(), |[lo, hi]| format!("{lo} to {hi}"));
        page.row(printable(&f.name), format_args!("{range}{}", if f.on == On::Points { "" } else { ", per cell" }));
    }
}

fn add_tree(page: &mut Page, args: &Args, device: &str, s: &Summary) {
    page.section(&format!(
        "Tree ({}, {}, lists {}{}), built in {} on {device}",
        args.tree.level.map_or_else(|| format!("alpha {}", args.tree.alpha), |level| format!("level {level}")),
        args.tree.assign,
        args.tree.lists,
        args.tree.budget.map(|b| format!(", budget {}", bytes(b))).unwrap_or_default(),
        milliseconds(s.build_ms)
    ));
    let asked = args.tree.level.map_or_else(|| format!("α = {} asks for", single(args.tree.alpha)), |_| "--level asks for".to_owned());
    let clipped =
        if s.wanted > s.level { format!(" (a tree of level {}, which {asked}, would be too large)", s.wanted) } else { String::new() };
    if s.graded {
        page.row("cells", "smaller where the tetrahedra crowd (graded grid)");
    }
    page.row("level of the leaves, l", format_args!("{}{clipped}", s.level));
    page.row("entries, n_m", grouped(s.entries));
    page.row("nodes, n_n", grouped(s.nodes));
    let (each, finer) = (s.entries / s.leaves.max(1), s.level + 1);
    let hint = args.tree.lists == Lists::Boundary && Fineness::Pictures.wants_finer(each) && s.wanted == s.level && finer <= MAX_LEVEL;
    let hint = if hint { "; pictures are drawn with a finer tree, which is faster" } else { "" };
    page.row("leaves", format_args!("{}, of {each} entries on average{hint}", grouped(s.leaves)));
}

/// Adds the arrays of the tree and the neighbours.
fn add_memory(page: &mut Page, s: &Summary) {
    for (name, n) in s.memory.arrays().into_iter().filter(|(_, n)| *n > 0) {
        let what = match name {
            "P" => "primitive ids",
            "PO" => "primitive offsets",
            "BV" => "boxes",
            "CO" => "child offsets",
            "NO" => "level offsets",
            "BF" => "boundary flags",
            "mask" => "masks of children and octants",
            _ => "",
        };
        page.row(format_args!("{name:4} {what}"), bytes(n));
    }
    page.row("total", bytes(s.memory.total()));
    page.row("as the paper counts", format_args!("{} (4 n_m + 25 n_n + 4 n_ni, without PO)", bytes(s.paper_bytes)));
    let neighbours = bytes(s.neighbour_bytes);
    page.row(
        "neighbours, boundary",
        format_args!("found in {}; neighbours take {neighbours} besides the tree", milliseconds(s.topology_ms)),
    );
}

/// Adds the target of the kernels and the time of each stage.
fn add_stages(page: &mut Page, shapes: Option<&Shapes>, s: &Summary) {
    if let Some(shapes) = shapes {
        page.row("kernels", shapes);
    }
    for (name, ms) in &s.stages {
        page.row(format_args!("  {name}"), milliseconds(*ms));
    }
}

fn add_bad_cells(page: &mut Page, mesh: &Mesh, s: &Summary) {
    page.section("Bad cells");
    for (tet, fault) in &s.bad {
        page.row(format_args!("cell {}", mesh.cell_id(*tet)), fault);
    }
}
