//! Arrays of files, and the names of the fields made from them.

use std::collections::{HashMap, HashSet};

use super::budget::Budget;
use super::loss::{Loss, MOST_COMPONENTS};
use crate::mesh::{Field, On};

/// An array of a file: `components` values per point or per cell of the file.
pub(crate) struct Array {
    pub name: String,
    pub on: On,
    pub components: usize,
    pub values: Vec<f32>,
    pub loss: Loss,
}

impl Array {
    /// An array of values that become single.
    pub fn rounded(name: String, on: On, components: usize, exact: &[f64]) -> Self {
        let values: Vec<f32> = exact.iter().map(|&v| v as f32).collect();
        let loss = Loss { whole: false, collapsed: Loss::collapsed(components, &values, exact) };
        Self { name, on, components, values, loss }
    }

    /// An array of whole numbers, which become single.
    pub fn whole(name: String, on: On, exact: &[f64]) -> Self {
        let mut array = Self::rounded(name, on, 1, exact);
        array.loss.whole = true;
        array
    }

    /// The name of the field of a component.
    pub fn name_of(&self, component: usize) -> String {
        let suffixes = self.suffixes();
        format!("{}{}", self.name, suffixes[suffixes.len() - self.components + component])
    }

    /// Fills the array with NaN up to `tuples` tuples if it is shorter. Returns an error that states the limit if the
    /// budget does not allow that.
    pub fn fill(&mut self, tuples: usize, budget: &mut Budget) -> Result<(), String> {
        let wanted = tuples * self.components;
        let missing = wanted.saturating_sub(self.values.len());
        budget.spend((missing * size_of::<f32>()) as u64)?;
        if missing > 0 {
            self.values.resize(wanted, f32::NAN);
        }
        Ok(())
    }

    /// The values of a point or cell; empty if the array has none for it.
    pub fn tuple(&self, i: usize) -> &[f32] {
        self.values.get(i * self.components..(i + 1) * self.components).unwrap_or_default()
    }

    /// Copies the values of `from` to `to`, an earlier point or cell, if that has none.
    pub fn complete(&mut self, to: usize, from: usize) {
        if !self.tuple(from).is_empty() && self.tuple(to).iter().all(|v| v.is_nan()) {
            self.values.copy_within(from * self.components..(from + 1) * self.components, to * self.components);
        }
    }

    /// Suffixes that are appended to the array's name to name its fields.
    pub fn suffixes(&self) -> &'static [&'static str] {
        suffixes(self.components)
    }
}

/// Suffixes of the fields that an array becomes: its components, and before those of a vector, its length.
pub(crate) fn suffixes(components: usize) -> &'static [&'static str] {
    match components {
        1 => &[""],
        3 => &["", ".x", ".y", ".z"],
        n => &[".0", ".1", ".2", ".3", ".4", ".5", ".6", ".7", ".8"][..n.min(MOST_COMPONENTS)],
    }
}

/// Length of a vector.
pub(crate) fn length(v: impl IntoIterator<Item = f32>) -> f32 {
    v.into_iter().map(|x| f64::from(x) * f64::from(x)).sum::<f64>().sqrt() as f32
}

/// The array whose fields begin at the first of `fields`: its name, and the fields of its components. Reverses how arrays
/// become fields.
pub(crate) fn gathered(fields: &[Field]) -> Option<(&str, &[Field])> {
    let first = fields.first()?;
    let named = |base: &str, suffixes: &[&str]| {
        let mut pairs = fields.iter().zip(suffixes);
        fields.len() >= suffixes.len() && pairs.all(|(f, suffix)| f.on == first.on && f.name.strip_prefix(base) == Some(suffix))
    };
    let of = |components: usize| {
        let suffixes = suffixes(components);
        let base = first.name.strip_suffix(suffixes[0]).filter(|base| named(base, suffixes))?;
        let parts = &fields[suffixes.len() - components..suffixes.len()];
        let is_length = |(i, &v): (usize, &f32)| {
            let of_parts = length(parts.iter().map(|part| part.values.get(i).copied().unwrap_or(f32::NAN)));
            v == of_parts || v.is_nan() && of_parts.is_nan()
        };
        (components != 3 || first.values.iter().enumerate().all(is_length)).then_some((base, parts))
    };
    (2..=MOST_COMPONENTS).rev().chain([1]).find_map(of)
}

/// The fields of a mesh but for those that follow from others: the lengths of vectors.
pub fn without_lengths(mut fields: &[Field]) -> Vec<&Field> {
    let mut kept = Vec::new();
    while let Some((_, parts)) = gathered(fields) {
        kept.extend(parts);
        fields = &fields[suffixes(parts.len()).len()..];
    }
    kept
}

/// The names that are taken by fields.
#[derive(Default)]
pub(crate) struct Names {
    taken: HashSet<String>,
    /// How many alternatives were tried for a name, so that many arrays of the same name do not try the same ones
    /// again.
    tried: HashMap<(String, On), usize>,
}

impl Names {
    /// A free name for an array: its own, unless one of the fields that it becomes would have a name that is taken.
    pub fn free(&mut self, array: &Array) -> String {
        let fields = |name: &str| array.suffixes().iter().map(|suffix| format!("{name}{suffix}")).collect::<Vec<_>>();
        let mut name = array.name.clone();
        while fields(&name).iter().any(|field| self.taken.contains(field)) {
            let word = if array.on == On::Cells { "cells" } else { "again" };
            let tried = self.tried.entry((array.name.clone(), array.on)).or_default();
            *tried += 1;
            name = if *tried == 1 { format!("{} ({word})", array.name) } else { format!("{} ({word} {tried})", array.name) };
        }
        self.taken.extend(fields(&name));
        name
    }
}
