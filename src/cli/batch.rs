//! Many inputs at once, their results in the order given.

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc;

/// Applies `work` to every item on the threads of `pool`, and hands each result to `take` on this thread, in
/// the order of the items, as soon as it and all before it are there. `take` may end it early.
///
/// Every thread has a state of its own, made by `state`, for buffers that are worth keeping.
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
        let mut early = BTreeMap::new();
        let mut due = 0;
        for (position, result) in receiver {
            early.insert(position, result);
            while let Some(result) = early.remove(&due) {
                if take(&items[due], result).is_break() {
                    stopped.store(true, Ordering::Relaxed);
                    return;
                }
                due += 1;
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
    fn results_come_in_the_order_of_the_items_whatever_takes_longest() {
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
    fn an_early_end_leaves_the_rest() {
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
    fn nothing_to_do_is_done_at_once() {
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
