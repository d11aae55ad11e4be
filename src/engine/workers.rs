//! Threads that share the work of a step.
//!
//! A step has hundreds of passes of a few microseconds each. So threads are kept, and wait for work in a loop: to hand it
//! over takes a fraction of a microsecond. A thread that waits for longer goes to sleep. Results do not depend on the number
//! of threads, because the parts of a task do not see each other.
//!
//! Each thread first takes the part with its own number, whose memory is in its cache from the last pass, and then what the
//! others have not begun. So a thread that the system does not run holds nobody up.

#![allow(
    unsafe_code,
    reason = "threads run a task that is borrowed; `run` does not return before they have finished it"
)]

use std::any::Any;
use std::cell::UnsafeCell;
use std::fmt;
use std::hint::spin_loop;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};

/// Largest number of threads.
pub const MOST_THREADS: usize = 32;

/// How often a thread looks for work, or for the end of it, before it lets others run: for some tens of microseconds.
const LOOKS: u32 = 2_000;

/// How often a thread lets others run before it sleeps. All in all it waits for some milliseconds, which is longer than a
/// phase of a step without work for it, so that it seldom has to be woken: that takes as long as fifty sweeps.
const TURNS: u32 = 2_000;

/// The threads of a world, besides the one that steps it.
///
/// A copy has no threads until [`Self::set`].
#[derive(Default)]
pub struct Workers {
    shared: Arc<Shared>,
    threads: Vec<JoinHandle<()>>,
    /// Number of threads asked for, the calling one not counted.
    wanted: usize,
    /// Whether the calling thread works alone.
    rests: bool,
}

/// What one thread writes, in cache lines of its own: two, because they are fetched in pairs.
#[derive(Clone, Debug, Default)]
#[repr(align(128))]
pub struct Apart<T>(pub T);

/// What the threads run; it gets the number of the thread.
type Task<'a> = dyn Fn(usize) + Sync + 'a;

#[derive(Default)]
struct Shared {
    /// Number of tasks so far.
    epoch: AtomicUsize,
    /// [`OPEN`] while threads may begin the task, and the number of threads that are at it.
    gate: AtomicUsize,
    task: TaskCell,
    /// Whether there is a task. A task within a task runs in one thread.
    is_busy: AtomicBool,
    /// Whether the threads are to end.
    ends: AtomicBool,
    /// Which threads sleep.
    sleeps: [AtomicBool; MOST_THREADS],
    /// What a part panicked with.
    panic: Mutex<Option<Box<dyn Any + Send>>>,
}

/// See [`Shared::gate`].
const OPEN: usize = 1 << 31;

