//! What owning calls took.

use std::fmt;

/// Device time of a stage.
#[derive(Clone, Debug, PartialEq)]
pub struct StageTime {
    /// Name of the stage.
    pub name: String,
    /// Milliseconds between the timestamps at its start and end.
    pub milliseconds: f64,
}

impl StageTime {
    /// Sum of the milliseconds of these stages.
    pub fn sum<'a>(stages: impl IntoIterator<Item = &'a Self>) -> f64 {
        stages.into_iter().map(|s| s.milliseconds).sum()
    }
}

/// Times of the stages of one or more submissions.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StageTimes {
    /// Each stage once, in the order in which the stages first ended. Empty if the queue does not support timestamps.
    pub stages: Vec<StageTime>,
    /// Number of submissions, transfers not included; 0 on the CPU.
    pub submissions: u32,
}

impl StageTimes {
    /// Milliseconds of the stage of this name, 0 without one.
    pub fn milliseconds(&self, name: &str) -> f64 {
        StageTime::sum(self.stages.iter().filter(|s| s.name == name))
    }

    /// Sum of the milliseconds of all stages.
    pub fn total(&self) -> f64 {
        StageTime::sum(&self.stages)
    }

    /// Adds the time of a stage.
    pub fn add_stage(&mut self, time: StageTime) {
        match self.stages.iter_mut().find(|s| s.name == time.name) {
            Some(stage) => stage.milliseconds += time.milliseconds,
            None => self.stages.push(time),
        }
    }

    /// Adds the times of further submissions.
    pub fn add(&mut self, more: Self) {
        more.stages.into_iter().for_each(|time| self.add_stage(time));
        self.submissions += more.submissions;
    }
}

impl fmt::Display for StageTimes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for StageTime { name, milliseconds } in &self.stages {
            write!(f, "{name} {milliseconds:.1} ms, ")?;
        }
        write!(f, "{} submissions", self.submissions)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stages_of_several_submissions_are_added_by_name() {
        let of = |names: &[(&str, f64)]| {
            let mut times = StageTimes { submissions: 1, ..StageTimes::default() };
            names.iter().for_each(|&(name, milliseconds)| times.add_stage(StageTime { name: name.into(), milliseconds }));
            times
        };
        let mut all = of(&[("a", 1.0), ("b", 2.0), ("a", 4.0)]);
        all.add(of(&[("c", 8.0), ("b", 16.0)]));
        assert_eq!(all.to_string(), "a 5.0 ms, b 18.0 ms, c 8.0 ms, 2 submissions");
        assert_eq!((all.total(), all.milliseconds("b"), all.milliseconds("d")), (31.0, 18.0, 0.0));
    }
}
