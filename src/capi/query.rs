//! The owning calls of the C interface: each queries a tree that olbvh owns, waits, and fills the caller's arrays.

use super::{HeldMesh, OLBVH_TOUCHED, OlbvhStatus, OlbvhTree, array, array_mut, border, handle, text, tolerance};
use crate::error::{Error, Result};
use crate::gpu::BufferRef;
use crate::mesh::{Bounds, Field, Mesh, On};
use crate::query::{LocateOptions, SILENT, locate, nearest, overlap, render, slice};
use crate::render::settings::MAX_ISO;
use crate::render::{PicturePlan, Prepared, RenderSettings, TransferFunction, ValidTets};
use crate::slicing::{Band, Extrapolate, TOUCHED, VoxelGrid};
use bytemuck::Pod;
use std::ffi::c_char;
use std::mem::MaybeUninit;
use std::slice::IterMut;
use std::sync::OnceLock;

/// What a picture shows. `olbvh_default_picture_settings` returns the defaults.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct OlbvhPictureSettings {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// The camera, in the form of `olbvh render --camera`; null: it sees the whole mesh from an oblique direction.
    pub camera: *const c_char,
    /// Half-spaces that are left out, each in the form of `olbvh render --clip`, separated by spaces; null: none.
    pub clips: *const c_char,
    /// Name of a colour map, as for `olbvh render --tf`; null: the default.
    pub colors: *const c_char,
    /// Opacity, in the form of `olbvh render --opacity`; null: `olbvh_render` adapts it to the field, `olbvh_view_make`
    /// lets it increase with the value.
    pub opacity: *const c_char,
    /// Values of iso-surfaces, which are drawn instead of the volume.
    pub iso: [f32; 8],
    /// Number of values in `iso` that are used; 0: the volume is drawn.
    pub iso_count: u32,
    /// Values at the two ends of the colour map. If the first is greater than the second, all values of the field are
    /// covered.
    pub range: [f32; 2],
    /// Distance between two samples in units of the mesh; 0: 1/512 of the diagonal of its bounding box.
    pub step: f64,
    /// Factor on the opacity: 2 makes the mesh as opaque as if rays travelled twice the distance through it.
    pub opacity_scale: f32,
    /// A ray ends when its opacity reaches this.
    pub termination: f32,
    /// Not 0: the surface, and steep changes of the field, are lit.
    pub shading: u32,
    /// Minimum opacity of a lit surface that is seen edge-on.
    pub outline: f32,
    /// Direction to the light: components to the right, upwards, and towards the viewer.
    pub light: [f32; 3],
}

/// Geometry of a stack of layers of voxels, in the coordinates of the mesh.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct OlbvhVoxels {
    /// Centre of voxel (0, 0) of layer 0.
    pub origin: [f32; 3],
    /// Vector from one voxel to the next in a row.
    pub next_voxel: [f32; 3],
    /// Vector from one row to the next.
    pub next_row: [f32; 3],
    /// Vector from one layer to the next.
    pub next_layer: [f32; 3],
    /// Half axes of a voxel's box.
    pub half: [[f32; 3]; 3],
    /// Number of voxels in a row.
    pub width: u32,
    /// Number of rows in a layer.
    pub height: u32,
    /// Number of layers.
    pub layers: u32,
}

