//! The C interface, `include/olbvh.h`: opaque handles, status codes, and one error message per thread. Build it with
//! `cargo rustc --release --lib --no-default-features --features capi --crate-type cdylib` (or `staticlib`).
//!
//! Functions return 0 or an error code; [`olbvh_last_error`] returns the text of the error. No panic crosses the border
//! to C. A handle keeps alive what it was made from, so handles may be freed in any order. Several threads may use one
//! handle at the same time, except a recording, which belongs to one thread at a time.
//!
//! The module is private: it is not an interface for Rust. C finds the functions by their exported names.
//!
//! # Safety
//! Every unsafe function here, exported or not, asks for the same; the header tells C programs so, once for all:
//! - A pointer that is not null points to as many elements as the function says. They stay valid during the call. What
//!   is read is initialised, and nothing writes it meanwhile; what is written overlaps no other argument, and nothing
//!   else uses it meanwhile.
//! - A handle comes from this library, and is not freed before the call has ended. Only one thread at a time uses a
//!   recording.
//! - A string ends with a zero byte.
//! - Handles and functions of Vulkan and of the host are what the function asks for.
//!
//! Pointers that are not aligned for their type are found, like null where it is not allowed; see [`check`]. What the
//! functions make of a pointer, they do not keep after the call.
#![allow(unsafe_code, reason = "the border to C")]

mod host;
mod lists;
mod query;
mod record;
#[cfg(test)]
mod tests;

use crate::build::{BadCells, DeviceMesh, Tree};
use crate::error::{Error, Result};
use crate::glsl::SceneBuffers;
use crate::gpu::{Buffer, Gpu, GpuOptions};
use crate::grid::MAX_LEVEL;
use crate::layout::{NONE, constants::voxels::SLICE_TOUCHED};
use crate::mesh::{Bounds, Mesh, On};
use crate::options::{Assign, BuildOptions, Fineness, Lists, TOLERANCE};
use std::borrow::Cow;
use std::cell::RefCell;
use std::ffi::{CStr, CString, c_char};
use std::mem::MaybeUninit;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

/// Result of a call.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OlbvhStatus {
    /// The call succeeded.
    Ok = 0,
    /// An argument is invalid.
    Invalid = 1,
    /// There is no Vulkan, no suitable device, or the device failed the self-test.
    Device = 2,
    /// There is not enough device memory.
    Memory = 3,
    /// The problem is larger than the device or 32-bit offsets allow.
    TooLarge = 4,
    /// A Vulkan call failed.
    Vulkan = 5,
    /// Any other error; please report it.
    Internal = 6,
    /// The device is lost (`VK_ERROR_DEVICE_LOST`): free all handles and start again with a new device.
    Lost = 7,
}

/// A device.
pub struct OlbvhGpu(Gpu);

/// A mesh in the device's memory.
pub struct OlbvhMesh(Arc<HeldMesh>);

/// A mesh, and the caller's numbers of its tetrahedra and points.
struct HeldMesh {
    device: DeviceMesh,
    /// The caller's number of each tetrahedron and of each point, if the mesh was reordered.
    ids: Option<Arc<[Vec<u32>; 2]>>,
    copy: query::HostCopy,
}

impl HeldMesh {
    /// The caller's number of a tetrahedron; `NONE` stays `NONE`.
    fn cell(&self, tet: u32) -> u32 {
        self.ids.as_ref().and_then(|ids| ids[0].get(tet as usize).copied()).unwrap_or(tet)
    }

    /// The caller's field, with so many floats for each point or tetrahedron, brought into the order of the mesh.
    ///
    /// # Safety
    /// See [`crate::capi`].
    unsafe fn field(&self, values: *const f32, on_cells: u32, components: u32) -> Result<(Vec<f32>, On)> {
        let (on, mesh) = (on(on_cells), self.device.input());
        let items = if on == On::Points { mesh.points } else { mesh.tets } as usize;
        let components = components as usize;
        // SAFETY: the caller keeps the rules of `capi`.
        let values = unsafe { array(values, items.saturating_mul(components), "values")? };
        let ids = self.ids.as_ref().map(|ids| &ids[usize::from(on == On::Points)]);
        let of = |&i: &u32| &values[i as usize * components..][..components];
        Ok((ids.map_or_else(|| values.to_vec(), |ids| ids.iter().flat_map(of).copied().collect()), on))
    }
}

/// What the values of a field belong to.
fn on(on_cells: u32) -> On {
    if on_cells == 0 { On::Points } else { On::Cells }
}

/// The tolerance to use; a negative argument selects the default.
fn tolerance(given: f32) -> f32 {
    if given < 0.0 { TOLERANCE } else { given }
}

