//! Device memory with guard words after it.

use super::failure::{Verdict, fail};
use crate::gpu::{Buffer, BufferRef, Gpu};

/// Value that memory holds before a case writes to it: unlikely as an index, a count or a sum.
pub(crate) const FILL: u32 = 0xa5c3_9e17;
/// Number of guard words after every buffer, which no kernel may write.
const GUARD: usize = 64;

/// Words in device memory, followed by a guard.
pub(crate) struct Guarded {
    buffer: Buffer,
    words: usize,
    name: &'static str,
}

impl Guarded {
    /// A buffer of `words` words: the data, then [`FILL`].
    pub(crate) fn new(gpu: &Gpu, name: &'static str, data: &[u32], words: usize) -> Verdict<Self> {
        let mut content = Vec::with_capacity(words.max(data.len()) + GUARD);
        content.extend_from_slice(data);
        content.resize(words.max(data.len()) + GUARD, FILL);
        Ok(Self { buffer: gpu.upload(name, &content)?, words: words.max(data.len()), name })
    }

    /// Scratch memory of this many bytes, rounded up to words. The device fills it, since it may be large.
    pub(crate) fn scratch(gpu: &Gpu, name: &'static str, bytes: u64) -> Verdict<Self> {
        let words = bytes.div_ceil(4);
        let buffer = gpu.buffer(name, 4 * (words + GUARD as u64))?;
        gpu.submit("olbvh.conformance.fill", |r| {
            r.fill(buffer.all(), FILL);
            Ok(())
        })?;
        Ok(Self { buffer, words: words as usize, name })
    }

    /// The buffer without its guard.
    pub(crate) fn all(&self) -> BufferRef {
        self.buffer.all().part(0, 4 * self.words as u64)
    }

    /// Reads the words; fails if the guard has been overwritten.
    pub(crate) fn read(&self, gpu: &Gpu, stage: &str) -> Verdict<Vec<u32>> {
        self.check_guard(gpu, stage)?;
        Ok(gpu.download(&self.buffer, self.all())?)
    }

    /// Reads the first words of a part; unlike [`Guarded::read`], it does not look at the guard.
    pub(crate) fn read_part(&self, gpu: &Gpu, part: BufferRef, words: usize) -> Verdict<Vec<u32>> {
        Ok(gpu.download(&self.buffer, part.part(0, 4 * words as u64))?)
    }

    /// Fails if the guard has been overwritten.
    pub(crate) fn check_guard(&self, gpu: &Gpu, stage: &str) -> Verdict {
        let guard: Vec<u32> = gpu.download(&self.buffer, self.buffer.all().part(4 * self.words as u64, 4 * GUARD as u64))?;
        let Some(i) = guard.iter().position(|&w| w != FILL) else { return Ok(()) };
        let array = format!("{} (guard after {} words)", self.name, self.words);
        Err(fail(stage, &array, Some(self.words + i), "untouched", &format!("{:#x}", guard[i])))
    }
}

/// The first words of a part; `content` holds all words of its memory.
pub(crate) fn part(content: &[u32], part: BufferRef, words: usize) -> &[u32] {
    let begin = (part.offset / 4) as usize;
    content.get(begin..begin + words).unwrap_or_default()
}
