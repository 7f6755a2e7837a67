//! Files as the decoder takes them. Numbers are to come as they are stored, where it would refuse a palette or turn shades
//! round: it is shown the page's photometric interpretation as "black is zero". And it knows no pages with a depth: it is
//! shown one so high as their tiles are one below another.

use std::io::{self, Read, Seek, SeekFrom};

/// The tag of the photometric interpretation.
const PHOTOMETRIC: u16 = 262;

/// Tags of the height and the depth of pages and tiles.
const HEIGHT: u16 = 257;
const TILE_HEIGHT: u16 = 323;
const DEPTH: u16 = 32_997;
const TILE_DEPTH: u16 = 32_998;

/// The most tags of a directory that are looked at; real ones have some 30.
const MOST_ENTRIES: u64 = 1 << 12;

/// Black is zero.
const GREY: u16 = 1;

/// A file, of which single bytes read otherwise.
pub(super) struct Patched<R> {
    inner: R,
    at: u64,
    patches: Vec<(u64, u8)>,
    /// The height of the first page, where the decoder is shown another.
    height: Option<usize>,
}

/// What the beginning of a file says, and where a directory is.
#[derive(Clone, Copy)]
struct Head {
    is_little: bool,
    /// Whether it is BigTIFF.
    is_big: bool,
    directory: u64,
}

impl Head {
    fn number(&self, bytes: &[u8]) -> u64 {
        let fold = |number: u64, byte: &u8| number << 8 | u64::from(*byte);
        if self.is_little { bytes.iter().rev().fold(0, fold) } else { bytes.iter().fold(0, fold) }
    }
}

/// A number that stands in a directory.
#[derive(Clone, Copy)]
struct Value {
    at: u64,
    /// Its bytes, 2 or 4.
    size: usize,
    number: u64,
}

impl<R: Read + Seek> Patched<R> {
    /// The file, whose first page may have a depth.
    ///
    /// # Errors
    /// As the file gives.
    pub fn of(inner: R) -> io::Result<Self> {
        let mut file = Self { inner, at: 0, patches: Vec::new(), height: None };
        file.unfold()?;
        file.seek(SeekFrom::Start(0))?;
        Ok(file)
    }

    /// The height of a page with a depth, which the decoder is shown as the height of all its planes of tiles.
    pub fn height(&self) -> Option<usize> {
        self.height
    }

    /// Shows tiles that lie behind each other in a page as tiles one below another.
    fn unfold(&mut self) -> io::Result<()> {
        let Some(mut head) = self.head()? else { return Ok(()) };
        self.seek(SeekFrom::Start(if head.is_big { 8 } else { 4 }))?;
        head.directory = match head.is_big {
            true => head.number(&self.array::<8>()?),
            false => head.number(&self.array::<4>()?),
        };
        let mut found = [None; 4];
        for (tag, entry) in self.entries(&head)? {
            if let Some(k) = [HEIGHT, TILE_HEIGHT, DEPTH, TILE_DEPTH].iter().position(|t| *t == tag)
            {
                found[k] = Some(entry);
            }
        }
        let [Some(height), Some(tile), Some(depth), tile_depth] = found else { return Ok(()) };
        let tile_depth = tile_depth.map_or(1, |entry: Value| entry.number);
        let (height, at, size) = (height.number, height.at, height.size);
        if depth.number < 2 || tile.number == 0 || tile_depth == 0 || height == 0 {
            return Ok(());
        }
        let tiles = height.div_ceil(tile.number).checked_mul(depth.number.div_ceil(tile_depth));
        let shown = tiles.and_then(|tiles| tiles.checked_mul(tile.number));
        // what the tag cannot hold, the decoder refuses as it is
        let Some(shown) = shown.filter(|&n| n < 1 << (8 * size.min(4))) else { return Ok(()) };
        self.height = usize::try_from(height).ok();
        let bytes = match head.is_little {
            true => shown.to_le_bytes()[..size].to_vec(),
            false => shown.to_be_bytes()[8 - size..].to_vec(),
        };
        self.patches.extend((at..).zip(bytes));
        Ok(())
    }

    /// Makes the directory at a place, and no other, say that black is zero.
    ///
    /// # Errors
    /// As the file gives.
    pub fn make_grey(&mut self, directory: u64) -> io::Result<()> {
        if self.height.is_none() {
            self.patches.clear(); // else the only directory keeps its height
        }
        self.seek(SeekFrom::Start(0))?;
        let Some(head) = self.head()? else { return Ok(()) };
        let entries = self.entries(&Head { directory, ..head })?;
        if let Some((_, Value { at, .. })) =
            entries.into_iter().find(|(tag, _)| *tag == PHOTOMETRIC)
        {
            let bytes = if head.is_little { GREY.to_le_bytes() } else { GREY.to_be_bytes() };
            self.patches.extend((at..).zip(bytes));
        }
        Ok(())
    }

    /// The beginning of the file; none if it is too short.
    fn head(&mut self) -> io::Result<Option<Head>> {
        let mut bytes = [0; 4];
        if self.read_exact(&mut bytes).is_err() {
            return Ok(None);
        }
        let mut head = Head { is_little: bytes[0] == b'I', is_big: false, directory: 0 };
        head.is_big = head.number(&bytes[2..]) == 43;
        Ok(Some(head))
    }

    /// The tags of a directory, each with the value that stands beside it; fewer where the file ends.
    fn entries(&mut self, head: &Head) -> io::Result<Vec<(u16, Value)>> {
        self.seek(SeekFrom::Start(head.directory))?;
        let (count, entry_bytes, value_at) = match head.is_big {
            true => (self.array::<8>().map(|n| head.number(&n)), 20, 12),
            false => (self.array::<2>().map(|n| head.number(&n)), 12, 8),
        };
        let (first, count) = (self.at, count.unwrap_or(0).min(MOST_ENTRIES));
        let mut entries = Vec::new();
        for entry in 0..count {
            let start = first + entry_bytes * entry;
            self.seek(SeekFrom::Start(start))?;
            let Ok(bytes) = self.array::<4>() else { break };
            let (tag, kind) = (head.number(&bytes[..2]) as u16, head.number(&bytes[2..]));
            let at = start + value_at;
            self.seek(SeekFrom::Start(at))?;
            let Ok(bytes) = self.array::<4>() else { break };
            let size = if kind == 3 { 2 } else { 4 };
            entries.push((tag, Value { at, size, number: head.number(&bytes[..size]) }));
        }
        Ok(entries)
    }

    fn array<const N: usize>(&mut self) -> io::Result<[u8; N]> {
        let mut bytes = [0; N];
        self.read_exact(&mut bytes)?;
        Ok(bytes)
    }
}

impl<R: Read> Read for Patched<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.inner.read(buffer)?;
        for &(place, byte) in &self.patches {
            if let Some(k) = place.checked_sub(self.at).filter(|&k| k < count as u64) {
                buffer[k as usize] = byte;
            }
        }
        self.at += count as u64;
        Ok(count)
    }
}

impl<R: Seek> Seek for Patched<R> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.at = self.inner.seek(to)?;
        Ok(self.at)
    }
}
