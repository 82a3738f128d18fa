//! The C interface, `include/olbvh.h`: opaque handles, status codes, a message per thread. Build it with
//! `cargo rustc --release --lib --no-default-features --features capi --crate-type cdylib` (or `staticlib`).
//!
//! Functions return 0 or the code of an error, whose text [`olbvh_last_error`] gives. No panic crosses the border. A handle keeps what it was made
//! from alive, so the order of freeing means nothing. One handle may be used by many threads at a time, a
//! recording by one.
//!
//! Not for Rust, where a pointer cannot be trusted as a C caller's must be: the module is private, and its functions reach C by their names.
#![allow(unsafe_code, reason = "the border to C")]

mod host;
mod query;
mod record;
#[cfg(test)]
mod tests;

use crate::build::{BadCells, DeviceMesh, MeshInput, Tree};
use crate::error::{Error, Result};
use crate::glsl::SceneBuffers;
use crate::gpu::{Buffer, Gpu, GpuOptions, StageTime};
use crate::mesh::{Mesh, On};
use crate::options::{Assign, BuildOptions, Fineness, Lists, TOLERANCE};
use crate::render::Bounds;
use std::cell::RefCell;
use std::ffi::{CStr, CString, c_char};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

/// How a call ended.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OlbvhStatus {
    /// Done.
    Ok = 0,
    /// An argument makes no sense.
    Invalid = 1,
    /// No Vulkan, or no device that qualifies.
    Device = 2,
    /// The device's memory does not suffice.
    Memory = 3,
    /// The mesh is larger than 32-bit offsets reach.
    TooLarge = 4,
    /// A Vulkan call failed.
    Vulkan = 5,
    /// Anything else; please report it.
    Internal = 6,
    /// The device is lost (`VK_ERROR_DEVICE_LOST`): free all handles, and begin again with another device.
    Lost = 7,
}

/// A device.
pub struct OlbvhGpu(Gpu);

/// A mesh in the device's memory.
pub struct OlbvhMesh(Arc<HeldMesh>);

/// A mesh, and what its tetrahedra and points are called.
struct HeldMesh {
    device: DeviceMesh,
    /// For each tetrahedron and each point its number with the caller, where that is another.
    ids: Option<[Vec<u32>; 2]>,
}

impl HeldMesh {
    /// The caller's number of a tetrahedron; what is none stays so.
    fn cell(&self, tet: u32) -> u32 {
        self.ids.as_ref().and_then(|[cells, _]| cells.get(tet as usize).copied()).unwrap_or(tet)
    }

    /// A field of the caller's in the order of the mesh.
    fn field(&self, values: *const f32, on_cells: u32) -> Result<(Vec<f32>, On)> {
        let (on, count) = on(on_cells, self.device.input());
        let values = array(values, count as usize, "values")?;
        let ids = self.ids.as_ref().map(|[cells, points]| if on == On::Points { points } else { cells });
        Ok((ids.map_or_else(|| values.to_vec(), |ids| ids.iter().map(|&i| values[i as usize]).collect()), on))
    }
}

/// What values belong to, and how many there are.
fn on(on_cells: u32, mesh: &MeshInput) -> (On, u32) {
    if on_cells == 0 { (On::Points, mesh.points) } else { (On::Cells, mesh.tets) }
}

/// What a tolerance below 0 stands for.
fn tolerance(given: f32) -> f32 {
    if given < 0.0 { TOLERANCE } else { given }
}

/// A tree over a mesh.
pub struct OlbvhTree {
    mesh: Arc<HeldMesh>,
    tree: Tree,
    /// What shaders get, see `olbvh.glsl`.
    addresses: Buffer,
}

/// How to build a tree; `olbvh_default_build_options` fills it.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct OlbvhBuildOptions {
    /// The paper's alpha, 0 to 10: how many levels coarser than the cells' size the leaves are.
    pub alpha: f32,
    /// 0: cells of the bounding box. 1: of those, the cells that no face plane separates. 2: exactly the cells touched.
    pub assign: u32,
    /// 0: all primitives are listed (the paper). 1: where the surface is, seeds and walks elsewhere.
    pub lists: u32,
    /// Level of the leaves whatever alpha says, 1 to 10: one finer than alpha 0 asks for suits thin parts. 0: as alpha says.
    pub level: u32,
    /// How fine leaves are beyond that: 0: as it says. 1: finer where lists are long, as suits points, slices and overlap. 2: as suits pictures. A recorded
    /// build takes no notice.
    pub fineness: u32,
    /// Most entries the tree may have; it gets coarser until it fits. 0: the usual capacity, 64 per tetrahedron and at least 2^20.
    pub capacity: u32,
    /// Most bytes the arrays of the tree may have together; it gets coarser until it fits. 0: no limit.
    pub budget: u64,
}

