//! Formatting of a report as tables, for a terminal and as Markdown.

use super::mesh_report::MeshReport;
use super::quantity::Quantity;
use super::report::Report;
use super::scaling::{QUANTITIES, unit};
use super::structure_report::{Figure, StageFigure, StructureReport};
use super::table::{Table, mebibytes, number, text_of};

/// A table with one row per structure and one column per mesh; `None` if no structure has a value.
fn by_structure(report: &Report, title: &str, cell: impl Fn(&MeshReport, &StructureReport) -> Option<String>) -> Option<Table> {
    let mut names: Vec<&str> = Vec::new();
    for s in report.meshes.iter().flat_map(|m| &m.structures) {
        if !names.contains(&s.name.as_str()) {
            names.push(&s.name);
        }
    }
    let header = std::iter::once(String::new()).chain(report.meshes.iter().map(|m| m.name.clone())).collect();
    let of = |name: &str, m: &MeshReport| m.structures.iter().find(|s| s.name == name).and_then(|s| cell(m, s));
    let row = |name: &str| {
        let cells: Vec<Option<String>> = report.meshes.iter().map(|m| of(name, m)).collect();
        let some = cells.iter().any(Option::is_some);
        some.then(|| std::iter::once(name.to_owned()).chain(cells.into_iter().map(|c| c.unwrap_or_else(|| "–".into()))).collect())
    };
    let rows: Vec<Vec<String>> = names.into_iter().filter_map(row).collect();
    (!rows.is_empty()).then(|| Table { title: title.into(), header, rows })
}

fn meshes(report: &Report) -> Table {
    let header = ["", "tetrahedra", "points", "boundary", "volume ratio", "aspect min", "median", "max"];
    let row = |m: &MeshReport| {
        let share = format!("{:.1} %", 100.0 * f64::from(m.boundary) / f64::from(m.tets.max(1)));
        let ratio = if m.quality.volume_ratio < 1e4 { number(m.quality.volume_ratio) } else { format!("{:.1e}", m.quality.volume_ratio) };
        let mut cells = vec![m.name.clone(), m.tets.to_string(), m.points.to_string(), share, ratio];
        cells.extend(m.quality.aspect.map(|a| format!("{a:.3}")));
        cells
    };
    Table { title: "Meshes (Table 1)".into(), header: text_of(&header), rows: report.meshes.iter().map(row).collect() }
}

fn figures(report: &Report, quantity: Quantity) -> Option<Table> {
    let unit = if quantity.is_rate() { "million per second" } else { "ms" };
    by_structure(report, &format!("{}, {unit} (times the LBVH's speed)", quantity.title()), |_, s| {
        let figure = s.figure(quantity)?;
        let ratio = figure.speedup.map_or(String::new(), |r| format!(" ({}×)", number(r)));
        Some(format!("{}{ratio}", number(figure.shown())))
    })
}

