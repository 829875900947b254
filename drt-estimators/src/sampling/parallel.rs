//! Work in parallel whose results are merged in order, so that the bits do not depend on the number
//! of threads.

/// Where work runs.
pub(crate) struct Pool {
    #[cfg(feature = "parallel")]
    pool: Option<rayon::ThreadPool>,
}

impl Pool {
    /// A pool of `threads` threads; 0 takes all cores.
    pub(crate) fn new(threads: usize) -> Self {
        #[cfg(not(feature = "parallel"))]
        {
            let _ = threads;
            Self {}
        }
        #[cfg(feature = "parallel")]
        {
            // Without a pool the work still gets done, on this thread.
            Self { pool: rayon::ThreadPoolBuilder::new().num_threads(threads).build().ok() }
        }
    }

    /// Calls `work` on each item and, on this thread, `merge` on the results in the items' order.
    /// `ahead` bounds how many results wait for their turn, per thread. Stops early when `merge`
    /// returns false.
    pub(crate) fn ordered<R: Send>(
        &self,
        items: core::ops::Range<u32>,
        ahead: u32,
        work: impl Fn(u32) -> R + Sync,
        mut merge: impl FnMut(u32, R) -> bool,
    ) -> bool {
        #[cfg(feature = "parallel")]
        if let Some(pool) = &self.pool
            && pool.current_num_threads() > 1
        {
            return queue::ordered(pool, items, ahead, &work, &mut merge);
        }
        let _ = ahead;
        for i in items {
            if !merge(i, work(i)) {
                return false;
            }
        }
        true
    }
}

#[cfg(feature = "parallel")]
mod queue {
    use std::collections::BTreeMap;
    use std::ops::Range;
    use std::sync::mpsc::{Receiver, channel};
    use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

    /// Which items are taken, and which may be.
    struct Queue {
        state: Mutex<State>,
        changed: Condvar,
    }

    #[derive(Clone, Copy)]
    struct State {
        next: u32,
        end: u32,
        /// Items from here on must wait until others are merged.
        limit: u32,
    }

    impl Queue {
        fn state(&self) -> MutexGuard<'_, State> {
            // What a panic of another thread left is still a state.
            self.state.lock().unwrap_or_else(PoisonError::into_inner)
        }

        /// Takes an item, as soon as one may be; `None` when there is none left.
        fn take(&self) -> Option<u32> {
            let waits = |s: &mut State| s.next < s.end && s.next >= s.limit;
            let waited = self.changed.wait_while(self.state(), waits);
            let mut state = waited.unwrap_or_else(PoisonError::into_inner);
            let item = (state.next < state.end).then_some(state.next);
            state.next += u32::from(item.is_some());
            item
        }

        fn change(&self, f: impl FnOnce(&mut State)) {
            f(&mut self.state());
            self.changed.notify_all();
        }
    }

    /// Lets no thread wait for ever if this one ends early, for whatever reason.
    struct Closed<'a>(&'a Queue);
    impl Drop for Closed<'_> {
        fn drop(&mut self) {
            self.0.change(|s| s.end = s.next);
        }
    }

    /// No thread waits for another as long as there is work: items are taken one by one.
    pub(super) fn ordered<R: Send>(
        pool: &rayon::ThreadPool,
        items: Range<u32>,
        ahead: u32,
        work: &(impl Fn(u32) -> R + Sync),
        merge: &mut impl FnMut(u32, R) -> bool,
    ) -> bool {
        let threads = pool.current_num_threads();
        let limit = items.start.saturating_add(ahead.max(1).saturating_mul(threads as u32));
        let state = State { next: items.start, end: items.end, limit };
        let queue = Queue { state: Mutex::new(state), changed: Condvar::new() };
        let (results, finished) = channel();
        pool.in_place_scope(|scope| {
            for _ in 0..threads {
                let (results, queue) = (results.clone(), &queue);
                scope.spawn(move |_| {
                    let _closed = Closed(queue);
                    while let Some(i) = queue.take() {
                        // Nobody listens any more after the merging has ended.
                        let _ = results.send((i, work(i)));
                    }
                });
            }
            drop(results);
            let _closed = Closed(&queue);
            merge_in_order(&queue, items, &finished, merge)
        })
    }

    fn merge_in_order<R>(
        queue: &Queue,
        items: Range<u32>,
        finished: &Receiver<(u32, R)>,
        merge: &mut impl FnMut(u32, R) -> bool,
    ) -> bool {
        let mut waiting = BTreeMap::new();
        for expected in items {
            let result = loop {
                if let Some(result) = waiting.remove(&expected) {
                    break result;
                }
                // Only a panic ends the sending early; it goes on when the scope ends.
                let Ok((i, result)) = finished.recv() else { return false };
                waiting.insert(i, result);
            };
            if !merge(expected, result) {
                return false;
            }
            queue.change(|s| s.limit = s.limit.saturating_add(1));
        }
        true
    }
}

#[cfg(all(test, feature = "parallel"))]
mod tests {
    use std::sync::atomic::{AtomicU32, Ordering::SeqCst};
    use std::vec::Vec;

    use super::Pool;

    /// Takes longer for some.
    fn slowly(i: u32) -> u32 {
        let pause = std::time::Duration::from_micros(u64::from(i * 7919 % 13) * 50);
        std::thread::sleep(pause);
        i * i
    }

    #[test]
    fn results_come_in_order_and_not_too_early() {
        for threads in [1, 2, 5] {
            let pool = Pool::new(threads);
            let (begun, mut merged) = (AtomicU32::new(0), Vec::new());
            let work = |i| {
                begun.fetch_add(1, SeqCst);
                slowly(i)
            };
            let done = pool.ordered(3..103, 2, work, |i, r| {
                assert!(begun.load(SeqCst) <= merged.len() as u32 + 2 * threads as u32);
                merged.push((i, r));
                true
            });
            assert!(done && merged == (3..103).map(|i| (i, i * i)).collect::<Vec<_>>());
        }
    }

    #[test]
    fn stops_when_told() {
        let pool = Pool::new(4);
        let begun = AtomicU32::new(0);
        let work = |i| {
            begun.fetch_add(1, SeqCst);
            slowly(i)
        };
        assert!(!pool.ordered(0..1000, 3, work, |i, _| i < 20));
        assert!(begun.load(SeqCst) <= 20 + 1 + 3 * 4);
    }

    #[test]
    #[should_panic(expected = "of item 7")]
    fn a_panic_is_passed_on() {
        let work = |i| if i == 7 { panic!("of item {i}") } else { slowly(i) };
        Pool::new(3).ordered(0..1000, 1, work, |_, _| true);
    }
}
