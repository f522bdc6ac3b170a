//! Work that is shared among threads.

/// Calls `work` with each of the workers and its number, each on a thread of its own.
pub(crate) fn for_each_worker<W: Send>(workers: &mut [W], work: &(impl Fn(&mut W, usize) + Sync)) {
    fn from<W: Send>(first: usize, workers: &mut [W], work: &(impl Fn(&mut W, usize) + Sync)) {
        if let [worker] = workers {
            return work(worker, first);
        }
        let half = workers.len() / 2;
        let (some, others) = workers.split_at_mut(half);
        rayon::join(
            || from(first, some, work),
            || from(first + half, others, work),
        );
    }
    if !workers.is_empty() {
        from(0, workers, work);
    }
}