/// A tree over a mesh.
pub struct OlbvhTree {
    mesh: Arc<HeldMesh>,
    tree: Tree,
    /// The device addresses that shaders read, see `olbvh.glsl`.
    addresses: Buffer,
}

/// How to build a tree. `olbvh_default_build_options` returns the defaults.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct OlbvhBuildOptions {
    /// The paper's alpha, from 0 to 10: how many levels coarser than the size of the tetrahedra the leaves are.
    pub alpha: f32,
    /// Which octree cells list a tetrahedron. 0: all cells of its bounding box. 1: of these, the cells that no face
    /// plane of the tetrahedron separates from it. 2: exactly the cells that it touches.
    pub assign: u32,
    /// Which leaves have full lists. 0: every leaf lists all its tetrahedra (the paper). 1: only leaves that the
    /// surface touches; every other leaf has one entry, from which walks across faces find the others.
    pub lists: u32,
    /// Level of the leaves, from 1 to 10, which overrides alpha; meshes with thin parts profit from a level finer than
    /// alpha 0 gives. 0: alpha decides.
    pub level: u32,
    /// Whether leaves become finer than that. 0: no. 1: yes where lists are long, which suits location of points,
    /// slices and overlap. 2: as fine as suits pictures. A recorded build ignores this.
    pub fineness: u32,
    /// Not 0: leaves at the surface tell most points beside the mesh without a search, for 4 bytes per leaf and up to a
    /// third more time of a build. This pays for pictures and slices of thin bodies.
    pub slabs: u32,
    /// Maximum number of entries of the tree, which is made coarser until it fits; `olbvh_tree_build` counts those of
    /// `assign` 0 with full lists, which are more. 0: the usual capacity, 64 entries per tetrahedron and at least 2^20,
    /// or that of `olbvh_plan`.
    pub capacity: u32,
    /// Maximum number of bytes of all arrays of the tree together; it is made coarser until it fits. 0: no limit.
    pub budget: u64,
}

impl OlbvhBuildOptions {
    fn read(&self) -> Result<BuildOptions> {
        check_level(self.level)?;
        let unknown = |what: &str, n: u32| Error::Invalid(format!("{what} {n} is not known"));
        Ok(BuildOptions {
            alpha: self.alpha,
            assign: Assign::EVERY.into_iter().find(|a| *a as u32 == self.assign).ok_or_else(|| unknown("assign", self.assign))?,
            lists: Lists::EVERY.into_iter().find(|l| *l as u32 == self.lists).ok_or_else(|| unknown("lists", self.lists))?,
            boxes: false,
            slabs: self.slabs != 0,
            capacity: (self.capacity != 0).then_some(self.capacity),
            budget: (self.budget != 0).then_some(self.budget),
            level: (self.level != 0).then_some(self.level),
            fineness: Fineness::EVERY.into_iter().find(|f| *f as u32 == self.fineness).ok_or_else(|| unknown("fineness", self.fineness))?,
        })
    }
}

/// Rejects a level that a tree cannot have.
fn check_level(level: u32) -> Result<()> {
    if level > MAX_LEVEL { Err(Error::Invalid(format!("level {level}; the deepest is {MAX_LEVEL}"))) } else { Ok(()) }
}

/// Properties of a tree.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct OlbvhTreeInfo {
    /// Level of the leaves.
    pub level: u32,
    /// Number of entries, that is of (tetrahedron, leaf) pairs.
    pub entries: u32,
    /// Number of nodes.
    pub nodes: u32,
    /// Number of leaves.
    pub leaves: u32,
    /// Lower corner of the mesh.
    pub lo: [f32; 3],
    /// Upper corner of the mesh.
    pub hi: [f32; 3],
    /// Number of tetrahedra left out because a vertex does not exist, occurs twice, or has a coordinate that is not
    /// finite or beyond 2^125.
    pub bad_cells: u32,
    /// Device time of the construction in milliseconds.
    pub build_ms: f64,
    /// Device address for `olbvh_open` of olbvh.glsl, valid until the tree is freed; 0 where the device has no buffer
    /// addresses. If the mesh was reordered, shaders see it in its new order. There is no field, so `olbvh_value` returns
    /// NaN; scenes can have one (`olbvh_scene_arrays`).
    pub address: u64,
}

thread_local! {
    static MESSAGE: RefCell<CString> = RefCell::default();
}

