//! Clocks that stand still while the processors work for others, where the system has them.

use cpu_time::{ProcessTime, ThreadTime};

/// Seconds that this thread has run.
pub fn thread() -> Option<f64> {
    ThreadTime::try_now().ok().map(|time| time.as_duration().as_secs_f64())
}

/// Seconds that all threads of this process have run, together.
pub fn process() -> Option<f64> {
    ProcessTime::try_now().ok().map(|time| time.as_duration().as_secs_f64())
}
