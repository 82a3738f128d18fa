//! The subcommand `olbvh slice`.

use crate::arguments::{named, range, vector};
use crate::common::{Common, Failure, Outcome};
use crate::engine;
use crate::input::{self, MemoryArgs, TreeArgs, WarpArgs};
use crate::output::{self, Progress};
use crate::slice_output::{Appearance, Layers, layer_file, materials};
use crate::slice_placement::Placement;
use crate::text::{counted, grouped, in_blocks, milliseconds};
use olbvh::blocks::{Cost, SliceRequest};
use olbvh::formats::{OutputFormat, printable};
use olbvh::mesh::{Bounds, Field, Mesh, On, valid_grid};
use olbvh::options::{BuildOptions, Fineness};
use olbvh::query::Sliced;
use olbvh::render::TransferFunction;
use olbvh::render::transfer::DEFAULT_MAP;
use olbvh::slicing::{Band, Extrapolate, Plane, SliceSettings, Tally, VoxelGrid};
use serde_json::json;
use std::path::PathBuf;
use std::time::Instant;

/// Cut a mesh into layers of voxels; no voxel that the mesh touches is left empty.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  olbvh slice bracket.vtu -o middle.png                 one slice through the middle
  olbvh slice bracket.vtu -o bracket.npy --layers 200   the whole mesh; kinds in bracket.kind.npy
  olbvh slice bracket.vtu -o layer.png --axis x --at 12.5 --layers 10 --thickness 0.2
  olbvh slice bracket.vtu -o cut.vti --normal 1,1,0.5 --size 800
  olbvh slice bracket.vtu -o print.svx --size 400       a package of voxels for printers

A voxel's kind is 2 if its centre lies in the mesh, 1 if only its box touches the mesh, otherwise 0. A touched voxel gets the value at the closest \
point of the closest boundary cell of the mesh (or, with --extrapolate linear, the field of that cell continued to the centre). Empty voxels are NaN, \
and transparent in pictures. Rows and layers run upwards; pictures show the highest row on top. Several layers make pictures NAME-0000.png, \
NAME-0001.png and so on. With --json, the centre of the first voxel (`origin`), the distances from voxel to voxel, row to row and layer to layer \
(`spacing`) and the directions of these (`axes`) place a .npy result in the coordinates of the mesh file. Origin and voxels of an .svx package are in \
metres (see --unit); its x and y run along the rows and from row to row. Where cells of the mesh overlap each other, options such as --alpha may \
change which of the cells that contain a point gives its value.")]
pub struct Args {
    /// Mesh file, or a procedural mesh such as kuhn:NX,NY,NZ.
    mesh: PathBuf,
    /// Output file; its extension selects the format: .npy, .vti, .png or .svx.
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,
    /// Axis perpendicular to the layers.
    #[arg(long, default_value = "z", value_name = "x|y|z", value_parser = axis)]
    axis: usize,
    /// Direction perpendicular to the layers, of any length, instead of an axis.
    #[arg(long, value_name = "X,Y,Z", value_parser = vector, allow_hyphen_values = true, conflicts_with = "axis")]
    normal: Option<[f64; 3]>,
    /// Position of the centre of the first layer along the axis (or unit normal), in units of the mesh. Default: the
    /// layers are centred on the mesh.
    #[arg(long, value_name = "V", allow_hyphen_values = true)]
    at: Option<f64>,
    /// Number of layers. Default: 1; for .svx as many as fill the mesh.
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    layers: Option<u32>,
    /// Size of a layer, which covers the bounds of the mesh: voxels per row x rows. A single number is voxels per row;
    /// voxels are then square.
    #[arg(long, default_value = "512", value_name = "WxH|W", value_parser = size, allow_negative_numbers = true)]
    size: [u32; 2],
    /// Height of a voxel perpendicular to the layers, in units of the mesh. Default: --spacing if given; otherwise,
    /// with one layer or with --at, the width of a voxel; otherwise what fills the mesh.
    #[arg(long, value_name = "T", allow_hyphen_values = true)]
    thickness: Option<f64>,
    /// Distance between the centres of two layers, in units of the mesh; negative: layers are stacked downwards.
    /// Default: the thickness.
    #[arg(long, value_name = "D", allow_hyphen_values = true)]
    spacing: Option<f64>,
    /// Name of the field to slice; a vector's name stands for its length at the points, which is interpolated, and name.x,
    /// name.y and name.z for its components. Default: the first field of points, or else the first field of cells.
    #[arg(long)]
    field: Option<String>,
    /// Value of voxels that the mesh only touches. nearest: that at the closest point of the mesh. linear: the field of
    /// the closest cell, extrapolated to the centre of the voxel.
    #[arg(long, default_value = "nearest", value_name = "nearest|linear", value_parser = named::<Extrapolate>)]
    extrapolate: Extrapolate,
    /// Also write the cell id of each voxel: to NAME.owner.npy, or as an array of the .vti.
    #[arg(long)]
    owners: bool,
    /// Colours of .png pictures: the name of a colour map, or a .json file, as for `render --tf` (whose opacities are
    /// not used). Default: viridis.
    #[arg(long, value_name = "MAP|FILE.json")]
    tf: Option<String>,
    /// Values of the field at the two ends of the colour map (and of the value channel of an .svx package), LO below
    /// HI. Default: the range in the .json file of --tf if it has one, otherwise the smallest and largest value of the
    /// field.
    #[arg(long, value_name = "LO:HI", value_parser = range, allow_hyphen_values = true)]
    range: Option<[f32; 2]>,
    /// Metres per unit of the mesh, for .svx. Default: 0.001, that is the mesh is in millimetres.
    #[arg(long, value_name = "M", value_parser = unit, allow_negative_numbers = true)]
    unit: Option<f64>,
    #[command(flatten)]
    warp: WarpArgs,
    #[command(flatten)]
    tree: TreeArgs,
    #[command(flatten)]
    memory: MemoryArgs,
}