impl OlbvhPictureSettings {
    /// The settings in Rust.
    ///
    /// # Safety
    /// See [`crate::capi`].
    pub(super) unsafe fn read(&self) -> Result<RenderSettings> {
        // SAFETY: the caller keeps the rules of `capi`.
        let [camera, clips, colors, opacity] = [self.camera, self.clips, self.colors, self.opacity].map(|string| unsafe { text(string) });
        let mut settings = RenderSettings {
            size: [self.width, self.height],
            iso: self.iso[..MAX_ISO.min(self.iso_count as usize)].to_vec(),
            range: (self.range[0] <= self.range[1]).then_some(self.range),
            step: (self.step != 0.0).then_some(self.step),
            opacity_scale: self.opacity_scale,
            termination: self.termination,
            shading: self.shading != 0,
            outline: self.outline,
            light: self.light,
            ..RenderSettings::default()
        };
        if self.iso_count as usize > MAX_ISO {
            return Err(Error::Invalid(format!("{} iso-surfaces; give up to {MAX_ISO}", self.iso_count)));
        }
        if let Some(camera) = camera {
            settings.camera = camera.parse()?;
        }
        if let Some(clips) = clips {
            settings.clips = clips.split_whitespace().map(str::parse).collect::<Result<_>>()?;
        }
        if let Some(colors) = colors {
            settings.transfer = TransferFunction::named(&colors)?;
        }
        if let Some(opacity) = opacity {
            settings.transfer = settings.transfer.with_opacity(TransferFunction::parse_opacity(&opacity)?)?;
        }
        Ok(settings)
    }
}

impl OlbvhVoxels {
    pub(super) fn read(&self) -> VoxelGrid {
        let Self { origin, next_voxel, next_row, next_layer, half, width, height, layers } = *self;
        VoxelGrid { origin, next_voxel, next_row, next_layer, half, size: [width, height], layers }
    }
}

/// Arrays of a mesh in host memory, read back when a picture first needs them. They are those of the device, in the
/// order there.
#[derive(Default)]
pub(super) struct HostCopy {
    pub(super) mesh: OnceLock<Mesh>,
    pub(super) neighbours: OnceLock<Vec<[u32; 4]>>,
    pub(super) bad: OnceLock<Vec<u32>>,
}

/// The content of a cell, which is made first if there is none.
fn kept<T>(cell: &OnceLock<T>, make: impl FnOnce() -> Result<T>) -> Result<&T> {
    match cell.get() {
        Some(value) => Ok(value),
        None => make().map(|made| cell.get_or_init(|| made)),
    }
}

impl HeldMesh {
    /// The plan of a picture, and its normals (none without shading). The mesh is read back only if the settings leave
    /// open what depends on it.
    fn prepare(&self, settings: &RenderSettings, bounds: Bounds, field: &Field) -> Result<(PicturePlan, Vec<[f32; 3]>)> {
        let RenderSettings { camera, transfer, iso, range, shading, .. } = settings;
        let adapts = iso.is_empty() && !transfer.has_opacity();
        let frames = camera.eye.is_none() || camera.ortho == Some(None);
        let needs_mesh = range.or(transfer.range()).is_none() || adapts || frames || *shading;
        // What is wrong with surfaces of a field of cells, `Prepared` says.
        if !needs_mesh && (iso.is_empty() || field.on == On::Points) {
            return Ok((PicturePlan::new(settings, &bounds, [0.0; 3], None)?, Vec::new()));
        }
        let bad = if self.device.status().bad == 0 { &[][..] } else { kept(&self.copy.bad, || self.device.bad_cells())? };
        // Opacity and light of a volume depend on where the surface is.
        let surface = adapts || iso.is_empty() && *shading;
        let neighbours = if surface { kept(&self.copy.neighbours, || self.device.neighbours())? } else { &[][..] };
        let valid = ValidTets { bounds, neighbours, is_valid: &|tet| bad.binary_search(&tet).is_err() };
        let Prepared { plan, normals, .. } = Prepared::new(settings, kept(&self.copy.mesh, || self.download())?, &valid, field)?;
        Ok((plan, normals))
    }

    /// The mesh in the order in which it lies on the device.
    fn download(&self) -> Result<Mesh> {
        let input = self.device.input();
        let (points, tets) = (self.download_part(input.positions, input.points)?, self.download_part(input.cells, input.tets)?);
        Ok(Mesh::new(points, tets))
    }

