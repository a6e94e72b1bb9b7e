#![allow(clippy::unwrap_used, clippy::panic)]

use std::vec::Vec;

use proptest::prelude::*;

use super::super::Batcher;
use super::super::message::StateSample;
use super::*;

const DECIMATION: u16 = 10;

fn sample(window: u64) -> StateSample {
    StateSample {
        position_sum: window as i64,
        ..StateSample::default()
    }
}

/// Returns a stream of `windows` windows from tick `first_tick`. The rig has no sample where `skipped`, and no room in
/// its queue for batch b where `refused`.
fn stream(
    first_tick: u64,
    windows: u64,
    skipped: impl Fn(u64) -> bool,
    refused: impl Fn(u32) -> bool,
) -> (Vec<Batch>, StreamEnd) {
    let mut batcher = Batcher::new();
    batcher.start(first_tick, DECIMATION);
    let mut batches = Vec::new();
    let mut offer = |batcher: &mut Batcher, batch: Option<Batch>| {
        if let Some(batch) = batch {
            if refused(batch.sequence) {
                batcher.refused(&batch);
            } else {
                batches.push(batch);
            }
        }
    };
    for window in 0..windows {
        if skipped(window) {
            batcher.skip();
        } else {
            let batch = batcher.push(sample(window));
            offer(&mut batcher, batch);
        }
    }
    let last = batcher.close();
    offer(&mut batcher, last);
    assert_eq!(batcher.end(), batcher.end());
    (batches, batcher.end())
}

/// Passes batches to a reassembly; returns the received and the missing windows.
fn reassemble(
    first_tick: u64,
    batches: &[Batch],
    end: &StreamEnd,
) -> (Vec<u64>, Vec<u64>, LossCounts) {
    let mut reassembly = Reassembly::new(DECIMATION);
    let window_of = |tick: u64| {
        assert_eq!((tick - first_tick) % u64::from(DECIMATION), 0);
        (tick - first_tick) / u64::from(DECIMATION)
    };
    let mut came = Vec::new();
    let mut missing = Vec::new();
    let mut note = |gap: Option<Gap>| {
        if let Some(gap) = gap {
            let first = window_of(gap.first_tick);
            missing.extend(first..first + gap.missing);
        }
    };
    for batch in batches {
        if let Ok(gap) = reassembly.accept(batch) {
            note(gap);
            for (k, sample) in batch.samples.iter().enumerate() {
                let window = window_of(batch.first_tick) + k as u64;
                assert_eq!(sample.position_sum, window as i64);
                came.push(window);
            }
        }
    }
    note(reassembly.finish(end).unwrap());
    (came, missing, reassembly.counts())
}

fn assert_exact(first_tick: u64, windows: u64, kept: &[Batch], end: &StreamEnd) {
    let (came, missing, counts) = reassemble(first_tick, kept, end);
    let expected: Vec<u64> = kept
        .iter()
        .flat_map(|batch| {
            batch
                .samples
                .iter()
                .map(|sample| sample.position_sum as u64)
        })
        .collect();
    assert_eq!(came, expected);
    let mut all: Vec<u64> = came.iter().chain(&missing).copied().collect();
    all.sort_unstable();
    assert_eq!(
        all,
        (0..windows).collect::<Vec<_>>(),
        "each window is either here or called missing"
    );
    assert_eq!(
        (counts.received, counts.missing),
        (came.len() as u64, missing.len() as u64)
    );
    assert_eq!(end.samples + end.dropped, windows);
}

