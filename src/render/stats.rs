//! What a picture was drawn from.

use std::ops::AddAssign;

/// Numbers of samples of a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RenderStats {
    /// Number of samples taken.
    pub samples: u64,
    /// Samples within the ray intervals that were skipped, since nothing is visible in their nodes.
    pub skipped_samples: u64,
    /// Number of samples taken that lie in the mesh.
    pub found_samples: u64,
}

impl AddAssign for RenderStats {
    fn add_assign(&mut self, other: Self) {
        let Self { samples, skipped_samples, found_samples } = other;
        self.samples += samples;
        self.skipped_samples += skipped_samples;
        self.found_samples += found_samples;
    }
}
