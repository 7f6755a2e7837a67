//! What the table of formats says of each: what its files look like, and what reads and writes them.

use std::io::{Read, Seek, Write};
use std::path::Path;

use atomesh::watch::Watch;

use super::detached::DataFolders;
use super::error::{ReadReason, WriteReason};
use super::format::ImageFormat;
use super::memory::Memory;
use super::note::LoadedImage;
use super::options::ReadOptions;
use super::view::ImageView;
use super::watched::Watched;

/// A row of the table.
pub(super) struct Codec {
    pub format: ImageFormat,
    /// The endings of its files' names, in lower case with their dots, the usual one first.
    pub endings: &'static [&'static str],
    /// The endings of headers whose samples are in other files. They are read, never written.
    pub header_endings: &'static [&'static str],
    pub begins: Begins,
    /// Whether files say where their samples are in the world.
    pub has_frame: bool,
    /// Whether only some of them do.
    pub frame_is_optional: bool,
    /// Whether the world's z axis points up.
    pub z_is_height: bool,
    /// Whether the writer takes floats.
    pub writes_floats: bool,
    pub read: Reader,
    /// The writer, if the format is written.
    pub write: Option<Writer>,
    /// Where meshes have the same endings: whether the file at a path is an image.
    pub is_no_mesh: Option<fn(&Path) -> bool>,
    /// Where a folder can be an image of the format: what finds and reads it.
    pub folder: Option<Folder>,
}

impl Codec {
    /// A format that is read from files without a frame, and not written; rows name what differs.
    pub const fn reading(format: ImageFormat, read: Reader) -> Self {
        Self {
            format,
            endings: &[],
            header_endings: &[],
            begins: Begins::Anyhow,
            has_frame: false,
            frame_is_optional: false,
            z_is_height: false,
            writes_floats: false,
            read,
            write: None,
            is_no_mesh: None,
            folder: None,
        }
    }

    /// Whether a file may begin with these bytes.
    pub fn may_begin_with(&self, head: &[u8]) -> bool {
        match self.begins {
            Begins::Anyhow | Begins::Mostly(_) => true,
            Begins::With(magics) => magics.iter().any(|magic| head.starts_with(magic)),
            Begins::If(test) => test(head),
        }
    }

    /// Whether bytes begin with a magic word of the format.
    pub fn is_told_by(&self, head: &[u8]) -> bool {
        match self.begins {
            Begins::With(magics) | Begins::Mostly(magics) => {
                magics.iter().any(|magic| head.starts_with(magic))
            }
            Begins::Anyhow | Begins::If(_) => false,
        }
    }

    /// All endings, those of headers last.
    pub fn all_endings(&self) -> impl Iterator<Item = &'static str> {
        self.endings.iter().chain(self.header_endings).copied()
    }
}

/// How the files of a format begin.
pub(super) enum Begins {
    /// No rule, or one that the reader checks.
    Anyhow,
    /// With one of these magic words, by which the format can be told.
    With(&'static [&'static [u8]]),
    /// With one of these magic words, by which the format can be told, or as the reader checks.
    Mostly(&'static [&'static [u8]]),
    /// As a test of the first eight bytes, or all of a shorter file, asks for.
    If(fn(&[u8]) -> bool),
}

/// Reads an image.
pub(super) type Reader = fn(Source<'_>) -> Result<LoadedImage, ReadReason>;

/// Writes an image.
pub(super) type Writer =
    fn(&mut dyn Output, &ImageView<'_>, &mut dyn Watch) -> Result<(), WriteReason>;

/// What makes one image of the files in a folder.
pub(super) struct Folder {
    /// Whether the file at a path is one of such a folder, whatever its name is; or the folder is one, where only
    /// what it holds can tell.
    pub is_part: fn(&Path) -> bool,
    pub read: fn(&Path, &ReadOptions, &mut dyn Watch) -> Result<LoadedImage, ReadReason>,
}

/// Bytes that can be read from any place.
pub(super) trait Input: Read + Seek {}

impl<T: Read + Seek> Input for T {}

/// Bytes that can be written to any place.
pub(super) trait Output: Write + Seek {}

impl<T: Write + Seek> Output for T {}

/// What a reader is given.
pub(super) struct Source<'a> {
    /// The bytes from the beginning.
    pub bytes: Watched<'a, &'a mut dyn Input>,
    /// Their number.
    pub length: u64,
    /// Where other files of the image may be, if that is known.
    pub folders: Option<DataFolders<'a>>,
    /// The file's own name there.
    pub name: Option<&'a str>,
    pub memory: Memory,
    pub options: &'a ReadOptions,
}
