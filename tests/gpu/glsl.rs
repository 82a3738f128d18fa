//! `olbvh.glsl` in a host's shader gives the answers of the library, by address and by descriptors.

#![allow(unsafe_code, reason = "plain Vulkan, beside the crate")]

use crate::not_run::not_run;
use crate::submit::submit;
use ash::vk;
use olbvh::build::{BadCells, DeviceMesh, Tree};
use olbvh::glsl::{OLBVH, SceneBuffers};
use olbvh::gpu::{Binding, BufferRef, Gpu, GpuOptions};
use olbvh::mesh::{Mesh, On, kuhn_jittered};
use olbvh::options::{BuildOptions, Lists};
use olbvh::query::{LocateOptions, Located, SILENT, locate, locate_all};

/// What a host's kernels begin with.
const HEAD: &str = r"
#version 460
#define OLBVH_TRAVERSE
#define OLBVH_SET 1
#define OLBVH_BINDING 3
layout(local_size_x = 64) in;
layout(push_constant) uniform Push { uvec2 tree; uint count, level; };
layout(set = 0, binding = 0) readonly buffer Points { float points[]; };
layout(set = 0, binding = 1) writeonly buffer Out { uint found[]; };
";

/// A kernel that writes ten words per point.
const ANSWERS: &str = r#"
#include "olbvh.glsl"
// Names that a host may use as well.
struct Grid { int best; };
float weights;
uint NONE, quantize, morton, search, tree_depth;

vec3 at;
uint met;
bool olbvh_visit_node(olbvh_Node node) {
    vec3 lo, hi;
    olbvh_node_box(node, lo, hi);
    return all(lessThanEqual(lo, at)) && all(lessThanEqual(at, hi));
}
bool olbvh_visit_leaf(olbvh_Node node) {
    uvec2 range = olbvh_entries(node);
    for (uint i = range.x; i < range.y; ++i) met = min(met, olbvh_primitive(i));
    return false;
}

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    at = vec3(points[3 * i], points[3 * i + 1], points[3 * i + 2]);
    olbvh_open(tree);
    vec4 b;
    uint owner = olbvh_locate(at, 1e-5, b);
    uint owners[OLBVH_OWNERS];
    met = OLBVH_NONE;
    olbvh_traverse();
    found[10 * i] = owner;
    found[10 * i + 1] = olbvh_owners(at, owners);
    found[10 * i + 2] = owner == OLBVH_NONE ? 0u : floatBitsToUint(olbvh_value(owner, b));
    found[10 * i + 3] = owner == OLBVH_NONE ? 0u : floatBitsToUint(olbvh_gradient(owner).y);
    found[10 * i + 4] = met;
    for (uint k = 0u; k < 4u; ++k) found[10 * i + 6 + k] = floatBitsToUint(b[k]);
    // The first points are the vertices of the mesh.
    uvec4 v = owner == OLBVH_NONE ? uvec4(0u) : 3u * olbvh_corners(owner);
    found[10 * i + 5] = floatBitsToUint(olbvh_weighed(b, vec4(points[v.x], points[v.y], points[v.z], points[v.w])));
}
"#;

/// A kernel that writes the distance to the nearest leaf of a random selection, found among all leaves and among nearer
/// ones only.
const NEAREST: &str = r#"
#include "olbvh.glsl"
vec3 at;
uint seed;
bool prunes;
float nearest;
float distance_to(olbvh_Node node) {
    vec3 lo, hi;
    olbvh_node_box(node, lo, hi);
    return distance(at, clamp(at, lo, hi));
}
bool olbvh_visit_node(olbvh_Node node) {
    bool selected = node.level < level || (node.code * 31u + seed) * 2654435761u >> 27 == 0u;
    return selected && (!prunes || distance_to(node) < nearest);
}
bool olbvh_visit_leaf(olbvh_Node node) {
    nearest = min(nearest, distance_to(node));
    return false;
}

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    at = vec3(points[3 * i], points[3 * i + 1], points[3 * i + 2]);
    seed = i;
    olbvh_open(tree);
    for (uint pass = 0; pass < 2; ++pass) {
        prunes = pass == 1;
        nearest = 1e30;
        olbvh_traverse();
        found[2 * i + pass] = floatBitsToUint(nearest);
    }
}
"#;

