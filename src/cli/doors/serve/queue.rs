//! Work that waits for a worker, in places that are limited.

use std::collections::VecDeque;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

/// Work that waits.
pub(super) struct Queue<T> {
    state: Mutex<State<T>>,
    /// Work came, or the queue was closed.
    changed: Condvar,
    places: usize,
}

struct State<T> {
    waiting: VecDeque<T>,
    /// Places of work that is still being prepared.
    reserved: usize,
    /// What was taken, and is not done.
    running: usize,
    is_closed: bool,
}

/// A place for work to come, which is free again if none comes.
pub(super) struct Place<'a, T>(&'a Queue<T>);

/// Closes the queue when it is dropped.
pub(super) struct Closing<'a, T>(&'a Queue<T>);

impl<T> Queue<T> {
    pub(super) fn new(places: usize) -> Self {
        Self {
            state: Mutex::new(State {
                waiting: VecDeque::new(),
                reserved: 0,
                running: 0,
                is_closed: false,
            }),
            changed: Condvar::new(),
            places,
        }
    }

    /// A place; `None` if all are taken, or no more work is taken.
    pub(super) fn place(&self) -> Option<Place<'_, T>> {
        let mut state = self.lock();
        let is_free = !state.is_closed && state.waiting.len() + state.reserved < self.places;
        is_free.then(|| {
            state.reserved += 1;
            Place(self)
        })
    }

    /// Adds work that had a place before.
    pub(super) fn push_again(&self, work: T) {
        self.lock().waiting.push_back(work);
        self.changed.notify_one();
    }

    /// Waits for work, which runs until [`done`](Self::done); `None` once the queue is closed.
    pub(super) fn take(&self) -> Option<T> {
        let mut state = self.lock();
        loop {
            if state.is_closed {
                return None;
            }
            if let Some(work) = state.waiting.pop_front() {
                state.running += 1;
                return Some(work);
            }
            let changed = self.changed.wait(state);
            state = changed.unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// What was taken is done.
    pub(super) fn done(&self) {
        self.lock().running -= 1;
    }

    /// How much work runs.
    pub(super) fn running(&self) -> usize {
        self.lock().running
    }

    /// How much work waits.
    pub(super) fn len(&self) -> usize {
        self.lock().waiting.len()
    }

    /// Takes no more work, and drops what waits.
    pub(super) fn close(&self) {
        let mut state = self.lock();
        state.is_closed = true;
        state.waiting.clear();
        self.changed.notify_all();
    }

    /// Closes the queue at the end of a scope.
    pub(super) fn closing(&self) -> Closing<'_, T> {
        Closing(self)
    }

    fn lock(&self) -> MutexGuard<'_, State<T>> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<T> Place<'_, T> {
    /// Puts work into the place.
    pub(super) fn fill(self, work: T) {
        let mut state = self.0.lock();
        if !state.is_closed {
            state.waiting.push_back(work);
            self.0.changed.notify_one();
        }
    }
}

impl<T> Drop for Place<'_, T> {
    fn drop(&mut self) {
        self.0.lock().reserved -= 1;
    }
}

impl<T> Drop for Closing<'_, T> {
    fn drop(&mut self) {
        self.0.close();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_limited_and_free_again() {
        let queue = Queue::new(2);
        let first = queue.place().unwrap();
        let second = queue.place().unwrap();
        assert!(queue.place().is_none());
        drop(second);
        queue.place().unwrap().fill(2);
        first.fill(1);
        assert!(queue.place().is_none());
        assert_eq!((queue.take(), queue.len()), (Some(2), 1));
        assert_eq!(queue.running(), 1);
        queue.done();
        assert_eq!(queue.running(), 0);
        assert!(queue.place().is_some());
        queue.push_again(3);
        queue.close();
        assert_eq!(queue.take(), None);
        assert!(queue.place().is_none());
    }

    #[test]
    fn who_waits_is_told_of_the_end() {
        let queue: Queue<()> = Queue::new(1);
        std::thread::scope(|scope| {
            let waiting = scope.spawn(|| queue.take());
            drop(queue.closing());
            assert_eq!(waiting.join().unwrap(), None);
        });
    }
}