    fn download_part<T: Pod>(&self, part: BufferRef, count: u32) -> Result<Vec<T>> {
        let mut all = vec![T::zeroed(); count as usize];
        if count > 0 {
            self.device.gpu().download_ref(part, bytemuck::cast_slice_mut(&mut all))?;
        }
        Ok(all)
    }
}

/// The caller's array that a call fills, unless the caller does not want it, which null says.
///
/// # Safety
/// See [`crate::capi`].
unsafe fn wanted<'a, T>(pointer: *mut T, count: usize, what: &str) -> Result<&'a mut [MaybeUninit<T>]> {
    // SAFETY: the caller keeps the rules of `capi`.
    unsafe { array_mut(pointer, if pointer.is_null() { 0 } else { count }, what) }
}

/// Writes values to the places that are next, as long as there are any.
pub(super) fn fill<T>(places: &mut IterMut<'_, MaybeUninit<T>>, values: impl IntoIterator<Item = T>) {
    // In this order: the first iterator of a pair may be asked once more than the second.
    for (value, place) in values.into_iter().zip(places) {
        place.write(value);
    }
}

/// Finds the owner of each of `count` points (three floats each): a tetrahedron, or `UINT32_MAX` if the point lies
/// outside of the mesh. `barycentrics` gets four floats per point, in the order of the tetrahedron's vertices; it may
/// be null. A point slightly outside of the mesh is accepted if its smallest barycentric coordinate in the nearest
/// tetrahedron is at least `-tolerance`; a negative `tolerance` selects the default, 1e-5.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn olbvh_locate(
    tree: *const OlbvhTree,
    points: *const f32,
    count: usize,
    tolerance: f32,
    owners: *mut u32,
    barycentrics: *mut f32,
) -> OlbvhStatus {
    border(|| {
        // SAFETY: the caller keeps the rules of `capi`.
        let (OlbvhTree { mesh, tree, .. }, points) = unsafe { (handle(tree, "tree")?, array(points.cast(), count, "points")?) };
        // SAFETY: the caller keeps the rules of `capi`.
        let (owners, weights) = unsafe { (array_mut(owners, count, "owners")?, wanted(barycentrics.cast(), count, "barycentrics")?) };
        let options = LocateOptions { tolerance: self::tolerance(tolerance), ..LocateOptions::default() };
        let found = locate(tree, points, None, &options, SILENT)?;
        fill(&mut owners.iter_mut(), found.owners.into_iter().map(|owner| mesh.cell(owner)));
        fill(&mut weights.iter_mut(), found.barycentrics);
        Ok(())
    })
}

/// Samples a field at `count` points (three floats each). `values` has `components` floats, 1 or more, for each point of the
/// mesh, or for each tetrahedron if `on_cells` is not 0, such as the three of a velocity next to each other. `results` gets
/// as many for each point, NaN outside of the mesh. `tolerance` as for `olbvh_locate`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn olbvh_sample(
    tree: *const OlbvhTree,
    points: *const f32,
    count: usize,
    tolerance: f32,
    values: *const f32,
    components: u32,
    on_cells: u32,
    results: *mut f32,
) -> OlbvhStatus {
    border(|| {
        // SAFETY: the caller keeps the rules of `capi`.
        let (OlbvhTree { mesh, tree, .. }, points) = unsafe { (handle(tree, "tree")?, array(points.cast(), count, "points")?) };
        if components == 0 {
            return Err(Error::Invalid("components is 0".into()));
        }
        let size = count.saturating_mul(components as usize);
        // SAFETY: the caller keeps the rules of `capi`.
        let (results, (values, on)) = unsafe { (array_mut(results, size, "results")?, mesh.field(values, on_cells, components)?) };
        let options = LocateOptions { tolerance: self::tolerance(tolerance), ..LocateOptions::default() };
        let sampled = locate(tree, points, Some((&values, on)), &options, SILENT)?.values;
        // A mesh without points or cells has no components.
        fill(&mut results.iter_mut(), sampled.into_iter().chain(std::iter::repeat(f32::NAN)));
        Ok(())
    })
}

