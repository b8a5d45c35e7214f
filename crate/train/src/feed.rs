//! Samples made ahead on threads of their own, and handed out in order.

use crate::error::TrainError;
use std::collections::BTreeMap;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// A queue of the next few items of a numbered series. Which thread makes an item makes no difference to it.
pub struct Feed<T> {
    shared: Arc<Shared<T>>,
    threads: Vec<JoinHandle<()>>,
    waited: Duration,
    handed_out: u64,
}

struct Shared<T> {
    queue: Mutex<Queue<T>>,
    changed: Condvar,
    ahead: u64,
}

struct Queue<T> {
    /// What is handed out next.
    wanted: u64,
    /// What is begun next.
    next: u64,
    ready: BTreeMap<u64, Result<T, TrainError>>,
    /// Time that the threads spent on making items, and how many.
    making: Duration,
    made: u32,
    stopped: bool,
    broken: bool,
}

impl<T: Send + 'static> Feed<T> {
    /// Starts `threads` threads that make items from number `first` on, at most `ahead` of them before they are asked
    /// for. `worker` is called once on each thread and gives what makes an item from its number.
    ///
    /// # Errors
    /// When the system has no thread to give.
    pub fn start<M>(
        threads: usize,
        ahead: usize,
        first: u64,
        worker: impl Fn() -> M + Send + Sync + 'static,
    ) -> Result<Self, TrainError>
    where
        M: FnMut(u64) -> Result<T, TrainError>,
    {
        let shared = Arc::new(Shared {
            queue: Mutex::new(Queue {
                wanted: first,
                next: first,
                ready: BTreeMap::new(),
                making: Duration::ZERO,
                made: 0,
                stopped: false,
                broken: false,
            }),
            changed: Condvar::new(),
            ahead: ahead.max(1) as u64,
        });
        let worker = Arc::new(worker);
        let threads = (0..threads.max(1))
            .map(|_| {
                let (shared, worker) = (shared.clone(), worker.clone());
                let work = move || {
                    let watch = Watch(&shared);
                    shared.work(worker());
                    std::mem::forget(watch);
                };
                let builder = std::thread::Builder::new().name("samples".to_owned());
                builder.spawn(work).map_err(TrainError::Thread)
            })
            .collect::<Result<_, _>>()?;
        Ok(Self {
            shared,
            threads,
            waited: Duration::ZERO,
            handed_out: 0,
        })
    }

    /// The next item, waited for if need be.
    ///
    /// # Errors
    /// What went wrong while the item was made.
    pub fn take(&mut self) -> Result<T, TrainError> {
        let started = Instant::now();
        let mut queue = self.shared.lock();
        loop {
            let wanted = queue.wanted;
            if let Some(item) = queue.ready.remove(&wanted) {
                queue.wanted += 1;
                self.shared.changed.notify_all();
                self.waited += started.elapsed();
                self.handed_out += 1;
                return item;
            }
            if queue.broken {
                return Err(TrainError::Worker);
            }
            let woken = self.shared.changed.wait(queue);
            queue = woken.unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// How long [`Feed::take`] has waited in all.
    pub fn waited(&self) -> Duration {
        self.waited
    }

    /// The mean time that a thread took for an item.
    pub fn mean_making(&self) -> Duration {
        let queue = self.shared.lock();
        queue.making / queue.made.max(1)
    }

    /// How many items were handed out.
    pub fn handed_out(&self) -> u64 {
        self.handed_out
    }
}

impl<T> Drop for Feed<T> {
    fn drop(&mut self) {
        self.shared.lock().stopped = true;
        self.shared.changed.notify_all();
        for thread in self.threads.drain(..) {
            // One that broke off has said so itself.
            drop(thread.join());
        }
    }
}

impl<T> Shared<T> {
    fn lock(&self) -> MutexGuard<'_, Queue<T>> {
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn work(&self, mut make: impl FnMut(u64) -> Result<T, TrainError>) {
        loop {
            let mut queue = self.lock();
            while !queue.stopped && queue.next >= queue.wanted + self.ahead {
                let woken = self.changed.wait(queue);
                queue = woken.unwrap_or_else(PoisonError::into_inner);
            }
            if queue.stopped {
                return;
            }
            let number = queue.next;
            queue.next += 1;
            drop(queue);
            let started = Instant::now();
            let item = make(number);
            let mut queue = self.lock();
            queue.making += started.elapsed();
            queue.made += 1;
            queue.ready.insert(number, item);
            drop(queue);
            self.changed.notify_all();
        }
    }
}

/// Tells those who wait when its thread breaks off.
struct Watch<'a, T>(&'a Shared<T>);

impl<T> Drop for Watch<'_, T> {
    fn drop(&mut self) {
        self.0.lock().broken = true;
        self.0.changed.notify_all();
    }
}
