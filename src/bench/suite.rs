//! What is measured: which meshes, how large the queries, for how long.

use super::measure::Budget;
use super::structure::Kind;
use crate::named::named;
use crate::options::{Assign, Lists};
use serde::Serialize;

/// A choice of meshes and sizes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Suite {
    /// Two small meshes and small queries: takes less than a minute on two cores.
    #[default]
    Quick,
    /// The paper's sizes: the meshes *Jets* and *Bar* exactly, procedural meshes of similar size and kind for the
    /// others.
    Paper,
    /// The meshes of [`Self::Paper`], and Kuhn grids from a thousand to 12.3 million tetrahedra.
    Full,
    /// Construction and location only, over Kuhn grids from a thousand to 12.3 million tetrahedra.
    Scaling,
}

impl Suite {
    /// The structures that are measured.
    pub(super) fn kinds(self) -> Vec<Kind> {
        let plain = |kind: &Kind| match kind {
            Kind::Octree { alpha, assign, lists } => *alpha == 0 && (*assign == Assign::Aabb || *lists == Lists::Boundary),
            Kind::Lbvh => true,
            Kind::Fine | Kind::Rays(_) => false,
        };
        let all = Kind::all();
        if self == Self::Scaling { all.into_iter().filter(plain).collect() } else { all }
    }

    /// The meshes of the suite, in the form that [`crate::formats::load`] takes, each preceded by the mesh of the paper
    /// that it stands for.
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
            Self::Scaling => {
                let [k1, k10, k100, k200] = ["kuhn:6,6,5", "kuhn:12,12,12", "kuhn:26,26,25", "kuhn:32,32,32"];
                let [m1, m4, m12] = ["kuhn:55,55,55", "kuhn:87,88,87", "kuhn:127,127,127"];
                vec![("1k", k1), ("10k", k10), ("100k", k100), ("200k", k200), ("1M", m1), ("4M", m4), ("12.3M", m12)]
            }
            Self::Full => sizes.map(|mesh| ("", mesh)).into_iter().chain(paper).collect(),
        }
    }
}

named!(Suite, "suite", [Quick = "quick", Paper = "paper", Full = "full", Scaling = "scaling"]);

/// Sizes of the queries, which are the same for every structure.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Settings {
    /// Number of points to locate.
    pub points: u32,
    /// Width and height of the picture in pixels; 0: no picture is drawn, and none of its samples are located.
    pub picture: u32,
    /// Voxels per row of the slice; 0: no slice.
    pub slice: u32,
    /// Whether the overlap with the moved mesh is measured.
    pub overlap: bool,
    /// Trees over meshes of up to this many tetrahedra are compared with the reference implementation, array by array.
    pub reference_tets: usize,
    /// Budget of each measurement.
    pub budget: Budget,
}

impl Settings {
    /// The settings of a suite. In the paper, pictures have 1024² pixels, slices 999² voxels, and medians 50
    /// repetitions.
    pub fn of(suite: Suite) -> Self {
        if suite == Suite::Quick {
            let budget = Budget { repetitions: 50, seconds: 0.05 };
            return Self { points: 1 << 14, picture: 96, slice: 256, overlap: true, reference_tets: 300_000, budget };
        }
        if suite == Suite::Scaling {
            let budget = Budget { repetitions: 15, seconds: 5.0 };
            return Self { points: 1 << 18, picture: 0, slice: 0, overlap: false, reference_tets: 300_000, budget };
        }
        let budget = Budget { repetitions: 50, seconds: 5.0 };
        Self { points: 1 << 20, picture: 1024, slice: 999, overlap: true, reference_tets: 300_000, budget }
    }
}