/// Maximum number of voxels; their files would have terabytes.
const MOST_VOXELS: u64 = 1 << 40;

const FORMATS: [OutputFormat; 4] = [OutputFormat::Npy, OutputFormat::Vti, OutputFormat::Png, OutputFormat::Svx];

/// Runs the subcommand.
pub fn run(args: &Args, common: &Common) -> Outcome {
    let format = args.format()?;
    let colors = input::transfer(args.tf.as_deref().unwrap_or(DEFAULT_MAP))?;
    let options = BuildOptions { slabs: true, ..args.tree.suited(Fineness::Points)? };
    let engine = engine::open(common, args.memory.memory)?;
    let mut loaded = args.tree.mesh(&args.mesh, common)?;
    args.warp.apply(&mut loaded.mesh, common)?;
    let mesh = &loaded.mesh;
    let field = input::field(mesh, args.field.as_deref())?;
    if field.is_none() && format == OutputFormat::Png {
        common.remark("the mesh has no fields; drawing voxels in one colour");
    }
    let bounds = Bounds::from(&valid_grid(mesh));
    let voxels = args.voxels(format, &bounds, mesh.origin, common)?;
    if let OutputFormat::Npy | OutputFormat::Vti = format {
        // A value and a kind per voxel; pictures and packages are compressed.
        output::check_room(&args.output, voxels.voxels() * if args.owners { 9 } else { 5 })?;
    }
    let look = args.look(format, &colors, mesh, field, common);
    let placement = Placement::new(&voxels, mesh);
    let mut layers = Layers::create(&args.output, format, &placement, mesh, args.owners, look)?;
    let progress = Progress::new(common, "slicing");
    let start = Instant::now();
    let mut has_values = false;
    let mut sink = |band: Band| {
        has_values = has_values || band.values.iter().any(|value| !value.is_nan());
        layers.band(band)
    };
    let asked = SliceRequest { mesh, options, field, voxels: &voxels, extrapolate: args.extrapolate };
    let (Sliced { tally, .. }, took) = engine.slice(&asked, &|done, total| progress.follow(done, total), &mut sink)?;
    layers.finish()?;
    drop(progress);
    input::remark_on_bad_cells(&args.mesh, took.bad_cells[0], common);
    if tally.inside + tally.touched == 0 {
        common.remark(placement.remark_on_emptiness(args.axis_name(), &bounds, mesh));
    } else if let Some(field) = field.filter(|_| !has_values) {
        let name = printable(&field.name);
        let where_ = if mesh.range(field, |_| true).is_none() { "anywhere" } else { "where the voxels are; --at moves them" };
        common.remark(format_args!("no voxel has a value: {name} has none {where_}"));
    }
    let seconds = start.elapsed().as_secs_f64() - took.build_seconds;
    let done = Done { format, voxels, placement, field, tally, took, seconds, device: engine.name() };
    done.report(args, common)
}

impl Args {
    /// The format of the output, to which all options apply.
    fn format(&self) -> Outcome<OutputFormat> {
        let format = output::announce(&self.output, &FORMATS, &[&self.mesh])?;
        if format == OutputFormat::Npy {
            for beside in ["kind.npy", "owner.npy"].into_iter().take(1 + usize::from(self.owners)) {
                output::announce(&self.output.with_extension(beside), &FORMATS, &[&self.mesh])?;
            }
        }
        for (given, option, formats, endings) in [
            (self.owners, "--owners", &[OutputFormat::Npy, OutputFormat::Vti][..], ".npy and .vti"),
            (self.tf.is_some(), "--tf", &[OutputFormat::Png], ".png"),
            (self.range.is_some(), "--range", &[OutputFormat::Png, OutputFormat::Svx], ".png and .svx"),
            (self.unit.is_some(), "--unit", &[OutputFormat::Svx], ".svx"),
        ] {
            if given && !formats.contains(&format) {
                return Err(Failure::Usage(format!("{option} is for {endings} files")));
            }
        }
        Ok(format)
    }

