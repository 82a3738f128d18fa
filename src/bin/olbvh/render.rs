//! The subcommand `olbvh render`.

use crate::arguments::{message, named, range, vector};
use crate::bounding_box;
use crate::common::{Common, Failure, Outcome};
use crate::engine;
use crate::input::{self, MemoryArgs, TreeArgs, WarpArgs};
use crate::legend::{Explained, Legend};
use crate::output::{Progress, ResultOutput};
use crate::text::{grouped, in_blocks, milliseconds, single};
use olbvh::blocks::{Cost, Picture, RenderRequest};
use olbvh::error::{Error, Result};
use olbvh::formats::{OutputFormat, printable, write_png};
use olbvh::mesh::{Field, Mesh, On};
use olbvh::options::{BuildOptions, Fineness};
use olbvh::render::camera::{CameraSpec, HELP};
use olbvh::render::clip;
use olbvh::render::maps::MAPS;
use olbvh::render::settings::MAX_SIZE;
use olbvh::render::{Background, Clip, Prepared, RenderSettings, SuitedStep, TransferFunction, suited_step, transfer};
use serde_json::json;
use std::path::PathBuf;
use std::time::Instant;

const EXAMPLES: &str = "\
Examples:
  olbvh render bracket.vtu -o bracket.png
  olbvh render bracket.vtu -o hot.png --field temperature --tf inferno --background black
  olbvh render bracket.vtu -o top.png --camera top,ortho --size 1600x900 --supersample 2
  olbvh render bracket.vtu -o part.png --opacity 0:0,0.6:0,0.7:0.9,0.8:0   some of the values
  olbvh render bracket.vtu -o iso.png --iso 40,55,70 --opacity 0.5 --box   three translucent iso-surfaces
  olbvh render bracket.vtu -o half.png --clip view --opacity 1       the half near the viewer cut away
  olbvh render bracket.vtu -o bent.png --warp displacement=300       the deformed shape, 300 times as bent as it is
  olbvh render bracket.vtu -o near.png --camera eye=120,-80,60,target=40,30,20,fov=25

By default, the camera sees the whole mesh; --json tells where it stands, in words for --camera. An opacity, of --opacity or a transfer function, is that of a layer as thick as 1/100 of the diagonal of \
the mesh's bounds. The picture depends little on --step and, where cells of the mesh do not overlap each other, not at all on --alpha, --level, \
--lists, --assign, --memory and --budget. Octree nodes in which the opacity is 0 everywhere are skipped, so pictures that show few of the values are \
drawn fast.";

