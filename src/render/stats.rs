//! What it took to draw a picture.

use std::ops::AddAssign;

/// Numbers of samples of a picture, and the time that they took.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RenderStats {
    /// Number of samples taken.
    pub samples: u64,
    /// Samples within the ray intervals that were skipped, since nothing is visible in their nodes.
    pub skipped_samples: u64,
    /// Number of samples taken that lie in the mesh.
    pub found_samples: u64,
    /// Milliseconds for the field's ranges and the marks of visible nodes, if some values are transparent.
    pub ranges_ms: f64,
    /// Milliseconds for the ray intervals.
    pub interval_ms: f64,
    /// Milliseconds for the march.
    pub march_ms: f64,
    /// Number of submissions that the march took; 0 on the CPU.
    pub submissions: u32,
}

impl AddAssign for RenderStats {
    fn add_assign(&mut self, other: Self) {
        let Self { samples, skipped_samples, found_samples, ranges_ms, interval_ms, march_ms, submissions } = other;
        self.samples += samples;
        self.skipped_samples += skipped_samples;
        self.found_samples += found_samples;
        self.ranges_ms += ranges_ms;
        self.interval_ms += interval_ms;
        self.march_ms += march_ms;
        self.submissions += submissions;
    }
}
