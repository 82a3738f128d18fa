//! Repetitions of a measurement and their times.

use super::load::Load;
use crate::error::Result;
use crate::times::{StageTime, StageTimes};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::time::Instant;

/// How often and how long one measurement is repeated: until either limit is reached, but at least once.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Budget {
    /// Maximum number of repetitions.
    pub repetitions: u32,
    /// Time in seconds after which no further repetition starts.
    pub seconds: f64,
}

/// The smallest, median and largest of some times, in milliseconds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    /// Smallest.
    pub min: f64,
    /// Median; for an even number of times the mean of the middle two.
    pub median: f64,
    /// Largest.
    pub max: f64,
}

impl Spread {
    /// The spread of some times; `None` if there are none.
    pub(crate) fn of(mut times: Vec<f64>) -> Option<Self> {
        times.sort_by(f64::total_cmp);
        let middle = times.len() / 2;
        let (min, max, upper) = (*times.first()?, *times.last()?, *times.get(middle)?);
        let median = if times.len().is_multiple_of(2) { f64::midpoint(times[middle - 1], upper) } else { upper };
        Some(Self { min, median, max })
    }
}

/// Times of a measurement.
#[derive(Clone, Debug, Serialize)]
pub struct Timing {
    /// Number of repetitions.
    pub repetitions: u32,
    /// Time between timestamps on the device; `None` if its queue has no timestamps.
    pub device_ms: Option<Spread>,
    /// Time of the whole call on the host, transfers included.
    pub wall_ms: Spread,
    /// Medians of the stages on the device, in milliseconds.
    pub stages_ms: BTreeMap<String, f64>,
}

impl Timing {
    /// The median in milliseconds: on the device if known, otherwise on the host.
    pub fn milliseconds(&self) -> f64 {
        self.device_ms.unwrap_or(self.wall_ms).median
    }
}

/// Raw times of repetitions.
#[derive(Clone, Debug, Default)]
pub(super) struct Runs {
    walls: Vec<f64>,
    device: Vec<StageTimes>,
}

impl Runs {
    pub(super) fn is_empty(&self) -> bool {
        self.walls.is_empty()
    }

    /// The times of one stage, or of all stages together.
    pub(super) fn timing(&self, stage: Option<&str>) -> Timing {
        let chosen = |s: &&StageTime| stage.is_none_or(|name| s.name == name);
        let sums = self.device.iter().map(|run| StageTime::sum(run.stages.iter().filter(chosen)));
        let mut by_name: BTreeMap<String, Vec<f64>> = BTreeMap::new();
        for (i, run) in self.device.iter().enumerate() {
            for s in run.stages.iter().filter(chosen) {
                let times = by_name.entry(s.name.clone()).or_default();
                times.resize(self.device.len(), 0.0);
                times[i] = s.milliseconds;
            }
        }
        let none = Spread { min: 0.0, median: 0.0, max: 0.0 };
        Timing {
            repetitions: self.walls.len() as u32,
            device_ms: Spread::of(sums.collect()).filter(|s| s.max > 0.0),
            wall_ms: Spread::of(self.walls.clone()).unwrap_or(none),
            stages_ms: by_name.into_iter().filter_map(|(name, times)| Some((name, Spread::of(times)?.median))).collect(),
        }
    }
}

/// Repeats `once`, which returns what it took, within a budget. The caller has run the same work before, so
/// that no repetition includes the costs of a first run. `load` keeps the device at its clock before each repetition.
pub(super) fn repeat(load: &Load, budget: &Budget, mut once: impl FnMut() -> Result<StageTimes>) -> Result<Runs> {
    let (start, mut runs) = (Instant::now(), Runs::default());
    while runs.is_empty() || (runs.walls.len() < budget.repetitions as usize && start.elapsed().as_secs_f64() < budget.seconds) {
        load.run()?;
        let begin = Instant::now();
        let times = once()?;
        runs.walls.push(begin.elapsed().as_secs_f64() * 1e3);
        runs.device.push(times);
    }
    Ok(runs)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians_and_sums() {
        let times = [4.0, 1.0, 3.0, 10.0];
        assert_eq!(Spread::of(times.to_vec()), Some(Spread { min: 1.0, median: 3.5, max: 10.0 }));
        assert_eq!(Spread::of(times[..3].to_vec()).map(|s| s.median), Some(3.0));
        let mut next = times.iter();
        let once = || {
            let stage = |name: &str, milliseconds| StageTime { name: name.into(), milliseconds };
            Ok(StageTimes { stages: vec![stage("a", *next.next().unwrap()), stage("b", 2.0)], submissions: 1 })
        };
        let runs = repeat(&Load::none(), &Budget { repetitions: 3, seconds: 10.0 }, once).unwrap();
        let all = runs.timing(None);
        assert_eq!((all.repetitions, all.device_ms.unwrap().median, all.stages_ms["b"]), (3, 5.0, 2.0));
        assert_eq!(runs.timing(Some("a")).milliseconds(), 3.0);
        let none = repeat(&Load::none(), &Budget { repetitions: 9, seconds: 0.0 }, || Ok(StageTimes::default())).unwrap().timing(None);
        assert!(none.repetitions == 1 && none.device_ms.is_none());
    }
}
