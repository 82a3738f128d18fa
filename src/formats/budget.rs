//! Limit of the memory that a file may demand beyond its own size.

use super::LoadOptions;

/// The number of bytes that may still be allocated for a file.
#[derive(Clone, Default)]
pub(crate) struct Budget {
    left: u64,
    expansion: u64,
}

impl Budget {
    /// The budget for a file of `bytes` bytes.
    pub fn new(bytes: usize, options: &LoadOptions) -> Self {
        let left = options.expansion.saturating_mul(bytes as u64).saturating_add(64 << 20);
        Self { left, expansion: options.expansion }
    }

    /// Spends `bytes`; returns an error that states the limit if fewer are left.
    pub fn spend(&mut self, bytes: u64) -> Result<(), String> {
        self.left = self.left.checked_sub(bytes).ok_or_else(|| format!("more than {} times the size of the file", self.expansion))?;
        Ok(())
    }
}
