//! Mapping from the numbers that a file gives its points or cells to positions in memory.

use std::collections::HashMap;
use std::collections::hash_map::Entry;

/// A look-up table from tags to positions. It is dense if the tags are, so that a single huge tag does not make it
/// huge.
pub(crate) enum Tags {
    Dense { first: i64, table: Vec<u32> },
    Sparse(HashMap<i64, u32>),
}

const NONE: u32 = u32::MAX;

impl Tags {
    /// Builds the table; position `i` belongs to `tags[i]`. `Err` holds a tag that occurs twice, unless `repeat` allows
    /// that (the first position counts then).
    pub fn new(tags: &[i64], repeat: bool) -> Result<Self, i64> {
        let first = tags.iter().copied().min().unwrap_or(0);
        let last = tags.iter().copied().max().unwrap_or(0);
        let span = last.checked_sub(first).and_then(|s| usize::try_from(s).ok());
        if let Some(span) = span.filter(|&s| s <= 4 * tags.len() + 1024) {
            let mut table = vec![NONE; span + 1];
            for (i, &tag) in tags.iter().enumerate() {
                let slot = &mut table[(tag - first) as usize];
                if *slot == NONE {
                    *slot = i as u32;
                } else if !repeat {
                    return Err(tag);
                }
            }
            return Ok(Tags::Dense { first, table });
        }
        let mut map = HashMap::with_capacity(tags.len());
        for (i, &tag) in tags.iter().enumerate() {
            match map.entry(tag) {
                Entry::Vacant(slot) => {
                    slot.insert(i as u32);
                }
                Entry::Occupied(_) if repeat => {}
                Entry::Occupied(_) => return Err(tag),
            }
        }
        Ok(Tags::Sparse(map))
    }

    /// Position of a tag.
    pub fn get(&self, tag: i64) -> Option<u32> {
        match self {
            Tags::Dense { first, table } => {
                let i = tag.checked_sub(*first).and_then(|i| usize::try_from(i).ok())?;
                table.get(i).copied().filter(|&slot| slot != NONE)
            }
            Tags::Sparse(map) => map.get(&tag).copied(),
        }
    }
}
