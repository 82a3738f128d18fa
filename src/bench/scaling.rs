//! Time per item over the size of the mesh: what a larger problem costs beyond its size.

use super::plot::{color, escaped, frame};
use super::report::{Quantity, Report, StructureReport};
use super::table::{Table, number};
use serde::Serialize;
use std::fmt::Write as _;

/// The size that others are related to.
const REFERENCE_TETS: f64 = 200_000.0;
const QUANTITIES: [Quantity; 3] = [Quantity::Build, Quantity::LocateRandom, Quantity::LocateCoherent];

/// One measurement at one size.
#[derive(Clone, Debug, Serialize)]
pub struct Scale {
    /// The structure.
    pub structure: String,
    /// What was measured.
    pub quantity: Quantity,
    /// The mesh.
    pub mesh: String,
    /// Its tetrahedra.
    pub tets: u32,
    /// Nanoseconds per tetrahedron built over, or per point located.
    pub ns_per_item: f64,
    /// That by the one of the mesh nearest to 200,000 tetrahedra.
    pub ratio: f64,
}

/// Every measurement by the size of its mesh.
pub(super) fn scales(report: &Report) -> Vec<Scale> {
    let distance = |tets: u32| (f64::from(tets.max(1)) / REFERENCE_TETS).ln().abs();
    let reference = report.meshes.iter().min_by(|a, b| distance(a.tets).total_cmp(&distance(b.tets)));
    let per_item = |s: &StructureReport, quantity| s.figure(quantity)?.per_second.map(|rate| 1e9 / rate);
    let mut scales = Vec::new();
    for quantity in QUANTITIES {
        for mesh in &report.meshes {
            for s in &mesh.structures {
                let at_reference =
                    reference.and_then(|m| m.structures.iter().find(|r| r.name == s.name)).and_then(|r| per_item(r, quantity));
                if let (Some(ns_per_item), Some(base)) = (per_item(s, quantity), at_reference) {
                    let (structure, mesh_name) = (s.name.clone(), mesh.name.clone());
                    scales.push(Scale { structure, quantity, mesh: mesh_name, tets: mesh.tets, ns_per_item, ratio: ns_per_item / base });
                }
            }
        }
    }
    scales
}

fn unit(quantity: Quantity) -> &'static str {
    if quantity == Quantity::Build { "ns per tetrahedron" } else { "ns per point" }
}

/// A table per measurement: sizes down, structures across.
pub(super) fn tables(report: &Report) -> Vec<Table> {
    let mut names: Vec<&str> = Vec::new();
    for scale in &report.scaling {
        if !names.contains(&scale.structure.as_str()) {
            names.push(&scale.structure);
        }
    }
    let table = |quantity: Quantity| {
        let of = |mesh: &str, name: &str| report.scaling.iter().find(|s| s.quantity == quantity && s.mesh == mesh && s.structure == name);
        let row = |mesh: &super::MeshReport| {
            let cell =
                |name: &&str| of(&mesh.name, name).map_or("–".into(), |s| format!("{} ({}×)", number(s.ns_per_item), number(s.ratio)));
            [vec![mesh.name.clone(), mesh.tets.to_string()], names.iter().map(cell).collect()].concat()
        };
        let header = ["", "tetrahedra"].into_iter().chain(names.iter().copied()).map(str::to_owned).collect();
        let title = format!("Scaling: {}, {} (times that at 200,000 tetrahedra)", quantity.title(), unit(quantity));
        Table { title, header, rows: report.meshes.iter().map(row).collect() }
    };
    if report.scaling.is_empty() { Vec::new() } else { QUANTITIES.map(table).into() }
}

const LEFT: f64 = 64.0;
const RIGHT: f64 = 1040.0;
const TOP: f64 = 56.0;
const BOTTOM: f64 = 324.0;

/// Name of a file and its content, a plot per measurement: both axes logarithmic, a line per structure.
pub(super) fn plots(report: &Report) -> Vec<(String, String)> {
    let plot = |quantity: Quantity| {
        let scales: Vec<&Scale> = report.scaling.iter().filter(|s| s.quantity == quantity && s.ns_per_item > 0.0).collect();
        let ends = |value: &dyn Fn(&Scale) -> f64| {
            let logs = scales.iter().map(|s| value(s).log10());
            let [lo, hi] = logs.fold([f64::INFINITY, f64::NEG_INFINITY], |[lo, hi], v| [lo.min(v), hi.max(v)]);
            [lo.floor(), hi.ceil().max(lo.floor() + 1.0)]
        };
        let (across, up) = (ends(&|s| f64::from(s.tets)), ends(&|s| s.ns_per_item));
        if !across.iter().chain(&up).all(|v| v.is_finite()) {
            return None;
        }
        let x = |tets: f64| LEFT + (RIGHT - LEFT) * (tets.log10() - across[0]) / (across[1] - across[0]);
        let y = |ns: f64| BOTTOM - (BOTTOM - TOP) * (ns.log10() - up[0]) / (up[1] - up[0]);
        let mut svg = String::new();
        for decade in across[0] as i32..=across[1] as i32 {
            let (tick, at) = (10f64.powi(decade), x(10f64.powi(decade)));
            let _ = writeln!(svg, "<path d=\"M{at:.1} {TOP}V{BOTTOM}\" stroke=\"#e3e3e8\"/>");
            let _ = writeln!(svg, "<text x=\"{at:.1}\" y=\"{}\" text-anchor=\"middle\">{tick}</text>", BOTTOM + 16.0);
        }
        for decade in up[0] as i32..=up[1] as i32 {
            let (tick, at) = (10f64.powi(decade), y(10f64.powi(decade)));
            let _ = writeln!(svg, "<path d=\"M{LEFT} {at:.1}H{RIGHT}\" stroke=\"#e3e3e8\"/>");
            let _ = writeln!(svg, "<text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{tick}</text>", LEFT - 8.0, at + 4.0);
        }
        let mut drawn: Vec<&str> = Vec::new();
        for s in report.meshes.iter().flat_map(|m| &m.structures) {
            if drawn.contains(&s.name.as_str()) {
                continue;
            }
            drawn.push(&s.name);
            let points = scales.iter().filter(|scale| scale.structure == s.name);
            let points: Vec<(f64, f64, &Scale)> = points.map(|&scale| (x(f64::from(scale.tets)), y(scale.ns_per_item), scale)).collect();
            let line: Vec<String> = points.iter().map(|(x, y, _)| format!("{x:.1},{y:.1}")).collect();
            let _ = writeln!(svg, "<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"2\"/>", line.join(" "), color(s));
            for (x, y, scale) in points {
                let told = format!("{} {}: {} {}", scale.mesh, s.name, number(scale.ns_per_item), unit(quantity));
                let dot = format!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3.5\" fill=\"{}\">", color(s));
                let _ = writeln!(svg, "{dot}<title>{}</title></circle>", escaped(&told));
            }
        }
        let title = format!("Scaling, {}: {} over tetrahedra, less is better", quantity.title(), unit(quantity));
        Some((format!("scaling_{}.svg", quantity.stem()), frame(report, &title, &svg)))
    };
    QUANTITIES.into_iter().filter_map(plot).collect()
}
