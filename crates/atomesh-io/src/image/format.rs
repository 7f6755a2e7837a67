//! The name of an image format.

use std::fmt;

/// An image format. The formats are constants, such as [`ImageFormat::PNG`]; [`ImageFormat::of`] finds
/// the one that a file's name calls for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ImageFormat {
    name: &'static str,
}

impl ImageFormat {
    /// The format of that name; its reader and writer stand in the table of formats.
    pub(super) const fn named(name: &'static str) -> Self {
        Self { name }
    }
}

impl fmt::Display for ImageFormat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name)
    }
}
