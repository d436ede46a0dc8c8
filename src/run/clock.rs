//! Clocks that stand still while the processors work for others, where the system has them.

/// Seconds that this thread has run.
#[cfg(unix)]
pub fn thread() -> Option<f64> {
    read(libc::CLOCK_THREAD_CPUTIME_ID)
}

/// Seconds that all threads of this process have run, together.
#[cfg(unix)]
pub fn process() -> Option<f64> {
    read(libc::CLOCK_PROCESS_CPUTIME_ID)
}

#[cfg(unix)]
fn read(clock: libc::clockid_t) -> Option<f64> {
    let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: the pointer is to a value of the type that is asked for.
    let told = unsafe { libc::clock_gettime(clock, &raw mut time) } == 0;
    told.then_some(time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64)
}

/// Seconds that this thread has run: not told here.
#[cfg(not(unix))]
pub fn thread() -> Option<f64> {
    None
}

/// Seconds that all threads of this process have run: not told here.
#[cfg(not(unix))]
pub fn process() -> Option<f64> {
    None
}
