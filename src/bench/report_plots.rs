//! Formatting of a report as bar charts, one SVG file per figure of the paper.

use super::plot::{GRID, HEIGHT, INK, MARGINS, WIDTH, color, escaped, frame};
use super::quantity::Quantity;
use super::report::Report;
use super::scaling_plots;
use super::structure_report::{Figure, StructureReport};
use super::table::number;
use std::fmt::Write as _;

/// Plots of everything that was measured: names and contents of files.
pub fn plots(report: &Report) -> Vec<(String, String)> {
    let figure = |q: Quantity| {
        let unit = if q.is_rate() { "million per second, more is better" } else { "milliseconds, less is better" };
        (q.name(), format!("{}: {unit}", q.title()), chart(report, &move |s| s.figure(q).map(Figure::shown)))
    };
    let memory = |s: &StructureReport| Some(s.memory.total as f64 / f64::from(1 << 20));
    let memory = ("table2_memory", "Memory (Table 2): MiB, less is better".to_owned(), chart(report, &memory));
    let all = Quantity::EVERY.into_iter().map(figure).chain([memory]);
    let bars = all.filter_map(|(stem, title, chart)| Some((format!("{stem}.svg"), frame(report, &title, &chart?))));
    bars.chain(scaling_plots::plots(report)).collect()
}

/// Draws bars on a logarithmic scale, one group per mesh; `None` if there are none.
fn chart(report: &Report, value: &dyn Fn(&StructureReport) -> Option<f64>) -> Option<String> {
    let positive = |s: &StructureReport| value(s).filter(|v| v.is_finite() && *v > 0.0);
    let values = || report.meshes.iter().flat_map(|m| m.structures.iter().filter_map(positive));
    let least = values().fold(f64::INFINITY, f64::min);
    let most = values().fold(0.0, f64::max);
    if most == 0.0 {
        return None;
    }
    // The scale starts at a whole decade, so that the smallest bar has some height.
    let (low, high) = ((least * 0.7).log10().floor(), (most * 1.6).log10());
    let [left, top, right, bottom] = MARGINS;
    let (wide, high_px) = (WIDTH - left - right, HEIGHT - top - bottom);
    let y = |v: f64| top + high_px * (1.0 - (v.log10() - low) / (high - low));
    let mut svg = String::new();
    for decade in low as i32..=high as i32 {
        for step in [1.0, 2.0, 5.0] {
            let tick = step * 10f64.powi(decade);
            if tick.log10() > high + 1e-9 || (step > 1.0 && high - low > 2.5) {
                continue;
            }
            let at = y(tick);
            let _ = writeln!(svg, "<path d=\"M{left} {at:.1}H{}\" stroke=\"{GRID}\"/>", WIDTH - right);
            let label = if tick >= 1.0 { format!("{tick}") } else { format!("{tick:.*}", decade.unsigned_abs() as usize) };
            let _ = writeln!(svg, "<text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{label}</text>", left - 8.0, at + 4.0);
        }
    }
    let group = wide / report.meshes.len() as f64;
    for (g, mesh) in report.meshes.iter().enumerate() {
        let bar = (group * 0.86 / mesh.structures.len().max(1) as f64).min(48.0);
        let begin = left + group * (g as f64 + 0.5) - bar * mesh.structures.len() as f64 / 2.0;
        for (i, s) in mesh.structures.iter().enumerate() {
            let x = begin + bar * i as f64;
            let Some(v) = positive(s) else {
                let _ = writeln!(
                    svg,
                    "<text x=\"{:.1}\" y=\"{}\" text-anchor=\"middle\" fill=\"#9a9da3\">–</text>",
                    x + bar / 2.0,
                    HEIGHT - bottom - 4.0
                );
                continue;
            };
            let _ = writeln!(
                svg,
                "<rect x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\" fill=\"{}\"><title>{} {}: {}</title></rect>",
                x + 0.06 * bar,
                y(v),
                0.88 * bar,
                HEIGHT - bottom - y(v),
                color(s),
                escaped(&mesh.name),
                escaped(&s.name),
                number(v)
            );
            if bar >= 26.0 {
                let _ = writeln!(
                    svg,
                    "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\" font-size=\"10\">{}</text>",
                    x + bar / 2.0,
                    y(v) - 3.0,
                    number(v)
                );
            }
        }
        // The label is the mesh of the paper that this one stands for, if any; many labels are placed in two lines.
        let (label, _) = mesh.name.rsplit_once(' ').unwrap_or((&mesh.name, ""));
        let line = if report.meshes.len() > 8 { 13.0 * (g % 2) as f64 } else { 0.0 };
        let (x, y) = (left + group * (g as f64 + 0.5), HEIGHT - bottom + 16.0 + line);
        let _ = writeln!(svg, "<text x=\"{x:.1}\" y=\"{y}\" text-anchor=\"middle\">{}</text>", escaped(label));
    }
    let _ = writeln!(svg, "<path d=\"M{left} {0}H{1}\" stroke=\"{INK}\"/>", HEIGHT - bottom, WIDTH - right);
    Some(svg)
}
