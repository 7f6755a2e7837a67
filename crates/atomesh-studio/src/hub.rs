//! What pages are shown: of each state the newest alone.
//!
//! The engine publishes frames by their kind. A socket sends a frame if it is newer than the one it has sent of this kind,
//! and if that one was acknowledged. So what waits for a stalled page is one frame of each kind, shared by all pages.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, RwLock};
use std::time::{Duration, Instant};

use axum::body::Bytes;
use axum::extract::ws::Utf8Bytes;
use tokio::sync::watch;

use crate::exhibit::Exhibit;
use crate::protocol::Kind;

/// A frame as it is sent.
#[derive(Clone, Debug)]
pub enum Frame {
    /// A state in words.
    Text(Utf8Bytes),
    /// Arrays.
    Binary(Bytes),
}

/// The newest of each kind of frames, and what slices are taken of.
#[derive(Debug)]
pub struct Hub {
    frames: Mutex<BTreeMap<Kind, (u64, Frame)>>,
    version: watch::Sender<u64>,
    exhibit: RwLock<Option<Arc<dyn Exhibit>>>,
    pages: Mutex<Pages>,
}

/// How many pages are open, and since when none is.
#[derive(Debug)]
struct Pages {
    count: usize,
    none_since: Instant,
}

impl Default for Hub {
    fn default() -> Self {
        Self {
            frames: Mutex::default(),
            version: watch::Sender::new(0),
            exhibit: RwLock::default(),
            pages: Mutex::new(Pages { count: 0, none_since: Instant::now() }),
        }
    }
}

impl Hub {
    /// Puts a frame in the place of the last one of its kind.
    pub fn publish(&self, kind: Kind, frame: Frame) {
        let mut frames = self.frames();
        let version = *self.version.borrow() + 1;
        frames.insert(kind, (version, frame));
        self.version.send_replace(version);
    }

    /// Takes a frame away: of nothing there is nothing to see. Pages learn it from the state.
    pub fn retract(&self, kind: Kind) {
        self.frames().remove(&kind);
    }

    /// Hears of new frames.
    pub fn subscribe(&self) -> watch::Receiver<u64> {
        self.version.subscribe()
    }

    /// The frames newer than those of the versions given, kind by kind.
    pub fn newer(&self, than: impl Fn(Kind) -> Option<u64>) -> Vec<(Kind, u64, Frame)> {
        let frames = self.frames();
        let newer =
            frames.iter().filter(|(kind, (v, _))| than(**kind).is_some_and(|sent| *v > sent));
        newer.map(|(kind, (version, frame))| (*kind, *version, frame.clone())).collect()
    }

    /// Shows something else.
    pub fn exhibit(&self, shown: Option<Arc<dyn Exhibit>>) {
        *self.exhibit.write().unwrap_or_else(PoisonError::into_inner) = shown;
    }

    /// What is shown.
    pub fn shown(&self) -> Option<Arc<dyn Exhibit>> {
        self.exhibit.read().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Counts a page that has come, unless there are as many as may be.
    pub fn come(&self, most: usize) -> bool {
        let mut pages = self.pages();
        let is_let_in = pages.count < most;
        pages.count += usize::from(is_let_in);
        is_let_in
    }

    /// Counts a page that goes.
    pub fn go(&self) {
        let mut pages = self.pages();
        pages.count -= 1;
        pages.none_since = Instant::now();
    }

    /// For how long there has been no page.
    pub fn deserted(&self) -> Duration {
        let pages = self.pages();
        if pages.count > 0 { Duration::ZERO } else { pages.none_since.elapsed() }
    }

    fn frames(&self) -> MutexGuard<'_, BTreeMap<Kind, (u64, Frame)>> {
        self.frames.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn pages(&self) -> MutexGuard<'_, Pages> {
        self.pages.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_each_kind_the_newest_waits() {
        let hub = Hub::default();
        let text = |n: usize| Frame::Text(n.to_string().into());
        for n in 0..1000 {
            hub.publish(Kind::Mesh, text(n));
        }
        hub.publish(Kind::State, text(7));
        let all = hub.newer(|_| Some(0));
        assert_eq!(all.len(), 2, "memory is flat however slow a page is");
        let mesh = all.iter().find(|(kind, ..)| *kind == Kind::Mesh).unwrap();
        assert!(matches!(&mesh.2, Frame::Text(text) if text.as_str() == "999"));
        let version = mesh.1;
        assert!(hub.newer(|kind| (kind == Kind::Mesh).then_some(version)).is_empty());
        assert!(hub.newer(|_| None).is_empty(), "what is not acknowledged keeps others back");
    }
}