#[derive(Default)]
struct TaskCell(UnsafeCell<Option<*const Task<'static>>>);

// SAFETY: it is written while the gate is closed and nobody is inside (`is_busy` admits one caller, which has waited for
// that), and read by threads inside. The task is `Sync`.
unsafe impl Send for TaskCell {}
// SAFETY: as above.
unsafe impl Sync for TaskCell {}

impl Workers {
    /// Starts or ends threads, so that there are `threads` with the calling one, [`MOST_THREADS`] at most. Fewer if the
    /// system does not give as many.
    pub fn set(&mut self, threads: usize) {
        let wanted = threads.clamp(1, MOST_THREADS) - 1;
        if self.wanted == wanted {
            return;
        }
        self.end();
        self.wanted = wanted;
        self.shared = Arc::default();
        for number in 1..=wanted {
            let shared = Arc::clone(&self.shared);
            let started = thread::Builder::new().name("simpulse".into()).spawn(move || shared.work(number));
            match started {
                Ok(thread) => self.threads.push(thread),
                Err(_) => break,
            }
        }
    }

    /// Lets the calling thread work alone, or all threads, from now on.
    pub fn rest(&mut self, rests: bool) {
        self.rests = rests;
    }

    /// Number of threads that work, the calling one included.
    pub fn count(&self) -> usize {
        if self.rests { 1 } else { self.threads.len() + 1 }
    }

    /// Runs `each` on every part, and returns when all are done. Parts beyond the number of threads wait for a thread.
    pub fn each<P: Send>(&self, mut parts: impl Iterator<Item = P>, each: impl Fn(P) + Sync) {
        if self.count() == 1 {
            return parts.for_each(each);
        }
        self.each_shared(&mut parts, &each);
    }

    /// As [`Self::each`] with several threads. Compiled once per type of parts, not per task.
    fn each_shared<P: Send>(&self, parts: &mut dyn Iterator<Item = P>, each: &(dyn Fn(P) + Sync)) {
        // Few threads need little room.
        match self.count() {
            ..=2 => self.each_of::<2, P>(parts, each),
            3..=8 => self.each_of::<8, P>(parts, each),
            _ => self.each_of::<MOST_THREADS, P>(parts, each),
        }
    }

    /// As [`Self::each_shared`], with `N` threads at most.
    fn each_of<const N: usize, P: Send>(
        &self,
        parts: &mut dyn Iterator<Item = P>,
        each: &(dyn Fn(P) + Sync),
    ) {
        loop {
            let mut count = 0;
            let taken: [Mutex<Option<P>>; N] = std::array::from_fn(|i| {
                let part = if i < self.count() { parts.next() } else { None };
                count += usize::from(part.is_some());
                Mutex::new(part)
            });
            match count {
                0 => return,
                1 => each(
                    taken.into_iter().find_map(|part| part.into_inner().ok().flatten()).expect("one part"),
                ),
                _ => self.run(&|number| {
                    for i in (number..N).chain(0..number) {
                        let part = taken[i].lock().unwrap_or_else(PoisonError::into_inner).take();
                        part.into_iter().for_each(each);
                    }
                }),
            }
            if count < self.count() {
                return;
            }
        }
    }

    /// Calls `each` with every item, in the order of the list, and with one of the `seats`; a thread takes the next item when it
    /// has finished one. A thread has a seat of its own; there are [`Self::count`] of them.
    pub fn in_turn<T: Send, S: Send>(
        &self,
        items: &mut [T],
        seats: &mut [S],
        each: impl Fn(&mut T, &mut S) + Sync,
    ) {
        let queue = Mutex::new(items.iter_mut());
        self.each(seats.iter_mut(), |seat| {
            loop {
                let next = queue.lock().unwrap_or_else(PoisonError::into_inner).next();
                let Some(item) = next else { return };
                each(item, seat);
            }
        });
    }

    /// Calls `each` with the parts of `items`, as [`Self::part`] divides them: the index of the first item, the items, and what
    /// the thread writes. There is at least one part, which may be empty. Returns what was written, in the order of the parts.
    pub fn each_part<'f, T: Sync, F: Default + Send>(
        &self,
        items: &[T],
        least: usize,
        found: &'f mut Vec<Apart<F>>,
        each: impl Fn(usize, &[T], &mut F) + Sync,
    ) -> &'f mut [Apart<F>] {
        let size = self.part(items.len(), least);
        let count = items.len().div_ceil(size).max(1);
        found.resize_with(count.max(found.len()), Apart::default);
        let found = &mut found[..count];
        self.each((0..).step_by(size).zip(&mut *found), |(first, Apart(found))| {
            each(first, &items[first..(first + size).min(items.len())], found);
        });
        found
    }

    /// Size of parts of `len` things, one part for each thread, in whole cache lines of floats; no part is smaller than
    /// `least`.
    pub fn part(&self, len: usize, least: usize) -> usize {
        len.div_ceil(self.count()).max(least).next_multiple_of(16)
    }

    /// Runs `task` in this thread and in every other that comes to it meanwhile, and returns when all have finished.
    ///
    /// # Panics
    /// If the task panics in a thread, after all have finished.
    fn run(&self, task: &Task<'_>) {
        let shared = &*self.shared;
        if shared.is_busy.swap(true, Ordering::Acquire) {
            return task(0);
        }
        // SAFETY: only the lifetime is changed. Threads use the task inside of the gate alone, and this function waits until
        // nobody is inside, also if a part panics.
        let lasting = unsafe { std::mem::transmute::<*const Task<'_>, *const Task<'static>>(task) };
        // SAFETY: the gate is closed and nobody is inside.
        unsafe { *shared.task.0.get() = Some(lasting) };
        shared.gate.store(OPEN, Ordering::Release);
        shared.epoch.fetch_add(1, Ordering::SeqCst);
        for (thread, sleeps) in self.threads.iter().zip(&shared.sleeps[1..]) {
            if sleeps.load(Ordering::SeqCst) {
                thread.thread().unpark();
            }
        }
        shared.attempt(task, 0);
        let (mut looks, mut inside) = (0, shared.gate.fetch_and(!OPEN, Ordering::AcqRel) & !OPEN);
        while inside > 0 {
            inside = shared.gate.load(Ordering::Acquire);
            looks += 1;
            // A thread that is inside may have to wait for a processor.
            if looks % LOOKS == 0 { thread::yield_now() } else { spin_loop() }
        }
        let panic = shared.panic.lock().unwrap_or_else(PoisonError::into_inner).take();
        shared.is_busy.store(false, Ordering::Release);
        if let Some(panic) = panic {
            std::panic::resume_unwind(panic);
        }
    }

    /// Ends all threads.
    fn end(&mut self) {
        self.shared.ends.store(true, Ordering::SeqCst);
        for thread in self.threads.drain(..) {
            thread.thread().unpark();
            // A thread does not panic: its tasks are caught.
            let _ = thread.join();
        }
    }
}