/// A kernel that walks from every point to the next but six, and writes where it ended.
const WALKS: &str = r#"
#include "olbvh.glsl"
void main() {
    uint i = gl_GlobalInvocationID.x, k = (i + 7u) % count;
    if (i >= count) return;
    vec3 start = vec3(points[3 * i], points[3 * i + 1], points[3 * i + 2]);
    vec3 end = vec3(points[3 * k], points[3 * k + 1], points[3 * k + 2]);
    olbvh_open(tree);
    vec4 b;
    uvec2 left = uvec2(OLBVH_NONE);
    uint from = olbvh_locate(start, 0.0, b), owner = OLBVH_NONE;
    owner = olbvh_walk(from, start, end, b, left); // also from nowhere
    found[5 * i] = from;
    found[5 * i + 1] = owner;
    found[5 * i + 2] = left.x;
    found[5 * i + 3] = left.y;
    found[5 * i + 4] = floatBitsToUint(b.x);
}
"#;

/// Checks walks between points of a box full of tetrahedra: those to a point within reach its owner, those to a point
/// outside leave through a boundary face where the way crosses the surface of the box.
fn check_walks(mesh: &Mesh, device: &DeviceMesh, points: &[[f32; 3]], expected: &Located, found: &[[u32; 5]]) {
    let neighbours = device.neighbours().unwrap();
    let size: [f32; 3] = [0, 1, 2].map(|c| mesh.points.iter().map(|p| p[c]).fold(0.0, f32::max));
    let (mut reached, mut outside) = (0, 0);
    for (i, &[from, owner, last, vertex, weight]) in found.iter().enumerate() {
        let k = (i + 7) % points.len();
        let (a, b) = (points[i], points[k]);
        let what = format!("from {a:?} in {from} to {b:?}: {owner}, left {last} by {vertex}");
        let deep = |p: [f32; 3]| (0..3).map(|c| p[c].min(size[c] - p[c])).fold(f32::MAX, f32::min);
        if from == u32::MAX {
            assert_eq!([owner, last, vertex], [u32::MAX; 3], "{what}");
        }
        if from == u32::MAX || deep(a) < 1e-3 || deep(b).abs() < 1e-3 {
            continue;
        }
        if deep(b) > 0.0 {
            assert_eq!((owner, weight), (expected.owners[k], expected.barycentrics[k][0].to_bits()), "{what}");
            assert_eq!([last, vertex], [u32::MAX; 2], "{what}");
            reached += 1;
        } else {
            assert_eq!((owner, neighbours[last as usize][vertex as usize]), (u32::MAX, u32::MAX), "{what}");
            let part = |c: usize| {
                if b[c] < 0.0 {
                    a[c] / (a[c] - b[c])
                } else if b[c] > size[c] {
                    (size[c] - a[c]) / (b[c] - a[c])
                } else {
                    1.0
                }
            };
            let part = (0..3).map(part).fold(1.0, f32::min);
            for c in 0..3 {
                let corners = mesh.tets[last as usize].map(|v| mesh.points[v as usize][c]);
                let at = a[c] + (b[c] - a[c]) * part;
                assert!(corners.iter().any(|&x| x > at - 1e-3) && corners.iter().any(|&x| x < at + 1e-3), "{what}: crosses at {at}");
            }
            outside += 1;
        }
    }
    assert!(reached > 500 && outside > 100, "{reached} walks ended in the mesh, {outside} outside");
}

fn compile(binding: Binding, kernel: &str) -> Vec<u32> {
    let compiler = shaderc::Compiler::new().unwrap();
    let mut options = shaderc::CompileOptions::new().unwrap();
    options.set_target_env(shaderc::TargetEnv::Vulkan, shaderc::EnvVersion::Vulkan1_2 as u32);
    if binding == Binding::Descriptors {
        options.add_macro_definition("OLBVH_DESCRIPTORS", None);
    }
    options.set_include_callback(|name, _, _, _| {
        assert_eq!(name, "olbvh.glsl");
        Ok(shaderc::ResolvedInclude { resolved_name: name.into(), content: OLBVH.into() })
    });
    let text = [HEAD, kernel].concat();
    compiler.compile_into_spirv(&text, shaderc::ShaderKind::Compute, "host.comp", "main", Some(&options)).unwrap().as_binary().to_vec()
}

