//! Comparison of two result files: the ratio of every measurement that both have, and whether it exceeds the spread of
//! the measurements.

use super::measure::Spread;
use super::stored::{StoredCopy, StoredFigure, StoredMesh, StoredStructure, leaves, read};
use super::table::{Table, mebibytes, number, text_of};
use crate::error::Result;
use crate::named::named;
use serde::Serialize;
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Minimum number of repetitions for smallest and largest times to show how much a time varies.
const REPETITIONS: u32 = 3;

/// How the second times relate to the first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// All second times are shorter than all first times.
    Faster,
    /// All second times are longer than all first times.
    Slower,
    /// The ranges of times overlap, so the difference may be noise.
    WithinSpread,
    /// One of the two has too few repetitions for a verdict.
    Unknown,
}

named!(Verdict, "verdict", [Faster = "FASTER", Slower = "SLOWER", WithinSpread = "within spread", Unknown = "too few repetitions"]);

impl Verdict {
    fn of([a, b]: [Spread; 2], repetitions: u32) -> Self {
        match () {
            () if repetitions < REPETITIONS => Self::Unknown,
            () if b.max < a.min => Self::Faster,
            () if b.min > a.max => Self::Slower,
            () => Self::WithinSpread,
        }
    }
}

/// A measurement that both files have.
#[derive(Clone, Debug, Serialize)]
pub struct Compared {
    /// Name of the mesh.
    pub mesh: String,
    /// Name of the structure.
    pub structure: String,
    /// What was measured.
    pub measurement: String,
    /// Milliseconds in the first and in the second file: on the device, or on the host if one of the files has no
    /// device times.
    pub ms: [Spread; 2],
    /// Second median divided by the first; if below 1, the second is faster.
    pub ratio: f64,
    /// Smallest and largest ratio that the spreads allow.
    pub ratio_range: [f64; 2],
    /// How the times relate.
    pub verdict: Verdict,
}

/// The comparison of two files.
#[derive(Clone, Debug, Serialize)]
pub struct Comparison {
    /// The files.
    pub files: [PathBuf; 2],
    /// Facts about device, settings and program that are equal in both files.
    pub same: BTreeMap<String, Value>,
    /// Facts that differ.
    pub different: BTreeMap<String, [Value; 2]>,
    /// The measurements that both files have.
    pub compared: Vec<Compared>,
    /// Structures whose memory differs: mesh, structure, bytes.
    pub memory: Vec<(String, String, [u64; 2])>,
    /// What only the first file has, and what only the second has.
    pub only: [Vec<String>; 2],
    /// Measurements that both files have but that cannot be compared, and why.
    pub incomparable: Vec<(String, String)>,
}

/// Compares the results of two runs.
///
/// # Errors
/// [`crate::Error::Io`] and [`crate::Error::File`] if a file cannot be read or is not a result file.
pub fn compare(files: [&Path; 2]) -> Result<Comparison> {
    let stored = [read(files[0])?, read(files[1])?];
    let facts = stored.each_ref().map(|s| {
        let mut facts = BTreeMap::new();
        s.facts.iter().for_each(|(name, value)| leaves(name, value, &mut facts));
        facts
    });
    let mut comparison = Comparison {
        files: files.map(Into::into),
        same: BTreeMap::new(),
        different: BTreeMap::new(),
        compared: Vec::new(),
        memory: Vec::new(),
        only: [Vec::new(), Vec::new()],
        incomparable: Vec::new(),
    };
    for name in facts[0].keys().chain(facts[1].keys().filter(|&name| !facts[0].contains_key(name))) {
        let values = facts.each_ref().map(|f| f.get(name).cloned().unwrap_or(Value::Null));
        if values[0] == values[1] {
            comparison.same.insert(name.clone(), values[0].clone());
        } else {
            comparison.different.insert(name.clone(), values);
        }
    }
    let [a, b] = &stored;
    if let (Some(a), Some(b)) = (&a.copy, &b.copy) {
        for (way, ms) in [("by command", [a.command_ms, b.command_ms]), ("by kernel", [a.kernel_ms, b.kernel_ms])] {
            let of = |copy: &StoredCopy, ms: Spread| StoredFigure {
                quantity: "copy".into(),
                repetitions: copy.repetitions,
                device_ms: Some(ms),
                wall_ms: ms,
                items: Some(copy.bytes),
            };
            comparison.compared.push(Compared::new("device", way, &of(a, ms[0]), &of(b, ms[1])));
        }
    }
    let pairs = matched(&a.meshes, &b.meshes, |m| &m.name, |m| format!("mesh {}", m.name), &mut comparison.only);
    for (a, b) in pairs {
        if (a.tets, a.points) == (b.tets, b.points) {
            comparison.add_mesh(a, b);
        } else {
            let why = format!("{} tetrahedra and {} points in A, {} and {} in B", a.tets, a.points, b.tets, b.points);
            comparison.incomparable.push((format!("mesh {}", a.name), why));
        }
    }
    Ok(comparison)
}