proptest! {
    #[test]
    fn what_is_missing_is_named_exactly(
        first_tick in 0_u64..1_000_000,
        windows in 0_u64..400,
        lost in prop::collection::vec(any::<bool>(), 64),
        refused in prop::collection::vec(prop::bool::weighted(0.1), 64),
        skipped in prop::collection::vec(prop::bool::weighted(0.02), 400),
    ) {
        let (batches, end) = stream(first_tick, windows, |w| skipped[w as usize], |b| refused[b as usize]);
        prop_assert_eq!(end.batches as usize, batches.len());
        let kept: Vec<Batch> = batches.into_iter().filter(|batch| !lost[batch.sequence as usize]).collect();
        assert_exact(first_tick, windows, &kept, &end);
    }

    #[test]
    fn duplicates_and_late_batches_change_nothing(order in prop::collection::vec(0_usize..30, 0..120)) {
        let (batches, end) = stream(77, 237, |_| false, |_| false);
        let line: Vec<Batch> = order.iter().map(|k| batches[*k].clone()).collect();
        let (came, missing, counts) = reassemble(77, &line, &end);
        prop_assert!(came.is_sorted_by(|a, b| a < b));
        let mut all: Vec<u64> = came.iter().chain(&missing).copied().collect();
        all.sort_unstable();
        prop_assert_eq!(all, (0..237).collect::<Vec<_>>());
        let repeated = order.iter().enumerate().filter(|(k, b)| {
            // The batch was received before, and was the newest then.
            order[..*k].iter().position(|one| one == *b).is_some_and(|first| order[..first].iter().all(|one| one < b))
        }).count() as u64;
        prop_assert_eq!(counts.duplicates, repeated);
        prop_assert_eq!(counts.batches + counts.duplicates + counts.late, order.len() as u64);
    }
}

#[test]
fn a_stream_lost_whole_is_missing_whole_and_placed() {
    let (_, end) = stream(1234, 100, |_| false, |_| false);
    let mut reassembly = Reassembly::new(DECIMATION);
    let gap = reassembly.finish(&end);
    assert_eq!(
        gap,
        Ok(Some(Gap {
            first_tick: 1234,
            missing: 100
        }))
    );
}

#[test]
fn the_number_wraps_and_counting_goes_on() {
    let mut reassembly = Reassembly::new(DECIMATION);
    let origin = 50;
    let batch = |number: u64| Batch {
        sequence: number as u32,
        first_tick: origin + number * BATCH as u64 * u64::from(DECIMATION),
        samples: core::iter::repeat_n(StateSample::default(), BATCH).collect(),
    };
    let span = 1_u64 << 32;
    for number in [0, 1 << 30, 1 << 31, 3 << 30, span - 1, span, span + 2] {
        assert!(reassembly.accept(&batch(number)).is_ok(), "{number}");
    }
    assert_eq!(reassembly.accept(&batch(span + 1)), Err(BatchRefusal::Late));
    assert_eq!(
        reassembly.accept(&batch(span)),
        Err(BatchRefusal::Duplicate)
    );
    assert_eq!(reassembly.counts().missing, (span + 3 - 7) * BATCH as u64);
}

#[test]
fn contradictions_are_refused() {
    let (batches, end) = stream(500, 80, |_| false, |_| false);
    let mut reassembly = Reassembly::new(DECIMATION);
    assert_eq!(reassembly.accept(&batches[0]), Ok(None));
    let mut shifted = batches[1].clone();
    shifted.first_tick += 1;
    assert_eq!(reassembly.accept(&shifted), Err(BatchRefusal::Inconsistent));
    let mut empty = batches[1].clone();
    empty.samples.clear();
    assert_eq!(reassembly.accept(&empty), Err(BatchRefusal::Inconsistent));
    assert_eq!(reassembly.accept(&batches[1]), Ok(None));
    let other = StreamEnd { samples: 8, ..end };
    assert_eq!(
        reassembly.finish(&other),
        Err(EndMismatch {
            announced: 8,
            seen: 16
        })
    );
    assert!(
        reassembly
            .finish(&StreamEnd {
                first_tick: 501,
                ..end
            })
            .is_err()
    );
    assert_eq!(
        reassembly.finish(&end),
        Ok(Some(Gap {
            first_tick: 660,
            missing: 64
        }))
    );
    let first_batch_before_time_began = Batch {
        first_tick: 3,
        ..batches[5].clone()
    };
    assert_eq!(
        Reassembly::new(DECIMATION).accept(&first_batch_before_time_began),
        Err(BatchRefusal::Inconsistent)
    );
}
