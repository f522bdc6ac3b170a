//! Parallel work on many inputs, with results in input order.

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc;

/// Applies `work` to all items on the threads of `pool`, and hands the results to `take` on this
/// thread, in the order of the items and as early as that order allows. If `take` breaks, the
/// remaining items are skipped.
///
/// `state` makes a state for each thread, such as buffers to reuse.
pub(crate) fn for_each_ordered<T: Sync, S, R: Send>(
    pool: &rayon::ThreadPool,
    items: &[T],
    state: impl Fn() -> S + Sync,
    work: impl Fn(&T, &mut S) -> R + Sync,
    mut take: impl FnMut(&T, R) -> ControlFlow<()>,
) {
    let next = AtomicUsize::new(0);
    let stopped = AtomicBool::new(false);
    let (sender, receiver) = mpsc::channel();
    let worker = |sender: mpsc::Sender<(usize, R)>| {
        let mut state = state();
        while !stopped.load(Ordering::Relaxed) {
            let position = next.fetch_add(1, Ordering::Relaxed);
            let Some(item) = items.get(position) else {
                break;
            };
            if sender.send((position, work(item, &mut state))).is_err() {
                break;
            }
        }
    };
    let worker = &worker;
    pool.in_place_scope(|scope| {
        for _ in 0..pool.current_num_threads().min(items.len()) {
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
                    stopped.store(true, Ordering::Relaxed);
                    return;
                }
                next += 1;
            }
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;
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
