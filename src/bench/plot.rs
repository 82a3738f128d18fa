//! What all plots share: their size, a colour for every structure, and the title, device and legend around a chart.

use super::report::Report;
use super::structure_report::StructureReport;
use std::fmt::Write as _;

pub(super) const WIDTH: f64 = 1080.0;
pub(super) const HEIGHT: f64 = 440.0;
/// Margins: left, top, right, bottom.
pub(super) const MARGINS: [f64; 4] = [64.0, 44.0, 16.0, 116.0];
pub(super) const GRID: &str = "#e3e3e8";
pub(super) const INK: &str = "#22252b";

/// The colour of a structure: one hue per α, lighter for stronger assignments, darkest for lists at the boundary only;
/// red for the program's tree, grey and violet for the baselines.
pub(super) fn color(s: &StructureReport) -> &'static str {
    let octrees = [
        ["#2d65ad", "#6a9ad3", "#acc9ea", "#123663"],
        ["#258a64", "#5fb592", "#a6d8c2", "#0d4732"],
        ["#c46d14", "#e59c4c", "#f5cd9d", "#743b04"],
    ];
    let place = if s.lists == Some("boundary") { Some(3) } else { ["aabb", "planes", "exact"].iter().position(|&a| Some(a) == s.assign) };
    match (s.alpha.and_then(|alpha| octrees.get(usize::from(alpha))), place) {
        (Some(shades), Some(place)) => shades[place],
        _ if s.kind == "olbvh" => "#b3395b",
        _ if s.kind == "lbvh" => "#6b6f76",
        _ => "#7a3fa0",
    }
}

pub(super) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// Adds title, device and legend to a chart.
pub(super) fn frame(report: &Report, title: &str, chart: &str) -> String {
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" font-family=\"sans-serif\" font-size=\"12\" fill=\"{INK}\">\n\
         <rect width=\"{WIDTH}\" height=\"{HEIGHT}\" fill=\"#fff\"/>\n<text x=\"16\" y=\"24\" font-size=\"15\" font-weight=\"bold\">{}</text>\n\
         <text x=\"{}\" y=\"24\" text-anchor=\"end\" fill=\"#6b6f76\">{}</text>\n{chart}",
        escaped(title),
        WIDTH - MARGINS[2],
        escaped(&report.device.name)
    );
    let mut names: Vec<&StructureReport> = Vec::new();
    for s in report.meshes.iter().flat_map(|m| &m.structures) {
        if names.iter().all(|n| n.name != s.name) {
            names.push(s);
        }
    }
    for (i, s) in names.into_iter().enumerate() {
        let (x, y) = (MARGINS[0] + (i / 4) as f64 * 190.0, HEIGHT - 64.0 + (i % 4) as f64 * 17.0);
        let _ = writeln!(svg, "<rect x=\"{x}\" y=\"{}\" width=\"11\" height=\"11\" fill=\"{}\"/>", y - 10.0, color(s));
        let _ = writeln!(svg, "<text x=\"{}\" y=\"{y}\">{}</text>", x + 17.0, escaped(&s.name));
    }
    svg.push_str("</svg>\n");
    svg
}
