//! The parameters that can be changed.

use crate::gpu::{DeviceClass, Target, WorkgroupLimits};

/// One parameter of a [`Target`].
pub struct Tunable {
    /// Name, as in a profile.
    pub name: &'static str,
    /// Description.
    pub about: &'static str,
    /// Prefixes of the names of the stages that it affects; their times decide.
    pub stages: &'static [&'static str],
    /// Values to try, ascending.
    pub values: &'static [u32],
    get: fn(&Target) -> u32,
    set: fn(&mut Target, u32),
}

const GROUPS: &[u32] = &[4, 8, 16, 32, 64, 128, 256, 512, 1024];
const ROWS: &[u32] = &[12, 16, 24, 32, 64, 128, 256, 512, 1024];
/// Stages that contain a scan or a sort.
const SCANS: &[&str] = &["build.count", "build.filter", "build.sort", "build.count_splits"];
const RUNS: &[&str] = &["build.emit", "build.count_splits", "build.splits", "build.leaves"];
const EACH: &[&str] = &["mesh.", "build.depth", "build.count", "build.filter", "build.emit", "build.leaves", "build.levels"];

/// Every tunable except the kind of sort, the most important ones first.
pub static TUNABLES: [Tunable; 10] = [
    Tunable {
        name: "sort.rows",
        about: "sort: pairs per invocation",
        stages: &["build.sort"],
        values: &[4, 8, 12, 15, 16, 24, 32, 1024, 2048, 4096, 8192, 16384],
        get: |t| t.sort.rows,
        set: |t, v| t.sort.rows = v,
    },
    Tunable {
        name: "sort.digit_bits",
        about: "sort: most bits per digit",
        stages: &["build.sort"],
        values: &[4, 5, 6, 7, 8, 9, 10, 11, 12],
        get: |t| t.sort.digit_bits,
        set: |t, v| t.sort.digit_bits = v,
    },
    Tunable {
        name: "sort.workgroup",
        about: "sort: invocations per workgroup",
        stages: &["build.sort"],
        values: GROUPS,
        get: |t| t.sort.workgroup,
        set: |t, v| t.sort.workgroup = v,
    },
    Tunable {
        name: "query",
        about: "queries: invocations per workgroup",
        stages: &["query."],
        values: GROUPS,
        get: |t| t.query,
        set: |t, v| t.query = v,
    },
    Tunable {
        name: "run.rows",
        about: "construction: entries that an invocation passes",
        stages: RUNS,
        values: ROWS,
        get: |t| t.run.rows,
        set: |t, v| t.run.rows = v,
    },
    Tunable {
        name: "run.workgroup",
        about: "construction by runs: invocations per workgroup",
        stages: RUNS,
        values: GROUPS,
        get: |t| t.run.workgroup,
        set: |t, v| t.run.workgroup = v,
    },
    Tunable {
        name: "each",
        about: "construction, an item per invocation: invocations per workgroup",
        stages: EACH,
        values: GROUPS,
        get: |t| t.each,
        set: |t, v| t.each = v,
    },
    Tunable {
        name: "scan.rows",
        about: "scan: values per invocation",
        stages: SCANS,
        values: &[4, 8, 12, 16, 24, 32, 64, 128, 256, 512, 1024, 2048],
        get: |t| t.scan.rows,
        set: |t, v| t.scan.rows = v,
    },
    Tunable {
        name: "scan.workgroup",
        about: "scan: invocations per workgroup",
        stages: SCANS,
        values: GROUPS,
        get: |t| t.scan.workgroup,
        set: |t, v| t.scan.workgroup = v,
    },
    Tunable {
        name: "spine",
        about: "scan: invocations of the workgroup that scans the sums",
        stages: SCANS,
        values: GROUPS,
        get: |t| t.spine,
        set: |t, v| t.spine = v,
    },
];

impl Tunable {
    /// Value of the parameter in a target.
    pub fn of(&self, target: &Target) -> u32 {
        (self.get)(target)
    }

    /// The target with the next value, above or below, that the device has room for; `None` if there is none.
    pub(super) fn step(&self, target: &Target, room: &WorkgroupLimits, up: bool) -> Option<Target> {
        let now = self.of(target);
        let usable = |&value: &u32| {
            let mut next = target.clone();
            (self.set)(&mut next, value);
            (next.check(room).is_ok() && next.check_scale().is_ok()).then_some(next)
        };
        if up {
            self.values.iter().filter(|&&v| v > now).find_map(usable)
        } else {
            self.values.iter().rev().filter(|&&v| v < now).find_map(usable)
        }
    }
}

/// The target with the other kind of sort, with the parameters of the best known row of that kind.
pub(super) fn other_sort(target: &Target, room: &WorkgroupLimits) -> Target {
    let row = if target.sort.serial { DeviceClass::Portable } else { DeviceClass::Cpu };
    Target { sort: row.target(room).sort, ..target.clone() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_stay_within_the_room() {
        for subgroup in [4, 8, 32, 64, 128] {
            let room = WorkgroupLimits::least(subgroup);
            for row in DeviceClass::EVERY {
                let target = row.target(&room);
                for tunable in &TUNABLES {
                    for up in [false, true] {
                        let mut at = target.clone();
                        let mut steps = 0;
                        while let Some(next) = tunable.step(&at, &room, up) {
                            assert!(if up { tunable.of(&next) > tunable.of(&at) } else { tunable.of(&next) < tunable.of(&at) });
                            next.check(&room).unwrap();
                            at = next;
                            steps += 1;
                        }
                        assert!(steps <= tunable.values.len());
                    }
                }
                let other = other_sort(&target, &room);
                assert_ne!(other.sort.serial, target.sort.serial);
                other.check(&room).unwrap();
            }
        }
    }
}