/// Runs a host's kernel, which writes `N` words per point.
fn run<const N: usize>(gpu: &Gpu, kernel: &str, scene: &SceneBuffers, level: u32, points: &[[f32; 3]]) -> Vec<[u32; N]> {
    let device = gpu.device();
    let input = gpu.upload("olbvh.test.points", points).unwrap();
    let output = gpu.buffer("olbvh.test.found", (4 * N * points.len()) as u64).unwrap();
    let addresses = gpu.upload("olbvh.test.scene", &[scene.addresses()]).unwrap();
    let list = scene.list(addresses.all());
    let sets = [[(0, input.all()), (1, output.all())].to_vec(), (3..).zip(list).collect::<Vec<_>>()];
    // SAFETY: a pipeline and its sets are created and used as Vulkan asks for; `run` waits, and everything is destroyed
    // afterwards.
    unsafe {
        let layouts = sets.clone().map(|set| {
            let binding = |(i, _): &(u32, BufferRef)| {
                let b = vk::DescriptorSetLayoutBinding::default().binding(*i).descriptor_count(1);
                b.descriptor_type(vk::DescriptorType::STORAGE_BUFFER).stage_flags(vk::ShaderStageFlags::COMPUTE)
            };
            let bindings: Vec<_> = set.iter().map(binding).collect();
            device.create_descriptor_set_layout(&vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings), None).unwrap()
        });
        let sizes = [vk::DescriptorPoolSize { ty: vk::DescriptorType::STORAGE_BUFFER, descriptor_count: 13 }];
        let pool = device.create_descriptor_pool(&vk::DescriptorPoolCreateInfo::default().max_sets(2).pool_sizes(&sizes), None).unwrap();
        let info = vk::DescriptorSetAllocateInfo::default().descriptor_pool(pool).set_layouts(&layouts);
        let handles = device.allocate_descriptor_sets(&info).unwrap();
        for (handle, set) in handles.iter().zip(&sets) {
            for (i, b) in set {
                let info = [vk::DescriptorBufferInfo { buffer: b.buffer(), offset: b.offset(), range: b.size() }];
                let write = vk::WriteDescriptorSet::default().dst_set(*handle).dst_binding(*i).buffer_info(&info);
                device.update_descriptor_sets(&[write.descriptor_type(vk::DescriptorType::STORAGE_BUFFER)], &[]);
            }
        }
        let ranges = [vk::PushConstantRange::default().stage_flags(vk::ShaderStageFlags::COMPUTE).size(16)];
        let info = vk::PipelineLayoutCreateInfo::default().set_layouts(&layouts).push_constant_ranges(&ranges);
        let layout = device.create_pipeline_layout(&info, None).unwrap();
        let code = compile(gpu.binding(), kernel);
        let module = device.create_shader_module(&vk::ShaderModuleCreateInfo::default().code(&code), None).unwrap();
        let stage = vk::PipelineShaderStageCreateInfo::default().stage(vk::ShaderStageFlags::COMPUTE).module(module).name(c"main");
        let info = [vk::ComputePipelineCreateInfo::default().stage(stage).layout(layout)];
        let pipeline = device.create_compute_pipelines(vk::PipelineCache::null(), &info, None).unwrap()[0];
        let address = addresses.all().address();
        let push = [address as u32, (address >> 32) as u32, points.len() as u32, level];
        submit(gpu, "olbvh.test.host", |r| {
            let commands = r.commands();
            device.cmd_bind_pipeline(commands, vk::PipelineBindPoint::COMPUTE, pipeline);
            device.cmd_bind_descriptor_sets(commands, vk::PipelineBindPoint::COMPUTE, layout, 0, &handles, &[]);
            device.cmd_push_constants(commands, layout, vk::ShaderStageFlags::COMPUTE, 0, bytemuck::cast_slice(&push));
            device.cmd_dispatch(commands, (points.len() as u32).div_ceil(64), 1, 1);
            Ok(())
        })
        .unwrap();
        device.destroy_pipeline(pipeline, None);
        device.destroy_shader_module(module, None);
        device.destroy_pipeline_layout(layout, None);
        device.destroy_descriptor_pool(pool, None);
        for l in layouts {
            device.destroy_descriptor_set_layout(l, None);
        }
    }
    let words: Vec<u32> = gpu.download(&output, output.all()).unwrap();
    words.as_chunks::<N>().0.to_vec()
}

