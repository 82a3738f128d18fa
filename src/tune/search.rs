//! Coordinate search: one tunable after the other, each as far as it gains, until nothing gains or the time is up.

use super::profile::Gain;
use super::tunables::{TUNABLES, other_sort};
use crate::bench::Spread;
use crate::error::{Error, Result};
use crate::gpu::{Target, WorkgroupLimits};
use crate::times::StageTime;
use std::time::{Duration, Instant};

/// Number of times that are taken of a candidate and of the best so far, in turns, for a decision.
const PAIRS: usize = 7;
/// A candidate that is slower than the best by this factor in the first two turns is not timed again.
const HOPELESS: f64 = 1.25;
/// Minimum gain for a change, as a fraction of the time.
const LEAST_GAIN: f64 = 0.01;

/// The work that is tuned.
pub trait Work {
    /// Checks that a target gives the expected answers, byte for byte. It also compiles the kernels, so that no
    /// measured time includes that.
    ///
    /// # Errors
    /// [`Error::Mismatch`] for other answers, or any error of the work itself.
    fn verify(&self, target: &Target) -> Result<()>;
    /// Runs the work whose stages have names with these beginnings, and returns its times.
    ///
    /// # Errors
    /// Any error of the work itself.
    fn run(&self, target: &Target, stages: &[&str]) -> Result<Vec<StageTime>>;
}

/// A step of the search.
#[derive(Clone, Debug)]
pub enum Event {
    /// A candidate was timed.
    Tried {
        /// What was changed.
        change: String,
        /// Median time of the candidate divided by that of the best so far.
        ratio: f64,
        /// Whether the candidate is the best now.
        kept: bool,
    },
    /// A candidate was refused because it gives wrong answers or does not run.
    Refused {
        /// What was changed.
        change: String,
        /// The reason.
        why: String,
    },
}

/// The result of a search.
#[derive(Clone, Debug)]
pub struct Tuned {
    /// The best target.
    pub target: Target,
    /// Number of changes that were kept.
    pub kept: usize,
    /// Number of candidates that were timed.
    pub tried: usize,
    /// Number of candidates that were refused.
    pub refused: usize,
    /// Whether nothing was left to try when the search ended.
    pub complete: bool,
    /// Milliseconds of every stage, and of all together, before and after tuning, measured in turns at the end.
    pub gains: Vec<Gain>,
}

struct Searcher<'a> {
    work: &'a dyn Work,
    best: Target,
    kept: usize,
    tried: usize,
    refused: usize,
    begin: Instant,
    time: Duration,
    report: &'a dyn Fn(&Event, f64),
}

/// Sum of the milliseconds of the stages whose names start with `beginnings`.
fn sum(stages: &[StageTime], beginnings: &[&str]) -> f64 {
    StageTime::sum(stages.iter().filter(|s| beginnings.iter().any(|b| s.name.starts_with(b))))
}

/// Lower and upper quartile.
fn quartiles(times: &[f64]) -> [f64; 2] {
    let mut times = times.to_vec();
    times.sort_by(f64::total_cmp);
    let last = times.len().saturating_sub(1);
    [times[last / 4], times[last - last / 4]]
}

fn median(times: &[f64]) -> f64 {
    Spread::of(times.to_vec()).map_or(f64::INFINITY, |s| s.median)
}