impl Shared {
    /// What a thread does until the end.
    fn work(&self, number: usize) {
        let mut done = 0;
        let (mut looks, sleeps) = (0, &self.sleeps[number]);
        while !self.ends.load(Ordering::SeqCst) {
            if self.epoch.load(Ordering::Acquire) == done {
                looks += 1;
                if looks < LOOKS + TURNS {
                    if looks < LOOKS {
                        spin_loop()
                    } else {
                        thread::yield_now()
                    }
                    continue;
                }
                // Either this thread sees the new epoch, or the caller sees that it sleeps, and wakes it.
                sleeps.store(true, Ordering::SeqCst);
                if self.epoch.load(Ordering::SeqCst) == done && !self.ends.load(Ordering::SeqCst) {
                    thread::park();
                }
                sleeps.store(false, Ordering::SeqCst);
                continue;
            }
            (done, looks) = (self.epoch.load(Ordering::Acquire), 0);
            let enter = |gate| (gate & OPEN != 0).then_some(gate + 1);
            if self.gate.fetch_update(Ordering::AcqRel, Ordering::Acquire, enter).is_err() {
                continue;
            }
            // SAFETY: this thread is inside: the task was written before the gate was opened, and the caller waits for all
            // who are inside before it writes another.
            if let Some(task) = unsafe { *self.task.0.get() } {
                // SAFETY: as above: the task exists until this thread has left.
                self.attempt(unsafe { &*task }, number);
            }
            self.gate.fetch_sub(1, Ordering::Release);
        }
    }

    /// Runs the part of a thread; keeps its panic.
    fn attempt(&self, task: &Task<'_>, number: usize) {
        if let Err(panic) = catch_unwind(AssertUnwindSafe(|| task(number))) {
            self.panic.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(panic);
        }
    }
}

impl Clone for Workers {
    fn clone(&self) -> Self {
        Workers::default()
    }
}

impl Drop for Workers {
    fn drop(&mut self) {
        self.end();
    }
}

impl fmt::Debug for Workers {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Workers({})", self.count())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::AtomicU64;

    fn with(threads: usize) -> Workers {
        let mut workers = Workers::default();
        workers.set(threads);
        workers
    }

    #[test]
    fn every_part_runs_once() {
        for threads in [1, 2, 3, 8] {
            let workers = with(threads);
            for parts in [0, 1, 2, 7, 100] {
                let mut seen = vec![0; parts];
                workers.each(seen.iter_mut(), |part| *part += 1);
                assert!(seen.iter().all(|&times| times == 1), "{threads} threads, {parts} parts: {seen:?}");
            }
        }
    }

    #[test]
    fn every_item_has_its_turn_once() {
        for threads in [1, 2, 3] {
            let workers = with(threads);
            let (mut items, mut seats) = ([0; 50], vec![0; workers.count()]);
            workers.in_turn(&mut items, &mut seats, |item, seat| (*item, *seat) = (*item + 1, *seat + 1));
            assert_eq!((items, seats.iter().sum::<i32>()), ([1; 50], 50), "{threads} threads");
        }
    }

    #[test]
    fn every_item_is_in_one_part() {
        for threads in [1, 2, 3] {
            let (workers, mut found) = (with(threads), vec![]);
            for len in [100, 0, 1, 16, 17, 33] {
                let items: Vec<usize> = (0..len).collect();
                let parts = workers.each_part(&items, 1, &mut found, |first, items, found: &mut Vec<_>| {
                    assert!(items.iter().all(|item| (first..first + items.len()).contains(item)));
                    items.clone_into(found);
                });
                assert!((1..=threads).contains(&parts.len()));
                assert_eq!(parts.iter().flat_map(|Apart(found)| found).copied().collect::<Vec<_>>(), items);
            }
        }
    }

    #[test]
    fn threads_that_sleep_are_woken() {
        let workers = with(3);
        let sum = AtomicU64::new(0);
        for round in 0..20 {
            workers.each(1..=3_u64, |part| {
                sum.fetch_add(part, Ordering::Relaxed);
            });
            if round % 5 == 0 {
                thread::sleep(std::time::Duration::from_millis(5));
            }
        }
        assert_eq!(sum.into_inner(), 120);
    }

    /// More threads than processors, so that some come late to a task, or find it over.
    #[test]
    fn tasks_in_quick_succession_are_whole() {
        let workers = with(8);
        let mut parts = [0_u32; 8];
        for round in 1..=20_000 {
            workers.each(parts.iter_mut(), |part| *part += 1);
            assert_eq!(parts, [round; 8]);
        }
    }

    #[test]
    fn a_panic_ends_the_task_alone_and_a_task_within_a_task_runs() {
        let workers = with(2);
        let caught = catch_unwind(AssertUnwindSafe(|| {
            workers.each(0..2, |part| assert!(part == 0, "part {part}"));
        }));
        assert!(caught.is_err());
        let sum = AtomicU64::new(0);
        workers.each(0..2, |_| {
            workers.each(1..=2_u64, |part| {
                sum.fetch_add(part, Ordering::Relaxed);
            });
        });
        assert_eq!(sum.into_inner(), 6);
    }

    #[test]
    fn threads_end_with_their_owner() {
        let shared = {
            let workers = with(4);
            workers.each(0..4, |_| {});
            Arc::downgrade(&workers.shared)
        };
        assert!(shared.upgrade().is_none());
    }
}
