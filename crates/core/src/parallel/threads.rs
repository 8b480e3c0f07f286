//! The threads that batches and searches share.

use std::sync::{Arc, Mutex, PoisonError};

use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};

/// The threads of a process, and how many are asked for (0 for one on each core).
struct Threads {
    asked: usize,
    /// Threads do not live on in a process that was forked: those of another process are of no use.
    pool: Option<(u32, Arc<ThreadPool>)>,
}

static THREADS: Mutex<Threads> = Mutex::new(Threads { asked: 0, pool: None });

fn locked() -> std::sync::MutexGuard<'static, Threads> {
    THREADS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Lets batches use this many threads; 0 for one on each core.
pub fn set(count: usize) {
    let mut threads = locked();
    if threads.asked != count {
        *threads = Threads { asked: count, pool: None };
    }
}

/// How many threads batches use.
#[must_use]
pub fn count() -> usize {
    match locked().asked {
        0 => std::thread::available_parallelism().map_or(1, usize::from),
        asked => asked,
    }
}

/// Threads for a search that takes long: those that batches share, or some of its own.
pub struct Team(Option<ThreadPool>);

impl Team {
    /// So many threads; 0 for those that batches share.
    ///
    /// # Errors
    /// If the system gives no such threads.
    pub fn new(count: usize) -> Result<Self, ThreadPoolBuildError> {
        let own = (count > 0).then(|| ThreadPoolBuilder::new().num_threads(count).build());
        own.transpose().map(Team)
    }

    pub fn install<T: Send>(&self, task: impl FnOnce() -> T + Send) -> T {
        match &self.0 {
            Some(pool) => pool.install(task),
            None => install(task),
        }
    }
}

/// Runs a task on the shared threads.
pub(crate) fn install<T: Send>(task: impl FnOnce() -> T + Send) -> T {
    match pool() {
        Some(pool) => pool.install(task),
        None => task(),
    }
}

fn pool() -> Option<Arc<ThreadPool>> {
    let mut threads = locked();
    let process = std::process::id();
    if let Some((owner, pool)) = &threads.pool
        && *owner == process
    {
        return Some(Arc::clone(pool));
    }
    let pool = Arc::new(ThreadPoolBuilder::new().num_threads(threads.asked).build().ok()?);
    // One of another process cannot be ended here: it is left alone.
    if let Some((_, old)) = threads.pool.replace((process, Arc::clone(&pool))) {
        std::mem::forget(old);
    }
    Some(pool)
}