/// Pairs the elements of two lists that have the same key; those that only one list has go to `only`.
fn matched<'a, T>(
    a: &'a [T],
    b: &'a [T],
    key: impl Fn(&T) -> &str,
    label: impl Fn(&T) -> String,
    only: &mut [Vec<String>; 2],
) -> Vec<(&'a T, &'a T)> {
    let missing = |x: &T, others: &[T]| others.iter().all(|y| key(y) != key(x));
    only[0].extend(a.iter().filter(|x| missing(x, b)).map(&label));
    only[1].extend(b.iter().filter(|y| missing(y, a)).map(&label));
    a.iter().filter_map(|x| Some((x, b.iter().find(|y| key(y) == key(x))?))).collect()
}

impl Comparison {
    fn add_mesh(&mut self, a: &StoredMesh, b: &StoredMesh) {
        let mesh = &a.name;
        let label = |s: &StoredStructure| format!("{} over {mesh}", s.name);
        for (a, b) in matched(&a.structures, &b.structures, |s| &s.name, label, &mut self.only) {
            let bytes = [a.memory.total, b.memory.total];
            if bytes[0] != bytes[1] {
                self.memory.push((mesh.clone(), a.name.clone(), bytes));
            }
            let label = |f: &StoredFigure| format!("{}, {} over {mesh}", f.quantity, a.name);
            for (f, g) in matched(&a.figures, &b.figures, |f| &f.quantity, label, &mut self.only) {
                match self.hindrance(f, g) {
                    None => self.compared.push(Compared::new(mesh, &a.name, f, g)),
                    Some(why) => self.incomparable.push((label(f), why)),
                }
            }
        }
    }

    /// Why two measurements with the same name are not of the same work; `None` if they are.
    fn hindrance(&self, a: &StoredFigure, b: &StoredFigure) -> Option<String> {
        // Intervals and overlaps count no items, but a picture of another size is other work.
        let picture = self.different.get("settings.picture").filter(|_| a.quantity == "intervals" || a.quantity == "march");
        if let Some([x, y]) = picture {
            return Some(format!("pictures of {x}² and {y}² pixels"));
        }
        let items = |n: Option<u64>| n.map_or("unknown".into(), |n| n.to_string());
        (a.items != b.items).then(|| format!("{} items in A, {} in B", items(a.items), items(b.items)))
    }

    /// Geometric mean of the ratios of each kind of measurement, and the number of each verdict.
    fn summary(&self) -> Table {
        let header = ["", "compared", "B/A, geometric mean", "faster", "slower", "within spread", "too few repetitions"];
        let mut names: Vec<&str> = Vec::new();
        for c in &self.compared {
            if !names.contains(&c.measurement.as_str()) {
                names.push(&c.measurement);
            }
        }
        let row = |name: &&str| {
            let of: Vec<&Compared> = self.compared.iter().filter(|c| c.measurement == *name).collect();
            let mean = (of.iter().map(|c| c.ratio.ln()).sum::<f64>() / of.len() as f64).exp();
            let count = |v: Verdict| of.iter().filter(|c| c.verdict == v).count().to_string();
            let counts = Verdict::EVERY.map(count);
            [vec![(*name).to_owned(), of.len().to_string(), number(mean)], counts.to_vec()].concat()
        };
        Table { title: "Summary: time of B by time of A".into(), header: text_of(&header), rows: names.iter().map(row).collect() }
    }