/// Finds the place of the mesh's surface that is closest to each of `count` points (three floats each), inside or outside:
/// the tetrahedron with it, or `OLBVH_NONE` if none is at most `within` away, a length like the coordinates. However large
/// `within` is, places farther away than some limit, which lies between half of the mesh's largest extent and all of it,
/// are not found. `barycentrics` gets four floats per point, in the order of the tetrahedron's vertices, and `distances`
/// one, NaN without a place; each of these two may be null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn olbvh_nearest(
    tree: *const OlbvhTree,
    points: *const f32,
    count: usize,
    within: f32,
    owners: *mut u32,
    barycentrics: *mut f32,
    distances: *mut f32,
) -> OlbvhStatus {
    border(|| {
        // SAFETY: the caller keeps the rules of `capi`.
        let (OlbvhTree { mesh, tree, .. }, points) = unsafe { (handle(tree, "tree")?, array(points.cast(), count, "points")?) };
        // SAFETY: the caller keeps the rules of `capi`.
        let (owners, weights) = unsafe { (array_mut(owners, count, "owners")?, wanted(barycentrics.cast(), count, "barycentrics")?) };
        // SAFETY: the caller keeps the rules of `capi`.
        let distances = unsafe { wanted(distances, count, "distances")? };
        let found = nearest(tree, points, within, SILENT)?;
        fill(&mut distances.iter_mut(), found.distances());
        fill(&mut owners.iter_mut(), found.owners.into_iter().map(|owner| mesh.cell(owner)));
        fill(&mut weights.iter_mut(), found.barycentrics);
        Ok(())
    })
}

/// The default settings of pictures.
#[unsafe(no_mangle)]
pub extern "C" fn olbvh_default_picture_settings() -> OlbvhPictureSettings {
    let RenderSettings { size: [width, height], opacity_scale, termination, shading, outline, light, .. } = RenderSettings::default();
    let [camera, clips, colors, opacity] = [std::ptr::null(); 4];
    let (iso, iso_count, range, step, shading) = ([0.0; 8], 0, [1.0, 0.0], 0.0, u32::from(shading));
    OlbvhPictureSettings {
        width,
        height,
        camera,
        clips,
        colors,
        opacity,
        iso,
        iso_count,
        range,
        step,
        opacity_scale,
        termination,
        shading,
        outline,
        light,
    }
}

/// Draws a field as a picture. `values` has a float per point, or per tetrahedron if `on_cells` is not 0. `pixels` gets
/// four floats per pixel, upper row first: colour (sRGB, 0 to 1) multiplied by its opacity, and opacity. The caller
/// adds the background. The mesh is read back to host memory, once, when settings first need it there: with shading, or
/// if `opacity`, `range`, or `eye` of `camera` is not given.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn olbvh_render(
    tree: *const OlbvhTree,
    settings: *const OlbvhPictureSettings,
    values: *const f32,
    on_cells: u32,
    pixels: *mut f32,
) -> OlbvhStatus {
    border(|| {
        // SAFETY: the caller keeps the rules of `capi`.
        let (OlbvhTree { mesh, tree, .. }, settings) = unsafe { (handle(tree, "tree")?, handle(settings, "settings")?.read()?) };
        settings.check()?;
        let [width, height] = settings.size.map(|n| n as usize);
        // SAFETY: the caller keeps the rules of `capi`.
        let (pixels, (values, on)) = unsafe { (array_mut(pixels.cast(), width * height, "pixels")?, mesh.field(values, on_cells, 1)?) };
        let field = Field { name: "values".into(), on, values };
        let (plan, normals) = mesh.prepare(&settings, tree.grid().into(), &field)?;
        let normals = (!normals.is_empty()).then_some(&normals[..]);
        fill(&mut pixels.iter_mut(), render(tree, &plan, (&field.values, on), normals, SILENT)?.colors);
        Ok(())
    })
}

