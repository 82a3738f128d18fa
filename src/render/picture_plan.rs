//! The settings of a picture evaluated for one mesh and field: everything that the kernels and the reference renderer
//! need.

use super::clip::MAX_CLIPS;
use super::rays::{LEAST, MAX_SAMPLES, View};
use super::settings::{DEFAULT_STEPS, MAX_ISO};
use super::shading::SKIN;
use super::visible_values::visible_values;
use super::{
    Background, Camera, Lighting, OPACITY_UNIT, ProjectedView, Projection, RayGrid, RenderSettings, ValidTets, auto_opacity,
    gradient_normals, shading_normals,
};
use crate::error::{Error, Result};
use crate::grid::{canonical, reciprocal, two_to};
use crate::layout::constants::frame::TABLE;
use crate::layout::{Grid, ViewUniforms};
use crate::mesh::{Bounds, Field, Mesh, On};
use glam::DVec3;

/// Entries of the sampled transfer function.
pub const TABLE_SIZE: usize = TABLE as usize;
/// Smallest step as a part of the diagonal, which keeps sample numbers exact in single precision.
const MIN_STEP: f64 = 1.0 / 65_536.0;
/// Largest distance of the eye, in diagonals: rays start near the mesh, but where is known to 2^-53 of that distance.
const MAX_DISTANCE: f64 = 1e9;

/// A picture to draw.
#[derive(Clone, Debug, PartialEq)]
pub struct PicturePlan {
    /// Width and height in rays: in pixels, unless a pixel has several.
    pub size: [u32; 2],
    /// The rays.
    pub rays: RayGrid,
    /// Distance Δ of two samples.
    pub step: f32,
    /// Part of its light that a cut loses per step behind it: 1 in the depth of the lit skin of a surface.
    pub cut_fade: f32,
    /// The field's value at place 0 of the table.
    pub value_lo: f32,
    /// Places per unit of value.
    pub value_scale: f32,
    /// [`TABLE_SIZE`] entries: sRGB colour, and the opacity of one step or of one surface.
    pub table: Vec<[f32; 4]>,
    /// Ranges of values, ascending and disjoint, outside of which the table is transparent; with iso-surfaces, the
    /// iso-values.
    pub visible_values: Vec<[f32; 2]>,
    /// Values of the iso-surfaces that are drawn instead of the volume, ascending and distinct.
    pub iso: Vec<f32>,
    /// Planes (unit normal n, and d) beyond which nothing is drawn: only points p with n·p ≤ d are.
    pub clips: Vec<[f32; 4]>,
    /// Opacity at which a ray ends.
    pub termination: f32,
    /// The light; `None`: colours are not lit.
    pub lighting: Option<Lighting>,
    /// What is behind the mesh.
    pub background: Background,
}

impl PicturePlan {
    /// Evaluates `settings` for a mesh with these bounds, whose coordinates are relative to `origin`, and a field with
    /// this range.
    ///
    /// # Errors
    /// [`Error::Invalid`] if a setting is out of its limits, if the step is below 1/65,536 of the diagonal or above the
    /// diagonal, if rays are no finite numbers or the eye is farther than 10^9 diagonals, or if the camera sees the
    /// mesh at so flat an angle that a ray would have more than [`MAX_SAMPLES`] samples.
    pub fn new(settings: &RenderSettings, bounds: &Bounds, origin: [f64; 3], field_range: Option<[f32; 2]>) -> Result<Self> {
        settings.check()?;
        let [width, height] = settings.size.map(f64::from);
        let camera = settings.camera.resolve(bounds, origin, width / height)?;
        Self::with_camera(settings, &camera, bounds, origin, field_range)
    }