    fn tables(&self) -> Vec<Table> {
        let shown = |v: &Value| v.as_str().map_or_else(|| v.to_string(), str::to_owned);
        let row = |(name, [a, b]): (&String, &[Value; 2])| vec![name.clone(), shown(a), shown(b)];
        let mut tables = Vec::new();
        if !self.different.is_empty() {
            let rows = self.different.iter().map(row).collect();
            tables.push(Table { title: "WHAT DIFFERS BESIDES THE TIMES".into(), header: text_of(&["", "A", "B"]), rows });
        }
        tables.push(self.summary());
        let mut meshes: Vec<&str> = self.compared.iter().map(|c| c.mesh.as_str()).collect();
        meshes.dedup();
        for mesh in meshes {
            let header = ["", "measurement", "A, ms", "B, ms", "B/A", "least", "most", ""];
            let row = |c: &Compared| {
                let figures = [c.ms[0].median, c.ms[1].median, c.ratio, c.ratio_range[0], c.ratio_range[1]].map(number);
                [vec![c.structure.clone(), c.measurement.clone()], figures.to_vec(), vec![c.verdict.name().into()]].concat()
            };
            let rows = self.compared.iter().filter(|c| c.mesh == mesh).map(row).collect();
            tables.push(Table { title: format!("Times, {mesh}"), header: text_of(&header), rows });
        }
        if !self.memory.is_empty() {
            let row = |(mesh, structure, [a, b]): &(String, String, [u64; 2])| {
                vec![format!("{structure} over {mesh}"), mebibytes(*a), mebibytes(*b), number(*b as f64 / *a as f64)]
            };
            let rows = self.memory.iter().map(row).collect();
            tables.push(Table { title: "Memory that differs, MiB".into(), header: text_of(&["", "A", "B", "B/A"]), rows });
        }
        for (name, only) in ["A", "B"].into_iter().zip(&self.only).filter(|(_, only)| !only.is_empty()) {
            let rows = only.iter().map(|what| vec![what.clone()]).collect();
            tables.push(Table { title: format!("Only in {name}"), header: text_of(&["what"]), rows });
        }
        if !self.incomparable.is_empty() {
            let rows = self.incomparable.iter().map(|(what, why)| vec![what.clone(), why.clone()]).collect();
            tables.push(Table { title: "Not compared".into(), header: text_of(&["what", "why"]), rows });
        }
        tables
    }

    fn heading(&self) -> String {
        let fact = |name: &str| self.same.get(name).and_then(Value::as_str);
        let device = fact("device.name")
            .map_or("different devices".into(), |name| format!("{name}, {}", fact("device.driver").unwrap_or("different drivers")));
        format!(
            "A {}\nB {}\non {device}\nRatios are of medians; `FASTER` and `SLOWER` mean that no repetition of one is as fast as any of the other.\n",
            self.files[0].display(),
            self.files[1].display()
        )
    }

    /// Formats the comparison as aligned text for a terminal.
    pub fn text(&self) -> String {
        let mut text = self.heading();
        self.tables().iter().for_each(|table| table.text(&mut text));
        text
    }

    /// Formats the comparison as Markdown.
    pub fn markdown(&self) -> String {
        let mut text = format!("# Comparison\n\n{}", self.heading().replace('\n', "  \n"));
        self.tables().iter().for_each(|table| table.markdown(&mut text));
        text
    }
}