/// A table per measurement, with one row per size and one column per structure.
fn scaling(report: &Report) -> Vec<Table> {
    let mut names: Vec<&str> = Vec::new();
    for scale in &report.scaling {
        if !names.contains(&scale.structure.as_str()) {
            names.push(&scale.structure);
        }
    }
    let table = |quantity: Quantity| {
        let of = |mesh: &str, name: &str| report.scaling.iter().find(|s| s.quantity == quantity && s.mesh == mesh && s.structure == name);
        let row = |mesh: &MeshReport| {
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

/// The main tables.
fn main_tables(report: &Report) -> Vec<Table> {
    let total = by_structure(report, "Memory (Table 2), MiB (part of the LBVH's)", |m, s| {
        let part = m.lbvh().map_or(String::new(), |l| format!(" ({:.0} %)", 100.0 * s.memory.total as f64 / l.memory.total as f64));
        Some(format!("{}{part}", mebibytes(s.memory.total)))
    });
    let paper = by_structure(report, "Memory as the paper counts, with boxes and without PO, MiB", |_, s| s.memory.paper.map(mebibytes));
    let lost = by_structure(report, "Lost points, of those inside the mesh", |_, s| {
        s.lost.map(|l| format!("{} of {} ({:.4} %)", l.points, l.of, 100.0 * l.points as f64 / l.of.max(1) as f64))
    });
    let mut tables = vec![meshes(report)];
    tables.extend(scaling(report));
    tables.extend(figures(report, Quantity::Build));
    tables.extend(total.into_iter().chain(paper));
    tables.extend(Quantity::EVERY[1..].iter().filter_map(|&q| figures(report, q)));
    tables.extend(lost);
    tables.extend(report.meshes.iter().filter_map(|m| stages(m, "", is_main)));
    tables
}

/// Whether a structure is a tree of the main tables: at α = 0 the paper's tree and the default one.
fn is_main(s: &StructureReport) -> bool {
    s.alpha == Some(0) && (s.assign == Some("aabb") || s.lists == Some("boundary"))
}

/// The stages of the chosen constructions, compared with the copy rate; `None` if stages are not timed.
fn stages(mesh: &MeshReport, which: &str, chosen: impl Fn(&StructureReport) -> bool) -> Option<Table> {
    let header = ["", "stage", "ms", "MiB at least", "GB/s", "of copy rate"];
    let of = |s: &StructureReport| {
        let name = s.name.clone();
        let row = move |f: &StageFigure| {
            let part = format!("{:.0} %", 100.0 * f.of_copy_rate);
            vec![name.clone(), f.stage.clone(), number(f.ms), mebibytes(f.bytes), number(f.gb_per_s), part]
        };
        s.stages.iter().map(row).collect::<Vec<_>>()
    };
    let rows: Vec<Vec<String>> = mesh.structures.iter().filter(|s| chosen(s)).flat_map(of).collect();
    let title = format!("Bytes that each stage moves at least, {which}{}", mesh.name);
    (!rows.is_empty()).then(|| Table { title, header: text_of(&header), rows })
}

/// Tables that break down the numbers of the main tables.
fn detail_tables(report: &Report) -> Vec<Table> {
    let listed = |items: &mut dyn Iterator<Item = String>| items.collect::<Vec<_>>().join(", ");
    let stages = report.meshes.iter().map(|m| {
        let row = |s: &StructureReport| {
            let stages = s.figure(Quantity::Build).map(|f| &f.timing.stages_ms);
            let stages = listed(&mut stages.into_iter().flatten().map(|(name, ms)| format!("{} {}", name, number(*ms))));
            vec![s.name.clone(), s.level.map_or("–".into(), |l| l.to_string()), s.entries.map_or("–".into(), |n| n.to_string()), stages]
        };
        let header = text_of(&["", "l", "entries", "device ms per stage"]);
        Table { title: format!("Construction by stage, {}", m.name), header, rows: m.structures.iter().map(row).collect() }
    });
    let traffic = report.meshes.iter().filter_map(|m| self::stages(m, "other trees, ", |s| !is_main(s)));
    let arrays = report.meshes.iter().map(|m| {
        let row = |s: &StructureReport| {
            let arrays = s.memory.arrays.iter().filter(|a| a.1 > 0).map(|(name, n)| format!("{name} {n}"));
            let more = [("before compaction", s.memory.before_compaction), ("scratch", s.memory.scratch)];
            let more = more.into_iter().filter_map(|(name, n)| Some(format!("{name} {}", n?)));
            vec![s.name.clone(), listed(&mut arrays.chain(more))]
        };
        Table {
            title: format!("Bytes by array, {}", m.name),
            header: text_of(&["", "bytes"]),
            rows: m.structures.iter().map(row).collect(),
        }
    });
    let every = report.meshes.iter().map(|m| {
        let header = ["", "measurement", "repetitions", "device min", "median", "max", "wall median, ms"];
        let row = |s: &StructureReport| {
            let name = s.name.clone();
            let figure = move |f: &Figure| {
                let t = &f.timing;
                let device = t.device_ms.map_or(text_of(&["–"; 3]), |d| [d.min, d.median, d.max].map(number).to_vec());
                [vec![name.clone(), f.quantity.name().into(), t.repetitions.to_string()], device, vec![number(t.wall_ms.median)]].concat()
            };
            s.figures.iter().map(figure).collect::<Vec<_>>()
        };
        let rows = m.structures.iter().flat_map(row).collect();
        Table { title: format!("Every measurement, {}", m.name), header: text_of(&header), rows }
    });
    stages.chain(traffic).chain(arrays).chain(every).collect()
}

fn heading(report: &Report) -> String {
    let Report { version, commit, suite, settings, device, copy, .. } = report;
    format!(
        "olbvh {version}{}, suite {}, on {} ({}; subgroups of {}, kernels `{}`, buffers by {})\n{} points, {}² pixels, slices of {} voxels a row; \
         medians of up to {} repetitions or {} s, device time, everything verified before it is timed\n\
         random points in trees with lists `boundary` are sorted first if there is at least one for every four tetrahedra, which is timed\n\
         copy rate {} GB/s, read and written\n",
        commit.as_ref().map_or(String::new(), |c| format!(" ({c})")),
        suite.name(),
        device.name,
        device.driver,
        device.subgroup,
        device.target,
        device.binding,
        settings.points,
        settings.picture,
        settings.slice,
        settings.budget.repetitions,
        settings.budget.seconds,
        number(copy.gb_per_s)
    )
}

/// What was not measured, and why.
fn notes(report: &Report) -> String {
    let structures = report
        .meshes
        .iter()
        .flat_map(|m| m.skipped.iter().map(move |(name, why)| format!("{name} over {}: not measured: {why}\n", m.name)));
    let meshes = report.failed.iter().map(|why| format!("not measured: {why}\n"));
    structures.chain(meshes).fold(String::new(), |text, line| text + "\n" + &line)
}

/// Formats the main tables for a terminal.
pub fn text(report: &Report) -> String {
    let mut text = heading(report);
    main_tables(report).iter().for_each(|table| table.text(&mut text));
    text + &notes(report)
}

/// Formats all tables as Markdown.
pub fn markdown(report: &Report) -> String {
    let mut text = format!("# Measurements\n\n{}", heading(report).replace('\n', "  \n"));
    main_tables(report).iter().chain(&detail_tables(report)).for_each(|table| table.markdown(&mut text));
    text + &notes(report)
}