    /// As [`PicturePlan::new`], but with `camera` instead of the camera of the settings.
    ///
    /// # Errors
    /// As [`PicturePlan::new`].
    pub fn with_camera(
        settings: &RenderSettings,
        camera: &Camera,
        bounds: &Bounds,
        origin: [f64; 3],
        field_range: Option<[f32; 2]>,
    ) -> Result<Self> {
        settings.check()?;
        let (distance, diagonal) = (camera.distance(bounds), bounds.diagonal());
        if distance > diagonal * MAX_DISTANCE {
            return Err(Error::Invalid(format!(
                "an eye at a distance of {distance:.1e} from the mesh, whose diagonal is {diagonal:.1e}; rays are exact up to 10^9 diagonals"
            )));
        }
        let view = camera.view(settings.size, bounds);
        if !view.rays.is_finite(settings.size) {
            let high = match camera.projection {
                Projection::Perspective(degrees) => format!("{degrees} degrees"),
                Projection::Orthographic(height) => format!("{height:e}"),
            };
            return Err(Error::Invalid(format!(
                "a picture {high} high, with rays beyond single precision; take a smaller fov or ortho height, or a larger zoom (the mesh's \
                 diagonal is {diagonal:.1e})"
            )));
        }
        Self::with_view(settings, &view, bounds, origin, field_range)
    }

    /// As [`PicturePlan::new`], but with the view of a renderer instead of the camera of the settings. Opacities are those of the
    /// settings; [`RenderSettings::for_field`] chooses some that suit a field.
    ///
    /// `bounds` contain the mesh in every frame that is drawn with this plan: nothing is drawn that is nearer than their
    /// nearest corner. The usual step and the unit of opacity are parts of their diagonal. So give a mesh that moves one box
    /// that holds all its positions.
    ///
    /// # Errors
    /// As [`PicturePlan::new`], and if the matrix has no inverse, or planes of equal depth that are not parallel to the picture.
    pub fn with_projected(
        settings: &RenderSettings,
        view: &ProjectedView,
        bounds: &Bounds,
        origin: [f64; 3],
        field_range: Option<[f32; 2]>,
    ) -> Result<Self> {
        settings.check()?;
        let view = view.view(settings.size, bounds)?;
        if !view.rays.is_finite(settings.size) {
            return Err(Error::Invalid("a matrix to clip space with rays beyond single precision".into()));
        }
        Self::with_view(settings, &view, bounds, origin, field_range)
    }

    fn with_view(settings: &RenderSettings, view: &View, bounds: &Bounds, origin: [f64; 3], field_range: Option<[f32; 2]>) -> Result<Self> {
        let diagonal = bounds.diagonal();
        let step = settings.step.unwrap_or(diagonal / DEFAULT_STEPS);
        let wrong = |why: String| Err(Error::Invalid(why));
        if step > diagonal {
            return wrong(format!("a step of {step:e} is longer than the diagonal of the mesh; take {diagonal:e} at most"));
        }
        if step < diagonal * MIN_STEP || !(step as f32).is_normal() {
            let least = (diagonal * MIN_STEP).max(f64::from(f32::MIN_POSITIVE));
            return wrong(format!("a step of {step:e} is too small for a mesh of diagonal {diagonal:e}; take at least {least:e}"));
        }
        let &View { right, up, forward, rays, reach } = view;
        if reach > step * f64::from(MAX_SAMPLES) {
            return wrong(format!(
                "rays that reach the mesh after {:.1e} steps of {step:e}, {MAX_SAMPLES} at most; move the camera to the mesh, or take a \
                 smaller angle or a step of {:e} or more",
                reach / step,
                reach / f64::from(MAX_SAMPLES)
            ));
        }
        let clips = settings.clips.iter().map(|clip| clip.resolve(bounds, origin, forward)).collect::<Result<_>>()?;
        let [across, upwards, back] = settings.light.map(f64::from);
        let to_light = (right * across + up * upwards - forward * back).try_normalize().unwrap_or(DVec3::Z).as_vec3();
        let range = value_range(settings.range.or(settings.transfer.range()).or(field_range));
        let mut iso: Vec<f32> = settings.iso.iter().copied().map(canonical).collect();
        iso.sort_by(f32::total_cmp);
        iso.dedup();
        let surfaces = !iso.is_empty();
        let exponent = f64::from(settings.opacity_scale) * if surfaces { 1.0 } else { step / (diagonal * OPACITY_UNIT) };
        let opaque = surfaces && !settings.transfer.has_opacity();
        let transfer = settings.transfer.over(range);
        let entry = |i: usize| {
            let [r, g, b, a] = transfer.at(i as f32 / (TABLE_SIZE - 1) as f32);
            let a = if opaque { 1.0 } else { a };
            [r, g, b, (1.0 - (1.0 - f64::from(a)).powf(exponent)) as f32]
        };
        // Not denormal, as devices may flush it: ranges beyond 2^126 end early.
        let value_scale = (1.0 / (range[1] - range[0])).max(f64::from(f32::MIN_POSITIVE)) as f32;
        let value_lo = range[0] as f32;
        let table: Vec<_> = (0..TABLE_SIZE).map(entry).collect();
        Ok(Self {
            size: settings.size,
            rays,
            step: step as f32,
            cut_fade: (step / (diagonal * SKIN)) as f32,
            value_lo,
            value_scale,
            visible_values: if surfaces { iso.iter().map(|&v| [v; 2]).collect() } else { visible_values(&table, value_lo, value_scale) },
            table,
            iso,
            clips,
            termination: settings.termination,
            lighting: settings.shading.then(|| Lighting::new(to_light, (1.0 - (1.0 - f64::from(settings.outline)).powf(exponent)) as f32)),
            background: settings.background,
        })
    }

