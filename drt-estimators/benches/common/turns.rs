//! Times of contenders that take turns, so that what else the machine does meanwhile weighs on all.

use std::time::Instant;

/// Seconds of one contender, turn by turn.
#[derive(Clone, Debug, Default)]
pub(crate) struct Times(Vec<f64>);

impl Times {
    pub(crate) fn median(&self) -> f64 {
        median(self.0.iter().copied())
    }

    /// The median over the turns of this contender's time over another's.
    pub(crate) fn over(&self, other: &Self) -> f64 {
        median(self.0.iter().zip(&other.0).map(|(a, b)| a / b))
    }

    /// What is left, turn by turn, without `share` times what another contender takes.
    pub(crate) fn without(&self, share: f64, other: &Self) -> Self {
        Self(self.0.iter().zip(&other.0).map(|(a, b)| a - share * b).collect())
    }
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_unstable_by(f64::total_cmp);
    values[values.len() / 2]
}

/// What a contender does in its turn.
pub(crate) type Task<'a> = Box<dyn FnMut() + 'a>;

/// Lets each task run once a turn. A turn before the first fills caches and does not count.
pub(crate) fn take_turns<const N: usize>(turns: usize, mut tasks: [Task<'_>; N]) -> [Times; N] {
    let mut times = [const { Times(Vec::new()) }; N];
    run(turns, &mut tasks, &mut times);
    times
}

/// The same for any number of tasks.
#[allow(dead_code, reason = "not every bench has a list of contenders")]
pub(crate) fn take_turns_all(turns: usize, mut tasks: Vec<Task<'_>>) -> Vec<Times> {
    let mut times = vec![Times::default(); tasks.len()];
    run(turns, &mut tasks, &mut times);
    times
}

fn run(turns: usize, tasks: &mut [Task<'_>], times: &mut [Times]) {
    for turn in 0..=turns {
        for (task, times) in tasks.iter_mut().zip(&mut *times) {
            let start = Instant::now();
            task();
            if turn > 0 {
                times.0.push(start.elapsed().as_secs_f64());
            }
        }
    }
}