    /// The stack of voxels over a mesh with these bounds. Those of a package are cubes.
    fn voxels(&self, format: OutputFormat, &Bounds { lo, hi }: &Bounds, origin: [f64; 3], common: &Common) -> Outcome<VoxelGrid> {
        let mut settings = SliceSettings {
            plane: self.normal.map_or(Plane::Axis(self.axis), Plane::Normal),
            at: self.at,
            layers: self.layers.unwrap_or(1),
            size: self.size,
            thickness: self.thickness,
            spacing: self.spacing,
        };
        if format == OutputFormat::Svx {
            let whole = settings.cubes(lo, hi, origin, true)?;
            settings = if self.layers.is_none() { whole } else { settings.cubes(lo, hi, origin, false)? };
            if settings.layers < whole.layers {
                common.remark(format_args!(
                    "{} of the {} layers that fill the mesh; without --layers, all are made",
                    settings.layers, whole.layers
                ));
            }
        }
        let voxels = settings.voxels(lo, hi, origin)?;
        if voxels.voxels() > MOST_VOXELS {
            let all = grouped(voxels.voxels());
            return Err(Failure::Usage(format!("{all} voxels, more than the maximum of 2^40; take fewer --layers or a smaller --size")));
        }
        Ok(voxels)
    }

    /// How values of a field are shown.
    fn look(&self, format: OutputFormat, colors: &TransferFunction, mesh: &Mesh, field: Option<&Field>, common: &Common) -> Appearance {
        let range = self.range.or(colors.range()).or_else(|| mesh.range(field?, |_| true)).unwrap_or([0.0, 1.0]);
        let materials = field.and_then(materials);
        if let (OutputFormat::Svx, None, Some(Field { name, on: On::Cells, .. })) = (format, &materials, field) {
            common.remark(format_args!(
                "{} does not number materials from 1 to 255; the package has its values from {} to {}",
                printable(name),
                range[0],
                range[1]
            ));
        }
        let colors = colors.over(range.map(f64::from));
        Appearance { colors, range, unit: self.unit.unwrap_or(0.001), field: field.map(|f| f.name.clone()), materials }
    }

    /// Name of the axis perpendicular to the layers; `None` on an oblique plane.
    fn axis_name(&self) -> Option<&'static str> {
        self.normal.is_none().then(|| AXES[self.axis])
    }
}

/// A stack that was sliced.
struct Done<'a> {
    format: OutputFormat,
    voxels: VoxelGrid,
    placement: Placement,
    field: Option<&'a Field>,
    tally: Tally,
    took: Cost,
    seconds: f64,
    device: String,
}

impl Done<'_> {
    /// Prints the summary.
    fn report(&self, args: &Args, common: &Common) -> Outcome {
        let Self { voxels, placement, field, tally, took, seconds, device, .. } = self;
        let file = |layer: u32| match self.format {
            OutputFormat::Png => layer_file(&args.output, layer, voxels.layers).display().to_string(),
            _ => args.output.display().to_string(),
        };
        let (first, last) = (file(0), file(voxels.layers - 1));
        let shown = if first == last { first.clone() } else { format!("{first} to {last}") };
        let [width, height] = voxels.size;
        let on = field.map(|f| if f.on == On::Points { "points" } else { "cells" });
        let json = json!({
            "file": first, "last_file": last, "layers": voxels.layers, "width": width, "height": height,
            "origin": placement.origin, "spacing": placement.spacing, "axis": args.axis_name(), "axes": placement.axes,
            "thickness": placement.thickness, "inside": tally.inside, "touched": tally.touched, "empty": tally.empty, "seconds": seconds,
            "field": field.map(|f| f.name.as_str()), "on": on, "build_ms": took.build_seconds * 1e3, "blocks": took.trees,
            "peak_bytes": took.peak, "bad_cells": took.bad_cells[0], "device": device,
        });
        let text = format!(
            "{shown}: {} of {width}x{height} voxels; {} inside, {} touched, {} empty; {} on {device}{}\n",
            counted(voxels.layers.into(), "layer"),
            grouped(tally.inside),
            grouped(tally.touched),
            grouped(tally.empty),
            milliseconds(seconds * 1e3),
            in_blocks(took)
        );
        output::summary(common, &json, &text)
    }
}

/// Names of the axes.
const AXES: [&str; 3] = ["x", "y", "z"];

fn axis(text: &str) -> Result<usize, String> {
    AXES.iter().position(|a| a.eq_ignore_ascii_case(text)).ok_or_else(|| "an axis is x, y or z".into())
}

/// Parses `WxH`, or `W` for square voxels.
fn size(text: &str) -> Result<[u32; 2], String> {
    let parts: Vec<Option<u32>> = text.split(['x', 'X', '×']).map(|n| n.trim().parse().ok().filter(|&n| n > 0)).collect();
    match parts[..] {
        [Some(w)] => Ok([w, 0]),
        [Some(w), Some(h)] => Ok([w, h]),
        _ => Err("a size is WxH or W in voxels, such as 800x600".into()),
    }
}

/// Parses metres per unit.
fn unit(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|&m: &f64| m > 0.0 && m.is_finite()).ok_or_else(|| "metres, above 0, such as 0.001 for millimetres".into())
}
