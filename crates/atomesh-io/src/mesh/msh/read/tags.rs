//! The tags by which MSH files name points and cells.

use std::collections::HashMap;

/// Which point or cell a tag names.
#[derive(Default)]
pub(super) struct Tags {
    /// The tag of each; in most files tag t names point t − 1.
    pub tags: Vec<u64>,
    map: HashMap<u64, u32>,
}

impl Tags {
    pub fn push(&mut self, tag: u64) {
        self.tags.push(tag);
    }

    /// To be called when all tags are known.
    pub fn close(&mut self) {
        let plain = self.tags.iter().enumerate().all(|(i, &tag)| tag == i as u64 + 1);
        if !plain {
            self.map = self.tags.iter().enumerate().map(|(i, &tag)| (tag, i as u32)).collect();
        }
    }

    pub fn index(&self, tag: u64) -> Option<u32> {
        if self.map.is_empty() {
            let index = tag.checked_sub(1)?;
            return (index < self.tags.len() as u64).then_some(index as u32);
        }
        self.map.get(&tag).copied()
    }
}