impl Searcher<'_> {
    fn is_over(&self) -> bool {
        self.begin.elapsed() >= self.time
    }

    /// Tries a candidate and returns whether it is the best now. An error of the candidate refuses it; a lost device
    /// ends the search.
    fn attempt(&mut self, change: String, candidate: Target, stages: &[&str]) -> Result<bool> {
        let outcome = self.work.verify(&candidate).and_then(|()| self.contest(&candidate, stages));
        let event = match outcome {
            Ok((ratio, better)) => {
                self.tried += 1;
                if better {
                    self.kept += 1;
                    self.best = candidate;
                }
                Event::Tried { change, ratio, kept: better }
            }
            // After a lost device, nothing that follows would run.
            Err(error @ Error::Vulkan { result: ash::vk::Result::ERROR_DEVICE_LOST, .. }) => return Err(error),
            Err(error) => {
                self.refused += 1;
                Event::Refused { change, why: error.to_string() }
            }
        };
        (self.report)(&event, self.begin.elapsed().as_secs_f64() / self.time.as_secs_f64());
        Ok(matches!(event, Event::Tried { kept: true, .. }))
    }

    /// Races a candidate against the best; a winner must win a second race. About one candidate in 70 wins a single
    /// race by chance.
    fn contest(&self, candidate: &Target, stages: &[&str]) -> Result<(f64, bool)> {
        let first = self.race(candidate, stages)?;
        if first.1 { self.race(candidate, stages) } else { Ok(first) }
    }

    /// Times candidate and best in turns. Returns the ratio of the medians, and whether the candidate is better by more
    /// than the times vary, that is whether its upper quartile lies below the lower quartile of the best.
    fn race(&self, candidate: &Target, stages: &[&str]) -> Result<(f64, bool)> {
        let time = |target: &Target| Ok::<_, Error>(sum(&self.work.run(target, stages)?, stages));
        let (mut ours, mut theirs) = (Vec::new(), Vec::new());
        for pair in 0..PAIRS {
            // The order alternates, so that neither always meets the state that the other left behind.
            if pair % 2 == 0 {
                theirs.push(time(&self.best)?);
                ours.push(time(candidate)?);
            } else {
                ours.push(time(candidate)?);
                theirs.push(time(&self.best)?);
            }
            if pair == 1 && ours.iter().zip(&theirs).all(|(a, b)| *a > HOPELESS * b) {
                break;
            }
        }
        let ratio = median(&ours) / median(&theirs);
        let clear = ours.len() == PAIRS && quartiles(&ours)[1] < quartiles(&theirs)[0];
        Ok((ratio, clear && ratio < 1.0 - LEAST_GAIN))
    }

    /// Tries every tunable once, each as far as it gains; returns whether any did.
    fn round(&mut self, room: &WorkgroupLimits) -> Result<bool> {
        let before = self.kept;
        for tunable in &TUNABLES {
            for up in [true, false] {
                let kept = self.kept;
                while let Some(candidate) = tunable.step(&self.best, room, up) {
                    if self.is_over() {
                        return Ok(self.kept > before);
                    }
                    let change = format!("{} {} → {}", tunable.name, tunable.of(&self.best), tunable.of(&candidate));
                    if !self.attempt(change, candidate, tunable.stages)? {
                        break;
                    }
                }
                if self.kept > kept {
                    break;
                }
            }
        }
        Ok(self.kept > before)
    }
}

/// Searches from `start` on, and tries no further candidate after `time`. `report` receives every step, and the
/// fraction of the time that has passed.
///
/// # Errors
/// Any error if `start` itself gives wrong answers or does not run, and an error if the device is lost.
pub fn tune(work: &dyn Work, room: &WorkgroupLimits, start: &Target, time: Duration, report: &dyn Fn(&Event, f64)) -> Result<Tuned> {
    work.verify(start)?;
    let begin = Instant::now();
    let mut searcher = Searcher { work, best: start.clone(), kept: 0, tried: 0, refused: 0, begin, time, report };
    let kind = |serial| if serial { "serial" } else { "ballot" };
    let other = other_sort(start, room);
    if !searcher.is_over() {
        let change = format!("sort {} → {}", kind(start.sort.serial), kind(other.sort.serial));
        searcher.attempt(change, other, &["build.sort"])?;
    }
    let mut complete = false;
    while !searcher.is_over() && !complete {
        complete = !searcher.round(room)? && !searcher.is_over();
    }
    let Searcher { best, kept, tried, refused, .. } = searcher;
    let gains = if kept > 0 { gains(work, start, &best)? } else { Vec::new() };
    Ok(Tuned { target: best, kept, tried, refused, complete, gains })
}