/// Slices a mesh conservatively: no voxel that the mesh touches is left empty. `answers`, if not null, gets a word per
/// voxel, layer by layer and row by row: the tetrahedron that contains its centre; if there is none, 2^31 plus the
/// tetrahedron nearest to its centre of those that touch its box; `UINT32_MAX` if the voxel is empty. `results`, if not
/// null, gets a float per voxel: the value of the field (`values` and `on_cells` as for `olbvh_render`; not read if
/// `results` is null), NaN if the voxel is empty. A voxel that is merely touched gets the value at the tetrahedron's point
/// nearest to its centre or, if `linear` is not 0, the tetrahedron's linear field extrapolated to its centre.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn olbvh_slice(
    tree: *const OlbvhTree,
    voxels: *const OlbvhVoxels,
    values: *const f32,
    on_cells: u32,
    linear: u32,
    answers: *mut u32,
    results: *mut f32,
) -> OlbvhStatus {
    border(|| {
        // SAFETY: the caller keeps the rules of `capi`.
        let (OlbvhTree { mesh, tree, .. }, voxels) = unsafe { (handle(tree, "tree")?, handle(voxels, "voxels")?.read()) };
        voxels.check()?;
        let count = usize::try_from(voxels.voxels()).map_err(|_| Error::TooLarge(format!("{} voxels", voxels.voxels())))?;
        // SAFETY: the caller keeps the rules of `capi`.
        let (answers, results) = unsafe { (wanted(answers, count, "answers")?, wanted(results, count, "results")?) };
        // SAFETY: the caller keeps the rules of `capi`.
        let field = if results.is_empty() { None } else { Some(unsafe { mesh.field(values, on_cells, 1)? }) };
        let (mut answers, mut results) = (answers.iter_mut(), results.iter_mut());
        let extrapolate = if linear == 0 { Extrapolate::Nearest } else { Extrapolate::Linear };
        let mut sink = |band: Band| {
            let touched = |kind: u8| if kind == TOUCHED { OLBVH_TOUCHED } else { 0 };
            let owners = band.owners.iter().zip(&band.kinds).map(|(&owner, &kind)| mesh.cell(owner) | touched(kind));
            fill(&mut answers, owners);
            fill(&mut results, band.values);
            Ok(())
        };
        let field = field.as_ref().map(|(values, on)| (&values[..], *on));
        slice(tree, field, &voxels, extrapolate, SILENT, &mut sink)?;
        Ok(())
    })
}

/// Finds the tetrahedra of each mesh that intersect the other mesh. The points of both meshes are in the same
/// coordinate system. In `hits_a` and `hits_b`, bit i % 32 of word i / 32 is set if tetrahedron i intersects the other
/// mesh; each gets one word per 32 tetrahedra, rounded up. Both trees must have been made with the same `olbvh_gpu`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn olbvh_overlap(a: *const OlbvhTree, b: *const OlbvhTree, hits_a: *mut u32, hits_b: *mut u32) -> OlbvhStatus {
    border(|| {
        // SAFETY: the caller keeps the rules of `capi`.
        let [a, b] = unsafe { [handle(a, "a")?, handle(b, "b")?] };
        let words = |tree: &OlbvhTree| tree.mesh.device.input().tets.div_ceil(32) as usize;
        // SAFETY: the caller keeps the rules of `capi`.
        let hits = unsafe { [array_mut(hits_a, words(a), "hits_a")?, array_mut(hits_b, words(b), "hits_b")?] };
        let found = overlap(&a.tree, &b.tree, SILENT)?.overlap;
        for ((hits, tree), found) in hits.into_iter().zip([a, b]).zip([found.a, found.b]) {
            let mut bits = vec![0; words(tree)];
            for cell in found.into_iter().map(|tet| tree.mesh.cell(tet)) {
                bits[(cell / 32) as usize] |= 1 << (cell % 32);
            }
            fill(&mut hits.iter_mut(), bits);
        }
        Ok(())
    })
}