fn check(binding: Binding) {
    let gpu = Gpu::new(&GpuOptions { binding: Some(binding), ..GpuOptions::default() }).unwrap();
    let mesh = kuhn_jittered([9, 8, 7], 0.3, 5).unwrap();
    let device = DeviceMesh::upload(&gpu, &mesh, BadCells::Skip).unwrap();
    // Vertices, and points of a lattice that extends beyond the mesh.
    let mut points = mesh.points.clone();
    points.extend((0..3000).map(|i| [(i % 13) as f32 * 0.81 - 0.5, (i / 13 % 13) as f32 * 0.73 - 0.4, (i / 169) as f32 * 0.47 - 0.3]));
    // A linear field: its value at a point follows from the coordinates, and its gradient is constant.
    let values: Vec<f32> = mesh.points.iter().map(|p| 3.0 + p[0] + 2.0 * p[1] - p[2]).collect();
    let bits = |numbers: &[f32]| numbers.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
    let field = gpu.upload("olbvh.test.field", &values).unwrap();
    for lists in [Lists::All, Lists::Boundary] {
        let tree = Tree::build(&gpu, &device, &BuildOptions { lists, slabs: true, ..BuildOptions::default() }).unwrap();
        let view = device.view();
        let (level, scene) = (tree.grid().level, SceneBuffers::new(&view, tree.memory(), Some(field.all())).unwrap());
        let found = run::<10>(&gpu, ANSWERS, &scene, level, &points);
        let options = LocateOptions::default();
        let expected = locate(&tree, &points, Some((&values, On::Points)), &options, SILENT).unwrap();
        let all = locate_all(&tree, &points, options.tolerance, SILENT).unwrap();
        for (i, [owner, owners, value, slope, met, x, weights @ ..]) in found.into_iter().enumerate() {
            let what = format!("{binding:?} {lists:?}: point {i} {:?}", points[i]);
            assert_eq!(owner, expected.owners[i], "{what}");
            if owner == u32::MAX {
                continue;
            }
            // A point outside of the surface is owned by the nearest tetrahedron, and no tetrahedron contains it.
            assert!(owners as usize == all.owners[i].len() || owners == 0, "{what}: {owners} owners of {:?}", all.owners[i]);
            assert_eq!(weights.to_vec(), bits(&expected.barycentrics[i]), "{what}");
            assert_eq!(value, expected.values[i].to_bits(), "{what}");
            let p = points[i];
            assert!((f32::from_bits(value) - (3.0 + p[0] + 2.0 * p[1] - p[2])).abs() < 1e-3, "{what}: {}", f32::from_bits(value));
            assert!((f32::from_bits(x) - p[0]).abs() < 1e-4, "{what}: {}", f32::from_bits(x));
            assert!((f32::from_bits(slope) - 2.0).abs() < 1e-2, "{what}: {}", f32::from_bits(slope));
            assert!(lists == Lists::Boundary || met <= owner, "{what}: the traversal has missed a leaf");
        }
        assert!(expected.owners.iter().filter(|o| **o == u32::MAX).count() > 100);
        let without = run::<10>(&gpu, ANSWERS, &SceneBuffers::new(&view, tree.memory(), None).unwrap(), level, &mesh.points);
        assert!(without.iter().all(|found| found[2..4].iter().all(|&bits| f32::from_bits(bits).is_nan())), "values without a field");
        check_walks(&mesh, &device, &points, &expected, &run::<5>(&gpu, WALKS, &scene, level, &points));
        let nearest = [0, 1, 3].map(|stack| run::<2>(&gpu, &format!("#define OLBVH_STACK {stack}\n{NEAREST}"), &scene, level, &points));
        for (i, [all, nearer]) in nearest[0].iter().enumerate() {
            assert_eq!(nearer, all, "{binding:?} {lists:?}: the leaf nearest to point {i} is {} away", f32::from_bits(*all));
        }
        assert!(nearest[1] == nearest[0] && nearest[2] == nearest[0], "{binding:?} {lists:?}: other leaves with another stack");
    }
    crate::silent(&gpu);
}

#[test]
fn by_address() {
    let gpu = Gpu::new(&GpuOptions::default()).unwrap();
    if gpu.binding() == Binding::Descriptors {
        not_run("the device has no buffer addresses");
        return;
    }
    check(Binding::Address);
}

#[test]
fn by_descriptors() {
    check(Binding::Descriptors);
}

/// The exported file contains nothing that only the kernels of the library use, and members of structs have the names
/// that they have on the host.
#[test]
fn other_programs_see_what_is_theirs() {
    for ours in ["OLBVH_WIDE", "u64vec2", "BUFFER16", "RECORDS", ".olbvh_"] {
        assert!(!OLBVH.contains(ours), "{ours}");
    }
    for member in ["    uvec2 grid; ", "    uint first_leaf; "] {
        assert!(OLBVH.contains(member), "{member}");
    }
}

#[test]
fn the_file_in_the_repository_is_the_exported_one() {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/include/olbvh.glsl");
    let same = std::fs::read_to_string(file).unwrap() == OLBVH;
    if !same && std::env::var_os("OLBVH_BLESS").is_some() {
        std::fs::write(file, OLBVH).unwrap();
    }
    assert!(same, "include/olbvh.glsl is old; OLBVH_BLESS=1 writes it anew");
}
