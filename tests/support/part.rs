//! A part of a recording.

use std::ops::Range;

use imucal_host::recording::Recording;

/// Some rows of a recording, its time from zero.
pub fn part(recording: &Recording, rows: Range<usize>) -> Recording {
    let mut part = recording.clone();
    let start = recording.time[rows.start];
    part.time = recording.time[rows.clone()].iter().map(|time| time - start).collect();
    for triple in [&mut part.acc, &mut part.gyr, &mut part.mag].into_iter().flatten() {
        triple.values = triple.values[rows.clone()].to_vec();
    }
    for rows_of in [&mut part.temperature].into_iter().flatten() {
        *rows_of = rows_of[rows.clone()].to_vec();
    }
    part.reference = recording.reference.as_ref().map(|reference| reference[rows.clone()].to_vec());
    part.position = recording.position.as_ref().map(|position| position[rows].to_vec());
    part.extra.clear();
    part
}