    /// Whether some of these values are transparent, so that parts of the mesh can be skipped.
    pub fn hides(&self, values: &[f32]) -> bool {
        let everything = matches!(self.visible_values[..], [[lo, hi]] if lo.is_infinite() && hi.is_infinite());
        let is_hidden = |v: f32| {
            let first = self.visible_values.partition_point(|&[_, end]| end < v);
            v.is_finite() && self.visible_values.get(first).is_none_or(|&[begin, _]| v < begin)
        };
        !everything && values.iter().copied().any(is_hidden)
    }

    /// The plan as the kernels take it, without the table.
    pub fn view(&self) -> ViewUniforms {
        let with = |v: [f32; 3], w: f32| [v[0], v[1], v[2], w];
        let [p, q, r, s] = self.rays.depth;
        let Lighting { to_light: [x, y, z], strength: [ambient, diffuse, specular], fill, rim } =
            self.lighting.unwrap_or(Lighting { to_light: [0.0, 0.0, 1.0], strength: [1.0, 0.0, 0.0], fill: 0.0, rim: 0.0 });
        let mut iso = [0.0; MAX_ISO];
        iso.iter_mut().zip(&self.iso).for_each(|(to, v)| *to = *v);
        let mut clip = [[0.0; 4]; MAX_CLIPS];
        clip.iter_mut().zip(&self.clips).for_each(|(to, plane)| *to = *plane);
        ViewUniforms {
            origin: with(self.rays.origin, p),
            origin_x: with(self.rays.origin_x, q),
            origin_y: with(self.rays.origin_y, r),
            direction: with(self.rays.direction, s),
            direction_x: with(self.rays.direction_x, 0.0),
            direction_y: with(self.rays.direction_y, 0.0),
            to_light: [x, y, z, fill],
            strength: [ambient, diffuse, specular, rim],
            step_size: self.step,
            inverse_step: self.inverse_step(),
            value_lo: self.value_lo,
            value_scale: self.value_scale,
            termination: self.termination,
            isos: self.iso.len().min(MAX_ISO) as u32,
            clips: self.clips.len().min(MAX_CLIPS) as u32,
            cut_fade: self.cut_fade,
            iso,
            clip,
        }
    }

    /// The picture for `colors` as in [`crate::query::Rendered`], composited over the background: four bytes per pixel,
    /// straight alpha. A pixel is the mean of `across` by `across` rays; rays at the right and at the bottom that fill
    /// no pixel are left out.
    pub fn pixels(&self, colors: &[[f32; 4]], across: u32) -> Vec<u8> {
        let n = across.max(1);
        let [width, height] = self.size.map(|rays| rays / n);
        let share = 1.0 / (n as f32 * n as f32);
        let rows: Vec<&[[f32; 4]]> = colors.chunks_exact(self.size[0].max(1) as usize).collect();
        let pixel = |rows: &[&[[f32; 4]]], x: u32, y: u32| {
            let rays = rows.iter().flat_map(|row| &row[(x * n) as usize..((x + 1) * n) as usize]);
            let sum = rays.fold([0.0; 4], |sum, color| [0, 1, 2, 3].map(|c| sum[c] + color[c]));
            self.background.pixel(sum.map(|v| v * share), y, height)
        };
        let of_row = |(rows, y)| (0..width).flat_map(move |x| pixel(rows, x, y));
        rows.chunks_exact(n as usize).zip(0..height).flat_map(of_row).collect()
    }

