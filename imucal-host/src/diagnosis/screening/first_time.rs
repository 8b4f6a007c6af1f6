//! Times that begin far from zero, as those of a clock that has run for hours do.
//!
//! Instants, half-waves of the time and the parts of a jackknife are sought between zero and the last row, and drifts and rates are those
//! since zero. Times that begin elsewhere are therefore moved, and a remark says from where on they are counted.

use std::borrow::Cow;

use crate::recording::{Recording, Stream};

/// Times that begin further from zero are moved, s.
const FAR: f64 = 1.0;

/// A recording and its simulator's stream with times since the recording's first row, and a remark; the stream is `None` where nothing was
/// moved, or there is none.
pub fn from_zero<'r>(
    mut recording: Cow<'r, Recording>,
    stream: Option<&Stream>,
) -> (Cow<'r, Recording>, Option<Stream>, Option<String>) {
    let first = recording.time.first().copied().unwrap_or(0.0);
    if first.abs() <= FAR {
        return (recording, None, None);
    }
    recording.to_mut().time.iter_mut().for_each(|time| *time -= first);
    let stream = stream.map(|stream| {
        let time = stream.time.iter().map(|time| time - first).collect();
        Stream { time, ..stream.clone() }
    });
    let remark = format!("times are counted from the first row on, at {first} s");
    (recording, stream, Some(remark))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::Manifest;

    #[test]
    fn times_that_begin_far_from_zero_are_moved_with_the_stream_and_others_are_not() {
        let at = |first: f64| {
            let time = (0..10).map(|row| first + 0.01 * f64::from(row)).collect();
            Recording::new("late.csv", Manifest::default(), time)
        };
        let stream = Stream { name: String::new(), time: vec![20_000.5], values: Default::default() };
        let late = at(20_000.0);
        let (moved, streamed, remark) = from_zero(Cow::Borrowed(&late), Some(&stream));
        assert!(moved.time[0] == 0.0 && (moved.time[9] - 0.09).abs() < 1e-9);
        assert_eq!(streamed.map(|stream| stream.time), Some(vec![0.5]));
        assert!(remark.is_some_and(|remark| remark.contains("20000 s")));
        let early = at(0.03);
        let (same, streamed, remark) = from_zero(Cow::Borrowed(&early), Some(&stream));
        assert!(same.time == early.time && streamed.is_none() && remark.is_none());
    }
}
