//! Accounting of buffer memory against a limit.

use std::sync::atomic::{AtomicU64, Ordering};

/// The bytes that the buffers of a [`super::Gpu`] take together, and their limit.
#[derive(Debug)]
pub(super) struct Ledger {
    limit: u64,
    used: AtomicU64,
    peak: AtomicU64,
}

impl Ledger {
    pub(super) fn new(limit: u64) -> Self {
        Self { limit, used: AtomicU64::new(0), peak: AtomicU64::new(0) }
    }

    pub(super) fn limit(&self) -> u64 {
        self.limit
    }

    pub(super) fn left(&self) -> u64 {
        self.limit - self.used.load(Ordering::Relaxed).min(self.limit)
    }

    pub(super) fn peak(&self) -> u64 {
        self.peak.load(Ordering::Relaxed)
    }

    /// Adds `bytes` to the total; if that would exceed the limit, returns the bytes in use as the error.
    pub(super) fn claim(&self, bytes: u64) -> Result<(), u64> {
        let more = |used: u64| used.checked_add(bytes).filter(|&sum| sum <= self.limit);
        let before = self.used.fetch_update(Ordering::Relaxed, Ordering::Relaxed, more)?;
        self.peak.fetch_max(before + bytes, Ordering::Relaxed);
        Ok(())
    }

    /// Subtracts `bytes` from the total.
    pub(super) fn release(&self, bytes: u64) {
        self.used.fetch_sub(bytes, Ordering::Relaxed);
    }
}
