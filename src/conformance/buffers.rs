//! Device memory with guard words behind it.

use super::failure::{Verdict, fail};
use crate::gpu::{Buffer, BufferRef, Gpu};

/// What memory holds before a case writes to it: no index, no count, not a likely sum.
pub(crate) const FILL: u32 = 0xa5c3_9e17;
/// Words behind every buffer that nobody may touch.
const GUARD: usize = 64;

/// Words in device memory, and behind them a guard.
pub(crate) struct Guarded {
    buffer: Buffer,
    words: usize,
    name: &'static str,
}

impl Guarded {
    /// `words` words: the data, then [`FILL`].
    pub(crate) fn new(gpu: &Gpu, name: &'static str, data: &[u32], words: usize) -> Verdict<Self> {
        let mut content = Vec::with_capacity(words.max(data.len()) + GUARD);
        content.extend_from_slice(data);
        content.resize(words.max(data.len()) + GUARD, FILL);
        Ok(Self { buffer: gpu.upload(name, &content)?, words: words.max(data.len()), name })
    }

    /// As many bytes, rounded up to words, of scratch memory.
    pub(crate) fn scratch(gpu: &Gpu, name: &'static str, bytes: u64) -> Verdict<Self> {
        Self::new(gpu, name, &[], bytes.div_ceil(4) as usize)
    }

    /// Without the guard.
    pub(crate) fn all(&self) -> BufferRef {
        self.buffer.all().part(0, 4 * self.words as u64)
    }

    /// The words; whoever wrote behind them fails.
    pub(crate) fn read(&self, gpu: &Gpu, stage: &str) -> Verdict<Vec<u32>> {
        let mut content: Vec<u32> = gpu.download(&self.buffer, self.buffer.all())?;
        if let Some(i) = content[self.words..].iter().position(|&w| w != FILL) {
            let found = format!("{:#x}", content[self.words + i]);
            return Err(fail(
                stage,
                &format!("{} (guard behind {} words)", self.name, self.words),
                Some(self.words + i),
                "untouched",
                &found,
            ));
        }
        content.truncate(self.words);
        Ok(content)
    }
}

/// The first words of a part, from the words of its memory.
pub(crate) fn part(content: &[u32], part: BufferRef, words: usize) -> &[u32] {
    let begin = (part.offset / 4) as usize;
    content.get(begin..begin + words).unwrap_or_default()
}
