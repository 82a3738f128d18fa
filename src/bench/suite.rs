//! What is measured: which meshes, how large the questions are, how long.

use super::Budget;
use crate::error::{Error, Result};
use serde::Serialize;

/// A choice of meshes and sizes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Suite {
    /// Two small meshes, small questions: within a minute on two cores.
    #[default]
    Quick,
    /// The paper's sizes: *Jets* and *Bar* exactly, procedural meshes of the same size and kind for the others.
    Paper,
    /// The same, and Kuhn grids from a thousand to 12.3 million tetrahedra.
    Full,
}

impl Suite {
    /// Every suite, smallest first.
    pub const ALL: [Self; 3] = [Self::Quick, Self::Paper, Self::Full];

    /// The name used on the command line and in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Quick => "quick",
            Self::Paper => "paper",
            Self::Full => "full",
        }
    }

    /// Its meshes as [`crate::formats::load`] takes them, with the mesh of the paper that each stands for.
    pub fn meshes(self) -> Vec<(&'static str, &'static str)> {
        let paper = [
            ("Bar", "kuhn:32,32,80"),
            ("as Dragon", "graded:52"),
            ("as Part", "shell:302"),
            ("as Cube", "kuhn:63,63,63,jitter=0.3"),
            ("as Fusion", "slivers:79"),
            ("as Pot", "shell:578"),
            ("Jets", "kuhn:127,127,127"),
        ];
        let sizes = ["kuhn:6,6,6", "kuhn:12,12,12", "kuhn:25,25,25", "kuhn:40,40,40", "kuhn:63,63,63", "kuhn:80,80,80", "kuhn:100,100,100"];
        match self {
            Self::Quick => vec![("", "kuhn:31,31,31"), ("", "graded:16")],
            Self::Paper => paper.to_vec(),
            Self::Full => sizes.map(|mesh| ("", mesh)).into_iter().chain(paper).collect(),
        }
    }
}

impl std::str::FromStr for Suite {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        let found = Self::ALL.into_iter().find(|s| s.name().eq_ignore_ascii_case(name));
        found.ok_or_else(|| Error::Invalid(format!("unknown suite `{name}`; known are quick, paper, full")))
    }
}

/// Sizes of the questions, the same for every structure.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Settings {
    /// Points to locate.
    pub points: u32,
    /// Width and height of the picture.
    pub picture: u32,
    /// Voxels of a row of the slice.
    pub slice: u32,
    /// Trees over meshes up to this size are compared with the reference, array by array.
    pub reference_tets: usize,
    /// Per measurement.
    pub budget: Budget,
}

impl Settings {
    /// Those of a suite; the paper's pictures have 1024² pixels, its slices 999² voxels, its medians 50 repetitions.
    pub fn of(suite: Suite) -> Self {
        if suite == Suite::Quick {
            let budget = Budget { repetitions: 50, seconds: 0.05 };
            return Self { points: 1 << 14, picture: 96, slice: 256, reference_tets: 300_000, budget };
        }
        let budget = Budget { repetitions: 50, seconds: 5.0 };
        Self { points: 1 << 20, picture: 1024, slice: 999, reference_tets: 300_000, budget }
    }
}
