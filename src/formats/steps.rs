//! Series of time steps, of which one is read.

use std::collections::HashSet;

use super::source::Source;
use crate::error::{Error, Result};

/// A time step of a series. `FromStr` takes a number or `last`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TimeStep {
    /// The step with this number, counted from 0 in ascending order.
    Number(u32),
    /// The last step.
    Last,
}

impl TimeStep {
    /// The number of this step among those of a file, which become ascending; 0 if there is only one, or none.
    pub(super) fn chosen<S: AsRef<str>>(self, source: &Source, steps: &mut [S]) -> Result<usize> {
        steps.sort_by(|a, b| {
            let [a, b] = [a, b].map(|time| time.as_ref().trim().parse().unwrap_or(f64::NAN));
            a.total_cmp(&b)
        });
        self.of(source, steps.len())
    }

    /// The number of this step among so many; 0 if there is only one, or none.
    pub(super) fn of(self, source: &Source, count: usize) -> Result<usize> {
        let last = count.saturating_sub(1);
        match self {
            Self::Number(n) if last > 0 && n as usize > last => {
                Err(source.error(format!("there is no time step {n}; the steps are 0 to {last}")))
            }
            Self::Number(n) => Ok((n as usize).min(last)),
            Self::Last => Ok(last),
        }
    }

    /// A warning that there are several steps, of which one is read.
    pub(super) fn remark(read: usize, count: usize) -> String {
        format!("time step {read} of 0 to {} is read; --time-step (LoadOptions::step) chooses another, such as `last`", count - 1)
    }
}

impl std::fmt::Display for TimeStep {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Number(n) => n.fmt(f),
            Self::Last => f.write_str("last"),
        }
    }
}

impl std::str::FromStr for TimeStep {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        if text.eq_ignore_ascii_case("last") {
            return Ok(Self::Last);
        }
        text.parse().map(Self::Number).map_err(|_| Error::Invalid(format!("`{text}` is no time step: a number from 0, or last")))
    }
}

/// The time steps of a file. VTK writes several into one file on demand: arrays of each follow each other, and those
/// that stay the same name several.
#[derive(Default)]
pub(super) struct Steps {
    /// The one that is read; `None`: the first that the file names.
    wanted: Option<String>,
    pub all: Vec<String>,
    seen: HashSet<String>,
}

impl Steps {
    pub fn of(wanted: Option<String>) -> Self {
        Self { wanted, ..Self::default() }
    }

    /// Whether an array of these steps, numbers separated by spaces, belongs to the one that is read.
    pub fn are_wanted(&mut self, of: &str) -> bool {
        let steps = || of.split_ascii_whitespace();
        self.all.extend(steps().filter(|&step| self.seen.insert(step.to_owned())).map(str::to_owned));
        let wanted = self.wanted.get_or_insert_with(|| steps().next().unwrap_or("").to_owned());
        steps().any(|step| step == wanted)
    }
}
