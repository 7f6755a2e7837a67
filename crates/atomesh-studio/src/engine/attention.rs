//! What the engine listens to while it works.

use std::collections::VecDeque;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, TryRecvError};
use std::time::{Duration, Instant};

use atomesh::watch::{Phase, Watch};
use serde_json::json;

use super::Request;
use crate::hub::{Frame, Hub};
use crate::protocol::Kind;

/// From one word about progress to the next.
const APART: Duration = Duration::from_millis(50);

/// Requests that wait, and the watch that looks for them during work.
#[derive(Debug)]
pub struct Attention {
    requests: Receiver<Request>,
    waiting: VecDeque<Request>,
    hub: Arc<Hub>,
    last: Option<(Phase, Instant)>,
    is_over: bool,
}

impl Attention {
    pub fn new(requests: Receiver<Request>, hub: Arc<Hub>) -> Self {
        Self { requests, waiting: VecDeque::new(), hub, last: None, is_over: false }
    }

    /// The next request; waits for it if it may. `None` if there is none, or nobody is left to ask.
    pub fn next(&mut self, waits: bool) -> Option<Request> {
        self.look();
        let next = self.waiting.pop_front();
        if next.is_some() || !waits { next } else { self.requests.recv().ok() }
    }

    /// The same watch for work that only the end interrupts.
    pub fn firm(&mut self) -> Firm<'_> {
        Firm(self)
    }

    fn look(&mut self) {
        loop {
            match self.requests.try_recv() {
                Ok(request) => self.waiting.push_back(request),
                Err(TryRecvError::Empty) => return,
                Err(TryRecvError::Disconnected) => {
                    self.is_over = true;
                    return;
                }
            }
        }
    }

    fn tell(&mut self, phase: Phase, done: f64, energy: Option<f64>) {
        if self.last.is_some_and(|(last, at)| last == phase && at.elapsed() < APART) {
            return;
        }
        self.last = Some((phase, Instant::now()));
        let progress =
            json!({ "phase": phase.name(), "done": done.clamp(0.0, 1.0), "energy": energy });
        self.hub.publish(Kind::Progress, Frame::Text(progress.to_string().into()));
    }

    fn is_ended(&self) -> bool {
        self.is_over || self.waiting.iter().any(|request| matches!(request, Request::End))
    }
}

impl Watch for Attention {
    fn step(&mut self, phase: Phase, done: f64, energy: Option<f64>) -> ControlFlow<()> {
        self.tell(phase, done, energy);
        self.look();
        match self.is_over || self.waiting.iter().any(Request::interrupts) {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    }
}

/// Goes on whatever is asked for, but for the end.
#[derive(Debug)]
pub struct Firm<'a>(&'a mut Attention);

impl Watch for Firm<'_> {
    fn step(&mut self, phase: Phase, done: f64, energy: Option<f64>) -> ControlFlow<()> {
        self.0.tell(phase, done, energy);
        self.0.look();
        if self.0.is_ended() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}
