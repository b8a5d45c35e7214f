//! Layouts that tie pictures and poses together by time: lists of times, the nearest partner, poses in between.

use glam::DAffine3;

use crate::finding::{Finding, FindingLog, Severity};
use crate::numbers::{Number, lines, words};
use crate::pose;

/// Pictures and poses further apart than this are not of one moment.
pub(super) const MAX_DIFFERENCE_S: f64 = 0.02;
/// Poses further apart than this are not interpolated.
const MAX_GAP_S: f64 = 0.1;

/// Something with a time in seconds.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Timed<T> {
    pub time_s: f64,
    pub value: T,
}

fn bad_line(file: &str, line: u32, expected: &str, found: String) -> Finding {
    Finding::new(Severity::Error, "line-broken")
        .at(file)
        .line(line)
        .expected(expected)
        .found(found)
        .advice("The line is left out; correct or remove it")
}

fn sort<T>(list: &mut [Timed<T>]) {
    list.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
}

fn excerpt(line: &str) -> String {
    format!("\"{}\"", line.chars().take(60).collect::<String>())
}

/// `time path` a line; with two pairs a line (associations) the one at `column`, 0 or 1. The value is the path with
/// its line.
pub(super) fn pictures(
    file: &str,
    text: &str,
    column: usize,
    log: &mut FindingLog,
) -> Vec<Timed<(String, u32)>> {
    let mut list = Vec::new();
    for (number, line) in lines(text) {
        let mut words = words(line).skip(2 * column);
        let time_s = words.next().and_then(|word| word.parse::<f64>().ok());
        match (time_s.filter(|time| time.is_finite()), words.next()) {
            (Some(time_s), Some(path)) => list.push(Timed {
                time_s,
                value: (path.trim_start_matches("./").replace('\\', "/"), number),
            }),
            _ => log.add(bad_line(
                file,
                number,
                "a time and a picture's path",
                excerpt(line),
            )),
        }
    }
    sort(&mut list);
    list
}

/// `time tx ty tz qx qy qz qw` a line.
pub(super) fn trajectory(file: &str, text: &str, log: &mut FindingLog) -> Vec<Timed<DAffine3>> {
    let mut list = Vec::new();
    for (line, content) in lines(text) {
        let values: Option<Vec<Number>> = words(content)
            .map(|word| word.parse().ok().map(|value| Number { value, line }))
            .collect();
        let Some(Ok([time, pose @ ..])) = values.map(<[Number; 8]>::try_from) else {
            log.add(bad_line(
                file,
                line,
                "8 numbers: time tx ty tz qx qy qz qw",
                excerpt(content),
            ));
            continue;
        };
        match pose::from_quaternion(file, &pose) {
            Ok(value) if time.value.is_finite() => list.push(Timed {
                time_s: time.value,
                value,
            }),
            Ok(_) => log.add(bad_line(
                file,
                line,
                "a finite time",
                time.value.to_string(),
            )),
            Err(finding) => {
                log.add(finding.advice("The line is left out; poses around it are used instead"));
            }
        }
    }
    sort(&mut list);
    list
}

/// Index of the entry nearest in time, if within `MAX_DIFFERENCE_S`.
fn nearest<T>(list: &[Timed<T>], time_s: f64) -> Option<usize> {
    let after = list.partition_point(|entry| entry.time_s < time_s);
    let distance = |index: usize| (list[index].time_s - time_s).abs();
    let index = [
        after.checked_sub(1),
        Some(after).filter(|&i| i < list.len()),
    ]
    .into_iter()
    .flatten()
    .min_by(|&a, &b| distance(a).total_cmp(&distance(b)))?;
    (distance(index) <= MAX_DIFFERENCE_S).then_some(index)
}

/// The partner of each entry of `list` in `others`: two are partners when each is the nearest of the other.
pub(super) fn partners<T, U>(list: &[Timed<T>], others: &[Timed<U>]) -> Vec<Option<usize>> {
    let pair = |(index, entry): (usize, &Timed<T>)| {
        let other = nearest(others, entry.time_s)?;
        (nearest(list, others[other].time_s) == Some(index)).then_some(other)
    };
    list.iter().enumerate().map(pair).collect()
}

/// The pose at a time: between two neighbours at most 0.1 s apart (translation linear, rotation spherical), else
/// the nearest within 20 ms.
pub(super) fn pose_at(trajectory: &[Timed<DAffine3>], time_s: f64) -> Option<DAffine3> {
    let after = trajectory.partition_point(|entry| entry.time_s <= time_s);
    let around = after
        .checked_sub(1)
        .map(|i| &trajectory[i])
        .zip(trajectory.get(after));
    if let Some((before, after)) = around
        && after.time_s - before.time_s <= MAX_GAP_S
    {
        let t = (time_s - before.time_s) / (after.time_s - before.time_s);
        let (_, from, start) = before.value.to_scale_rotation_translation();
        let (_, to, end) = after.value.to_scale_rotation_translation();
        return Some(DAffine3::from_rotation_translation(
            from.slerp(to, t),
            start.lerp(end, t),
        ));
    }
    nearest(trajectory, time_s).map(|index| trajectory[index].value)
}