/// Draw a field of a mesh as a volume or as iso-surfaces, into a PNG file.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES, after_long_help = long_help())]
pub struct Args {
    /// Mesh file, or a procedural mesh such as kuhn:NX,NY,NZ.
    mesh: PathBuf,
    /// Output file, a .png picture. `-`: standard output, while the summary goes to standard error.
    #[arg(short, long, value_name = "OUT.png")]
    output: PathBuf,
    /// Name of the field to draw; a vector's name stands for its length at the points, which is interpolated, and name.x,
    /// name.y and name.z for its components. Default: the first field of points, or else of cells; without any field, the height z.
    #[arg(long)]
    field: Option<String>,
    /// Width and height in pixels; a single number gives a square.
    #[arg(long, default_value = "1024x1024", value_name = "WxH", value_parser = size, allow_negative_numbers = true)]
    size: [u32; 2],
    /// Rays per pixel in each direction, 1 to 8: N×N rays are averaged, which smooths edges and takes N×N times as long.
    #[arg(long, default_value_t = 1, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=8), allow_negative_numbers = true)]
    supersample: u32,
    /// Distance between two samples on a ray, in units of the mesh. Default: 1/512 of the diagonal of the mesh's
    /// bounds; less where walls are thinner than 12 such steps, or layers of cells thinner than one, down to 1/8192. An
    /// iso-surface may have gaps where the mesh or its cells are thinner than a step.
    #[arg(long, allow_negative_numbers = true)]
    step: Option<f64>,
    /// View and settings, separated by commas, for example `top,ortho` or `azimuth=30,elevation=20,zoom=1.5` (angles in
    /// degrees; --help lists all).
    #[arg(long, default_value = "iso", allow_hyphen_values = true, value_parser = named::<CameraSpec>, long_help = format!("Camera: {HELP}"))]
    camera: CameraSpec,
    /// Cut away what lies beyond a plane, for example `x`, `view`, `z=40%` or `-y=12.5`; up to four times (--help
    /// explains it).
    #[arg(long = "clip", value_name = "DIRECTION[=PLACE]", allow_hyphen_values = true, value_parser = named::<Clip>, long_help = format!("Cut away what lies farther in a direction than a place; up to {} times. A clip is {}", clip::MAX_CLIPS, clip::HELP))]
    clips: Vec<Clip>,
    /// Colours and opacities: the name of a colour map, or a .json file (--help lists the maps and describes the file).
    #[arg(long, default_value = transfer::DEFAULT_MAP, value_name = "MAP|FILE.json")]
    tf: String,
    /// Opacity, from 0 to 1, per 1/100 of the mesh's diagonal: one number, or PLACE:OPACITY pairs, where PLACE goes
    /// from 0 to 1 over --range. Default: opacities that fit the field, so that rare values show through common ones.
    #[arg(long, value_name = "A|P:A,P:A,…", value_parser = opacity, allow_hyphen_values = true)]
    opacity: Option<Opacity>,
    /// Draw iso-surfaces of a field of points at these values (up to 8) instead of the volume. They are opaque, unless
    /// --opacity or the file of --tf gives their opacities.
    #[arg(long, value_name = "V,V,…", value_parser = iso, allow_hyphen_values = true)]
    iso: Option<Iso>,
    /// Values of the field at the two ends of the transfer function, LO below HI. Default: the range in the .json file
    /// of --tf if it has one, otherwise the smallest and largest value of the field.
    #[arg(long, value_name = "LO:HI", value_parser = range, allow_hyphen_values = true)]
    range: Option<[f32; 2]>,
    /// Factor on the opacity: 2 makes the mesh as opaque as if it were twice as large.
    #[arg(long, default_value_t = 1.0, value_name = "S", allow_negative_numbers = true)]
    opacity_scale: f32,
    /// Background: white, black, grey, transparent, #rrggbb, or two colours TOP,BOTTOM for a gradient. Default: white.
    #[arg(long, value_name = "COLOR", value_parser = named::<Background>)]
    background: Option<Background>,
    /// Show at the right which colour stands for which value, beside the mesh, which takes less of the picture then.
    #[arg(long)]
    legend: bool,
    /// Draw the edges of the mesh's bounds, which show where in the mesh iso-surfaces lie, or what clips leave.
    #[arg(long = "box")]
    bounds: bool,
    /// Show colours without lighting.
    #[arg(long)]
    no_shading: bool,
    /// Minimum opacity, from 0 to 1, of lit surfaces that are seen edge-on: it keeps outlines crisp where the field is
    /// faint. 0: no outlines.
    #[arg(long, default_value_t = 0.35, value_name = "A", allow_negative_numbers = true)]
    outline: f32,
    /// Direction to the light, of any length, as seen in the picture: right, up, towards the viewer. Default:
    /// -0.45,0.65,1.
    #[arg(long, value_name = "R,U,T", value_parser = vector, allow_hyphen_values = true)]
    light: Option<[f64; 3]>,
    /// Opacity at which a ray ends, above 0 and up to 1.
    #[arg(long, default_value_t = 0.99, value_name = "A", allow_negative_numbers = true)]
    termination: f32,
    #[command(flatten)]
    warp: WarpArgs,
    #[command(flatten)]
    tree: TreeArgs,
    #[command(flatten)]
    memory: MemoryArgs,
}

