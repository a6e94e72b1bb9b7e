//! Processes pieces in several threads and returns the results in the order of the pieces.

use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError, mpsc};

use super::error::PrepareError;
use rig_model::batch::each_by;

/// Maximum number of threads: the number of items in memory grows with it.
const MOST_THREADS: usize = 16;

/// Returns the number of threads to use; 0 means all processors.
pub fn threads(wanted: usize) -> usize {
    match wanted {
        0 => std::thread::available_parallelism().map_or(1, usize::from),
        n => n,
    }
    .min(MOST_THREADS)
}

/// Passes every item of `produce` to `work`, and the results to `take` in the order of the items.
///
/// `produce` and `take` run in the calling thread, `work` in `threads` others (in the calling thread if `threads` is
/// 1). At most `threads` items are in progress. The results do not depend on the number of threads if `work` depends
/// only on its argument.
///
/// By hand: no usual library of threads gives results in order while it holds a bounded number of items of a stream.
///
/// # Errors
/// The first error of `work` or `take` in the order of the items, otherwise that of `produce`.
pub(super) fn in_order<T: Send, R: Send>(
    threads: usize,
    produce: impl FnOnce(&mut dyn FnMut(T) -> Result<(), PrepareError>) -> Result<(), PrepareError>,
    work: &(dyn Fn(T) -> Result<R, PrepareError> + Sync),
    take: &mut dyn FnMut(R) -> Result<(), PrepareError>,
) -> Result<(), PrepareError> {
    if threads <= 1 {
        return produce(&mut |item| take(work(item)?));
    }
    let (items, source) = mpsc::channel::<(usize, T)>();
    let (results, done) = mpsc::channel();
    let source = Mutex::new(source);
    std::thread::scope(|scope| {
        for _ in 0..threads {
            let (source, results) = (&source, results.clone());
            scope.spawn(move || {
                loop {
                    // The lock is held while waiting for an item, not while working on it.
                    let next = source.lock().unwrap_or_else(PoisonError::into_inner).recv();
                    let Ok((number, item)) = next else { break };
                    if results.send((number, work(item))).is_err() {
                        break;
                    }
                }
            });
        }
        drop(results);
        let mut queue = Queue {
            done,
            early: BTreeMap::new(),
            sent: 0,
            taken: 0,
        };
        let result = produce(&mut |item| {
            while queue.sent - queue.taken >= threads {
                queue.take_next(take)?;
            }
            let number = queue.sent;
            queue.sent += 1;
            items.send((number, item)).map_err(|_| stopped())
        })
        .and_then(|()| {
            while queue.taken < queue.sent {
                queue.take_next(take)?;
            }
            Ok(())
        });
        // Ends the threads, which wait for nothing else.
        drop(items);
        result
    })
}

fn stopped() -> PrepareError {
    PrepareError::Stopped("A thread that prepares rows has ended early.".into())
}

/// Buffer for results that arrive out of order.
struct Queue<R> {
    done: mpsc::Receiver<(usize, Result<R, PrepareError>)>,
    early: BTreeMap<usize, Result<R, PrepareError>>,
    sent: usize,
    taken: usize,
}

impl<R> Queue<R> {
    fn take_next(
        &mut self,
        take: &mut dyn FnMut(R) -> Result<(), PrepareError>,
    ) -> Result<(), PrepareError> {
        loop {
            if let Some(result) = self.early.remove(&self.taken) {
                self.taken += 1;
                return take(result?);
            }
            let (number, result) = self.done.recv().map_err(|_| stopped())?;
            self.early.insert(number, result);
        }
    }
}

/// Calls `work` with the index of each item and the item, spread over `threads`.
pub fn each_of<T: Send>(threads: usize, items: &mut [T], work: &(dyn Fn(usize, &mut T) + Sync)) {
    // Each lock is taken once: it only proves that no two threads have the same item.
    let items: Vec<Mutex<&mut T>> = items.iter_mut().map(Mutex::new).collect();
    each_by(items.len(), threads, |k| {
        let mut item = items[k].lock().unwrap_or_else(PoisonError::into_inner);
        work(k, &mut item);
    });
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn squares(threads: usize, refuse: Option<usize>) -> (Vec<usize>, Result<(), PrepareError>) {
        let mut taken = Vec::new();
        let result = in_order(
            threads,
            |push| (0..100).try_for_each(push),
            &|k: usize| {
                // Later items finish earlier.
                std::thread::sleep(std::time::Duration::from_micros(
                    ((100 - k) * 7 % 50) as u64,
                ));
                if Some(k) == refuse {
                    return Err(PrepareError::Stopped(format!("item {k}")));
                }
                Ok(k * k)
            },
            &mut |square| {
                taken.push(square);
                Ok(())
            },
        );
        (taken, result)
    }

    #[test]
    fn results_come_in_order_and_end_at_the_first_error() {
        for threads in [1, 2, 5] {
            let (taken, result) = squares(threads, None);
            result.unwrap();
            assert_eq!(taken, (0..100).map(|k| k * k).collect::<Vec<_>>());
            let (taken, result) = squares(threads, Some(40));
            assert_eq!(result.unwrap_err().to_string(), "item 40");
            assert_eq!(taken.len(), 40);
        }
    }

    #[test]
    fn every_item_is_worked_on_once() {
        for threads in [1, 2, 9] {
            let mut items: Vec<usize> = vec![1; 50];
            each_of(threads, &mut items, &|k, item| *item += k);
            assert_eq!(items, (1..51).collect::<Vec<_>>());
        }
    }
}
