//! CPU-time clocks, where the system provides them: they stop while the processors work for other programs.

use cpu_time::{ProcessTime, ThreadTime};

/// CPU time of this thread, s.
pub fn thread() -> Option<f64> {
    ThreadTime::try_now().ok().map(|time| time.as_duration().as_secs_f64())
}

/// CPU time of all threads of this process together, s.
pub fn process() -> Option<f64> {
    ProcessTime::try_now().ok().map(|time| time.as_duration().as_secs_f64())
}