/// Opacity points. They have a type of their own, because clap takes a list for repeated arguments.
#[derive(Clone)]
struct Opacity(Vec<(f32, f32)>);

/// Values of iso-surfaces, a type of their own for the same reason.
#[derive(Clone)]
struct Iso(Vec<f32>);

/// Opacities below this do not change a pixel of 8 bits.
const FAINT: f32 = 1.0 / 510.0;

/// Runs the subcommand.
pub fn run(args: &Args, common: &Common) -> Outcome {
    let output = ResultOutput::announce(&args.output, &[OutputFormat::Png], &[&args.mesh], common)?;
    let options = args.tree.suited(Fineness::Pictures)?;
    let legend = args.legend()?;
    let mut settings = args.settings(legend.as_ref())?;
    settings.check()?;
    let engine = engine::open(common, args.memory.memory)?;
    let mut loaded = args.tree.mesh(&args.mesh, common)?;
    args.warp.apply(&mut loaded.mesh, common)?;
    let mesh = &loaded.mesh;
    let options = suited_to_picture(options, settings.size, mesh);
    let field = args.field(mesh, common)?;
    let values = mesh.range(&field, |_| true);
    let expects_something = remark_on_iso(&settings.iso, &field, values, common);
    remark_on_range(settings.range.or(settings.transfer.range()), &field, values, common);
    let suited = suited_step(&mesh.points, &mesh.tets);
    settings.step = settings.step.or(suited.and_then(|suited| suited.step));
    let start = Instant::now();
    let progress = Progress::new(common, "rendering");
    let asked = RenderRequest { mesh, options, field: &field, settings: &settings };
    let (mut picture, took) = engine.render(&asked, &|done, total| progress.follow(done, total))?;
    drop(progress);
    input::remark_on_bad_cells(&args.mesh, took.bad_cells[0], common);
    if expects_something && picture.rendered.colors.iter().all(|color| color[3] < FAINT) {
        let no_volume = picture.rendered.stats.found_samples == 0 && loaded.report.flat == loaded.report.tetrahedra;
        remark_on_emptiness(&field, values, no_volume, common);
    }
    if let Some(SuitedStep { thickness, .. }) = suited.filter(|suited| 2.0 * suited.thickness < f64::from(picture.prepared.plan.step)) {
        common.remark(format_args!(
            "the mesh is about {thickness:.1e} thick, the step is {:.1e}: the picture may show rings, or miss parts; --step sets it",
            picture.prepared.plan.step
        ));
    }
    if args.bounds {
        bounding_box::draw(&mut picture.rendered.colors, &picture.prepared.plan, &picture.prepared.bounds, args.supersample);
    }
    let seconds = start.elapsed().as_secs_f64() - took.build_seconds;
    args.write(&picture, &field, legend, &output)?;
    let camera = picture.prepared.camera.text(&picture.prepared.bounds, mesh.origin);
    Done { picture, camera, field, took, seconds, device: engine.name() }.report(args, output, common)
}

/// Options of a tree for a picture of this size. Slabs and a second build over more than two tetrahedra per ray would take
/// longer than they save.
fn suited_to_picture(options: BuildOptions, size: [u32; 2], mesh: &Mesh) -> BuildOptions {
    let rays: u64 = size.into_iter().map(u64::from).product();
    let slabs = 2 * rays >= mesh.tets.len() as u64;
    let fineness = if options.fineness == Fineness::Pictures && !slabs { Fineness::Points } else { options.fineness };
    BuildOptions { slabs, fineness, ..options }
}

/// A picture that was drawn.
struct Done {
    picture: Picture,
    /// Its camera, as `--camera` takes it.
    camera: String,
    field: Field,
    took: Cost,
    seconds: f64,
    device: String,
}