impl Compared {
    fn new(mesh: &str, structure: &str, a: &StoredFigure, b: &StoredFigure) -> Self {
        // Both times must be from the same clock.
        let ms = match (a.device_ms, b.device_ms) {
            (Some(a), Some(b)) => [a, b],
            _ => [a.wall_ms, b.wall_ms],
        };
        let [x, y] = ms;
        Self {
            mesh: mesh.into(),
            structure: structure.into(),
            measurement: a.quantity.clone(),
            ms,
            ratio: y.median / x.median,
            ratio_range: [y.min / x.max, y.max / x.min],
            verdict: Verdict::of(ms, a.repetitions.min(b.repetitions)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Error;
    use serde_json::json;

    fn figure(quantity: &str, [min, median, max]: [f64; 3], items: Option<u64>) -> Value {
        let spread = json!({ "min": min, "median": median, "max": max });
        json!({ "quantity": quantity, "repetitions": 3, "device_ms": spread, "wall_ms": spread, "items": items })
    }

    fn report(device: &str, picture: u32, tets: u32, figures: &[Value]) -> Value {
        let structure = json!({ "name": "LBVH", "memory": { "total": 1024 * u64::from(picture) }, "figures": figures });
        let mesh = json!({ "name": "m", "tets": tets, "points": 9, "structures": [structure] });
        json!({ "version": "1", "device": { "name": device }, "settings": { "picture": picture }, "meshes": [mesh] })
    }

    fn compared(a: &Value, b: &Value) -> Comparison {
        let folder = tempfile::tempdir().unwrap();
        let paths = ["a.json", "b.json"].map(|name| folder.path().join(name));
        std::fs::write(&paths[0], a.to_string()).unwrap();
        std::fs::write(&paths[1], b.to_string()).unwrap();
        compare([&paths[0], &paths[1]]).unwrap()
    }

    #[test]
    fn ratios_and_verdicts() {
        let times = |build, locate| vec![figure("build", build, Some(7)), figure("locate_random", locate, Some(5))];
        let a = report("X", 64, 7, &times([9.0, 10.0, 11.0], [1.0, 2.0, 3.0]));
        let b = report("X", 64, 7, &times([18.0, 20.0, 22.0], [2.5, 2.6, 4.0]));
        let both = compared(&a, &b);
        assert!(both.different.is_empty() && both.incomparable.is_empty() && both.only == [Vec::<String>::new(), Vec::new()]);
        let [build, locate] = [0, 1].map(|i| &both.compared[i]);
        assert_eq!((build.ratio, build.verdict, locate.verdict), (2.0, Verdict::Slower, Verdict::WithinSpread));
        assert_eq!(build.ratio_range, [18.0 / 11.0, 22.0 / 9.0]);
        let back = compared(&b, &a);
        assert_eq!((back.compared[0].ratio, back.compared[0].verdict), (0.5, Verdict::Faster));
        for text in [both.text(), both.markdown()] {
            assert!(text.contains("SLOWER") && text.contains("2.00") && !text.contains("DIFFERS"), "{text}");
        }
        assert_eq!(Verdict::of(build.ms, 2), Verdict::Unknown);
        let mut few = a.clone();
        few["meshes"][0]["structures"][0]["figures"][0]["repetitions"] = 2.into();
        let summary = compared(&few, &b).summary();
        assert_eq!((&summary.header[6][..], &summary.rows[0][3..]), ("too few repetitions", &["0", "0", "0", "1"].map(str::to_owned)[..]));
    }

    #[test]
    fn what_differs_is_told() {
        let a = report("X", 64, 7, &[figure("intervals", [1.0; 3], None), figure("slice", [1.0; 3], Some(9))]);
        let b = report(
            "Y",
            128,
            7,
            &[figure("intervals", [1.0; 3], None), figure("slice", [1.0; 3], Some(8)), figure("march", [1.0; 3], None)],
        );
        let both = compared(&a, &b);
        assert!(both.compared.is_empty());
        assert_eq!(both.different["device.name"], [json!("X"), json!("Y")]);
        assert_eq!(both.incomparable.len(), 2);
        assert_eq!(both.only, [vec![], vec!["march, LBVH over m".to_owned()]]);
        assert_eq!(both.memory, [("m".to_owned(), "LBVH".to_owned(), [65536, 131_072])]);
        let text = both.text();
        for part in ["WHAT DIFFERS", "settings.picture", "Only in B", "Not compared", "9 items in A, 8 in B", "64² and 128²"] {
            assert!(text.contains(part), "no `{part}` in {text}");
        }
        let other = report("X", 64, 8, &[]);
        assert_eq!(compared(&a, &other).incomparable[0].0, "mesh m");
    }

    #[test]
    fn other_files_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.json");
        std::fs::write(&path, "{\n\"meshes\": 3}").unwrap();
        let error = compare([&path, &path]).unwrap_err().to_string();
        assert!(error.contains("a.json: line 2") && error.contains("olbvh bench -o"), "{error}");
        assert!(matches!(compare([Path::new("nothing.json"), &path]), Err(Error::Io { .. })));
    }
}
