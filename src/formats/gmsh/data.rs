//! Reader for `$NodeData` and `$ElementData` of Gmsh files.

use super::super::TimeStep;
use super::super::array::Array;
use super::super::budget::Budget;
use super::super::loss::Loss;
use super::super::source::{Source, excerpt};
use super::super::tags::Tags;
use super::reader::Reader;
use crate::error::Result;
use crate::mesh::On;
use std::collections::{BTreeSet, HashMap};

/// Values, identified by the numbers of nodes or elements.
pub(crate) struct View {
    pub name: String,
    pub on: On,
    /// Number of the time step.
    pub step: i64,
    components: usize,
    tags: Vec<i64>,
    values: Vec<f64>,
}

impl View {
    /// Converts to an array with one value per point or cell, NaN where the file has none; `padding` limits the NaN.
    /// `Err` holds a warning: values for something that does not exist, as in renumbered meshes, are no reason to
    /// refuse the mesh.
    pub fn array(&self, tags: &Tags, count: usize, padding: &mut Budget) -> Result<Array, String> {
        let left_out = |why: String| format!("array `{}` is left out: {why}", excerpt(self.name.as_bytes()));
        if self.tags.is_empty() {
            return Err(left_out("it has no values".into()));
        }
        let what = if self.on == On::Points { "node" } else { "element" };
        let n = self.components;
        let missing = (n * count).saturating_sub(self.values.len());
        let refused = |limit: String| left_out(format!("few {what}s have a value, and NaN for the others would take {limit}"));
        padding.spend((missing * size_of::<f32>()) as u64).map_err(refused)?;
        let given: Vec<f32> = self.values.iter().map(|&v| v as f32).collect();
        let mut values = vec![f32::NAN; n * count];
        for (&tag, tuple) in self.tags.iter().zip(given.chunks_exact(n.max(1))) {
            let found = tags.get(tag).and_then(|i| values.get_mut(i as usize * n..(i as usize + 1) * n));
            let slot = found.ok_or_else(|| left_out(format!("it has a value for {what} {tag}, which does not exist")))?;
            slot.copy_from_slice(tuple);
        }
        let loss = Loss { whole: false, collapsed: Loss::collapsed(n, &given, &self.values) };
        Ok(Array { name: self.name.clone(), on: self.on, components: n, values, loss })
    }
}

/// Keeps the views of one time step, and those that the file has at one step only. If there are several steps, returns
/// remarks on that, and on the views that lack the step.
pub(crate) fn keep_step(views: &mut Vec<View>, step: TimeStep, source: &Source) -> Result<Vec<String>> {
    let mut steps_of: HashMap<(On, &str), BTreeSet<i64>> = HashMap::new();
    for view in views.iter() {
        steps_of.entry((view.on, &view.name)).or_default().insert(view.step);
    }
    let is_series = |view: &View| steps_of[&(view.on, view.name.as_str())].len() > 1;
    let mut all: Vec<String> = steps_of.values().filter(|steps| steps.len() > 1).flatten().map(i64::to_string).collect();
    all.sort_unstable();
    all.dedup();
    if all.len() < 2 {
        return Ok(Vec::new());
    }
    let chosen = step.chosen(source, &mut all)?;
    let lacks = |steps: &BTreeSet<i64>| steps.len() > 1 && !steps.iter().any(|step| step.to_string() == all[chosen]);
    let lacking = steps_of.iter().filter(|(_, steps)| lacks(steps)).map(|((_, name), _)| excerpt(name.as_bytes()));
    let mut remarks: Vec<String> = lacking.map(|name| format!("array `{name}` is left out: it has no values at this time step")).collect();
    remarks.sort_unstable();
    remarks.insert(0, TimeStep::remark(chosen, all.len()));
    let kept: Vec<bool> = views.iter().map(|view| !is_series(view) || view.step.to_string() == all[chosen]).collect();
    let mut kept = kept.into_iter();
    views.retain(|_| kept.next().unwrap_or(true));
    Ok(remarks)
}

impl Reader<'_> {
    pub(crate) fn view(&mut self, on: On, end: &[u8]) -> Result<View> {
        let at = self.tokens.at;
        let strings = self.tokens.count("the number of texts")?;
        let mut name = None;
        for _ in 0..strings {
            self.tokens.skip_space()?;
            let (line, _) = self.tokens.line()?.unwrap_or_default();
            let text = line.trim_ascii();
            let text = text.strip_prefix(b"\"").unwrap_or(text);
            let text = text.strip_suffix(b"\"").unwrap_or(text);
            name.get_or_insert_with(|| String::from_utf8_lossy(text).into_owned());
        }
        for _ in 0..self.tokens.count("the number of real tags")? {
            self.tokens.float("a real tag")?;
        }
        let mut numbers = [0, 1, 0];
        for i in 0..self.tokens.count("the number of integer tags")? {
            let number = self.tokens.integer("an integer tag")?;
            if let Some(slot) = numbers.get_mut(i) {
                *slot = number;
            }
        }
        if self.binary {
            self.tokens.line()?;
        }
        let [step, components, count] = numbers;
        let components = usize::try_from(components).ok().filter(|n| (1..=9).contains(n));
        let components = components.ok_or_else(|| self.source.error_line(at, format!("{} components, not 1 to 9", numbers[1])))?;
        let count = self.bounded(count, 4 + 8 * components, "tuples of values")?;
        let mut view = View {
            name: name.unwrap_or_else(|| "unnamed".into()),
            on,
            step,
            components,
            tags: Vec::with_capacity(count),
            values: Vec::with_capacity(count * components),
        };
        for _ in 0..count {
            view.tags.push(self.int("the number of a node or element")?);
            for _ in 0..components {
                view.values.push(self.real("a value")?);
            }
        }
        self.end(end)?;
        Ok(view)
    }
}