impl OlbvhBuildOptions {
    fn read(&self) -> Result<BuildOptions> {
        let unknown = |what: &str, n: u32| Error::Invalid(format!("{what} {n} is not known"));
        Ok(BuildOptions {
            alpha: self.alpha,
            assign: Assign::EVERY.into_iter().find(|a| *a as u32 == self.assign).ok_or_else(|| unknown("assign", self.assign))?,
            lists: Lists::EVERY.into_iter().find(|l| *l as u32 == self.lists).ok_or_else(|| unknown("lists", self.lists))?,
            boxes: false,
            capacity: (self.capacity != 0).then_some(self.capacity),
            budget: (self.budget != 0).then_some(self.budget),
            level: (self.level != 0).then_some(self.level),
            fineness: Fineness::EVERY.into_iter().find(|f| *f as u32 == self.fineness).ok_or_else(|| unknown("fineness", self.fineness))?,
        })
    }
}

/// What was built.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct OlbvhTreeInfo {
    /// Level of the leaves.
    pub level: u32,
    /// Primitive ids in the leaves.
    pub entries: u32,
    /// Nodes.
    pub nodes: u32,
    /// Leaves.
    pub leaves: u32,
    /// Lower corner of the mesh.
    pub lo: [f32; 3],
    /// Upper corner of the mesh.
    pub hi: [f32; 3],
    /// Tetrahedra left out: a vertex that does not exist, occurs twice or is not finite.
    pub bad_cells: u32,
    /// Milliseconds of device time.
    pub build_ms: f64,
    /// Device address for `olbvh_open` of olbvh.glsl; 0 where the device has no buffer addresses. Shaders see a mesh that was reordered in its new order, and no
    /// field: `olbvh_value` is NaN there. Scenes have fields (`olbvh_scene_arrays`).
    pub address: u64,
}

thread_local! {
    static MESSAGE: RefCell<CString> = RefCell::default();
}

fn status_of(error: &Error) -> OlbvhStatus {
    match error {
        Error::Invalid(_) | Error::BadCells { .. } => OlbvhStatus::Invalid,
        Error::NoVulkan(_) | Error::NoDevice(_) | Error::SelfTest { .. } => OlbvhStatus::Device,
        Error::Memory { .. } => OlbvhStatus::Memory,
        Error::TooLarge(_) => OlbvhStatus::TooLarge,
        Error::Vulkan { result: ash::vk::Result::ERROR_DEVICE_LOST, .. } => OlbvhStatus::Lost,
        Error::Vulkan { .. } => OlbvhStatus::Vulkan,
        _ => OlbvhStatus::Internal,
    }
}

fn remember(message: &str) {
    // A text with a zero in it ends there.
    let text = CString::new(message.split('\0').next().unwrap_or_default()).unwrap_or_default();
    MESSAGE.with(|m| *m.borrow_mut() = text);
}

/// Runs the work of a function of the interface; keeps errors and panics on this side.
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

/// What a handle means.
fn handle<'a, T>(pointer: *const T, what: &str) -> Result<&'a T> {
    // SAFETY: the caller passes null or a handle that is not freed yet (see each function).
    unsafe { pointer.as_ref() }.ok_or_else(|| missing(what))
}

/// As [`handle`], of one that nobody else uses meanwhile.
fn handle_mut<'a, T>(pointer: *mut T, what: &str) -> Result<&'a mut T> {
    // SAFETY: as above, and the caller vouches for the rest (see each function).
    unsafe { pointer.as_mut() }.ok_or_else(|| missing(what))
}

/// Fills a struct of the caller's.
fn put<T>(out: *mut T, value: T) -> Result<()> {
    *handle_mut(out, "the place for the result")? = value;
    Ok(())
}

/// An array of the caller's; a null pointer is an empty one of no elements.
fn array<'a, T>(pointer: *const T, count: usize, what: &str) -> Result<&'a [T]> {
    match (pointer.is_null(), count) {
        (_, 0) => Ok(&[]),
        (true, _) => Err(missing(what)),
        // SAFETY: the caller vouches for `count` elements (see each function).
        (false, _) => Ok(unsafe { std::slice::from_raw_parts(pointer, count) }),
    }
}

/// Hands a value over to the caller.
fn give<T>(out: *mut *mut T, value: T) -> Result<()> {
    *handle_mut(out, "the place for the result")? = Box::into_raw(Box::new(value));
    Ok(())
}

/// Takes back what [`give`] gave.
fn release<T>(pointer: *mut T) {
    if !pointer.is_null() {
        let _ = border(|| {
            // SAFETY: the pointer came from `give` and is not used again.
            drop(unsafe { Box::from_raw(pointer) });
            Ok(())
        });
    }
}

/// The text of the last error of this thread; valid until its next call.
#[unsafe(no_mangle)]
pub extern "C" fn olbvh_last_error() -> *const c_char {
    MESSAGE.with(|m| m.borrow().as_ptr())
}

