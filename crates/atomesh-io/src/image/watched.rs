//! A reader that reports its progress to a watch, which can stop it.

use std::cell::Cell;
use std::io::{self, Read, Seek, SeekFrom};

use atomesh::watch::{Cancelled, Phase, Watch, check};

/// Bytes between two looks at the watch. Gzip unpacks at most a thousand times as many, so that the watch
/// is asked every second even then.
const STEP: u64 = 1 << 19;

/// Passes bytes on and tells the watch, every half megabyte, the share of the file that was read.
pub(super) struct Watched<'a, R> {
    inner: R,
    watch: &'a mut dyn Watch,
    cancelled: &'a Cell<bool>,
    file_bytes: u64,
    read_bytes: u64,
    next_look: u64,
}

impl<'a, R> Watched<'a, R> {
    /// Watches `inner`, of `file_bytes` bytes. `cancelled` becomes true when the watch ends the
    /// work; the error that reading then gives is of no interest.
    pub fn new(
        inner: R,
        file_bytes: u64,
        watch: &'a mut dyn Watch,
        cancelled: &'a Cell<bool>,
    ) -> Self {
        Self { inner, watch, cancelled, file_bytes, read_bytes: 0, next_look: 0 }
    }

    /// Goes on with another reader, of `file_bytes` bytes, for the same watch.
    pub fn over<S>(self, inner: S, file_bytes: u64) -> Watched<'a, S> {
        Watched::new(inner, file_bytes, self.watch, self.cancelled)
    }
}

impl<R: Read> Read for Watched<'_, R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if self.read_bytes >= self.next_look {
            self.next_look = self.read_bytes + STEP;
            let done = (self.read_bytes as f64 / self.file_bytes.max(1) as f64).min(1.0);
            if self.cancelled.get() || check(self.watch, Phase::Read, done, None).is_err() {
                self.cancelled.set(true);
                self.next_look = 0;
                return Err(io::Error::other(Cancelled));
            }
        }
        let count = self.inner.read(buffer)?;
        self.read_bytes += count as u64;
        Ok(count)
    }
}

impl<R: Seek> Seek for Watched<'_, R> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.inner.seek(to)
    }
}
