//! Samples come in order, and are the same whoever made them.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod common;

use net::sample::Sample;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};
use train::TrainError;
use train::data::{Augment, SampleOptions, Sampler};
use train::feed::Feed;

fn samples(threads: usize, first: u64, count: usize) -> Vec<Sample> {
    let set = common::rooms(3, 16, 80, 60);
    let options = SampleOptions {
        views: [4; 2],
        size: [64, 48],
        crop: [32, 32, 16],
        augment: Augment::default(),
        ..common::plain(9)
    };
    let mut feed = Feed::start(threads, 5, first, move || {
        let mut sampler = Sampler::new(set.clone(), options);
        move |number| sampler.sample(number)
    })
    .unwrap();
    (0..count).map(|_| feed.take().unwrap()).collect()
}

fn same(a: &Sample, b: &Sample) -> bool {
    a.views == b.views
        && a.images == b.images
        && a.depth_m == b.depth_m
        && a.truth.tsdf == b.truth.tsdf
        && a.truth.occupied == b.truth.occupied
        && a.truth.supervised == b.truth.supervised
}

#[test]
fn threads_and_the_start_make_no_difference() {
    let one = samples(1, 0, 10);
    let four = samples(4, 0, 10);
    let later = samples(3, 6, 4);
    for (i, (a, b)) in one.iter().zip(&four).enumerate() {
        assert!(
            same(a, b),
            "sample {i} differs between one and four threads"
        );
    }
    for (a, b) in one[6..].iter().zip(&later) {
        assert!(same(a, b), "a sample differs after a resume");
    }
    assert!(!same(&one[0], &one[3]), "samples repeat");
    assert_eq!(one[0].views.len(), 4);
    assert_eq!(one[0].images.len(), 4 * 3 * 64 * 48);
    assert_eq!(one[0].depth_m.len(), 4 * 64 * 48);
}

#[test]
fn every_scan_comes_once_a_round() {
    let sampler = Sampler::new(common::rooms(3, 4, 32, 24), common::plain(1));
    for round in 0..5 {
        let mut scans: Vec<usize> = (3 * round..3 * round + 3)
            .map(|n| sampler.scan_of(n))
            .collect();
        scans.sort_unstable();
        assert_eq!(scans, [0, 1, 2]);
    }
}

#[test]
fn no_more_is_made_ahead_than_asked_and_waiting_is_measured() {
    let made = Arc::new(AtomicU64::new(0));
    let counted = made.clone();
    let mut feed = Feed::start(4, 6, 0, move || {
        let counted = counted.clone();
        move |number| {
            counted.fetch_add(1, Ordering::SeqCst);
            // Later items are faster: the order must hold all the same.
            std::thread::sleep(Duration::from_millis(20 - number.min(20)));
            Ok(number)
        }
    })
    .unwrap();
    let started = Instant::now();
    while made.load(Ordering::SeqCst) < 6 && started.elapsed() < Duration::from_secs(30) {
        std::thread::sleep(Duration::from_millis(5));
    }
    // Time for a seventh, which must not come.
    std::thread::sleep(Duration::from_millis(200));
    assert_eq!(made.load(Ordering::SeqCst), 6);
    let handed: Vec<u64> = (0..20).map(|_| feed.take().unwrap()).collect();
    assert_eq!(handed, (0..20).collect::<Vec<u64>>());
    assert_eq!(feed.handed_out(), 20);
    assert!(feed.waited() > Duration::ZERO);
    assert!(feed.mean_making() >= Duration::from_millis(5));
    drop(feed);
    assert!(made.load(Ordering::SeqCst) <= 26);
}

#[test]
fn a_fault_is_handed_on_in_its_turn_and_a_broken_thread_is_noticed() {
    let mut feed = Feed::start(3, 4, 0, || {
        |number| match number {
            2 => Err(TrainError::Worker),
            _ => Ok(number),
        }
    })
    .unwrap();
    assert_eq!(feed.take().unwrap(), 0);
    assert_eq!(feed.take().unwrap(), 1);
    assert!(feed.take().is_err());
    assert_eq!(feed.take().unwrap(), 3);

    let mut broken = Feed::start(1, 4, 0, || {
        |number: u64| {
            assert!(number < 1, "this thread is meant to break off");
            Ok(number)
        }
    })
    .unwrap();
    assert_eq!(broken.take().unwrap(), 0);
    assert!(matches!(broken.take(), Err(TrainError::Worker)));
}

#[test]
fn a_crop_may_be_larger_than_the_scan() {
    let options = SampleOptions {
        crop: [400, 48, 32],
        ..common::plain(1)
    };
    let mut sampler = Sampler::new(common::rooms(1, 8, 80, 60), options);
    let truth = sampler.sample(0).unwrap().truth;
    // Outside there are neither surfaces nor free space; a column without either counts as empty.
    let fine: Vec<(f32, bool)> = truth
        .tsdf
        .into_iter()
        .zip(truth.supervised[2].clone())
        .collect();
    let outside = (0..48 * 32)
        .map(|row| fine[400 * row])
        .filter(|(value, _)| *value == -1.0);
    let known = outside.clone().filter(|(_, known)| *known);
    assert!(outside.count() == 48 * 32 && known.count() == 48 * 32);
    assert!(fine.iter().any(|(value, _)| value.abs() < 0.5));
}

#[test]
fn samples_have_as_many_views_as_asked_or_any_number_between() {
    let options = SampleOptions {
        views: [2, 5],
        ..common::plain(1)
    };
    let mut sampler = Sampler::new(common::rooms(1, 8, 80, 60), options);
    let mut counts: Vec<usize> = (0..40)
        .map(|number| sampler.sample(number).unwrap().views.len())
        .collect();
    counts.sort_unstable();
    counts.dedup();
    assert_eq!(counts, [2, 3, 4, 5]);
}