fn status_of(error: &Error) -> OlbvhStatus {
    match error {
        Error::Invalid(_) | Error::BadCells { .. } => OlbvhStatus::Invalid,
        Error::NoVulkan(_) | Error::NoDevice(_) | Error::SelfTest { .. } => OlbvhStatus::Device,
        Error::Memory { .. } | Error::Vulkan { result: ash::vk::Result::ERROR_OUT_OF_DEVICE_MEMORY, .. } => OlbvhStatus::Memory,
        Error::TooLarge(_) => OlbvhStatus::TooLarge,
        Error::Vulkan { result: ash::vk::Result::ERROR_DEVICE_LOST, .. } => OlbvhStatus::Lost,
        Error::Vulkan { .. } => OlbvhStatus::Vulkan,
        _ => OlbvhStatus::Internal,
    }
}

fn remember(message: &str) {
    // The text is cut at its first zero byte.
    let text = CString::new(message.split('\0').next().unwrap_or_default()).unwrap_or_default();
    MESSAGE.with(|m| *m.borrow_mut() = text);
}

/// Runs the body of an interface function and turns errors and panics into a status.
fn border(work: impl FnOnce() -> Result<()>) -> OlbvhStatus {
    match catch_unwind(AssertUnwindSafe(work)) {
        Ok(Ok(())) => OlbvhStatus::Ok,
        Ok(Err(error)) => {
            remember(&error.to_string());
            status_of(&error)
        }
        Err(_) => {
            remember("a panic inside olbvh; please report it");
            OlbvhStatus::Internal
        }
    }
}

fn missing(what: &str) -> Error {
    Error::Invalid(format!("{what} is null"))
}

/// Rejects null, and pointers that are not aligned for their type, to which there must be no reference.
fn check<T>(pointer: *const T, what: &str) -> Result<()> {
    if pointer.is_null() {
        return Err(missing(what));
    }
    if !pointer.is_aligned() {
        return Err(Error::Invalid(format!("{what} at address {pointer:p}, which is not a multiple of {}", align_of::<T>())));
    }
    Ok(())
}

/// The object of a handle, or a struct.
///
/// # Safety
/// See [`crate::capi`].
unsafe fn handle<'a, T>(pointer: *const T, what: &str) -> Result<&'a T> {
    check(pointer, what)?;
    // SAFETY: neither null nor misaligned; the caller keeps the rules of `capi`.
    Ok(unsafe { &*pointer })
}

/// The object of a handle that only one thread at a time uses.
///
/// # Safety
/// See [`crate::capi`].
unsafe fn handle_mut<'a, T>(pointer: *mut T, what: &str) -> Result<&'a mut T> {
    check(pointer, what)?;
    // SAFETY: neither null nor misaligned; the caller keeps the rules of `capi`.
    Ok(unsafe { &mut *pointer })
}

/// A struct that may be missing, which null says.
///
/// # Safety
/// See [`crate::capi`].
unsafe fn optional<'a, T>(pointer: *const T, what: &str) -> Result<Option<&'a T>> {
    // SAFETY: the caller keeps the rules of `capi`.
    if pointer.is_null() { Ok(None) } else { unsafe { handle(pointer, what) }.map(Some) }
}

/// A string that may be missing, which null says.
///
/// # Safety
/// See [`crate::capi`].
unsafe fn text<'a>(pointer: *const c_char) -> Option<Cow<'a, str>> {
    // SAFETY: the caller keeps the rules of `capi`.
    (!pointer.is_null()).then(|| unsafe { CStr::from_ptr(pointer) }.to_string_lossy())
}

/// The caller's memory for a result, which need not be initialised.
///
/// # Safety
/// See [`crate::capi`].
unsafe fn place<'a, T>(out: *mut T) -> Result<&'a mut MaybeUninit<T>> {
    // SAFETY: the caller keeps the rules of `capi`.
    unsafe { handle_mut(out.cast(), "the place for the result") }
}

/// Rejects an array larger than any memory, which a wrong count gives.
fn check_count<T>(count: usize, what: &str) -> Result<()> {
    let fits = count.checked_mul(size_of::<T>()).is_some_and(|bytes| isize::try_from(bytes).is_ok());
    if fits { Ok(()) } else { Err(Error::TooLarge(format!("{what}: {count} elements are more than memory can hold"))) }
}

/// The caller's array. Any pointer is allowed for an array without elements.
///
/// # Safety
/// See [`crate::capi`].
unsafe fn array<'a, T>(pointer: *const T, count: usize, what: &str) -> Result<&'a [T]> {
    if count == 0 {
        return Ok(&[]);
    }
    check_count::<T>(count, what)?;
    check(pointer, what)?;
    // SAFETY: neither null, nor misaligned, nor too large; the caller keeps the rules of `capi`.
    Ok(unsafe { std::slice::from_raw_parts(pointer, count) })
}

