//! Numbers that are stored as differences from their neighbours (TIFF's predictors 2 and 3).

use std::io::{Read, Seek};

use ::tiff::decoder::Decoder;
use ::tiff::tags::Tag;

use super::super::error::ReadReason;
use super::super::sample_type::ByteOrder;
use super::page::Page;
use super::{FORMAT, reason};

/// How the values of a row are to be put together.
pub(super) struct Predictor {
    kind: Kind,
    /// Bytes of a value.
    size: usize,
    /// Values from one sample to the next in a row.
    stride: usize,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    None,
    /// Values are the differences from those before.
    Horizontal,
    /// The bytes of floats are parted by their weight, and are the differences from those before.
    Floats,
}

impl Predictor {
    /// That of the page at which the decoder is.
    pub fn of<R: Read + Seek>(decoder: &mut Decoder<R>, page: &Page) -> Result<Self, ReadReason> {
        let code = decoder.find_tag_unsigned::<u16>(Tag::Predictor).map_err(reason)?.unwrap_or(1);
        let kind = match code {
            1 => Kind::None,
            2 if page.bits() >= 8 => Kind::Horizontal,
            3 if page.bits() >= 16 => Kind::Floats,
            _ => {
                let found = format!("predictor {code} of samples of {} bits", page.bits());
                let expected = "1, 2 from 8 bits on, 3 of floats";
                return Err(ReadReason::Unsupported { format: FORMAT, found, expected });
            }
        };
        let stride = if page.planes() > 1 { 1 } else { page.channels() };
        Ok(Self { kind, size: page.bits() / 8, stride })
    }

    /// Puts a row's values together.
    pub fn undo(&self, row: &mut [u8], order: ByteOrder) {
        match (self.kind, self.size) {
            (Kind::None, _) => {}
            (Kind::Horizontal, 1) => self.add::<1>(row, order),
            (Kind::Horizontal, 2) => self.add::<2>(row, order),
            (Kind::Horizontal, 4) => self.add::<4>(row, order),
            (Kind::Horizontal, _) => self.add::<8>(row, order),
            (Kind::Floats, _) => self.join(row, order),
        }
    }

    /// Adds to each value of `N` bytes the one before, without regard to overflow.
    fn add<const N: usize>(&self, row: &mut [u8], order: ByteOrder) {
        let (values, _) = row.as_chunks_mut::<N>();
        for k in self.stride..values.len() {
            let before = values[k - self.stride];
            let mut carry = 0;
            for byte in 0..N {
                let byte = if order == ByteOrder::Little { byte } else { N - 1 - byte };
                let sum = u16::from(values[k][byte]) + u16::from(before[byte]) + carry;
                values[k][byte] = sum as u8;
                carry = sum >> 8;
            }
        }
    }

    /// Sums bytes up, and puts those of each float together, the most significant of all floats being stored first.
    fn join(&self, row: &mut [u8], order: ByteOrder) {
        for k in self.stride..row.len() {
            row[k] = row[k].wrapping_add(row[k - self.stride]);
        }
        let (parted, count) = (row.to_vec(), row.len() / self.size);
        for k in 0..count {
            for byte in 0..self.size {
                let to = if order == ByteOrder::Big { byte } else { self.size - 1 - byte };
                row[k * self.size + to] = parted[byte * count + k];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_add_up_in_either_order_of_bytes() {
        let values: [u16; 6] = [65_535, 3, 2, 300, 65_000, 7];
        for (order, bytes) in [
            (ByteOrder::Little, u16::to_le_bytes as fn(u16) -> [u8; 2]),
            (ByteOrder::Big, u16::to_be_bytes),
        ] {
            for stride in [1, 2, 3] {
                let stored = |k: usize| match k.checked_sub(stride) {
                    Some(before) => values[k].wrapping_sub(values[before]),
                    None => values[k],
                };
                let mut row: Vec<u8> = (0..6).flat_map(|k| bytes(stored(k))).collect();
                Predictor { kind: Kind::Horizontal, size: 2, stride }.undo(&mut row, order);
                assert_eq!(row, values.into_iter().flat_map(bytes).collect::<Vec<_>>());
            }
        }
    }

    #[test]
    fn floats_come_together() {
        let values = [1.5f32, -2.25, 1e-3, 7e8];
        let whole: Vec<[u8; 4]> = values.iter().map(|v| v.to_be_bytes()).collect();
        let parted: Vec<u8> = (0..4).flat_map(|byte| whole.iter().map(move |v| v[byte])).collect();
        let stored: Vec<u8> = (0..16)
            .map(|k| if k == 0 { parted[0] } else { parted[k].wrapping_sub(parted[k - 1]) })
            .collect();
        for (order, expected) in [
            (ByteOrder::Big, whole.concat()),
            (ByteOrder::Little, values.iter().flat_map(|v| v.to_le_bytes()).collect()),
        ] {
            let mut row = stored.clone();
            Predictor { kind: Kind::Floats, size: 4, stride: 1 }.undo(&mut row, order);
            assert_eq!(row, expected);
        }
    }
}