    /// The reciprocal of the step.
    pub fn inverse_step(&self) -> f32 {
        1.0 / self.step
    }

    /// The position of sample `k` of a ray (origin, unit direction).
    pub fn sample(&self, (origin, direction): ([f32; 3], [f32; 3]), k: u32) -> [f32; 3] {
        let t = (k as f32 + 0.5) * self.step;
        [0, 1, 2].map(|c| origin[c] + direction[c] * t)
    }

    /// The stretch of a ray (origin, unit direction) that no clip leaves out, and that lies within `limit`, in steps from
    /// the origin, and the clip at which it begins. Clip (n, d) meets the ray at `((d − n·origin) · (1/(n·direction))) · (1/Δ)`, or nowhere if
    /// n·direction is below [`LEAST`]. Nothing is left if the end is less than the start.
    pub fn kept_stretch(&self, (origin, direction): ([f32; 3], [f32; 3]), limit: f32) -> ([f32; 2], Option<usize>) {
        let (mut kept, mut cut) = ([0.0, limit], None);
        for (i, &[x, y, z, d]) in self.clips.iter().enumerate() {
            let dot = |v: [f32; 3]| (x * v[0] + y * v[1]) + z * v[2];
            let (before, speed) = (d - dot(origin), dot(direction));
            if speed.abs() < LEAST {
                kept[1] = if before < 0.0 { -1.0 } else { kept[1] };
                continue;
            }
            let at = ((before * reciprocal(speed)) * self.inverse_step()).clamp(-1.0, MAX_SAMPLES as f32);
            if speed > 0.0 {
                kept[1] = kept[1].min(at);
            } else if at > kept[0] {
                (kept[0], cut) = (at, Some(i));
            }
        }
        (kept, cut)
    }

    /// The normal at a place of a ray, `at` steps from its origin, whose own is `n`. A cut, where a clip opens the mesh
    /// at `begin` steps, is lit like a surface: with w = 1 − (at − begin)·fade, if that is above 0, it is `n + (n_clip −
    /// n)·w`.
    pub fn beside_cut(&self, at: f32, n: [f32; 3], ([begin, _], cut): ([f32; 2], Option<usize>)) -> [f32; 3] {
        let part = 1.0 - (at - begin) * self.cut_fade;
        let Some(clip) = cut.and_then(|i| self.clips.get(i)).filter(|_| part > 0.0) else { return n };
        [0, 1, 2].map(|c| n[c] + (clip[c] - n[c]) * part)
    }

    /// Colour, and opacity of one step, at a finite value. With `x = clamp((value − lo)·scale, 0, 1)·1023`, i =
    /// min(floor(x), 1022) and t = x − i, it is `table[i] + (table[i+1] − table[i])·t`.
    pub fn lookup(&self, value: f32) -> [f32; 4] {
        let x = ((value - self.value_lo) * self.value_scale).clamp(0.0, 1.0) * (TABLE_SIZE - 1) as f32;
        let i = (x as usize).min(TABLE_SIZE - 2);
        let t = x - i as f32;
        let (a, b) = (self.table[i], self.table[i + 1]);
        [0, 1, 2, 3].map(|c| a[c] + (b[c] - a[c]) * t)
    }
}

/// How much larger than its cell the box of a node is when rays are tested against it, so that no sample is lost by
/// rounding of samples, boxes and rays. 2^-18 of the bounds is 1/256 of the smallest cell; 2^-21 of a coordinate is
/// four of its last bits. Twin of `glsl/query/volume_plan`.
pub(crate) fn interval_slack(grid: &Grid) -> [f32; 3] {
    let (lo, hi) = (grid.lo, grid.hi);
    let largest = (0..3).map(|c| canonical(hi[c] - lo[c])).fold(0.0, f32::max);
    [0, 1, 2].map(|c| canonical(largest * two_to(-18)) + canonical(canonical(lo[c].abs() + hi[c].abs()) * two_to(-21)))
}