/// The caller's array that a call fills, and which need not be initialised. Any pointer is allowed for an array without
/// elements.
///
/// # Safety
/// See [`crate::capi`].
unsafe fn array_mut<'a, T>(pointer: *mut T, count: usize, what: &str) -> Result<&'a mut [MaybeUninit<T>]> {
    if count == 0 {
        return Ok(&mut []);
    }
    check_count::<T>(count, what)?;
    check(pointer, what)?;
    // SAFETY: neither null, nor misaligned, nor too large; the caller keeps the rules of `capi`.
    Ok(unsafe { std::slice::from_raw_parts_mut(pointer.cast(), count) })
}

/// Moves a value to the heap and passes ownership to the caller as a handle.
fn give<T>(out: &mut MaybeUninit<*mut T>, value: T) {
    out.write(Box::into_raw(Box::new(value)));
}

/// Frees what [`give`] passed out; does nothing for null.
///
/// # Safety
/// See [`crate::capi`]. Nothing uses the handle again.
unsafe fn release<T>(pointer: *mut T, what: &str) {
    if !pointer.is_null() {
        let _ = border(|| {
            check(pointer, what)?;
            // SAFETY: the pointer came from `give`, and nothing uses it again.
            drop(unsafe { Box::from_raw(pointer) });
            Ok(())
        });
    }
}

/// Text of the last error of this thread, which calls that succeed keep; empty if there was none. Valid until the next
/// call of this thread.
#[unsafe(no_mangle)]
pub extern "C" fn olbvh_last_error() -> *const c_char {
    MESSAGE.with(|m| m.borrow().as_ptr())
}

/// Version of the library, for example "0.1.0".
#[unsafe(no_mangle)]
pub extern "C" fn olbvh_version() -> *const c_char {
    concat!(env!("CARGO_PKG_VERSION"), "\0").as_ptr().cast()
}

/// Version of this interface. A header and a library with different versions are incompatible.
pub const OLBVH_ABI: u32 = 6;
/// What stands for an owner where there is none.
pub const OLBVH_NONE: u32 = u32::MAX;
/// The bit of a voxel's owner that says that the voxel is merely touched.
pub const OLBVH_TOUCHED: u32 = 0x8000_0000;
const _: () = assert!(OLBVH_NONE == NONE && OLBVH_TOUCHED == SLICE_TOUCHED);

/// Returns the `OLBVH_ABI` of the library, for comparison with that of the header.
#[unsafe(no_mangle)]
pub extern "C" fn olbvh_abi() -> u32 {
    OLBVH_ABI
}

/// Opens a device, chosen by a part of its name or by its number; null selects the best suitable device.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn olbvh_gpu_open(device: *const c_char, out: *mut *mut OlbvhGpu) -> OlbvhStatus {
    border(|| {
        // SAFETY: the caller keeps the rules of `capi`.
        let (device, out) = unsafe { (text(device).map(Cow::into_owned), place(out)?) };
        give(out, OlbvhGpu(Gpu::new(&GpuOptions { device, ..GpuOptions::default() })?));
        Ok(())
    })
}

/// Frees the handle of a device; null is allowed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn olbvh_gpu_free(gpu: *mut OlbvhGpu) {
    // SAFETY: the caller keeps the rules of `capi`.
    unsafe { release(gpu, "gpu") };
}

/// Uploads a mesh to the device: three floats per point, four indices per tetrahedron. Invalid tetrahedra are left out
/// and counted (`olbvh_tree_info`). If `reorder` is not 0, points and tetrahedra are first sorted along a Z-order
/// curve, which pays where they come in no spatial order; all functions still take and return the caller's numbers. Of
/// the tetrahedra that share a face, edge or vertex, the first along the curve then owns its points, instead of the one
/// with the lowest number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn olbvh_mesh_upload(
    gpu: *const OlbvhGpu,
    points: *const f32,
    point_count: usize,
    tets: *const u32,
    tet_count: usize,
    reorder: u32,
    out: *mut *mut OlbvhMesh,
) -> OlbvhStatus {
    border(|| {
        // SAFETY: the caller keeps the rules of `capi`.
        let (gpu, out) = unsafe { (&handle(gpu, "gpu")?.0, place(out)?) };
        // SAFETY: the caller keeps the rules of `capi`.
        let (points, tets) = unsafe { (array(points.cast(), point_count, "points")?, array(tets.cast(), tet_count, "tets")?) };
        let (device, ids) = if reorder == 0 {
            (DeviceMesh::upload_slices(gpu, points, tets)?, None)
        } else {
            let mesh = Mesh::new(points.to_vec(), tets.to_vec()).along_curve()?;
            (DeviceMesh::upload(gpu, &mesh, BadCells::Skip)?, mesh.cell_ids.zip(mesh.point_ids).map(|ids| Arc::new(ids.into())))
        };
        give(out, OlbvhMesh(Arc::new(HeldMesh { device, ids, copy: query::HostCopy::default() })));
        Ok(())
    })
}

