//! A thread that writes files while the run goes on, one after the other in the order in which they are given. A checkpoint is
//! therefore on disk only after all frames given before it.

use crate::error::{Error, Result};
use rayon::ThreadPoolBuilder;
use std::fmt::Display;
use std::panic::resume_unwind;
use std::sync::mpsc::{SyncSender, sync_channel};
use std::thread::{Builder, JoinHandle};

/// Files that wait while another one is written.
const WAITING: usize = 1;

/// Writes a file.
type Job = Box<dyn FnOnce() -> Result<()> + Send>;

/// The queue of the thread, and the thread.
type Work = (SyncSender<Job>, JoinHandle<Result<()>>);

/// Writes files in the background, until the first one that cannot be written.
#[derive(Default)]
pub(super) struct Writer {
    /// `None` while there is nothing to write.
    work: Option<Work>,
}

impl Writer {
    /// Gives a file to the thread; if [`WAITING`] files wait already, waits too.
    ///
    /// # Errors
    /// An earlier file that could not be written; this one is not written either.
    pub(super) fn add(&mut self, file: impl FnOnce() -> Result<()> + Send + 'static) -> Result<()> {
        let work = self.work.take().map_or_else(start, Ok)?;
        let (queue, _) = self.work.insert(work);
        // a thread that takes no more files has stopped at one of them
        if queue.send(Box::new(file)).is_err() { self.wait() } else { Ok(()) }
    }

    /// Whether all is well so far, without waiting.
    ///
    /// # Errors
    /// As of [`Writer::wait`].
    pub(super) fn check(&mut self) -> Result<()> {
        // the thread ends by itself only at a file that it cannot write
        let is_over = self.work.as_ref().is_some_and(|(_, thread)| thread.is_finished());
        if is_over { self.wait() } else { Ok(()) }
    }

    /// Waits until all files are on disk. A panic of the thread goes on here.
    ///
    /// # Errors
    /// The first file that could not be written; those after it are not written either.
    pub(super) fn wait(&mut self) -> Result<()> {
        let Some((queue, thread)) = self.work.take() else { return Ok(()) };
        drop(queue);
        thread.join().unwrap_or_else(|panic| resume_unwind(panic))
    }
}

impl Drop for Writer {
    /// Waits for the thread: once the folder is free again, nothing is written there.
    fn drop(&mut self) {
        if let Some((queue, thread)) = self.work.take() {
            drop(queue);
            // files are left over only by a run that panics itself
            let _ = thread.join();
        }
    }
}

/// Starts the thread.
fn start() -> Result<Work> {
    let failed = |e: &dyn Display| Error::Unsupported(format!("the thread that writes files cannot start: {e}"));
    // pictures are drawn by all threads of the pool in which they are drawn: by one here, the others are for the solver
    let pool = ThreadPoolBuilder::new().num_threads(1).build().map_err(|e| failed(&e))?;
    let (queue, files) = sync_channel::<Job>(WAITING);
    let thread = Builder::new().spawn(move || files.into_iter().try_for_each(|file| pool.install(file)));
    Ok((queue, thread.map_err(|e| failed(&e))?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::panic::{AssertUnwindSafe, catch_unwind};
    use std::sync::{Arc, Mutex};
    use std::time::Duration;

    #[test]
    fn files_are_written_in_order_until_one_cannot_be() {
        let written = Arc::new(Mutex::new(Vec::new()));
        let file = |number: usize| {
            let written = Arc::clone(&written);
            move || {
                std::thread::sleep(Duration::from_millis(5));
                if number == 3 {
                    return Err(Error::file("3.vtu", "full"));
                }
                written.lock().unwrap().push(number);
                Ok(())
            }
        };
        let mut writer = Writer::default();
        writer.wait().unwrap();
        (0..3).for_each(|number| writer.add(file(number)).unwrap());
        writer.wait().unwrap();
        assert_eq!(*written.lock().unwrap(), [0, 1, 2]);
        writer.add(file(3)).unwrap();
        assert!(writer.wait().unwrap_err().to_string().contains("3.vtu"));
        writer.add(file(3)).unwrap();
        let noticed = (0..1000).find_map(|_| {
            std::thread::sleep(Duration::from_millis(5));
            writer.check().err()
        });
        assert!(noticed.unwrap().to_string().contains("3.vtu"));
        // whoever neither waits nor checks is told with a later file
        let refused = (3..10).find_map(|number| writer.add(file(number)).err()).unwrap();
        assert!(refused.to_string().contains("3.vtu") && refused.exit_code() == 4, "{refused}");
        writer.wait().unwrap();
        assert_eq!(*written.lock().unwrap(), [0, 1, 2], "nothing after it");
        writer.add(file(7)).unwrap();
        drop(writer);
        assert_eq!(*written.lock().unwrap(), [0, 1, 2, 7]);
    }

    #[test]
    fn a_panic_is_passed_on() {
        let mut writer = Writer::default();
        writer.add(|| panic!("in the thread")).unwrap();
        let panic = catch_unwind(AssertUnwindSafe(|| writer.wait())).unwrap_err();
        assert_eq!(panic.downcast_ref(), Some(&"in the thread"));
        writer.wait().unwrap();
    }
}
