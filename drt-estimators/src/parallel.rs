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

    /// Calls `work` on each item and `merge` on the results in the items' order. `wave` bounds how
    /// many results exist at once, per thread. Stops early when `merge` returns false.
    pub(crate) fn ordered<R: Send>(
        &self,
        items: core::ops::Range<u32>,
        wave: u32,
        work: impl Fn(u32) -> R + Sync,
        mut merge: impl FnMut(u32, R) -> bool,
    ) -> bool {
        #[cfg(feature = "parallel")]
        if let Some(pool) = &self.pool
            && pool.current_num_threads() > 1
        {
            use rayon::prelude::*;
            let step = wave.saturating_mul(pool.current_num_threads() as u32).max(1);
            let mut start = items.start;
            while start < items.end {
                let end = u32::min(items.end, start.saturating_add(step));
                let results: alloc::vec::Vec<R> =
                    pool.install(|| (start..end).into_par_iter().map(&work).collect());
                for (i, r) in results.into_iter().enumerate() {
                    if !merge(start + i as u32, r) {
                        return false;
                    }
                }
                start = end;
            }
            return true;
        }
        let _ = wave;
        for i in items {
            if !merge(i, work(i)) {
                return false;
            }
        }
        true
    }
}