/// Medians of every stage with both targets, measured in turns.
fn gains(work: &dyn Work, start: &Target, best: &Target) -> Result<Vec<Gain>> {
    let every = &["mesh.", "build.", "query."];
    let mut runs: [Vec<Vec<StageTime>>; 2] = [Vec::new(), Vec::new()];
    for _ in 0..PAIRS {
        runs[0].push(work.run(start, every)?);
        runs[1].push(work.run(best, every)?);
    }
    let mut names: Vec<&str> = Vec::new();
    for stage in runs.iter().flatten().flatten() {
        if !names.contains(&stage.name.as_str()) {
            names.push(&stage.name);
        }
    }
    let of = |runs: &[Vec<StageTime>], chosen: &dyn Fn(&StageTime) -> bool| {
        median(&runs.iter().map(|run| StageTime::sum(run.iter().filter(|s| chosen(s)))).collect::<Vec<f64>>())
    };
    let gain = |stage: &str, chosen: &dyn Fn(&StageTime) -> bool| Gain {
        stage: stage.into(),
        before_ms: of(&runs[0], chosen),
        after_ms: of(&runs[1], chosen),
    };
    let stages = names.iter().map(|&name| gain(name, &|s| s.name == name));
    Ok(stages.chain([gain("all", &|_| true)]).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::DeviceClass;
    use std::cell::{Cell, RefCell};

    /// A fake device that is fastest with queries of 64 and runs of 256, computes wrong results with spines of 128, and
    /// whose times vary.
    struct Fake {
        noise: f64,
        calls: Cell<u32>,
        verified: RefCell<Vec<Target>>,
    }

    impl Work for Fake {
        fn verify(&self, target: &Target) -> Result<()> {
            self.verified.borrow_mut().push(target.clone());
            if target.spine == 128 { Err(Error::Mismatch("the sums differ".into())) } else { Ok(()) }
        }

        fn run(&self, target: &Target, _: &[&str]) -> Result<Vec<StageTime>> {
            assert!(self.verified.borrow().contains(target), "timed before it was verified");
            self.calls.set(self.calls.get() + 1);
            let noise = 1.0 + self.noise * f64::from(self.calls.get() * 7919 % 101) / 101.0;
            let off = |value: u32, best: u32| (f64::from(value).log2() - f64::from(best).log2()).abs();
            let stage = |name: &str, ms: f64| StageTime { name: name.into(), milliseconds: ms * noise };
            let spine = if target.spine == 128 { 0.1 } else { 1.0 };
            Ok(vec![
                stage("query.march", 10.0 + off(target.query, 64)),
                stage("build.emit", 10.0 + off(target.run.rows, 256)),
                stage("build.count", 10.0 * spine),
                stage("build.sort", 10.0),
            ])
        }
    }

    fn run(noise: f64, time: Duration) -> (Tuned, Vec<Event>) {
        let room = WorkgroupLimits::least(32);
        let fake = Fake { noise, calls: Cell::new(0), verified: RefCell::default() };
        let events = RefCell::new(Vec::new());
        let report = |event: &Event, _: f64| events.borrow_mut().push(event.clone());
        let tuned = tune(&fake, &room, &DeviceClass::Portable.target(&room), time, &report).unwrap();
        (tuned, events.into_inner())
    }

    #[test]
    fn finds_what_is_better_and_refuses_what_is_wrong() {
        let (tuned, events) = run(0.01, Duration::from_secs(60));
        assert_eq!((tuned.target.query, tuned.target.run.rows, tuned.target.spine), (64, 256, 256));
        assert!(tuned.complete && tuned.kept >= 2 && tuned.refused > 0);
        assert!(events.iter().any(|e| matches!(e, Event::Refused { change, why } if change == "spine 256 → 128" && why.contains("sums"))));
        let all = tuned.gains.last().unwrap();
        assert!(all.stage == "all" && all.after_ms < all.before_ms, "{all:?}");
        assert_eq!(tuned.gains.len(), 5);
    }

    #[test]
    fn noise_changes_nothing() {
        let (tuned, _) = run(2.0, Duration::from_secs(60));
        let start = DeviceClass::Portable.target(&WorkgroupLimits::least(32));
        assert_eq!((tuned.kept, tuned.target), (0, start));
        assert!(tuned.gains.is_empty());
    }

    #[test]
    fn no_time_tries_nothing() {
        let (tuned, events) = run(0.01, Duration::ZERO);
        assert!(events.is_empty() && tuned.tried == 0 && !tuned.complete);
    }
}
