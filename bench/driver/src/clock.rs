//! Wall and CPU time of a piece of work.

use std::time::{Duration, Instant};

use rustix::time::{ClockId, clock_gettime};
use serde_json::{Value, json};

/// Runs since it was made.
pub struct Clock {
    wall: Instant,
    cpu: Duration,
}

impl Clock {
    /// A clock that starts now.
    pub fn start() -> Self {
        Self { wall: Instant::now(), cpu: cpu_time() }
    }

    /// Wall seconds and CPU seconds of all threads since the start, as a JSON object to be added to.
    pub fn stop(&self) -> Value {
        let cpu = (cpu_time() - self.cpu).as_secs_f64();
        json!({ "wall": self.wall.elapsed().as_secs_f64(), "cpu": cpu })
    }
}

/// CPU time of all threads of this process so far.
fn cpu_time() -> Duration {
    let time = clock_gettime(ClockId::ProcessCPUTime);
    Duration::new(time.tv_sec.unsigned_abs(), time.tv_nsec.unsigned_abs() as u32)
}