impl Done {
    /// Prints the summary.
    fn report(&self, args: &Args, output: ResultOutput, common: &Common) -> Outcome {
        let Self { picture: Picture { rendered, prepared: Prepared { plan, range: [lo, hi], .. } }, camera, field, took, seconds, device } =
            self;
        let (stats, [width, height], n) = (rendered.stats, args.size, args.supersample);
        let took_ms = |stage: &str| rendered.times.milliseconds(stage);
        let (ranges_ms, interval_ms, march_ms) =
            (took_ms("build.ranges") + took_ms("query.visible"), took_ms("query.intervals"), took_ms("query.march"));
        let json = json!({
            "file": args.output.display().to_string(), "width": width, "height": height, "supersample": n,
            "field": field.name, "range": [single(*lo), single(*hi)], "iso": plan.iso.iter().map(|&v| single(v)).collect::<Vec<_>>(),
            "camera": camera, "step": single(plan.step), "samples": stats.samples, "skipped_samples": stats.skipped_samples,
            "found_samples": stats.found_samples, "ranges_ms": ranges_ms, "interval_ms": interval_ms,
            "march_ms": march_ms, "build_ms": took.build_seconds * 1e3, "blocks": took.trees, "peak_bytes": took.peak,
            "bad_cells": took.bad_cells[0], "seconds": seconds, "device": device,
        });
        let text = format!(
            "{}: {} from {lo} to {hi}, {width}x{height} pixels{}, step {}\n{} samples, {} in the mesh, {} skipped; ray intervals {}, marching {} on {device}{}\n",
            args.output.display(),
            printable(&field.name),
            if n > 1 { format!(" of {n}x{n} rays") } else { String::new() },
            single(plan.step),
            grouped(stats.samples),
            grouped(stats.found_samples),
            grouped(stats.skipped_samples),
            milliseconds(interval_ms),
            milliseconds(march_ms),
            in_blocks(took)
        );
        output.finish(common, &json, &text)
    }
}

impl Args {
    /// The legend, if there is to be one.
    fn legend(&self) -> Outcome<Option<Legend>> {
        if !self.legend {
            return Ok(None);
        }
        let [width, height] = self.size;
        let small =
            |[w, h]: [u32; 2]| Failure::Usage(format!("a picture of {width}x{height} is too small for --legend; take at least {w}x{h}"));
        Legend::new(self.size).map(Some).map_err(small)
    }

    fn settings(&self, legend: Option<&Legend>) -> Outcome<RenderSettings> {
        let mut transfer = input::transfer(&self.tf)?;
        if let Some(Opacity(points)) = &self.opacity {
            transfer = transfer.with_opacity(points.clone())?;
        }
        let defaults = RenderSettings::default();
        let ([width, height], n) = (self.size, self.supersample);
        let size = [width - legend.map_or(0, Legend::width), height].map(|pixels| pixels.saturating_mul(n));
        if n > 1 && size.iter().any(|&rays| rays > MAX_SIZE) {
            return Err(Error::Invalid(format!(
                "{width}x{height} pixels of {n}x{n} rays; a picture has at most {MAX_SIZE} rays in each direction"
            ))
            .into());
        }
        Ok(RenderSettings {
            size,
            camera: self.camera,
            frames_bounds: self.bounds,
            clips: self.clips.clone(),
            transfer,
            iso: self.iso.as_ref().map(|iso| iso.0.clone()).unwrap_or_default(),
            range: self.range,
            step: self.step,
            background: self.background.unwrap_or(defaults.background),
            opacity_scale: self.opacity_scale,
            termination: self.termination,
            shading: !self.no_shading,
            outline: self.outline,
            light: self.light.map_or(defaults.light, |light| light.map(|x| x as f32)),
        })
    }

    /// Writes the picture, with its legend.
    fn write(&self, picture: &Picture, field: &Field, legend: Option<Legend>, output: &ResultOutput) -> Outcome {
        let Picture { rendered, prepared: Prepared { plan, range, .. } } = picture;
        let pixels = plan.pixels(&rendered.colors, self.supersample);
        let explained = Explained { field: &printable(&field.name), range: *range, plan };
        let pixels = legend.map(|legend| legend.beside(&pixels, &explained)).unwrap_or(pixels);
        let [width, height] = self.size;
        Ok(write_png(output.path(), width, height, &pixels)?)
    }