/// A plan with the camera of the settings, and the normals that its light needs.
#[derive(Clone, Debug)]
pub struct Prepared {
    /// The plan.
    pub plan: PicturePlan,
    /// The camera, framed around the mesh's vertices.
    pub camera: Camera,
    /// The bounds of the mesh.
    pub bounds: Bounds,
    /// A normal per point of the mesh; empty without shading.
    pub normals: Vec<[f32; 3]>,
    /// The values at the ends of the transfer function.
    pub range: [f32; 2],
}

impl Prepared {
    /// Prepares everything needed to draw `field` on `mesh`.
    ///
    /// # Errors
    /// As [`PicturePlan::new`].
    pub fn new(settings: &RenderSettings, mesh: &Mesh, valid: &ValidTets<'_>, field: &Field) -> Result<Self> {
        let settings = settings.for_field(mesh, valid, field)?;
        let points = if settings.frames_bounds { valid.bounds.corners().to_vec() } else { used_points(mesh, valid) };
        let aspect = f64::from(settings.size[0]) / f64::from(settings.size[1]);
        let camera = settings.camera.resolve_around(&valid.bounds, &points, mesh.origin, aspect)?;
        let plan = PicturePlan::with_camera(&settings, &camera, &valid.bounds, mesh.origin, None)?;
        let range = settings.range.unwrap_or([0.0, 1.0]);
        Ok(Self { plan, camera, bounds: valid.bounds, normals: settings.normals(mesh, valid, field), range })
    }
}

impl RenderSettings {
    /// These settings with what they leave open chosen for a field: the range of values and, for a volume, opacities. Done
    /// once per field; a renderer then makes a [`PicturePlan`] of them in every frame.
    ///
    /// # Errors
    /// [`Error::Invalid`] if a setting is out of its limits, or for iso-surfaces of a field of cells.
    pub fn for_field(&self, mesh: &Mesh, valid: &ValidTets<'_>, field: &Field) -> Result<Self> {
        let range = self.range_for(mesh, valid, field);
        let mut settings = Self { range: Some(range), ..self.clone() };
        settings.check()?;
        if !settings.iso.is_empty() && field.on == On::Cells {
            return Err(Error::Invalid(format!(
                "iso-surfaces of `{}`, a field of cells, which jumps from cell to cell; take a field of points, or an opacity that \
                 shows some values only",
                field.name
            )));
        }
        if settings.iso.is_empty() && !settings.transfer.has_opacity() {
            settings.transfer = settings.transfer.with_opacity(auto_opacity(mesh, valid, field, range))?;
        }
        Ok(settings)
    }

    /// A normal per point of the mesh for the light of these settings; empty without light.
    pub fn normals(&self, mesh: &Mesh, valid: &ValidTets<'_>, field: &Field) -> Vec<[f32; 3]> {
        match (self.shading, self.iso.is_empty()) {
            (false, _) => Vec::new(),
            (true, true) => shading_normals(mesh, valid, field, self.range_for(mesh, valid, field)),
            (true, false) => gradient_normals(mesh, valid, field),
        }
    }

    /// The range of values that is asked for, or that of the field.
    fn range_for(&self, mesh: &Mesh, valid: &ValidTets<'_>, field: &Field) -> [f32; 2] {
        self.range.or(self.transfer.range()).or_else(|| mesh.range(field, valid.is_valid)).unwrap_or([0.0, 1.0])
    }
}

/// The vertices of valid tetrahedra.
fn used_points(mesh: &Mesh, valid: &ValidTets<'_>) -> Vec<DVec3> {
    let mut used = vec![false; mesh.points.len()];
    for id in valid.of(mesh).flat_map(|(_, ids)| ids) {
        used[id] = true;
    }
    let points = mesh.points.iter().zip(used).filter(|(_, used)| *used);
    points.map(|(p, _)| DVec3::from_array(p.map(f64::from))).collect()
}

/// The range of values, made wide enough for a constant field, which then lies in the middle.
fn value_range(range: Option<[f32; 2]>) -> [f64; 2] {
    let [lo, hi] = range.unwrap_or([0.0, 1.0]).map(f64::from);
    let least = lo.abs().max(hi.abs()).max(1e-30) * 1e-6;
    if hi - lo < least { [lo - least, hi + least] } else { [lo, hi] }
}

#[cfg(test)]
mod tests;
