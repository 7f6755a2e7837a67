//! The colours of a palette.

use atomesh::image::Samples;

use super::super::colour::Values;
use super::super::error::ReadReason;
use super::super::memory::Memory;
use super::FORMAT;

/// Colours by their indices.
pub(super) struct Palette {
    /// Red of all indices, then green, then blue.
    map: Vec<u16>,
}

impl Palette {
    /// The colours of a colour map. Old programs wrote them in 8 bits.
    pub fn new(mut map: Vec<u16>) -> Self {
        if map.iter().all(|&value| value < 256) {
            map.iter_mut().for_each(|value| *value *= 257);
        }
        Self { map }
    }

    fn colour(&self, index: usize) -> Option<[u16; 3]> {
        let count = self.map.len() / 3;
        (index < count).then(|| [0, 1, 2].map(|c| self.map[c * count + index]))
    }

    /// Whether an index is black.
    pub fn is_black(&self, index: usize) -> bool {
        self.colour(index) == Some([0; 3])
    }

    /// The colours of indices, by what values mean; of 8 bits where all of the palette are.
    ///
    /// # Errors
    /// If an index has no colour.
    pub fn colours(
        &self,
        indices: &Samples,
        values: &mut Values,
        memory: Memory,
    ) -> Result<Samples, ReadReason> {
        let mut colours = Vec::new();
        memory.reserve(&mut colours, indices.len().saturating_mul(3))?;
        for place in 0..indices.len() {
            let index = indices.get(place) as usize;
            let colour = self.colour(index).ok_or_else(|| {
                let (field, count) = ("ColorMap", self.map.len() / 3);
                let value = format!("of {count} colours, without {index}");
                let expected = "a colour for each index";
                ReadReason::Header { format: FORMAT, field, value, expected }
            })?;
            colours.extend(colour);
        }
        // 8 bits are widened to 16 in either way
        let is_byte = |value: &u16| value.is_multiple_of(257) || value.is_multiple_of(256);
        if self.map.iter().all(is_byte) {
            return values.of(colours.into_iter().map(|value| (value >> 8) as u8).collect(), 3);
        }
        values.of(colours, 3)
    }
}