/// Version of the library, such as "0.1.0".
#[unsafe(no_mangle)]
pub extern "C" fn olbvh_version() -> *const c_char {
    concat!(env!("CARGO_PKG_VERSION"), "\0").as_ptr().cast()
}

/// Opens a device: part of its name, or its number; null: the best that qualifies.
#[unsafe(no_mangle)]
pub extern "C" fn olbvh_gpu_open(device: *const c_char, out: *mut *mut OlbvhGpu) -> OlbvhStatus {
    border(|| {
        // SAFETY: the caller passes null or a C string.
        let name = (!device.is_null()).then(|| unsafe { CStr::from_ptr(device) }.to_string_lossy().into_owned());
        give(out, OlbvhGpu(Gpu::new(&GpuOptions { device: name, ..GpuOptions::default() })?))
    })
}

/// Lets a device go; null is allowed.
#[unsafe(no_mangle)]
pub extern "C" fn olbvh_gpu_free(gpu: *mut OlbvhGpu) {
    release(gpu);
}

/// Brings a mesh to the device: three floats per point, four indices per tetrahedron. Bad cells are left out and counted. `reorder`, if not 0, brings points
/// and tetrahedra into the order of a Z curve on the way, which pays where they come in no order; all functions go on to take and to give the caller's numbers.
/// Of the tetrahedra that share a face, edge or vertex, the first along the curve owns its points then, not that of the lowest number.
#[unsafe(no_mangle)]
pub extern "C" fn olbvh_mesh_upload(
    gpu: *const OlbvhGpu,
    points: *const f32,
    point_count: usize,
    tets: *const u32,
    tet_count: usize,
    reorder: u32,
    out: *mut *mut OlbvhMesh,
) -> OlbvhStatus {
    border(|| {
        let points = array(points.cast::<[f32; 3]>(), point_count, "points")?.to_vec();
        let tets = array(tets.cast::<[u32; 4]>(), tet_count, "tets")?.to_vec();
        let mesh = Mesh::new(points, tets);
        let mesh = if reorder == 0 { mesh } else { mesh.along_curve()? };
        let device = DeviceMesh::upload(&handle(gpu, "gpu")?.0, &mesh, BadCells::Skip)?;
        give(out, OlbvhMesh(Arc::new(HeldMesh { device, ids: mesh.cell_ids.zip(mesh.point_ids).map(<[_; 2]>::from) })))
    })
}

/// Lets a mesh go; null is allowed.
#[unsafe(no_mangle)]
pub extern "C" fn olbvh_mesh_free(mesh: *mut OlbvhMesh) {
    release(mesh);
}

/// What `olbvh_tree_build` takes where it is given no options.
#[unsafe(no_mangle)]
pub extern "C" fn olbvh_default_build_options() -> OlbvhBuildOptions {
    let BuildOptions { alpha, assign, lists, level, fineness, capacity, budget, .. } = BuildOptions::default();
    let ([level, capacity], budget) = ([level, capacity].map(|limit| limit.unwrap_or(0)), budget.unwrap_or(0));
    OlbvhBuildOptions { alpha, assign: assign as u32, lists: lists as u32, level, fineness: fineness as u32, capacity, budget }
}

/// Builds the tree over a mesh. `options` may be null.
#[unsafe(no_mangle)]
pub extern "C" fn olbvh_tree_build(mesh: *const OlbvhMesh, options: *const OlbvhBuildOptions, out: *mut *mut OlbvhTree) -> OlbvhStatus {
    border(|| {
        let mesh = handle(mesh, "mesh")?.0.clone();
        // SAFETY: null, or the caller's options.
        let options = unsafe { options.as_ref() }.map_or(Ok(BuildOptions::default()), OlbvhBuildOptions::read)?;
        let device = &mesh.device;
        let gpu = device.gpu();
        let tree = Tree::build(gpu, device, &options)?;
        let addresses = gpu.upload("olbvh.tree.addresses", &[SceneBuffers::new(&device.view(), tree.memory(), None).addresses()])?;
        give(out, OlbvhTree { mesh, tree, addresses })
    })
}

/// Lets a tree go; null is allowed.
#[unsafe(no_mangle)]
pub extern "C" fn olbvh_tree_free(tree: *mut OlbvhTree) {
    release(tree);
}

/// Tells what a tree is like.
#[unsafe(no_mangle)]
pub extern "C" fn olbvh_tree_info(tree: *const OlbvhTree, out: *mut OlbvhTreeInfo) -> OlbvhStatus {
    border(|| {
        let OlbvhTree { mesh, tree, addresses } = handle(tree, "tree")?;
        let (status, Bounds { lo, hi }) = (tree.status(), tree.grid().into());
        let info = OlbvhTreeInfo {
            level: status.level,
            entries: status.entries,
            nodes: status.nodes,
            leaves: status.leaves,
            lo,
            hi,
            bad_cells: mesh.device.status().bad,
            build_ms: StageTime::sum(tree.stages()),
            address: addresses.all().address,
        };
        put(out, info)
    })
}
