//! A stream that repeats each value until the next one comes, as a table at a higher rate than the simulator's does.
//!
//! Taken as it is, every change would seem late by half of the time that a value is held, and in steps. The first row of
//! each value is kept, the others are left out.

use std::borrow::Cow;

use crate::{
    diagnosis::screening::held_values::held,
    recording::{Simulated, Stream},
};

/// The stream without repeated values, and what a reader ought to know.
pub fn fresh(stream: &Stream) -> (Cow<'_, Stream>, Option<String>) {
    let Some(found) = held(stream.time.len(), &|row| stream.values.is_repeated(row)) else {
        return (Cow::Borrowed(stream), None);
    };
    let mut repeated = found.repeated.iter().peekable();
    let kept: Vec<usize> =
        (0..stream.time.len()).filter(|row| repeated.next_if(|next| *next == row).is_none()).collect();
    let thinned = Stream {
        name: stream.name.clone(),
        time: kept.iter().map(|row| stream.time[*row]).collect(),
        values: Simulated::at(&stream.values, &kept),
    };
    let remark = format!(
        "{}: each value of the stream stands in {:.0} rows, expected a new one in each; the first row of each is \
         used, the others are left out; export the simulator's samples at their own rate",
        stream.name, found.rows
    );
    (Cow::Owned(thinned), Some(remark))
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;

    fn stream(value: impl Fn(usize) -> f64) -> Stream {
        Stream {
            name: "sim".to_owned(),
            time: (0..1000).map(|k| 0.01 * k as f64).collect(),
            values: Simulated {
                gyr: Some((0..1000).map(|k| Vector3::repeat(value(k))).collect()),
                ..Simulated::default()
            },
        }
    }

    #[test]
    fn repeated_values_are_used_once() {
        let held = stream(|k| (k / 4 * 4) as f64);
        let (thinned, remark) = fresh(&held);
        assert_eq!((thinned.time.len(), thinned.time[1]), (250, 0.04));
        assert!(remark.unwrap().contains("stands in 4 rows"));
    }

    #[test]
    fn a_machine_at_rest_repeats_nothing() {
        let rests = stream(|k| if k < 700 { 0.0 } else { k as f64 });
        let (same, remark) = fresh(&rests);
        assert_eq!((&*same, remark), (&rests, None));
        assert_eq!(fresh(&stream(|_| 0.0)).1, None);
    }
}
