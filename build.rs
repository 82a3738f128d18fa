//! Compiles every kernel of `glsl/` in its three forms, reflects it, and generates its Rust side into `OUT_DIR`:
//! `kernels.rs` (argument structs, specialization constants, access per buffer, SPIR-V), `layout.rs` (shared structs),
//! `constants.rs`, and `olbvh.glsl` for the shaders of other programs.

#[path = "build/constants.rs"]
mod constants;
#[path = "build/export.rs"]
mod export;
#[path = "build/reflect.rs"]
mod reflect;

use reflect::{Interface, StructLayout};
use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::{env, fs, process, thread};

const GLSL: &str = "glsl";

/// A shader of another program, compiled to check that `glsl/olbvh.glsl` compiles.
const FOREIGN: &str = "#version 460
#define OLBVH_TRAVERSE
#include \"olbvh.glsl\"
bool visit_node(Node node) { return true; }
bool visit_leaf(Node node) { return false; }
void main() { olbvh_open(uvec2(0u)); }
";

fn main() {
    println!("cargo:rerun-if-changed={GLSL}");
    println!("cargo:rerun-if-changed=build");
    let out = PathBuf::from(env::var("OUT_DIR").unwrap_or_default());
    let result = generate(&out);
    if let Err(message) = result {
        // The message is printed as it is: file, line and the words of the compiler.
        eprintln!("\n{message}");
        process::exit(1);
    }
}

fn generate(out: &Path) -> Result<(), String> {
    let mut files = Vec::new();
    find_files(Path::new(GLSL), &mut files)?;
    files.sort();
    let kernels: Vec<&PathBuf> = files.iter().filter(|path| stage_of(path).is_some()).collect();
    let interfaces = on_all_cores(kernels.len(), |i| reflect_kernel(kernels[i]))?;
    // From the last one on, since those of queries take longest.
    let [count, forms] = [kernels.len(), FORMS.len()];
    on_all_cores(count * forms, |i| compile_kernel(kernels[count - 1 - i / forms], &FORMS[i % forms], out))?;
    write(&out.join("kernels.rs"), &kernels_source(&interfaces))?;
    for form in [&ADDRESS, &DESCRIPTOR] {
        compile(FOREIGN, "foreign.comp", form, false)?;
    }
    write(&out.join("olbvh.glsl"), &export::export(Path::new(GLSL))?)?;
    write(&out.join("constants.rs"), &constants::source(&files)?)?;
    write(&out.join("layout.rs"), &layout_source()?)
}

/// The results of jobs 0 to `count` - 1, in this order. The shader compiler takes up to a second for a kernel.
fn on_all_cores<T: Send>(count: usize, job: impl Fn(usize) -> Result<T, String> + Sync) -> Result<Vec<T>, String> {
    let (next, done) = (AtomicUsize::new(0), Mutex::new(BTreeMap::new()));
    thread::scope(|scope| {
        for _ in 0..thread::available_parallelism().map_or(1, usize::from) {
            scope.spawn(|| {
                while let Some(i) = Some(next.fetch_add(1, Ordering::Relaxed)).filter(|&i| i < count) {
                    let result = job(i);
                    done.lock().unwrap_or_else(PoisonError::into_inner).insert(i, result);
                }
            });
        }
    });
    done.into_inner().unwrap_or_else(PoisonError::into_inner).into_values().collect()
}

