//! The command-line program: one file per subcommand. The subcommands compute through [`engine`], which hides whether a
//! Vulkan device or the CPU does the work.

mod arguments;
mod bench;
mod bounding_box;
mod common;
mod conformance;
mod devices;
mod engine;
mod info;
mod input;
mod legend;
mod locate;
mod output;
mod overlap;
mod render;
mod slice;
mod slice_output;
mod slice_placement;
mod text;
mod tune;

use clap::{Parser, Subcommand};
use common::{Common, Failure};
use std::process::ExitCode;

const AFTER_HELP: &str = "\
MESH is a file: .vtu, .vts, .vtr or .vti, .pvtu, .vtm or .pvd with the files that it lists, .vtk, .msh (Gmsh), .mesh or .meshb (Medit), .node or .ele (TetGen), .inp (Abaqus, CalculiX), .veg (Vega FEM), .tet (Isaac Gym); or a procedural mesh: kuhn:NX,NY,NZ, a grid of \
NX×NY×NZ unit cubes of six tetrahedra each, with a scalar field, or graded:N, far-field:N, shell:N, slivers:N (see `olbvh bench --help`). Lengths are in the \
units of the mesh.

Examples:
  olbvh info bracket.vtu                               the contents of a mesh, and its tree
  olbvh render bracket.vtu -o bracket.png              a picture of its first field
  olbvh locate bracket.vtu points.csv -o out.csv       the cell of each point, and the value there
  olbvh slice bracket.vtu -o bracket.npy --layers 100  voxels; none that the mesh touches is empty
  olbvh overlap a.vtu b.vtu -o cells.json              the cells of two meshes that intersect
  olbvh bench                                          how fast the device does all of this
  olbvh tune                                           parameters with which it is faster
  olbvh render kuhn:32,32,32 -o jet.png --device cpu   without a Vulkan device

Exit codes: 0 done, 1 failed, 2 wrong usage, 3 bad input file, 4 no suitable device, 130 interrupted.";

/// Build octree linear bounding volume hierarchies (OLBVH) over tetrahedral meshes on the GPU, and query them: locate
/// points and interpolate fields, render pictures, slice into voxels, find the overlap of two meshes.
#[derive(Parser)]
#[command(name = "olbvh", version, after_help = AFTER_HELP, propagate_version = true, max_term_width = 120)]
struct Cli {
    #[command(flatten)]
    common: Common,
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Bench(bench::Args),
    Conformance(conformance::Args),
    Devices(devices::Args),
    Info(info::Args),
    Locate(locate::Args),
    Render(Box<render::Args>),
    Slice(Box<slice::Args>),
    Overlap(overlap::Args),
    Tune(tune::Args),
}

fn main() -> ExitCode {
    let Cli { common, command } = Cli::parse();
    common.start_log();
    output::clean_up_on_interrupt();
    let done = match command {
        Command::Bench(args) => bench::run(&args, &common),
        Command::Conformance(args) => conformance::run(&args, &common),
        Command::Devices(args) => devices::run(&args, &common),
        Command::Info(args) => info::run(&args, &common),
        Command::Locate(args) => locate::run(&args, &common),
        Command::Render(args) => render::run(&args, &common),
        Command::Slice(args) => slice::run(&args, &common),
        Command::Overlap(args) => overlap::run(&args, &common),
        Command::Tune(args) => tune::run(&args, &common),
    };
    done.map_or_else(Failure::report, |()| ExitCode::SUCCESS)
}
