//! What a failing case reports.

use crate::error::Error;
use std::fmt::Debug;

/// The first difference between the device and the reference implementation.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Failure {
    /// Stage or kernel that wrote the array.
    pub stage: String,
    /// Name of the array.
    pub array: String,
    /// First index that differs; `None` if the failure does not concern an element.
    pub index: Option<u64>,
    /// Value of the reference implementation.
    pub expected: String,
    /// Value of the device.
    pub found: String,
}

/// Why a case ends early.
#[derive(Debug)]
pub(crate) enum Stop {
    /// The results differ.
    Failed(Failure),
    /// The device cannot hold the case.
    Skipped(String),
}

/// Result of a step of a case.
pub(crate) type Verdict<T = ()> = Result<T, Stop>;

impl std::fmt::Display for Failure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: {}", self.stage, self.array)?;
        if let Some(i) = self.index {
            write!(f, "[{i}]")?;
        }
        write!(f, ": expected {}, found {}", self.expected, self.found)
    }
}

impl From<Error> for Stop {
    fn from(error: Error) -> Self {
        match error {
            Error::Memory { .. } | Error::TooLarge(_) => Self::Skipped(error.to_string()),
            _ => fail("run", "result", None, "success", &error.to_string()),
        }
    }
}

/// Makes a failure.
pub(crate) fn fail(stage: &str, array: &str, index: Option<usize>, expected: &str, found: &str) -> Stop {
    let index = index.map(|i| i as u64);
    Stop::Failed(Failure { stage: stage.into(), array: array.into(), index, expected: expected.into(), found: found.into() })
}

/// Compares an array of the device with that of the reference implementation.
pub(crate) fn compare<T: PartialEq + Debug>(stage: &str, array: &str, expected: &[T], found: &[T]) -> Verdict {
    if let Some(i) = expected.iter().zip(found).position(|(e, f)| e != f) {
        return Err(fail(stage, array, Some(i), &format!("{:?}", expected[i]), &format!("{:?}", found[i])));
    }
    if expected.len() != found.len() {
        return Err(fail(stage, &format!("{array}.len()"), None, &expected.len().to_string(), &found.len().to_string()));
    }
    Ok(())
}

/// Compares one value with that of the reference implementation.
pub(crate) fn compare_one<T: PartialEq + Debug>(stage: &str, what: &str, expected: &T, found: &T) -> Verdict {
    if expected == found { Ok(()) } else { Err(fail(stage, what, None, &format!("{expected:?}"), &format!("{found:?}"))) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(verdict: Verdict) -> String {
        match verdict {
            Err(Stop::Failed(f)) => f.to_string(),
            other => format!("{other:?}"),
        }
    }

    #[test]
    fn a_failure_names_stage_array_index_and_values() {
        assert_eq!(text(compare("build.splits", "PO", &[0, 1, 2], &[0, 7, 2])), "build.splits: PO[1]: expected 1, found 7");
        assert_eq!(text(compare("build.splits", "PO", &[0, 1], &[0])), "build.splits: PO.len(): expected 2, found 1");
        assert!(compare("build.splits", "PO", &[0, 1], &[0, 1]).is_ok());
        assert_eq!(text(compare_one("build.depth", "level", &3, &4)), "build.depth: level: expected 3, found 4");
    }
}
