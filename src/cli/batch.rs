//! Parallel work on many inputs, with results in input order.

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::sync::{Condvar, Mutex, PoisonError, mpsc};

/// Results that may wait for an earlier one, for each thread: a frame may be large.
const AHEAD: usize = 4;

/// Applies `work` to all items on the threads of `pool`, and hands the results to `take` on this
/// thread, in the order of the items and as early as that order allows. No more than some results
/// wait for an earlier one. If `take` breaks, the remaining items are skipped.
///
/// `state` makes a state for each thread, such as buffers to reuse.
pub(crate) fn for_each_ordered<T: Sync, S, R: Send>(
    pool: &rayon::ThreadPool,
    items: &[T],
    state: impl Fn() -> S + Sync,
    work: impl Fn(&T, &mut S) -> R + Sync,
    mut take: impl FnMut(&T, R) -> ControlFlow<()>,
) {
    let threads = pool.current_num_threads().min(items.len());
    let queue = Queue::new(items.len(), AHEAD * threads);
    let (sender, receiver) = mpsc::channel();
    let worker = |sender: mpsc::Sender<(usize, R)>| {
        // However this ends, no other worker waits for it.
        let _stop = StopOnPanic(&queue);
        let mut state = state();
        while let Some(position) = queue.next() {
            if sender
                .send((position, work(&items[position], &mut state)))
                .is_err()
            {
                break;
            }
        }
    };
    let worker = &worker;
    pool.in_place_scope(|scope| {
        for _ in 0..threads {
            let sender = sender.clone();
            scope.spawn(move |_| worker(sender));
        }
        drop(sender);
        let mut waiting = BTreeMap::new();
        let mut next = 0;
        for (position, result) in receiver {
            waiting.insert(position, result);
            while let Some(result) = waiting.remove(&next) {
                if take(&items[next], result).is_break() {
                    queue.stop();
                    return;
                }
                next += 1;
                queue.set_taken(next);
            }
        }
    });
}

/// As [`for_each_ordered`], until `take` fails.
pub(crate) fn try_for_each_ordered<T: Sync, S, R: Send>(
    pool: &rayon::ThreadPool,
    items: &[T],
    state: impl Fn() -> S + Sync,
    work: impl Fn(&T, &mut S) -> R + Sync,
    mut take: impl FnMut(&T, R) -> anyhow::Result<()>,
) -> anyhow::Result<()> {
    let mut taken = Ok(());
    for_each_ordered(pool, items, state, work, |item, result| {
        taken = take(item, result);
        match taken {
            Ok(()) => ControlFlow::Continue(()),
            Err(_) => ControlFlow::Break(()),
        }
    });
    taken
}

/// Which item is next. A worker waits while it would be too far ahead of what is taken.
struct Queue {
    items: usize,
    ahead: usize,
    state: Mutex<QueueState>,
    changed: Condvar,
}

#[derive(Default)]
struct QueueState {
    next: usize,
    taken: usize,
    is_stopped: bool,
}

impl Queue {
    fn new(items: usize, ahead: usize) -> Self {
        Self {
            items,
            ahead,
            state: Mutex::default(),
            changed: Condvar::new(),
        }
    }

    /// The position of the next item; `None` if there is none or the work is to stop.
    fn next(&self) -> Option<usize> {
        let state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        let is_early = |state: &mut QueueState| {
            !state.is_stopped && state.next < self.items && state.next >= state.taken + self.ahead
        };
        let waited = self.changed.wait_while(state, is_early);
        let mut state = waited.unwrap_or_else(PoisonError::into_inner);
        if state.is_stopped || state.next >= self.items {
            return None;
        }
        state.next += 1;
        Some(state.next - 1)
    }

    /// As many items are taken.
    fn set_taken(&self, taken: usize) {
        self.change(|state| state.taken = taken);
    }

    fn stop(&self) {
        self.change(|state| state.is_stopped = true);
    }

    fn change(&self, change: impl FnOnce(&mut QueueState)) {
        change(&mut self.state.lock().unwrap_or_else(PoisonError::into_inner));
        self.changed.notify_all();
    }
}

/// Stops the work if a worker panics: its result would be waited for.
struct StopOnPanic<'a>(&'a Queue);

impl Drop for StopOnPanic<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.0.stop();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicUsize, Ordering};
    use std::time::Duration;

    fn pool(threads: usize) -> rayon::ThreadPool {
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap()
    }

    #[test]
    fn results_come_in_input_order_however_long_each_takes() {
        let items: Vec<u64> = (0..40).collect();
        for threads in [1, 2, 7] {
            let mut seen = Vec::new();
            let work = |item: &u64, _: &mut ()| {
                std::thread::sleep(Duration::from_micros((40 - item) * 50));
                item * 2
            };
            for_each_ordered(
                &pool(threads),
                &items,
                || (),
                work,
                |item, result| {
                    seen.push((*item, result));
                    ControlFlow::Continue(())
                },
            );
            let expected: Vec<_> = items.iter().map(|i| (*i, i * 2)).collect();
            assert_eq!(seen, expected);
        }
    }

    #[test]
    fn few_results_wait_for_a_slow_one() {
        let items: Vec<usize> = (0..200).collect();
        let done = AtomicUsize::new(0);
        let work = |item: &usize, (): &mut ()| {
            if *item == 0 {
                std::thread::sleep(Duration::from_millis(50));
                assert!(done.load(Ordering::SeqCst) <= 3 * AHEAD);
            }
            done.fetch_add(1, Ordering::SeqCst);
        };
        let mut taken = 0;
        for_each_ordered(
            &pool(3),
            &items,
            || (),
            work,
            |_, ()| {
                taken += 1;
                ControlFlow::Continue(())
            },
        );
        assert_eq!(taken, items.len());
    }

    #[test]
    #[should_panic(expected = "this item is bad")]
    fn a_panic_ends_the_work() {
        let items: Vec<usize> = (0..200).collect();
        let work = |item: &usize, (): &mut ()| assert!(*item != 3, "this item is bad");
        for_each_ordered(
            &pool(2),
            &items,
            || (),
            work,
            |_, ()| ControlFlow::Continue(()),
        );
    }

    #[test]
    fn no_results_come_after_a_break() {
        let items: Vec<usize> = (0..1000).collect();
        let mut seen = 0;
        for_each_ordered(
            &pool(2),
            &items,
            || (),
            |item, ()| *item,
            |_, _| {
                seen += 1;
                if seen == 3 {
                    ControlFlow::Break(())
                } else {
                    ControlFlow::Continue(())
                }
            },
        );
        assert_eq!(seen, 3);
    }

    #[test]
    fn no_items_are_no_work() {
        let none: [u8; 0] = [];
        for_each_ordered(
            &pool(2),
            &none,
            || (),
            |item, ()| *item,
            |_, _| ControlFlow::Continue(()),
        );
    }
}