    /// The field to draw. A mesh without fields is coloured by height, so that there is something to see.
    fn field(&self, mesh: &Mesh, common: &Common) -> Outcome<Field> {
        if let Some(field) = input::field(mesh, self.field.as_deref())? {
            return Ok(field.clone());
        }
        common.remark("the mesh has no fields; drawing the height z");
        Ok(Field { name: "z".into(), on: On::Points, values: mesh.points.iter().map(|p| p[2]).collect() })
    }
}

/// Remarks on a range in which the field has no values.
fn remark_on_range(range: Option<[f32; 2]>, field: &Field, values: Option<[f32; 2]>, common: &Common) {
    if let (Some([lo, hi]), Some([least, most])) = (range, values)
        && (most < lo || least > hi)
    {
        let name = printable(&field.name);
        common.remark(format_args!("values of {name} go from {least} to {most}, none of them within the range {lo} to {hi} that is shown"));
    }
}

/// Remarks on a picture in which nothing is to be seen.
fn remark_on_emptiness(field: &Field, values: Option<[f32; 2]>, no_volume: bool, common: &Common) {
    let why = if values.is_none() {
        format!("{} has no value", printable(&field.name))
    } else if no_volume {
        "all cells are flat".into()
    } else {
        "the camera (--camera, --clip) does not see the mesh, or only what is transparent (--opacity)".into()
    };
    common.remark(format_args!("the picture is empty: {why}"));
}

/// Remarks on iso-values that show nothing, or little. Returns whether something may be seen.
fn remark_on_iso(iso: &[f32], field: &Field, values: Option<[f32; 2]>, common: &Common) -> bool {
    // Those of a field of cells are an error, which says more.
    let Some([lo, hi]) = values.filter(|_| !iso.is_empty() && field.on == On::Points) else { return true };
    let name = printable(&field.name);
    if lo == hi {
        common.remark(format_args!("no surface to be seen: all values of {name} are {lo}"));
        return false;
    }
    let seen = iso.iter().any(|iso| (lo..=hi).contains(iso));
    if !seen {
        common.remark(format_args!("no surface to be seen: values of {name} go from {lo} to {hi}"));
    }
    for (end, what) in [(lo, "smallest"), (hi, "largest")].into_iter().filter(|(end, _)| iso.contains(end)) {
        common.remark(format_args!(
            "{end} is the {what} value of {name}: its surface is speckled, or not to be seen; take one within {lo} to {hi}"
        ));
    }
    seen
}

/// Parses `WxH`, or `N` for a square.
fn size(text: &str) -> Result<[u32; 2], String> {
    let (w, h) = text.split_once(['x', 'X', '×']).unwrap_or((text, text));
    match (w.trim().parse(), h.trim().parse()) {
        (Ok(w), Ok(h)) => Ok([w, h]),
        _ => Err("a size is WxH in pixels, such as 1600x900".into()),
    }
}

/// Parses opacities; the error message holds only what is wrong with them.
fn opacity(text: &str) -> Result<Opacity, String> {
    TransferFunction::parse_opacity(text).map(Opacity).map_err(message)
}

/// Parses values `V,V,…`.
fn iso(text: &str) -> Result<Iso, String> {
    let values: Result<Vec<f32>, _> = text.split(',').map(|part| part.trim().parse()).collect();
    values.map(Iso).map_err(|_| "values of surfaces are numbers separated by commas, such as 120,180".into())
}

/// Examples, colour maps, and the format of a transfer function file.
fn long_help() -> String {
    let mut maps = crate::text::Page::default();
    for map in MAPS {
        maps.row(map.name, map.about);
    }
    format!("{EXAMPLES}\n\nColour maps (NAME_r is the reversed map):\n{maps}\nTransfer function in a file:\n{}", transfer::JSON_HELP)
}
