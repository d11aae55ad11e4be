//! Independent jobs on several threads.

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Number of processors, at least 1.
pub fn processors() -> usize {
    std::thread::available_parallelism().map_or(1, |n| n.get())
}

/// Calls `work` for each item of a list on this many threads. Results are in the order of the list. After an
/// error no further item begins.
///
/// Errors: the first one in the order of the list.
pub fn in_parallel<T: Sync, R: Send, E: Send>(
    list: &[T],
    threads: usize,
    work: impl Fn(&T) -> Result<R, E> + Sync,
) -> Result<Vec<R>, E> {
    let next = AtomicUsize::new(0);
    let slots: Vec<Mutex<Option<Result<R, E>>>> = list.iter().map(|_| Mutex::new(None)).collect();
    let go = || {
        while let Some((item, slot)) = {
            let i = next.fetch_add(1, Ordering::Relaxed);
            list.get(i).zip(slots.get(i))
        } {
            let result = work(item);
            if result.is_err() {
                next.store(list.len(), Ordering::Relaxed);
            }
            // A panicking thread aborts the whole scope, so no poisoned slot is ever read.
            if let Ok(mut slot) = slot.lock() {
                *slot = Some(result);
            }
        }
    };
    std::thread::scope(|scope| {
        for _ in 1..threads.min(list.len()) {
            scope.spawn(go);
        }
        go();
    });
    slots.into_iter().filter_map(|slot| slot.into_inner().ok().flatten()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_are_in_the_order_of_the_list_and_an_error_ends_it() {
        let list: Vec<u64> = (0..50).collect();
        let squares = in_parallel(&list, 4, |&n| Ok::<_, u64>(n * n));
        assert_eq!(squares, Ok(list.iter().map(|n| n * n).collect()));
        assert_eq!(in_parallel(&list, 4, |&n| if n == 7 { Err(n) } else { Ok(n) }), Err(7));
    }
}