/// The same tetrahedra with their points elsewhere, as a simulation moves them: three floats for each point of `mesh`, which
/// stays as it is, like its trees. Neighbours, whose search takes most of the time of an upload, are taken over, unless the
/// mesh has invalid tetrahedra.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn olbvh_mesh_moved(mesh: *const OlbvhMesh, points: *const f32, out: *mut *mut OlbvhMesh) -> OlbvhStatus {
    border(|| {
        // SAFETY: the caller keeps the rules of `capi`.
        let (OlbvhMesh(mesh), out) = unsafe { (handle(mesh, "mesh")?, place(out)?) };
        // SAFETY: the caller keeps the rules of `capi`.
        let points: &[[f32; 3]] = unsafe { array(points.cast(), mesh.device.input().points as usize, "points")? };
        let device = match &mesh.ids {
            None => mesh.device.moved(points)?,
            Some(ids) => mesh.device.moved(&ids[1].iter().map(|&i| points[i as usize]).collect::<Vec<_>>())?,
        };
        give(out, OlbvhMesh(Arc::new(HeldMesh { device, ids: mesh.ids.clone(), copy: query::HostCopy::default() })));
        Ok(())
    })
}

/// Frees the handle of a mesh; null is allowed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn olbvh_mesh_free(mesh: *mut OlbvhMesh) {
    // SAFETY: the caller keeps the rules of `capi`.
    unsafe { release(mesh, "mesh") };
}

/// The default build options, which `olbvh_tree_build` also uses when its `options` are null.
#[unsafe(no_mangle)]
pub extern "C" fn olbvh_default_build_options() -> OlbvhBuildOptions {
    let BuildOptions { alpha, assign, lists, level, fineness, slabs, capacity, budget, .. } = BuildOptions::default();
    let ([level, capacity], budget) = ([level, capacity].map(|limit| limit.unwrap_or(0)), budget.unwrap_or(0));
    let [assign, lists, fineness, slabs] = [assign as u32, lists as u32, fineness as u32, u32::from(slabs)];
    OlbvhBuildOptions { alpha, assign, lists, level, fineness, slabs, capacity, budget }
}

/// Builds the tree over a mesh. `options` may be null: the defaults.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn olbvh_tree_build(
    mesh: *const OlbvhMesh,
    options: *const OlbvhBuildOptions,
    out: *mut *mut OlbvhTree,
) -> OlbvhStatus {
    border(|| {
        // SAFETY: the caller keeps the rules of `capi`.
        let (mesh, options, out) = unsafe { (handle(mesh, "mesh")?.0.clone(), optional(options, "options")?, place(out)?) };
        let options = options.map_or(Ok(BuildOptions::default()), OlbvhBuildOptions::read)?;
        let device = &mesh.device;
        let gpu = device.gpu();
        let tree = Tree::build(gpu, device, &options)?;
        let addresses = gpu.upload("olbvh.tree.addresses", &[SceneBuffers::new(&device.view(), tree.memory(), None)?.addresses()])?;
        give(out, OlbvhTree { mesh, tree, addresses });
        Ok(())
    })
}

/// Frees the handle of a tree; null is allowed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn olbvh_tree_free(tree: *mut OlbvhTree) {
    // SAFETY: the caller keeps the rules of `capi`.
    unsafe { release(tree, "tree") };
}

/// Reports the properties of a tree.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn olbvh_tree_info(tree: *const OlbvhTree, out: *mut OlbvhTreeInfo) -> OlbvhStatus {
    border(|| {
        // SAFETY: the caller keeps the rules of `capi`.
        let (OlbvhTree { mesh, tree, addresses }, out) = unsafe { (handle(tree, "tree")?, place(out)?) };
        let (status, Bounds { lo, hi }) = (tree.status(), tree.grid().into());
        let info = OlbvhTreeInfo {
            level: status.level,
            entries: status.entries,
            nodes: status.nodes,
            leaves: status.leaves,
            lo,
            hi,
            bad_cells: mesh.device.status().bad,
            build_ms: tree.times().total(),
            address: addresses.all().address,
        };
        out.write(info);
        Ok(())
    })
}