fn find_files(folder: &Path, found: &mut Vec<PathBuf>) -> Result<(), String> {
    let entries = fs::read_dir(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    for path in entries.filter_map(Result::ok).map(|e| e.path()) {
        if path.is_dir() {
            find_files(&path, found)?;
        } else {
            found.push(path);
        }
    }
    Ok(())
}

/// The stage of a shader file; `None` for a file that is only included.
fn stage_of(path: &Path) -> Option<shaderc::ShaderKind> {
    match path.extension()?.to_str()? {
        "comp" => Some(shaderc::ShaderKind::Compute),
        "rgen" => Some(shaderc::ShaderKind::RayGeneration),
        "rmiss" => Some(shaderc::ShaderKind::Miss),
        "rchit" => Some(shaderc::ShaderKind::ClosestHit),
        _ => None,
    }
}

/// How a kernel reaches its buffers: the suffix of the compiled file, and the macro that selects this form in the
/// source.
struct Form {
    suffix: &'static str,
    macro_name: Option<&'static str>,
}

const ADDRESS: Form = Form { suffix: "address", macro_name: None };
const WIDE: Form = Form { suffix: "wide", macro_name: Some("OLBVH_WIDE") };
const DESCRIPTOR: Form = Form { suffix: "descriptor", macro_name: Some("OLBVH_DESCRIPTORS") };
const FORMS: [Form; 3] = [ADDRESS, WIDE, DESCRIPTOR];

/// Compiles one source. Its `#include`s are resolved in `glsl/`, each file once.
fn compile(source: &str, name: &str, form: &Form, optimise: bool) -> Result<Vec<u32>, String> {
    let stage = stage_of(Path::new(name)).unwrap_or(shaderc::ShaderKind::Compute);
    let included = RefCell::new(BTreeSet::new());
    let compiler = shaderc::Compiler::new().map_err(|e| format!("shaderc: {e}"))?;
    let mut options = shaderc::CompileOptions::new().map_err(|e| format!("shaderc: {e}"))?;
    options.set_target_env(shaderc::TargetEnv::Vulkan, shaderc::EnvVersion::Vulkan1_2 as u32);
    options.set_target_spirv(shaderc::SpirvVersion::V1_5);
    options.set_warnings_as_errors();
    options.set_optimization_level(if optimise { shaderc::OptimizationLevel::Performance } else { shaderc::OptimizationLevel::Zero });
    if let Some(name) = form.macro_name {
        options.add_macro_definition(name, Some("1"));
    }
    if stage != shaderc::ShaderKind::Compute {
        options.add_macro_definition("OLBVH_RAY_TRACING", Some("1"));
    }
    options.set_include_callback(|file, _, _, _| {
        let path = Path::new(GLSL).join(file);
        let again = !included.borrow_mut().insert(file.to_owned());
        let content = if again { String::new() } else { read(&path)? };
        Ok(shaderc::ResolvedInclude { resolved_name: path.display().to_string(), content })
    });
    let artifact = compiler
        .compile_into_spirv(source, stage, name, "main", Some(&options))
        .map_err(|e| format!("{e}\n(in the form `{}`)", form.suffix))?;
    Ok(artifact.as_binary().to_vec())
}

/// The stem of a kernel's compiled files: `query.locate` of `glsl/query/locate.comp`.
fn stem_of(path: &Path) -> String {
    let path = path.with_extension("");
    path.strip_prefix(GLSL).unwrap_or(&path).display().to_string().replace(['/', '\\'], ".")
}

/// Optimisation may remove names, so an unoptimised module is reflected, and optimised ones are shipped.
fn reflect_kernel(path: &Path) -> Result<Interface, String> {
    let name = path.display().to_string();
    reflect::interface(&compile(&read(path)?, &name, &DESCRIPTOR, false)?, &stem_of(path)).map_err(|e| format!("{name}: {e}"))
}

fn compile_kernel(path: &Path, form: &Form, out: &Path) -> Result<(), String> {
    let words = compile(&read(path)?, &path.display().to_string(), form, true)?;
    let bytes: Vec<u8> = words.iter().flat_map(|w| w.to_le_bytes()).collect();
    fs::write(out.join(format!("{}.{}.spv", stem_of(path), form.suffix)), bytes).map_err(|e| e.to_string())
}

fn read(path: &Path) -> Result<String, String> {
    fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()))
}

fn write(path: &Path, text: &str) -> Result<(), String> {
    fs::write(path, text).map_err(|e| format!("{}: {e}", path.display()))
}

/// `build.30_count_splits` → `CountSplits`, `primitives.scan_tiles` → `ScanTiles`.
fn type_name(stem: &str) -> String {
    let words = stem.rsplit('.').next().unwrap_or(stem).split('_');
    let words = words.filter(|w| !w.chars().all(|c| c.is_ascii_digit()));
    words.map(|w| w[..1].to_uppercase() + &w[1..]).collect()
}

