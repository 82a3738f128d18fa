//! Formatting of the time per item over the size of the mesh as line charts, one SVG file per measurement.

use super::plot::{GRID, color, escaped, frame};
use super::quantity::Quantity;
use super::report::Report;
use super::scaling::{QUANTITIES, Scale, unit};
use super::table::number;
use std::fmt::Write as _;

const LEFT: f64 = 64.0;
const RIGHT: f64 = 1040.0;
const TOP: f64 = 56.0;
const BOTTOM: f64 = 324.0;

/// One plot per measurement, as name and content of a file: both axes are logarithmic, and there is one line per
/// structure.
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
            let _ = writeln!(svg, "<path d=\"M{at:.1} {TOP}V{BOTTOM}\" stroke=\"{GRID}\"/>");
            let _ = writeln!(svg, "<text x=\"{at:.1}\" y=\"{}\" text-anchor=\"middle\">{tick}</text>", BOTTOM + 16.0);
        }
        for decade in up[0] as i32..=up[1] as i32 {
            let (tick, at) = (10f64.powi(decade), y(10f64.powi(decade)));
            let _ = writeln!(svg, "<path d=\"M{LEFT} {at:.1}H{RIGHT}\" stroke=\"{GRID}\"/>");
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
        Some((format!("scaling_{}.svg", quantity.name()), frame(report, &title, &svg)))
    };
    QUANTITIES.into_iter().filter_map(plot).collect()
}