fn kernels_source(interfaces: &[Interface]) -> String {
    let mut s = String::from("// Generated by build.rs by reflection of glsl/.\n");
    for k in interfaces {
        let name = type_name(&k.stem);
        let _ = writeln!(s, "\n/// Arguments of `{}`.\n#[derive(Clone, Copy, Debug)]\npub(crate) struct {name} {{", k.stem);
        for b in &k.buffers {
            let _ = writeln!(s, "    pub {}: BufferRef,", b.name);
        }
        for a in &k.scalars {
            let _ = writeln!(s, "    pub {}: {},", a.name, a.rust_type);
        }
        let _ = writeln!(
            s,
            "}}\n/// Specialization constants of `{}`.\n#[derive(Clone, Copy, Debug)]\npub(crate) struct {name}Spec {{",
            k.stem
        );
        for c in &k.constants {
            let _ = writeln!(s, "    pub {}: u32,", c.name.to_lowercase());
        }
        let _ = writeln!(s, "}}\nimpl Default for {name}Spec {{\n    fn default() -> Self {{\n        Self {{");
        for c in &k.constants {
            let _ = writeln!(s, "            {}: {},", c.name.to_lowercase(), c.default);
        }
        let _ = writeln!(
            s,
            "        }}\n    }}\n}}\nimpl Specialization for {name}Spec {{\n    fn values(&self) -> Vec<(u32, u32)> {{\n        vec!["
        );
        for c in &k.constants {
            let _ = writeln!(s, "            ({}, self.{}),", c.id, c.name.to_lowercase());
        }
        let _ = writeln!(s, "        ]\n    }}\n}}\nimpl Kernel for {name} {{\n    type Spec = {name}Spec;");
        let _ = writeln!(s, "    const INFO: &'static KernelInfo = &KernelInfo {{\n        name: \"olbvh.{}\",", k.stem);
        for Form { suffix, .. } in &FORMS {
            let _ = writeln!(s, "        {suffix}: include_bytes!(concat!(env!(\"OUT_DIR\"), \"/{}.{suffix}.spv\")),", k.stem);
        }
        let _ = writeln!(s, "        buffers: &[");
        for b in &k.buffers {
            let access = if !b.writes {
                "Read"
            } else if b.reads {
                "ReadWrite"
            } else {
                "Write"
            };
            let _ = writeln!(s, "            BufferInfo {{ name: \"{}\", access: Access::{access}, alignment: {} }},", b.name, b.alignment);
        }
        let for_queries = k.stem.starts_with("query.") || k.stem.starts_with("baseline.");
        let _ = writeln!(s, "        ],\n        scalar_bytes: {},\n        for_queries: {for_queries},\n    }};\n}}", k.scalar_bytes);
        let _ = writeln!(s, "impl Arguments for {name} {{\n    fn info(&self) -> &'static KernelInfo {{\n        Self::INFO\n    }}");
        let _ = writeln!(
            s,
            "    fn buffers(&self) -> Vec<BufferRef> {{\n        vec![{}]\n    }}",
            list(k.buffers.iter().map(|b| format!("self.{}", b.name)))
        );
        let _ = writeln!(s, "    fn scalars(&self, base: usize, out: &mut [u8]) {{");
        for a in &k.scalars {
            let _ = writeln!(s, "        put(out, base + {}, bytemuck::bytes_of(&self.{}));", a.offset, a.name);
        }
        let _ = writeln!(s, "    }}\n}}");
    }
    let _ = writeln!(
        s,
        "\n/// Every kernel, by name.\npub(crate) const ALL: &[&KernelInfo] = &[{}];",
        list(interfaces.iter().map(|k| format!("{}::INFO", type_name(&k.stem))))
    );
    s
}

fn list(items: impl Iterator<Item = String>) -> String {
    items.collect::<Vec<_>>().join(", ")
}

/// The files of shared structs, and who sees these in Rust.
const LAYOUTS: [(&str, &str); 3] = [("scene", "pub"), ("layout", "pub"), ("state", "pub(crate)")];

/// Compiles a module that uses every struct of these files, and turns the reflected structs into Rust, with the comments of the
/// source.
fn layout_source() -> Result<String, String> {
    let shared = |(name, seen)| Ok((read(&Path::new(GLSL).join(format!("shared/{name}.glsl")))?, seen));
    let files = LAYOUTS.into_iter().map(shared).collect::<Result<Vec<(String, &str)>, String>>()?;
    let docs = reflect::comments(&files.iter().map(|(text, _)| text.as_str()).collect::<String>());
    let structs: Vec<(&str, &str)> =
        files.iter().flat_map(|(text, seen)| reflect::struct_names(text).map(move |name| (name, *seen))).collect();
    let mut probe = String::from("#version 460\n#include \"shared/layout.glsl\"\nlayout(local_size_x = 1) in;\n");
    for (i, (name, _)) in structs.iter().enumerate() {
        let _ = writeln!(probe, "layout(set = 0, binding = {i}, std430) buffer Probe{i} {{ {name} at[]; }} probe{i};");
    }
    probe.push_str("void main() {}\n");
    let words = compile(&probe, "layout_source", &DESCRIPTOR, false)?;
    let mut s = String::from("// Generated by build.rs by reflection of scene.glsl, layout.glsl and state.glsl in glsl/shared.\n");
    for (name, seen) in structs {
        let StructLayout { bytes, members } = reflect::layout_of(&words, name)?;
        let doc = |key: &str| docs.get(key).cloned().unwrap_or_else(|| "Undocumented.".into());
        let _ = writeln!(
            s,
            "\n/// {}\n#[repr(C)]\n#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]",
            doc(name)
        );
        let _ = writeln!(s, "{seen} struct {name} {{");
        for m in &members {
            let _ = writeln!(s, "    /// {}\n    pub {}: {},", doc(&format!("{name}.{}", m.name)), m.name, m.rust_type);
        }
        let _ = writeln!(s, "}}\nconst _: () = {{\n    assert!(std::mem::size_of::<{name}>() == {bytes});");
        for m in &members {
            let _ = writeln!(s, "    assert!(std::mem::offset_of!({name}, {}) == {});", m.name, m.offset);
        }
        let _ = writeln!(s, "}};");
    }
    Ok(s)
}
